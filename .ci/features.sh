#!/usr/bin/env bash
# Compiles the library with each useful set of features, with the oldest supported Rust. Counts the
# crates that a library with queries alone depends on.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh
. .ci/oldest.sh

# Each format alone takes minutes for the crates that read it, and has few conditions in the code.
for set in "" parallel collide collide,parallel encode encode,collide encode,parallel gltf,collide threemf encode,collide,parallel,gltf,threemf,gmsh; do
    check -p tesdf --no-default-features --features "$set"
done

most=21
found=$(cargo tree -p tesdf --no-default-features -e normal --prefix none --no-dedupe | sed 's/ (.*//' | sort -u | wc -l)
echo "a library that only queries: $found crates"
if [ "$found" -gt "$most" ]; then
    echo "error: $found crates; expected at most $most" >&2
    exit 1
fi

#!/usr/bin/env bash
# Compiles the library with each useful set of features, and tests the error message of a tool that
# was built without the GPU. Counts the crates that a library with queries alone depends on.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh

for set in "" parallel collide collide,parallel encode encode,collide encode,parallel gltf threemf vtu gmsh gltf,collide threemf,vtu encode,collide,parallel,gltf,threemf,vtu,gmsh; do
    RUSTFLAGS="-D warnings" step cargo check --quiet --lib -p tesdf --no-default-features --features "$set" --target-dir target/features
done
# Not optimised: one test of an error message.
CARGO_PROFILE_TEST_OPT_LEVEL=0 step cargo test --quiet --lib -p tesdf-terminal device --target-dir target/features

most=20
found=$(cargo tree -p tesdf --no-default-features -e normal --prefix none --no-dedupe | sed 's/ (.*//' | sort -u | wc -l)
echo "a library that only queries: $found crates"
if [ "$found" -gt "$most" ]; then
    echo "error: $found crates; expected at most $most" >&2
    exit 1
fi

#!/usr/bin/env bash
# Compiles the queries and contacts of the library for 64-bit ARM, where the kernels use portable
# lanes. Reading meshes is left out: it would need a C compiler for ARM. Rustup installs the target
# if it is missing. Without rustup or its server, a warning says so.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh

target=aarch64-unknown-linux-gnu
if ! rustup target add "$target" >/dev/null 2>&1; then
    echo "warning: the target $target could not be installed; ARM is not tested" >&2
    exit 0
fi
RUSTFLAGS="-D warnings" step "ARM" cargo check --quiet --lib -p tesdf --no-default-features --features collide,parallel \
    --target "$target" --target-dir target/arm

#!/usr/bin/env bash
# Compiles everything but the GPU's crate with the oldest Rust that is supported (`rust-version` in Cargo.toml), which rustup installs where it is
# missing. Where neither rustup nor its server is there, a warning says so; clippy still checks the versions of the standard library's
# items.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh

version=$(sed -n 's/^rust-version = "\(.*\)"$/\1/p' Cargo.toml)
if ! cargo "+$version" --version >/dev/null 2>&1; then
    if ! rustup toolchain install "$version" --profile minimal --no-self-update >/dev/null 2>&1; then
        echo "warning: Rust $version could not be installed; the oldest supported Rust is not tested" >&2
        exit 0
    fi
fi
step cargo "+$version" check --quiet --workspace --exclude tesdf-gpu --target-dir target/msrv

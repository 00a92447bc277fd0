#!/usr/bin/env bash
# Compiles all crates except the GPU's with the oldest supported Rust (`rust-version` in
# Cargo.toml). Rustup installs this version if it is missing. Without rustup or its server, a
# warning says so; clippy still checks since which version each item of the standard library exists.
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

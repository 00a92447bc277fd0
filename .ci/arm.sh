#!/usr/bin/env bash
# Compiles the queries and contacts of the library for 64-bit ARM, where the kernels use portable
# lanes. Reading meshes is left out: it would need a C compiler for ARM. Rustup installs the target
# if it is missing. Without rustup or its server, a warning says so.
#
# `--run` instead compiles the whole library and dynamics, with a C compiler for ARM, and compares
# their bytes with the table of all platforms, in the emulator QEMU.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh

target=aarch64-unknown-linux-gnu
if ! rustup target add "$target" >/dev/null 2>&1; then
    echo "warning: the target $target could not be installed; ARM is not tested" >&2
    exit 0
fi
if [ "${1:-}" = --run ]; then
    if ! command -v qemu-aarch64-static >/dev/null || ! command -v aarch64-linux-gnu-gcc >/dev/null; then
        needed="qemu-user-static gcc-aarch64-linux-gnu libc6-dev-arm64-cross"
        { apt-get install --quiet --yes --no-install-recommends $needed ||
            { apt-get update --quiet && apt-get install --quiet --yes --no-install-recommends $needed; }; } >/dev/null 2>&1 || {
            echo "error: the emulator and the C compiler for ARM could not be installed" >&2
            echo "hint: on Debian or Ubuntu, as root: apt-get install $needed" >&2
            exit 2
        }
    fi
    export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
    export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="qemu-aarch64-static -L /usr/aarch64-linux-gnu"
    step "ARM: bytes" cargo test --quiet -p tesdf-sim --test golden --target "$target" --target-dir target/arm
    exit
fi
RUSTFLAGS="-D warnings" step "ARM" cargo check --quiet --lib -p tesdf --no-default-features --features collide,parallel \
    --target "$target" --target-dir target/arm

#!/usr/bin/env bash
# Checks the text of all kernels, and compiles it with NVRTC, CUDA's compiler, to machine code and to
# PTX. It needs no GPU. It takes minutes, so it runs only where what decides the text has changed since
# the last time: `crates/tesdf-gpu/kernels.sha256` has the hash. It writes the new hash, for the commit of
# the change. With `--always` it always runs.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh

stamp=crates/tesdf-gpu/kernels.sha256
hash=$(find crates/tesdf-gpu/src/kernels crates/tesdf-gpu/src/cuda crates/tesdf-sim/src/newton/packed.rs \
    crates/tesdf-sim/src/newton/interior/constants.rs Cargo.lock .ci/nvrtc.sh -type f -print0 | LC_ALL=C sort -z |
    xargs -0 sha256sum | sha256sum | cut -d ' ' -f 1)
if [ "${1:-}" != --always ] && [ "$hash" = "$(cat "$stamp" 2>/dev/null)" ]; then
    echo "NVRTC has compiled these kernels: $stamp has their hash"
    exit
fi
. .ci/nvrtc.sh
step "NVRTC" cargo test --quiet --workspace $features --test gpu -- --ignored cuda_source:: nvrtc::
if [ "$hash" != "$(cat "$stamp" 2>/dev/null)" ]; then
    echo "$hash" >"$stamp"
    echo "commit $stamp with the kernels"
fi

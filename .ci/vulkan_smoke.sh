#!/usr/bin/env bash
# Runs the kernels on the software Vulkan driver: one small test for each stage and mode. With `--all`
# all tests of the GPU crate.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh
. .ci/vulkan.sh
export TESDF_DEVICE=wgpu:0

# Other crates have no test of this name. Without the crates beside it, the GPU crate would be compiled
# again, with other features.
if [ "${1:-}" = --all ]; then
    step "all kernels on Vulkan" cargo test --quiet -p tesdf-gpu
else
    step "Vulkan" cargo test --quiet --workspace $features --test it smoke::
fi

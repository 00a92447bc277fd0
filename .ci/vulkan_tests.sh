#!/usr/bin/env bash
# Runs the kernels on the software Vulkan driver: one small test for each stage and mode. With `--all`
# all tests of the GPU crate, but those of open meshes in all modes, whose kernels this driver compiles for
# ten minutes, and those of calls that fail, which the replacement of CUDA's driver alone can do.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh
. .ci/vulkan.sh
export TESDF_DEVICE=wgpu:0

if [ "${1:-}" = --all ]; then
    step "all kernels on Vulkan" cargo test --quiet --workspace $features --test gpu -- --skip in_all_modes --skip driver_faults::
    step "the tool on Vulkan" cargo test --quiet --workspace $features --test it devices::
else
    step "Vulkan" cargo test --quiet --workspace $features --test gpu smoke::
fi

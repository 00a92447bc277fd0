#!/usr/bin/env bash
# Makes .card, which lab/scripts/card/run.sh needs on a machine with an NVIDIA GPU: compressed programs, machine
# code of all kernels for sm_90 by this machine's NVRTC, the Python package, and the hashes of contacts that the
# stand-in for CUDA computes. `--programs` leaves the hashes, which take minutes, as they are.
# Put packages of Vulkan's loader (libvulkan1, libegl1, libglvnd0, … as .deb) into .card where the other machine has none.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."
. .ci/toolchain.sh
. .ci/nvrtc.sh
. .ci/cuda_on_cpu.sh
. .ci/wheel.sh
. lab/scripts/card/golden.sh

mkdir -p .card
pwd >.card/built_in
cargo build --release -p tesdf-cli --features gpu
cargo build --release --manifest-path lab/Cargo.toml --features gpu
# In the release profile: most tests wait for the processor that they compare with.
tests=$(cargo test --release -p tesdf-gpu --test gpu --no-run --message-format json | sed -n 's/.*"executable":"\([^"]*gpu-[^"]*\)".*/\1/p' | tail -1)
cargo test --quiet --locked --workspace $features --no-run --test it
wheel gpu as-in-tests,gpu

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
strip -o "$work/tesdf" "${CARGO_TARGET_DIR:-target}/release/tesdf"
strip -o "$work/tesdf-lab" "${CARGO_TARGET_DIR:-lab/target}/release/tesdf-lab"
strip -o "$work/gpu_tests" "$tests"
mkdir "$work/python" "$work/kernels"
python3 -c 'import sys, zipfile; zipfile.ZipFile(sys.argv[1]).extractall(sys.argv[2])' target/python/wheels/gpu/*.whl "$work/python"
find "$work/python" -name '*.so*' -exec strip {} +
TESDF_KERNEL_CACHE=$work/kernels "$work/tesdf-lab" kernels
for program in tesdf tesdf-lab gpu_tests; do xz -9e -c "$work/$program" >.card/$program.xz; done
for folder in python kernels; do tar cJf .card/$folder.txz -C "$work/$folder" .; done
if [ "${1:-}" != --programs ]; then
    LD_LIBRARY_PATH=$cuda_on_cpu golden "$work/tesdf-lab" | tee .card/golden.txt
fi
du -sh .card

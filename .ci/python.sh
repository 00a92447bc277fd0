#!/usr/bin/env bash
# Builds the wheel of the Python package with the GPU, and tests it in a clean virtual environment
# beside MuJoCo. Kernels run on the replacement of CUDA's driver. `.ci/python_release.sh` has the rest.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh
. .ci/gmsh.sh
. .ci/cuda_on_cpu.sh
. .ci/wheel.sh

# Downloads, while the compiler works.
environment env python/tests/requirements.txt >"$folder/environment.txt" 2>&1 &
environment_job=$!
# The program, as its own tests have it.
step "wheel" cargo test --quiet --locked --workspace $features --no-run --test it
step "wheel" wheel gpu as-in-tests,gpu
wait $environment_job || { cat "$folder/environment.txt"; exit 1; }
step "wheel" in_environment env "${pip[@]}" --no-deps "$folder"/wheels/gpu/*.whl

export LD_LIBRARY_PATH="$cuda_on_cpu${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
step "Python: package, MuJoCo" in_environment env -m pytest python/tests --ignore python/tests/release --ignore python/tests/test_device.py
step "Python: devices" in_environment env -m pytest python/tests/test_device.py -k "not wgpu"
# Compares the stubs with the module. The tests use the module as the stubs describe it.
step "Python: stubs" in_environment env -m mypy.stubtest tesdf --allowlist python/tests/stubtest-allowlist.txt \
    --mypy-config-file python/tests/mypy.ini
# Each example checks what it shows.
for example in arm_inserts_peg furniture_leg grasp_check inspect_asset mujoco_nut_on_bolt mujoco_peg_in_hole plan_around_part push_worlds rl_batch; do
    step "Python: examples" in_environment env "examples/python/$example.py"
done

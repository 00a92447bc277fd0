#!/usr/bin/env bash
# Tests the Python package with what takes long to install or to start: MJWarp, Newton, PyTorch, OMPL,
# Ray, Chromium, rerun, USD, and Vulkan's software driver; and the wheel without the GPU. Newton needs an
# older MuJoCo, so it has an environment of its own. `.ci/python.sh` has the tests of the package.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh
. .ci/gmsh.sh
. .ci/cuda_on_cpu.sh
. .ci/chromium.sh
. .ci/vulkan.sh
. .ci/wheel.sh

tests=python/tests/release
step "Python environments" environment release $tests/requirements.txt
step "Python environments" environment newton $tests/requirements-newton.txt
step "wheels" cargo test --quiet --locked --workspace $features --no-run --test it
step "wheels" wheel gpu as-in-tests,gpu
step "wheels" wheel default as-in-tests
step "wheels" in_environment release "${pip[@]}" --no-deps "$folder"/wheels/gpu/*.whl
step "wheels" in_environment newton "${pip[@]}" --no-deps "$folder"/wheels/default/*.whl
# For the tests of Newton beside a GPU.
rm -rf "$folder/with_gpu"
step "wheels" in_environment newton "${pip[@]}" --no-deps --target "$folder/with_gpu" "$folder"/wheels/gpu/*.whl

# Warp compiles each kernel once, which takes minutes.
export WARP_CACHE_PATH=$folder/warp
# Otherwise Ray reports its use to its makers.
export RAY_USAGE_STATS_ENABLED=0

in_newton() {
    step "Newton" in_environment newton -m pytest $tests/test_newton.py $tests/test_no_device.py &&
        step "Newton example" in_environment newton $tests/unoptimised_kernels.py examples/python/newton_nut_on_bolt.py &&
        PYTHONPATH=$folder/with_gpu LD_LIBRARY_PATH=$cuda_on_cpu step "Newton with a device" \
            in_environment newton -m pytest $tests/test_newton_device.py
}
in_release() {
    step "MJWarp, PyTorch, JAX, Chromium, rerun, USD" in_environment release -m pytest $tests --ignore $tests/test_newton.py \
        --ignore $tests/test_newton_device.py --ignore $tests/test_no_device.py --ignore $tests/test_mujoco_warp_device.py \
        --ignore $tests/test_ray.py &&
        # Ray forks, which a process with JAX must not do.
        step "Ray" in_environment release -m pytest $tests/test_ray.py &&
        # With MJWarp, PyTorch, rerun and USD, whose types `.ci/python.sh` does not see. Other packages may lack types.
        step "Python: stubs" in_environment release -m mypy.stubtest tesdf --allowlist $tests/stubtest-allowlist.txt \
            --mypy-config-file python/tests/mypy.ini &&
        step "MJWarp example" in_environment release $tests/unoptimised_kernels.py examples/python/mujoco_warp_nuts_on_bolts.py &&
        step "PyTorch example" in_environment release examples/python/peg_finds_hole.py &&
        step "PyTorch example" in_environment release examples/python/grasps_without_collision.py &&
        step "OMPL example" in_environment release examples/python/plan_with_ompl.py &&
        step "Ray example" in_environment release examples/python/ray_encode.py &&
        step "Ray example" in_environment release examples/python/ray_worlds.py &&
        # CUDA's replacement is for these tests only: Warp would take it, too.
        LD_LIBRARY_PATH=$cuda_on_cpu step "MJWarp with a device" in_environment release -m pytest $tests/test_mujoco_warp_device.py &&
        LD_LIBRARY_PATH=$cuda_on_cpu step "Vulkan and CUDA" in_environment release -m pytest python/tests/test_device.py
}
in_newton >"$folder/newton.txt" 2>&1 &
newton_job=$!
status=0
in_release || status=$?
wait $newton_job || status=$?
cat "$folder/newton.txt"
exit $status

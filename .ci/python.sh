#!/usr/bin/env bash
# Builds the wheel of the Python package, with the GPU and without it, and tests both in clean virtual
# environments: with the GPU beside MuJoCo 4, without it beside Newton, which needs an older MuJoCo.
# Both run at the same time. It needs the network, or pip's cache. Some tests run Gmsh, Chromium,
# Vulkan's software driver, and the replacement of CUDA's driver.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh
. .ci/gmsh.sh
. .ci/chromium.sh
. .ci/vulkan.sh
. .ci/cuda_on_cpu.sh

python=${PYTHON:-python3}
if ! "$python" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 9))' 2>/dev/null; then
    echo "error: $python with venv, 3.9 or newer, was not found" >&2
    echo "hint: on Debian or Ubuntu: apt-get install python3 python3-venv; another one by PYTHON=…" >&2
    exit 2
fi

folder=target/python
tools=$folder/tools env=$folder/env newton=$folder/newton wheels=$folder/wheels
maturin=$(sed -n 's/^requires = \["\(maturin==.*\)"\]$/\1/p' python/pyproject.toml)
pip=(-m pip --disable-pip-version-check install --quiet)

environment() {
    step "$python" -m venv --clear "$1" && step "$1/bin/python" "${pip[@]}" -r "$2"
}
environments() {
    environment "$env" python/tests/requirements.txt && environment "$newton" python/tests/requirements-newton.txt
}
build_tools() {
    if ! "$tools/bin/python" -m pip --disable-pip-version-check freeze 2>/dev/null | grep -qx "$maturin"; then
        step "$python" -m venv --clear "$tools" && step "$tools/bin/python" "${pip[@]}" "$maturin"
    fi
}
wheel() {
    # With the optimisation level of the tests.
    CARGO_PROFILE_DEV_OPT_LEVEL=2 step "$tools/bin/maturin" build --quiet --profile dev --locked -m python/Cargo.toml --features "$1" --out "$wheels/$2"
}

# Downloads, while the compiler works.
mkdir -p "$folder"
environments >"$folder/environments.txt" 2>&1 &
environments_job=$!
# The tests compare contacts with those of the command. It is built as for its own tests, whose
# crates have more features, and the wheels with the same crates (`as-in-tests`): each is compiled once.
step cargo test --quiet --locked --workspace $features --no-run --test command_line
build_tools
rm -rf "$wheels"
wheel as-in-tests,gpu gpu
wheel as-in-tests default
wait $environments_job || { cat "$folder/environments.txt"; exit 1; }
step "$env/bin/python" "${pip[@]}" --no-deps "$wheels"/gpu/*.whl
step "$newton/bin/python" "${pip[@]}" --no-deps "$wheels"/default/*.whl
# For the test of Newton beside a GPU.
rm -rf "$folder/with_gpu"
step "$newton/bin/python" "${pip[@]}" --no-deps --target "$folder/with_gpu" "$wheels"/gpu/*.whl

export TESDF_CLI=${CARGO_TARGET_DIR:-$PWD/target}/debug/tesdf
# Warp compiles each kernel once, which takes minutes.
export WARP_CACHE_PATH=$PWD/$folder/warp
# Otherwise Ray reports its use to its makers.
export RAY_USAGE_STATS_ENABLED=0

tests() {
    step "$1/bin/python" -m pytest "${@:2}"
}
in_newton() {
    tests "$newton" python/tests/test_newton.py python/tests/test_no_device.py &&
        step "$newton/bin/python" python/tests/unoptimised_kernels.py examples/python/newton_nut_on_bolt.py &&
        # CUDA's replacement is for these tests only: Warp would take it, too.
        LD_LIBRARY_PATH=$cuda_on_cpu tests "$env" python/tests/test_device.py &&
        PYTHONPATH=$PWD/$folder/with_gpu LD_LIBRARY_PATH=$cuda_on_cpu tests "$newton" python/tests/test_newton_device.py &&
        # Compares the stubs with the module. The tests use the module as the stubs describe it.
        step "$env/bin/python" -m mypy.stubtest tesdf --allowlist python/tests/stubtest-allowlist.txt
}
in_mujoco() {
    tests "$env" python/tests --ignore python/tests/test_newton.py --ignore python/tests/test_no_device.py \
        --ignore python/tests/test_device.py --ignore python/tests/test_newton_device.py || return
    # Each example checks what it shows.
    for example in examples/python/*.py; do
        case $example in
        */newton_*) ;;
        */mujoco_warp_*) step "$env/bin/python" python/tests/unoptimised_kernels.py "$example" || return ;;
        *) step "$env/bin/python" "$example" || return ;;
        esac
    done
}
in_newton >"$folder/newton.txt" 2>&1 &
newton_job=$!
status=0
in_mujoco || status=$?
wait $newton_job || status=$?
cat "$folder/newton.txt"
exit $status

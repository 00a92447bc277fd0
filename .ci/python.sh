#!/usr/bin/env bash
# Builds the wheel of the Python package and tests it in a clean virtual environment. It needs the
# network, or pip's cache. Some tests run Gmsh and Chromium.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh
. .ci/gmsh.sh
. .ci/chromium.sh

python=${PYTHON:-python3}
if ! "$python" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 9))' 2>/dev/null; then
    echo "error: $python with venv, 3.9 or newer, was not found" >&2
    echo "hint: on Debian or Ubuntu: apt-get install python3 python3-venv; another one by PYTHON=…" >&2
    exit 2
fi

tools=target/python/tools env=target/python/env wheels=target/python/wheels
maturin=$(sed -n 's/^requires = \["\(maturin==.*\)"\]$/\1/p' python/pyproject.toml)
pip=(-m pip --disable-pip-version-check install --quiet)
if ! "$tools/bin/python" -m pip --disable-pip-version-check freeze 2>/dev/null | grep -qx "$maturin"; then
    step "$python" -m venv --clear "$tools"
    step "$tools/bin/python" "${pip[@]}" "$maturin"
fi
rm -rf "$wheels"
# With the optimisation level of the tests, so that the crates below are compiled once.
CARGO_PROFILE_DEV_OPT_LEVEL=2 step "$tools/bin/maturin" build --quiet --profile dev --locked -m python/Cargo.toml --out "$wheels"
step "$python" -m venv --clear "$env"
step "$env/bin/python" "${pip[@]}" "$wheels"/*.whl -r python/tests/requirements.txt
# The tests compare contacts with those of the command.
# With the features of the tests, which take the same crates.
CARGO_PROFILE_DEV_OPT_LEVEL=2 step cargo build --quiet --locked --workspace $features --bin tesdf
# Warp compiles its kernels once, which takes minutes.
export WARP_CACHE_PATH=$PWD/target/python/warp
TESDF_CLI=${CARGO_TARGET_DIR:-$PWD/target}/debug/tesdf step "$env/bin/python" -m pytest python/tests --ignore python/tests/test_newton.py
# Otherwise Ray reports its use to its makers.
export RAY_USAGE_STATS_ENABLED=0
# Each example checks what it shows.
for example in examples/python/*.py; do
    case $example in
    */newton_*) ;;
    *) step "$env/bin/python" "$example" ;;
    esac
done
# Newton needs an older mujoco.
newton=target/python/newton
step "$python" -m venv --clear "$newton"
step "$newton/bin/python" "${pip[@]}" "$wheels"/*.whl -r python/tests/requirements-newton.txt
step "$newton/bin/python" -m pytest python/tests/test_newton.py
step "$newton/bin/python" examples/python/newton_nut_on_bolt.py
# Compares the stubs with the module. The tests use the module as the stubs describe it.
step "$env/bin/python" -m mypy.stubtest tesdf --allowlist python/tests/stubtest-allowlist.txt

# Sourced by .ci/python.sh and .ci/python_release.sh: builds wheels of the Python package with the crates
# of the tests, so that each crate is compiled once, and makes clean virtual environments. It needs the
# network, or pip's cache.

. .ci/environment.sh
if ! "$python" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 9))' 2>/dev/null; then
    echo "error: $python with venv, 3.9 or newer, was not found" >&2
    echo "hint: on Debian or Ubuntu: apt-get install python3 python3-venv; another one by PYTHON=…" >&2
    exit 2
fi

folder=$PWD/target/python
pip=(-m pip --disable-pip-version-check install --quiet)
mkdir -p "$folder"

# environment NAME REQUIREMENTS: a new virtual environment in target/python.
environment() {
    "$python" -m venv --clear "$folder/$1" && "$folder/$1/bin/python" "${pip[@]}" -r "$2"
}

# wheel NAME FEATURES: a wheel in target/python/wheels/NAME.
wheel() {
    local tools=$folder/tools
    environment_with "$tools" "$(sed -n 's/^requires = \["\(maturin==.*\)"\]$/\1/p' python/pyproject.toml)" || return
    rm -rf "${folder:?}/wheels/$1"
    # With the optimisation level of the tests.
    CARGO_PROFILE_DEV_OPT_LEVEL=2 "$tools/bin/maturin" build --quiet --profile dev --locked -m python/Cargo.toml \
        --features "$2" --out "$folder/wheels/$1"
}

# in_environment NAME COMMAND…: runs a program of an environment.
in_environment() {
    "$folder/$1/bin/python" "${@:2}"
}

# The tests compare contacts with those of the command.
export TESDF_CLI=${CARGO_TARGET_DIR:-$PWD/target}/debug/tesdf

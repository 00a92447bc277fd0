# Sourced by ./demo, ./test and .ci/run: finds cargo and a linker, or explains how to install them.

if ! command -v cargo >/dev/null && [ -f "${CARGO_HOME:-$HOME/.cargo}/env" ]; then
    # rustup is installed, but this shell does not know it.
    . "${CARGO_HOME:-$HOME/.cargo}/env"
fi
if ! command -v cargo >/dev/null; then
    echo "error: cargo was not found" >&2
    echo "hint: install Rust 1.95 or newer: curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh -s -- -y" >&2
    exit 2
fi
if ! command -v cc >/dev/null; then
    echo "error: cc was not found; Rust needs it to link" >&2
    echo "hint: on Debian or Ubuntu: apt-get install build-essential" >&2
    exit 2
fi

# The features that are off by default and that tests need.
features="--features tesdf-cli/gpu,tesdf-bench/peers"

# Prints a command, then runs it. Adds its seconds to the file STEP_TIMES, where that is set.
step() {
    echo "+ $*"
    local start=$SECONDS status=0
    "$@" || status=$?
    if [ -n "${STEP_TIMES:-}" ]; then
        printf '%6d s  %s\n' $((SECONDS - start)) "$*" >>"$STEP_TIMES"
    fi
    return $status
}

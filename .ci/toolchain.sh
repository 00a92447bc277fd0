# Sourced by ./demo, ./test and .ci/run: finds cargo and a linker, or says how to get them.

if ! command -v cargo >/dev/null && [ -f "${CARGO_HOME:-$HOME/.cargo}/env" ]; then
    # rustup was installed, but this shell was not told.
    . "${CARGO_HOME:-$HOME/.cargo}/env"
fi
if ! command -v cargo >/dev/null; then
    echo "error: cargo was not found" >&2
    echo "hint: install Rust 1.89 or newer: curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh -s -- -y" >&2
    exit 2
fi
if ! command -v cc >/dev/null; then
    echo "error: cc was not found; Rust needs it to link" >&2
    echo "hint: on Debian or Ubuntu: apt-get install build-essential" >&2
    exit 2
fi

# Prints a command, then runs it.
step() {
    echo "+ $*"
    "$@"
}

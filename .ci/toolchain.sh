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
if [ "${OS:-}" != Windows_NT ] && ! command -v cc >/dev/null; then
    echo "error: cc was not found; Rust needs it to link" >&2
    echo "hint: on Debian or Ubuntu: apt-get install build-essential" >&2
    exit 2
fi

# Large pages for the heaps of the compiler (jemalloc) and of all other programs (glibc). On a virtual
# machine whose host backs its memory by small pages, `cargo check -p tesdf` takes 9 s with them and 82 s
# without (a dependent read from 64 MB: 0.19 and 1.7 µs).
export MALLOC_CONF=${MALLOC_CONF:-thp:always}
export GLIBC_TUNABLES=${GLIBC_TUNABLES:-glibc.malloc.hugetlb=1}

# The feature that is off by default and that tests need.
features="--features tesdf-cli/gpu"

# The compiler of Miri and of coverage, which install it where it is missing.
nightly=nightly-2026-10-30

# Prints a command, then runs it. Where STEP_TIMES names a file, adds a line to it: the name of the
# step, its seconds, and the seconds of all processors that it used.
step() {
    local name=$1
    shift
    echo "+ $*"
    if [ -z "${STEP_TIMES:-}" ]; then
        "$@"
        return
    fi
    local measured status=0 TIMEFORMAT='%R %U %S'
    measured=$(mktemp)
    { time "$@" 2>&3; } 3>&2 2>"$measured" || status=$?
    awk -v name="$name" '{ printf "%s\t%.1f\t%.1f\n", name, $1, $2 + $3 }' "$measured" >>"$STEP_TIMES"
    rm "$measured"
    return $status
}

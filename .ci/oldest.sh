# Sourced: the function `check`, which compiles with the oldest supported Rust (`rust-version` in Cargo.toml).
# Rustup installs this version if it is missing. Without rustup or its server, a warning says so, and the Rust
# that is there compiles; clippy still checks since which version each item of the standard library exists.

oldest=+$(sed -n 's/^rust-version = "\(.*\)"$/\1/p' Cargo.toml)
if ! cargo "$oldest" --version >/dev/null 2>&1 && ! rustup toolchain install "${oldest#+}" --profile minimal --no-self-update >/dev/null 2>&1; then
    echo "warning: Rust ${oldest#+} could not be installed; the oldest supported Rust is not tested" >&2
    oldest=
fi

# One compiler, set of flags and folder, so that the crates from elsewhere are compiled once.
check() {
    RUSTFLAGS="-D warnings" step "feature sets" cargo ${oldest:+"$oldest"} check --quiet --lib --target-dir target/features "$@"
}

#!/usr/bin/env bash
# Prints how many lines, regions and branches the tests reach, per crate and folder, and the branches of four folders
# of `tesdf` that go one way alone. It runs unit tests and `it` of `tesdf`; with other arguments for `cargo test`, the
# tests that they name: `.ci/coverage.sh -p tesdf-sim --lib`. It needs rustup, and installs a nightly compiler of a
# fixed date and cargo-llvm-cov.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh

version=0.9.1
if ! rustup component list --toolchain "$nightly" --installed 2>/dev/null | grep -q llvm-tools; then
    step "coverage" rustup toolchain install "$nightly" --profile minimal --component llvm-tools --no-self-update
fi
export PATH=$PWD/target/tools/bin:$PATH
if [ "$(cargo llvm-cov --version 2>/dev/null)" != "cargo-llvm-cov $version" ]; then
    step "coverage" cargo install --quiet --locked --root target/tools "cargo-llvm-cov@$version"
fi

report=$PWD/target/coverage.json
# The nightly compiler puts the examples where the tests of them do not look.
[ $# -gt 0 ] || set -- -p tesdf --lib --test it -- --skip examples::
# Optimised, and without checks that a debug build adds: these have branches that no test may take.
step "coverage" cargo "+$nightly" llvm-cov --branch --profile quick --json --output-path "$report" "$@"
python3 .ci/coverage.py "$report" tesdf/geometry tesdf/encode tesdf/asset tesdf/query

#!/usr/bin/env bash
# Prints how many lines, regions and branches the tests reach, per crate and folder, and the branches of four folders
# of `tesdf` that go one way alone. It runs unit tests and `it` of all crates but `tesdf-gpu`; with other arguments for
# `cargo test`, the tests that they name: `.ci/coverage.sh -p tesdf-sim --lib`. A test that fails, for example without
# Gmsh, does not stop it. It needs rustup, and installs a nightly compiler of a fixed date and cargo-llvm-cov.
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

crates="-p tesdf -p tesdf-sim -p tesdf-parts -p tesdf-playback -p tesdf-rapier -p tesdf-cli"
# The nightly compiler puts the examples where the tests of them do not look.
[ $# -gt 0 ] || set -- $crates --lib --test it -- --skip examples:: --skip outlines::
folder=$PWD/target/llvm-cov-target
mkdir -p "$folder/quick"
programs() {
    find "$folder/quick" -type f -executable ! -name '*.so' ! -name 'build?script*' "$@"
}
programs -delete
rm -f "$folder"/*.profraw "$folder"/*.json
# Optimised, and without checks that a debug build adds: these have branches that no test may take.
step "coverage" cargo "+$nightly" llvm-cov --no-report --branch --profile quick --ignore-run-fail "$@"
tools=$(rustc "+$nightly" --print target-libdir)/../bin
"$tools/llvm-profdata" merge --sparse "$folder"/*.profraw -o "$folder/all.profdata"
# One program at a time: of several, `llvm-cov` says of a function what the first one says that has it.
programs | while read -r program; do
    report=$folder/$(basename "$program").json
    "$tools/llvm-cov" export --instr-profile "$folder/all.profdata" "$program" >"$report"
done
python3 .ci/coverage.py "$folder"/*.json tesdf/geometry tesdf/encode tesdf/asset tesdf/query

#!/usr/bin/env bash
# Runs the code with vector instructions under Miri, which finds undefined behaviour: the encoder's against
# the scalar code, and the queries' kernels. It needs rustup, and installs a nightly compiler of a fixed date.
# Miri knows AVX2, not AVX-512.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh

if ! rustup run "$nightly" cargo miri --version >/dev/null 2>&1; then
    step "Miri" rustup toolchain install "$nightly" --profile minimal --component miri,rust-src --no-self-update
fi
export PROPTEST_CASES=1 PROPTEST_DISABLE_FAILURE_PERSISTENCE=1 MIRIFLAGS=-Zmiri-disable-isolation
export RUSTFLAGS="-C target-feature=+avx2,+fma" CARGO_TARGET_DIR=$PWD/target/miri
step "Miri" cargo "+$nightly" miri test --quiet -p tesdf --lib -- every_instruction_set query::kernel:: query::nearest::

#!/usr/bin/env bash
# Builds all fuzz targets with the compiler of the project, and runs each target for the given
# number of seconds (default 13) on the inputs in fuzz/corpus. One target runs on each core at a
# time. A failing input is written to fuzz/artifacts. libFuzzer needs a C++ compiler.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh
. .ci/cxx.sh

seconds=${1:-13}
only=${2:-}
target=$(rustc -vV | sed -n 's/^host: //p')
out=$PWD/target/fuzz
# The flags of `cargo fuzz` without the sanitizer, which needs a nightly compiler. With `--target`,
# build scripts are compiled without these flags.
coverage="--cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 -Cllvm-args=-sanitizer-coverage-inline-8bit-counters \
-Cllvm-args=-sanitizer-coverage-pc-table -Cllvm-args=-sanitizer-coverage-trace-compares -Ccodegen-units=1"
RUSTFLAGS=$coverage step "fuzzing" cargo build --manifest-path fuzz/Cargo.toml --release --target "$target" --target-dir "$out" --bins

mkdir -p fuzz/artifacts
run_target() {
    local name=$1
    # New inputs stay in the target folder. The corpus only has inputs that were chosen by hand or
    # by `-merge=1`.
    local found=$out/found/$name
    mkdir -p "$found" "fuzz/corpus/$name"
    "$out/$target/release/$name" -max_total_time="$seconds" -timeout=20 -rss_limit_mb=3000 -print_final_stats=1 -verbosity=0 \
        -artifact_prefix="fuzz/artifacts/$name-" "$found" "fuzz/corpus/$name" >"$found.log" 2>&1 && return
    tail -n 60 "$found.log" >&2
    echo "error: the fuzz target $name failed; fuzz/artifacts has its input, $found.log its output" >&2
    return 1
}
export -f run_target
export out target seconds
# A target uses one core.
targets=$(basename -s .rs fuzz/fuzz_targets/*.rs)
step "fuzzing" xargs -P "$(nproc)" -I{} bash -c 'run_target {}' <<<"${only:-$targets}"
(cd "$out/found" && grep "stat::number_of_executed_units" ./*.log)

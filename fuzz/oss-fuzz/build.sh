#!/bin/bash -eu
# Builds all fuzz targets, each with its corpus. OSS-Fuzz sets SRC and OUT.
cd "$SRC/tesdf"
cargo fuzz build -O
for target in fuzz/fuzz_targets/*.rs; do
    name=$(basename -s .rs "$target")
    cp "fuzz/target/x86_64-unknown-linux-gnu/release/$name" "$OUT/"
    zip -jqr "$OUT/${name}_seed_corpus.zip" "fuzz/corpus/$name"
done

#!/usr/bin/env bash
# Packages each crate that can be published. Builds the packages of the library, of parts and of
# dynamics from the packaged files. The other packages are not built: they need the GPU's or
# Rapier's crates, which would be compiled again for minutes, and ./test compiles the same files.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh

# Not optimised: the compiled code never runs.
export CARGO_PROFILE_DEV_OPT_LEVEL=0
# A new folder each time: cargo unpacks the packages into its home, under a name made from this path,
# and takes what an earlier run unpacked there, even where its files have changed since.
mkdir -p target/packages
target_dir=$(mktemp -d "$PWD/target/packages/XXXXXX")
trap 'rm -rf "$target_dir"' EXIT
step cargo package --quiet --allow-dirty --target-dir "$target_dir" -p tesdf -p tesdf-parts -p tesdf-sim
step cargo package --quiet --allow-dirty --target-dir "$target_dir" --no-verify --workspace --exclude tesdf-python

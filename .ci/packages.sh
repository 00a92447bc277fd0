#!/usr/bin/env bash
# Packages each crate that can be published. Builds the packages of the library and of dynamics
# from the packaged files. The other packages are not built: they need the GPU's or Rapier's crates,
# which would be compiled again for minutes, and ./test compiles the same files.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh

# Not optimised: the compiled code never runs.
export CARGO_PROFILE_DEV_OPT_LEVEL=0
step cargo package --quiet --allow-dirty --target-dir target/packages -p tesdf -p tesdf-sim
step cargo package --quiet --allow-dirty --target-dir target/packages --no-verify --workspace --exclude tesdf-python

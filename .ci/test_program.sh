#!/usr/bin/env bash
# Runs a test program for cargo, as a step with the name of its crate.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/toolchain.sh"

program=$(basename "$1")
# In `target/debug/deps/NAME-HASH`, the program of the unit tests has the name of the crate.
name=${program%-*}
[ "${name//_/-}" = "$CARGO_PKG_NAME" ] && name="unit tests"
step "$CARGO_PKG_NAME: $name" "$@"

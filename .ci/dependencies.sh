#!/usr/bin/env bash
# Checks the licences, sources and known vulnerabilities of all dependencies with cargo-deny;
# deny.toml lists what is allowed. The vulnerabilities come from
# https://github.com/RustSec/advisory-db. If it cannot be fetched, a warning says so, and the rest
# is checked.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh

version=0.20.2
deny=target/tools/bin/cargo-deny
if [ "$("$deny" --version 2>/dev/null)" != "cargo-deny $version" ]; then
    # Not optimised, without data for debuggers: the program runs for seconds, and compiling it takes most
    # of the time.
    CARGO_PROFILE_DEV_DEBUG=0 step "dependencies" cargo install --quiet --locked --debug --root target/tools "cargo-deny@$version"
fi

advisories=
if step "dependencies" "$deny" fetch db; then
    advisories=advisories
else
    echo "warning: the list of known vulnerabilities could not be fetched; dependencies are checked for licences and sources alone" >&2
fi
for workspace in . python fuzz lab crates/tesdf-web; do
    step "dependencies" "$deny" --manifest-path "$workspace/Cargo.toml" --config deny.toml --locked check --hide-inclusion-graph $advisories bans licenses sources
done

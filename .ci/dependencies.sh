#!/usr/bin/env bash
# Licences, sources and known vulnerabilities of all dependencies, by cargo-deny; deny.toml says what is allowed. Vulnerabilities are those of
# https://github.com/RustSec/advisory-db: where that cannot be fetched, a warning says so, and the rest is checked.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh

version=0.20.2
deny=target/tools/bin/cargo-deny
if [ "$("$deny" --version 2>/dev/null)" != "cargo-deny $version" ]; then
    # Not optimised: it runs for seconds, and compiling is what takes time.
    step cargo install --quiet --locked --debug --root target/tools "cargo-deny@$version"
fi

advisories=
if step "$deny" fetch db; then
    advisories=advisories
else
    echo "warning: the list of known vulnerabilities could not be fetched; dependencies are checked for licences and sources alone" >&2
fi
for workspace in . python fuzz; do
    step "$deny" --manifest-path "$workspace/Cargo.toml" --config deny.toml --locked check --hide-inclusion-graph $advisories bans licenses sources
done

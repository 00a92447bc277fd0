#!/usr/bin/env bash
# Compiles all crates except the GPU's with the oldest supported Rust. Packages each crate that can be
# published. Compiles the library, parts and dynamics from the packaged
# files. The other packages are not compiled: they need the GPU's or Rapier's crates, which would be
# compiled again for minutes, and ./test compiles the same files.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh
. .ci/oldest.sh

check --bins --workspace --exclude tesdf-gpu

# A new folder each time, so that nothing of an earlier run is taken.
mkdir -p target/packages
folder=$(mktemp -d "$PWD/target/packages/XXXXXX")
trap 'rm -rf "$folder"' EXIT
step "packages" cargo package --quiet --allow-dirty --target-dir "$folder" --no-verify --workspace --exclude tesdf-python

# Each package has the texts of its licences.
for package in "$folder"/package/*.crate; do
    tar -tzf "$package" | grep -c '/LICENSE-\(APACHE\|MIT\)$' | grep -qx 2 ||
        { echo "error: $(basename "$package") lacks the text of a licence" >&2; exit 1; }
done

# One workspace of the packaged files. Checked, not built as `cargo package` would: the compiled code
# never runs.
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml)
packed=$folder/packed
mkdir "$packed"
cp Cargo.lock "$packed"
printf '[workspace]\nresolver = "3"\nmembers = ["*-%s"]\n[patch.crates-io]\n' "$version" >"$packed/Cargo.toml"
for crate in tesdf tesdf-parts tesdf-sim; do
    tar -xzf "$folder/package/$crate-$version.crate" -C "$packed"
    echo "$crate = { path = \"$crate-$version\" }" >>"$packed/Cargo.toml"
done
check --manifest-path "$packed/Cargo.toml" --workspace

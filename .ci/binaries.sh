#!/usr/bin/env bash
# Makes the archives of the tool `tesdf` of a release, with the GPU, in target/binaries: by default for Linux on
# x86-64 and on ARM, elsewhere for this machine, or for the targets that are named:
#
#     .ci/binaries.sh [TARGET…]
#
# An archive has the program, its manual and completions, the changelog, the texts of all licences, and the list of
# the crates in it (CycloneDX). The same commit and compiler give the same bytes.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh
. .ci/release_tools.sh

binaries=$PWD/target/binaries
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml)
mkdir -p "$binaries"
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH

# The list of crates in the program, by a tool of cargo.
cyclonedx=0.5.9
if [ "$(target/tools/bin/cargo-cyclonedx cyclonedx --version 2>/dev/null)" != "cargo-cyclonedx-cyclonedx $cyclonedx" ]; then
    CARGO_PROFILE_DEV_DEBUG=0 step "binaries" cargo install --quiet --locked --debug --root target/tools "cargo-cyclonedx@$cyclonedx"
fi

# pack FOLDER: its archive, with one time and owner for all files.
pack() {
    case $1 in
    *-windows-*)
        rm -f "$1.zip"
        find "$1" -type f -exec touch --date="@$SOURCE_DATE_EPOCH" {} +
        "$release_bin/python" -c 'import shutil, sys; shutil.make_archive(sys.argv[1], "zip", ".", sys.argv[1])' "$1" ;;
    *-darwin) tar -czf "$1.tar.gz" "$1" ;;
    *)  tar --sort=name --mtime="@$SOURCE_DATE_EPOCH" --owner=0 --group=0 --numeric-owner --mode=go=rX,u+rw -cf - "$1" |
            gzip -n -9 >"$1.tar.gz" ;;
    esac
}

for target in "${targets[@]}"; do
    if command -v rustup >/dev/null; then
        rustup --quiet target add "$target"
    fi
    options=(--quiet --locked --release -p tesdf-cli --features gpu)
    # The oldest C library that Rust itself runs with, as for the wheels.
    case $target in
    *-linux-*) step "binaries" cargo zigbuild "${options[@]}" --target "$target.2.17" ;;
    *) step "binaries" cargo build "${options[@]}" --target "$target" ;;
    esac
    extension=
    case $target in *-windows-*) extension=.exe ;; esac
    program=${CARGO_TARGET_DIR:-$PWD/target}/$target/release/tesdf$extension

    name=tesdf-$version-$target
    folder=$binaries/$name
    rm -rf "$folder"
    mkdir -p "$folder"
    cp "$program" README.md CHANGELOG.md LICENSE-MIT LICENSE-APACHE "$folder"
    .ci/licences.py tesdf-cli "$target" gpu >"$folder/THIRD-PARTY-LICENCES.txt"
    target/tools/bin/cargo-cyclonedx cyclonedx --quiet --manifest-path crates/tesdf-cli/Cargo.toml --features gpu \
        --target "$target" --format json --spec-version 1.5 --override-filename sbom
    # No path of this machine, and no random number.
    sed -e "s,file://$PWD/,file:///,g" -e '/"serialNumber"/d' crates/tesdf-cli/sbom.json >"$folder/tesdf.cdx.json"
    # It writes one beside each manifest.
    find crates python -maxdepth 2 -name sbom.json -delete

    # Where the program can run here, also in an emulator, it encodes to the bytes of the host.
    run=()
    case $target in
    "$host") ;;
    aarch64-*-linux-*) command -v qemu-aarch64-static >/dev/null && run=(qemu-aarch64-static -L /usr/aarch64-linux-gnu) || run=(false) ;;
    *) run=(false) ;;
    esac
    if [ "${run[*]}" = false ]; then
        echo "warning: $target cannot run here; its program is not tested" >&2
    else
        step "binaries" "${run[@]}" "$program" encode data/procedural/shaft_keyway.obj -o "$binaries/$target.tesdf" >/dev/null
        "${run[@]}" "$program" --version | tee /dev/stderr | grep -q "($(git log -1 --abbrev=7 --format='%h %cs'))" ||
            { echo "error: tesdf --version does not name this commit" >&2; exit 1; }
        cmp "$binaries/$host.tesdf" "$binaries/$target.tesdf"
    fi

    # The manual and completions are those of every target.
    case $target in
    "$host")
        rm -rf "$binaries/texts"
        mkdir -p "$binaries/texts/man" "$binaries/texts/completions"
        for shell in bash elvish fish powershell zsh; do
            "$program" completions "$shell" >"$binaries/texts/completions/tesdf.$shell"
        done
        "$program" man >"$binaries/texts/man/tesdf.1"
        for command in $("$program" man --list); do
            "$program" man "$command" >"$binaries/texts/man/tesdf-$command.1"
        done ;;
    esac
    if [ -d "$binaries/texts" ]; then
        cp -R "$binaries/texts/." "$folder"
    else
        echo "error: $host makes the manual; name it before $target" >&2
        exit 1
    fi
    (cd "$binaries" && pack "$name")
    rm -rf "$folder"
done
rm -rf "$binaries/texts" "$binaries"/*.tesdf
.ci/checksums.sh "$binaries"

# Sourced by the scripts that make files of a release: sets `release_bin` to the folder of maturin,
# cargo-zigbuild and auditwheel, which pip installs into target/release-tools, and `host` to the target of this
# machine. Zig, which pip installs too, is the C compiler and linker for Linux: its files run with old C libraries,
# and it makes those for ARM on any processor.

release_requirements="$(sed -n 's/^requires = \["\(maturin==.*\)"\]$/\1/p' python/pyproject.toml)
ziglang==0.17.1
cargo-zigbuild==0.24.1
auditwheel==6.8.2"
release_tools=$PWD/target/release-tools
host=$(rustc -vV | sed -n 's/^host: //p')
python=${PYTHON:-python3}

# scripts_of ENVIRONMENT: the folder with the programs of a virtual environment.
scripts_of() {
    if [ -d "$1/Scripts" ]; then echo "$1/Scripts"; else echo "$1/bin"; fi
}

if [ "$(cat "$release_tools/requirements.txt" 2>/dev/null)" != "$release_requirements" ]; then
    "$python" -m venv --clear "$release_tools"
    # shellcheck disable=SC2086
    "$(scripts_of "$release_tools")/python" -m pip --disable-pip-version-check install --quiet $release_requirements
    echo "$release_requirements" >"$release_tools/requirements.txt"
fi
release_bin=$(scripts_of "$release_tools")
# cargo-zigbuild and maturin look for Zig here.
export PATH="$release_bin:$PATH"

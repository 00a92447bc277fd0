# Sourced by the scripts that make files of a release: sets `release_bin` to the folder of maturin,
# cargo-zigbuild and auditwheel, which pip installs into target/release-tools, `host` to the target of this machine,
# and `targets` to those that the script was given. Zig, which pip installs too, is the C compiler and linker for
# Linux: its files run with old C libraries, and it makes those for ARM on any processor.

. .ci/environment.sh

release_tools=$PWD/target/release-tools
host=$(rustc -vV | sed -n 's/^host: //p')
environment_with "$release_tools" "$(sed -n 's/^requires = \["\(maturin==.*\)"\]$/\1/p' python/pyproject.toml)" \
    ziglang==0.17.1 cargo-zigbuild==0.24.1 auditwheel==6.8.2
release_bin=$(scripts_of "$release_tools")
# cargo-zigbuild and maturin look for Zig here.
export PATH="$release_bin:$PATH"

# The targets that are named, or all that this machine makes.
targets=("$@")
if [ $# = 0 ]; then
    case $host in
    *-linux-gnu) targets=(x86_64-unknown-linux-gnu aarch64-unknown-linux-gnu) ;;
    *) targets=("$host") ;;
    esac
fi

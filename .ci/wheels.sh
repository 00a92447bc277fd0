#!/usr/bin/env bash
# Makes the wheels of a release, with the GPU, in target/wheels: by default for Linux on x86-64 and on ARM,
# elsewhere for this machine, or for the targets that are named:
#
#     .ci/wheels.sh [TARGET…]
#
# Each wheel is for all versions of Python from 3.9, and has the texts of all licences. Those for Linux are checked to
# be manylinux2014: they run with glibc 2.17. The wheel of this machine is installed in a new virtual environment, and
# must give its first contacts within a minute. That for ARM does so under QEMU, with Debian's Python, where apt-get can
# download both.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. .ci/toolchain.sh
. .ci/release_tools.sh

wheels=$PWD/target/wheels
largest=15000000 # bytes

# first_contacts COMMAND…: runs Python, which prints the contacts of two cubes.
first_contacts() {
    "$@" -c '
import tesdf
corners = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
squares = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
part = tesdf.encode((corners, [t for a, b, c, d in squares for t in ([a, b, c], [a, c, d])]))
scene = tesdf.Scene()
scene.add_many(scene.add_shape(part), [[0, 0, 0, 0, 0, 0, 1], [0.3, 0.2, 0.95, 0, 0, 0, 1]])
contacts = scene.detect(contact_distance=1e-4)
assert len(contacts.distance) > 0 and abs(contacts.distance.min() + 0.05) < 1e-6, contacts.distance
print(f"tesdf {tesdf.__version__}: {len(contacts.distance)} contacts of two cubes")'
}

# installed_here WHEEL: in a new environment, as a user would.
installed_here() {
    local environment=$PWD/target/wheel-check started=$SECONDS
    "$python" -m venv --clear "$environment"
    "$(scripts_of "$environment")/python" -m pip --disable-pip-version-check install --quiet "$1"
    first_contacts "$(scripts_of "$environment")/python"
    echo "from a new environment to the first contacts: $((SECONDS - started)) s"
    [ $((SECONDS - started)) -le 60 ] || { echo "error: expected at most 60 s" >&2; return 1; }
}

# arm_under_qemu WHEEL: with Debian's Python for ARM in target/arm-python, and numpy of PyPI. The packages of this
# machine stay as they are.
arm_under_qemu() {
    . .ci/arm_python.sh
    if [ -z "$arm_python" ]; then
        return
    fi
    local site=$PWD/target/arm-python/site
    rm -rf "$site"
    "$release_bin/python" -m pip --disable-pip-version-check install --quiet --target "$site" --only-binary=:all: \
        --platform manylinux2014_aarch64 --platform manylinux_2_28_aarch64 --python-version 3.11 --implementation cp \
        --abi cp311 --abi abi3 "$1"
    PYTHONPATH=$site first_contacts $arm_python
}

for target in "${targets[@]}"; do
    options=(--release --strip --locked -m python/Cargo.toml --features gpu --target "$target" --out "$wheels/$target")
    case $target in
    *-linux-*) options+=(--zig --compatibility manylinux2014) ;;
    esac
    if command -v rustup >/dev/null; then
        rustup --quiet target add "$target"
    fi
    rm -rf "${wheels:?}/$target"
    .ci/licences.py tesdf-python "$target" gpu >python/THIRD-PARTY-LICENCES.txt
    step "wheels" maturin build --quiet "${options[@]}"
    wheel=$(echo "$wheels/$target"/*.whl)

    size=$(wc -c <"$wheel")
    echo "$(basename "$wheel"): $((size / 1000)) kB"
    [ "$size" -le $largest ] || { echo "error: expected at most $((largest / 1000)) kB" >&2; exit 1; }
    "$release_bin/python" -m zipfile -l "$wheel" | grep -q '/licenses/THIRD-PARTY-LICENCES.txt' ||
        { echo "error: the wheel lacks the licences of other crates" >&2; exit 1; }
    case $target in
    *-linux-*) auditwheel show "$wheel" | tr '\n' ' ' | grep -o '"manylinux_2_17_[a-z0-9_]*"' ||
        { echo "error: the wheel is not manylinux2014: auditwheel show $wheel" >&2; exit 1; } ;;
    esac
    case $target in
    "$host") step "wheels" installed_here "$wheel" ;;
    aarch64-unknown-linux-gnu) step "wheels" arm_under_qemu "$wheel" ;;
    *) echo "warning: the wheel for $target was not installed, because this is $host" >&2 ;;
    esac
done

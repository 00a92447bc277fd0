# Sourced where C++ is compiled: finds or installs a compiler.

if ! command -v c++ >/dev/null && command -v apt-get >/dev/null; then
    as_root=
    [ "$(id -u)" = 0 ] || as_root="sudo -n"
    $as_root apt-get install --quiet --yes g++ >/dev/null || true
fi
if ! command -v c++ >/dev/null; then
    echo "error: a C++ compiler, which CUDA kernels are tested and fuzz targets are linked with, was not found" >&2
    echo "hint: on Debian or Ubuntu: apt-get install g++" >&2
    exit 2
fi

# Sourced by ./test: sets TESDF_GMSH to a Gmsh that runs, or explains how to install one. Tests run
# it as a program; nothing links it.
#
# It tries in this order: TESDF_GMSH, `gmsh` in the PATH, the Gmsh that an earlier call installed in
# target/gmsh, and the wheel of PyPI. The wheel needs Python with pip, but neither root nor a
# virtual environment. It also needs X11 and OpenGL libraries, although it opens no window. If they
# are missing and apt exists, they are unpacked next to it.

gmsh_version=4.15.2
gmsh_folder=$PWD/target/gmsh
# Names in Debian and Ubuntu; a library may have another name in some releases.
gmsh_libraries="libglu1-mesa libgl1 libglx0 libglvnd0 libopengl0 libx11-6 libxcb1 libxau6 libxdmcp6 libxrender1 libxcursor1
    libxfixes3 libxext6 libxft2 libxinerama1 libfontconfig1 libfreetype6 libexpat1 libpng16-16 libpng16-16t64 libbrotli1
    libbsd0 libmd0 libgomp1"

gmsh_runs() {
    [ -n "$1" ] && command -v "$1" >/dev/null && "$1" --version >/dev/null 2>&1
}

gmsh_install() {
    mkdir -p "$gmsh_folder"
    # Not with --target, which leaves out the shared library.
    python3 -m pip install --quiet --disable-pip-version-check --root-user-action=ignore --no-deps --ignore-installed \
        --prefix "$gmsh_folder" "gmsh==$gmsh_version" || return 1
    cat >"$gmsh_folder/run" <<'WRAPPER'
#!/bin/sh
# Runs Gmsh through its Python module, with the libraries of this folder where the system has none.
folder=$(dirname "$0")
libraries=$(find "$folder/libraries" -type d -name '*-linux-gnu' 2>/dev/null | paste -sd : -)
if [ -n "$libraries" ]; then
    export LD_LIBRARY_PATH="${LD_LIBRARY_PATH:+$LD_LIBRARY_PATH:}$libraries"
fi
module=$(find "$folder" -name gmsh.py | head -n 1)
PYTHONPATH=$(dirname "$module")
export PYTHONPATH
exec python3 -c 'import sys, gmsh; sys.argv[0] = "gmsh"; gmsh.initialize(sys.argv, run=True); gmsh.finalize()' "$@"
WRAPPER
    chmod +x "$gmsh_folder/run"
    gmsh_runs "$gmsh_folder/run" && return 0
    command -v apt-get >/dev/null || return 1
    mkdir -p "$gmsh_folder/debs"
    for library in $gmsh_libraries; do
        # A name that this release does not have is not an error: Gmsh must run in the end.
        (cd "$gmsh_folder/debs" && apt-get download --quiet "$library" >/dev/null 2>&1) || true
    done
    for package in "$gmsh_folder"/debs/*.deb; do
        [ -e "$package" ] && dpkg -x "$package" "$gmsh_folder/libraries"
    done
    gmsh_runs "$gmsh_folder/run"
}

if ! gmsh_runs "${TESDF_GMSH:-}"; then
    if gmsh_runs gmsh; then
        TESDF_GMSH=$(command -v gmsh)
    elif gmsh_runs "$gmsh_folder/run" || gmsh_install; then
        TESDF_GMSH=$gmsh_folder/run
    else
        echo "error: Gmsh, which tests run, was not found and could not be installed into $gmsh_folder" >&2
        echo "hint: pip install gmsh, and on Debian or Ubuntu: apt-get install libglu1-mesa libxcursor1 libxft2 libxinerama1 libgomp1" >&2
        echo "hint: or: apt-get install gmsh" >&2
        exit 2
    fi
fi
export TESDF_GMSH

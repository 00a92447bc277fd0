# Sourced: sets `arm_python` to a command that runs Debian's Python for 64-bit ARM under QEMU, or to nothing, with a
# warning. apt-get downloads both into target/arm-python; this machine's packages stay as they are, and no root is
# needed.

arm_folder=$PWD/target/arm-python
arm_python=

# debian_packages ARCHITECTURE NAME…: downloads packages, with all that they need, and unpacks them.
debian_packages() {
    local folder=$arm_folder/$1 package
    mkdir -p "$folder/lists/partial" "$folder/archives/partial" "$folder/root"
    : >"$folder/status"
    cat >"$folder/apt.conf" <<END
APT::Architecture "$1";
APT::Architectures { "$1"; };
APT::Install-Recommends "false";
APT::Sandbox::User "";
Dir::State::lists "$folder/lists";
Dir::State::status "$folder/status";
Dir::Cache::archives "$folder/archives";
Dir::Cache::pkgcache "";
Dir::Cache::srcpkgcache "";
END
    APT_CONFIG=$folder/apt.conf apt-get --quiet update >/dev/null &&
        APT_CONFIG=$folder/apt.conf apt-get --quiet --yes --download-only install "${@:2}" >/dev/null || return
    for package in "$folder"/archives/*.deb; do
        dpkg-deb -x "$package" "$folder/root" || return
    done
}

arm_programs() {
    qemu=$(command -v qemu-aarch64-static || echo "$arm_folder/$(dpkg --print-architecture 2>/dev/null)/root/usr/bin/qemu-aarch64-static")
    python_on_arm=$(echo "$arm_folder"/arm64/root/usr/bin/python3.[0-9]*)
    [ -x "$qemu" ] && [ -x "$python_on_arm" ]
}
if ! arm_programs && command -v apt-get >/dev/null && command -v dpkg-deb >/dev/null; then
    # numpy needs the library of C++.
    debian_packages arm64 python3 libstdc++6
    [ -x "$qemu" ] || debian_packages "$(dpkg --print-architecture)" qemu-user-static
fi
if arm_programs; then
    arm_python="$qemu -L $arm_folder/arm64/root $python_on_arm"
else
    echo "warning: Python for ARM, or QEMU, could not be downloaded by apt-get; nothing ran on ARM" >&2
fi

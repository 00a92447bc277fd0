# Sourced where GPU code runs on it: finds or installs the software Vulkan driver, on which tests have
# the same result on every machine.

vulkan_driver() {
    # Debian and Ubuntu, Fedora, and a driver built from source.
    for file in /usr/share/vulkan/icd.d/lvp_icd*.json /usr/local/share/vulkan/icd.d/lvp_icd*.json; do
        if [ -e "$file" ]; then
            echo "$file"
            break
        fi
    done
}

if [ -z "$(vulkan_driver)" ] && command -v apt-get >/dev/null; then
    as_root=
    [ "$(id -u)" = 0 ] || as_root="sudo -n"
    $as_root apt-get update --quiet >/dev/null && $as_root apt-get install --quiet --yes \
        libvulkan1 mesa-vulkan-drivers >/dev/null || true
fi
if [ -z "$(vulkan_driver)" ]; then
    echo "error: the software Vulkan driver, on which GPU tests run, was not found and could not be installed" >&2
    echo "hint: on Debian or Ubuntu: apt-get install libvulkan1 mesa-vulkan-drivers" >&2
    exit 2
fi
VK_DRIVER_FILES=$(vulkan_driver)
# Older loaders only know this name.
VK_ICD_FILENAMES=$VK_DRIVER_FILES
export VK_DRIVER_FILES VK_ICD_FILENAMES
# The driver warns without it.
export XDG_RUNTIME_DIR="${XDG_RUNTIME_DIR:-${TMPDIR:-/tmp}}"

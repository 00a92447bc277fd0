# Sourced by .ci/kernels.sh: adds NVRTC, which compiles the kernels for CUDA, to LD_LIBRARY_PATH, or
# explains how to install it. Compiling needs no GPU.
#
# It tries in this order: the NVRTC of the system's loader, the one that an earlier call installed
# in target/nvrtc, and the wheel of PyPI. The wheel needs Python with pip, but neither root nor a
# virtual environment.

nvrtc_version=12.9.86
nvrtc_folder=$PWD/target/nvrtc
nvrtc_library=$nvrtc_folder/nvidia/cuda_nvrtc/lib

nvrtc_is_known() {
    ldconfig -p 2>/dev/null | grep -q 'libnvrtc\.so\(\.12\)\? '
}

nvrtc_install() {
    mkdir -p "$nvrtc_folder"
    python3 -m pip install --quiet --disable-pip-version-check --root-user-action=ignore --no-deps --upgrade \
        --target "$nvrtc_folder" "nvidia-cuda-nvrtc-cu12==$nvrtc_version"
}

if ! nvrtc_is_known; then
    if [ -e "$nvrtc_library/libnvrtc.so.12" ] || nvrtc_install; then
        export LD_LIBRARY_PATH="$nvrtc_library${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
    else
        echo "error: NVRTC, which compiles kernels for CUDA, was not found and could not be installed into $nvrtc_folder" >&2
        echo "hint: pip install nvidia-cuda-nvrtc-cu12, and put its folder nvidia/cuda_nvrtc/lib into LD_LIBRARY_PATH" >&2
        exit 2
    fi
fi

# Sourced by ./test: builds the replacement of CUDA's driver and NVRTC for machines without an
# NVIDIA GPU, and sets cuda_on_cpu to its folder.

cuda_on_cpu=$PWD/target/cuda_on_cpu
cuda_on_cpu_source=$PWD/crates/tesdf-gpu/tests/cuda_on_cpu

. .ci/cxx.sh
mkdir -p "$cuda_on_cpu"
if [ "$cuda_on_cpu_source/cuda.cpp" -nt "$cuda_on_cpu/libcuda.so" ]; then
    # With _FORTIFY_SOURCE, jumps between fibers are errors.
    c++ -std=c++17 -O2 -U_FORTIFY_SOURCE -Wall -fPIC -shared -DHEADER="\"$cuda_on_cpu_source/kernel.h\"" \
        -o "$cuda_on_cpu/libcuda.so" "$cuda_on_cpu_source/cuda.cpp" -ldl
    cp "$cuda_on_cpu/libcuda.so" "$cuda_on_cpu/libnvrtc.so"
fi

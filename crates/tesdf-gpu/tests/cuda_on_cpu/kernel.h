// Definitions that a kernel finds on a GPU. They come before the text of a kernel, which is then
// compiled as C++.
typedef unsigned long size_t;
struct uint3 { unsigned x, y, z; };
extern "C" {
uint3 threadIdx, blockIdx, gridDim, blockDim;
char* cuda_shared;
void (*cuda_sync)();
// Returns the word of the lane `other` of the same subgroup.
unsigned (*cuda_exchange)(unsigned word, unsigned other);
}
#define warpSize 32u
#define __global__
#define __device__
#define __grid_constant__
#define __forceinline__ inline
#define __launch_bounds__(...)
#define __syncthreads() cuda_sync()
// Blocks run one after the other.
#define __threadfence()
static inline int __clz(unsigned x) { return x ? __builtin_clz(x) : 32; }
static inline unsigned __shfl_xor_sync(unsigned, unsigned word, unsigned mask) {
    return cuda_exchange(word, threadIdx.x ^ mask);
}
static inline float __shfl_xor_sync(unsigned, float number, unsigned mask) {
    unsigned word;
    __builtin_memcpy(&word, &number, 4);
    word = cuda_exchange(word, threadIdx.x ^ mask);
    __builtin_memcpy(&number, &word, 4);
    return number;
}
static inline float __shfl_sync(unsigned, float number, unsigned lane) {
    unsigned word;
    __builtin_memcpy(&word, &number, 4);
    word = cuda_exchange(word, lane % warpSize);
    __builtin_memcpy(&number, &word, 4);
    return number;
}
static inline unsigned min(unsigned a, unsigned b) { return a < b ? a : b; }
static inline unsigned max(unsigned a, unsigned b) { return a > b ? a : b; }
static inline int min(int a, int b) { return a < b ? a : b; }
static inline int max(int a, int b) { return a > b ? a : b; }
static inline float min(float a, float b) { return __builtin_fminf(a, b); }
static inline float max(float a, float b) { return __builtin_fmaxf(a, b); }
static inline double min(double a, double b) { return __builtin_fmin(a, b); }
static inline double max(double a, double b) { return __builtin_fmax(a, b); }
static inline double sqrt(double x) { return __builtin_sqrt(x); }
static inline double fabs(double x) { return __builtin_fabs(x); }
static inline float sqrt(float x) { return __builtin_sqrtf(x); }
static inline float floor(float x) { return __builtin_floorf(x); }
static inline float atan2(float y, float x) { return __builtin_atan2f(y, x); }
static inline float fabs(float x) { return __builtin_fabsf(x); }

// Blocks run one after the other, and threads one at a time.
static inline unsigned cuda_fetch_add(unsigned *at, unsigned value) {
    const unsigned old = *at;
    *at = old + value;
    return old;
}
static inline unsigned cuda_fetch_min(unsigned *at, unsigned value) {
    const unsigned old = *at;
    *at = min(old, value);
    return old;
}
static inline unsigned cuda_fetch_max(unsigned *at, unsigned value) {
    const unsigned old = *at;
    *at = max(old, value);
    return old;
}
static inline unsigned atomicExch(unsigned *at, unsigned value) {
    const unsigned old = *at;
    *at = value;
    return old;
}

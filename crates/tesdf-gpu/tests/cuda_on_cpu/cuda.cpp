// The functions of CUDA's driver and of NVRTC that this crate calls, on the processor. They test
// the use of CUDA without a GPU. A CUDA device behaves differently in timing, parallelism and
// memory.
//
// The "machine code" of a kernel is the path of a shared library, which the C++ compiler makes from
// the kernel's text. It stays in the folder `kernels` beside this library, by the hash of the text,
// for all processes. The threads of a block are fibers. Each fiber runs to its next barrier. When
// some threads never reach a barrier, the process ends. Each buffer lies directly before protected
// memory, so a read or write past its end also ends the process.
//
// A GPU promises no order of blocks, nor of threads between two barriers. With CUDA_ON_CPU_ORDER=SEED
// both orders are random, and others in each launch and after each barrier.
//
// After `cuda_on_cpu_fail` a call fails, alone or with all later ones.
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <deque>
#include <dlfcn.h>
#include <fstream>
#include <map>
#include <numeric>
#include <setjmp.h>
#include <string>
#include <sys/mman.h>
#include <sys/stat.h>
#include <ucontext.h>
#include <unistd.h>
#include <vector>

#define CUDA extern "C" __attribute__((visibility("default")))

struct uint3 { unsigned x, y, z; };

// Handles: any distinct values.
static void *const CONTEXT = (void *)1, *const STREAM = (void *)2, *const POOL = (void *)3;
static const int INVALID = 1, NO_CONTEXT = 201, NOT_FOUND = 500;

[[noreturn]] static void stop(const std::string &why) {
    fprintf(stderr, "CUDA on the CPU: %s\n", why.c_str());
    _exit(70);
}

// Calls that fail.

static std::atomic<uint64_t> calls = 0, first_failure = 0, last_failure = 0;
static int failure;
static std::atomic<const char *> failed_call = "";

// From now on, the calls from number `first` (from 1) to `last` fail with `status`. Returns the number of
// calls that could have failed since this function was called last.
CUDA uint64_t cuda_on_cpu_fail(uint64_t first, uint64_t last, int status) {
    first_failure = first, last_failure = last, failure = status, failed_call = "";
    return calls.exchange(0);
}
// The first call that failed since, or an empty text.
CUDA const char *cuda_on_cpu_failed() { return failed_call; }

static bool fails(const char *call) {
    const uint64_t number = ++calls;
    if (number < first_failure || number > last_failure) return false;
    const char *none = failed_call;
    if (!*none) failed_call.compare_exchange_strong(none, call);
    return true;
}
#define MAY_FAIL if (fails(__func__)) return failure;

// Devices and memory.

static thread_local void *current = nullptr;
static std::map<uint64_t, std::pair<void *, size_t>> taken;

CUDA int cuInit(unsigned) { return 0; }
CUDA int cuDeviceGetCount(int *count) { *count = 1; return 0; }
CUDA int cuDeviceGet(int *device, int index) { *device = index; return index == 0 ? 0 : 101; }
CUDA int cuDeviceGetName(char *name, int size, int) { snprintf(name, size, "CUDA on the CPU"); return 0; }
CUDA int cuDeviceTotalMem_v2(size_t *bytes, int) { *bytes = size_t(1) << 32; return 0; }
CUDA int cuDeviceGetAttribute(int *value, int attribute, int) {
    // Attributes: multiprocessors, compute capability 9.0, shared memory per block, memory pools.
    static const std::map<int, int> attributes = {{16, 3}, {75, 9}, {76, 0}, {97, 227 << 10}, {115, 1}};
    auto found = attributes.find(attribute);
    if (found == attributes.end()) return INVALID;
    *value = found->second;
    return 0;
}
CUDA int cuDevicePrimaryCtxRetain(void **context, int) { *context = CONTEXT; return 0; }
CUDA int cuCtxSetCurrent(void *context) { MAY_FAIL current = context; return 0; }
CUDA int cuStreamCreate(void **stream, unsigned flags) { *stream = STREAM; return flags == 0 ? 0 : INVALID; }
CUDA int cuDeviceGetDefaultMemPool(void **pool, int) { *pool = POOL; return 0; }
CUDA int cuMemPoolSetAttribute(void *pool, int, void *) { return pool == POOL ? 0 : INVALID; }
CUDA int cuGetErrorString(int error, const char **text) {
    *text = error == 2 ? "out of memory" : error == 719 ? "unspecified launch failure" : "see cuda.h";
    return 0;
}

CUDA int cuMemAllocAsync(uint64_t *pointer, size_t bytes, void *stream) {
    MAY_FAIL
    if (current != CONTEXT) return NO_CONTEXT;
    if (stream != STREAM) return INVALID;
    const size_t page = sysconf(_SC_PAGESIZE), all = (bytes + page - 1) / page * page + 2 * page;
    char *begin = (char *)mmap(nullptr, all, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (begin == MAP_FAILED || mprotect(begin + page, all - 2 * page, PROT_READ | PROT_WRITE) != 0) return 2;
    // Filled with a pattern other than zero, so that reads of unwritten memory are noticed.
    memset(begin + page, 0xCD, all - 2 * page);
    *pointer = (uint64_t)(begin + all - page - bytes) & ~uint64_t(15);
    taken[*pointer] = {begin, all};
    return 0;
}
CUDA int cuMemFreeAsync(uint64_t pointer, void *) {
    MAY_FAIL
    auto found = taken.find(pointer);
    if (current != CONTEXT || found == taken.end()) return INVALID;
    munmap(found->second.first, found->second.second);
    taken.erase(found);
    return 0;
}
CUDA int cuMemGetInfo_v2(size_t *free, size_t *total) {
    cuDeviceTotalMem_v2(total, 0);
    *free = *total;
    for (const auto &one : taken) *free -= std::min(*free, one.second.second);
    return 0;
}
CUDA int cuMemcpyHtoDAsync_v2(uint64_t to, const void *from, size_t bytes, void *stream) {
    MAY_FAIL
    if (current != CONTEXT || stream != STREAM) return NO_CONTEXT;
    memcpy((void *)to, from, bytes);
    return 0;
}
CUDA int cuMemcpyDtoHAsync_v2(void *to, uint64_t from, size_t bytes, void *stream) {
    MAY_FAIL
    if (current != CONTEXT || stream != STREAM) return NO_CONTEXT;
    memcpy(to, (void *)from, bytes);
    return 0;
}
CUDA int cuStreamSynchronize(void *) { MAY_FAIL return current == CONTEXT ? 0 : NO_CONTEXT; }

CUDA int cuEventCreate(void **event, unsigned) { MAY_FAIL *event = new timespec{}; return 0; }
CUDA int cuEventRecord(void *event, void *) { MAY_FAIL return clock_gettime(CLOCK_MONOTONIC, (timespec *)event); }
CUDA int cuEventSynchronize(void *) { MAY_FAIL return 0; }
CUDA int cuEventElapsedTime(float *milliseconds, void *from, void *to) {
    auto *a = (timespec *)from, *b = (timespec *)to;
    *milliseconds = (b->tv_sec - a->tv_sec) * 1e3f + (b->tv_nsec - a->tv_nsec) * 1e-6f;
    return 0;
}
CUDA int cuEventDestroy_v2(void *event) { delete (timespec *)event; return 0; }

// Kernels.

static const char MAGIC[] = "\x7f" "ELF";

struct Kernel {
    std::string name;
    void (*run)(void **);
    uint3 *thread, *block, *grid, *threads;
    char **shared;
    void (**sync)();
    unsigned (**exchange)(unsigned, unsigned);
};

CUDA int cuModuleLoadData(void **module, const void *image) {
    MAY_FAIL
    if (current != CONTEXT) return NO_CONTEXT;
    *module = dlopen((const char *)image + strlen(MAGIC), RTLD_NOW | RTLD_LOCAL);
    return *module ? 0 : INVALID;
}
template <typename T> static bool find(T &to, void *module, const char *name) {
    to = (T)dlsym(module, name);
    return to != nullptr;
}
CUDA int cuModuleGetFunction(void **function, void *module, const char *name) {
    MAY_FAIL
    auto *k = new Kernel{name};
    bool whole = dlsym(module, name) && find(k->run, module, "cuda_run") && find(k->thread, module, "threadIdx") &&
                 find(k->block, module, "blockIdx") && find(k->grid, module, "gridDim") && find(k->threads, module, "blockDim") &&
                 find(k->shared, module, "cuda_shared") && find(k->sync, module, "cuda_sync") &&
                 find(k->exchange, module, "cuda_exchange");
    *function = k;
    return whole ? 0 : NOT_FOUND;
}
CUDA int cuFuncSetAttribute(void *, int, int) { MAY_FAIL return 0; }
// A small number, so that the loop of an indirect launch runs more than once.
CUDA int cuOccupancyMaxActiveBlocksPerMultiprocessor(int *blocks, void *, int, size_t) { MAY_FAIL *blocks = 2; return 0; }

enum class Fiber { Ready, Done };
// A fiber and the launcher enter each other by `_longjmp`: `swapcontext` calls the kernel of the operating
// system, which took nine tenths of the time of kernels that exchange values.
struct FiberState { std::vector<char> stack; jmp_buf at; bool has_begun; };
static jmp_buf launcher;
// A deque, because a fiber does not move.
static std::deque<FiberState> fibers;
static std::vector<Fiber> states;
static std::vector<unsigned> words;
static std::vector<unsigned> order_of_threads, order_of_blocks;
static unsigned running;
static Kernel *kernel;
static void **arguments;

// The numbers below `count`, in another order in each call where CUDA_ON_CPU_ORDER is a seed.
static const std::vector<unsigned> &order(unsigned count, std::vector<unsigned> &all) {
    static const char *seed = getenv("CUDA_ON_CPU_ORDER");
    static uint64_t random = seed ? strtoull(seed, nullptr, 10) * 2 + 1 : 0;
    if (all.size() != count) {
        all.resize(count);
        std::iota(all.begin(), all.end(), 0);
    }
    for (unsigned left = seed ? count : 0; left > 1; left--) {
        // Knuth's MMIX generator; its high bits are the better ones.
        random = random * 6364136223846793005 + 1442695040888963407;
        std::swap(all[left - 1], all[(random >> 32) * left >> 32]);
    }
    return all;
}

static void leave() {
    if (_setjmp(fibers[running].at) == 0) _longjmp(launcher, 1);
}
// A fiber runs its thread of one block after the other, also of other kernels.
static void body() {
    for (;;) {
        kernel->run(arguments);
        states[running] = Fiber::Done;
        leave();
    }
}
static void enter() {
    FiberState &fiber = fibers[running];
    if (_setjmp(launcher) != 0) return;
    if (fiber.has_begun) _longjmp(fiber.at, 1);
    fiber.has_begun = true;
    ucontext_t begin;
    getcontext(&begin);
    begin.uc_stack.ss_sp = fiber.stack.data();
    begin.uc_stack.ss_size = fiber.stack.size();
    begin.uc_link = nullptr;
    makecontext(&begin, body, 0);
    setcontext(&begin);
}
static unsigned exchange(unsigned word, unsigned other) {
    words[running] = word;
    leave();
    const unsigned found = words[other];
    leave();
    return found;
}
static void run_block(unsigned threads) {
    states.assign(threads, Fiber::Ready);
    for (unsigned done = 0; done < threads;) {
        done = 0;
        for (unsigned thread : order(threads, order_of_threads)) {
            running = thread;
            *kernel->thread = {running, 0, 0};
            if (states[running] != Fiber::Done) enter();
            done += states[running] == Fiber::Done;
        }
        if (done != 0 && done != threads) stop(kernel->name + ": a barrier that some threads of a block never reach");
    }
}
CUDA int cuLaunchKernel(void *function, unsigned gx, unsigned gy, unsigned gz, unsigned bx, unsigned by, unsigned bz, unsigned shared,
                        void *stream, void **parameters, void **) {
    MAY_FAIL
    if (current != CONTEXT) return NO_CONTEXT;
    if (stream != STREAM || gx == 0 || gy == 0 || gz == 0 || by != 1 || bz != 1) return INVALID;
    while (fibers.size() < bx) fibers.push_back({std::vector<char>(256 << 10), {}, false});
    kernel = (Kernel *)function;
    arguments = parameters;
    words.resize(bx);
    std::vector<char> memory(shared + 16);
    *kernel->shared = memory.data();
    *kernel->sync = leave;
    *kernel->exchange = exchange;
    *kernel->threads = {bx, by, bz};
    *kernel->grid = {gx, gy, gz};
    for (unsigned block : order(gx * gy * gz, order_of_blocks)) {
        *kernel->block = {block % gx, block / gx % gy, block / gx / gy};
        run_block(bx);
    }
    return 0;
}

// NVRTC.

struct Program { std::string text, log, image; };

static std::string between(const std::string &text, const std::string &from, const std::string &to, size_t &at) {
    const size_t begin = text.find(from, at);
    if (begin == std::string::npos) return {};
    const size_t end = text.find(to, begin + from.size());
    if (end == std::string::npos) stop("\"" + from + "\" without \"" + to + "\"");
    at = end + to.size();
    return text.substr(begin + from.size(), end - begin - from.size());
}
static void replace_all(std::string &text, const std::string &from, const std::string &to, const std::string &with_from,
                        const std::string &with_to) {
    for (size_t at = 0; (at = text.find(from, at)) != std::string::npos;) {
        size_t end = at;
        const std::string inner = between(text, from, to, end);
        text.replace(at, end - at, with_from + inner + with_to);
    }
}
// Converts a kernel to C++, and adds a function that calls it with CUDA's pointers to its
// arguments.
static std::string as_cpp(std::string text) {
    for (const char *bytes : {"4", "8", "16"}) {
        const std::string shared = std::string("extern __shared__ __align__(") + bytes + ") char ";
        replace_all(text, shared, "[];", "char* const ", " = cuda_shared;");
    }
    for (const char *name : {"add", "min", "max"}) {
        const std::string atom = std::string("asm volatile(\"atom.relaxed.") + name + ".u32 %0, [%1], %2;\" : \"=r\"(result) : \"l\"(";
        replace_all(text, atom, ") );", std::string("result = cuda_fetch_") + name + "((uint32_t*)", ");");
    }
    for (size_t at; (at = text.find("), \"r\"(")) != std::string::npos;) text.replace(at, 7, ", ");
    if (text.find("asm ") != std::string::npos || text.find("__shared__") != std::string::npos) return {};
    size_t head = text.rfind("extern \"C\" __global__");
    head = text.find("  ", head) + 2;
    const size_t open = text.find('(', head);
    std::string parameters = text.substr(open + 1, text.find(") {", open) - open - 1) + ", ", call;
    int number = 0;
    for (size_t at = 0, comma; (comma = parameters.find(", ", at)) != std::string::npos; at = comma + 2) {
        std::string type = parameters.substr(at, comma - at);
        type = type.substr(0, type.rfind(' '));
        for (const char *word : {"__restrict__", "__grid_constant__"})
            if (size_t found = type.find(word); found != std::string::npos) type.erase(found, strlen(word));
        call += (number ? ", *(" : "*(") + type + "*)a[" + std::to_string(number) + "]";
        number++;
    }
    const std::string name = text.substr(head, open - head);
    return "#include \"" HEADER "\"\n" + text + "\nextern \"C\" void cuda_run(void** a) { " + name + "(" + call + "); }\n";
}

static unsigned long long fnv(const std::string &text, unsigned long long hash) {
    for (unsigned char c : text) hash = (hash ^ c) * 0x100000001b3;
    return hash;
}

CUDA int nvrtcVersion(int *major, int *minor) { *major = 0, *minor = 0; return 0; }
CUDA int nvrtcGetNumSupportedArchs(int *count) { *count = 1; return 0; }
CUDA int nvrtcGetSupportedArchs(int *known) { known[0] = 90; return 0; }
CUDA int nvrtcCreateProgram(void **program, const char *text, const char *, int, const char **, const char **) {
    *program = new Program{text, "", ""};
    return 0;
}
CUDA int nvrtcCompileProgram(void *program, int, const char **) {
    auto *p = (Program *)program;
    const std::string cpp = as_cpp(p->text);
    if (cpp.empty()) {
        p->log = "assembly that is not known on the CPU";
        return 6;
    }
    Dl_info self;
    if (!dladdr((void *)nvrtcCompileProgram, &self)) stop("the path of this library is not known");
    const std::string own = self.dli_fname, folder = own.substr(0, own.rfind('/')) + "/kernels";
    const std::string flags = "-w -std=c++17 -O1 -fno-strict-aliasing -ffp-contract=off -fPIC -shared";
    std::ifstream header(HEADER);
    const std::string definitions(std::istreambuf_iterator<char>(header), {});
    char hash[33];
    const std::string all = cpp + definitions + flags;
    snprintf(hash, sizeof hash, "%016llx%016llx", fnv(all, 0xcbf29ce484222325), fnv(all, 0x84222325cbf29ce4));
    const std::string library = folder + "/" + hash + ".so";
    p->image = MAGIC + library;
    if (access(library.c_str(), R_OK) == 0) return 0;
    mkdir(folder.c_str(), 0777);
    std::string unfinished = folder + "/XXXXXX";
    if (!mkdtemp(unfinished.data())) stop("no folder " + folder);
    std::ofstream(unfinished + "/kernel.cpp") << cpp;
    const std::string command = "cd " + unfinished + " && c++ " + flags + " -o kernel.so kernel.cpp 2> log";
    const bool compiled = system(command.c_str()) == 0;
    std::ifstream log(unfinished + "/log");
    p->log.assign(std::istreambuf_iterator<char>(log), {});
    // Another process may have compiled the same text. Either file will do.
    if (compiled && rename((unfinished + "/kernel.so").c_str(), library.c_str()) != 0) stop("no file " + library);
    for (const char *file : {"/kernel.cpp", "/log", ""}) remove((unfinished + file).c_str());
    return compiled ? 0 : 6;
}
CUDA int nvrtcGetProgramLogSize(void *program, size_t *size) { *size = ((Program *)program)->log.size() + 1; return 0; }
CUDA int nvrtcGetProgramLog(void *program, char *log) { strcpy(log, ((Program *)program)->log.c_str()); return 0; }
CUDA int nvrtcGetCUBINSize(void *program, size_t *size) { *size = ((Program *)program)->image.size() + 1; return 0; }
CUDA int nvrtcGetCUBIN(void *program, char *image) { strcpy(image, ((Program *)program)->image.c_str()); return 0; }
CUDA int nvrtcGetPTXSize(void *program, size_t *size) { return nvrtcGetCUBINSize(program, size); }
CUDA int nvrtcGetPTX(void *program, char *image) { return nvrtcGetCUBIN(program, image); }
CUDA int nvrtcDestroyProgram(void **program) { delete (Program *)*program; return 0; }
CUDA const char *nvrtcGetErrorString(int) { return "see nvrtc.h"; }

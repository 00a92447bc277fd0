//! A library that is preloaded into the tool (`LD_PRELOAD`), compiled by the test itself. It makes
//! calls of the C library fail.
//!
//! The environment variable `FAULT` is the kind of the call, the number of the call that fails,
//! counted from 1 when the program begins, and what fails: `once` or `from` then on. The file that
//! `FAULT_HIT` names is made when a call fails.
use std::ffi::{CStr, c_char, c_int, c_long, c_uint, c_void};
use std::mem::transmute;
use std::ptr::null_mut;
use std::sync::atomic::{AtomicI64, AtomicU8, AtomicUsize, Ordering::Relaxed};

const EIO: c_int = 5;
const EAGAIN: c_int = 11;
const ENOMEM: c_int = 12;
const EACCES: c_int = 13;
const ENOSPC: c_int = 28;
const NEXT: *mut c_void = -1_isize as *mut c_void;

#[derive(Clone, Copy, PartialEq)]
#[repr(u8)]
enum Kind {
    Write = 1,
    Read,
    Open,
    Create,
    Sync,
    Stat,
    Change,
    Remove,
    Map,
    Allocate,
    Thread,
    Rights,
    Clock,
}

const NAMES: [(&CStr, Kind); 13] = [
    (c"write", Kind::Write),
    (c"read", Kind::Read),
    (c"open", Kind::Open),
    (c"create", Kind::Create),
    (c"sync", Kind::Sync),
    (c"stat", Kind::Stat),
    (c"change", Kind::Change),
    (c"remove", Kind::Remove),
    (c"map", Kind::Map),
    (c"allocate", Kind::Allocate),
    (c"thread", Kind::Thread),
    (c"rights", Kind::Rights),
    (c"clock", Kind::Clock),
];

static KIND: AtomicU8 = AtomicU8::new(0);
/// Calls until the one that fails.
static LEFT: AtomicI64 = AtomicI64::new(0);
static ONCE: AtomicU8 = AtomicU8::new(1);
/// Whether the tool has begun. The standard library, which runs before, ends the process where it
/// gets no memory.
static BEGUN: AtomicU8 = AtomicU8::new(0);

unsafe extern "C" {
    fn getenv(name: *const c_char) -> *mut c_char;
    fn strcmp(a: *const c_char, b: *const c_char) -> c_int;
    fn strtol(text: *const c_char, end: *mut *mut c_char, base: c_int) -> c_long;
    fn strncmp(a: *const c_char, b: *const c_char, count: usize) -> c_int;
    fn strlen(text: *const c_char) -> usize;
    fn dlsym(library: *mut c_void, name: *const c_char) -> *mut c_void;
    fn __errno_location() -> *mut c_int;
    fn __libc_malloc(bytes: usize) -> *mut c_void;
    fn __libc_calloc(count: usize, bytes: usize) -> *mut c_void;
    fn __libc_realloc(old: *mut c_void, bytes: usize) -> *mut c_void;
    fn __libc_memalign(alignment: usize, bytes: usize) -> *mut c_void;
    fn close(file: c_int) -> c_int;
    fn chmod(path: *const c_char, mode: c_uint) -> c_int;
    fn setresgid(real: c_uint, effective: c_uint, saved: c_uint) -> c_int;
    fn setresuid(real: c_uint, effective: c_uint, saved: c_uint) -> c_int;
    fn getuid() -> c_uint;
}

#[used]
#[unsafe(link_section = ".init_array")]
static BEGIN: extern "C" fn() = begin;

/// `FAULT` is `KIND NUMBER once` or `KIND NUMBER from`.
extern "C" fn begin() {
    unsafe {
        let text = getenv(c"FAULT".as_ptr());
        if text.is_null() {
            return;
        }
        for (name, kind) in NAMES {
            let length = strlen(name.as_ptr());
            if strncmp(text, name.as_ptr(), length) == 0 && *text.add(length) == b' ' as c_char {
                let mut end = null_mut();
                LEFT.store(strtol(text.add(length), &mut end, 10), Relaxed);
                ONCE.store((strcmp(end, c" once".as_ptr()) == 0).into(), Relaxed);
                KIND.store(kind as u8, Relaxed);
            }
        }
    }
}

/// Counts a call, and tells whether it fails.
fn fails(kind: Kind) -> bool {
    if KIND.load(Relaxed) != kind as u8 {
        return false;
    }
    let left = LEFT.fetch_sub(1, Relaxed);
    if left == 1 {
        const CREATE_TO_WRITE: c_int = 0o101;
        unsafe { close(real_open(getenv(c"FAULT_HIT".as_ptr()), CREATE_TO_WRITE, 0o644)) };
    }
    left == 1 || left < 1 && ONCE.load(Relaxed) == 0
}

/// From the chosen call on, the folder that `FAULT_FOLDER` names takes no new files.
fn lose_rights() {
    if fails(Kind::Rights) {
        const NOBODY: c_uint = 65_534;
        unsafe {
            chmod(getenv(c"FAULT_FOLDER".as_ptr()), 0o555);
            if getuid() == 0 {
                setresgid(NOBODY, NOBODY, NOBODY);
                setresuid(NOBODY, NOBODY, NOBODY);
            }
        }
    }
}

fn set_error(number: c_int) {
    unsafe { *__errno_location() = number };
}

/// The function of the C library with this name.
fn real(found: &AtomicUsize, name: &CStr) -> usize {
    if found.load(Relaxed) == 0 {
        found.store(unsafe { dlsym(NEXT, name.as_ptr()) } as usize, Relaxed);
    }
    found.load(Relaxed)
}

unsafe fn real_open(path: *const c_char, flags: c_int, mode: c_uint) -> c_int {
    static REAL: AtomicUsize = AtomicUsize::new(0);
    unsafe {
        let open: unsafe extern "C" fn(*const c_char, c_int, c_uint) -> c_int =
            transmute(real(&REAL, c"open64"));
        open(path, flags, mode)
    }
}

/// Functions of the C library. Where the condition holds, they fail with an error number and -1 in
/// place of the result.
macro_rules! faulty {
    ($($name:ident($($argument:ident: $type:ty),*) -> $out:ty: $condition:expr => $error:expr, $result:expr;)*) => {$(
        #[unsafe(no_mangle)]
        unsafe extern "C" fn $name($($argument: $type),*) -> $out {
            static REAL: AtomicUsize = AtomicUsize::new(0);
            if $condition {
                set_error($error);
                return $result;
            }
            unsafe {
                let name = CStr::from_bytes_with_nul_unchecked(concat!(stringify!($name), "\0").as_bytes());
                let real: unsafe extern "C" fn($($type),*) -> $out = transmute(real(&REAL, name));
                real($($argument),*)
            }
        }
    )*};
}

type Text = *const c_char;
type Bytes = *mut c_void;

/// Messages on stderr never fail.
fn write_fails(file: c_int) -> bool {
    lose_rights();
    file != 2 && fails(Kind::Write)
}

fn open_fails(flags: c_int) -> bool {
    const CREATE: c_int = 0o100;
    lose_rights();
    fails(if flags & CREATE == 0 { Kind::Open } else { Kind::Create })
}

fn sync_fails() -> bool {
    lose_rights();
    fails(Kind::Sync)
}

faulty! {
    write(file: c_int, bytes: Bytes, count: usize) -> isize: write_fails(file) => ENOSPC, -1;
    writev(file: c_int, bytes: Bytes, count: c_int) -> isize: write_fails(file) => ENOSPC, -1;
    read(file: c_int, bytes: Bytes, count: usize) -> isize: fails(Kind::Read) => EIO, -1;
    open(path: Text, flags: c_int, mode: c_uint) -> c_int: open_fails(flags) => EACCES, -1;
    open64(path: Text, flags: c_int, mode: c_uint) -> c_int: open_fails(flags) => EACCES, -1;
    openat64(folder: c_int, path: Text, flags: c_int, mode: c_uint) -> c_int: open_fails(flags) => EACCES, -1;
    mkdir(path: Text, mode: c_uint) -> c_int: fails(Kind::Create) => ENOSPC, -1;
    opendir(path: Text) -> Bytes: fails(Kind::Open) => EACCES, null_mut();
    fsync(file: c_int) -> c_int: sync_fails() => EIO, -1;
    fdatasync(file: c_int) -> c_int: sync_fails() => EIO, -1;
    stat64(path: Text, found: Bytes) -> c_int: fails(Kind::Stat) => EIO, -1;
    lstat64(path: Text, found: Bytes) -> c_int: fails(Kind::Stat) => EIO, -1;
    fstat64(file: c_int, found: Bytes) -> c_int: fails(Kind::Stat) => EIO, -1;
    fstatat64(folder: c_int, path: Text, found: Bytes, flags: c_int) -> c_int: fails(Kind::Stat) => EIO, -1;
    statx(folder: c_int, path: Text, flags: c_int, mask: c_uint, found: Bytes) -> c_int: fails(Kind::Stat) => EIO, -1;
    realpath(path: Text, found: Bytes) -> Bytes: fails(Kind::Stat) => EIO, null_mut();
    readlink(path: Text, found: Bytes, size: usize) -> isize: fails(Kind::Stat) => EIO, -1;
    getcwd(found: Bytes, size: usize) -> Bytes: fails(Kind::Stat) => EIO, null_mut();
    fchmod(file: c_int, mode: c_uint) -> c_int: fails(Kind::Change) => EIO, -1;
    fchown(file: c_int, owner: c_uint, group: c_uint) -> c_int: fails(Kind::Change) => EIO, -1;
    flock(file: c_int, how: c_int) -> c_int: fails(Kind::Change) => EIO, -1;
    ftruncate64(file: c_int, bytes: i64) -> c_int: fails(Kind::Change) => EIO, -1;
    lseek64(file: c_int, bytes: i64, from: c_int) -> i64: fails(Kind::Change) => EIO, -1;
    rename(from: Text, to: Text) -> c_int: fails(Kind::Change) => EACCES, -1;
    unlink(path: Text) -> c_int: fails(Kind::Remove) => EIO, -1;
    mmap64(at: Bytes, bytes: usize, rights: c_int, flags: c_int, file: c_int, from: i64) -> Bytes: file >= 0 && fails(Kind::Map) => ENOMEM, NEXT;
}

#[unsafe(no_mangle)]
unsafe extern "C" fn pthread_create(id: Bytes, how: Bytes, work: Bytes, argument: Bytes) -> c_int {
    static REAL: AtomicUsize = AtomicUsize::new(0);
    if fails(Kind::Thread) {
        return EAGAIN;
    }
    unsafe {
        let real: unsafe extern "C" fn(Bytes, Bytes, Bytes, Bytes) -> c_int =
            transmute(real(&REAL, c"pthread_create"));
        real(id, how, work, argument)
    }
}

/// The clock of the calendar goes back by a year at the chosen call.
#[unsafe(no_mangle)]
unsafe extern "C" fn clock_gettime(clock: c_int, found: *mut [i64; 2]) -> c_int {
    const CALENDAR: c_int = 0;
    static REAL: AtomicUsize = AtomicUsize::new(0);
    unsafe {
        let real: unsafe extern "C" fn(c_int, *mut [i64; 2]) -> c_int =
            transmute(real(&REAL, c"clock_gettime"));
        let result = real(clock, found);
        if clock == CALENDAR && fails(Kind::Clock) {
            (*found)[0] -= 365 * 86_400;
        }
        result
    }
}

/// The tool begins by catching aborts.
#[unsafe(no_mangle)]
unsafe extern "C" fn signal(number: c_int, handler: usize) -> usize {
    const ABORT: c_int = 6;
    static REAL: AtomicUsize = AtomicUsize::new(0);
    unsafe {
        let real: unsafe extern "C" fn(c_int, usize) -> usize = transmute(real(&REAL, c"signal"));
        let before = real(number, handler);
        BEGUN.fetch_or((number == ABORT).into(), Relaxed);
        before
    }
}

fn allocated(at: impl FnOnce() -> *mut c_void) -> *mut c_void {
    if BEGUN.load(Relaxed) != 0 && fails(Kind::Allocate) {
        set_error(ENOMEM);
        return null_mut();
    }
    at()
}

#[unsafe(no_mangle)]
unsafe extern "C" fn malloc(bytes: usize) -> *mut c_void {
    allocated(|| unsafe { __libc_malloc(bytes) })
}

#[unsafe(no_mangle)]
unsafe extern "C" fn calloc(count: usize, bytes: usize) -> *mut c_void {
    allocated(|| unsafe { __libc_calloc(count, bytes) })
}

#[unsafe(no_mangle)]
unsafe extern "C" fn realloc(old: *mut c_void, bytes: usize) -> *mut c_void {
    allocated(|| unsafe { __libc_realloc(old, bytes) })
}

#[unsafe(no_mangle)]
unsafe extern "C" fn posix_memalign(at: *mut *mut c_void, alignment: usize, bytes: usize) -> c_int {
    let found = allocated(|| unsafe { __libc_memalign(alignment, bytes) });
    if found.is_null() {
        return ENOMEM;
    }
    unsafe { *at = found };
    0
}

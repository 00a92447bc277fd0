//! A documented exit code where the standard library aborts the process.

/// From now on the process ends with exit code 2 and a hint where it would be aborted.
///
/// Where a file or an option says how much memory is wanted, a failed allocation is an error like
/// others. Collections that grow with the work are not checked everywhere. When one of them gets no
/// memory, the standard library prints how many bytes it asked for, and aborts.
pub fn give_exit_code() {
    #[cfg(unix)]
    // SAFETY: the handler calls nothing but `write` and `_exit`, which POSIX lists as safe in signal
    // handlers.
    unsafe {
        let handler = on_abort as extern "C" fn(libc::c_int);
        libc::signal(libc::SIGABRT, handler as libc::sighandler_t);
    }
}

#[cfg(unix)]
extern "C" fn on_abort(_: libc::c_int) {
    const MESSAGE: &[u8] = b"error: tesdf cannot go on, for the reason in the lines above\n\
        hint: where memory is short, take a smaller file or fewer --threads\n";
    // SAFETY: the pointer and the length are of one constant; `_exit` does not return.
    unsafe {
        libc::write(2, MESSAGE.as_ptr().cast(), MESSAGE.len());
        libc::_exit(2)
    }
}

//! Gives the process a documented exit code when the standard library aborts it.

/// Makes an abort end the process with exit code 2 and a hint.
///
/// A failed allocation is an ordinary error where a file or an option determines the amount of
/// memory. Collections that grow with the work are not all checked: when one of them gets no
/// memory, the standard library prints the number of bytes and aborts.
pub fn give_exit_code() {
    #[cfg(unix)]
    // SAFETY: the handler calls nothing but `write` and `_exit`, which POSIX lists as safe in
    // signal handlers.
    unsafe {
        let handler = on_abort as extern "C" fn(libc::c_int);
        libc::signal(libc::SIGABRT, handler as libc::sighandler_t);
    }
}

#[cfg(unix)]
extern "C" fn on_abort(_: libc::c_int) {
    const MESSAGE: &[u8] = b"error: tesdf cannot continue; the lines above give the reason\n\
        hint: if memory is short, use a smaller file or fewer --threads\n";
    // SAFETY: the pointer and the length belong to one constant; `_exit` does not return.
    unsafe {
        libc::write(2, MESSAGE.as_ptr().cast(), MESSAGE.len());
        libc::_exit(2)
    }
}

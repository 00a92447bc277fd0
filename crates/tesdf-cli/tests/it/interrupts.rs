//! Signals that end a command while it reads.
use std::fs::{File, OpenOptions};
use std::os::unix::fs::OpenOptionsExt as _;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use crate::folder::{Folder, texts, wait_for_handler};

/// A command that catches signals, and waits for what nobody writes into a pipe. The end of the pipe
/// is returned, too.
fn reading(folder: &Folder, before: &str, args: &str) -> (Child, File) {
    let program = folder.command(&[]).get_program().to_owned();
    let child = Command::new("sh")
        // The tests may themselves run where SIGHUP is ignored.
        .args(["-c", &format!("exec env --default-signal=HUP sh -c \"{before} exec '$0' {args}\"")])
        .arg(program)
        .current_dir(folder.path(""))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    wait_for_handler(&child);
    // Opens without waiting, but not before there is a reader.
    let mut pipe = OpenOptions::new();
    pipe.write(true).custom_flags(libc::O_NONBLOCK);
    loop {
        match pipe.open(folder.path("pipe.stl")) {
            Ok(end) => return (child, end),
            Err(e) => assert_eq!(e.raw_os_error(), Some(libc::ENXIO), "{e}"),
        }
        sleep(Duration::from_millis(5));
    }
}

fn send(signal: &str, child: &Child) {
    assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
}

#[test]
fn signals_end_a_command_that_reads_and_leave_its_output() {
    let folder = Folder::new();
    assert!(Command::new("mkfifo").arg(folder.path("pipe.stl")).status().unwrap().success());
    folder.write("a.tesdf", "what was here before");
    for args in ["check pipe.stl", "encode pipe.stl -o a.tesdf"] {
        for signal in ["-INT", "-TERM", "-HUP"] {
            let (child, _end) = reading(&folder, "", args);
            send(signal, &child);
            let (code, out, err) = texts(child.wait_with_output().unwrap());
            assert_eq!((code, out.as_str()), (Some(2), ""), "{args} {signal}");
            assert!(
                err.starts_with("error: interrupted; no output is half written"),
                "{args} {signal}: {err}"
            );
        }
    }
    assert_eq!(folder.names(), ["a.tesdf", "pipe.stl"]);
    assert_eq!(std::fs::read(folder.path("a.tesdf")).unwrap(), b"what was here before");
}

#[test]
fn a_command_that_ignores_the_end_of_its_terminal_goes_on() {
    let folder = Folder::new();
    assert!(Command::new("mkfifo").arg(folder.path("pipe.stl")).status().unwrap().success());
    // As `nohup` does.
    let (mut child, _end) = reading(&folder, "trap '' HUP;", "check pipe.stl");
    sleep(Duration::from_millis(50));
    send("-HUP", &child);
    sleep(Duration::from_millis(200));
    assert_eq!(child.try_wait().unwrap(), None);
    send("-TERM", &child);
    assert_eq!(child.wait().unwrap().code(), Some(2));
}

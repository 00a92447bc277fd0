//! Signals that end a command while it reads.
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::folder::{Folder, texts, wait_for_handler};

/// A command that reads from a pipe into which nobody writes, once it catches signals.
fn reading(folder: &Folder, before: &str, args: &str) -> Child {
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
    child
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
            let child = reading(&folder, "", args);
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
    let mut child = reading(&folder, "trap '' HUP;", "check pipe.stl");
    std::thread::sleep(Duration::from_millis(50));
    send("-HUP", &child);
    std::thread::sleep(Duration::from_millis(200));
    assert_eq!(child.try_wait().unwrap(), None);
    send("-TERM", &child);
    assert_eq!(child.wait().unwrap().code(), Some(2));
}

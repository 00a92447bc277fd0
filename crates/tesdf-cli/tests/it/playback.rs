//! `tesdf export` and `tesdf view`

use crate::folder::Folder;

/// A ball that drops on a plane, next to a ball that lies there: 20 steps.
const DROP: &str = r#"
time_step = 2e-3
duration = 0.04

[[bodies]]
name = "floor"
shape = "plane"
fixed = true

[[bodies]]
name = "ball"
shape = { sphere = { radius = 0.01 } }
density = 1000
translation = [0, 0, 0.0105]

[[bodies]]
name = "</script> & ball"
shape = { sphere = { radius = 0.01 } }
density = 1000
translation = [0.1, 0, 0.01]
"#;

fn simulated() -> Folder {
    let folder = Folder::new();
    folder.write("drop.toml", DROP);
    folder.good(&["simulate", "drop.toml", "-o", "run"]);
    folder
}

#[test]
fn a_run_becomes_a_glb_file() {
    let folder = simulated();
    let text = folder.good(&["export", "run", "-o", "run.glb"]);
    assert!(text.contains("21 of 21 states") && text.contains("bodies"), "{text}");
    let bytes = std::fs::read(folder.path("run.glb")).unwrap();
    assert_eq!(&bytes[..4], b"glTF");
    folder.good(&["export", "run", "-o", "again.glb"]);
    assert!(bytes == std::fs::read(folder.path("again.glb")).unwrap());

    let text = folder.good(&["export", "run", "-o", "few.glb", "--every", "7", "--speed", "0.1"]);
    assert!(text.contains("4 of 21 states"), "{text}");
    let text = folder.good(&["export", "run", "-o", "few.glb", "--fps", "100"]);
    assert!(text.contains("5 of 21 states"), "{text}");
}

#[test]
fn what_cannot_be_exported_is_refused() {
    let folder = simulated();
    folder.write("text", "no run");
    for (args, expected) in [
        (&["text", "-o", "a.glb"][..], "not a run of tesdf"),
        (&["run", "-o", "run"][..], "is the input run itself"),
        (&["run", "-o", "a.glb", "--every", "0"][..], "--every"),
        (&["run", "-o", "a.glb", "--fps", "0"][..], "greater than 0"),
        (&["run", "-o", "a.glb", "--speed", "-1"][..], "greater than 0"),
        (&["run", "-o", "a.glb", "--geometry", "cup=cup.stl"][..], "there is no body cup"),
        (&["run", "-o", "a.glb", "--geometry", "ball=none.tesdf"][..], "--geometry BODY=FILE"),
    ] {
        let (code, _, err) = folder.tesdf(&[&["export"], args].concat());
        assert_eq!(code, Some(2), "{args:?}: {err}");
        assert!(err.contains(expected), "{args:?}: {err}");
    }
    assert_eq!(folder.names(), ["drop.toml", "run", "text"]);
}

#[test]
fn a_run_becomes_a_page() {
    let folder = simulated();
    let text = folder.good(&["view", "run", "-o", "page.html"]);
    assert!(text.contains("21 of 21 states") && text.contains("at most 2 in a frame"), "{text}");
    let page = std::fs::read_to_string(folder.path("page.html")).unwrap();
    assert!(page.contains("<title>run</title>") && page.contains(r#""name":"\u003c/script> & ball""#));
    assert_eq!(page.matches("</script>").count(), 3, "the name of a body ends no script");
    assert_eq!(page.matches("</html>").count(), 1);
    for address in ["http:", "https:", "//cdn", "src="] {
        let found = page.lines().find(|line| line.contains(address));
        assert_eq!(found, None, "a page asks for nothing");
    }
    folder.good(&["view", "run", "-o", "again.html"]);
    assert!(page == std::fs::read_to_string(folder.path("again.html")).unwrap());

    let text = folder.good(&[
        "view",
        "run",
        "-o",
        "few.html",
        "--every",
        "5",
        "--contacts",
        "0",
        "--title",
        "A <b> & c",
    ]);
    assert!(text.contains("5 of 21 states") && text.contains("none drawn"), "{text}");
    let page = std::fs::read_to_string(folder.path("few.html")).unwrap();
    assert!(page.contains("<h1>A &lt;b> &amp; c</h1>") && page.contains(r#""contacts":null"#));
    let (code, _, err) = folder.tesdf(&["view", "run", "-o", "run"]);
    assert!(code == Some(2) && err.contains("is the input run itself"), "{err}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_page_follows_a_run_and_is_served_until_ctrl_c() {
    use std::io::{BufRead, BufReader, Read, Write};
    use std::net::TcpStream;
    use std::process::{Command, Stdio};
    let folder = Folder::new();
    folder.write("drop.toml", DROP);
    let mut child = folder
        .command(&["simulate", "drop.toml", "-o", "run", "--view"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut notes = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
    let address = notes.find_map(|line| {
        let (_, url) = line.split_once("the run is shown at http://")?;
        Some(url.trim_end_matches('/').to_string())
    });
    let address = address.unwrap();
    let mut stream = TcpStream::connect(&address).unwrap();
    write!(stream, "GET /frames HTTP/1.1\r\nHost: {address}\r\n\r\n").unwrap();
    let mut events = String::new();
    stream.read_to_string(&mut events).unwrap();
    assert!(events.contains("\"step\":20,") && events.ends_with("event: end\ndata: \n\n"), "{events}");
    assert!(notes.any(|line| line.contains("the run has ended")));
    assert_eq!(child.try_wait().unwrap(), None);
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let (code, out, _) = crate::folder::texts(child.wait_with_output().unwrap());
    assert!(code == Some(0) && out.contains("20 steps"), "{code:?} {out}");
    // The run is that of the command without a page.
    folder.good(&["simulate", "drop.toml", "-o", "plain"]);
    assert!(std::fs::read(folder.path("run")).unwrap() == std::fs::read(folder.path("plain")).unwrap());
}

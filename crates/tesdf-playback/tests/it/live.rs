//! The page that follows a run: what its server answers.
use std::io::{Read, Write};
use std::net::TcpStream;
use std::ops::ControlFlow;
use std::time::Duration;

use serde_json::Value;
use tesdf_playback::LiveView;
use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::{Dynamics, simulate};

const SCENE: &str = r#"
time_step = 2e-3
duration = 0.02

[[bodies]]
name = "floor"
shape = "plane"
fixed = true

[[bodies]]
name = "box"
shape = { box = { half_extents = [0.02, 0.02, 0.01] } }
mass = 0.5
translation = [3, 0, 0.01]
"#;

/// A request to the server of the view, whose answer has not been read.
fn ask(view: &LiveView, path: &str, host: Option<&str>, more: &str) -> TcpStream {
    let url = view.url();
    let address = url.trim_start_matches("http://").trim_end_matches('/');
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {}\r\n{more}\r\n", host.unwrap_or(address)).unwrap();
    stream
}

fn text(mut stream: TcpStream) -> String {
    let mut text = String::new();
    stream.read_to_string(&mut text).unwrap();
    text
}

#[test]
fn a_page_is_sent_the_states_and_forces_of_the_run() {
    let loaded = LoadedScene::parse(SCENE.into(), "scene.toml").unwrap();
    let mut engine = loaded.newton(loaded.system().unwrap()).unwrap();
    let mut view = LiveView::open(engine.system(), "<b>").unwrap();
    let page = text(ask(&view, "/", None, ""));
    assert!(page.starts_with("HTTP/1.1 200 OK\r\n"), "{}", &page[..60]);
    assert!(page.contains("<h1>&lt;b></h1>") && page.contains("connect-src 'self'"));
    let early = ask(&view, "/frames", None, "");
    let mut last = None;
    simulate(&loaded.scene, &mut engine, |moment| {
        match moment.step == moment.steps {
            true => view.end(&moment.into()).unwrap(),
            false => view.show(&moment.into()).unwrap(),
        }
        last = Some((moment.system.states()[1].pose.translation, moment.forces.unwrap().clone()));
        ControlFlow::Continue(())
    })
    .unwrap();
    let events = text(early);
    assert!(events.contains("text/event-stream") && events.ends_with("event: end\ndata: \n\n"), "{events}");
    let frames: Vec<&str> = events.lines().filter_map(|line| line.strip_prefix("data: {")).collect();
    let frame: Value = serde_json::from_str(&format!("{{{}", frames[frames.len() - 1])).unwrap();
    assert_eq!((frame["step"].as_u64(), frame["time"].as_f64()), (Some(10), Some(0.02)));
    assert_eq!(frame["poses"].as_array().unwrap().len(), 14);
    // Positions are relative to the middle of the bodies at the beginning, where the box was.
    let ((at, forces), z) = (last.unwrap(), frame["poses"][9].as_f64().unwrap());
    assert!((z - (at.z - 0.01)).abs() < 1e-6, "{z} {at}");
    assert_eq!(frame["forces"]["found"], forces.contacts.len());
    let up: f64 =
        (0..forces.contacts.len()).map(|k| frame["forces"]["vectors"][3 * k + 2].as_f64().unwrap()).sum();
    assert!((up - 0.5 * 9.81).abs() < 1e-3, "{up}");
    // A page that was interrupted asks for what it lacks.
    let later = text(ask(&view, "/frames", None, &format!("Last-Event-ID: {}\r\n", frames.len() - 2)));
    assert_eq!(later.lines().filter(|line| line.starts_with("data: {")).count(), 1, "{later}");
}

#[test]
fn others_are_refused_and_a_dropped_view_answers_no_more() {
    let loaded = LoadedScene::parse(SCENE.into(), "scene.toml").unwrap();
    let view = LiveView::open(&loaded.system().unwrap(), "run").unwrap();
    assert!(text(ask(&view, "/", Some("example.org"), "")).starts_with("HTTP/1.1 403 "));
    assert!(text(ask(&view, "/etc/passwd", None, "")).starts_with("HTTP/1.1 404 "));
    assert!(text(ask(&view, "/frames?x", None, "")).starts_with("HTTP/1.1 404 "));
    let (mut open, url) = (ask(&view, "/frames", None, ""), view.url());
    open.read_exact(&mut [0; 15]).unwrap();
    drop(view);
    assert!(text(open).ends_with("event: end\ndata: \n\n"));
    let address = url.trim_start_matches("http://").trim_end_matches('/').to_string();
    let refused = (0..100).any(|_| {
        std::thread::sleep(Duration::from_millis(20));
        TcpStream::connect(&address).is_err()
    });
    assert!(refused, "{address} still answers");
}

//! A page that follows a run while it is made.
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::json;
use tesdf::glam::{DQuat, DVec3};
use tesdf_sim::{Forces, Moment, RunRecord, System};

use crate::forces::{DrawnForce, drawn};
use crate::page;
use crate::playback::checked;
use crate::{ContactOptions, Frames, Playback, PlaybackError};

/// Least wall time between two frames: browsers draw no more than 60 a second.
const PAUSE: Duration = Duration::from_millis(16);
/// Longest head of a request, bytes.
const HEAD: u64 = 16_384;
/// How long a browser may take to send a request.
const PATIENCE: Duration = Duration::from_secs(5);
/// Most connections at a time.
const MOST: usize = 32;
/// Most text of frames that is kept for pages that are opened later, bytes: some minutes of every
/// frame, for a hundred bodies.
const KEPT: usize = 64 << 20;

/// A state of a run that a [`LiveView`] shows.
#[derive(Clone, Copy, Debug)]
pub struct LiveFrame<'a> {
    /// Number of steps so far.
    pub step: u64,
    /// Simulated time, s.
    pub time: f64,
    /// The bodies.
    pub system: &'a System,
    /// The forces of the last step, where they are known.
    pub forces: Option<&'a Forces>,
}

impl<'a> From<&Moment<'a>> for LiveFrame<'a> {
    fn from(&Moment { step, time, system, forces, .. }: &Moment<'a>) -> Self {
        Self { step, time, system, forces }
    }
}

/// A page on this machine that follows a run while it is made. It is served on the loopback
/// interface alone, until this value is dropped; pages that are open then keep what they have.
///
/// A page that is opened later gets the states since the beginning. At most 64 MiB of them are kept:
/// where there would be more, every other one is dropped, so old states are farther apart in time
/// than new ones.
#[derive(Debug)]
pub struct LiveView {
    address: SocketAddr,
    shared: Arc<Shared>,
    /// The middle of the page, m, world frame, and the diagonal of the bodies, m.
    centre: DVec3,
    diagonal: f64,
    /// What each body's pose is told of, in its frame, m.
    origins: Vec<DVec3>,
    /// Rotations of the last frame.
    rotations: Vec<DQuat>,
    last: Option<Instant>,
}

#[derive(Debug, Default)]
struct Shared {
    page: String,
    sent: Mutex<Sent>,
    grown: Condvar,
    connections: AtomicUsize,
}

/// What pages are sent.
#[derive(Debug, Default)]
struct Sent {
    frames: Vec<SentFrame>,
    /// Number of frames so far, with those that were dropped.
    count: usize,
    /// Of the text of `frames`.
    bytes: usize,
    has_ended: bool,
    is_closed: bool,
}

/// A frame as pages are sent it.
#[derive(Clone, Debug)]
struct SentFrame {
    number: usize,
    text: Arc<str>,
}

impl Sent {
    /// Adds a frame. Where all are more than `most` bytes then, every other one is dropped, but for
    /// the first and the last one.
    fn push(&mut self, text: &str, most: usize) {
        self.bytes += text.len();
        self.frames.push(SentFrame { number: self.count, text: text.into() });
        self.count += 1;
        if self.bytes > most {
            let last = self.frames.len() - 1;
            let mut k = 0..;
            self.frames.retain(|_| k.next().is_some_and(|k| k == last || k % 2 == 0));
            self.bytes = self.frames.iter().map(|frame| frame.text.len()).sum();
        }
    }

    /// The frames from number `next` on.
    fn from(&self, next: usize) -> &[SentFrame] {
        &self.frames[self.frames.partition_point(|frame| frame.number < next)..]
    }
}

impl LiveView {
    /// Serves a page with the present state of `system`. `title` is its heading.
    ///
    /// # Errors
    /// [`PlaybackError::State`] for a state that is not valid, [`PlaybackError::Serve`] where the
    /// machine has no loopback interface.
    pub fn open(system: &System, title: &str) -> Result<Self, PlaybackError> {
        let begin = RunRecord::new(system, serde_json::Value::Null);
        let run = Playback::new(&begin, system, Frames::default())?;
        let serve = |e: std::io::Error| PlaybackError::Serve(e.to_string());
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).map_err(serve)?;
        let address = listener.local_addr().map_err(serve)?;
        let shared = Arc::new(Shared { page: page::live(&run, title)?, ..Shared::default() });
        let served = Arc::clone(&shared);
        let accept = move || accept(&listener, address, &served);
        thread::Builder::new().name("live view".into()).spawn(accept).map_err(serve)?;
        let origins: Vec<DVec3> = (0..run.bodies.len()).map(|body| run.origin(body)).collect();
        let rotations = vec![DQuat::IDENTITY; origins.len()];
        let (centre, diagonal) = (run.centre, run.diagonal());
        Ok(Self { address, shared, centre, diagonal, origins, rotations, last: None })
    }

    /// The address of the page, such as `http://127.0.0.1:41234/`.
    pub fn url(&self) -> String {
        format!("http://{}/", self.address)
    }

    /// Shows the bodies after a step. States that follow each other within 16 ms of
    /// wall time are left out.
    ///
    /// # Errors
    /// [`PlaybackError::State`] for a state that is not valid.
    pub fn show(&mut self, frame: &LiveFrame<'_>) -> Result<(), PlaybackError> {
        if self.last.is_some_and(|last| last.elapsed() < PAUSE) {
            return Ok(());
        }
        self.last = Some(Instant::now());
        let LiveFrame { step, time, system, forces } = *frame;
        let mut poses = Vec::with_capacity(7 * self.origins.len());
        for (body, state) in system.states().iter().enumerate().take(self.origins.len()) {
            let pose = checked(state.pose).map_err(|reason| PlaybackError::State {
                body: system.bodies()[body].name.clone(),
                step: step as usize,
                reason,
            })?;
            let before = &mut self.rotations[body];
            *before = if before.dot(pose.rotation) < 0.0 { -pose.rotation } else { pose.rotation };
            let at = pose.to_world(self.origins[body]) - self.centre;
            poses.extend(at.as_vec3().to_array());
            poses.extend(before.as_quat().to_array());
        }
        let forces = forces.map(|forces| {
            let (found, kept) = drawn(&forces.contacts, self.centre, self.diagonal, ContactOptions::MOST);
            let all = |of: fn(&DrawnForce) -> [f32; 3]| kept.iter().flat_map(of).collect::<Vec<f32>>();
            json!({
                "found": found,
                "points": all(|force| force.point.to_array()),
                "vectors": all(|force| force.force.to_array()),
            })
        });
        let frame = json!({ "time": time, "step": step, "poses": poses, "forces": forces }).to_string();
        self.shared.sent().push(&frame, KEPT);
        self.shared.grown.notify_all();
        Ok(())
    }

    /// As [`show`](Self::show), but of the last step: the page then says that the run has ended.
    ///
    /// # Errors
    /// [`PlaybackError::State`] for a state that is not valid.
    pub fn end(&mut self, frame: &LiveFrame<'_>) -> Result<(), PlaybackError> {
        self.last = None;
        self.show(frame)?;
        self.shared.sent().has_ended = true;
        self.shared.grown.notify_all();
        Ok(())
    }
}

impl Drop for LiveView {
    fn drop(&mut self) {
        self.shared.sent().is_closed = true;
        self.shared.grown.notify_all();
        // The thread that accepts connections waits for one.
        drop(TcpStream::connect_timeout(&self.address, PATIENCE));
    }
}

impl Shared {
    fn sent(&self) -> MutexGuard<'_, Sent> {
        self.sent.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The frames from number `next` on, once there are any or after some seconds, and whether
    /// there will be more.
    fn wait(&self, next: usize) -> (Vec<SentFrame>, bool) {
        let waits = |sent: &mut Sent| sent.count <= next && !sent.has_ended && !sent.is_closed;
        let waited = self.grown.wait_timeout_while(self.sent(), PATIENCE, waits);
        let (sent, _) = waited.unwrap_or_else(PoisonError::into_inner);
        (sent.from(next).to_vec(), !sent.has_ended && !sent.is_closed)
    }
}

/// Answers until the view is closed.
fn accept(listener: &TcpListener, address: SocketAddr, shared: &Arc<Shared>) {
    for stream in listener.incoming() {
        if shared.sent().is_closed {
            return;
        }
        let Ok(stream) = stream else { continue };
        let for_thread = Arc::clone(shared);
        if shared.connections.fetch_add(1, Ordering::Relaxed) >= MOST {
            shared.connections.fetch_sub(1, Ordering::Relaxed);
            continue;
        }
        let answer = move || {
            // A browser that has gone away is no error.
            drop(answer(&stream, address, &for_thread));
            for_thread.connections.fetch_sub(1, Ordering::Relaxed);
        };
        if thread::Builder::new().name("live view".into()).spawn(answer).is_err() {
            shared.connections.fetch_sub(1, Ordering::Relaxed);
        }
    }
}

/// Answers one request.
fn answer(mut stream: &TcpStream, address: SocketAddr, shared: &Shared) -> std::io::Result<()> {
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_nodelay(true)?;
    let mut lines = BufReader::new(stream.take(HEAD)).lines();
    let request = lines.next().transpose()?.unwrap_or_default();
    let (mut host, mut next) = (String::new(), 0);
    for line in lines {
        let line = line?;
        let Some((key, value)) = line.split_once(':') else { break };
        match &*key.to_ascii_lowercase() {
            "host" => host = value.trim().to_string(),
            "last-event-id" => next = value.trim().parse::<usize>().map_or(0, |last| last + 1),
            _ => {}
        }
    }
    // A page of another site could ask under a name that leads here.
    let port = address.port();
    if host != format!("127.0.0.1:{port}") && host != format!("localhost:{port}") {
        return write!(stream, "HTTP/1.1 403 Forbidden\r\nContent-Length: 0\r\nConnection: close\r\n\r\n");
    }
    match request.split(' ').take(2).collect::<Vec<_>>()[..] {
        ["GET", "/"] => write!(
            stream,
            "HTTP/1.1 200 OK\r\nContent-Type: text/html; charset=utf-8\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{}",
            shared.page.len(),
            shared.page
        ),
        ["GET", "/frames"] => stream_frames(stream, shared, next),
        _ => write!(stream, "HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"),
    }
}

/// Sends the frames from number `next` on as server-sent events.
fn stream_frames(mut stream: &TcpStream, shared: &Shared, mut next: usize) -> std::io::Result<()> {
    write!(
        stream,
        "HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\nCache-Control: no-store\r\nConnection: close\r\n\r\n"
    )?;
    loop {
        let (frames, goes_on) = shared.wait(next);
        let mut text = String::new();
        for SentFrame { number, text: frame } in &frames {
            text += &format!("id: {number}\ndata: {frame}\n\n");
            next = number + 1;
        }
        match goes_on {
            // A comment finds out whether the browser is still there.
            true if frames.is_empty() => text += ":\n\n",
            true => {}
            false => text += "event: end\ndata: \n\n",
        }
        stream.write_all(text.as_bytes())?;
        if !goes_on {
            return Ok(());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Sent;

    /// What is kept stays bounded, spans the run, and is denser the newer it is.
    #[test]
    fn old_frames_are_thinned() {
        let mut sent = Sent::default();
        for number in 0..10_000 {
            sent.push(&format!("{number:010}"), 1_000);
            assert!(sent.bytes <= 1_000 && sent.bytes == 10 * sent.frames.len());
            assert_eq!(sent.frames.last().unwrap().number, number);
            // A page that has all frames so far gets the next one.
            assert_eq!(sent.from(number).len(), 1);
        }
        let numbers: Vec<usize> = sent.frames.iter().map(|frame| frame.number).collect();
        assert!(sent.frames.iter().all(|frame| *frame.text == *format!("{:010}", frame.number)));
        assert!(numbers[0] == 0 && numbers.len() >= 50);
        let apart: Vec<usize> = numbers.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!(apart.windows(2).all(|pair| pair[0] >= pair[1]), "{apart:?}");
        assert_eq!(sent.from(5_000).len(), numbers.iter().filter(|n| **n >= 5_000).count());
    }
}

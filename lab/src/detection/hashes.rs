//! Hashes of contacts: equal input must give equal bytes.
use rayon::prelude::*;
use tesdf::collide::Contact;
use tesdf_cli::terminal::report::Failure;

/// Number of contacts that a thread writes at a time: a million contacts take seconds.
const TASK: usize = 4096;

/// The hash of the contacts of each frame.
#[derive(Default)]
pub struct Hashes(Vec<blake3::Hash>);

impl Hashes {
    /// Adds the contacts of a detection of frame `frame`. Frames come in order, and may repeat.
    ///
    /// # Errors
    /// An earlier detection of this frame gave other contacts.
    pub fn add(&mut self, frame: usize, contacts: &[Contact]) -> Result<(), Failure> {
        let hash = hash(contacts)?;
        match self.0.get(frame) {
            None => self.0.push(hash),
            Some(earlier) if *earlier == hash => {}
            Some(_) => {
                return Err(Failure::new(format!("frame {frame}: two detections gave different contacts")));
            }
        }
        Ok(())
    }

    /// The hash of all frames.
    pub fn all(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for hash in &self.0 {
            hasher.update(hash.as_bytes());
        }
        hasher.finalize().to_hex()[..32].to_string()
    }
}

/// The hash of the contacts as JSON.
fn hash(contacts: &[Contact]) -> Result<blake3::Hash, Failure> {
    let parts: Vec<Vec<u8>> =
        contacts.par_chunks(TASK).map(serde_json::to_vec).collect::<Result<_, _>>().map_err(Failure::new)?;
    let mut hasher = blake3::Hasher::new();
    hasher.update(b"[");
    for (k, part) in parts.iter().enumerate() {
        if k > 0 {
            hasher.update(b",");
        }
        // Without the brackets of the part.
        hasher.update(&part[1..part.len() - 1]);
    }
    hasher.update(b"]");
    Ok(hasher.finalize())
}

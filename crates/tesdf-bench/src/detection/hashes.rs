//! Hashes of contacts: equal input must give equal bytes.
use tesdf::collide::Contact;
use tesdf_terminal::report::Failure;

/// The hash of the contacts of each frame.
#[derive(Default)]
pub struct Hashes(Vec<blake3::Hash>);

impl Hashes {
    /// Adds the contacts of a detection of frame `frame`. Frames come in order, and may repeat.
    ///
    /// # Errors
    /// An earlier detection of this frame gave other contacts.
    pub fn add(&mut self, frame: usize, contacts: &[Contact]) -> Result<(), Failure> {
        let bytes = serde_json::to_vec(contacts).map_err(Failure::new)?;
        let hash = blake3::hash(&bytes);
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

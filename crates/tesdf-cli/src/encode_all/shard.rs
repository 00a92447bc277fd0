//! Divides meshes among machines.
use std::fmt;
use std::num::NonZeroU32;
use std::str::FromStr;

/// One of `of` parts of all meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 1 to `of`.
    number: NonZeroU32,
    of: NonZeroU32,
}

impl Shard {
    /// Whether the mesh with this path is in this part. Only the path decides, so it stays in its
    /// part when other meshes are added, and machines need not agree on a list.
    pub fn has(self, path: &str) -> bool {
        let [a, b, c, d, e, f, g, h, ..] = *blake3::hash(path.as_bytes()).as_bytes();
        let hash = u64::from_le_bytes([a, b, c, d, e, f, g, h]);
        hash % u64::from(self.of.get()) + 1 == u64::from(self.number.get())
    }

    /// The number of this part, from 1, and the number of parts.
    pub fn numbers(self) -> [u32; 2] {
        [self.number.get(), self.of.get()]
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers =
            text.split_once('/').and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
        match numbers {
            Some((number, of)) if number <= of => Ok(Self { number, of }),
            _ => Err("expected I/N with I from 1 to N, such as 2/4".into()),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_parsed() {
        assert_eq!("2/4".parse().map(Shard::numbers), Ok([2, 4]));
        for wrong in ["0/4", "5/4", "1/0", "4", "a/b", "-1/4", "1/2/3"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn each_path_is_in_one_shard() {
        let shards: Vec<Shard> = (1..=5).map(|i| format!("{i}/5").parse().unwrap()).collect();
        let mut sizes = [0; 5];
        for k in 0..1000 {
            let path = format!("folder/part {k}.stl");
            let having: Vec<_> = (0..5).filter(|&i| shards[i].has(&path)).collect();
            assert_eq!(having.len(), 1, "{path}");
            sizes[having[0]] += 1;
        }
        assert!(sizes.iter().all(|size| (150..250).contains(size)), "{sizes:?}");
    }
}

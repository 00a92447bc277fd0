//! Reads hostile bytes: no panic, no part of a file ignored silently, no memory allocated by a
//! count.
#[path = "it/sample/mod.rs"]
mod sample;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::path::Path;

use sample::{DATA_URI, OFF, glb, json, tetrahedron_buffer};
use tesdf::mesh::{MeshFormat, read_bytes};

thread_local! {
    /// Bytes that this thread holds, and the largest value since the last reset.
    static HELD: Cell<(usize, usize)> = const { Cell::new((0, 0)) };
}

/// An allocator that counts the bytes each thread holds.
struct Counting;

// SAFETY: every call is passed on to `System` unchanged. The count is a plain thread-local cell
// without a destructor, which allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let (held, most) = HELD.get();
        let held = held + layout.size();
        HELD.set((held, most.max(held)));
        // SAFETY: the caller's guarantees are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        let (held, most) = HELD.get();
        HELD.set((held.saturating_sub(layout.size()), most));
        // SAFETY: the caller's guarantees are passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// SplitMix64: small, seeded, and the same everywhere.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}

fn samples() -> Vec<(String, MeshFormat, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/bad");
    let mut samples: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter_map(|path| Some((MeshFormat::of_path(&path).ok()?, path)))
        .map(|(format, path)| {
            (path.file_name().unwrap().to_string_lossy().into_owned(), format, std::fs::read(&path).unwrap())
        })
        .collect();
    samples.sort_by(|a, b| a.0.cmp(&b.0));
    assert!(samples.len() > 50);
    let node = r#"{"mesh":0,"scale":[1,1,-1]}"#;
    samples.push(("off".into(), MeshFormat::Off, OFF.into()));
    samples.push(("gltf".into(), MeshFormat::Gltf, json(DATA_URI, node).into()));
    samples.push(("glb".into(), MeshFormat::Glb, glb(&json("", node), &tetrahedron_buffer())));
    samples
}

/// Words that can break parsers.
const TOKENS: &[&[u8]] = &[
    b"-1",
    b"0",
    b"4294967295",
    b"4294967296",
    b"18446744073709551616",
    b"-9223372036854775808",
    b"1e400",
    b"nan",
    b"-inf",
    b"/",
    b"//",
    b"\\\n",
    b"\r",
    b"\n",
    b"\0",
    b"f ",
    b"v ",
    b"\nend_header\n",
    b"\nelement face 9\n",
    b"property list uchar int a\n",
    b"endsolid",
    b"facet",
    b"\xFF",
    b"\xEF\xBB\xBF",
    b"#",
    b"\"",
    b"{",
    b",",
    b"1",
];

fn mutate(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut out = bytes.to_vec();
    for _ in 0..=random.below(4) {
        let at = random.below(out.len());
        let to = (at + random.below(16)).min(out.len());
        match random.below(7) {
            0 if !out.is_empty() => out[at] ^= 1 << random.below(8),
            1 if !out.is_empty() => out[at] = random.next() as u8,
            2 => out.truncate(at),
            3 => drop(out.drain(at..to)),
            4 => {
                let copy = out[at..to].to_vec();
                out.splice(at..at, copy);
            }
            5 => drop(out.splice(at..to, TOKENS[random.below(TOKENS.len())].iter().copied())),
            _ => drop(out.splice(at..at, TOKENS[random.below(TOKENS.len())].iter().copied())),
        }
    }
    out
}

/// Reads the bytes. A mesh must be valid, memory use small, and an error explained.
fn assert_survives(name: &str, bytes: &[u8], format: MeshFormat) -> bool {
    let (held, _) = HELD.get();
    HELD.set((held, held));
    let result = read_bytes(bytes, format);
    let used = HELD.get().1 - held;
    // A face `f 1 1 1` of eight bytes takes about 100 bytes of memory per byte in the passes of
    // reading. Two more pages cover messages and tables of fixed size.
    assert!(used <= 100 * bytes.len() + 8192, "{name}: {used} bytes held for {} read", bytes.len());
    match result {
        Ok(loaded) => {
            let (vertices, faces) = (loaded.mesh.vertices(), loaded.mesh.faces());
            assert!(!faces.is_empty() && faces.len() <= bytes.len() && vertices.len() <= bytes.len());
            assert!(faces.iter().flatten().all(|&v| (v as usize) < vertices.len()));
            assert!(vertices.iter().all(|p| p.is_finite()), "{name}");
            true
        }
        Err(error) => {
            assert!(error.to_string().len() > 20);
            false
        }
    }
}

#[test]
fn mutated_files_neither_panic_nor_allocate_much() {
    let mut random = Random(7);
    let (mut read, mut refused) = (0, 0);
    for (name, format, bytes) in samples() {
        let rounds = if bytes.len() < 4096 { 10_000 } else { 500 };
        for _ in 0..rounds {
            let mutated = mutate(&bytes, &mut random);
            if assert_survives(&name, &mutated, format) { read += 1 } else { refused += 1 }
        }
    }
    // Both outcomes must occur often for the test to be meaningful.
    assert!(read > 10_000 && refused > 10_000, "{read} read, {refused} refused");
}

#[test]
fn each_reader_survives_files_of_all_other_formats() {
    for (name, _, bytes) in samples() {
        for format in MeshFormat::ALL {
            assert_survives(&name, &bytes, format);
        }
    }
}

#[test]
fn every_proper_prefix_of_a_binary_file_is_refused() {
    let binary = [
        "ply_big_endian.ply",
        "ply_little_double.ply",
        "stl_solid_but_binary.stl",
        "soup_unwelded.stl",
        "glb",
    ];
    let mut tried = 0;
    for (name, format, bytes) in samples().into_iter().filter(|s| binary.contains(&s.0.as_str())) {
        assert!(read_bytes(&bytes, format).is_ok(), "{name}");
        for end in 0..bytes.len() {
            assert!(
                !assert_survives(&name, &bytes[..end], format),
                "{name}: the first {end} bytes were read"
            );
        }
        tried += 1;
    }
    assert_eq!(tried, binary.len());
}

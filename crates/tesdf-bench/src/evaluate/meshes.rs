//! The meshes of Table I: nearest to the paper's, whose own are not public.
use tesdf::Length;

use super::paper;

/// A mesh, and how it is measured.
#[derive(Debug)]
pub struct Mesh {
    /// As its rows are called.
    pub name: &'static str,
    /// Under the folder of meshes.
    pub path: &'static str,
    /// The rows of the paper's Table I that it stands beside.
    pub paper: &'static [&'static str],
    /// ε of the sampled encoder, mesh unit: that of the paper's row.
    pub threshold: f64,
    /// In a conforming domain also the space outside, up to here: where the paper's tetrahedra per face say so.
    pub outside: Option<Length>,
    /// Whether a deformed form is measured, too, in a conforming domain.
    pub deforms: Deforms,
    /// Whether it is measured with `--quick`.
    pub quick: Quick,
}

/// Whether a mesh is measured deformed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Deforms {
    Yes,
    No,
}

/// Whether a mesh is among the quick ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quick {
    Yes,
    No,
}

const AROUND: Option<Length> = Some(Length::OfDiagonal(0.05));

const fn rigid(
    name: &'static str,
    path: &'static str,
    paper: &'static [&'static str],
    threshold: f64,
    outside: Option<Length>,
    quick: Quick,
) -> Mesh {
    Mesh { name, path, paper, threshold, outside, deforms: Deforms::No, quick }
}

/// Q of the paper for meshes that have no row of their own.
const USUAL_RESOLUTION: u32 = 128;

impl Mesh {
    /// Q of the paper's row.
    pub fn paper_resolution(&self) -> u32 {
        let row = self.paper.iter().find_map(|name| paper::table_1(name)?.sampling);
        row.map_or(USUAL_RESOLUTION, |(resolution, _)| resolution)
    }
}

/// All of them, in the order of the table.
pub const MESHES: [Mesh; 8] = [
    rigid("bolt", "procedural/iso_m16_bolt_24k.obj", &["M16 bolt"], 0.0, AROUND, Quick::No),
    rigid("nut", "procedural/iso_m16_nut_c100.obj", &["M16 Nut"], 0.0, None, Quick::No),
    rigid("hole", "procedural/lobed_hole_c100.obj", &["Hole"], 0.0, AROUND, Quick::No),
    rigid("shaft", SHAFT, &["Shaft"], 1e-7, None, Quick::Yes),
    rigid("spoon", "procedural/spoon.obj", &["Spoon"], 1e-9, AROUND, Quick::No),
    Mesh {
        name: "gripper",
        path: "public/industreal_franka_finger_rubber_coll.obj",
        paper: &["Gripper", "Deformed gripper"],
        threshold: 0.0,
        outside: None,
        deforms: Deforms::Yes,
        quick: Quick::Yes,
    },
    Mesh {
        name: "finger",
        path: "public/robotiq_2f_140_inner_finger.stl",
        paper: &[],
        threshold: 0.0,
        outside: None,
        deforms: Deforms::Yes,
        quick: Quick::No,
    },
    // Tetrahedra from a file: conforming without any program.
    Mesh {
        name: "beam",
        path: "procedural/beam.ele",
        paper: &[],
        threshold: 0.0,
        outside: None,
        deforms: Deforms::Yes,
        quick: Quick::Yes,
    },
];

/// That of Table IV.
pub const SHAFT: &str = "procedural/shaft_keyway.obj";

//! The meshes of Table I. Of the paper's own meshes its authors have published a bolt and a nut, without
//! a licence: `paper-bolt` and `paper-nut` have their dimensions. The others are the most similar ones.
use tesdf::Length;

use super::paper;

/// A mesh, and how it is measured.
#[derive(Debug)]
pub struct Mesh {
    /// Name in the rows.
    pub name: &'static str,
    /// Path in the folder of meshes.
    pub path: &'static str,
    /// The rows of the paper's Table I that are printed above the rows of this mesh.
    pub paper: &'static [&'static str],
    /// ε of the sampled encoder, in the mesh's unit, as in the paper's row.
    pub threshold: f64,
    /// Width of the band outside the body in a conforming domain. It is given where the paper's
    /// number of tetrahedra per face indicates such a band.
    pub outside: Option<Length>,
    /// Whether a deformed shape is measured as well, in a conforming domain.
    pub deforms: Deforms,
    /// Whether it is measured with `--quick`.
    pub quick: Quick,
}

/// Whether a mesh is also measured after a deformation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Deforms {
    Yes,
    No,
}

/// Whether a mesh is measured with `--quick`.
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

/// The paper's Q for meshes without a row of their own.
const USUAL_RESOLUTION: u32 = 128;

impl Mesh {
    /// Q in the paper's row.
    pub fn paper_resolution(&self) -> u32 {
        let row = self.paper.iter().find_map(|name| paper::table_1(name)?.sampling);
        row.map_or(USUAL_RESOLUTION, |(resolution, _)| resolution)
    }
}

/// All meshes, in the order of the table.
pub const MESHES: [Mesh; 10] = [
    rigid("paper-bolt", "parts/paper_bolt.ply", &["M16 bolt"], 0.0, AROUND, Quick::No),
    rigid("paper-nut", "parts/paper_nut.ply", &["M16 Nut"], 0.0, None, Quick::No),
    rigid("bolt", "procedural/iso_m16_bolt_24k.obj", &[], 0.0, AROUND, Quick::No),
    rigid("nut", "procedural/iso_m16_nut_c100.obj", &[], 0.0, None, Quick::No),
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
    // A mesh with tetrahedra from a file, so it conforms without another program.
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

/// The mesh of Table IV.
pub const SHAFT: &str = "procedural/shaft_keyway.obj";

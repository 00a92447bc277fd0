//! Reads contacts of the device, and returns them in the form and order of
//! `tesdf::collide::detect`.
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use tesdf::collide::internal::{kept_at_vertices, local_minima};
use tesdf::collide::{
    CollideError, CollideOptions, Contact, FeatureB, FeatureId, Mode, PairReduction, Scene, Shape,
};

use super::scene::instances::Instances;
use crate::kernels::report::contact::{CONVERGED, NO_CORNER, ROWS, WORDS};
use crate::kernels::report::reduce::members::TOUCHING_WORDS;
use crate::kernels::report::reduce::selection::REPORT_ROWS;
use crate::kernels::scene::shape::NONE;

/// The words of a contact, in the layout that kernels write.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Words {
    a: u32,
    b: u32,
    face_a: u32,
    cell: u32,
    face_b: u32,
    feature: u32,
    corner: u32,
    ordered_pair: u32,
}

/// The rows of a contact, in the layout that kernels write.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Row {
    point_a: [f32; 3],
    distance: f32,
    gradient: [f32; 3],
    /// Cosine between the gradient and the face's normal.
    cosine: f32,
    point_b: [f32; 4],
}

/// A touching pair, in the layout that kernels write.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Touching {
    a: u32,
    b: u32,
    contacts: u32,
    first_member: u32,
    kept: u32,
}

/// The loss by the reduction of a pair, in the layout that kernels write.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Report {
    center: [f32; 3],
    length: f32,
    error: f32,
    unused: [f32; 3],
}

const _: () = assert!(size_of::<Words>() == 4 * WORDS as usize);
const _: () = assert!(size_of::<Row>() == 16 * ROWS as usize);
const _: () = assert!(size_of::<Touching>() == 4 * TOUCHING_WORDS as usize);
const _: () = assert!(size_of::<Report>() == 16 * REPORT_ROWS as usize);

/// The reduction of a pair of instances, in world units. The instances of a world are in the order
/// of their ids, and the first ordered pair of a pair takes the surface of the first instance.
pub fn pair_reduction(instances: &Instances, touching: &Touching, report: &Report) -> PairReduction {
    let at = &instances.placed[touching.b as usize];
    PairReduction {
        instance_a: instances.ids[touching.a as usize],
        instance_b: instances.ids[touching.b as usize],
        contacts: touching.contacts as usize,
        kept: touching.kept as usize,
        wrench_error: f64::from(report.error),
        center: at.to_world(Vec3::from_array(report.center)),
        length: f64::from(report.length) * at.unit,
        left_out_above: None,
    }
}

/// Contacts in the world, sorted by world, pair of instances, ordered pair, face, feature and cell;
/// and the indices of their faces in both shapes.
pub fn contacts(
    shapes: &[&Shape],
    instances: &Instances,
    mode: Mode,
    words: &[Words],
    rows: &[Row],
) -> (Vec<Contact>, Vec<[u32; 2]>) {
    let of_words = |(words, row): (&Words, &Row)| {
        let (a, b) = (words.a, words.b);
        let faces = [words.face_a, words.face_b];
        ((a.min(b), a.max(b), a > b), contact(shapes, instances, mode, words, row), faces)
    };
    let mut found: Vec<_> = words.par_iter().zip(rows).map(of_words).collect();
    // Instances are sorted by world and id. Outside of the cube, a face may have several parts
    // without a cell.
    found.par_sort_unstable_by_key(|(pair, c, _)| {
        (*pair, c.face_a, c.feature.a, c.tet_b, c.point_a.to_array().map(f64::to_bits))
    });
    found.into_iter().map(|(_, contact, faces)| (contact, faces)).unzip()
}

/// Removes contacts that are no local minima over the surface. Returns their number.
///
/// # Errors
/// An instance is missing.
pub fn keep_minima(
    scene: &Scene,
    options: &CollideOptions,
    shapes: &[&Shape],
    instances: &Instances,
    words: &mut Vec<Words>,
    rows: &mut Vec<Row>,
) -> Result<usize, CollideError> {
    let found: Vec<Contact> = words
        .par_iter()
        .zip(&*rows)
        .map(|(words, row)| contact(shapes, instances, options.mode, words, row))
        .collect();
    let faces: Vec<u32> = words.iter().map(|words| words.face_a).collect();
    let keep = local_minima(scene, options, &found, &faces)?;
    retain(&keep, words, rows);
    Ok(keep.iter().filter(|keep| !**keep).count())
}

fn retain(keep: &[bool], words: &mut Vec<Words>, rows: &mut Vec<Row>) {
    let mut kept = keep.iter();
    words.retain(|_| *kept.next().unwrap_or(&true));
    let mut kept = keep.iter();
    rows.retain(|_| *kept.next().unwrap_or(&true));
}

/// Removes contacts of whole faces: of the contacts of several faces at one vertex, keeps the one
/// whose gradient most opposes its face; among equals, that of the lowest face.
pub fn one_per_vertex(shapes: &[&Shape], instances: &Instances, words: &mut Vec<Words>, rows: &mut Vec<Row>) {
    let key = |(at, (words, row)): (usize, (&Words, &Row))| {
        let shape = shapes[instances.shapes[words.a as usize]];
        let vertex = vertex(shape, words)?;
        let cosine = (f64::from(row.cosine) / COSINE_TIE).round() as i64;
        let face = surface_names(shape, Mode::exact(), words).0;
        Some(((words.a, words.b, vertex), cosine, face, at))
    };
    let keys = words.iter().zip(&*rows).enumerate().filter_map(key).collect();
    let keep = kept_at_vertices(keys, words.len());
    retain(&keep, words, rows);
}

/// Cosines that differ by less are equal: the rounding of unit vectors in `f32`. On the processor
/// it is 1e-9.
const COSINE_TIE: f64 = 1e-6;

/// The vertex at which a contact of a face is; `None` when it is at no vertex.
fn vertex(shape: &Shape, words: &Words) -> Option<u32> {
    let corner = words.corner % CONVERGED;
    if corner == NO_CORNER {
        return None;
    }
    match shape {
        Shape::Mesh(asset) => Some(asset.face_vertices(words.face_a as usize)[corner as usize]),
        // Far outside of what can touch.
        Shape::Plane => None,
        simple => {
            let point = *simple.parts().0.get(words.face_a as usize)?.get(corner as usize)?;
            simple.nodes().iter().position(|&(p, _)| p == point).map(|node| node as u32)
        }
    }
}

fn contact(shapes: &[&Shape], instances: &Instances, mode: Mode, words: &Words, row: &Row) -> Contact {
    let (a, b) = (words.a as usize, words.b as usize);
    let at = &instances.placed[b];
    let (face_a, feature_a) = surface_names(shapes[instances.shapes[a]], mode, words);
    let (face_b, feature_b) = field_names(shapes[instances.shapes[b]], words);
    Contact {
        point_a: at.to_world(Vec3::from_array(row.point_a)),
        point_b: at.to_world(Vec3::from_slice(&row.point_b)),
        normal: at.rotate(Vec3::from_array(row.gradient)),
        distance: f64::from(row.distance) * at.unit,
        face_a,
        face_b,
        tet_b: (words.cell != NONE).then_some(words.cell),
        instance_a: instances.ids[a],
        instance_b: instances.ids[b],
        feature: FeatureId { a: feature_a, b: feature_b },
        converged: words.corner >= CONVERGED,
    }
}

/// The face and the feature of the first body, with the ids of the source mesh. The feature is the
/// face, or in Node-TES the node.
fn surface_names(shape: &Shape, mode: Mode, words: &Words) -> (u32, u32) {
    let (part, corner) = (words.face_a, (words.corner % CONVERGED) as usize);
    match (mode, shape) {
        (Mode::Node, Shape::Mesh(asset)) => {
            let node = asset.face_vertices(part as usize)[corner];
            (asset.arrays().lowest_faces[node as usize], node)
        }
        (Mode::Node, simple) => {
            let point: DVec3 = simple.parts().0[part as usize][corner];
            let node = simple.nodes().iter().position(|&(p, _)| p == point).unwrap_or(0);
            (part, node as u32)
        }
        (Mode::Face { .. } | Mode::Exact(_), Shape::Mesh(asset)) => {
            let face = asset.face_id(part as usize);
            (face, face)
        }
        (Mode::Face { .. } | Mode::Exact(_), Shape::Plane) => (0, 0),
        (Mode::Face { .. } | Mode::Exact(_), _) => (part, part),
    }
}

/// The nearest face of the second body, by its id in the source mesh, and the nearest feature of
/// this face.
fn field_names(shape: &Shape, words: &Words) -> (u32, FeatureB) {
    let Shape::Mesh(asset) = shape else { return (words.face_b, FeatureB::Face(words.face_b)) };
    let corners = asset.face_vertices(words.face_b as usize);
    let face = asset.face_id(words.face_b as usize);
    let feature = match words.feature {
        0 => FeatureB::Face(face),
        edge @ 1..=3 => {
            let (a, b) = (corners[edge as usize - 1], corners[edge as usize % 3]);
            FeatureB::Edge(a.min(b), a.max(b))
        }
        corner => FeatureB::Vertex(corners[(corner as usize - 4) % 3]),
    };
    (face, feature)
}

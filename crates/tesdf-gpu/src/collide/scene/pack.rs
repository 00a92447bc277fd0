//! Packs shapes into the arrays that kernels read.
use glam::{DVec3, Vec3};
use tesdf::TeSdf;
use tesdf::asset::FaceRecord;
use tesdf::asset::layout::{SignHints, TreeChild};
use tesdf::base::InsideRule;
use tesdf::collide::Shape;
use tesdf::geometry::Triangle;
use tesdf::query::{Arrays, SignArrays};

use super::movable::{face_levels, tree_levels};
use super::roots::Roots;
use crate::kernels::deform::refit::GROWN;
use crate::kernels::pairs::meshlets::FACES_OF_MESHLET;
use crate::kernels::query::nearest::TREE_DEPTH;
use crate::kernels::query::sign;
use crate::kernels::scene::shape::{self as layout, STRIDE};

/// The contents of the buffers of [`Shapes`](crate::kernels::scene::shape::Shapes).
#[derive(Default)]
pub struct Packed {
    pub table: Vec<u32>,
    pub words: Vec<u32>,
    pub rows: Vec<[f32; 4]>,
    /// Number of words of the fans before the next shape.
    fans: usize,
}

impl Packed {
    /// Adds a shape.
    ///
    /// # Errors
    /// The reason why kernels cannot read the shape.
    pub fn add(&mut self, shape: &Shape) -> Result<(), String> {
        let entry = self.entry(shape)?;
        self.table.extend(entry);
        Ok(())
    }

    /// Appends the arrays of a shape, and returns its entry for the table.
    fn entry(&mut self, shape: &Shape) -> Result<[u32; STRIDE as usize], String> {
        let mut row = [0u32; STRIDE as usize];
        let mut sizes = |kind: u32, sizes: DVec3| {
            row[layout::KIND as usize] = kind;
            let at = layout::SIZES as usize;
            row[at..at + 3].copy_from_slice(&sizes.as_vec3().to_array().map(f32::to_bits));
        };
        match shape {
            Shape::Mesh(asset) => {
                return self.add_mesh(asset);
            }
            Shape::Plane => sizes(layout::PLANE, DVec3::ZERO),
            Shape::Box { half_extents } => sizes(layout::BOX, *half_extents),
            Shape::Sphere { radius } => sizes(layout::ROUND, DVec3::new(0.0, *radius, 0.0)),
            Shape::Capsule { half_height, radius } => {
                sizes(layout::ROUND, DVec3::new(*half_height, *radius, 0.0));
            }
            Shape::Cylinder { .. } => {
                return Err("a cylinder, which kernels do not have; the processor finds its contacts".into());
            }
        }
        row[layout::DIAGONAL as usize] = bounded(shape.diagonal()).to_bits();
        row[layout::FANS as usize] = layout::NONE;
        row[layout::MESHLET_COUNT as usize] = 1;
        row[layout::BAD_VERTEX as usize] = layout::NONE;
        // A plane has two triangles, whose size depends on the field that they meet.
        row[layout::FACE_COUNT as usize] = 2;
        if !matches!(shape, Shape::Plane) {
            let records = simple_records(shape);
            row[layout::FACE_COUNT as usize] = records.len() as u32;
            row[layout::RECORDS as usize] = self.rows_at(records.into_iter().flat_map(four))?;
        }
        row[layout::INNER_BALL as usize] = self.rows_at([inner_ball(shape.inner_ball())].into_iter())?;
        Ok(row)
    }

    fn add_mesh(&mut self, asset: &TeSdf) -> Result<[u32; STRIDE as usize], String> {
        let (mesh, sign) = (&asset.arrays(), asset.sign_arrays());
        let depth = depth(mesh);
        // A walk of the tree replaces a node on its stack by the two children.
        if depth + 2 > TREE_DEPTH {
            return Err(format!("a face tree of {depth} levels; expected {} at most", TREE_DEPTH - 2));
        }
        let mut row = [0u32; STRIDE as usize];
        let mut set = |at: u32, value: u32| row[at as usize] = value;
        set(layout::KIND, layout::MESH);
        set(layout::NODES, self.words_at(mesh.nodes.iter().copied())?);
        set(layout::LISTS, self.bytes_at(mesh.lists)?);
        set(layout::PALETTE_STARTS, self.words_at(mesh.palette_starts.iter().copied())?);
        let halves =
            mesh.palettes.chunks(2).map(|c| u32::from(c[0]) | u32::from(*c.get(1).unwrap_or(&0)) << 16);
        set(layout::PALETTES, self.words_at(halves)?);
        set(layout::PALETTES_HIGH, mesh.palettes_high.map_or(Ok(layout::NONE), |high| self.bytes_at(high))?);
        set(layout::BOUNDS, self.bytes_at(mesh.cell_bounds)?);
        set(layout::CHILDREN, self.words_at(mesh.tree_children.as_flattened().iter().copied())?);
        set(layout::RECORDS, self.rows_at(records(mesh).into_iter().flat_map(four))?);
        set(
            layout::BOXES,
            self.rows_at(mesh.tree_boxes.iter().flat_map(|b| {
                let (rows, _) = b.as_chunks::<4>();
                rows.to_vec()
            }))?,
        );
        let meshlets = meshlets(mesh);
        set(layout::MESHLETS, self.rows_at(meshlets.iter().map(|&(start, count)| ball(mesh, start, count)))?);
        set(
            layout::MESHLET_FACES,
            self.words_at(meshlets.iter().flat_map(|&(start, count)| [start, count]))?,
        );
        set(layout::MESHLET_COUNT, meshlets.len() as u32);
        set(layout::FACE_COUNT, mesh.faces.len() as u32);
        set(layout::EXACT_LISTS, u32::from(mesh.has_exact_lists));
        set(layout::FACE_VERTICES, self.words_at(mesh.faces.as_flattened().iter().copied())?);
        set(layout::FANS, self.fans_at(asset)?);
        if let Some(sign) = &sign {
            set(layout::RULE, rule_of(sign));
            let triangles = [&sign.triangles[..], &sign.closing].concat();
            let record = |corners: &[DVec3; 3]| {
                let (triangle, hints) = (Triangle::new(*corners), SignHints::default());
                without_nan(*FaceRecord::new(&triangle, mesh.cube.middle(), hints).as_array())
            };
            let records = triangles.iter().map(record).flat_map(four);
            set(layout::SIGN_TRIANGLES, self.rows_at(records)?);
            set(layout::SIGN_COUNT, triangles.len() as u32);
            set(layout::CLOSING_COUNT, sign.closing.len() as u32);
            set(layout::TURNED, u32::from(!sign.faces_look_outward));
        }
        let roots = Roots::new(mesh);
        set(layout::TETRAHEDRA, self.rows_at(roots.rows.into_iter())?);
        set(layout::TREE_BOXES, self.rows_at(roots.boxes.into_iter())?);
        set(layout::TREE, self.words_at(roots.tree.iter().flatten().copied())?);
        set(layout::TREE_NODES, roots.tree.len() as u32);
        set(layout::INNER_BALL, self.rows_at([inner_ball(mesh.inner_ball)].into_iter())?);
        set(layout::BAD_VERTEX, layout::NONE);
        if !roots.tree.is_empty() {
            set(layout::TET_VERTICES, self.words_at(mesh.tetrahedra.as_flattened().iter().copied())?);
            set(layout::FACE_LEVELS, self.words_at(face_levels(mesh.tree_children).into_iter())?);
            set(layout::TREE_LEVELS, self.words_at(tree_levels(&roots.tree).into_iter())?);
            set(layout::VERTEX_COUNT, (mesh.vertices.len() + mesh.domain_vertices.len()) as u32);
        }
        let mut set = |at: u32, value: f64| set(at, (value as f32).to_bits());
        set(layout::SIDE, mesh.cube.side());
        set(layout::INVERSE_SIDE, 1.0 / mesh.cube.side());
        set(layout::BOUND_UNIT, mesh.cell_bound_unit);
        set(layout::BAND, mesh.band);
        set(layout::HALF_THICKNESS, mesh.half_thickness);
        set(layout::DIAGONAL, mesh.bounds.extent().length());
        let beyond = sign.map_or(0.0, |sign| sign.reach_beyond);
        set(layout::REACH_BEYOND, beyond);
        let bounds = mesh.bounds.grown(mesh.half_thickness + beyond);
        for axis in 0..3 {
            set(layout::LOW + axis as u32, (bounds.min - mesh.cube.middle())[axis]);
            set(layout::HIGH + axis as u32, (bounds.max - mesh.cube.middle())[axis]);
        }
        Ok(row)
    }

    /// The place of the fans of a mesh for the table. [`fans`] makes them.
    fn fans_at(&mut self, asset: &TeSdf) -> Result<u32, String> {
        if !has_fans(asset) {
            return Ok(layout::NONE);
        }
        let start = u32::try_from(self.fans).map_err(too_many_words)?;
        self.fans += words_of_fans(asset);
        u32::try_from(self.fans).map_err(too_many_words)?;
        Ok(start)
    }

    fn words_at(&mut self, words: impl Iterator<Item = u32>) -> Result<u32, String> {
        let at = self.words.len();
        self.words.extend(words);
        u32::try_from(at).map_err(too_many_words)
    }

    fn bytes_at(&mut self, bytes: &[u8]) -> Result<u32, String> {
        let word = |chunk: &[u8]| {
            let mut word = [0; 4];
            word[..chunk.len()].copy_from_slice(chunk);
            u32::from_le_bytes(word)
        };
        // Kernels read half words byte by byte, and a list may end with the section: the padding
        // keeps such a read within the buffer.
        self.words_at(bytes.chunks(4).map(word).chain([0]))
    }

    fn rows_at(&mut self, rows: impl Iterator<Item = [f32; 4]>) -> Result<u32, String> {
        let at = self.rows.len();
        self.rows.extend(rows);
        u32::try_from(at).map_err(|_| "more than 2^32 rows of arrays".to_owned())
    }
}

/// The number of a rule in [`layout::RULE`].
fn rule_of(sign: &SignArrays) -> u32 {
    match sign.rule {
        InsideRule::Generalized if !sign.closing.is_empty() => sign::GENERALIZED,
        InsideRule::Nonzero | InsideRule::Generalized => sign::NONZERO,
        InsideRule::Odd => sign::ODD,
        InsideRule::Winding | InsideRule::Sheet { .. } => sign::WINDING,
    }
}

/// Whether a mesh has normal cones, for which kernels need its fans.
fn has_fans(asset: &TeSdf) -> bool {
    asset.faces_enclose_the_solid() && asset.is_detected_on_devices()
}

fn words_of_fans(asset: &TeSdf) -> usize {
    2 * asset.arrays().vertices.len() + 1 + 3 * asset.face_count()
}

/// The words of [`Fans`](layout::Fans) for shapes that were packed.
pub fn fans(shapes: &[Shape]) -> Vec<u32> {
    let mut words = Vec::new();
    for shape in shapes {
        let Shape::Mesh(asset) = shape else { continue };
        if !has_fans(asset) {
            continue;
        }
        let (clear, scale) = (asset.corner_cones(), asset.arrays().frame.scale);
        let fans = || (0..clear.len() as u32).map(|vertex| asset.faces_at(vertex));
        // `Packed::add` has refused more words than `u32` counts.
        let mut start = (words.len() + 2 * clear.len() + 1) as u32;
        for (fan, &clear) in fans().zip(clear) {
            words.extend([start, ((f64::from(clear) * scale) as f32).to_bits()]);
            start += fan.len() as u32;
        }
        words.push(start);
        words.extend(fans().flatten());
    }
    words
}

fn too_many_words(_: std::num::TryFromIntError) -> String {
    "more than 2^32 words of arrays".to_owned()
}

/// A diagonal; 0 where it is infinite.
fn bounded(diagonal: f64) -> f32 {
    if diagonal.is_finite() { diagonal as f32 } else { 0.0 }
}

fn four(record: [f32; 16]) -> [[f32; 4]; 4] {
    std::array::from_fn(|i| std::array::from_fn(|k| record[4 * i + k]))
}

/// The faces as kernels read them. Each corner belongs to the first face that has it.
fn records(mesh: &Arrays) -> Vec<[f32; 16]> {
    let mut seen = vec![false; mesh.lowest_faces.len()];
    let record = |(record, corners): (&FaceRecord, &[u32; 3])| {
        let owned = (0..3).filter(|&k| !std::mem::replace(&mut seen[corners[k] as usize], true));
        with_owned(*record.as_array(), owned)
    };
    mesh.records.iter().zip(mesh.faces).map(record).collect()
}

/// The parts of a simple shape as faces. A segment is a face with two equal corners, and a point
/// one with three.
fn simple_records(shape: &Shape) -> Vec<[f32; 16]> {
    let (parts, nodes) = (shape.parts().0, shape.nodes());
    let record = |(number, points): (usize, &Vec<DVec3>)| {
        let corners = std::array::from_fn(|k| points[k.min(points.len() - 1)]);
        let triangle = Triangle::new(corners);
        let mut record = *FaceRecord::new(&triangle, DVec3::ZERO, SignHints::default()).as_array();
        // `FaceRecord` decides in the frame of a mesh whether a face is flat. A simple shape may
        // have any size, so its normal is set here.
        record[9..12].copy_from_slice(&triangle.normal.as_vec3().to_array());
        let owned = (0..points.len()).filter(|&k| nodes.contains(&(points[k], number as u32)));
        with_owned(record, owned)
    };
    parts.iter().enumerate().map(record).collect()
}

/// Replaces a normal of NaN by zero, because shaders may assume that no number is NaN.
pub(crate) fn without_nan(mut record: [f32; 16]) -> [f32; 16] {
    if record[9].is_nan() {
        record[9..12].fill(0.0);
    }
    record
}

/// Removes NaN, and adds a bit for each owned corner.
fn with_owned(record: [f32; 16], owned: impl Iterator<Item = usize>) -> [f32; 16] {
    let mut record = without_nan(record);
    let hints = record[15].to_bits() & 0xFFFF;
    let owned: u32 = owned.map(|k| 1 << (layout::OWNED_CORNERS + k as u32)).sum();
    record[15] = f32::from_bits(layout::HINTS | hints | owned);
    record
}

/// Center and radius of an inner ball; zeros without a ball.
fn inner_ball(ball: Option<(DVec3, f64)>) -> [f32; 4] {
    let (center, radius) = ball.unwrap_or_default();
    center.as_vec3().extend(radius as f32).to_array()
}

/// Number of levels of the face tree.
fn depth(mesh: &Arrays) -> usize {
    let mut levels = vec![1usize; mesh.tree_children.len()];
    for node in (0..levels.len()).rev() {
        for child in mesh.tree_children[node] {
            if let TreeChild::Node(c) = TreeChild::decode(child) {
                levels[node] = levels[node].max(levels[c as usize] + 1);
            }
        }
    }
    levels.first().copied().unwrap_or(0)
}

/// First face and number of faces of each meshlet, in order. The meshlets are the largest subtrees
/// of the face tree with at most [`FACES_OF_MESHLET`] faces.
fn meshlets(mesh: &Arrays) -> Vec<(u32, u32)> {
    let mut ranges = vec![(u32::MAX, 0u32); mesh.tree_children.len()];
    let range = |ranges: &[(u32, u32)], word| match TreeChild::decode(word) {
        TreeChild::Node(c) => ranges[c as usize],
        TreeChild::Leaf(start, count) => (start, count),
    };
    for node in (0..ranges.len()).rev() {
        let [a, b] = mesh.tree_children[node].map(|word| range(&ranges, word));
        ranges[node] = (a.0.min(b.0), a.1 + b.1);
    }
    let mut stack = vec![TreeChild::Node(0).encode()];
    let mut meshlets = Vec::new();
    while let Some(word) = stack.pop() {
        let (start, count) = range(&ranges, word);
        match TreeChild::decode(word) {
            TreeChild::Node(node) if count > FACES_OF_MESHLET => {
                stack.extend(mesh.tree_children[node as usize])
            }
            _ => meshlets.push((start, count)),
        }
    }
    meshlets.sort_unstable();
    meshlets
}

/// A ball around the given faces, relative to the center of the cube.
fn ball(mesh: &Arrays, start: u32, count: u32) -> [f32; 4] {
    let faces = &mesh.records[start as usize..(start + count) as usize];
    let corners = faces.iter().flat_map(|r| r.triangle().corners);
    let (low, high) =
        corners.clone().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), c| (l.min(c), h.max(c)));
    let center: Vec3 = (0.5 * (low + high)).as_vec3();
    let radius = corners.map(|c| c.distance(center.as_dvec3())).fold(0.0, f64::max);
    let grown = f64::from(GROWN);
    let radius = radius * (1.0 + grown) + grown * mesh.cube.side();
    [center.x, center.y, center.z, radius as f32]
}

use glam::DVec3;

use crate::TeSdf;
use crate::asset::{Conforming, FaceRecord};
use crate::domain::DomainCube;
use crate::geometry::{Aabb, LocalFrame};

/// The arrays of an asset, as kernels of other devices read them. [`layout`](crate::asset::layout) explains the words.
///
/// Lengths are in the local frame; `f32` positions are relative to the middle of the cube.
#[derive(Clone, Copy, Debug)]
pub struct Arrays<'a> {
    /// From the mesh's unit to the local frame.
    pub frame: LocalFrame,
    /// The cube of the bisection forest.
    pub cube: DomainCube,
    /// The forest: see [`Node`](crate::asset::layout::Node). The first words are its roots.
    pub nodes: &'a [u32],
    /// The lists: see [`List`](crate::asset::layout::List).
    pub lists: &'a [u8],
    /// Where each palette begins, and where the last one ends.
    pub palette_starts: &'a [u32],
    /// Low 16 bits of the palette faces.
    pub palettes: &'a [u16],
    /// The eight bits above them.
    pub palettes_high: Option<&'a [u8]>,
    /// Boxes of the two children of each node of the face tree.
    pub tree_boxes: &'a [[f32; 12]],
    /// The children: see [`TreeChild`](crate::asset::layout::TreeChild).
    pub tree_children: &'a [[u32; 2]],
    /// Corner vertices of the faces.
    pub faces: &'a [[u32; 3]],
    /// Ids of the faces in the source mesh.
    pub face_ids: &'a [u32],
    /// For each vertex the lowest id of a face that has it; [`u32::MAX`] for one that no face has.
    pub lowest_faces: &'a [u32],
    /// The faces in `f32`, with their sign hints.
    pub records: &'a [FaceRecord],
    /// For every word of the forest the square root of a lower bound of the signed distances in its cell.
    pub cell_bounds: &'a [u8],
    /// What a squared entry of [`cell_bounds`](Self::cell_bounds) is worth.
    pub cell_bound_unit: f64,
    /// Bounds of the mesh.
    pub bounds: Aabb,
    /// How far around the solid the domain is sure to reach.
    pub band: f64,
    /// Middle and radius of a ball inside of the solid; see [`Shape::inner_ball`](crate::collide::Shape::inner_ball).
    pub inner_ball: Option<(DVec3, f64)>,
    /// Whether every list is proved to be exact where the vertices are now.
    pub has_exact_lists: bool,
    /// Corner vertices of the tetrahedra of a conforming domain, each a root of the forest; none for the bisection domain, whose roots are
    /// the six of the cube. The mesh's vertices come first, then the domain's own.
    pub tetrahedra: &'a [[u32; 4]],
    /// Vertices of the mesh where they are now, in its unit.
    pub vertices: &'a [[f64; 3]],
    /// Vertices of a conforming domain that are not of the mesh, likewise.
    pub domain_vertices: &'a [[f64; 3]],
}

impl TeSdf {
    /// What kernels of other devices read. Makes the bounds of the cells when nothing has made them yet.
    pub fn arrays(&self) -> Arrays<'_> {
        let (cell_bounds, cell_bound_unit) = self.cell_bounds().bytes();
        let ball = self.inner_ball();
        Arrays {
            frame: self.frame,
            cube: self.cube,
            nodes: &self.nodes,
            lists: &self.lists,
            palette_starts: &self.palette_starts,
            palettes: &self.palettes,
            palettes_high: self.palettes_high.as_deref(),
            tree_boxes: &self.tree_boxes,
            tree_children: &self.tree_children,
            faces: &self.faces,
            face_ids: &self.face_ids,
            lowest_faces: self.lowest_faces(),
            records: &self.records,
            cell_bounds,
            cell_bound_unit,
            bounds: self.local_bounds(),
            band: self.band(),
            inner_ball: (ball.radius > 0.0).then(|| (ball.center - self.cube.middle(), ball.radius)),
            has_exact_lists: self.has_exact_lists(),
            tetrahedra: self.conforming.as_ref().map_or(&[], Conforming::tetrahedra),
            vertices: &self.vertices,
            domain_vertices: self.conforming.as_ref().map_or(&[], Conforming::vertices),
        }
    }
}

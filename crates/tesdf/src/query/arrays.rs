use glam::DVec3;

use crate::TeSdf;
use crate::asset::{Conforming, FaceRecord};
use crate::base::InsideRule;
use crate::domain::DomainCube;
use crate::geometry::{Aabb, GeneralizedWinding, LocalFrame};

/// The arrays of an asset, as kernels on other devices read them. [`layout`](crate::asset::layout)
/// explains the words.
///
/// Lengths are in the local frame. `f32` positions are relative to the centre of the cube.
#[derive(Clone, Copy, Debug)]
pub struct Arrays<'a> {
    /// Maps the mesh's unit to the local frame.
    pub frame: LocalFrame,
    /// The cube of the bisection forest.
    pub cube: DomainCube,
    /// The forest; see [`Node`](crate::asset::layout::Node). The first words are its roots.
    pub nodes: &'a [u32],
    /// The lists; see [`List`](crate::asset::layout::List).
    pub lists: &'a [u8],
    /// Start of each palette, then the end of the last palette.
    pub palette_starts: &'a [u32],
    /// Low bits of the palette faces; see [`palette_face`](crate::asset::layout::palette_face).
    pub palettes: &'a [u16],
    /// High bits of the palette faces; `None` where all of them are 0.
    pub palettes_high: Option<&'a [u8]>,
    /// Boxes of the two children of each node of the face tree.
    pub tree_boxes: &'a [[f32; 12]],
    /// The children; see [`TreeChild`](crate::asset::layout::TreeChild).
    pub tree_children: &'a [[u32; 2]],
    /// Corner vertices of the faces.
    pub faces: &'a [[u32; 3]],
    /// Ids of the faces in the source mesh.
    pub face_ids: &'a [u32],
    /// For each vertex, the lowest id of a face that has it; [`u32::MAX`] when no face has it.
    pub lowest_faces: &'a [u32],
    /// The faces in `f32`, with their sign hints.
    pub records: &'a [FaceRecord],
    /// For each word of the forest, the square root of a lower bound of the signed distances in its
    /// cell.
    pub cell_bounds: &'a [u8],
    /// The bound is the squared entry of [`cell_bounds`](Self::cell_bounds) times this value.
    pub cell_bound_unit: f64,
    /// Bounds of the mesh.
    pub bounds: Aabb,
    /// Distance around the solid that the domain covers at least.
    pub band: f64,
    /// Centre and radius of a ball inside the solid; see
    /// [`Shape::inner_ball`](crate::collide::Shape::inner_ball).
    pub inner_ball: Option<(DVec3, f64)>,
    /// Whether every list is proved exact for the current vertices.
    pub has_exact_lists: bool,
    /// Half of the thickness of a sheet, whose faces' distances the field is; otherwise 0.
    pub half_thickness: f64,
    /// Corner vertices of the tetrahedra of a conforming domain; each tetrahedron is a root of the
    /// forest. The mesh's vertices come first, then the domain's own. Empty for the bisection
    /// domain, whose roots are the six tetrahedra of the cube.
    pub tetrahedra: &'a [[u32; 4]],
    /// Current vertices of the mesh, in its unit.
    pub vertices: &'a [[f64; 3]],
    /// Current vertices of a conforming domain that are not of the mesh, in the mesh's unit.
    pub domain_vertices: &'a [[f64; 3]],
}

/// What tells the side of points in crossing cells where the listed faces do not.
#[derive(Clone, Debug)]
pub struct SignArrays {
    /// The rule. All faces count, and the triangles.
    pub rule: InsideRule,
    /// Triangles that count for the side alone, in the local frame.
    pub triangles: Vec<[DVec3; 3]>,
    /// Triangles that close an open mesh, in the local frame: each begins with an open edge. The side
    /// then changes where there is no face, too. Empty for a closed mesh.
    pub closing: Vec<[DVec3; 3]>,
    /// How far the inside of an open mesh can extend beyond the bounds of its faces; otherwise 0.
    pub reach_beyond: f64,
    /// Whether no face has the inside in front of it.
    pub faces_look_outward: bool,
}

impl TeSdf {
    /// What tells the side of points; `None` where the listed faces do, or where there are no
    /// sides.
    #[doc(hidden)]
    pub fn sign_arrays(&self) -> Option<SignArrays> {
        let rule = self.sign_rule()?;
        let local = |v: u32| self.frame.to_local(DVec3::from_array(self.vertices[v as usize]));
        let faces = self.sign_faces.as_deref().unwrap_or(&[]);
        let triangles = faces.iter().map(|face| face.map(local)).collect();
        Some(SignArrays {
            rule: self.inside().rule,
            triangles,
            closing: rule.jump().map_or(Vec::new(), |jump| jump.closing()),
            reach_beyond: rule.jump().map_or(0.0, GeneralizedWinding::reach_beyond),
            faces_look_outward: self.faces_look_outward(),
        })
    }

    /// The arrays that kernels on other devices read. Computes the bounds of the cells on first
    /// use.
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
            half_thickness: self.half_thickness,
            tetrahedra: self.conforming.as_ref().map_or(&[], Conforming::tetrahedra),
            vertices: &self.vertices,
            domain_vertices: self.conforming.as_ref().map_or(&[], Conforming::vertices),
        }
    }
}

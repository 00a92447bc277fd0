//! Labels the cells of the bisection domain by what is inside.
use glam::DVec3;

use super::filter::PAD;
use crate::asset::layout::Label;
use crate::base::Side;
use crate::domain::Cell;
use crate::geometry::{Aabb, AabbTree, SignRule, triangle_meets_tetrahedron};
use crate::mesh::{Presented, SolidMesh, Telling, TriangleMesh, WindingNumber};

/// What tells the sides of cells. All is in the local frame.
pub enum CellSigns {
    /// The winding number of the surface: inside is where it is 1 or more.
    Winding(WindingNumber),
    /// A rule over all faces. The sign faces are no surface.
    Rule(SignRule, SignFaces),
    /// Nothing: all is outside of the faces.
    Unsigned,
}

/// Faces that count for the sign only, with a tree over their boxes.
pub struct SignFaces {
    triangles: Vec<[DVec3; 3]>,
    tree: AabbTree,
}

/// Largest number of faces in a leaf.
const LEAF: usize = 4;

impl SignFaces {
    /// Builds the tree.
    pub fn new(triangles: Vec<[DVec3; 3]>) -> Self {
        let boxes: Vec<Aabb> = triangles.iter().map(|t| Aabb::of(t).grown(PAD)).collect();
        Self { tree: AabbTree::build(&boxes, LEAF), triangles }
    }

    /// Whether one of the faces comes within the padding of a cell.
    fn any_in(&self, cell: &Cell) -> bool {
        let (reach, mut any) = (Aabb::of(&cell.corners), false);
        let meets = |&f: &u32| triangle_meets_tetrahedron(&self.triangles[f as usize], &cell.corners, PAD);
        self.tree.visit(|bounds| bounds.overlaps(reach), |faces| any |= faces.iter().any(meets));
        any
    }
}

impl CellSigns {
    /// `local` has the presented faces in the local frame.
    pub fn new(solid: &SolidMesh, presented: &Presented, local: &TriangleMesh) -> Self {
        match presented.telling {
            Telling::Winding => Self::Winding(WindingNumber::new(local)),
            Telling::Sheet => Self::Unsigned,
            Telling::Rule | Telling::RuleUnoriented => {
                let position = |v: u32| local.vertices()[v as usize];
                let faces = [local.faces(), &presented.sign_faces].concat();
                let triangles = presented.sign_faces.iter().map(|f| f.map(position)).collect();
                Self::Rule(SignRule::new(solid.inside().rule, &faces, position), SignFaces::new(triangles))
            }
        }
    }

    /// Whether the sign changes in holes of the mesh.
    pub fn jumps(&self) -> bool {
        matches!(self, Self::Rule(rule, _) if rule.jumps())
    }

    /// Whether a point is inside, for choices that only cost depends on.
    pub fn is_inside(&self, p: DVec3) -> bool {
        match self {
            Self::Winding(winding) => winding.at(p) >= 1,
            Self::Rule(rule, _) => rule.is_inside(p),
            Self::Unsigned => false,
        }
    }

    /// The label of a cell. `crosses`: faces of the surface come within its padding.
    pub fn label(&self, cell: &Cell, crosses: bool) -> Label {
        let side = match self {
            Self::Winding(winding) => match (crosses, winding.at_perturbed(cell.centroid())) {
                // The number is read back as an `i32`: it is negative where the surface is inside
                // out.
                (true, w) => return Label::Crossing(w as u32),
                (false, w) if w >= 1 => Side::Inside,
                _ => Side::Outside,
            },
            // The rule is evaluated at the points of crossing cells. They need no number.
            Self::Rule(_, faces) if crosses || faces.any_in(cell) => return Label::Crossing(0),
            Self::Rule(rule, _) => match rule.side_within(cell.centroid(), cell.radius() + PAD) {
                Some(side) => side,
                None => return Label::Crossing(0),
            },
            Self::Unsigned => Side::Outside,
        };
        match side {
            Side::Inside => Label::Inside,
            Side::Outside => Label::Outside,
        }
    }
}

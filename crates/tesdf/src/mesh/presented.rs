//! The faces that the encoder takes from a solid, and what tells their sides.
use std::borrow::Cow;

use super::{MeshError, SolidMesh, TriangleMesh};
use crate::base::InsideRule;

/// What tells the sides of the faces that a solid presents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Telling {
    /// Their winding number: inside is where it is 1 or more.
    Winding,
    /// The rule of the solid, over all faces of the mesh.
    Rule,
    /// Nothing.
    Sheet,
}

/// A solid as the encoder takes it.
pub(crate) struct Presented<'a> {
    /// All vertices, and the faces of the surface.
    pub mesh: Cow<'a, TriangleMesh>,
    /// The ids of these faces in the mesh; `None`: all faces in their order.
    pub ids: Option<Vec<u32>>,
    /// What tells their sides.
    pub telling: Telling,
    /// Faces that are no surface but count for the sign.
    pub sign_faces: Vec<[u32; 3]>,
    /// Whether the faces are an embedded manifold with winding number 0 or 1 everywhere.
    pub is_simple: bool,
}

impl SolidMesh {
    /// The faces of the surface, and what tells their sides.
    pub(crate) fn presented(&self) -> Result<Presented<'_>, MeshError> {
        let telling = match self.inside().rule {
            InsideRule::Sheet { .. } => Telling::Sheet,
            _ if self.is_told_by_winding() => Telling::Winding,
            _ => Telling::Rule,
        };
        let (mesh, ids) = match self.mesh().faces() {
            // A tree has two leaves at least. A face and its reverse enclose nothing, as one face
            // does.
            &[[a, b, c]] => {
                let both = TriangleMesh::new(self.mesh().vertices().to_vec(), vec![[a, b, c], [a, c, b]])?;
                (Cow::Owned(both), Some(vec![0, 0]))
            }
            _ => (Cow::Borrowed(self.mesh()), None),
        };
        Ok(Presented {
            mesh,
            ids,
            telling,
            sign_faces: Vec::new(),
            is_simple: self.is_simple() && telling == Telling::Winding,
        })
    }

    /// Whether the rule holds where the winding number is 1 or more, and nowhere else, as far as the
    /// winding numbers of the check tell. With all faces as the surface.
    fn is_told_by_winding(&self) -> bool {
        match (self.inside().rule, self.winding()) {
            (InsideRule::Winding, _) => true,
            (InsideRule::Sheet { .. }, _) | (_, None) => false,
            (rule, Some([least, greatest])) => {
                least >= 0 && (0..=greatest).all(|w| rule.holds(w) == (w >= 1))
            }
        }
    }
}

//! The faces that the encoder takes from a solid, and what tells their sides.
use std::borrow::Cow;

use super::{
    Defect, DefectKind, FaceClass, MeshError, Severity, Survey, Topology, TriangleMesh, check_and_survey,
};
use crate::base::{Inside, InsideRule, SurfaceFaces};

/// What tells the sides of the faces that a solid presents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Telling {
    /// Their winding number: inside is where it is 1 or more.
    Winding,
    /// The rule of the solid, over all faces of the mesh.
    Rule,
    /// The same, and some faces have the inside in front of them in places.
    RuleUnoriented,
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

/// Which faces of a mesh are the surface of a solid, and what tells their sides.
///
/// Where the boundary of the solid is made of whole faces, these faces, turned outward, have a
/// winding number of 1 or more exactly inside. Then this number tells the sides, whatever the rule
/// was (`docs/math.md`, section 10). Otherwise the rule is evaluated over all faces.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Presentation {
    telling: Telling,
    faces: Faces,
    is_simple: bool,
    /// Faces of the surface that lie partly within the solid, or partly outside of it.
    partly: Vec<u32>,
}

#[derive(Clone, Debug, PartialEq)]
enum Faces {
    /// All faces as they are.
    All,
    /// Some faces, by their ids, and whether each is turned round.
    Some(Vec<(u32, bool)>),
}

impl Presentation {
    /// `winding` is the range of winding numbers, and `survey` those of all sides of faces, where
    /// they are known. `hairs`: the faces without area that stand out.
    pub fn new(
        mesh: &TriangleMesh,
        inside: Inside,
        winding: Option<[i32; 2]>,
        survey: Option<Survey>,
        hairs: &[u32],
    ) -> Self {
        let Inside { rule, surface } = inside;
        let all = |telling| Self { telling, faces: Faces::All, is_simple: true, partly: Vec::new() };
        let by_rule = || Self { is_simple: false, ..all(Telling::RuleUnoriented) };
        if let InsideRule::Sheet { .. } = rule {
            return Self { is_simple: false, ..all(Telling::Sheet) };
        }
        if inside == Inside::default() {
            return all(Telling::Winding);
        }
        let Some(survey) = survey else { return by_rule() };
        if surface == SurfaceFaces::All && survey.is_complete() {
            let told =
                |[least, greatest]: [i32; 2]| least >= 0 && (0..=greatest).all(|w| rule.holds(w) == (w >= 1));
            if winding.is_some_and(told) {
                return all(Telling::Winding);
            }
            if rule != InsideRule::Odd && winding.is_some_and(|[_, greatest]| greatest <= 0) {
                let turned = (0..mesh.faces().len() as u32).map(|f| (f, true)).collect();
                return Self::turned(mesh, turned).unwrap_or_else(by_rule);
            }
        }
        let classes = survey.classes(rule);
        let kept: Vec<(u32, bool)> = match surface {
            SurfaceFaces::All => (0..).zip(&classes).map(|(f, c)| (f, is_inward(*c))).collect(),
            SurfaceFaces::Boundary => boundary(mesh, &classes, hairs),
        };
        if kept.is_empty() {
            return by_rule();
        }
        // A face without area is not known, and changes no winding number.
        let is_whole = |&(f, _): &(u32, bool)| {
            matches!(classes[f as usize], FaceClass::Outward | FaceClass::Inward | FaceClass::Unknown)
        };
        if survey.is_complete() && kept.iter().all(is_whole) {
            // It may fail where edges of the boundary lie on each other without sharing vertices.
            if let Some(turned) = Self::turned(mesh, kept.clone()) {
                return turned;
            }
        }
        let is_partly = |f: &u32| {
            !matches!(classes[*f as usize], FaceClass::Outward | FaceClass::Inward | FaceClass::Unknown)
        };
        let has_both = kept.iter().any(|k| classes[k.0 as usize] == FaceClass::Mixed);
        let is_oriented = survey.is_complete() && !has_both;
        let partly = match surface {
            SurfaceFaces::All => Vec::new(),
            SurfaceFaces::Boundary => kept.iter().map(|k| k.0).filter(is_partly).collect(),
        };
        Self {
            telling: if is_oriented { Telling::Rule } else { Telling::RuleUnoriented },
            partly,
            faces: Faces::Some(kept),
            ..by_rule()
        }
    }

    /// The faces, turned outward, if their winding number tells the sides: each of them must have a
    /// number below 1 in front of it, and of 1 or more behind it, everywhere.
    fn turned(mesh: &TriangleMesh, faces: Vec<(u32, bool)>) -> Option<Self> {
        let made = part(mesh, &faces).ok()?;
        if made.faces().is_empty() || !Topology::new(made.faces()).is_closed() {
            return None;
        }
        let (report, survey) = check_and_survey(&made, InsideRule::Winding);
        let survey = survey.filter(Survey::is_complete)?;
        let outward = |c: FaceClass| c == FaceClass::Outward || c == FaceClass::Unknown;
        let is_told = survey.classes(InsideRule::Winding).into_iter().all(outward);
        let all = faces.len() == mesh.faces().len() && faces.iter().all(|(_, turned)| !turned);
        is_told.then(|| Self {
            telling: Telling::Winding,
            faces: if all { Faces::All } else { Faces::Some(faces) },
            is_simple: report.is_simple(),
            partly: Vec::new(),
        })
    }

    /// The faces of the surface of the mesh, and what tells their sides. `is_simple`: all faces are
    /// an embedded manifold with winding number 0 or 1 everywhere.
    pub fn of<'a>(&self, solid: &'a TriangleMesh, is_simple: bool) -> Result<Presented<'a>, MeshError> {
        let &Self { mut telling, ref faces, is_simple: own, .. } = self;
        let all = solid.faces();
        let (mut mesh, mut ids) = match faces {
            Faces::All => (Cow::Borrowed(solid), None),
            Faces::Some(some) => {
                let ids: Vec<u32> = some.iter().map(|(face, _)| *face).collect();
                (Cow::Owned(part(solid, some)?), Some(ids))
            }
        };
        // A tree has two leaves at least. A face and its reverse enclose nothing, as one face does.
        let single = match mesh.faces() {
            &[face] => Some(face),
            _ => None,
        };
        if let Some([a, b, c]) = single {
            let both = vec![[a, b, c], [a, c, b]];
            mesh = Cow::Owned(TriangleMesh::new(solid.vertices().to_vec(), both)?);
            ids = Some(vec![ids.map_or(0, |ids| ids[0]); 2]);
            if telling == Telling::Rule {
                telling = Telling::RuleUnoriented;
            }
        }
        let sign_faces = match (telling, faces) {
            (Telling::Rule | Telling::RuleUnoriented, Faces::Some(some)) => {
                // A face that is turned round counts -1, and twice more as it was: 1 in all. One
                // that has its reverse counts 0.
                let mut times = vec![1; all.len()];
                if single.is_none() {
                    some.iter().for_each(|&(f, turned)| times[f as usize] = if turned { 2 } else { 0 });
                }
                all.iter().zip(times).flat_map(|(f, n)| std::iter::repeat_n(*f, n)).collect()
            }
            _ => Vec::new(),
        };
        // The check of a mesh that is presented as it is has told this.
        let is_simple = own && (!matches!(faces, Faces::All) || is_simple);
        Ok(Presented { mesh, ids, telling, sign_faces, is_simple })
    }

    /// Whether a face of the mesh is a face of the surface.
    pub fn has_face(&self, face: u32) -> bool {
        match &self.faces {
            Faces::All => true,
            Faces::Some(some) => some.iter().any(|(f, _)| *f == face),
        }
    }

    /// A warning where faces lie only partly between inside and outside.
    pub fn partly_buried(&self, mesh: &TriangleMesh) -> Option<Defect> {
        let first = *self.partly.first()?;
        let message = format!(
            "face {first}{} lies partly within the solid and stays in the surface as a whole: distances inside may refer to \
             its inner part",
            match self.partly.len() {
                1 => String::new(),
                n => format!(", like {} others,", n - 1),
            }
        );
        let place = mesh.triangle(first as usize).iter().sum::<glam::DVec3>() / 3.0;
        let defect = Defect::new(DefectKind::PartlyBuried, Severity::Warning, place, message);
        Some(defect.faces(self.partly.clone()))
    }
}

fn is_inward(class: FaceClass) -> bool {
    matches!(class, FaceClass::Inward | FaceClass::PartlyInward)
}

/// The faces that are not buried, and whether each looks inward. A face of which nothing is known
/// stays when it has a vertex of another face that stays, unless it stands out of the surface.
fn boundary(mesh: &TriangleMesh, classes: &[FaceClass], hairs: &[u32]) -> Vec<(u32, bool)> {
    let mut used = vec![false; mesh.vertices().len()];
    let known = |c: FaceClass| !matches!(c, FaceClass::Buried | FaceClass::Unknown);
    for (corners, _) in mesh.faces().iter().zip(classes).filter(|(_, c)| known(**c)) {
        corners.iter().for_each(|&v| used[v as usize] = true);
    }
    let stays = |&(face, class): &(u32, &FaceClass)| match class {
        FaceClass::Buried => false,
        FaceClass::Unknown => {
            hairs.binary_search(&face).is_err()
                && mesh.faces()[face as usize].iter().any(|&v| used[v as usize])
        }
        _ => true,
    };
    (0..).zip(classes).filter(stays).map(|(f, c)| (f, is_inward(*c))).collect()
}

/// A mesh of the same vertices, and some of the faces, each turned round or not.
fn part(mesh: &TriangleMesh, faces: &[(u32, bool)]) -> Result<TriangleMesh, MeshError> {
    let turned = |&(face, turned): &(u32, bool)| {
        let [a, b, c] = mesh.faces()[face as usize];
        if turned { [a, c, b] } else { [a, b, c] }
    };
    TriangleMesh::new(mesh.vertices().to_vec(), faces.iter().map(turned).collect())
}

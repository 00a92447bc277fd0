//! Proves that the label of a cell is right everywhere in the cell: the winding number at its
//! centroid agrees, and no face passes through.
use glam::DVec3;

use super::apart::{are_apart, common_point};
use super::parts::rounding;
use super::report::{Claim, Fault};
use super::surface::Surface;
use super::winding::Rays;
use crate::TeSdf;
use crate::asset::about;
use crate::asset::layout::{Label, Node};
use crate::base::Side;
use crate::domain::Cell;
use crate::geometry::Aabb;

/// Checks the labels of the cells of a bisection domain.
pub struct Signs<'a> {
    pub asset: &'a TeSdf,
    pub surface: &'a Surface,
    pub rays: Rays<'a>,
    /// Corners of the faces that are no surface but count for the sign.
    pub sign_faces: &'a [[DVec3; 3]],
    /// A face this near to a cell counts as passing through it. It is more than the distance by
    /// which a point can miss its cell.
    pub gap: f64,
}

impl Signs<'_> {
    /// The fault in the sign of a cell; `None` when it is proved. `near` are the faces near the
    /// cell, `list` is its list.
    pub fn fault(&self, word: u32, cell: &Cell, node: Node, list: &[u32], near: &[u32]) -> Option<Fault> {
        let fault = self.located(word, cell).or_else(|| match self.asset.about().signs {
            about::Signs::Cells => self.label(cell, node),
            about::Signs::Rule | about::Signs::RuleUnoriented => self.label_of_rule(cell, node),
            about::Signs::Sheet => self.label_of_sheet(cell, node),
        });
        let is_told = match self.asset.about().signs {
            about::Signs::Cells => true,
            // Other cells leave the side to the rule, at each point.
            about::Signs::Rule | about::Signs::RuleUnoriented => {
                matches!(node, Node::Listed(Label::Inside | Label::Outside, _))
            }
            about::Signs::Sheet => false,
        };
        if !is_told {
            return fault.map(|f| f.cell(word));
        }
        let fault = fault.or_else(|| {
            // In a crossing cell, the sign is counted over the faces of the list.
            let counted: &[u32] =
                if matches!(node, Node::Listed(Label::Crossing(_), _)) { list } else { &[] };
            self.passing(cell, near, counted)
        });
        fault.map(|f| f.cell(word))
    }

    /// A fault when a query at the centroid does not find the cell.
    pub fn located(&self, word: u32, cell: &Cell) -> Option<Fault> {
        let centroid = cell.centroid();
        let (_, found) = self.asset.locate_with_word(centroid);
        (found != word as usize).then(|| {
            Fault::refuted(Claim::Sign, "a query at the centroid of the cell arrives at another cell")
                .at(self.asset, centroid)
        })
    }

    fn label(&self, cell: &Cell, node: Node) -> Option<Fault> {
        let centroid = cell.centroid();
        let winding = self.rays.at(centroid);
        let wrong = |says: String| {
            let reason = format!("the label says {says}; the winding number at the centroid is {winding}");
            Some(Fault::refuted(Claim::Sign, reason).at(self.asset, centroid))
        };
        match node {
            Node::Listed(Label::Crossing(w), _) if w as i32 != winding => wrong(format!("{}", w as i32)),
            Node::Listed(Label::Crossing(_), _) | Node::Split(_) => None,
            _ => {
                let inside = side_of(node) == Side::Inside;
                (inside != (winding >= 1)).then_some(())?;
                wrong((if inside { "inside" } else { "outside" }).into())
            }
        }
    }

    /// The label of a cell of an asset whose rule is evaluated at points of other cells.
    fn label_of_rule(&self, cell: &Cell, node: Node) -> Option<Fault> {
        let Node::Listed(Label::Inside | Label::Outside, _) = node else { return None };
        let centroid = cell.centroid();
        let says = side_of(node);
        let jumps = self.asset.about().certificate().jumps();
        let side = match self.asset.sign_rule() {
            Some(rule) if jumps => rule.side_within(centroid, cell.radius() + self.gap),
            _ => {
                let inside = self.asset.inside().rule.holds(self.rays.at(centroid));
                Some(if inside { Side::Inside } else { Side::Outside })
            }
        };
        if side == Some(says) {
            return self.sign_face_in(cell);
        }
        let reason = format!("the label says {says:?}; the rule says {side:?} at the centroid");
        let fault = match side {
            None => Fault::undecided(Claim::Sign, reason),
            Some(_) => Fault::refuted(Claim::Sign, reason),
        };
        Some(fault.at(self.asset, centroid))
    }

    /// A fault when a face that counts for the sign only comes into a cell with a side.
    fn sign_face_in(&self, cell: &Cell) -> Option<Fault> {
        let middle = cell.centroid();
        let corners = cell.corners.map(|c| c - middle);
        let radius = corners.iter().map(|c| c.length()).fold(0.0, f64::max);
        let reach = Aabb::of(&cell.corners).grown(2.0 * self.gap);
        let comes_in = self.sign_faces.iter().filter(|t| Aabb::of(&t[..]).overlaps(reach)).any(|t| {
            let local = t.map(|c| c - middle);
            let error = rounding(local.iter().map(|c| c.length()).fold(radius, f64::max) + radius);
            !are_apart(&corners, &local, self.gap, error)
        });
        comes_in.then(|| {
            let reason =
                "a face that counts for the sign may pass through the cell, whose label says that none does";
            Fault::undecided(Claim::Sign, reason).at(self.asset, middle)
        })
    }

    /// The label of a cell of a sheet: everything is outside of the faces.
    fn label_of_sheet(&self, cell: &Cell, node: Node) -> Option<Fault> {
        let is_outside = matches!(
            node,
            Node::Listed(Label::Outside, _) | Node::Far(Side::Outside) | Node::NotOfDomain | Node::Split(_)
        );
        (!is_outside).then(|| {
            let reason = "the label says that the cell has an inside; expected none in a sheet";
            Fault::refuted(Claim::Sign, reason).at(self.asset, cell.centroid())
        })
    }

    /// A fault when a face outside `counted` comes into the cell.
    fn passing(&self, cell: &Cell, near: &[u32], counted: &[u32]) -> Option<Fault> {
        let middle = cell.centroid();
        let corners = cell.corners.map(|c| c - middle);
        let radius = corners.iter().map(|c| c.length()).fold(0.0, f64::max);
        let reach = radius + self.gap + 2.0 * self.surface.error;
        let comes_near = |face: u32| {
            let bound = self.surface.triangles[face as usize].low(middle, self.surface.error);
            bound.distance <= reach && !counted.contains(&face)
        };
        for face in near.iter().copied().filter(|&face| comes_near(face)) {
            let local = self.surface.triangles[face as usize].corners.map(|c| c - middle);
            let error = rounding(local.iter().map(|c| c.length()).fold(radius, f64::max) + radius);
            if are_apart(&corners, &local, self.gap, error) {
                continue;
            }
            let says = if counted.is_empty() {
                "a face passes through the cell, whose label says that none does"
            } else {
                "a face passes through the cell and is not in its list, so the sign is counted without it"
            };
            return Some(
                match common_point(&corners, &local) {
                    Some(p) => Fault::refuted(Claim::Sign, says).at(self.asset, p + middle),
                    None => {
                        let reason =
                            format!("a face comes so near to the cell that it may pass through it: {says}");
                        Fault::undecided(Claim::Sign, reason).at(self.asset, middle)
                    }
                }
                .face(self.asset, face),
            );
        }
        None
    }

    /// A fault when a vertex lies outside the cube, where every query answers outside.
    pub fn beyond_cube(&self) -> Option<Fault> {
        let (low, side) = (self.asset.cube.origin(), self.asset.cube.side());
        let is_beyond = |p: &DVec3| !(p.cmpge(low).all() && p.cmple(low + side).all());
        let mut corners = self.surface.triangles.iter().flat_map(|t| t.corners);
        let at = corners.find(|p| is_beyond(p))?;
        let reason = "a vertex lies outside of the cube, where every query says outside";
        Some(Fault::refuted(Claim::Sign, reason).at(self.asset, at))
    }
}

/// The side that the label of a cell says; `Outside` for a crossing cell.
pub fn side_of(node: Node) -> Side {
    match node {
        Node::Listed(Label::Inside, _) | Node::Far(Side::Inside) => Side::Inside,
        _ => Side::Outside,
    }
}

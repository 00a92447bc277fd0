//! Middle phase: clips a face by every cell that it meets.
//!
//! The polygon descends the bisection forest, from the six roots of the cube or from the tetrahedra
//! of a conforming domain. Each bisection cuts it by a plane through the cell. So the polygon at a
//! leaf is the face clipped by that leaf, and cells that the face does not meet are not visited.
use glam::DVec3;

use crate::TeSdf;
use crate::asset::Conforming;
use crate::asset::layout::Node;
use crate::base::Side;
use crate::collide::bodies::polygon::{Parts, Polygon, Vertex};
use crate::domain::{Cell, ROOTS};
use crate::geometry::{Aabb, barycentric};
use crate::query::Place;

/// A thinner polygon (local frame) is a sliver. The parts beside it have almost the same distances.
const SLIVER: f64 = 1e-11;

/// The part of a face in a cell.
#[derive(Clone, Debug)]
pub struct ClippedPolygon {
    /// The polygon, in the field's local frame.
    pub polygon: Polygon,
    /// The part of the asset that answers the cell's points.
    pub place: Place,
    /// The word of the cell in the forest; `None` outside the cube.
    pub cell: Option<u32>,
}

/// Clips by the cells that can contain a signed distance up to `reach` (local frame).
///
/// Parts beyond the band are skipped, unless `reach` is wider than the band. Then the face tree
/// answers them.
pub fn clip(asset: &TeSdf, polygon: Polygon, reach: f64, visit: &mut impl FnMut(&ClippedPolygon)) {
    // The inside of an open mesh may extend beyond the domain.
    let beyond = reach >= asset.band() || asset.jump().is_some();
    let clipping = Clipping { asset, reach, beyond };
    if let Some(domain) = &asset.conforming {
        // The domain need not extend beyond the solid.
        return Clipping { beyond: reach > 0.0, ..clipping }.tetrahedra(domain, polygon, visit);
    }
    let (origin, side) = (asset.cube.origin(), asset.cube.side());
    let mut inside = polygon;
    for axis in 0..3 {
        for low in [true, false] {
            let height = |v: &Vertex| {
                let x = v.point[axis] - origin[axis];
                if low { x } else { side - x }
            };
            let out = match inside.cut(height) {
                Parts::Above => continue,
                Parts::Below => std::mem::take(&mut inside),
                Parts::Across(kept, out) => {
                    inside = kept;
                    out
                }
            };
            if clipping.beyond {
                visit(&ClippedPolygon { polygon: out, place: Place::NotOfDomain, cell: None });
            }
            if inside.vertices().is_empty() {
                return;
            }
        }
    }
    clipping.order(inside, [0, 1, 2], 0, visit);
}

struct Clipping<'a> {
    asset: &'a TeSdf,
    reach: f64,
    /// Whether parts beyond the band are needed.
    beyond: bool,
}

impl Clipping<'_> {
    /// Clips by the tetrahedra of a conforming domain. The face tree answers the parts outside all
    /// tetrahedra.
    fn tetrahedra(&self, domain: &Conforming, polygon: Polygon, visit: &mut impl FnMut(&ClippedPolygon)) {
        let mut rest = vec![polygon.clone()];
        self.asset.visit_roots(domain, polygon.bounds(), |root| {
            let corners = self.asset.root(root).corners;
            if let Some(held) = cut_by(&corners, polygon.clone(), |_| {}) {
                self.below(root, held, visit);
            }
            if self.beyond {
                for part in std::mem::take(&mut rest) {
                    if part.bounds().overlaps(Aabb::of(&corners)) {
                        cut_by(&corners, part, |out| rest.push(out));
                    } else {
                        rest.push(part);
                    }
                }
            }
        });
        if self.beyond {
            // Rounding leaves slivers between two tetrahedra. Such a sliver may extend along a side
            // to the outside of the domain.
            let outside = |part: &Polygon| {
                !part.is_thinner(SLIVER) && matches!(self.asset.locate(part.center()), Place::NotOfDomain)
            };
            for polygon in rest.into_iter().filter(outside) {
                visit(&ClippedPolygon { polygon, place: Place::NotOfDomain, cell: None });
            }
        }
    }

    /// Cuts by the planes x_i = x_j between the roots, in the way that sorting three coordinates
    /// compares them. After the comparisons of the neighbours 0 1, 1 2, 0 1, the coordinates of
    /// `axes` are in descending order.
    fn order(
        &self,
        polygon: Polygon,
        axes: [usize; 3],
        comparison: usize,
        visit: &mut impl FnMut(&ClippedPolygon),
    ) {
        let Some(&at) = [0, 1, 0].get(comparison) else {
            let root = ROOTS.iter().position(|r| *r == axes).unwrap_or(0);
            return self.descend(root, polygon, visit);
        };
        let origin = self.asset.cube.origin();
        let mut swapped = axes;
        swapped.swap(at, at + 1);
        let [i, j] = [axes[at], axes[at + 1]];
        // Without an exchange, the last comparison repeats the first. Rounding would then split off
        // what lies in its plane, and one face would have two polygons in a cell.
        let unchanged = if comparison == 1 { 3 } else { comparison + 1 };
        match polygon.cut(|v| (v.point[i] - origin[i]) - (v.point[j] - origin[j])) {
            Parts::Above => self.order(polygon, axes, unchanged, visit),
            Parts::Below => self.order(polygon, swapped, comparison + 1, visit),
            Parts::Across(above, below) => {
                self.order(above, axes, unchanged, visit);
                self.order(below, swapped, comparison + 1, visit);
            }
        }
    }

    /// Descends from a root of the cube.
    fn descend(&self, root: usize, mut polygon: Polygon, visit: &mut impl FnMut(&ClippedPolygon)) {
        let [i, j, k] = ROOTS[root];
        let (origin, inverse) = (self.asset.cube.origin(), 1.0 / self.asset.cube.side());
        for v in polygon.vertices_mut() {
            let u: DVec3 = (v.point - origin) * inverse;
            v.lambda = [1.0 - u[i], u[i] - u[j], u[j] - u[k], u[k]];
        }
        self.below(root, polygon, visit);
    }

    /// Descends from any root. The vertices have their barycentric coordinates in it.
    fn below(&self, root: usize, mut polygon: Polygon, visit: &mut impl FnMut(&ClippedPolygon)) {
        let bounds = self.asset.cell_bounds();
        let mut waiting: Vec<(u32, u32, Polygon)> = Vec::new();
        let (mut word, mut depth) = (root as u32, 0u32);
        loop {
            let node = Node::decode(self.asset.nodes[word as usize], &self.asset.lists);
            match node {
                _ if bounds.least(word) > self.reach => {}
                Node::Split(children) => {
                    let k = 3 - (depth % 3) as usize;
                    depth += 1;
                    word = match polygon.cut(|v| v.lambda[0] - v.lambda[k]) {
                        Parts::Above => children,
                        Parts::Below => children + 1,
                        Parts::Across(above, mut below) => {
                            to_child(&mut below, k, 1);
                            waiting.push((children + 1, depth, below));
                            polygon = above;
                            children
                        }
                    };
                    to_child(&mut polygon, k, (word - children) as usize);
                    continue;
                }
                leaf => self.leaf(word, leaf, std::mem::take(&mut polygon), visit),
            }
            match waiting.pop() {
                Some(next) => (word, depth, polygon) = next,
                None => return,
            }
        }
    }

    fn leaf(&self, word: u32, leaf: Node, polygon: Polygon, visit: &mut impl FnMut(&ClippedPolygon)) {
        let place = match leaf {
            Node::Listed(label, offset) => Place::Listed { label, offset },
            Node::Far(side) => Place::Far(side),
            Node::NotOfDomain if self.beyond => Place::Far(Side::Outside),
            Node::NotOfDomain | Node::Split(_) => return,
        };
        visit(&ClippedPolygon { polygon, place, cell: Some(word) });
    }
}

/// Visits the cell of a point, if that cell can contain a signed distance up to `reach`.
pub fn locate(asset: &TeSdf, point: DVec3, reach: f64, visit: &mut impl FnMut(&ClippedPolygon)) {
    let (place, word) = asset.locate_with_word(point);
    let cell = u32::try_from(word).ok();
    let beyond = matches!(place, Place::NotOfDomain) && reach < asset.band() && asset.jump().is_none();
    if beyond || cell.is_some_and(|word| asset.cell_bounds().least(word) > reach) {
        return;
    }
    visit(&ClippedPolygon { polygon: Polygon::new(&[point]), place, cell });
}

/// The part of a polygon in a tetrahedron, with barycentric coordinates. The other parts go to
/// `out`.
fn cut_by(corners: &[DVec3; 4], mut polygon: Polygon, mut out: impl FnMut(Polygon)) -> Option<Polygon> {
    polygon.vertices_mut().iter_mut().for_each(|v| v.lambda = barycentric(corners, v.point));
    for k in 0..4 {
        match polygon.cut(|v| v.lambda[k]) {
            Parts::Above => {}
            Parts::Below => {
                out(polygon);
                return None;
            }
            Parts::Across(above, below) => {
                out(below);
                polygon = above;
            }
        }
    }
    Some(polygon)
}

fn to_child(polygon: &mut Polygon, k: usize, side: usize) {
    polygon.vertices_mut().iter_mut().for_each(|v| v.lambda = Cell::lambda_of_child(v.lambda, k, side));
}

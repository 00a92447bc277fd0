use tesdf::Side;
use tesdf::asset::layout::{Label, Node};
use tesdf::encode::internal::PAD;
use tesdf::geometry::internal::triangle_meets_tetrahedron;
use tesdf::geometry::{Aabb, Triangle};
use tesdf::glam::DVec3;

use super::cells::{Cells, Located, barycentric, combine, lattice};
use super::random::Random;
use super::reference::Reference;

/// The guarantees of an asset about its cells, in its local frame, checked without code of the
/// encoder.
///
/// - Each cell is reached once and halves its parent (checked while [`Cells`] reads them).
/// - Lists ascend, without repetitions.
/// - At no point of a cell is the list farther than the mesh by more than `delta`.
/// - A list names every face within the padding of its cell, and faces meet only crossing cells.
/// - Labels agree with the winding number. Cells that are not of the domain are outside and beyond
///   the band.
/// - Point location finds the cell that contains the point.
pub struct WellFormed<'a> {
    pub reference: &'a Reference,
    pub cells: &'a Cells,
    /// Band of the domain, in the local frame.
    pub band: f64,
    /// Number of lattice points along an edge of each cell.
    pub lattice: usize,
    /// Largest number of checked cells; they are evenly spread.
    pub max_cells: usize,
}

/// Accepted rounding error of the encoder as a fraction of the diagonal, as in the certificate.
const DELTA: f64 = 1e-13;

impl WellFormed<'_> {
    pub fn check(&self) -> Result<(), String> {
        let n = self.cells.leaves.len();
        let step = n.div_ceil(self.max_cells);
        let mut random = Random(n as u64);
        for (i, leaf) in self.cells.leaves.iter().enumerate().step_by(step) {
            let check = |what: &str, found: Result<(), String>| {
                found.map_err(|e| format!("leaf {i} of {n}, {:?}: {what}: {e}", leaf.node))
            };
            check("list", self.check_order(leaf))?;
            check("faces that meet the cell", self.check_meeting(leaf))?;
            let mut points = lattice(&leaf.cell.corners, self.lattice);
            points.extend((0..8).map(|_| combine(&leaf.cell.corners, &random.weights())));
            points.iter().try_for_each(|&p| check("distance", self.check_distance(leaf, p)))?;
            for &p in &points[points.len() - 8..] {
                check("label", self.check_label(leaf, p))?;
                check("location", self.check_location(leaf, p))?;
            }
        }
        (0..1000).try_for_each(|_| {
            let p = self.cells.cube.origin() + self.cells.cube.side() * (0.5 + 0.5 * random.in_cube());
            let leaf = self.cells.locate(p).ok_or(format!("{p} is in no cell"))?;
            self.check_location(leaf, p)
        })
    }

    fn check_order(&self, leaf: &Located) -> Result<(), String> {
        match leaf.node {
            Node::Listed(..) if leaf.positions.is_empty() => Err("it is empty".into()),
            _ if leaf.positions.windows(2).all(|w| w[0] < w[1]) => Ok(()),
            _ => Err(format!("{:?} does not ascend", leaf.positions)),
        }
    }

    fn check_distance(&self, leaf: &Located, p: DVec3) -> Result<(), String> {
        if !matches!(leaf.node, Node::Listed(..)) {
            return Ok(());
        }
        let triangles = leaf.faces.iter().map(|&f| &self.reference.triangles[f as usize]);
        let listed = triangles.map(|t| t.closest(p).distance).fold(f64::INFINITY, f64::min);
        let (face, exact) = self.reference.closest_local(p);
        let excess = (listed - exact.distance) / self.reference.local_diagonal();
        if excess > DELTA {
            let weights = barycentric(&leaf.cell.corners, p);
            return Err(format!(
                "face {face} at {:e} is nearer by {excess:e} diagonals at {weights:?}",
                exact.distance
            ));
        }
        Ok(())
    }

    fn check_meeting(&self, leaf: &Located) -> Result<(), String> {
        let corners = &leaf.cell.corners;
        let crossing = matches!(leaf.node, Node::Listed(Label::Crossing(_), _));
        for face in self.reference.overlapping(Aabb::of(corners).grown(PAD)) {
            let triangle = &self.reference.triangles[face as usize];
            // The separating-axis test may return true without need. Only then the slower distance
            // is computed.
            let met = triangle_meets_tetrahedron(&triangle.corners, corners, PAD);
            if met && !(crossing && leaf.faces.contains(&face)) {
                let gap = gap(triangle, corners);
                if gap < 0.99 * PAD {
                    return Err(format!("face {face} is {gap:e} away and not listed"));
                }
            }
        }
        Ok(())
    }

    /// `p` must be inside the cell.
    fn check_label(&self, leaf: &Located, p: DVec3) -> Result<(), String> {
        let reference = self.reference;
        let winding = |p: DVec3| reference.winding().at_perturbed(reference.frame.to_world(p));
        let found = winding(p);
        let right = match leaf.node {
            Node::Listed(Label::Crossing(w), _) => {
                let centroid = leaf.cell.centroid();
                // In the mesh's frame the centroid is rounded. Near the surface it can be on
                // another side.
                let beside = reference.closest_local(centroid).1.distance < 1e-12;
                beside || winding(centroid) == w as i32
            }
            Node::Listed(Label::Inside, _) | Node::Far(Side::Inside) => found >= 1,
            Node::Listed(Label::Outside, _) | Node::Far(Side::Outside) => found == 0,
            Node::NotOfDomain => found == 0 && reference.closest_local(p).1.distance > self.band,
            Node::Split(_) => false,
        };
        if right { Ok(()) } else { Err(format!("winding number {found} at {p}")) }
    }

    fn check_location(&self, leaf: &Located, p: DVec3) -> Result<(), String> {
        let holds = |l: &Located| {
            // Fixed-point location truncates coordinates to 2^-52 of the cube, at any depth.
            let slack = 8.0 * f64::EPSILON * 2f64.powf(f64::from(l.cell.depth) / 3.0);
            barycentric(&l.cell.corners, p).iter().all(|&w| w >= -slack)
        };
        let found = self.cells.locate(p).ok_or(format!("{p} is in no cell"))?;
        match (holds(leaf), holds(found)) {
            (true, true) => Ok(()),
            which => Err(format!("{p}: (expected, found) hold it: {which:?}")),
        }
    }
}

/// The distance between a triangle and a tetrahedron.
fn gap(triangle: &Triangle, t: &[DVec3; 4]) -> f64 {
    let inside = |p: DVec3| barycentric(t, p).iter().all(|&w| w >= 0.0);
    if triangle.corners.iter().any(|&p| inside(p)) {
        return 0.0;
    }
    let sides = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]].map(|s| Triangle::new(s.map(|k: usize| t[k])));
    sides.iter().map(|s| triangles_gap(triangle, s)).fold(f64::INFINITY, f64::min)
}

/// The distance between two triangles: corner to triangle and edge to edge, or 0 where an edge
/// passes through.
fn triangles_gap(a: &Triangle, b: &Triangle) -> f64 {
    let mut least = f64::INFINITY;
    for (t, o) in [(a, b), (b, a)] {
        for k in 0..3 {
            let (p, q) = (t.corners[k], t.corners[(k + 1) % 3]);
            least = least.min(o.closest(p).distance);
            // The distance from a convex body is convex along a segment, so ternary search finds
            // its minimum.
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..80 {
                let (s, u) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
                let at = |x: f64| o.closest(p + x * (q - p)).distance;
                if at(s) < at(u) {
                    high = u
                } else {
                    low = s
                }
                least = least.min(at(s));
            }
        }
    }
    least
}

//! Claims on a piece: for which parts of the surface the list is known to be as near, and at what
//! cost.
//!
//! A *claim* `(o, κ)` on a piece says: `d(x, list) ≤ d(x, o) + κ` for every point `x` of the piece.
//! `docs/math.md`, section 15, proves each rule.
use super::parts::Edge;
use super::piece::Piece;
use super::problem::{Item, OpenFace, Problem};

/// Fraction of `delta` that all rules of a chain may cost together.
const MAX_COST: f64 = 0.875;

/// The claims that hold on a piece: those of the whole cell and those added on the way to the
/// piece.
pub struct Claims<'a> {
    problem: &'a Problem,
    /// The cost of each item's claim; infinite when it has no claim.
    cost: Vec<f64>,
    /// Items in the order in which they were claimed.
    trail: Vec<Item>,
}

impl<'a> Claims<'a> {
    /// Begins with claims on all items that the list holds, at cost 0.
    pub fn new(problem: &'a Problem) -> Self {
        let mut claims = Self { problem, cost: vec![f64::INFINITY; problem.items()], trail: Vec::new() };
        for &item in &problem.held {
            claims.add(item, 0.0);
        }
        claims
    }

    /// Number of claims; see [`forget`](Self::forget).
    pub fn count(&self) -> usize {
        self.trail.len()
    }

    /// Removes all claims except the first `count`.
    pub fn forget(&mut self, count: usize) {
        for item in self.trail.drain(count..) {
            self.cost[self.problem.place(item)] = f64::INFINITY;
        }
    }

    /// The cost of an item's claim; infinite when it has no claim.
    pub fn cost(&self, item: Item) -> f64 {
        self.cost[self.problem.place(item)]
    }

    /// Whether the item has no claim yet.
    pub fn is_open(&self, item: Item) -> bool {
        self.cost(item) == f64::INFINITY
    }

    /// Adds a claim, unless it costs too much or the item has a claim already. Returns whether it
    /// was added.
    pub fn add(&mut self, item: Item, cost: f64) -> bool {
        let is_new = cost <= MAX_COST * self.problem.delta && self.is_open(item);
        if is_new {
            let place = self.problem.place(item);
            self.cost[place] = cost;
            self.trail.push(item);
        }
        is_new
    }

    /// Cost of a claim on a vertex that follows from claims on edges and faces around it.
    pub fn vertex_by_others(&self, vertex: u32) -> f64 {
        self.least(&self.problem.around_vertex[vertex as usize])
    }

    /// Cost of a claim on an edge that follows from claims on faces around it, or from a claim on
    /// the end that is nearest everywhere on the piece.
    pub fn edge_by_others(&self, edge: u32, piece: &Piece) -> f64 {
        let by_faces = self.least(&self.problem.around_edge[edge as usize]);
        by_faces.min(self.edge_by_ends(edge, &self.problem.edges[edge as usize], piece))
    }

    fn edge_by_ends(&self, edge: u32, shape: &Edge, piece: &Piece) -> f64 {
        let ends = self.problem.ends[edge as usize];
        let mut most = [f64::NEG_INFINITY; 2];
        for corner in piece.corners {
            let Some(within) = shape.within(corner) else { return f64::INFINITY };
            most = [0, 1].map(|end| most[end].max(within[end]));
        }
        let by = |end: usize| self.touched(most[end]) + self.cost(Item::Vertex(ends[end]));
        by(0).min(by(1))
    }

    /// Cost of treating the piece as outside a region. `most` is the greatest value, at the piece's
    /// corners, of a function that is positive inside the region.
    fn touched(&self, most: f64) -> f64 {
        let Problem { error, touch, .. } = *self.problem;
        if most <= -error {
            0.0
        } else if most + error <= touch {
            touch
        } else {
            f64::INFINITY
        }
    }

    fn least(&self, items: &[Item]) -> f64 {
        items.iter().map(|&item| self.cost(item)).fold(f64::INFINITY, f64::min)
    }

    /// Cost of a claim on a face that follows from claims on its edges, when no point of the piece
    /// is over the face.
    pub fn face_by_border(&self, face: &OpenFace, piece: &Piece) -> f64 {
        let border = face.border.map(|item| self.cost(item));
        let mut sides = [[0.0; 3]; 4];
        for (side, &corner) in sides.iter_mut().zip(&piece.corners) {
            match face.shape.sides(corner) {
                Some(found) => *side = found,
                None => return border.into_iter().fold(0.0, f64::max) + face.shape.thickness,
            }
        }
        let missed = self.touched(max_inside(&sides));
        let mut cost = 0.0;
        for k in 0..3 {
            // When the whole piece is on the inner side of an edge, no closest point lies on that
            // edge.
            let is_clear = sides.iter().all(|s| s[k] >= 2.0 * self.problem.touch + self.problem.error);
            if !is_clear {
                cost = f64::max(cost, border[k]);
            }
        }
        missed + cost
    }

    /// Costs of claims on the edges of a face that is no thicker than rounding, each from claims on
    /// the other edges.
    pub fn thin_border(&self, face: &OpenFace) -> [f64; 3] {
        let longest = face.shape.longest_edge();
        let cost = face.border.map(|item| self.cost(item));
        let others = cost[(longest + 1) % 3].max(cost[(longest + 2) % 3]);
        std::array::from_fn(|k| face.shape.thickness + if k == longest { others } else { cost[longest] })
    }
}

/// An upper bound on how far inside all three sides a point of a piece can be: the least, over some
/// mixtures of two sides, of the greatest value at the corners.
fn max_inside(sides: &[[f64; 3]; 4]) -> f64 {
    let of = |weights: [f64; 3]| {
        let value = |s: &[f64; 3]| weights[0] * s[0] + weights[1] * s[1] + weights[2] * s[2];
        sides.iter().map(value).fold(f64::NEG_INFINITY, f64::max)
    };
    let mut least = of([1.0, 0.0, 0.0]).min(of([0.0, 1.0, 0.0])).min(of([0.0, 0.0, 1.0]));
    for (k, l) in [(0, 1), (1, 2), (2, 0)] {
        // The maximum of affine functions of the weight is least where two of them are equal.
        for i in 0..4 {
            for j in 0..i {
                let slope = |s: &[f64; 3]| s[k] - s[l];
                let change = slope(&sides[i]) - slope(&sides[j]);
                let weight = (sides[j][l] - sides[i][l]) / change;
                if weight > 0.0 && weight < 1.0 {
                    let mut weights = [0.0; 3];
                    weights[k] = weight;
                    weights[l] = 1.0 - weight;
                    least = least.min(of(weights));
                }
            }
        }
    }
    least
}

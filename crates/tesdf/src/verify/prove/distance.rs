//! Proves for one cell that no face outside its list is closer than the list by more than `delta`,
//! or finds a point where a face is.
//!
//! The cell is cut into pieces until a rule settles every face on every piece. Values at corners
//! are passed on from piece to piece, because a cut makes only one new corner.
use glam::DVec3;

use super::claims::Claims;
use super::dominance::{COST, Dominance, Nearest, Rival};
use super::parts::Bound;
use super::piece::{Cut, Piece};
use super::problem::{Item, Problem};

/// Pieces after this many cuts are not cut further: the search is recursive, and the stack is
/// limited.
const DEEPEST: u32 = 2000;

/// Pieces are halved this often before they are cut along faces of the list.
const HALVED_FIRST: u32 = 8;
/// Fraction of `delta` that the drift of the pieces may cost.
const DRIFT: f64 = 1.0 / 32.0;
/// Fraction of `delta` that the rounding error may reach.
const ROUNDING: f64 = 0.125;

/// Why a cell is not proved.
#[derive(Clone, Debug, PartialEq)]
pub enum Open {
    /// A face outside the list is closer by more than `delta` at a point of the cell.
    Refuted {
        /// The point, relative to the centroid of the cell.
        at: DVec3,
        /// The face, by its index in the file.
        face: u32,
        /// Lower bound of the distance of the list.
        list: f64,
        /// Upper bound of the distance of the face.
        distance: f64,
    },
    /// The cell is neither proved nor refuted.
    Undecided {
        /// The reason.
        reason: Reason,
        /// A point of the piece at which the search stopped, relative to the centroid of the cell.
        at: DVec3,
        /// A face that is not settled, by its index in the file.
        face: u32,
    },
    /// The search was cancelled.
    Cancelled,
}

/// Why a cell is undecided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// The cell needs more pieces than allowed.
    Pieces,
    /// The rounding error is not small relative to `delta`.
    Rounding,
}

/// The search in one cell.
pub struct Search<'a> {
    problem: &'a Problem,
    claims: Claims<'a>,
    /// Stacks. Each piece owns the end of both.
    rivals: Vec<Rival>,
    faces: Vec<Facing>,
    /// For each item, the number of the piece on which it was last tested.
    tested: Vec<u64>,
    /// Number of pieces so far.
    pub pieces: u64,
    max_pieces: u64,
    is_cancelled: &'a dyn Fn() -> bool,
}

/// A face without a claim.
#[derive(Clone, Copy, Debug)]
struct Facing {
    at: u32,
    /// Lower bounds of its distance from each corner of the piece.
    low: [f64; 4],
    /// Lower bound of its distance from the centre of the piece.
    center: Bound,
}

/// The starts of a piece's entries on both stacks.
#[derive(Clone, Copy)]
struct Start {
    rivals: usize,
    faces: usize,
}

/// Number of pieces between two tests for cancellation.
const LOOK: u64 = 1 << 12;

impl<'a> Search<'a> {
    /// Prepares a search that visits at most `max_pieces` pieces.
    pub fn new(problem: &'a Problem, max_pieces: u64, is_cancelled: &'a dyn Fn() -> bool) -> Self {
        Self {
            problem,
            claims: Claims::new(problem),
            rivals: Vec::new(),
            faces: Vec::new(),
            tested: vec![0; problem.items()],
            pieces: 0,
            max_pieces,
            is_cancelled,
        }
    }

    /// Searches the cell with these corners.
    ///
    /// # Errors
    /// [`Open`]: the cell is not proved.
    pub fn run(&mut self, corners: [DVec3; 4]) -> Result<(), Open> {
        let problem = self.problem;
        let Some(first) = problem.faces.first() else { return Ok(()) };
        if problem.error > ROUNDING * problem.delta {
            let reason = Reason::Rounding;
            return Err(Open::Undecided { reason, at: corners[0], face: first.position });
        }
        let mut nearest = [Nearest::NONE; 4];
        for (at, face) in (0..).zip(&problem.list) {
            let high = corners.map(|c| face.high(c, problem.error));
            nearest = std::array::from_fn(|k| nearest[k].or(at, corners[k], high[k]));
            self.rivals.push(Rival { at, high: high.map(|h| h.distance) });
        }
        for (at, face) in (0..).zip(&problem.faces) {
            let low = corners.map(|c| face.shape.low(c, problem.error).distance);
            self.faces.push(Facing { at, low, center: NOT_SEEN });
        }
        self.settle(&Piece::whole(corners), &nearest, Start { rivals: 0, faces: 0 })
    }

    /// Settles all faces on the stack from `start` on, for one piece.
    fn settle(&mut self, piece: &Piece, nearest: &[Nearest; 4], start: Start) -> Result<(), Open> {
        self.pieces += 1;
        if self.pieces.is_multiple_of(LOOK) && (self.is_cancelled)() {
            return Err(Open::Cancelled);
        }
        let problem = self.problem;
        let claimed = self.claims.count();
        let own = Start { rivals: self.rivals.len(), faces: self.faces.len() };
        let (center, radius) = piece.ball();

        let (at_center, near) = self.look_from_center(center, radius, start);
        let [a, b, c, d] = *nearest;
        let nearest = [a, b, c, d, at_center];
        let dominance = Dominance::new(
            piece,
            self.rivals[own.rivals..].to_vec(),
            &problem.list,
            &nearest,
            problem.error,
            problem.delta,
        );
        let mut least = near;
        for at in start.faces..own.faces {
            let facing = self.faces[at];
            let item = Item::Face(facing.at);
            let part = problem.part(item);
            match dominance.unless_by_ball(part) {
                None => {
                    self.claims.add(item, COST * problem.delta);
                }
                Some(seen) => {
                    least = least.min(seen.distance);
                    self.faces.push(Facing { center: seen, ..facing });
                }
            }
        }
        // The whole piece lies beyond the distance up to which the certificate promises anything.
        let is_beyond = least - radius >= problem.within + problem.delta;
        if !is_beyond {
            self.claim_faces(&dominance, own.faces);
            let mut chain = Chain { search: self, dominance: &dominance, piece, from: own.faces };
            chain.follow();
        }
        let claims = &self.claims;
        let mut kept = own.faces;
        for at in own.faces..self.faces.len() {
            if !is_beyond && claims.is_open(Item::Face(self.faces[at].at)) {
                self.faces[kept] = self.faces[at];
                kept += 1;
            }
        }
        self.faces.truncate(kept);

        if kept > own.faces {
            self.look_for_witness(center, at_center.high, own, piece)?;
            self.divide(piece, &nearest, own)?;
        }
        self.claims.forget(claimed);
        self.rivals.truncate(own.rivals);
        self.faces.truncate(own.faces);
        Ok(())
    }

    /// The nearest face of the list as seen from the centre, and a lower bound of the distance of
    /// the list there. Pushes the rivals that can be nearest somewhere in the piece.
    fn look_from_center(&mut self, center: DVec3, radius: f64, start: Start) -> (Nearest, f64) {
        let problem = self.problem;
        let end = self.rivals.len();
        let mut nearest = Nearest::NONE;
        let mut low = f64::INFINITY;
        for at in start.rivals..end {
            let rival = self.rivals[at];
            let face = &problem.list[rival.at as usize];
            nearest = nearest.or(rival.at, center, face.high(center, problem.error));
            // Every rival is kept for now; the loop below drops those that are too far.
            self.rivals.push(rival);
        }
        let limit = nearest.high + 2.0 * radius;
        let mut kept = end;
        for at in end..self.rivals.len() {
            let rival = self.rivals[at];
            let bound = problem.list[rival.at as usize].low(center, problem.error).distance;
            low = low.min(bound);
            if bound <= limit {
                self.rivals[kept] = rival;
                kept += 1;
            }
        }
        self.rivals.truncate(kept);
        (nearest, low)
    }

    /// Claims faces by the point rule and the plane rule.
    fn claim_faces(&mut self, dominance: &Dominance, from: usize) {
        for at in from..self.faces.len() {
            let facing = self.faces[at];
            let item = Item::Face(facing.at);
            if dominance.is_nearer(self.problem.part(item), &facing.low, facing.center) {
                self.claims.add(item, COST * self.problem.delta);
            }
        }
    }

    /// Fails when a remaining face is closer at the centre than the whole list.
    fn look_for_witness(&self, center: DVec3, high: f64, own: Start, piece: &Piece) -> Result<(), Open> {
        let Problem { delta, error, within, .. } = *self.problem;
        // Besides the errors of the bounds: corners are rounded when taken relative to the centroid
        // of the cell, and pieces drift.
        let clear = delta + 2.0 * error + 2.0 * piece.drift;
        for facing in &self.faces[own.faces..] {
            let face = &self.problem.faces[facing.at as usize];
            if facing.center.distance + clear > high {
                continue;
            }
            let distance = face.shape.high(center, error).distance;
            let of_list = self.problem.list.iter().map(|f| f.low(center, error).distance);
            let list = of_list.fold(f64::INFINITY, f64::min);
            if distance + clear < list && distance < within - delta {
                return Err(Open::Refuted { at: center, face: face.position, list, distance });
            }
        }
        Ok(())
    }

    fn divide(&mut self, piece: &Piece, nearest: &[Nearest; 5], own: Start) -> Result<(), Open> {
        let problem = self.problem;
        let undecided = |reason| {
            let face = problem.faces[self.faces[own.faces].at as usize].position;
            Err(Open::Undecided { reason, at: piece.ball().0, face })
        };
        if self.pieces >= self.max_pieces || piece.depth >= DEEPEST {
            return undecided(Reason::Pieces);
        }
        if piece.drift > DRIFT * problem.delta {
            return undecided(Reason::Rounding);
        }
        let along = (piece.depth >= HALVED_FIRST).then(|| &problem.list[nearest[4].at as usize]);
        let cut = along.and_then(|face| piece.cut_by(face)).unwrap_or_else(|| piece.halved());
        let (new, seen) = self.look_from_cut(&cut, own);
        let [a, b, c, d, _] = *nearest;
        for end in 0..2 {
            let corner = cut.edge[end];
            let below = Start { rivals: self.rivals.len(), faces: self.faces.len() };
            for (at, high) in (own.rivals..below.rivals).zip(&seen.0) {
                let mut rival = self.rivals[at];
                rival.high[corner] = *high;
                self.rivals.push(rival);
            }
            for (at, low) in (own.faces..below.faces).zip(&seen.1) {
                let mut facing = self.faces[at];
                facing.low[corner] = *low;
                self.faces.push(facing);
            }
            let mut nearest = [a, b, c, d];
            nearest[corner] = new;
            self.settle(&piece.child(&cut, end), &nearest, below)?;
            self.rivals.truncate(below.rivals);
            self.faces.truncate(below.faces);
        }
        Ok(())
    }

    /// The nearest face of the list as seen from the new corner, and the bounds for the rivals and
    /// the remaining faces there.
    fn look_from_cut(&self, cut: &Cut, own: Start) -> (Nearest, (Vec<f64>, Vec<f64>)) {
        let problem = self.problem;
        let mut nearest = Nearest::NONE;
        let rivals = self.rivals[own.rivals..].iter().map(|rival| {
            let high = problem.list[rival.at as usize].high(cut.corner, problem.error);
            nearest = nearest.or(rival.at, cut.corner, high);
            high.distance
        });
        let rivals = rivals.collect();
        let low = |f: &Facing| problem.faces[f.at as usize].shape.low(cut.corner, problem.error).distance;
        (nearest, (rivals, self.faces[own.faces..].iter().map(low).collect()))
    }
}

const NOT_SEEN: Bound = Bound { distance: f64::NEG_INFINITY, offset: DVec3::ZERO };

/// Claims by chains: on faces from their edges, on edges from their ends and from the faces around
/// them.
struct Chain<'s, 'a, 't> {
    search: &'s mut Search<'a>,
    dominance: &'t Dominance,
    piece: &'t Piece,
    /// Start of the piece's faces on the stack.
    from: usize,
}

impl Chain<'_, '_, '_> {
    /// Adds claims until no rule adds another claim.
    fn follow(&mut self) {
        let problem = self.search.problem;
        let open: Vec<u32> = self.search.faces[self.from..].iter().map(|f| f.at).collect();
        let mut open: Vec<u32> =
            open.into_iter().filter(|&f| self.search.claims.is_open(Item::Face(f))).collect();
        while !open.is_empty() {
            let before = self.search.claims.count();
            for &face in &open {
                for item in problem.faces[face as usize].border {
                    match item {
                        Item::Edge(edge) => {
                            for vertex in problem.ends[edge as usize] {
                                self.claim_vertex(vertex);
                            }
                            self.claim_edge(edge);
                        }
                        Item::Vertex(vertex) => self.claim_vertex(vertex),
                        Item::Face(_) => {}
                    }
                }
                self.claim_face(face);
            }
            if self.search.claims.count() == before {
                return;
            }
            open.retain(|&f| self.search.claims.is_open(Item::Face(f)));
        }
    }

    fn claim_vertex(&mut self, vertex: u32) {
        let item = Item::Vertex(vertex);
        if self.search.claims.is_open(item) {
            let cost = self.search.claims.vertex_by_others(vertex);
            if !self.search.claims.add(item, cost) {
                self.claim_by_tests(item);
            }
        }
    }

    fn claim_edge(&mut self, edge: u32) {
        let item = Item::Edge(edge);
        if self.search.claims.is_open(item) {
            let cost = self.search.claims.edge_by_others(edge, self.piece);
            if !self.search.claims.add(item, cost) {
                self.claim_by_tests(item);
            }
        }
    }

    fn claim_by_tests(&mut self, item: Item) {
        let problem = self.search.problem;
        let tested = &mut self.search.tested[problem.place(item)];
        if std::mem::replace(tested, self.search.pieces) == self.search.pieces {
            return;
        }
        let part = problem.part(item);
        let is_nearer = match self.dominance.unless_by_ball(part) {
            None => true,
            Some(center) => {
                let low = self.piece.corners.map(|c| part.low(c, problem.error).distance);
                self.dominance.is_nearer(part, &low, center)
            }
        };
        if is_nearer {
            self.search.claims.add(item, COST * problem.delta);
        }
    }

    fn claim_face(&mut self, face: u32) {
        let problem = self.search.problem;
        let shape = &problem.faces[face as usize];
        if shape.shape.normal().is_none() {
            let costs = self.search.claims.thin_border(shape);
            for (item, cost) in shape.border.into_iter().zip(costs) {
                self.search.claims.add(item, cost);
            }
        }
        let cost = self.search.claims.face_by_border(shape, self.piece);
        self.search.claims.add(Item::Face(face), cost);
    }
}

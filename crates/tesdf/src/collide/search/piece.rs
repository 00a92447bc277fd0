//! A part of a face in the search for the least signed distance of a surface.
use glam::DVec3;

use crate::TeSdf;
use crate::collide::bodies::field::{Field, FieldBody, ROUNDING};
use crate::collide::bodies::jump;
use crate::collide::bodies::polygon::{Parts, Polygon};
use crate::collide::bodies::surface::{Part, SurfaceBody};
use crate::collide::scene::field_value::FieldValue;
use crate::collide::search::bulge::Bulge;
use crate::collide::search::depth_bounds::{Bound, DepthBounds, Kind};
use crate::collide::search::longest_edge::longest_edge;
use crate::geometry::{Feature, GeneralizedWinding, Triangle, polygon_to_triangle};

/// A part of a face, or of the core of a rounded shape, in the field's frame.
#[derive(Clone, Debug)]
pub struct Piece {
    /// The face, by its index in the surface's asset.
    pub face: u32,
    /// The surface lies within this distance of the piece.
    pub radius: f64,
    /// A segment has its second corner twice, a point is three equal corners.
    corners: [DVec3; 3],
    count: usize,
    normal: DVec3,
    /// Whether the whole piece is known to be inside.
    is_inside: bool,
    bounds: DepthBounds,
    /// The round side that the piece stands for, if any.
    bulge: Option<Bulge>,
}

/// What a piece has become by a look at it.
pub enum Rest {
    /// No point of it is lower by more than the tolerance.
    Nothing,
    /// It has to be searched in parts, none of which is below the bound.
    Pieces(f64, Vec<Piece>),
}

/// The side of the surface on which a piece is.
enum Side {
    Outside,
    Inside,
    /// It crosses faces. Where these are few, the plane of the one that it crosses deepest.
    Across(Option<Plane>),
}

/// A plane: one of its points, and its normal.
#[derive(Clone, Copy)]
struct Plane(DVec3, DVec3);

/// What a bound has brought.
enum Progress {
    /// A lower greatest value.
    Lower,
    /// Nothing.
    None,
    /// Nothing, because the piece extends beyond a face. This plane cuts off a part over the face.
    Beyond(Plane),
}

/// The lowest point of a surface so far, in the field's frame.
#[derive(Clone, Copy, Debug)]
pub struct Lowest {
    /// Signed distance of the surface point.
    pub distance: f64,
    /// The face, by its index in the surface's asset.
    pub face: u32,
    /// The surface lies within this distance of the point.
    pub radius: f64,
    /// The point of the core of the face.
    pub point: DVec3,
    /// The field there.
    pub value: FieldValue,
}

/// Looks for points of pieces that are lower than all others so far. Lengths are in the field's
/// frame.
pub struct Looks<'a> {
    /// The field.
    pub field: &'a FieldBody<'a>,
    /// Parts are dropped that are not lower than the lowest point by more than this.
    pub tolerance: f64,
    /// Signed distances above this are not wanted.
    pub limit: f64,
    /// The lowest signed distance of any point so far.
    pub least: f64,
    /// A point of these pieces that has the lowest signed distance.
    pub lowest: Option<Lowest>,
}

/// A bulge that is lower than this share of the tolerance is left out.
pub const FLAT: f64 = 0.25;
/// Number of places of one piece that are looked at before it is divided.
const ROUNDS: usize = 8;
/// A piece that crosses up to this number of faces is cut along one of them. Others are halved.
const FEW: usize = 4;
/// A piece is cut along the side of a face where this share of its size is on both sides.
const THIN: f64 = 1e-3;
/// A piece is cut along a jump where this share of its size is on both sides; otherwise it is
/// halved.
const SLICE: f64 = 0.125;
/// Values in `f32` are used while more than this is to be gained (local frame).
const COARSE: f64 = 1e-4;
/// Nearer to the surface than this (local frame), a piece may cross it. Where two faces cross,
/// their computed distance is rarely 0 but about 1e-17.
const CLEAR: f64 = 1e-9;

impl Piece {
    /// A whole face of a surface.
    pub fn new(surface: &SurfaceBody, face: u32, part: &Part) -> Self {
        let piece = Self::of_points(face, part.points(), part.normal, part.radius);
        let bulge = surface.round_side().and_then(|round| Bulge::of_face(round, piece.corners));
        Self { bulge, ..piece }
    }

    /// One to three points of a face that the surface lies within `radius` of.
    pub fn of_points(face: u32, points: &[DVec3], normal: DVec3, radius: f64) -> Self {
        let corners = std::array::from_fn(|k| points[k.min(points.len() - 1)]);
        let bounds = DepthBounds::NONE;
        Self { face, radius, corners, count: points.len(), normal, is_inside: false, bounds, bulge: None }
    }

    /// How far the surface may lie from the piece, or from within the radius of it.
    fn bulge(&self) -> f64 {
        self.bulge.as_ref().map_or(0.0, |bulge| bulge.height)
    }

    /// The point of the surface that a point of the piece stands for.
    fn on_surface(&self, p: DVec3) -> DVec3 {
        self.bulge.as_ref().map_or(p, |bulge| bulge.on_surface(p))
    }

    /// The halves of a piece that stands for a part of a round side.
    fn halves_of_bulge(&self, field: &FieldBody, bulge: &Bulge, is_flat: bool) -> Vec<Self> {
        let faces: Vec<(u32, Triangle)> =
            self.bounds.iter().filter_map(|b| Some((b.face, triangle(field, b.face)?))).collect();
        let half = |(corners, bulge)| Self { bulge, ..self.with_corners(corners, &faces) };
        bulge.halves(self.corners, is_flat).map(half).into()
    }

    /// A piece with other corners, and with the bounds by the distances of these from faces.
    fn with_corners(&self, corners: [DVec3; 3], faces: &[(u32, Triangle)]) -> Self {
        let mut part = Self { corners, bounds: DepthBounds::NONE, ..self.clone() };
        for (face, triangle) in faces {
            part.bounds.add(chord(*face, triangle, corners));
        }
        part
    }

    /// No point of the surface is deeper, by the bounds.
    fn deepest(&self) -> f64 {
        self.bounds.greatest + self.radius + self.bulge()
    }

    fn points(&self) -> &[DVec3] {
        &self.corners[..self.count]
    }

    fn point(&self, [u, v, w]: [f64; 3]) -> DVec3 {
        u * self.corners[0] + v * self.corners[1] + w * self.corners[2]
    }

    fn center(&self) -> DVec3 {
        match self.count {
            1 => self.corners[0],
            2 => 0.5 * (self.corners[0] + self.corners[1]),
            _ => self.corners.iter().sum::<DVec3>() / 3.0,
        }
    }

    /// Greatest distance from `p` to a point of the piece.
    fn reach(&self, p: DVec3) -> f64 {
        self.corners.iter().map(|c| c.distance_squared(p)).fold(0.0, f64::max).sqrt()
    }

    /// The halves, divided in the middle of the longest edge.
    fn halves(&self, field: &FieldBody, hair: f64) -> Vec<Self> {
        let k = if self.count < 3 { 0 } else { longest_edge(self.corners) };
        let l = (k + 1) % 3;
        let middle = 0.5 * (self.corners[k] + self.corners[l]);
        let half = |moved: usize| {
            let mut half = Self { bounds: DepthBounds::NONE, ..self.clone() };
            half.corners[moved] = middle;
            if self.count == 2 {
                half.corners[2] = half.corners[1];
            }
            for bound in self.bounds.iter() {
                let mut bound = *bound;
                // Corners on both sides of a plane leave room between them.
                let of_middle = match triangle(field, bound.face) {
                    Some(triangle) if bound.kind == Kind::Chord => triangle.closest(middle).distance,
                    Some(triangle) => triangle.normal.dot(middle - triangle.corners[0]).abs() + hair,
                    None => f64::INFINITY,
                };
                bound.at[moved] = of_middle.min(0.5 * (bound.at[k] + bound.at[l]));
                if self.count == 2 {
                    bound.at[2] = bound.at[1];
                }
                half.bounds.add(bound);
            }
            half
        };
        match self.count {
            1 => Vec::new(),
            _ => vec![half(l), half(k)],
        }
    }

    /// The greatest distance from a plane that the piece has on both sides of it.
    fn depth_across(&self, Plane(point, normal): Plane) -> f64 {
        let heights = self.points().iter().map(|p| normal.dot(*p - point));
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        high.min(-low)
    }

    /// The parts above and below a plane, as triangles. `None` unless the piece is a triangle that
    /// the plane divides.
    fn cut(&self, asset: &TeSdf, Plane(point, normal): Plane) -> Option<Vec<Self>> {
        if self.count < 3 {
            return None;
        }
        let height = |p: DVec3| normal.dot(p - point);
        let Parts::Across(above, below) = Polygon::new(self.points()).cut(|v| height(v.point)) else {
            return None;
        };
        let faces: Vec<(u32, Triangle)> =
            self.bounds.iter().map(|b| (b.face, asset.local_triangle(b.face as usize))).collect();
        let mut parts = Vec::new();
        for polygon in [above, below] {
            let points: Vec<DVec3> = polygon.points().collect();
            for k in 2..points.len() {
                let corners = [points[0], points[k - 1], points[k]];
                parts.push(self.with_corners(corners, &faces));
            }
        }
        Some(parts)
    }
}

/// A face of a mesh's field.
fn triangle(field: &FieldBody, face: u32) -> Option<Triangle> {
    match field.field {
        Field::Mesh(asset) => Some(asset.local_triangle(face as usize)),
        Field::Simple(_) => None,
    }
}

/// The bound by the distance from one face.
fn chord(face: u32, triangle: &Triangle, corners: [DVec3; 3]) -> Bound {
    let closest = corners.map(|c| triangle.closest(c));
    // Over and under the face itself, the distance is linear.
    let is_over = closest.iter().all(|c| c.feature == Feature::Face);
    let kind = if is_over { Kind::Plane } else { Kind::Chord };
    Bound { face, kind, at: closest.map(|c| c.distance) }
}

impl Looks<'_> {
    /// A first look at a corner of a piece.
    pub fn corner(&mut self, piece: &Piece, corner: DVec3) {
        self.value(piece, corner, false);
    }

    /// Whether nothing as low as this is wanted.
    pub fn is_closed(&self, bound: f64) -> bool {
        // A bound that is not a number is closed, too.
        !(bound < self.least - self.tolerance && bound <= self.limit)
    }

    /// Whether bounds of the depth bound the wanted values of a piece.
    fn is_deep(&self, piece: &Piece) -> bool {
        self.least + piece.radius < 0.0 || self.is_inside(piece)
    }

    /// Whether bounds of the depth bound all values of a piece. The formula of a simple shape has
    /// bounds outside, too.
    fn is_inside(&self, piece: &Piece) -> bool {
        piece.is_inside || matches!(self.field.field, Field::Simple(_))
    }

    /// The first look at a whole face, none of whose points is below the bound.
    pub fn first(&mut self, mut piece: Piece, bound: f64) -> Rest {
        let center = piece.on_surface(piece.center());
        let (value, lower) = self.value(&piece, center, false);
        let bound = bound.max(self.by_reach(&piece, center, &value, lower));
        if self.is_closed(bound) {
            return Rest::Nothing;
        }
        if self.is_deep(&piece) {
            self.add_bound(&mut piece, center, &value);
        }
        let bound = bound.max(-piece.deepest());
        if self.is_closed(bound) { Rest::Nothing } else { Rest::Pieces(bound, vec![piece]) }
    }

    /// Looks at a piece where it can be lowest, and divides it when it can still be lower than all
    /// others.
    pub fn look(&mut self, mut piece: Piece, mut bound: f64) -> Rest {
        if piece.bulge() <= FLAT * self.tolerance {
            piece.bulge = None;
        }
        if !self.is_deep(&piece) {
            // The distance outside matters, too.
            match self.side(&piece) {
                Side::Outside => return Rest::Nothing,
                Side::Inside => piece.is_inside = true,
                Side::Across(plane) => return self.divided(&piece, bound, plane),
            }
        }
        let mut plane = None;
        for _ in 0..ROUNDS {
            bound = bound.max(-piece.deepest());
            if self.is_closed(bound) {
                return Rest::Nothing;
            }
            let at = piece.on_surface(piece.point(piece.bounds.at));
            let is_fine = -self.least + COARSE > piece.deepest();
            let (value, lower) = self.value(&piece, at, is_fine);
            bound = bound.max(self.by_reach(&piece, at, &value, lower));
            if self.is_closed(bound) {
                return Rest::Nothing;
            }
            let progress = self.add_bound(&mut piece, at, &value);
            bound = bound.max(-piece.deepest());
            if self.is_closed(bound) {
                return Rest::Nothing;
            }
            if value.distance > 0.0 && !self.is_inside(&piece) {
                match self.side(&piece) {
                    Side::Outside => return Rest::Nothing,
                    Side::Inside => piece.is_inside = true,
                    Side::Across(plane) => return self.divided(&piece, bound, plane),
                }
            }
            match progress {
                Progress::Lower => {}
                Progress::None => break,
                Progress::Beyond(side) => {
                    plane = Some(side);
                    break;
                }
            }
        }
        self.divided(&piece, bound, plane)
    }

    /// Lower bound of the signed distances of the surface on a piece, by the value at a point and
    /// the bound `lower` there.
    fn by_reach(&self, piece: &Piece, at: DVec3, value: &FieldValue, lower: f64) -> f64 {
        let (field, reach) = (self.field, piece.reach(at) + piece.bulge());
        match field.jump() {
            None => (lower - reach).max(field.lowest() - piece.radius),
            Some(_) => {
                let slack = ROUNDING + 1e-9 * value.distance.abs();
                field.least_in_ball(at, reach, (value.distance, slack)) - piece.radius
            }
        }
    }

    /// The parts of a piece that can still be lower than all others. The piece is cut along a
    /// plane, or halved.
    fn divided(&self, piece: &Piece, bound: f64, plane: Option<Plane>) -> Rest {
        if let Some(bulge) = &piece.bulge {
            let is_flat = self.is_closed(bound + bulge.height);
            return Rest::Pieces(bound, piece.halves_of_bulge(self.field, bulge, is_flat));
        }
        let cut = match (plane, self.field.field) {
            (Some(plane), Field::Mesh(asset)) => piece.cut(asset, plane),
            _ => None,
        };
        let mut parts = cut.unwrap_or_else(|| piece.halves(self.field, self.hair()));
        parts.retain(|part| !self.is_closed(bound.max(-part.deepest())));
        if parts.is_empty() { Rest::Nothing } else { Rest::Pieces(bound, parts) }
    }

    /// The value at a point of a piece, and a lower bound of the signed distance of the surface
    /// there. In `f32`, unless `is_fine` or where the point is lower than all others.
    fn value(&mut self, piece: &Piece, p: DVec3, is_fine: bool) -> (FieldValue, f64) {
        if !is_fine {
            let (value, slack) = self.field.rough_value(p);
            let lower = value.distance - slack - piece.radius;
            if lower >= self.least {
                return (value, lower);
            }
        }
        let value = self.field.exact_value(p);
        self.offer(piece, p, &value);
        (value, value.distance - piece.radius)
    }

    fn offer(&mut self, piece: &Piece, point: DVec3, value: &FieldValue) {
        let distance = value.distance - piece.radius;
        if distance < self.least && distance <= self.limit {
            self.least = distance;
            let Piece { face, radius, .. } = *piece;
            self.lowest = Some(Lowest { distance, face, radius, point, value: *value });
        }
    }

    /// Adds the bound that the nearest face of a point gives.
    fn add_bound(&self, piece: &mut Piece, at: DVec3, value: &FieldValue) -> Progress {
        let before = piece.bounds.greatest;
        match self.field.field {
            Field::Simple(_) => {
                // A convex function lies above its tangents.
                let at = piece.corners.map(|c| -(value.distance + value.gradient.dot(c - at)));
                let face = piece.bounds.iter().map(|b| b.face + 1).max().unwrap_or(0);
                piece.bounds.add(Bound { face, kind: Kind::Plane, at });
            }
            Field::Mesh(asset) => {
                let face = value.position;
                let triangle = asset.local_triangle(face as usize);
                match piece.bounds.of_face(face) {
                    None => piece.bounds.add(chord(face, &triangle, piece.corners)),
                    Some((Bound { kind: Kind::Chord, .. }, here))
                        if value.feature == Feature::Face && here > value.distance.abs() + self.hair() =>
                    {
                        let Some(heights) = self.heights(asset, piece, &triangle) else {
                            return self.beyond(piece, &triangle);
                        };
                        piece.bounds.add(Bound { face, kind: Kind::Plane, at: heights });
                    }
                    Some(_) => return Progress::None,
                }
            }
        }
        if piece.bounds.greatest < before { Progress::Lower } else { Progress::None }
    }

    /// The plane through a side of a face, perpendicular to the face, that the piece crosses
    /// deepest. A piece that is large against the face is halved instead.
    fn beyond(&self, piece: &Piece, triangle: &Triangle) -> Progress {
        let [a, b, c] = triangle.corners;
        let size = piece.reach(piece.center());
        if size > a.distance(b).max(b.distance(c)).max(c.distance(a)) {
            return Progress::None;
        }
        let mut deepest = (THIN * size, Progress::None);
        for (p, q) in [(a, b), (b, c), (c, a)] {
            let side = Plane(p, (q - p).cross(triangle.normal).normalize_or_zero());
            let depth = piece.depth_across(side);
            if depth > deepest.0 {
                deepest = (depth, Progress::Beyond(side));
            }
        }
        deepest.1
    }

    /// A length that is small relative to the tolerance, and large relative to rounding.
    fn hair(&self) -> f64 {
        (0.125 * self.tolerance).clamp(1e-13, CLEAR)
    }

    /// Heights of the corners under the plane of a face, if they bound the depth over the piece.
    ///
    /// They do where the piece, moved into that plane, is not inside. On the way there a point that
    /// is inside comes to the surface. So it is with faces in one plane, and with faces beyond a
    /// convex edge.
    fn heights(&self, asset: &TeSdf, piece: &Piece, triangle: &Triangle) -> Option<[f64; 3]> {
        if asset.jump().is_some() {
            // On the way, the sign may change where there is no surface.
            return None;
        }
        // The outside is in front of the face, or on the other side where faces do not look
        // outward.
        self.heights_under(asset, piece, triangle, triangle.normal).or_else(|| {
            match asset.faces_look_outward() {
                true => None,
                false => self.heights_under(asset, piece, triangle, -triangle.normal),
            }
        })
    }

    /// The same, with the outside on the side of the plane that the normal points to.
    fn heights_under(
        &self,
        asset: &TeSdf,
        piece: &Piece,
        triangle: &Triangle,
        normal: DVec3,
    ) -> Option<[f64; 3]> {
        let hair = self.hair();
        let heights = piece.corners.map(|c| normal.dot(triangle.corners[0] - c));
        let mut points: [DVec3; 3] = std::array::from_fn(|k| piece.corners[k] + (heights[k] + hair) * normal);
        let [a, b, c] = points;
        // A piece that looks to the other side than the face goes around the other way.
        if (b - a).cross(c - a).dot(normal) < 0.0 {
            points.swap(1, 2);
        }
        let points = &points[..piece.count];
        let mut is_clear = normal != DVec3::ZERO;
        asset.near_polygon(points, normal, hair, &mut |face| {
            if is_clear {
                let other = asset.local_triangle(face as usize);
                is_clear = polygon_to_triangle(points, normal, &other, 0.5 * hair).is_none();
            }
            if is_clear { hair } else { f64::NEG_INFINITY }
        });
        let center = points.iter().sum::<DVec3>() / points.len() as f64;
        (is_clear && self.field.exact_value(center).distance > 0.0).then(|| heights.map(|h| h.abs() + hair))
    }

    /// The side of a piece of a mesh's field. Where it is outside, its nearest point is a
    /// candidate.
    fn side(&mut self, piece: &Piece) -> Side {
        let Field::Mesh(asset) = self.field.field else { return Side::Inside };
        let (points, normal, clear) = (piece.points(), piece.normal, self.hair() + piece.bulge());
        let outer = (self.least + piece.radius).min(self.limit + piece.radius).max(0.0) + 2.0 * clear;
        let mut nearest = (outer, None);
        let (mut crossed, mut deepest) = (0, (clear, None));
        asset.near_polygon(points, normal, outer, &mut |face| {
            let triangle = asset.local_triangle(face as usize);
            let limit = nearest.0.max(2.0 * clear);
            if let Some((distance, at)) = polygon_to_triangle(points, normal, &triangle, limit) {
                if distance < nearest.0 {
                    nearest = (distance, Some(at));
                }
                let plane = Plane(triangle.corners[0], triangle.normal);
                let depth = piece.depth_across(plane);
                if distance <= clear && depth > clear {
                    crossed += 1;
                    if depth > deepest.0 {
                        deepest = (depth, Some(plane));
                    }
                }
            }
            // A piece that crosses many faces is halved, whichever they are.
            if crossed > FEW { f64::NEG_INFINITY } else { nearest.0.max(2.0 * clear) }
        });
        if let (Some(at), true) = (nearest.1, self.least + piece.radius >= 0.0) {
            let at = piece.on_surface(at);
            self.offer(piece, at, &self.field.exact_value(at));
        }
        if piece.bulge.is_some() && nearest.0 < outer {
            // The surface beside the piece may be lower, or on the other side.
            return Side::Across(None);
        }
        if crossed > 0 {
            return Side::Across(deepest.1.filter(|_| crossed <= FEW));
        }
        // It is on one side, unless the sign jumps. Where its centre is on the surface, a corner
        // shows the side.
        let center = piece.center();
        let mut at = (center, self.field.exact_value(center));
        if at.1.distance.abs() <= clear {
            for p in points {
                let value = self.field.exact_value(*p);
                if value.distance.abs() > at.1.distance.abs() {
                    at = (*p, value);
                }
            }
        }
        if let (Some(jump), true) = (self.field.jump(), at.1.distance.abs() > clear) {
            return self.side_of_jump(jump, piece, at);
        }
        if at.1.distance >= -clear {
            return Side::Outside;
        }
        self.offer(piece, at.0, &at.1);
        Side::Inside
    }

    /// The side of a piece that no face passes through, in the field of an open mesh. `at` is a
    /// point of it off the faces, with the value there.
    fn side_of_jump(
        &mut self,
        jump: &GeneralizedWinding,
        piece: &Piece,
        (at, value): (DVec3, FieldValue),
    ) -> Side {
        self.offer(piece, at, &value);
        let plane = match jump::side(jump, piece.points(), at) {
            jump::Side::Outside => return Side::Outside,
            jump::Side::Inside => return Side::Inside,
            jump::Side::Across(cut) => {
                // How deep the part is that is certainly inside.
                if let Parts::Across(inner, _) = Polygon::new(piece.points()).cut(|v| cut.inner(v.point)) {
                    for p in inner.points() {
                        self.value(piece, p, false);
                    }
                }
                cut.plane().map(|(point, normal)| Plane(point, normal))
            }
            jump::Side::Unknown => None,
        };
        let size = piece.reach(piece.center());
        if size <= self.tolerance {
            // The jump is found up to the tolerance.
            return Side::Outside;
        }
        Side::Across(plane.filter(|plane| piece.depth_across(*plane) > SLICE * size))
    }
}

//! Normals of contacts from the normal cones of the features that touch; proof in `docs/math.md`,
//! section 18.
//!
//! The gradient of the signed distance says in which direction the distance of one point changes.
//! Where a body lies on another one, this is the normal of any face of *b* that is as near, also
//! where an edge of *b* lies on a face of *a*: as a plane, such a contact is a wall that is not
//! there. And the point is only known to the tolerance of its distance, so just apart the gradient
//! is off by √(2 tolerance / distance). A contact's normal must be in the cone of the outward
//! normals at the place of *b*, and its opposite in that of *a*: a face has one, an edge the arc
//! between its two faces, a vertex the cone of its faces.
use arrayvec::ArrayVec;
use glam::DVec3;

use super::field::ROUNDING;
use super::{CollideError, CollideOptions, Contact, InstanceId, Placement, Scene, Shape};
use crate::TeSdf;
use crate::asset::corner_cones::CONVEX;
use crate::geometry::Triangle;
use crate::parallel::*;
use crate::query::Precision;

/// Sine of the angle by which a normal may be out of a cone: bodies that turn by less in a step can
/// touch there.
const SLOPE: f64 = 0.1;

/// Faces that are turned against each other by more (rad) do not touch with their insides.
const PARALLEL: f64 = 1e-3;

/// Normals that differ by less (rad) are equal, so the edges between coplanar faces are none.
const SAME: f64 = 1e-6;

/// A ray is in a cone when it is nearer to it than this (rad).
const NEAR: f64 = 1e-4;

/// Maximum number of times that a direction is moved into one cone and then into the other one.
const ALTERNATIONS: usize = 4;

/// A place with more different normals is left as it is.
const MOST: usize = 12;

/// A place with more faces is left as it is.
const MOST_FACES: usize = 64;

/// The surroundings of a vertex must be clear up to this multiple of the limit of a place.
const CLEAR: f64 = 4.0;

/// On a side, the vertices must be farther than this multiple of the limit.
const BESIDE: f64 = 1e3;

/// A place belongs to a feature when it is nearer than this: parts of the diagonals of the smaller
/// and of the larger body. The search knows a place to its tolerance.
const OF_SMALLER: f64 = 1e-6;
const OF_LARGER: f64 = 2e-7;

/// Different outward normals at a place.
type Normals = ArrayVec<DVec3, MOST>;

/// The normal cones of two bodies, in the world.
#[derive(Clone, Copy, Debug)]
pub struct Cones<'a> {
    a: Body<'a>,
    b: Body<'a>,
    /// The diagonals, in the world.
    sizes: [f64; 2],
    near: f64,
    /// Bound of the error of a distance.
    tolerance: f64,
}

/// A shape in the world.
#[derive(Clone, Copy, Debug)]
struct Body<'a> {
    shape: &'a Shape,
    placement: Placement,
}

/// A place on a body or in it, in the world.
struct Place {
    at: DVec3,
    /// Faces up to this distance belong to it.
    limit: f64,
    /// One of them, by its index in the shape.
    face: u32,
}

impl<'a> Cones<'a> {
    /// Of the body that has the faces, and the body whose field is used. `tolerance` is the bound of
    /// the error of distances in the world's unit, and `precision` is that of the contacts.
    pub fn new([a, b]: [(&'a Shape, Placement); 2], tolerance: f64, precision: Precision) -> Self {
        let [a, b] = [a, b].map(|(shape, placement)| Body { shape, placement });
        let sizes = [a, b].map(|body| body.shape.diagonal() * body.placement.scale);
        let finite = sizes.into_iter().filter(|size| size.is_finite());
        let (least, most) = finite.fold((f64::INFINITY, 0.0f64), |(l, m), s| (l.min(s), m.max(s)));
        let rounding = match precision {
            Precision::F64 => OF_LARGER,
            Precision::F32 => ROUNDING,
        };
        let near = (OF_SMALLER * least.min(f64::MAX)).max(rounding * most);
        Self { a, b, sizes, near, tolerance: tolerance.max(near) }
    }

    /// The distance up to which two places are one, in the world's unit.
    pub fn near(&self) -> f64 {
        self.near
    }

    /// The error of the place of a contact at a distance: the distance of a point beside the nearest
    /// one exceeds it by the square of the way over twice the distance.
    pub fn place(&self, distance: f64) -> f64 {
        self.near + (8.0 * self.tolerance * distance.abs()).sqrt()
    }

    /// A contact of a face with the normal that the cones allow, and its distance along that
    /// normal. `faces` are the indices of its faces in the shapes. `None` where they allow none: no
    /// motion of the bodies brings these features together before others.
    ///
    /// Contacts of open meshes and sheets, at places that are not convex, and those that are deeper
    /// than the features are known, stay as they are.
    pub fn of(&self, contact: Contact, faces: [u32; 2]) -> Option<Contact> {
        let keep = Some(contact);
        let Contact { point_a, point_b, distance, normal, .. } = contact;
        let Some(of_a) = self.a.normals(&Place { at: point_a, limit: self.near, face: faces[0] }) else {
            return keep;
        };
        if let Some(radius) = self.b.radius() {
            return self.of_round(contact, &of_a, radius);
        }
        let is_apart = distance > self.near;
        // Inside of b, the faces of one place are equally near. Outside, they have the nearest point.
        let place = match is_apart {
            true => Place { at: point_b, limit: self.near, face: faces[1] },
            false => Place { at: point_a, limit: distance.abs() + 2.0 * self.near, face: faces[1] },
        };
        let Some(of_b) = self.b.normals(&place) else { return keep };
        // Above a plane, only its normal holds, however deep.
        let is_deep = distance < -self.near && !matches!(self.a.shape, Shape::Plane);
        let otherwise = if is_deep { keep } else { None };
        let along = |normal: DVec3| Some(Contact { normal, ..contact });
        // The common normal of two edges.
        let across = match (of_a.as_slice(), of_b.as_slice()) {
            ([a, b], [c, d]) => crossing([a, b], [c, d]),
            _ => None,
        };
        match (of_a.as_slice(), of_b.as_slice(), across) {
            // The corners of a patch are at edges or vertices of one of them.
            ([m], [h], _) => {
                if h.distance(-*m) <= PARALLEL {
                    along(self.flush(-*m, *h))
                } else {
                    otherwise
                }
            }
            // The plane of the face: the way to it from the nearest point of b.
            ([m], ..) => match (Cone::new(of_b.iter().copied()).is_near(-*m), is_apart) {
                (false, _) => otherwise,
                (true, true) => self.turned(contact, -*m),
                (true, false) => along(-*m),
            },
            (_, [h], _) => {
                if Cone::opposite(&of_a).is_near(*h) {
                    along(*h)
                } else {
                    keep
                }
            }
            (.., Some(across)) => {
                // The distance along the common normal of two edges is the same between all points
                // of their lines.
                let n = if across.dot(normal) < 0.0 { -across } else { across };
                if Cone::opposite(&of_a).is_near(n) && Cone::new(of_b.iter().copied()).is_near(n) {
                    let distance = if is_apart { n.dot(point_a - point_b) } else { distance };
                    Some(Contact { normal: n, distance, ..contact })
                } else if is_apart {
                    keep
                } else {
                    otherwise
                }
            }
            _ if is_apart => {
                // The gradient of the exact place is in both cones.
                let within = clamped(&Cone::opposite(&of_a), &Cone::new(of_b.iter().copied()), normal);
                within.and_then(|normal| self.turned(contact, normal)).or(keep)
            }
            _ => {
                // The mean is the same in both orders of a pair. The gradient, moved into the
                // cones, is not: two such contacts would be a notch that locks.
                let rays = common(&Cone::opposite(&of_a), &Cone::new(of_b.iter().copied()));
                match rays.iter().sum::<DVec3>().try_normalize() {
                    Some(mean) => along(mean),
                    None if rays.is_empty() => otherwise,
                    None => keep,
                }
            }
        }
    }

    /// The normal of two faces that lie flush on each other, as far as bodies turn in a step. That
    /// of the larger body: a small one that comes to lie on it gets no push to the side. Of bodies
    /// of one size it is the mean. Both are the same in both orders.
    fn flush(&self, of_a: DVec3, of_b: DVec3) -> DVec3 {
        let [a, b] = self.sizes;
        if a > (1.0 + SAME) * b {
            of_a
        } else if b > (1.0 + SAME) * a {
            of_b
        } else {
            (of_a + of_b).normalize()
        }
    }

    /// A contact of bodies that are apart with another normal, and its distance along it. `None` where
    /// this is not the direction from one point to the other, as far as the places are known and
    /// the bodies may turn.
    fn turned(&self, contact: Contact, normal: DVec3) -> Option<Contact> {
        let Contact { point_a, point_b, distance, .. } = contact;
        let way = point_a - point_b;
        let is_right = normal.dot(contact.normal) > least_cosine()
            || way.distance(distance * normal) <= self.place(distance);
        is_right.then(|| Contact { normal, distance: normal.dot(way), ..contact })
    }

    /// A contact of a face that keeps its distance and its points: its normal is that of `turned`
    /// where the way from one point to the other is along it, as far as the place is known.
    pub fn beside(&self, contact: Contact, turned: Option<Contact>) -> Contact {
        let Contact { point_a, point_b, distance, .. } = contact;
        let is_along = |normal: &DVec3| {
            let way = point_a - point_b;
            way.distance(distance * *normal) <= self.place(distance)
        };
        let normal = turned.map(|turned| turned.normal).filter(is_along).unwrap_or(contact.normal);
        Contact { normal, ..contact }
    }

    /// A contact of a ball or capsule of a radius, in the world, with faces of these normals. The
    /// gradient is exact there, because it begins at the core.
    fn of_round(&self, contact: Contact, of_a: &[DVec3], radius: f64) -> Option<Contact> {
        let &[m] = of_a else { return Some(contact) };
        let core = contact.point_b - radius * contact.normal;
        let height = m.dot(core - contact.point_a);
        let foot = core - height * m;
        if height > 0.0 && foot.distance(contact.point_a) <= self.place(height) {
            let (normal, point_b) = (-m, core - radius * m);
            return Some(Contact { point_a: foot, point_b, normal, distance: height - radius, ..contact });
        }
        // The core is over another face, or inside.
        (height <= 0.0 || !contact.converged).then_some(contact)
    }
}

impl Body<'_> {
    /// Radius of a rounded shape, in the world.
    fn radius(&self) -> Option<f64> {
        match *self.shape {
            Shape::Sphere { radius } | Shape::Capsule { radius, .. } => Some(radius * self.placement.scale),
            _ => None,
        }
    }

    /// The different outward normals of the faces around a place, in the world. `None` where they
    /// are no cone: at rounded shapes, borders, and where the surface is concave.
    fn normals(&self, place: &Place) -> Option<Normals> {
        let at = self.placement.to_shape(place.at);
        let limit = place.limit / self.placement.scale;
        let local = match self.shape {
            Shape::Plane => [DVec3::Z].into_iter().collect(),
            Shape::Box { half_extents } => {
                let side = |axis: usize| {
                    let sign = if at[axis] < 0.0 { -1.0 } else { 1.0 };
                    (half_extents[axis] - at[axis].abs() <= limit).then(|| sign * DVec3::AXES[axis])
                };
                (0..3).filter_map(side).collect()
            }
            Shape::Mesh(asset) => around(asset, at, limit, place.face)?,
            Shape::Sphere { .. } | Shape::Capsule { .. } => return None,
        };
        let rotation = self.placement.pose.rotation;
        (!local.is_empty()).then(|| local.into_iter().map(|n| rotation * n).collect())
    }
}

/// The different normals of the faces within `limit` of a place, from a face on, in the unit of the
/// mesh.
fn around(asset: &TeSdf, at: DVec3, limit: f64, face: u32) -> Option<Normals> {
    if !(asset.faces_enclose_the_solid() && asset.faces_look_outward()) {
        return None;
    }
    let first = triangle(asset, face);
    if is_on_inside(&first, at, limit) {
        return Some([first.normal].into_iter().collect());
    }
    match known_around(asset, at, limit, (face, &first)) {
        Some(known) => known,
        None => searched_around(asset, at, limit, (face, &first)),
    }
}

fn triangle(asset: &TeSdf, face: u32) -> Triangle {
    let normal = asset.local_triangle(face as usize).normal;
    Triangle::from_parts(asset.face_corners(face as usize), normal, false)
}

/// As [`around`], at a vertex or a side of a face with clear surroundings; `None` elsewhere.
fn known_around(
    asset: &TeSdf,
    at: DVec3,
    limit: f64,
    (face, first): (u32, &Triangle),
) -> Option<Option<Normals>> {
    let cones = asset.corner_cones();
    let vertices = asset.face_vertices(face as usize);
    let clear = vertices.map(|vertex| f64::from(cones[vertex as usize]));
    let near = first.corners.map(|corner| corner.distance(at));
    if let Some(k) = (0..3).find(|&k| near[k] <= limit) {
        // Nothing else is within the limit of a place that is within it of the vertex.
        if clear[k].abs() <= CLEAR * limit {
            return None;
        }
        let fan = asset.faces_at(vertices[k]);
        let normals = || different(fan.iter().map(|&face| asset.local_triangle(face as usize).normal));
        return Some(if clear[k] > 0.0 { normals() } else { flat(normals()?) });
    }
    // Far from vertices without needles, a side has two faces.
    if (0..3).any(|k| clear[k] == 0.0 || near[k] <= BESIDE * limit) {
        return None;
    }
    let height = |k: usize| {
        let (start, side) = (first.corners[k], first.corners[(k + 1) % 3] - first.corners[k]);
        first.normal.cross(side).dot(at - start) / side.length()
    };
    let mut sides = (0..3).filter(|&k| height(k) <= limit);
    let (Some(side), None) = (sides.next(), sides.next()) else { return None };
    let mut others = asset.faces_beside(face as usize, side);
    let (Some(other), None) = (others.next(), others.next()) else { return None };
    let both = [*first, triangle(asset, other as u32)];
    Some(convex(&both))
}

/// As [`around`], by a search over the faces that have common vertices.
fn searched_around(asset: &TeSdf, at: DVec3, limit: f64, (face, first): (u32, &Triangle)) -> Option<Normals> {
    let (mut found, mut next, mut seen) = (vec![*first], vec![face], vec![face]);
    while let Some(face) = next.pop() {
        for vertex in asset.face_vertices(face as usize) {
            for &other in asset.faces_at(vertex) {
                if seen.contains(&other) {
                    continue;
                }
                seen.push(other);
                let triangle = triangle(asset, other);
                if triangle.closest(at).distance <= limit {
                    found.push(triangle);
                    next.push(other);
                }
            }
        }
        if found.len() > MOST_FACES {
            return None;
        }
    }
    convex(&found)
}

/// The different normals of faces that have a place in common; `None` where they are not convex.
fn convex(faces: &[Triangle]) -> Option<Normals> {
    let normals = different(faces.iter().map(|triangle| triangle.normal))?;
    let is_convex = |&Triangle { corners: [first, ..], normal, .. }: &Triangle| {
        let corners = faces.iter().flat_map(|other| other.corners);
        corners.map(|p| p - first).all(|way| way.dot(normal) <= CONVEX * way.length())
    };
    (normals.len() < 2 || faces.iter().all(is_convex)).then_some(normals)
}

/// The different ones of some normals; `None` of more than [`MOST`].
fn different(all: impl Iterator<Item = DVec3>) -> Option<Normals> {
    let mut normals = Normals::new();
    for normal in all.filter(|n| *n != DVec3::ZERO) {
        if normals.iter().all(|n| n.distance(normal) > SAME) {
            normals.try_push(normal).ok()?;
        }
    }
    Some(normals)
}

/// The normal of faces in one plane.
fn flat(normals: Normals) -> Option<Normals> {
    (normals.len() < 2).then_some(normals)
}

/// Whether a place is farther than `limit` from all sides of a face.
fn is_on_inside(&Triangle { corners, normal, .. }: &Triangle, at: DVec3, limit: f64) -> bool {
    (0..3).all(|k| {
        let side = corners[(k + 1) % 3] - corners[k];
        normal.cross(side).dot(at - corners[k]) > limit * side.length()
    })
}

/// The greatest cosine of an angle out of a cone.
fn least_cosine() -> f64 {
    (1.0 - SLOPE * SLOPE).sqrt()
}

/// A cone of unit vectors: all sums of its rays with weights of at least 0.
struct Cone {
    rays: Normals,
    /// The cross products of each two rays, in the order of the first one.
    crosses: Crosses,
}

type Crosses = ArrayVec<DVec3, { MOST * (MOST - 1) / 2 }>;

impl Cone {
    fn new(rays: impl Iterator<Item = DVec3>) -> Self {
        let mut cone = Self { rays: Normals::new(), crosses: Crosses::new() };
        cone.rays.extend(rays);
        for (i, p) in cone.rays.iter().enumerate() {
            cone.crosses.extend(cone.rays[i + 1..].iter().map(|q| p.cross(*q)));
        }
        cone
    }

    /// The cone of the opposite directions.
    fn opposite(normals: &[DVec3]) -> Self {
        Self::new(normals.iter().map(|n| -*n))
    }

    /// The cross product of the rays `i` and `j`, where `i` is less than `j`.
    fn cross(&self, i: usize, j: usize) -> DVec3 {
        self.crosses[i * (2 * self.rays.len() - i - 1) / 2 + j - i - 1]
    }

    /// Whether a direction is a sum of three rays that are not in a plane.
    fn is_inside(&self, v: DVec3) -> bool {
        let count = self.rays.len();
        (0..count).any(|i| {
            (i + 1..count).any(|j| {
                let over = self.cross(i, j).dot(v);
                (j + 1..count).any(|k| {
                    let (det, next) = (self.cross(i, j).dot(self.rays[k]), self.cross(j, k).dot(v));
                    let last = -self.cross(i, k).dot(v);
                    let side = det.signum();
                    det.abs() > 1e-12 && over * side >= 0.0 && next * side >= 0.0 && last * side >= 0.0
                })
            })
        })
    }

    /// The direction of the cone that is nearest to a direction.
    fn nearest(&self, v: DVec3) -> DVec3 {
        if self.is_inside(v) {
            return v;
        }
        let mut best = (f64::NEG_INFINITY, DVec3::ZERO);
        let mut offer = |p: DVec3| {
            let cosine = p.dot(v);
            if cosine > best.0 {
                best = (cosine, p);
            }
        };
        for (i, &p) in self.rays.iter().enumerate() {
            offer(p);
            (i + 1..self.rays.len()).filter_map(|j| self.foot(i, j, v)).for_each(&mut offer);
        }
        best.1
    }

    /// The direction nearest to `v` between the rays `i` and `j`; `None` where it is one of them.
    fn foot(&self, i: usize, j: usize, v: DVec3) -> Option<DVec3> {
        let (p, q, across) = (self.rays[i], self.rays[j], self.cross(i, j));
        let square = across.length_squared();
        if square <= f64::MIN_POSITIVE {
            return None;
        }
        let foot = v - v.dot(across) / square * across;
        let is_between = p.cross(foot).dot(across) >= 0.0 && foot.cross(q).dot(across) >= 0.0;
        if is_between { foot.try_normalize() } else { None }
    }

    /// Whether the cosine between a direction and the [`nearest`](Self::nearest) one of the cone is at
    /// least this. Most contacts ask this often, and one direction of the cone is enough to tell.
    fn is_within(&self, v: DVec3, least: f64) -> bool {
        if self.rays.iter().any(|ray| ray.dot(v) >= least) {
            return true;
        }
        // Planes at a greater angle have no such direction; far more than rounding is added.
        let sine_squared = 1.0 - least * least + 1e-12;
        let mut pairs = (0..self.rays.len()).flat_map(|i| (i + 1..self.rays.len()).map(move |j| (i, j)));
        let is_beside = |(i, j)| {
            let across = self.cross(i, j);
            v.dot(across).powi(2) <= sine_squared * across.length_squared()
                && self.foot(i, j, v).is_some_and(|foot| foot.dot(v) >= least)
        };
        pairs.any(is_beside) || self.is_inside(v)
    }

    /// Whether a direction is in the cone, up to [`SLOPE`].
    fn is_near(&self, direction: DVec3) -> bool {
        self.is_within(direction, least_cosine())
    }
}

/// A direction that is in both cones, near to `v`; `None` where none is found.
fn clamped(one: &Cone, other: &Cone, v: DVec3) -> Option<DVec3> {
    let mut at = v;
    for _ in 0..ALTERNATIONS {
        let of_one = one.nearest(at);
        at = other.nearest(of_one);
        if at.distance(of_one) <= SAME {
            return Some(at);
        }
    }
    None
}

/// The direction perpendicular to two edges, each between two faces with these normals; `None` where
/// they are parallel.
fn crossing([a, b]: [&DVec3; 2], [c, d]: [&DVec3; 2]) -> Option<DVec3> {
    let [one, other] = [a.cross(*b).try_normalize()?, c.cross(*d).try_normalize()?];
    let both = one.cross(other);
    (both.length() > PARALLEL).then(|| both.normalize())
}

/// The extreme rays of what two cones have in common.
fn common(one: &Cone, other: &Cone) -> ArrayVec<DVec3, { 4 * MOST }> {
    let least = NEAR.cos();
    let holds = |cone: &Cone, ray: DVec3| cone.is_within(ray, least);
    let mut rays = ArrayVec::<DVec3, { 4 * MOST }>::new();
    // There are at most as many as both have together, and some that rounding adds.
    let mut offer = |ray: DVec3| {
        if !rays.is_full() && rays.iter().all(|r| r.distance(ray) > 2.0 * NEAR) {
            rays.push(ray);
        }
    };
    one.rays.iter().filter(|ray| holds(other, **ray)).for_each(|ray| offer(*ray));
    other.rays.iter().filter(|ray| holds(one, **ray)).for_each(|ray| offer(*ray));
    // The lines in which a side of one crosses a side of the other.
    let unit = |cross: &DVec3| cross.try_normalize();
    let mut others = Crosses::new();
    others.extend(other.crosses.iter().filter_map(unit));
    for side in one.crosses.iter().filter_map(unit) {
        for line in others.iter().map(|other| side.cross(*other)) {
            let Some(ray) = line.try_normalize().filter(|_| line.length() > NEAR) else { continue };
            for ray in [ray, -ray] {
                if holds(one, ray) && holds(other, ray) {
                    offer(ray);
                }
            }
        }
    }
    rays
}

/// Contacts per local minimum, found elsewhere with the precision `f32`, with the normals of their
/// cones, without those that have none and without twins. `faces` are the indices of their faces in
/// both shapes. The contacts are those of whole faces, in the order of a detection.
///
/// # Errors
/// [`CollideError::NoInstance`] for an instance that the scene lacks.
pub fn in_cones(
    scene: &Scene,
    options: &CollideOptions,
    contacts: &[Contact],
    faces: &[[u32; 2]],
) -> Result<Vec<Contact>, CollideError> {
    let body = |id: InstanceId| {
        let instance = scene.instance(id)?;
        Ok((scene.shape(instance.shape)?, instance.placement()))
    };
    let ids = |c: &Contact| (c.instance_a.min(c.instance_b), c.instance_a.max(c.instance_b));
    let mut found = Vec::with_capacity(contacts.len());
    let mut faces = faces;
    for run in contacts.chunk_by(|x, y| ids(x) == ids(y)) {
        let mut of_pair = Vec::with_capacity(run.len());
        let mut near = 0.0;
        for order in run.chunk_by(|x, y| x.instance_a == y.instance_a) {
            let bodies: [(&Shape, Placement); 2] = [body(order[0].instance_a)?, body(order[0].instance_b)?];
            let diagonal = bodies[1].0.diagonal().min(f64::MAX) * bodies[1].1.scale;
            let cones = Cones::new(bodies, options.tolerance.resolve(diagonal), Precision::F32);
            near = cones.near();
            let (of_order, others) = faces.split_at(order.len().min(faces.len()));
            faces = others;
            let of_order = order.par_iter().zip(of_order).filter_map(|(c, faces)| cones.of(*c, *faces));
            of_pair.extend(of_order.collect::<Vec<_>>());
        }
        let kept = keep_different(&of_pair, near);
        found.extend(of_pair.into_iter().zip(kept).filter_map(|(c, keep)| keep.then_some(c)));
    }
    Ok(found)
}

/// Of contacts of one pair of instances that have the same place, normal and distance, in both
/// orders, keeps the first: twins would carry twice the load of others. `contacts` are all of the
/// pair, and `near` is [`Cones::near`].
pub fn keep_different(contacts: &[Contact], near: f64) -> Vec<bool> {
    let point = |k: usize| 0.5 * (contacts[k].point_a + contacts[k].point_b);
    let normal = |k: usize| {
        let Contact { instance_a, instance_b, normal, .. } = contacts[k];
        if instance_a < instance_b { normal } else { -normal }
    };
    let mut order: Vec<usize> = (0..contacts.len()).collect();
    order.sort_by(|&k, &l| point(k).x.total_cmp(&point(l).x).then(k.cmp(&l)));
    let mut twins: Vec<(usize, usize)> = Vec::new();
    for (i, &k) in order.iter().enumerate() {
        let distance = contacts[k].distance;
        // The two points of a contact are as far apart as its distance, in both orders along the
        // same normal.
        let reach = near + PARALLEL * distance.abs();
        for &l in &order[i + 1..] {
            if point(l).x - point(k).x > reach {
                break;
            }
            if point(k).distance(point(l)) <= reach
                && normal(k).distance(normal(l)) <= SAME
                && (distance - contacts[l].distance).abs() <= near
            {
                twins.push((k.min(l), k.max(l)));
            }
        }
    }
    twins.sort_unstable();
    let mut kept = vec![true; contacts.len()];
    for (k, l) in twins {
        kept[l] &= !kept[k];
    }
    kept
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::encode::{Encoder, Preset};
    use crate::mesh::{SolidMesh, TriangleMesh};

    /// A torus of 12 × 8 quads, which is convex outside and a saddle inside.
    fn torus() -> TeSdf {
        let (n, m) = (12u32, 8u32);
        let vertex = |k: u32| {
            let (around, across) =
                (TAU * f64::from(k / m) / f64::from(n), TAU * f64::from(k % m) / f64::from(m));
            let radius = 1.0 + 0.4 * across.cos();
            DVec3::new(radius * around.cos(), radius * around.sin(), 0.4 * across.sin())
        };
        let quad = |k: u32| {
            let at = |i: u32, j: u32| (k / m + i) % n * m + (k % m + j) % m;
            [[at(0, 0), at(1, 0), at(1, 1)], [at(0, 0), at(1, 1), at(0, 1)]]
        };
        let mesh = TriangleMesh::new((0..n * m).map(vertex).collect(), (0..n * m).flat_map(quad).collect());
        let solid = SolidMesh::new(mesh.expect("valid ids")).expect("a closed surface");
        Encoder::new().preset(Preset::Fast).encode(&solid).expect("a torus")
    }

    #[test]
    fn known_surroundings_are_those_of_the_search() {
        let asset = torus();
        let limit = 1e-6;
        let (mut known, mut cones) = (0, 0);
        for face in 0..asset.face_count() as u32 {
            let first = triangle(&asset, face);
            let [a, b, c] = first.corners;
            for at in [
                a,
                b + 0.7 * limit * first.normal,
                0.3 * a + 0.7 * b,
                0.5 * (b + c) - 0.5 * limit * first.normal,
                a + 1e-4 * (c - a),
                (a + b + c) / 3.0,
            ] {
                let searched = searched_around(&asset, at, limit, (face, &first));
                cones += usize::from(searched.as_ref().is_some_and(|normals| normals.len() > 1));
                let Some(found) = known_around(&asset, at, limit, (face, &first)) else { continue };
                known += 1;
                let [found, searched] = [found, searched].map(Option::unwrap_or_default);
                let is_among = |n: &DVec3| searched.iter().any(|other| other.distance(*n) <= SAME);
                let is_same = found.len() == searched.len() && found.iter().all(is_among);
                assert!(is_same, "face {face}, {at}: {found:?} instead of {searched:?}");
            }
        }
        assert!(known > 700 && cones > 100, "{known} places known, {cones} cones");
    }

    #[test]
    fn the_nearest_direction_of_a_cone_is_in_it() {
        let cone = |rays: &[DVec3]| Cone::new(rays.iter().map(|ray| ray.normalize()));
        let sector = cone(&[DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE]);
        assert_eq!(sector.nearest(DVec3::ONE.normalize()), DVec3::ONE.normalize());
        let aside = DVec3::new(1.0, 1.0, -0.5).normalize();
        assert!(sector.nearest(aside).distance(DVec3::new(1.0, 1.0, 0.0).normalize()) < 1e-15);
        assert!(sector.nearest(DVec3::new(2.0, -1.0, -1.0).normalize()).distance(DVec3::X) < 1e-15);
        for k in 0..1000u32 {
            let v = DVec3::new(f64::from(k % 10), f64::from(k / 10 % 10), f64::from(k / 100)) - 4.6;
            let (v, cosine) = (v.normalize(), sector.nearest(v.normalize()).dot(v.normalize()));
            assert!(sector.is_within(v, cosine - 1e-12));
            assert!(sector.is_inside(v) || !sector.is_within(v, cosine + 1e-12));
        }
        // Two arcs that have one direction in common.
        let (one, other) = (cone(&[DVec3::Z, DVec3::X]), cone(&[DVec3::Z, -DVec3::X]));
        let tilted = DVec3::new(0.03, 0.0, 1.0).normalize();
        assert!(clamped(&one, &other, tilted).is_some_and(|n| n.distance(DVec3::Z) < 1e-12));
        assert_eq!(common(&one, &other).as_slice(), [DVec3::Z]);
        let apart = cone(&[-DVec3::Z, DVec3::Y]);
        assert!(common(&one, &apart).is_empty());
    }
}

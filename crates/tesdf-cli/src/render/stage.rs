//! The scene of a picture, prepared for rays: the first hit of a ray, and the distance from a
//! point.
use std::sync::Arc;

use tesdf::collide::{Placement, Shape};
use tesdf::geometry::Aabb;
use tesdf::glam::DVec3;

use tesdf_playback::{Linear, SmoothNormals};

use super::cut::{Cut, HalfSpace};

/// A body of a picture.
#[derive(Clone, Copy, Debug)]
pub struct Drawn<'a> {
    /// Its geometry.
    pub shape: &'a Shape,
    /// Pose and scale in the world.
    pub placement: Placement,
    /// Its colour. A plane ignores it and is a floor of grey squares.
    pub colour: Linear,
    /// Whether it is cut.
    pub exposure: Exposure,
}

/// Whether a body is cut open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exposure {
    /// The body is shown whole.
    Whole,
    /// The part in the removed space is not shown.
    Cut,
}

/// The first hit of a ray.
#[derive(Clone, Copy, Debug)]
pub struct Met {
    /// Distance along the ray, in world units.
    pub t: f64,
    pub point: DVec3,
    /// Outward unit normal of the surface.
    pub normal: DVec3,
    /// Normal for shading, which is continuous over round surfaces.
    pub smooth: DVec3,
    /// Index of the body in the list.
    pub body: usize,
    pub part: Part,
}

/// The part of a body that a ray hits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Its surface.
    Skin,
    /// Its interior, exposed by the cut.
    Section,
    /// A section where it overlaps another body.
    Overlap,
}

pub struct Body<'a> {
    pub drawn: Drawn<'a>,
    normals: Option<Arc<SmoothNormals>>,
    /// Bounding box, in world units.
    bounds: Aabb,
}

impl Body<'_> {
    pub fn is_floor(&self) -> bool {
        matches!(self.drawn.shape, Shape::Plane)
    }

    /// Signed distance of the whole body, in world units.
    pub fn signed_distance(&self, p: DVec3) -> f64 {
        let Placement { scale, .. } = self.drawn.placement;
        self.drawn.shape.signed_distance_f32(self.drawn.placement.to_shape(p)) * scale
    }
}

/// All bodies, and the removed space.
pub struct Stage<'a> {
    pub bodies: Vec<Body<'a>>,
    pub cut: &'a Cut,
    /// Bounding box of all bodies except planes, in world units.
    pub bounds: Aabb,
}

impl<'a> Stage<'a> {
    pub fn new(bodies: &[Drawn<'a>], cut: &'a Cut) -> Self {
        let mut known: Vec<(&Arc<tesdf::TeSdf>, Arc<SmoothNormals>)> = Vec::new();
        let mut ready = Vec::with_capacity(bodies.len());
        for &drawn in bodies {
            let normals = match drawn.shape {
                Shape::Mesh(asset) => {
                    let made = known.iter().find(|(other, _)| Arc::ptr_eq(other, asset));
                    let normals =
                        made.map(|(_, n)| n.clone()).unwrap_or_else(|| Arc::new(SmoothNormals::new(asset)));
                    known.push((asset, normals.clone()));
                    Some(normals)
                }
                _ => None,
            };
            let bounds = match drawn.shape {
                Shape::Plane => Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY },
                shape => drawn.placement.bounds(shape.bounds()),
            };
            ready.push(Body { drawn, normals, bounds });
        }
        let bounds = ready.iter().filter(|b| !b.is_floor()).fold(Aabb::EMPTY, |a, b| a.union(b.bounds));
        Self { bodies: ready, cut, bounds }
    }

    /// The first hit of a ray; `along` is a unit vector.
    pub fn first(&self, origin: DVec3, along: DVec3) -> Option<Met> {
        let span = self.cut.span(origin, along);
        let mut best: Option<Met> = None;
        for body in 0..self.bodies.len() {
            let limit = best.map_or(f64::INFINITY, |b| b.t);
            let exposed = span.filter(|_| self.bodies[body].drawn.exposure == Exposure::Cut);
            let met = match exposed {
                None => self.skin(body, origin, along, 0.0, limit),
                Some(span) => self
                    .skin(body, origin, along, 0.0, limit.min(span.enter))
                    .or_else(|| self.section(body, origin, along, span.leave, span.through, limit))
                    .or_else(|| self.skin(body, origin, along, span.leave, limit)),
            };
            let Some(mut met) = met else { continue };
            match best {
                Some(other) if met.t > other.t => {}
                Some(other) if met.t == other.t && other.part != Part::Skin && met.part != Part::Skin => {
                    met = other;
                    met.part = Part::Overlap;
                    best = Some(met);
                }
                _ => best = Some(met),
            }
        }
        best
    }

    fn skin(&self, body: usize, origin: DVec3, along: DVec3, from: f64, limit: f64) -> Option<Met> {
        if limit < from || !from.is_finite() {
            return None;
        }
        let Body { drawn: Drawn { shape, placement, .. }, normals, .. } = &self.bodies[body];
        let [start, direction] = [
            placement.to_shape(origin + from * along),
            placement.pose.rotation.inverse() * along / placement.scale,
        ];
        let hit = shape.ray_cast(start, direction, limit - from)?;
        let at = start + hit.t * direction;
        let smooth = hit.face.zip(normals.as_deref()).and_then(|(face, normals)| normals.at(face, at));
        let to_world = |n: DVec3| placement.pose.rotation * n;
        let t = from + hit.t;
        Some(Met {
            t,
            point: origin + t * along,
            normal: to_world(hit.normal),
            smooth: to_world(smooth.unwrap_or(hit.normal)),
            body,
            part: Part::Skin,
        })
    }

    /// The section of a body at the point where the ray leaves the removed space.
    fn section(
        &self,
        body: usize,
        origin: DVec3,
        along: DVec3,
        t: f64,
        through: HalfSpace,
        limit: f64,
    ) -> Option<Met> {
        let point = origin + t * along;
        let Body { drawn, bounds, .. } = &self.bodies[body];
        let inside = t <= limit
            && t.is_finite()
            && bounds.contains(point)
            && drawn.shape.contains(drawn.placement.to_shape(point));
        // The normal of the removed half space points into the removed space, as an outward surface
        // normal does.
        let normal = through.normal;
        inside.then_some(Met { t, point, normal, smooth: normal, body, part: Part::Section })
    }

    /// Distance from `p` to the visible bodies, negative inside, if it is below `limit`; otherwise
    /// `limit`.
    ///
    /// Sections count as surface. Near the cut the result is a lower bound.
    pub fn distance(&self, p: DVec3, limit: f64) -> f64 {
        let removed = self.cut.signed_distance(p);
        let mut least = limit;
        for body in &self.bodies {
            let cut = if body.drawn.exposure == Exposure::Cut { -removed } else { f64::NEG_INFINITY };
            if cut >= least || body.bounds.distance_squared(p) >= least.max(0.0).powi(2) {
                continue;
            }
            least = least.min(body.signed_distance(p).max(cut));
        }
        least
    }
}

use glam::DVec3;
use serde::Serialize;

use super::PointClass;
use crate::base::Certificate;
use crate::geometry::is_flat;
use crate::mesh::TriangleMesh;
use crate::query::{Answer, Precision};

/// The error bounds that a [`Precision`] promises. The answers of an asset that certifies nothing
/// are compared with the same bounds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Promise {
    /// Largest error of a distance, as a fraction of the diagonal.
    pub of_diagonal: f64,
    /// Added to the error bound: this many units in the last place of the largest coordinate of the
    /// mesh and the point.
    pub ulps: f64,
    /// Largest error of a gradient, in radians.
    pub gradient: f64,
    /// Added to the gradient bound: this length divided by the distance. In the mesh's unit; 0
    /// unless the precision treats narrow faces of the mesh as segments.
    pub gradient_width: f64,
    /// Nearer to the surface than this fraction of the diagonal, gradients are only promised to be
    /// unit vectors.
    pub gradient_from: f64,
    /// Distances and gradients are promised only nearer to the surface than this, in the mesh's
    /// unit; `None`: everywhere. Signs are promised everywhere.
    pub within: Option<f64>,
    diagonal: f64,
    largest_coordinate: f64,
}

impl Promise {
    fn new(precision: Precision, mesh: &TriangleMesh, certificate: &Certificate) -> Self {
        let bounds = mesh.bounds();
        let largest_coordinate = bounds.min.abs().max(bounds.max.abs()).max_element();
        let (of_diagonal, ulps, gradient_from) = match precision {
            Precision::F32 => (1e-6, 0.0, 1e-4),
            Precision::F64 => (1e-12, 4.0, 1e-9),
        };
        let diagonal = mesh.diagonal();
        let within = certificate.delta().map_or(Some(0.0), |_| certificate.exactness_distance());
        let gradient_width = match precision {
            Precision::F32 if has_narrow_faces(mesh, of_diagonal * diagonal) => of_diagonal * diagonal,
            _ => 0.0,
        };
        Self {
            of_diagonal,
            ulps,
            gradient: 1e-3,
            gradient_width,
            gradient_from,
            within,
            diagonal,
            largest_coordinate,
        }
    }

    /// Largest error of a gradient at this distance, in radians.
    fn gradient_at(&self, distance: f64) -> f64 {
        self.gradient + self.gradient_width / distance.abs()
    }

    /// Largest error of the distance at `p`, in the mesh's unit. Up to this distance from the
    /// surface, either sign is accepted.
    pub fn distance(&self, p: DVec3) -> f64 {
        let largest = self.largest_coordinate.max(p.abs().max_element());
        self.of_diagonal * self.diagonal + self.ulps * (largest.next_up() - largest)
    }
}

/// Whether some face has a height over its longest edge that is at most `height`.
fn has_narrow_faces(mesh: &TriangleMesh, height: f64) -> bool {
    (0..mesh.faces().len()).any(|face| {
        let [a, b, c] = mesh.triangle(face).map(|p| p / height);
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        is_flat((b - a).cross(c - a).length(), longest, 1.0)
    })
}

/// A point with an error. Lengths are in the mesh's unit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Worst {
    /// The point.
    pub point: [f64; 3],
    /// Class of the point.
    pub class: PointClass,
    /// Signed distance by brute force.
    pub expected: f64,
    /// Signed distance of the answer.
    pub found: f64,
    /// Face of the answer, 0-based.
    pub face: u32,
}

/// Errors at the points of one class.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ClassErrors {
    /// The class.
    pub class: PointClass,
    /// Number of points.
    pub points: usize,
    /// Largest error of a distance, in the mesh's unit.
    pub largest_error: f64,
}

/// Comparison of one precision with brute force.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PrecisionReport {
    /// `f32` or `f64`.
    pub precision: &'static str,
    /// Whether there is no mistake.
    pub passed: bool,
    /// The promised bounds.
    pub promise: Promise,
    /// Largest error of a signed distance, in the mesh's unit.
    pub largest_error: f64,
    /// The same as a fraction of the diagonal.
    pub largest_error_of_diagonal: f64,
    /// Largest error relative to the bound at its point. A distance is right when this is at most
    /// 1.
    pub largest_error_of_promise: f64,
    /// The point with the largest relative error.
    pub worst: Option<Worst>,
    /// Number of points with a larger error than the bound.
    pub distance_mistakes: usize,
    /// Number of points on the wrong side that are farther from the surface than the promised
    /// error.
    pub sign_mistakes: usize,
    /// The point among them that is farthest from the surface.
    pub worst_sign: Option<Worst>,
    /// Number of gradients with a larger error than promised, not of length 1, or of a face that is
    /// not closest.
    pub gradient_mistakes: usize,
    /// Largest angle between a gradient and the direction from the closest point of the answer's
    /// face, in radians.
    pub largest_gradient_error: f64,
    /// The point with this angle.
    pub worst_gradient: Option<Worst>,
    /// Largest error of a signed distance where no bound is promised; `None` when every point has a
    /// promise.
    pub largest_error_beyond: Option<f64>,
    /// Errors by class, without the points where lists are cut.
    pub classes: Vec<ClassErrors>,
}

/// A largest value and its point. On ties the first point.
#[derive(Clone, Debug, Default)]
struct Largest {
    value: f64,
    at: Option<Worst>,
}

impl Largest {
    fn add(&mut self, value: f64, at: impl FnOnce() -> Worst) {
        // NaN counts as worse than any number.
        let value = if value.is_nan() { f64::INFINITY } else { value };
        if self.at.is_none() || value > self.value {
            *self = Self { value, at: Some(at()) };
        }
    }

    fn join(self, other: Self) -> Self {
        let other_wins = other.at.is_some() && (self.at.is_none() || other.value > self.value);
        if other_wins { other } else { self }
    }
}

/// Accumulated errors of one precision.
pub(super) struct Comparison {
    precision: Precision,
    promise: Promise,
    /// Nearer to the surface than this, lists are not cut; `None`: everywhere.
    uncut_within: Option<f64>,
    classes: [(usize, f64); PointClass::ALL.len()],
    beyond: f64,
    distance_mistakes: usize,
    error: Largest,
    sign_mistakes: usize,
    sign: Largest,
    gradient_mistakes: usize,
    gradient: Largest,
}

impl Comparison {
    pub(super) fn new(precision: Precision, mesh: &TriangleMesh, certificate: &Certificate) -> Self {
        Self {
            precision,
            promise: Promise::new(precision, mesh, certificate),
            uncut_within: certificate.exactness_distance(),
            classes: Default::default(),
            beyond: 0.0,
            distance_mistakes: 0,
            error: Largest::default(),
            sign_mistakes: 0,
            sign: Largest::default(),
            gradient_mistakes: 0,
            gradient: Largest::default(),
        }
    }

    pub(super) fn precision(&self) -> Precision {
        self.precision
    }

    pub(super) fn promise(&self) -> &Promise {
        &self.promise
    }

    /// Compares one answer. `offset` is the vector to `p` from the closest point of the face that
    /// the answer names.
    pub(super) fn add(
        &mut self,
        class: PointClass,
        p: DVec3,
        expected: f64,
        answer: &Answer,
        offset: Option<DVec3>,
    ) {
        let found = answer.signed_distance;
        let at = || Worst { point: p.to_array(), class, expected, found, face: answer.face };
        let bound = self.promise.distance(p);
        // Nearer than the bound, either sign is accepted, but the distance must be right.
        let clear = expected.abs() > bound;
        let error = if clear { (found - expected).abs() } else { (found.abs() - expected.abs()).abs() };
        let error = if error.is_nan() { f64::INFINITY } else { error };
        // A signed distance of zero is on neither side.
        if clear && found * expected.signum() <= 0.0 {
            self.sign_mistakes += 1;
            self.sign.add(expected.abs(), at);
        }
        let is_beyond = |within: Option<f64>| within.is_some_and(|within| expected.abs() >= within);
        if is_beyond(self.promise.within) {
            self.beyond = self.beyond.max(error);
        }
        if is_beyond(self.uncut_within) {
            return;
        }
        let slot = &mut self.classes[class as usize];
        *slot = (slot.0 + 1, slot.1.max(error));
        self.distance_mistakes += usize::from(error > bound);
        self.error.add(error / bound, at);
        match gradient_error(p, expected, answer, offset, &self.promise) {
            Some(angle) => {
                let right = angle <= self.promise.gradient_at(expected);
                self.gradient_mistakes += usize::from(!right);
                self.gradient.add(angle, at);
            }
            None => {
                let unit = (answer.gradient.length() - 1.0).abs() <= self.promise.gradient;
                if !unit {
                    self.gradient_mistakes += 1;
                    self.gradient.add(f64::INFINITY, at);
                }
            }
        }
    }

    /// A point whose distance, or else sign, breaks the promise; `None` when there is none.
    pub(super) fn worst_broken(self) -> Option<Worst> {
        // An asset that certifies nothing promises signs only.
        let is_promised = self.promise.within.is_none_or(|within| within > 0.0);
        if is_promised && self.distance_mistakes > 0 { self.error.at } else { self.sign.at }
    }

    pub(super) fn join(mut self, other: Self) -> Self {
        for (a, b) in self.classes.iter_mut().zip(other.classes) {
            *a = (a.0 + b.0, a.1.max(b.1));
        }
        Self {
            precision: self.precision,
            promise: self.promise,
            uncut_within: self.uncut_within,
            classes: self.classes,
            beyond: self.beyond.max(other.beyond),
            distance_mistakes: self.distance_mistakes + other.distance_mistakes,
            error: self.error.join(other.error),
            sign_mistakes: self.sign_mistakes + other.sign_mistakes,
            sign: self.sign.join(other.sign),
            gradient_mistakes: self.gradient_mistakes + other.gradient_mistakes,
            gradient: self.gradient.join(other.gradient),
        }
    }

    pub(super) fn report(self) -> PrecisionReport {
        let largest_error = self.classes.iter().map(|c| c.1).fold(0.0, f64::max);
        let classes = PointClass::ALL.into_iter().zip(self.classes);
        PrecisionReport {
            precision: match self.precision {
                Precision::F32 => "f32",
                Precision::F64 => "f64",
            },
            passed: self.distance_mistakes + self.sign_mistakes + self.gradient_mistakes == 0,
            largest_error_beyond: self.promise.within.map(|_| self.beyond),
            promise: self.promise,
            largest_error,
            largest_error_of_diagonal: largest_error / self.promise.diagonal,
            largest_error_of_promise: self.error.value,
            worst: self.error.at,
            distance_mistakes: self.distance_mistakes,
            sign_mistakes: self.sign_mistakes,
            worst_sign: self.sign.at,
            gradient_mistakes: self.gradient_mistakes,
            largest_gradient_error: self.gradient.value,
            worst_gradient: self.gradient.at,
            classes: classes
                .map(|(class, (points, largest_error))| ClassErrors { class, points, largest_error })
                .collect(),
        }
    }
}

/// The error of the gradient. The expected direction comes from the closest point of the face that
/// the answer names, and this face must be a closest face. `None` so near to the surface that no
/// direction is promised.
///
/// Where several faces are closest, the gradient of any of them is right. One face has only one
/// closest point. So this test is as strict as a comparison with the nearest face, but does not
/// jump between faces.
fn gradient_error(
    p: DVec3,
    expected: f64,
    answer: &Answer,
    offset: Option<DVec3>,
    promise: &Promise,
) -> Option<f64> {
    let bound = promise.distance(p);
    if expected.abs() < (promise.gradient_from * promise.diagonal).max(10.0 * bound) {
        return None;
    }
    let Some(offset) = offset.filter(|o| o.length() <= expected.abs() + 2.0 * bound) else {
        return Some(f64::INFINITY);
    };
    let direction = expected.signum() * offset.normalize();
    // The length of the chord, which also shows a wrong length of the gradient.
    Some((answer.gradient - direction).length())
}

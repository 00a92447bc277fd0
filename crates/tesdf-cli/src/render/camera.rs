use tesdf::glam::{DVec2, DVec3};

/// Position and projection of the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Azimuth of the camera around the z axis, degrees, from x towards y.
    pub azimuth: f64,
    /// Elevation of the camera above the plane z = 0, degrees, -90 to 90.
    pub elevation: f64,
    /// Angle between the left and right borders of a square picture, degrees, between 0 and 180;
    /// `None` is an orthographic projection.
    pub field_of_view: Option<f64>,
    /// Magnification relative to a picture that fits the scene; positive.
    pub zoom: f64,
    /// The point in the middle of the picture, in world units; `None` is the middle of the scene.
    pub target: Option<DVec3>,
}

impl Default for View {
    /// An orthographic view from the front right and above.
    fn default() -> Self {
        Self { azimuth: -60.0, elevation: 25.0, field_of_view: None, zoom: 1.0, target: None }
    }
}

/// A camera that gives the rays of a picture's pixels. The world's z axis points up in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Unit vector to the right of the picture.
    pub right: DVec3,
    /// Unit vector upwards in the picture.
    pub up: DVec3,
    /// Unit vector into the picture.
    pub forward: DVec3,
    eye: DVec3,
    projection: Projection,
    /// Coordinates of the picture's middle in the picture plane.
    centre: DVec2,
    /// Edge length of a pixel in the picture plane.
    pixel: f64,
    /// Size of the picture, pixels.
    size: DVec2,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Projection {
    /// Parallel rays that start on the plane through the eye. The picture plane is that plane.
    Orthographic,
    /// Rays that start at the eye. The picture plane lies one unit ahead.
    Perspective,
}

/// Margin on each side, as a fraction of the picture.
const MARGIN: f64 = 0.06;

impl Camera {
    /// The camera that sees all `points`, in world units, in a picture of `size` pixels. `None`
    /// when the points have no extent.
    pub fn fitted(view: &View, points: &[DVec3], size: [u32; 2]) -> Option<Self> {
        let (azimuth, elevation) = (view.azimuth.to_radians(), view.elevation.to_radians());
        let right = DVec3::new(-azimuth.sin(), azimuth.cos(), 0.0);
        let level = DVec3::new(azimuth.cos(), azimuth.sin(), 0.0);
        let forward = -(level * elevation.cos() + DVec3::Z * elevation.sin());
        let up = right.cross(forward);
        let seen = || points.iter().map(|p| DVec3::new(right.dot(*p), up.dot(*p), forward.dot(*p)));
        let (low, high) =
            seen().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let depth = (high - low).length();
        if !(depth > 0.0 && depth.is_finite()) {
            return None;
        }
        let size = DVec2::new(f64::from(size[0]), f64::from(size[1]));
        let usable = size * (1.0 - 2.0 * MARGIN);
        let from_seen = |p: DVec3| right * p.x + up * p.y + forward * p.z;
        let mut camera = match view.field_of_view {
            None => {
                let middle = 0.5 * (low + high);
                let extent = (high - low).truncate();
                // Rays start one extent ahead of the scene, which leaves room for shadows and
                // bounds.
                let eye = from_seen(DVec3::new(middle.x, middle.y, low.z - depth));
                let pixel = (extent / usable).max_element();
                Self {
                    right,
                    up,
                    forward,
                    eye,
                    projection: Projection::Orthographic,
                    centre: DVec2::ZERO,
                    pixel,
                    size,
                }
            }
            Some(degrees) => {
                let tangent = (0.5 * degrees.to_radians()).tan();
                let slope = usable / usable.max_element() * tangent;
                // For each point the eye must lie behind the planes through the point that bound
                // the picture.
                let bound = |axis: usize, sign: f64| {
                    seen().map(|p| sign * p[axis] - slope[axis] * p.z).fold(f64::NEG_INFINITY, f64::max)
                };
                let [x, y] = [0, 1].map(|axis| [bound(axis, 1.0), bound(axis, -1.0)]);
                let back = |[a, b]: [f64; 2], slope: f64| -(a + b) / (2.0 * slope);
                let eye = DVec3::new(
                    0.5 * (x[0] - x[1]),
                    0.5 * (y[0] - y[1]),
                    back(x, slope.x).min(back(y, slope.y)),
                );
                let pixel = 2.0 * tangent / usable.max_element();
                let eye = from_seen(eye);
                Self {
                    right,
                    up,
                    forward,
                    eye,
                    projection: Projection::Perspective,
                    centre: DVec2::ZERO,
                    pixel,
                    size,
                }
            }
        };
        if let Some((at, _)) = view.target.and_then(|target| camera.plane_coordinates(target)) {
            camera.centre = at;
        }
        camera.pixel /= view.zoom;
        (camera.pixel > 0.0 && camera.pixel.is_finite() && camera.eye.is_finite()).then_some(camera)
    }

    /// Origin and unit direction of the ray through `at`, in pixels from the upper left corner of
    /// the picture.
    pub fn ray(&self, at: DVec2) -> [DVec3; 2] {
        let q = self.centre + (at - 0.5 * self.size) * DVec2::new(self.pixel, -self.pixel);
        let across = self.right * q.x + self.up * q.y;
        match self.projection {
            Projection::Orthographic => [self.eye + across, self.forward],
            Projection::Perspective => [self.eye, (self.forward + across).normalize()],
        }
    }

    /// Position of a world point in the picture, in pixels from the upper left corner, and its
    /// distance along the ray. `None` when the point is behind the camera.
    pub fn project(&self, p: DVec3) -> Option<(DVec2, f64)> {
        let (q, distance) = self.plane_coordinates(p)?;
        let q = (q - self.centre) / self.pixel;
        Some((0.5 * self.size + DVec2::new(q.x, -q.y), distance))
    }

    /// Edge length of a pixel at a distance along a ray, in world units.
    pub fn pixel_at(&self, distance: f64) -> f64 {
        match self.projection {
            Projection::Orthographic => self.pixel,
            Projection::Perspective => self.pixel * distance,
        }
    }

    fn plane_coordinates(&self, p: DVec3) -> Option<(DVec2, f64)> {
        let from_eye = p - self.eye;
        let (across, depth) =
            (DVec2::new(self.right.dot(from_eye), self.up.dot(from_eye)), self.forward.dot(from_eye));
        match self.projection {
            Projection::Orthographic => Some((across, depth)),
            Projection::Perspective => (depth > 0.0).then(|| (across / depth, from_eye.length())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners() -> Vec<DVec3> {
        (0..8)
            .map(|k| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1) * 3.0, f64::from(k >> 2) - 7.0))
            .collect()
    }

    #[test]
    fn all_points_are_in_the_picture_and_touch_its_margin() {
        for field_of_view in [None, Some(30.0), Some(90.0)] {
            for (azimuth, elevation) in [(0.0, 0.0), (35.0, 20.0), (-130.0, -60.0), (10.0, 90.0)] {
                let view = View { azimuth, elevation, field_of_view, ..View::default() };
                let camera = Camera::fitted(&view, &corners(), [600, 400]).unwrap();
                let seen = corners().iter().map(|p| camera.project(*p).unwrap().0).collect::<Vec<_>>();
                let low = seen.iter().copied().reduce(DVec2::min).unwrap() / DVec2::new(600.0, 400.0);
                let high = seen.iter().copied().reduce(DVec2::max).unwrap() / DVec2::new(600.0, 400.0);
                let free = low.min(DVec2::ONE - high);
                assert!(free.cmpgt(DVec2::splat(MARGIN - 1e-9)).all(), "{view:?}: {free}");
                assert!(free.min_element() < MARGIN + 0.02, "{view:?}: {free}");
            }
        }
    }

    #[test]
    fn rays_and_projections_are_inverse() {
        for field_of_view in [None, Some(40.0)] {
            let target = DVec3::new(0.2, 1.0, -6.5);
            let view = View { field_of_view, zoom: 3.0, target: Some(target), ..View::default() };
            let camera = Camera::fitted(&view, &corners(), [300, 500]).unwrap();
            let middle = DVec2::new(150.0, 250.0);
            assert!(camera.project(target).unwrap().0.distance(middle) < 1e-9);
            let at_six = |at: DVec2| {
                let [origin, along] = camera.ray(at);
                origin + 6.0 * along
            };
            let (at, distance) = camera.project(at_six(DVec2::new(20.0, 70.0))).unwrap();
            assert!(at.distance(DVec2::new(20.0, 70.0)) < 1e-9 && (distance - 6.0).abs() < 1e-9);
            let step = at_six(middle).distance(at_six(middle + DVec2::X));
            assert!((step / camera.pixel_at(6.0) - 1.0).abs() < 1e-2);
        }
        assert_eq!(Camera::fitted(&View::default(), &[], [9, 9]), None);
        assert_eq!(Camera::fitted(&View::default(), &[DVec3::ONE], [9, 9]), None);
    }
}

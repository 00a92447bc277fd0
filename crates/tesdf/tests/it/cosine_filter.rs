//! Eq. (10) on the paper's Fig. 5: two faces in the field of a rectangle, with three gradients,
//! only one of which is useful.

use crate::support::bodies::Body;
use crate::support::shapes::Shape;
use tesdf::collide::{CollideOptions, Contact, ContactsPer, Instance, InstanceId, Mode, Pose, Scene, detect};
use tesdf::geometry::Triangle;
use tesdf::glam::DVec3;

/// The rectangle, 4 × 1, extruded along y.
fn rectangle() -> Shape {
    Shape::default().add_box(DVec3::new(0.0, -2.0, 0.0), DVec3::new(4.0, 2.0, 1.0), 4)
}

/// The probing body. Its lower side is below the middle of the rectangle (n¹ points down); the next
/// side rises out of the rectangle (n²). Corners are in the plane, and each side runs from one
/// corner to the next.
const PROBE: [[f64; 2]; 5] = [[1.0, 0.35], [2.0, 0.35], [3.2, 1.15], [3.2, 1.6], [1.0, 1.6]];

/// A prism over a convex polygon in x and z, given counter-clockwise.
fn prism(polygon: &[[f64; 2]], half_depth: f64) -> Shape {
    let n = polygon.len() as u32;
    let at = |y: f64| polygon.iter().map(move |&[x, z]| DVec3::new(x, y, z));
    let vertices = at(-half_depth).chain(at(half_depth)).collect();
    let mut faces = Vec::new();
    for i in 0..n {
        let j = (i + 1) % n;
        faces.extend([[i, j, n + j], [i, n + j, n + i]]);
        if i > 0 && i + 1 < n {
            faces.extend([[0, i + 1, i], [n, n + i, n + i + 1]]);
        }
    }
    // Seen from −y, with x to the right and z up, the faces turn clockwise, so they are reversed.
    let outward = faces.into_iter().map(|[a, b, c]| [a, c, b]).collect();
    Shape { vertices, faces: outward }
}

struct Figure {
    scene: Scene,
    probe: Body,
}

impl Figure {
    fn new() -> Self {
        let (field, probe) = (Body::new(rectangle().solid()), Body::new(prism(&PROBE, 0.5).solid()));
        let mut scene = Scene::new();
        for body in [&probe, &field] {
            let shape = scene.add_shape(body.asset.clone()).expect("a mesh");
            scene.add(Instance::new(shape, Pose::IDENTITY)).expect("a pose");
        }
        Self { scene, probe }
    }

    /// Contacts of the probe's faces, and the number of contacts that were dropped in total.
    fn contacts(&self, mode: Mode, cos_theta: Option<f64>) -> (Vec<Contact>, usize) {
        let mode = cos_theta.map_or(mode, |cos| mode.filtered(cos)).per(ContactsPer::Cell);
        let options = CollideOptions::with_mode(mode);
        let found = detect(&self.scene, &options).expect("a good scene");
        let all = found.iter().filter(|c| c.instance_a == InstanceId(0)).copied().collect();
        (all, found.statistics.filtered)
    }

    fn normal(&self, face: u32) -> DVec3 {
        Triangle::new(self.probe.solid.mesh().triangle(face as usize)).normal
    }

    /// The contacts of the faces with this normal.
    fn of_normal<'a>(&self, contacts: &'a [Contact], normal: DVec3) -> Vec<&'a Contact> {
        contacts.iter().filter(|c| self.normal(c.face_a).distance(normal) < 1e-9).collect()
    }
}

#[test]
fn gradients_that_face_away_are_dropped() {
    let figure = Figure::new();
    let n1 = DVec3::NEG_Z;
    let n2 = DVec3::new(0.8, 0.0, -1.2).normalize();
    for mode in [Mode::exact(), Mode::face()] {
        let (all, filtered) = figure.contacts(mode, None);
        assert_eq!(filtered, 0);
        let points = |c: &Contact, way: f64| c.normal.z * way > 0.999;
        // ∇φ¹: the nearest side is the lower one, although the way out is up.
        let first = figure.of_normal(&all, n1);
        assert!(!first.is_empty() && first.iter().all(|c| points(c, -1.0)), "{mode:?} {first:?}");
        // ∇φ² and ∇φ³: the second face has both, in different cells.
        let second = figure.of_normal(&all, n2);
        assert!(second.iter().any(|c| points(c, -1.0)), "{mode:?}");
        assert!(second.iter().any(|c| points(c, 1.0)), "{mode:?}");

        let cos = 0.5;
        let (kept, filtered) = figure.contacts(mode, Some(cos));
        assert!(figure.of_normal(&kept, n1).is_empty(), "{mode:?}: ∇φ¹ stays");
        let second_kept = figure.of_normal(&kept, n2);
        assert!(!second_kept.is_empty(), "{mode:?}: ∇φ³ is gone");
        assert!(second_kept.iter().all(|c| points(c, 1.0)), "{mode:?}: ∇φ² stays");
        assert!(filtered > 0);
        // The kept contacts satisfy Eq. (10) exactly and are unchanged.
        let by_hand: Vec<Contact> =
            all.iter().filter(|c| c.normal.dot(figure.normal(c.face_a)) <= -cos).copied().collect();
        assert_eq!(kept, by_hand, "{mode:?}");
    }
}

#[test]
fn a_threshold_of_minus_one_keeps_all_contacts_and_one_only_opposite_gradients() {
    let figure = Figure::new();
    let (all, _) = figure.contacts(Mode::exact(), None);
    // ∇φ · n > 1 is never true, except for the rounding of two unit vectors.
    let (kept, filtered) = figure.contacts(Mode::exact(), Some(-1.0));
    assert!(all.len() - kept.len() == 0 || filtered > 0 && all.len() - kept.len() < all.len() / 4);
    let (strict, _) = figure.contacts(Mode::exact(), Some(1.0 - 1e-9));
    assert!(strict.iter().all(|c| c.normal.dot(figure.normal(c.face_a)) < -0.999_999));
    assert!(strict.len() < all.len());
}

#[test]
fn nodes_are_not_filtered() {
    let figure = Figure::new();
    let (all, _) = figure.contacts(Mode::Node, None);
    let (kept, filtered) = figure.contacts(Mode::Node, Some(0.9));
    assert!(!all.is_empty());
    assert_eq!((all, 0), (kept, filtered));
}

//! Pairs of prisms that lie flush on each other, and what their contacts have to be.
use std::sync::Arc;

use tesdf::collide::{CollideOptions, Contact, ContactsPer, Instance, Mode, Pose, Scene, Shape};
use tesdf::encode::{Encoder, Preset};
use tesdf::glam::{DQuat, DVec2, DVec3};
use tesdf::mesh::{SolidMesh, TriangleMesh};

use super::random::Random;

/// A prism of height 0.5 over a polygon, which is the union of convex ones.
struct Prism {
    shape: Shape,
    convex: Vec<Vec<DVec2>>,
}

impl Prism {
    /// Of a polygon whose first corner sees all others.
    fn new(outline: &[DVec2], convex: Vec<Vec<DVec2>>) -> Self {
        let n = outline.len() as u32;
        let at = |z: f64| outline.iter().map(move |p| p.extend(z));
        let (vertices, mut faces) = (at(-0.25).chain(at(0.25)).collect::<Vec<_>>(), Vec::new());
        for k in 1..n - 1 {
            faces.extend([[0, k + 1, k], [n, n + k, n + k + 1]]);
        }
        for k in 0..n {
            let next = (k + 1) % n;
            faces.extend([[k, next, n + next], [k, n + next, n + k]]);
        }
        let solid = SolidMesh::new(TriangleMesh::new(vertices, faces).expect("indices")).expect("a solid");
        let asset = Encoder::new().preset(Preset::Fast).encode(&solid).expect("a prism");
        Self { shape: Shape::Mesh(Arc::new(asset)), convex }
    }

    /// A convex polygon of size 1.
    fn convex(random: &mut Random) -> Self {
        let n = 3 + random.index(5);
        let turn = |k: usize| std::f64::consts::TAU * (k as f64 + 0.3 * random.unit()) / n as f64;
        let angles: Vec<f64> = (0..n).map(turn).collect();
        let outline: Vec<DVec2> = angles.into_iter().map(|angle| 0.5 * DVec2::from_angle(angle)).collect();
        Self::new(&outline, vec![outline.clone()])
    }

    /// An L of size 1.
    fn concave(random: &mut Random) -> Self {
        let (w, h) = (random.between(0.2, 0.4), random.between(0.2, 0.4));
        let p = |x: f64, y: f64| DVec2::new(x - w, y - h);
        let outline = [p(w, h), p(w, 0.9), p(0.0, 0.9), p(0.0, 0.0), p(0.9, 0.0), p(0.9, h)];
        let post = vec![p(0.0, 0.0), p(w, 0.0), p(w, 0.9), p(0.0, 0.9)];
        let foot = vec![p(0.0, 0.0), p(0.9, 0.0), p(0.9, h), p(0.0, h)];
        Self::new(&outline, vec![post, foot])
    }

    /// A built-in box of size 1.
    fn cuboid(random: &mut Random) -> Self {
        let half = DVec2::new(random.between(0.2, 0.5), random.between(0.2, 0.5));
        let outline = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let convex = outline.map(|(x, y)| half * DVec2::new(x, y)).to_vec();
        Self { shape: Shape::Box { half_extents: half.extend(0.25) }, convex: vec![convex] }
    }

    fn random(random: &mut Random) -> Self {
        [Self::convex, Self::concave, Self::cuboid][random.index(3)](random)
    }
}

/// What two convex polygons share.
fn shared(one: &[DVec2], other: &[DVec2]) -> Vec<DVec2> {
    let mut shared = one.to_vec();
    for (k, &start) in other.iter().enumerate() {
        let side = other[(k + 1) % other.len()] - start;
        let height = |p: DVec2| side.perp_dot(p - start);
        let all = std::mem::take(&mut shared);
        for (i, &p) in all.iter().enumerate() {
            let q = all[(i + 1) % all.len()];
            let [from, to] = [p, q].map(height);
            if from >= 0.0 {
                shared.push(p);
            }
            if (from < 0.0) != (to < 0.0) {
                shared.push(p + (q - p) * (from / (from - to)));
            }
        }
    }
    shared
}

/// A prism on another one, in a world that is turned.
pub struct Flush {
    prisms: [Prism; 2],
    poses: [Pose; 2],
    gap: f64,
    /// The corners of the area that they share: at least three.
    corners: Vec<DVec3>,
    /// The normal of the area.
    normal: DVec3,
}

impl Flush {
    /// Random prisms, one on the other; `None` where they do not meet.
    fn random(random: &mut Random, gap: f64) -> Option<Self> {
        let [under, upper] = [Prism::random(random), Prism::random(random)];
        let (angle, aside) = (random.between(0.0, 6.0), 0.3 * random.in_cube().truncate());
        let turned = |p: &DVec2| DVec2::from_angle(angle).rotate(*p) + aside;
        let of_upper: Vec<Vec<DVec2>> =
            upper.convex.iter().map(|part| part.iter().map(turned).collect()).collect();
        let parts = under.convex.iter().flat_map(|a| of_upper.iter().map(|b| shared(a, b)));
        let area: Vec<DVec2> = parts.flatten().collect();
        let world = Pose {
            translation: random.in_cube(),
            rotation: DQuat::from_axis_angle(random.direction(), random.between(0.0, 3.0)),
        };
        let on_it = Pose { translation: aside.extend(0.5 + gap), rotation: DQuat::from_rotation_z(angle) };
        (area.len() > 2).then(|| Self {
            prisms: [under, upper],
            poses: [world, world.after(on_it)],
            gap,
            corners: area.iter().map(|p| world.to_world(p.extend(0.25))).collect(),
            normal: world.rotation * DVec3::Z,
        })
    }

    /// Random pairs, with these gaps in turn.
    pub fn pairs(count: usize, gaps: &[f64]) -> Vec<Self> {
        let mut random = Random(0xf1a7);
        (0..count).filter_map(|k| Self::random(&mut random, gaps[k % gaps.len()])).collect()
    }

    /// A scene with a world for each pair, and its options.
    pub fn scene(pairs: &[Self]) -> (Scene, CollideOptions) {
        let mut scene = Scene::new();
        for (world, pair) in (0..).zip(pairs) {
            for (prism, &pose) in pair.prisms.iter().zip(&pair.poses) {
                let shape = scene.add_shape(prism.shape.clone()).expect("a shape");
                scene.add(Instance { world, ..Instance::new(shape, pose) }).expect("a pose");
            }
        }
        let options = CollideOptions {
            contact_distance: 1e-4,
            ..CollideOptions::with_mode(Mode::exact().per(ContactsPer::Minimum))
        };
        (scene, options)
    }

    /// Checks the contacts of such a scene.
    pub fn hold(pairs: &[Self], contacts: &[Contact], allowed: &Allowed) {
        let wrong = |(k, pair): (u32, &Self)| {
            let own = contacts.iter().filter(|c| c.instance_a.0 / 2 == k).collect::<Vec<_>>();
            let gap = pair.gap;
            pair.fault(&own, allowed).map(|fault| format!("pair {k}, gap {gap}: {fault}"))
        };
        let wrong = (0..).zip(pairs).filter_map(wrong).collect::<Vec<_>>();
        assert!(wrong.is_empty(), "{} of {} pairs:\n{}", wrong.len(), pairs.len(), wrong.join("\n"));
    }

    /// A normal that is not that of the area, a distance that is not the gap, or a direction in which
    /// the support of the contacts is not that of the area.
    fn fault(&self, contacts: &[&Contact], allowed: &Allowed) -> Option<String> {
        let &Self { gap, normal, .. } = self;
        let range = gap - allowed.distance..=gap.max(0.0) + allowed.distance;
        for contact in contacts {
            let sine = contact.normal.cross(normal).length();
            if sine > allowed.sine || !range.contains(&contact.distance) {
                return Some(format!("{contact:?} leans by {sine}"));
            }
        }
        let across = normal.any_orthonormal_pair();
        // In an overlap a corner is as far inside of both bodies as the overlap is deep, which at a
        // sharp corner is this multiple of it along the area.
        let place = allowed.place + 12.0 * gap.abs();
        let off = |turn: u32| {
            let angle = std::f64::consts::TAU * f64::from(turn) / 64.0;
            let direction = angle.cos() * across.0 + angle.sin() * across.1;
            let most = |points: &mut dyn Iterator<Item = DVec3>| {
                points.map(|p| p.dot(direction)).fold(f64::NEG_INFINITY, f64::max)
            };
            let of_area = most(&mut self.corners.iter().copied());
            most(&mut contacts.iter().map(|contact| contact.point_a)) - of_area
        };
        let off = (0..64).map(off).find(|off| off.abs() > place || off.is_nan())?;
        Some(format!("the support of {} contacts is off by {off}", contacts.len()))
    }
}

/// Bounds of what contacts may differ by from what the geometry says.
pub struct Allowed {
    /// Sine of the angle between normals.
    pub sine: f64,
    pub distance: f64,
    /// Of the corners of the area, beside the depth of the overlap.
    pub place: f64,
}

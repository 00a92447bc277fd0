//! Boxes, as meshes and as shapes, and the normals of contacts of a box on its edge or corner.
use std::sync::Arc;

use tesdf::collide::{CollideOptions, Contact, ContactsPer, Instance, InstanceId, Mode, Pose, Scene, Shape};
use tesdf::encode::{Encoder, Preset};
use tesdf::glam::{DQuat, DVec3};

use super::bodies::rotation;
use super::random::Random;
use super::shapes;

/// A box, as a mesh or a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Mesh,
    Formula,
}

/// A box in the world.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    pub kind: Kind,
    pub half: DVec3,
    pub pose: Pose,
}

impl Block {
    pub fn shape(&self) -> Shape {
        match self.kind {
            Kind::Formula => Shape::Box { half_extents: self.half },
            Kind::Mesh => {
                let solid = shapes::Shape::default().add_box(-self.half, self.half, 1).solid();
                Shape::Mesh(Arc::new(Encoder::new().preset(Preset::Fast).encode(&solid).expect("a box")))
            }
        }
    }

    /// How far a direction is out of the cone of the normals of the sides within `near` of a point:
    /// the length of what must be taken from it. The normals are the axes, so each component of the
    /// direction, in the frame of the box, must be 0 off the sides, and of their sign at them.
    pub fn out_of_cone(&self, point: DVec3, direction: DVec3, near: f64) -> f64 {
        let (p, d) = (self.pose.to_body(point), self.pose.rotation.inverse() * direction);
        let excess = |axis: usize| {
            let at_side = self.half[axis] - p[axis].abs() <= near;
            if at_side { (-d[axis] * p[axis].signum()).max(0.0) } else { d[axis].abs() }
        };
        DVec3::from_array([0, 1, 2].map(excess)).length()
    }

    /// The number of sides within `near` of a point.
    pub fn sides_at(&self, point: DVec3, near: f64) -> usize {
        let p = self.pose.to_body(point);
        (0..3).filter(|&axis| self.half[axis] - p[axis].abs() <= near).count()
    }

    /// The axes of the box in the world.
    pub fn axes(&self) -> [DVec3; 3] {
        DVec3::AXES.map(|axis| self.pose.rotation * axis)
    }
}

/// Sine of the angle by which a normal may be out of a cone (`docs/math.md`, section 18).
pub const SLOPE: f64 = 0.1;

/// A point is on a side of a box of size 1 when it is nearer.
pub const ON_SIDE: f64 = 5e-6;

/// How well a detection knows contacts.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    /// A point belongs to a feature up to this distance.
    pub near: f64,
    /// Error of distances.
    pub tolerance: f64,
    /// Error of the normal of a face.
    pub direction: f64,
}

/// Contacts up to this distance.
const CONTACT_DISTANCE: f64 = 2e-3;

/// Contacts of a floor's face with an edge or a corner of a box have the normal of the floor, in these
/// modes and for these kinds of contacts: those right over each other. All others, but the minima, are
/// along the way between their points, as far as these are known (`docs/math.md`, section 18).
pub fn edges_are_pushed_along_the_normal_of_the_floor(
    detect: &dyn Fn(&Scene, &CollideOptions) -> Vec<Contact>,
    kinds: &[(Mode, ContactsPer)],
    Known { near, tolerance, direction }: Known,
) {
    let mut random = Random(29);
    let mut worlds: Vec<[Block; 2]> = Vec::new();
    let mut scene = Scene::new();
    for kind in [Kind::Mesh, Kind::Formula] {
        let half = DVec3::new(0.3, 0.25, 0.02);
        let floor = DVec3::new(1.0, 1.0, 0.5);
        let shapes = [floor, half].map(|half| {
            let shape = Block { kind, half, pose: Pose::IDENTITY }.shape();
            scene.add_shape(shape).expect("a good shape")
        });
        for gap in [-1e-7, 0.0, 1e-9, 1e-7, 1e-6, 1e-4] {
            for tilt in 0..4 {
                let turn = match tilt {
                    // Slightly tilted, on an edge along the x or the y axis.
                    0..2 => DQuat::from_axis_angle(DVec3::AXES[tilt], random.between(0.02, 0.1)),
                    2 => DQuat::from_axis_angle(DVec3::X, random.between(0.3, 1.3)),
                    _ => rotation(&mut random),
                };
                let height = (turn.inverse() * DVec3::Z).abs().dot(half);
                let at = DVec3::new(random.between(-0.3, 0.3), random.between(-0.3, 0.3), height + gap);
                let blocks = [
                    Block { kind, half: floor, pose: Pose::at(DVec3::new(0.0, 0.0, -0.5)) },
                    Block { kind, half, pose: Pose { translation: at, rotation: turn } },
                ];
                for (shape, block) in shapes.into_iter().zip(blocks) {
                    let world = worlds.len() as u32;
                    scene.add(Instance { world, ..Instance::new(shape, block.pose) }).expect("a good pose");
                }
                worlds.push(blocks);
            }
        }
    }
    for &(mode, contacts_per) in kinds {
        let options = CollideOptions {
            contact_distance: CONTACT_DISTANCE,
            ..CollideOptions::with_mode(mode.per(contacts_per))
        };
        let found = detect(&scene, &options);
        let mut with_edge = vec![0; worlds.len()];
        for c in &found {
            let world = c.instance_a.0 as usize / 2;
            // Well within the limit.
            if is_of_edge(&worlds[world], c, 0.4 * near) {
                let up = if is_floor(c.instance_a) { -c.normal } else { c.normal };
                assert!(up.distance(DVec3::Z) < direction, "{mode:?} per {contacts_per:?}: {c:?}");
                with_edge[world] += usize::from(is_floor(c.instance_a));
            } else if contacts_per != ContactsPer::Minimum {
                let way = c.point_a - c.point_b;
                let off = way.distance(c.distance * c.normal);
                let known = 1.1 * near + (8.0 * tolerance * c.distance.abs()).sqrt();
                assert!(off <= known, "{off} beside the way, {mode:?} per {contacts_per:?}: {c:?}");
            }
        }
        // In the others, points are known less well than this. Frank–Wolfe seldom comes so near to the
        // lowest point, and over a cell never.
        let least = match (mode, contacts_per) {
            (Mode::Node | Mode::Exact(_), _) => worlds.len() / 2,
            (Mode::Face { .. }, ContactsPer::Face | ContactsPer::Minimum) => worlds.len() / 8,
            (Mode::Face { .. }, ContactsPer::Cell) => 0,
        };
        let seen = with_edge.iter().filter(|&&count| count > 0).count();
        println!("{mode:?} per {contacts_per:?}: {seen} of {} worlds, {with_edge:?}", worlds.len());
        assert!(seen >= least, "{mode:?} per {contacts_per:?}: {with_edge:?}");
    }
}

/// Instances alternate: the floor, the box on it.
fn is_floor(id: InstanceId) -> bool {
    id.0.is_multiple_of(2)
}

/// Whether a contact is right between the inside of a floor's side and an edge or corner of a box.
fn is_of_edge([floor, block]: &[Block; 2], c: &Contact, near: f64) -> bool {
    let [below, above] = if is_floor(c.instance_a) { [c.point_a, c.point_b] } else { [c.point_b, c.point_a] };
    floor.sides_at(below, 1e-3) == 1
        && block.sides_at(above, near) >= 2
        && (above - below).truncate().length() <= near
}

/// Two boxes of size 1 that nearly touch at random features: `gap` is the distance along the
/// direction that turns a feature of the second to the first.
pub fn touching(random: &mut Random, gap: f64) -> [Block; 2] {
    let mut block = |turned: bool| {
        let kind = if random.unit() < 0.5 { Kind::Mesh } else { Kind::Formula };
        let half = DVec3::new(random.between(0.2, 0.4), random.between(0.2, 0.4), random.between(0.2, 0.4));
        let rotation = if turned { rotation(random) } else { DQuat::IDENTITY };
        Block { kind, half, pose: Pose { translation: DVec3::ZERO, rotation } }
    };
    let flush = block(false);
    let [first, mut second] = [block(true), block(true)];
    let mut first = if random.unit() < 0.3 { Block { pose: flush.pose, ..first } } else { first };
    if random.unit() < 0.3 {
        // Flush faces and parallel edges.
        second.pose.rotation = first.pose.rotation;
    }
    // The second is moved along a direction until the supports in it are `gap` apart.
    let side = |block: &Block, axis: usize| block.pose.rotation * DVec3::AXES[axis];
    let direction = match random.index(3) {
        0 => side(&first, random.index(3)),
        1 => side(&first, random.index(3)).cross(side(&second, random.index(3))),
        _ => random.direction(),
    };
    let direction = direction.try_normalize().unwrap_or(DVec3::Z);
    let support = |block: &Block, d: DVec3| (block.pose.rotation.inverse() * d).abs().dot(block.half);
    let way = support(&first, direction) + support(&second, direction) + gap;
    let aside = 0.2 * random.in_cube().reject_from_normalized(direction);
    first.pose.translation = 0.1 * random.in_cube();
    second.pose.translation = first.pose.translation + way * direction + aside;
    [first, second]
}

/// Contacts per face and per cell keep their points, which need not be the nearest places of two
/// features. Where bodies touch there and have a direction in both cones, the normal is such a one.
/// Points that are farther than `on_side` from a side, but not farther than [`ON_SIDE`], may count
/// as either.
pub fn normals_are_in_the_cones_where_these_meet(
    detect: &dyn Fn(&Scene, &CollideOptions) -> Vec<Contact>,
    gaps: &[f64],
    on_side: f64,
) {
    let mut random = Random(0xced);
    let worlds: Vec<[Block; 2]> = (0..200).map(|k| touching(&mut random, gaps[k % gaps.len()])).collect();
    let mut scene = Scene::new();
    for (world, block) in (0..).zip(&worlds).flat_map(|(world, both)| both.map(|block| (world, block))) {
        let shape = scene.add_shape(block.shape()).expect("a good shape");
        scene.add(Instance { world, ..Instance::new(shape, block.pose) }).expect("a good pose");
    }
    let (mut seen, mut none) = (0, 0);
    for contacts_per in [ContactsPer::Face, ContactsPer::Cell] {
        let options = CollideOptions {
            contact_distance: 2e-3,
            ..CollideOptions::with_mode(Mode::exact().per(contacts_per))
        };
        let found = detect(&scene, &options).into_iter();
        for c in found.filter(|c| c.converged && c.distance.abs() <= 1e-6) {
            let [a, b] = [c.instance_a, c.instance_b].map(|id| worlds[id.0 as usize / 2][id.0 as usize % 2]);
            let near = ON_SIDE + 2.0 * c.distance.abs();
            let is_known = |block: &Block, p: DVec3| block.sides_at(p, on_side) == block.sides_at(p, near);
            if !(is_known(&a, c.point_a) && is_known(&b, c.point_b)) {
                continue;
            }
            let out = |n: DVec3| {
                let of_a = a.out_of_cone(c.point_a, -n, near);
                // A face of b is a wall for all points of a.
                let of_a = if b.sides_at(c.point_b, near) == 1 { 0.0 } else { of_a };
                of_a.max(b.out_of_cone(c.point_b, n, near))
            };
            // The normals of faces and the common normals of edges.
            let (of_a, of_b) = (a.axes(), b.axes());
            let across = of_a.iter().flat_map(|p| of_b.map(|q| p.cross(q).normalize_or(*p)));
            let directions = of_a.into_iter().chain(of_b).chain(across).flat_map(|n| [n, -n]);
            // Up to the tolerance of faces that are parallel.
            let is_allowed = directions.map(out).any(|out| out < 1e-4);
            seen += usize::from(is_allowed);
            none += usize::from(!is_allowed);
            let own = out(c.normal);
            assert!(
                !is_allowed || own <= 1.01 * SLOPE,
                "{own} out of a cone, {contacts_per:?}: {a:?} {b:?} {c:?}"
            );
        }
    }
    assert!(seen > 1000, "{seen} contacts, and {none} without a common direction");
}

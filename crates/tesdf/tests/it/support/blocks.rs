//! Boxes, as meshes and as shapes, and the normals of contacts of a box on its edge or corner.
use std::sync::Arc;

use tesdf::collide::{
    CollideOptions, Contact, Contacts, ContactsPer, Instance, InstanceId, Mode, Pose, Scene, Shape,
};
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

/// Contacts up to this distance.
const CONTACT_DISTANCE: f64 = 2e-3;

/// Contacts of a floor's face with an edge or a corner of a box have the normal of the floor, in each
/// mode of faces and for each kind of contacts: those right over each other. All others, but the
/// minima, are along the way between their points, as far as these are known (`docs/math.md`, section
/// 18): a point belongs to a feature up to `near`, and distances have an error of `tolerance`.
pub fn edges_are_pushed_along_the_normal_of_the_floor(
    detect: &dyn Fn(&Scene, &CollideOptions) -> Contacts,
    [near, tolerance]: [f64; 2],
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
    for mode in [Mode::Exact, Mode::Face] {
        for contacts_per in [ContactsPer::Cell, ContactsPer::Face, ContactsPer::Minimum] {
            let options = CollideOptions {
                contacts_per,
                contact_distance: CONTACT_DISTANCE,
                ..CollideOptions::with_mode(mode)
            };
            let found = detect(&scene, &options);
            let mut with_edge = vec![0; worlds.len()];
            for c in &found {
                let world = c.instance_a.0 as usize / 2;
                // Well within the limit.
                if is_of_edge(&worlds[world], c, 0.4 * near) {
                    let up = if is_floor(c.instance_a) { -c.normal } else { c.normal };
                    assert!(up.distance(DVec3::Z) < 1e-9, "{mode:?} per {contacts_per:?}: {c:?}");
                    with_edge[world] += usize::from(is_floor(c.instance_a));
                } else if contacts_per != ContactsPer::Minimum {
                    let way = c.point_a - c.point_b;
                    let off = way.distance(c.distance * c.normal);
                    let known = 1.1 * near + (8.0 * tolerance * c.distance.abs()).sqrt();
                    assert!(off <= known, "{off} beside the way, {mode:?} per {contacts_per:?}: {c:?}");
                }
            }
            // In the others, points are known less well than this. Frank–Wolfe seldom comes so near
            // to the lowest point, and over a cell never.
            let least = match (mode, contacts_per) {
                (Mode::Node | Mode::Exact, _) => worlds.len() / 2,
                (Mode::Face, ContactsPer::Face | ContactsPer::Minimum) => worlds.len() / 8,
                (Mode::Face, ContactsPer::Cell) => 0,
            };
            let seen = with_edge.iter().filter(|&&count| count > 0).count();
            println!("{mode:?} per {contacts_per:?}: {seen} of {} worlds, {with_edge:?}", worlds.len());
            assert!(seen >= least, "{mode:?} per {contacts_per:?}: {with_edge:?}");
        }
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

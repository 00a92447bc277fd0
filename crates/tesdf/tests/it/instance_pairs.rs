//! Compares the pairs of instances that are kept from step to step with those of each step alone, and
//! with brute force over all pairs.

use crate::support::random::Random;
use tesdf::collide::internal::Ahead;
use tesdf::collide::{
    CollideError, CollideOptions, Groups, Instance, InstanceId, InstancePair, InstancePairs, Pose, Scene,
    Shape, Velocity, detect, detect_pairs, detect_with, instance_pairs,
};
use tesdf::glam::{DQuat, DVec3};

/// All pairs of instances whose bounds are within their contact distance, sorted by world and ids.
fn all_pairs(scene: &Scene, options: &CollideOptions) -> Vec<InstancePair> {
    let all: Vec<(InstanceId, &Instance)> = scene.instances().collect();
    let shape = |i: &Instance| scene.shape(i.shape).expect("a shape");
    let ahead = |i: &Instance| Ahead::new(i, shape(i), options.speculative_time);
    let bounds = |id: InstanceId| {
        let bounds = scene.bounds(id).expect("bounds");
        let rounding = 8.0 * f64::EPSILON * bounds.min.abs().max(bounds.max.abs()).max_element();
        bounds.grown(rounding)
    };
    let is_plane = |i: &Instance| matches!(shape(i), Shape::Plane);
    let mut pairs = Vec::new();
    for (k, &(a, x)) in all.iter().enumerate() {
        for &(b, y) in &all[k + 1..] {
            let two_planes = is_plane(x) && is_plane(y);
            let contact_distance = options.contact_distance + ahead(x).closing(&ahead(y));
            let are_near = bounds(a).grown(contact_distance).overlaps(bounds(b));
            if !two_planes && scene.may_meet((a, x), (b, y)) && are_near {
                pairs.push((x.world, InstancePair { first: a, second: b, contact_distance }));
            }
        }
    }
    pairs.sort_by_key(|(world, p)| (*world, p.first, p.second));
    pairs.into_iter().map(|(_, pair)| pair).collect()
}

/// A scene that changes at random, with the instances that have changed.
struct Changing {
    scene: Scene,
    shapes: Vec<tesdf::collide::ShapeId>,
    random: Random,
    moved: Vec<InstanceId>,
}

/// Half of the side of the cube in which the instances are.
const SPACE: f64 = 3.0;

impl Changing {
    fn new(seed: u64) -> Self {
        let mut scene = Scene::new();
        let shapes = [
            Shape::Sphere { radius: 0.4 },
            Shape::Box { half_extents: DVec3::new(0.2, 0.5, 0.3) },
            Shape::Capsule { half_height: 0.5, radius: 0.1 },
            Shape::Plane,
        ];
        let shapes = shapes.map(|shape| scene.add_shape(shape).expect("a shape")).to_vec();
        let mut this = Self { scene, shapes, random: Random(seed), moved: Vec::new() };
        this.add(60);
        this
    }

    fn add(&mut self, count: usize) {
        for _ in 0..count {
            let instance = self.instance();
            self.scene.add(instance).expect("an instance");
        }
    }

    fn instance(&mut self) -> Instance {
        let random = &mut self.random;
        // One in sixteen is a plane.
        let shape = self.shapes[if random.index(16) == 0 { 3 } else { random.index(3) }];
        let rotation = DQuat::from_axis_angle(random.direction(), random.between(0.0, 6.0));
        let pose = Pose::new(SPACE * random.in_cube(), rotation).expect("a pose");
        let velocity = Velocity { linear: random.in_cube(), angular: random.in_cube() };
        let group = |random: &mut Random| 1 << random.index(3) | 1 << random.index(3);
        let groups = Groups { memberships: group(random), filter: group(random) };
        let (scale, world) = (random.between(0.5, 1.5), random.index(2) as u32);
        Instance { velocity, scale, world, groups, ..Instance::new(shape, pose) }
    }

    fn any(&mut self) -> InstanceId {
        let at = self.random.index(self.scene.instances().len());
        self.scene.instances().nth(at).expect("an instance").0
    }

    fn update(&mut self, id: InstanceId, change: impl FnOnce(&mut Self, Instance) -> Instance) {
        let instance = change(self, *self.scene.instance(id).expect("an instance"));
        self.scene.update(&[(id, instance)]).expect("a state");
        self.moved.push(id);
    }

    /// Small motions of some instances.
    fn drift(&mut self) {
        for _ in 0..20 {
            let id = self.any();
            self.update(id, |this, i| {
                let translation = i.pose.translation + 0.03 * this.random.in_cube();
                Instance { pose: Pose { translation, ..i.pose }, ..i }
            });
        }
    }

    /// A change that is rare.
    fn change(&mut self) {
        let id = self.any();
        match self.random.index(9) {
            0 => self.update(id, |this, i| Instance { pose: this.instance().pose, ..i }),
            1 => self.update(id, |this, i| Instance { groups: this.instance().groups, ..i }),
            2 => self.update(id, |this, i| Instance { velocity: this.instance().velocity, ..i }),
            3 => self.update(id, |this, i| Instance { scale: this.random.between(0.1, 4.0), ..i }),
            4 => self.update(id, |this, _| this.instance()),
            5 => self.add(2),
            6 => self.scene.remove(&[id]).expect("it is there"),
            7 => {
                let still: Vec<_> = (0..30).map(|_| self.any()).collect();
                self.scene.set_still(still);
            }
            _ => {
                let other = self.any();
                match self.scene.is_excluded(id, other) {
                    true => self.scene.include(id, other),
                    false => self.scene.exclude(id, other).expect("both are there"),
                }
            }
        }
    }
}

#[test]
fn kept_pairs_are_those_of_each_step() {
    for seed in 0..12 {
        let mut changing = Changing::new(seed);
        let mut options = CollideOptions { contact_distance: 0.01, ..CollideOptions::default() };
        let (mut kept, mut of_moved) = (InstancePairs::new(), InstancePairs::new());
        let mut found = 0;
        for step in 0..60 {
            if step % 20 == 19 {
                options.contact_distance = changing.random.between(0.0, 0.3);
                options.speculative_time = changing.random.between(0.0, 0.1);
            }
            changing.moved.clear();
            changing.drift();
            if step % 3 == 0 {
                changing.change();
            }
            let scene = &changing.scene;
            let expected = instance_pairs(scene, options.contact_distance, options.speculative_time);
            let expected = expected.expect("pairs");
            assert_eq!(all_pairs(scene, &options), expected, "seed {seed}, step {step}");
            kept.update(scene, &options).expect("pairs");
            assert_eq!(kept.pairs(), expected, "seed {seed}, step {step}");
            of_moved.update_moved(scene, &options, &changing.moved).expect("pairs");
            assert_eq!(of_moved.pairs(), expected, "seed {seed}, step {step}: only those that moved");
            found += expected.len();
        }
        assert!(found > 1000, "{found} pairs");
    }
}

#[test]
fn kept_pairs_have_the_same_contacts() {
    let mut changing = Changing::new(99);
    let options = CollideOptions { contact_distance: 0.05, ..CollideOptions::default() };
    let mut pairs = InstancePairs::new();
    for step in 0..10 {
        changing.drift();
        changing.change();
        let scene = &changing.scene;
        let expected = format!("{:?}", detect(scene, &options).expect("contacts"));
        let found = detect_with(&mut pairs, scene, &options).expect("contacts");
        assert!(!found.is_empty() && format!("{found:?}") == expected, "step {step}");
        let found = detect_pairs(pairs.pairs(), scene, &options).expect("contacts");
        assert_eq!(format!("{found:?}"), expected, "step {step}");
    }
}

#[test]
fn removed_instances_and_an_empty_scene_are_noticed() {
    let mut scene = Scene::new();
    let ball = scene.add_shape(Shape::Sphere { radius: 1.0 }).expect("a shape");
    let at = |x: f64| Instance::new(ball, Pose::at(x * DVec3::X));
    let ids = scene.add_many(&[at(0.0), at(1.0), at(9.0)]).expect("instances");
    let (options, mut pairs) = (CollideOptions::default(), InstancePairs::new());
    pairs.update(&scene, &options).expect("pairs");
    assert_eq!(pairs.pairs().len(), 1);
    scene.remove(&[ids.start]).expect("it is there");
    pairs.update_moved(&scene, &options, &[]).expect("pairs");
    assert!(pairs.pairs().is_empty());
    let gone = pairs.update_moved(&scene, &options, &[ids.start]).expect_err("it is gone");
    assert_eq!(gone, CollideError::NoInstance(ids.start));
    scene.add(at(1.5)).expect("an instance");
    pairs.update(&scene, &options).expect("pairs");
    assert_eq!(pairs.pairs().len(), 1);
    scene.remove(&scene.instances().map(|(id, _)| id).collect::<Vec<_>>()).expect("they are there");
    pairs.update(&scene, &options).expect("pairs");
    assert!(pairs.pairs().is_empty());
}

#[test]
fn too_many_pairs_are_refused_and_forgotten() {
    let mut scene = Scene::new();
    let ball = scene.add_shape(Shape::Sphere { radius: 1.0 }).expect("a shape");
    // 2897 · 2896 / 2 pairs are slightly more than 2²².
    let ids = scene.add_many(&[Instance::new(ball, Pose::IDENTITY); 2897]).expect("instances");
    let (options, mut pairs) = (CollideOptions::default(), InstancePairs::new());
    let error = pairs.update(&scene, &options).expect_err("too many");
    assert!(matches!(error, CollideError::TooManyPairs { .. }), "{error}");
    scene.remove(&[ids.start]).expect("it is there");
    pairs.update(&scene, &options).expect("pairs");
    assert_eq!(pairs.pairs().len(), 2896 * 2895 / 2);
}

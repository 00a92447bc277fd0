//! The pairs of instances that can touch, kept from step to step.
use std::collections::BTreeMap;

use crate::collide::options::CollideOptions;
use crate::collide::pairs::{Entry, InstancePair, MAX_PAIRS};
use crate::collide::scene::error::CollideError;
use crate::collide::scene::ids::{InstanceId, ShapeId};
use crate::collide::scene::{Instance, Scene};
use crate::geometry::{Aabb, AabbTree};

/// The pairs of instances that can touch, for a scene whose instances move a little from step to
/// step.
///
/// They are the same as those of [`instance_pairs`](crate::collide::instance_pairs()), in the same order.
/// Each instance has a wider box, which it may move in. Pairs of wider boxes that overlap are kept,
/// and only they are tested. A tree finds the pairs of an instance that has left its wider box. So
/// the time of a step is proportional to the number of instances, and instances at rest cost next
/// to nothing. When instances are added or removed, or change their world, all is made anew.
///
/// ```
/// use tesdf::collide::{CollideOptions, Instance, InstancePairs, Pose, Scene, Shape, detect, detect_with};
/// use tesdf::glam::DVec3;
///
/// let mut scene = Scene::new();
/// let ball = scene.add_shape(Shape::Sphere { radius: 1.0 })?;
/// let still = scene.add(Instance::new(ball, Pose::IDENTITY))?;
/// let falling = scene.add(Instance::new(ball, Pose::at(DVec3::new(0.0, 0.0, 2.5))))?;
/// let (options, mut pairs) = (CollideOptions::default(), InstancePairs::new());
/// for step in 0..10 {
///     scene.set_poses(&[(falling, Pose::at(DVec3::new(0.0, 0.0, 2.5 - 0.1 * f64::from(step))))])?;
///     let contacts = detect_with(&mut pairs, &scene, &options)?;
///     assert_eq!(contacts.len(), detect(&scene, &options)?.len());
/// }
/// assert_eq!((pairs.pairs()[0].first, pairs.pairs()[0].second), (still, falling));
/// # Ok::<(), tesdf::collide::CollideError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct InstancePairs {
    /// In the order of the scene.
    bodies: Vec<Body>,
    worlds: BTreeMap<u32, World>,
    /// Pairs of wider boxes that overlap, sorted by world and bodies.
    candidates: Vec<Candidate>,
    pairs: Vec<InstancePair>,
    /// The numbers that all boxes depend on.
    measures: Measures,
    excluded: Vec<(InstanceId, InstanceId)>,
    still: Vec<InstanceId>,
}

/// Contact distance, speculative time, and the bounds of all shapes.
#[derive(Clone, Debug, Default, PartialEq)]
struct Measures {
    contact_distance: f64,
    speculative_time: f64,
    shapes: Vec<(ShapeId, Aabb)>,
}

#[derive(Clone, Debug)]
struct Body {
    entry: Entry,
    state: Instance,
    /// The box that it may move in.
    wide: Aabb,
    /// Whether its state has changed since the last update.
    has_changed: bool,
    /// Whether its candidates are searched anew.
    has_left: bool,
}

/// The bodies of one world, by their indices.
#[derive(Clone, Debug)]
struct World {
    planes: Vec<u32>,
    others: Vec<u32>,
    /// A tree of the wider boxes of `others`.
    tree: AabbTree,
    /// The sum of the areas of its boxes when it was built.
    area: f64,
}

#[derive(Clone, Copy, Debug)]
struct Candidate {
    world: u32,
    first: u32,
    second: u32,
    /// The pair, if they are one.
    pair: Option<InstancePair>,
}

/// A wider box extends by this share of the longest edge of the body's box to each side.
const MARGIN: f64 = 0.05;
/// Boxes in a leaf of the tree.
const LEAF: usize = 4;
/// The tree is built anew when the areas of its boxes have grown by this factor.
const WORN: f64 = 2.0;

impl InstancePairs {
    /// No pairs; the first update finds them.
    pub fn new() -> Self {
        Self::default()
    }

    /// The pairs at the last update, sorted by world and ids.
    pub fn pairs(&self) -> &[InstancePair] {
        &self.pairs
    }

    /// Finds the pairs of a scene. Only instances whose state has changed since the last update are
    /// looked at; any scene and any options are accepted.
    ///
    /// # Errors
    /// As [`instance_pairs`](crate::collide::instance_pairs()). The next update then begins anew.
    pub fn update(&mut self, scene: &Scene, options: &CollideOptions) -> Result<(), CollideError> {
        self.updated(scene, options, None)
    }

    /// As [`update`](Self::update), for a scene in which only the instances `moved` have changed
    /// since the last update. Other instances are not compared with their last states.
    ///
    /// # Errors
    /// As [`update`](Self::update), and [`CollideError::NoInstance`].
    pub fn update_moved(
        &mut self,
        scene: &Scene,
        options: &CollideOptions,
        moved: &[InstanceId],
    ) -> Result<(), CollideError> {
        self.updated(scene, options, Some(moved))
    }

    fn updated(
        &mut self,
        scene: &Scene,
        options: &CollideOptions,
        moved: Option<&[InstanceId]>,
    ) -> Result<(), CollideError> {
        let result = self.try_update(scene, options, moved);
        if result.is_err() {
            *self = Self::default();
        }
        result
    }

    fn try_update(
        &mut self,
        scene: &Scene,
        options: &CollideOptions,
        moved: Option<&[InstanceId]>,
    ) -> Result<(), CollideError> {
        let measures = Measures::new(scene, options);
        let is_same = measures == self.measures;
        self.measures = measures;
        let fits = match moved {
            Some(moved) if is_same && self.bodies.len() == scene.instances().len() => {
                self.look_at(scene, moved)?
            }
            _ => self.look_at_all(scene, is_same)?,
        };
        if !fits {
            self.begin(scene)?;
        }
        let excluded: Vec<_> = scene.excluded().collect();
        if excluded != self.excluded {
            self.excluded = excluded;
            self.bodies.iter_mut().for_each(|body| body.has_changed = true);
        }
        if scene.still() != self.still {
            self.still = scene.still().to_vec();
            self.bodies.iter_mut().for_each(|body| body.has_changed = true);
        }
        if self.bodies.iter().any(|body| body.has_left) {
            self.search()?;
        }
        if self.bodies.iter().any(|body| body.has_changed) {
            self.test(scene)?;
        }
        Ok(())
    }

    /// Looks at the listed bodies. Returns whether they fit into the worlds as these are.
    fn look_at(&mut self, scene: &Scene, moved: &[InstanceId]) -> Result<bool, CollideError> {
        for &id in moved {
            let instance = scene.instance(id)?;
            let Ok(at) = self.bodies.binary_search_by_key(&id, |body| body.entry.id) else {
                return Ok(false);
            };
            let body = &mut self.bodies[at];
            if body.state != *instance && !body.change(scene, &self.measures, instance)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Looks at all bodies. `is_same` says that boxes only depend on the states.
    fn look_at_all(&mut self, scene: &Scene, is_same: bool) -> Result<bool, CollideError> {
        if self.bodies.len() != scene.instances().len() {
            return Ok(false);
        }
        for (body, (id, instance)) in self.bodies.iter_mut().zip(scene.instances()) {
            let has_changed = !is_same || body.state != *instance;
            if body.entry.id != id || (has_changed && !body.change(scene, &self.measures, instance)?) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Makes all bodies and worlds anew.
    fn begin(&mut self, scene: &Scene) -> Result<(), CollideError> {
        let body = |(id, instance): (InstanceId, &Instance)| {
            let Measures { contact_distance, speculative_time, .. } = self.measures;
            let entry = Entry::new(scene, id, instance, contact_distance, speculative_time)?;
            let (state, wide) = (*instance, entry.wider(MARGIN));
            Ok(Body { entry, state, wide, has_changed: true, has_left: true })
        };
        self.bodies = scene.instances().map(body).collect::<Result<_, CollideError>>()?;
        self.candidates.clear();
        self.pairs.clear();
        let mut worlds: BTreeMap<u32, [Vec<u32>; 2]> = BTreeMap::new();
        for (index, body) in self.bodies.iter().enumerate() {
            let [planes, others] = worlds.entry(body.state.world).or_default();
            if body.entry.is_plane { planes } else { others }.push(index as u32);
        }
        let world =
            |(id, [planes, others]): (u32, [Vec<u32>; 2])| (id, World::new(planes, others, &self.bodies));
        self.worlds = worlds.into_iter().map(world).collect();
        Ok(())
    }

    /// Finds the candidates of the bodies that have left their wider boxes.
    fn search(&mut self) -> Result<(), CollideError> {
        let bodies = &self.bodies;
        let mut found: Vec<Candidate> = Vec::new();
        let mut near = 0;
        for world in self.worlds.values_mut() {
            let left = |indices: &[u32]| -> Vec<u32> {
                indices.iter().copied().filter(|&i| bodies[i as usize].has_left).collect()
            };
            let (planes, others) = (left(&world.planes), left(&world.others));
            if !others.is_empty() {
                world.refit(bodies);
            }
            let mut offer = |i: u32, j: u32| {
                let (a, b) = (&bodies[i as usize], &bodies[j as usize]);
                // Of two bodies that have both left, the first finds the pair.
                let is_other = i != j && (i < j || !b.has_left);
                if is_other && a.wide.overlaps(b.wide) && a.state.groups.meet(b.state.groups) {
                    let pair = Entry::pair(&a.entry, &b.entry, self.measures.contact_distance);
                    near += usize::from(pair.is_some());
                    let (world, first, second) = (a.state.world, i.min(j), i.max(j));
                    found.push(Candidate { world, first, second, pair: None });
                }
                near <= 2 * MAX_PAIRS
            };
            let too_many = CollideError::TooManyPairs { limit: MAX_PAIRS };
            for &i in &planes {
                if !world.others.iter().all(|&j| offer(i, j)) {
                    return Err(too_many);
                }
            }
            for &i in &others {
                let wide = bodies[i as usize].wide;
                let mut fits = world.planes.iter().all(|&j| offer(i, j));
                let near = |items: &[u32]| {
                    fits &= items.iter().all(|&item| offer(i, world.others[item as usize]));
                };
                world.tree.visit(|node| node.overlaps(wide), near);
                if !fits {
                    return Err(too_many);
                }
            }
        }
        let has_left = |i: u32| bodies[i as usize].has_left;
        self.candidates.retain(|c| !has_left(c.first) && !has_left(c.second));
        self.candidates.append(&mut found);
        // The old candidates are one sorted run, which the sort finds.
        self.candidates.sort_by_key(|c| (c.world, c.first, c.second));
        self.bodies.iter_mut().for_each(|body| body.has_left = false);
        Ok(())
    }

    /// Tests the candidates of the bodies that have changed, and lists the pairs.
    fn test(&mut self, scene: &Scene) -> Result<(), CollideError> {
        let Self { bodies, candidates, pairs, measures, .. } = self;
        pairs.clear();
        for candidate in candidates {
            let [a, b] = [candidate.first, candidate.second].map(|i| &bodies[i as usize]);
            if a.has_changed || b.has_changed {
                candidate.pair = Entry::pair(&a.entry, &b.entry, measures.contact_distance)
                    .filter(|pair| !scene.is_excluded(pair.first, pair.second))
                    .filter(|pair| !scene.are_still(pair.first, pair.second));
            }
            if let Some(pair) = candidate.pair {
                pairs.push(pair);
                if pairs.len() > MAX_PAIRS {
                    return Err(CollideError::TooManyPairs { limit: MAX_PAIRS });
                }
            }
        }
        bodies.iter_mut().for_each(|body| body.has_changed = false);
        Ok(())
    }
}

impl Measures {
    fn new(scene: &Scene, options: &CollideOptions) -> Self {
        let CollideOptions { contact_distance, speculative_time, .. } = *options;
        let shapes = scene.shapes().map(|(id, shape)| (id, shape.bounds())).collect();
        Self { contact_distance, speculative_time, shapes }
    }
}

impl Body {
    /// Takes over another state. Returns whether it stays in its world, and a plane or no plane.
    fn change(
        &mut self,
        scene: &Scene,
        measures: &Measures,
        instance: &Instance,
    ) -> Result<bool, CollideError> {
        let Measures { contact_distance, speculative_time, .. } = *measures;
        let entry = Entry::new(scene, self.entry.id, instance, contact_distance, speculative_time)?;
        let fits = self.state.world == instance.world && self.entry.is_plane == entry.is_plane;
        // A body that becomes smaller gets a smaller box.
        let wider = entry.wider(MARGIN);
        let is_within = self.wide.contains(entry.bounds.min)
            && self.wide.contains(entry.bounds.max)
            && (entry.is_plane || self.wide.extent().max_element() <= 2.0 * wider.extent().max_element());
        if !is_within || self.state.groups != instance.groups {
            self.wide = wider;
            self.has_left = true;
        }
        (self.entry, self.state, self.has_changed) = (entry, *instance, true);
        Ok(fits)
    }
}

impl World {
    fn new(planes: Vec<u32>, others: Vec<u32>, bodies: &[Body]) -> Self {
        let boxes: Vec<Aabb> = others.iter().map(|&i| bodies[i as usize].wide).collect();
        let tree = AabbTree::build(&boxes, LEAF);
        let area = area(&tree);
        Self { planes, others, tree, area }
    }

    /// Fits the tree to the wider boxes, or builds it anew where it has become too loose.
    fn refit(&mut self, bodies: &[Body]) {
        let others = &self.others;
        let box_of = |item: u32| bodies[others[item as usize] as usize].wide;
        for slot in (0..2 * self.tree.nodes().len() as u32).rev() {
            self.tree.refit(slot, box_of);
        }
        self.tree.refit_root(box_of);
        if area(&self.tree) > WORN * self.area {
            *self = Self::new(std::mem::take(&mut self.planes), std::mem::take(&mut self.others), bodies);
        }
    }
}

/// The sum of the areas of all boxes.
fn area(tree: &AabbTree) -> f64 {
    let of_box = |(bounds, _): &(Aabb, _)| {
        let e = bounds.extent();
        e.x * e.y + e.y * e.z + e.z * e.x
    };
    tree.nodes().as_flattened().iter().map(of_box).sum()
}

//! Compares contacts of the device with those of the host.
use std::collections::{BTreeMap, BTreeSet};

use tesdf::collide::{
    CollideOptions, Contact, Contacts, ContactsPer, InstanceId, Mode, Scene, Shape, detect, why,
};
use tesdf::geometry::Triangle;
use tesdf::glam::{DVec2, DVec3};
use tesdf_gpu::{Detector, DetectorOptions, Device};

/// Largest error of `f32`, relative to the larger body: rounding of poses, faces and distances.
pub const ROUNDING: f64 = 2e-6;
/// Frank–Wolfe may step to another vertex when two are equally deep. A face counts as different
/// when its minima differ by more than this, relative to the larger body.
pub const ANOTHER_WAY: f64 = 1e-5;
/// Largest share of faces that may have another depth, or be on the other side of a threshold.
pub const MOST_OTHERS: f64 = 0.01;
/// Largest share of cells in which only the host or only the device finds a part: slivers at
/// borders, and faces that lie in borders.
pub const MOST_CELLS: f64 = 0.02;

/// Largest share of contacts with a normal that is not the gradient.
const MOST_TURNED: f64 = 0.05;

/// The device that `TESDF_DEVICE` names, or the best device.
pub fn device() -> Device {
    Device::choose(None).expect("a device: `./test` makes the replacement of CUDA's driver")
}

/// The contacts of a scene, and the detector that found them.
pub fn found(scene: &Scene, options: &CollideOptions, with: DetectorOptions) -> (Contacts, Detector) {
    let mut detector = Detector::new(&device(), scene, with).expect("fits");
    let contacts = detector.detect(scene, options).expect("detects");
    (contacts, detector)
}

/// Signed distance of a shape, in its frame.
pub fn exact(shape: &Shape, p: DVec3) -> f64 {
    match shape {
        Shape::Mesh(asset) => asset.query_by_tree(p).signed_distance,
        Shape::Plane => p.z,
        Shape::Sphere { radius } => p.length() - radius,
        Shape::Capsule { half_height, radius } => {
            (p - DVec3::Z * p.z.clamp(-half_height, *half_height)).length() - radius
        }
        Shape::Cylinder { half_height, radius } => {
            let q = DVec2::new(p.truncate().length() - radius, p.z.abs() - half_height);
            q.max(DVec2::ZERO).length() + q.max_element().min(0.0)
        }
        Shape::Box { half_extents } => {
            let q = p.abs() - *half_extents;
            q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
        }
    }
}

/// Signed distance of an instance at a point of the world.
pub fn field(scene: &Scene, id: InstanceId, p: DVec3) -> f64 {
    let instance = scene.instance(id).expect("it is there");
    let shape = scene.shape(instance.shape).expect("it is there");
    instance.scale * exact(shape, instance.placement().to_shape(p))
}

/// Checks a contact against the exact field. Its normal is the gradient, or of a face one that the
/// normal cones of both bodies allow, as far as the place is known (`docs/math.md`, section 18).
pub fn is_true(scene: &Scene, mode: Mode, c: &Contact, size: f64) {
    let (a, b) = (c.instance_a, c.instance_b);
    let instance = scene.instance(a).expect("it is there");
    let shape = scene.shape(instance.shape).expect("it is there");
    // For round shapes, the detection measures the core, and its nearest point may be anywhere
    // inside.
    if matches!(shape, Shape::Sphere { .. } | Shape::Capsule { .. }) {
        return;
    }
    if let Shape::Mesh(asset) = shape {
        let place = (0..asset.face_count()).find(|&k| asset.face_id(k) == c.face_a).expect("a face");
        let triangle = Triangle::new(asset.face_corners(place).map(|p| instance.placement().to_world(p)));
        // The surface of a sheet is half of the thickness away from its faces.
        let around = instance.scale * asset.inside().rule.half_thickness();
        let off = triangle.closest(c.point_a).distance;
        assert!(off < around + ROUNDING * size, "point {} is {off} off its face {}", c.point_a, c.face_a);
    }
    // In the thickness of a sheet, what is half of it off a face may be nearer to another face.
    let is_sheet = |id: InstanceId| {
        let shape = scene.shape(scene.instance(id).expect("it is there").shape).expect("it is there");
        matches!(shape, Shape::Mesh(asset) if asset.inside().rule.half_thickness() > 0.0)
    };
    if c.distance >= 0.0 || ![a, b].into_iter().any(is_sheet) {
        let distance = field(scene, b, c.point_a);
        assert!((distance - c.distance).abs() < 2.0 * ROUNDING * size, "{c:?}: the field says {distance}");
        let surface = field(scene, b, c.point_b);
        assert!(surface.abs() < 2.0 * ROUNDING * size, "{c:?}: point b is {surface} off the surface");
    }
    assert!((c.normal.length() - 1.0).abs() < 1e-5);
    let diagonal = |id: InstanceId| {
        let instance = scene.instance(id).expect("it is there");
        instance.scale * scene.shape(instance.shape).expect("it is there").diagonal()
    };
    let larger = [a, b].map(diagonal).into_iter().filter(|d| d.is_finite()).fold(0.0, f64::max);
    let place = if mode == Mode::Node { 0.0 } else { (8.0 * ROUNDING * larger * c.distance.abs()).sqrt() };
    assert!(beside_the_way(c) < 3.0 * ROUNDING * size + place, "{c:?}: normal");
}

/// How far a step along the normal, as long as the distance, ends beside the point of *a*.
fn beside_the_way(c: &Contact) -> f64 {
    (c.point_b + c.distance * c.normal).distance(c.point_a)
}

/// Checks that few normals are not the gradients within rounding.
fn few_are_turned(contacts: &Contacts, size: f64) {
    let turned = contacts.iter().filter(|c| beside_the_way(c) >= 3.0 * ROUNDING * size).count();
    println!("{turned} of {} normals are no gradients", contacts.len());
    assert!(
        turned as f64 <= 2.0 + MOST_TURNED * contacts.len() as f64,
        "{turned} of {} normals are no gradients",
        contacts.len()
    );
}

/// The least distance of each part of an ordered pair.
pub fn least(contacts: &[Contact]) -> BTreeMap<(InstanceId, InstanceId, u32), f64> {
    let mut least = BTreeMap::new();
    for c in contacts {
        let known: &mut f64 = least.entry((c.instance_a, c.instance_b, c.feature.a)).or_insert(f64::INFINITY);
        *known = known.min(c.distance);
    }
    least
}

/// The contact distance of a part of an ordered pair, which velocities add to.
fn reach(scene: &Scene, options: &CollideOptions, &(a, b, part): &(InstanceId, InstanceId, u32)) -> f64 {
    let report = why(scene, options, a, b, Some(part)).expect("a report");
    report.parts.iter().map(|part| part.contact_distance).fold(0.0, f64::max)
}

/// Whether a part of contacts per cell may be missing on one side although it is not at the contact
/// distance: the filter depends on a normal, and Frank–Wolfe may step another way. Such parts count
/// as others.
fn may_be_lost(options: &CollideOptions) -> bool {
    has_filter(options) || matches!(options.mode, Mode::Face { .. })
}

fn has_filter(options: &CollideOptions) -> bool {
    options.mode.faces().is_some_and(|faces| faces.cos_theta.is_some())
}

/// The number of touching parts, and of those with different results on device and host.
#[derive(Clone, Copy, Debug, Default)]
pub struct Compared {
    pub touching: usize,
    pub others: usize,
    /// Contacts by part and cell.
    pub cells: usize,
    /// Contacts by part and cell that only one side finds.
    pub differing: usize,
}

impl Compared {
    pub fn add(&mut self, more: Self) {
        self.touching += more.touching;
        self.others += more.others;
        self.cells += more.cells;
        self.differing += more.differing;
    }

    /// Checks that at least `least` parts were compared, and that few differ.
    pub fn is_good(self, least: usize) {
        println!("{self:?}");
        assert!(self.touching >= least, "{self:?}; expected {least} that touch at least");
        let most = 2 + (MOST_OTHERS * self.touching as f64) as usize;
        assert!(self.others <= most, "{self:?}; expected {most} others at most");
        let most = 4 + (MOST_CELLS * self.cells as f64) as usize;
        assert!(self.differing <= most, "{self:?}; expected {most} cells at most that differ");
    }
}

/// Compares all contacts of a scene.
pub fn hold(scene: &Scene, options: &CollideOptions, size: f64) -> Compared {
    let (device, _) = found(scene, options, DetectorOptions::default());
    let most = 1 + device.len() / 1000;
    device.iter().step_by(most).for_each(|c| is_true(scene, options.mode, c, size));
    few_are_turned(&device, size);
    hold_against(scene, options, size, &device)
}

/// Compares the given contacts of a device with all contacts of a scene on the host.
pub fn hold_against(scene: &Scene, options: &CollideOptions, size: f64, device: &Contacts) -> Compared {
    let host = detect(scene, options).expect("a good scene");
    if options.mode.contacts_per() == Some(ContactsPer::Face) {
        return faces_hold(scene, options, size, [&host, device]);
    }
    let (on_host, on_device) = (least(host.as_slice()), least(device.as_slice()));
    let keys: BTreeSet<_> = on_host.keys().chain(on_device.keys()).collect();
    let mut others = 0;
    for key in &keys {
        let (h, d) = (on_host.get(key), on_device.get(key));
        let deepest = h.into_iter().chain(d).fold(f64::INFINITY, |x: f64, y| x.min(*y));
        let is_close = || reach(scene, options, key) - deepest < ROUNDING * size;
        match (h, d) {
            (Some(h), Some(d)) if options.mode == Mode::Node => {
                assert!((h - d).abs() < ROUNDING * size, "node {key:?}: {d} instead of {h}");
            }
            (Some(h), Some(d)) => others += usize::from((h - d).abs() > ANOTHER_WAY * size),
            _ => {
                assert!(
                    may_be_lost(options) || is_close(),
                    "{key:?}: {h:?} on the host, {d:?} on the device"
                );
                others += 1;
            }
        }
    }
    // The cells of a part may differ by slivers at their borders.
    let cells = |c: &Contacts| {
        c.iter().map(|c| (c.instance_a, c.instance_b, c.feature.a, c.tet_b)).collect::<BTreeSet<_>>()
    };
    let (h, d) = (cells(&host), cells(device));
    let differing = h.symmetric_difference(&d).count();
    Compared { touching: keys.len(), others, cells: h.len(), differing }
}

/// Compares contacts per face. A face that shares its contact has it at a vertex, by the name of
/// another face; host and device may choose another one of equals.
fn faces_hold(scene: &Scene, options: &CollideOptions, size: f64, sides: [&Contacts; 2]) -> Compared {
    let by_face = sides.map(|side| least(side.as_slice()));
    let corners = Corners::new(scene);
    let keys: BTreeSet<_> = by_face.iter().flat_map(BTreeMap::keys).collect();
    let mut others = 0;
    for key in &keys {
        let [h, d] = [0, 1].map(|side: usize| {
            let own = by_face[side].get(key).copied();
            corners.shared(key, sides[side], size).chain(own).reduce(f64::min)
        });
        let deepest = h.into_iter().chain(d).fold(f64::INFINITY, f64::min);
        let is_close = || reach(scene, options, key) - deepest < ROUNDING * size;
        match (h, d) {
            (Some(h), Some(d)) => others += usize::from((h - d).abs() > ANOTHER_WAY * size),
            _ => {
                assert!(has_filter(options) || is_close(), "{key:?}: {h:?} on the host, {d:?} on the device");
                others += 1;
            }
        }
    }
    Compared { touching: keys.len(), others, cells: 0, differing: 0 }
}

/// Corners of the faces of all instances of meshes and boxes, in the world.
struct Corners(BTreeMap<(InstanceId, u32), Vec<DVec3>>);

impl Corners {
    fn new(scene: &Scene) -> Self {
        let mut all = BTreeMap::new();
        for (id, instance) in scene.instances() {
            let at = instance.placement();
            match scene.shape(instance.shape).expect("it is there") {
                Shape::Mesh(asset) => all.extend((0..asset.face_count()).map(|face| {
                    let corners = asset.face_corners(face).map(|p| at.to_world(p));
                    ((id, asset.face_id(face)), corners.to_vec())
                })),
                shape => all.extend(shape.parts().0.iter().enumerate().map(|(part, points)| {
                    ((id, part as u32), points.iter().map(|&p| at.to_world(p)).collect())
                })),
            }
        }
        Self(all)
    }

    /// Distances of contacts at the corners of a face.
    fn shared<'a>(
        &'a self,
        &(a, b, face): &(InstanceId, InstanceId, u32),
        contacts: &'a Contacts,
        size: f64,
    ) -> impl Iterator<Item = f64> + 'a {
        let corners = self.0.get(&(a, face)).map_or(&[][..], Vec::as_slice);
        contacts
            .iter()
            .filter(move |c| (c.instance_a, c.instance_b) == (a, b))
            .filter(move |c| corners.iter().any(|p| p.distance(c.point_a) < ROUNDING * size))
            .map(|c| c.distance)
    }
}

/// Options with a contact for each cell that a face meets.
pub fn per_cell(mode: Mode) -> CollideOptions {
    CollideOptions::with_mode(mode.per(ContactsPer::Cell))
}

/// All modes of detection that have kernels, for bodies of diagonal `size`: with contacts per cell,
/// then per face.
pub fn each_mode(size: f64) -> [CollideOptions; 5] {
    let face = CollideOptions { contact_distance: 1e-3 * size, ..per_cell(Mode::face()) };
    let exact = CollideOptions { mode: Mode::exact().per(ContactsPer::Cell), ..face };
    [
        CollideOptions { mode: Mode::Node, ..face },
        CollideOptions { mode: face.mode.filtered(0.3), ..face },
        face,
        exact,
        CollideOptions { mode: Mode::exact(), ..exact },
    ]
}

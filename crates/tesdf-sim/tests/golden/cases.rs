//! Assets, distances, contacts and short runs, as hashes of their bytes. No case needs files, threads
//! or a clock, so the same cases run on every platform, and in a browser.
use std::sync::Arc;

use tesdf::base::elementary;
use tesdf::collide::{
    ClearanceOptions, CollideOptions, ContactPatches, Contacts, ContactsPer, Instance, Mode, Motion,
    PatchOptions, PatchTracker, Pose, Reduction, Scene, Shape, TimeOfImpactOptions, Velocity, clearance,
    detect, time_of_impact,
};
use tesdf::domain::{ConformingMesh, TetMesh};
use tesdf::encode::{Domain, Encoder, Preset};
use tesdf::glam::DVec3;
use tesdf::{SolidMesh, TeSdf};
use tesdf_parts::{Bolt, Nut, Resolution, Size, Spoon};
use tesdf_sim::newton::{Newton, NewtonOptions};
use tesdf_sim::scene_file::LoadedScene;
use tesdf_sim::{Dynamics, Mass, MassProperties, System};

/// A hash of bytes: FNV-1a of 64 bits.
#[derive(Clone, Copy)]
struct Hash(u64);

impl Hash {
    const NEW: Self = Self(0xcbf2_9ce4_8422_2325);

    fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3);
        }
    }

    fn number(&mut self, x: f64) {
        self.bytes(&x.to_bits().to_le_bytes());
    }

    fn vector(&mut self, v: DVec3) {
        v.to_array().into_iter().for_each(|x| self.number(x));
    }

    fn text(self) -> String {
        format!("{:016x}", self.0)
    }
}

/// The name of each case and the hash of its bytes.
pub fn hashes() -> Vec<(String, String)> {
    let mut found = Vec::new();
    let assets = assets(&mut found);
    distances(&assets, &mut found);
    contacts(&assets, &mut found);
    runs(&assets, &mut found);
    found
}

/// One case a line, as in the table: hash, name.
pub fn table() -> String {
    hashes().into_iter().map(|(name, hash)| format!("{hash} {name}\n")).collect()
}

type Found = Vec<(String, String)>;

struct Assets {
    bolt: Arc<TeSdf>,
    nut: Arc<TeSdf>,
    spoon: Arc<TeSdf>,
    block: Arc<TeSdf>,
}

const SIZE: &str = "M8";
const CLEARANCE: f64 = 5e-5;

fn assets(found: &mut Found) -> Assets {
    let size: Size = SIZE.parse().expect("a size");
    let bolt = Bolt { length: 8e-3, clearance: CLEARANCE, ..Bolt::iso_4014(size) };
    let bolt = Bolt { thread_length: Bolt::longest_thread(&bolt.thread, bolt.length), ..bolt };
    let bolt = bolt.mesh(Resolution::Segments(12)).expect("a bolt");
    let nut = Nut { height: 4e-3, ..Nut::iso_4032(size) }.mesh(Resolution::Segments(12)).expect("a nut");
    let spoon = Spoon::DEFAULT.mesh(Resolution::Segments(12)).expect("a spoon");
    let mut encode = |name: &str, solid: &SolidMesh, encoder: Encoder<'_>| {
        let asset = encoder.encode(solid).expect("an asset");
        let mut hash = Hash::NEW;
        hash.bytes(asset.as_bytes());
        found.push((format!("asset {name}"), hash.text()));
        Arc::new(asset)
    };
    let preset = |preset| Encoder::new().preset(preset);
    let (tetrahedra, solid) = block();
    let conforming = ConformingMesh::new(&solid, &tetrahedra).expect("a conforming mesh");
    let spoon_default = encode("spoon, default", &spoon, preset(Preset::Default));
    encode("spoon, compact", &spoon, preset(Preset::Compact));
    encode("spoon, gpu", &spoon, preset(Preset::Gpu));
    Assets {
        bolt: encode("bolt, fast", &bolt, preset(Preset::Fast)),
        nut: encode("nut, fast", &nut, preset(Preset::Fast)),
        spoon: spoon_default,
        block: encode("block, conforming", &solid, Encoder::new().domain(Domain::Conforming(&conforming))),
    }
}

/// A block of 18 cells of a grid, six tetrahedra each, and its surface. No two coordinates are round.
fn block() -> (TetMesh, SolidMesh) {
    const CELLS: [u32; 3] = [3, 3, 2];
    let index = |[i, j, k]: [u32; 3]| (i * (CELLS[1] + 1) + j) * (CELLS[2] + 1) + k;
    let mut vertices = Vec::new();
    let mut tetrahedra = Vec::new();
    for i in 0..=CELLS[0] {
        for j in 0..=CELLS[1] {
            for k in 0..=CELLS[2] {
                let [x, y, z] = [i, j, k].map(f64::from);
                vertices.push(0.01 * DVec3::new(x + 0.1 * y, y + 0.07 * z * x, z + 0.05 * x * y));
                if i == CELLS[0] || j == CELLS[1] || k == CELLS[2] {
                    continue;
                }
                // Kuhn's tetrahedra: one for each order of the axes.
                for order in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
                    let mut at = [i, j, k];
                    let mut corners = [index(at); 4];
                    for (step, axis) in order.into_iter().enumerate() {
                        at[axis] += 1;
                        corners[step + 1] = index(at);
                    }
                    tetrahedra.push(corners);
                }
            }
        }
    }
    let mesh = TetMesh::new(vertices, tetrahedra).expect("tetrahedra");
    let solid = SolidMesh::new(mesh.surface().expect("a surface")).expect("a solid");
    (mesh, solid)
}

/// Numbers from -1 to 1 without a pattern.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        2.0 * ((self.0 >> 11) as f64 / (1_u64 << 53) as f64) - 1.0
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next())
    }
}

fn distances(assets: &Assets, found: &mut Found) {
    for (name, asset) in [("bolt", &assets.bolt), ("spoon", &assets.spoon), ("block", &assets.block)] {
        let mut random = Numbers(1);
        let (bounds, mut exact, mut single) = (asset.bounds(), Hash::NEW, Hash::NEW);
        for k in 0..2000 {
            // Near the surface, in and around the box, and far out.
            let spread = [0.5, 0.5, 1.0, 20.0][k % 4];
            let mut p = bounds.center() + spread * random.vector() * bounds.extent();
            if k % 4 == 0 {
                let [a, b, c] = asset.face_corners(k / 4 % asset.face_count());
                p = a + (b - a) * random.next() + (c - a) * random.next() + 1e-5 * random.vector();
            }
            for (hash, answer) in [(&mut exact, asset.query(p)), (&mut single, asset.query_f32(p))] {
                hash.number(answer.signed_distance);
                hash.vector(answer.gradient);
                hash.vector(answer.closest_point);
                hash.bytes(&answer.face.to_le_bytes());
            }
        }
        found.push((format!("distances f64, {name}"), exact.text()));
        found.push((format!("distances f32, {name}"), single.text()));
    }
}

/// The pose of a nut whose thread is that of the bolt, turned by an angle from where both begin.
fn on_thread(turn: f64) -> Pose {
    let pitch = SIZE.parse::<Size>().expect("a size").thread().pitch;
    let translation = DVec3::new(1e-5, -5e-6, 2.0 * pitch + pitch * turn / std::f64::consts::TAU);
    Pose { translation, rotation: elementary::from_axis_angle(DVec3::Z, turn) }
}

fn contact_hash(contacts: &Contacts) -> Hash {
    let mut hash = Hash::NEW;
    for c in contacts.iter() {
        [c.point_a, c.point_b, c.normal].into_iter().for_each(|v| hash.vector(v));
        hash.number(c.distance);
        let of = format!("{} {} {:?} {:?} {}", c.face_a, c.face_b, c.tet_b, c.feature, c.converged);
        hash.bytes(of.as_bytes());
    }
    hash
}

fn contacts(assets: &Assets, found: &mut Found) {
    let shapes: Vec<(&str, Shape, Shape, Pose)> = vec![
        ("nut on bolt", assets.nut.clone().into(), assets.bolt.clone().into(), on_thread(0.7)),
        (
            "spoon in block",
            assets.spoon.clone().into(),
            assets.block.clone().into(),
            Pose {
                translation: DVec3::new(0.011, 0.018, 0.009),
                rotation: elementary::from_scaled_axis(DVec3::new(0.4, 1.1, -0.3)),
            },
        ),
        (
            "block on cylinder",
            assets.block.clone().into(),
            Shape::Cylinder { half_height: 0.02, radius: 0.01 },
            Pose {
                translation: DVec3::new(-0.01, -0.012, 0.0195),
                rotation: elementary::from_scaled_axis(DVec3::new(0.02, -0.01, 0.3)),
            },
        ),
    ];
    let face = Mode::face();
    let modes = [
        ("node", Mode::Node, Reduction::None),
        ("face", face, Reduction::None),
        ("paper", Mode::PAPER, Reduction::None),
        ("exact", Mode::exact(), Reduction::None),
        ("exact per cell", Mode::exact().per(ContactsPer::Cell), Reduction::None),
        ("exact per minimum", Mode::exact().per(ContactsPer::Minimum), Reduction::None),
        ("exact, 8 a pair", Mode::exact(), Reduction::PerPair(8)),
        ("exact, 8 spread", Mode::exact(), Reduction::Spread(8)),
    ];
    for (name, a, b, pose) in shapes {
        let mut scene = Scene::new();
        let ids = [a, b].map(|shape| scene.add_shape(shape).expect("a shape"));
        let a = scene.add(Instance::new(ids[0], pose)).expect("an instance");
        let b = scene.add(Instance::new(ids[1], Pose::IDENTITY)).expect("an instance");
        for (mode_name, mode, reduction) in modes {
            let options =
                CollideOptions { contact_distance: 2e-4, reduction, ..CollideOptions::with_mode(mode) };
            let contacts = detect(&scene, &options).expect("contacts");
            let mut hash = contact_hash(&contacts);
            if mode_name == "exact" {
                let ContactPatches { patches, .. } = PatchTracker::new(PatchOptions::default())
                    .expect("a tracker")
                    .update(&scene, contacts.as_slice())
                    .expect("patches");
                hash.bytes(format!("{patches:?}").as_bytes());
            }
            let count = contacts.len();
            found.push((format!("contacts {name}, {mode_name}: {count}"), hash.text()));
        }
        let mut hash = Hash::NEW;
        for lift in [0.0, 1e-3, 0.05] {
            let pose = Pose { translation: pose.translation + lift * DVec3::new(0.3, 0.2, 1.0), ..pose };
            scene.set_poses(&[(a, pose)]).expect("a pose");
            let clearance = clearance(&scene, a, b, &ClearanceOptions::default()).expect("a clearance");
            hash.bytes(format!("{clearance:?}").as_bytes());
        }
        let linear = DVec3::new(-0.015, -0.01, -0.05);
        let velocity = Velocity { linear, angular: DVec3::new(0.2, -0.1, 0.5) };
        let motion = Motion::Linear { velocity };
        let options = TimeOfImpactOptions { end: 1.0, ..TimeOfImpactOptions::default() };
        let impact = time_of_impact(&scene, a, b, motion, Motion::Rest, &options).expect("an impact");
        hash.bytes(format!("{impact:?}").as_bytes());
        found.push((format!("clearance and time of impact, {name}"), hash.text()));
    }
}

/// Adds the states of all bodies after each of so many steps.
fn run(name: &str, engine: &mut dyn Dynamics, time_step: f64, steps: usize, found: &mut Found) {
    let mut hash = Hash::NEW;
    for _ in 0..steps {
        engine.step(time_step).expect("a step");
        for state in engine.system().states() {
            hash.vector(state.pose.translation);
            state.pose.rotation.to_array().into_iter().for_each(|x| hash.number(x));
            [state.linear, state.angular].into_iter().for_each(|v| hash.vector(v));
        }
    }
    found.push((format!("run of {name}"), hash.text()));
}

fn runs(assets: &Assets, found: &mut Found) {
    let gravity = DVec3::new(0.0, 0.0, -9.81);
    // Meshes: a nut on its bolt; spoons that fall onto a block.
    for (name, fixed, free, mode, count) in [
        ("a nut on a bolt", &assets.bolt, &assets.nut, Mode::exact(), 1),
        ("spoons on a block", &assets.block, &assets.spoon, Mode::Node, 2),
    ] {
        let mut system = System::new(gravity);
        let ids = [fixed, free].map(|asset| system.add_shape(asset.clone()).expect("a shape"));
        system.add("fixed", Instance::new(ids[0], Pose::IDENTITY), Mass::Fixed).expect("a body");
        let properties = MassProperties::of_shape(&Shape::Mesh(free.clone()), 1.0, 7850.0).expect("a mass");
        for k in 0..count {
            let pose = match count {
                1 => on_thread(0.0),
                _ => Pose {
                    translation: DVec3::new(0.01, 0.015, 0.03 + 0.02 * f64::from(k)),
                    rotation: elementary::from_scaled_axis(DVec3::new(0.3, 0.1 * f64::from(k), 1.0)),
                },
            };
            let body = system
                .add(format!("{k}"), Instance::new(ids[1], pose), Mass::Free(properties))
                .expect("a body");
            system.set_friction(body, 0.3).expect("friction");
        }
        let collide = CollideOptions { mode, ..CollideOptions::for_simulation() };
        let options = NewtonOptions::default();
        let mut engine = Newton::new(system, detect, collide, options).expect("an engine");
        run(name, &mut engine, 2e-3, 40, found);
    }
    for (name, text, steps) in SCENES {
        let loaded = LoadedScene::parse(format!("{HEAD}{text}"), "scene.toml").expect("a scene");
        let mut engine = loaded.newton(loaded.system().expect("a system")).expect("an engine");
        run(name, &mut engine, loaded.scene.time_step, *steps, found);
    }
}

/// The first lines of the scenes.
const HEAD: &str = "time_step = 5e-3\nduration = 1\ngravity = [0, 0, -9.81]\n";

/// Scenes of simple shapes.
const SCENES: &[(&str, &str, usize)] = &[
    (
        "simple shapes that fall and bounce",
        r#"
[[bodies]]
name = "floor"
shape = "plane"
fixed = true
friction = 0.5
restitution = 0.4
[[bodies]]
name = "box"
shape = { box = { half_extents = [0.05, 0.04, 0.03] } }
mass = 1
friction = 0.5
translation = [0, 0, 0.1]
rotation = [0.1, 0.2, 0.3, 0.927361849549570]
[[bodies]]
name = "ball"
shape = { sphere = { radius = 0.03 } }
mass = 0.5
friction = 0.5
restitution = 0.5
translation = [0.01, 0.02, 0.3]
velocity = [0.1, 0, 0]
[[bodies]]
name = "capsule"
shape = { capsule = { half_height = 0.05, radius = 0.02 } }
mass = 0.4
friction = 0.3
translation = [-0.02, 0.01, 0.4]
rotation = [0, 0.707106781186548, 0, 0.707106781186548]
[[bodies]]
name = "cylinder"
shape = { cylinder = { half_height = 0.03, radius = 0.02 } }
mass = 0.4
friction = 0.3
translation = [0.2, 0.01, 0.05]
angular_velocity = [1, 2, 3]
"#,
        80,
    ),
    (
        "joints and motors",
        r#"
[[bodies]]
name = "upper"
shape = { box = { half_extents = [0.1, 0.02, 0.02] } }
mass = 1
translation = [0.1, 0, 1]
[[bodies]]
name = "lower"
shape = { capsule = { half_height = 0.08, radius = 0.02 } }
mass = 0.5
translation = [0.3, 0, 1]
rotation = [0, 0.707106781186548, 0, 0.707106781186548]
[[bodies]]
name = "weight"
shape = { sphere = { radius = 0.04 } }
mass = 2
translation = [0.44, 0, 1]
[[joints]]
name = "shoulder"
kind = "hinge"
child = "upper"
anchor = [0, 0, 1]
axis = [0, 1, 0.2]
motor = { drive = { velocity = 3 }, limit = 20 }
[[joints]]
name = "elbow"
kind = "hinge"
parent = "upper"
child = "lower"
anchor = [0.2, 0, 1]
axis = [0, 1, 0]
[[joints]]
name = "wrist"
kind = "ball"
parent = "lower"
child = "weight"
anchor = [0.4, 0, 1]
"#,
        100,
    ),
    (
        "a wall of boxes that is hit",
        r#"
[[bodies]]
name = "floor"
shape = "plane"
fixed = true
friction = 0.6
[[bodies]]
name = "brick"
shape = { box = { half_extents = [0.1, 0.05, 0.05] } }
mass = 1
friction = 0.6
translation = [0, 0, 0.05]
copies = { count = 4, translation = [0.03, 0.01, 0.1] }
[[bodies]]
name = "ball"
shape = { sphere = { radius = 0.06 } }
mass = 3
friction = 0.2
translation = [0.02, -0.4, 0.22]
velocity = [0, 4, 0]
"#,
        60,
    ),
];

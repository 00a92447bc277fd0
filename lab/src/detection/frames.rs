//! The frames of a benchmark, from a scene, a run or a file of poses.
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use tempfile::TempDir;
use tesdf::collide::{Instance, InstanceId, Pose, Scene};
use tesdf::encode::{EncodeOptions, Encoder};
use tesdf::glam::{DQuat, DVec3};
use tesdf::input;
use tesdf::mesh::SolidMesh;
use tesdf::{Progress, TeSdf};
use tesdf_sim::scene_file::{LoadedScene, MAX_BODIES};

use super::poses::{PoseFile, VERSION};
use crate::scenes::criteria;
use tesdf_cli::terminal::interrupt;
use tesdf_cli::terminal::progress::watched;
use tesdf_cli::terminal::report::Failure;
use tesdf_cli::terminal::{asset_file, run_file};

/// Maximum number of instances in all worlds.
const MAX_INSTANCES: usize = 1 << 20;
/// Hint for a file of poses that is refused.
const WRITES_POSES: &str = "`tesdf-lab poses` writes files of poses";

/// Bodies and their poses in each frame.
pub struct Frames {
    /// The bodies in their first poses.
    pub scene: Scene,
    /// For each frame, the pose of each instance of the scene.
    pub poses: Vec<Vec<Pose>>,
    /// Contact distance in the file, if it has one.
    pub contact_distance: Option<f64>,
}

impl Frames {
    /// Reads a scene (`.toml`), a run (`.tesrun`) or a file of poses (`.json`), and copies it into
    /// `worlds` worlds. At most `max_frames` frames are read; those of a run are evenly spaced.
    /// Meshes of a file of poses are encoded with `options`.
    ///
    /// # Errors
    /// A file cannot be read, or its content does not match its extension.
    pub fn read(
        path: &Path,
        max_frames: usize,
        worlds: u32,
        options: &EncodeOptions,
    ) -> Result<Self, Failure> {
        let frames = match path.extension().and_then(|e| e.to_str()) {
            Some("toml") => {
                Self::of_scene(&LoadedScene::read_with(path, &criteria()).map_err(Failure::new)?)?
            }
            Some("json") => Self::of_poses(path, max_frames, options)?,
            _ => Self::of_run(path, max_frames)?,
        };
        frames.in_worlds(worlds)
    }

    /// The bodies of a scene, where they begin.
    ///
    /// # Errors
    /// A mesh cannot be read or encoded.
    pub fn of_scene(loaded: &LoadedScene) -> Result<Self, Failure> {
        let interrupted = interrupt::flag();
        let progress = Progress::default();
        let system =
            watched(&progress, interrupted, || loaded.system_watched(&progress)).map_err(Failure::new)?;
        let scene = system.scene().clone();
        let poses = vec![scene.instances().map(|(_, instance)| instance.pose).collect()];
        Ok(Self { scene, poses, contact_distance: loaded.scene.detector.contact_distance })
    }

    fn of_run(path: &Path, max_frames: usize) -> Result<Self, Failure> {
        let named = |e: &dyn std::fmt::Display| Failure::new(format!("{}: {e}", path.display()));
        let record = run_file::open(path)?;
        let loaded = LoadedScene::of_run(&record, path).map_err(Failure::new)?;
        let start = Self::of_scene(&loaded)?;
        let steps = record.times().len();
        let every = steps.div_ceil(max_frames.max(1)).max(1);
        let bodies = start.poses[0].len();
        let frame = |step| (0..bodies).map(|body| record.pose(step, body)).collect::<Option<Vec<Pose>>>();
        let poses = (0..steps).step_by(every).map(frame).collect::<Option<Vec<_>>>();
        let poses = poses.ok_or_else(|| named(&format!("a pose is missing; expected {bodies} a step")))?;
        Ok(Self { poses, ..start })
    }

    fn of_poses(path: &Path, max_frames: usize, options: &EncodeOptions) -> Result<Self, Failure> {
        let named = |e: &dyn std::fmt::Display| Failure::new(format!("{}: {e}", path.display()));
        let named = |e: &dyn std::fmt::Display| named(e).hint(WRITES_POSES);
        let text = input::read(path).map_err(|e| named(&e))?;
        let file: PoseFile =
            serde_json::from_slice(&text).map_err(|e| named(&format!("not a file of poses: {e}")))?;
        if file.tesdf_poses != VERSION {
            return Err(named(&format!("version {}; this build reads {VERSION}", file.tesdf_poses)));
        }
        if file.bodies.len() > MAX_BODIES || file.instances.len() > MAX_BODIES {
            let [bodies, instances] = [file.bodies.len(), file.instances.len()];
            let found = format!("{bodies} bodies, {instances} instances; expected at most {MAX_BODIES} each");
            return Err(named(&found));
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        if let Some(scene) = &file.scene {
            let mut loaded = LoadedScene::read_with(folder.join(scene), &criteria()).map_err(Failure::new)?;
            let _assets = encode_meshes(&mut loaded, options)?;
            let start = Self::of_scene(&loaded)?;
            let poses = file.poses(start.poses[0].len(), max_frames).map_err(|e| named(&e))?;
            return Ok(Self { poses, contact_distance: Some(file.contact_distance), ..start });
        }
        let mut scene = Scene::new();
        let (mut shapes, mut opened) = (Vec::new(), BTreeMap::new());
        let interrupted = interrupt::flag();
        for body in &file.bodies {
            let path = folder.join(body);
            let file = path.canonicalize().unwrap_or_else(|_| path.clone());
            let shape = match opened.get(&file) {
                Some(&shape) => shape,
                None => scene.add_shape(geometry(&path, options, interrupted)?).map_err(Failure::new)?,
            };
            opened.insert(file, shape);
            shapes.push(shape);
        }
        let poses = file.poses(file.instances.len(), max_frames).map_err(|e| named(&e))?;
        let first = &poses[0];
        for (&(body, world), &pose) in file.instances.iter().zip(first) {
            let shape = *shapes.get(body).ok_or_else(|| {
                named(&format!("an instance of body {body}; expected one of {}", shapes.len()))
            })?;
            scene.add(Instance { world, ..Instance::new(shape, pose) }).map_err(Failure::new)?;
        }
        Ok(Self { scene, poses, contact_distance: Some(file.contact_distance) })
    }

    /// Copies the frames into several worlds. Frame `f` of world `w` is frame `f + w`, so the
    /// worlds differ.
    fn in_worlds(self, worlds: u32) -> Result<Self, Failure> {
        if worlds <= 1 {
            return Ok(self);
        }
        let instances = self.scene.instances().len().saturating_mul(worlds as usize);
        if instances > MAX_INSTANCES {
            return Err(Failure::new(format!(
                "--worlds {worlds} makes {instances} instances; expected at most {MAX_INSTANCES}: take fewer worlds"
            )));
        }
        let Self { mut scene, poses, contact_distance } = self;
        let instances: Vec<Instance> = scene.instances().map(|(_, instance)| *instance).collect();
        for world in 1..worlds {
            let more: Vec<Instance> = instances.iter().map(|i| Instance { world, ..*i }).collect();
            scene.add_many(&more).map_err(Failure::new)?;
        }
        let frame = |f: usize| {
            (0..worlds as usize).flat_map(|w| poses[(f + w) % poses.len()].iter().copied()).collect()
        };
        let poses = (0..poses.len()).map(frame).collect();
        Ok(Self { scene, poses, contact_distance })
    }

    /// Moves the instances of the scene to their poses in a frame.
    ///
    /// # Errors
    /// Never for frames of the same scene.
    pub fn show(&mut self, frame: usize) -> Result<(), Failure> {
        let ids: Vec<InstanceId> = self.scene.instances().map(|(id, _)| id).collect();
        let poses: Vec<(InstanceId, Pose)> = ids.into_iter().zip(self.poses[frame].iter().copied()).collect();
        self.scene.set_poses(&poses).map_err(Failure::new)
    }
}

impl PoseFile {
    /// The poses of at most `max_frames` frames, each with `count` bodies; at least one frame.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub fn poses(&self, count: usize, max_frames: usize) -> Result<Vec<Vec<Pose>>, String> {
        let pose = |&[x, y, z, i, j, k, w]: &[f64; 7]| {
            Pose::new(DVec3::new(x, y, z), DQuat::from_xyzw(i, j, k, w)).map_err(|e| e.to_string())
        };
        let of_frame = |(k, frame): (usize, &Vec<[f64; 7]>)| match frame.len() == count {
            true => frame.iter().map(pose).collect(),
            false => Err(format!("frame {k} has {} poses; expected {count}", frame.len())),
        };
        let frames = self.frames.iter().take(max_frames).enumerate().map(of_frame);
        match frames.collect::<Result<Vec<_>, String>>()? {
            none if none.is_empty() => Err("no frame".into()),
            frames => Ok(frames),
        }
    }
}

/// Encodes the meshes of a scene with `options`, each once. The assets are files in a folder that
/// is removed when it is dropped.
///
/// # Errors
/// A mesh cannot be read or encoded, or there is no folder for temporary files.
pub fn encode_meshes(loaded: &mut LoadedScene, options: &EncodeOptions) -> Result<TempDir, Failure> {
    let folder = TempDir::new().map_err(|e| {
        Failure::new(format!("no temporary folder: {e}"))
            .hint("set TMPDIR to a folder that can be written to")
    })?;
    let interrupted = interrupt::flag();
    let scene_folder = loaded.path.parent().unwrap_or(Path::new("")).to_path_buf();
    let mut encoded: BTreeMap<PathBuf, PathBuf> = BTreeMap::new();
    for body in &mut loaded.scene.bodies {
        let body = body.get_mut();
        let Some(mesh) = body.mesh.take() else { continue };
        let number = encoded.len();
        let asset = match encoded.entry(scene_folder.join(mesh)) {
            Entry::Occupied(asset) => asset.into_mut(),
            Entry::Vacant(entry) => {
                let asset = folder.path().join(format!("{number}.tesdf"));
                geometry(entry.key(), options, interrupted)?.save(&asset).map_err(Failure::new)?;
                entry.insert(asset)
            }
        };
        body.asset = Some(asset.clone());
    }
    Ok(folder)
}

/// Opens a `.tesdf` file, or encodes a mesh.
pub fn geometry(
    path: &Path,
    options: &EncodeOptions,
    interrupted: &AtomicBool,
) -> Result<Arc<TeSdf>, Failure> {
    if path.extension().is_some_and(|e| e == "tesdf") {
        return asset_file::open(path).map(Arc::new);
    }
    let named = |e: &dyn std::fmt::Display| Failure::new(format!("{}: {e}", path.display()));
    let solid = SolidMesh::read(path).map_err(Failure::new)?;
    let progress = Progress::default();
    watched(&progress, interrupted, || {
        Encoder::new().options(options.clone()).progress(&progress).encode(&solid)
    })
    .map(Arc::new)
    .map_err(|e| named(&e))
}

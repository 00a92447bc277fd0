//! Animated GLB files.
use std::collections::BTreeMap;

use gltf_json as json;
use json::accessor::{ComponentType, GenericComponentType, Type};
use json::animation::{Channel, Interpolation, Property, Sampler, Target};
use json::buffer::Target as BufferTarget;
use json::material::{PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor};
use json::mesh::{Mode, Primitive, Semantic};
use json::scene::UnitQuaternion;
use json::validation::Checked::Valid;
use json::validation::USize64;
use json::{Accessor, Index, Material, Node, Root};
use tesdf::collide::Pose;
use tesdf::glam::DVec2;

use crate::mesh::Mesh;
use crate::playback::{DrawnBody, Part, Playback};
use crate::{Linear, PlaybackError, linear, simple};

/// Options of [`glb()`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlbOptions {
    /// Seconds of the run in each second of the animation: players have no control of the speed.
    pub speed: f64,
}

impl Default for GlbOptions {
    /// The animation takes as long as the run.
    fn default() -> Self {
        Self { speed: 1.0 }
    }
}

/// Turns the z axis, which is up in a run, to the y axis, which is up in glTF: x y z w.
const UPRIGHT: [f32; 4] = [-std::f32::consts::FRAC_1_SQRT_2, 0.0, 0.0, std::f32::consts::FRAC_1_SQRT_2];
/// sRGB of the light and the dark squares of floors.
const SQUARES: [[u8; 3]; 2] = [[240, 242, 245], [222, 226, 232]];

/// The bytes of a GLB file with the run as an animation.
///
/// A node `run` turns z to y and lies at the centre of the run. Its children are the bodies, with
/// their names. A body that moves has channels of its translation and rotation, in metres. Bodies
/// of the same shape share its vertices and faces; there is one mesh for each of their colours. A
/// plane is a floor of squares. Contacts are not in the file.
///
/// # Errors
/// [`PlaybackError`]: a state or the speed is not valid, or the file would be larger than 4 GiB.
pub fn glb(run: &Playback<'_>, options: &GlbOptions) -> Result<Vec<u8>, PlaybackError> {
    let GlbOptions { speed } = *options;
    if !(speed > 0.0 && speed.is_finite()) {
        return Err(PlaybackError::Option { option: "speed", found: speed, expected: "a positive number" });
    }
    let mut file = File::default();
    let times: Vec<f32> = run.times.iter().map(|t| ((t - run.times[0]) / speed) as f32).collect();
    let mut meshes = Meshes::default();
    let mut animation = Animation::default();
    let mut children = Vec::new();
    for (number, body) in run.bodies.iter().enumerate() {
        let track = run.track(number)?;
        let mesh = meshes.get(&mut file, run, body);
        children.push(animation.add(&mut file, body, mesh, &track, &times));
    }
    let [x, y, z] = run.centre.as_vec3().to_array();
    let root = file.root.push(Node {
        name: Some("run".into()),
        translation: Some([x, z, -y]),
        rotation: Some(UnitQuaternion(UPRIGHT)),
        children: (!children.is_empty()).then_some(children),
        ..Node::default()
    });
    let scene = file.root.push(json::Scene {
        extensions: None,
        extras: Default::default(),
        name: None,
        nodes: vec![root],
    });
    file.root.scene = Some(scene);
    if !animation.channels.is_empty() {
        let Animation { channels, samplers, .. } = animation;
        file.root.push(json::Animation {
            extensions: None,
            extras: Default::default(),
            name: Some("run".into()),
            channels,
            samplers,
        });
    }
    file.into_bytes()
}

/// The file so far.
#[derive(Default)]
struct File {
    root: Root,
    data: Vec<u8>,
}

impl File {
    /// Appends rows of numbers to the data.
    fn view(&mut self, bytes: &[u8], target: Option<BufferTarget>) -> Index<json::buffer::View> {
        let offset = self.data.len();
        self.data.extend_from_slice(bytes);
        // Each view begins at a multiple of the size of its numbers.
        self.data.resize(self.data.len().next_multiple_of(4), 0);
        self.root.push(json::buffer::View {
            buffer: Index::new(0),
            byte_length: bytes.len().into(),
            byte_offset: Some(offset.into()),
            byte_stride: None,
            extensions: None,
            extras: Default::default(),
            name: None,
            target: target.map(Valid),
        })
    }

    fn accessor(
        &mut self,
        view: Index<json::buffer::View>,
        count: usize,
        component: ComponentType,
        type_: Type,
    ) -> Accessor {
        Accessor {
            buffer_view: Some(view),
            byte_offset: Some(USize64(0)),
            count: count.into(),
            component_type: Valid(GenericComponentType(component)),
            extensions: None,
            extras: Default::default(),
            max: None,
            min: None,
            name: None,
            normalized: false,
            sparse: None,
            type_: Valid(type_),
        }
    }

    /// An accessor of rows of floats. `N` is 1, 3 or 4.
    fn floats<const N: usize>(&mut self, rows: &[[f32; N]], target: Option<BufferTarget>) -> Accessor {
        let view = self.view(bytemuck::cast_slice(rows.as_flattened()), target);
        let type_ = match N {
            1 => Type::Scalar,
            3 => Type::Vec3,
            _ => Type::Vec4,
        };
        self.accessor(view, rows.len(), ComponentType::F32, type_)
    }

    fn material(&mut self, name: &str, colour: Linear) -> Index<Material> {
        let [r, g, b] = colour.to_array();
        self.root.push(Material {
            name: Some(name.into()),
            pbr_metallic_roughness: PbrMetallicRoughness {
                base_color_factor: PbrBaseColorFactor([r, g, b, 1.0]),
                metallic_factor: StrengthFactor(0.0),
                roughness_factor: StrengthFactor(0.6),
                ..PbrMetallicRoughness::default()
            },
            ..Material::default()
        })
    }

    fn into_bytes(mut self) -> Result<Vec<u8>, PlaybackError> {
        self.root.asset.generator = Some(format!("tesdf {}", env!("CARGO_PKG_VERSION")));
        let length = self.data.len();
        if length > 0 {
            self.root.push(json::Buffer {
                byte_length: length.into(),
                extensions: None,
                extras: Default::default(),
                name: None,
                uri: None,
            });
        }
        let mut text = self.root.to_vec().map_err(|e| PlaybackError::Encode(e.to_string()))?;
        text.resize(text.len().next_multiple_of(4), b' ');
        let total = 12 + 8 + text.len() as u64 + 8 + length as u64;
        let most = u64::from(u32::MAX);
        if total > most {
            let hint = "play fewer frames";
            return Err(PlaybackError::Size { bytes: total, format: "GLB", most, hint });
        }
        let mut bytes = Vec::with_capacity(total as usize);
        bytes.extend_from_slice(b"glTF");
        for number in [2, total as u32, text.len() as u32] {
            bytes.extend_from_slice(&number.to_le_bytes());
        }
        bytes.extend_from_slice(b"JSON");
        bytes.append(&mut text);
        bytes.extend_from_slice(&(length as u32).to_le_bytes());
        bytes.extend_from_slice(b"BIN\0");
        bytes.append(&mut self.data);
        Ok(bytes)
    }
}

/// The accessors of a mesh: positions, normals, indices.
type Shared = [Index<Accessor>; 3];

/// The meshes of the file so far.
#[derive(Default)]
struct Meshes {
    /// By the number of the mesh in the run.
    shared: BTreeMap<usize, Shared>,
    materials: BTreeMap<[u32; 3], Index<Material>>,
    /// By the number of the mesh in the run and the material.
    made: BTreeMap<(usize, usize), Index<json::Mesh>>,
}

impl Meshes {
    fn get(&mut self, file: &mut File, run: &Playback<'_>, body: &DrawnBody) -> Index<json::Mesh> {
        match body.part {
            Part::Floor(at) => {
                let edge = simple::square(run.diagonal());
                let squares = simple::floor(DVec2::new(at.x, at.y), edge, run.diagonal());
                let primitives = squares.iter().zip(SQUARES).map(|(mesh, rgb)| {
                    let colour = linear(rgb);
                    let material = self.material(file, "floor", colour);
                    primitive(shared(file, mesh), material)
                });
                let primitives = primitives.collect();
                push_mesh(file, &body.name, primitives)
            }
            Part::Mesh(number) => {
                let material = self.material(file, "body", body.colour);
                if let Some(made) = self.made.get(&(number, material.value())) {
                    return *made;
                }
                let accessors =
                    *self.shared.entry(number).or_insert_with(|| shared(file, &run.meshes[number]));
                let mesh = push_mesh(file, &body.name, vec![primitive(accessors, material)]);
                self.made.insert((number, material.value()), mesh);
                mesh
            }
        }
    }

    fn material(&mut self, file: &mut File, name: &str, colour: Linear) -> Index<Material> {
        let key = colour.to_array().map(f32::to_bits);
        *self.materials.entry(key).or_insert_with(|| file.material(name, colour))
    }
}

fn push_mesh(file: &mut File, name: &str, primitives: Vec<Primitive>) -> Index<json::Mesh> {
    file.root.push(json::Mesh {
        extensions: None,
        extras: Default::default(),
        name: Some(name.into()),
        primitives,
        weights: None,
    })
}

fn primitive([positions, normals, indices]: Shared, material: Index<Material>) -> Primitive {
    Primitive {
        attributes: BTreeMap::from([
            (Valid(Semantic::Positions), positions),
            (Valid(Semantic::Normals), normals),
        ]),
        extensions: None,
        extras: Default::default(),
        indices: Some(indices),
        material: Some(material),
        mode: Valid(Mode::Triangles),
        targets: None,
    }
}

/// Appends the vertices and faces of a mesh to the file.
fn shared(file: &mut File, mesh: &Mesh) -> Shared {
    let [low, high] = mesh.extremes();
    let mut positions = file.floats(&mesh.positions, Some(BufferTarget::ArrayBuffer));
    positions.min = Some(serde_json::json!(low.to_array()));
    positions.max = Some(serde_json::json!(high.to_array()));
    let normals = file.floats(&mesh.normals, Some(BufferTarget::ArrayBuffer));
    // The number 65535 restarts a primitive in some graphics interfaces.
    let (bytes, component) = match mesh.positions.len() < usize::from(u16::MAX) {
        true => {
            let short: Vec<u16> = mesh.indices.iter().map(|&i| i as u16).collect();
            (bytemuck::cast_slice(&short).to_vec(), ComponentType::U16)
        }
        false => (bytemuck::cast_slice(&mesh.indices).to_vec(), ComponentType::U32),
    };
    let view = file.view(&bytes, Some(BufferTarget::ElementArrayBuffer));
    let indices = file.accessor(view, mesh.indices.len(), component, Type::Scalar);
    [positions, normals, indices].map(|accessor| file.root.push(accessor))
}

/// The animation so far.
#[derive(Default)]
struct Animation {
    /// The accessor of the times, which all samplers share.
    times: Option<Index<Accessor>>,
    channels: Vec<Channel>,
    samplers: Vec<Sampler>,
}

impl Animation {
    /// Appends the node of a body. Only what changes gets a channel.
    fn add(
        &mut self,
        file: &mut File,
        body: &DrawnBody,
        mesh: Index<json::Mesh>,
        track: &[Pose],
        times: &[f32],
    ) -> Index<Node> {
        let translations: Vec<[f32; 3]> =
            track.iter().map(|pose| pose.translation.as_vec3().to_array()).collect();
        let rotations: Vec<[f32; 4]> = track.iter().map(|pose| pose.rotation.as_quat().to_array()).collect();
        // A floor is in metres, whatever the scale of its plane.
        let scale = match body.part {
            Part::Floor(_) => 1.0,
            Part::Mesh(_) => body.scale as f32,
        };
        let node = file.root.push(Node {
            name: Some(body.name.clone()),
            mesh: Some(mesh),
            translation: translations.first().copied(),
            rotation: rotations.first().copied().map(UnitQuaternion),
            scale: (scale != 1.0).then_some([scale; 3]),
            ..Node::default()
        });
        if translations.windows(2).any(|pair| pair[0] != pair[1]) {
            let values = file.floats(&translations, None);
            self.channel(file, node, Property::Translation, values, times);
        }
        if rotations.windows(2).any(|pair| pair[0] != pair[1]) {
            let values = file.floats(&rotations, None);
            self.channel(file, node, Property::Rotation, values, times);
        }
        node
    }

    fn channel(
        &mut self,
        file: &mut File,
        node: Index<Node>,
        property: Property,
        values: Accessor,
        times: &[f32],
    ) {
        let input = *self.times.get_or_insert_with(|| {
            let rows: Vec<[f32; 1]> = times.iter().map(|&t| [t]).collect();
            let mut accessor = file.floats(&rows, None);
            accessor.min = times.first().map(|t| serde_json::json!([t]));
            accessor.max = times.last().map(|t| serde_json::json!([t]));
            file.root.push(accessor)
        });
        let output = file.root.push(values);
        let sampler = Index::push(
            &mut self.samplers,
            Sampler {
                extensions: None,
                extras: Default::default(),
                input,
                interpolation: Valid(Interpolation::Linear),
                output,
            },
        );
        let target = Target { extensions: None, extras: Default::default(), node, path: Valid(property) };
        self.channels.push(Channel { sampler, target, extensions: None, extras: Default::default() });
    }
}

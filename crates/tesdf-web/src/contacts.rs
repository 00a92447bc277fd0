//! Two assets at poses: their contacts and their clearance.
use tesdf::collide::{self, ClearanceOptions, CollideOptions, Instance, InstanceId, Pose, Scene};
use tesdf::glam::{DQuat, DVec3};
use wasm_bindgen::prelude::*;

use crate::{Asset, thrown};

fn pose(name: &str, numbers: &[f64]) -> Result<Pose, JsError> {
    let [x, y, z, qx, qy, qz, qw] = numbers.try_into().map_err(|_| {
        JsError::new(&format!("{name} has {} numbers; expected x y z qx qy qz qw", numbers.len()))
    })?;
    Pose::new(DVec3::new(x, y, z), DQuat::from_xyzw(qx, qy, qz, qw)).map_err(thrown)
}

/// Two bodies.
fn scene(a: &Asset, b: &Asset, poses: [&[f64]; 2]) -> Result<(Scene, [InstanceId; 2]), JsError> {
    let mut scene = Scene::new();
    let mut add = |asset: &Asset, pose: Pose| -> Result<InstanceId, JsError> {
        let shape = scene.add_shape(asset.0.clone()).map_err(thrown)?;
        scene.add(Instance::new(shape, pose)).map_err(thrown)
    };
    let ids = [add(a, pose("poseA", poses[0])?)?, add(b, pose("poseB", poses[1])?)?];
    Ok((scene, ids))
}

/// The contacts of two bodies.
#[wasm_bindgen]
pub struct Contacts(collide::Contacts);

/// All contacts of two bodies in both orders, in the frame of the poses.
#[wasm_bindgen]
pub fn contacts(
    a: &Asset,
    b: &Asset,
    #[wasm_bindgen(js_name = poseA)] pose_a: &[f64],
    #[wasm_bindgen(js_name = poseB)] pose_b: &[f64],
    #[wasm_bindgen(unchecked_param_type = "ContactOptions | undefined")] options: JsValue,
) -> Result<Contacts, JsError> {
    let options = match options.is_undefined() || options.is_null() {
        true => CollideOptions::default(),
        false => {
            let text = js_sys::JSON::stringify(&options).map(String::from);
            let text = text.map_err(|_| JsError::new("options are no object of plain values"))?;
            serde_json::from_str(&text).map_err(thrown)?
        }
    };
    let (scene, _) = scene(a, b, [pose_a, pose_b])?;
    Ok(Contacts(collide::detect(&scene, &options).map_err(thrown)?))
}

#[wasm_bindgen]
impl Contacts {
    /// The number of contacts.
    #[wasm_bindgen(getter)]
    pub fn length(&self) -> usize {
        self.0.len()
    }

    /// Three numbers for each: the witness point on the body that has the face.
    #[wasm_bindgen(getter)]
    pub fn points(&self) -> Vec<f64> {
        self.0.iter().flat_map(|c| c.point_a.to_array()).collect()
    }

    /// Three numbers for each: the nearest point of the other body.
    #[wasm_bindgen(getter, js_name = otherPoints)]
    pub fn other_points(&self) -> Vec<f64> {
        self.0.iter().flat_map(|c| c.point_b.to_array()).collect()
    }

    /// Three numbers for each: a unit vector from the other body to the one that has the face.
    #[wasm_bindgen(getter)]
    pub fn normals(&self) -> Vec<f64> {
        self.0.iter().flat_map(|c| c.normal.to_array()).collect()
    }

    /// The signed distances; negative where the bodies overlap.
    #[wasm_bindgen(getter)]
    pub fn distances(&self) -> Vec<f64> {
        self.0.iter().map(|c| c.distance).collect()
    }

    /// The bodies that have the faces: 0 for *a*, 1 for *b*.
    #[wasm_bindgen(getter)]
    pub fn bodies(&self) -> Vec<u8> {
        self.0.iter().map(|c| u8::from(c.instance_a > c.instance_b)).collect()
    }

    /// Two numbers for each: the face, and the face of the other body.
    #[wasm_bindgen(getter)]
    pub fn faces(&self) -> Vec<u32> {
        self.0.iter().flat_map(|c| [c.face_a, c.face_b]).collect()
    }
}

/// The signed distance of two bodies.
#[wasm_bindgen]
pub struct Clearance(collide::Clearance);

/// The signed distance of two bodies; negative where they overlap. `tolerance` is a length; by default
/// the library chooses one.
#[wasm_bindgen]
pub fn clearance(
    a: &Asset,
    b: &Asset,
    #[wasm_bindgen(js_name = poseA)] pose_a: &[f64],
    #[wasm_bindgen(js_name = poseB)] pose_b: &[f64],
    tolerance: Option<f64>,
) -> Result<Clearance, JsError> {
    let (scene, [a, b]) = scene(a, b, [pose_a, pose_b])?;
    let mut options = ClearanceOptions::default();
    if let Some(tolerance) = tolerance {
        options.tolerance = tesdf::Length::Absolute(tolerance);
    }
    Ok(Clearance(collide::clearance(&scene, a, b, &options).map_err(thrown)?))
}

#[wasm_bindgen]
impl Clearance {
    /// The least distance of the surfaces, or minus the greatest depth of a point.
    #[wasm_bindgen(getter)]
    pub fn distance(&self) -> f64 {
        self.0.distance
    }

    /// The witness point on *a*.
    #[wasm_bindgen(getter, js_name = pointA)]
    pub fn point_a(&self) -> Vec<f64> {
        self.0.point_a.to_array().to_vec()
    }

    /// The witness point on *b*.
    #[wasm_bindgen(getter, js_name = pointB)]
    pub fn point_b(&self) -> Vec<f64> {
        self.0.point_b.to_array().to_vec()
    }

    /// A unit vector from *b* to *a*.
    #[wasm_bindgen(getter)]
    pub fn normal(&self) -> Vec<f64> {
        self.0.normal.to_array().to_vec()
    }

    /// Whether the solids share volume.
    #[wasm_bindgen(getter)]
    pub fn overlap(&self) -> bool {
        self.0.overlap
    }
}

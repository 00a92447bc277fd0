//! What determines the bits of a run besides its scene.
use serde::{Deserialize, Serialize};
use tesdf::TeSdf;
use tesdf::collide::{CollideError, Shape};

use crate::System;

/// The software and geometry that a run was made with. Runs of equal scenes with equal origins have
/// the same bits.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunOrigin {
    /// Version of `tesdf-sim`.
    pub version: String,
    /// Where contacts are detected: `cpu`, or the name of a GPU device.
    pub device: String,
    /// For each body that is an encoded mesh: the BLAKE3 hash of its vertices, faces, cells and
    /// lists, in hexadecimal. `None` for other bodies.
    pub geometries: Vec<Option<String>>,
}

impl RunOrigin {
    /// The origin of a run of `system` whose contacts are detected on `device`.
    ///
    /// # Errors
    /// Never for a system that was built through its methods.
    pub fn of(system: &System, device: &str) -> Result<Self, CollideError> {
        let geometry = |body: &crate::Body| {
            let instance = system.scene().instance(body.instance)?;
            Ok(match system.scene().shape(instance.shape)? {
                Shape::Mesh(asset) => Some(fingerprint(asset)),
                _ => None,
            })
        };
        Ok(Self {
            version: env!("CARGO_PKG_VERSION").into(),
            device: device.into(),
            geometries: system.bodies().iter().map(geometry).collect::<Result<_, CollideError>>()?,
        })
    }
}

/// A hash of the geometry. The name of the source file is left out, so a mesh may be renamed.
fn fingerprint(asset: &TeSdf) -> String {
    let mut hasher = blake3::Hasher::new();
    // How the detector uses the lists depends on what the certificate proves about them.
    hasher.update(asset.container().metadata().get("certificate").map_or(&[], String::as_bytes));
    for section in asset.sections() {
        hasher.update(section.spec.name.as_bytes());
        hasher.update(&(section.bytes.len() as u64).to_le_bytes());
        hasher.update(section.bytes);
    }
    hasher.finalize().to_hex().to_string()
}

//! Friction of pairs, joints and scripts of a scene.
use tesdf::collide::Pose;
use tesdf::glam::{DQuat, DVec3};

use super::read::LoadedScene;
use super::{JointSection, SceneError};
use crate::script::Scripts;
use crate::{Joint, System};

impl LoadedScene {
    /// Adds the friction of pairs and the joints to the system, and checks the scripts.
    pub(super) fn connect(&self, system: &mut System) -> Result<(), SceneError> {
        for (k, pair) in self.scene.friction.iter().enumerate() {
            let at = |reason: String| self.value("friction", format!("number {}: {reason}", k + 1));
            let [a, b] = &pair.bodies;
            let [a, b] = [body(system, a).map_err(at)?, body(system, b).map_err(at)?];
            system.set_pair_friction(a, b, pair.coefficient).map_err(|e| at(e.to_string()))?;
        }
        for (k, section) in self.scene.joints.iter().enumerate() {
            let at = |reason: String| self.value("joints", format!("{}: {reason}", section.name));
            if self.scene.joints[..k].iter().any(|other| other.name == section.name) {
                return Err(at("the name is used twice; give each joint its own".into()));
            }
            let joint = joint(system, section).map_err(at)?;
            system.add_joint(joint).map_err(|e| self.value("joints", e))?;
        }
        Scripts::new(&self.scene.scripts, system).map_err(|reason| self.value("scripts", reason))?;
        Ok(())
    }
}

fn joint(system: &System, section: &JointSection) -> Result<Joint, String> {
    let child = body(system, &section.child)?;
    let parent = section.parent.as_ref().map(|name| body(system, name)).transpose()?;
    let pose = |body: usize| system.states()[body].pose;
    let axis = DVec3::from_array(section.axis).try_normalize();
    let axis =
        axis.ok_or_else(|| format!("axis {:?}; expected a direction of any length except 0", section.axis))?;
    let anchor = section.anchor.map_or(pose(child).translation, DVec3::from_array);
    let frame = Pose::new(anchor, DQuat::from_rotation_arc(DVec3::Z, axis)).map_err(|e| e.to_string())?;
    let poses = [parent.map_or(Pose::IDENTITY, pose), pose(child)];
    let joint = Joint::new(&section.name, section.kind, (parent, child), poses, frame);
    Ok(Joint { limits: section.limits, motor: section.motor, ..joint })
}

fn body(system: &System, name: &str) -> Result<usize, String> {
    let names = || system.bodies().iter().map(|b| b.name.as_str()).collect::<Vec<_>>().join(", ");
    let found = system.bodies().iter().position(|body| body.name == name);
    found.ok_or_else(|| format!("there is no body {name}; the bodies are {}", names()))
}

//! Friction of pairs, joints, their couplings and scripts of a scene.
use tesdf::base::elementary;
use tesdf::collide::Pose;
use tesdf::glam::DVec3;

use super::read::LoadedScene;
use super::{CouplingSection, JointSection, SceneError};
use crate::script::{Scripts, joint_named};
use crate::{Coupling, Joint, System};

impl LoadedScene {
    /// Adds the friction of pairs, the excluded pairs, the joints and their couplings to the
    /// system, and checks the scripts.
    pub(super) fn connect(&self, system: &mut System) -> Result<(), SceneError> {
        for (k, pair) in self.scene.friction.iter().enumerate() {
            let at = |reason: String| self.value("friction", format!("number {}: {reason}", k + 1));
            let [a, b] = pair_of(system, &pair.bodies).map_err(at)?;
            system.set_pair_friction(a, b, pair.coefficient).map_err(|e| at(e.to_string()))?;
            if let Some(torsional) = pair.torsional {
                system.set_pair_friction_torsional(a, b, torsional).map_err(|e| at(e.to_string()))?;
            }
        }
        for (k, pair) in self.scene.exclude.iter().enumerate() {
            let at = |reason: String| self.value("exclude", format!("number {}: {reason}", k + 1));
            let [a, b] = pair_of(system, &pair.bodies).map_err(at)?;
            system.exclude(a, b).map_err(|e| at(e.to_string()))?;
        }
        for (k, section) in self.scene.joints.iter().enumerate() {
            let at = |reason: String| self.value("joints", format!("{}: {reason}", section.name));
            if self.scene.joints[..k].iter().any(|other| other.name == section.name) {
                return Err(at("the name is used twice; give each joint its own".into()));
            }
            let joint = joint(system, section).map_err(at)?;
            system.add_joint(joint).map_err(|e| self.value("joints", e))?;
        }
        for (k, section) in self.scene.couplings.iter().enumerate() {
            let at = |reason: String| self.value("couplings", format!("number {}: {reason}", k + 1));
            let coupling = coupling(system, section).map_err(at)?;
            system.add_coupling(coupling).map_err(|e| at(e.to_string()))?;
        }
        system.check_couplings().map_err(|e| self.value("couplings", e))?;
        Scripts::new(&self.scene.scripts, system).map_err(|reason| self.value("scripts", reason))?;
        Ok(())
    }

    /// Checks that the criteria match the bodies, joints and scripts.
    pub(super) fn check_criteria(&self, system: &System) -> Result<(), SceneError> {
        let free = |body: &str| match self.scene.scripts.iter().any(|s| s.body.as_deref() == Some(body)) {
            true => Err(format!("a script drives body {body}; only contacts may, so take it out")),
            false => Ok(()),
        };
        let at = |(name, reason): (String, String)| self.value(&format!("criterion.{name}"), reason);
        self.scene.criterion.check(system, free).map_err(at)
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
    let frame =
        Pose::new(anchor, elementary::from_rotation_arc(DVec3::Z, axis)).map_err(|e| e.to_string())?;
    let poses = [parent.map_or(Pose::IDENTITY, pose), pose(child)];
    let mut joint = Joint::new(&section.name, section.kind, (parent, child), poses, frame);
    joint.begin_at(section.coordinate)?;
    Ok(Joint { limits: section.limits, motor: section.motor, resistance: section.resistance, ..joint })
}

fn coupling(system: &System, section: &CouplingSection) -> Result<Coupling, String> {
    let CouplingSection { joint, of, ratio, offset } = section;
    let joint = joint_named(system, joint)?;
    let of = joint_named(system, of)?;
    Ok(Coupling { joint, of, ratio: *ratio, offset: *offset })
}

/// The numbers of two different bodies.
fn pair_of(system: &System, names: &[String; 2]) -> Result<[usize; 2], String> {
    let [a, b] = [body(system, &names[0])?, body(system, &names[1])?];
    match a == b {
        true => Err(format!("both bodies are {}; give two different bodies", names[0])),
        false => Ok([a, b]),
    }
}

fn body(system: &System, name: &str) -> Result<usize, String> {
    let names = || system.bodies().iter().map(|b| b.name.as_str()).collect::<Vec<_>>().join(", ");
    let found = system.bodies().iter().position(|body| body.name == name);
    found.ok_or_else(|| format!("there is no body {name}; the bodies are {}", names()))
}

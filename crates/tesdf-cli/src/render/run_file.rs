//! The bodies of a recorded run at one of its steps.
use std::path::Path;

use crate::terminal::interrupt;
use crate::terminal::report::Failure;
use tesdf::collide::Placement;
use tesdf::glam::Vec3;
use tesdf::save::Destination;
use tesdf_sim::record::RecordedContact;

use super::{Args, ContactMark, Posed};
use crate::open_run::{self, OpenRun};

/// Reads a run and opens the geometries of its bodies. Also returns the output file, which must not
/// be one of these files.
///
/// # Errors
/// The file is not a run, a geometry is missing, or the run has no contacts although they are to be
/// drawn.
pub fn posed(args: &Args, run: &Path) -> Result<(Posed, Destination), Failure> {
    let at = |reason: &dyn std::fmt::Display| Failure::new(format!("{}: {reason}", run.display()));
    let interrupted = interrupt::flag();
    let OpenRun { record, system, output, .. } =
        open_run::open(run, &args.geometries, &args.output, args.consent, interrupted)?;

    let end = record.times().last().copied();
    let time = args.time.or(end).ok_or_else(|| at(&"it has no steps"))?;
    let step = match args.contacts {
        false => record.nearest_step(time).ok_or_else(|| at(&"it has no steps"))?,
        true => record.nearest_contacts(time).ok_or_else(|| {
            at(&"it has no contacts").hint("simulate with contacts_every in the scene's section [record]")
        })?,
    };
    let mut posed = Posed { shapes: Vec::new(), placements: Vec::new(), contacts: Vec::new() };
    for (place, body) in system.bodies().iter().enumerate() {
        let instance = system.scene().instance(body.instance).map_err(|e| at(&e))?;
        let pose = record.pose(step, place).ok_or_else(|| at(&format!("it has no pose of {}", body.name)))?;
        posed.shapes.push(system.scene().shape(instance.shape).map_err(|e| at(&e))?.clone());
        posed.placements.push(Placement { pose, scale: instance.scale });
    }
    if args.contacts {
        let kept = record.contacts().find(|(kept, _)| *kept == step as u64);
        posed.contacts = kept.iter().flat_map(|(_, contacts)| contacts.iter().map(mark)).collect();
    }
    Ok((posed, output))
}

/// The mark lies on the body with the field, because the normal points away from it.
fn mark(contact: &RecordedContact) -> ContactMark {
    let [point, normal] = [contact.point, contact.normal].map(|v| Vec3::from_array(v).as_dvec3());
    ContactMark { point: point - f64::from(contact.distance) * normal, normal }
}

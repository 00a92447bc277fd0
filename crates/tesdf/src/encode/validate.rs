//! Checks that the options fit each other, the solid and the domain.
use std::borrow::Cow;

use super::error::EncodeError;
use super::roots::{Domain, MAX_SIZE};
use super::{Deformation, EncodeOptions, Method, Refinement, Threshold};
use crate::base::{Inside, InsideRule, SurfaceFaces};
use crate::mesh::{Presented, SolidMesh, Telling};

/// Checks that the rule of a solid, its surface, the domain and the options fit each other.
pub fn validated_inside(
    solid: &SolidMesh,
    presented: &Presented,
    jumps: bool,
    domain: &Domain,
    options: &EncodeOptions,
) -> Result<(), EncodeError> {
    let wrong = |option, found: String, expected| Err(EncodeError::Option { option, found, expected });
    let Inside { rule, surface } = *solid.inside();
    if options.inside != Inside::default() && options.inside != *solid.inside() {
        return wrong("inside", options.inside.to_string(), "the rule that the solid was made with");
    }
    if let InsideRule::Sheet { thickness } = rule
        && !(thickness > 0.0 && thickness <= MAX_SIZE * presented.mesh.diagonal())
    {
        return wrong(
            "thickness",
            thickness.to_string(),
            "a positive length, at most 8 times the diagonal of the mesh",
        );
    }
    if surface == SurfaceFaces::Boundary && (presented.telling == Telling::Sheet || jumps) {
        return wrong(
            "surface",
            "boundary, of a mesh without an exact inside".into(),
            "all: an open mesh and a sheet have no faces that are surely inside",
        );
    }
    let all_as_they_are = presented.telling == Telling::Winding && matches!(presented.mesh, Cow::Borrowed(_));
    if matches!(domain, Domain::Conforming(_)) && !all_as_they_are {
        return wrong(
            "inside",
            format!("{}, in a conforming domain", rule.name()),
            "the bisection domain for a rule that the winding number of the faces does not tell",
        );
    }
    Ok(())
}

/// The width of the band, in the unit of the mesh.
pub fn validated(options: &EncodeOptions, domain: &Domain, diagonal: f64) -> Result<f64, EncodeError> {
    let band = options.band.resolve(diagonal);
    let wrong = |option, found: String, expected| Err(EncodeError::Option { option, found, expected });
    if !(0.0..=MAX_SIZE * diagonal).contains(&band) {
        return wrong(
            "band",
            options.band.to_string(),
            "a length from 0 to 8 times the diagonal of the mesh",
        );
    }
    if !(options.byte_worth > 0.0 && options.byte_worth.is_finite()) {
        return wrong("byte_worth", format!("{}", options.byte_worth), "a positive number");
    }
    if options.tighten_levels > MAX_TIGHTEN {
        return wrong("tighten_levels", format!("{}", options.tighten_levels), "0 to 30");
    }
    for r in options.region_boxes() {
        if !(r.min.is_finite() && r.max.is_finite() && r.min.cmple(r.max).all()) {
            return wrong(
                "region",
                format!("{} to {}", r.min, r.max),
                "min x y z and a max that is not less",
            );
        }
    }
    if let Some(groups) = options.groups {
        if groups.size == 0 {
            return wrong("groups.size", "0".into(), "1 or more faces");
        }
        if !(0.0..=MAX_SIZE * diagonal).contains(&options.fit_within(diagonal)) {
            return wrong(
                "groups.fit_within",
                groups.fit_within.to_string(),
                "a length from 0 to 8 times the diagonal of the mesh",
            );
        }
    }
    if options.max_entries == Some(0) {
        return wrong("max_entries", "0".into(), "1 or more faces");
    }
    if let Method::Sampled(sampling) = options.method {
        if !(1..=MAX_RESOLUTION).contains(&sampling.resolution) {
            return wrong("resolution", format!("{}", sampling.resolution), "1 to 1024");
        }
        if !(sampling.shrink > 0.0 && sampling.shrink <= 1.0) {
            return wrong("shrink", format!("{}", sampling.shrink), "above 0, at most 1");
        }
        if let Threshold::Absolute(e) | Threshold::Squared(e) = sampling.threshold
            && !(e >= 0.0 && e.is_finite())
        {
            return wrong("threshold", e.to_string(), "a length, or an area, of 0 or more");
        }
    }
    if let Domain::Bisection = domain {
        if options.deformation == Deformation::Expected {
            return wrong(
                "deformation",
                "lists for deformation in the bisection domain, whose cells do not follow the surface".into(),
                "a conforming domain for it",
            );
        }
        if options.refinement == Refinement::None {
            return wrong(
                "refinement",
                "none in the bisection domain, which would be six cells".into(),
                "a conforming domain for it",
            );
        }
    }
    Ok(band)
}

const MAX_TIGHTEN: u32 = 30;
const MAX_RESOLUTION: u32 = 1024;

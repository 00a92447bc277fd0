//! The report of `Scene.why`.
use pyo3::prelude::*;
use serde::Serialize;
use tesdf::collide::{BroadVerdict, PairVerdict, PartReport, PolygonReport, PolygonVerdict, WhyReport};
use tesdf::glam::DVec3;

use crate::classes;

/// Fields of `tesdf.WhyReport`.
#[derive(Serialize)]
struct Why<'a> {
    instance_a: u32,
    instance_b: u32,
    pair: PairVerdict,
    contact_distance: f64,
    bounds_gap: f64,
    total: usize,
    candidates: usize,
    parts: Vec<Part<'a>>,
}

/// Fields of `tesdf.reports.WhyPart`.
#[derive(Serialize)]
struct Part<'a> {
    id: u32,
    contact_distance: f64,
    broad: &'static str,
    bound: Option<f64>,
    polygons: Vec<Polygon<'a>>,
}

/// Fields of `tesdf.reports.WhyPolygon`.
#[derive(Serialize)]
struct Polygon<'a> {
    cell: Option<u32>,
    vertices: &'a [DVec3],
    distance: f64,
    point: DVec3,
    face_b: u32,
    verdict: &'static str,
    cosine: Option<f64>,
}

impl<'a> From<&'a PartReport> for Part<'a> {
    fn from(part: &'a PartReport) -> Self {
        let (broad, bound) = match part.broad {
            BroadVerdict::Candidate => ("candidate", None),
            BroadVerdict::PrunedByTree { bound } => ("pruned_by_tree", Some(bound)),
            BroadVerdict::PrunedByBall { bound } => ("pruned_by_ball", Some(bound)),
        };
        let PartReport { id, contact_distance, .. } = *part;
        let polygons = part.polygons.iter().map(Polygon::from).collect();
        Self { id, contact_distance, broad, bound, polygons }
    }
}

impl<'a> From<&'a PolygonReport> for Polygon<'a> {
    fn from(polygon: &'a PolygonReport) -> Self {
        let (verdict, cosine) = match polygon.verdict {
            PolygonVerdict::Contact => ("contact", None),
            PolygonVerdict::CellBeyond => ("cell_beyond", None),
            PolygonVerdict::Beyond => ("beyond", None),
            PolygonVerdict::Filtered { cosine } => ("filtered", Some(cosine)),
            PolygonVerdict::Descending => ("descending", None),
            PolygonVerdict::OutOfCones => ("out_of_cones", None),
        };
        let PolygonReport { cell, distance, point, face_b, .. } = *polygon;
        Self { cell, vertices: &polygon.vertices, distance, point, face_b, verdict, cosine }
    }
}

/// An object of `tesdf.WhyReport`.
pub fn report<'py>(py: Python<'py>, found: &WhyReport) -> PyResult<Bound<'py, PyAny>> {
    let WhyReport { pair, contact_distance, bounds_gap, total, candidates, .. } = *found;
    let parts = found.parts.iter().map(Part::from).collect();
    let (instance_a, instance_b) = (found.instance_a.0, found.instance_b.0);
    let why = Why { instance_a, instance_b, pair, contact_distance, bounds_gap, total, candidates, parts };
    classes::report(py, "WhyReport", &why)
}

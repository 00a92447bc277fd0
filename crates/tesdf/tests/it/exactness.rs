//! Compares every encoded mesh of `data/` with brute force and with the reference distances.
//!
//! `TESDF_TEST_POINTS=100000 TESDF_TEST_PRESET=default cargo test --release -p tesdf --test
//! it exactness -- --nocapture` is the long run, with a table of the largest errors.

use std::fmt::Write as _;
use std::sync::{LazyLock, Mutex};

use crate::support::cells::Cells;
use crate::support::meshes::{self, Row};
use crate::support::points::{self, KINDS, Kind};
use crate::support::reference::{Reference, exceeds};
use crate::support::rotation::{least, of_the_day};
use crate::support::well_formed::WellFormed;
use rayon::prelude::*;
use tesdf::encode::{EncodeOptions, Encoder, Preset};
use tesdf::geometry::{Closest, Feature};
use tesdf::glam::DVec3;
use tesdf::mesh::SolidMesh;
use tesdf::query::{Answer, Precision};
use tesdf::{Length, TeSdf};

/// Points per mesh, unless `TESDF_TEST_POINTS` is set.
const POINTS: usize = 1800;
/// Number of these points that are compared with all faces without a tree.
const BRUTE: usize = 54;
/// Meshes that are always encoded with the default preset.
const DEFAULT_PRESET: [&str; 3] = ["iso_m16_bolt_6k", "iso_m16_nut_c50", "lobed_hole_c100"];

/// Meshes with at least this many faces take minutes to encode and are part of the long run only.
const LARGE: usize = 100_000;

struct Sample {
    row: Row,
    solid: SolidMesh,
    asset: TeSdf,
    reference: Reference,
    cells: Cells,
}

/// The meshes of the day, encoded once for all tests. `Err` names the fault.
static SAMPLES: LazyLock<Vec<Result<Sample, String>>> = LazyLock::new(|| {
    let mut rows = meshes::manifest();
    rows.retain(|r| !meshes::CRACKED.contains(&r.name.as_str()));
    let long_run = std::env::var_os("TESDF_TEST_PRESET").is_some();
    rows.retain(|r| long_run || r.faces < LARGE);
    assert!(rows.len() > 60, "{} meshes in the manifest", rows.len());
    of_the_day(rows).into_iter().map(Sample::new).collect()
});

impl Sample {
    fn new(row: Row) -> Result<Self, String> {
        let named = |e: String| format!("{}: {e}", row.name);
        let solid = row.solid().map_err(named)?;
        let options = options(&row);
        let asset = Encoder::new().options(options).encode(&solid).map_err(|e| named(e.to_string()))?;
        let (reference, cells) = (Reference::new(solid.mesh()), Cells::of(&asset));
        Ok(Self { row, solid, asset, reference, cells })
    }

    fn points(&self) -> Vec<(Kind, DVec3)> {
        points::sample(self.solid.mesh(), &self.cells, points::count(POINTS))
    }
}

/// The preset `TESDF_TEST_PRESET` for all meshes. Without it, a mixture that takes minutes: a few
/// meshes with the default preset, large meshes with coarser cells than any preset makes.
fn options(row: &Row) -> EncodeOptions {
    let fast = EncodeOptions::preset(Preset::Fast);
    match std::env::var("TESDF_TEST_PRESET").as_deref() {
        Ok("default") => EncodeOptions::default(),
        Ok("fast") => fast,
        Ok("compact") => EncodeOptions::preset(Preset::Compact),
        Ok(other) => panic!("TESDF_TEST_PRESET is {other}; expected default, fast or compact"),
        Err(_) if DEFAULT_PRESET.contains(&row.name.as_str()) => EncodeOptions::default(),
        Err(_) if row.faces > 2_500 => EncodeOptions { byte_worth: 1.0, ..fast },
        Err(_) => fast,
    }
}

/// Runs `check` on every mesh and reports all failures together.
fn on_all(check: impl Fn(&Sample) -> Result<(), String> + Sync) {
    let failed = Mutex::new(Vec::new());
    SAMPLES.par_iter().for_each(|sample| {
        let result = match sample {
            Ok(sample) => check(sample).map_err(|e| format!("{}: {e}", sample.row.name)),
            Err(e) => Err(e.clone()),
        };
        if let Err(e) = result {
            failed.lock().expect("no panic holds it").push(e);
        }
    });
    let failed = failed.into_inner().expect("no panic held it");
    assert!(failed.is_empty(), "{} meshes fail:\n{}", failed.len(), failed.join("\n"));
}

/// Counts mistakes and keeps the first few.
#[derive(Default)]
struct Mistakes {
    count: usize,
    first: String,
}

impl Mistakes {
    fn add(&mut self, what: impl FnOnce() -> String) {
        self.count += 1;
        if self.count <= 3 {
            write!(self.first, "\n    {}", what()).expect("writing to a string");
        }
    }

    fn result(self, of: usize) -> Result<(), String> {
        if self.count == 0 {
            Ok(())
        } else {
            Err(format!("{} mistakes at {of} points:{}", self.count, self.first))
        }
    }
}

const PRECISIONS: [Precision; 2] = [Precision::F32, Precision::F64];

fn tolerance(reference: &Reference, p: DVec3, precision: Precision) -> f64 {
    match precision {
        Precision::F32 => reference.tolerance_f32(p),
        Precision::F64 => reference.tolerance_f64(p),
    }
}

#[test]
fn distances_equal_brute_force() {
    let table = Mutex::new(Vec::new());
    on_all(|s| {
        let points = s.points();
        let mut mistakes = Mistakes::default();
        // Largest error by precision and kind, in diagonals.
        let mut largest = [[0.0f64; KINDS.len()]; 2];
        for (i, &(kind, p)) in points.iter().enumerate() {
            let exact = s.reference.signed_distance(p);
            if i < BRUTE {
                let local = s.reference.frame.to_local(p);
                let [low, high] = s.reference.certified_bounds(local).map(|d| d / s.reference.frame.scale);
                let slack = s.reference.tolerance_f64(p);
                // Near the surface, `p - c` cancels, so the bound becomes weaker in proportion.
                let weak = slack + 4e-16 * s.reference.diagonal.powi(2) / exact.abs().max(1e-300);
                let weak = weak.min(slack + 1e-7 * s.reference.diagonal);
                if exact.abs() < low - slack || exact.abs() > high + slack || low < exact.abs() - weak {
                    mistakes.add(|| format!("{p}: reference {exact:e} is not in {low:e} to {high:e}"));
                }
            }
            for (which, precision) in PRECISIONS.into_iter().enumerate() {
                let answer = s.asset.query_with(p, precision);
                let tolerance = tolerance(&s.reference, p, precision);
                let error = (answer.signed_distance.abs() - exact.abs()).abs();
                let at = KINDS.iter().position(|k| *k == kind).expect("one of them");
                largest[which][at] = largest[which][at].max(error / s.reference.diagonal);
                let wrong_sign = (answer.signed_distance < 0.0) != (exact < 0.0) && exact.abs() > tolerance;
                if exceeds(error, tolerance) || wrong_sign {
                    mistakes.add(|| {
                        let d = s.reference.diagonal;
                        let [a, e] = [answer.signed_distance / d, exact / d];
                        format!("{kind:?} {precision:?} {:?}: {a:e} is not {e:e} diagonals", p.to_array())
                    });
                }
            }
        }
        table.lock().expect("no panic holds it").push((s.row.name.clone(), points.len(), largest));
        mistakes.result(points.len())
    });
    let mut table = table.into_inner().expect("no panic held it");
    table.sort_by(|a, b| a.0.cmp(&b.0));
    println!("largest |error| / diagonal: mesh, points, f32 and f64 of {KINDS:?}");
    for (name, n, [f32s, f64s]) in table {
        let row = |errors: [f64; 9]| errors.map(|e| format!("{e:.1e}")).join(" ");
        println!("{name} {n} | {} | {}", row(f32s), row(f64s));
    }
}

#[test]
fn distances_equal_the_reference_files() {
    let compared = Mutex::new(0);
    on_all(|s| {
        let points = s.row.reference_points();
        let mut mistakes = Mistakes::default();
        for &(p, exact) in &points {
            let p = DVec3::from_array(p);
            for precision in PRECISIONS {
                let found = s.asset.query_with(p, precision).signed_distance;
                if exceeds((found - exact).abs(), tolerance(&s.reference, p, precision)) {
                    mistakes.add(|| format!("{precision:?} {:?}: {found:e} is not {exact:e}", p.to_array()));
                }
            }
        }
        *compared.lock().expect("no panic holds it") += s.row.references.len();
        mistakes.result(points.len())
    });
    let files: usize = meshes::manifest().iter().map(|row| row.references.len()).sum();
    assert_eq!(files, 106, "reference files");
    let compared = *compared.lock().expect("no panic held it");
    assert!(compared > least(files - 1, files / 4), "{compared} reference files were compared");
}

#[test]
fn answers_are_consistent() {
    on_all(|s| {
        let points = s.points();
        let mut mistakes = Mistakes::default();
        let only: Vec<DVec3> = points.iter().map(|p| p.1).collect();
        let batches = PRECISIONS.map(|precision| s.asset.query_batch_with(&only, precision));
        let mut asides = 0;
        for (i, &p) in only.iter().enumerate() {
            let exact = s.reference.signed_distance(p);
            for (precision, batch) in PRECISIONS.into_iter().zip(&batches) {
                let answer = s.asset.query_with(p, precision);
                if answer != batch[i] {
                    mistakes.add(|| format!("{p}: the batch says {:?}, the query {answer:?}", batch[i]));
                }
                if let Err(e) = check_answer(s, p, answer, precision) {
                    mistakes.add(|| format!("{precision:?} {:?}: {e}: {answer:?}", p.to_array()));
                }
                match s.asset.query_in_domain_with(p, precision) {
                    Some(inside) if inside != answer => {
                        mistakes.add(|| format!("{p}: {inside:?} in the domain"))
                    }
                    None if exact <= 0.05 * s.reference.diagonal => {
                        mistakes.add(|| format!("{p} is not in the domain"))
                    }
                    None => asides += 1,
                    Some(_) => {}
                }
            }
            let slack = s.reference.tolerance_f64(p);
            if s.asset.is_inside(p) != s.reference.is_inside(p) && exact.abs() > slack {
                mistakes.add(|| format!("{:?}: is_inside is {}", p.to_array(), s.asset.is_inside(p)));
            }
        }
        if asides == 0 {
            mistakes.add(|| "no point is outside of the domain".into());
        }
        mistakes.result(points.len())
    });
}

/// The closest point is on the named face and at the reported distance. The gradient is a right
/// unit vector.
fn check_answer(s: &Sample, p: DVec3, answer: Answer, precision: Precision) -> Result<(), String> {
    let r = &s.reference;
    let tolerance = tolerance(r, p, precision);
    let off = (answer.closest_point.distance(p) - answer.signed_distance.abs()).abs();
    if exceeds(off, tolerance) {
        return Err(format!("the closest point is {off:e} nearer or farther than the distance"));
    }
    let Some(face) = r.triangles.get(answer.face as usize) else { return Err("no such face".into()) };
    let beside = face.closest(r.frame.to_local(answer.closest_point)).distance / r.frame.scale;
    if beside > tolerance {
        return Err(format!("the closest point is {beside:e} beside its face"));
    }
    if exceeds((answer.gradient.length() - 1.0).abs(), 1e-6) {
        return Err(format!("the gradient has length {}", answer.gradient.length()));
    }
    check_gradient(r, p, answer, precision)
}

/// Largest accepted angle between the gradient and the expected direction, in radians.
const ANGLE: f64 = 1e-3;

/// The expected gradient is `(x - c) / φ` for the closest point c. When several points are equally
/// near up to the precision, any of them may be used. On the surface the expected direction is the
/// pseudonormal of the closest feature.
fn check_gradient(r: &Reference, p: DVec3, answer: Answer, precision: Precision) -> Result<(), String> {
    let local = r.frame.to_local(p);
    let (_, nearest) = r.closest_local(local);
    let (from, reach) = match precision {
        Precision::F32 => (1e-4, 1.1e-6),
        Precision::F64 => (1e-9, 2e-12),
    };
    let diagonal = r.local_diagonal();
    // The coordinates of the point are rounded. Far from the origin, this rounding exceeds the part
    // relative to the diagonal.
    let ulp = 8.0 * f64::EPSILON * p.abs().max_element().max(r.largest) * r.frame.scale;
    let within = r.within_local(local, nearest.distance + reach * diagonal + 1e-15 * nearest.distance);
    let agrees = |n: DVec3| answer.gradient.angle_between(n) <= ANGLE;
    if nearest.distance >= from * diagonal && nearest.distance * ANGLE > 2.0 * ulp {
        let sign = if r.is_inside(p) { -1.0 } else { 1.0 };
        if !within.iter().any(|(_, c)| agrees(sign * (local - c.point))) {
            let angle = answer.gradient.angle_between(sign * (local - nearest.point));
            let share = nearest.distance / diagonal;
            return Err(format!("the gradient is off by {angle:e} at {share:e} diagonals"));
        }
    } else if precision == Precision::F64 && nearest.distance < 1e-10 * diagonal {
        let on = |&(face, c): &(u32, Closest)| {
            [r.triangles[face as usize].normal, pseudonormal(r, face, c.feature)]
        };
        let flat = within.iter().all(|w| on(w).contains(&DVec3::ZERO));
        if !flat && !within.iter().flat_map(on).any(agrees) {
            return Err("the gradient on the surface is no pseudonormal".into());
        }
    }
    Ok(())
}

/// The sum of the normals of the faces around an edge, or the angle-weighted sum around a vertex.
fn pseudonormal(r: &Reference, face: u32, feature: Feature) -> DVec3 {
    let corners = r.faces[face as usize];
    let held: Vec<u32> = match feature {
        Feature::Face => return r.triangles[face as usize].normal,
        Feature::Edge(k) => vec![corners[k as usize], corners[(k as usize + 1) % 3]],
        Feature::Vertex(k) => vec![corners[k as usize]],
    };
    let at = r.triangles[face as usize].corners[match feature {
        Feature::Edge(k) | Feature::Vertex(k) => k as usize,
        Feature::Face => 0,
    }];
    let mut sum = DVec3::ZERO;
    for (other, _) in r.within_local(at, 1e-12) {
        let ids = r.faces[other as usize];
        if !held.iter().all(|v| ids.contains(v)) {
            continue;
        }
        let t = &r.triangles[other as usize];
        let k = ids.iter().position(|v| *v == held[0]).expect("it holds it");
        let side = |i: usize| t.corners[(k + i) % 3] - t.corners[k];
        let weight = if held.len() == 1 { side(1).angle_between(side(2)) } else { 1.0 };
        if weight.is_finite() {
            sum += weight * t.normal;
        }
    }
    sum.normalize_or_zero()
}

#[test]
fn domains_are_well_formed() {
    on_all(|s| {
        let band = 0.05 * s.reference.local_diagonal();
        let (reference, cells) = (&s.reference, &s.cells);
        WellFormed { reference, cells, band, lattice: 2, max_cells: points::count(POINTS) / 8 }.check()
    });
}

/// Cracks wider than rounding remain after default repair. The error then names them.
#[test]
fn cracked_meshes_are_refused() {
    for row in meshes::manifest().iter().filter(|r| meshes::CRACKED.contains(&r.name.as_str())) {
        let error = row.solid().expect_err(&row.name);
        assert!(error.contains("no well-defined inside") && error.contains("edge"), "{}: {error}", row.name);
    }
}

/// The band and the regions belong to the domain.
#[test]
fn regions_belong_to_the_domain() {
    let solid = meshes::named("procedural/tetra.obj");
    let bounds = solid.mesh().bounds();
    let d = solid.mesh().diagonal();
    let region = [bounds.max + 0.5 * d, bounds.max + DVec3::new(1.0, 1.5, 2.0) * d];
    let [a, b] = region.map(|p| p.to_array());
    let options = EncodeOptions {
        band: Length::Absolute(0.0),
        regions: vec![[a[0], a[1], a[2], b[0], b[1], b[2]]],
        ..EncodeOptions::default()
    };
    let asset = Encoder::new().options(options).encode(&solid).expect("valid options");
    let reference = Reference::new(solid.mesh());
    let mut random = crate::support::random::Random(5);
    for i in 0..2000 {
        let t = (0.5 * random.in_cube() + 0.5).map(|x| if i % 3 == 0 { x.round() } else { x });
        let p = region[0] + t * (region[1] - region[0]);
        let answer = asset.query_in_domain(p).unwrap_or_else(|| panic!("{p} is not in the domain"));
        let exact = reference.signed_distance(p);
        assert!((answer.signed_distance - exact).abs() <= reference.tolerance_f64(p), "{p}");
    }
    assert!(asset.query_in_domain(bounds.min - 0.5 * d).is_none());
}

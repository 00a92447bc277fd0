//! Every rule of what is inside: signed distances, sides, verification and proof against brute force
//! over all faces.
mod support;

use proptest::prelude::*;
use support::brute_inside::BruteInside;
use support::random::Random;
use tesdf::TeSdf;
use tesdf::asset::{FORMAT_VERSION, FORMAT_VERSION_OF_RULES};
use tesdf::base::{Inside, InsideRule};
use tesdf::encode::{EncodeError, Encoder, Preset};
use tesdf::glam::{DMat3, DVec3};
use tesdf::mesh::{DefectKind, SolidMesh, TriangleMesh};
use tesdf::query::Precision;
use tesdf::verify::{ProveOptions, VerifyOptions, prove, verify};

/// Faces from parts, which share no vertices.
#[derive(Clone, Default)]
struct Parts {
    vertices: Vec<DVec3>,
    faces: Vec<[u32; 3]>,
}

/// Whether the faces of a part look outward.
#[derive(Clone, Copy, PartialEq)]
enum Turn {
    Outward,
    Inward,
}

impl Parts {
    fn add(mut self, vertices: &[DVec3], faces: &[[u32; 3]], turn: Turn) -> Self {
        let first = self.vertices.len() as u32;
        self.vertices.extend(vertices);
        self.faces.extend(faces.iter().map(|f| {
            let [a, b, c] = f.map(|v| v + first);
            if turn == Turn::Outward { [a, b, c] } else { [a, c, b] }
        }));
        self
    }

    fn cube(self, low: DVec3, edge: f64, turn: Turn) -> Self {
        self.add(&corners(low, edge), &sides(&[0, 1, 2, 3, 4, 5]), turn)
    }

    /// A cube without the side at its greatest z.
    fn open_cube(self, low: DVec3, edge: f64, turn: Turn) -> Self {
        self.add(&corners(low, edge), &sides(&[0, 2, 3, 4, 5]), turn)
    }

    fn mesh(self) -> TriangleMesh {
        TriangleMesh::new(self.vertices, self.faces).expect("valid ids")
    }

    /// The mesh turned about a general axis.
    fn turned(self) -> Self {
        let turn = DMat3::from_rotation_x(0.3) * DMat3::from_rotation_y(0.7) * DMat3::from_rotation_z(1.1);
        Self { vertices: self.vertices.into_iter().map(|v| turn * v).collect(), ..self }
    }
}

fn corners(low: DVec3, edge: f64) -> Vec<DVec3> {
    let corner = |k: u32| low + edge * DVec3::new((k & 1).into(), (k >> 1 & 1).into(), (k >> 2).into());
    (0..8).map(corner).collect()
}

/// Two faces for each side of a cube: low z, high z, low y, high y, low x, high x.
fn sides(which: &[usize]) -> Vec<[u32; 3]> {
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    which
        .iter()
        .flat_map(|&k| [[quads[k][0], quads[k][1], quads[k][2]], [quads[k][0], quads[k][2], quads[k][3]]])
        .collect()
}

/// A sphere of rings, from its south pole up to the ring `rings` of `n`.
fn bowl(n: u32, rings: u32) -> Parts {
    let mut vertices = vec![DVec3::NEG_Z];
    for ring in 1..=rings {
        let polar = std::f64::consts::PI * f64::from(ring) / f64::from(n);
        for k in 0..2 * n {
            let around = std::f64::consts::PI * f64::from(k) / f64::from(n);
            vertices.push(DVec3::new(polar.sin() * around.cos(), polar.sin() * around.sin(), -polar.cos()));
        }
    }
    let at = |ring: u32, k: u32| 1 + (ring - 1) * 2 * n + k % (2 * n);
    let mut faces = Vec::new();
    for k in 0..2 * n {
        faces.push([0, at(1, k + 1), at(1, k)]);
        for ring in 1..rings {
            faces.push([at(ring, k), at(ring, k + 1), at(ring + 1, k)]);
            faces.push([at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)]);
        }
    }
    Parts { vertices, faces }
}

fn moebius(n: u32) -> Parts {
    let vertices = (0..n).flat_map(|i| {
        let around = 2.0 * std::f64::consts::PI * f64::from(i) / f64::from(n);
        let across = DVec3::new(around.cos(), around.sin(), 0.0) * (0.5 * around).cos()
            + DVec3::Z * (0.5 * around).sin();
        let middle = 2.0 * DVec3::new(around.cos(), around.sin(), 0.0);
        [middle - 0.5 * across, middle + 0.5 * across]
    });
    let faces = (0..n).flat_map(|i| {
        let (a, b) = (2 * i, 2 * i + 1);
        let (c, d) = if i + 1 < n { (a + 2, a + 3) } else { (1, 0) };
        [[a, b, c], [b, d, c]]
    });
    Parts { vertices: vertices.collect(), faces: faces.collect() }
}

fn encode(mesh: &TriangleMesh, rule: InsideRule) -> TeSdf {
    let solid = SolidMesh::with_inside(mesh.clone(), Inside::new(rule)).expect("a solid");
    Encoder::new().preset(Preset::Fast).encode(&solid).expect("encodes")
}

/// Points at which rules are delicate: on faces, edges and corners, in their planes, on the lattice of
/// the bounds, near the surface, and far away.
fn points(mesh: &TriangleMesh, n: usize, seed: u64) -> Vec<DVec3> {
    let bounds = mesh.bounds();
    let mut random = Random(seed);
    let mut points = Vec::new();
    let at = |x: f64, y: f64, z: f64| bounds.min + DVec3::new(x, y, z) * bounds.extent();
    for k in 0..125 {
        let [x, y, z] = [k % 5, k / 5 % 5, k / 25].map(|i| f64::from(i) / 4.0);
        points.push(at(x, y, z));
    }
    for _ in 0..n {
        points.push(at(random.between(-0.3, 1.3), random.between(-0.3, 1.3), random.between(-0.3, 1.3)));
        let [a, b, c] = mesh.triangle(random.index(mesh.faces().len()));
        let [u, v, w] = random.weights::<3>();
        let on = u * a + v * b + w * c;
        points.push(on + random.power(-12.0, -1.0) * mesh.diagonal() * random.direction());
        points.extend([a, a.midpoint(b), a + 2.0 * (b - a), on]);
        points.push(a.lerp(b, random.unit()) + 1e-9 * mesh.diagonal() * random.direction());
        points.push(on + random.power(0.0, 9.0) * mesh.diagonal() * random.direction());
    }
    points
}

/// Compares an asset with brute force in both precisions and by the tree, verifies and proves it, and
/// reads it back.
fn assert_exact(mesh: &TriangleMesh, asset: &TeSdf, brute: &BruteInside, n: usize) {
    let diagonal = mesh.diagonal();
    let all = points(mesh, n, 7);
    let answers = [asset.query_batch(&all), asset.query_batch_f32(&all)];
    for (i, &p) in all.iter().enumerate() {
        let ulps = 8.0 * f64::EPSILON * p.abs().max_element();
        for (answer, of_diagonal) in
            [(answers[0][i], 1e-12), (asset.query_by_tree(p), 1e-12), (answers[1][i], 1e-6)]
        {
            let bound = of_diagonal * diagonal + ulps;
            let error = brute.error(p, answer.signed_distance, bound);
            assert!(
                error <= bound + 1e-6 * (of_diagonal * brute.distance(p)).min(bound),
                "{p}: {} is off by {error:e}",
                answer.signed_distance
            );
        }
        if let Some(inside) = brute.is_inside(p)
            && brute.distance(p) > 1e-9 * diagonal
            && asset.inside().rule.half_thickness() == 0.0
        {
            assert_eq!(asset.is_inside(p), inside, "{p}");
        }
    }
    let report =
        verify(asset, &VerifyOptions { samples: 2000, seed: 3 }, |_| std::ops::ControlFlow::Continue(()))
            .expect("verifies");
    assert!(report.passed, "{report:#?}");
    let proof =
        prove(asset, &ProveOptions::default(), |_| std::ops::ControlFlow::Continue(())).expect("a proof");
    assert!(proof.proved, "{proof:#?}");

    let again = TeSdf::from_bytes(asset.as_bytes()).expect("opens");
    again.verify_checksums().expect("intact");
    assert_eq!(again.inside(), asset.inside());
    assert_eq!(again.query_batch(&all[..200]), answers[0][..200]);
}

fn assert_rule(mesh: &TriangleMesh, rule: InsideRule, n: usize) -> TeSdf {
    let asset = encode(mesh, rule);
    assert_exact(mesh, &asset, &BruteInside::of_all(mesh, rule), n);
    asset
}

use InsideRule::{Generalized, Nonzero, Odd, Sheet, Winding};
use Turn::{Inward, Outward};

/// Overlapping cubes, one of them inside out, coincident faces, and a cavity.
fn mixed() -> TriangleMesh {
    let parts = Parts::default().cube(DVec3::ZERO, 2.0, Outward).cube(DVec3::ONE, 2.0, Outward);
    let parts = parts.cube(DVec3::new(2.0, 0.0, 0.0), 1.0, Inward).cube(DVec3::splat(0.25), 0.5, Inward);
    parts.cube(DVec3::new(2.5, 2.5, 0.5), 1.0, Inward).mesh()
}

#[test]
fn balanced_rules_equal_brute_force() {
    for rule in [Winding, Nonzero, Odd, Generalized] {
        let asset = assert_rule(&mixed(), rule, 150);
        assert!(!asset.about().certificate().jumps());
        let expected = if rule == Winding { FORMAT_VERSION } else { FORMAT_VERSION_OF_RULES };
        assert_eq!(asset.container().version(), expected, "{rule:?}");
    }
    let turned =
        Parts::default().cube(DVec3::ZERO, 2.0, Inward).cube(DVec3::ONE, 2.0, Outward).turned().mesh();
    for rule in [Nonzero, Odd] {
        assert_rule(&turned, rule, 150);
    }
}

#[test]
fn a_rule_that_winding_numbers_tell_keeps_the_lists_of_the_default() {
    let mesh = bowl(6, 6).mesh();
    let plain = encode(&mesh, Winding);
    for rule in [Nonzero, Odd, Generalized] {
        let asset = assert_rule(&mesh, rule, 20);
        assert_eq!(asset.container().version(), FORMAT_VERSION);
        let nodes = |asset: &TeSdf| asset.sections().map(|s| s.bytes.to_vec()).collect::<Vec<_>>();
        assert_eq!(nodes(&asset), nodes(&plain), "{rule:?}");
        assert_eq!(asset.inside().rule, rule);
    }
}

#[test]
fn open_meshes_by_the_generalized_winding_number() {
    let cup = Parts::default().open_cube(DVec3::ZERO, 1.0, Outward);
    let meshes = [
        cup.clone().mesh(),
        cup.clone().turned().mesh(),
        // Inside out, and next to a closed cube; two that overlap.
        cup.clone().cube(DVec3::new(0.5, 0.5, 0.5), 1.0, Outward).mesh(),
        cup.open_cube(DVec3::new(0.25, 0.5, 0.125), 1.0, Inward).mesh(),
        bowl(6, 5).mesh(),
        bowl(6, 3).turned().mesh(),
    ];
    for mesh in meshes {
        let asset = assert_rule(&mesh, Generalized, 100);
        assert!(asset.about().certificate().jumps());
        assert_eq!(asset.container().version(), FORMAT_VERSION_OF_RULES);
        assert!(asset.is_inside(mesh.bounds().center() - 0.2 * mesh.bounds().extent() * DVec3::Z));
    }
}

#[test]
fn a_flat_hole_is_closed_where_the_number_is_one_half() {
    // By symmetry, the plane of the hole of a half of a surface that is symmetric to it has 1/2.
    let cup = bowl(8, 4).mesh();
    let asset = encode(&cup, Generalized);
    for (x, y) in [(0.0, 0.0), (0.3, 0.1), (-0.5, 0.5), (0.0, 0.9)] {
        let at = |z: f64| asset.signed_distance(DVec3::new(x, y, z));
        assert!(at(-1e-6) < 0.0 && at(1e-6) > 0.0, "({x}, {y})");
        assert!(at(0.0).abs() > 0.01, "on the plane the distance is that to the faces");
    }
}

#[test]
fn degenerate_meshes_have_distances_under_the_generalized_rule_and_as_sheets() {
    let triangle = Parts { vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y], faces: vec![[0, 1, 2]] };
    let twice = Parts { faces: vec![[0, 1, 2], [0, 1, 2]], ..triangle.clone() };
    let folded = Parts { faces: vec![[0, 1, 2], [0, 2, 1]], ..triangle.clone() };
    let flat = Parts { faces: vec![[0, 1, 2], [0, 0, 1], [1, 1, 1]], ..triangle.clone() };
    let mut random = Random(5);
    let vertices: Vec<DVec3> = (0..60).map(|_| random.in_cube()).collect();
    let soup = Parts { vertices, faces: (0..20).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect() };
    let fan = Parts {
        vertices: vec![DVec3::ZERO, DVec3::Z, DVec3::X, DVec3::Y, -DVec3::X],
        faces: vec![[0, 1, 2], [0, 1, 3], [0, 1, 4]],
    };
    for mesh in [triangle, twice, folded, flat, soup, fan, moebius(12)].map(Parts::mesh) {
        assert_rule(&mesh, Generalized, 60);
        let sheet = assert_rule(&mesh, Sheet { thickness: 0.1 }, 60);
        assert_eq!(sheet.container().version(), FORMAT_VERSION_OF_RULES);
        let on = mesh.triangle(0).iter().sum::<DVec3>() / 3.0;
        assert!((sheet.signed_distance(on) + 0.05).abs() < 1e-12 && sheet.is_inside(on));
    }
}

#[test]
fn a_sheet_is_a_solid_of_its_thickness() {
    let mesh = Parts::default().open_cube(DVec3::ZERO, 1.0, Outward).mesh();
    let asset = assert_rule(&mesh, Sheet { thickness: 0.125 }, 200);
    let answer = asset.query(DVec3::new(0.5, 0.5, -1.0));
    assert_eq!((answer.signed_distance, answer.gradient), (1.0 - 0.0625, DVec3::NEG_Z));
    assert_eq!(answer.closest_point, DVec3::new(0.5, 0.5, -0.0625));
    let answer = asset.query(DVec3::new(0.5, 0.5, 0.03125));
    assert_eq!((answer.signed_distance, answer.gradient), (-0.03125, DVec3::Z));
    assert_eq!(answer.closest_point, DVec3::new(0.5, 0.5, 0.0625));
    let far = asset.query(DVec3::new(0.5, 0.5, -1e12));
    assert_eq!(far.closest_point.z, -0.0625);
}

#[test]
fn gradients_on_the_surface_point_outward_under_every_rule() {
    let mesh =
        Parts::default().cube(DVec3::ZERO, 1.0, Inward).cube(DVec3::new(3.0, 0.0, 0.0), 1.0, Outward).mesh();
    for rule in [Nonzero, Odd] {
        let asset = encode(&mesh, rule);
        for precision in [Precision::F64, Precision::F32] {
            for x in [0.0, 3.0] {
                let on = asset.query_with(DVec3::new(x + 0.3, 0.4, 1.0), precision);
                assert!(on.gradient.distance(DVec3::Z) < 1e-6, "{rule:?} {precision:?}: {on:?}");
            }
        }
    }
}

#[test]
fn refusals_name_the_rules_that_take_the_mesh() {
    let open = Parts::default().open_cube(DVec3::ZERO, 1.0, Outward).mesh();
    let error = SolidMesh::new(open.clone()).expect_err("open");
    assert_eq!(error.rules(), [Generalized, Sheet { thickness: 0.0 }]);
    let text = error.to_string();
    assert!(text.contains("--inside generalized") && text.contains("--inside sheet --thickness"), "{text}");
    for rule in [Nonzero, Odd] {
        assert!(SolidMesh::with_inside(open.clone(), rule.into()).is_err(), "{rule:?}");
    }

    let inward = Parts::default().cube(DVec3::ZERO, 1.0, Inward).mesh();
    let error = SolidMesh::new(inward).expect_err("inside out");
    assert!(error.report().defects.iter().any(|d| d.kind == DefectKind::NoInside));
    assert!(error.to_string().contains("--inside nonzero"), "{error}");

    let twice = Parts::default().cube(DVec3::ZERO, 1.0, Outward).cube(DVec3::ZERO, 1.0, Outward).mesh();
    let error = SolidMesh::with_inside(twice, Odd.into()).expect_err("even everywhere");
    assert!(error.to_string().contains("winding number that is odd"), "{error}");
}

#[test]
fn options_that_do_not_fit_are_refused() {
    let open = Parts::default().open_cube(DVec3::ZERO, 1.0, Outward).mesh();
    for thickness in [0.0, -1.0, f64::NAN, f64::INFINITY, 100.0] {
        let solid = SolidMesh::with_inside(open.clone(), Sheet { thickness }.into()).expect("any mesh");
        let error = Encoder::new().encode(&solid).expect_err("no thickness");
        assert!(matches!(error, EncodeError::Option { option: "thickness", .. }), "{error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    /// Random cubes, outward and inward, some of them open.
    #[test]
    fn random_boxes(boxes in proptest::collection::vec((0..4u8, 0..4u8, 0..4u8, 1..4u8, any::<bool>(), 0..4u8), 1..4)) {
        let mut parts = Parts::default();
        let mut is_open = false;
        for (x, y, z, edge, inward, lid) in boxes {
            let low = DVec3::new(x.into(), y.into(), z.into());
            let turn = if inward { Inward } else { Outward };
            parts = match lid {
                0 => parts.open_cube(low, edge.into(), turn),
                _ => parts.cube(low, edge.into(), turn),
            };
            is_open |= lid == 0;
        }
        let mesh = parts.mesh();
        let rules: &[InsideRule] = if is_open { &[Generalized] } else { &[Nonzero, Odd] };
        for &rule in rules {
            if SolidMesh::with_inside(mesh.clone(), rule.into()).is_ok() {
                assert_rule(&mesh, rule, 25);
            }
        }
    }
}

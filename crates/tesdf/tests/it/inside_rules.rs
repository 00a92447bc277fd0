//! Every rule of what is inside: signed distances, sides, verification and proof against brute force
//! over all faces.

use std::ops::ControlFlow;

use crate::support::brute_inside::BruteInside;
use crate::support::meshes::encoded;
use crate::support::parts::Turn::{Inward, Outward};
use crate::support::parts::{Parts, bowl, moebius};
use crate::support::random::Random;
use crate::support::tetrahedra::cube;
use proptest::prelude::*;
use tesdf::TeSdf;
use tesdf::asset::{FORMAT_VERSION, FORMAT_VERSION_OF_RULES};
use tesdf::base::{Inside, InsideRule, SurfaceFaces};
use tesdf::encode::{Domain, EncodeError, EncodeOptions, Encoder, Preset};
use tesdf::glam::DVec3;
use tesdf::mesh::{DefectKind, SolidMesh, TriangleMesh};
use tesdf::query::Precision;
use tesdf::verify::{ProveOptions, VerifyOptions, prove, verify};

fn encode(mesh: &TriangleMesh, rule: InsideRule) -> TeSdf {
    let solid = SolidMesh::with_inside(mesh.clone(), Inside::new(rule)).expect("a solid");
    encoded(&solid)
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
    assert_verified(asset);
    let again = TeSdf::from_bytes(asset.as_bytes()).expect("opens");
    again.verify_checksums().expect("intact");
    assert_eq!(again.inside(), asset.inside());
    assert_eq!(again.query_batch(&all[..200]), answers[0][..200]);
}

fn assert_verified(asset: &TeSdf) {
    let options = VerifyOptions { samples: 2000, seed: 3 };
    let report = verify(asset, &options, |_| ControlFlow::Continue(())).expect("verifies");
    assert!(report.passed, "{report:#?}");
    let proof = prove(asset, &ProveOptions::default(), |_| ControlFlow::Continue(())).expect("a proof");
    assert!(proof.proved, "{proof:#?}");
}

fn assert_rule(mesh: &TriangleMesh, rule: InsideRule, n: usize) -> TeSdf {
    let asset = encode(mesh, rule);
    assert_exact(mesh, &asset, &BruteInside::of_all(mesh, rule), n);
    asset
}

use InsideRule::{Generalized, Nonzero, Odd, Sheet, Winding};

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
        let points = points(&mesh, 200, 1);
        assert!(points.iter().any(|&p| asset.is_inside(p)) && !points.iter().all(|&p| asset.is_inside(p)));
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
        // Two faces that look against each other enclose nothing.
        match SolidMesh::with_inside(mesh.clone(), Generalized.into()) {
            Ok(_) => drop(assert_rule(&mesh, Generalized, 60)),
            Err(refusal) => assert_eq!((mesh.faces().len(), refusal.rules().len()), (2, 1)),
        }
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
    assert_eq!(error.rules(), [Generalized, Sheet { thickness: 0.01 }]);
    let text = error.to_string();
    assert!(text.contains("rule `generalized`") && text.contains("rule `sheet`"), "{text}");
    for rule in [Nonzero, Odd] {
        assert!(SolidMesh::with_inside(open.clone(), rule.into()).is_err(), "{rule:?}");
    }

    // A sheet has no inside, whatever its number of faces.
    let vertices = vec![DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
    let plate = Parts { vertices, faces: vec![[0, 1, 2], [0, 2, 3]] }.turned().mesh();
    let error = SolidMesh::new(plate).expect_err("open");
    assert_eq!(error.rules(), [Sheet { thickness: 0.01 }]);
    assert!(
        error.to_string().contains("rule `sheet` takes its faces as sheets of a thickness: 0.01 is"),
        "{error}"
    );

    let inward = Parts::default().cube(DVec3::ZERO, 1.0, Inward).mesh();
    let error = SolidMesh::new(inward).expect_err("inside out");
    assert!(error.report().defects.iter().any(|d| d.kind == DefectKind::NoInside));
    assert!(error.to_string().contains("rule `nonzero`"), "{error}");

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

    let closed = Parts::default().cube(DVec3::ZERO, 1.0, Outward).mesh();
    let boundary = |rule| Inside { rule, surface: SurfaceFaces::Boundary };
    let sheet = Sheet { thickness: 0.1 };
    let none = EncodeOptions::default;
    let odd = EncodeOptions { inside: Odd.into(), ..none() };
    for (mesh, inside, options, name, found) in [
        (&closed, Nonzero.into(), odd.clone(), "inside", "odd"),
        (&closed, Inside::default(), odd, "inside", "odd"),
        (&closed, boundary(sheet), none(), "surface", "boundary"),
        (&open, boundary(Generalized), none(), "surface", "boundary"),
    ] {
        let solid = SolidMesh::with_inside(mesh.clone(), inside).expect("a solid");
        match Encoder::new().options(options).encode(&solid) {
            Err(EncodeError::Option { option, found: text, .. }) => {
                assert!(option == name && text.contains(found), "{inside:?}: {option} is {text}");
            }
            other => panic!("{inside:?}: {:?}", other.map(|_| ())),
        }
    }
    // The options may say again what the solid says.
    let solid = SolidMesh::with_inside(closed, Odd.into()).expect("a solid");
    let same = EncodeOptions { inside: Odd.into(), ..EncodeOptions::preset(Preset::Fast) };
    assert!(Encoder::new().options(same).encode(&solid).is_ok());
}

/// The cells of a conforming domain tell the side, so the winding number of the faces has to.
#[test]
fn a_conforming_domain_takes_only_rules_that_the_winding_number_tells() {
    let (solid, domain) = cube();
    for (rule, is_taken) in [(Odd, true), (Generalized, true), (Sheet { thickness: 0.1 }, false)] {
        let solid = SolidMesh::with_inside(solid.mesh().clone(), rule.into()).expect("a solid");
        let encoder = Encoder::new().preset(Preset::Fast).domain(Domain::Conforming(&domain));
        match encoder.encode(&solid) {
            Ok(_) => assert!(is_taken, "{rule:?}"),
            Err(EncodeError::Option { option: "inside", found, .. }) => {
                assert!(!is_taken && found == "sheet, in a conforming domain", "{rule:?}: {found}");
            }
            Err(e) => panic!("{rule:?}: {e}"),
        }
    }
}

/// The asset of a mesh whose surface is the boundary. Compares it with brute force, for which the
/// surface is the faces of the asset.
fn assert_boundary(mesh: &TriangleMesh, rule: InsideRule, n: usize) -> TeSdf {
    let inside = Inside { rule, surface: SurfaceFaces::Boundary };
    let solid = SolidMesh::with_inside(mesh.clone(), inside).expect("a solid");
    let asset = encoded(&solid);
    let ids: Vec<u32> = (0..asset.face_count()).map(|at| asset.face_id(at)).collect();
    for (at, &id) in ids.iter().enumerate() {
        let [mut stored, mut own] = [asset.face_vertices(at), mesh.faces()[id as usize]];
        stored.sort_unstable();
        own.sort_unstable();
        assert_eq!(stored, own, "face {id}");
    }
    // Whether a face is surface, from points beside it: off the face by 1e-6, all over it.
    let brute = BruteInside::of_all(mesh, rule);
    let mut random = Random(3);
    let mut lies_within = 0;
    for face in 0..mesh.faces().len() as u32 {
        let [a, b, c] = mesh.triangle(face as usize);
        let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
        // Another face between the point and the face would tell nothing.
        let others = (0..mesh.faces().len() as u32).filter(|&f| f != face);
        let others = BruteInside::new(mesh, rule, others);
        let is_between = (0..50).any(|_| {
            let [u, v, w] = random.weights::<3>();
            let on = u * a + v * b + w * c;
            let beside = [1.0, -1.0].map(|s| on + s * 1e-6 * normal);
            let distance = others.distance(on);
            let alone = !(1e-9..=1e-5).contains(&distance);
            alone && brute.is_inside(beside[0]) != brute.is_inside(beside[1])
        });
        assert!(ids.contains(&face) || !is_between, "face {face} is left out");
        lies_within += u32::from(ids.contains(&face) && !is_between);
    }
    // A small part between inside and outside has no sample.
    assert!(5 * lies_within <= ids.len() as u32, "{lies_within} faces of the surface are within the solid");
    assert_exact(mesh, &asset, &BruteInside::new(mesh, rule, ids.into_iter()), n);
    asset
}

#[test]
fn the_boundary_leaves_out_faces_within_the_solid() {
    // Nested, apart, and cubes that share a side: the boundary is of whole faces.
    let nested = Parts::default().cube(DVec3::ZERO, 4.0, Outward).cube(DVec3::ONE, 1.0, Outward);
    let nested =
        nested.cube(DVec3::new(4.0, 0.0, 0.0), 4.0, Outward).cube(DVec3::splat(9.0), 1.0, Inward).mesh();
    for (rule, faces) in [(Winding, 20), (Nonzero, 32)] {
        let asset = assert_boundary(&nested, rule, 60);
        assert_eq!((asset.face_count(), asset.container().sections().count()), (faces, 11), "{rule:?}");
        assert_eq!(asset.container().version(), FORMAT_VERSION_OF_RULES);
    }
    // An odd number counts the nested cube as a cavity.
    assert_eq!(assert_boundary(&nested, Odd, 60).face_count(), 44);
}

#[test]
fn faces_partly_within_the_solid_stay_and_the_sign_counts_all_faces() {
    let mesh =
        Parts::default().cube(DVec3::ZERO, 2.0, Outward).cube(DVec3::new(1.0, 0.5, 0.25), 1.5, Outward);
    let mesh = mesh.cube(DVec3::new(1.25, 0.75, 0.5), 0.5, Outward).mesh();
    let inside = Inside { rule: Winding, surface: SurfaceFaces::Boundary };
    let solid = SolidMesh::with_inside(mesh.clone(), inside).expect("a solid");
    let partly = |d: &&tesdf::mesh::Defect| d.kind == DefectKind::PartlyBuried;
    assert_eq!(solid.warnings().iter().filter(partly).count(), 1, "{:?}", solid.warnings());
    let asset = assert_boundary(&mesh, Winding, 120);
    assert!(asset.face_count() < mesh.faces().len());
    assert_boundary(&mixed(), Nonzero, 60);
    assert_boundary(&mixed(), Odd, 60);
    // Walls within the overlap are left out, so its middle is deeper.
    let spheres =
        Parts { vertices: bowl(8, 8).vertices.iter().map(|&v| v + 0.7 * DVec3::X).collect(), ..bowl(8, 8) };
    let spheres = bowl(8, 8).add(&spheres.vertices, &spheres.faces, Outward).mesh();
    let asset = assert_boundary(&spheres, Winding, 40);
    let middle = DVec3::new(0.35, 0.0, 0.0);
    let [boundary, all] = [asset.signed_distance(middle), encode(&spheres, Winding).signed_distance(middle)];
    assert!(boundary < all - 0.05, "{boundary} {all}");
}

/// A cube that is folded and inside out: its faces 0 and 11 lie on each other, and the inside is
/// the 1e-31 between them.
#[test]
fn a_boundary_of_one_face_is_stored_with_both_sides() {
    let vertices = [
        DVec3::ZERO,
        DVec3::X,
        DVec3::Y,
        DVec3::new(-1.0, -0.75, 0.5),
        DVec3::new(1.8186903903260827, 1e-31, -5.0000000000000005e-61),
        DVec3::new(0.925, -0.3, 1.3),
        DVec3::new(-0.25, -0.75, -0.75),
        DVec3::ONE,
    ];
    let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let faces = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let mesh = TriangleMesh::new(vertices.to_vec(), faces).expect("a mesh");
    let inside = Inside { rule: Winding, surface: SurfaceFaces::Boundary };
    let asset = encoded(&SolidMesh::with_inside(mesh.clone(), inside).expect("a solid"));
    let ids: Vec<u32> = (0..asset.face_count()).map(|at| asset.face_id(at)).collect();
    assert_eq!(ids, [11, 11]);
    // Points that lie on the fold itself may be on either side of it.
    assert_verified(&asset);
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

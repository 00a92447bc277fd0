//! Bodies whose faces do not enclose them: mass properties against formulas and sums over points,
//! and a sheet that falls.
#[path = "../../../tesdf/tests/it/support/parts.rs"]
#[allow(dead_code, reason = "each test program uses its part")]
mod parts;

use parts::Parts;
use parts::Turn::Outward;
use tesdf::base::{Inside, InsideRule, SurfaceFaces};
use tesdf::collide::{CollideOptions, Instance, Mode, Pose, Shape, detect};
use tesdf::encode::{Encoder, Preset};
use tesdf::glam::{DMat3, DQuat, DVec3};
use tesdf::mesh::{SolidMesh, TriangleMesh};
use tesdf_sim::newton::{Newton, NewtonOptions};
use tesdf_sim::{Dynamics, Mass, MassProperties, State, System};

fn shape(mesh: TriangleMesh, inside: impl Into<Inside>) -> Shape {
    let solid = SolidMesh::with_inside(mesh, inside.into()).expect("a solid");
    Shape::from(Encoder::new().preset(Preset::Fast).encode(&solid).expect("encodes"))
}

/// A sum over the boxes of a grid, at their centres.
fn by_grid(shape: &Shape, cells: u32) -> MassProperties {
    let Shape::Mesh(asset) = shape else { panic!("a mesh") };
    let bounds = shape.bounds();
    let edge = bounds.extent() / f64::from(cells);
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(cells);
    let points: Vec<DVec3> = (0..cells.pow(3))
        .map(|k| {
            bounds.min
                + bounds.extent() * DVec3::new(at(k % cells), at(k / cells % cells), at(k / cells / cells))
        })
        .filter(|p| asset.query(*p).signed_distance < 0.0)
        .collect();
    let volume = edge.element_product();
    let center = points.iter().sum::<DVec3>() / points.len() as f64;
    let moment = |p: &DVec3| {
        let r = *p - center;
        DMat3::from_diagonal(DVec3::splat(r.length_squared())) - DMat3::from_cols(r * r.x, r * r.y, r * r.z)
    };
    let inertia = volume * points.iter().map(moment).sum::<DMat3>();
    MassProperties { mass: volume * points.len() as f64, center, inertia }
}

/// The largest difference, relative to the size and the mass.
fn difference(a: &MassProperties, b: &MassProperties) -> f64 {
    let size = (a.inertia.x_axis.x / a.mass).sqrt();
    let inertia = (a.inertia - b.inertia).to_cols_array().into_iter().map(f64::abs).fold(0.0, f64::max);
    let relative = [a.mass / b.mass - 1.0, a.center.distance(b.center) / size, inertia / a.inertia.x_axis.x];
    relative.into_iter().map(f64::abs).fold(0.0, f64::max)
}

/// Two cubes of volume 1 that share one of 0.6³.
fn overlap() -> TriangleMesh {
    Parts::default().cube(DVec3::ZERO, 1.0, Outward).cube(DVec3::splat(0.4), 1.0, Outward).mesh()
}

#[test]
fn solids_told_by_a_rule_have_the_mass_of_each_place_once() {
    let shared = 0.6f64.powi(3);
    let boundary = |rule| Inside { rule, surface: SurfaceFaces::Boundary };
    for (inside, expected) in [
        (boundary(InsideRule::Winding), 2.0 - shared),
        (boundary(InsideRule::Nonzero), 2.0 - shared),
        (InsideRule::Odd.into(), 2.0 - 2.0 * shared),
    ] {
        let found = MassProperties::of_shape(&shape(overlap(), inside), 1.0, 1.0).expect("a mass");
        assert!((found.mass / expected - 1.0).abs() < 1e-3, "{inside}: {} of {expected}", found.mass);
        assert!(found.center.distance(DVec3::splat(0.7)) < 1e-3, "{inside}: {found:?}");
        // Along the diagonal both are alike, so all axes are.
        let inertia = found.inertia;
        assert!((inertia.x_axis.x - inertia.z_axis.z).abs() < 1e-3 * inertia.x_axis.x);
    }
}

#[test]
fn turned_solids_have_the_mass_of_a_sum_over_points() {
    let turned = Parts::default()
        .cube(DVec3::ZERO, 1.0, Outward)
        .cube(DVec3::splat(0.3), 1.2, Outward)
        .turned()
        .mesh();
    let shape = shape(turned, InsideRule::Odd);
    let found = MassProperties::of_shape(&shape, 1.0, 1.0).expect("a mass");
    let apart = difference(&found, &by_grid(&shape, 90));
    assert!(apart < 5e-3, "{apart}; {found:?}");
}

/// From the plane of a flat hole, the faces take half of the sphere. So the inside ends there.
#[test]
fn an_open_cube_has_the_mass_of_the_cube() {
    let open = Parts::default().open_cube(DVec3::splat(-0.5), 1.0, Outward).turned().mesh();
    let found = MassProperties::of_shape(&shape(open, InsideRule::Generalized), 1.0, 1.0).expect("a mass");
    let half_extents = DVec3::splat(0.5);
    let expected = MassProperties::of_shape(&Shape::Box { half_extents }, 1.0, 1.0).expect("a mass");
    let apart = difference(&found, &expected);
    assert!(apart < 6e-3, "{apart}; {found:?}");
}

#[test]
fn a_flat_sheet_has_the_mass_of_a_plate() {
    let (length, thickness) = (0.8, 0.02);
    let found = MassProperties::of_shape(&plate(length, thickness), 1.0, 500.0).expect("a mass");
    let half_extents = 0.5 * DVec3::new(length, length, thickness);
    let expected = MassProperties::of_shape(&Shape::Box { half_extents }, 1.0, 500.0).expect("a mass");
    assert!(difference(&found, &expected) < 1e-12, "{found:?} instead of {expected:?}");
}

fn plate(edge: f64, thickness: f64) -> Shape {
    shape(Parts::default().plate(edge).mesh(), InsideRule::Sheet { thickness })
}

/// A sheet comes to rest on the ground, half of its thickness above it.
#[test]
fn a_sheet_that_falls_lies_on_the_ground() {
    let thickness = 0.02;
    let mut system = System::new(-9.81 * DVec3::Z);
    let ground = system.add_shape(Shape::Plane).expect("a shape");
    system.add("ground", Instance::new(ground, Pose::IDENTITY), Mass::Fixed).expect("a body");
    let sheet = plate(0.8, thickness);
    let mass = Mass::Free(MassProperties::of_shape(&sheet, 1.0, 500.0).expect("a mass"));
    let sheet = system.add_shape(sheet).expect("a shape");
    let tilted = DQuat::from_rotation_x(0.2) * DQuat::from_rotation_y(0.1);
    let pose = Pose::new(0.2 * DVec3::Z, tilted).expect("a pose");
    let body = system.add("sheet", Instance::new(sheet, pose), mass).expect("a body");
    let collide = CollideOptions { contact_distance: 2e-3, ..CollideOptions::with_mode(Mode::Node) };
    let mut engine = Newton::new(system, detect, collide, NewtonOptions::default()).expect("options");
    for _ in 0..300 {
        engine.step(5e-3).expect("a step");
    }
    let State { pose, linear, angular } = engine.system().states()[body];
    assert!((pose.translation.z - 0.5 * thickness).abs() < 1e-4, "{pose:?}");
    assert!(linear.length() < 1e-3 && angular.length() < 1e-3, "{linear} {angular}");
    assert!((pose.rotation * DVec3::Z).z > 0.999_999, "{pose:?}");
}

//! Pictures of scenes: what is seen where, and what the binary says.
mod folder;

use std::path::Path;

use folder::{Folder, texts};
use tesdf::collide::{Contact, FeatureB, FeatureId, InstanceId, Placement, Pose, Scene, Shape};
use tesdf::glam::DVec3;
use tesdf_cli::render::{Cut, Drawn, Exposure, HalfSpace, RenderError, Scenery, View, linear, render};
use tiny_skia::Pixmap;

const RED: [u8; 3] = [220, 40, 40];
const GREEN: [u8; 3] = [40, 190, 60];
const TETRAHEDRON: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
/// From the front: x to the right, z upwards.
const FRONT: View = View { azimuth: -90.0, elevation: 0.0, field_of_view: None, zoom: 1.0, target: None };

fn drawn(shape: &Shape, at: DVec3, rgb: [u8; 3], exposure: Exposure) -> Drawn<'_> {
    Drawn { shape, placement: Placement { pose: Pose::at(at), scale: 1.0 }, colour: linear(rgb), exposure }
}

/// Pixels that are clearly red, clearly green, and neither.
fn hues(map: &Pixmap) -> [usize; 3] {
    map.pixels().iter().fold([0; 3], |mut counts, p| {
        let (r, g) = (i32::from(p.red()), i32::from(p.green()));
        counts[if r > g + 30 {
            0
        } else if g > r + 30 {
            1
        } else {
            2
        }] += 1;
        counts
    })
}

fn hue_at(map: &Pixmap, x: u32, y: u32) -> char {
    let p = map.pixel(x, y).unwrap();
    let (r, g) = (i32::from(p.red()), i32::from(p.green()));
    if r > g + 30 {
        'r'
    } else if g > r + 30 {
        'g'
    } else {
        '-'
    }
}

#[test]
fn a_sphere_covers_its_disc_and_the_nearer_body_hides_the_other() {
    let (ball, block) = (Shape::Sphere { radius: 1.0 }, Shape::Box { half_extents: DVec3::splat(0.5) });
    let cut = Cut::default();
    let bodies = [
        drawn(&ball, DVec3::ZERO, RED, Exposure::Whole),
        drawn(&block, DVec3::new(0.0, -3.0, 0.0), GREEN, Exposure::Whole),
    ];
    let picture =
        |bodies: &[Drawn]| render(&Scenery { bodies, cut: &cut, contacts: &[] }, &FRONT, [200, 200]).unwrap();
    // Fitted: the radius is 44 % of the side, the block half of it.
    let disc = std::f64::consts::PI * 88.0 * 88.0;
    let [red, green, _] = hues(&picture(&bodies[..1]));
    assert!((red as f64 - disc).abs() < 0.02 * disc && green == 0, "{red} {green}, {disc}");
    let [red, green, _] = hues(&picture(&bodies));
    assert!((green as f64 - 88.0 * 88.0).abs() < 400.0, "{green}");
    assert!((red as f64 - (disc - 88.0 * 88.0)).abs() < 0.03 * disc, "{red}");
}

#[test]
fn a_cut_opens_what_it_should_and_shows_overlaps() {
    let (outer, inner) = (Shape::Box { half_extents: DVec3::ONE }, Shape::Sphere { radius: 0.5 });
    // In front of the plane y = 0 the box is removed, the ball in it is not.
    let cut = Cut(vec![HalfSpace::new(DVec3::NEG_Y, 0.0).unwrap()]);
    let at = |ball: Exposure, x: u32, y: u32| {
        let bodies = [
            drawn(&outer, DVec3::ZERO, GREEN, Exposure::Cut),
            drawn(&inner, DVec3::ZERO, [60, 60, 220], ball),
        ];
        let map = render(&Scenery { bodies: &bodies, cut: &cut, contacts: &[] }, &FRONT, [200, 200]).unwrap();
        hue_at(&map, x, y)
    };
    assert_eq!([at(Exposure::Whole, 100, 100), at(Exposure::Whole, 30, 40)], ['-', 'g']);
    // Where both are cut, both are inside of the ball: red.
    assert_eq!([at(Exposure::Cut, 110, 100), at(Exposure::Cut, 30, 40)], ['r', 'g']);
}

#[test]
fn contacts_are_drawn_on_top_and_fainter_behind_a_body() {
    let block = Shape::Box { half_extents: DVec3::ONE };
    let mut scene = Scene::new();
    let shape = scene.add_shape(block.clone()).unwrap();
    let id: InstanceId = scene.add(tesdf::collide::Instance::new(shape, Pose::IDENTITY)).unwrap();
    let contact = |p: DVec3| Contact {
        point_a: p,
        point_b: p,
        normal: p.normalize(),
        distance: 0.0,
        face_a: 0,
        face_b: 0,
        tet_b: None,
        instance_a: id,
        instance_b: id,
        feature: FeatureId { a: 0, b: FeatureB::Face(0) },
        converged: true,
    };
    let cut = Cut::default();
    let bodies = [drawn(&block, DVec3::ZERO, GREEN, Exposure::Whole)];
    let redness = |contacts: &[Contact]| {
        let map = render(&Scenery { bodies: &bodies, cut: &cut, contacts }, &FRONT, [400, 400]).unwrap();
        let p = map.pixel(200, 200).unwrap();
        i32::from(p.red()) - i32::from(p.green())
    };
    let [bare, front, back] =
        [redness(&[]), redness(&[contact(DVec3::NEG_Y)]), redness(&[contact(DVec3::Y)])];
    assert!(bare < back && back < front && front > 100, "{bare} {back} {front}");
}

#[test]
fn what_cannot_be_drawn_is_an_error() {
    let cut = Cut::default();
    let floor = [drawn(&Shape::Plane, DVec3::ZERO, RED, Exposure::Whole)];
    let fails = |bodies: &[Drawn], size| {
        render(&Scenery { bodies, cut: &cut, contacts: &[] }, &FRONT, size).map(|_| ()).unwrap_err()
    };
    assert!(matches!(fails(&floor, [100, 100]), RenderError::Nothing));
    assert!(matches!(fails(&[], [100, 100]), RenderError::Nothing));
    assert!(matches!(fails(&floor, [100, 9]), RenderError::Size([100, 9])));
}

fn with_threads(folder: &Folder, threads: &str, args: &[&str]) -> Vec<u8> {
    let out = folder.command(args).env("RAYON_NUM_THREADS", threads).output().unwrap();
    assert_eq!(texts(out), (Some(0), String::new(), String::new()), "{args:?}");
    std::fs::read(folder.path("p.png")).unwrap()
}

#[test]
fn the_binary_draws_the_same_bytes_on_any_number_of_threads() {
    let folder = Folder::new();
    folder.write("t.obj", TETRAHEDRON);
    folder.good(&["encode", "t.obj", "-o", "t.tesdf", "--preset", "fast"]);
    let args = [
        "render",
        "t.tesdf",
        "t.tesdf",
        "capsule:0.5,0.2",
        "plane",
        "-o",
        "p.png",
        "--pose",
        "0 0 0 0 0 0 1",
        "--pose",
        "-1.5 0 0.5 0 0 -0.6 0.8",
        "--pose",
        "0,0,2,0,0,0,1",
        "--pose",
        "0 0 -0.5 0 0 0 1",
        "--cut",
        "-0.2 -1 0 -0.5",
        "--cut-bodies",
        "0,2",
        "--size",
        "120x90",
        "--view",
        "-50 20",
        "--field-of-view",
        "40",
    ];
    let png = with_threads(&folder, "1", &args);
    assert!(png == with_threads(&folder, "2", &args));
    let map = Pixmap::decode_png(&png).unwrap();
    assert_eq!((map.width(), map.height()), (120, 90));
    let mut colours: Vec<_> = map.pixels().iter().map(|p| (p.red(), p.green(), p.blue())).collect();
    colours.sort_unstable();
    colours.dedup();
    assert!(colours.len() > 200, "{} colours", colours.len());
    assert_eq!(folder.names(), ["p.png", "t.obj", "t.tesdf"]);
}

#[test]
fn bad_arguments_are_2_and_leave_no_file() {
    let folder = Folder::new();
    folder.write("bad.tesdf", "no asset");
    for (args, expected) in [
        (&["--cut", "0 0 0 1"][..], "has no direction"),
        (&["--cut", "0 0 1"], "3 numbers; expected four"),
        (&["--cut-bodies", "0"], "--cut <nx ny nz d>"),
        (&["--cut", "1 0 0 0", "--cut-bodies", "0,3"], "--cut-bodies names 3; the bodies are 0 to 1"),
        (&["--pose", "0 0 0 0 0 0 1"], "--pose is given 1 times for 2 bodies"),
        (&["--pose", "0 0 0 0 0 0 -3"], "of length 3"),
        (&["--view", "0 100"], "elevation 100 is not between -90 and 90"),
        (&["--size", "4x400"], "a picture of 4x400 pixels"),
        (&["--size", "big"], "expected WIDTHxHEIGHT"),
        (&["--zoom", "-1"], "-1 is not greater than 0"),
        (&["box:1,1"], "2 numbers; expected three"),
        (&["missing.tesdf"], "missing.tesdf"),
        (&["bad.tesdf"], "bad.tesdf"),
    ] {
        let all = [&["render", "sphere:1", "plane", "-o", "p.png"][..], args].concat();
        let (code, out, err) = folder.tesdf(&all);
        assert_eq!((code, out.as_str()), (Some(2), ""), "{args:?}: {err}");
        assert!(err.contains(expected), "{args:?}: {err}");
    }
    assert!(!Path::exists(&folder.path("p.png")));
}

//! Pictures of scenes, and the messages of `tesdf render`.

use std::path::Path;

use crate::folder::{Folder, texts};
use tesdf::collide::{Placement, Pose, Shape};
use tesdf::glam::DVec3;
use tesdf_cli::render::{
    ContactMark, Cut, Drawn, Exposure, HalfSpace, RenderError, Scenery, View, linear, render,
};
use tesdf_sim::RunRecord;
use tiny_skia::Pixmap;

const RED: [u8; 3] = [220, 40, 40];
const GREEN: [u8; 3] = [40, 190, 60];
const TETRAHEDRON: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
/// A view from the front, with x to the right and z upwards.
const FRONT: View = View { azimuth: -90.0, elevation: 0.0, field_of_view: None, zoom: 1.0, target: None };

fn drawn(shape: &Shape, at: DVec3, rgb: [u8; 3], exposure: Exposure) -> Drawn<'_> {
    Drawn { shape, placement: Placement { pose: Pose::at(at), scale: 1.0 }, colour: linear(rgb), exposure }
}

/// Numbers of pixels that are clearly red, clearly green, and neither.
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
    // In the fitted picture the radius of the sphere is 44 % of the side, and the block is half as
    // large as the sphere.
    let disc = std::f64::consts::PI * 88.0 * 88.0;
    let [red, green, _] = hues(&picture(&bodies[..1]));
    assert!((red as f64 - disc).abs() < 0.02 * disc && green == 0, "{red} {green}, {disc}");
    let [red, green, _] = hues(&picture(&bodies));
    assert!((green as f64 - 88.0 * 88.0).abs() < 400.0, "{green}");
    assert!((red as f64 - (disc - 88.0 * 88.0)).abs() < 0.03 * disc, "{red}");
}

#[test]
fn a_cut_opens_the_chosen_bodies_and_shows_overlaps() {
    let (outer, inner) = (Shape::Box { half_extents: DVec3::ONE }, Shape::Sphere { radius: 0.5 });
    // In front of the plane y = 0 the box is removed. The ball inside it is not removed.
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
    // When both are cut, the point is in the overlap of both sections, which is red.
    assert_eq!([at(Exposure::Cut, 110, 100), at(Exposure::Cut, 30, 40)], ['r', 'g']);
}

#[test]
fn contacts_are_drawn_on_top_and_fainter_behind_a_body() {
    let block = Shape::Box { half_extents: DVec3::ONE };
    let contact = |p: DVec3| ContactMark { point: p, normal: p.normalize() };
    let cut = Cut::default();
    let bodies = [drawn(&block, DVec3::ZERO, GREEN, Exposure::Whole)];
    let redness = |contacts: &[ContactMark]| {
        let map = render(&Scenery { bodies: &bodies, cut: &cut, contacts }, &FRONT, [400, 400]).unwrap();
        let p = map.pixel(200, 200).unwrap();
        i32::from(p.red()) - i32::from(p.green())
    };
    let [bare, front, back] =
        [redness(&[]), redness(&[contact(DVec3::NEG_Y)]), redness(&[contact(DVec3::Y)])];
    assert!(bare < back && back < front && front > 100, "{bare} {back} {front}");
}

#[test]
fn empty_pictures_and_invalid_sizes_are_errors() {
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

/// A ball falls by 14 of its radii beside a fixed body.
const DROP: &str = r#"
time_step = 0.05
duration = 0.5

[[bodies]]
name = "ball"
shape = { sphere = { radius = 0.1 } }
density = 1000
translation = [0, 0, 2]

[[bodies]]
name = "block"
mesh = "meshes/t.obj"
fixed = true
translation = [1, 0, 0]

[record]
contacts_every = 4
"#;

#[test]
fn a_run_is_drawn_at_a_time_like_its_bodies_by_hand() {
    let folder = Folder::new();
    std::fs::create_dir_all(folder.path("scene/meshes")).unwrap();
    folder.write("scene/meshes/t.obj", TETRAHEDRON);
    folder.write("scene/drop.toml", DROP);
    folder.good(&["encode", "scene/meshes/t.obj", "-o", "t.tesdf", "--preset", "fast"]);
    folder.good(&["simulate", "scene/drop.toml", "-o", "run"]);
    let picture = |args: &[&str]| {
        let common = ["-o", "p.png", "--size", "90x90", "--target", "0.5 0 1"];
        folder.good(&[&["render"][..], args, &common].concat());
        std::fs::read(folder.path("p.png")).unwrap()
    };
    let record = RunRecord::open(folder.path("run")).unwrap();
    let by_hand = |step: usize| {
        let z = record.pose(step, 0).unwrap().translation.z;
        let pose = format!("0 0 {z:?} 0 0 0 1");
        picture(&["sphere:0.1", "t.tesdf", "--pose", &pose, "--pose", "1 0 0 0 0 0 1"])
    };
    let end = by_hand(10);
    assert!(end != by_hand(4), "the ball falls");
    assert!(end == picture(&["--run", "run"]), "the end");
    assert!(by_hand(4) == picture(&["--run", "run", "--time", "0.21"]), "the nearest step");
    // Contacts are recorded at the steps 0, 4 and 8; there are none.
    assert!(by_hand(8) == picture(&["--run", "run", "--contacts"]), "the nearest step with contacts");

    std::fs::rename(folder.path("scene"), folder.path("elsewhere")).unwrap();
    let (code, _, err) = folder.tesdf(&["render", "--run", "run", "-o", "p.png"]);
    assert!(code == Some(2) && err.contains("body block") && err.contains("--geometry BODY=FILE"), "{err}");
    assert!(end == picture(&["--run", "run", "--geometry", "block=t.tesdf"]), "geometry that moved");
}

#[test]
fn contacts_of_a_run_are_drawn_where_they_are() {
    let folder = Folder::new();
    let rest = DROP.replace("translation = [0, 0, 2]", "translation = [0, 0, 0.1]").replace(
        "mesh = \"meshes/t.obj\"\nfixed = true\ntranslation = [1, 0, 0]",
        "shape = \"plane\"\nfixed = true",
    );
    folder.write("rest.toml", rest);
    folder.good(&["simulate", "rest.toml", "-o", "run"]);
    let common =
        ["render", "--run", "run", "-o", "p.png", "--size", "300x300", "--view", "-90 -30", "--time", "0.2"];
    let redness = |args: &[&str]| {
        folder.good(&[&common[..], args].concat());
        let map = Pixmap::load_png(folder.path("p.png")).unwrap();
        map.pixels().iter().filter(|p| i32::from(p.red()) > i32::from(p.green().max(p.blue())) + 60).count()
    };
    let [bare, marked] = [redness(&[]), redness(&["--contacts"])];
    assert!(marked > bare, "{bare} {marked}");

    let no_contacts = std::fs::read_to_string(folder.path("rest.toml")).unwrap().replace("= 4", "= 0");
    folder.write("rest.toml", no_contacts);
    folder.good(&["simulate", "rest.toml", "-o", "run"]);
    let (code, _, err) = folder.tesdf(&[&common[..], &["--contacts"]].concat());
    assert!(code == Some(2) && err.contains("contacts_every"), "{err}");
}

#[test]
fn bad_arguments_exit_with_2_and_leave_no_file() {
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
        (&["--time", "1"], "--run <RUN>"),
        (&["--run", "run"], "cannot be used with"),
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

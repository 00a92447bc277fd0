//! Pictures of `tesdf slice` for solids whose distance is a formula.
use tesdf::glam::{DVec2, DVec3};
use tesdf_cli::slice::{
    Axis, CellLabel, CellOutline, Deviation, Overlay, View, cut_tetrahedron, cut_triangle, draw, draw_error,
};

const MAJOR: f64 = 10.0;
const MINOR: f64 = 4.0;

fn torus(p: DVec3) -> f64 {
    (p.truncate().length() - MAJOR).hypot(p.z) - MINOR
}

fn torus_point(i: u32, j: u32, [n, m]: [u32; 2]) -> DVec3 {
    let angle = |i: u32, n: u32| f64::from(i % n) / f64::from(n) * std::f64::consts::TAU;
    let (u, v) = (angle(i, n), angle(j, m));
    let r = MAJOR + MINOR * v.cos();
    DVec3::new(r * u.cos(), r * u.sin(), MINOR * v.sin())
}

/// The triangles of the torus, and the six tetrahedra of each cube of a grid around it, cut by the
/// plane.
fn overlay(view: &View) -> Overlay {
    let mut overlay = Overlay::default();
    let counts @ [n, m] = [160, 64];
    for (i, j) in (0..n).flat_map(|i| (0..m).map(move |j| (i, j))) {
        let [a, b, c, d] =
            [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(di, dj)| torus_point(i + di, j + dj, counts));
        let cuts = [[a, b, c], [a, c, d]];
        overlay.surface.extend(cuts.into_iter().filter_map(|t| cut_triangle(view.axis, view.offset, t)));
    }
    let edge = 1.25;
    for cell in 0..24 * 24 * 24 {
        let corner = DVec3::new(f64::from(cell % 24), f64::from(cell / 24 % 24), f64::from(cell / 576))
            * edge
            - DVec3::splat(12.0 * edge);
        for [i, j, k] in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
            let mut p = [corner; 4];
            for (step, axis) in [i, j, k].into_iter().enumerate() {
                p[step + 1..].iter_mut().for_each(|p| p[axis] += edge);
            }
            let label = match p.map(torus) {
                d if d.iter().all(|&d| d < 0.0) => CellLabel::Inside,
                d if d.iter().all(|&d| d > 0.0) => CellLabel::Outside,
                _ => CellLabel::Crossing,
            };
            if let Some(polygon) = cut_tetrahedron(view.axis, view.offset, p) {
                overlay.cells.push(CellOutline { polygon, label });
            }
        }
    }
    overlay
}

fn view(axis: Axis) -> View {
    let half = DVec3::new(MAJOR + MINOR, MAJOR + MINOR, MINOR);
    let mut view = View::of_box(axis, 0.3, -half, half);
    view.unit = "mm".into();
    view.title = "torus.tesdf".into();
    view
}

fn decoded(png: &[u8]) -> tiny_skia::Pixmap {
    tiny_skia::Pixmap::decode_png(png).unwrap()
}

#[test]
fn torus_is_warm_inside_blue_outside_and_dark_on_the_surface() {
    let view = view(Axis::Z);
    let png = draw(&view, &overlay(&view), 1200, torus).unwrap();
    if let Some(path) = std::env::var_os("TESDF_WRITE_PICTURE") {
        std::fs::write(path, &png).unwrap();
    }
    let map = decoded(&png);
    assert_eq!(map.width().max(map.height()), 1200);
    let counts = map.pixels().iter().fold([0_usize; 3], |[warm, blue, dark], p| {
        let (r, b) = (i32::from(p.red()), i32::from(p.blue()));
        [warm + usize::from(r > b + 20), blue + usize::from(b > r + 20), dark + usize::from(r + b < 90)]
    });
    // The torus fills pi * (14^2 - 6^2) / (28 + margin)^2 of the plot.
    let area = std::f64::consts::PI * (196.0 - 36.0) / (view.max - view.min).element_product();
    let share = counts[0] as f64 / (counts[0] + counts[1]) as f64;
    assert!((share - area).abs() < 0.02, "{share} of the plot is warm; expected {area}");
    assert!(counts[2] > 4000, "{} dark pixels", counts[2]);
}

#[test]
fn long_cuts_and_every_axis_and_size_are_drawn() {
    for (axis, size) in [(Axis::X, 256), (Axis::Y, 700)] {
        let mut view = view(axis);
        view.offset = 8.0;
        view.title = "a very long file name with characters that the font lacks: 面 ".repeat(9);
        let map = decoded(&draw(&view, &Overlay::default(), size, torus).unwrap());
        assert_eq!(map.width().max(map.height()), size);
    }
    let needle = View::of_box(Axis::Z, 0.0, DVec3::ZERO, DVec3::new(1e-6, 1e3, 1.0));
    let map = decoded(&draw(&needle, &Overlay::default(), 600, |p| p.length() - 100.0).unwrap());
    assert_eq!(map.height(), 600);
}

#[test]
fn invalid_sizes_and_views_are_errors() {
    let draw = |view: &View, size| draw(view, &Overlay::default(), size, torus).map_err(|e| e.to_string());
    let good = view(Axis::Z);
    assert_eq!(draw(&good, 10).unwrap_err(), "a picture of 10 pixels; expected 256 to 8192");
    for max in [good.min, DVec2::NAN, DVec2::INFINITY, good.min + 1e-17] {
        let bad = View { max, ..good.clone() };
        assert!(draw(&bad, 400).unwrap_err().contains("has no area"), "{max}");
    }
}

#[test]
fn distances_that_are_not_finite_stay_grey() {
    let png = draw(&view(Axis::Z), &Overlay::default(), 300, |p| if p.x > 0.0 { f64::NAN } else { torus(p) });
    assert!(decoded(&png.unwrap()).pixels().iter().any(|p| [p.red(), p.green(), p.blue()] == [200; 3]));
}

#[test]
fn errors_are_red_where_they_are_and_nowhere_else() {
    let view = view(Axis::Z);
    // The error is 1 in the half with x > 0, deeper than 2 below the surface.
    let is_off = |p: DVec3| p.x > 0.0 && torus(p) < -2.0;
    let deviation = |p: DVec3| {
        let error = if is_off(p) { 1.0 } else { 1e-9 };
        (p.y.abs() < MAJOR).then_some(Deviation { exact: torus(p), error })
    };
    let map = decoded(&draw_error(&view, &Overlay::default(), 600, 1e-6, deviation).unwrap());
    let count = |pick: &dyn Fn([i32; 3]) -> bool| {
        let of = |p: &tiny_skia::PremultipliedColorU8| [p.red(), p.green(), p.blue()].map(i32::from);
        map.pixels().iter().filter(|p| pick(of(p))).count() as f64
    };
    let (red, green) = (count(&|[r, _, b]| r == 142 && b == 32), count(&|rgb| rgb == [214, 232, 220]));
    // The expected numbers of pixels, from samples of the plot.
    let extent = view.max - view.min;
    let points = (0..400 * 400).map(|i| {
        let share = DVec2::new(f64::from(i % 400) + 0.5, f64::from(i / 400) + 0.5) / 400.0;
        view.axis.point(view.offset, view.min + share * extent)
    });
    let off = points.clone().filter(|&p| p.y.abs() < MAJOR && is_off(p)).count() as f64;
    let exact = points.filter(|&p| p.y.abs() < MAJOR && !is_off(p)).count() as f64;
    assert!((red / green / (off / exact) - 1.0).abs() < 0.1, "{red} {green} {off} {exact}");
}

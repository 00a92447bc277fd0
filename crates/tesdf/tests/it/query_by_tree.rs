//! The face tree gives the same distances, sides and gradients as the lists.

use crate::support::meshes::{encoded, named};
use crate::support::random::Random;
use tesdf::query::Precision;

#[test]
fn queries_by_tree_and_by_lists_agree() {
    for file in ["procedural/cube.obj", "procedural/shaft_keyway.obj", "procedural/lobed_peg.obj"] {
        let solid = named(file);
        let (bounds, diagonal) = (solid.mesh().bounds(), solid.mesh().diagonal());
        let asset = encoded(&solid);
        let mut random = Random(1);
        for i in 0..4000 {
            let share = random.in_cube() * if i % 4 == 0 { 4.0 } else { 0.6 };
            let mut p = bounds.center() + share * bounds.extent();
            if i % 3 == 0 {
                // Close to the surface.
                let at = asset.query(p);
                p = at.closest_point + random.power(-9.0, -2.0) * diagonal * at.gradient;
            }
            for (precision, of_diagonal) in [(Precision::F32, 1e-6), (Precision::F64, 1e-12)] {
                let (tree, list) = (asset.query_by_tree_with(p, precision), asset.query_with(p, precision));
                let error = 2.0 * of_diagonal * diagonal;
                let (a, b) = (tree.signed_distance, list.signed_distance);
                assert!((a.abs() - b.abs()).abs() <= error, "{file} {p} {precision:?}: {a}, {b}");
                assert!((a - b).abs() <= 2.0 * error, "{file} {p} {precision:?}: {a}, {b}");
                assert!((tree.gradient.length() - 1.0).abs() < 1e-6, "{file} {p} {precision:?}: {tree:?}");
            }
        }
        let p = bounds.center();
        assert!(asset.reads_by_tree(p).tree_faces >= 1 && asset.reads_by_tree(p).list_entries == 0);
        assert!(asset.query_by_tree_f32(p * f64::NAN).signed_distance.is_nan());
    }
}

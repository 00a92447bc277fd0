//! Batches into arrays give the answers of single queries, for any number of points, inside and
//! outside the domain.

use crate::support::meshes::{encoded, named};
use crate::support::random::Random;
use tesdf::TeSdf;
use tesdf::glam::DVec3;
use tesdf::query::{Answer, AnswerColumns, BatchError, Extent, Precision};

struct Columns {
    signed_distance: Vec<f64>,
    gradient: Vec<[f64; 3]>,
    closest_point: Vec<[f64; 3]>,
    face: Vec<u32>,
}

impl Columns {
    fn new(rows: usize) -> Self {
        Self {
            signed_distance: vec![7.0; rows],
            gradient: vec![[7.0; 3]; rows],
            closest_point: vec![[7.0; 3]; rows],
            face: vec![7; rows],
        }
    }

    fn as_mut(&mut self) -> AnswerColumns<'_> {
        AnswerColumns {
            signed_distance: &mut self.signed_distance,
            gradient: &mut self.gradient,
            closest_point: &mut self.closest_point,
            face: &mut self.face,
        }
    }

    /// Compares bits, so that NaN equals itself.
    fn is(&self, row: usize, answer: &Answer) -> bool {
        let bits = |v: [f64; 3]| v.map(f64::to_bits);
        self.signed_distance[row].to_bits() == answer.signed_distance.to_bits()
            && bits(self.gradient[row]) == bits(answer.gradient.to_array())
            && bits(self.closest_point[row]) == bits(answer.closest_point.to_array())
            && self.face[row] == answer.face
    }
}

fn asset() -> TeSdf {
    encoded(&named("procedural/shaft_keyway.obj"))
}

#[test]
fn columns_equal_the_answers() {
    let asset = asset();
    let bounds = asset.bounds();
    let mut random = Random(1);
    // More than two tasks of a batch, and not a multiple of the number of points that pass the
    // stages together.
    let mut points: Vec<DVec3> =
        (0..8195).map(|_| bounds.center() + 0.7 * random.in_cube() * bounds.extent()).collect();
    points[5].y = f64::NAN;
    let none = asset.query(points[5]);
    let mut asides = 0;
    for precision in [Precision::F32, Precision::F64] {
        let batch = asset.query_batch_with(&points, precision);
        let mut everywhere = Columns::new(points.len());
        asset.query_batch_into(&points, precision, Extent::Everywhere, everywhere.as_mut()).unwrap();
        let mut domain = Columns::new(points.len());
        asset.query_batch_into(&points, precision, Extent::Domain, domain.as_mut()).unwrap();
        let mut distances = vec![7.0; points.len()];
        asset.signed_distances_into(&points, precision, &mut distances).unwrap();
        for (i, answer) in batch.iter().enumerate() {
            assert!(everywhere.is(i, answer), "{precision:?} {i}: {answer:?}");
            assert_eq!(distances[i].to_bits(), answer.signed_distance.to_bits(), "{precision:?} {i}");
            let expected = asset.query_in_domain_with(points[i], precision);
            asides += usize::from(expected.is_none());
            assert!(domain.is(i, &expected.unwrap_or(none)), "{precision:?} {i}: {expected:?}");
        }
    }
    assert!((2000..2 * points.len() - 2000).contains(&asides), "{asides} answers are outside of the domain");

    assert_eq!(
        asset.query_batch_into(&[], Precision::F64, Extent::Everywhere, Columns::new(0).as_mut()),
        Ok(())
    );
}

/// Arrays of a wrong length are an error that names the array, and no row is written.
#[test]
fn columns_of_different_lengths_are_an_error() {
    let asset = asset();
    let points = [DVec3::ZERO; 20];
    for (column, rows) in [("signed_distance", 19), ("gradient", 21), ("closest_point", 0), ("face", 17)] {
        let lengths = ["signed_distance", "gradient", "closest_point", "face"]
            .map(|name| if name == column { rows } else { points.len() });
        let [mut d, mut g, mut c, mut f] = lengths.map(Columns::new);
        let columns = AnswerColumns {
            signed_distance: &mut d.signed_distance,
            gradient: &mut g.gradient,
            closest_point: &mut c.closest_point,
            face: &mut f.face,
        };
        let refused =
            asset.query_batch_into(&points, Precision::F64, Extent::Everywhere, columns).unwrap_err();
        assert_eq!(refused, BatchError { column, found: rows, expected: 20 });
        assert!(
            refused.to_string().contains(&format!("{column} has {rows} rows for 20 points")),
            "{refused}"
        );
        assert!(d.signed_distance.iter().all(|&d| d == 7.0) && f.face.iter().all(|&f| f == 7));
    }
    let mut distances = [7.0; 21];
    let refused = asset.signed_distances_into(&points, Precision::F32, &mut distances).unwrap_err();
    assert_eq!(refused, BatchError { column: "distances", found: 21, expected: 20 });
    assert_eq!(distances, [7.0; 21]);
}

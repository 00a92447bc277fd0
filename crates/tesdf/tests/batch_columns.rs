//! Batches into arrays give the answers of single queries, for any number of points, in and out of the domain.
mod support;

use support::meshes::named;
use support::random::Random;
use tesdf::asset::about::Source;
use tesdf::encode::{EncodeOptions, EncodeProgress, Preset, encode};
use tesdf::glam::DVec3;
use tesdf::query::{Answer, AnswerColumns, Extent, Precision};

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

    /// Bit by bit, so that NaN is equal to itself.
    fn is(&self, row: usize, answer: &Answer) -> bool {
        let bits = |v: [f64; 3]| v.map(f64::to_bits);
        self.signed_distance[row].to_bits() == answer.signed_distance.to_bits()
            && bits(self.gradient[row]) == bits(answer.gradient.to_array())
            && bits(self.closest_point[row]) == bits(answer.closest_point.to_array())
            && self.face[row] == answer.face
    }
}

#[test]
fn columns_are_the_answers() {
    let solid = named("procedural/shaft_keyway.obj");
    let (bounds, options) = (solid.mesh().bounds(), EncodeOptions::preset(Preset::Fast));
    let asset = encode(&solid, &Source::default(), &options, &EncodeProgress::default()).unwrap();
    let mut random = Random(1);
    // More than two tasks of a batch, and not a multiple of what goes through the stages together.
    let mut points: Vec<DVec3> =
        (0..8195).map(|_| bounds.center() + 0.7 * random.in_cube() * bounds.extent()).collect();
    points[5].y = f64::NAN;
    let none = asset.query(points[5], Precision::F64);
    let mut asides = 0;
    for precision in [Precision::F32, Precision::F64] {
        let batch = asset.query_batch(&points, precision);
        let mut everywhere = Columns::new(points.len());
        asset.query_batch_into(&points, precision, Extent::Everywhere, everywhere.as_mut());
        let mut domain = Columns::new(points.len());
        asset.query_batch_into(&points, precision, Extent::Domain, domain.as_mut());
        let mut distances = vec![7.0; points.len()];
        asset.signed_distances_into(&points, precision, &mut distances);
        for (i, answer) in batch.iter().enumerate() {
            assert!(everywhere.is(i, answer), "{precision:?} {i}: {answer:?}");
            assert_eq!(distances[i].to_bits(), answer.signed_distance.to_bits(), "{precision:?} {i}");
            let expected = asset.query_in_domain(points[i], precision);
            asides += usize::from(expected.is_none());
            assert!(domain.is(i, &expected.unwrap_or(none)), "{precision:?} {i}: {expected:?}");
        }
    }
    assert!((2000..2 * points.len() - 2000).contains(&asides), "{asides} answers are outside of the domain");

    let mut short = Columns::new(20);
    let columns = AnswerColumns { gradient: &mut [[0.0; 3]; 17], ..short.as_mut() };
    asset.query_batch_into(&points, Precision::F64, Extent::Everywhere, columns);
    let answered = short.signed_distance.iter().filter(|&&d| d != 7.0).count();
    assert_eq!((answered, short.face[17]), (17, 7), "as many points as the shortest column");
    asset.query_batch_into(&[], Precision::F64, Extent::Everywhere, short.as_mut());
}

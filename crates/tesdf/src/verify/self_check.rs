//! Compares a new encoding with brute force before it counts as proved.
use crate::parallel::*;
use glam::DVec3;

use super::brute_force::BruteForce;
use super::compare::{Comparison, Worst};
use super::true_sign::{TrueSign, signed, unshifted};
use super::{PointClass, mesh_of};
use crate::TeSdf;
use crate::asset::CellKind;
use crate::mesh::{MeshError, SolidMesh};
use crate::query::Precision;
use crate::sampling::Random;

/// Number of points in cells of one kind. The whole check takes 2 % of the encoding time.
const POINTS: usize = 128;
const SEED: u64 = 0x7e5d;
const KINDS: [CellKind; 6] = [
    CellKind::Outside,
    CellKind::Inside,
    CellKind::Crossing,
    CellKind::FarOutside,
    CellKind::FarInside,
    CellKind::NotOfDomain,
];

/// Finds an error in an encoding: the point with the largest error of distance or sign, among
/// points in cells of every kind. `None` when all points are within the promised bounds.
///
/// The expected values are the least distance over all faces of the surface, and the side by the
/// rule of `solid`, over all faces of its mesh. They use neither the lists nor the face tree.
pub(crate) fn self_check(asset: &TeSdf, solid: &SolidMesh) -> Result<Option<(Precision, Worst)>, MeshError> {
    let (mesh, _) = mesh_of(asset)?;
    let truth = BruteForce::new(&mesh, mesh.diagonal());
    let sign = TrueSign::new(solid.mesh().clone(), solid.inside().rule);
    let certificate = asset.about().certificate();
    let points = points(asset).into_par_iter();
    let expected: Vec<(DVec3, f64, Option<bool>)> =
        points.map(|p| (p, truth.distance(p), sign.is_inside(p))).collect();
    let mistake = |precision| {
        let mut comparison = Comparison::new(precision, &mesh, certificate);
        for &(point, distance, inside) in &expected {
            let answer = unshifted(asset, asset.query_with(point, precision));
            let expected = signed(distance, inside, &answer);
            comparison.add(PointClass::Box, point, expected, &answer, None);
        }
        Some(precision).zip(comparison.worst_broken())
    };
    Ok(mistake(Precision::F64).or_else(|| mistake(Precision::F32)))
}

/// Random points in cells of every kind. Half of them lie on the border of a cell.
fn points(asset: &TeSdf) -> Vec<DVec3> {
    let mut cells: [Vec<[DVec3; 4]>; KINDS.len()] = Default::default();
    asset.visit_cells(|cell| {
        let kind = KINDS.iter().position(|&kind| kind == cell.kind).unwrap_or(0);
        cells[kind].push(cell.corners);
    });
    let mut points = Vec::new();
    for (kind, cells) in cells.iter().enumerate().filter(|(_, cells)| !cells.is_empty()) {
        for index in 0..POINTS {
            let random = &mut Random::new(SEED + kind as u64, index as u64);
            let [a, b, c, d] = cells[random.below(cells.len())];
            points.push(if index % 2 == 0 {
                random.in_simplex(&[a, b, c, d])
            } else {
                random.in_simplex(&[a, b, c])
            });
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::asset::SharedSection;
    use crate::asset::layout::{Label, Node};
    use crate::base::Side;
    use crate::encode::Encoder;
    use crate::mesh::{MeshFormat, read_bytes};

    #[test]
    fn cells_with_a_wrong_side_are_found() {
        // An octahedron.
        let obj = "v 1 0 0\nv 0 1 0\nv -1 0 0\nv 0 -1 0\nv 0 0 1\nv 0 0 -1\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\nf 2 1 6\nf 3 2 6\n\
                   f 4 3 6\nf 1 4 6\n";
        let mesh = read_bytes(obj.as_bytes(), MeshFormat::Obj).expect("a mesh").mesh;
        let solid = SolidMesh::new(mesh).expect("a solid");
        let mut asset = Encoder::new().encode(&solid).expect("encodes");
        assert_eq!(self_check(&asset, &solid), Ok(None));
        // Mark all cells as outside.
        let mut nodes = asset.nodes.to_vec();
        for word in &mut nodes {
            *word = match Node::decode(*word, &asset.lists) {
                Node::Listed(_, offset) => Node::Listed(Label::Outside, offset).encode(),
                Node::Far(_) => Node::Far(Side::Outside).encode(),
                _ => *word,
            };
        }
        asset.nodes = SharedSection::of_rows(&nodes);
        let (precision, worst) = self_check(&asset, &solid).expect("a mesh").expect("it is wrong");
        assert!(precision == Precision::F64 && (worst.found - worst.expected).abs() > 0.01, "{worst:?}");
    }
}

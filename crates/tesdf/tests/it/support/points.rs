use tesdf::glam::DVec3;
use tesdf::mesh::TriangleMesh;

use super::cells::Cells;
use super::random::Random;

/// Placement of a point of [`sample`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Near the surface, within 2 % of the diagonal.
    Near,
    /// 1e-13 to 1e-1 diagonals from faces, edges and vertices, in any direction.
    Beside,
    Face,
    Edge,
    Vertex,
    CellBorder,
    /// Inside the bounds, also deep inside.
    Deep,
    /// Up to a few diagonals away.
    Outside,
    /// Up to 1e4 diagonals away.
    FarAway,
}

pub const KINDS: [Kind; 9] = [
    Kind::Near,
    Kind::Beside,
    Kind::Face,
    Kind::Edge,
    Kind::Vertex,
    Kind::CellBorder,
    Kind::Deep,
    Kind::Outside,
    Kind::FarAway,
];

/// Number of points per mesh: `TESDF_TEST_POINTS`, or `default`.
pub fn count(default: usize) -> usize {
    match std::env::var("TESDF_TEST_POINTS") {
        Ok(text) => text.parse().expect("TESDF_TEST_POINTS is a number of points"),
        Err(_) => default,
    }
}

/// `n` points, with the kinds in turn. The same mesh and cells give the same points.
pub fn sample(mesh: &TriangleMesh, cells: &Cells, n: usize) -> Vec<(Kind, DVec3)> {
    let mut random = Random(mesh.faces().len() as u64);
    let areas = Areas::of(mesh);
    (0..n).map(|i| (KINDS[i % 9], point(KINDS[i % 9], mesh, cells, &areas, &mut random))).collect()
}

fn point(kind: Kind, mesh: &TriangleMesh, cells: &Cells, areas: &Areas, random: &mut Random) -> DVec3 {
    let (bounds, diagonal) = (mesh.bounds(), mesh.diagonal());
    let any = mesh.triangle(random.index(mesh.faces().len()));
    match kind {
        Kind::Near => {
            let face = mesh.triangle(areas.pick(random));
            let normal = (face[1] - face[0]).cross(face[2] - face[0]).normalize_or_zero();
            on(face, random.weights()) + random.between(-0.02, 0.02) * diagonal * normal
        }
        Kind::Beside => {
            let mut weights: [f64; 3] = random.weights();
            (0..random.index(3)).for_each(|k| weights[k] = 0.0);
            on(any, weights) + random.power(-13.0, -1.0) * diagonal * random.direction()
        }
        Kind::Face => on(any, random.weights()),
        Kind::Edge => {
            let t = random.unit();
            any[0] + t * (any[1] - any[0])
        }
        Kind::Vertex => any[random.index(3)],
        Kind::CellBorder => cells.border_point(random),
        Kind::Deep => bounds.min + (random.in_cube() * 0.5 + 0.5) * bounds.extent(),
        Kind::Outside => bounds.center() + 3.0 * diagonal * random.in_cube(),
        Kind::FarAway => bounds.center() + random.power(0.0, 4.0) * diagonal * random.direction(),
    }
}

pub fn on(face: [DVec3; 3], weights: [f64; 3]) -> DVec3 {
    let sum: f64 = weights.iter().sum();
    face[0] + weights[1] / sum * (face[1] - face[0]) + weights[2] / sum * (face[2] - face[0])
}

/// Picks faces with probability proportional to their area.
struct Areas(Vec<f64>);

impl Areas {
    fn of(mesh: &TriangleMesh) -> Self {
        let scale = mesh.diagonal();
        let mut sum = 0.0;
        let cumulated = (0..mesh.faces().len()).map(|f| {
            let [a, b, c] = mesh.triangle(f).map(|p| (p - mesh.vertices()[0]) / scale);
            sum += (b - a).cross(c - a).length();
            sum
        });
        Self(cumulated.collect())
    }

    fn pick(&self, random: &mut Random) -> usize {
        let at = random.unit() * self.0[self.0.len() - 1];
        self.0.partition_point(|&c| c < at).min(self.0.len() - 1)
    }
}

use glam::DVec3;
use serde::Serialize;

use super::VerifyOptions;
use super::true_sign::TrueSign;
use crate::TeSdf;
use crate::asset::CellKind;
use crate::geometry::{Aabb, Triangle};
use crate::mesh::TriangleMesh;
use crate::sampling::{Random, Weighted};

/// Classes of the points that are compared with brute force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PointClass {
    /// Uniform in the mesh's bounds, enlarged by a factor of 1.2.
    Box,
    /// 1e-9 to 1e-2 diagonals from a face, on either side, uniform in the logarithm.
    NearSurface,
    /// On a face, up to rounding.
    OnFace,
    /// On an edge, up to rounding.
    OnEdge,
    /// At a vertex.
    AtVertex,
    /// On a face, edge or corner of a cell, up to rounding.
    CellBorder,
    /// Inside the solid: the deepest of several points.
    Deep,
    /// 0.2 to 1000 diagonals outside the bounds.
    FarOutside,
    /// Inside a cell with a list, cell by cell. Only for an asset that certifies nothing.
    InCell,
}

impl PointClass {
    /// All classes.
    pub const ALL: [Self; 9] = [
        Self::Box,
        Self::NearSurface,
        Self::OnFace,
        Self::OnEdge,
        Self::AtVertex,
        Self::CellBorder,
        Self::Deep,
        Self::FarOutside,
        Self::InCell,
    ];

    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Box => "in the box",
            Self::NearSurface => "near the surface",
            Self::OnFace => "on faces",
            Self::OnEdge => "on edges",
            Self::AtVertex => "at vertices",
            Self::CellBorder => "on borders of cells",
            Self::Deep => "deep inside",
            Self::FarOutside => "far outside",
            Self::InCell => "inside cells",
        }
    }

    /// The class of sample `index`. Any 20 consecutive samples contain all classes but
    /// [`InCell`](Self::InCell); those where errors are likely come most often.
    pub fn of_index(index: u64) -> Self {
        use PointClass::*;
        const TURN: [PointClass; 20] = [
            Box,
            NearSurface,
            OnFace,
            OnEdge,
            AtVertex,
            CellBorder,
            Deep,
            FarOutside,
            Box,
            NearSurface,
            OnEdge,
            CellBorder,
            NearSurface,
            OnFace,
            Box,
            NearSurface,
            AtVertex,
            CellBorder,
            Deep,
            NearSurface,
        ];
        TURN[(index % 20) as usize]
    }
}

/// Makes the points. The same asset and seed give the same points.
pub(super) struct Sampler<'a> {
    asset: &'a TeSdf,
    mesh: &'a TriangleMesh,
    sign: &'a TrueSign,
    seed: u64,
    bounds: Aabb,
    diagonal: f64,
    areas: Weighted,
    /// Corners of each cell of the domain, in the mesh's unit.
    cells: Vec<[DVec3; 4]>,
    /// Corners of each cell with a list, for an asset that certifies nothing.
    listed: Vec<[DVec3; 4]>,
    /// Number of points of classes that take turns.
    samples: u64,
}

/// Largest number of random points tried to find points inside.
const TRIES: usize = 64;
/// Number of points inside from which the deepest is taken.
const DEEPEST_OF: usize = 4;
/// Largest number of points inside a cell with a list, and of points inside cells for each other
/// point.
const IN_CELL: u64 = 4;

impl<'a> Sampler<'a> {
    pub(super) fn new(
        asset: &'a TeSdf,
        mesh: &'a TriangleMesh,
        sign: &'a TrueSign,
        options: VerifyOptions,
    ) -> Self {
        let diagonal = mesh.diagonal();
        // Relative to the diagonal, so that areas do not underflow.
        let areas = Weighted::new((0..mesh.faces().len()).map(|f| {
            let [a, b, c] = mesh.triangle(f);
            ((b - a) / diagonal).cross((c - a) / diagonal).length()
        }));
        let is_certified = asset.about().certificate().delta().is_some();
        let (mut cells, mut listed) = (Vec::new(), Vec::new());
        asset.visit_cells(|cell| {
            if cell.kind.is_listed() && !is_certified {
                listed.push(cell.corners);
            }
            if cell.kind != CellKind::NotOfDomain {
                cells.push(cell.corners);
            }
        });
        let (seed, samples) = (options.seed, options.samples as u64);
        Self { asset, mesh, sign, seed, bounds: mesh.bounds(), diagonal, areas, cells, listed, samples }
    }

    /// Number of points inside cells. They come after the others.
    pub(super) fn in_cells(&self) -> u64 {
        IN_CELL * self.samples.min(self.listed.len() as u64)
    }

    /// Number of cells with such a point.
    pub(super) fn cells_with_points(&self) -> u64 {
        self.in_cells().min(self.listed.len() as u64)
    }

    pub(super) fn point(&self, index: u64) -> (PointClass, DVec3) {
        let class = if index < self.samples { PointClass::of_index(index) } else { PointClass::InCell };
        (class, self.of_class(class, index))
    }

    fn of_class(&self, class: PointClass, index: u64) -> DVec3 {
        let random = &mut Random::new(self.seed, index);
        match class {
            PointClass::InCell => {
                // Cells have points in turn; when there are more cells than points, those in equal
                // steps.
                let (at, cells) = (u128::from(index - self.samples), self.listed.len() as u128);
                let with_points = u128::from(self.cells_with_points());
                random.in_simplex(&self.listed[(at % with_points * cells / with_points) as usize])
            }
            PointClass::Box => self.in_box(random),
            PointClass::NearSurface => {
                let corners = self.face(random);
                let normal = Triangle::new(corners.map(|p| (p - corners[0]) / self.diagonal)).normal;
                let offset = random.sign() * random.log_between(1e-9, 1e-2) * self.diagonal;
                random.in_simplex(&corners) + offset * normal
            }
            PointClass::OnFace => {
                let corners = self.face(random);
                random.in_simplex(&corners)
            }
            PointClass::OnEdge => {
                let [a, b, _] = self.any_face(random);
                a.lerp(b, random.unit())
            }
            PointClass::AtVertex => self.any_face(random)[0],
            PointClass::CellBorder => self.cell_border(random),
            PointClass::Deep => self.deep(random),
            PointClass::FarOutside => {
                let distance = random.log_between(0.2, 1e3) * self.diagonal;
                let from = self.bounds.center();
                from + (0.5 * self.diagonal + distance) * random.direction()
            }
        }
    }

    fn in_box(&self, random: &mut Random) -> DVec3 {
        let (center, half) = (self.bounds.center(), 0.6 * self.bounds.extent());
        random.in_box(Aabb { min: center - half, max: center + half })
    }

    /// Corners of a random face, with probability proportional to its area.
    fn face(&self, random: &mut Random) -> [DVec3; 3] {
        let face = self.areas.pick(random).unwrap_or(0);
        self.mesh.triangle(face)
    }

    /// Corners of a random face, all faces with equal probability, in a random rotation.
    fn any_face(&self, random: &mut Random) -> [DVec3; 3] {
        let mut corners = self.mesh.triangle(random.below(self.mesh.faces().len()));
        corners.rotate_left(random.below(3));
        corners
    }

    fn cell_border(&self, random: &mut Random) -> DVec3 {
        let Some(mut corners) = self.cells.get(random.below(self.cells.len().max(1))).copied() else {
            return self.in_box(random);
        };
        corners.rotate_left(random.below(4));
        let [a, b, c, _] = corners;
        match random.below(4) {
            0 => a,
            1 => 0.5 * (a + b),
            2 => random.in_simplex(&[a, b]),
            _ => random.in_simplex(&[a, b, c]),
        }
    }

    fn deep(&self, random: &mut Random) -> DVec3 {
        let mut found = 0;
        let mut best = (0.0, None);
        for _ in 0..TRIES {
            let p = random.in_box(self.bounds);
            if self.sign.is_inside(p) == Some(true) {
                let depth = self.asset.signed_distance_f32(p).abs();
                if depth > best.0 {
                    best = (depth, Some(p));
                }
                found += 1;
                if found == DEEPEST_OF {
                    break;
                }
            }
        }
        best.1.unwrap_or_else(|| random.in_box(self.bounds))
    }
}

use glam::DVec3;

use super::EvaluateError;
use crate::TeSdf;
use crate::asset::CellKind;
use crate::geometry::Aabb;

/// Most voxels along the diagonal: 2^48 points at most then fit a domain of 8 diagonals.
pub const MAX_FINENESS: u32 = 1 << 13;

/// The centres of the voxels that cover a domain. The middle of the mesh's bounds is a corner of voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// The point with the lowest coordinates, mesh unit.
    pub origin: DVec3,
    /// Side of a voxel, mesh unit.
    pub voxel: f64,
    /// Number of points along each axis.
    pub counts: [u64; 3],
}

impl Grid {
    /// The grid over the domains of `assets`, which are of the same mesh, with `fineness` voxels along its diagonal.
    ///
    /// # Errors
    /// The fineness is out of range, or there is no asset.
    pub fn of(assets: &[&TeSdf], fineness: u32) -> Result<Self, EvaluateError> {
        if !(1..=MAX_FINENESS).contains(&fineness) {
            return Err(EvaluateError::Fineness { found: fineness });
        }
        let bounds = assets.first().ok_or(EvaluateError::Empty)?.bounds();
        let voxel = bounds.extent().length() / f64::from(fineness);
        let domain = assets.iter().fold(Aabb::EMPTY, |b, asset| b.union(domain(asset)));
        let middle = bounds.center();
        let low = ((domain.min - middle) / voxel).floor();
        let high = ((domain.max - middle) / voxel).ceil();
        let counts = (high - low).to_array().map(|n| n.max(0.0) as u64);
        Ok(Self { origin: middle + (low + 0.5) * voxel, voxel, counts })
    }

    /// Number of points.
    pub fn len(&self) -> u64 {
        self.counts.iter().product()
    }

    /// Whether it has no point.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A point; each index is below its count.
    pub fn point(&self, index: [u64; 3]) -> DVec3 {
        self.origin + self.voxel * DVec3::from_array(index.map(|i| i as f64))
    }
}

/// Bounds of the cells of the domain.
fn domain(asset: &TeSdf) -> Aabb {
    let mut bounds = Aabb::EMPTY;
    asset.visit_cells(|cell| {
        if cell.kind != CellKind::NotOfDomain {
            bounds = bounds.union(Aabb::of(&cell.corners));
        }
    });
    bounds
}

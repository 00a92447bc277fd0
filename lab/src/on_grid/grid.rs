use tesdf::TeSdf;
use tesdf::asset::CellKind;
use tesdf::geometry::Aabb;
use tesdf::glam::DVec3;

/// Largest number of voxels along the diagonal. With this limit, a domain of 8 diagonals has at
/// most 2^48 points.
pub const MAX_FINENESS: u32 = 1 << 13;

/// The centres of the voxels that cover a domain. The centre of the mesh's bounds is a corner of
/// voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// The grid point with the lowest coordinates, in the mesh's unit.
    pub origin: DVec3,
    /// Side length of a voxel, in the mesh's unit.
    pub voxel: f64,
    /// Number of points along each axis.
    pub counts: [u64; 3],
}

impl Grid {
    /// The grid over the domains of `assets`, which encode the same mesh. `fineness` is the number
    /// of voxels along the diagonal of the mesh's bounds.
    pub fn of(assets: &[&TeSdf], fineness: u32) -> Self {
        let bounds = assets.iter().fold(Aabb::EMPTY, |b, asset| b.union(asset.bounds()));
        let voxel = bounds.extent().length() / f64::from(fineness);
        let domain = assets.iter().fold(Aabb::EMPTY, |b, asset| b.union(domain(asset)));
        let middle = bounds.center();
        let low = ((domain.min - middle) / voxel).floor();
        let high = ((domain.max - middle) / voxel).ceil();
        let counts = (high - low).to_array().map(|n| n.max(0.0) as u64);
        Self { origin: middle + (low + 0.5) * voxel, voxel, counts }
    }

    /// Number of points.
    pub fn len(&self) -> u64 {
        self.counts.iter().product()
    }

    /// Whether the grid has no point.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Position of a point, in the mesh's unit. Each index is smaller than the count of its axis.
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

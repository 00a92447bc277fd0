//! Meshes and the tetrahedra around them.
use std::collections::BTreeMap;
use std::path::Path;

use tesdf::asset::about::Source;
use tesdf::domain::gmsh::{GmshError, GmshOptions, tetrahedralise_and_report};
use tesdf::domain::{ConformingMesh, TetMesh, read_tetrahedra};
use tesdf::encode::Domain;
use tesdf::geometry::orientation;
use tesdf::mesh::{SolidMesh, TriangleMesh};

use super::DomainName;
use super::meshes::Mesh;
use crate::mesh_file;
use crate::report::{Failure, note};

/// A solid in a domain.
pub struct Place {
    pub solid: SolidMesh,
    pub source: Source,
    /// As rows name it.
    pub name: String,
    /// `None`: the bisection domain.
    pub conforming: Option<ConformingMesh>,
}

impl Place {
    pub fn domain(&self) -> Domain<'_> {
        self.conforming.as_ref().map_or(Domain::Bisection, Domain::Conforming)
    }
}

/// The mesh in the domain; one that comes with tetrahedra keeps them.
///
/// # Errors
/// A file cannot be read, the mesh is no solid, or there are no tetrahedra of it.
pub fn open(mesh: &Mesh, data: &Path, domain: DomainName) -> Result<Place, Failure> {
    let path = data.join(mesh.path);
    let at = |e: &dyn std::fmt::Display| Failure::new(format!("{}: {e}", path.display()));
    if !path.exists() {
        return Err(Failure::new(format!("there is no mesh {}", path.display()))
            .hint("give the folder `data` of the repository to --data"));
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    if path.extension().is_some_and(|e| e == "ele") {
        let tetrahedra = read_tetrahedra(&path).map_err(|e| at(&e))?;
        let surface = boundary(&tetrahedra).map_err(|e| at(&e))?;
        let solid = SolidMesh::new(surface).map_err(|e| at(&e))?;
        let conforming = ConformingMesh::new(&solid, &tetrahedra).map_err(|e| at(&e))?;
        let source = Source { name, ..Source::default() };
        return Ok(Place { solid, source, name: "file".into(), conforming: Some(conforming) });
    }
    let loaded = mesh_file::read(&path)?;
    let source = Source { name, blake3: loaded.report.source_blake3.clone() };
    let solid = SolidMesh::new(loaded.mesh).map_err(|e| at(&e))?;
    if domain == DomainName::Bisection {
        return Ok(Place { solid, source, name: "bisection".into(), conforming: None });
    }
    let options = GmshOptions { band: mesh.outside, ..GmshOptions::default() };
    let made = tetrahedralise_and_report(&solid, &options).map_err(|e| match e {
        GmshError::AllRefused(_) => at(&e),
        e => Failure::new(e),
    })?;
    made.refused.iter().for_each(|refused| note(&format!("{}: {refused:?}", mesh.name)));
    Ok(Place { solid, source, name: "Gmsh".into(), conforming: Some(made.mesh) })
}

/// The triangles that only one tetrahedron has, outward.
fn boundary(tetrahedra: &TetMesh) -> Result<TriangleMesh, tesdf::mesh::MeshError> {
    let mut sides: BTreeMap<[u32; 3], Option<[u32; 3]>> = BTreeMap::new();
    for (t, &[a, b, c, d]) in tetrahedra.tetrahedra().iter().enumerate() {
        let [p, q, r, s] = tetrahedra.corners(t);
        let [c, d] = if orientation(p, q, r, s) < 0 { [c, d] } else { [d, c] };
        for side in [[a, c, b], [a, b, d], [b, c, d], [c, a, d]] {
            let mut key = side;
            key.sort_unstable();
            sides.entry(key).and_modify(|s| *s = None).or_insert(Some(side));
        }
    }
    let faces: Vec<[u32; 3]> = sides.into_values().flatten().collect();
    let mut used: Vec<u32> = faces.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let place = |v: u32| used.binary_search(&v).unwrap_or_default() as u32;
    let vertices = used.iter().map(|&v| tetrahedra.vertices()[v as usize]).collect();
    TriangleMesh::new(vertices, faces.iter().map(|f| f.map(place)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use tesdf::geometry::tetrahedron_volume;

    #[test]
    fn the_boundary_of_the_beam_is_closed_and_holds_its_volume() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/procedural/beam.ele");
        let tetrahedra = read_tetrahedra(&path).unwrap();
        let surface = boundary(&tetrahedra).unwrap();
        let volume: f64 = (0..tetrahedra.tetrahedra().len())
            .map(|t| tetrahedron_volume(&tetrahedra.corners(t)).abs())
            .sum();
        assert!((volume / surface.bounds().extent().element_product() - 1.0).abs() < 1e-9);
        let solid = SolidMesh::new(surface).unwrap();
        let domain = ConformingMesh::new(&solid, &tetrahedra).unwrap();
        assert_eq!(domain.tetrahedra().len(), 1920);
    }
}

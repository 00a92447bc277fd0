//! Opens meshes and makes the tetrahedra around them.
use std::path::Path;

use tesdf::Progress;
use tesdf::asset::about::Source;
use tesdf::domain::gmsh::{GmshError, GmshOptions, tetrahedralise_and_report};
use tesdf::domain::{ConformingMesh, read_tetrahedra};
use tesdf::encode::Domain;
use tesdf::mesh::{SolidMesh, SolidOptions};

use super::DomainName;
use super::meshes::Mesh;
use tesdf_cli::terminal::report::{Failure, note};

/// A solid in a domain.
pub struct Subject {
    pub solid: SolidMesh,
    pub source: Source,
    /// Name of the domain in the rows of a table.
    pub name: String,
    /// The tetrahedra; `None` for the bisection domain.
    pub conforming: Option<ConformingMesh>,
}

impl Subject {
    pub fn domain(&self) -> Domain<'_> {
        self.conforming.as_ref().map_or(Domain::Bisection, Domain::Conforming)
    }
}

/// Opens a mesh in a domain. A mesh that comes with tetrahedra keeps them.
///
/// # Errors
/// A file cannot be read, the mesh is not a solid, or tetrahedra are missing.
pub fn open(mesh: &Mesh, data: &Path, domain: DomainName) -> Result<Subject, Failure> {
    let path = data.join(mesh.path);
    let at = |e: &dyn std::fmt::Display| Failure::new(format!("{}: {e}", path.display()));
    if !path.exists() {
        return Err(Failure::new(format!("there is no mesh {}", path.display()))
            .hint("give the folder `data` of the repository to --data"));
    }
    if path.extension().is_some_and(|e| e == "ele") {
        let tetrahedra = read_tetrahedra(&path).map_err(|e| at(&e))?;
        let surface = tetrahedra.surface().map_err(|e| at(&e))?;
        let solid = SolidMesh::new(surface).map_err(|e| at(&e))?;
        let conforming = ConformingMesh::new(&solid, &tetrahedra).map_err(|e| at(&e))?;
        let source = Source::of_file(&path, String::new());
        return Ok(Subject { solid, source, name: "file".into(), conforming: Some(conforming) });
    }
    let loaded = SolidMesh::load(&path, &SolidOptions::default()).map_err(Failure::new)?;
    let (source, solid) = (loaded.source(), loaded.solid);
    if domain == DomainName::Bisection {
        return Ok(Subject { solid, source, name: "bisection".into(), conforming: None });
    }
    let options = GmshOptions { band: mesh.outside, ..GmshOptions::default() };
    let made = tetrahedralise_and_report(&solid, &options, &Progress::default()).map_err(|e| match e {
        GmshError::AllRefused(_) => at(&e),
        e => Failure::new(e),
    })?;
    made.refused.iter().for_each(|refused| note(&format!("{}: {refused:?}", mesh.name)));
    Ok(Subject { solid, source, name: "Gmsh".into(), conforming: Some(made.mesh) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use tesdf::geometry::internal::tetrahedron_volume;

    #[test]
    fn the_boundary_of_the_beam_is_closed_and_holds_its_volume() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/procedural/beam.ele");
        let tetrahedra = read_tetrahedra(&path).unwrap();
        let surface = tetrahedra.surface().unwrap();
        let volume: f64 = (0..tetrahedra.tetrahedra().len())
            .map(|t| tetrahedron_volume(&tetrahedra.corners(t)).abs())
            .sum();
        assert!((volume / surface.bounds().extent().element_product() - 1.0).abs() < 1e-9);
        let solid = SolidMesh::new(surface).unwrap();
        let domain = ConformingMesh::new(&solid, &tetrahedra).unwrap();
        assert_eq!(domain.tetrahedra().len(), 1920);
    }
}

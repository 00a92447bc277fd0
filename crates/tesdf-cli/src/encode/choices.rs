//! The options of the encoder, which `encode` and `encode-all` share.
use std::num::NonZeroU32;
use std::path::Path;

use crate::terminal::parse;
use crate::terminal::report::Failure;
use clap::ValueEnum;
use tesdf::base::SurfaceFaces;
use tesdf::encode::{
    Deformation, Domain, DomainChoice, EncodeChoices, Encoder, EncoderChoice, InsideChoice, Preset,
    Refinement, Threshold,
};
use tesdf::geometry::Aabb;
use tesdf::mesh::{RepairMode, SolidMesh};
use tesdf::{Progress, TeSdf};

/// The options of the encoder.
#[derive(clap::Args, Debug)]
pub struct ChoiceArgs {
    /// Division of the space in and around the solid into tetrahedra: `bisection` needs no other
    /// program, `gmsh` runs Gmsh, and a FILE (.msh, .node, .ele) has tetrahedra that conform
    /// to the mesh's faces
    #[arg(long, value_name = "bisection|gmsh|FILE", default_value = "bisection")]
    pub domain: DomainChoice,
    /// Method that finds the closest faces of each tetrahedron [default: certified, or the
    /// preset's]
    #[arg(long, value_parser = parse::named::<EncoderChoice>())]
    pub encoder: Option<EncoderChoice>,
    /// Trade-off between memory, query speed and encoding time
    #[arg(long, value_parser = parse::named::<Preset>(), default_value_t = Preset::Default)]
    pub preset: Preset,
    /// Resolution Q of the sampled encoder: an edge of a tetrahedron has Q + 1 samples [default:
    /// 32]
    #[arg(long, value_name = "Q")]
    pub resolution: Option<u32>,
    /// Threshold of the sampled encoder: a face is listed if it is at most this length farther than
    /// the closest face at a sample; `squared:AREA` compares squared distances instead; `safe` is large
    /// enough that no needed face is missing
    #[arg(long, value_name = "LENGTH|safe|squared:AREA")]
    pub threshold: Option<Threshold>,
    /// Truncate each list to this number of faces; the faces that are needed nearest to the surface
    /// stay
    #[arg(long, value_name = "N")]
    pub e_max: Option<NonZeroU32>,
    /// Prepare the lists for moving vertices; needs a conforming domain
    #[arg(long)]
    pub deformable: bool,
    /// Keep the tetrahedra of a conforming domain as they are, without bisecting them
    #[arg(long)]
    pub plain: bool,
    /// Width of the encoded band around the mesh's bounding box, in the mesh's unit [default: 5 %
    /// of its diagonal]
    #[arg(long, value_name = "LENGTH", value_parser = parse::length, allow_hyphen_values = true)]
    pub band: Option<f64>,
    /// A box that is encoded as well, in the mesh's unit; may be given several times
    #[arg(long = "region", value_name = "x0 y0 z0 x1 y1 z1", value_parser = parse::region, allow_hyphen_values = true)]
    pub regions: Vec<Aabb>,
    /// Name of the mesh's unit; it is recorded in the file and scales nothing
    #[arg(long, value_name = "NAME")]
    pub unit: Option<String>,
    /// Rule that says what is inside
    #[arg(long, value_name = "RULE", value_parser = parse::named::<InsideChoice>(), default_value_t = InsideChoice::Winding)]
    pub inside: InsideChoice,
    /// Thickness of a sheet, in the mesh's unit
    #[arg(long, value_name = "LENGTH", value_parser = parse::length)]
    pub thickness: Option<f64>,
    /// Faces to which distances refer
    #[arg(long, value_name = "FACES", value_parser = parse::named::<SurfaceFaces>(), default_value_t = SurfaceFaces::All)]
    pub surface: SurfaceFaces,
    /// Repair a mesh without a well-defined inside as `tesdf repair --auto` does, before it is
    /// encoded; what was changed is printed and recorded in the file [default: such a mesh is
    /// refused]
    #[arg(long, value_enum)]
    pub repair: Option<RepairChoice>,
}

/// Repairs before encoding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RepairChoice {
    /// The first that makes the mesh encodable: none, duplicates and T-junctions and orientation,
    /// welding of cracks, filling of holes
    Auto,
}

impl ChoiceArgs {
    /// Whether meshes are repaired before they are encoded.
    pub fn repair_mode(&self) -> RepairMode {
        self.repair.map_or(RepairMode::Never, |RepairChoice::Auto| RepairMode::Auto)
    }

    /// The options for the library.
    pub fn choices(&self) -> EncodeChoices {
        let numbers = |r: &Aabb| [r.min.x, r.min.y, r.min.z, r.max.x, r.max.y, r.max.z];
        EncodeChoices {
            preset: self.preset,
            domain: self.domain.clone(),
            encoder: self.encoder,
            resolution: self.resolution,
            threshold: self.threshold,
            e_max: self.e_max,
            deformation: if self.deformable { Deformation::Expected } else { Deformation::None },
            refinement: self.plain.then_some(Refinement::None),
            band: self.band,
            regions: self.regions.iter().map(numbers).collect(),
            unit: self.unit.clone(),
            inside: self.inside,
            thickness: self.thickness,
            surface: self.surface,
        }
    }
}

/// Encodes the solid of the mesh file `path` in the domain of `choices`. The error message names
/// the file.
///
/// # Errors
/// Gmsh or the file of tetrahedra gives no domain, an option does not apply to the solid, or
/// `progress` was cancelled.
pub(crate) fn encode(
    solid: &SolidMesh,
    path: &Path,
    choices: &EncodeChoices,
    encoder: Encoder<'_>,
    progress: &Progress,
) -> Result<TeSdf, Failure> {
    let tetrahedra = choices.tetrahedra(solid, progress).map_err(Failure::new)?;
    let domain = tetrahedra.as_ref().map_or(Domain::Bisection, Domain::Conforming);
    encoder.domain(domain).encode(solid).map_err(|e| Failure::new(format!("{}: {e}", path.display())))
}

//! Draws what Figs. 2 and 3 of the paper show. The first picture has the tetrahedra inside and
//! around a torus, cut open, shrunk and coloured by class. The second picture has one tetrahedron
//! with its encoded faces. Needs Gmsh.
//!
//! ```text
//! cargo run --release -p tesdf-cli --example tetrahedra -- \
//!     data/public/torus_quads.obj docs/images
//! ```
use std::error::Error;
use std::path::PathBuf;
use std::sync::Arc;

use tesdf::collide::{Placement, Pose, Shape};
use tesdf::domain::ConformingMesh;
use tesdf::domain::gmsh::{GmshOptions, tetrahedralise};
use tesdf::encode::{Domain, EncodeOptions, Encoder, Preset, Refinement};
use tesdf::glam::DVec3;
use tesdf::mesh::{SolidMesh, TriangleMesh, read};
use tesdf::{Length, Side};
use tesdf_cli::render::{Cut, Drawn, Exposure, HalfSpace, Scenery, View, linear, render};

type Failure = Box<dyn Error>;

/// Sides of a positively oriented tetrahedron, facing outward.
const SIDES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
/// Colours of the classes T_BI, T_I, T_BO and T_O.
const COLOURS: [[u8; 3]; 4] = [[236, 160, 92], [176, 58, 40], [150, 190, 220], [40, 96, 158]];

/// Tetrahedra that are shrunk towards their centroids, so that gaps separate them.
fn apart(tetrahedra: &[[DVec3; 4]]) -> Result<Shape, Failure> {
    let mut mesh = (Vec::new(), Vec::new());
    for corners in tetrahedra {
        let first = mesh.0.len() as u32;
        let centre = 0.25 * corners.iter().sum::<DVec3>();
        mesh.0.extend(corners.map(|p| centre + 0.88 * (p - centre)));
        mesh.1.extend(SIDES.map(|side| side.map(|k| first + k)));
    }
    shape(mesh)
}

/// Faces as thin plates on their outer side.
fn plates(faces: &[[DVec3; 3]], thickness: f64) -> Result<Shape, Failure> {
    let mut mesh = (Vec::new(), Vec::new());
    for &[a, b, c] in faces {
        let first = mesh.0.len() as u32;
        let (centre, up) = ((a + b + c) / 3.0, thickness * (b - a).cross(c - a).normalize());
        for height in [0.2, 1.0] {
            mesh.0.extend([a, b, c].map(|p| centre + 0.96 * (p - centre) + height * up));
        }
        let prism = [[0, 2, 1], [3, 4, 5], [0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]];
        mesh.1.extend(prism.map(|side| side.map(|k| first + k)));
    }
    shape(mesh)
}

fn shape((vertices, faces): (Vec<DVec3>, Vec<[u32; 3]>)) -> Result<Shape, Failure> {
    let solid = SolidMesh::new(TriangleMesh::new(vertices, faces)?)?;
    Ok(Shape::Mesh(Arc::new(Encoder::new().preset(Preset::Fast).encode(&solid)?)))
}

fn drawn(shape: &Shape, colour: [u8; 3], exposure: Exposure) -> Drawn<'_> {
    let placement = Placement { pose: Pose::IDENTITY, scale: 1.0 };
    Drawn { shape, placement, colour: linear(colour), exposure }
}

fn main() -> Result<(), Failure> {
    let mut arguments = std::env::args().skip(1).map(PathBuf::from);
    let (Some(mesh), Some(folder)) = (arguments.next(), arguments.next()) else {
        return Err("expected a mesh and a folder for the pictures".into());
    };
    let solid = SolidMesh::new(read(&mesh)?.mesh)?;
    let around = GmshOptions { band: Some(Length::OfDiagonal(0.06)), ..GmshOptions::default() };
    let domain = tetrahedralise(&solid, &around)?;
    let middle = solid.mesh().bounds().center();
    let view = View { azimuth: -65.0, elevation: 32.0, field_of_view: None, zoom: 1.0, target: None };

    // The tetrahedra behind a plane through the middle, without the outer ones of the upper half.
    let mut classes: [Vec<[DVec3; 4]>; 4] = Default::default();
    for (t, corners) in domain.tetrahedra().iter().enumerate() {
        let positions = domain.corners(t);
        let from = 0.25 * positions.iter().sum::<DVec3>() - middle;
        let has_surface = corners.iter().any(|&v| (v as usize) < solid.mesh().vertices().len());
        let outside = domain.sides()[t] == Side::Outside;
        // The outside is cut at the middle as well, so the inside stands out of it.
        if from.y > 0.0 && !(outside && from.z > 0.0) {
            classes[2 * usize::from(outside) + usize::from(!has_surface)].push(positions);
        }
    }
    let shown: Vec<(usize, Shape)> = (0..4)
        .filter(|&class| !classes[class].is_empty())
        .map(|class| Ok((class, apart(&classes[class])?)))
        .collect::<Result<_, Failure>>()?;
    let bodies: Vec<Drawn> =
        shown.iter().map(|(class, shape)| drawn(shape, COLOURS[*class], Exposure::Whole)).collect();
    let picture = |bodies: &[Drawn], cut: &Cut, view: &View, name: &str| -> Result<(), Failure> {
        let scenery = Scenery { bodies, cut, contacts: &[] };
        Ok(std::fs::write(folder.join(name), render(&scenery, view, [1000, 640])?.encode_png()?)?)
    };
    picture(&bodies, &Cut::default(), &view, "tetrahedra.png")?;
    encoded_faces(&solid, &domain, &view, picture)
}

/// Draws the inner tetrahedron with the longest list, the faces of its list, and half of the body.
fn encoded_faces(
    solid: &SolidMesh,
    domain: &ConformingMesh,
    view: &View,
    picture: impl Fn(&[Drawn], &Cut, &View, &str) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let options = EncodeOptions { refinement: Refinement::None, ..EncodeOptions::default() };
    let asset = Encoder::new().options(options).domain(Domain::Conforming(domain)).encode(solid)?;
    let mut longest = None;
    asset.visit_cells(|cell| {
        let inside = domain.sides()[cell.id as usize] == Side::Inside;
        if inside && longest.is_none_or(|(_, length)| cell.list_length > length) {
            longest = Some((cell.id, cell.list_length));
        }
    });
    let Some((cell, _)) = longest else { return Err("nothing is inside".into()) };
    let corners = domain.corners(cell as usize);
    let faces: Vec<[DVec3; 3]> =
        asset.list_of(cell).iter().map(|&face| solid.mesh().triangle(face as usize)).collect();
    let centre = 0.25 * corners.iter().sum::<DVec3>();
    let diagonal = solid.mesh().diagonal();
    let (body, plates) = (
        shape((solid.mesh().vertices().to_vec(), solid.mesh().faces().to_vec()))?,
        plates(&faces, 0.006 * diagonal)?,
    );
    let tetrahedron = apart(&[corners])?;
    // The plane of the cut crosses the tube just behind the tetrahedron, so the tetrahedron stands
    // in front of the section.
    let from = centre - solid.mesh().bounds().center();
    let along = DVec3::new(-from.y, from.x, 0.0);
    let least = corners.iter().map(|p| along.dot(*p)).fold(f64::INFINITY, f64::min);
    let half = HalfSpace::new(along, least).ok_or("no direction")?;
    let bodies = [
        drawn(&body, [205, 208, 214], Exposure::Cut),
        drawn(&tetrahedron, COLOURS[3], Exposure::Whole),
        drawn(&plates, COLOURS[0], Exposure::Whole),
    ];
    println!("{} encoded faces", faces.len());
    let azimuth = along.y.atan2(along.x).to_degrees() + 20.0;
    let near = View { azimuth, elevation: 18.0, zoom: 2.4, target: Some(centre), ..*view };
    picture(&bodies, &Cut(vec![half]), &near, "encoded-faces.png")
}

use std::borrow::Cow;

use super::assemble::assemble;
use super::attempts::{EFFORT_PER_FACE, refine, refine_within_effort};
use super::cell_signs::{CellSigns, SignFaces};
use super::effort::Effort;
use super::error::EncodeError;
use super::hints::{Simplicity, sign_hints};
use super::lists::{Finished, Lists};
use super::refine::{GroupWeights, Refiner, Weights};
use super::roots::{Domain, MAX_SIZE, Roots};
use super::sampled::{Sampler, lipschitz_candidates};
use super::statistics::statistics;
use super::surface::{Surface, Touching};
use super::tighten::Levels;
use super::{Deformation, EncodeOptions, Method, Refinement, Source, Threshold};
use crate::asset::layout::{self, TREE_LEAF, TreeChild};
use crate::asset::{Section, TeSdf, about, about::Signs, write_container};
use crate::base::{Certificate, Inside, InsideRule, Length, Progress, Proved, Stage, SurfaceFaces};
use crate::domain::{Cell, DomainCube, MAX_DEPTH};
use crate::geometry::{Aabb, AabbTree, Child, LocalFrame, SignRule};
use crate::mesh::{MeshError, Presented, SolidMesh, Telling, TriangleMesh, WindingNumber};
use crate::verify::self_check;

/// The input of an encoding, in addition to the solid.
pub struct Request<'a> {
    /// Where the cells come from.
    pub domain: Domain<'a>,
    /// The file of the mesh, which the asset records.
    pub source: &'a Source,
    /// The options.
    pub options: &'a EncodeOptions,
    /// Looks at the samples of [`Method::Sampled`].
    pub sampler: &'a dyn Sampler,
    /// Shows how far the encoding is, and carries the request to stop.
    pub progress: &'a Progress,
}

/// Encodes a solid; see [`Encoder::encode`](super::Encoder::encode).
pub fn encode(solid: &SolidMesh, request: &Request) -> Result<TeSdf, EncodeError> {
    let Request { domain, source, options, sampler, progress } = *request;
    let presented = solid.presented()?;
    let mesh = &*presented.mesh;
    if mesh.faces().is_empty() {
        return Err(EncodeError::NoSurface);
    }
    let diagonal = mesh.diagonal();
    let frame = LocalFrame::of(mesh.bounds());
    let band = validated(options, &domain, diagonal)? * frame.scale;
    if mesh.faces().len() > layout::MAX_FACES {
        return Err(EncodeError::TooLarge {
            what: "faces",
            found: mesh.faces().len(),
            limit: layout::MAX_FACES,
        });
    }
    let local = local_mesh(mesh, frame)?;
    let signs = cell_signs(solid, &presented, &local);
    let jumps = matches!(&signs, CellSigns::Rule(rule, _) if rule.jumps());
    validated_inside(solid, &presented, jumps, &domain, options)?;
    let regions: Vec<Aabb> = options
        .region_boxes()
        .map(|r| Aabb { min: frame.to_local(r.min), max: frame.to_local(r.max) })
        .collect();
    let diagonal_local = diagonal * frame.scale;
    let roots = Roots::of(&domain, local.bounds().grown(band), &regions, frame, diagonal_local)?;
    let touching = match domain {
        Domain::Bisection => Touching::Kept,
        Domain::Conforming(_) => Touching::Ignored,
    };
    let surface = Surface::new(&local, roots.cube.side(), touching);
    let boxes: Vec<Aabb> = surface.triangles.iter().map(|t| Aabb::of(&t.corners)).collect();
    let tree = AabbTree::build(&boxes, TREE_LEAF);
    let near = NEAR * diagonal_local;

    let fit_within = options.fit_within(diagonal) * frame.scale;
    let groups = options.groups.map(|groups| GroupWeights {
        size: f64::from(groups.size),
        fit_within,
        levels: Levels::new(options.tighten_levels, 0, surface.faces.len()),
    });
    let unlimited = Effort::new(u64::MAX);
    let mut refiner = Refiner {
        surface: &surface,
        weights: Weights {
            byte: options.byte_worth / surface.faces.len() as f64,
            near,
            per_volume: 1.0 / (surface.area.max(near * diagonal_local) * 4.0 * near),
            far_faces: FAR_FACES,
            far_list: FAR_LIST,
            far_distance: FAR_DISTANCE * diagonal_local,
            floor: groups.map_or(FLOOR, |g| FULL * g.size),
            long_faces: 0.0,
            groups,
        },
        band,
        bounds: local.bounds(),
        regions: &regions,
        inside: &|p| signs.is_inside(p),
        max_depth: MAX_DEPTH,
        progress,
        effort: &unlimited,
    };
    let mut trees = match domain {
        Domain::Bisection => refine_within_effort(refiner, &roots.cells, EFFORT_PER_FACE)?,
        Domain::Conforming(_) => {
            // The whole mesh of tetrahedra is the domain, and every cell gets a list.
            refiner.band = f64::INFINITY;
            refiner.weights.far_list = usize::MAX;
            if options.refinement == Refinement::None {
                refiner.max_depth = 0;
            }
            let candidates = |cell: &Cell| lipschitz_candidates(&surface, &tree, cell);
            refine(&refiner, &roots.cells, candidates).ok_or(EncodeError::Cancelled)?
        }
    };

    let lists =
        Lists { surface: &surface, tree: &tree, options, scale: frame.scale, kept_within: fit_within };
    let Finished { labels, exact_within, proof } =
        lists.finish(&mut trees, &roots, &signs, sampler, progress)?;

    progress.begin(Stage::Assemble, 1);
    let simplicity = if presented.is_simple { Simplicity::Simple } else { Simplicity::Involved };
    let hints = sign_hints(&surface, &tree, simplicity);
    let mut position = vec![0u32; tree.order().len()];
    for (at, &face) in tree.order().iter().enumerate() {
        position[face as usize] = at as u32;
    }
    let forest = assemble(&mut trees, &labels, &position, &roots.order())?;

    let in_order = |face: &u32| *face as usize;
    let faces: Vec<[u32; 3]> = tree.order().iter().map(|f| mesh.faces()[in_order(f)]).collect();
    let hints: Vec<u16> = tree.order().iter().map(|f| hints[in_order(f)].0).collect();
    let vertices: Vec<[f64; 3]> = mesh.vertices().iter().map(|v| v.to_array()).collect();
    let (offset, origin) = (frame.offset, roots.cube.origin());
    let placed = [offset.x, offset.y, offset.z, frame.scale, origin.x, origin.y, origin.z, roots.cube.side()];
    let low: Vec<u16> = forest.palettes.iter().map(|&f| f as u16).collect();
    let high: Vec<u8> = forest.palettes.iter().map(|&f| (f >> 16) as u8).collect();
    let of_source = |face: &u32| presented.ids.as_ref().map_or(*face, |ids| ids[*face as usize]);
    let face_ids: Vec<u32> = tree.order().iter().map(of_source).collect();
    let (tree_boxes, tree_children) = face_tree(&tree, &roots.cube);
    let mut sections = vec![
        Section::new(layout::VERTICES, &vertices),
        Section::new(layout::FACES, &faces),
        Section::new(layout::FACE_IDS, &face_ids),
        Section::new(layout::SIGN_HINTS, &hints),
        Section::new(layout::FRAME, &placed),
        Section::new(layout::NODES, &forest.nodes),
        Section::new(layout::LISTS, &forest.lists),
        Section::new(layout::PALETTE_STARTS, &forest.palette_starts),
        Section::new(layout::PALETTES, &low),
        Section::new(layout::TREE_BOXES, &tree_boxes),
        Section::new(layout::TREE_CHILDREN, &tree_children),
    ];
    let own: Vec<[f64; 3]> = match domain {
        Domain::Bisection => Vec::new(),
        Domain::Conforming(domain) => {
            domain.vertices()[vertices.len()..].iter().map(|v| v.to_array()).collect()
        }
    };
    if !roots.tetrahedra.is_empty() {
        sections.push(Section::new(layout::DOMAIN_VERTICES, &own));
        sections.push(Section::new(layout::TETRAHEDRA, &roots.tetrahedra));
    }
    if !presented.sign_faces.is_empty() {
        sections.push(Section::new(layout::SIGN_FACES, &presented.sign_faces));
    }
    if faces.len() > 1 << 16 {
        sections.push(Section::new(layout::PALETTES_HIGH, &high));
    }
    let encoder = match options.method {
        Method::Certified => "certified".into(),
        Method::Sampled(_) => sampler.name(),
    };
    let proved = Proved { within: exact_within / frame.scale, chains: proof };
    let mut certificate =
        Certificate::new(encoder, domain.name().into(), diagonal, roots.cube.side(), proved);
    certificate.inside = *solid.inside();
    certificate.jumps = jumps;
    let about = about::About {
        source: source.clone(),
        options: EncodeOptions { inside: *solid.inside(), ..options.clone() },
        certificate,
        signs: match presented.telling {
            Telling::Winding => Signs::Cells,
            Telling::Rule => Signs::Rule,
            Telling::RuleUnoriented => Signs::RuleUnoriented,
            Telling::Sheet => Signs::Sheet,
        },
        statistics: statistics(&trees, &labels, &roots.cells, mesh, frame),
    };
    let bytes = write_container(&sections, &about.to_metadata())?;
    let asset = TeSdf::from_bytes(&bytes)?;
    if asset.about().certificate().delta().is_some()
        && let Some((precision, worst)) = self_check(&asset, solid)?
    {
        return Err(EncodeError::SelfCheck { precision, worst: Box::new(worst) });
    }
    Ok(asset)
}

/// Half width of the layer around the surface in which a query counts in full, as a share of the
/// diagonal.
const NEAR: f64 = 0.01;
/// Faces and nodes that a query by the face tree reads where lists are long. On bolt and nut it
/// reads 270 to 330.
const FAR_FACES: f64 = 250.0;
/// A cell with a shorter list is never left to the face tree.
const FAR_LIST: usize = 48;
/// A cell nearer to the surface than this share of the diagonal is never left to the face tree.
const FAR_DISTANCE: f64 = 0.025;
/// Refinement is not expected to make a list shorter than this.
const FLOOR: f64 = 6.0;
/// The same where lists are read in groups, as a share of a group: tightening makes such a list
/// shorter, and merging fills it again.
const FULL: f64 = 0.75;

/// What tells the sides of the cells. `local` has the presented faces in the local frame.
fn cell_signs(solid: &SolidMesh, presented: &Presented, local: &TriangleMesh) -> CellSigns {
    match presented.telling {
        Telling::Winding => CellSigns::Winding(WindingNumber::new(local)),
        Telling::Sheet => CellSigns::Unsigned,
        Telling::Rule | Telling::RuleUnoriented => {
            let position = |v: u32| local.vertices()[v as usize];
            let faces = [local.faces(), &presented.sign_faces].concat();
            let triangles = presented.sign_faces.iter().map(|f| f.map(position)).collect();
            CellSigns::Rule(SignRule::new(solid.inside().rule, &faces, position), SignFaces::new(triangles))
        }
    }
}

/// Checks that the rule of a solid, its surface, the domain and the options fit each other.
fn validated_inside(
    solid: &SolidMesh,
    presented: &Presented,
    jumps: bool,
    domain: &Domain,
    options: &EncodeOptions,
) -> Result<(), EncodeError> {
    let wrong = |option, found: String, expected| Err(EncodeError::Option { option, found, expected });
    let Inside { rule, surface } = *solid.inside();
    if options.inside != Inside::default() && options.inside != *solid.inside() {
        return wrong("inside", options.inside.to_string(), "the rule that the solid was made with");
    }
    if let InsideRule::Sheet { thickness } = rule
        && !(thickness > 0.0 && thickness <= MAX_SIZE * presented.mesh.diagonal())
    {
        return wrong(
            "thickness",
            thickness.to_string(),
            "a positive length, at most 8 times the diagonal of the mesh",
        );
    }
    if surface == SurfaceFaces::Boundary && (presented.telling == Telling::Sheet || jumps) {
        return wrong(
            "surface",
            "boundary, of a mesh without an exact inside".into(),
            "all: an open mesh and a sheet have no faces that are surely inside",
        );
    }
    let all_as_they_are = presented.telling == Telling::Winding && matches!(presented.mesh, Cow::Borrowed(_));
    if matches!(domain, Domain::Conforming(_)) && !all_as_they_are {
        return wrong(
            "inside",
            format!("{}, in a conforming domain", rule.name()),
            "the bisection domain for a rule that the winding number of the faces does not tell",
        );
    }
    Ok(())
}

fn validated(options: &EncodeOptions, domain: &Domain, diagonal: f64) -> Result<f64, EncodeError> {
    let band = options.band.resolve(diagonal);
    let wrong = |option, found: String, expected| Err(EncodeError::Option { option, found, expected });
    if !(0.0..=MAX_SIZE * diagonal).contains(&band) {
        return wrong(
            "band",
            options.band.to_string(),
            "a length from 0 to 8 times the diagonal of the mesh",
        );
    }
    if !(options.byte_worth > 0.0 && options.byte_worth.is_finite()) {
        return wrong("byte_worth", format!("{}", options.byte_worth), "a positive number");
    }
    if options.tighten_levels > MAX_TIGHTEN {
        return wrong("tighten_levels", format!("{}", options.tighten_levels), "0 to 30");
    }
    for r in options.region_boxes() {
        if !(r.min.is_finite() && r.max.is_finite() && r.min.cmple(r.max).all()) {
            return wrong(
                "region",
                format!("{} to {}", r.min, r.max),
                "min x y z and a max that is not less",
            );
        }
    }
    if let Some(groups) = options.groups {
        if groups.size == 0 {
            return wrong("groups.size", "0".into(), "1 or more faces");
        }
        if !(0.0..=MAX_SIZE * diagonal).contains(&options.fit_within(diagonal)) {
            return wrong(
                "groups.fit_within",
                groups.fit_within.to_string(),
                "a length from 0 to 8 times the diagonal of the mesh",
            );
        }
    }
    if options.max_entries == Some(0) {
        return wrong("max_entries", "0".into(), "1 or more faces");
    }
    if let Method::Sampled(sampling) = options.method {
        if !(1..=MAX_RESOLUTION).contains(&sampling.resolution) {
            return wrong("resolution", format!("{}", sampling.resolution), "1 to 1024");
        }
        if !(sampling.shrink > 0.0 && sampling.shrink <= 1.0) {
            return wrong("shrink", format!("{}", sampling.shrink), "above 0, at most 1");
        }
        if let Threshold::Absolute(e) = sampling.threshold
            && !(e >= 0.0 && e.is_finite())
        {
            return wrong("threshold", Length::Absolute(e).to_string(), "a length of 0 or more");
        }
    }
    if let Domain::Bisection = domain {
        if options.deformation == Deformation::Expected {
            return wrong(
                "deformation",
                "lists for deformation in the bisection domain, whose cells do not follow the surface".into(),
                "a conforming domain for it",
            );
        }
        if options.refinement == Refinement::None {
            return wrong(
                "refinement",
                "none in the bisection domain, which would be six cells".into(),
                "a conforming domain for it",
            );
        }
    }
    Ok(band)
}

const MAX_TIGHTEN: u32 = 30;
const MAX_RESOLUTION: u32 = 1024;

fn local_mesh(mesh: &TriangleMesh, frame: LocalFrame) -> Result<TriangleMesh, MeshError> {
    let vertices = mesh.vertices().iter().map(|&v| frame.to_local(v)).collect();
    TriangleMesh::new(vertices, mesh.faces().to_vec())
}

/// The face tree in `f32`, relative to the middle of the cube. Boxes are rounded outward.
fn face_tree(tree: &AabbTree, cube: &DomainCube) -> (Vec<[f32; 12]>, Vec<[u32; 2]>) {
    let middle = cube.middle();
    let child = |c: Child| match c {
        Child::Node(n) => TreeChild::Node(n),
        Child::Leaf { start, end } => TreeChild::Leaf(start, end - start),
    };
    let mut nodes = tree.nodes().to_vec();
    if let (bounds, Child::Leaf { start, end }) = tree.root() {
        // A tree that is a single leaf is written as a node with two leaves. Of a single face, both
        // leaves have the face.
        let half = start + (end - start) / 2;
        nodes.push([(bounds, Child::Leaf { start, end: half }), (bounds, Child::Leaf { start: half, end })]);
    }
    let boxes = nodes.iter().map(|node| {
        let [a, b] = [0, 1].map(|side| node[side].0.rounded_from(middle));
        std::array::from_fn(|k| if k < 6 { a[k] } else { b[k - 6] })
    });
    let children = nodes.iter().map(|n| [child(n[0].1).encode(), child(n[1].1).encode()]);
    (boxes.collect(), children.collect())
}

//! The common steps of all formats, after the bytes have become polygons.
use glam::DVec3;

use super::{LoadReport, LoadedMesh, MeshFormat, MeshPart, Origin, Place, ReadError};
use crate::mesh::count::count;
use crate::mesh::polygon::{Shape, triangulate};
use crate::mesh::weld::weld_equal;
use crate::mesh::{MeshError, TriangleMesh};

/// Vertices and polygons as the file gives them. Indices are 0-based and not checked yet.
pub(super) struct RawMesh {
    pub positions: Vec<DVec3>,
    /// Corners of all polygons, concatenated.
    pub corners: Vec<u64>,
    /// For each polygon, the end of its corners in `corners`.
    pub ends: Vec<usize>,
    pub places: Places,
    /// First vertex number of the format; used in messages only.
    pub base: u64,
    /// Name of the unit of length, where the format or the file states it.
    pub unit: Option<&'static str>,
    /// Names of the objects of the file.
    pub part_names: Vec<String>,
    /// Runs of polygons: the first polygon, and its object. A run ends where the next one begins.
    pub part_starts: Vec<(usize, usize)>,
    pub notes: Vec<String>,
}

/// The places of vertices and polygons in the file.
pub(super) enum Places {
    /// Line numbers.
    Lines { vertices: Vec<u64>, faces: Vec<u64> },
    /// Byte offsets.
    Bytes { vertices: Vec<u64>, faces: Vec<u64> },
    /// Elements, each with the index of its first vertex and of its first face, ascending.
    Elements(Vec<(usize, usize, String)>),
}

impl Places {
    fn vertex(&self, i: usize) -> Place {
        match self {
            Self::Lines { vertices, .. } => Place::Line(vertices[i]),
            Self::Bytes { vertices, .. } => Place::Byte(vertices[i]),
            Self::Elements(parts) => element(parts, |part| part.0 <= i),
        }
    }

    fn face(&self, i: usize) -> Place {
        match self {
            Self::Lines { faces, .. } => Place::Line(faces[i]),
            Self::Bytes { faces, .. } => Place::Byte(faces[i]),
            Self::Elements(parts) => element(parts, |part| part.1 <= i),
        }
    }
}

fn element(
    parts: &[(usize, usize, String)],
    starts_before: impl Fn(&(usize, usize, String)) -> bool,
) -> Place {
    let end = parts.partition_point(starts_before);
    Place::Element(parts[..end].last().map(|part| part.2.clone()).unwrap_or_default())
}

impl RawMesh {
    pub fn new(places: Places, base: u64) -> Self {
        Self {
            positions: Vec::new(),
            corners: Vec::new(),
            ends: Vec::new(),
            places,
            base,
            unit: None,
            part_names: Vec::new(),
            part_starts: Vec::new(),
            notes: Vec::new(),
        }
    }

    pub fn with_lines(base: u64) -> Self {
        Self::new(Places::Lines { vertices: Vec::new(), faces: Vec::new() }, base)
    }

    pub fn with_bytes() -> Self {
        Self::new(Places::Bytes { vertices: Vec::new(), faces: Vec::new() }, 0)
    }

    /// Adds a vertex at line or byte `at`.
    pub fn push_vertex(&mut self, position: DVec3, at: u64) {
        self.positions.push(position);
        match &mut self.places {
            Places::Lines { vertices, .. } | Places::Bytes { vertices, .. } => vertices.push(at),
            Places::Elements(_) => {}
        }
    }

    /// Ends a polygon at line or byte `at`. Its corners are those pushed since the polygon before.
    pub fn end_face(&mut self, at: u64) {
        self.ends.push(self.corners.len());
        match &mut self.places {
            Places::Lines { faces, .. } | Places::Bytes { faces, .. } => faces.push(at),
            Places::Elements(_) => {}
        }
    }

    /// Begins an object. The polygons that follow belong to it.
    pub fn begin_part(&mut self, name: String) {
        self.continue_part(self.part_names.len());
        self.part_names.push(name);
    }

    /// The polygons that follow belong to the object `part`.
    pub fn continue_part(&mut self, part: usize) {
        // An object without polygons leaves no run.
        if self.part_starts.last().is_some_and(|&(first, _)| first == self.ends.len()) {
            self.part_starts.pop();
        }
        self.part_starts.push((self.ends.len(), part));
    }

    /// Number of corners pushed since the last polygon ended.
    pub fn open_corners(&self) -> usize {
        self.corners.len() - self.ends.last().copied().unwrap_or(0)
    }

    /// Adds the triangles of a strip at line or byte `at`. Triangles with two equal corners only
    /// turn the strip; they are not faces.
    pub fn push_strip(&mut self, strip: &[u64], at: u64) {
        for (i, t) in strip.windows(3).enumerate() {
            if t[0] != t[1] && t[1] != t[2] && t[2] != t[0] {
                self.corners.extend(if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] });
                self.end_face(at);
            }
        }
    }
}

/// Checks indices and coordinates, welds, drops unused vertices, and triangulates.
pub(super) fn assemble(
    raw: RawMesh,
    format: MeshFormat,
    source_blake3: String,
) -> Result<LoadedMesh, ReadError> {
    let RawMesh { positions, corners, ends, places, base, unit, part_names, part_starts, mut notes } = raw;
    if ends.is_empty() {
        return Err(ReadError::NoFaces { format, vertices: positions.len() });
    }
    for (what, found) in [("vertices", positions.len()), ("face corners", corners.len())] {
        if found > 3 * TriangleMesh::MAX_ELEMENTS {
            return Err(MeshError::TooLarge { what, found, limit: 3 * TriangleMesh::MAX_ELEMENTS }.into());
        }
    }
    let polygons = || {
        let starts = std::iter::once(&0).chain(&ends);
        starts.zip(&ends).map(|(&start, &end)| &corners[start..end])
    };

    let mut used = vec![false; positions.len()];
    for (face, polygon) in polygons().enumerate() {
        for &index in polygon {
            match usize::try_from(index).ok().and_then(|i| used.get_mut(i)) {
                Some(is_used) => *is_used = true,
                None => {
                    return Err(ReadError::IndexOutOfRange {
                        format,
                        place: places.face(face),
                        face,
                        index: index.saturating_add(base),
                        vertices: positions.len() as u64,
                        base,
                    });
                }
            }
        }
    }
    let non_finite =
        |i: usize| ['x', 'y', 'z'].into_iter().zip(positions[i].to_array()).find(|(_, v)| !v.is_finite());
    let bad = (0..positions.len()).find_map(|i| used[i].then(|| non_finite(i)).flatten().map(|bad| (i, bad)));
    if let Some((i, (axis, value))) = bad {
        let face = polygons().position(|p| p.contains(&(i as u64))).unwrap_or_default();
        let (place, vertex) = (places.vertex(i), i as u64 + base);
        return Err(ReadError::NonFinite { format, place, vertex, base, face, axis, value });
    }

    let unused = used.iter().filter(|u| !**u).count();
    let unused_non_finite = (0..positions.len()).find(|&i| !used[i] && non_finite(i).is_some());
    let mut welded = weld_equal(&positions, &used);
    let mut faces = Vec::with_capacity(corners.len().saturating_sub(2 * ends.len()));
    let mut face_origin = Vec::with_capacity(faces.capacity());
    let mut counts = PolygonCounts::default();
    let (mut outline, mut triangles) = (Vec::new(), Vec::new());
    for (face, polygon) in polygons().enumerate() {
        // Every corner is in range and used, so it has a target.
        let ids = |corner: u32| welded.target[polygon[corner as usize] as usize].unwrap_or_default();
        if polygon.len() == 3 {
            faces.push([ids(0), ids(1), ids(2)]);
            face_origin.push(face as u32);
            continue;
        }
        outline.clear();
        outline.extend(polygon.iter().map(|&i| positions[i as usize]));
        triangles.clear();
        counts.add(face, triangulate(&outline, &mut triangles));
        faces.extend(triangles.iter().map(|t| t.map(ids)));
        face_origin.extend(std::iter::repeat_n(face as u32, triangles.len()));
    }

    if format == MeshFormat::Stl
        && let Some((merged, distance)) = welded.close_rounding(&mut faces)
    {
        notes.push(format!(
            "{} at most {distance:.1e} from another merged, the rounding of STL's 32-bit numbers; the mesh is closed so",
            count(merged, "vertex", "vertices")
        ));
    }
    if unused > 0 {
        notes.push(format!("vertices dropped because no face uses them: {unused}"));
    }
    if let Some(i) = unused_non_finite {
        let place = places.vertex(i);
        notes.push(format!(
            "{place}: vertex {} ({base}-based) is not finite; no face uses it, so it was dropped",
            i as u64 + base
        ));
    }
    counts.note(&places, &mut notes);
    let report = LoadReport {
        format,
        vertices_in_file: positions.len(),
        faces_in_file: ends.len(),
        triangulated_polygons: counts.split,
        concave_polygons: counts.concave,
        welded_vertices: positions.len() - unused - welded.positions.len(),
        unused_vertices: unused,
        unit: unit.map(str::to_owned),
        notes,
        source_blake3,
    };
    Ok(LoadedMesh {
        mesh: TriangleMesh::new(welded.positions, faces)?,
        report,
        parts: parts(part_names, &part_starts, &face_origin),
        origin: Origin { vertices: welded.first, faces: face_origin },
    })
}

/// The objects that have faces. `polygons` has for each face its polygon, ascending.
fn parts(names: Vec<String>, starts: &[(usize, usize)], polygons: &[u32]) -> Vec<MeshPart> {
    let mut parts: Vec<_> = names.into_iter().map(|name| MeshPart { name, faces: Vec::new() }).collect();
    let face = |polygon: usize| polygons.partition_point(|&of| (of as usize) < polygon);
    for (i, &(first, part)) in starts.iter().enumerate() {
        let end = starts.get(i + 1).map_or(polygons.len(), |&(next, _)| face(next));
        let run = face(first)..end;
        if !run.is_empty() {
            parts[part].faces.push(run);
        }
    }
    parts.retain(|part| !part.faces.is_empty());
    parts
}

#[derive(Default)]
struct PolygonCounts {
    split: usize,
    concave: usize,
    first_concave: usize,
    irregular: usize,
    first_irregular: usize,
}

impl PolygonCounts {
    fn add(&mut self, face: usize, shape: Shape) {
        self.split += 1;
        match shape {
            Shape::Convex => {}
            Shape::Concave => {
                if self.concave == 0 {
                    self.first_concave = face;
                }
                self.concave += 1;
            }
            Shape::Irregular => {
                if self.irregular == 0 {
                    self.first_irregular = face;
                }
                self.irregular += 1;
            }
        }
    }

    fn note(&self, places: &Places, notes: &mut Vec<String>) {
        if self.concave > 0 {
            notes.push(format!(
                "{} of {} polygons are concave (the first is polygon {}, 0-based, {}); they were split without overlap",
                self.concave,
                self.split,
                self.first_concave,
                places.face(self.first_concave)
            ));
        }
        if self.irregular > 0 {
            notes.push(format!(
                "{} polygons have no area, cross themselves, or are too intricate to split well (the first is polygon {}, 0-based, {}); \
                 their triangles may be flat or overlap: check the mesh",
                self.irregular,
                self.first_irregular,
                places.face(self.first_irregular)
            ));
        }
    }
}

//! Divides the mesh of a file into its objects.
use std::collections::HashMap;

use glam::DVec3;

use super::{LoadedMesh, Topology, TriangleMesh, WindingNumber};
use crate::geometry::Aabb;

/// A mesh with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedMesh {
    /// The name in the file. Names may repeat, be empty, or have characters that file names cannot
    /// have.
    pub name: String,
    /// The mesh. Its vertices and faces have the order that they had in the whole.
    pub mesh: TriangleMesh,
}

/// Divides a mesh into the objects that its file has ([`LoadedMesh::parts`]). Faces outside of all
/// objects are one more, without a name. If the file has fewer than two objects, the connected
/// components take their place, and their names are numbers from 1.
///
/// Faces that share an edge are connected, unless more than two faces share it. A component that is
/// inside out is a cavity of the smallest component around it, and belongs to that.
///
/// # Example
///
/// ```
/// use tesdf::mesh::{MeshFormat, read_bytes, split};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let tetrahedron = "f -4 -2 -3\nf -4 -3 -1\nf -3 -2 -1\nf -2 -4 -1\n";
/// let corners = |x: i32| format!("v {x} 0 0\nv {} 0 0\nv {x} 1 0\nv {x} 0 1\n", x + 1);
/// let obj = format!("o left\n{}{tetrahedron}o right\n{}{tetrahedron}", corners(0), corners(5));
/// let parts = split(&read_bytes(obj.as_bytes(), MeshFormat::Obj)?);
/// assert_eq!(parts[1].name, "right");
/// assert_eq!(parts[1].mesh.faces().len(), 4);
/// # Ok(())
/// # }
/// ```
pub fn split(loaded: &LoadedMesh) -> Vec<NamedMesh> {
    let mesh = &loaded.mesh;
    if loaded.parts.len() < 2 {
        let parts = components(mesh);
        let named = |(i, faces): (usize, Vec<u32>)| named(mesh, (i + 1).to_string(), &faces);
        return parts.into_iter().enumerate().map(named).collect();
    }
    let mut is_free = vec![true; mesh.faces().len()];
    let mut found = Vec::new();
    for part in &loaded.parts {
        let faces: Vec<u32> = part.faces.iter().cloned().flatten().map(|face| face as u32).collect();
        faces.iter().for_each(|&face| is_free[face as usize] = false);
        found.push(named(mesh, part.name.clone(), &faces));
    }
    let free: Vec<u32> = (0..is_free.len()).filter(|&face| is_free[face]).map(|face| face as u32).collect();
    if !free.is_empty() {
        found.push(named(mesh, String::new(), &free));
    }
    found
}

fn named(mesh: &TriangleMesh, name: String, faces: &[u32]) -> NamedMesh {
    let mut vertices: Vec<u32> = faces.iter().flat_map(|&face| mesh.faces()[face as usize]).collect();
    vertices.sort_unstable();
    vertices.dedup();
    let ids: HashMap<u32, u32> = vertices.iter().enumerate().map(|(i, &v)| (v, i as u32)).collect();
    let positions = vertices.iter().map(|&v| mesh.vertices()[v as usize]).collect();
    let faces = faces.iter().map(|&face| mesh.faces()[face as usize].map(|v| ids[&v])).collect();
    NamedMesh { name, mesh: TriangleMesh::of_part(positions, faces) }
}

/// The faces of each component, by the lowest face. A cavity belongs to the component around it.
fn components(mesh: &TriangleMesh) -> Vec<Vec<u32>> {
    let (of, count) = Topology::new(mesh.faces()).components(|edge| edge.face_count() == 2);
    let mut parts = vec![Vec::new(); count.max(1)];
    for (face, &component) in of.iter().enumerate() {
        // A face with two equal corners bounds nothing, wherever it is.
        let component = if component == Topology::NO_COMPONENT { 0 } else { component as usize };
        parts[component].push(face as u32);
    }
    let volumes: Vec<f64> = parts.iter().map(|faces| volume(mesh, faces)).collect();
    if volumes.iter().all(|&volume| volume >= 0.0) {
        return parts;
    }
    let around = Surroundings::new(mesh, &parts, &volumes);
    for part in 0..parts.len() {
        if volumes[part] < 0.0
            && let Some(outer) = around.smallest(part)
        {
            let cavity = std::mem::take(&mut parts[part]);
            parts[outer].extend(cavity);
        }
    }
    parts.retain(|faces| !faces.is_empty());
    parts.iter_mut().for_each(|faces| faces.sort_unstable());
    parts
}

/// Signed volume, relative to the first corner: positive for an outward surface.
fn volume(mesh: &TriangleMesh, faces: &[u32]) -> f64 {
    let Some(&first) = faces.first() else { return 0.0 };
    let origin = mesh.triangle(first as usize)[0];
    let six = |&face: &u32| {
        let [a, b, c] = mesh.triangle(face as usize).map(|p| p - origin);
        a.dot(b.cross(c))
    };
    faces.iter().map(six).sum::<f64>() / 6.0
}

/// The components that may have cavities.
struct Surroundings<'a> {
    bounds: Vec<Aabb>,
    /// A vertex of each component.
    vertices: Vec<DVec3>,
    outward: Vec<(usize, WindingNumber)>,
    volumes: &'a [f64],
}

impl<'a> Surroundings<'a> {
    fn new(mesh: &TriangleMesh, parts: &[Vec<u32>], volumes: &'a [f64]) -> Self {
        let bounds = |faces: &Vec<u32>| {
            faces.iter().fold(Aabb::EMPTY, |all, &face| all.union(Aabb::of(&mesh.triangle(face as usize))))
        };
        let vertex =
            |faces: &Vec<u32>| faces.first().map_or(DVec3::ZERO, |&face| mesh.triangle(face as usize)[0]);
        let winding = |part: usize| WindingNumber::new(&named(mesh, String::new(), &parts[part]).mesh);
        let outward = (0..parts.len()).filter(|&part| volumes[part] > 0.0).map(|part| (part, winding(part)));
        let vertices = parts.iter().map(vertex).collect();
        Self { bounds: parts.iter().map(bounds).collect(), vertices, outward: outward.collect(), volumes }
    }

    /// The smallest component around `part`.
    fn smallest(&self, part: usize) -> Option<usize> {
        let inner = self.bounds[part];
        let is_around = |(outer, winding): &&(usize, WindingNumber)| {
            let outer = self.bounds[*outer];
            outer.contains(inner.min)
                && outer.contains(inner.max)
                && winding.at_perturbed(self.vertices[part]) > 0
        };
        let around = self.outward.iter().filter(is_around).map(|(outer, _)| *outer);
        around.min_by(|&a, &b| self.volumes[a].total_cmp(&self.volumes[b]).then(a.cmp(&b)))
    }
}

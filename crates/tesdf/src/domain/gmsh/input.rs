//! The input of Gmsh: the surface in the local frame, with a box around it if one is needed, and a
//! script.
use std::fmt::Write;

use glam::DVec3;

use super::GmshSettings;
use crate::{
    domain::conforming::first_at_position,
    geometry::{Aabb, LocalFrame},
    mesh::SolidMesh,
};

/// Rows of squares along the longest side of the box. Without rows, the corners of the box see the
/// whole surface, and the tetrahedra in between get lists of thousands of faces.
const BOX_ROWS: f64 = 8.0;

/// The file that the script merges.
pub(super) const SURFACE: &str = "surface.msh";

/// The surface as entity 1 and the box as entity 2, in MSH 2.2.
pub(super) fn surface(solid: &SolidMesh, frame: &LocalFrame, hull: Option<Aabb>) -> String {
    let mesh = solid.mesh();
    let first = first_at_position(mesh.vertices());
    let mut used = vec![false; mesh.vertices().len()];
    mesh.faces().iter().flatten().for_each(|&v| used[first[v as usize] as usize] = true);
    let mut nodes: Vec<(usize, DVec3)> =
        (0..used.len()).filter(|&v| used[v]).map(|v| (v + 1, frame.to_local(mesh.vertices()[v]))).collect();
    let mut triangles: Vec<(usize, [usize; 3])> =
        mesh.faces().iter().map(|face| (1, face.map(|v| first[v as usize] as usize + 1))).collect();
    if let Some(hull) = hull {
        let hull = Aabb { min: frame.to_local(hull.min), max: frame.to_local(hull.max) };
        let (vertices, faces) = lattice(hull);
        let offset = used.len() + 1;
        nodes.extend(vertices.into_iter().enumerate().map(|(v, p)| (offset + v, p)));
        triangles.extend(faces.into_iter().map(|face| (2, face.map(|v| offset + v))));
    }
    let mut out = format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}\n", nodes.len());
    // Writing to a String cannot fail. `{:e}` gives the shortest decimal that reads back as the
    // same number.
    for (id, p) in nodes {
        let _ = writeln!(out, "{id} {:e} {:e} {:e}", p.x, p.y, p.z);
    }
    let _ = writeln!(out, "$EndNodes\n$Elements\n{}", triangles.len());
    for (element, (entity, [a, b, c])) in triangles.into_iter().enumerate() {
        let _ = writeln!(out, "{} 2 2 0 {entity} {a} {b} {c}", element + 1);
    }
    out + "$EndElements\n"
}

/// The sides of a box as triangles, outward.
fn lattice(bounds: Aabb) -> (Vec<DVec3>, Vec<[usize; 3]>) {
    let extent = bounds.extent();
    let spacing = extent.max_element() / BOX_ROWS;
    let rows: [usize; 3] = std::array::from_fn(|axis| (extent[axis] / spacing).round().max(1.0) as usize);
    let mut vertices = Vec::new();
    let mut ids = std::collections::HashMap::new();
    let mut id = |at: [usize; 3]| {
        *ids.entry(at).or_insert_with(|| {
            let share = DVec3::from_array(std::array::from_fn(|axis| at[axis] as f64 / rows[axis] as f64));
            vertices.push(bounds.min * (1.0 - share) + bounds.max * share);
            vertices.len() - 1
        })
    };
    let mut faces = Vec::new();
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for (side, i, j) in [0, rows[axis]]
            .into_iter()
            .flat_map(|side| (0..rows[u]).flat_map(move |i| (0..rows[v]).map(move |j| (side, i, j))))
        {
            let mut corner = |di: usize, dj: usize| {
                let mut at = [0; 3];
                (at[axis], at[u], at[v]) = (side, i + di, j + dj);
                id(at)
            };
            let (a, b, c, d) = (corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1));
            faces.extend(if side == 0 { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] });
        }
    }
    (vertices, faces)
}

/// The script. Sizes come from the surface alone, so that no vertex is added where none is needed.
pub(super) fn script(settings: GmshSettings, has_box: bool) -> String {
    let algorithm = settings.algorithm.number();
    let [optimize, netgen] = settings.optimizer.numbers();
    let outer = if has_box { "Surface Loop(2) = {2};\nVolume(2) = {2, 1};\n" } else { "" };
    format!(
        "Merge \"{SURFACE}\";\nSurface Loop(1) = {{1}};\nVolume(1) = {{1}};\n{outer}\
         Mesh.Algorithm3D = {algorithm};\nMesh.Optimize = {optimize};\nMesh.OptimizeNetgen = {netgen};\n\
         Mesh.MeshSizeExtendFromBoundary = 0;\nMesh.MeshSizeFromPoints = 0;\nMesh.SaveAll = 1;\n\
         General.NumThreads = 1;\nMesh.MaxNumThreads3D = 1;\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{TriangleMesh, check};

    #[test]
    fn the_box_is_a_closed_surface() {
        let (vertices, faces) =
            lattice(Aabb { min: DVec3::new(-1.0, 0.0, 0.25), max: DVec3::new(3.0, 1.0, 0.5) });
        let faces = faces.into_iter().map(|f| f.map(|v| v as u32)).collect();
        let mesh = TriangleMesh::new(vertices, faces).unwrap();
        let report = check(&mesh);
        assert!(report.is_simple(), "{report}");
        // 8 x 2, 8 x 1 and 2 x 1 squares.
        assert_eq!(mesh.faces().len(), 2 * 2 * (16 + 8 + 2));
    }
}

//! Builds small meshes from bytes. Degenerate shapes are as likely as regular ones.
#![allow(dead_code, reason = "each target uses its own part")]

use glam::DVec3;
use libfuzzer_sys::arbitrary::{Result, Unstructured};
use tesdf::mesh::TriangleMesh;

/// A coordinate from −2 to 2: on a coarse grid, close to it, or any number.
pub fn coordinate(bytes: &mut Unstructured) -> Result<f64> {
    let on_grid = f64::from(bytes.int_in_range(-4i8..=4)?) / 4.0;
    Ok(match bytes.int_in_range(0u8..=9)? {
        0 => on_grid + 10f64.powi(-i32::from(bytes.int_in_range(1u8..=20)?)),
        1 => on_grid * 10f64.powi(-i32::from(bytes.int_in_range(1u8..=60)?)),
        2 => f64::from(bytes.arbitrary::<i32>()?) / f64::from(1u32 << 30),
        _ => on_grid,
    })
}

/// A point with such coordinates.
pub fn point(bytes: &mut Unstructured) -> Result<DVec3> {
    Ok(DVec3::new(coordinate(bytes)?, coordinate(bytes)?, coordinate(bytes)?))
}

/// A mesh of up to 12 vertices and 24 faces in any order.
pub fn soup(bytes: &mut Unstructured) -> Result<TriangleMesh> {
    let vertices = (0..bytes.int_in_range(3usize..=12)?).map(|_| point(bytes)).collect::<Result<Vec<_>>>()?;
    let last = vertices.len() as u32 - 1;
    let faces = (0..bytes.int_in_range(1usize..=24)?)
        .map(|_| {
            Ok([bytes.int_in_range(0..=last)?, bytes.int_in_range(0..=last)?, bytes.int_in_range(0..=last)?])
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(TriangleMesh::new(vertices, faces).expect("ids are in range and numbers finite"))
}

/// A box or octahedron with moved vertices, and sometimes additional faces that have one vertex
/// only. The mesh stays closed, because no face is removed.
pub fn closed(bytes: &mut Unstructured) -> Result<TriangleMesh> {
    let corner = |k: u32| DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64);
    let (mut vertices, mut faces): (Vec<DVec3>, Vec<[u32; 3]>) = if bytes.arbitrary()? {
        let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        (
            (0..8).map(corner).collect(),
            sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        )
    } else {
        let axes = [DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
        let around = (0..4u32).flat_map(|k| [[k, (k + 1) % 4, 4], [(k + 1) % 4, k, 5]]);
        (axes.to_vec(), around.collect())
    };
    for _ in 0..bytes.int_in_range(0usize..=4)? {
        let at = bytes.int_in_range(0..=vertices.len() - 1)?;
        vertices[at] = match bytes.int_in_range(0u8..=3)? {
            0 => vertices[bytes.int_in_range(0..=vertices.len() - 1)?],
            1 => vertices[at] + 1e-9 * point(bytes)?,
            2 => vertices[at] + 0.3 * point(bytes)?,
            _ => point(bytes)?,
        };
    }
    for _ in 0..bytes.int_in_range(0usize..=2)? {
        faces.push([bytes.int_in_range(0..=vertices.len() as u32 - 1)?; 3]);
    }
    Ok(TriangleMesh::new(vertices, faces).expect("ids are in range and numbers finite"))
}

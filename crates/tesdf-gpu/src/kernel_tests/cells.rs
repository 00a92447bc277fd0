//! Cells of points.
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

use cubecl::prelude::*;
use tesdf::TeSdf;
use tesdf::asset::layout::Node;
use tesdf::collide::Shape;
use tesdf::domain::Cell;
use tesdf::encode::{Encoder, Preset};
use tesdf::geometry::internal::barycentric;
use tesdf::glam::DVec3;
use tesdf::mesh::{SolidMesh, TriangleMesh};

use super::{device, groups_of, read, upload};
use crate::GpuShapes;
use crate::kernels::GROUP;
use crate::kernels::geometry::vector::{Row, xyz};
use crate::kernels::scene::shape::{NONE, Shapes};

/// Finds the cell of a point per thread, in the first shape.
#[cube(launch)]
fn locate_points(shapes: &Shapes, points: &[Row], cells: &mut [u32], count: u32) {
    let index = ABSOLUTE_POS as u32;
    if index < count {
        cells[index as usize] = shapes.field(0u32).locate(xyz(points[index as usize])).number;
    }
}

/// A torus, whose cells have many sizes.
fn asset() -> TeSdf {
    const AROUND: u32 = 40;
    const ACROSS: u32 = 20;
    let vertex = |i: u32, j: u32| {
        let (u, v) = (f64::from(i) / f64::from(AROUND) * TAU, f64::from(j) / f64::from(ACROSS) * TAU);
        DVec3::new((3.0 + v.cos()) * u.cos(), (3.0 + v.cos()) * u.sin(), v.sin())
    };
    let number = |i: u32, j: u32| (i % AROUND) * ACROSS + j % ACROSS;
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for (i, j) in (0..AROUND).flat_map(|i| (0..ACROSS).map(move |j| (i, j))) {
        vertices.push(vertex(i, j));
        let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(k, l)| number(i + k, j + l));
        faces.extend([[a, b, c], [a, c, d]]);
    }
    let solid = SolidMesh::new(TriangleMesh::new(vertices, faces).expect("valid ids")).expect("a solid");
    Encoder::new().preset(Preset::Fast).encode(&solid).expect("encodes")
}

/// The leaves of the forest by number, relative to the center of the cube.
fn leaves(asset: &TeSdf) -> BTreeMap<u32, Cell> {
    let arrays = asset.arrays();
    let middle = arrays.cube.middle();
    let root = |root: usize| {
        let Cell { corners, depth } = arrays.cube.root(root);
        (root as u32, Cell { corners: corners.map(|p| p - middle), depth })
    };
    let mut open: Vec<(u32, Cell)> = (0..6).map(root).collect();
    let mut leaves = BTreeMap::new();
    while let Some((number, cell)) = open.pop() {
        match Node::decode(arrays.nodes[number as usize], arrays.lists) {
            Node::Split(first) => open.extend([(first, cell.child(0)), (first + 1, cell.child(1))]),
            _ => drop(leaves.insert(number, cell)),
        }
    }
    leaves
}

/// The found cell holds its point: points anywhere, in corners, centroids and midpoints of cells,
/// beyond the cube, and far away. Where several cells hold a point, any of them may be found.
#[test]
fn kernels_locate_points_in_cells_that_hold_them() {
    let asset = asset();
    let leaves = leaves(&asset);
    let side = asset.arrays().cube.side();
    let mut random = fastrand::Rng::with_seed(5);
    let mut in_cube = || side * (DVec3::from_array(std::array::from_fn(|_| random.f64())) - 0.5);
    let mut points: Vec<DVec3> = (0..4000).map(|_| 1.2 * in_cube()).collect();
    for cell in leaves.values() {
        points.extend(cell.corners);
        points.extend([cell.centroid(), cell.midpoint()]);
    }
    points.extend([1e6, 1e20, -1e30].map(|far| far * DVec3::ONE));
    let rows: Vec<[f32; 4]> = points.iter().map(|p| p.as_vec3().extend(0.0).to_array()).collect();
    let device = device();
    let shapes = GpuShapes::upload(&device, &[Shape::from(asset.clone())]).expect("fits");
    let (rows_there, cells) = (upload(&device, &rows), upload(&device, &vec![0u32; rows.len()]));
    locate_points::launch(
        device.client(),
        groups_of(rows.len()),
        CubeDim::new_1d(GROUP),
        shapes.argument(),
        rows_there.rows(),
        cells.words(),
        rows.len() as u32,
    );
    let cells: Vec<u32> = read(&device, &cells, rows.len());
    // A point of the cube's frame has an error of 2^-24 of the side.
    let rounding = side / f64::from(1 << 22);
    let (mut inside, mut depths) = (0, BTreeSet::new());
    for (row, number) in rows.iter().zip(cells) {
        let p = DVec3::new(row[0].into(), row[1].into(), row[2].into());
        let out = p.abs().max_element() - 0.5 * side;
        if number == NONE {
            assert!(out > -rounding, "{p} has no cell");
            continue;
        }
        assert!(out < rounding, "{p} has cell {number}");
        let cell = leaves.get(&number).unwrap_or_else(|| panic!("{p}: cell {number} is bisected"));
        // The heights of a cell are at least a fifth of its longest edge.
        let least = barycentric(&cell.corners, p).into_iter().fold(f64::INFINITY, f64::min);
        assert!(least * cell.width() > -5.0 * rounding, "{p}: {least} in cell {number}");
        inside += 1;
        depths.insert(cell.depth);
    }
    println!("{inside} points in {} cells of depths {depths:?}", leaves.len());
    assert!(inside > 4000 && depths.len() > 5, "{inside} points in cells of depths {depths:?}");
}

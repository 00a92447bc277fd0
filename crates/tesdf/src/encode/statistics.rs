//! Counts cells and entries of an encoding.
use super::refine::{Leaf, Tree};
use crate::asset::about::Statistics;
use crate::asset::layout::Label;
use crate::base::elementary;
use crate::domain::Cell;
use crate::geometry::LocalFrame;
use crate::mesh::TriangleMesh;

/// Counts the leaves of the trees that grow from `cells`. `labels` are those of the leaves.
pub fn statistics(
    roots: &[Tree],
    labels: &[Label],
    cells: &[Cell],
    mesh: &TriangleMesh,
    frame: LocalFrame,
) -> Statistics {
    let mut s = Statistics {
        faces: mesh.faces().len(),
        vertices: mesh.vertices().len(),
        diagonal: mesh.diagonal(),
        crossing_cells: labels.iter().filter(|l| matches!(l, Label::Crossing(_))).count(),
        ..Statistics::default()
    };
    roots.iter().zip(cells).for_each(|(tree, &cell)| add(&mut s, tree, cell));
    let listed = s.domain_volume - s.far_volume;
    s.volume_weighted_list /= if listed > 0.0 { listed } else { 1.0 };
    let unit = elementary::powi(frame.scale, -3);
    s.domain_volume *= unit;
    s.far_volume *= unit;
    s
}

fn add(s: &mut Statistics, tree: &Tree, cell: Cell) {
    match tree {
        Tree::Split(children) => {
            children.iter().enumerate().for_each(|(side, child)| add(s, child, cell.child(side)));
        }
        Tree::Leaf(Leaf::Outside) => s.outside_cells += 1,
        Tree::Leaf(Leaf::Far) => {
            s.far_cells += 1;
            s.far_volume += cell.volume();
            s.domain_volume += cell.volume();
        }
        Tree::Leaf(Leaf::Listed { faces, .. }) => {
            s.listed_cells += 1;
            s.entries += faces.len();
            s.longest_list = s.longest_list.max(faces.len());
            s.domain_volume += cell.volume();
            s.volume_weighted_list += cell.volume() * faces.len() as f64;
        }
    }
}

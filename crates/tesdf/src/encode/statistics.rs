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

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::base::Chains;
    use crate::domain::DomainCube;
    use crate::geometry::Aabb;

    #[test]
    fn lists_are_weighted_by_volume_and_no_lists_have_the_mean_0() {
        let vertices = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
        let mesh = TriangleMesh::new(vertices, vec![[0, 1, 2]]).expect("valid ids");
        let cube = DomainCube::around(Aabb { min: DVec3::ZERO, max: DVec3::ONE });
        let cell = cube.root(0);
        let volume = cell.volume();
        // Lengths of the local frame are twice those of the mesh.
        let frame = LocalFrame::new(DVec3::ZERO, 2.0);
        let listed = |count: u32| {
            let faces = (0..count).collect();
            Tree::Leaf(Leaf::Listed { faces, crossing: false, chains: Chains::NONE })
        };
        let split = |a, b| Tree::Split(Box::new([a, b]));

        let far = [Tree::Leaf(Leaf::Far), Tree::Leaf(Leaf::Outside)];
        let found = statistics(&far, &[Label::Outside; 2], &[cell, cube.root(1)], &mesh, frame);
        assert_eq!((found.far_cells, found.outside_cells, found.listed_cells), (1, 1, 0));
        assert_eq!((found.domain_volume, found.far_volume), (volume / 8.0, volume / 8.0));
        assert_eq!(found.volume_weighted_list, 0.0);

        // A half of the cell, and two quarters of it.
        let trees = [split(listed(4), split(listed(8), Tree::Leaf(Leaf::Far)))];
        let labels = [Label::Crossing(0), Label::Inside, Label::Inside];
        let found = statistics(&trees, &labels, &[cell], &mesh, frame);
        assert_eq!((found.far_cells, found.listed_cells, found.crossing_cells), (1, 2, 1));
        assert_eq!((found.entries, found.longest_list, found.faces, found.vertices), (12, 8, 1, 3));
        let expected = (4.0 * 0.5 + 8.0 * 0.25) / 0.75;
        assert!((found.volume_weighted_list - expected).abs() < 1e-12, "{found:?}");
    }
}

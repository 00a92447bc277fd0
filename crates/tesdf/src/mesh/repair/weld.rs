use std::collections::HashMap;

use glam::{DVec3, I64Vec3};

use super::Draft;

/// Merges vertices. Returns pairs of the merged vertex and the vertex that replaces it.
///
/// Vertices are visited in ascending order. A vertex is merged into the nearest earlier vertex that
/// was kept and is within `tolerance`; otherwise it is kept. So no vertex moves by more than the
/// tolerance, and the result depends only on the order of the vertices.
pub(super) fn weld(draft: &mut Draft, tolerance: f64) -> Vec<[u32; 2]> {
    let largest = draft.vertices.iter().fold(0.0, |m: f64, p| m.max(p.abs().max_element()));
    // Most points are near no side of their cell, so few cells are looked at. A cell may be larger,
    // so that cell indices fit into 64 bits.
    let cell = (2.0 * tolerance).max(largest * 2f64.powi(-40));
    let key = |p: DVec3| (p / cell).floor().as_i64vec3();
    // Rounding does not move a point that is within the tolerance out of reach.
    let reach = DVec3::splat(tolerance * (1.0 + 1e-12) + largest * 4.0 * f64::EPSILON);
    let mut cells: HashMap<_, Vec<u32>> = HashMap::new();
    let mut target: Vec<u32> = (0..draft.vertices.len() as u32).collect();
    let mut merged = Vec::new();
    for (v, &p) in draft.vertices.iter().enumerate() {
        let (low, high) = (key(p - reach), key(p + reach));
        let around = (low.x..=high.x).flat_map(move |x| {
            (low.y..=high.y).flat_map(move |y| (low.z..=high.z).map(move |z| I64Vec3::new(x, y, z)))
        });
        let near = around
            .filter_map(|at| cells.get(&at))
            .flatten()
            .map(|&u| (draft.vertices[u as usize].distance(p), u))
            .filter(|&(d, _)| d <= tolerance)
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        match near {
            Some((_, u)) => {
                target[v] = u;
                merged.push([v as u32, u]);
            }
            None => cells.entry(key(p)).or_default().push(v as u32),
        }
    }
    draft.faces.iter_mut().flatten().for_each(|v| *v = target[*v as usize]);
    merged
}

use std::collections::HashMap;

use glam::DVec3;

use super::Draft;

/// Merges vertices. Returns pairs of the merged vertex and the vertex that replaces it.
///
/// Vertices are visited in ascending order. A vertex is merged into the nearest earlier vertex that
/// was kept and is within `tolerance`; otherwise it is kept. So no vertex moves by more than the
/// tolerance, and the result depends only on the order of the vertices.
pub(super) fn weld(draft: &mut Draft, tolerance: f64) -> Vec<[u32; 2]> {
    let largest = draft.vertices.iter().fold(0.0, |m: f64, p| m.max(p.abs().max_element()));
    // A cell may be larger than the tolerance, so that cell indices fit into 64 bits.
    let cell = tolerance.max(largest * 2f64.powi(-40));
    let key = |p: DVec3| (p / cell).floor().as_i64vec3();
    let mut cells: HashMap<_, Vec<u32>> = HashMap::new();
    let mut target: Vec<u32> = (0..draft.vertices.len() as u32).collect();
    let mut merged = Vec::new();
    let steps = || (0..27).map(|k| glam::I64Vec3::new(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1));
    for (v, &p) in draft.vertices.iter().enumerate() {
        let at = key(p);
        let near = steps()
            .filter_map(|step| cells.get(&(at + step)))
            .flatten()
            .map(|&u| (draft.vertices[u as usize].distance(p), u))
            .filter(|&(d, _)| d <= tolerance)
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        match near {
            Some((_, u)) => {
                target[v] = u;
                merged.push([v as u32, u]);
            }
            None => cells.entry(at).or_default().push(v as u32),
        }
    }
    draft.faces.iter_mut().flatten().for_each(|v| *v = target[*v as usize]);
    merged
}

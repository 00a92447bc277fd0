use crate::mesh::{Defect, DefectKind, Severity, TriangleMesh};

/// Accepted range of the diagonal, in any unit. Squares and cubes of such lengths, and their
/// differences at full precision, stay far from the ends of the range of 64-bit floats (1e-308 to
/// 1e308).
const DIAGONAL: [f64; 2] = [1e-50, 1e50];

/// Accepted range of absolute values of coordinates other than 0. Numbers of at least 1e-90 are
/// multiples of 2^-352. So products of three coordinate differences are multiples of 2^-1056, which
/// 64-bit floats can hold, and predicates stay exact.
const COORDINATE: [f64; 2] = [1e-90, 1e50];

/// Whether a coordinate is in the range in which predicates are exact.
pub(crate) fn coordinate_in_range(c: f64) -> bool {
    c == 0.0 || (COORDINATE[0]..=COORDINATE[1]).contains(&c.abs())
}

/// Finds values outside the accepted range.
pub(crate) fn out_of_range(mesh: &TriangleMesh) -> Vec<Defect> {
    let mut used = vec![false; mesh.vertices().len()];
    mesh.faces().iter().flatten().for_each(|&v| used[v as usize] = true);
    let mut defects = Vec::new();
    for (v, p) in mesh.vertices().iter().enumerate().filter(|(v, _)| used[*v]) {
        let axes = ['x', 'y', 'z'].into_iter().zip(p.to_array());
        if let Some((axis, value)) = axes.into_iter().find(|(_, c)| !coordinate_in_range(*c)) {
            let message = format!(
                "vertex {v} has {axis} = {value:e}, out of range: expected 0 or an absolute value from {:e} to {:e}; \
                 change the unit",
                COORDINATE[0], COORDINATE[1]
            );
            let defect = Defect::new(DefectKind::OutOfRange, Severity::Error, *p, message);
            defects.push(defect.vertices([v as u32]));
        }
    }
    let diagonal = mesh.diagonal();
    if defects.is_empty() && !(DIAGONAL[0]..=DIAGONAL[1]).contains(&diagonal) {
        let message = format!(
            "the diagonal of the mesh is {diagonal:e}, out of range: expected {:e} to {:e}; change the unit",
            DIAGONAL[0], DIAGONAL[1]
        );
        defects.push(Defect::new(DefectKind::OutOfRange, Severity::Error, mesh.bounds().center(), message));
    }
    defects
}

/// Warns about sizes and positions that 32-bit floats cannot hold, and notes unused vertices.
pub(super) fn scale_defects(mesh: &TriangleMesh) -> Vec<Defect> {
    let mut defects = Vec::new();
    let bounds = mesh.bounds();
    let diagonal = mesh.diagonal();
    let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
    // Rounding to 24 bits would move vertices by more than 1e-6 of the diagonal, the accuracy of
    // 32-bit storage.
    let rounding = largest * f64::from(f32::EPSILON) / 2.0;
    if rounding > 1e-6 * diagonal {
        let message = format!(
            "the mesh is far from the origin: 32-bit floats would move its vertices by up to {rounding:.1e} \
             ({:.1e} of the diagonal); distances are computed relative to a local origin",
            rounding / diagonal
        );
        defects.push(Defect::new(DefectKind::FarFromOrigin, Severity::Warning, bounds.center(), message));
    }
    let square = diagonal * diagonal;
    if square > f64::from(f32::MAX) || square < f64::from(f32::MIN_POSITIVE) {
        let message = format!(
            "the diagonal is {diagonal:.3e}: its square is out of the range of 32-bit floats; check the unit of the mesh"
        );
        defects.push(Defect::new(DefectKind::ExtremeScale, Severity::Warning, bounds.center(), message));
    }
    let mut used = vec![false; mesh.vertices().len()];
    mesh.faces().iter().flatten().for_each(|&v| used[v as usize] = true);
    for v in (0..used.len()).filter(|&v| !used[v]) {
        let message = format!("vertex {v} is used by no face");
        let defect = Defect::new(DefectKind::UnusedVertex, Severity::Note, mesh.vertices()[v], message);
        defects.push(defect.vertices([v as u32]));
    }
    defects
}

/// Corners of the four sides of a positively oriented tetrahedron, counter-clockwise seen from
/// outside. Side `k` is opposite to corner `k`.
const SIDES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// The sides of a positively oriented tetrahedron, outward.
pub fn sides_of(corners: [u32; 4]) -> [[u32; 3]; 4] {
    SIDES.map(|side| side.map(|k| corners[k]))
}

//! The edges of a mesh that stand out, where bodies that are apart can be nearest to each other.
use arrayvec::ArrayVec;
use glam::DVec3;

use super::TeSdf;

/// Faces count as coplanar when the corners of each are within this distance of the plane of the
/// other (local frame), and their normals turn by less than [`TURNED`] (rad).
const COPLANAR: f64 = 1e-9;
const TURNED: f64 = 1e-6;

impl TeSdf {
    /// For each face, in the order of the file, the sides that are edges to be tested: bit k is the
    /// side from corner k to the next one. An edge belongs to the lowest face that has it. Edges
    /// are left out between two coplanar faces, and where two faces form a valley, if the faces
    /// look outward. Made on first use.
    ///
    /// Where the nearest point of a body that is apart lies on an edge, the direction to the other
    /// body is between the normals of its faces. In a valley there is none. On a flat edge it is
    /// the normal of the plane, and then a vertex of the other body, or an edge of either one, is
    /// as near: the border of the part of the plane that is nearest consists of these.
    pub(crate) fn sharp_sides(&self) -> &[u8] {
        self.sharp_sides.get_or_init(|| {
            let sides = |face: usize| {
                (0..3).filter(|&side| self.is_sharp(face, side)).map(|side| 1 << side).sum::<u8>()
            };
            // On one thread: a thread that waits could take up a task that waits for this.
            (0..self.face_count()).map(sides).collect()
        })
    }

    /// The edges to be tested that belong to some faces: 3 × face + side.
    pub(crate) fn sharp_edges(&self, start: u32, count: u32) -> impl Iterator<Item = u32> {
        let sides = &self.sharp_sides()[start as usize..(start + count) as usize];
        (start..).zip(sides).flat_map(|(face, &sides)| {
            (0..3).filter(move |side| sides >> side & 1 == 1).map(move |side| 3 * face + side)
        })
    }

    /// The other faces that have a side of a face.
    pub(crate) fn faces_beside(&self, face: usize, side: usize) -> impl Iterator<Item = usize> {
        let corners = self.faces[face];
        let (start, end) = (corners[side], corners[(side + 1) % 3]);
        let mut last = face;
        self.faces_at(start).iter().map(|&other| other as usize).filter(move |&other| {
            // A face that has the vertex twice is named twice.
            let is_new = other != face && other != last && self.faces[other].contains(&end);
            last = if is_new { other } else { last };
            is_new
        })
    }

    fn is_sharp(&self, face: usize, side: usize) -> bool {
        let next = (side + 1) % 3;
        let corners = self.faces[face];
        let is_same = |other: usize| {
            let (a, b) = (corners[other], corners[(other + 1) % 3]);
            (a.min(b), a.max(b)) == (corners[side].min(corners[next]), corners[side].max(corners[next]))
        };
        let others: ArrayVec<usize, 2> = self.faces_beside(face, side).take(2).collect();
        let is_own = self.faces_beside(face, side).all(|other| self.face_ids[face] < self.face_ids[other]);
        if corners[side] == corners[next] || !is_own || (0..side).any(is_same) {
            return false;
        }
        let [other] = others[..] else { return true };
        // Two faces that go around in the same way have the edge in opposite directions.
        let is_back = |k: &usize| {
            (self.faces[other][*k], self.faces[other][(*k + 1) % 3]) == (corners[next], corners[side])
        };
        let Some(back) = (0..3).find(is_back) else { return true };
        let (own, beside) = (self.local_triangle(face), self.local_triangle(other));
        if own.normal == DVec3::ZERO || beside.normal == DVec3::ZERO {
            return true;
        }
        // The heights of the third corners over the plane of the other face.
        let start = own.corners[side];
        let heights = [
            own.normal.dot(beside.corners[(back + 2) % 3] - start),
            beside.normal.dot(own.corners[(side + 2) % 3] - start),
        ];
        // From the other side, a ridge is a valley.
        let is_valley = self.faces_look_outward() && heights.iter().all(|&height| height > COPLANAR);
        let is_flat = heights.iter().all(|&height| height.abs() <= COPLANAR)
            && own.normal.dot(beside.normal) > 0.0
            && own.normal.cross(beside.normal).length() <= TURNED;
        !is_valley && !is_flat
    }
}

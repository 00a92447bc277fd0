//! The faces around each vertex.

/// For each vertex of a mesh, the faces that have it.
#[derive(Clone, Debug)]
pub struct FacesAt {
    /// Where the faces of each vertex begin, and the end of the last ones.
    starts: Vec<u32>,
    faces: Vec<u32>,
}

impl FacesAt {
    /// `faces` are the vertices of each face; there are `vertices` of them.
    pub fn new(faces: &[[u32; 3]], vertices: usize) -> Self {
        let mut starts = vec![0u32; vertices + 1];
        faces.iter().flatten().for_each(|&v| starts[v as usize + 1] += 1);
        (1..starts.len()).for_each(|v| starts[v] += starts[v - 1]);
        let mut next = starts.clone();
        let mut around = vec![0u32; 3 * faces.len()];
        for (face, corners) in (0u32..).zip(faces) {
            for &v in corners {
                around[next[v as usize] as usize] = face;
                next[v as usize] += 1;
            }
        }
        Self { starts, faces: around }
    }

    /// The faces that have a vertex, in ascending order.
    pub fn of(&self, vertex: u32) -> &[u32] {
        let [start, end] = [vertex, vertex + 1].map(|v| self.starts[v as usize] as usize);
        &self.faces[start..end]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_vertex_has_its_faces_in_order() {
        let around = FacesAt::new(&[[3, 1, 0], [1, 3, 4]], 5);
        let expected: [&[u32]; 5] = [&[0], &[0, 1], &[], &[0, 1], &[1]];
        (0..5).for_each(|v| assert_eq!(around.of(v), expected[v as usize]));
    }
}

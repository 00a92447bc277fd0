//! The places of faces by their ids.
use super::TeSdf;

impl TeSdf {
    /// The place in the file of the face with this id; `None` where there is none. The order of the
    /// ids is made on first use.
    pub(crate) fn place_of_face(&self, id: u32) -> Option<usize> {
        let id_at = |place: &u32| self.face_ids[*place as usize];
        let places = self.faces_by_id.get_or_init(|| {
            let mut places: Vec<u32> = (0..self.faces.len() as u32).collect();
            places.sort_by_key(id_at);
            places
        });
        places.binary_search_by_key(&id, id_at).ok().map(|at| places[at] as usize)
    }
}

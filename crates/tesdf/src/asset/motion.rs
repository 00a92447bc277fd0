use std::sync::Arc;

use super::incidence::Incidence;

/// The faces and tetrahedra that have moved since every list was proved.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    pub incidence: Arc<Incidence>,
    /// By position in the file.
    pub faces: Vec<bool>,
    pub tetrahedra: Vec<bool>,
}

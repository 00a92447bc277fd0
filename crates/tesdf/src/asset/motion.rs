use std::sync::Arc;

use super::incidence::Incidence;

/// What has moved since every list was proved.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    pub incidence: Arc<Incidence>,
    /// By position.
    pub faces: Vec<bool>,
    pub tetrahedra: Vec<bool>,
}

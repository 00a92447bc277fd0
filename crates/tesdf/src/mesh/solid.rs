use super::TriangleMesh;
/// Placeholder.
#[derive(Clone, Debug)]
pub struct SolidMesh(TriangleMesh);
impl SolidMesh {
    /// p
    pub fn new(mesh: TriangleMesh) -> Result<Self, std::convert::Infallible> {
        Ok(Self(mesh))
    }
    /// p
    pub fn mesh(&self) -> &TriangleMesh {
        &self.0
    }
    /// p
    pub fn is_simple(&self) -> bool {
        true
    }
}

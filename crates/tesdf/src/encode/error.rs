use crate::asset::AssetError;
use crate::mesh::MeshError;
use crate::query::Precision;
use crate::verify::Worst;

/// Why a solid cannot be encoded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// [`Progress::cancel`](crate::base::Progress::cancel) was called.
    #[error("the encoding was cancelled")]
    Cancelled,
    /// An option has an invalid value.
    #[error("option {option} is {found}; expected {expected}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// The value found.
        found: String,
        /// The values that are accepted.
        expected: &'static str,
    },
    /// The asset has more of something than the file format can name.
    #[error("{found} {what} are more than the {limit} that the file format can name; split the mesh")]
    TooLarge {
        /// What there is too much of.
        what: &'static str,
        /// The number found.
        found: usize,
        /// The largest number that the format can name.
        limit: usize,
    },
    /// The surface has no face.
    #[error(
        "no face lies between inside and outside, so there is no surface; encode with all faces as the surface"
    )]
    NoSurface,
    /// Everywhere in the domain, lists name many faces that are near each other, and no bisection
    /// makes them shorter.
    #[error(
        "the faces have no short lists: {compared} comparisons of faces with cells were not enough to tell them apart. Face \
         {face} is {slenderness:.1e} times as long as it is high; `tesdf check` lists faces like it, remesh them, or split the mesh"
    )]
    NoShortLists {
        /// The face with the largest ratio of length to height, 0-based.
        face: u32,
        /// Its longest edge over its height.
        slenderness: f64,
        /// Number of comparisons that were made.
        compared: u64,
    },
    /// The mesh does not fit the local frame.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The sampler cannot look at the samples.
    #[error("{0}")]
    Sampler(Box<dyn std::error::Error + Send + Sync>),
    /// The finished file is wrong somewhere, although its lists count as proved. This is a bug of
    /// this library.
    #[error(
        "the encoded file is wrong: at ({}, {}, {}) it says {} in {precision:?}, and all faces say {}; \
         this is a bug of tesdf, so please report it with the mesh and the options; nothing was written",
        worst.point[0], worst.point[1], worst.point[2], worst.found, worst.expected
    )]
    SelfCheck {
        /// The precision of the query.
        precision: Precision,
        /// The point with the largest error.
        worst: Box<Worst>,
    },
    /// The finished file does not open.
    #[error("the encoded asset is not valid: {0}")]
    Asset(#[from] AssetError),
}

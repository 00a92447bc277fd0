use crate::asset::AssetError;
use crate::mesh::MeshError;
use crate::query::Precision;
use crate::verify::Worst;

/// Why a solid cannot be encoded.
#[derive(Debug, thiserror::Error)]
pub enum EncodeError {
    /// [`Progress::cancel`] was called.
    #[error("the encoding was cancelled")]
    Cancelled,
    /// An option has no meaning.
    #[error("option {option} is {found}; expected {expected}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// The value found.
        found: String,
        /// What is accepted.
        expected: &'static str,
    },
    /// More of something than the file format can name.
    #[error("{found} {what} are more than the {limit} that the file format can name; split the mesh")]
    TooLarge {
        /// What there is too much of.
        what: &'static str,
        /// How much was found.
        found: usize,
        /// The most that fits.
        limit: usize,
    },
    /// Lists of faces that are near each other all over the domain, and no bisection makes them shorter.
    #[error(
        "the faces have no short lists: {compared} comparisons of faces with cells were not enough to tell them apart. Face \
         {face} is {slenderness:.1e} times as long as it is high; `tesdf check` lists faces like it, remesh them, or split the mesh"
    )]
    NoShortLists {
        /// The face that is longest for its height, 0-based.
        face: u32,
        /// Its longest edge over its height.
        slenderness: f64,
        /// Comparisons that were made.
        compared: u64,
    },
    /// The mesh does not fit the local frame.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// What looks at samples cannot.
    #[error("{0}")]
    Sampler(Box<dyn std::error::Error + Send + Sync>),
    /// The finished file is wrong somewhere, although its lists count as proved: a bug of this library.
    #[error(
        "the encoded file is wrong: at ({}, {}, {}) it says {} in {precision:?}, and all faces say {}; \
         this is a bug of tesdf, so please report it with the mesh and the options; nothing was written",
        worst.point[0], worst.point[1], worst.point[2], worst.found, worst.expected
    )]
    SelfCheck {
        /// What the query computed with.
        precision: Precision,
        /// The point that is off the most.
        worst: Box<Worst>,
    },
    /// The finished file does not open.
    #[error("the encoded asset is not valid: {0}")]
    Asset(#[from] AssetError),
}

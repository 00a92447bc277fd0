//! What a detection tests, and what a contact of a face stands for.
use serde::{Deserialize, Serialize};

use crate::base::{Length, Named};
use crate::collide::scene::error::CollideError;
use crate::named;

/// The part of body *a* that is tested against the field of body *b*.
///
/// ```
/// use tesdf::collide::{CollideOptions, ContactsPer, Mode};
///
/// let nodes = CollideOptions::with_mode(Mode::Node);
/// let exact = CollideOptions::with_mode(Mode::exact());
/// assert_eq!(exact, CollideOptions::default());
/// let minima = CollideOptions::with_mode(Mode::exact().per(ContactsPer::Minimum));
/// let filtered = CollideOptions::with_mode(Mode::face().per(ContactsPer::Cell).filtered(0.5));
/// # let _ = (nodes, minima, filtered);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mode {
    /// Node-TES: the vertices.
    Node,
    /// Face-TES: the least signed distance over each face (Eq. 9). A fixed number of Frank–Wolfe
    /// iterations gives an upper bound of the minimum. In the field of an open mesh, whose signed
    /// distance jumps, it searches as [`Exact`](Self::Exact).
    Face {
        /// Number of Frank–Wolfe iterations, at most
        /// [`MAX_ITERATIONS`]. Each evaluates the field once. The
        /// paper uses 16.
        ///
        /// [`MAX_ITERATIONS`]: crate::collide::CollideOptions::MAX_ITERATIONS
        iterations: u32,
        /// What a contact is.
        faces: FaceOptions,
    },
    /// As [`Face`](Self::Face), but with the minimum itself, within the
    /// [`tolerance`](FaceOptions::tolerance). It comes from a closed form outside, and from branch
    /// and bound inside.
    Exact(FaceOptions),
}

impl Mode {
    /// The number of Frank–Wolfe iterations of [`face`](Self::face), as in the paper.
    pub const ITERATIONS: u32 = 16;
    /// The Face-TES of the paper: 16 iterations, contacts per cell, and the filter of Eq. (10) with
    /// cos θ = 0.3.
    pub const PAPER: Self = Self::Face {
        iterations: Self::ITERATIONS,
        faces: FaceOptions { contacts_per: ContactsPer::Cell, cos_theta: Some(0.3), ..FaceOptions::DEFAULT },
    };

    /// Face-TES with its defaults: 16 iterations, contacts per face.
    pub const fn face() -> Self {
        Self::Face { iterations: Self::ITERATIONS, faces: FaceOptions::DEFAULT }
    }

    /// The exact mode with its defaults: contacts per face.
    pub const fn exact() -> Self {
        Self::Exact(FaceOptions::DEFAULT)
    }

    /// The options of faces; `None` in the mode [`Node`](Self::Node).
    pub const fn faces(&self) -> Option<&FaceOptions> {
        match self {
            Self::Node => None,
            Self::Face { faces, .. } | Self::Exact(faces) => Some(faces),
        }
    }

    /// The options of faces, to change them; `None` in the mode [`Node`](Self::Node).
    pub const fn faces_mut(&mut self) -> Option<&mut FaceOptions> {
        match self {
            Self::Node => None,
            Self::Face { faces, .. } | Self::Exact(faces) => Some(faces),
        }
    }

    /// The mode with other contacts per face. [`Node`](Self::Node), which has one contact for each
    /// vertex, stays as it is.
    #[must_use]
    pub const fn per(mut self, contacts_per: ContactsPer) -> Self {
        if let Some(faces) = self.faces_mut() {
            faces.contacts_per = contacts_per;
        }
        self
    }

    /// The mode with the filter of Eq. (10) for contacts of faces.
    #[must_use]
    pub const fn filtered(mut self, cos_theta: f64) -> Self {
        if let Some(faces) = self.faces_mut() {
            faces.cos_theta = Some(cos_theta);
        }
        self
    }

    /// The mode with another tolerance for contacts of faces.
    #[must_use]
    pub const fn within(mut self, tolerance: Length) -> Self {
        if let Some(faces) = self.faces_mut() {
            faces.tolerance = tolerance;
        }
        self
    }

    /// What a contact of a face stands for; `None` in the mode [`Node`](Self::Node).
    pub const fn contacts_per(&self) -> Option<ContactsPer> {
        match self.faces() {
            Some(faces) => Some(faces.contacts_per),
            None => None,
        }
    }

    /// Which mode it is.
    pub const fn kind(&self) -> ModeName {
        match self {
            Self::Node => ModeName::Node,
            Self::Face { .. } => ModeName::Face,
            Self::Exact(_) => ModeName::Exact,
        }
    }
}

impl Default for Mode {
    /// [`Mode::exact`].
    fn default() -> Self {
        Self::exact()
    }
}

/// The options that the modes [`Face`](Mode::Face) and [`Exact`](Mode::Exact) share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaceOptions {
    /// One contact for each cell that a face meets, for each face, or for each local minimum.
    pub contacts_per: ContactsPer,
    /// Bound of the error of the mode [`Exact`](Mode::Exact), and of results of the mode
    /// [`Face`](Mode::Face) that count as converged: a fraction of the diagonal of the field's
    /// body, or a length in the world's unit.
    pub tolerance: Length,
    /// Eq. (10): a contact of a face is dropped when ∇φ · n > −cos θ. `None` keeps all.
    pub cos_theta: Option<f64>,
}

impl FaceOptions {
    const DEFAULT: Self =
        Self { contacts_per: ContactsPer::Face, tolerance: Length::OfDiagonal(1e-7), cos_theta: None };
    /// The defaults of a simulation: contacts per local minimum. As planes, other contacts of faces
    /// stop bodies that have room.
    pub const OF_SIMULATION: Self = Self { contacts_per: ContactsPer::Minimum, ..Self::DEFAULT };
}

impl Default for FaceOptions {
    /// Contacts per face, a tolerance of 1e-7 of the diagonal, and no filter.
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// What a contact of the modes [`Face`](Mode::Face) and [`Exact`](Mode::Exact) stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactsPer {
    /// A face of body *a* in one cell of body *b*, as in the paper: the least signed distance over
    /// the part of the face in that cell. A face has as many contacts as it meets cells. The normal
    /// is a direction that both bodies allow, where the way between the points is along one.
    Cell,
    /// A face of body *a*: its least signed distance over all cells. Where the face lies flat on
    /// body *b*, or is large, the extremes of the part that touches are contacts too, so that a box
    /// stands on its corners. The normal is as for [`Cell`](Self::Cell); where both bodies allow
    /// none, of equally near faces of *b*, the one that opposes the face gives it. Faces that have
    /// the same vertex as their contact share it.
    Face,
    /// A local minimum of the signed distance over the surface of body *a*: the contacts of
    /// [`Face`](Self::Face), without those beside which the surface is lower, where the distance
    /// falls by more than 0.1 per unit of length. As planes, these would stop bodies that have
    /// room; those that are walls all the same, as the sides of a groove, stay. Each that is left
    /// out is followed by a lower one, so the deepest contact remains. Of instances that close by
    /// more than 0.1 of the smaller diagonal within the speculative time, all contacts stay.
    ///
    /// Distances are along the normals, which are in the normal cones of both bodies; where these
    /// have no common direction, there is no contact. Of contacts at one place with one normal, in
    /// both orders of a pair, one stays. This is what a simulation needs.
    Minimum,
}

named!(ContactsPer {
    Cell: "cell", "A face in one cell of the other body";
    Face: "face", "A face, with the extremes of flat contact";
    Minimum: "minimum", "A local minimum over the surface";
});

/// Which [`Mode`] it is, without the options of the mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ModeName {
    /// [`Mode::Node`]
    Node,
    /// [`Mode::Face`]
    Face,
    /// [`Mode::Exact`]
    Exact,
}

named!(ModeName {
    Node: "node", "The vertices";
    Face: "face", "The faces, by Frank-Wolfe iterations";
    Exact: "exact", "The faces, with the exact minimum";
});

impl ModeName {
    /// The mode with these options of faces, which the mode `node` does not use.
    pub const fn with(self, faces: FaceOptions) -> Mode {
        match self {
            Self::Node => Mode::Node,
            Self::Face => Mode::Face { iterations: Mode::ITERATIONS, faces },
            Self::Exact => Mode::Exact(faces),
        }
    }
}

/// A mode as texts give it: its name, and beside it the options of the mode. `None` stands for
/// what a text leaves out. A choice that would have no effect is an error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ModeChoices {
    /// The mode.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mode: Option<ModeName>,
    /// What a contact of a face stands for; of the modes `face` and `exact`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contacts_per: Option<ContactsPer>,
    /// Number of Frank–Wolfe iterations; of the mode `face`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iterations: Option<u32>,
    /// Bound of the error; of the modes `face` and `exact`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<Length>,
    /// Threshold of the cosine filter; of the modes `face` and `exact`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cos_theta: Option<f64>,
}

impl ModeChoices {
    /// The mode, `exact` if none is named. `faces` are the defaults of the options of faces.
    ///
    /// # Errors
    /// [`CollideError::NotOfMode`]: an option of another mode.
    pub fn mode(&self, faces: FaceOptions) -> Result<Mode, CollideError> {
        let name = self.mode.unwrap_or(ModeName::Exact);
        const OF_FACES: &str = "`face` and `exact`";
        let options = [
            ("contacts_per", self.contacts_per.is_some(), name != ModeName::Node, OF_FACES),
            ("iterations", self.iterations.is_some(), name == ModeName::Face, "`face`"),
            ("tolerance", self.tolerance.is_some(), name != ModeName::Node, OF_FACES),
            ("cos_theta", self.cos_theta.is_some(), name != ModeName::Node, OF_FACES),
        ];
        for (option, is_chosen, is_used, modes) in options {
            if is_chosen && !is_used {
                return Err(CollideError::NotOfMode { option, mode: name.name(), modes });
            }
        }
        let faces = FaceOptions {
            contacts_per: self.contacts_per.unwrap_or(faces.contacts_per),
            tolerance: self.tolerance.unwrap_or(faces.tolerance),
            cos_theta: self.cos_theta.or(faces.cos_theta),
        };
        Ok(match (name.with(faces), self.iterations) {
            (Mode::Face { faces, .. }, Some(iterations)) => Mode::Face { iterations, faces },
            (mode, _) => mode,
        })
    }
}

impl From<Mode> for ModeChoices {
    /// The choices that give the mode.
    fn from(mode: Mode) -> Self {
        let faces = mode.faces();
        Self {
            mode: Some(mode.kind()),
            contacts_per: faces.map(|faces| faces.contacts_per),
            iterations: match mode {
                Mode::Face { iterations, .. } => Some(iterations),
                Mode::Node | Mode::Exact(_) => None,
            },
            tolerance: faces.map(|faces| faces.tolerance),
            cos_theta: faces.and_then(|faces| faces.cos_theta),
        }
    }
}

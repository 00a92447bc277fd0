//! Normals of contacts from the normal cones of the features that touch, with the rules of
//! `tesdf::collide::cones` (`docs/math.md`, section 18).
//!
//! In: contacts of faces with the gradients of their distances. Out: the same contacts, with
//! normals that both bodies allow; points and distances stay, as do the gradients of places without
//! cones.
//!
//! Everything is in the frame of the field. What differs from the processor is the rounding of
//! `f32`: a place, a height over a plane or a normal is known to some 3e-7, a tenth of the limits
//! that they are compared with.
mod around;
mod cone;
pub mod contact;

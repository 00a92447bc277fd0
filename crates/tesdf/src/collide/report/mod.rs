//! What a detection reports: contacts, hidden overlaps, and fewer or grouped contacts.
pub mod contact;
pub mod hidden_overlap;
pub mod hull;
pub mod patches;
pub mod reduce;
pub mod touching_features;

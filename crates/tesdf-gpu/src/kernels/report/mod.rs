//! Contacts, their order, and those that a reduction keeps.
pub mod contact;
pub mod hull;
pub mod order;
pub mod reduce;
pub mod world_contacts;
pub mod wrench;

//! Memory between the stages.
use super::Capacities;
use crate::GpuError;
use crate::device::{Buffer, Device};
use crate::kernels::products;

/// Bytes of a word and of a row of four `f32`.
pub const WORD: usize = 4;
pub const ROW: usize = 16;

/// Buffers between the stages.
pub struct Products {
    /// Most elements of each.
    pub room: Capacities,
    pub directions: Buffer,
    pub maps: Buffer,
    pub blocks: Buffer,
    pub meshlets: Buffer,
    pub polygons: Buffer,
    /// From the first detection of faces on.
    weights: Option<Buffer>,
    pub contact_words: Buffer,
    pub contact_rows: Buffer,
    /// Of directions: how deep, where no contact need show it.
    pub depths: Buffer,
    pub groups: Buffer,
    /// From the first reduction on.
    pub members: Option<Members>,
}

impl Products {
    pub fn new(device: &Device, room: Capacities) -> Result<Self, GpuError> {
        let buffer = |name, count: u32, size: usize| device.empty(name, count as usize * size);
        Ok(Self {
            room,
            directions: buffer("directions", room.directions, products::DIRECTION_WORDS * WORD)?,
            maps: buffer("maps of directions", room.directions, products::DIRECTION_ROWS * ROW)?,
            blocks: buffer("blocks", room.blocks, products::PAIR_WORDS * WORD)?,
            meshlets: buffer("meshlets", room.meshlets, products::PAIR_WORDS * WORD)?,
            polygons: buffer("polygons", room.polygons, products::POLYGON_WORDS * WORD)?,
            weights: None,
            contact_words: buffer("contacts", room.contacts, products::CONTACT_WORDS * WORD)?,
            contact_rows: buffer("rows of contacts", room.contacts, products::CONTACT_ROWS * ROW)?,
            depths: buffer("depths of directions", room.directions, WORD)?,
            groups: device.empty("groups", 3 * WORD)?,
            members: None,
        })
    }

    /// Where the vertices of polygons are; nodes have none.
    pub fn weights(&mut self, device: &Device) -> Result<Buffer, GpuError> {
        let bytes = self.room.polygons as usize * products::POLYGON_ROWS * ROW;
        let weights = match self.weights.take() {
            Some(weights) => weights,
            None => device.empty("weights of polygons", bytes)?,
        };
        self.weights = Some(weights.clone());
        Ok(weights)
    }

    /// Names and bytes of all.
    pub fn account(&self) -> Vec<(&'static str, usize)> {
        let Self {
            directions,
            maps,
            blocks,
            meshlets,
            polygons,
            contact_words,
            contact_rows,
            depths,
            groups,
            ..
        } = self;
        let own = [directions, maps, blocks, meshlets, polygons, contact_words, contact_rows, depths, groups];
        let members = self.members.as_ref().map(Members::buffers);
        let all = own.into_iter().chain(&self.weights).chain(members.into_iter().flatten());
        all.map(|buffer| (buffer.name(), buffer.bytes())).collect()
    }
}

/// What a reduction needs besides.
pub struct Members {
    /// Contacts of each pair of instances, then the next place for one.
    pub tallies: Buffer,
    pub touching: Buffer,
    /// The contact that a member is.
    pub numbers: Buffer,
    pub members: Buffer,
    pub reports: Buffer,
    pub kept_words: Buffer,
    pub kept_rows: Buffer,
}

impl Members {
    pub fn new(device: &Device, room: Capacities) -> Result<Self, GpuError> {
        let buffer = |name, count: u32, size: usize| device.empty(name, count as usize * size);
        let pairs = room.directions / 2;
        Ok(Self {
            tallies: buffer("tallies of pairs", pairs, WORD)?,
            touching: buffer("pairs that touch", pairs, products::TOUCHING_WORDS * WORD)?,
            numbers: buffer("numbers of members", room.contacts, WORD)?,
            members: buffer("members of pairs", room.contacts, products::MEMBER_ROWS * ROW)?,
            reports: buffer("reports of pairs", pairs, products::REPORT_ROWS * ROW)?,
            kept_words: buffer("kept contacts", room.kept, products::CONTACT_WORDS * WORD)?,
            kept_rows: buffer("rows of kept contacts", room.kept, products::CONTACT_ROWS * ROW)?,
        })
    }

    fn buffers(&self) -> [&Buffer; 7] {
        let Self { tallies, touching, numbers, members, reports, kept_words, kept_rows } = self;
        [tallies, touching, numbers, members, reports, kept_words, kept_rows]
    }
}

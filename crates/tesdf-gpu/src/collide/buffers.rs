//! Pipeline buffers: the memory between the stages of a pass.
use tesdf::collide::Reduction;

use super::Capacities;
use super::counts::Counts;
use crate::GpuError;
use crate::device::{Buffer, Device};
use crate::kernels::detect::candidates::{
    ItemsLaunch, PolygonsLaunch, ROWS as POLYGON_ROWS, WHOLE, WORDS as ITEM_WORDS,
};
use crate::kernels::detect::ordered_pair::{OrderedPairsLaunch, ROWS as PAIR_ROWS, WORDS as PAIR_WORDS};
use crate::kernels::pairs::instance_pairs::FoundLaunch;
use crate::kernels::pairs::meshlets::{BlocksLaunch, WORDS as BLOCK_WORDS};
use crate::kernels::report::contact::{ContactsLaunch, ROWS as CONTACT_ROWS, WORDS as CONTACT_WORDS};
use crate::kernels::report::reduce::members::{
    MembersLaunch, ROWS as MEMBER_ROWS, TOUCHING_WORDS, TouchingLaunch,
};
use crate::kernels::report::reduce::selection::REPORT_ROWS;

/// Size of a word and of a row of four `f32`, in bytes.
pub const WORD: usize = 4;
pub const ROW: usize = 16;

/// The buffers that one stage writes and the next stage reads.
pub struct PipelineBuffers {
    /// Capacity of each buffer, in elements.
    pub room: Capacities,
    pub pair_words: Buffer,
    pair_rows: Buffer,
    blocks: Buffer,
    meshlets: Buffer,
    items: Buffer,
    /// Vertices of the polygons as weights. Allocated at the first detection of faces by cells.
    weights: Option<Buffer>,
    /// The weights of a whole face.
    whole: Buffer,
    pub contact_words: Buffer,
    pub contact_rows: Buffer,
    /// For each ordered pair: the depth of an overlap that contacts need not show.
    pub depths: Buffer,
    pub groups: Buffer,
    /// Allocated at the first reduction.
    pub members: Option<MemberBuffers>,
}

fn words(device: &Device, name: &'static str, count: u32, each: u32) -> Result<Buffer, GpuError> {
    device.empty(name, count as usize * each as usize * WORD)
}

fn rows(device: &Device, name: &'static str, count: u32, each: u32) -> Result<Buffer, GpuError> {
    device.empty(name, count as usize * each as usize * ROW)
}

impl PipelineBuffers {
    pub fn new(device: &Device, room: Capacities) -> Result<Self, GpuError> {
        let words = |name, count, each| words(device, name, count, each);
        let rows = |name, count, each| rows(device, name, count, each);
        Ok(Self {
            room,
            pair_words: words("ordered pairs", room.ordered_pairs, PAIR_WORDS)?,
            pair_rows: rows("maps of ordered pairs", room.ordered_pairs, PAIR_ROWS)?,
            blocks: words("blocks", room.blocks, BLOCK_WORDS)?,
            meshlets: words("meshlets", room.meshlets, BLOCK_WORDS)?,
            items: words("polygons", room.polygons, ITEM_WORDS)?,
            weights: None,
            whole: device.upload("weights of a whole face", &WHOLE)?,
            contact_words: words("contacts", room.contacts, CONTACT_WORDS)?,
            contact_rows: rows("rows of contacts", room.contacts, CONTACT_ROWS)?,
            depths: words("depths of ordered pairs", room.ordered_pairs, 1)?,
            groups: words("groups", 1, 3)?,
            members: None,
        })
    }

    /// Allocates the buffer for the vertices of polygons. Nodes and whole faces need none.
    pub fn add_weights(&mut self, device: &Device) -> Result<(), GpuError> {
        if self.weights.is_none() {
            let weights = rows(device, "weights of polygons", self.room.polygons, POLYGON_ROWS as u32)?;
            self.weights = Some(weights);
        }
        Ok(())
    }

    /// Allocates the buffers of a reduction.
    pub fn add_members(&mut self, device: &Device) -> Result<(), GpuError> {
        if self.members.is_none() {
            self.members = Some(MemberBuffers::new(device, self.room)?);
        }
        Ok(())
    }

    pub fn ordered_pairs(&self) -> OrderedPairsLaunch {
        OrderedPairsLaunch::new(self.pair_words.words(), self.pair_rows.rows(), self.room.ordered_pairs)
    }

    pub fn blocks(&self) -> BlocksLaunch {
        BlocksLaunch::new(self.blocks.words(), self.room.blocks)
    }

    pub fn found(&self) -> FoundLaunch {
        FoundLaunch::new(self.ordered_pairs(), self.blocks())
    }

    pub fn meshlets(&self) -> BlocksLaunch {
        BlocksLaunch::new(self.meshlets.words(), self.room.meshlets)
    }

    pub fn items(&self) -> ItemsLaunch {
        ItemsLaunch::new(self.items.words(), self.room.polygons)
    }

    pub fn polygons(&self) -> PolygonsLaunch {
        // Kernels of polygons are launched only after `add_weights`.
        let weights = self.weights.as_ref().unwrap_or(&self.items);
        PolygonsLaunch::new(self.items(), weights.rows())
    }

    /// Whole faces as polygons.
    pub fn whole_faces(&self) -> PolygonsLaunch {
        PolygonsLaunch::new(self.items(), self.whole.rows())
    }

    pub fn contacts(&self) -> ContactsLaunch {
        ContactsLaunch::new(self.contact_words.words(), self.contact_rows.rows(), self.room.contacts)
    }

    /// The contacts of a pass with these counts, or those that its reduction kept.
    pub fn kept(&self, reduction: Reduction, counts: &Counts) -> ContactBuffers<'_> {
        match (reduction, &self.members) {
            (Reduction::PerPair(_), Some(own)) => {
                ContactBuffers { words: &own.kept_words, rows: &own.kept_rows, count: counts.kept }
            }
            _ => ContactBuffers {
                words: &self.contact_words,
                rows: &self.contact_rows,
                count: counts.contacts,
            },
        }
    }

    /// Name and size in bytes of each buffer.
    pub fn account(&self) -> Vec<(&'static str, usize)> {
        let Self {
            pair_words, pair_rows, blocks, meshlets, items, whole, contact_words, contact_rows, ..
        } = self;
        let pairs = [pair_words, pair_rows, blocks, meshlets, items, whole];
        let own = pairs.into_iter().chain([contact_words, contact_rows, &self.depths, &self.groups]);
        let members = self.members.as_ref().map(MemberBuffers::buffers);
        let all = own.chain(&self.weights).chain(members.into_iter().flatten());
        all.map(|buffer| (buffer.name(), buffer.bytes())).collect()
    }
}

/// The buffers of some contacts, and the number of these.
pub struct ContactBuffers<'a> {
    pub words: &'a Buffer,
    pub rows: &'a Buffer,
    pub count: u32,
}

impl ContactBuffers<'_> {
    pub fn argument(&self) -> ContactsLaunch {
        ContactsLaunch::new(self.words.words(), self.rows.rows(), self.count)
    }
}

/// The buffers of a reduction.
pub struct MemberBuffers {
    room: Capacities,
    /// For each pair of instances: the number of its contacts, later the next free place for a
    /// contact.
    pub tallies: Buffer,
    pub touching: Buffer,
    /// The index of the contact for each member.
    contacts: Buffer,
    rows: Buffer,
    pub reports: Buffer,
    pub kept_words: Buffer,
    pub kept_rows: Buffer,
}

impl MemberBuffers {
    fn new(device: &Device, room: Capacities) -> Result<Self, GpuError> {
        let pairs = room.ordered_pairs / 2;
        Ok(Self {
            room,
            tallies: words(device, "tallies of pairs", pairs, 1)?,
            touching: words(device, "pairs that touch", pairs, TOUCHING_WORDS)?,
            contacts: words(device, "contacts of members", room.contacts, 1)?,
            rows: rows(device, "members of pairs", room.contacts, MEMBER_ROWS)?,
            reports: rows(device, "reports of pairs", pairs, REPORT_ROWS)?,
            kept_words: words(device, "kept contacts", room.kept, CONTACT_WORDS)?,
            kept_rows: rows(device, "rows of kept contacts", room.kept, CONTACT_ROWS)?,
        })
    }

    pub fn touching(&self) -> TouchingLaunch {
        TouchingLaunch::new(self.touching.words(), self.room.ordered_pairs / 2)
    }

    pub fn members(&self) -> MembersLaunch {
        MembersLaunch::new(self.contacts.words(), self.rows.rows())
    }

    pub fn kept(&self) -> ContactsLaunch {
        ContactsLaunch::new(self.kept_words.words(), self.kept_rows.rows(), self.room.kept)
    }

    fn buffers(&self) -> [&Buffer; 7] {
        let Self { tallies, touching, contacts, rows, reports, kept_words, kept_rows, .. } = self;
        [tallies, touching, contacts, rows, reports, kept_words, kept_rows]
    }
}

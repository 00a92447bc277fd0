//! Chooses the member of a pair with the greatest key. Among equal keys, the member with the lowest
//! name wins, so the result does not depend on the order of members.
use cubecl::prelude::*;

use crate::kernels::query::nearest::FAR;
use crate::kernels::report::contact::Contacts;
use crate::kernels::report::reduce::members::{Members, MembersExpand};
use crate::kernels::scene::shape::NONE;

/// Threads per group, which choose together.
pub const GROUP: u32 = 256;

/// A member and its key.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Chosen {
    pub key: f32,
    /// Index of the member; [`NONE`] when there is none.
    pub member: u32,
}

/// Shared memory of a group for a choice.
#[derive(CubeType)]
pub struct Chooser {
    keys: Shared<[f32]>,
    members: Shared<[u32]>,
}

#[cube]
pub fn chooser() -> Chooser {
    Chooser {
        keys: Shared::<[f32]>::new_slice(GROUP as usize),
        members: Shared::<[u32]>::new_slice(GROUP as usize),
    }
}

#[cube]
pub fn nothing_chosen() -> Chosen {
    Chosen { key: -FAR.runtime(), member: NONE.runtime() }
}

#[cube]
impl Members {
    /// Whether the contact of a member comes before that of another member of its pair.
    fn is_before(&self, contacts: &Contacts, member: u32, other: u32) -> bool {
        let (x, y) = (self.contacts[member as usize], self.contacts[other as usize]);
        contacts.compare_names(0u32, x, y) == 1u32
    }

    /// Whether `a` has the greater key, or an equal key and the lower name.
    pub fn wins(&self, contacts: &Contacts, a: Chosen, b: Chosen) -> bool {
        let is_greater = a.key > b.key;
        let mut better = false;
        if a.key == b.key && a.member != NONE && b.member != NONE {
            better = self.is_before(contacts, a.member, b.member);
        }
        is_greater || better
    }

    /// The best choice of all threads. All threads of the group must call it.
    pub fn best(&self, contacts: &Contacts, chooser: &mut Chooser, mine: Chosen) -> Chosen {
        // Wait until all threads have read the last result.
        sync_cube();
        let unit = UNIT_POS as usize;
        chooser.keys[unit] = mine.key;
        chooser.members[unit] = mine.member;
        sync_cube();
        let mut apart = comptime!(GROUP / 2).runtime();
        while apart > 0u32 {
            if UNIT_POS < apart {
                let at = (UNIT_POS + apart) as usize;
                let other = Chosen { key: chooser.keys[at], member: chooser.members[at] };
                let own = Chosen { key: chooser.keys[unit], member: chooser.members[unit] };
                if self.wins(contacts, other, own) {
                    chooser.keys[unit] = other.key;
                    chooser.members[unit] = other.member;
                }
            }
            apart /= 2u32;
            sync_cube();
        }
        Chosen { key: chooser.keys[0], member: chooser.members[0] }
    }
}

//! What has followed the modes of a network at instants.

use crate::mlcp::Role;
use std::collections::HashMap;

/// Modes whose successors are remembered.
const REMEMBERED: usize = 1 << 12;
/// After so many instants without an answer a mode is not asked again: its successors are another matter.
pub const ASKED: u32 = 2;

/// What has followed a mode.
pub enum Next {
    /// this one, last
    Mode(Box<[bool]>),
    /// so often nothing that is found here
    Unknown(u32),
}

/// What has followed the modes met so far.
#[derive(Default)]
pub struct Successors {
    known: HashMap<Box<[u64]>, Next>,
    /// the key of the present one
    key: Vec<u64>,
}

impl Successors {
    /// The mode before and what pairs may do now, as bits.
    pub fn note_key(&mut self, roles: &[Role], active: &[bool]) {
        self.key.clear();
        for (roles, active) in roles.chunks(16).zip(active.chunks(16)) {
            let bits = roles.iter().zip(active).map(|(role, &on)| *role as u64 * 2 + u64::from(on));
            self.key.push(bits.fold(1, |word, bits| word << 3 | bits));
        }
    }

    /// What has followed the mode of the present key.
    pub fn last(&self) -> Option<&Next> {
        self.known.get(self.key.as_slice())
    }

    /// Takes notice of what has followed the mode of the present key.
    pub fn remember(&mut self, active: &[bool], found: bool) {
        if self.known.len() >= REMEMBERED {
            self.known.clear();
        }
        match (self.known.get_mut(self.key.as_slice()), found) {
            (Some(Next::Mode(mode)), true) => mode.copy_from_slice(active),
            (Some(Next::Unknown(times)), false) => *times += 1,
            (Some(next), true) => *next = Next::Mode(active.into()),
            (Some(Next::Mode(_)), false) => {}
            (None, true) => {
                self.known.insert(self.key.as_slice().into(), Next::Mode(active.into()));
            }
            (None, false) => {
                self.known.insert(self.key.as_slice().into(), Next::Unknown(1));
            }
        }
    }
}

//! What has followed the modes of a network at instants.

use crate::mlcp::Role;
use std::collections::HashMap;

/// Modes whose successors are remembered.
const REMEMBERED: usize = 1 << 12;

/// What has followed the modes met so far.
#[derive(Default)]
pub struct Successors {
    known: HashMap<Box<[u64]>, Box<[bool]>>,
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
    pub fn last(&self) -> Option<&[bool]> {
        self.known.get(self.key.as_slice()).map(|mode| &**mode)
    }

    /// Takes notice of what has followed the mode of the present key.
    pub fn remember(&mut self, active: &[bool]) {
        if self.known.len() >= REMEMBERED {
            self.known.clear();
        }
        match self.known.get_mut(self.key.as_slice()) {
            Some(mode) => mode.copy_from_slice(active),
            None => _ = self.known.insert(self.key.as_slice().into(), active.into()),
        }
    }
}

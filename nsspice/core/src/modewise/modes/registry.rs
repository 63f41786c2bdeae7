//! The modes met so far, which of them followed which, and how much memory they may take.

use crate::dense::RankOne;
use crate::modewise::modes::input_power::Supply;
use crate::modewise::modes::mode::Mode;
use crate::modewise::modes::network::Network;
use crate::modewise::modes::outputs::{OutputRows, Outputs};
use crate::modewise::modes::prepared::Reduced;
use crate::switch::Switch;
use std::collections::HashMap;
use std::sync::Arc;

/// Memory for reduced modes [bytes]; beyond it the longest unused ones are forgotten.
const BUDGET: usize = 256 << 20;
/// Followers remembered per mode.
const FOLLOWERS: usize = 64;

/// Pairs by which a mode may differ from the one that it is derived from.
const FLIPS: usize = 4;

/// A mode by number.
pub type Id = usize;

struct Entry {
    on: Box<[bool]>,
    gates: Box<[bool]>,
    made: Option<Result<Arc<Mode>, String>>,
    outputs: Option<Box<OutputRows>>,
    /// points at which outputs were wanted before they were made
    points: f64,
    supplies: Option<Box<[Supply]>>,
    used: u64,
    bytes: usize,
    /// (cause, follower)
    next: Vec<(u64, Id)>,
}

/// All modes.
#[derive(Default)]
pub struct Registry {
    entries: Vec<Entry>,
    by_key: HashMap<Box<[u64]>, Id>,
    clock: u64,
    bytes: usize,
    key: Vec<u64>,
    /// the two modes asked for last
    recent: [Id; 2],
    /// the mode without active pairs, if others can be derived from it
    none: Option<Option<Arc<Mode>>>,
    /// modes that other runs have reduced
    reduced: Arc<Reduced>,
    turn: RankOne,
    /// reductions made
    pub built: u64,
}

impl Registry {
    /// No mode yet but those of other runs.
    pub fn new(reduced: Arc<Reduced>) -> Registry {
        Registry { reduced, ..Registry::default() }
    }

    /// The number of a mode.
    pub fn id(&mut self, on: &[bool], gates: &[bool]) -> Id {
        self.key.clear();
        self.key.resize((on.len() + gates.len()).div_ceil(64), 0);
        for (i, &b) in on.iter().chain(gates).enumerate() {
            if b {
                self.key[i / 64] |= 1 << (i % 64);
            }
        }
        if let Some(&id) = self.by_key.get(&self.key[..]) {
            return id;
        }
        let id = self.entries.len();
        self.by_key.insert(self.key.clone().into(), id);
        self.entries.push(Entry {
            on: on.into(),
            gates: gates.into(),
            made: None,
            outputs: None,
            points: 0.0,
            supplies: None,
            used: 0,
            bytes: 0,
            next: Vec::new(),
        });
        id
    }

    /// Active pairs of a mode.
    pub fn on(&self, id: Id) -> &[bool] {
        &self.entries[id].on
    }

    /// Switch states of a mode.
    pub fn gates(&self, id: Id) -> &[bool] {
        &self.entries[id].gates
    }

    /// Whether a mode is reduced already.
    pub fn is_made(&self, id: Id) -> bool {
        self.entries[id].made.is_some()
    }

    /// The reduced mode, or why there is none.
    pub fn mode(
        &mut self,
        id: Id,
        net: &Network,
        switches: &[Switch],
    ) -> Result<Arc<Mode>, String> {
        self.clock += 1;
        let clock = self.clock;
        self.entries[id].used = clock;
        if self.recent[0] != id {
            self.recent = [id, self.recent[0]];
        }
        if let Some(made) = &self.entries[id].made {
            return made.clone();
        }
        let made = match self.derived(id, net, switches) {
            Some(made) => Ok(Arc::new(made)),
            None => {
                let entry = &self.entries[id];
                self.reduced.mode(net, switches, &entry.on, &entry.gates)
            }
        };
        let entry = &mut self.entries[id];
        entry.bytes = made.as_ref().map_or(256, |m| m.bytes());
        entry.made = Some(made.clone());
        self.built += 1;
        self.bytes += entry.bytes;
        if self.bytes > BUDGET {
            self.forget(id);
        }
        made
    }

    /// The mode by pivots from one of those used last, or from that in which no pair is active: its
    /// slow rates are not lost next to the fast ones of conducting pairs, and pivots keep them.
    fn derived(&mut self, id: Id, net: &Network, switches: &[Switch]) -> Option<Mode> {
        if !net.symmetric || !switches.is_empty() {
            return None;
        }
        let target = &self.entries[id];
        let differ = |from: &Entry| -> Vec<usize> {
            (0..net.m).filter(|&i| from.on[i] != target.on[i]).collect()
        };
        let near = self.recent.iter().filter_map(|&from| match self.entries.get(from) {
            Some(entry @ Entry { made: Some(Ok(mode)), .. }) if from != id => {
                let pairs = differ(entry);
                (pairs.len() <= FLIPS).then(|| (pairs, mode.clone()))
            }
            _ => None,
        });
        let mut ways: Vec<(Vec<usize>, Arc<Mode>)> = near.collect();
        ways.sort_by_key(|way| way.0.len());
        for (pairs, mode) in &ways {
            if let Some(found) = walk(mode, pairs, net, &mut self.turn) {
                return Some(found);
            }
        }
        let none = self.none.get_or_insert_with(|| {
            let off = vec![false; net.m];
            let mode = self.reduced.mode(net, switches, &off, &[]).ok();
            mode.filter(|mode| mode.generation.is_some())
        });
        let pairs: Vec<usize> = (0..net.m).filter(|&i| self.entries[id].on[i]).collect();
        walk(none.as_ref()?, &pairs, net, &mut self.turn)
    }

    /// Drops the longer unused half.
    fn forget(&mut self, keep: Id) {
        let mut ages: Vec<u64> =
            self.entries.iter().filter(|e| e.made.is_some()).map(|e| e.used).collect();
        ages.sort_unstable();
        let limit = ages[ages.len() / 2];
        for (id, entry) in self.entries.iter_mut().enumerate() {
            if id != keep && entry.made.is_some() && entry.used <= limit {
                self.bytes -= entry.bytes;
                entry.bytes = 0;
                entry.made = None;
                entry.outputs = None;
                entry.supplies = None;
            }
        }
    }

    /// The outputs of a mode, which are wanted at so many points more: made as soon as they cost less
    /// than all these points one by one.
    #[inline]
    pub fn outputs(
        &mut self,
        id: Id,
        mode: &Mode,
        outputs: &Outputs,
        points: f64,
    ) -> Option<&OutputRows> {
        if self.entries[id].outputs.is_none() {
            self.make_outputs(id, mode, outputs, points);
        }
        self.entries[id].outputs.as_deref()
    }

    #[cold]
    fn make_outputs(&mut self, id: Id, mode: &Mode, outputs: &Outputs, points: f64) {
        let entry = &mut self.entries[id];
        entry.points += points;
        if entry.points >= outputs.singly(mode) {
            let made = outputs.rows(mode);
            entry.bytes += made.bytes();
            self.bytes += made.bytes();
            entry.outputs = Some(Box::new(made));
        }
    }

    /// Finds what the inputs deliver in a mode, if it is not known; true if it has not been.
    pub fn supply(&mut self, id: Id, mode: &Mode, net: &Network) -> bool {
        let entry = &mut self.entries[id];
        let fresh = entry.supplies.is_none();
        if fresh {
            let made = Supply::all(net, mode);
            let bytes = made.iter().map(Supply::bytes).sum::<usize>();
            entry.bytes += bytes;
            self.bytes += bytes;
            entry.supplies = Some(made.into());
        }
        fresh
    }

    /// What the inputs deliver in a mode.
    pub fn supplies(&self, id: Id) -> &[Supply] {
        self.entries[id].supplies.as_deref().unwrap_or(&[])
    }

    /// What followed this mode after this cause.
    #[inline]
    pub fn follower(&self, id: Id, cause: u64) -> Option<Id> {
        self.entries[id].next.iter().find(|n| n.0 == cause).map(|n| n.1)
    }

    /// Remembers a follower.
    pub fn remember(&mut self, id: Id, cause: u64, next: Id) {
        let list = &mut self.entries[id].next;
        if let Some(known) = list.iter_mut().find(|n| n.0 == cause) {
            known.1 = next;
        } else {
            if list.len() >= FOLLOWERS {
                list.remove(0);
            }
            list.push((cause, next));
        }
    }
}

/// A mode with some pairs turned over.
fn walk(from: &Mode, pairs: &[usize], net: &Network, turn: &mut RankOne) -> Option<Mode> {
    let Some((&last, others)) = pairs.split_last() else { return Some(from.clone()) };
    let mut mode = None;
    for &p in others {
        mode = Some(mode.as_ref().unwrap_or(from).neighbour(net, p, turn)?);
    }
    mode.as_ref().unwrap_or(from).neighbour(net, last, turn)
}

/// Fingerprint of a set of numbers.
pub fn fingerprint(kind: u64, items: impl IntoIterator<Item = usize>) -> u64 {
    items.into_iter().fold(0xcbf2_9ce4_8422_2325 ^ kind, |h, i| {
        (h ^ (i as u64 + 1)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

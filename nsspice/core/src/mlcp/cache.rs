//! Factored modes, kept by mode within a bound on memory.

use super::model::Model;
use super::modes::{ModeFactor, LEVELS};
use crate::linear::DENSE_LIMIT;
use crate::sparse::Csc;
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use std::sync::Arc;

/// Memory for the factors of one problem [bytes].
const BUDGET: usize = 128 << 20;

/// Factors larger than this are changed in place [bytes].
const LARGE: usize = 256 << 10;

/// Mixes 64-bit words; the keys are bit patterns, no adversary chooses them.
#[derive(Default)]
pub(crate) struct WordHasher(u64);

impl Hasher for WordHasher {
    fn finish(&self) -> u64 {
        self.0 ^ (self.0 >> 29)
    }

    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0u8; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.write_u64(u64::from_le_bytes(word));
        }
    }

    fn write_u64(&mut self, word: u64) {
        self.0 = (self.0.rotate_left(5) ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }

    fn write_usize(&mut self, word: usize) {
        self.write_u64(word as u64);
    }
}

struct Entry {
    factor: Arc<ModeFactor>,
    used: u64,
}

/// Of systems whose factors are larger than this, one mode is kept of each level [bytes].
const HUGE: usize = 16 << 20;

/// What a new mode of a level is made from.
struct Recent {
    key: Box<[u64]>,
    /// Jacobian of the mode `active`
    jacobian: Csc,
    active: Vec<bool>,
}

/// Factored modes.  The least recently used ones are dropped when memory runs out; of large systems
/// only the last two modes of each level are kept (before and after an event, solved in turn), and the
/// older one is turned into the next in place.
pub(crate) struct ModeCache {
    entries: HashMap<Box<[u64]>, Entry, BuildHasherDefault<WordHasher>>,
    recent: [Vec<Recent>; LEVELS.len()],
    key: Vec<u64>,
    rows: Vec<usize>,
    clock: u64,
    bytes: usize,
}

impl ModeCache {
    pub fn new() -> ModeCache {
        ModeCache {
            entries: HashMap::default(),
            recent: Default::default(),
            key: Vec::new(),
            rows: Vec::new(),
            clock: 0,
            bytes: 0,
        }
    }

    /// The factor of a mode, made if it is not there.
    pub fn get(&mut self, model: &Arc<Model>, level: usize, active: &[bool]) -> Arc<ModeFactor> {
        self.clock += 1;
        pack(level as u64, active, &mut self.key);
        if let Some(entry) = self.entries.get_mut(self.key.as_slice()) {
            entry.used = self.clock;
            return entry.factor.clone();
        }
        let factor = if model.size() <= DENSE_LIMIT {
            let jacobian = model.mode_jacobian(active, LEVELS[level]);
            Arc::new(ModeFactor::new(model, level, active, &jacobian))
        } else {
            self.make_sparse(model, level, active)
        };
        self.bytes += factor.bytes();
        if self.bytes > BUDGET {
            self.forget_older_half();
        }
        let entry = Entry { factor: factor.clone(), used: self.clock };
        self.entries.insert(self.key.as_slice().into(), entry);
        factor
    }

    /// From the last mode of the level, if there is one.
    fn make_sparse(
        &mut self,
        model: &Arc<Model>,
        level: usize,
        active: &[bool],
    ) -> Arc<ModeFactor> {
        let key = self.key.as_slice();
        let keeps = keeps_modes(model);
        let kept = if keeps || model.factor_bytes > HUGE { 1 } else { 2 };
        if self.recent[level].len() < kept {
            let jacobian = model.mode_jacobian(active, LEVELS[level]);
            let factor = ModeFactor::new(model, level, active, &jacobian);
            let recent = Recent { key: key.into(), jacobian, active: active.to_vec() };
            self.recent[level].push(recent);
            return Arc::new(factor);
        }
        let entries = &self.entries;
        let used = |recent: &&mut Recent| entries.get(&recent.key).map_or(0, |e| e.used);
        let Some(recent) = self.recent[level].iter_mut().min_by_key(used) else {
            unreachable!("as many as are kept");
        };
        for (i, (old, &new)) in recent.active.iter_mut().zip(active).enumerate() {
            if *old != new {
                *old = new;
                model.rewrite_row(i, new, LEVELS[level], &mut recent.jacobian);
            }
        }
        let rows = &mut self.rows;
        let source = if keeps {
            self.entries.get(&recent.key).map(|e| e.factor.clone())
        } else {
            let entry = self.entries.remove(&recent.key);
            entry.map(|entry| {
                self.bytes = self.bytes.saturating_sub(entry.factor.bytes());
                entry.factor
            })
        };
        recent.key.copy_from_slice(key);
        match source {
            None => Arc::new(ModeFactor::new(model, level, active, &recent.jacobian)),
            Some(mut factor) => match Arc::get_mut(&mut factor) {
                Some(own) => {
                    own.change(active, &recent.jacobian, rows);
                    factor
                }
                None => Arc::new(factor.changed(active, &recent.jacobian, rows)),
            },
        }
    }

    /// By halves, so that the search for the oldest does not recur with every new mode.
    fn forget_older_half(&mut self) {
        let mut ages: Vec<u64> = self.entries.values().map(|e| e.used).collect();
        if ages.is_empty() {
            return;
        }
        let middle = ages.len() / 2;
        let (_, &mut median, _) = ages.select_nth_unstable(middle);
        self.entries.retain(|_, e| e.used > median);
        self.bytes = self.entries.values().map(|e| e.factor.bytes()).sum();
    }
}

/// Whether modes are worth keeping: copying large factors takes longer than changing a few rows.
pub(crate) fn keeps_modes(model: &Model) -> bool {
    model.factor_bytes <= LARGE
}

/// Head word, then one bit per pair.
pub(crate) fn pack(head: u64, active: &[bool], key: &mut Vec<u64>) {
    key.clear();
    key.push(head);
    for bits in active.chunks(64) {
        let mut word = 0u64;
        for (i, &a) in bits.iter().enumerate() {
            word |= u64::from(a) << i;
        }
        key.push(word);
    }
}

/// A number for an active set, to notice that it returns.
pub(crate) fn fingerprint(active: &[bool]) -> u64 {
    let mut hasher = WordHasher::default();
    for bits in active.chunks(64) {
        let word = bits.iter().enumerate().fold(0u64, |w, (i, &a)| w | (u64::from(a) << i));
        hasher.write_u64(word);
    }
    hasher.finish()
}

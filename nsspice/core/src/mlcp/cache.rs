//! Factored modes, kept by mode within a bound on memory.

use super::model::Model;
use super::modes::ModeFactor;
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use std::sync::Arc;

/// Memory for the factors of one problem [bytes].
const BUDGET: usize = 128 << 20;

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

/// The least recently used modes are dropped when memory runs out.
pub(crate) struct ModeCache {
    entries: HashMap<Box<[u64]>, Entry, BuildHasherDefault<WordHasher>>,
    key: Vec<u64>,
    clock: u64,
    bytes: usize,
    budget: usize,
    /// number of factorisations so far
    pub factored: u64,
}

impl ModeCache {
    pub fn new() -> ModeCache {
        ModeCache {
            entries: HashMap::default(),
            key: Vec::new(),
            clock: 0,
            bytes: 0,
            budget: BUDGET,
            factored: 0,
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
        let factor = Arc::new(ModeFactor::new(model, level, active));
        self.factored += 1;
        self.bytes += factor.bytes();
        self.make_room();
        let entry = Entry { factor: factor.clone(), used: self.clock };
        self.entries.insert(self.key.as_slice().into(), entry);
        factor
    }

    /// Drops the older half of the modes once the budget is exceeded, so that the search for the
    /// oldest does not recur with every new mode.
    fn make_room(&mut self) {
        if self.bytes <= self.budget || self.entries.is_empty() {
            return;
        }
        let mut ages: Vec<u64> = self.entries.values().map(|e| e.used).collect();
        let middle = ages.len() / 2;
        let (_, &mut median, _) = ages.select_nth_unstable(middle);
        self.entries.retain(|_, e| e.used > median);
        self.bytes = self.entries.values().map(|e| e.factor.bytes()).sum();
    }
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

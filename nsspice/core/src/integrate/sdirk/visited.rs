//! The modes in which steps have been taken, or in which none has a solution, for those who judge them.

use std::collections::HashSet;

/// Modes kept at most.
const MOST: usize = 4096;

/// Sets of conducting pairs, each with the end of its first step [s].
#[derive(Default)]
pub struct Visited {
    last: Vec<bool>,
    known: HashSet<Vec<bool>>,
    found: Vec<(f64, Vec<bool>)>,
}

impl Visited {
    /// Takes notice of a step that has ended at a time.
    pub fn note(&mut self, active: &[bool], time: f64) {
        if self.last == active && !self.known.is_empty() {
            return;
        }
        self.last.clear();
        self.last.extend_from_slice(active);
        if self.known.len() < MOST && !self.known.contains(active) {
            self.known.insert(active.to_vec());
            self.found.push((time, active.to_vec()));
        }
    }

    /// Those found since the last call.
    pub fn take(&mut self) -> Vec<(f64, Vec<bool>)> {
        std::mem::take(&mut self.found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_mode_is_told_once() {
        let mut visited = Visited::default();
        for (k, on) in [false, false, true, false, true].into_iter().enumerate() {
            visited.note(&[on], k as f64);
        }
        assert_eq!(visited.take(), [(0.0, vec![false]), (2.0, vec![true])]);
        assert!(visited.take().is_empty());
    }

    #[test]
    fn a_system_without_pairs_has_one_mode() {
        let mut visited = Visited::default();
        visited.note(&[], 1.0);
        visited.note(&[], 2.0);
        assert_eq!(visited.take(), [(1.0, vec![])]);
    }
}

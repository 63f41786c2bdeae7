//! What a run leaves for those who check it: sampled steps as they are, and both sides of jumps.
//!
//! Nothing is judged here.  A record holds the unknowns at both ends of an accepted step, its
//! multipliers and sources, so that the laws can be checked by code that shares nothing with the
//! solver.

use crate::pieces::Pieces;

/// Records are handed over when they hold this many numbers, so that memory stays bounded.
const FULL: usize = 1 << 18;
/// A record of a step that changes the mode costs as many tokens, and more in large circuits; each
/// step brings one token, and there is a stock for a thousand records.
const PRICE: u64 = 32;
const STOCK: u64 = 1024 * PRICE;

/// Accepted steps, one array per quantity.
#[derive(Clone, Debug, Default)]
pub struct Records {
    /// end of the step [s]
    pub time: Vec<f64>,
    /// its length [s], infinite for static equations
    pub length: Vec<f64>,
    /// unknowns at the end
    pub z: Vec<f64>,
    /// their change over the step
    pub change: Vec<f64>,
    /// multipliers at the end
    pub l: Vec<f64>,
    /// sources at the end, left limits
    pub u: Vec<f64>,
    /// their change over the step
    pub source_change: Vec<f64>,
    /// roles of the pairs; empty without switches
    pub roles: Vec<u8>,
}

impl Records {
    /// Takes one accepted step from `before` and u0 to `z` and u1.
    #[allow(clippy::too_many_arguments)] // one argument per recorded quantity
    pub fn push(
        &mut self,
        time: f64,
        length: f64,
        before: &[f64],
        z: &[f64],
        l: &[f64],
        u0: &[f64],
        u1: &[f64],
        roles: impl Iterator<Item = u8>,
    ) {
        self.time.push(time);
        self.length.push(length);
        self.z.extend_from_slice(z);
        self.change.extend(z.iter().zip(before).map(|(new, old)| new - old));
        self.l.extend_from_slice(l);
        self.u.extend_from_slice(u1);
        self.source_change.extend(u1.iter().zip(u0).map(|(new, old)| new - old));
        self.roles.extend(roles);
    }

    /// Numbers that wait to be fetched.
    pub fn size(&self) -> usize {
        2 * (self.time.len() + self.z.len() + self.u.len()) + self.l.len()
    }
}

/// Chooses the steps to record and keeps them.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    /// one of this many steps is recorded; 0 records none
    every: u64,
    /// steps recorded after a change of mode
    window: u32,
    /// tokens that a record of such a step costs
    price: u64,
    tokens: u64,
    epoch: u64,
    left: u32,
    /// what was recorded
    pub records: Records,
    /// rows of both sides of jumps
    pub sides: Vec<f64>,
    /// rows of both sides are wanted
    pub keep_sides: bool,
    /// steps with error control are recorded one and all
    pub all: bool,
    /// so are those at the ends of all steps of fixed length, within these instants
    between: Option<[f64; 2]>,
    /// outputs that measures follow, by steps with error control
    pub pieces: Pieces,
    /// steps seen
    pub seen: u64,
}

impl Samples {
    /// Records every `every`-th step and `window` steps from each change of mode; `size` is the
    /// number of unknowns and pairs: in large circuits changes that follow each other closely
    /// are sampled.
    pub fn new(every: u64, window: u32, keep_sides: bool, size: usize) -> Samples {
        let price = PRICE + (size / 8) as u64;
        Samples { every, window, price, tokens: STOCK, keep_sides, ..Samples::default() }
    }

    /// Keeps points between the rows, too, within two instants.
    pub fn keep_between(&mut self, window: [f64; 2]) {
        self.between = Some(window);
    }

    /// True if points at a time are kept in addition to the rows.
    pub fn between(&self, time: f64) -> bool {
        self.between.is_some_and(|[from, to]| from <= time && time <= to)
    }

    /// True if the step that begins now is to be recorded in any mode.
    pub fn wants(&mut self, epoch: u64) -> bool {
        if self.every == 0 {
            return false;
        }
        self.seen += 1;
        if self.epoch != epoch {
            return self.changed(epoch); // a switch or a jump has changed it between the steps
        }
        if self.seen.is_multiple_of(self.every) {
            return true;
        }
        self.tokens = (self.tokens + 1).min(STOCK);
        self.left > 0 && self.pay()
    }

    /// True if a step that led to mode `epoch` is to be recorded because the mode is new.
    pub fn changed(&mut self, epoch: u64) -> bool {
        if self.every == 0 || self.epoch == epoch {
            return false;
        }
        self.epoch = epoch;
        self.left = self.window;
        self.pay()
    }

    /// True if the state right after a jump is to be recorded.
    pub fn jumped(&mut self) -> bool {
        self.every > 0 && self.pay()
    }

    /// True if anything is recorded.
    pub fn watches(&self) -> bool {
        self.every > 0
    }

    fn pay(&mut self) -> bool {
        let rich = self.tokens >= self.price;
        if rich {
            self.tokens -= self.price;
            self.left = self.left.saturating_sub(1);
        }
        rich
    }

    /// Numbers that wait to be fetched.
    pub fn waiting(&self) -> usize {
        self.records.size() + self.sides.len() + self.pieces.waiting()
    }

    /// True when they should be fetched.
    pub fn full(&self) -> bool {
        self.waiting() >= FULL
    }

    /// Hands over the records.
    pub fn take_records(&mut self) -> Records {
        std::mem::take(&mut self.records)
    }

    /// Hands over the rows of both sides of jumps.
    pub fn take_sides(&mut self) -> Vec<f64> {
        std::mem::take(&mut self.sides)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_change_of_mode_is_recorded_and_every_eighth_step() {
        let mut w = Samples::new(8, 2, false, 3);
        let mut kept = Vec::new();
        for step in 1..=40u64 {
            let epoch = 1 + step / 20; // changes in step 20
            let before = if step == 20 { 1 } else { epoch };
            if w.wants(before) | w.changed(epoch) {
                kept.push(step);
            }
        }
        assert_eq!(kept, vec![1, 2, 8, 16, 20, 21, 24, 32, 40]);
    }

    #[test]
    fn changes_in_every_step_of_a_large_circuit_are_sampled() {
        let mut w = Samples::new(128, 1, false, 8 * 992);
        let kept = (1..=200_000u64).filter(|&k| w.wants(k - 1) | w.changed(k)).count();
        assert!(kept < 200_000 / 128 + (200_000 + 1024 * 32) / 1024 + 8, "{kept}");
    }
}

//! Matrices of the step lengths in use.

use crate::integrate::implicit::step_length::Stage;
use crate::integrate::implicit::stepper::Stepper;

/// Levels of step lengths: the shortest step is 2^-44 of the longest.
pub const LEVELS: usize = 45;
/// Size below which an unknown is small relative to the others of its kind.
pub const SMALL: f64 = 1e-3;
/// Memory for matrices and factors of all levels [numbers], roughly.
const BUDGET: usize = 40_000_000;

struct Level {
    stage: Stage,
    epoch: u64,
    stamp: u64,
}

/// The implicit steps of some levels; those that have not been used for long are forgotten.
pub struct Levels {
    all: Vec<Option<Box<Level>>>,
    /// so many are kept
    most: usize,
    stamp: u64,
    /// stages assembled
    pub made: u64,
}

impl Levels {
    /// For `size` unknowns and pairs.
    pub fn new(size: usize) -> Levels {
        Levels {
            all: (0..LEVELS).map(|_| None).collect(),
            most: (BUDGET / (200 * size + 1)).clamp(4, LEVELS),
            stamp: 0,
            made: 0,
        }
    }

    /// Number of modes met at the busiest level.
    pub fn mode_count(&self) -> usize {
        self.all.iter().flatten().map(|r| r.stage.mode_count()).max().unwrap_or(0)
    }

    /// The implicit step of a level, of this length [s].
    pub fn at(&mut self, s: &Stepper, level: usize, length: f64) -> &mut Stage {
        self.stamp += 1;
        if self.all[level].is_none() {
            let used = |k: &usize| self.all[*k].as_ref().map_or(u64::MAX, |r| r.stamp);
            if self.all.iter().flatten().count() >= self.most {
                if let Some(oldest) = (0..LEVELS).min_by_key(used) {
                    self.all[oldest] = None;
                }
            }
            let stage = Stage::new(&s.solver.sys, length, true, &s.solver.constants);
            self.all[level] = Some(Box::new(Level { stage, epoch: s.state.epoch, stamp: 0 }));
            self.made += 1;
        }
        let stamp = self.stamp;
        let kept = self.all[level].as_mut().unwrap_or_else(|| unreachable!("just made"));
        kept.stamp = stamp;
        if kept.epoch != s.state.epoch {
            kept.stage.release(); // so that a large factor can be turned into the next in place
            kept.epoch = s.state.epoch;
        }
        &mut kept.stage
    }
}

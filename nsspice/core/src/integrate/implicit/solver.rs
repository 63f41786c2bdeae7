//! What solves one implicit step of any length from a state: matrices by length, factors by mode, and for networks with
//! smooth functions Newton's method.

use super::failure::{Best, Failure, Outcome};
use super::records::{Levels, Scratch};
use super::smooth::SmoothPart;
use super::state::State;
use super::statistics::Statistics;
use super::step_length::{Stage, System};
use crate::mlcp::{Residual, Start};

/// Lengths of ordinary steps whose matrices are kept, and of those that show what follows a jump (up to twenty,
/// the same at each event): as many as this memory holds [numbers], within these bounds.
const BUDGET: usize = 4_000_000;
const FEWEST: [usize; 2] = [12, 24];
const MOST: usize = 96;
/// Numbers that a length takes for each unknown and pair, roughly: matrices, rows and a factor.
const EACH: usize = 200;

/// What to do with solutions so large that the problem may be infeasible up to rounding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::integrate) enum Large {
    /// hand them to the caller, who asks for a certificate
    Refused,
    /// the next one has been certified
    Awaited,
    /// those of this mode have been certified
    Mode(u64),
}

/// The equations of a network and all that solves them.
pub struct Solver {
    pub(in crate::integrate) sys: System,
    /// Newton's method, for a system with smooth nonlinear terms
    pub(in crate::integrate) smooth: Option<Box<SmoothPart>>,
    /// of each source its value, if that is constant
    pub(in crate::integrate) constants: Vec<Option<f64>>,
    /// matrices by step length
    pub(in crate::integrate) levels: Levels,
    /// solutions so large that they are doubtful
    pub(in crate::integrate) large: Large,
    /// counters
    pub stats: Statistics,
    /// work space, and what the last attempt of a step has left there
    pub(in crate::integrate) scratch: Scratch,
}

impl Solver {
    /// For a system; its functions are given apart, to Newton's method.
    pub fn new(
        sys: System,
        smooth: Option<Box<SmoothPart>>,
        constants: Vec<Option<f64>>,
    ) -> Solver {
        let (n, m) = (sys.linear.g.nrows, sys.linear.a.ncols);
        Solver {
            sys,
            smooth,
            constants,
            levels: Levels { stages: Vec::new(), stamp: 0, last_stage: 0 },
            large: Large::Refused,
            stats: Statistics::default(),
            scratch: Scratch::new([n, m]),
        }
    }

    /// Solves the complementarity problem with right-hand side `rhs` at stage `k`.
    pub(in crate::integrate) fn solve(
        &mut self,
        state: &mut State,
        k: usize,
        length: f64,
        start: Start,
    ) -> Outcome {
        self.stats.problems += 1;
        self.scratch.z_before.copy_from_slice(&state.z);
        self.scratch.l_before.copy_from_slice(&state.l);
        if self.smooth.is_some() {
            return self.solve_smooth(state, length, start);
        }
        let stage = &mut self.levels.stages[k];
        stage.release();
        let solved = stage.driver.solve(
            &self.scratch.rhs,
            &self.sys.linear.q,
            &state.roles,
            &mut state.z,
            &mut state.l,
            start,
        );
        let (residual, suspect) = match solved {
            // the way to a very short step is by longer ones, where nothing hides; flaws that
            // remain need a proof that they are no conflict
            Ok(solved)
                if solved.flawed && stage.impulsive && matches!(self.large, Large::Refused) =>
            {
                (solved.residual.worst(), true)
            }
            Ok(solved) => {
                self.stats.worst_stage = self.stats.worst_stage.max(solved.stage);
                let found = stage.driver.active();
                let known = match self.large {
                    Large::Refused => false,
                    Large::Awaited => true,
                    Large::Mode(epoch) => epoch == state.epoch && found == state.active,
                };
                if !solved.needs_certificate || known {
                    if found != state.active {
                        state.active.copy_from_slice(found);
                        state.epoch += 1;
                        self.stats.mode_changes += 1;
                    }
                    if solved.needs_certificate {
                        self.large = Large::Mode(state.epoch);
                    }
                    self.note(solved.residual);
                    return Ok(());
                }
                (solved.residual.worst(), true)
            }
            Err(unsolved) => (unsolved.residual.worst(), false),
        };
        state.z.copy_from_slice(&self.scratch.z_before);
        state.l.copy_from_slice(&self.scratch.l_before);
        Err(self.failed(state, length, residual, suspect, None))
    }

    /// A failure with what a certificate needs.
    pub(in crate::integrate) fn failed(
        &self,
        state: &State,
        length: f64,
        residual: f64,
        suspect: bool,
        best: Option<Box<Best>>,
    ) -> Box<Failure> {
        Box::new(Failure {
            time: state.time,
            length,
            rhs: self.scratch.rhs.clone(),
            roles: state.roles.iter().map(|&r| r as u8).collect(),
            residual,
            suspect,
            best,
            restless: None,
        })
    }

    pub(in crate::integrate) fn solve_static(
        &mut self,
        state: &mut State,
        start: Start,
    ) -> Outcome {
        let k = self.stage_index(state, f64::INFINITY, false);
        let matrices = &self.levels.stages[k].matrices;
        matrices.right_hand_side(&state.z, &state.u0, &state.u1, &mut self.scratch.rhs);
        self.solve(state, k, f64::INFINITY, start)?;
        Ok(())
    }

    pub(in crate::integrate) fn note(&mut self, residual: Residual) {
        self.stats.checks += 1;
        let s = &mut self.stats;
        s.residual_rows = s.residual_rows.max(residual.rows);
        s.residual_complementarity = s.residual_complementarity.max(residual.complementarity);
    }

    /// The stage for a step length; lengths equal up to rounding share one.
    pub(in crate::integrate) fn stage_index(
        &mut self,
        state: &State,
        length: f64,
        impulsive: bool,
    ) -> usize {
        self.levels.stamp += 1;
        let stamp = self.levels.stamp;
        let same = |s: &Stage| {
            s.impulsive == impulsive
                && (s.length == length || (s.length - length).abs() <= 1e-9 * length)
        };
        // most steps are like the last one
        let last = self.levels.last_stage;
        if self
            .levels
            .stages
            .get(last)
            .is_some_and(|s| s.length == length && s.impulsive == impulsive)
        {
            self.levels.stages[last].stamp = stamp;
            return last;
        }
        if let Some(k) = self.levels.stages.iter().position(same) {
            self.levels.stages[k].stamp = stamp;
            self.levels.last_stage = k;
            return k;
        }
        let alike = |k: &usize| self.levels.stages[*k].impulsive == impulsive;
        let kept = (0..self.levels.stages.len()).filter(alike);
        let size = state.z.len() + state.l.len();
        let most = (BUDGET / (EACH * size + 1)).clamp(FEWEST[usize::from(impulsive)], MOST);
        if kept.clone().count() >= most {
            let oldest = kept.min_by_key(|&k| self.levels.stages[k].stamp).unwrap_or(0);
            self.levels.stages.swap_remove(oldest);
        }
        let mut stage = Stage::new(&self.sys, length, impulsive, &self.constants);
        stage.stamp = stamp;
        self.levels.stages.push(stage);
        self.levels.stages.len() - 1
    }
}

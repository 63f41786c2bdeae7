//! What finding a state jump may see of a run: neither the switches nor the records.

use crate::integrate::implicit::records::{Facts, Instants};
use crate::integrate::implicit::solver::Solver;
use crate::integrate::implicit::state::State;
use crate::integrate::implicit::stepper::Stepper;
use crate::waveform::Waveform;

/// Finds state jumps, and the values and rates right after them.
pub(in crate::integrate) struct StateJumps<'a> {
    pub solver: &'a mut Solver,
    pub state: &'a mut State,
    pub instants: &'a mut Instants,
    pub facts: &'a Facts,
    pub sources: &'a [Waveform],
    /// nominal [s]
    pub step_length: f64,
}

impl Stepper {
    /// What finds state jumps, at the present state.
    pub(in crate::integrate) fn jumps(&mut self) -> StateJumps<'_> {
        StateJumps {
            solver: &mut self.solver,
            state: &mut self.state,
            instants: &mut self.instants,
            facts: &self.facts,
            sources: &self.waveforms,
            step_length: self.schedule.step_length,
        }
    }
}

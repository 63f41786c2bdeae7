//! What a run passes through, segment by segment, for those who ask how it depends on its beginning.

use crate::integrate::Failure;
use crate::modewise::functions::inputs::Segment;
use crate::modewise::modes::mode::Mode;
use crate::modewise::run::Engine;
use crate::modewise::run_state::Phase;
use std::sync::Arc;

/// A segment that has been passed through.
pub struct Passage {
    /// modes through whose constraints the state jumped on the way in
    pub state_jumps: Vec<Arc<Mode>>,
    /// the mode
    pub mode: Arc<Mode>,
    /// inputs from its start on
    pub inputs: Segment,
    /// its ends [s]
    pub start: f64,
    /// see `start`
    pub end: f64,
    /// modal coordinates at both ends
    pub first: Vec<f64>,
    /// see `first`
    pub last: Vec<f64>,
    /// `[1; inputs]` at its end, left limit
    pub v: Vec<f64>,
    /// guards of the mode that came to their end there
    pub crossing: Vec<usize>,
}

/// How an interval of the run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Passed {
    /// at the time asked for
    Stop,
    /// as the gate of a switch went up
    Trigger,
    /// implicit steps, sampled switches or an impact without derivative were needed
    Unproved,
    /// after more segments than are kept
    Many,
}

/// Segments that are kept.
const MOST: usize = 200_000;

/// Keeps the passages of a run.
#[derive(Default)]
pub(in crate::modewise) struct Trace {
    pub on: bool,
    /// jumps on the way into the segment to come
    pub state_jumps: Vec<Arc<Mode>>,
    /// an impact was resolved by implicit steps
    pub struck: bool,
    pub passages: Vec<Passage>,
}

impl Engine {
    /// Runs from the present state to the planned end, or until the gate of a switch goes up; keeps what it passes.
    pub fn pass(&mut self, trigger: Option<usize>) -> Result<Passed, Failure> {
        while self.span.time < self.plan.stop {
            let stepped = !matches!(self.span.phase, Phase::Moving)
                || self.control.sampling.on.contains(&true);
            if stepped || self.trace.struck {
                return Ok(Passed::Unproved);
            }
            if self.trace.passages.len() >= MOST {
                return Ok(Passed::Many);
            }
            let before = trigger.map(|s| self.control.gates[s]);
            self.finish()?;
            if before == Some(false) && trigger.is_some_and(|s| self.control.gates[s]) {
                return Ok(Passed::Trigger);
            }
        }
        Ok(if self.trace.struck { Passed::Unproved } else { Passed::Stop })
    }

    /// Keeps passages from now on, beginning with the next start.
    pub fn trace(&mut self) {
        self.trace = Trace { on: true, ..Trace::default() };
    }

    /// The passages kept so far.
    pub fn take_passages(&mut self) -> Vec<Passage> {
        std::mem::take(&mut self.trace.passages)
    }

    /// States of the switches' gates.
    pub fn gates(&self) -> &[bool] {
        &self.control.gates
    }

    /// A mode has been entered that is left immediately, since a switch reacts: its jump counts.
    pub(in crate::modewise) fn note_state_jumps(&mut self, mode: &Arc<Mode>, left_at_once: bool) {
        if !self.trace.on {
            return;
        }
        for k in 0..self.picker.state_jumps.len() {
            let through = self.picker.state_jumps[k].through;
            if let Ok(mode) =
                self.registry.mode(through, &self.prepared.net, &self.prepared.switches)
            {
                self.trace.state_jumps.push(mode);
            }
        }
        if left_at_once && mode.impulses.is_some() {
            self.trace.state_jumps.push(mode.clone());
        }
    }

    /// A segment ends: modal coordinates and inputs there are at hand.
    pub(in crate::modewise) fn trace_passage(&mut self, mode: &Arc<Mode>) {
        if !self.trace.on {
            return;
        }
        let state_jumps = std::mem::take(&mut self.trace.state_jumps);
        self.trace.passages.push(Passage {
            state_jumps,
            mode: mode.clone(),
            inputs: self.motion.segment.clone(),
            start: self.span.time,
            end: self.span.end,
            first: self.motion.path.start().to_vec(),
            last: self.state.x.clone(),
            v: self.state.v.clone(),
            crossing: self.span.crossing.clone(),
        });
    }
}

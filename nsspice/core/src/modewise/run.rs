//! The run: segment after segment, rows evaluated at their instants.

use crate::integrate::{by_sources, Failure, Progress};
use crate::modewise::checks::energy_balance::EnergyBalance;
use crate::modewise::checks::samples::Samples;
use crate::modewise::checks::segment_points::Along;
use crate::modewise::events::accumulation::Accumulation;
use crate::modewise::events::at_threshold::Control;
use crate::modewise::events::implicit_steps::Stepped;
use crate::modewise::events::successor::{cause_of, roles, Picker, Scene};
use crate::modewise::events::verify::Scale;
use crate::modewise::log::{Log, Statistics};
use crate::modewise::modes::implicit_step::Implicit;
use crate::modewise::modes::mode::{Mode, Watch};
use crate::modewise::modes::outputs::{Outputs, Spec};
use crate::modewise::modes::prepared::Prepared;
use crate::modewise::modes::registry::{Id, Registry};
use crate::modewise::output::passages::Trace;
use crate::modewise::output::rows::Table;
use crate::modewise::run_state::{Motion, Phase, Plan, Span, State};
use crate::modewise::segments::root_bracketing::{Ending, EventSearch};
use crate::modewise::series::run::Expanded;
use crate::row_clock::RowClock;
use crate::switch::comparisons_first;
use std::time::{Duration, Instant};

/// Segments between two looks at the clock.
const LOOK: u64 = 32;
/// Switch reactions at one instant before it is called chatter.
const MAX_REACTIONS: usize = 64;
/// Segments between two residual checks of known modes.
pub(super) const CHECK: u64 = 64;

/// One system in the course of its simulation.
pub struct Engine {
    /// what is simulated
    pub prepared: Prepared,
    /// states of the switches
    pub control: Control,
    /// rows and what else is made of outputs
    pub table: Table,
    pub(super) registry: Registry,
    pub(super) implicit: Implicit,
    pub(super) picker: Picker,
    pub(super) event_search: EventSearch,
    pub(super) motion: Motion,
    pub(super) scale: Scale,
    pub(super) plan: Plan,
    pub(super) span: Span,
    pub(super) state: State,
    pub(super) accumulation: Accumulation,
    pub(super) checked: Vec<bool>,
    pub(super) expanded: Expanded,
    pub(super) samples: Samples,
    pub(super) along: Along,
    pub(super) energy_balance: EnergyBalance,
    pub(super) trace: Trace,
    /// jumps and changes of pairs
    pub log: Log,
    /// counters
    pub stats: Statistics,
}

impl Engine {
    /// Prepares a run of a system.
    pub fn new(prepared: &Prepared, outputs: Vec<Spec>) -> Engine {
        let (net, switches) = (&prepared.net, prepared.switches.len());
        let count = 1 + prepared.inputs.len();
        let scale = Scale { v: vec![0.0; count], rate: vec![0.0; count], ..Scale::default() };
        Engine {
            implicit: Implicit::new(net.n, net.m, prepared.models.clone()),
            control: Control::new(switches),
            table: Table::new(Outputs::new(outputs, net, &prepared.inputs)),
            registry: Registry::new(prepared.modes.clone()),
            picker: Picker::default(),
            event_search: EventSearch::default(),
            motion: Motion::default(),
            scale,
            plan: Plan { rows: RowClock::new(0.0, 1.0, 0.0), stop: 0.0, fixed_step: 1.0 },
            span: Span::default(),
            state: State::new(net, count),
            accumulation: Accumulation::default(),
            checked: Vec::new(),
            expanded: Expanded::default(),
            samples: Samples::default(),
            along: Along::default(),
            energy_balance: EnergyBalance::default(),
            trace: Trace::default(),
            log: Log { pairs: vec![false; net.m], ..Log::default() },
            stats: Statistics::default(),
            prepared: prepared.clone(),
        }
    }

    /// Number of output columns, the time included.
    pub fn columns(&self) -> usize {
        self.table.outputs.len() + 1
    }

    /// Plans rows from `out_start` to `stop`; returns their number. `fixed_step` bounds implicit steps.
    pub fn plan(&mut self, stop: f64, out_start: f64, out_step: f64, fixed_step: f64) -> u64 {
        self.plan.stop = stop;
        self.plan.fixed_step = fixed_step;
        self.control.sampling = self.new_sampling();
        self.picker.verifier.seen.resize(self.prepared.switches.len(), 0.0);
        self.samples.controls.resize(self.prepared.switches.len(), 0.0);
        self.plan.rows = RowClock::new(out_start, out_step, stop);
        self.plan.rows.count()
    }

    /// Starts at time 0 from charges and fluxes `E z`, with the gates in given states, and from a mode by
    /// the pairs that conduct, if it is known: where nothing is stored there may be several.
    pub fn start(
        &mut self,
        charges: &[f64],
        gates: &[bool],
        active: Option<Vec<bool>>,
    ) -> Result<(), Failure> {
        self.control.gates.copy_from_slice(gates);
        self.prepared.net.energy(charges, &mut self.state.a);
        self.scale.see_state(&self.state.a);
        self.sample_end();
        self.balance_start();
        self.span.time = 0.0;
        self.guess_scale();
        self.motion.present = None;
        self.prepare_series();
        self.enter_known(active);
        self.begin(&[])?;
        let on = match self.expanded_pairs() {
            Some(on) => on,
            None => self.registry.on(self.present_id()).to_vec(),
        };
        self.log.begin(&on);
        Ok(())
    }

    /// The states of the gates at the start from those `before`, if the sources alone decide about them.
    pub fn gates_by_sources(&self, before: &[bool]) -> Option<Vec<bool>> {
        by_sources(&self.prepared.sys.linear, &self.prepared.switches, before, &self.sources(0.0))
    }

    pub(super) fn present_id(&self) -> Id {
        self.motion.present.as_ref().map_or(0, |p| p.0)
    }

    /// A first idea of how large the state becomes: a start from rest has no scale of its own.
    fn guess_scale(&mut self) {
        self.prepared.inputs.begin(0.0, &mut self.motion.segment);
        let h = self.plan.fixed_step.min(self.plan.stop);
        self.scale.see_inputs(&self.motion.segment, h);
        let roles = roles(self.prepared.net.m, &self.prepared.switches, &self.control.gates);
        crate::modewise::modes::implicit_step::later(&self.motion.segment, 0.0, &mut self.state.v);
        let step = self.implicit.step(
            &self.prepared.sys,
            &self.prepared.net,
            &self.state.a,
            &self.state.v,
            &roles,
            h,
        );
        if step.is_ok_and(|s| !s.suspect) {
            let a = self.coordinates(&self.implicit.z);
            self.scale.see_state(&a);
        }
    }

    /// Energy coordinates of what the unknowns `z` store.
    pub(super) fn coordinates(&self, z: &[f64]) -> Vec<f64> {
        let mut charges = vec![0.0; self.prepared.net.n];
        self.prepared.sys.linear.e.mul_add(1.0, z, &mut charges);
        let mut a = vec![0.0; self.prepared.net.states];
        self.prepared.net.energy(&charges, &mut a);
        a
    }

    /// Takes the inputs of a segment from here on; returns how long it may last: to a breakpoint, the end of the run,
    /// or the next look at sampled switches [s].
    pub(super) fn begin_inputs(&mut self) -> f64 {
        self.prepared.inputs.begin(self.span.time, &mut self.motion.segment);
        if self.span.breakpoint <= self.span.time {
            self.span.breakpoint = self.prepared.inputs.next_breakpoint(self.span.time);
        }
        let last = if self.span.time >= self.plan.stop { f64::INFINITY } else { self.plan.stop };
        let mut horizon = self.span.breakpoint.min(last) - self.span.time;
        if !horizon.is_finite() {
            horizon = 1e-3 * self.plan.stop;
        }
        self.scale.see_inputs(&self.motion.segment, horizon.min(self.plan.stop));
        horizon.min(self.look() - self.span.time)
    }

    /// Finds the mode from the present time on and walks to the end of the segment. `crossing`:
    /// guards of the mode so far that have come to their end.
    pub(super) fn begin(&mut self, crossing: &[usize]) -> Result<(), Failure> {
        let horizon = self.begin_inputs();
        if self.begin_expanded(crossing, horizon) {
            return Ok(());
        }
        self.throw_by_inputs();
        let mut crossing: &[usize] = crossing;
        let mut struck = false;
        for _ in 0..MAX_REACTIONS {
            let from = self.motion.present.as_ref().map(|p| p.0);
            let cause = cause_of(crossing, &self.control.gates);
            let scene = Scene { prepared: &self.prepared, segment: &self.motion.segment, horizon };
            let picked = self.picker.pick(
                &scene,
                &mut self.registry,
                &mut self.implicit,
                from,
                cause,
                crossing,
                &self.control.gates,
                &mut self.state.a,
                &mut self.scale,
                &mut self.motion.path,
            );
            let Some(picked) = picked else {
                if !struck && !crossing.is_empty() && self.impact(horizon) {
                    (struck, crossing) = (true, &[]);
                    self.trace.struck = true;
                    continue;
                }
                return self.carry_on();
            };
            if picked.mode.impulses.is_some() || !self.picker.state_jumps.is_empty() {
                let origin = match self.picker.state_jumps.first() {
                    Some(state_jump) => state_jump.before.clone(),
                    None => self.state.a.clone(),
                };
                let entry = self.state.a.clone();
                // the state with which the run goes on
                let (start, now) = (self.motion.path.start(), &self.motion.segment.now);
                picked.mode.leave(start, now, &mut self.state.a);
                self.note_jump(&picked.mode, picked.id, &origin, &entry);
            }
            if from != Some(picked.id) {
                self.stats.mode_changes += 1;
            }
            let settled = self.picker.verifier.thrown.is_empty() && !self.rest();
            self.note_state_jumps(&picked.mode, !settled);
            self.motion.present = Some((picked.id, picked.mode));
            if settled {
                return self.walk(horizon);
            }
            comparisons_first(&self.prepared.switches, &mut self.picker.verifier.thrown);
            for k in 0..self.picker.verifier.thrown.len() {
                let s = self.picker.verifier.thrown[k];
                self.note_turn_at_begin(s);
                self.throw(s);
                if self.control.sampling.on[s] {
                    self.control.sampling.turn(s, -self.picker.verifier.seen[s]);
                }
            }
            crossing = &[];
        }
        self.stats.chatter += 1;
        self.span.phase = Phase::Fresh; // the modes that were tried lead nowhere
        let last = self.picker.verifier.thrown.last();
        Err(Failure::restless(self.span.time, last.map(|&s| self.prepared.switches[s].pair)))
    }

    /// Switches whose control is a source react before anything else is looked at.
    fn throw_by_inputs(&mut self) {
        let Some((id, mode)) = self.motion.present.clone() else { return };
        let gates = self.registry.gates(id).to_vec();
        for &(j, s) in &mode.guards.direct {
            // one that has just crossed its threshold has reacted; this guard is of its old state
            if self.control.gates[s] != gates[s] {
                continue;
            }
            let g = crate::dense::dot(mode.guards.rows.v.row(j), &self.motion.segment.now)
                + crate::dense::dot(mode.guards.rows.d.row(j), &self.motion.segment.rate);
            let size: f64 = mode
                .guards
                .rows
                .v
                .row(j)
                .iter()
                .zip(&self.motion.segment.now)
                .map(|(c, v)| (c * v).abs())
                .sum();
            if g < -1e-13 * size {
                self.note_turn(&mode, s, true);
                self.throw(s);
            }
        }
    }

    /// The same after implicit steps.
    pub(super) fn walk_from_here(&mut self, horizon: f64) {
        self.accumulation.recent.clear();
        self.walk(horizon).ok();
    }

    /// Marches through the segment that has been begun.
    fn walk(&mut self, horizon: f64) -> Result<(), Failure> {
        let Some((id, mode)) = self.motion.present.clone() else { return Ok(()) };
        self.sample_begin(&mode);
        let (verifier, looked) = (&self.picker.verifier, self.event_search.intervals);
        let (length, ending) = self.event_search.walk(
            &self.motion.path,
            &verifier.start,
            &verifier.guards,
            &verifier.noise,
            &verifier.clear,
            horizon,
            self.span.time,
        );
        self.span.ending = ending;
        self.span.end = match ending {
            // the breakpoint's own time, not a sum
            Ending::Horizon if self.span.breakpoint - self.span.time <= horizon => {
                self.span.breakpoint
            }
            Ending::Horizon => self.span.time + length,
            Ending::Crossing => self.span.time + length,
        };
        self.span.crossing.clear();
        self.span.crossing.extend_from_slice(&self.event_search.crossing);
        self.stats.segments += 1;
        self.stats.undetermined += u64::from(mode.open > 0);
        self.table.inside.ready = false;
        self.span.phase = Phase::Moving;
        self.state.x.resize(mode.n, 0.0);
        if ending == Ending::Crossing || self.stats.segments < 32 {
            // both ends may be zero: how large the state is shows in between
            for part in [0.25, 0.6] {
                self.motion.path.at(part * length, &mut self.motion.point);
                self.see(&mode);
            }
        }
        match self.event_search.reached(length) {
            Some(reached) => std::mem::swap(reached, &mut self.motion.point),
            None => self.motion.path.at(length, &mut self.motion.point),
        }
        self.look_along(&mode, length, self.event_search.intervals - looked);
        self.stats.events += self.log.note(self.registry.on(id), self.span.time);
        if id >= self.checked.len() {
            self.checked.resize(id + 1, false);
        }
        let fresh = !self.checked[id];
        // what begins at the end of the run serves its last row: laws count, energies hardly
        let part = if self.span.time < self.plan.stop { 1.0 } else { 0.0 };
        self.sample_segment(&mode, part * length, fresh);
        if fresh || self.stats.segments.is_multiple_of(CHECK) {
            self.checked[id] = true;
            self.motion.path.at(0.618 * length, &mut self.motion.point);
            self.check(&mode);
            self.motion.path.at(length, &mut self.motion.point);
        }
        self.hand_segment();
        Ok(())
    }

    /// Leaves the segment: state at its end, and on.
    pub(super) fn finish(&mut self) -> Result<(), Failure> {
        if self.expanded.active {
            return self.finish_expanded();
        }
        let Some((id, mode)) = self.motion.present.clone() else { return Ok(()) };
        self.see_controls(&mode);
        self.motion.path.state(&self.motion.point, &mut self.state.x);
        self.motion.path.inputs(&self.motion.segment, &self.motion.point, &mut self.state.v);
        self.trace_passage(&mode);
        self.balance_segment(id, &mode);
        self.write_pieces();
        self.note_left();
        mode.leave(&self.state.x, &self.state.v, &mut self.state.a);
        self.scale.see_state(&self.state.a);
        self.sample_end();
        self.span.time = self.span.end;
        let crossing = std::mem::take(&mut self.span.crossing);
        let result = self.leave(&mode, crossing);
        if result.is_ok() {
            self.note_right();
        }
        result
    }

    /// Goes on from the end of a segment: to the mode that follows, or in implicit steps.
    fn leave(&mut self, mode: &Mode, crossing: Vec<usize>) -> Result<(), Failure> {
        if self.too_fast() {
            return self.carry_on();
        }
        match self.span.ending {
            Ending::Horizon => {
                self.stats.breakpoints += u64::from(self.span.end >= self.span.breakpoint)
            }
            Ending::Crossing => {
                for &j in &crossing {
                    if let Watch::Switch(s) = mode.guards.watch[j] {
                        self.note_turn(mode, s, false);
                        self.throw(s);
                        self.control.sampling.note(s);
                    }
                }
                if self.is_crowded() && !self.control.sampling.begin(self.span.time) {
                    self.span.crossing = crossing;
                    return self.carry_on();
                }
            }
        }
        let result = self.begin(&crossing);
        let keep = std::mem::take(&mut self.span.crossing);
        self.span.crossing = if keep.is_empty() && matches!(self.span.phase, Phase::Stepping(_)) {
            crossing
        } else {
            keep
        };
        result
    }

    /// Computes rows into `out` until it is full, the plan ends, a step fails, the work has doubled or `budget` is spent.
    pub fn advance(&mut self, out: &mut [f64], budget: Duration) -> (usize, Progress) {
        let columns = self.columns();
        let capacity = out.len() / columns;
        let begin = Instant::now();
        let (mut rows, mut count) = (0, 0u64);
        while rows < capacity {
            let row = &mut out[rows * columns..(rows + 1) * columns];
            if self.table.ends.rows.next(row) {
                self.table.expected.rows.take(row);
                rows += 1;
                continue;
            }
            let Some(target) = self.plan.rows.peek() else {
                self.end_pieces();
                return (rows, Progress::Done);
            };
            let result = match self.span.phase {
                Phase::Moving => {
                    let written = self.write_rows(&mut out[rows * columns..]);
                    rows += written;
                    if written > 0 {
                        continue;
                    }
                    if self.prepared.inputs.known() <= self.span.end {
                        return (rows, Progress::Waiting);
                    }
                    self.finish()
                }
                Phase::Stepping(_) if self.prepared.inputs.known() <= self.span.time => {
                    return (rows, Progress::Waiting);
                }
                Phase::Stepping(h) => match self.implicit_step(h, target, row) {
                    Ok(Stepped::Row) => {
                        self.table.expected.rows.take(row);
                        self.plan.rows.advance();
                        rows += 1;
                        Ok(())
                    }
                    Ok(Stepped::Point) => {
                        self.table.expected.rows.take(row);
                        rows += 1;
                        Ok(())
                    }
                    Ok(Stepped::Silent) => Ok(()),
                    Err(failure) => Err(failure),
                },
                Phase::Fresh => return (rows, Progress::Done),
            };
            if let Err(failure) = result {
                self.log.failure = Some(failure);
                return (rows, Progress::Failed);
            }
            count += 1;
            let pause = self.doubles() || self.brimful();
            if pause || count.is_multiple_of(LOOK) && begin.elapsed() > budget {
                break;
            }
        }
        if self.plan.rows.peek().is_none() {
            self.end_pieces();
        }
        (rows, Progress::More)
    }

    /// Present time [s].
    pub fn time(&self) -> f64 {
        self.span.time
    }

    /// Why the last mode could not be reduced.
    pub fn trouble(&self) -> Option<&str> {
        self.picker.trouble.as_deref()
    }

    /// Modes reduced so far.
    pub fn modes(&self) -> u64 {
        self.checked.iter().filter(|c| **c).count() as u64
    }

    /// Complementarity problems solved.
    pub fn problems(&self) -> u64 {
        self.implicit.solved + self.implicit.unsolved
    }

    /// Intervals on which guards were judged.
    pub fn intervals(&self) -> u64 {
        self.event_search.intervals
    }
}

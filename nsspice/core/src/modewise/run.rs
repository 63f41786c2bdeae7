//! The run: segment after segment, rows evaluated where they stand.

use super::crowd::Storm;
use super::fixed::Stepped;
use super::handed::Handed;
use super::implicit::Implicit;
use super::inputs::{Inputs, Segment};
use super::march::{Ending, March};
use super::mode::{Mode, Watch};
use super::network::{Assembly, Network};
use super::outputs::{Outputs, Spec};
use super::pick::{cause_of, roles, settle, Picker, Scene};
use super::prepared::Prepared;
use super::registry::{Id, Registry};
use super::rows::Inside;
use super::sides::Ends;
use super::tally::Tally;
use super::terms::Point;
use super::trace::Trace;
use super::trajectory::Trajectory;
use super::verify::Scale;
use super::witness::Witness;
use crate::instant::Reinitialiser;
use crate::moreau::{by_sources, Failure, Jump, Progress};
use crate::pieces::Pieces;
use crate::resting::Resting;
use crate::row_clock::RowClock;
use crate::sampling::Sampling;
use crate::switch::Switch;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Segments between two looks at the clock.
const LOOK: u64 = 32;
/// Switch reactions at one instant before it is called chatter.
const MAX_REACTIONS: usize = 64;
/// Segments between two residual checks of known modes.
const CHECK: u64 = 64;

/// Counters of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Statistics {
    /// segments
    pub segments: u64,
    /// changes of pairs
    pub events: u64,
    /// corners of the sources
    pub corners: u64,
    /// changes of the mode
    pub mode_changes: u64,
    /// segments that leave some voltage or current undetermined
    pub undetermined: u64,
    /// switch operations
    pub switchings: u64,
    /// jumps of charges or fluxes
    pub jumps: u64,
    /// instants at which a switch did not come to rest
    pub chatter: u64,
    /// implicit steps where no mode could be proved
    pub fixed_steps: u64,
    /// energy that those have taken which are no jumps [J]
    pub taken: f64,
    /// worst residual of rows over all checks
    pub residual_rows: f64,
    /// worst complementarity residual over all checks
    pub residual_complementarity: f64,
    /// residual checks made
    pub checks: u64,
}

/// What the engine is doing.
pub(super) enum Phase {
    /// nothing yet
    Fresh,
    /// inside a segment that is known up to its end
    Moving,
    /// implicit steps of this length
    Stepping(f64),
}

/// One system in the course of its simulation.
pub struct Engine {
    pub(super) sys: Arc<Assembly>,
    /// jumps by the structure of the network, where it is known
    reinitialiser: Option<Arc<Reinitialiser>>,
    pub(super) net: Arc<Network>,
    pub(super) inputs: Inputs,
    /// switches
    pub switches: Arc<[Switch]>,
    pub(super) gates: Vec<bool>,
    pub(super) outputs: Outputs,
    pub(super) registry: Registry,
    pub(super) implicit: Implicit,
    pub(super) picker: Picker,
    pub(super) march: March,
    pub(super) path: Trajectory,
    pub(super) segment: Segment,
    pub(super) scale: Scale,
    pub(super) rows: RowClock,
    pub(super) stop: f64,
    /// longest implicit step where the exact engine is at a loss
    pub(super) fixed_step: f64,
    pub(super) phase: Phase,
    /// start of the segment [s]
    pub(super) time: f64,
    /// its end [s]
    pub(super) end: f64,
    pub(super) ending: Ending,
    pub(super) corner: f64,
    pub(super) present: Option<(Id, Arc<Mode>)>,
    pub(super) a: Vec<f64>,
    pub(super) x: Vec<f64>,
    pub(super) spare: Vec<f64>,
    /// the end of the segment
    pub(super) point: Point,
    pub(super) inside: Inside,
    pub(super) crossing: Vec<usize>,
    pub(super) z: Vec<f64>,
    pub(super) l: Vec<f64>,
    pub(super) v: Vec<f64>,
    /// times of events that may pile up
    pub(super) crowd: Vec<f64>,
    /// switches that chatter
    pub(super) sampling: Sampling,
    /// controls that rest at thresholds
    pub resting: Resting,
    /// parts in which events follow one another too fast to be followed
    pub(super) storm: Storm,
    /// when the exact engine took over again, and the implicit step before
    pub(super) resumed: (f64, f64),
    /// implicit steps before it is tried again, and how many of them were waited for last time
    pub(super) pause: (u32, u32),
    checked: Vec<bool>,
    pub(super) ends: Ends,
    pub(super) witness: Witness,
    pub(super) tally: Tally,
    pub(super) trace: Trace,
    /// outputs that measures follow
    pub pieces: Pieces,
    /// outputs that drive other blocks
    pub(super) handed: Handed,
    pub(super) logged: Vec<bool>,
    pub(super) log_open: bool,
    /// counters
    pub stats: Statistics,
    /// the last failure
    pub failure: Option<Failure>,
    /// recorded jumps
    pub jumps: Vec<Jump>,
    /// changes of pairs: time, pair, whether it conducts from then on
    pub events: Vec<(f64, usize, bool)>,
}

impl Engine {
    /// Prepares a run of a system.
    pub fn new(prepared: &Prepared, outputs: Vec<Spec>) -> Engine {
        let (sys, net, switches) =
            (prepared.sys.clone(), prepared.net.clone(), prepared.switches.clone());
        let inputs = prepared.inputs.clone();
        let (n, m, r) = (net.n, net.m, net.states);
        let outputs = Outputs::new(outputs, &net, &inputs);
        let count = 1 + inputs.len();
        let scale = Scale { v: vec![0.0; count], rate: vec![0.0; count], ..Scale::default() };
        Engine {
            implicit: Implicit::new(n, m, prepared.models.clone()),
            gates: vec![false; switches.len()],
            outputs,
            registry: Registry::new(prepared.modes.clone()),
            picker: Picker::default(),
            march: March::default(),
            path: Trajectory::default(),
            segment: Segment::default(),
            scale,
            rows: RowClock::new(0.0, 1.0, 0.0),
            stop: 0.0,
            fixed_step: 1.0,
            phase: Phase::Fresh,
            time: 0.0,
            end: 0.0,
            ending: Ending::Horizon,
            corner: f64::NEG_INFINITY,
            present: None,
            a: vec![0.0; r],
            x: Vec::new(),
            spare: Vec::new(),
            point: Point::default(),
            inside: Inside::default(),
            crossing: Vec::new(),
            z: vec![0.0; n],
            l: vec![0.0; m],
            v: vec![0.0; count],
            crowd: Vec::new(),
            sampling: Sampling::new(switches.len(), 1.0),
            resting: Resting::new(switches.len()),
            storm: Storm::default(),
            resumed: (f64::NEG_INFINITY, 0.0),
            pause: (0, 0),
            checked: Vec::new(),
            ends: Ends::default(),
            witness: Witness::default(),
            tally: Tally::default(),
            trace: Trace::default(),
            pieces: Pieces::default(),
            handed: Handed::default(),
            logged: vec![false; m],
            log_open: false,
            stats: Statistics::default(),
            failure: None,
            jumps: Vec::new(),
            events: Vec::new(),
            sys,
            reinitialiser: prepared.reinitialiser.clone(),
            net,
            inputs,
            switches,
        }
    }

    /// Number of output columns, the time included.
    pub fn columns(&self) -> usize {
        self.outputs.len() + 1
    }

    /// Plans rows from `out_start` to `stop`; returns their number. `fixed_step` bounds implicit steps.
    pub fn plan(&mut self, stop: f64, out_start: f64, out_step: f64, fixed_step: f64) -> u64 {
        self.stop = stop;
        self.fixed_step = fixed_step;
        self.sampling = self.new_sampling();
        self.picker.verifier.seen.resize(self.switches.len(), 0.0);
        self.witness.controls.resize(self.switches.len(), 0.0);
        self.rows = RowClock::new(out_start, out_step, stop);
        self.rows.count()
    }

    /// Starts at time 0 from charges and fluxes `E z`, with the gates in given states, and from a mode by
    /// the pairs that conduct, if it is known: where nothing is stored there may be several.
    pub fn start(
        &mut self,
        charges: &[f64],
        gates: &[bool],
        active: Option<Vec<bool>>,
    ) -> Result<(), Failure> {
        self.gates.copy_from_slice(gates);
        self.net.energy(charges, &mut self.a);
        self.scale.see_state(&self.a);
        self.witness_end();
        self.tally_start();
        self.time = 0.0;
        self.guess_scale();
        self.present = None;
        self.enter_known(active);
        self.begin(&[])?;
        let id = self.present_id();
        self.logged.copy_from_slice(self.registry.on(id));
        self.log_open = true;
        Ok(())
    }

    /// The states of the gates at the start from those `before`, if the sources alone decide about them.
    pub fn gates_by_sources(&self, before: &[bool]) -> Option<Vec<bool>> {
        by_sources(&self.sys.linear, &self.switches, before, &self.sources(0.0))
    }

    pub(super) fn present_id(&self) -> Id {
        self.present.as_ref().map_or(0, |p| p.0)
    }

    /// A first idea of how large the state becomes: a start from rest has no scale of its own.
    fn guess_scale(&mut self) {
        self.inputs.begin(0.0, &mut self.segment);
        let h = self.fixed_step.min(self.stop);
        self.scale.see_inputs(&self.segment, h);
        let roles = roles(self.net.m, &self.switches, &self.gates);
        super::implicit::later(&self.segment, 0.0, &mut self.v);
        let step = self.implicit.step(&self.sys, &self.net, &self.a, &self.v, &roles, h);
        if step.is_ok_and(|s| !s.suspect) {
            let a = self.coordinates(&self.implicit.z);
            self.scale.see_state(&a);
        }
    }

    /// Energy coordinates of what the unknowns `z` store.
    pub(super) fn coordinates(&self, z: &[f64]) -> Vec<f64> {
        let mut charges = vec![0.0; self.net.n];
        self.sys.linear.e.mul_add(1.0, z, &mut charges);
        let mut a = vec![0.0; self.net.states];
        self.net.energy(&charges, &mut a);
        a
    }

    /// Takes the inputs of a segment from here on; returns how long it may last: to a corner, the end of the run,
    /// or the next look at sampled switches [s].
    pub(super) fn begin_inputs(&mut self) -> f64 {
        self.inputs.begin(self.time, &mut self.segment);
        if self.corner <= self.time {
            self.corner = self.inputs.next_corner(self.time);
        }
        let last = if self.time >= self.stop { f64::INFINITY } else { self.stop };
        let mut horizon = self.corner.min(last) - self.time;
        if !horizon.is_finite() {
            horizon = 1e-3 * self.stop;
        }
        self.scale.see_inputs(&self.segment, horizon.min(self.stop));
        horizon.min(self.look() - self.time)
    }

    /// Finds the mode from the present time on and walks to the end of the segment. `crossing`:
    /// guards of the mode so far that have come to their end.
    pub(super) fn begin(&mut self, crossing: &[usize]) -> Result<(), Failure> {
        let horizon = self.begin_inputs();
        self.throw_by_inputs();
        let mut crossing: &[usize] = crossing;
        let mut struck = false;
        for _ in 0..MAX_REACTIONS {
            let from = self.present.as_ref().map(|p| p.0);
            let cause = cause_of(crossing, &self.gates);
            let scene = Scene {
                sys: &self.sys,
                reinitialiser: self.reinitialiser.as_deref(),
                inputs: &self.inputs,
                net: &self.net,
                switches: &self.switches,
                segment: &self.segment,
                horizon,
            };
            let picked = self.picker.pick(
                &scene,
                &mut self.registry,
                &mut self.implicit,
                from,
                cause,
                crossing,
                &self.gates,
                &mut self.a,
                &mut self.scale,
                &mut self.path,
            );
            let Some(picked) = picked else {
                if !struck && !crossing.is_empty() && self.impact(horizon) {
                    (struck, crossing) = (true, &[]);
                    self.trace.struck = true;
                    continue;
                }
                return self.carry_on();
            };
            if picked.mode.impulses.is_some() || !self.picker.leaps.is_empty() {
                let origin = match self.picker.leaps.first() {
                    Some(leap) => leap.before.clone(),
                    None => self.a.clone(),
                };
                let entry = self.a.clone();
                settle(&picked.mode, &self.segment.now, &mut self.a);
                self.note_jump(&picked.mode, picked.id, &origin, &entry);
            }
            if from != Some(picked.id) {
                self.stats.mode_changes += 1;
            }
            let settled = self.picker.verifier.thrown.is_empty() && !self.rest();
            self.trace_leaps(&picked.mode, !settled);
            self.present = Some((picked.id, picked.mode));
            if settled {
                return self.walk(horizon);
            }
            for k in 0..self.picker.verifier.thrown.len() {
                let s = self.picker.verifier.thrown[k];
                self.throw(s);
                if self.sampling.on[s] {
                    self.sampling.turn(s, -self.picker.verifier.seen[s]);
                }
            }
            crossing = &[];
        }
        self.stats.chatter += 1;
        self.phase = Phase::Fresh; // the modes that were tried lead nowhere
        let last = self.picker.verifier.thrown.last();
        Err(Failure::restless(self.time, last.map(|&s| self.switches[s].pair)))
    }

    /// Switches whose control is a source react before anything else is looked at.
    fn throw_by_inputs(&mut self) {
        let Some((id, mode)) = self.present.clone() else { return };
        let gates = self.registry.gates(id).to_vec();
        for &(j, s) in &mode.direct {
            // one that has just crossed its threshold has reacted; this guard is of its old state
            if self.gates[s] != gates[s] {
                continue;
            }
            let g = crate::dense::dot(mode.guards.v.row(j), &self.segment.now)
                + crate::dense::dot(mode.guards.d.row(j), &self.segment.rate);
            let size: f64 = mode
                .guards
                .v
                .row(j)
                .iter()
                .zip(&self.segment.now)
                .map(|(c, v)| (c * v).abs())
                .sum();
            if g < -1e-13 * size {
                self.throw(s);
            }
        }
    }

    /// The same after implicit steps.
    pub(super) fn walk_from_here(&mut self, horizon: f64) {
        self.crowd.clear();
        self.walk(horizon).ok();
    }

    /// Marches through the segment that has been begun.
    fn walk(&mut self, horizon: f64) -> Result<(), Failure> {
        let Some((id, mode)) = self.present.clone() else { return Ok(()) };
        self.witness_begin(&mode);
        let verifier = &self.picker.verifier;
        let (length, ending) = self.march.walk(
            &self.path,
            &verifier.start,
            &verifier.guards,
            &verifier.noise,
            &verifier.clear,
            horizon,
            self.time,
        );
        self.ending = ending;
        self.end = match ending {
            // the corner's own time, not a sum
            Ending::Horizon if self.corner - self.time <= horizon => self.corner,
            Ending::Horizon => self.time + length,
            Ending::Crossing => self.time + length,
        };
        self.crossing.clear();
        self.crossing.extend_from_slice(&self.march.crossing);
        self.stats.segments += 1;
        self.stats.undetermined += u64::from(mode.open > 0);
        self.inside.ready = false;
        self.phase = Phase::Moving;
        self.x.resize(mode.n, 0.0);
        if ending == Ending::Crossing || self.stats.segments < 32 {
            // both ends may be zero: how large the state is shows in between
            for part in [0.25, 0.6] {
                self.path.at(part * length, &mut self.point);
                self.see(&mode);
            }
        }
        match self.march.reached(length) {
            Some(reached) => std::mem::swap(reached, &mut self.point),
            None => self.path.at(length, &mut self.point),
        }
        self.log(id);
        if id >= self.checked.len() {
            self.checked.resize(id + 1, false);
        }
        let fresh = !self.checked[id];
        // what begins at the end of the run serves its last row: laws count, energies hardly
        let part = if self.time < self.stop { 1.0 } else { 0.0 };
        self.witness_segment(&mode, part * length, fresh);
        if fresh || self.stats.segments.is_multiple_of(CHECK) {
            self.checked[id] = true;
            self.path.at(0.618 * length, &mut self.point);
            self.check(&mode);
            self.path.at(length, &mut self.point);
        }
        self.hand_segment();
        Ok(())
    }

    /// Leaves the segment: state at its end, and on.
    pub(super) fn finish(&mut self) -> Result<(), Failure> {
        let Some((id, mode)) = self.present.clone() else { return Ok(()) };
        self.see_controls(&mode);
        self.path.state(&self.point, &mut self.x);
        self.path.inputs(&self.segment, &self.point, &mut self.v);
        self.trace_passage(&mode);
        self.tally_segment(id, &mode);
        self.write_pieces();
        self.note_left();
        mode.leave(&self.x, &self.v, &mut self.a);
        self.scale.see_state(&self.a);
        self.witness_end();
        self.time = self.end;
        let crossing = std::mem::take(&mut self.crossing);
        if self.too_fast() {
            return self.carry_on();
        }
        match self.ending {
            Ending::Horizon => self.stats.corners += u64::from(self.end >= self.corner),
            Ending::Crossing => {
                for &j in &crossing {
                    if let Watch::Switch(s) = mode.watch[j] {
                        self.throw(s);
                        self.sampling.note(s);
                    }
                }
                if self.is_crowded() && !self.sampling.begin(self.time) {
                    self.crossing = crossing;
                    return self.carry_on();
                }
            }
        }
        let result = self.begin(&crossing);
        let keep = std::mem::take(&mut self.crossing);
        self.crossing = if keep.is_empty() && matches!(self.phase, Phase::Stepping(_)) {
            crossing
        } else {
            keep
        };
        if result.is_ok() {
            self.note_right();
        }
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
            if self.ends.rows.next(row) {
                rows += 1;
                continue;
            }
            let Some(target) = self.rows.peek() else {
                self.end_pieces();
                return (rows, Progress::Done);
            };
            let result = match self.phase {
                Phase::Moving => {
                    let written = self.write_rows(&mut out[rows * columns..]);
                    rows += written;
                    if written > 0 {
                        continue;
                    }
                    self.finish()
                }
                Phase::Stepping(h) => match self.implicit_step(h, target, row) {
                    Ok(Stepped::Row) => {
                        self.rows.advance();
                        rows += 1;
                        Ok(())
                    }
                    Ok(Stepped::Point) => {
                        rows += 1;
                        Ok(())
                    }
                    Ok(Stepped::Silent) => Ok(()),
                    Err(failure) => Err(failure),
                },
                Phase::Fresh => return (rows, Progress::Done),
            };
            if let Err(failure) = result {
                self.failure = Some(failure);
                return (rows, Progress::Failed);
            }
            count += 1;
            let pause = self.doubles() || self.brimful();
            if pause || count.is_multiple_of(LOOK) && begin.elapsed() > budget {
                break;
            }
        }
        if self.rows.peek().is_none() {
            self.end_pieces();
        }
        (rows, Progress::More)
    }

    /// Present time [s].
    pub fn time(&self) -> f64 {
        self.time
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
        self.march.intervals
    }
}

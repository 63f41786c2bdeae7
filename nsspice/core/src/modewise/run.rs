//! The run: segment after segment, rows evaluated where they stand.

use super::implicit::Implicit;
use super::inputs::{Inputs, Segment};
use super::march::{Ending, March};
use super::mode::{Mode, SwitchLaw, Watch};
use super::network::{Assembly, Network};
use super::outputs::{Outputs, RowClock, Spec};
use super::pick::{cause_of, roles, settle, Picker, Scene};
use super::registry::{Id, Registry};
use super::terms::Point;
use super::trajectory::{Bundle, Trajectory};
use super::verify::Scale;
use crate::moreau::{Failure, Jump, Progress};
use crate::waveform::Side;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Events and jumps kept in full; later ones are only counted.
const MAX_EVENTS: usize = 1 << 16;
const MAX_JUMPS: usize = 4096;
/// Segments between two looks at the clock.
const LOOK: u64 = 32;
/// Switch reactions at one instant before it is called chatter.
const MAX_REACTIONS: usize = 64;
/// So many events within so small a part of the run are an accumulation.
const CROWD: usize = 40;
const CROWDED: f64 = 1e-12;
/// Segments between two residual checks of known modes.
const CHECK: u64 = 64;
/// Changes below this part of the largest stored energy norm are no jump.
const NO_JUMP: f64 = 1e-10;
/// Two instants closer than this, relatively, are one.
const SAME: f64 = 64.0 * f64::EPSILON;

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
    pub(super) sys: Assembly,
    pub(super) net: Network,
    pub(super) inputs: Inputs,
    pub(super) switches: Vec<SwitchLaw>,
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
    x: Vec<f64>,
    pub(super) point: Point,
    values: Bundle,
    rates: Bundle,
    bundled: bool,
    rated: bool,
    crossing: Vec<usize>,
    pub(super) z: Vec<f64>,
    pub(super) l: Vec<f64>,
    v: Vec<f64>,
    crowd: Vec<f64>,
    checked: Vec<bool>,
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
    /// Reduces a system; the error says why it cannot be treated mode by mode.
    pub fn new(
        sys: Assembly,
        inputs: Inputs,
        switches: Vec<SwitchLaw>,
        outputs: Vec<Spec>,
    ) -> Result<Engine, String> {
        let net = Network::new(&sys, &inputs)?;
        let (n, m, r) = (net.n, net.m, net.states);
        let outputs = Outputs::new(outputs, &net, &inputs);
        let count = 1 + inputs.len();
        let scale = Scale {
            v: vec![0.0; count],
            rate: vec![0.0; count],
            ..Scale::default()
        };
        Ok(Engine {
            implicit: Implicit::new(n, m),
            gates: vec![false; switches.len()],
            outputs,
            registry: Registry::default(),
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
            point: Point::default(),
            values: Bundle::default(),
            rates: Bundle::default(),
            bundled: false,
            rated: false,
            crossing: Vec::new(),
            z: vec![0.0; n],
            l: vec![0.0; m],
            v: vec![0.0; count],
            crowd: Vec::new(),
            checked: Vec::new(),
            logged: vec![false; m],
            log_open: false,
            stats: Statistics::default(),
            failure: None,
            jumps: Vec::new(),
            events: Vec::new(),
            sys,
            net,
            inputs,
            switches,
        })
    }

    /// Whether lists of charges and switch states have the right lengths.
    pub fn fits(&self, charges: usize, gates: usize) -> bool {
        charges == self.net.n && gates == self.switches.len()
    }

    /// Modes reduced, tried ones included.
    pub fn reduced(&self) -> u64 {
        self.registry.built
    }

    /// Number of output columns, the time included.
    pub fn columns(&self) -> usize {
        self.outputs.len() + 1
    }

    /// Plans rows from `out_start` to `stop`; returns their number. `fixed_step` bounds implicit steps.
    pub fn plan(&mut self, stop: f64, out_start: f64, out_step: f64, fixed_step: f64) -> u64 {
        self.stop = stop;
        self.fixed_step = fixed_step;
        self.rows = RowClock::new(out_start, out_step, stop);
        self.rows.rows()
    }

    /// Starts at time 0 from charges and fluxes `E z`, with the switches' controls in given states.
    pub fn start(&mut self, charges: &[f64], gates: &[bool]) -> Result<(), Failure> {
        self.gates.copy_from_slice(gates);
        self.net.energy(charges, &mut self.a);
        self.scale.see_state(&self.a);
        self.time = 0.0;
        self.guess_scale();
        self.present = None;
        self.begin(&[])?;
        let id = self.present_id();
        self.logged.copy_from_slice(self.registry.on(id));
        self.log_open = true;
        Ok(())
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
        let step = self.implicit.step(
            &self.sys,
            &self.net,
            &self.a,
            &self.v,
            &roles,
            h,
            crate::mlcp::Start::Cold,
        );
        if step.is_ok_and(|s| !s.suspect) {
            let mut charges = vec![0.0; self.net.n];
            self.sys.e.mul_add(1.0, &self.implicit.z, &mut charges);
            let mut a = vec![0.0; self.a.len()];
            self.net.energy(&charges, &mut a);
            self.scale.see_state(&a);
        }
    }

    /// Finds the mode from the present time on and walks to the end of the segment. `crossing`:
    /// guards of the mode so far that have come to their end.
    pub(super) fn begin(&mut self, crossing: &[usize]) -> Result<(), Failure> {
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
        self.throw_by_inputs();
        let mut crossing: &[usize] = crossing;
        for _ in 0..MAX_REACTIONS {
            let from = self.present.as_ref().map(|p| p.0);
            let cause = cause_of(crossing, &self.gates);
            let scene = Scene {
                sys: &self.sys,
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
            self.present = Some((picked.id, picked.mode));
            if self.picker.verifier.thrown.is_empty() {
                return self.walk(horizon);
            }
            for k in 0..self.picker.verifier.thrown.len() {
                let s = self.picker.verifier.thrown[k];
                self.gates[s] = !self.gates[s];
                self.stats.switchings += 1;
            }
            crossing = &[];
        }
        self.stats.chatter += 1;
        self.carry_on()
    }

    /// Switches whose control is a source react before anything else is looked at.
    fn throw_by_inputs(&mut self) {
        let Some((_, mode)) = &self.present else { return };
        for &(j, s) in &mode.direct {
            let g = crate::dense::dot(mode.guards.v.row(j), &self.segment.now)
                + crate::dense::dot(mode.guards.d.row(j), &self.segment.rate);
            let size: f64 =
                mode.guards.v.row(j).iter().zip(&self.segment.now).map(|(c, v)| (c * v).abs()).sum();
            if g < -1e-13 * size {
                self.gates[s] = !self.gates[s];
                self.stats.switchings += 1;
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
        let verifier = &self.picker.verifier;
        let (length, ending) = self.march.walk(
            &self.path,
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
        self.bundled = false;
        self.phase = Phase::Moving;
        self.path.at(length, &mut self.point);
        self.x.resize(mode.n, 0.0);
        self.log(id);
        if id >= self.checked.len() {
            self.checked.resize(id + 1, false);
        }
        if !self.checked[id] || self.stats.segments.is_multiple_of(CHECK) {
            self.checked[id] = true;
            self.check(&mode);
        }
        Ok(())
    }

    /// Leaves the segment: state at its end, and on.
    fn finish(&mut self) -> Result<(), Failure> {
        let Some((_, mode)) = self.present.clone() else { return Ok(()) };
        self.path.state(&self.point, &mut self.x);
        self.path.inputs(&self.segment, &self.point, &mut self.v);
        mode.leave_x.apply(&self.x, &mut self.a);
        mode.leave_v.apply_add(&self.v, &mut self.a);
        self.scale.see_state(&self.a);
        self.time = self.end;
        let crossing = std::mem::take(&mut self.crossing);
        match self.ending {
            Ending::Horizon => self.stats.corners += 1,
            Ending::Crossing => {
                for &j in &crossing {
                    if let Watch::Switch(s) = mode.watch[j] {
                        self.gates[s] = !self.gates[s];
                        self.stats.switchings += 1;
                    }
                }
                self.crowd.push(self.time);
                if self.crowd.len() > CROWD {
                    let first = self.crowd[self.crowd.len() - CROWD];
                    if self.time - first < CROWDED * self.stop {
                        self.crowd.clear();
                        self.crossing = crossing;
                        return self.carry_on();
                    }
                    if self.crowd.len() > 4 * CROWD {
                        self.crowd.drain(..2 * CROWD);
                    }
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
        result
    }

    /// Computes rows into `out` until it is full, the plan ends, a step fails or `budget` is spent.
    pub fn advance(&mut self, out: &mut [f64], budget: Duration) -> (usize, Progress) {
        let columns = self.columns();
        let capacity = out.len() / columns;
        let begin = Instant::now();
        let (mut rows, mut count) = (0, 0u64);
        while rows < capacity {
            let Some(target) = self.rows.peek() else {
                return (rows, Progress::Done);
            };
            let row = &mut out[rows * columns..(rows + 1) * columns];
            let result = match self.phase {
                Phase::Moving => {
                    let last = self.end >= self.stop && self.end < self.corner;
                    if target < self.end - SAME * self.end || (last && target <= self.end) {
                        self.write(target, row);
                        self.rows.advance();
                        rows += 1;
                        continue;
                    }
                    self.finish()
                }
                Phase::Stepping(h) => match self.implicit_step(h, target, row) {
                    Ok(true) => {
                        self.rows.advance();
                        rows += 1;
                        Ok(())
                    }
                    Ok(false) => Ok(()),
                    Err(failure) => Err(failure),
                },
                Phase::Fresh => return (rows, Progress::Done),
            };
            if let Err(failure) = result {
                self.failure = Some(failure);
                return (rows, Progress::Failed);
            }
            count += 1;
            if count.is_multiple_of(LOOK) && begin.elapsed() > budget {
                break;
            }
        }
        (rows, Progress::More)
    }

    /// Evaluates the outputs inside the segment.
    fn write(&mut self, time: f64, row: &mut [f64]) {
        let Some((id, mode)) = &self.present else { return };
        if !self.bundled {
            self.bundled = true;
            let outputs = &self.outputs;
            let rows = self.registry.outputs(*id, || outputs.rows(mode));
            self.path.bundle(&rows.value, &self.segment, false, &mut self.values);
            self.rated = rows.rate.is_some();
            if let Some(rate) = &rows.rate {
                self.path.bundle(rate, &self.segment, false, &mut self.rates);
            }
        }
        self.path.at((time - self.time).max(0.0), &mut self.point);
        row[0] = time;
        for (j, value) in row[1..].iter_mut().enumerate() {
            *value = self.values.value(j, &self.point);
            if self.rated {
                *value += self.rates.slope(j, &self.point);
            }
        }
        // the end of the segment is needed again
        let length = self.length();
        self.path.at(length, &mut self.point);
    }

    fn length(&self) -> f64 {
        self.end - self.time
    }

    /// Notes which pairs have changed since the last time.
    pub(super) fn log(&mut self, id: Id) {
        if !self.log_open {
            return;
        }
        for (i, (old, &new)) in self.logged.iter_mut().zip(self.registry.on(id)).enumerate() {
            if *old != new {
                *old = new;
                self.stats.events += 1;
                if self.events.len() < MAX_EVENTS {
                    self.events.push((self.time, i, new));
                }
            }
        }
    }

    /// Unknowns and multipliers from a mode's state at the start or end of a segment.
    fn unknowns(&self, mode: &Mode, x: &[f64], v: &[f64], d: &[f64], z: &mut [f64], l: &mut [f64]) {
        let k = self.net.kernel.cols;
        let mut a = vec![0.0; self.net.states];
        mode.leave_x.apply(x, &mut a);
        mode.leave_v.apply_add(v, &mut a);
        let mut b = vec![0.0; k + mode.active.len()];
        mode.algebraic.x.apply(x, &mut b);
        mode.algebraic.v.apply_add(v, &mut b);
        mode.algebraic.d.apply_add(d, &mut b);
        self.net.big_r.apply(&a, z);
        self.net.kernel.apply_add(&b[..k], z);
        l.fill(0.0);
        for (&i, &value) in mode.active.iter().zip(&b[k..]) {
            l[i] = value;
        }
    }

    /// Residual of all equations at the end of the segment.
    fn check(&mut self, mode: &Mode) {
        let (n, m) = (self.net.n, self.net.m);
        let mut x = vec![0.0; mode.n];
        self.path.state(&self.point, &mut x);
        let mut v = vec![0.0; self.v.len()];
        self.path.inputs(&self.segment, &self.point, &mut v);
        let mut d = self.segment.slope.clone();
        for tone in &self.segment.tones {
            let now = crate::dense::complex(v[tone.index + 1], v[tone.index]);
            let change = tone.rate * now;
            d[tone.index] = change.im;
            d[tone.index + 1] = change.re;
        }
        for decay in &self.segment.decays {
            d[decay.index] = decay.rate * v[decay.index];
        }
        let (mut z, mut l) = (vec![0.0; n], vec![0.0; m]);
        self.unknowns(mode, &x, &v, &d, &mut z, &mut l);
        // E z' = E R a'
        let mut rate = vec![0.0; mode.n];
        self.path.state_rate(&self.point, &mut rate);
        let mut da = vec![0.0; self.net.states];
        mode.leave_x.apply(&rate, &mut da);
        mode.leave_v.apply_add(&d, &mut da);
        let mut rhs = vec![0.0; n];
        self.net.charges.apply(&da, &mut rhs);
        rhs.iter_mut().for_each(|q| *q = -*q);
        self.net.s.apply_add(&v, &mut rhs);
        let roles = roles(m, &self.switches, &self.gates);
        let found = self.implicit.residual(&self.sys, &rhs, &roles, &z, &l);
        self.stats.checks += 1;
        self.stats.residual_rows = self.stats.residual_rows.max(found.rows);
        self.stats.residual_complementarity =
            self.stats.residual_complementarity.max(found.complementarity);
    }

    /// Unknowns and multipliers at the present end of the segment.
    pub fn state(&mut self) -> (Vec<f64>, Vec<f64>) {
        if let (Phase::Moving, Some((_, mode))) = (&self.phase, self.present.clone()) {
            let mut x = vec![0.0; mode.n];
            self.path.state(&self.point, &mut x);
            let mut v = vec![0.0; self.v.len()];
            self.path.inputs(&self.segment, &self.point, &mut v);
            let (mut z, mut l) = (vec![0.0; self.net.n], vec![0.0; self.net.m]);
            self.unknowns(&mode, &x, &v, &self.segment.rate, &mut z, &mut l);
            return (z, l);
        }
        (self.z.clone(), self.l.clone())
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

    /// Records a jump that ends in a mode, `origin` being the first and `entry` the last of the
    /// energy coordinates before it.
    fn note_jump(&mut self, mode: &Arc<Mode>, id: Id, origin: &[f64], entry: &[f64]) {
        let change = self.a.iter().zip(origin).fold(0.0f64, |m, (x, y)| m.hypot(x - y));
        if change <= NO_JUMP * self.scale.a {
            return;
        }
        self.stats.jumps += 1;
        if self.jumps.len() >= MAX_JUMPS {
            return;
        }
        let (n, m, k) = (self.net.n, self.net.m, self.net.kernel.cols);
        let mut before = vec![0.0; n];
        let mut scrap = vec![0.0; m];
        if let Some((_, old)) = self.present.clone() {
            let mut x = vec![0.0; old.n];
            old.enter.apply(origin, &mut x);
            self.unknowns(&old, &x, &self.v, &self.segment.rate, &mut before, &mut scrap);
        }
        let mut x = vec![0.0; mode.n];
        mode.enter.apply(entry, &mut x);
        let mut after = vec![0.0; n];
        self.unknowns(mode, &x, &self.segment.now, &self.segment.rate, &mut after, &mut scrap);
        let (mut unknowns, mut multipliers) = (vec![0.0; n], vec![0.0; m]);
        let mut steps: Vec<(Id, Vec<f64>)> =
            self.picker.leaps.iter().map(|l| (l.through, l.before.clone())).collect();
        steps.push((id, entry.to_vec()));
        for (through, mut joint) in steps {
            let Ok(mode) = self.registry.mode(through, &self.net, &self.switches) else { continue };
            let Some(impulses) = &mode.impulses else { continue };
            joint.extend_from_slice(&self.segment.now);
            let mut b = vec![0.0; k + mode.active.len()];
            impulses.algebraic.apply(&joint, &mut b);
            self.net.kernel.apply_add(&b[..k], &mut unknowns);
            for (&i, &value) in mode.active.iter().zip(&b[k..]) {
                multipliers[i] += value;
            }
        }
        self.jumps.push(Jump { time: self.time, before, after, multipliers, unknowns });
    }

    /// Source values at a time.
    pub(super) fn sources(&self, time: f64) -> Vec<f64> {
        let mut u = vec![0.0; self.inputs.waveforms().len()];
        self.inputs.values(time, Side::Right, &mut u);
        u
    }
}

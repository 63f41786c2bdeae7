//! The stepping loop: resumable, so that the caller decides when to look at rows, time and signals.

use super::clock::{evaluate, Clock, Target};
use super::gates::Switch;
use super::record::{Outputs, Values};
use super::stage::{Stage, System};
use crate::mlcp::{Residual, Role, Start};
use crate::waveform::{Side, Waveform};
use std::time::{Duration, Instant};

/// Length of an impulsive step relative to the nominal step: short enough that nothing but the jump
/// happens in it, long enough that `E/h` does not drown `G`.
const JUMP: f64 = 1e-9;
/// Length of the step that shows the values right after a jump.
const AFTER_JUMP: f64 = 1e-4;
/// A mode earns its affine map at this many steps.
const USES_FOR_MAP: u32 = 3;
/// Step lengths whose matrices are kept.
const STAGES: usize = 12;
/// Steps between two looks at the clock and two checks of the residual.
const LOOK: u64 = 64;
const CHECK: u64 = 1024;
/// Switch reactions at one instant before it is called chatter.
const MAX_REACTIONS: usize = 64;
/// Jumps kept in full; later ones are only counted.
const MAX_JUMPS: usize = 4096;

/// Instants to visit.
pub enum Plan {
    /// a time grid with steps and corners
    Grid(Clock),
    /// bare points, for static systems and sweeps
    Points { times: Vec<f64>, next: usize },
}

/// A jump of the stored charges or fluxes.
#[derive(Clone, Debug)]
pub struct Jump {
    /// when [s]
    pub time: f64,
    /// unknowns before
    pub before: Vec<f64>,
    /// unknowns after
    pub after: Vec<f64>,
    /// impulses of the multipliers [A s or V s]
    pub multipliers: Vec<f64>,
    /// impulses of the unknowns that carry one (branch currents, node voltages)
    pub unknowns: Vec<f64>,
}

/// A step that was not solved, with what a certificate needs.
#[derive(Clone, Debug)]
pub struct Failure {
    /// end of the step [s]
    pub time: f64,
    /// step length [s]; infinite for a static problem
    pub length: f64,
    /// right-hand side of the rows of z
    pub rhs: Vec<f64>,
    /// roles of the pairs: 0 diode, 1 closed, 2 open
    pub roles: Vec<u8>,
    /// worst residual reached
    pub residual: f64,
    /// a solution was found, but it is so large that infeasibility has to be ruled out first
    pub suspect: bool,
}

/// Counters of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Statistics {
    /// accepted steps
    pub steps: u64,
    /// steps whose mode differs from the one before
    pub mode_changes: u64,
    /// steps solved by the affine map or factor of the present mode
    pub quick_steps: u64,
    /// complementarity problems solved by the driver
    pub problems: u64,
    /// highest driver stage needed
    pub worst_stage: u8,
    /// switch operations
    pub switchings: u64,
    /// jumps of charges or fluxes
    pub jumps: u64,
    /// instants at which a switch did not come to rest
    pub chatter: u64,
    /// worst residual of rows over all checked steps
    pub residual_rows: f64,
    /// worst complementarity residual over all checked steps
    pub residual_complementarity: f64,
    /// residual checks made
    pub checks: u64,
}

/// What `advance` came back with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// rows are full or the time budget is spent
    More,
    /// the plan is finished
    Done,
    /// a step was not solved; see `failure`
    Failed,
}

/// One island in the course of its simulation.
pub struct Stepper {
    sys: System,
    waveforms: Vec<Waveform>,
    switches: Vec<Switch>,
    outputs: Outputs,
    constants: Vec<Option<f64>>,
    diodes: Vec<usize>,
    static_system: bool,
    stages: Vec<Stage>,
    stamp: u64,
    plan: Plan,
    step_length: f64,
    time: f64,
    first_row: bool,
    // state
    z: Vec<f64>,
    l: Vec<f64>,
    rates: Vec<f64>,
    u0: Vec<f64>,
    u1: Vec<f64>,
    roles: Vec<Role>,
    active: Vec<bool>,
    epoch: u64,
    // work space
    x: Vec<f64>,
    input: Vec<f64>,
    rhs: Vec<f64>,
    w: Vec<f64>,
    work: Vec<f64>,
    ends: Vec<f64>,
    accept_large: bool,
    /// counters
    pub stats: Statistics,
    /// the last failure
    pub failure: Option<Failure>,
    /// recorded jumps
    pub jumps: Vec<Jump>,
}

type Outcome = Result<(), Box<Failure>>;

impl Stepper {
    /// A stepper at rest at time 0; call one of the `start_` functions next.
    pub fn new(
        sys: System,
        waveforms: Vec<Waveform>,
        switches: Vec<Switch>,
        outputs: Outputs,
    ) -> Stepper {
        let (n, m, p) = (sys.g.nrows, sys.a.ncols, waveforms.len());
        let mut roles = vec![Role::Diode; m];
        for s in &switches {
            roles[s.pair] = s.role();
        }
        let diodes = (0..m).filter(|&i| roles[i] == Role::Diode).collect();
        let static_system = sys.e.values.iter().all(|&v| v == 0.0);
        let active = roles.iter().map(|&r| r == Role::Closed).collect();
        Stepper {
            constants: waveforms.iter().map(Waveform::constant).collect(),
            static_system,
            diodes,
            outputs,
            stages: Vec::new(),
            stamp: 0,
            plan: Plan::Points { times: Vec::new(), next: 0 },
            step_length: f64::INFINITY,
            time: 0.0,
            first_row: false,
            z: vec![0.0; n],
            l: vec![0.0; m],
            rates: vec![0.0; n],
            u0: vec![0.0; p],
            u1: vec![0.0; p],
            roles,
            active,
            epoch: 1,
            x: vec![0.0; n + m],
            input: Vec::new(),
            rhs: vec![0.0; n],
            w: vec![0.0; m],
            work: vec![0.0; 4 * (n + m) + 16],
            ends: vec![0.0; n],
            accept_large: false,
            stats: Statistics::default(),
            failure: None,
            jumps: Vec::new(),
            sys,
            waveforms,
            switches,
        }
    }

    /// Number of output columns, the time included.
    pub fn columns(&self) -> usize {
        self.outputs.len() + 1
    }

    /// Present unknowns and multipliers.
    pub fn state(&self) -> (&[f64], &[f64]) {
        (&self.z, &self.l)
    }

    /// Present time [s].
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Distinct modes seen at the nominal step length.
    pub fn mode_count(&self) -> usize {
        self.stages.iter().map(Stage::mode_count).max().unwrap_or(0)
    }

    /// Rules out asking for a certificate again: the large solution has been confirmed.
    pub fn accept_large(&mut self) {
        self.accept_large = true;
        self.failure = None;
    }

    /// Sets the instants to visit from here on; returns the number of output rows.
    pub fn plan(&mut self, plan: Plan, step_length: f64) -> u64 {
        self.step_length = step_length;
        self.plan = plan;
        match &self.plan {
            Plan::Grid(clock) => {
                self.first_row = clock.first_row_now();
                clock.rows()
            }
            Plan::Points { times, .. } => {
                self.first_row = false;
                times.len() as u64
            }
        }
    }

    /// Starts from the solution of the static equations (capacitors open, inductors shorted).
    pub fn start_dc(&mut self, time: f64, guess: Option<(&[f64], &[f64])>) -> Result<(), Failure> {
        self.time = time;
        evaluate(&self.waveforms, time, Side::Right, &mut self.u0);
        let start = match guess {
            Some((z, l)) => {
                self.z.copy_from_slice(z);
                self.l.copy_from_slice(l);
                Start::Warm
            }
            None => {
                self.z.fill(0.0);
                self.l.fill(0.0);
                Start::Cold
            }
        };
        self.u1.copy_from_slice(&self.u0);
        self.rates.fill(0.0);
        for _ in 0..MAX_REACTIONS {
            self.solve_static(start).map_err(|f| *f)?;
            if !self.react() {
                return Ok(());
            }
        }
        self.stats.chatter += 1;
        Ok(())
    }

    /// Starts from stored charges and fluxes `E z(0-)` by an impulsive step; the first entry of
    /// `jumps` tells what it moved.
    pub fn start_charges(&mut self, time: f64, charges: &[f64], step: f64) -> Result<(), Failure> {
        self.time = time;
        self.step_length = step;
        evaluate(&self.waveforms, time, Side::Right, &mut self.u0);
        self.z.fill(0.0);
        self.l.fill(0.0);
        if self.static_system {
            return self.start_dc(time, None);
        }
        self.impulse(Some(charges), Start::Cold).map_err(|f| *f)?;
        self.settle_switches().map_err(|f| *f)
    }

    /// Computes rows into `out` until it is full, the plan ends, a step fails or `budget` is spent.
    pub fn advance(&mut self, out: &mut [f64], budget: Duration) -> (usize, Progress) {
        let columns = self.columns();
        let begin = Instant::now();
        let mut rows = 0;
        let capacity = out.len() / columns;
        let mut count: u64 = 0;
        while rows < capacity {
            if self.first_row {
                self.first_row = false;
                self.write(self.time, &mut out[rows * columns..(rows + 1) * columns]);
                rows += 1;
                continue;
            }
            let target = match &mut self.plan {
                Plan::Grid(clock) => clock.next(&self.waveforms),
                Plan::Points { times, next } => times.get(*next).map(|&time| {
                    *next += 1;
                    let length = f64::INFINITY;
                    Target { time, label: time, length, row: true, jump: false }
                }),
            };
            let Some(target) = target else {
                return (rows, Progress::Done);
            };
            if let Err(failure) = self.step(&target) {
                self.failure = Some(*failure);
                return (rows, Progress::Failed);
            }
            if target.row {
                self.write(target.label, &mut out[rows * columns..(rows + 1) * columns]);
                rows += 1;
            }
            count += 1;
            if count % LOOK == 0 && begin.elapsed() > budget {
                break;
            }
        }
        (rows, Progress::More)
    }

    fn write(&self, label: f64, row: &mut [f64]) {
        row[0] = label;
        let at = Values { z: &self.z, l: &self.l, rates: &self.rates, u: &self.u0 };
        self.outputs.write(&at, &mut row[1..]);
    }

    fn step(&mut self, target: &Target) -> Outcome {
        let points = matches!(self.plan, Plan::Points { .. });
        self.time = target.time;
        if self.static_system || points {
            evaluate(&self.waveforms, target.time, Side::Right, &mut self.u0);
            self.u1.copy_from_slice(&self.u0);
            self.take(f64::INFINITY)?;
        } else {
            evaluate(&self.waveforms, target.time, Side::Left, &mut self.u1);
            self.take(target.length)?;
            if target.jump {
                evaluate(&self.waveforms, target.time, Side::Right, &mut self.u0);
                self.impulse_or_leave()?;
            } else {
                self.u0.copy_from_slice(&self.u1);
            }
        }
        if !self.switches.is_empty() {
            self.settle_switches()?;
        }
        Ok(())
    }

    /// One ordinary step of the given length from (z, u0) with sources u1 at its end.
    fn take(&mut self, length: f64) -> Outcome {
        self.stats.steps += 1;
        let k = self.stage_index(length, false);
        let (n, m) = (self.z.len(), self.l.len());
        let stage = &mut self.stages[k];
        let slot = stage.slot(&self.active, self.epoch);
        slot.uses += 1;
        let mut quick = slot.factor.regular();
        if quick {
            if slot.map.is_none() && slot.uses == USES_FOR_MAP {
                stage.make_map(&self.active, self.epoch, &mut self.work);
            }
            let inputs = &stage.inputs;
            if self.input.len() < inputs.len() {
                self.input.resize(inputs.len(), 0.0);
            }
            let (nc, ne) = (inputs.carried.len(), inputs.ends.len());
            let has_map = stage.slot(&self.active, self.epoch).map.is_some();
            if has_map {
                for (x, &j) in self.input.iter_mut().zip(&stage.inputs.carried) {
                    *x = self.z[j];
                }
                for (x, &j) in self.input[nc..].iter_mut().zip(&stage.inputs.ends) {
                    *x = self.u1[j];
                }
                for (x, &j) in self.input[nc + ne..].iter_mut().zip(&stage.inputs.starts) {
                    *x = self.u0[j];
                }
                let count = stage.inputs.len();
                let slot = stage.slot(&self.active, self.epoch);
                let map = slot.map.as_ref().expect("just checked");
                map.apply(&self.input[..count], &mut self.x);
            } else {
                let matrices = &stage.matrices;
                matrices.right_hand_side(&self.z, &self.u0, &self.u1, &mut self.rhs);
                self.x[..n].copy_from_slice(&self.rhs);
                for i in 0..m {
                    self.x[n + i] = if self.active[i] { -matrices.q[i] } else { 0.0 };
                }
                let slot = stage.slot(&self.active, self.epoch);
                slot.factor.clone().solve(&mut self.x, &mut self.work);
                let (z, l) = self.x.split_at_mut(n);
                stage.matrices.slacks(z, l, true, &mut self.w);
                for i in 0..m {
                    if !self.active[i] {
                        l[i] = self.w[i];
                    }
                }
            }
            let guards = &self.x[n..];
            quick = self.diodes.iter().all(|&i| guards[i] >= 0.0)
                && (length.is_finite() || self.x.iter().all(|v| v.is_finite()));
        }
        if !quick {
            let stage = &self.stages[k];
            stage.matrices.right_hand_side(&self.z, &self.u0, &self.u1, &mut self.rhs);
            self.keep_for_rates();
            self.solve(k, length, Start::Warm)?;
            self.finish_rates(length);
            return Ok(());
        }
        self.stats.quick_steps += 1;
        if self.stats.steps % CHECK == 0 {
            let matrices = &self.stages[k].matrices;
            matrices.right_hand_side(&self.z, &self.u0, &self.u1, &mut self.rhs);
        }
        self.keep_for_rates();
        self.z.copy_from_slice(&self.x[..n]);
        for i in 0..m {
            self.l[i] = if self.active[i] { self.x[n + i] } else { 0.0 };
        }
        self.finish_rates(length);
        if self.stats.steps % CHECK == 0 {
            let driver = &mut self.stages[k].driver;
            let residual = driver.residual(&self.rhs, &self.sys.q, &self.roles, &self.z, &self.l);
            self.note(residual);
        }
        Ok(())
    }

    /// Solves the complementarity problem with right-hand side `rhs` at stage `k`.
    fn solve(&mut self, k: usize, length: f64, start: Start) -> Outcome {
        self.stats.problems += 1;
        let stage = &mut self.stages[k];
        let solved = stage.driver.solve(
            &self.rhs,
            &self.sys.q,
            &self.roles,
            &mut self.z,
            &mut self.l,
            start,
        );
        let (residual, suspect) = match solved {
            Ok(solved) => {
                self.stats.worst_stage = self.stats.worst_stage.max(solved.stage);
                let suspect = solved.needs_certificate && !self.accept_large && !stage.impulsive;
                if !suspect {
                    let found = stage.driver.active();
                    if found != self.active {
                        self.active.copy_from_slice(found);
                        self.epoch += 1;
                        self.stats.mode_changes += 1;
                    }
                    self.note(solved.residual);
                    return Ok(());
                }
                (solved.residual.worst(), true)
            }
            Err(unsolved) => (unsolved.residual.worst(), false),
        };
        Err(Box::new(Failure {
            time: self.time,
            length,
            rhs: self.rhs.clone(),
            roles: self.roles.iter().map(|&r| r as u8).collect(),
            residual,
            suspect,
        }))
    }

    fn solve_static(&mut self, start: Start) -> Outcome {
        let k = self.stage_index(f64::INFINITY, false);
        let matrices = &self.stages[k].matrices;
        matrices.right_hand_side(&self.z, &self.u0, &self.u1, &mut self.rhs);
        self.solve(k, f64::INFINITY, start)
    }

    /// A jump at the present time; where the impulsive problem has no solution the next ordinary
    /// step has to resolve it.
    fn impulse_or_leave(&mut self) -> Outcome {
        let (z, l) = (self.z.clone(), self.l.clone());
        if self.impulse(None, Start::Warm).is_err() {
            self.z = z;
            self.l = l;
        }
        Ok(())
    }

    /// The implicit impulsive step: charges and fluxes jump so that all laws hold again.
    ///
    /// The first, very short step moves the stored quantities; a second, longer one from the same
    /// stored quantities gives the finite values of currents and voltages right after the jump.
    fn impulse(&mut self, charges: Option<&[f64]>, start: Start) -> Outcome {
        let before = self.z.clone();
        let delta = JUMP * self.step_length;
        let k = self.stage_index(delta, true);
        self.load_charges(k, charges, delta);
        self.solve(k, delta, start)?;
        let after = self.z.clone();
        let multipliers: Vec<f64> = self.l.iter().map(|v| v * delta).collect();
        if self.jumped(charges, &before, &after) {
            self.stats.jumps += 1;
            if self.jumps.len() < MAX_JUMPS {
                let unknowns = after.iter().map(|v| v * delta).collect();
                let after = after.clone();
                self.jumps.push(Jump { time: self.time, before, after, multipliers, unknowns });
            }
        }
        let short = AFTER_JUMP * self.step_length;
        let k = self.stage_index(short, true);
        self.load_charges(k, None, short);
        if self.solve(k, short, Start::Warm).is_ok() {
            if self.outputs.needs_rates() {
                for (rate, (new, old)) in self.rates.iter_mut().zip(self.z.iter().zip(&after)) {
                    *rate = (new - old) / short;
                }
            }
            for &j in &self.stages[k].inputs.carried {
                self.z[j] = after[j];
            }
        } else {
            self.z.copy_from_slice(&after);
        }
        Ok(())
    }

    /// Right-hand side of an impulsive step of length `delta`.
    fn load_charges(&mut self, k: usize, charges: Option<&[f64]>, delta: f64) {
        let matrices = &self.stages[k].matrices;
        match charges {
            Some(charges) => {
                self.rhs.fill(0.0);
                for (r, c) in self.rhs.iter_mut().zip(charges) {
                    *r = c / delta;
                }
                matrices.source_end.mul_add(1.0, &self.u0, &mut self.rhs);
            }
            None => matrices.right_hand_side(&self.z, &self.u0, &self.u0, &mut self.rhs),
        }
    }

    /// Did stored charges or fluxes change by more than a step of length `JUMP h` explains?
    fn jumped(&mut self, charges: Option<&[f64]>, before: &[f64], after: &[f64]) -> bool {
        let n = before.len();
        let mut old = vec![0.0; n];
        match charges {
            Some(charges) => old.copy_from_slice(charges),
            None => self.sys.e.mul_add(1.0, before, &mut old),
        }
        self.ends.fill(0.0);
        self.sys.e.mul_add(1.0, after, &mut self.ends);
        for kind in 0..2u8 {
            let rows = || (0..n).filter(|&i| self.sys.row_kind[i] == kind);
            let size = rows().map(|i| old[i].abs().max(self.ends[i].abs())).fold(0.0, f64::max);
            if rows().any(|i| (self.ends[i] - old[i]).abs() > 1e-6 * size) {
                return true;
            }
        }
        false
    }

    /// Applies the switch laws until they agree with the state.
    fn settle_switches(&mut self) -> Outcome {
        for _ in 0..MAX_REACTIONS {
            if !self.react() {
                return Ok(());
            }
            if self.static_system || matches!(self.plan, Plan::Points { .. }) {
                self.u1.copy_from_slice(&self.u0);
                self.solve_static(Start::Warm)?;
            } else {
                self.impulse_or_leave()?;
            }
        }
        self.stats.chatter += 1;
        Ok(())
    }

    /// Updates all switches; true if one of them changed.
    fn react(&mut self) -> bool {
        let mut changed = false;
        for switch in &mut self.switches {
            if switch.update(&self.z) {
                changed = true;
                self.stats.switchings += 1;
                let role = switch.role();
                self.roles[switch.pair] = role;
                self.active[switch.pair] = role == Role::Closed;
                self.epoch += 1;
            }
        }
        changed
    }

    fn keep_for_rates(&mut self) {
        if self.outputs.needs_rates() {
            self.rates.copy_from_slice(&self.z);
        }
    }

    fn finish_rates(&mut self, length: f64) {
        if self.outputs.needs_rates() {
            for (rate, z) in self.rates.iter_mut().zip(&self.z) {
                *rate = (z - *rate) / length;
            }
        }
    }

    fn note(&mut self, residual: Residual) {
        self.stats.checks += 1;
        let s = &mut self.stats;
        s.residual_rows = s.residual_rows.max(residual.rows);
        s.residual_complementarity = s.residual_complementarity.max(residual.complementarity);
    }

    /// The stage for a step length; lengths equal up to rounding share one.
    fn stage_index(&mut self, length: f64, impulsive: bool) -> usize {
        self.stamp += 1;
        let stamp = self.stamp;
        let same = |s: &Stage| {
            s.impulsive == impulsive
                && (s.length == length || (s.length - length).abs() <= 1e-9 * length)
        };
        if let Some(k) = self.stages.iter().position(same) {
            self.stages[k].stamp = stamp;
            return k;
        }
        if self.stages.len() >= STAGES {
            let oldest = (0..STAGES).min_by_key(|&k| self.stages[k].stamp).unwrap_or(0);
            self.stages.swap_remove(oldest);
        }
        let mut stage = Stage::new(&self.sys, length, impulsive, &self.constants);
        stage.stamp = stamp;
        self.stages.push(stage);
        self.stages.len() - 1
    }
}

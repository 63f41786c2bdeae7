//! The stepping loop: resumable, so that the caller decides when to look at rows, time and signals.

use super::at_once::AtOnce;
use super::clock::{Clock, Target};
use super::controls::Controls;
use super::failure::Failure;
use super::impacts::Impacts;
use super::jumps::{jump_weights, Jump};
use super::record::{Outputs, Quantities};
use super::smooth::SmoothPart;
use super::stage::{Stage, System};
use super::storage::Storage;
use super::times::fastest_time;
use super::witness::Witness;
use crate::audit::{Balance, Sums, ITERATED};
use crate::given::fixed_by_lines;
use crate::instant::{Continuous, Reinitialiser};
use crate::mlcp::{work_len, Role};
use crate::newton::Tracking;
use crate::resting::Resting;
use crate::structure::{kinks_that_reach_storage, Coordinates};
use crate::switch::Switch;
use crate::waveform::Waveform;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Events kept in full; later ones are only counted.
pub(super) const MAX_EVENTS: usize = 1 << 16;
/// Steps between two looks at the clock.
const LOOK: u64 = 64;
/// Switch reactions at one instant before it is called chatter.
pub(super) const MAX_REACTIONS: usize = 128;

/// Instants to visit.
pub enum Plan {
    /// a time grid with steps and corners
    Grid(Clock),
    /// bare points, for static systems and sweeps
    Points {
        /// where
        times: Vec<f64>,
        /// index of the next one
        next: usize,
    },
}

impl Plan {
    fn next(&mut self, waveforms: &[Waveform]) -> Option<Target> {
        match self {
            Plan::Grid(clock) => clock.next(waveforms),
            Plan::Points { times, next } => {
                let time = *times.get(*next)?;
                *next += 1;
                let length = f64::INFINITY;
                Some(Target { time, label: time, length, row: true, jump: false })
            }
        }
    }
}

/// Counters of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Statistics {
    /// accepted steps
    pub steps: u64,
    /// changes of pairs
    pub events: u64,
    /// solutions whose mode differs from the one before
    pub mode_changes: u64,
    /// steps solved by the affine map or factor of the present mode
    pub quick_steps: u64,
    /// complementarity problems solved by the driver
    pub problems: u64,
    /// steps from a mode that leaves some voltage or current undetermined
    pub undetermined: u64,
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
    /// problems linearised by Newton's method
    pub linearised: u64,
    /// worst residual of the laws at the points of a path that is followed, not solved
    pub grid_residual: f64,
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

/// What to do with solutions so large that the problem may be infeasible up to rounding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Large {
    /// hand them to the caller, who asks for a certificate
    Refused,
    /// the next one has been certified
    Awaited,
    /// those of this mode have been certified
    Mode(u64),
}

/// One island in the course of its simulation.
pub struct Stepper {
    pub(super) sys: System,
    /// Newton's method, for a system with smooth nonlinear terms
    pub(super) smooth: Option<Box<SmoothPart>>,
    pub(super) waveforms: Vec<Waveform>,
    pub(super) switches: Arc<[Switch]>,
    /// those that chatter, see [`crate::sampling`]
    pub(super) sampled: Vec<bool>,
    /// how far the control of each has been from its threshold
    pub(super) swings: Vec<f64>,
    /// those that rest at thresholds
    pub(super) resting: Resting,
    /// whether a control that is at its threshold is taken to stay there
    pub(super) still: Vec<bool>,
    /// the points of a sweep: each is at rest, and no time passes between them
    pub(super) frozen: bool,
    /// state of each switch's gate
    pub(super) gates: Vec<bool>,
    pub(super) outputs: Outputs,
    pub(super) constants: Vec<Option<f64>>,
    pub(super) diodes: Vec<usize>,
    pub(super) static_system: bool,
    pub(super) stages: Vec<Stage>,
    pub(super) stamp: u64,
    /// the stage used last
    pub(super) last_stage: usize,
    pub(super) plan: Plan,
    /// a dynamic system at the points of a sweep: its static equations are solved
    pub(super) sweeping: bool,
    pub(super) retry: Option<Target>,
    pub(super) step_length: f64,
    pub(super) storage: Storage,
    /// laws without storage
    pub(super) at_once: AtOnce,
    /// switches that sources decide about
    pub(super) controls: Controls,
    /// of each source, whether something may jump where its slope does
    pub(super) kinks: Vec<bool>,
    /// unknowns that constant and piecewise linear sources alone determine: no step errs in them
    pub(super) fixed: Vec<bool>,
    /// which voltages the unknowns are, if not all are counted against ground
    pub(super) coordinates: Option<Coordinates>,
    /// then: the capacitances that meet in each node [F]
    pub(super) node_storage: Vec<f64>,
    /// the state after instants at which nothing jumps
    pub(super) continuous: Option<Box<Continuous>>,
    /// jumps by the structure of the network, where it is known
    pub(super) reinitialiser: Option<Box<Reinitialiser>>,
    /// the largest current so far, where that is looked after [A]
    pub(super) felt: f64,
    /// rates of what is stored at the present state, where a jump in closed form has just told them
    pub(super) begun: Option<Vec<f64>>,
    /// scratch: slopes of the sources
    pub(super) slopes: Vec<f64>,
    /// what charges and fluxes are measured by in jumps, and the largest so far of each kind
    pub(super) weights: Vec<f64>,
    pub(super) heaviest: [f64; 2],
    /// scratch: charges and fluxes on both sides of what may be a jump, and what they are measured by
    pub(super) moving: [Vec<f64>; 5],
    /// pairs that close at speed
    pub(super) impacts: Impacts,
    /// the switch that has changed last
    pub(super) last_thrown: Option<usize>,
    /// the least and the largest conductance of a resistor [S]
    pub(super) conductances: [f64; 2],
    /// the unknowns are those before the sources or switches that changed last: no jump has been found
    pub(super) stale: bool,
    /// fastest time constant [s]
    pub(super) fastest: f64,
    pub(super) time: f64,
    /// time of the state where smooth functions were evaluated last [s]
    pub(super) smooth_time: f64,
    pub(super) first_row: bool,
    // state
    pub(super) z: Vec<f64>,
    pub(super) l: Vec<f64>,
    pub(super) rates: Vec<f64>,
    pub(super) u0: Vec<f64>,
    pub(super) u1: Vec<f64>,
    pub(super) roles: Vec<Role>,
    pub(super) active: Vec<bool>,
    pub(super) epoch: u64,
    // work space
    pub(super) x: Vec<f64>,
    pub(super) input: Vec<f64>,
    pub(super) rhs: Vec<f64>,
    pub(super) w: Vec<f64>,
    /// how negative a guard may be by rounding; for which mode and step length, up to which step
    pub(super) noise: Vec<f64>,
    pub(super) noise_known: (u64, f64, u64),
    /// the mode just tried is still new: its residuals are checked in every step
    pub(super) recent: bool,
    pub(super) work: Vec<f64>,
    /// largest charge and flux at a possible jump so far
    pub(super) largest: [f64; 2],
    pub(super) z_before: Vec<f64>,
    pub(super) l_before: Vec<f64>,
    pub(super) large: Large,
    /// from here on every step is a row, and a jump two [s]; infinite for rows of the grid only
    pub(super) all_points: f64,
    /// the last step ended in a jump; `left` is the row before it
    pub(super) two_sided: bool,
    pub(super) left: Vec<f64>,
    pub(super) z_recorded: Vec<f64>,
    /// what is left for the certificate
    pub witness: Witness,
    /// what goes with the run for the certificate: its balance of energy
    pub sums: Option<Box<Sums>>,
    /// counters
    pub stats: Statistics,
    /// the last failure
    pub failure: Option<Failure>,
    /// recorded jumps
    pub jumps: Vec<Jump>,
    /// changes of pairs: time, pair, whether it conducts from then on
    pub events: Vec<(f64, usize, bool)>,
    /// the state of the pairs that `events` leads to
    pub(super) logged: Vec<bool>,
    pub(super) logged_epoch: u64,
}

impl Stepper {
    /// A stepper at rest at time 0; call one of the `start_` functions next.
    pub fn new(
        mut sys: System,
        waveforms: Vec<Waveform>,
        switches: Arc<[Switch]>,
        gates: Vec<bool>,
        outputs: Outputs,
    ) -> Stepper {
        let at_once = AtOnce::new(&sys);
        let kinks = kinks_that_reach_storage(&sys.linear, sys.smooth.as_ref());
        let smooth = sys.smooth.take().map(|smooth| Box::new(SmoothPart::new(&sys, smooth)));
        let (n, m, p) = (sys.linear.g.nrows, sys.linear.a.ncols, waveforms.len());
        let mut roles = vec![Role::Diode; m];
        for (s, &gate) in switches.iter().zip(&gates) {
            roles[s.pair] = s.role(gate);
        }
        let diodes: Vec<usize> = (0..m).filter(|&i| roles[i] == Role::Diode).collect();
        let static_system = sys.linear.e.values.iter().all(|&v| v == 0.0)
            && !smooth.as_ref().is_some_and(|s| s.newton.stores());
        let active = roles.iter().map(|&r| r == Role::Closed).collect();
        let impacts = Impacts::new(&sys, !diodes.is_empty() || switches.iter().any(|s| s.latching));
        let functions = smooth.iter().flat_map(|smooth| smooth.newton.rows_of_functions());
        let functions: Vec<usize> = functions.collect();
        let fixed = fixed_by_lines(&sys.linear, &functions, &waveforms);
        let controls = Controls::new(&sys.linear, functions.into_iter(), &switches);
        let weights = jump_weights(&sys);
        let conductances = sys.conductances();
        Stepper {
            at_once,
            impacts,
            controls,
            kinks,
            fixed,
            coordinates: None,
            node_storage: vec![0.0; n],
            continuous: None,
            reinitialiser: None,
            begun: None,
            slopes: vec![0.0; p],
            felt: 0.0,
            weights,
            conductances,
            heaviest: [0.0; 2],
            moving: Default::default(),
            constants: waveforms.iter().map(Waveform::constant).collect(),
            static_system,
            diodes,
            smooth,
            stages: Vec::new(),
            stamp: 0,
            last_stage: 0,
            plan: Plan::Points { times: Vec::new(), next: 0 },
            sweeping: false,
            retry: None,
            step_length: f64::INFINITY,
            fastest: fastest_time(&sys.linear.e, &sys.linear.g),
            storage: Storage::new(&sys.linear.e, &sys.linear.row_kind),
            time: 0.0,
            smooth_time: 0.0,
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
            noise: vec![0.0; m],
            noise_known: (0, f64::NAN, 0),
            recent: true,
            work: vec![0.0; work_len(n + m)],
            largest: [0.0; 2],
            z_before: vec![0.0; n],
            l_before: vec![0.0; m],
            large: Large::Refused,
            all_points: f64::INFINITY,
            two_sided: false,
            left: vec![0.0; 1 + outputs.len()],
            z_recorded: vec![0.0; n],
            witness: Witness::default(),
            sums: None,
            outputs,
            stats: Statistics::default(),
            failure: None,
            jumps: Vec::new(),
            events: Vec::new(),
            logged: vec![false; m],
            logged_epoch: 0,
            sys,
            waveforms,
            sampled: vec![false; switches.len()],
            swings: vec![0.0; switches.len()],
            resting: Resting::new(switches.len()),
            still: vec![false; switches.len()],
            frozen: false,
            switches,
            gates,
            last_thrown: None,
            stale: false,
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

    /// Lets smooth functions see a fixed time: in a sweep, the time counts the points.
    pub fn freeze_time(&mut self, time: f64) {
        self.frozen = true;
        if let Some(smooth) = &mut self.smooth {
            smooth.frozen = Some(time);
        }
    }

    /// Follows the path of solutions by Euler-Newton steps at the points of a static system;
    /// `correctors` as the functions ask for if not given.
    pub fn follow_path(&mut self, by_rate: bool, correctors: Option<usize>) {
        if let Some(smooth) = &mut self.smooth {
            let correctors = correctors.unwrap_or_else(|| smooth.newton.usual_correctors());
            smooth.tracking = Some(Tracking { by_rate, correctors });
        }
    }

    /// The balance of energy up to now, if the run is accompanied by one.
    pub fn balance(&mut self) -> Option<Balance> {
        self.sums.as_mut().map(|sums| sums.balance(&self.z))
    }

    /// Present time [s].
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Takes a mode for the present one.
    pub(super) fn turn_to(&mut self, mode: &[bool]) {
        if self.active != mode {
            self.active.copy_from_slice(mode);
            self.epoch += 1;
        }
    }

    /// Pairs of the switches whose controls have come to rest at thresholds, and when first [s].
    pub fn resting(&self) -> Vec<(usize, f64)> {
        self.resting.told(&self.switches)
    }

    /// State of each switch's gate.
    pub fn gates(&self) -> &[bool] {
        &self.gates
    }

    /// Distinct modes seen at the nominal step length.
    pub fn mode_count(&self) -> usize {
        self.stages.iter().map(Stage::mode_count).max().unwrap_or(0)
    }

    /// The suspect solution was found genuine: takes it, and further ones in its mode.
    pub fn accept_large(&mut self) {
        self.large = Large::Awaited;
        self.failure = None;
    }

    /// Makes every step from a time on a row, and every jump two.
    pub fn show_all_points(&mut self, from: f64) {
        self.all_points = from;
    }

    /// Sets the instants to visit from here on; returns the number of output rows.
    pub fn plan(&mut self, plan: Plan, step_length: f64) -> u64 {
        self.step_length = step_length;
        self.plan = plan;
        self.sweeping = matches!(self.plan, Plan::Points { .. });
        if let (Some(smooth), false, false) = (&mut self.smooth, self.sweeping, self.static_system)
        {
            smooth.newton.set_accuracy(ITERATED);
        }
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

    /// Computes rows into `out` until it is full, the plan ends, a step fails or `budget` is spent.
    pub fn advance(&mut self, out: &mut [f64], budget: Duration) -> (usize, Progress) {
        let columns = self.columns();
        let begin = Instant::now();
        let mut rows = 0;
        let capacity = out.len() / columns;
        let most = if self.all_points.is_finite() { 2 } else { 1 }; // rows that one step may add
        let mut count: u64 = 0;
        while rows + most <= capacity {
            if self.first_row {
                self.first_row = false;
                self.write(self.time, &mut out[rows * columns..(rows + 1) * columns]);
                rows += 1;
                if self.witness.between(self.time) {
                    self.note_side(self.time);
                }
                continue;
            }
            let Some(target) = self.retry.take().or_else(|| self.plan.next(&self.waveforms)) else {
                return (rows, Progress::Done);
            };
            if self.logged_epoch == 0 {
                self.log_events(); // what the start has found is no event
                self.events.clear();
            }
            let target = match self.step(&target) {
                Ok(None) => target,
                Ok(Some(impact)) => {
                    let length = target.time - impact.time;
                    self.retry = (length > 0.0).then_some(Target { length, ..target });
                    impact
                }
                Err(failure) => {
                    // back to the state before, so that the step can be taken again
                    self.z.copy_from_slice(&self.z_before);
                    self.l.copy_from_slice(&self.l_before);
                    self.forget_functions();
                    self.failure = Some(*failure);
                    self.retry = Some(target);
                    return (rows, Progress::Failed);
                }
            };
            if self.logged_epoch != self.epoch {
                self.log_events();
            }
            if self.two_sided {
                rows += self.note_sides(&target, &mut out[rows * columns..]);
            }
            if target.row || target.time >= self.all_points {
                self.write(target.label, &mut out[rows * columns..(rows + 1) * columns]);
                rows += 1;
            }
            if self.witness.between(target.time) && !self.two_sided {
                self.note_side(target.label);
            }
            count += 1;
            let pause = count.is_multiple_of(LOOK) && begin.elapsed() > budget;
            if pause || self.witness.full() {
                break;
            }
        }
        (rows, Progress::More)
    }

    /// The row before a jump goes before its row of the table, else both go to the side rows;
    /// returns the number of rows added to the table.
    fn note_sides(&mut self, target: &Target, out: &mut [f64]) -> usize {
        if self.all_points.is_finite() {
            if target.time < self.all_points {
                return 0;
            }
            out[..self.left.len()].copy_from_slice(&self.left);
            return 1;
        }
        self.witness.sides.extend_from_slice(&self.left);
        self.note_side(target.label);
        0
    }

    /// Adds the present values to the side rows.
    fn note_side(&mut self, label: f64) {
        let start = self.witness.sides.len();
        let mut sides = std::mem::take(&mut self.witness.sides);
        sides.resize(start + self.columns(), 0.0);
        self.write(label, &mut sides[start..]);
        self.witness.sides = sides;
    }

    /// Notes which pairs have changed since the last time.
    pub(super) fn log_events(&mut self) {
        self.logged_epoch = self.epoch;
        for (i, (old, &new)) in self.logged.iter_mut().zip(&self.active).enumerate() {
            if *old != new {
                *old = new;
                self.stats.events += 1;
                if self.events.len() < MAX_EVENTS {
                    self.events.push((self.time, i, new));
                }
            }
        }
    }

    pub(super) fn write(&mut self, label: f64, row: &mut [f64]) {
        row[0] = label;
        let f = self.smooth.as_ref().map_or([&[][..]; 2], |s| [&s.f, &s.rates]);
        let quantities = Quantities { z: &self.z, l: &self.l, rates: &self.rates, u: &self.u0, f };
        self.outputs.write(&quantities, &mut row[1..]);
    }
}

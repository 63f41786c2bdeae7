//! The stepping loop: resumable, so that the caller decides when to look at rows, time and signals.

use super::events::impacts::Impacts;
use super::events::source_controlled::Controls;
use super::events::switching::Switching;
use super::failure::Failure;
use super::instants::jumps::jump_weights;
use super::instants::storage::Storage;
use super::instants::time_constants::fastest_time;
use super::outputs::Outputs;
use super::recorder::Recorder;
use super::records::{Facts, Instants, Schedule};
use super::smooth::SmoothPart;
use super::solver::{Large, Solver};
use super::state::State;
use super::statistics::Statistics;
use super::step_length::{Stage, System};
use super::time_grid::{known, Clock, Target};
use crate::audit::{Balance, ITERATED};
use crate::mlcp::Role;
use crate::newton::Tracking;
use crate::source_determined::fixed_by_lines;
use crate::structure::kinks_that_reach_storage;
use crate::switch::Switch;
use crate::waveform::Waveform;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Steps between two looks at the clock.
const LOOK: u64 = 64;
/// Switch reactions at one instant before it is called chatter.
pub(in crate::integrate) const MAX_REACTIONS: usize = 128;

/// Instants to visit.
pub enum Plan {
    /// a time grid with steps and breakpoints
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

/// What `advance` came back with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// rows are full or the time budget is spent
    More,
    /// the plan is finished
    Done,
    /// a step was not solved; see `failure`
    Failed,
    /// a source is not known beyond the present time: somebody has to say how it goes on
    Waiting,
}

/// One island in the course of its simulation.
pub struct Stepper {
    /// the equations, and what solves them
    pub(in crate::integrate) solver: Solver,
    /// where the run is
    pub(in crate::integrate) state: State,
    pub(in crate::integrate) waveforms: Vec<Waveform>,
    /// the switches and what decides about them
    pub(in crate::integrate) switching: Switching,
    /// what is known of the network once and for all
    pub(in crate::integrate) facts: Facts,
    /// what finds states right after instants at which something may jump, and what jumps are measured by
    pub(in crate::integrate) instants: Instants,
    /// what is shown and kept of a run
    pub recorder: Recorder,
    /// which instants come next
    pub(in crate::integrate) schedule: Schedule,
    /// the last failure
    pub failure: Option<Failure>,
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
        let (n, m, p) = (sys.linear.g.nrows, sys.linear.a.ncols, waveforms.len());
        let any = !switches.is_empty();
        let mut roles = vec![Role::Diode; m];
        for (s, &gate) in switches.iter().zip(&gates) {
            roles[s.pair] = s.role(gate);
        }
        let state = State::at_rest(roles, [n, p]);
        let kinks = kinks_that_reach_storage(&sys.linear, sys.smooth.as_ref());
        let weights = jump_weights(&sys);
        let smooth = sys.smooth.take();
        let rated = outputs.needs_function_rates();
        let smooth = smooth.map(|smooth| Box::new(SmoothPart::new(&sys, smooth, rated)));
        let stores = smooth.as_ref().is_some_and(|smooth| smooth.newton.stores());
        let functions = smooth.iter().flat_map(|smooth| smooth.newton.rows_of_functions());
        let functions: Vec<usize> = functions.collect();
        let impulsive = !state.diodes.is_empty() || switches.iter().any(|s| s.latching);
        let impacts = Impacts::new(&sys, impulsive);
        let facts = Facts {
            static_system: sys.linear.e.values.iter().all(|&v| v == 0.0) && !stores,
            kinks,
            fixed: fixed_by_lines(&sys.linear, &functions, &waveforms),
            coordinates: None,
            node_storage: vec![0.0; n],
            conductances: sys.conductances(),
            fastest: fastest_time(&sys.linear.e, &sys.linear.g),
            storage: Storage::new(&sys.linear.e, &sys.linear.row_kind),
        };
        let controls = Controls::new(&sys.linear, functions.into_iter(), &switches);
        let constants = waveforms.iter().map(Waveform::constant).collect();
        Stepper {
            solver: Solver::new(sys, smooth, constants),
            switching: Switching::new(switches, gates, controls),
            facts,
            instants: Instants::new(impacts, weights, p),
            recorder: Recorder::new(outputs, [n, m], any),
            schedule: Schedule {
                plan: Plan::Points { times: Vec::new(), next: 0 },
                sweeping: false,
                retry: None,
                step_length: f64::INFINITY,
            },
            waveforms,
            state,
            failure: None,
        }
    }

    /// Present unknowns and multipliers.
    pub fn state(&self) -> (&[f64], &[f64]) {
        (&self.state.z, &self.state.l)
    }

    /// Lets smooth functions see a fixed time: in a sweep, the time counts the points.
    pub fn freeze_time(&mut self, time: f64) {
        self.switching.frozen = true;
        if let Some(smooth) = &mut self.solver.smooth {
            smooth.frozen = Some(time);
        }
    }

    /// Follows the path of solutions by Euler-Newton steps at the points of a static system;
    /// `correctors` as the functions ask for if not given.
    pub fn follow_path(&mut self, by_rate: bool, correctors: Option<usize>) {
        if let Some(smooth) = &mut self.solver.smooth {
            let correctors = correctors.unwrap_or_else(|| smooth.newton.usual_correctors());
            smooth.tracking = Some(Tracking { by_rate, correctors });
        }
    }

    /// The balance of energy up to now, if the run is accompanied by one.
    pub fn balance(&mut self) -> Option<Balance> {
        self.recorder.sums.as_mut().map(|sums| sums.balance(&self.state.z))
    }

    /// Counters.
    pub fn statistics(&self) -> &Statistics {
        &self.solver.stats
    }

    /// Present time [s].
    pub fn time(&self) -> f64 {
        self.state.time
    }

    /// Pairs of the switches whose controls have come to rest at thresholds, and when first [s].
    pub fn resting(&self) -> Vec<(usize, f64)> {
        self.switching.resting.told(&self.switching.switches)
    }

    /// Where controls were when gates turned.
    pub fn switching_turns(&self) -> &crate::switch::Turns {
        &self.switching.turns
    }

    /// Keeps also what only checks of turning gates need.
    pub fn watch_closely(&mut self) {
        self.switching.turns.wanted = true;
        self.recorder.expected.wanted = true;
    }

    /// State of each switch's gate.
    pub fn gate_states(&self) -> &[bool] {
        &self.switching.gates
    }

    /// Distinct modes seen at the nominal step length.
    pub fn mode_count(&self) -> usize {
        self.solver.levels.stages.iter().map(Stage::mode_count).max().unwrap_or(0)
    }

    /// The suspect solution was found genuine: takes it, and further ones in its mode.
    pub fn accept_large(&mut self) {
        self.solver.large = Large::Awaited;
        self.failure = None;
    }

    /// Makes every step from a time on a row, and every jump two.
    pub fn show_all_points(&mut self, from: f64) {
        self.recorder.all_points = from;
    }

    /// Sets the instants to visit from here on; returns the number of output rows.
    pub fn plan(&mut self, plan: Plan, step_length: f64) -> u64 {
        self.schedule.step_length = step_length;
        self.schedule.plan = plan;
        self.schedule.sweeping = matches!(self.schedule.plan, Plan::Points { .. });
        if let (Some(smooth), false, false) =
            (&mut self.solver.smooth, self.schedule.sweeping, self.facts.static_system)
        {
            smooth.newton.set_accuracy(ITERATED);
        }
        match &self.schedule.plan {
            Plan::Grid(clock) => {
                self.recorder.first_row = clock.first_row_now();
                clock.rows()
            }
            Plan::Points { times, .. } => {
                self.recorder.first_row = false;
                times.len() as u64
            }
        }
    }

    /// Computes rows into `out` until it is full, the plan ends, a step fails or `budget` is spent.
    pub fn advance(&mut self, out: &mut [f64], budget: Duration) -> (usize, Progress) {
        let columns = self.recorder.columns();
        let begin = Instant::now();
        let mut rows = 0;
        let capacity = out.len() / columns;
        let most = if self.recorder.all_points.is_finite() { 2 } else { 1 }; // rows that one step may add
        let mut count: u64 = 0;
        while rows + most <= capacity {
            if self.recorder.first_row {
                self.recorder.first_row = false;
                self.write(self.state.time, &mut out[rows * columns..(rows + 1) * columns]);
                self.recorder.expect_last();
                rows += 1;
                if self.recorder.samples.between(self.state.time) {
                    self.recorder.note_side(&self.state, self.solver.functions(), self.state.time);
                }
                continue;
            }
            if self.schedule.retry.is_none() && known(&self.waveforms) <= self.state.time {
                return (rows, Progress::Waiting);
            }
            let Some(target) =
                self.schedule.retry.take().or_else(|| self.schedule.plan.next(&self.waveforms))
            else {
                return (rows, Progress::Done);
            };
            if self.recorder.logged_epoch == 0 {
                self.log_events(); // what the start has found is no event
                self.recorder.events.clear();
            }
            let target = match self.step(&target) {
                Ok(None) => target,
                Ok(Some(impact)) => {
                    let length = target.time - impact.time;
                    self.schedule.retry = (length > 0.0).then_some(Target { length, ..target });
                    impact
                }
                Err(failure) => {
                    // back to the state before, so that the step can be taken again
                    self.state.z.copy_from_slice(&self.solver.scratch.z_before);
                    self.state.l.copy_from_slice(&self.solver.scratch.l_before);
                    self.solver.forget_functions();
                    self.failure = Some(*failure);
                    self.schedule.retry = Some(target);
                    return (rows, Progress::Failed);
                }
            };
            if self.recorder.logged_epoch != self.state.epoch {
                self.log_events();
            }
            if self.recorder.two_sided {
                rows += self.note_sides(&target, &mut out[rows * columns..]);
            }
            if target.row || target.time >= self.recorder.all_points {
                self.write(target.label, &mut out[rows * columns..(rows + 1) * columns]);
                self.recorder.expect_last();
                rows += 1;
            }
            if self.recorder.samples.between(target.time) && !self.recorder.two_sided {
                self.recorder.note_side(&self.state, self.solver.functions(), target.label);
            }
            count += 1;
            let pause = count.is_multiple_of(LOOK) && begin.elapsed() > budget;
            if pause || self.recorder.samples.full() {
                break;
            }
        }
        (rows, Progress::More)
    }

    /// The row before a jump goes before its row of the table, else both go to the side rows;
    /// returns the number of rows added to the table.
    fn note_sides(&mut self, target: &Target, out: &mut [f64]) -> usize {
        let recorder = &mut self.recorder;
        if recorder.all_points.is_finite() {
            if target.time < recorder.all_points {
                return 0;
            }
            out[..recorder.left.len()].copy_from_slice(&recorder.left);
            recorder.expected.take(&recorder.left);
            return 1;
        }
        recorder.samples.sides.extend_from_slice(&recorder.left);
        recorder.note_side(&self.state, self.solver.functions(), target.label);
        0
    }

    /// Writes the row of the present state.
    pub(in crate::integrate) fn write(&mut self, label: f64, row: &mut [f64]) {
        self.recorder.write(&self.state, self.solver.functions(), label, row);
    }

    /// Writes the outputs at the present time, which comes first.
    pub fn at_wait(&mut self, row: &mut [f64]) {
        self.write(self.state.time, row);
    }

    /// Keeps the row before a possible jump.
    pub(in crate::integrate) fn write_left(&mut self, label: f64) {
        self.recorder.write_left(&self.state, self.solver.functions(), label);
    }

    /// Notes which pairs have changed since the last time.
    pub(in crate::integrate) fn log_events(&mut self) {
        self.recorder.log_events(&self.state, &mut self.solver.stats);
    }
}

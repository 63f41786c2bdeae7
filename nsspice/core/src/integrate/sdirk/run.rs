//! The loop: steps, rows, breakpoints and events, resumable.

use super::controller::energies::{Energies, Point};
use super::controller::errors::back;
use super::controller::node_errors::Nodes;
use super::controller::stage_equations::StageEquations;
use super::controller::step_matrices::LEVELS;
use super::counters::Counters;
use super::dense_output::interpolation::Between;
use super::dense_output::limits::PointRows;
use super::dense_output::stored_outputs::StoredRows;
use super::events::across_kinks::{Passage, Patience};
use super::events::fallback::{Fallback, FALLBACK_LEVEL};
use super::events::guards::{Scales, VIOLATED};
use super::events::locate::Locator;
use super::records::{Control, Settings, Shown, Trouble};
use super::samples::{no_length, Samples};
use super::step::Trial;
use super::visited::Visited;
use super::{Accuracy, Tableau};
use crate::audit::Taken;
use crate::integrate::implicit::events::impacts::REST;
use crate::integrate::implicit::failure::Failure;
use crate::integrate::implicit::stepper::{Progress, Stepper};
use crate::integrate::implicit::time_grid::{evaluate, known, next_breakpoint};
use crate::row_clock::RowClock;
use crate::sampling::Sampling;
use crate::tolerances::ACCEPT;
use crate::waveform::{Side, INSTANT};
use std::time::{Duration, Instant};

/// Residual at which the iteration of a stage may end, as a part of the tolerance.
const STAGE_ACCURACY: f64 = 1e-6;
/// First level of a run with error control.
const FIRST_LEVEL: usize = 12;
/// Longest time between two looks of switches that chatter, as a part of the run: at some ten microseconds for
/// each restart all take seconds.
const INTERVAL: f64 = 2e-5;
/// An event this early in a step (as a part of it), where the mode does not end, is looked for again
/// with a shorter step.
const EARLY: f64 = 0.05;
/// Steps between two looks at the clock, and between two checks of the residual.
pub(super) const LOOK: u64 = 16;

/// Why a step ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum End {
    Plain,
    Breakpoint {
        /// nothing can jump there
        calm: bool,
    },
    Event,
    /// switches that are sampled look at their controls
    Look,
}

/// An accepted step whose rows are being written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Accepted {
    pub theta: f64,
    pub time: f64,
    end: End,
}

/// The controller of one run; the state is the stepper's.
pub struct Sdirk {
    /// what is asked of a run
    pub(super) settings: Settings,
    /// rows and records of the steps
    pub(super) shown: Shown,
    /// what decides about lengths of steps
    pub control: Control,
    /// what keeps a run from going on as usual: events that accumulate, switches that find no state
    pub(super) trouble: Trouble,
    /// that of the present step
    pub(super) tableau: &'static Tableau,
    /// the modes of steps
    pub visited: Visited,
    pub(super) stage_equations: StageEquations,
    pub(super) scales: Scales,
    /// errors as energies, where they are asked for
    pub(super) energies: Option<Box<Energies>>,
    /// else errors at nodes, where voltages along a tree are the unknowns
    pub(super) nodes: Option<Nodes>,
    pub(super) trial: Trial,
    pub(super) accepted: Option<Accepted>,
    pub(super) begun: bool,
    /// the next breakpoint of a source, and whether something may jump there
    pub(super) breakpoint: (f64, bool),
    /// of each source, whether something may jump where its slope does
    kinks: Vec<bool>,
    /// this step does not continue another one
    pub(super) fresh: bool,
    /// counters
    pub counters: Counters,
}

impl Sdirk {
    /// Plans a run from the present time of `s` to `stop` with steps of at most `longest`, rows at
    /// `out_start + k out_step` and at `stop`.
    pub fn new(
        s: &mut Stepper,
        method: &'static Tableau,
        accuracy: Accuracy,
        stop: f64,
        longest: f64,
        (out_start, out_step): (f64, f64),
    ) -> Sdirk {
        let pace = s.waveforms.iter().map(|w| w.pace()).fold(f64::INFINITY, f64::min);
        let fixed = accuracy.relative >= 1.0;
        let longest = if fixed { longest } else { longest.min(pace) };
        if let (Some(smooth), false) = (&mut s.solver.smooth, fixed) {
            let accuracy = STAGE_ACCURACY * accuracy.relative;
            smooth.newton.set_accuracy(fault!("stage_iteration", accuracy, 1e-2));
        }
        s.schedule.step_length = longest;
        s.schedule.sweeping = false;
        let energies = accuracy.energy.then(|| Energies::new(s)).flatten().map(Box::new);
        Sdirk {
            settings: Settings { method, accuracy, start: s.state.time, stop },
            shown: Shown {
                rows: RowClock::new(out_start, out_step, stop),
                points: PointRows::default(),
                samples: Samples::default(),
                origin: None,
                stored: StoredRows::new(s),
                between: Between::new(s),
            },
            control: Control {
                level: if fixed { 0 } else { FIRST_LEVEL },
                last_error: (longest, 0.0),
                erring: 0,
                tied: vec![false; s.state.z.len()],
                unbounded: None,
                patience: Patience::default(),
            },
            trouble: Trouble {
                futile: false,
                troubled: f64::NEG_INFINITY,
                rests: (f64::NEG_INFINITY, 0),
                restless: None,
                fallback: Fallback::new(),
                sampling: Sampling::new(
                    s.switching.count(),
                    longest.min(INTERVAL * (stop - s.state.time)),
                ),
            },
            tableau: method.next(false),
            visited: Visited::default(),
            stage_equations: StageEquations::new(s, longest, method.gamma),
            scales: Scales::new(s),
            nodes: if energies.is_some() { None } else { Nodes::new(s) },
            energies,
            trial: Trial::new(s, method),
            accepted: None,
            begun: false,
            breakpoint: (f64::NEG_INFINITY, false),
            kinks: s.facts.kinks.clone(),
            fresh: true,
            counters: Counters::default(),
        }
    }

    /// Number of rows in all.
    pub fn row_count(&self) -> u64 {
        self.shown.rows.count()
    }

    /// Modes met at the busiest step length.
    pub fn mode_count(&self) -> usize {
        self.stage_equations.levels.mode_count()
    }

    /// See [`Sampling::chattering`].
    pub fn chattering(&self, s: &Stepper) -> (Vec<(usize, u64, f64)>, f64) {
        self.trouble.sampling.chattering(&s.switching.switches, |k| self.scales.of_control(s, k))
    }

    /// The steps recorded since the last call.
    pub fn take_intervals(&mut self) -> Taken {
        self.shown.samples.take(self.tableau, ACCEPT)
    }

    /// Numbers that wait to be taken.
    pub fn waiting(&self) -> usize {
        self.shown.samples.taken.size()
    }

    /// As `Stepper::advance`.
    pub fn advance(
        &mut self,
        s: &mut Stepper,
        out: &mut [f64],
        budget: Duration,
    ) -> (usize, Progress) {
        let columns = s.recorder.columns();
        let begin = Instant::now();
        let capacity = out.len() / columns;
        let mut rows = 0;
        let mut count = 0u64;
        if !self.begun {
            self.begun = true;
            s.switching.still.fill(false);
            s.log_events(); // what the start has found is no event
            s.recorder.events.clear();
            self.begin_anew(s);
        }
        while rows < capacity {
            let row = &mut out[rows * columns..(rows + 1) * columns];
            if self.shown.points.next(row) {
                s.recorder.expected.take(row);
                rows += 1;
                continue;
            }
            if let Some(accepted) = self.accepted {
                rows += self.write_inside(s, accepted.time, &mut out[rows * columns..]);
                if rows == capacity {
                    break;
                }
                // what a source does at the end of the step is a part of that end: it has to be known
                if accepted.time < self.settings.stop && known(&s.waveforms) <= accepted.time {
                    return (rows, Progress::Waiting);
                }
                self.keep_pieces(s, accepted.time);
                self.accepted = None;
                self.finish(s, accepted);
                self.show_point(s);
                continue;
            }
            if self.shown.rows.time() <= s.state.time + self.at_once(s.state.time) {
                s.write(self.shown.rows.time(), row);
                s.recorder.expect_last();
                self.shown.rows.advance();
                rows += 1;
                continue;
            }
            if s.state.time >= self.settings.stop {
                return (rows, Progress::Done);
            }
            // another block has to go on first, or a controller
            if known(&s.waveforms) <= s.state.time {
                return (rows, Progress::Waiting);
            }
            if let Err(failure) = self.step(s) {
                self.visited.note(&s.state.active, s.state.time);
                s.failure = Some(*failure);
                return (rows, Progress::Failed);
            }
            if self.accepted.is_none() {
                self.show_point(s); // a forced step is accepted immediately
            }
            count += 1;
            let full = self.shown.samples.full() || s.recorder.samples.full();
            if full || count.is_multiple_of(LOOK) && begin.elapsed() > budget {
                break;
            }
        }
        let written = self.accepted.is_none() && self.shown.rows.peek().is_none();
        let done = rows == capacity && written && self.shown.points.is_empty();
        (rows, if done { Progress::Done } else { Progress::More })
    }

    /// Writes the outputs where the run waits, before what happens there; the time comes first.
    pub fn at_wait(&mut self, s: &mut Stepper, row: &mut [f64]) {
        match self.accepted {
            Some(accepted) => {
                self.write_at(s, accepted.time, row);
            }
            None => s.at_wait(row),
        }
    }

    /// A row this near to the end of a step belongs to it: the breakpoint of a source and the multiple of the
    /// row distance that are one instant differ by rounding.
    pub(super) fn at_once(&self, time: f64) -> f64 {
        1e-12 * self.trial.length + 2.0 * f64::EPSILON * time
    }

    /// Remembers the state from which the next step starts; its functions may be `known`.
    pub(super) fn begin_step(&mut self, s: &mut Stepper, known: bool) {
        (self.shown.origin, self.fresh) = (None, !known);
        if !known {
            self.stage_equations.deepest = LEVELS - 1;
        }
        let (n, m) = (s.state.z.len(), s.state.l.len());
        self.scales.note(s, &s.state.z, &s.state.l, !known);
        s.gates().see_controls();
        self.note_controls(s);
        self.trial.start = s.state.time;
        self.trial.unsolved = 0;
        let (z, guards) = self.trial.first.split_at_mut(n);
        let (guards, f) = guards.split_at_mut(m);
        match &mut s.solver.smooth {
            Some(smooth) if known => f.copy_from_slice(&smooth.f),
            Some(smooth) => smooth.newton.evaluate(&s.state.z, &s.state.u0, s.state.time, f),
            None => {}
        }
        z.copy_from_slice(&s.state.z);
        if let Some(energies) = &mut self.energies {
            energies.note(Point { z, f }, s.state.time);
        }
        s.solver.sys.linear.slacks(&s.state.z, &s.state.l, &mut s.solver.scratch.w);
        for (i, guard) in guards.iter_mut().enumerate() {
            *guard = if s.state.active[i] { s.state.l[i] } else { s.solver.scratch.w[i] };
        }
        self.stage_equations.begin(&s.state.active, &self.scales);
        if self.breakpoint.0 <= s.state.time {
            self.breakpoint = next_breakpoint(&s.waveforms, &self.kinks, s.state.time);
        }
        self.trial.breakpoint = self.breakpoint.0;
    }

    /// Rows at the end of a step that has been finished, where they are wanted.
    pub(super) fn show_point(&mut self, s: &mut Stepper) {
        let next = self.shown.rows.time();
        let row = ((next - s.state.time).abs() <= 1e-9 * self.trial.length).then_some(next);
        self.shown.points.note_right(s, row);
    }

    /// Where the next step ends at the latest [s], and how.
    pub(super) fn target(&self) -> (f64, End) {
        let (breakpoint, jump) = self.breakpoint;
        let plain = if breakpoint <= self.settings.stop {
            (breakpoint, End::Breakpoint { calm: !jump })
        } else {
            (self.settings.stop, End::Plain)
        };
        if self.trouble.sampling.next < plain.0 {
            (self.trouble.sampling.next, End::Look)
        } else {
            plain
        }
    }

    /// Finds the next accepted step, its length and how it ends.
    fn step(&mut self, s: &mut Stepper) -> Result<(), Box<Failure>> {
        if let Some(failure) = self.trouble.restless.take() {
            return Err(failure);
        }
        let fixed = self.settings.accuracy.relative >= 1.0;
        let (target, at_target) = self.target();
        let remaining = target - s.state.time;
        loop {
            let crowded = self.trouble.fallback.is_crowded(s.state.time);
            if crowded && self.sample(s) {
                return self.step(s);
            }
            if crowded || self.control.level >= self.stage_equations.deepest {
                return self.force(s);
            }
            let mut level = self.control.level;
            while level + 1 < self.stage_equations.deepest
                && self.stage_equations.length(level + 1) >= remaining * (1.0 - 1e-9)
            {
                level += 1;
            }
            let (stage_equations, tableau) = (&mut self.stage_equations, self.tableau);
            if let Err(broken) = self.trial.compute(s, stage_equations, tableau, level) {
                if std::mem::take(&mut self.stage_equations.hidden) && level > 0 {
                    self.control.level = level - 1;
                    continue;
                }
                self.control.level = level + if broken.at < 0.5 { 2 } else { 1 };
                self.trial.unsolved += 1;
                // a law that jumps against the motion has no solution near the jump, at any length
                if self.is_stuck(s.state.time) {
                    return self.force(s);
                }
                continue;
            }
            if self.turn_at_rest(s) {
                return self.step(s);
            }
            let whole = self.trial.length <= remaining * (1.0 + 1e-9);
            let to_target = self.trial.length >= remaining * (1.0 - 1e-9);
            let error = if fixed { 0.0 } else { self.error(s) };
            #[cfg(feature = "faults")]
            let error = fault!("estimate_1000th", error, error / 1000.0);
            #[cfg(feature = "faults")]
            let error = fault!("estimate_30th", error, error / 30.0);
            if error > 1.0 || error.is_nan() {
                self.counters.rejected += 1;
                self.control.level = level + back(error, self.tableau.error_order);
                // nor has a junction whose last charge is torn out by a winding: its voltage has no bound
                if self.is_stuck(s.state.time) {
                    self.control.unbounded.get_or_insert((self.control.erring, s.state.time));
                    return self.force(s);
                }
                continue;
            }
            let limit = if whole { 1.0 } else { remaining / self.trial.length };
            let (stage_equations, scales) = (&mut self.stage_equations, &self.scales);
            let trial = &mut self.trial;
            let mut locator = Locator { s, stage_equations, scales, tableau, trial };
            let found = locator.violation(limit);
            let passage = found.map(|(_, depth)| self.pass(s, level, depth));
            let (passed, error) = match passage {
                Some(Passage::Open(error)) => (true, error),
                _ => (false, error),
            };
            if let Some(Passage::Narrow(shorter)) = passage {
                self.counters.rejected += 1;
                self.control.level = level + shorter;
                continue;
            }
            if let (Some((high, _)), false) = (found, passed) {
                let (stage_equations, scales) = (&mut self.stage_equations, &self.scales);
                let trial = &mut self.trial;
                let mut locator = Locator { s, stage_equations, scales, tableau, trial };
                let theta = locator.end_of_mode(high);
                let theta = locator.arrival(theta).unwrap_or(theta);
                // the continuous solution of a first step begins where it does to the tolerance only, which
                // would decide how long what chatters stays in either mode, or that it ends immediately
                let early = tableau.looks_back() && theta < EARLY && !fixed;
                if early && (theta >= REST || locator.margin(theta) < -VIOLATED) {
                    self.control.level = level + 3;
                    continue;
                }
                let little = self.stage_equations.length(FALLBACK_LEVEL);
                self.trouble.fallback.note_event(s.state.time + theta * self.trial.length, little);
                self.trouble.troubled = s.state.time;
                if self.trouble.futile && theta < EARLY {
                    // the mode did not end here: look closer
                    self.control.level = level + 3;
                    continue;
                }
                self.counters.located += 1;
                self.accepted = Some(self.at_event(s, theta, (target, at_target)));
            } else if let Some(theta) = if passed { None } else { self.arrives(s, limit) } {
                self.counters.located += 1;
                self.accepted = Some(self.at_event(s, theta, (target, at_target)));
            } else {
                let (time, end) = if to_target {
                    (target, at_target)
                } else {
                    let length = self.trial.length;
                    (self.shown.rows.meet(s.state.time + length, length), End::Plain)
                };
                self.accepted = Some(Accepted { theta: limit, time, end });
                let clear = self.stage_equations.length(FALLBACK_LEVEL);
                if whole && (time > self.trouble.troubled + clear || passed) {
                    self.trouble.fallback.note_progress();
                    self.trouble.sampling.forget();
                    self.trouble.futile = false;
                }
                // room to grow: the next longer step would do, with a margin
                if !fixed && level <= self.control.level {
                    let q = self.tableau.error_order;
                    let grown = self.trend(error) * 2.0f64.powi(q);
                    let up = usize::from(grown < 0.5) + usize::from(grown * 2.0f64.powi(q) < 0.2);
                    self.control.level = self.grown(level, up, time);
                }
            }
            if fixed {
                self.control.level = self.control.level.saturating_sub(1);
            }
            s.solver.stats.steps += 1;
            s.solver.stats.undetermined +=
                u64::from(std::mem::take(&mut self.stage_equations.open));
            self.counters.matrices = self.stage_equations.levels.made;
            self.certify(s);
            self.visited.note(&s.state.active, s.state.time);
            return Ok(());
        }
    }

    /// A step that ends with a mode.  Within the rounding of instants a jump of a source comes first: what turns there
    /// has not been searched for.
    fn at_event(&self, s: &Stepper, theta: f64, (target, at_target): (f64, End)) -> Accepted {
        let time = (s.state.time + theta * self.trial.length).min(target);
        match at_target {
            End::Breakpoint { calm: false } if target - time <= INSTANT * target => {
                Accepted { theta, time: target, end: at_target }
            }
            _ => Accepted { theta, time, end: End::Event },
        }
    }

    /// Moves the state to the end of the accepted step.
    fn finish(&mut self, s: &mut Stepper, accepted: Accepted) {
        let (n, m) = (s.state.z.len(), s.state.l.len());
        let Trial { start, length, .. } = self.trial;
        let chosen = self.shown.samples.chooses(s, start, accepted.time, length);
        let erring = chosen && self.finds_errors(s);
        if erring {
            self.take_nodes(s, accepted.theta);
        }
        if accepted.theta == 1.0 {
            self.trial.take_end(self.tableau);
        } else {
            self.trial.evaluate(s, &mut self.stage_equations, self.tableau, accepted.theta);
            if self.trial.crossing {
                self.trial.mode.clone_from(&self.stage_equations.met);
            }
        }
        if erring {
            self.find_errors(s, accepted.theta);
        }
        let event = accepted.end == End::Event;
        let (trial, stage_equations, tableau) = (&self.trial, &self.stage_equations, self.tableau);
        if chosen {
            let (theta, end) = (accepted.theta, accepted.time);
            self.shown.samples.step(s, trial, stage_equations, tableau, theta, end);
        }
        self.shown.samples.sum_up(s, trial, stage_equations, tableau, accepted.theta);
        // a mode that ends where it begins has not been: its values may obey no sign, and are not shown
        let empty = event && no_length(self.trial.start, accepted.time, self.trial.length);
        if empty {
            s.state.u1.copy_from_slice(&self.trial.at.u);
            self.shown.points.note_left(s);
        }
        let trial = &self.trial;
        let (z, guards) = trial.at.x.split_at(n);
        s.state.z.copy_from_slice(z);
        let pairs = guards.iter().zip(s.state.active.iter().zip(&s.state.roles));
        for (i, (l, (&g, (&active, &role)))) in s.state.l.iter_mut().zip(pairs).enumerate() {
            *l = stage_equations.resistances.multiplier(i, g, active, role, trial.open());
        }
        if s.recorder.outputs.needs_rates() {
            s.recorder.rates.copy_from_slice(&self.trial.at.slope[..n]);
        }
        s.state.time = accepted.time;
        let turned = self.look(s);
        s.solver.scratch.smooth_time = s.state.time;
        s.solver.forget_functions();
        if let Some(smooth) = &mut s.solver.smooth {
            smooth.f.copy_from_slice(&self.trial.at.x[n + m..]);
            smooth.rates.copy_from_slice(&self.trial.at.slope[n..]);
        }
        // where the slope of a source jumps and nothing else can, the step goes on
        let calm = accepted.end == (End::Breakpoint { calm: true });
        if calm {
            evaluate(&s.waveforms, s.state.time, Side::Right, &mut s.state.u0);
        }
        let goes_on = match accepted.end {
            End::Plain | End::Look => true,
            End::Breakpoint { calm } => calm && !s.gates().sources_turn(),
            End::Event => false,
        };
        let plain = goes_on && turned.is_empty();
        if !empty && !plain {
            self.scales.note(s, &s.state.z, &s.state.l, false); // after a plain end the next step does
        }
        if self.trial.crossing {
            self.enter_mode(s);
        }
        let continued = plain && self.resolves_rates();
        if continued && self.settings.method.continues() {
            self.trial.continue_rates();
        }
        if plain && !calm {
            s.state.u0.copy_from_slice(&self.trial.at.u);
        } else if !plain {
            s.state.u1.copy_from_slice(&self.trial.at.u);
            self.shown.points.note_left(s);
            evaluate(&s.waveforms, s.state.time, Side::Right, &mut s.state.u0);
            let before = s.state.active.clone();
            s.instants.begun = None;
            // asked before anything turns: controls are those of the mode in which the step has ended
            let reached = if event { self.reach(s, accepted.theta) } else { Vec::new() };
            turned.iter().for_each(|&k| s.gates().throw(k));
            reached.into_iter().for_each(|k| s.gates().turn(k, true));
            self.restart(s);
            self.trouble.futile = event && before == s.state.active;
        }
        if s.solver.smooth.is_some() {
            self.trial.leave(self.tableau, accepted.theta, plain && !calm);
        }
        if plain {
            self.tableau = self.settings.method.next(continued);
            self.begin_step(s, true);
        } else {
            self.begin_anew(s);
        }
    }
}

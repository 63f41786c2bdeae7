//! Steps over the end of a mode that need not be located.
//!
//! Where a diode with resistances begins or ceases to conduct, the rates of what is stored have a kink
//! and no more.  In a step over it each stage takes the mode that its laws ask for, and the embedded
//! formula sees the kink as it sees any other lack of smoothness: where the error that it estimates is
//! allowed, an instant of the change has no meaning within the tolerance.  Where rates jump, or where
//! the kink counts, the estimate says so, and the end of the mode is located.

use crate::integrate::implicit::recorder::MAX_EVENTS;
use crate::integrate::implicit::stepper::Stepper;
use crate::integrate::sdirk::controller::stage_equations::Fit;
use crate::integrate::sdirk::run::Sdirk;

/// A step over the end of a mode may have this part of the error of another: for a kink the estimate
/// is of the size of the error, but may miss a part of it, and errors over many kinks add up.
const SHARE: f64 = 0.0625;
/// With an error up to here steps over the end of a mode are taken shorter; the error over a kink of one
/// half as long is a quarter.
const NARROWED: f64 = 4.0;
/// Smaller parts of the tolerance are no error at all.
pub(in crate::integrate::sdirk) const NOTICED: f64 = 1e-3;
/// After failures so many ends of modes at most are located without a trial.
const MOST: u32 = 16;
/// So many trials of steps over ends of modes within this part of the longest step lead nowhere: where a
/// conflict is still below the tolerance, two modes take turns.
const TURNS: u32 = 64;
/// See [`TURNS`]: with two decades more no event of the tests is found elsewhere.
const NOWHERE: f64 = 1e-6;

/// The instant at which a guard vanished in such a step, which appears only in the list of events, is wanted to this
/// part of the step.
pub(in crate::integrate::sdirk) const CLOSE: f64 = 1e-6;
/// Evaluations spent on it: every other one halves the bracket, from the whole step down to [`CLOSE`].
const LOOKS: usize = 40;

/// Whether a step may go on over the end of a mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::integrate::sdirk) enum Passage {
    /// with this error
    Open(f64),
    /// one so many levels shorter may
    Narrow(usize),
    /// the end has to be located; the step is as it was
    Closed,
}

/// How many ends of modes are located before a step over one is tried again.
#[derive(Clone, Copy, Debug, Default)]
pub struct Patience {
    wait: u32,
    left: u32,
    /// when the trials began that are so near to each other, and their number
    since: f64,
    turns: u32,
}

impl Patience {
    /// Whether a step over the end of a mode at this time leads on.
    fn leads_on(&mut self, time: f64, longest: f64) -> bool {
        if time - self.since > NOWHERE * longest {
            (self.since, self.turns) = (time, 0);
        }
        self.turns += 1;
        self.turns <= TURNS
    }

    /// Whether the next one is to be tried.
    fn tries(&mut self) -> bool {
        let tries = self.left == 0;
        self.left = self.left.saturating_sub(1);
        tries
    }

    fn note(&mut self, passed: bool) {
        self.wait = if passed { 0 } else { (2 * self.wait + 1).min(MOST) };
        self.left = self.wait;
    }
}

impl Sdirk {
    /// Tries the step at `level`, in which the mode ends by a guard this negative, as one from mode to
    /// mode.  After a change of mode it is always tried: what such a step says of the instant at which the
    /// next pair changes is of low order, and diodes often change one right after the other.
    pub(in crate::integrate::sdirk) fn pass(
        &mut self,
        s: &mut Stepper,
        level: usize,
        depth: f64,
    ) -> Passage {
        let first = self.tableau.looks_back();
        // a thyristor that has stopped conducting does not begin again, regardless of its signs
        let latched = (0..s.switching.count()).any(|k| s.switching.latched(k));
        if self.settings.accuracy.relative >= 1.0
            || latched
            || !(first || self.control.patience.tries())
            || !self.control.patience.leads_on(s.state.time, self.stage_equations.longest)
        {
            return Passage::Closed;
        }
        let tableau = self.tableau;
        let tied = self.control.tied.clone();
        self.trial.crossing = true;
        let solved = self.trial.compute(s, &mut self.stage_equations, tableau, level).is_ok();
        let scales = &self.scales;
        let turns = |s: &Stepper, stages: &[Vec<f64>]| {
            stages.iter().any(|x| scales.switches_turn(s, &x[..s.state.z.len()]))
        };
        // no stage in another mode: the guard dips below zero between them
        let shows = self.trial.crossed || depth <= SHARE * self.settings.accuracy.relative;
        // a control that the new mode holds at its threshold has come there when the old one ended
        let sound = solved && shows && !turns(s, &self.trial.stages.ends) && !self.comes_to_rest(s);
        let error = if sound { self.error(s) } else { f64::INFINITY };
        // what is a rate in one mode and fixed by the laws in the other has no kink but a jump
        let error = if self.control.tied == tied { error } else { f64::INFINITY };
        let near = error <= NARROWED;
        if !first {
            self.control.patience.note(near);
        }
        if error <= SHARE {
            self.counters.passed += 1;
            return Passage::Open(error);
        }
        self.trial.crossing = false;
        if near {
            return Passage::Narrow((0.5 * (error / SHARE).log2()).ceil() as usize);
        }
        // what was solved before is solved again
        let _ = self.trial.compute(s, &mut self.stage_equations, tableau, level);
        Passage::Closed
    }

    /// Takes the mode at the end of a step from mode to mode, and notes when its pairs changed.
    pub(in crate::integrate::sdirk) fn enter_mode(&mut self, s: &mut Stepper) {
        let changed = |i: &usize| s.state.active[*i] != self.trial.mode[*i];
        let changed: Vec<usize> = (0..s.state.active.len()).filter(changed).collect();
        if !changed.is_empty() {
            let mut changes: Vec<_> = self.instants(s, &changed);
            changes.sort_by(|a, b| a.0.total_cmp(&b.0));
            s.state.active.copy_from_slice(&self.trial.mode);
            s.state.epoch += 1;
            s.solver.stats.mode_changes += 1;
            s.solver.stats.events += changes.len() as u64;
            let room = MAX_EVENTS.saturating_sub(s.recorder.events.len());
            s.recorder.events.extend(changes.into_iter().take(room));
            s.recorder.logged.copy_from_slice(&s.state.active);
            s.recorder.logged_epoch = s.state.epoch;
        }
        self.trial.crossing = false;
    }

    /// When the guards of some pairs vanished in the step, the pairs, and the mode in which they are at its end.
    fn instants(&mut self, s: &mut Stepper, changed: &[usize]) -> Vec<(f64, usize, bool)> {
        let around: Vec<_> = changed.iter().map(|&i| self.around(s, i)).collect();
        let kept = self.trial.at.clone();
        let (mode, open) = (self.trial.mode.clone(), self.stage_equations.open);
        let found = changed.iter().zip(around).map(|(&i, bracket)| {
            // Newton's method would have to start again at each point
            let part =
                if s.solver.smooth.is_some() { on_line(bracket) } else { self.root(s, i, bracket) };
            ((self.trial.start + part * self.trial.length).min(s.state.time), i, mode[i])
        });
        let found = found.collect();
        self.trial.at = kept;
        self.stage_equations.open = open;
        found
    }

    /// Two points of the step between which the guard of a pair vanished: their places, and the guards there.
    fn around(&self, s: &Stepper, i: usize) -> [(f64, f64); 2] {
        let (trial, tableau, guard) = (&self.trial, self.tableau, s.state.z.len() + i);
        let mut points: Vec<(f64, f64)> = vec![(0.0, trial.first[guard].max(0.0))];
        let stages = tableau.first()..tableau.stages();
        points.extend(stages.map(|k| (tableau.c[k], trial.stages.ends[k][guard])));
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let around = points.windows(2).find(|w| w[0].1 >= 0.0 && w[1].1 < 0.0);
        around.map_or([(1.0, 1.0), (1.0, -1.0)], |w| [w[0], w[1]])
    }

    /// Where the guard of a pair vanishes between two points, by the continuous solution: secants (Illinois), and
    /// halves where one has not halved the bracket: on both sides of zero the guard has different units.
    fn root(&mut self, s: &mut Stepper, i: usize, bracket: [(f64, f64); 2]) -> f64 {
        let [mut before, mut beyond] = bracket;
        let mut width = f64::INFINITY;
        for _ in 0..LOOKS {
            let slow = beyond.0 - before.0 > 0.5 * width;
            width = beyond.0 - before.0;
            let secant = on_line([before, beyond]);
            let inside = secant > before.0 && secant < beyond.0 && !slow;
            let theta = if inside { secant } else { 0.5 * (before.0 + beyond.0) };
            if width <= CLOSE {
                break;
            }
            let (stage_equations, tableau) = (&mut self.stage_equations, self.tableau);
            if self.trial.evaluate(s, stage_equations, tableau, theta) == Fit::Contradiction {
                break;
            }
            let guard = self.trial.at.x[s.state.z.len() + i];
            if self.scales.at_zero(i, s.state.active[i], guard) {
                return theta;
            }
            if guard > 0.0 {
                before = (theta, guard);
                beyond.1 *= 0.5;
            } else {
                beyond = (theta, guard);
                before.1 *= 0.5;
            }
        }
        on_line([before, beyond])
    }
}

/// Where a line through two points vanishes.
fn on_line([before, beyond]: [(f64, f64); 2]) -> f64 {
    before.0 + (beyond.0 - before.0) * before.1 / (before.1 - beyond.1)
}

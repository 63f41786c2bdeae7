//! Impacts inside a step: a gap closes at speed, and the speed has to jump.
//!
//! In passive networks the states jump only where sources or switches do: what a pair sees of the
//! network is positive real, and behaves like `s`, 1 or `1/s` at high frequencies.  Controlled sources
//! can put more integrations between a pair and its own condition (force, speed, gap): it then
//! closes while what it stops still moves.  An ordinary step would spread the impact over its length
//! and the next one.  So a step in which such a pair changes is cut where it does: the reinitialising step
//! follows there, and if anything jumps, the rest of the step goes on from where it led.

use crate::integrate::implicit::instants::jumps::{StateJump, IMPACT};
use crate::integrate::implicit::instants::state_jumps::StateJumps;
use crate::integrate::implicit::step_length::{Stage, System};
use crate::integrate::implicit::stepper::Stepper;
use crate::integrate::implicit::time_grid::{evaluate_after, Target};
use crate::mlcp::{Role, Start};

/// Modes in which a pair is looked at before it counts as harmless.
const LOOKS: u8 = 4;
/// Lengths, relative to the shortest time, at which the response of a pair is compared.
const LENGTHS: [f64; 2] = [1e-4, 2e-4];
/// Power of the length beyond which a response is that of an impact: between 1, a store, and 2.
const POWER: f64 = 1.5;
/// Problems solved to find an instant, and the width at which the search ends.
const MOST: usize = 60;
/// See [`MOST`]: the rounding of an instant, which is a sum of two, at both ends.
const NARROW: f64 = 4.0 * f64::EPSILON;
/// A rest of a step shorter than this part of it is none, and an event earlier than that is one at its begin.
pub(in crate::integrate) const REST: f64 = 1e-9;

/// Which pairs may bring an impact.
#[derive(Clone, Debug, Default)]
pub struct Impacts {
    /// false for passive networks
    pub active: bool,
    /// looked for: there are no smooth functions
    possible: bool,
    /// how often each pair was found harmless
    harmless: Vec<u8>,
    /// conducting pairs at the begin of the step
    before: Vec<bool>,
}

impl Impacts {
    /// Looks at a system.
    pub fn new(sys: &System, diodes: bool) -> Impacts {
        let active = diodes && !passive(sys);
        let possible = active && sys.smooth.is_none();
        let m = if possible { sys.linear.a.ncols } else { 0 };
        Impacts { active, possible, harmless: vec![0; m], before: vec![false; m] }
    }

    /// Takes the mode at the begin of a step.
    pub fn begin(&mut self, active: &[bool]) {
        if self.possible {
            self.before.copy_from_slice(active);
        }
    }
}

/// Symmetric storage, and losses that dominate: a network of R, L, C, windings, gyrators and sources.  What else
/// is passive is not recognised, and costs some looks.
fn passive(sys: &System) -> bool {
    sys.dominant && sys.linear.e.iter().eq(sys.linear.e.transpose().iter())
}

/// A step that ends at an impact.
pub struct Cut {
    /// its end
    pub target: Target,
    /// the reinitialising step from there
    pub state_jump: StateJump,
}

/// Where a step began.
struct Begin {
    time: f64,
    length: f64,
    z: Vec<f64>,
    l: Vec<f64>,
}

impl Stepper {
    /// Looks for an impact in the step just taken, which changed the mode.  If there is one, the
    /// state is that of its instant, before anything jumped; else it is as it was.
    pub(in crate::integrate) fn cut_at_impact(&mut self, target: &Target) -> Option<Cut> {
        fault!("impacts_not_cut" => return None);
        if !self.instants.impacts.possible {
            return None;
        }
        let before = std::mem::take(&mut self.instants.impacts.before);
        let turned =
            self.state.diodes.iter().copied().filter(|&i| before[i] != self.state.active[i]);
        let changed: Vec<usize> = turned.collect();
        let kept = (
            self.state.z.clone(),
            self.state.l.clone(),
            self.state.active.clone(),
            self.recorder.rates.clone(),
        );
        let (begun, u1) = (
            (self.solver.scratch.z_before.clone(), self.solver.scratch.l_before.clone()),
            self.state.u1.clone(),
        );
        let begin = Begin {
            time: target.time - target.length,
            length: target.length,
            z: begun.0.clone(),
            l: begun.1.clone(),
        };
        let mut parts = Vec::new();
        for i in changed {
            if self.jumps().strikes(i, &before) {
                parts.extend(self.instant(i, before[i], &begin));
            }
        }
        // a gap that only rounding closes brings no impact, and the next one may
        parts.sort_by(f64::total_cmp);
        let cut = parts.into_iter().find_map(|part| self.cut_at(part, &before, &begin, target));
        if cut.is_none() {
            (self.state.z, self.state.l, self.recorder.rates) = (kept.0, kept.1, kept.3);
            self.state.turn_to(&kept.2);
            self.state.u1 = u1;
            self.state.time = target.time;
        }
        (self.solver.scratch.z_before, self.solver.scratch.l_before) = begun;
        self.instants.impacts.before = before;
        cut
    }

    /// Takes the part of a step that ends at an impact; None if nothing jumps there.
    fn cut_at(
        &mut self,
        part: f64,
        before: &[bool],
        begin: &Begin,
        target: &Target,
    ) -> Option<Cut> {
        let length = part * begin.length;
        let whole = begin.length - length < REST * begin.length;
        if whole && target.jump {
            return None; // a reinitialising step follows anyway
        }
        let time = if whole { target.time } else { begin.time + length };
        evaluate_after(&self.waveforms, time, begin.time, target.time, &mut self.state.u1);
        (self.state.z, self.state.l) = (begin.z.clone(), begin.l.clone());
        self.state.turn_to(before);
        self.state.time = time;
        self.solve_step(length).ok()?;
        let state = (self.state.z.clone(), self.state.l.clone(), self.recorder.rates.clone());
        let sources = std::mem::replace(&mut self.state.u0, self.state.u1.clone());
        let state_jump = self.jumps().find_state_jump(None, IMPACT, Start::Warm).ok();
        self.state.u0 = sources;
        let state_jump = state_jump
            .filter(|l| self.jumps().noticed(None, [&state.0, &l.first, &l.after], &[]))?;
        (self.state.z, self.state.l, self.recorder.rates) = state;
        let label = if whole { target.label } else { time };
        let cut = Target { time, label, length, row: whole && target.row, jump: false };
        Some(Cut { target: cut, state_jump })
    }

    /// The part of a step after which a pair changes: the last found at which it has not.
    fn instant(&mut self, i: usize, conducts: bool, begin: &Begin) -> Option<f64> {
        let (mut a, mut b) = (0.0f64, 1.0f64);
        let mut fa = self.guard(i, conducts, &begin.z, &begin.l);
        let mut fb = self.margin(i, conducts, begin, 1.0)?;
        if !(fa > 0.0 && fb < 0.0) {
            return None;
        }
        let mut side = 0;
        for _ in 0..MOST {
            if b - a <= NARROW * b.max(begin.time.abs() / begin.length) {
                break;
            }
            let secant = b - fb * (b - a) / (fb - fa);
            let c = if secant > a && secant < b { secant } else { 0.5 * (a + b) };
            let fc = self.margin(i, conducts, begin, c)?;
            if fc >= 0.0 {
                (a, fa) = (c, fc);
                if fc == 0.0 {
                    break;
                }
                if side == 1 {
                    fb *= 0.5; // Illinois
                }
                side = 1;
            } else {
                (b, fb) = (c, fc);
                if side == 2 {
                    fa *= 0.5;
                }
                side = 2;
            }
        }
        (a > 0.0).then_some(a)
    }

    /// Multiplier or slack of a pair.
    fn guard(&self, i: usize, conducts: bool, z: &[f64], l: &[f64]) -> f64 {
        if conducts {
            return l[i];
        }
        self.solver.sys.linear.slacks_of(z, l)[i]
    }

    /// Guard of a pair at the end of a part of the step, in which it is held as it was at its begin.
    fn margin(&mut self, i: usize, conducts: bool, begin: &Begin, part: f64) -> Option<f64> {
        let length = part * begin.length;
        let (time, end) = (begin.time + length, begin.time + begin.length);
        evaluate_after(&self.waveforms, time, begin.time, end, &mut self.state.u1);
        let mut stage = Stage::new(&self.solver.sys, length, false, &self.solver.constants);
        let mut rhs = vec![0.0; begin.z.len()];
        stage.matrices.right_hand_side(&begin.z, &self.state.u0, &self.state.u1, &mut rhs);
        let mut roles = self.state.roles.clone();
        roles[i] = if conducts { Role::Closed } else { Role::Open };
        let (mut z, mut l) = (begin.z.clone(), begin.l.clone());
        let start = Start::Warm;
        let q = &self.solver.sys.linear.q;
        let solved = stage.driver.solve(&rhs, q, &roles, &mut z, &mut l, start).ok()?;
        (!solved.needs_certificate).then(|| self.guard(i, conducts, &z, &l))
    }
}

impl StateJumps<'_> {
    /// Whether a pair that changes in this mode meets something that moves: its slack follows its
    /// multiplier by two integrations or more, or the reverse where it opens.
    fn strikes(&mut self, i: usize, mode: &[bool]) -> bool {
        if self.instants.impacts.harmless[i] >= LOOKS {
            return false;
        }
        let shortest = self.step_length.min(self.facts.fastest);
        let [short, long] = LENGTHS.map(|part| self.response(i, mode, part * shortest));
        let power = (long / short).abs().log2();
        let found = if mode[i] { power < -POWER } else { power > POWER };
        self.instants.impacts.harmless[i] += u8::from(!found);
        found
    }

    /// Slack of a pair per unit of its multiplier in a short step, the other pairs as in a mode.
    fn response(&mut self, i: usize, mode: &[bool], length: f64) -> f64 {
        let n = self.state.z.len();
        let mut mode = mode.to_vec();
        mode[i] = false;
        let mut stage = Stage::new(&self.solver.sys, length, true, &self.solver.constants);
        let factor = stage.factor(&mode, 1);
        if !factor.regular() {
            return f64::NAN;
        }
        let linear = &self.solver.sys.linear;
        let mut x = vec![0.0; self.solver.scratch.x.len()];
        let (rows, values) = linear.a.col(i);
        rows.iter().zip(values).for_each(|(&r, v)| x[r] -= v);
        let (pairs, values) = linear.d.col(i);
        for (&k, v) in pairs.iter().zip(values).filter(|e| mode[*e.0]) {
            x[n + k] -= v;
        }
        factor.solve(&mut x, &mut self.solver.scratch.work);
        x[n + i] = 1.0;
        let (z, l) = x.split_at(n);
        let mut w = vec![0.0; l.len()];
        linear.b.mul_add(-1.0, z, &mut w);
        linear.d.mul_add(1.0, l, &mut w);
        w[i]
    }
}

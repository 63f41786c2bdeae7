//! The stage equations of a fixed mode at each step length.

use super::guard_encoding::Resistances;
use super::step_matrices::{Levels, LEVELS};
use super::winding_ratios::Ratios;
use crate::integrate::implicit::matrices::{Ends, OPEN};
use crate::integrate::implicit::step_length::Stage;
use crate::integrate::implicit::stepper::Stepper;
use crate::integrate::sdirk::events::guards::Scales;
use crate::mlcp::{Residual, Role, Start};
use crate::rounding::OF_SOLUTION;
use crate::tolerances::ACCEPT;

/// A mode earns its affine map at this many solves.
const USES_FOR_MAP: u32 = 3;
/// A solution at most so many times as large as the point from which it was sought hides no conflict.
const ORDINARY: f64 = 2.0;
/// The step lengths `longest 2^-level` and what belongs to each.
pub struct StageEquations {
    /// longest step [s]
    pub longest: f64,
    gamma: f64,
    /// the implicit steps in use
    pub levels: Levels,
    roles: Vec<Role>,
    pub resistances: Resistances,
    /// steps of this level and below are too short for the present mode: rounding of what is stored
    /// would hide what the rest conducts
    pub deepest: usize,
    /// what the fluxes of perfectly coupled inductors have hidden in the last stage: a longer step shows it
    pub hidden: bool,
    /// ratios of the voltages of perfectly coupled inductors
    ratios: Ratios,
    /// unknowns that carry storage
    pub stored: Vec<usize>,
    /// the mode in which the last complementarity problem was solved
    pub met: Vec<bool>,
    /// the mode of a stage since the last step has left something open
    pub open: bool,
    candidate: Candidate,
}

/// A point that may be the solution of a stage.
struct Candidate {
    x: Vec<f64>,
    /// its mode
    active: Vec<bool>,
    /// what signs are known to there
    noise: Vec<f64>,
}

/// The implicit step that a stage is.
#[derive(Clone, Copy)]
pub struct StageProblem<'a> {
    /// which length
    pub level: usize,
    /// its end [s]
    pub t: f64,
    /// unknowns and functions with which it begins
    pub from: &'a [f64],
    /// sources at its end
    pub u: &'a [f64],
    /// the point to begin with, or to stay close to where the mode leaves something open
    pub near: &'a [f64],
    /// of a step, whose curve must not know of what comes after the end of the mode
    pub keeps: bool,
}

/// How the equations of a mode came out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fit {
    /// solved
    Solved,
    /// the mode leaves something open: solved as a complementarity problem, maybe in another one
    Open,
    /// the laws of this mode contradict each other here
    Contradiction,
}

impl StageEquations {
    /// Steps of at most `longest`.
    pub fn new(s: &Stepper, longest: f64, gamma: f64) -> StageEquations {
        let size = s.state.z.len() + s.state.l.len();
        let e = &s.solver.sys.linear.e;
        let mut stored: Vec<usize> =
            (0..e.ncols).filter(|&j| e.col(j).1.iter().any(|&v| v != 0.0)).collect();
        if let Some(smooth) = &s.solver.smooth {
            stored.extend(smooth.newton.stored_unknowns());
            stored.sort_unstable();
            stored.dedup();
        }
        StageEquations {
            longest,
            gamma,
            levels: Levels::new(size),
            roles: Vec::new(),
            resistances: Resistances::new(s.state.l.len()),
            deepest: LEVELS - 1,
            hidden: false,
            ratios: if s.solver.smooth.is_some() {
                Ratios::default()
            } else {
                Ratios::new(&s.solver.sys.linear)
            },
            stored,
            met: Vec::new(),
            open: false,
            candidate: Candidate {
                x: vec![0.0; size],
                active: vec![false; s.state.l.len()],
                noise: vec![0.0; s.state.l.len()],
            },
        }
    }

    /// Takes notice of the point where a step begins.
    pub fn begin(&mut self, active: &[bool], scales: &Scales) {
        self.resistances.begin(scales);
        self.met.clear();
        self.met.extend_from_slice(active);
    }

    /// Step length of a level [s].
    pub fn length(&self, level: usize) -> f64 {
        self.longest * 0.5f64.powi(level as i32)
    }

    /// Length of the implicit step that a stage is [s].
    pub fn stage_length(&self, level: usize) -> f64 {
        self.gamma * self.length(level)
    }

    fn stage_of(&mut self, s: &Stepper, level: usize) -> &mut Stage {
        let length = self.stage_length(level);
        self.levels.at(s, level, length)
    }

    /// One implicit step in the present mode, for any signs of its guards; `x` takes unknowns, guards
    /// and functions.
    pub fn solve(&mut self, s: &mut Stepper, problem: StageProblem, x: &mut [f64]) -> Fit {
        if s.solver.smooth.is_some() {
            return self.solve_smooth(s, problem, x, false);
        }
        self.solve_linear(s, problem, x)
    }

    /// The same without smooth functions.
    fn solve_linear(&mut self, s: &mut Stepper, problem: StageProblem, x: &mut [f64]) -> Fit {
        let StageProblem { level, from, u, .. } = problem;
        let n = s.state.z.len();
        let stage = self.stage_of(s, level);
        if stage.factor(&s.state.active, s.state.epoch).regular() {
            let slot = stage.slot(&s.state.active, s.state.epoch);
            slot.uses += 1;
            let fresh = slot.map.is_none() && slot.uses == USES_FOR_MAP;
            if fresh {
                stage.make_map(&s.state.active, s.state.epoch, &mut s.solver.scratch.work);
            }
            let (inputs, slot) = stage.inputs_and_slot(&s.state.active, s.state.epoch);
            if let (Some(map), true, false) = (&slot.map, slot.trusted, fresh) {
                s.solver.scratch.input.clear();
                s.solver.scratch.input.extend(inputs.carried.iter().map(|&j| from[j]));
                s.solver.scratch.input.extend(inputs.ends.iter().map(|&j| u[j]));
                map.apply(&s.solver.scratch.input, x);
                return Fit::Solved;
            }
            let refined = !slot.trusted || fresh;
            let ends = Ends { z0: &from[..n], u0: u, u1: u };
            stage.solve_mode(
                &s.solver.sys,
                &s.state.active,
                s.state.epoch,
                ends,
                refined,
                x,
                &mut s.solver.scratch.work,
            );
            stage.matrices.guards(x, &s.state.active, true, &mut s.solver.scratch.w);
            let (inputs, slot) = stage.inputs_and_slot(&s.state.active, s.state.epoch);
            if let (Some(map), true) = (&slot.map, fresh) {
                // modes in which a large part and a small one meet lose digits in the map
                s.solver.scratch.input.clear();
                s.solver.scratch.input.extend(inputs.carried.iter().map(|&j| from[j]));
                s.solver.scratch.input.extend(inputs.ends.iter().map(|&j| u[j]));
                let mut mapped = x.to_vec();
                map.apply(&s.solver.scratch.input, &mut mapped);
                slot.trusted = s.solver.sys.apart(x, &mapped, from) <= OF_SOLUTION;
            }
            return Fit::Solved;
        }
        self.open = true;
        let fit = self.solve_open(s, problem, x);
        let keeps = problem.keeps && fit == Fit::Open && self.met != s.state.active;
        if keeps && self.keeps_mode(s, problem, x) {
            return Fit::Solved;
        }
        fit
    }

    /// Where a solution in another mode stores something else, what is stored goes on in the present one: its guards
    /// show that it has ended, and the curve to the instant at which it did so must not know of what comes after.
    fn keeps_mode(&mut self, s: &mut Stepper, problem: StageProblem, x: &mut [f64]) -> bool {
        let StageProblem { level, from, u, .. } = problem;
        let n = s.state.z.len();
        let mut own = std::mem::take(&mut self.candidate.x);
        own.copy_from_slice(x);
        self.resistances.decode(&mut own[n..], &s.state.active, &s.state.roles);
        let stage = self.stage_of(s, level);
        let factor = stage.factor(&s.state.active, s.state.epoch);
        let ends = Ends { z0: &from[..n], u0: u, u1: u };
        let mut keeps = stage.matrices.sharpen(
            &factor,
            &s.state.active,
            ends,
            &mut own,
            &mut s.solver.scratch.work,
        );
        if keeps {
            let (z, l) = own.split_at(n);
            let rows = residual(stage, s, z, l).rows;
            keeps = rows <= ACCEPT && s.solver.sys.stored_apart(z, x, &from[..n]) > OF_SOLUTION;
        }
        if keeps {
            x.copy_from_slice(&own);
            stage.matrices.guards(x, &s.state.active, true, &mut s.solver.scratch.w);
        }
        self.candidate.x = own;
        keeps
    }

    /// Whether the present mode, in which the last stage has been solved too, has a point next to `near` that obeys
    /// all signs up to rounding: then no other one is sought.
    fn stays(&mut self, s: &mut Stepper, problem: StageProblem, x: &mut [f64]) -> bool {
        let StageProblem { level, from, u, .. } = problem;
        if x.len() > OPEN || self.met != s.state.active {
            return false;
        }
        let n = s.state.z.len();
        let most = ORDINARY * size(x);
        let mut own = std::mem::take(&mut self.candidate.x);
        let mut noise = std::mem::take(&mut self.candidate.noise);
        own.copy_from_slice(x);
        let stage = self.stage_of(s, level);
        let factor = stage.factor(&s.state.active, s.state.epoch);
        let ends = Ends { z0: &from[..n], u0: u, u1: u };
        let mut stays = stage.matrices.sharpen(
            &factor,
            &s.state.active,
            ends,
            &mut own,
            &mut s.solver.scratch.work,
        );
        if stays {
            let (z, l) = own.split_at(n);
            let found = residual(stage, s, z, l);
            stage.driver.sign_tolerances(&s.state.active, &mut noise);
            s.solver.sys.linear.slacks(z, l, &mut s.solver.scratch.w);
            let guard = |i: usize| if s.state.active[i] { l[i] } else { s.solver.scratch.w[i] };
            stays = found.worst() <= ACCEPT
                && size(&own) <= most
                && s.state.diodes.iter().all(|&i| guard(i) >= -noise[i]);
        }
        if stays {
            x.copy_from_slice(&own);
        }
        (self.candidate.x, self.candidate.noise) = (own, noise);
        stays
    }

    /// A mode that leaves something open: the complementarity problem is solved, which moves what is open
    /// so that all signs hold if that is possible.  Where it finds another mode, the guard of a pair that
    /// has changed is minus the quantity that has become positive.
    fn solve_open(&mut self, s: &mut Stepper, problem: StageProblem, x: &mut [f64]) -> Fit {
        let StageProblem { level, from, u, near, .. } = problem;
        let stage = self.stage_of(s, level);
        stage.matrices.right_hand_side(from, u, u, &mut s.solver.scratch.rhs);
        stage.release();
        x.copy_from_slice(near);
        self.resistances.decode(&mut x[s.state.z.len()..], &s.state.active, &s.state.roles);
        if !self.stays(s, problem, x) {
            if !self.solve_signs(s, level, x) {
                return Fit::Contradiction;
            }
            self.sharpen(s, problem, x);
        }
        self.hidden = self.ratios.lost(s, self.stage_length(level), &self.met, u, x);
        if self.hidden {
            self.deepest = self.deepest.min(level);
            return Fit::Contradiction;
        }
        self.resistances.encode(s, x);
        Fit::Open
    }

    /// Solves a complementarity problem from `x`.
    fn solve_signs(&mut self, s: &mut Stepper, level: usize, x: &mut [f64]) -> bool {
        let driver = &mut self.stage_of(s, level).driver;
        let (z, l) = x.split_at_mut(s.state.z.len());
        let most = ORDINARY * size(z).max(size(l));
        // a conflict hides behind the voltages of inductors in a very short step; a longer one shows it.  What was
        // there before hides none, however little is stored by now
        driver
            .solve(&s.solver.scratch.rhs, &s.solver.sys.linear.q, &s.state.roles, z, l, Start::Warm)
            .is_ok_and(|found| {
                !found.flawed && (!found.needs_certificate || size(z).max(size(l)) <= most)
            })
    }

    /// Improves a solution in the mode in which it has been found, which is `met` from now on.
    fn sharpen(&mut self, s: &mut Stepper, problem: StageProblem, x: &mut [f64]) {
        let StageProblem { level, from, u, .. } = problem;
        let n = s.state.z.len();
        let (mut sharp, mut active) =
            (std::mem::take(&mut self.candidate.x), std::mem::take(&mut self.candidate.active));
        let stage = self.stage_of(s, level);
        active.copy_from_slice(stage.driver.active());
        let factor = stage.driver.mode_factor(&active);
        sharp.copy_from_slice(x);
        let ends = Ends { z0: &from[..n], u0: u, u1: u };
        if stage.matrices.sharpen(&factor, &active, ends, &mut sharp, &mut s.solver.scratch.work)
            && s.solver.sys.apart(x, &sharp, from) > OF_SOLUTION
        {
            let (z, l) = sharp.split_at(n);
            let found = residual(stage, s, z, l);
            if found.worst() <= ACCEPT {
                x.copy_from_slice(&sharp);
            }
        }
        self.met.clone_from(&active);
        (self.candidate.x, self.candidate.active) = (sharp, active);
    }

    /// As `solve`, but in the mode that the laws require at this instant; `met` says which one.  The
    /// guards are those of [`StageEquations::solve_open`].
    pub fn cross(&mut self, s: &mut Stepper, problem: StageProblem, x: &mut [f64]) -> Fit {
        if s.solver.smooth.is_some() {
            return self.solve_smooth(s, problem, x, true);
        }
        let n = s.state.z.len();
        if self.met != s.state.active && n + s.state.l.len() > OPEN {
            return self.solve_open(s, problem, x); // its mode is the next one's rather than the first
        }
        let fit = self.solve(s, problem, x);
        if fit == Fit::Open {
            return fit;
        }
        if fit == Fit::Solved && s.state.diodes.iter().all(|&i| x[n + i] >= 0.0) {
            self.met.clone_from(&s.state.active);
            return Fit::Open;
        }
        self.solve_open(s, problem, x)
    }

    /// As `solve` with smooth functions, by Newton's method; in the present mode or a `free` one.
    fn solve_smooth(
        &mut self,
        s: &mut Stepper,
        problem: StageProblem,
        x: &mut [f64],
        free: bool,
    ) -> Fit {
        let StageProblem { level, t, from, u, near, .. } = problem;
        let (n, m) = (s.state.z.len(), s.state.l.len());
        let rate = 1.0 / self.stage_length(level);
        self.roles.clear();
        let fixed = |active| if active { Role::Closed } else { Role::Open };
        let roles = s.state.roles.iter().zip(&s.state.active);
        self.roles.extend(roles.map(|(&role, &a)| if free { role } else { fixed(a) }));
        let roles = std::mem::take(&mut self.roles);
        s.solver.scratch.rhs.fill(0.0);
        s.solver.sys.linear.s.mul_add(1.0, u, &mut s.solver.scratch.rhs);
        x.copy_from_slice(near);
        let (z, rest) = x.split_at_mut(n);
        let (l, f) = rest.split_at_mut(m);
        self.resistances.decode(l, &s.state.active, &roles);
        let Some(smooth) = &mut s.solver.smooth else { return Fit::Contradiction };
        let newton = &mut smooth.newton;
        newton.set_rate(rate);
        newton.carry(&from[..n]);
        newton.carry_functions(&from[n..]);
        let solved = newton.solve(
            &s.solver.scratch.rhs,
            u,
            t,
            &s.solver.sys.linear.q,
            &roles,
            z,
            l,
            Start::Warm,
        );
        self.roles = roles;
        match solved {
            Ok(solved) => {
                newton.values(f);
                s.solver.stats.linearised += u64::from(solved.iterations);
                if free {
                    self.met.clear();
                    self.met.extend_from_slice(newton.active());
                    s.solver.note(solved.residual);
                    self.resistances.encode(s, &mut x[..n + m]);
                    return Fit::Open;
                }
                s.solver.note(solved.residual);
                s.solver.sys.linear.slacks(z, l, &mut s.solver.scratch.w);
                let blocked =
                    l.iter_mut().zip(&s.solver.scratch.w).zip(&s.state.active).filter(|l| !*l.1);
                blocked.for_each(|((guard, &w), _)| *guard = w);
                Fit::Solved
            }
            Err(unsolved) => {
                s.solver.stats.linearised += u64::from(unsolved.iterations);
                Fit::Contradiction
            }
        }
    }

    /// The change of the unknowns that a change `raw` of what is stored (unknowns, then functions)
    /// would make in the smooth stage solved last, to first order.
    pub fn respond(&mut self, s: &mut Stepper, level: usize, raw: &[f64], out: &mut [f64]) {
        let n = s.state.z.len();
        let rate = 1.0 / self.stage_length(level);
        let Some(smooth) = &mut s.solver.smooth else { return };
        smooth.newton.set_rate(rate);
        smooth.newton.respond(&raw[..n], &raw[n..], &mut out[..n]);
    }

    /// Residual of the last stage solved at a level: unknowns `z`, multipliers `l`.
    pub fn residual(
        &mut self,
        s: &mut Stepper,
        level: usize,
        from: &[f64],
        u: &[f64],
        z: &[f64],
        l: &[f64],
    ) -> Residual {
        let stage = self.stage_of(s, level);
        stage.matrices.right_hand_side(from, u, u, &mut s.solver.scratch.rhs);
        residual(stage, s, z, l)
    }
}

/// By how much unknowns and multipliers miss the equations of a step with the right-hand side at hand.
fn residual(stage: &mut Stage, s: &Stepper, z: &[f64], l: &[f64]) -> Residual {
    stage.driver.residual(&s.solver.scratch.rhs, &s.solver.sys.linear.q, &s.state.roles, z, l)
}

/// The largest magnitude.
fn size(x: &[f64]) -> f64 {
    x.iter().fold(0.0f64, |a, v| a.max(v.abs()))
}

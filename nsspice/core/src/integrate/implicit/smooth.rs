//! Steps of systems with smooth nonlinear terms: the same scheme, each step by Newton's method.

use super::failure::{Best, Failure, Outcome};
use super::matrices::StepMatrices;
use super::solver::Solver;
use super::state::State;
use super::step_length::System;
use super::time_grid::{evaluate, slopes};
use crate::descriptor::{Linear, Smooth};
use crate::mlcp::{Residual, Start};
use crate::newton::{Data, Newton, Tracking};
use crate::sparse::Csc;
use crate::structure::Coordinates;
use crate::tolerances::CLEARLY;
use crate::waveform::{Side, Waveform};

/// A prediction that reaches further than this many steps back is none.
pub(in crate::integrate) const FARTHEST: f64 = 4.0;

/// Largest part of a predicted change that may be due to its curvature.
const BENT: f64 = 0.2;

/// Newton's method and the functions at the present state.
pub struct SmoothPart {
    pub(in crate::integrate) newton: Newton,
    /// functions at the present state
    pub(in crate::integrate) f: Vec<f64>,
    /// their rates over the last step
    pub(in crate::integrate) rates: Vec<f64>,
    /// `f` belongs to the present state
    known: bool,
    /// the time that the functions see, where the time of the stepper counts points of a sweep
    pub(in crate::integrate) frozen: Option<f64>,
    /// the path is followed instead of solving every point
    pub(in crate::integrate) tracking: Option<Tracking>,
    /// of the sources where a step begins, their slopes and values
    u_rate: Vec<f64>,
    u_old: Vec<f64>,
    /// rates of the functions are wanted
    rated: bool,
    /// state and time one step ago
    last: Option<f64>,
    z_last: Vec<f64>,
    /// and two steps ago, while the motion is smooth
    before: Option<f64>,
    z_before: Vec<f64>,
    /// the last solve was quick: the path has no breakpoint here
    calm: bool,
    prediction: Vec<f64>,
    scratch: Vec<f64>,
    /// see [`Linear::conducting`]; empty until it is asked for
    conducting: Option<Csc>,
    /// nodes at which functions store a charge, where unknowns are voltages along a tree
    pub(in crate::integrate) charged: Vec<bool>,
}

impl SmoothPart {
    /// Prepares Newton's method for a system; rates of its functions may be wanted.
    pub fn new(sys: &System, smooth: Smooth, rated: bool) -> SmoothPart {
        let count = smooth.tape.program().len();
        let n = sys.linear.g.nrows;
        SmoothPart {
            newton: Newton::new(
                &sys.linear.e,
                &sys.linear.g,
                &sys.linear.a,
                &sys.linear.b,
                &sys.linear.d,
                &sys.linear.row_kind,
                smooth,
                sys.tree.as_ref(),
            ),
            f: vec![0.0; count],
            rates: vec![0.0; count],
            known: false,
            frozen: None,
            tracking: None,
            rated,
            u_rate: vec![0.0; sys.linear.s.ncols],
            u_old: vec![0.0; sys.linear.s.ncols],
            last: None,
            z_last: vec![0.0; n],
            before: None,
            z_before: vec![0.0; n],
            calm: false,
            prediction: vec![0.0; n],
            scratch: vec![0.0; count],
            conducting: None,
            charged: Vec::new(),
        }
    }

    /// Says along which tree voltages are the unknowns.
    pub(in crate::integrate) fn know_tree(&mut self, tree: &Coordinates) {
        self.charged = tree.touched(self.newton.stored_rows());
    }

    /// What the path follower has to know of the sources where a step begins.
    pub(in crate::integrate) fn see_sources(&mut self, waveforms: &[Waveform], begin: f64) {
        if self.tracking.is_some_and(|tracking| tracking.by_rate) {
            evaluate(waveforms, begin, Side::Right, &mut self.u_old);
            slopes(waveforms, begin, &mut self.u_rate);
        }
    }

    /// The time that the functions see.
    pub(in crate::integrate) fn clock(&self, time: f64) -> f64 {
        self.frozen.unwrap_or(time)
    }

    /// Predicts the state at `time` from the present one at `begin` and the two before it, and
    /// moves on by one step.
    fn extrapolate(&mut self, z: &[f64], begin: f64, time: f64) {
        let reach = self.last.map_or(0.0, |last| (time - begin) / (begin - last));
        if let (Some(last), true) = (self.last, reach > 0.0 && reach <= FARTHEST) {
            let bend = match self.before {
                Some(before)
                    if self.calm && last > before && begin - last > 0.9 * (last - before) =>
                {
                    // second divided difference times (t - t0) (t - t1)
                    let area = (time - begin) * (time - last) / (begin - before);
                    [area / (begin - last), area / (last - before)]
                }
                _ => [0.0; 2],
            };
            let points = z.iter().zip(&self.z_last).zip(&self.z_before);
            for (p, ((z, last), before)) in self.prediction.iter_mut().zip(points) {
                let change = reach * (z - last);
                let bent = bend[0] * (z - last) - bend[1] * (last - before);
                // what is curved as much as it moves is noise
                *p = z + change + if bent.abs() <= BENT * change.abs() { bent } else { 0.0 };
            }
            self.newton.predict(&self.prediction);
        }
        std::mem::swap(&mut self.z_before, &mut self.z_last);
        self.before = self.last;
        self.z_last.copy_from_slice(z);
        self.last = (time > begin).then_some(begin);
    }

    /// The present state has been changed from outside.
    pub(in crate::integrate) fn forget(&mut self) {
        self.known = false;
        self.last = None;
    }

    /// `out += factor Q f(z)`
    pub(in crate::integrate) fn add_stored_at(
        &mut self,
        z: &[f64],
        u: &[f64],
        time: f64,
        factor: f64,
        out: &mut [f64],
    ) {
        if self.newton.stores() {
            let clock = self.clock(time);
            let mut f = std::mem::take(&mut self.scratch);
            self.newton.evaluate(z, u, clock, &mut f);
            self.newton.add_stored(factor, &f, out);
            self.scratch = f;
        }
    }

    /// Begins a step from the unknowns `from`, with the sources `u` at its begin and its end: what they carry
    /// is given to Newton's method apart, for the cut-set equations.
    pub(in crate::integrate) fn set_out(
        &mut self,
        matrices: &StepMatrices,
        from: &[f64],
        u: [&[f64]; 2],
        rhs: &mut [f64],
    ) {
        rhs.fill(0.0);
        matrices.add_sources(u[0], u[1], rhs);
        self.newton.carry(from);
    }

    /// The storage matrix at a state; None if the functions store nothing.  What a function stores in an
    /// unknown from which it is gone within an `instant` [s] is no storage: the diffusion charge of a
    /// blocking junction is the exponential of minus some hundred.
    pub(in crate::integrate) fn stored(
        &mut self,
        linear: &Linear,
        z: &[f64],
        u: &[f64],
        t: f64,
        instant: f64,
    ) -> Option<Csc> {
        if !self.newton.stores() {
            return None;
        }
        let (slopes, left) = self.left_after(linear, (z, u, t), instant);
        let mut entries: Vec<_> = linear.e.iter().collect();
        entries.extend(slopes.into_iter().filter(|e| left[e.0] > 0.0 && left[e.1] > 0.0));
        Some(Csc::from_triplets(linear.e.nrows, linear.e.ncols, &entries))
    }

    /// The slopes of what functions store at a state, and of each law what is stored there, less what is gone from it
    /// within an `instant` [s].
    fn left_after(
        &mut self,
        linear: &Linear,
        (z, u, t): (&[f64], &[f64], f64),
        instant: f64,
    ) -> (Vec<(usize, usize, f64)>, Vec<f64>) {
        let clock = self.clock(t);
        let slopes = self.newton.stored_slopes(z, u, clock);
        let mut own = vec![0.0; linear.g.nrows];
        linear.e.iter().filter(|e| e.0 == e.1).for_each(|(j, _, v)| own[j] = v);
        let (mut left, mut held) = (vec![0.0; linear.g.nrows], vec![0.0; linear.g.nrows]);
        linear.g.iter().filter(|e| e.0 == e.1).for_each(|(j, _, v)| held[j] = v.abs());
        for (row, c, v) in linear.g.iter() {
            // by what conducts, by the current that it drives through a winding or through a resistance
            let branch = linear.row_kind[row] == 0 && linear.row_kind[c] == 1;
            left[row] -= match (row == c, own[c] > 0.0) {
                (true, _) => instant * v.abs(),
                (false, true) => (instant * v) * (instant * v) / own[c],
                (false, false) if branch && held[c] > 0.0 => instant * v * v / held[c],
                (false, false) => 0.0,
            };
        }
        for (row, _, v) in linear.e.iter().chain(slopes.iter().copied()).filter(|e| e.0 == e.1) {
            left[row] += v.abs();
        }
        (slopes, left)
    }

    /// Laws in which what functions store at a state counts, see [`SmoothPart::stored`].
    pub(in crate::integrate) fn keeps(
        &mut self,
        linear: &Linear,
        z: &[f64],
        u: &[f64],
        t: f64,
        instant: f64,
    ) -> Vec<bool> {
        let (_, left) = self.left_after(linear, (z, u, t), instant);
        left.into_iter().map(|left| left > 0.0).collect()
    }

    /// What conducts where all switches are closed.
    pub(in crate::integrate) fn conducting(&mut self, linear: &Linear) -> &Csc {
        self.conducting.get_or_insert_with(|| linear.conducting())
    }

    /// Takes the functions and their rates at a state that is no end of a step.
    pub(in crate::integrate) fn enter(&mut self, z: &[f64], u: &[f64], time: f64, rates: &[f64]) {
        let clock = self.clock(time);
        self.newton.evaluate(z, u, clock, &mut self.f);
        self.rates.copy_from_slice(rates);
        (self.known, self.last) = (true, None);
    }

    /// Computes the functions at the end of a step of this length, and their rates in it: it begins with `from`.
    pub(in crate::integrate) fn after_jump(
        &mut self,
        z: &[f64],
        from: &[f64],
        u: &[f64],
        time: f64,
        length: f64,
    ) {
        let clock = self.clock(time);
        self.newton.evaluate(z, u, clock, &mut self.f);
        for (rate, (end, begin)) in self.rates.iter_mut().zip(self.f.iter().zip(from)) {
            *rate = (end - begin) / length;
        }
        self.known = true;
        self.last = None;
    }
}

impl Solver {
    /// The smooth functions at the present state, and their rates over the last step.
    pub(in crate::integrate) fn functions(&self) -> [&[f64]; 2] {
        self.smooth.as_ref().map_or([&[]; 2], |smooth| [&smooth.f, &smooth.rates])
    }

    /// Whether some charge is a function of the unknowns: then charges depend on potentials.
    pub(in crate::integrate) fn functions_store(&self) -> bool {
        self.smooth.as_ref().is_some_and(|smooth| smooth.newton.stores())
    }

    /// The state has been changed otherwise than by a solve.
    pub(in crate::integrate) fn forget_functions(&mut self) {
        if let Some(smooth) = &mut self.smooth {
            smooth.forget();
        }
    }

    /// The smooth functions of the unknowns `z` at the present time.
    pub(in crate::integrate) fn functions_at(&mut self, state: &State, z: &[f64]) -> Vec<f64> {
        let Some(smooth) = &mut self.smooth else { return Vec::new() };
        let clock = smooth.clock(state.time);
        let mut f = smooth.f.clone();
        smooth.newton.evaluate(z, &state.u0, clock, &mut f);
        f
    }

    /// The charges and fluxes of smooth functions of the unknowns `z` in each law.
    pub(in crate::integrate) fn stored_by_functions(
        &mut self,
        state: &State,
        z: &[f64],
    ) -> Vec<f64> {
        let mut out = vec![0.0; z.len()];
        if let Some(smooth) = &mut self.smooth {
            smooth.add_stored_at(z, &state.u0, state.time, 1.0, &mut out);
        }
        out
    }

    /// Gives what the functions of the unknowns `z` store to Newton's method.
    pub(in crate::integrate) fn carry_stored(&mut self, state: &State, z: &[f64]) {
        if self.functions_store() {
            let f = self.functions_at(state, z);
            if let Some(smooth) = &mut self.smooth {
                smooth.newton.carry_functions(&f);
            }
        }
    }

    /// A failure of a step with what the unknowns `from` carry, which Newton's method is given apart.
    pub(in crate::integrate) fn with_charges(
        &self,
        k: usize,
        from: &[f64],
        mut failure: Box<Failure>,
    ) -> Box<Failure> {
        if self.smooth.is_some() {
            self.levels.stages[k].matrices.carry.mul_add(1.0, from, &mut failure.rhs);
        }
        failure
    }

    /// Solves the nonlinear problem with right-hand side `rhs`, sources `u1`.
    pub(in crate::integrate) fn solve_smooth(
        &mut self,
        state: &mut State,
        length: f64,
        start: Start,
    ) -> Outcome {
        let Some(smooth) = &mut self.smooth else { return Ok(()) };
        let clock = smooth.clock(state.time);
        smooth.newton.set_rate(1.0 / length);
        let solved = smooth.newton.solve(
            &self.scratch.rhs,
            &state.u1,
            clock,
            &self.sys.linear.q,
            &state.roles,
            &mut state.z,
            &mut state.l,
            start,
        );
        match solved {
            Ok(solved) => {
                smooth.newton.values(&mut smooth.f);
                smooth.known = true;
                smooth.calm = solved.iterations <= 2;
                self.scratch.smooth_time = state.time;
                if smooth.newton.active() != state.active {
                    state.active.copy_from_slice(smooth.newton.active());
                    state.epoch += 1;
                    self.stats.mode_changes += 1;
                }
                self.stats.worst_stage = self.stats.worst_stage.max(solved.stage);
                self.stats.linearised += u64::from(solved.iterations);
                self.note(solved.residual);
                Ok(())
            }
            Err(unsolved) => {
                self.stats.linearised += u64::from(unsolved.iterations);
                let worst = unsolved.residual.worst();
                let best = Best { worst_row: unsolved.worst_row, point: unsolved.point };
                Err(self.failed(state, length, worst, false, Some(Box::new(best))))
            }
        }
    }

    /// Lets Newton's method end at rounding for a while.
    pub(in crate::integrate) fn exactly<T>(&mut self, solve: impl FnOnce(&mut Solver) -> T) -> T {
        let known = self.smooth.as_ref().map(|smooth| smooth.newton.accuracy());
        if let Some(smooth) = &mut self.smooth {
            smooth.newton.set_accuracy(0.0);
        }
        let found = solve(self);
        if let (Some(smooth), Some(accuracy)) = (&mut self.smooth, known) {
            smooth.newton.set_accuracy(accuracy);
        }
        found
    }

    /// One Euler-Newton step from the time `begin`; a static problem.
    fn follow(&mut self, state: &mut State, k: usize, begin: f64, tracking: Tracking) -> Outcome {
        self.scratch.z_before.copy_from_slice(&state.z);
        self.scratch.l_before.copy_from_slice(&state.l);
        let Some(smooth) = &mut self.smooth else { return Ok(()) };
        smooth.newton.set_rate(0.0);
        let (clock, old_clock) = (smooth.clock(state.time), smooth.clock(begin));
        let mut predictor = None;
        let matrices = &self.levels.stages[k].matrices;
        if tracking.by_rate && state.time > begin {
            let h = state.time - begin;
            let u = &smooth.u_old;
            let ahead: Vec<f64> = u.iter().zip(&smooth.u_rate).map(|(u, r)| u + h * r).collect();
            matrices.right_hand_side(&state.z, &ahead, &ahead, &mut self.scratch.rhs);
            smooth.newton.evaluate(&state.z, &smooth.u_old, old_clock, &mut smooth.scratch);
            let t_rate = if smooth.frozen.is_some() { 0.0 } else { 1.0 };
            smooth.newton.add_drift(-h, &smooth.u_rate, t_rate, &mut self.scratch.rhs);
            predictor = Some((self.scratch.rhs.clone(), old_clock));
        }
        matrices.right_hand_side(&state.z, &state.u0, &state.u1, &mut self.scratch.rhs);
        let (q, roles) = (&self.sys.linear.q[..], &state.roles[..]);
        let here = Data { rhs: &self.scratch.rhs, u: &state.u1, t: clock, q, roles };
        let (mut rows, mut pairs) = (0.0f64, 0.0f64);
        for step in 0..=tracking.correctors {
            let data = match &predictor {
                Some((rhs, t)) if step == 0 => Data { rhs, u: &smooth.u_old, t: *t, q, roles },
                _ => here,
            };
            let found = smooth.newton.linearised_step(&data, &mut state.z, &mut state.l);
            self.stats.problems += 1;
            self.stats.linearised += 1;
            let Some(found) = found else {
                let failed = smooth.newton.residual_at(&here, &state.z, &state.l);
                return Err(self.failed(state, f64::INFINITY, failed.worst(), false, None));
            };
            (rows, pairs) = (rows.max(found.rows), pairs.max(found.complementarity));
        }
        let grid = smooth.newton.residual_at(&here, &state.z, &state.l);
        let worst = grid.worst();
        // such a point may be of another path, or of none
        if worst > CLEARLY || worst.is_nan() {
            state.z.copy_from_slice(&self.scratch.z_before);
            state.l.copy_from_slice(&self.scratch.l_before);
            return Err(self.failed(state, f64::INFINITY, worst, false, None));
        }
        smooth.newton.values(&mut smooth.f);
        smooth.known = true;
        self.stats.grid_residual = self.stats.grid_residual.max(worst);
        self.scratch.smooth_time = state.time;
        if smooth.newton.active() != state.active {
            state.active.copy_from_slice(smooth.newton.active());
            state.epoch += 1;
            self.stats.mode_changes += 1;
        }
        self.note(Residual { rows, complementarity: pairs });
        Ok(())
    }

    /// One ordinary step, predicted along the secant of the last one.
    pub(in crate::integrate) fn take_smooth(
        &mut self,
        state: &mut State,
        k: usize,
        length: f64,
    ) -> Outcome {
        let begin = self.scratch.smooth_time;
        let tracking = self.smooth.as_ref().and_then(|s| s.tracking);
        if let (Some(tracking), true) = (tracking, length.is_infinite()) {
            return self.follow(state, k, begin, tracking);
        }
        let Some(smooth) = &mut self.smooth else { return Ok(()) };
        smooth.set_out(
            &self.levels.stages[k].matrices,
            &state.z,
            [&state.u0, &state.u1],
            &mut self.scratch.rhs,
        );
        let wanted = length.is_finite() && smooth.newton.stores();
        if !smooth.known && (wanted || smooth.rated) {
            let clock = smooth.clock(begin);
            smooth.newton.evaluate(&state.z, &state.u0, clock, &mut smooth.f);
            smooth.known = true;
        }
        if wanted {
            smooth.newton.carry_functions(&smooth.f);
        }
        smooth.rates.copy_from_slice(&smooth.f);
        smooth.extrapolate(&state.z, begin, state.time);
        self.solve(state, k, length, Start::Warm)
            .map_err(|failure| self.with_charges(k, &state.z, failure))?;
        let Some(smooth) = &mut self.smooth else { return Ok(()) };
        for (rate, new) in smooth.rates.iter_mut().zip(&smooth.f) {
            *rate = if length.is_finite() { (new - *rate) / length } else { 0.0 };
        }
        Ok(())
    }
}

//! After an event: the next mode; and single implicit steps over what cannot be located.

use super::fallback::FALLBACK_LEVEL;
use super::guards::VIOLATED;
use crate::integrate::implicit::failure::Failure;
use crate::integrate::implicit::stepper::Stepper;
use crate::integrate::implicit::time_grid::{evaluate, evaluate_after};
use crate::integrate::sdirk::run::Sdirk;
use crate::mlcp::Start;
use crate::tolerances::ACCEPT;
use crate::waveform::Side;

impl Sdirk {
    /// The next step does not continue another one.
    pub(in crate::integrate::sdirk) fn begin_anew(&mut self, s: &mut Stepper) {
        let known = self.knows_rates(s);
        self.tableau = self.settings.method.next(known);
        self.scales.forget();
        self.begin_step(s, false);
        self.begin_at_rest(s);
    }

    /// Whether the rates of what is stored are known at the begin of a step although it does not continue another
    /// one: the structure of the network has given them.
    pub(in crate::integrate::sdirk) fn knows_rates(&mut self, s: &mut Stepper) -> bool {
        let rates = s.instants.begun.take().filter(|_| self.settings.method.continues());
        rates.iter().for_each(|rates| self.trial.begin_rates(rates));
        rates.is_some()
    }

    /// Whether the rates at the end of the step just taken may begin the next one.  They are differences over
    /// its last stage, known to what is stored by `u`: over the next step that may count for no more than the
    /// residual of a stage.  A step that a breakpoint has cut to nearly nothing misses this.
    pub(in crate::integrate::sdirk) fn resolves_rates(&self) -> bool {
        let next = self.stage_equations.length(self.control.level);
        let stage = self.tableau.gamma * self.trial.length;
        f64::EPSILON * next <= ACCEPT * stage
    }

    /// Finds the mode from here on; charges and fluxes may jump.
    pub(in crate::integrate::sdirk) fn restart(&mut self, s: &mut Stepper) {
        s.gates().throw_by_sources();
        self.measure_pairs(s);
        (s.instants.begun, s.instants.felt) = (None, self.scales.largest[1]);
        // a failure is left to the next step, which can be certified
        let _ = s.impulse_or_leave();
        let (z, l) = (s.state.z.clone(), s.state.l.clone());
        let changed = s.gates().react();
        if let Err(failure) = s.settle_after(changed) {
            if !(failure.restless.is_some() && self.calm(s, (&z, &l))) {
                (s.state.z, s.state.l) = (z, l);
                self.trouble.restless = failure.restless.map(|_| failure);
            }
        }
        s.log_events();
    }

    /// Finds which guards of pairs are zero up to rounding.
    fn measure_pairs(&self, s: &mut Stepper) {
        for (k, zero) in s.instants.zero.iter_mut().enumerate() {
            *zero = [false, true].map(|active| VIOLATED * self.scales.of_pair(k, active));
        }
        if let Some(continuous) = &mut s.instants.continuous {
            continuous.zero.copy_from_slice(&s.instants.zero);
        }
    }

    /// Samples the switches that come to no rest at an instant if the tolerance does not decide on which side of
    /// its threshold any of them is, and begins once more from `before`; false if there is no such solution.
    fn calm(&mut self, s: &mut Stepper, before: (&[f64], &[f64])) -> bool {
        let near = self.scales.near(s, &s.state.z, self.settings.accuracy.relative);
        if !s.gates().turning().all(|k| near.contains(&k)) {
            return false;
        }
        self.trouble.sampling.sample(&near, s.state.time);
        self.trouble.sampling.begin(s.state.time);
        s.switching.sampled.clone_from(&self.trouble.sampling.on);
        s.state.z.copy_from_slice(before.0);
        s.state.l.copy_from_slice(before.1);
        s.settle_after(true).is_ok()
    }

    /// Samples the switches that have made events accumulate; false if there are none.
    pub(in crate::integrate::sdirk) fn sample(&mut self, s: &mut Stepper) -> bool {
        // the rounding of an instant is stepped across by one implicit step
        let any = self.trouble.fallback.has_returned() && self.trouble.sampling.begin(s.state.time);
        if any {
            self.trouble.fallback.note_progress();
            s.switching.sampled.clone_from(&self.trouble.sampling.on);
        }
        any
    }

    /// The switches whose thresholds have been reached at `point`, the part `theta` of the step.  Those that have
    /// left them by less than the tolerance since may chatter.
    pub(in crate::integrate::sdirk) fn reach(&mut self, s: &Stepper, theta: f64) -> Vec<usize> {
        let mut reached = self.scales.reached(s, &self.trial.at.x[..s.state.z.len()]);
        // what was there all the time, or leaves it on this side, has not come
        reached.retain(|&k| !self.stays(s, k) && !self.leaves(s, k));
        for &k in &reached {
            let away = self.scales.excursion(s, k, &self.trial.stages.ends, theta);
            if away <= self.settings.accuracy.relative {
                self.trouble.sampling.note(k);
            }
        }
        reached
    }

    /// The sampled switches that turn at the end of a step: at an instant at which they look at their controls,
    /// or after one that an implicit step has stepped across.
    pub(in crate::integrate::sdirk) fn look(&mut self, s: &mut Stepper) -> Vec<usize> {
        if !self.trouble.sampling.looks(s.state.time) {
            return Vec::new();
        }
        let mut turned = Vec::new();
        for (k, margin) in self.scales.sampled(s, &s.state.z) {
            if margin < -VIOLATED {
                turned.push(k);
                self.trouble.sampling.turn(k, -margin * self.scales.of_control(s, k));
            } else {
                self.trouble.sampling.stays(k, margin);
            }
        }
        if self.trouble.sampling.release() {
            s.switching.sampled.clone_from(&self.trouble.sampling.on);
        }
        turned
    }

    /// Notes that a step from `time` has failed; whether an implicit one has to step across what is there.
    pub(in crate::integrate::sdirk) fn is_stuck(&mut self, time: f64) -> bool {
        self.trouble.fallback.is_stuck(time, self.stage_equations.length(FALLBACK_LEVEL))
    }

    /// A single implicit step with complementarity, over what cannot be located.
    pub(in crate::integrate::sdirk) fn force(
        &mut self,
        s: &mut Stepper,
    ) -> Result<(), Box<Failure>> {
        let target = self.breakpoint.0.min(self.settings.stop);
        let remaining = target - s.state.time;
        let level = self.trouble.fallback.enter(s.state.time);
        let level = level.min(self.stage_equations.deepest - 1);
        let wanted = self.stage_equations.stage_length(level);
        let length = if wanted >= remaining * (1.0 - 1e-9) { remaining } else { wanted };
        let at_breakpoint = length == remaining && target == self.breakpoint.0;
        self.implicit(s, length, if length == remaining { target } else { s.state.time + length })?;
        self.counters.forced += 1;
        self.trouble.fallback.leave(s.state.time, length);
        self.trouble.futile = false;
        self.control.level = self.control.level.min(FALLBACK_LEVEL);
        let turned = self.look(s);
        turned.iter().for_each(|&k| s.gates().throw(k));
        if at_breakpoint {
            evaluate(&s.waveforms, s.state.time, Side::Right, &mut s.state.u0);
            self.restart(s);
        } else {
            let changed = s.gates().react() || !turned.is_empty();
            s.settle_after(changed)?;
            s.log_events();
        }
        self.begin_step(s, false);
        Ok(())
    }

    /// An implicit step of a length to its `end`.
    fn implicit(&mut self, s: &mut Stepper, length: f64, end: f64) -> Result<(), Box<Failure>> {
        let time = s.state.time;
        evaluate_after(&s.waveforms, end, time, self.breakpoint.0, &mut s.state.u1);
        let mut before = vec![0.0; s.recorder.columns()];
        s.write(time, &mut before);
        let k = s.solver.stage_index(&s.state, length, true);
        let (from, u) = (s.state.z.clone(), s.state.u1.clone());
        let matrices = &s.solver.levels.stages[k].matrices;
        if let Some(smooth) = &mut s.solver.smooth {
            smooth.set_out(matrices, &from, [&u, &u], &mut s.solver.scratch.rhs);
        } else {
            matrices.right_hand_side(&from, &u, &u, &mut s.solver.scratch.rhs);
        }
        s.solver.carry_stored(&s.state, &from);
        s.solver.forget_functions();
        s.state.time = end;
        // its record has no rates: they follow from the charges of both ends, however short it is
        if let Err(failure) =
            s.solver.exactly(|solver| solver.solve(&mut s.state, k, length, Start::Warm))
        {
            s.state.time = time;
            return Err(s.solver.with_charges(k, &from, failure));
        }
        s.solver.sharpen(&mut s.state, k, &from, &u, &u);
        if s.recorder.outputs.needs_rates() {
            for ((rate, z), old) in s.recorder.rates.iter_mut().zip(&s.state.z).zip(&from) {
                *rate = (z - old) / length;
            }
        }
        if let Some(smooth) = &mut s.solver.smooth {
            let old = &self.trial.first[s.state.z.len() + s.state.l.len()..];
            for (rate, (new, old)) in smooth.rates.iter_mut().zip(smooth.f.iter().zip(old)) {
                *rate = (new - old) / length;
            }
        }
        let taken = s.recorder.sums.as_mut().map(|sums| sums.taken());
        s.sum_up(length, true);
        let instant = length <= self.stage_equations.stage_length(FALLBACK_LEVEL);
        if let (true, Some(sums), Some(taken)) = (instant, &mut s.recorder.sums, taken) {
            sums.pass_over(taken);
        }
        if s.recorder.samples.watches() {
            s.recorder.z_recorded.copy_from_slice(&from);
            s.recorder.record(&s.state, length);
        }
        s.solver.stats.steps += 1;
        self.trial.leave(self.tableau, 1.0, false);
        self.tableau = self.settings.method.next(false);
        self.write_between(s, time, &before);
        self.shown.points.note_left(s);
        s.state.u0.copy_from_slice(&s.state.u1);
        Ok(())
    }

    /// The rows inside a single implicit step from `begin`, with the row `before` there: it is a line.
    fn write_between(&mut self, s: &mut Stepper, begin: f64, before: &[f64]) {
        let length = s.state.time - begin;
        if let Some([from, to]) = s.recorder.samples.pieces.wanted(begin, s.state.time) {
            s.write_left(s.state.time);
            s.recorder.samples.pieces.line([from, to], Some(&before[1..]), &s.recorder.left[1..]);
        }
        while self.shown.rows.time() < s.state.time - 1e-12 * length {
            let label = self.shown.rows.time();
            let part = ((label - begin) / length).max(0.0);
            s.write_left(label);
            for (end, begin) in s.recorder.left.iter_mut().zip(before).skip(1) {
                *end = begin + part * (*end - begin);
            }
            self.shown.points.wait(&s.recorder.left);
            self.shown.rows.advance();
        }
    }
}

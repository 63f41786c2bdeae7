//! One step: by the affine map or the factor of the present mode, else by the driver.

use super::events::impacts::Cut;
use super::failure::{Failure, Outcome};
use super::stepper::Stepper;
use super::time_grid::{evaluate, Target};
use crate::mlcp::Start;
use crate::waveform::Side;

/// What is known at the begin of a step.
struct Begun {
    /// a record of it is wanted
    wanted: bool,
    /// problems solved and changes of mode so far
    problems: u64,
    epoch: u64,
}

impl Stepper {
    /// Steps to a target, or to an impact before it: then returns where the step has ended.
    pub(in crate::integrate) fn step(
        &mut self,
        target: &Target,
    ) -> Result<Option<Target>, Box<Failure>> {
        let mut reached = None;
        self.state.time = target.time;
        self.recorder.two_sided = false;
        if self.facts.static_system || self.schedule.sweeping {
            if target.jump && self.recorder.shows_sides() {
                evaluate(&self.waveforms, target.time, Side::Left, &mut self.state.u0);
                self.state.u1.copy_from_slice(&self.state.u0);
                self.take(f64::INFINITY)?;
                self.write_left(target.label);
                self.recorder.two_sided = true;
            }
            evaluate(&self.waveforms, target.time, Side::Right, &mut self.state.u0);
            self.state.u1.copy_from_slice(&self.state.u0);
            if let Err(failure) = self.take(f64::INFINITY) {
                self.search(failure, |s| s.solver.solve_static(&mut s.state, Start::Cold))?;
            }
        } else {
            evaluate(&self.waveforms, target.time, Side::Left, &mut self.state.u1);
            fault!("source_of_begin" => self.state.u1.copy_from_slice(&self.state.u0));
            let cut = self.take_to(target)?;
            self.instants.stale = false;
            if (target.jump || cut.is_some()) && self.recorder.shows_sides() {
                self.write_left(cut.as_ref().map_or(target.label, |c| c.target.label));
                self.recorder.two_sided = true;
            }
            if let Some(cut) = cut {
                self.state.u0.copy_from_slice(&self.state.u1);
                let (before, jumps) = (self.state.z.clone(), self.solver.stats.jumps);
                self.enter(None, before.clone(), cut.state_jump);
                self.account_for_jump(&before, jumps);
                reached = Some(cut.target);
            } else if target.jump {
                let side = fault!("source_left_limit", Side::Right, Side::Left);
                evaluate(&self.waveforms, target.time, side, &mut self.state.u0);
                self.gates().throw_by_sources();
                self.impulse_or_leave()?;
            } else {
                self.state.u0.copy_from_slice(&self.state.u1);
            }
        }
        if !self.switching.switches.is_empty() {
            self.gates().look_for_rest();
            let changed = self.gates().react();
            let dynamic = !self.facts.static_system && !self.schedule.sweeping;
            if dynamic {
                self.switching.still.fill(false); // what the switches do takes no time
            }
            if changed && dynamic && !self.recorder.two_sided && self.recorder.shows_sides() {
                self.write_left(reached.map_or(target.label, |r| r.label));
                self.recorder.two_sided = true;
            }
            self.settle_after(changed)?;
            if changed && !dynamic && self.recorder.samples.watches() {
                self.recorder.z_recorded.copy_from_slice(&self.state.z);
                self.recorder.record(&self.state, f64::INFINITY);
            }
            self.gates().note_controls();
        }
        Ok(reached)
    }

    /// One ordinary step of the given length from (z, u0) with sources u1 at its end.
    fn take(&mut self, length: f64) -> Outcome {
        let begun = self.begin_step();
        self.solve_step(length)?;
        self.end_step(begun, length);
        Ok(())
    }

    /// One ordinary step to a target, or to an impact before it.
    fn take_to(&mut self, target: &Target) -> Result<Option<Cut>, Box<Failure>> {
        let begun = self.begin_step();
        self.instants.impacts.begin(&self.state.active);
        self.solve_step(target.length)?;
        let cut = if self.state.epoch == begun.epoch { None } else { self.cut_at_impact(target) };
        self.end_step(begun, cut.as_ref().map_or(target.length, |c| c.target.length));
        Ok(cut)
    }

    /// Keeps the state if it is asked for at the end of the step.
    fn begin_step(&mut self) -> Begun {
        self.solver.stats.steps += 1;
        let wanted = self.recorder.samples.wants(self.state.epoch);
        if wanted || self.recorder.sums.is_some() {
            self.solver.scratch.z_before.copy_from_slice(&self.state.z);
        }
        Begun { wanted, problems: self.solver.stats.problems, epoch: self.state.epoch }
    }

    fn end_step(&mut self, begun: Begun, length: f64) {
        // a mode that changed within the step was found by the driver, which keeps the old state
        if begun.wanted || self.recorder.samples.changed(self.state.epoch) {
            self.recorder.z_recorded.copy_from_slice(&self.solver.scratch.z_before);
            self.recorder.record(&self.state, length);
        }
        if length.is_finite() {
            let new =
                self.solver.stats.problems > begun.problems || self.state.epoch != begun.epoch;
            self.sum_up(length, new);
        }
    }

    /// Adds an implicit step from `z_before`, u0 to z, u1 to the balance of energy.
    pub(in crate::integrate) fn sum_up(&mut self, length: f64, new: bool) {
        let Some(sums) = &mut self.recorder.sums else { return };
        let f = self.solver.functions();
        let (sides, sources) = (
            [&self.solver.scratch.z_before[..], &self.state.z],
            [&self.state.u0[..], &self.state.u1],
        );
        sums.step(length, sides, &self.state.l, sources, f, new);
    }

    /// Finds the end of a step, and the rates of the unknowns in it.
    pub(in crate::integrate) fn solve_step(&mut self, length: f64) -> Outcome {
        if self.recorder.outputs.needs_rates() {
            self.recorder.rates.copy_from_slice(&self.state.z);
        }
        if let Some(smooth) = &mut self.solver.smooth {
            smooth.see_sources(&self.waveforms, self.solver.scratch.smooth_time);
        }
        #[cfg(feature = "faults")]
        let multipliers = self.state.l.clone();
        self.solver.step(&mut self.state, length)?;
        #[cfg(feature = "faults")]
        if let Some(z) = self.state.z.first_mut() {
            fault!("step_value_off_1e-5" => *z *= 1.0 + 1e-5);
            fault!("step_value_off_1e-3" => *z *= 1.0 + 1e-3);
            let both = self.state.l.iter_mut().zip(multipliers);
            fault!("multipliers_averaged" => both.for_each(|(l, old)| *l = 0.5 * (*l + old)));
        }
        if self.recorder.outputs.needs_rates() {
            for (rate, z) in self.recorder.rates.iter_mut().zip(&self.state.z) {
                *rate = (z - *rate) / length;
            }
        }
        Ok(())
    }

    /// A switch has found no state.
    pub(in crate::integrate) fn unsettled(&self) -> Box<Failure> {
        let pair = self.switching.last_thrown.map(|k| self.switching.switches[k].pair);
        Box::new(Failure::restless(self.state.time, pair))
    }
}

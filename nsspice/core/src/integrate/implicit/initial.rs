//! First states: static solutions, and those that follow from stored charges and fluxes.

use super::failure::Failure;
use super::stepper::{Stepper, MAX_REACTIONS};
use super::time_grid::evaluate;
use crate::mlcp::Start;
use crate::waveform::Side;

/// Unknowns and multipliers near which a solution is wanted.
pub type Guess<'a> = Option<(&'a [f64], &'a [f64])>;

impl Stepper {
    fn begin_near(&mut self, guess: Guess) -> Start {
        match guess {
            Some((z, l)) => {
                self.state.z.copy_from_slice(z);
                self.state.l.copy_from_slice(l);
                Start::Warm
            }
            None => {
                self.state.z.fill(0.0);
                self.state.l.fill(0.0);
                Start::Cold
            }
        }
    }

    /// Starts from the solution of the static equations (capacitors open, inductors shorted) with the
    /// sources as they are before any ideal edge at this time; see [`Stepper::leave_dc`].
    pub fn start_dc(&mut self, time: f64, guess: Guess) -> Result<(), Failure> {
        self.state.time = time;
        evaluate(&self.waveforms, time, Side::Left, &mut self.state.u0);
        let start = self.begin_near(guess);
        self.state.u1.copy_from_slice(&self.state.u0);
        self.recorder.rates.fill(0.0);
        // an open switch may be the only way for a current
        self.gates().throw_by_sources();
        self.switching.still.fill(true);
        for round in 0..MAX_REACTIONS {
            // nothing stored holds the nodes at which next to nothing flows
            if let Err(failure) =
                self.solver.exactly(|solver| solver.solve_static(&mut self.state, start))
            {
                self.search(failure, |s| {
                    s.solver.exactly(|solver| solver.solve_static(&mut s.state, Start::Cold))
                })
                .map_err(|f| *f)?;
            }
            if !self.gates().react_in(round) {
                #[cfg(feature = "faults")]
                self.damage_start();
                if self.recorder.samples.watches() {
                    self.recorder.z_recorded.copy_from_slice(&self.state.z);
                    self.recorder.record(&self.state, f64::INFINITY);
                }
                return Ok(());
            }
        }
        self.solver.stats.chatter += 1;
        if self.facts.static_system {
            return Err(*self.unsettled());
        }
        // what is stored lets go of such a start, or slides; the first row obeys the laws of the switches
        self.settle_after(self.schedule.step_length.is_finite()).or(Ok(()))
    }

    /// What is stored at the start, damaged by the chosen fault.
    #[cfg(feature = "faults")]
    fn damage_start(&mut self) {
        let unknowns: Vec<usize> = self.facts.storage.unknowns().collect();
        let mut stored: Vec<f64> = unknowns.iter().map(|&j| self.state.z[j]).collect();
        crate::faults::damage::start(&mut stored);
        unknowns.iter().zip(stored).for_each(|(&j, value)| self.state.z[j] = value);
    }

    /// Lets the ideal edges of sources at the start act on the static solution.
    pub fn leave_dc(&mut self) -> Result<(), Failure> {
        evaluate(&self.waveforms, self.state.time, Side::Right, &mut self.state.u1);
        if self.state.u1 == self.state.u0 {
            return Ok(());
        }
        self.state.u0.copy_from_slice(&self.state.u1);
        self.switching.still.fill(self.facts.static_system);
        self.gates().throw_by_sources();
        self.settle_after(true).map_err(|f| *f)
    }

    /// Starts from stored charges and fluxes `E z(0-)` by a reinitialising step; the first entry of
    /// `jumps` says what it moved.  Of several solutions the one near a guess is approached.
    pub fn start_charges(
        &mut self,
        time: f64,
        charges: &[f64],
        step: f64,
        guess: Guess,
    ) -> Result<(), Failure> {
        self.state.time = time;
        self.schedule.step_length = step;
        evaluate(&self.waveforms, time, Side::Right, &mut self.state.u0);
        self.state.z.fill(0.0);
        self.state.l.fill(0.0);
        if self.facts.static_system {
            return self.start_dc(time, guess);
        }
        self.gates().throw_by_sources();
        // the other switches belong to the state that the charges lead to: found by starting again with
        // those that have changed, not by a second jump from where the wrong ones led
        for round in 0..MAX_REACTIONS {
            self.recorder.jumps.clear();
            self.solver.stats.jumps = 0;
            let start = self.begin_near(guess);
            if let Err(failure) = self.impulse(Some(charges), start) {
                let again = |s: &mut Stepper| {
                    s.recorder.jumps.clear();
                    s.solver.stats.jumps = 0;
                    s.impulse(Some(charges), Start::Cold)
                };
                self.search(failure, again).map_err(|f| *f)?;
            }
            if !self.gates().react_in(round) {
                return Ok(());
            }
        }
        self.solver.stats.chatter += 1;
        Ok(())
    }
}

//! Points of a step at which the certificate integrates what flows.

use super::controller::stage_equations::Fit;
use super::run::Sdirk;
use super::Accuracy;
use crate::audit::PLACES;
use crate::integrate::implicit::stepper::Stepper;

impl Sdirk {
    /// Evaluates the points inside the accepted step, up to the part `theta`, at which the certificate finds its error.
    pub(super) fn take_nodes(&mut self, s: &mut Stepper, theta: f64) {
        let Accuracy { relative, energy, .. } = self.settings.accuracy;
        if relative >= 1.0 || energy || s.recorder.sums.is_none() {
            return; // no tolerance, or one of energies
        }
        for part in &PLACES[..PLACES.len() - 1] {
            let at = part * theta;
            let fit = self.trial.evaluate(s, &mut self.stage_equations, self.tableau, at);
            if fit != Fit::Contradiction {
                self.shown.samples.node(s, &self.trial, &self.stage_equations);
            }
        }
    }
}

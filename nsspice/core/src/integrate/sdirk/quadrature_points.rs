//! Points of a step at which the certificate integrates what flows.

use super::controller::stage_equations::Fit;
use super::run::Sdirk;
use super::Accuracy;
use crate::audit::{Asked, PLACES};
use crate::integrate::implicit::stepper::Stepper;

impl Sdirk {
    /// Whether somebody judges the steps, and they have a tolerance that is not one of energies.
    ///
    /// Edges of junctions fall inside of steps, where no quadrature of a few points follows them.
    pub(super) fn finds_errors(&self, s: &Stepper) -> bool {
        let Accuracy { relative, energy, .. } = self.settings.accuracy;
        let smooth = s.solver.smooth.is_some();
        relative < 1.0 && !energy && !smooth && s.recorder.sums.is_some()
    }

    /// Evaluates the points inside the accepted step, up to the part `theta`, at which the certificate finds its error.
    pub(super) fn take_nodes(&mut self, s: &mut Stepper, theta: f64) {
        for part in &PLACES[..PLACES.len() - 1] {
            let at = part * theta;
            let fit = self.trial.evaluate(s, &mut self.stage_equations, self.tableau, at);
            if fit != Fit::Contradiction {
                self.shown.samples.node(s, &self.trial, &self.stage_equations);
            }
        }
    }

    /// Hands these points and the end of the step, which is evaluated, to the certificate.
    pub(super) fn find_errors(&mut self, s: &mut Stepper, theta: f64) {
        let Accuracy { relative, voltage, current, .. } = self.settings.accuracy;
        let asked = Asked { relative, least: [voltage, current] };
        self.shown.samples.node(s, &self.trial, &self.stage_equations);
        self.shown.samples.find_errors(s, &self.trial, theta, asked);
    }
}

//! Residuals of stages, looked at now and then.

use super::run::{Sdirk, LOOK};
use crate::integrate::implicit::stepper::Stepper;
use crate::rounding::OF_SOLUTION;
use crate::tolerances::ACCEPT;

impl Sdirk {
    /// Checks the residual of the last stage now and then.
    pub(super) fn certify(&mut self, s: &mut Stepper) {
        // Newton's method checks every solution
        if s.solver.smooth.is_some()
            || s.solver.stats.steps > 8 && !s.solver.stats.steps.is_multiple_of(4 * LOOK)
        {
            return;
        }
        let (n, last) = (s.state.z.len(), self.tableau.stages() - 1);
        let trial = &mut self.trial;
        trial.take_end(self.tableau);
        let (z, guards) = trial.at.x.split_at_mut(n);
        let pairs = s.state.active.iter().zip(&s.state.roles);
        for (i, (g, (&active, &role))) in guards.iter_mut().zip(pairs).enumerate() {
            // a step that is going to be cut may end beyond the root of a guard
            let sign = trial.crossing || role == crate::mlcp::Role::Diode && active;
            *g = self.stage_equations.resistances.multiplier(i, *g, active, role, sign);
        }
        let base = &trial.stages.bases[last];
        let found = self.stage_equations.residual(s, trial.level, base, &trial.at.u, z, guards);
        // what has decayed to rounding of the past has no digits left to be judged
        let noise = |v: &[f64]| v.iter().all(|v| v.abs() <= OF_SOLUTION * self.scales.biggest());
        let whole = self.accepted.is_some_and(|a| a.theta == 1.0) && !(noise(z) && noise(guards));
        if whole || found.worst() <= ACCEPT {
            s.solver.note(found);
        }
    }
}

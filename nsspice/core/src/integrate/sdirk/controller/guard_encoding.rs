//! Multipliers and slacks of pairs as one number each.

use crate::integrate::implicit::stepper::Stepper;
use crate::integrate::sdirk::events::guards::Scales;
use crate::mlcp::Role;

/// Voltages by currents [Ohm], to compare multipliers with slacks.
pub struct Resistances {
    /// the largest voltage by the currents near each pair
    beside: Vec<f64>,
}

impl Resistances {
    pub fn new(pairs: usize) -> Resistances {
        Resistances { beside: vec![1.0; pairs] }
    }

    /// Takes notice of the point where a step begins.
    pub fn begin(&mut self, scales: &Scales) {
        let [voltage, _] = scales.largest;
        for (i, resistance) in self.beside.iter_mut().enumerate() {
            let current = scales.current_beside(i);
            if voltage > 0.0 && current > 0.0 {
                *resistance = voltage / current;
            }
        }
    }

    /// The multiplier of a pair from its guard, of a stage that [`super::stage_equations::Fit`] calls `open` or not.
    pub fn multiplier(&self, i: usize, guard: f64, active: bool, role: Role, open: bool) -> f64 {
        match (active, open && role == Role::Diode) {
            (true, false) => guard,
            (false, false) => 0.0,
            (true, true) => guard.max(0.0),
            (false, true) => (-guard / self.beside[i]).max(0.0),
        }
    }

    /// Multipliers from guards.
    pub fn decode(&self, l: &mut [f64], active: &[bool], roles: &[Role]) {
        for (i, ((l, &active), &role)) in l.iter_mut().zip(active).zip(roles).enumerate() {
            *l = self.multiplier(i, *l, active, role, true);
        }
    }

    /// Guards from multipliers in `x`, see [`super::stage_equations::StageEquations::solve_open`].
    pub fn encode(&self, s: &mut Stepper, x: &mut [f64]) {
        let (z, l) = x.split_at_mut(s.state.z.len());
        s.solver.sys.linear.slacks(z, l, &mut s.solver.scratch.w);
        for (((l, &w), &active), resistance) in
            l.iter_mut().zip(&s.solver.scratch.w).zip(&s.state.active).zip(&self.beside)
        {
            *l = if active { *l - w.max(0.0) / resistance } else { w - l.max(0.0) * resistance };
        }
    }
}

//! Errors at nodes where voltages along a tree are the unknowns: such a voltage is measured by the potentials between
//! which it lies, so that that of a diode which conducts is not followed to its own digits.

use crate::integrate::implicit::stepper::Stepper;
use crate::integrate::sdirk::events::guards::Scales;
use crate::structure::Coordinates;

/// Of each node the error of its potential, by those of all capacitors on the way to ground, and the potentials at both
/// ends of a step.
///
/// What the charge of the node is off by says less: a small capacitor to ground holds the common potential of large
/// ones that hang there.
pub struct Nodes {
    tree: Coordinates,
    /// capacitances that meet in each node [F]
    storage: Vec<f64>,
    /// at which functions store a charge: what they store with differs by powers of ten within a step
    charged: Vec<bool>,
    errors: Vec<f64>,
    first: Vec<f64>,
    last: Vec<f64>,
}

impl Nodes {
    /// Nothing where the unknowns are potentials.
    pub fn new(s: &Stepper) -> Option<Nodes> {
        let zeros = vec![0.0; s.state.z.len()];
        Some(Nodes {
            tree: s.facts.coordinates.clone()?,
            storage: s.facts.node_storage.clone(),
            charged: match &s.solver.smooth {
                Some(smooth) => smooth.charged.clone(),
                None => vec![false; s.state.z.len()],
            },
            errors: zeros.clone(),
            first: zeros.clone(),
            last: zeros,
        })
    }

    /// Takes the errors of unknowns, of which these are `stored`, those of potentials that charges of functions
    /// determine, and the unknowns at both ends of the step.
    pub fn take(&mut self, stored: &[usize], [errors, potentials]: [&[f64]; 2], ends: [&[f64]; 2]) {
        self.errors.fill(0.0);
        for &j in stored {
            self.errors[j] = errors[j];
        }
        self.tree.add_up(&mut self.errors);
        let places = self.charged.iter().zip(&self.storage).zip(potentials);
        for (error, ((&charged, &storage), &own)) in self.errors.iter_mut().zip(places) {
            *error = match (charged, storage > 0.0) {
                (true, _) => own,
                (false, true) => *error,
                (false, false) => 0.0,
            };
        }
        for (potentials, z) in [&mut self.first, &mut self.last].into_iter().zip(ends) {
            potentials.copy_from_slice(z);
            self.tree.add_up(potentials);
        }
    }

    /// Of both nodes of an unknown the error and what it is measured by, of the larger relative error.
    pub fn worse(&self, own: usize, scales: &Scales, ahead: f64, least: f64) -> (f64, f64) {
        let of = |j: usize| {
            let beyond = ahead * (self.last[j] - self.first[j]).abs();
            (self.errors[j].abs(), scales.size_of_potential(j, self.last[j], beyond).max(least))
        };
        let one = of(own);
        let other = usize::try_from(self.tree.before(own)).map_or((0.0, 1.0), of);
        let more = other.0 * one.1 > one.0 * other.1 || other.0.is_nan();
        if more {
            other
        } else {
            one
        }
    }
}

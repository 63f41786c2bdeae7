//! Rows inside long steps: where a polynomial through a few of them gives all, the laws are solved for
//! those alone.
//!
//! The few are at Chebyshev's points, so that the polynomial errs about as little as one of its degree
//! can anywhere in the step (J.-P. Berrut, L. N. Trefethen, *Barycentric Lagrange interpolation*, SIAM
//! Review 46 (2004) 501, doi:10.1137/S0036144502417715).  Between them it is compared with the laws.

use super::polynomial::{basis, Basis, Curve, Moments, POWERS as POINTS};
use super::rows::Inside;
use super::source_outputs::Driven;
use crate::integrate::implicit::stepper::Stepper;
use crate::integrate::sdirk::step::Trial;
use crate::tolerances::CLEARLY;
use std::f64::consts::PI;

/// Points between those of the polynomial at which it is compared with the laws: the first, the middle and
/// the last extremum of its error.
const LOOKS: [usize; 3] = [1, POINTS / 2, POINTS - 1];
/// With fewer rows in a step all of them are solved for.
const WORTH: f64 = 2.0 * (POINTS + LOOKS.len()) as f64;

/// The rows of one step.
pub struct Between {
    /// the part of the step that the polynomial is for
    end: f64,
    curve: Curve,
    basis: Basis,
    /// outputs at the points
    values: Vec<Vec<f64>>,
    driven: Driven,
    /// outputs by the laws and by the polynomial
    exact: Vec<f64>,
    plain: Vec<f64>,
    /// largest outputs so far
    largest: Vec<f64>,
}

/// A place between -1 and 1, at an angle of so many parts of half a turn, of twice as many as points.
fn place(angle: usize) -> f64 {
    -(PI * angle as f64 / (2 * POINTS) as f64).cos()
}

/// Where the polynomial meets the laws.
fn places() -> [f64; POINTS] {
    std::array::from_fn(|k| place(2 * k + 1))
}

impl Between {
    pub fn new(s: &Stepper) -> Between {
        let zeros = vec![0.0; s.recorder.outputs.len()];
        Between {
            end: 1.0,
            curve: Curve::new(zeros.len()),
            basis: basis(&places()),
            values: vec![zeros.clone(); POINTS],
            driven: Driven::new(s),
            exact: zeros.clone(),
            plain: zeros.clone(),
            largest: zeros,
        }
    }

    /// Whether the polynomial gives the rows of a step to a part of the tolerance.
    pub(in crate::integrate::sdirk) fn serves(&mut self, step: &mut Inside) -> bool {
        // steps of fixed length have no tolerance
        let open = step.s.solver.smooth.is_none() || step.trial.crossing || step.tolerance >= 1.0;
        self.end = step.end;
        !open && step.rows >= WORTH && self.agrees(step)
    }

    fn agrees(&mut self, step: &mut Inside) -> bool {
        let Between { end, curve, exact, plain, largest, .. } = self;
        let part = |place: f64| *end * (0.5 + 0.5 * place);
        for (at, row) in places().into_iter().zip(&mut self.values) {
            if !step.by_laws(part(at), row) {
                return false;
            }
            for (largest, v) in largest.iter_mut().zip(row) {
                *largest = largest.max(v.abs());
            }
        }
        curve.join(&self.basis, &self.values);
        LOOKS.iter().all(|look| {
            let at = place(2 * look);
            let solved = step.by_laws(part(at), exact);
            curve.write(at, plain);
            let mut outputs = exact.iter().zip(&*plain).zip(&*largest);
            solved && outputs.all(|((a, b), size)| (a - b).abs() <= CLEARLY * step.tolerance * size)
        })
    }

    /// The outputs at the part `theta` of the step.
    pub(in crate::integrate::sdirk) fn write(
        &self,
        s: &Stepper,
        trial: &mut Trial,
        theta: f64,
        row: &mut [f64],
    ) {
        self.curve.write(self.place(theta), row);
        if !self.driven.is_empty() {
            trial.look_up_sources(s, theta);
            self.driven.write(&trial.at.u, row);
        }
    }

    /// Where the polynomial has the part `theta` of the step.
    pub(in crate::integrate::sdirk) fn place(&self, theta: f64) -> f64 {
        2.0 * theta / self.end - 1.0
    }

    /// Sums of rows.
    pub(in crate::integrate::sdirk) fn write_sums(&self, moments: &Moments, row: &mut [f64]) {
        self.curve.write_sums(moments, row);
        self.driven.write(&moments.sources, row);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of the next power the polynomial errs most where it is compared: by the least possible
    /// error, `2 / 2^POINTS` between -1 and 1.
    #[test]
    fn it_is_compared_where_it_errs_most() {
        let mut curve = Curve::new(1);
        let law = |x: f64| x.powi(POINTS as i32);
        curve.join(&basis(&places()), &places().map(|x| vec![law(x)]));
        let error = |x: f64| {
            let mut row = [0.0];
            curve.write(x, &mut row);
            (row[0] - law(x)).abs()
        };
        let most = 2.0 * 0.5f64.powi(POINTS as i32);
        assert!((-50..=50).all(|k| error(f64::from(k) / 50.0) <= most + 1e-14));
        assert!(LOOKS.iter().all(|look| (error(place(2 * look)) - most).abs() <= 1e-14));
    }
}

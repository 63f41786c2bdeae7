//! Rows inside long steps: where a polynomial through a few of them tells all, the laws are solved for
//! those alone.
//!
//! The few are at Chebyshev's points, so that the polynomial errs about as little as one of its degree
//! can anywhere in the step (J.-P. Berrut, L. N. Trefethen, *Barycentric Lagrange interpolation*, SIAM
//! Review 46 (2004) 501, doi:10.1137/S0036144502417715).  Between them it is compared with the laws.

use super::super::stepper::Stepper;
use super::driven::Driven;
use super::rows::Inside;
use std::f64::consts::PI;

/// Points that the polynomial goes through.
const POINTS: usize = 6;
/// Points between them at which it is compared with the laws: the first, the middle and the last
/// extremum of its error.
const LOOKS: [usize; 3] = [1, POINTS / 2, POINTS - 1];
/// With fewer rows in a step all of them are solved for.
const WORTH: f64 = 2.0 * (POINTS + LOOKS.len()) as f64;
/// Largest distance of the polynomial from the laws, as a part of the tolerance.
const NEAR: f64 = 0.1;

/// Where a polynomial is known, and what it is in each column.
struct Polynomial {
    places: [f64; POINTS],
    weights: [f64; POINTS],
    values: Vec<Vec<f64>>,
}

/// The rows of one step.
pub struct Between {
    /// the part of the step that the polynomial is for
    end: f64,
    polynomial: Polynomial,
    driven: Driven,
    /// outputs by the laws and by the polynomial
    exact: Vec<f64>,
    plain: Vec<f64>,
    /// largest outputs so far
    largest: Vec<f64>,
}

/// The part of the step at an angle of so many parts of half a turn, of twice as many as points.
fn place(angle: usize) -> f64 {
    0.5 - 0.5 * (PI * angle as f64 / (2 * POINTS) as f64).cos()
}

impl Polynomial {
    fn new(columns: usize) -> Polynomial {
        let sign = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let angle = |k: usize| PI * (2 * k + 1) as f64 / (2 * POINTS) as f64;
        Polynomial {
            places: std::array::from_fn(|k| place(2 * k + 1)),
            weights: std::array::from_fn(|k| sign(k) * angle(k).sin()),
            values: vec![vec![0.0; columns]; POINTS],
        }
    }

    /// All columns at a place.
    fn write(&self, place: f64, row: &mut [f64]) {
        let mut shares = [0.0; POINTS];
        for ((share, at), weight) in shares.iter_mut().zip(&self.places).zip(&self.weights) {
            *share = weight / (place - at);
        }
        let sum: f64 = shares.iter().sum();
        if let Some(k) = self.places.iter().position(|at| *at == place) {
            return row.copy_from_slice(&self.values[k]);
        }
        row.fill(0.0);
        for (share, values) in shares.iter().zip(&self.values) {
            let share = share / sum;
            row.iter_mut().zip(values).for_each(|(out, v)| *out += share * v);
        }
    }
}

impl Between {
    pub fn new(s: &Stepper) -> Between {
        let zeros = vec![0.0; s.outputs.len()];
        Between {
            end: 1.0,
            polynomial: Polynomial::new(zeros.len()),
            driven: Driven::new(s),
            exact: zeros.clone(),
            plain: zeros.clone(),
            largest: zeros,
        }
    }

    /// Whether the polynomial gives the rows of a step to a part of the tolerance.
    pub(super) fn serves(&mut self, step: &mut Inside) -> bool {
        // steps of fixed length have no tolerance
        let open = step.s.smooth.is_none() || step.trial.crossing || step.tolerance >= 1.0;
        self.end = step.end;
        !open && step.rows >= WORTH && self.agrees(step)
    }

    fn agrees(&mut self, step: &mut Inside) -> bool {
        let Between { end, polynomial, exact, plain, largest, .. } = self;
        for (at, row) in polynomial.places.iter().zip(&mut polynomial.values) {
            if !step.by_laws(*end * at, row) {
                return false;
            }
            for (largest, v) in largest.iter_mut().zip(row) {
                *largest = largest.max(v.abs());
            }
        }
        LOOKS.iter().all(|look| {
            let at = place(2 * look);
            let solved = step.by_laws(*end * at, exact);
            polynomial.write(at, plain);
            let mut outputs = exact.iter().zip(&*plain).zip(&*largest);
            solved && outputs.all(|((a, b), size)| (a - b).abs() <= NEAR * step.tolerance * size)
        })
    }

    /// The outputs at the part `theta` of the step.
    pub(super) fn write(&self, step: &mut Inside, theta: f64, row: &mut [f64]) {
        self.polynomial.write(theta / self.end, row);
        if !self.driven.is_empty() {
            step.trial.look_up_sources(step.s, theta);
            self.driven.write(&step.trial.u, row);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_met_everywhere() {
        let law = |t: f64| [1.0, (t - 0.3) * (1.0 + t).powi(POINTS as i32 - 2)];
        let mut polynomial = Polynomial::new(2);
        for (at, row) in polynomial.places.iter().zip(&mut polynomial.values) {
            row.copy_from_slice(&law(*at));
        }
        let mut row = [0.0; 2];
        for t in (0..=40).map(|k| f64::from(k) / 40.0).chain(polynomial.places) {
            polynomial.write(t, &mut row);
            for (found, expected) in row.iter().zip(law(t)) {
                assert!((found - expected).abs() <= 1e-13, "{t}: {found} {expected}");
            }
        }
    }

    /// Of the next power the polynomial errs most where it is compared: by the least possible
    /// error, `2 / 4^POINTS`.
    #[test]
    fn it_is_compared_where_it_errs_most() {
        let mut polynomial = Polynomial::new(1);
        let law = |t: f64| t.powi(POINTS as i32);
        for (at, row) in polynomial.places.iter().zip(&mut polynomial.values) {
            row[0] = law(*at);
        }
        let error = |t: f64| {
            let mut row = [0.0];
            polynomial.write(t, &mut row);
            (row[0] - law(t)).abs()
        };
        let most = 2.0 * 0.25f64.powi(POINTS as i32);
        assert!((0..=100).all(|k| error(f64::from(k) / 100.0) <= most + 1e-15));
        assert!(LOOKS.iter().all(|look| (error(place(2 * look)) - most).abs() <= 1e-15));
    }
}

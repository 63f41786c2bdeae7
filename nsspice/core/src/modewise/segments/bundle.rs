//! Functionals along a trajectory, collapsed to factors of its terms.

use crate::dense::{dot, looks};
use crate::modewise::functions::terms::Point;
use std::ops::Range;

/// Functionals along a trajectory.
#[derive(Default)]
pub struct Bundle {
    /// number of functionals
    pub count: usize,
    /// factors by slot
    pub factor: Vec<f64>,
}

/// What several functionals are at one point.
#[derive(Default)]
pub struct Looks {
    /// values
    pub value: Vec<f64>,
    /// derivatives
    pub slope: Vec<f64>,
    /// bounds, from the weights that were given
    pub bound: Vec<f64>,
}

impl Looks {
    /// Makes room for so many.
    pub fn resize(&mut self, count: usize) {
        for list in [&mut self.value, &mut self.slope, &mut self.bound] {
            list.resize(count, 0.0);
        }
    }
}

impl Bundle {
    /// Value of one functional.
    #[inline]
    pub fn value(&self, j: usize, point: &Point) -> f64 {
        let slots = point.value.len();
        dot(&self.factor[j * slots..(j + 1) * slots], &point.value)
    }

    /// Derivative of one functional.
    #[inline]
    pub fn slope(&self, j: usize, point: &Point) -> f64 {
        let slots = point.value.len();
        dot(&self.factor[j * slots..(j + 1) * slots], &point.slope)
    }

    /// Bound from the bounds of the slots.
    #[inline]
    pub fn bound(&self, j: usize, weights: &[f64]) -> f64 {
        let slots = weights.len();
        self.factor[j * slots..(j + 1) * slots].iter().zip(weights).map(|(c, w)| c.abs() * w).sum()
    }

    /// Values, derivatives and bounds of several functionals.
    pub fn look(&self, which: Range<usize>, point: &Point, weights: &[f64], out: &mut Looks) {
        let slots = weights.len();
        let factor = &self.factor[which.start * slots..which.end * slots];
        let out = [&mut out.value, &mut out.slope, &mut out.bound].map(|o| &mut o[which.clone()]);
        looks(factor, [&point.value, &point.slope, weights], out);
    }
}

//! Functionals along a trajectory, collapsed to factors of its terms.

use super::terms::Point;
use crate::dense::dot;

/// Functionals along a trajectory.
#[derive(Default)]
pub struct Bundle {
    /// number of functionals
    pub count: usize,
    /// factors by slot
    pub factor: Vec<f64>,
    /// absolute factors by term
    pub size: Vec<f64>,
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

    /// Bound from the bounds of the terms.
    #[inline]
    pub fn bound(&self, j: usize, terms: &[f64]) -> f64 {
        dot(&self.size[j * terms.len()..(j + 1) * terms.len()], terms)
    }
}

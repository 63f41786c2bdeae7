//! Jacobians of small systems, written where they are factorised.

use super::equations::Equations;
use super::linear::Derivative;
use crate::dense::DenseLu;
use crate::linear::SURVIVES;

/// The scaled Jacobian as a function of the derivatives.
#[derive(Default)]
pub(super) struct Direct {
    /// the linear part, column by column
    linear: Vec<f64>,
    /// where derivatives are added: place, slot, factor
    slopes: Vec<(u32, u32, f64)>,
}

impl Direct {
    /// From the parts of the Jacobian and the weights of its entries, both in the pattern of `eq`.
    pub fn new(eq: &Equations, linear: &[f64], weight: &[f64], entries: &[Derivative]) -> Direct {
        let size = eq.size();
        let mut out = Direct { linear: vec![0.0; size * size], slopes: Vec::new() };
        let mut place = vec![0; linear.len()];
        for c in 0..size {
            for at in eq.pattern.colptr[c]..eq.pattern.colptr[c + 1] {
                place[at] = c * size + eq.pattern.rowidx[at];
                out.linear[place[at]] = linear[at] * weight[at];
            }
        }
        out.slopes.extend(entries.iter().map(|e| {
            let at = e.at as usize;
            (place[at] as u32, e.slot, e.factor * weight[at])
        }));
        out
    }

    /// Factorises the Jacobian in a mode; false if it is singular.
    pub fn factorise(
        &self,
        eq: &Equations,
        slopes: &[f64],
        active: &[bool],
        factor: &mut DenseLu,
    ) -> bool {
        let size = eq.size();
        factor.set_hold(0.0);
        factor.factor_by(size, |lu| {
            lu.copy_from_slice(&self.linear);
            for &(at, slot, f) in &self.slopes {
                lu[at as usize] += f * slopes[slot as usize];
            }
            for (i, _) in active.iter().enumerate().filter(|(_, &a)| !a) {
                let row = eq.n + i;
                lu[row..].iter_mut().step_by(size).for_each(|v| *v = 0.0);
                lu[row * size + row] = 1.0;
            }
        });
        factor.pivot_ratio() > SURVIVES
    }
}

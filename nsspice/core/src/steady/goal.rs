//! A functional of a run: weighted integrals of outputs and of their products, and values at instants.

use super::fourier::Piece;
use super::orbit::Orbit;
use crate::modewise::Passage;

/// A window of time [s].
type Window = [f64; 2];

/// Which value counts at an instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// the left limit at an event, which moves with it
    Left,
    /// the value at a fixed instant
    Fixed,
    /// the right limit at an event, which moves with it
    Right,
}

/// What is differentiated, to first order: a sum of these.
#[derive(Clone, Debug, Default)]
pub struct Goal {
    /// output, window, factor of its integral
    pub integrals: Vec<(usize, Window, f64)>,
    /// output, instant, which value there, factor
    pub values: Vec<(usize, f64, Limit, f64)>,
    /// two outputs, window, factor of the integral of their product
    pub products: Vec<(usize, usize, Window, f64)>,
    /// output, window, angular frequency, phase at the time 0, factor of the integral of the output times the cosine
    pub waves: Vec<(usize, Window, f64, f64, f64)>,
}

/// An instant inside of a passage at which values of outputs count.
pub(super) struct Cut {
    /// since the start of the passage [s]
    pub at: f64,
    /// factor of each output
    pub weights: Vec<f64>,
}

impl Goal {
    /// Whether it names outputs and windows that are there.
    pub fn fits(&self, outputs: usize) -> bool {
        let known = |o: usize| o < outputs;
        self.integrals.iter().all(|i| known(i.0))
            && self.values.iter().all(|v| known(v.0))
            && self.products.iter().all(|p| known(p.0) && known(p.1))
            && self.waves.iter().all(|w| known(w.0))
    }

    /// Constant weights of outputs at an instant that is no end of a window.
    pub(super) fn constant(&self, t: f64, outputs: usize) -> Option<Vec<f64>> {
        let mut out = None;
        for &(o, window, factor) in self.integrals.iter().filter(|i| i.1[0] < t && t < i.1[1]) {
            debug_assert!(window[0] < window[1]);
            out.get_or_insert_with(|| vec![0.0; outputs])[o] += factor;
        }
        out
    }

    /// Factors of values of some kinds at an end of a passage.
    pub(super) fn values_at(&self, t: f64, which: &[Limit], outputs: usize) -> Option<Vec<f64>> {
        let mut out = None;
        for &(o, at, limit, factor) in &self.values {
            if which.contains(&limit) && same(at, t) {
                out.get_or_insert_with(|| vec![0.0; outputs])[o] += factor;
            }
        }
        out
    }

    /// Outputs of which a window begins or ends at an instant.
    pub(super) fn ending_at(&self, t: f64) -> impl Iterator<Item = usize> + '_ {
        let at = move |w: &Window| same(w[0], t) || same(w[1], t);
        let integrals = self.integrals.iter().filter(move |i| at(&i.1)).map(|i| i.0);
        let products = self.products.iter().filter(move |p| at(&p.2)).flat_map(|p| [p.0, p.1]);
        let waves = self.waves.iter().filter(move |w| at(&w.1)).map(|w| w.0);
        integrals.chain(products).chain(waves)
    }

    /// What the functional loses, for each second by which an event comes later, on the side after it, and gains
    /// before it: outputs on both sides and their instants, which differ by a period where it closes.
    pub(super) fn jump(&self, [t0, t1]: [f64; 2], before: &[f64], after: &[f64]) -> f64 {
        // a window that ends at an event is not moved by it
        let inside = |w: &Window| {
            let closed = w[1] >= t0 && w[0] <= t1;
            if t0 == t1 {
                w[0] < t0 && t0 < w[1] && !same(w[0], t0) && !same(w[1], t0)
            } else {
                closed
            }
        };
        let mut sum = 0.0;
        for (o, _, factor) in self.integrals.iter().filter(|i| inside(&i.1)) {
            sum += factor * (before[*o] - after[*o]);
        }
        for (i, j, _, factor) in self.products.iter().filter(|p| inside(&p.2)) {
            sum += factor * (before[*i] * before[*j] - after[*i] * after[*j]);
        }
        for (o, _, omega, phase, factor) in self.waves.iter().filter(|w| inside(&w.1)) {
            let [c0, c1] = [t0, t1].map(|t| (omega * t + phase).cos());
            sum += factor * (before[*o] * c0 - after[*o] * c1);
        }
        sum
    }

    /// Outputs that jumps of which count.
    pub(super) fn integrated(&self) -> impl Iterator<Item = usize> + '_ {
        let products = self.products.iter().flat_map(|p| [p.0, p.1]);
        self.integrals.iter().map(|i| i.0).chain(products).chain(self.waves.iter().map(|w| w.0))
    }
}

/// Whether two instants are one to rounding.
fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 16.0 * f64::EPSILON * a.abs().max(b.abs())
}

impl Orbit {
    /// Where intervals of a passage begin and end, with the values that count there, in rising order.
    pub(super) fn cuts(&self, p: &Passage, goal: &Goal) -> Vec<Cut> {
        let outputs = self.outputs.len();
        let inside = |t: f64| p.start < t && t < p.end && !same(t, p.start) && !same(t, p.end);
        let mut cuts: Vec<Cut> = Vec::new();
        let mut cut = |at: f64, output: Option<(usize, f64)>| {
            let mut weights = vec![0.0; outputs];
            if let Some((o, factor)) = output {
                weights[o] = factor;
            }
            cuts.push(Cut { at, weights });
        };
        for t in goal.integrals.iter().flat_map(|i| i.1).filter(|&t| inside(t)) {
            cut(t - p.start, None);
        }
        for &(o, t, _, factor) in goal.values.iter().filter(|v| inside(v.1)) {
            cut(t - p.start, Some((o, factor)));
        }
        let meets = |w: &Window| w[1] > p.start && w[0] < p.end;
        let mut windows: Vec<(Window, f64)> = Vec::new();
        let mut add = |window: &Window, omega: f64| {
            if !meets(window) {
                return;
            }
            match windows.iter_mut().find(|w| w.0 == *window) {
                Some(known) => known.1 = known.1.max(omega),
                None => windows.push((*window, omega)),
            }
        };
        goal.products.iter().for_each(|p| add(&p.2, 0.0));
        goal.waves.iter().for_each(|w| add(&w.1, w.2.abs()));
        for (window, omega) in windows {
            let piece = self.piece(p, window);
            let mut values = vec![0.0; outputs];
            piece.quadrature(Piece::longest(omega), |t, weight, point| {
                piece.values(point, &mut values);
                let mut weights = vec![0.0; outputs];
                for (i, j, _, factor) in goal.products.iter().filter(|p| p.2 == window) {
                    weights[*i] += weight * factor * values[*j];
                    weights[*j] += weight * factor * values[*i];
                }
                for (o, _, w, phase, factor) in goal.waves.iter().filter(|w| w.1 == window) {
                    weights[*o] += weight * factor * (w * (p.start + t) + phase).cos();
                }
                cuts.push(Cut { at: t, weights });
            });
        }
        cuts.sort_by(|a, b| a.at.total_cmp(&b.at));
        cuts
    }
}

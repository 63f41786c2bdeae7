//! Where the solution of a stage probably lies: polynomials through points found before.

use super::combine::add_rates;
use super::tableau::{Node, Tableau, MOST};
use crate::dense::add_scaled;
use crate::integrate::implicit::smooth::FARTHEST;

/// Where Newton's method begins.
pub struct Beginning {
    pub past: Past,
    guess: Vec<f64>,
}

impl Beginning {
    /// For `stages` of `n` unknowns, `more` guards and functions.
    pub fn new(stages: usize, n: usize, more: usize) -> Beginning {
        Beginning { past: Past::new(stages, n + more), guess: vec![0.0; n] }
    }

    /// The unknowns at the end of stage `i`, see [`Past::predict`].
    pub fn of_stage(
        &mut self,
        tableau: &Tableau,
        i: usize,
        h: f64,
        first: &[f64],
        done: &[Vec<f64>],
    ) -> Option<&[f64]> {
        self.past.predict(tableau, i, h, first, done, &mut self.guess).then_some(&self.guess)
    }

    /// The unknowns of the polynomial through the stages, with these weights of their rates.
    pub fn of_point(
        &mut self,
        h: f64,
        weights: &[f64; MOST],
        first: &[f64],
        rates: &[Vec<f64>],
    ) -> &[f64] {
        self.guess.copy_from_slice(first);
        add_rates(h, weights, rates, &mut self.guess);
        &self.guess
    }
}

/// The points of the last accepted step.
pub struct Past {
    /// ends of its stages, then its begin
    points: Vec<Vec<f64>>,
    /// when they were, counted from the present begin in lengths of the past step; negative
    places: Vec<f64>,
    /// length of that step [s]; zero: there is none, or something has changed since
    length: f64,
}

impl Past {
    pub fn new(points: usize, size: usize) -> Past {
        Past {
            points: vec![vec![0.0; size]; points + 1],
            places: vec![0.0; points + 1],
            length: 0.0,
        }
    }

    /// What lies after says nothing about what comes.
    pub fn forget(&mut self) {
        self.length = 0.0;
    }

    /// Keeps the points of a step that was accepted up to `theta`; the stages are exchanged for
    /// older ones.
    pub fn keep(
        &mut self,
        tableau: &Tableau,
        length: f64,
        theta: f64,
        first: &[f64],
        stages: &mut [Vec<f64>],
    ) {
        self.length = length;
        let last = stages.len();
        for (i, stage) in stages.iter_mut().enumerate() {
            std::mem::swap(&mut self.points[i], stage);
            self.places[i] = tableau.c[i] - theta;
        }
        self.points[last].copy_from_slice(first);
        self.places[last] = -theta;
    }

    /// The unknowns at the end of stage `i` of a step of length `h`, from the stages before it and
    /// the past; false if there is nothing to go by.
    pub fn predict(
        &self,
        tableau: &Tableau,
        i: usize,
        h: f64,
        first: &[f64],
        done: &[Vec<f64>],
        out: &mut [f64],
    ) -> bool {
        let usable = self.length > 0.0 && h <= FARTHEST * self.length;
        let mut known: [(f64, &[f64]); 4] = [(0.0, first); 4];
        let mut count = 0;
        for node in tableau.predictors[i] {
            known[count] = match *node {
                Node::Past(k) if usable => (self.places[k] * self.length / h, &self.points[k]),
                Node::Past(_) => continue,
                Node::Begin => (0.0, first),
                Node::Stage(k) => (tableau.c[k], &done[k]),
            };
            count += 1;
        }
        if count < 2 {
            return false;
        }
        let places = known.map(|(place, _)| place);
        let weights = match count {
            2 => lagrange::<2>(tableau.c[i], &places),
            3 => lagrange::<3>(tableau.c[i], &places),
            _ => lagrange::<4>(tableau.c[i], &places),
        };
        out.fill(0.0);
        for (weight, (_, point)) in weights.iter().zip(&known[..count]) {
            add_scaled(out, *weight, point);
        }
        true
    }
}

/// Weights in the value `at` a place of the polynomial through the first of some points.
fn lagrange<const COUNT: usize>(at: f64, places: &[f64; 4]) -> [f64; 4] {
    let mut weights = [1.0; 4];
    for j in 0..COUNT {
        for k in (0..COUNT).filter(|k| *k != j) {
            weights[j] *= (at - places[k]) / (places[j] - places[k]);
        }
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cubics are predicted exactly where four points are known, parabolas where three are.
    #[test]
    fn polynomials_are_continued() {
        for order in [2, 4] {
            let tableau = Tableau::of_order(order).unwrap();
            let (old, h) = (0.7, 0.3);
            for degree in 0..3 {
                let law = |t: f64| vec![(1.0 + 2.0 * t).powi(degree)];
                let mut past = Past::new(tableau.stages(), 1);
                let theta = 0.9;
                let mut stages: Vec<_> = tableau.c.iter().map(|c| law((c - theta) * old)).collect();
                past.keep(tableau, old, theta, &law(-theta * old), &mut stages);
                let done: Vec<_> = tableau.c.iter().map(|c| law(c * h)).collect();
                for i in tableau.first()..tableau.stages() {
                    let mut out = [0.0];
                    assert!(past.predict(tableau, i, h, &law(0.0), &done[..i], &mut out));
                    assert!((out[0] - done[i][0]).abs() < 1e-13, "{order} {i} {degree}");
                }
                past.forget();
                let first = tableau.first();
                let known = &done[..first];
                assert!(!past.predict(tableau, first, h, &law(0.0), known, &mut [0.0]));
            }
        }
    }
}

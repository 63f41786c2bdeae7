//! What outputs and pairs are on both sides of each event of a run, and averages between instants.

use super::orbit::{at_end, velocity, Orbit};
use crate::modewise::modes::mode::Mode;
use crate::modewise::Passage;

/// An event between two passages.
pub struct Commutation {
    /// when [s]
    pub time: f64,
    /// outputs, left and right limits
    pub outputs: [Vec<f64>; 2],
    /// pairs that conduct before and after
    pub active: [Vec<usize>; 2],
}

impl Orbit {
    /// The events of the last run; of a periodic one that between its end and its beginning is the first.
    pub fn commutations(&self, periodic: bool) -> Vec<Commutation> {
        let count = self.passages.len();
        let first = usize::from(!periodic);
        (first..count)
            .map(|k| {
                let (from, to) = (&self.passages[(k + count - 1) % count], &self.passages[k]);
                let [dx, d, dd] = at_end(from);
                let before = self.values(&from.mode, [&from.last, &from.v, &d], [&dx, &d, &dd]);
                Commutation {
                    time: to.start,
                    outputs: [before, self.at_start(to)],
                    active: [from.mode.active.clone(), to.mode.active.clone()],
                }
            })
            .collect()
    }

    fn at_start(&self, p: &Passage) -> Vec<f64> {
        let (v, d) = (&p.inputs.now, &p.inputs.rate);
        let mut dd = Vec::new();
        p.inputs.curvatures(d, &mut dd);
        self.values(&p.mode, [&p.first, v, d], [&velocity(&p.mode, &p.first, v), d, &dd])
    }

    fn values(&self, mode: &Mode, state: [&[f64]; 3], rates: [&[f64]; 3]) -> Vec<f64> {
        let rows = self.outputs.rows(mode);
        let (mut out, mut sizes) = (vec![0.0; self.outputs.len()], vec![0.0; self.outputs.len()]);
        rows.apply(state, &mut out, &mut sizes);
        rows.add_rates(rates, &mut out);
        out
    }

    /// Integrals of products of outputs between neighbouring instants in rising order, instant by instant.
    pub fn products_between(&self, pairs: &[(usize, usize)], instants: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; pairs.len() * instants.len().saturating_sub(1)];
        let mut first = 0;
        for (window, sums) in instants.windows(2).zip(sums.chunks_exact_mut(pairs.len().max(1))) {
            while self.passages.get(first).is_some_and(|p| p.end <= window[0]) {
                first += 1;
            }
            let inside = self.passages[first..].iter().take_while(|p| p.start < window[1]);
            for p in inside {
                self.piece(p, [window[0], window[1]]).add_products(self.outputs.len(), pairs, sums);
            }
        }
        sums
    }
}

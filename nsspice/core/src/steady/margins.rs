//! How far the beginning of a run has to move in a direction until its modes change.

use super::modal::carry;
use super::orbit::{at_end, entering, Orbit};
use crate::dense::{dot, Matrix};

/// Parts of a direction at which a guard vanishes somewhere in the run and everywhere, to first order.
#[derive(Clone, Copy, Debug)]
pub struct Margin {
    /// pair that the guard watches
    pub pair: usize,
    /// the least part, at which the mode begins to change
    pub first: f64,
    /// the largest
    pub last: f64,
}

impl Orbit {
    /// The parts of a direction (of energy coordinates at the beginning) at which guards vanish at the ends of
    /// segments of the last run, pair by pair; those that never do are left out.
    pub fn margins(&self, direction: &[f64]) -> Vec<Margin> {
        let mut found: Vec<Margin> = Vec::new();
        let mut x = Matrix { rows: direction.len(), cols: 1, data: direction.to_vec() };
        for (k, p) in self.passages.iter().enumerate() {
            if k == 0 {
                for mode in &p.state_jumps {
                    x = mode.leave_x.times(&entering(mode, &x));
                }
                x = entering(&p.mode, &x);
            } else {
                x = self.events[k].after[0].times(&x);
            }
            let start = [&p.first, &p.inputs.now, &p.inputs.rate].map(Clone::clone);
            let begun = x.data.clone();
            carry(&p.mode, p.end - p.start, &mut x);
            let [_, d, _] = at_end(p);
            let end = [p.last.clone(), p.v.clone(), d];
            let rows = &p.mode.guards.rows;
            for (j, &watch) in p.mode.guards.watch.iter().enumerate() {
                let pair = self.pair_of(watch);
                for ([at, v, rate], moved) in [(&start, &begun), (&end, &x.data)] {
                    let slope = dot(rows.x.row(j), moved);
                    let value =
                        dot(rows.x.row(j), at) + dot(rows.v.row(j), v) + dot(rows.d.row(j), rate);
                    let part = -value / slope;
                    if !(part.is_finite() && part > 0.0) {
                        continue;
                    }
                    match found.iter_mut().find(|m| m.pair == pair) {
                        Some(m) => (m.first, m.last) = (m.first.min(part), m.last.max(part)),
                        None => found.push(Margin { pair, first: part, last: part }),
                    }
                }
            }
        }
        found
    }
}

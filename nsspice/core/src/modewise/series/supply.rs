//! What sources bring along a segment, as coefficients of powers of the time.

use super::nodal::Given;
use crate::dense::{complex, Complex};
use crate::modewise::functions::inputs::{Inputs, Segment};
use crate::sparse::Csc;
use crate::structure::Elements;

/// Voltages and currents of sources by `[1; inputs]`.
#[derive(Clone, Debug, Default)]
pub struct Supply {
    /// source or node, input, factor
    volts: Vec<(usize, usize, f64)>,
    entering: Vec<(usize, usize, f64)>,
    sizes: [usize; 2],
    v: Vec<f64>,
}

impl Supply {
    /// Of a network with these columns of sources.
    pub fn new(elements: &Elements, inputs: &Inputs, columns: &Csc) -> Supply {
        let by_input = inputs.columns(columns);
        let (mut volts, mut entering) = (Vec::new(), Vec::new());
        for input in 0..by_input.cols {
            let column = by_input.col(input);
            if column.iter().all(|v| *v == 0.0) {
                continue;
            }
            for (k, branch) in elements.voltages.iter().enumerate() {
                volts.push((k, input, -branch.index.map_or(0.0, |row| column[row])));
            }
            let nodes = elements.entering(&column);
            entering.extend(nodes.into_iter().enumerate().map(|(node, i)| (node, input, i)));
        }
        volts.retain(|entry| entry.2 != 0.0);
        entering.retain(|entry| entry.2 != 0.0);
        let sizes = [elements.voltages.len(), elements.nodes];
        Supply { volts, entering, sizes, v: Vec::new() }
    }

    /// What they bring at order `k`, for a length `h`.
    pub fn coefficient(&mut self, segment: &Segment, k: usize, h: f64, out: &mut Given) {
        let v = &mut self.v;
        v.clear();
        match k {
            0 => v.extend_from_slice(&segment.now),
            1 => v.extend(segment.slope.iter().map(|slope| slope * h)),
            _ => v.resize(segment.now.len(), 0.0),
        }
        if k > 0 {
            for tone in &segment.tones {
                let term = power(tone.rate.scale(h), k) * tone.start;
                (v[tone.index], v[tone.index + 1]) = (term.im, term.re);
            }
            for decay in &segment.decays {
                v[decay.index] = power(complex(decay.rate * h, 0.0), k).re * decay.start;
            }
        }
        let Given { volts, entering } = out;
        for ((list, entries), &size) in
            [(volts, &self.volts), (entering, &self.entering)].into_iter().zip(&self.sizes)
        {
            list.clear();
            list.resize(size, 0.0);
            entries.iter().for_each(|&(at, input, factor)| list[at] += factor * v[input]);
        }
    }
}

/// `x^k / k!`
fn power(x: Complex, k: usize) -> Complex {
    (1..=k).fold(complex(1.0, 0.0), |term, j| (term * x).scale(1.0 / j as f64))
}

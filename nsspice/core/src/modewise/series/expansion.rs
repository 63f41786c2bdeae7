//! Taylor coefficients of all unknowns on a segment.
//!
//! With the states known to order `k` one solve gives all voltages and currents to that order, and those of capacitors
//! and inductors the states to the next one: `x_{k+1} = h / (k + 1) (i / C, v / L)_k`, scaled by powers of the length.
//! The series ends where the next term is below rounding; where that takes too many, the segment is shortened.

use super::super::inputs::{Inputs, Segment};
use super::tableau::{Drive, Tableau};
use crate::dense::{complex, Complex};
use crate::rounding::UNIT;
use crate::sparse::Csc;

/// Terms at most.
pub const TERMS: usize = 24;

/// Sources of a network along a segment.
pub struct Sources<'a> {
    /// the network's sources
    pub inputs: &'a Inputs,
    /// their columns
    pub columns: &'a Csc,
    /// how they go on
    pub segment: &'a Segment,
}

impl Sources<'_> {
    /// What they bring into the equations at order `k`, for a length `h`.
    fn coefficient(&self, k: usize, h: f64, out: &mut [f64]) {
        let mut v = vec![0.0; self.segment.now.len()];
        let segment = self.segment;
        match k {
            0 => v.copy_from_slice(&segment.now),
            1 => v.iter_mut().zip(&segment.slope).for_each(|(v, slope)| *v = slope * h),
            _ => {}
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
        out.fill(0.0);
        if k > 0 && v.iter().all(|v| *v == 0.0) {
            return;
        }
        let count = self.inputs.waveforms().len();
        let u: Vec<f64> = (0..count).map(|w| self.inputs.value_of(w, &v)).collect();
        self.columns.mul_add(1.0, &u, out);
    }
}

/// `x^k / k!`
fn power(x: Complex, k: usize) -> Complex {
    (1..=k).fold(complex(1.0, 0.0), |term, j| (term * x).scale(1.0 / j as f64))
}

/// The coefficients.
#[derive(Default)]
pub struct Expansion {
    /// length of the segment [s]
    pub h: f64,
    /// coefficients of all unknowns
    pub y: Vec<Vec<f64>>,
    /// coefficients of the states, one more
    pub x: Vec<Vec<f64>>,
    /// what sources bring, at this order and the next
    driven: [Vec<f64>; 2],
    rising: Vec<f64>,
    spare: Vec<Vec<f64>>,
}

impl Expansion {
    fn list(&mut self, len: usize) -> Vec<f64> {
        let mut list = self.spare.pop().unwrap_or_default();
        list.clear();
        list.resize(len, 0.0);
        list
    }

    /// Begins at states, those of dependent ones being determined by the others.
    pub fn begin(&mut self, t: &Tableau, states: &[f64], sources: &Sources, h: f64) {
        self.spare.append(&mut self.y);
        self.spare.append(&mut self.x);
        self.h = h;
        let mut first = self.list(t.states());
        for (k, x) in first.iter_mut().enumerate().filter(|(k, _)| t.dependent(*k).is_none()) {
            *x = states[k];
        }
        self.x.push(first);
        let n = sources.columns.nrows;
        self.driven.iter_mut().chain([&mut self.rising]).for_each(|list| list.resize(n, 0.0));
        sources.coefficient(0, h, &mut self.driven[1]);
    }

    /// Adds a term; false where the mode has none.
    pub fn extend(&mut self, t: &mut Tableau, sources: &Sources) -> bool {
        let k = self.y.len();
        self.driven.swap(0, 1);
        sources.coefficient(k + 1, self.h, &mut self.driven[1]);
        let per = (k + 1) as f64 / self.h;
        for (rising, next) in self.rising.iter_mut().zip(&self.driven[1]) {
            *rising = per * next;
        }
        let mut y = self.list(t.size());
        let drive = Drive {
            sources: &self.driven[0],
            rising: &self.rising,
            states: &self.x[k],
            constant: k == 0,
        };
        if !t.solve(&drive, &mut y) {
            return false;
        }
        let mut next = self.list(t.states());
        for (state, x) in next.iter_mut().enumerate() {
            match t.dependent(state) {
                None => *x = t.rate(state, &y) / per,
                Some(_) => self.x[k][state] = t.value(state, &y),
            }
        }
        // what has been found of dependent states drives nothing
        self.x.push(next);
        self.y.push(y);
        true
    }

    /// Adds terms until two in a row are below rounding of the largest voltage and current, since one may vanish where a
    /// source passes zero; shortens the segment where too many would be needed.  False where the mode has none.
    pub fn complete(&mut self, t: &mut Tableau, sources: &Sources, largest: [f64; 2]) -> bool {
        let mut small = 0;
        loop {
            let next = self.next_term(t, largest);
            small = if next <= UNIT { small + 1 } else { 0 };
            if small > 1 && self.y.len() > 1 {
                return true;
            }
            if self.y.len() == TERMS {
                if small == 0 {
                    self.shorten((UNIT / next).powf(1.0 / TERMS as f64));
                }
                return true;
            }
            if !self.extend(t, sources) {
                return false;
            }
        }
    }

    /// The size of the next term, of the states and of what drives them, as a part of the largest values.
    fn next_term(&self, t: &Tableau, [voltage, current]: [f64; 2]) -> f64 {
        let Some(last) = self.x.last() else { return f64::INFINITY };
        let capacitors = t.elements.capacitors.len();
        let mut most = 0.0f64;
        for (state, x) in last.iter().enumerate() {
            let size = if state < capacitors { voltage } else { current };
            most = most.max(x.abs() / size.max(f64::MIN_POSITIVE));
        }
        let ends = &t.elements;
        for branch in &ends.voltages {
            let source = branch.index.map_or(0.0, |row| self.driven[1][row]);
            most = most.max(source.abs() / voltage.max(source.abs()).max(f64::MIN_POSITIVE));
        }
        most
    }

    fn shorten(&mut self, part: f64) {
        self.h *= part;
        for list in [&mut self.y, &mut self.x] {
            let mut factor = 1.0;
            for coefficients in list {
                coefficients.iter_mut().for_each(|c| *c *= factor);
                factor *= part;
            }
        }
    }

    /// All unknowns at a part `s` of the segment.
    pub fn at(&self, s: f64, out: &mut [f64]) {
        horner(&self.y, s, out);
    }

    /// Their rates.
    pub fn rates(&self, s: f64, out: &mut [f64]) {
        out.fill(0.0);
        for (k, y) in self.y.iter().enumerate().skip(1).rev() {
            let factor = k as f64 / self.h;
            out.iter_mut().zip(y).for_each(|(out, y)| *out = *out * s + factor * y);
        }
    }

    /// The states at a part `s` of the segment.
    pub fn states(&self, t: &Tableau, s: f64, out: &mut [f64]) {
        horner(&self.x, s, out);
        for state in (0..out.len()).filter(|&state| t.dependent(state).is_some()) {
            // the last list holds no terms of these
            let known = self.x[..self.y.len()].iter().rev();
            out[state] = known.fold(0.0, |sum, x| sum * s + x[state]);
        }
    }
}

fn horner(coefficients: &[Vec<f64>], s: f64, out: &mut [f64]) {
    out.fill(0.0);
    for c in coefficients.iter().rev() {
        out.iter_mut().zip(c).for_each(|(out, c)| *out = *out * s + c);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::{Branch, Coordinates, Elements};
    use crate::waveform::{Smooth, Waveform};

    #[test]
    fn a_driven_circuit_follows_its_closed_form() {
        // 1 V sin(t) at node 0, 1 Ohm, 1 F from node 1 to ground: v = (sin t - cos t + e^-t) / 2
        let between = |ends, value| Branch { ends, value, index: None };
        let elements = Elements {
            nodes: 3,
            coordinates: Coordinates::of_nodes(3),
            unknowns: vec![0, 1],
            capacitors: vec![between([1, 2], 1.0)],
            resistors: vec![between([0, 1], 1.0)],
            voltages: vec![Branch { ends: [0, 2], value: 0.0, index: Some(2) }],
            ..Elements::default()
        };
        let mut t = Tableau::new(elements, &[]).unwrap();
        let sine = Smooth::Sin {
            offset: 0.0,
            amplitude: 1.0,
            frequency: 0.5 / std::f64::consts::PI,
            delay: 0.0,
            damping: 0.0,
            phase: 0.0,
        };
        let inputs = Inputs::new(vec![Waveform::Smooth(sine)]).unwrap();
        let mut segment = Segment::default();
        inputs.begin(0.0, &mut segment);
        let columns = Csc::from_triplets(3, 1, &[(2, 0, -1.0)]);
        let sources = Sources { inputs: &inputs, columns: &columns, segment: &segment };
        let mut e = Expansion::default();
        e.begin(&t, &[0.0], &sources, 0.8);
        assert!(e.complete(&mut t, &sources, [1.0, 1.0]));
        let (mut y, mut dy) = (vec![0.0; t.size()], vec![0.0; t.size()]);
        for s in [0.0, 0.3, 1.0] {
            let at = s * e.h;
            e.at(s, &mut y);
            e.rates(s, &mut dy);
            let (sin, cos, decay) = (at.sin(), at.cos(), (-at).exp());
            // some twenty terms below 1, each rounded when it is formed and when it is added
            let error = y[1] - 0.5 * (sin - cos + decay);
            assert!(error.abs() < 40.0 * UNIT, "{error} at {at} of {}", e.h);
            // times their orders in the derivative
            assert!((dy[1] - 0.5 * (cos + sin - decay)).abs() < 20.0 * 40.0 * UNIT);
        }
        let mut end = [0.0];
        e.states(&t, 1.0, &mut end);
        assert!((end[0] - y[1]).abs() < 40.0 * UNIT);
    }
}

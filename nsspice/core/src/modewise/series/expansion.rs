//! Taylor coefficients of all unknowns on a segment.
//!
//! With the states known to order `k` one solution gives all voltages and currents to that order, and those of capacitors
//! and inductors the states to the next one: `x_{k+1} = h / (k + 1) (i / C, v / L)_k`, scaled by powers of the length.
//! The series ends where the next term is below rounding; where that takes too many, the segment is shortened.

use super::nodal::{Given, Nodal, Solution};
use super::supply::Supply;
use crate::dense::{largest, polynomials};
use crate::modewise::functions::inputs::Segment;
use crate::rounding::UNIT;

/// Terms at most.
pub const TERMS: usize = 24;

/// The coefficients.
#[derive(Default)]
pub struct Expansion {
    /// length of the segment [s]
    pub h: f64,
    /// unknowns of the network
    pub z: Vec<Vec<f64>>,
    /// multipliers of pairs that conduct, slacks of the others
    pub guards: Vec<Vec<f64>>,
    /// states, one more
    pub x: Vec<Vec<f64>>,
    /// largest voltage and current of each term
    pub sizes: Vec<[f64; 2]>,
    /// what sources bring, at this order and the next
    given: [Given; 2],
    rising: Given,
    solution: Solution,
    spare: [Vec<Vec<f64>>; 3],
}

impl Expansion {
    /// Begins at states, those of dependent ones being determined by the others.
    pub fn begin(&mut self, states: &[f64], (supply, segment): (&mut Supply, &Segment), h: f64) {
        for (spare, list) in self.spare.iter_mut().zip([&mut self.z, &mut self.guards, &mut self.x])
        {
            spare.append(list);
        }
        self.sizes.clear();
        self.h = h;
        let mut first = self.spare[2].pop().unwrap_or_default();
        first.clear();
        first.extend_from_slice(states);
        self.x.push(first);
        supply.coefficient(segment, 0, h, &mut self.given[1]);
    }

    /// Adds a term, whose currents need no more digits than rounding of `enough` leaves (see [`Nodal::solve`]).
    pub fn extend(
        &mut self,
        net: &mut Nodal,
        (supply, segment): (&mut Supply, &Segment),
        enough: f64,
    ) {
        let k = self.z.len();
        self.given.swap(0, 1);
        supply.coefficient(segment, k + 1, self.h, &mut self.given[1]);
        let per = (k + 1) as f64 / self.h;
        let Given { volts, entering } = &mut self.rising;
        for (rising, next) in [(volts, &self.given[1].volts), (entering, &self.given[1].entering)] {
            rising.clear();
            rising.extend(next.iter().map(|next| per * next));
        }
        for one in net.dependent() {
            let others: f64 = one.others.iter().map(|&(other, sign)| sign * self.x[k][other]).sum();
            self.x[k][one.state] = net.forced(one, &self.given[0]) - others;
        }
        let given = (&self.given[0], &self.rising);
        net.solve(given, &self.x[k], (k == 0, enough), &mut self.solution);
        let [of_z, of_guards, of_x] = &mut self.spare;
        let mut z = of_z.pop().unwrap_or_default();
        let mut guards = of_guards.pop().unwrap_or_default();
        let mut next = of_x.pop().unwrap_or_default();
        z.resize(net.unknowns(), 0.0);
        guards.resize(net.offsets.len(), 0.0);
        net.write(&self.solution, &self.x[k], k == 0, [&mut z, &mut guards]);
        self.sizes.push(net.largest(&self.solution));
        next.clear();
        next.extend(self.solution.rates.iter().map(|rate| rate / per));
        net.dependent().iter().for_each(|one| next[one.state] = 0.0);
        self.x.push(next);
        self.z.push(z);
        self.guards.push(guards);
    }

    /// Adds terms until two in a row are below rounding of the largest voltage and current, since one may vanish where a
    /// source passes zero; shortens the segment where too many would be needed.
    pub fn complete(
        &mut self,
        net: &mut Nodal,
        (supply, segment): (&mut Supply, &Segment),
        most: [f64; 2],
    ) {
        let mut small = 0;
        loop {
            let next = self.next_term(net, most);
            small = if next <= UNIT { small + 1 } else { 0 };
            if small > 1 && self.z.len() > 1 {
                return;
            }
            if self.z.len() == TERMS {
                if small == 0 {
                    self.shorten((UNIT / next).powf(1.0 / TERMS as f64));
                }
                return;
            }
            self.extend(net, (supply, segment), most[1]);
        }
    }

    /// The size of the next term, of the states and of what drives them, as a part of the largest values.
    fn next_term(&self, net: &Nodal, [voltage, current]: [f64; 2]) -> f64 {
        let Some(last) = self.x.last() else { return f64::INFINITY };
        let (of_capacitors, of_inductors) = last.split_at(net.elements.capacitors.len());
        let part = |list: &[f64], size: f64| largest(list) / size.max(f64::MIN_POSITIVE);
        let states = part(of_capacitors, voltage).max(part(of_inductors, current));
        let source = largest(&self.given[1].volts);
        states.max(source / voltage.max(source).max(f64::MIN_POSITIVE))
    }

    fn shorten(&mut self, part: f64) {
        self.h *= part;
        for list in [&mut self.z, &mut self.guards, &mut self.x] {
            let mut factor = 1.0;
            for coefficients in list {
                coefficients.iter_mut().for_each(|c| *c *= factor);
                factor *= part;
            }
        }
        let mut factor = 1.0;
        for size in &mut self.sizes {
            *size = size.map(|size| size * factor);
            factor *= part;
        }
    }

    /// The unknowns at a part `s` of the segment.
    pub fn at(&self, s: f64, out: &mut [f64]) {
        if let Some(first) = self.z.first().filter(|_| s == 0.0) {
            return out.copy_from_slice(first);
        }
        polynomials(&self.z, s, out);
    }

    /// Their rates.
    pub fn rates(&self, s: f64, out: &mut [f64]) {
        out.fill(0.0);
        for (k, z) in self.z.iter().enumerate().skip(1).rev() {
            let factor = k as f64 / self.h;
            out.iter_mut().zip(z).for_each(|(out, z)| *out = *out * s + factor * z);
        }
    }

    /// The guards at a part `s` of the segment.
    pub fn guards(&self, s: f64, out: &mut [f64]) {
        polynomials(&self.guards, s, out);
    }

    /// The states at a part `s` of the segment.
    pub fn states(&self, net: &Nodal, s: f64, out: &mut [f64]) {
        polynomials(&self.x, s, out);
        for one in net.dependent() {
            // the last list holds no terms of these
            let known = self.x[..self.z.len()].iter().rev();
            out[one.state] = known.fold(0.0, |sum, x| sum * s + x[one.state]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modewise::functions::inputs::Inputs;
    use crate::sparse::Csc;
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
        let mut supply = Supply::new(&elements, &inputs, &columns);
        let mut net = Nodal::new(elements, &[]).unwrap();
        assert!(net.set_mode(&[]));
        let mut e = Expansion::default();
        e.begin(&[0.0], (&mut supply, &segment), 0.8);
        e.complete(&mut net, (&mut supply, &segment), [1.0, 1.0]);
        let (mut z, mut dz) = (vec![0.0; 3], vec![0.0; 3]);
        for s in [0.0, 0.3, 1.0] {
            let at = s * e.h;
            e.at(s, &mut z);
            e.rates(s, &mut dz);
            let (sin, cos, decay) = (at.sin(), at.cos(), (-at).exp());
            // some twenty terms below 1, each rounded when it is formed and when it is added
            let error = z[1] - 0.5 * (sin - cos + decay);
            assert!(error.abs() < 40.0 * UNIT, "{error} at {at} of {}", e.h);
            // times their orders in the derivative
            assert!((dz[1] - 0.5 * (cos + sin - decay)).abs() < 20.0 * 40.0 * UNIT);
        }
        let mut end = [0.0];
        e.states(&net, 1.0, &mut end);
        assert!((end[0] - z[1]).abs() < 40.0 * UNIT);
    }
}

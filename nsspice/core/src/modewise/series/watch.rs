//! What ends a segment: guards of diodes and controls of switches.

use super::motion::{Begun, Motion};
use super::polynomial::first_root;
use crate::mlcp::Role;
use crate::rounding::{OF_SOLUTION, UNIT};
use crate::switch::Switch;
use std::sync::Arc;

/// What is watched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Watched {
    /// a diode, by its number
    Pair(usize),
    /// the control of a switch
    Switch(usize),
}

/// A diode that is watched.
#[derive(Clone, Copy, Debug)]
pub(super) struct Diode {
    /// its number
    pub at: usize,
    /// its place among the pairs of the elements
    pub pair: usize,
    /// while it conducts
    pub conductance: f64,
}

/// A term of a control.
struct Term {
    unknown: u32,
    /// among the unknowns that have a part in controls
    place: u32,
    factor: f64,
}

/// Switches, and the edges at which they turn next.
pub struct Controls {
    switches: Arc<[Switch]>,
    /// threshold, and the sign of the distance to it
    edges: Vec<(f64, f64)>,
    /// of all controls, and where those of each end
    terms: Vec<Term>,
    ends: Vec<usize>,
    unknowns: Vec<usize>,
    /// how far each of them moves at most
    moves: Vec<f64>,
}

impl Controls {
    /// Of some switches.
    pub fn new(switches: &Arc<[Switch]>) -> Controls {
        let all = switches.iter().flat_map(|s| &s.control);
        let mut unknowns: Vec<usize> = all.map(|term| term.0).collect();
        unknowns.sort_unstable();
        unknowns.dedup();
        let (mut terms, mut ends) = (Vec::new(), vec![0]);
        for switch in switches.iter() {
            terms.extend(switch.control.iter().map(|&(unknown, factor)| {
                let place = unknowns.partition_point(|&other| other < unknown) as u32;
                Term { unknown: unknown as u32, place, factor }
            }));
            ends.push(terms.len());
        }
        let (switches, moves) = (switches.clone(), vec![0.0; unknowns.len()]);
        Controls { switches, edges: Vec::new(), terms, ends, unknowns, moves }
    }

    /// The terms of a control.
    fn terms(&self, s: usize) -> &[Term] {
        &self.terms[self.ends[s]..self.ends[s + 1]]
    }

    /// Takes how far unknowns move.
    fn see_moves(&mut self, coefficients: &[Vec<f64>]) {
        for (moves, &unknown) in self.moves.iter_mut().zip(&self.unknowns) {
            *moves = coefficients.iter().map(|z| z[unknown].abs()).sum();
        }
    }

    /// How far a control moves at most.
    fn moves(&self, s: usize) -> f64 {
        self.terms(s).iter().map(|term| term.factor.abs() * self.moves[term.place as usize]).sum()
    }

    /// Takes the states of the gates, and writes the roles of their pairs.
    pub fn set(&mut self, gates: &[bool], roles: &mut [Role]) {
        self.edges.clear();
        for (switch, &gate) in self.switches.iter().zip(gates) {
            roles[switch.pair] = switch.role(gate);
            self.edges.push(switch.edge(gate));
        }
    }

    /// The distance of a control from its threshold, or a coefficient of it, and the size of its terms.
    fn distance(&self, s: usize, constant: bool, z: &[f64]) -> (f64, f64) {
        let (threshold, sign) = self.edges[s];
        let (mut sum, mut size) = (if constant { -threshold } else { 0.0 }, 0.0);
        for Term { unknown, factor, .. } in self.terms(s) {
            let term = factor * z[*unknown as usize];
            (sum, size) = (sum + term, size + term.abs());
        }
        (sign * sum, size + threshold.abs())
    }
}

impl Motion {
    /// What a guard of a diode is known to where the largest voltage and current are these: the current of a resistance
    /// has the rounding of the voltages around it, and the voltage across a parallel one that of its current.
    fn noise(&self, diode: &Diode, [voltage, current]: [f64; 2]) -> f64 {
        if self.on[diode.at] {
            return self.most_noise(diode, [voltage, current]);
        }
        let g = self.net.beside(diode.pair);
        let through = 2.0 * UNIT * g * voltage + OF_SOLUTION * current;
        self.widened * (through / g).min(OF_SOLUTION * voltage)
    }

    /// A bound of [`Motion::noise`] that does not ask what is parallel to the diode.
    fn most_noise(&self, diode: &Diode, [voltage, current]: [f64; 2]) -> f64 {
        let through = 2.0 * UNIT * diode.conductance * voltage + OF_SOLUTION * current;
        self.widened * if self.on[diode.at] { through } else { OF_SOLUTION * voltage }
    }

    /// The guards that are negative, or become so, judged by so many terms: the first one beyond rounding decides.
    /// The instant is known to a part of the segment.  Notes whether the terms have decided about all.
    pub(super) fn violated(&mut self, late: f64, terms: usize, largest: [f64; 2]) -> Vec<Watched> {
        let e = &self.expansion;
        let sizes: Vec<[f64; 2]> =
            (0..terms).map(|k| if k == 0 { largest } else { self.least(k, largest) }).collect();
        let (mut out, mut decided) = (Vec::new(), 0);
        for diode in &self.diodes {
            let at = diode.at;
            let first = e.guards[0][at] - late * e.guards[1][at].abs();
            if first > self.most_noise(diode, sizes[0]) {
                decided += 1;
                continue;
            }
            for (k, (guards, &sizes)) in e.guards.iter().zip(&sizes).enumerate() {
                let blur = if k == 0 { late * e.guards[1][at].abs() } else { 0.0 };
                if guards[at].abs() > self.noise(diode, sizes) + blur {
                    if guards[at] < 0.0 {
                        out.push(Watched::Pair(at));
                    }
                    decided += 1;
                    break;
                }
            }
        }
        for s in 0..self.controls.switches.len() {
            for (k, z) in e.z[..terms].iter().enumerate() {
                let (distance, size) = self.controls.distance(s, k == 0, z);
                let mut noise = OF_SOLUTION * size;
                if k == 0 {
                    noise += late * self.controls.distance(s, false, &e.z[1]).0.abs();
                }
                if distance.abs() > noise {
                    if distance < 0.0 {
                        out.push(Watched::Switch(s));
                    }
                    decided += 1;
                    break;
                }
            }
        }
        self.decided = decided == self.diodes.len() + self.controls.switches.len();
        out
    }

    /// Where the segment that has been expanded ends.
    pub(super) fn walk(&mut self) -> Option<Begun> {
        let terms = self.expansion.z.len();
        let sizes: Vec<[f64; 2]> = (0..terms)
            .map(|k| if k == 0 { self.largest } else { self.least(k, self.largest) })
            .collect();
        let (mut most, mut ends): (f64, Vec<(f64, Watched)>) = (1.0, Vec::new());
        let mut end = |coefficients: &[f64], watched: Watched| {
            if let Some(root) = first_root(coefficients, most) {
                most = most.min(root);
                ends.push((root, watched));
            }
        };
        let guards = &self.expansion.guards;
        let mut rest = std::mem::take(&mut self.rest);
        rest.clear();
        rest.resize(self.on.len(), 0.0);
        for term in &guards[1..] {
            rest.iter_mut().zip(term).for_each(|(rest, g)| *rest += g.abs());
        }
        let mut own = std::mem::take(&mut self.coefficients);
        for diode in &self.diodes {
            let at = diode.at;
            // nothing that comes later can reach it
            if guards[0][at] > self.most_noise(diode, sizes[0]).max(rest[at]) {
                continue;
            }
            own.clear();
            for (k, term) in guards.iter().enumerate() {
                // a guard that begins at zero is one that rises, over its distance
                if !own.is_empty() || term[at] > self.noise(diode, sizes[k]) {
                    own.push(term[at]);
                }
            }
            if !own.is_empty() {
                end(&own, Watched::Pair(at));
            }
        }
        let mut rests = false;
        self.controls.see_moves(&self.expansion.z[1..]);
        for s in 0..self.controls.switches.len() {
            let (distance, size) = self.controls.distance(s, true, &self.expansion.z[0]);
            if distance > self.controls.moves(s).max(OF_SOLUTION * size) {
                continue;
            }
            own.clear();
            for (k, z) in self.expansion.z.iter().enumerate() {
                let (distance, size) = self.controls.distance(s, k == 0, z);
                if !own.is_empty() || distance > OF_SOLUTION * size {
                    own.push(distance);
                }
            }
            // a control that rests at its threshold is a matter of definition
            rests |= own.is_empty();
            if !own.is_empty() {
                end(&own, Watched::Switch(s));
            }
        }
        (self.rest, self.coefficients) = (rest, own);
        if rests {
            return None;
        }
        ends.retain(|end| end.0 <= most * (1.0 + 4.0 * f64::EPSILON));
        Some(Begun::Lasts(most * self.expansion.h, ends.into_iter().map(|end| end.1).collect()))
    }

    /// The distance of each control from its threshold where the unknowns are these, and what it is known to.
    pub fn controls<'a>(&'a self, z: &'a [f64]) -> impl Iterator<Item = (usize, f64, f64)> + 'a {
        (0..self.controls.switches.len()).map(move |s| {
            let (distance, size) = self.controls.distance(s, true, z);
            (s, distance, OF_SOLUTION * size)
        })
    }

    /// What the controls are known to.
    pub fn doubt(&self, z: &[f64]) -> f64 {
        self.controls(z).fold(0.0, |most, control| f64::max(most, control.2))
    }
}

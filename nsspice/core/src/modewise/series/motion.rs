//! A network in motion: the mode that follows an instant, and how long its segment lasts.

use super::expansion::Expansion;
use super::nodal::{Given, Nodal};
use super::supply::Supply;
use super::watch::{Controls, Diode, Watched};
use crate::mlcp::Role;
use crate::modewise::functions::inputs::{Inputs, Segment};
use crate::rounding::{OF_SOLUTION, UNIT};
use crate::sparse::Csc;
use crate::structure::Elements;
use crate::switch::Switch;
use crate::tolerances::{CLEARLY, NO_JUMP};
use std::collections::HashSet;
use std::sync::Arc;

/// Rounds in which all pairs of the wrong sign are turned over together, before it is one of them.
const TOGETHER: usize = 6;
/// A segment that has to be cut into more parts than this is left to closed forms.
const PARTS: f64 = 64.0;
/// States up to which closed forms are made in less time than a series is.
const FEW: usize = 16;

/// How a segment was begun.
pub enum Begun {
    /// it lasts so long [s], and ends with these guards, or with the time that was given
    Lasts(f64, Vec<Watched>),
    /// the controls of these switches are beyond their thresholds
    Thrown(Vec<usize>),
}

/// A network that is followed by series.
pub struct Motion {
    /// its equations
    pub net: Nodal,
    /// the present segment
    pub expansion: Expansion,
    /// the states at its beginning
    pub states: Vec<f64>,
    /// which pairs are active
    pub on: Vec<bool>,
    pub(super) supply: Supply,
    pub(super) controls: Controls,
    /// largest voltage and current so far
    pub(super) largest: [f64; 2],
    pub(super) diodes: Vec<Diode>,
    /// whether the guards looked at last are all beyond rounding
    pub(super) decided: bool,
    /// by how much more than usual guards are taken for rounding
    pub(super) widened: f64,
    roles: Vec<Role>,
    given: Given,
    pub(super) rest: Vec<f64>,
    pub(super) coefficients: Vec<f64>,
}

impl Motion {
    /// A network with resistances in series with all of its pairs; nothing for any other, and for small ones.
    pub fn new(
        elements: Elements,
        offsets: &[f64],
        switches: &Arc<[Switch]>,
        (inputs, columns): (&Inputs, &Csc),
    ) -> Option<Motion> {
        let stored = elements.capacitors.len() + elements.inductors.len();
        if stored <= FEW || switches.iter().any(|s| s.latching) {
            return None;
        }
        let supply = Supply::new(&elements, inputs, columns);
        let net = Nodal::new(elements, offsets)?;
        Some(Motion {
            states: vec![0.0; net.states()],
            expansion: Expansion::default(),
            on: vec![false; offsets.len()],
            supply,
            controls: Controls::new(switches),
            largest: [0.0; 2],
            diodes: Vec::new(),
            decided: false,
            widened: 1.0,
            roles: Vec::new(),
            given: Given::default(),
            rest: Vec::new(),
            coefficients: Vec::new(),
            net,
        })
    }

    /// Takes the states from the unknowns of the network, and the pairs that are active.
    pub fn enter(&mut self, z: &[f64], on: &[bool]) {
        self.net.states_of(z, &mut self.states);
        self.on.copy_from_slice(on);
    }

    /// Finds the mode from here on, near the present one, and how long it lasts, `horizon` at most [s]; nothing where
    /// there is none of this kind.
    pub fn begin(&mut self, gates: &[bool], segment: &Segment, horizon: f64) -> Option<Begun> {
        self.take_gates(gates);
        if !self.consistent(segment) {
            return None;
        }
        let (mut seen, mut rounds) = (HashSet::new(), 0);
        self.widened = 1.0;
        loop {
            if rounds > 0 && !seen.insert(self.on.clone()) {
                // to and fro: what one mode takes for rounding is beyond it in the other; one after the other leads on
                if rounds > TOGETHER {
                    return None;
                }
                self.widened = 1.0 / CLEARLY;
                rounds = TOGETHER;
                seen.clear();
            }
            if !self.net.set_mode(&self.on) {
                return None;
            }
            self.expansion.begin(&self.states, (&mut self.supply, segment), horizon);
            for _ in 0..2 {
                self.expansion.extend(&mut self.net, (&mut self.supply, segment), 0.0);
            }
            let mut largest = self.sizes();
            let mut violated = self.violated(segment.resolution / horizon, 2, largest);
            if violated.is_empty() {
                let from = (&mut self.supply, segment);
                self.expansion.complete(&mut self.net, from, largest);
                if self.expansion.h * PARTS < horizon {
                    return None;
                }
                largest = self.sizes();
                if !self.decided || self.expansion.h < horizon {
                    let late = segment.resolution / self.expansion.h;
                    violated = self.violated(late, self.expansion.z.len(), largest);
                }
            }
            if self.turn_over(&violated, &mut rounds) {
                continue;
            }
            let switch = |watched: &Watched| match watched {
                Watched::Switch(s) => Some(*s),
                Watched::Pair(_) => None,
            };
            let thrown: Vec<usize> = violated.iter().filter_map(switch).collect();
            if !thrown.is_empty() {
                return Some(Begun::Thrown(thrown));
            }
            self.largest = largest;
            return self.walk();
        }
    }

    /// The pairs that switches open and close, and those that are diodes.
    fn take_gates(&mut self, gates: &[bool]) {
        self.roles.clear();
        self.roles.resize(self.on.len(), Role::Diode);
        self.controls.set(gates, &mut self.roles);
        for (on, role) in self.on.iter_mut().zip(&self.roles) {
            *on = *role == Role::Closed || (*on && *role == Role::Diode);
        }
        self.diodes.clear();
        for (k, pair) in self.net.elements.pairs.iter().enumerate() {
            let diode = pair.index.filter(|&at| self.roles[at] == Role::Diode);
            let conductance = 1.0 / pair.value;
            self.diodes.extend(diode.map(|at| Diode { at, pair: k, conductance }));
        }
    }

    /// Whether what sources force upon dependent states is what these are.
    fn consistent(&mut self, segment: &Segment) -> bool {
        if self.net.dependent().is_empty() {
            return true;
        }
        self.supply.coefficient(segment, 0, 1.0, &mut self.given);
        let capacitors = self.net.elements.capacitors.len();
        self.net.dependent().iter().all(|one| {
            let others = one.others.iter().map(|&(other, sign)| sign * self.states[other]);
            let terms: Vec<f64> = others.chain([self.states[one.state]]).collect();
            let forced = self.net.forced(one, &self.given);
            let kind = usize::from(one.state >= capacitors);
            let size = terms.iter().fold(forced.abs(), |size, term| size.max(term.abs()));
            (terms.iter().sum::<f64>() - forced).abs() <= NO_JUMP * size.max(self.largest[kind])
        })
    }

    /// Turns over what has the wrong sign: everything in the first rounds, then the first in order alone, which never
    /// goes in circles where there is one solution (K. G. Murty, Linear Algebra Appl. 9 (1974) 19).
    fn turn_over(&mut self, violated: &[Watched], rounds: &mut usize) -> bool {
        let pairs = violated.iter().filter_map(|watched| match watched {
            Watched::Pair(at) => Some(*at),
            Watched::Switch(_) => None,
        });
        *rounds += 1;
        if *rounds <= TOGETHER {
            let mut any = false;
            for pair in pairs {
                self.on[pair] = !self.on[pair];
                any = true;
            }
            return any;
        }
        let Some(first) = pairs.min() else { return false };
        self.on[first] = !self.on[first];
        true
    }

    /// The largest voltage and current so far, those at the beginning of the present segment included.
    fn sizes(&self) -> [f64; 2] {
        let [voltage, current] = self.expansion.sizes[0];
        [self.largest[0].max(voltage), self.largest[1].max(current)]
    }

    /// The multipliers at a part of the segment.
    pub fn multipliers(&self, s: f64, l: &mut [f64]) {
        self.expansion.guards(s, l);
        l.iter_mut().zip(&self.on).filter(|(_, on)| !**on).for_each(|(l, _)| *l = 0.0);
    }

    /// Goes to a part of the segment: the states there are those from which the next one begins.
    pub fn leave(&mut self, s: f64, turned: &[Watched]) {
        self.expansion.states(&self.net, s, &mut self.states);
        for watched in turned {
            if let Watched::Pair(at) = *watched {
                self.on[at] = !self.on[at];
            }
        }
    }

    /// Segments by series that cost as many operations as the closed form of the mode: about 25 of the cube of the number
    /// of states for its spectrum (G. H. Golub, C. F. Van Loan, *Matrix Computations*, 4th ed., section 7.5.6), and as
    /// many as an inverse of all equations for its reduction, against two operations of each solution for some ten terms,
    /// and as many once more for guards and rows.
    pub fn worth(&self) -> f64 {
        let equations = self.net.unknowns() + self.on.len();
        let [states, equations] = [self.states.len(), equations].map(|size| (size as f64).powi(3));
        (25.0 * states + 2.0 * equations) / (40.0 * self.net.work() as f64)
    }

    /// A length within which polynomials of degree nine follow the unknowns to rounding [s].
    pub fn smooth_width(&self) -> f64 {
        let e = &self.expansion;
        let mut width = 1.0f64;
        for (k, sizes) in e.sizes.iter().enumerate().skip(10) {
            let sizes = sizes.iter().zip(self.largest);
            let part = sizes.fold(0.0, |most, (size, all)| f64::max(most, size / all));
            if part > 0.0 {
                width = width.min((OF_SOLUTION / part).powf(1.0 / k as f64));
            }
        }
        width * e.h
    }

    /// The largest voltage and current of a term, or what its rounding is measured by where all is at rest.
    pub(super) fn least(&self, k: usize, largest: [f64; 2]) -> [f64; 2] {
        let floor = UNIT / OF_SOLUTION;
        let [voltage, current] = self.expansion.sizes[k];
        [voltage.max(floor * largest[0]), current.max(floor * largest[1])]
    }
}

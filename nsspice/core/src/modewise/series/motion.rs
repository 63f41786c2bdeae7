//! A network in motion: the mode that follows an instant, and how long its segment lasts.

use super::expansion::{Expansion, Sources};
use super::polynomial::first_root;
use super::scout::REGULAR;
use super::tableau::Tableau;
use crate::mlcp::Role;
use crate::rounding::{OF_SOLUTION, UNIT};
use crate::structure::Elements;
use crate::switch::Switch;
use crate::tolerances::NO_JUMP;
use std::collections::HashSet;

/// Rounds in which all pairs of the wrong sign are turned over together, before it is one of them.
const TOGETHER: usize = 6;
/// A segment that has to be cut into more parts than this is left to closed forms.
const PARTS: f64 = 64.0;
/// States up to which closed forms are made in less time than a series is.
const FEW: usize = 16;

/// What is watched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Watched {
    /// a diode, by its number
    Pair(usize),
    /// the control of a switch
    Switch(usize),
}

/// What a guard is made of: unknowns of the tableau with factors, and its constant part.
struct Guard {
    watched: Watched,
    constant: f64,
    terms: Vec<(usize, f64)>,
    /// its largest terms are voltages (0) or currents (1)
    kind: usize,
    /// what it is known to, as a part of the largest voltage and current
    blur: [f64; 2],
}

impl Guard {
    fn value(&self, k: usize, y: &[f64]) -> f64 {
        let constant = if k == 0 { self.constant } else { 0.0 };
        self.terms.iter().fold(constant, |sum, &(at, factor)| sum + factor * y[at])
    }

    fn noise(&self, [voltage, current]: [f64; 2]) -> f64 {
        self.blur[0] * voltage + self.blur[1] * current
    }
}

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
    pub tableau: Tableau,
    /// the present segment
    pub expansion: Expansion,
    /// the states at its beginning
    pub states: Vec<f64>,
    /// which pairs are active
    pub on: Vec<bool>,
    /// the unknowns of the network by those of the tableau
    unknowns: Vec<Vec<(usize, f64)>>,
    /// unknowns of the network that are voltages of capacitors: a difference of potentials has lost digits
    stored: Vec<(usize, usize, f64)>,
    /// largest voltage and current so far
    largest: [f64; 2],
    guards: Vec<Guard>,
    coefficients: Vec<f64>,
}

impl Motion {
    /// A network with resistances in series with all of its pairs; nothing for any other, and for small ones.
    pub fn new(elements: Elements, offsets: &[f64], switches: &[Switch]) -> Option<Motion> {
        let stored = elements.capacitors.len() + elements.inductors.len();
        let ideal = elements.pairs.iter().any(|pair| pair.value == 0.0);
        if stored <= FEW || ideal || switches.iter().any(|s| s.latching) {
            return None;
        }
        let tableau = Tableau::new(elements, offsets)?;
        let (unknowns, stored) = (tableau.unknowns(), tableau.stored());
        let pairs = offsets.len();
        Some(Motion {
            states: vec![0.0; tableau.states()],
            expansion: Expansion::default(),
            on: vec![false; pairs],
            unknowns,
            stored,
            largest: [0.0; 2],
            guards: Vec::new(),
            coefficients: Vec::new(),
            tableau,
        })
    }

    /// Takes the states from the unknowns of the network, and the pairs that are active.
    pub fn enter(&mut self, z: &[f64], on: &[bool]) {
        let mut states = std::mem::take(&mut self.states);
        self.tableau.states_of(z, &mut states);
        self.states = states;
        self.on.copy_from_slice(on);
    }

    /// Finds the mode from here on, near the present one, and how long it lasts, `horizon` at most [s]; nothing where
    /// there is none of this kind.
    pub fn begin(
        &mut self,
        (switches, gates): (&[Switch], &[bool]),
        sources: &Sources,
        horizon: f64,
    ) -> Option<Begun> {
        let mut roles = vec![Role::Diode; self.on.len()];
        for (switch, &gate) in switches.iter().zip(gates) {
            roles[switch.pair] = switch.role(gate);
        }
        for (on, role) in self.on.iter_mut().zip(&roles) {
            *on = *role == Role::Closed || (*on && *role == Role::Diode);
        }
        if !self.consistent(sources) {
            return None;
        }
        let (mut seen, mut rounds) = (HashSet::new(), 0);
        let first = loop {
            if !seen.insert(self.on.clone()) {
                // to and fro: one after the other leads on, or nowhere
                if rounds > TOGETHER {
                    return None;
                }
                rounds = TOGETHER;
                seen.clear();
            }
            if !self.tableau.set_mode(&self.on) || self.tableau.pivot_ratio() < REGULAR {
                return None;
            }
            self.watch((switches, gates), &roles);
            self.expansion.begin(&self.tableau, &self.states, sources, horizon);
            for _ in 0..2 {
                if !self.expansion.extend(&mut self.tableau, sources) {
                    return None;
                }
            }
            let largest = self.sizes();
            let violated = self.violated(sources.segment.resolution / horizon, 2, largest);
            if self.turn_over(&violated, &mut rounds) {
                continue;
            }
            if !violated.is_empty() {
                break violated;
            }
            let (tableau, expansion) = (&mut self.tableau, &mut self.expansion);
            if !expansion.complete(tableau, sources, largest) || expansion.h * PARTS < horizon {
                return None;
            }
            let all = self.expansion.y.len();
            let violated =
                self.violated(sources.segment.resolution / self.expansion.h, all, largest);
            if !self.turn_over(&violated, &mut rounds) {
                break violated;
            }
        };
        let thrown: Vec<usize> = first.iter().filter_map(|v| v.0).collect();
        if !thrown.is_empty() {
            return Some(Begun::Thrown(thrown));
        }
        self.largest = self.sizes();
        self.walk()
    }

    /// Whether what sources force upon dependent states is what these are.
    fn consistent(&self, sources: &Sources) -> bool {
        let t = &self.tableau;
        let mut driven = vec![0.0; sources.columns.nrows];
        let count = sources.inputs.waveforms().len();
        let u: Vec<f64> =
            (0..count).map(|k| sources.inputs.value_of(k, &sources.segment.now)).collect();
        sources.columns.mul_add(1.0, &u, &mut driven);
        (0..t.states()).filter_map(|state| t.dependent(state)).all(|one| {
            let others = one.others.iter().map(|&(other, sign)| sign * self.states[other]);
            let terms: Vec<f64> = others.chain([self.states[one.state]]).collect();
            let forced = t.forced(one, &driven);
            let kind = usize::from(one.state >= t.elements.capacitors.len());
            let size = terms.iter().fold(forced.abs(), |size, term| size.max(term.abs()));
            (terms.iter().sum::<f64>() - forced).abs() <= NO_JUMP * size.max(self.largest[kind])
        })
    }

    /// Turns over what has the wrong sign: everything in the first rounds, then the first in order alone, which never
    /// goes in circles where there is one solution (K. G. Murty, Linear Algebra Appl. 9 (1974) 19).
    fn turn_over(
        &mut self,
        violated: &[(Option<usize>, Option<usize>, f64)],
        rounds: &mut usize,
    ) -> bool {
        let pairs = violated.iter().filter_map(|&(_, pair, much)| pair.map(|pair| (pair, much)));
        *rounds += 1;
        if *rounds <= TOGETHER {
            let mut any = false;
            for (pair, _) in pairs {
                self.on[pair] = !self.on[pair];
                any = true;
            }
            return any;
        }
        let Some(first) = pairs.map(|pair| pair.0).min() else { return false };
        self.on[first] = !self.on[first];
        true
    }

    /// What is to be watched in the mode that has been set.
    fn watch(&mut self, (switches, gates): (&[Switch], &[bool]), roles: &[Role]) {
        self.guards.clear();
        for (k, pair) in self.tableau.elements.pairs.iter().enumerate() {
            let Some(at) = pair.index.filter(|&at| roles[at] == Role::Diode) else { continue };
            let (constant, terms) = self.tableau.guard_terms(k);
            let on = self.tableau.is_on(k);
            let blur = if on { [2.0 * UNIT / pair.value, OF_SOLUTION] } else { [OF_SOLUTION, 0.0] };
            self.guards.push(Guard {
                watched: Watched::Pair(at),
                constant,
                terms,
                kind: usize::from(on),
                blur,
            });
        }
        for (s, switch) in switches.iter().enumerate() {
            let (threshold, sign) = switch.edge(gates[s]);
            let mut terms = Vec::new();
            for &(unknown, factor) in &switch.control {
                let list = self.unknowns[unknown].iter();
                terms.extend(list.map(|&(at, own)| (at, sign * factor * own)));
            }
            let constant = -sign * threshold;
            let blur = [0.0, 0.0];
            self.guards.push(Guard { watched: Watched::Switch(s), constant, terms, kind: 2, blur });
        }
    }

    /// The largest voltage and current so far, those at the beginning of the present segment included.
    fn sizes(&self) -> [f64; 2] {
        let [voltage, current] = self.tableau.largest(&self.expansion.y[0]);
        [self.largest[0].max(voltage), self.largest[1].max(current)]
    }

    /// The largest voltage and current of a term, or what its rounding is measured by where all is at rest.
    fn least(&self, y: &[f64], largest: [f64; 2]) -> [f64; 2] {
        let [voltage, current] = self.tableau.largest(y);
        let floor = UNIT / OF_SOLUTION;
        [voltage.max(floor * largest[0]), current.max(floor * largest[1])]
    }

    /// The guards that are negative, or become so, judged by so many terms: the first one beyond rounding decides.
    /// The instant is known to a part of the segment.
    fn violated(
        &self,
        resolution: f64,
        terms: usize,
        largest: [f64; 2],
    ) -> Vec<(Option<usize>, Option<usize>, f64)> {
        let mut out = Vec::new();
        let y = &self.expansion.y[..terms];
        let sizes: Vec<[f64; 2]> = y
            .iter()
            .enumerate()
            .map(|(k, y)| if k == 0 { largest } else { self.least(y, largest) })
            .collect();
        for guard in &self.guards {
            let slope = guard.value(1, &y[1]);
            for (k, (y, sizes)) in y.iter().zip(&sizes).enumerate() {
                let g = guard.value(k, y);
                let mut noise =
                    guard.noise(*sizes) + if k == 0 { resolution * slope.abs() } else { 0.0 };
                if guard.kind == 2 {
                    let terms = guard.terms.iter().map(|&(at, factor)| (factor * y[at]).abs());
                    noise += OF_SOLUTION * (terms.sum::<f64>() + guard.constant.abs());
                }
                if g.abs() <= noise {
                    continue;
                }
                if g < 0.0 {
                    let much = -g / noise;
                    out.push(match guard.watched {
                        Watched::Pair(at) => (None, Some(at), much),
                        Watched::Switch(s) => (Some(s), None, much),
                    });
                }
                break;
            }
        }
        out
    }

    /// Where the segment that has been expanded ends.
    fn walk(&mut self) -> Option<Begun> {
        let y = &self.expansion.y;
        let sizes: Vec<[f64; 2]> = y.iter().map(|y| self.least(y, self.largest)).collect();
        let (mut most, mut ends): (f64, Vec<(f64, Watched)>) = (1.0, Vec::new());
        for guard in &self.guards {
            self.coefficients.clear();
            for (k, y) in y.iter().enumerate() {
                let g = guard.value(k, y);
                // a guard that begins at zero is one that rises, over its distance
                if self.coefficients.is_empty() {
                    let sizes = if k == 0 { self.largest } else { sizes[k] };
                    let terms = guard.terms.iter().map(|&(at, factor)| (factor * y[at]).abs());
                    let own = if guard.kind == 2 { OF_SOLUTION * terms.sum::<f64>() } else { 0.0 };
                    if g <= guard.noise(sizes) + own {
                        continue;
                    }
                }
                self.coefficients.push(g);
            }
            if self.coefficients.is_empty() {
                match guard.watched {
                    Watched::Pair(_) => continue,
                    // a control that rests at its threshold is a matter of definition
                    Watched::Switch(_) => return None,
                }
            }
            if let Some(root) = first_root(&self.coefficients, most) {
                most = most.min(root);
                ends.push((root, guard.watched));
            }
        }
        ends.retain(|end| end.0 <= most * (1.0 + 4.0 * f64::EPSILON));
        Some(Begun::Lasts(most * self.expansion.h, ends.into_iter().map(|end| end.1).collect()))
    }

    /// The distance of each control from its threshold at a part of the segment, and what it is known to.
    pub fn controls(&self, y: &[f64]) -> impl Iterator<Item = (usize, f64, f64)> + '_ {
        let y = y.to_vec();
        self.guards.iter().filter_map(move |guard| match guard.watched {
            Watched::Switch(s) => {
                let terms = guard.terms.iter().map(|&(at, factor)| (factor * y[at]).abs());
                let size = terms.sum::<f64>() + guard.constant.abs();
                Some((s, guard.value(0, &y), OF_SOLUTION * size))
            }
            Watched::Pair(_) => None,
        })
    }

    /// What the controls are known to.
    pub fn doubt(&self, y: &[f64]) -> f64 {
        self.controls(y).fold(0.0, |most, control| f64::max(most, control.2))
    }

    /// Unknowns and multipliers of the network from those of the tableau, and from the states or their rates.
    pub fn write(&self, y: &[f64], states: &[f64], z: &mut [f64], l: &mut [f64]) {
        for (z, terms) in z.iter_mut().zip(&self.unknowns) {
            *z = terms.iter().map(|&(at, factor)| factor * y[at]).sum();
        }
        self.stored.iter().for_each(|&(j, state, sign)| z[j] = sign * states[state]);
        l.fill(0.0);
        for (k, pair) in self.tableau.elements.pairs.iter().enumerate() {
            if let (Some(at), true) = (pair.index, self.tableau.is_on(k)) {
                l[at] = self.tableau.pair_current(k, y);
            }
        }
    }

    /// Goes to a part of the segment: the states there are those from which the next one begins.
    pub fn leave(&mut self, s: f64, turned: &[Watched]) {
        let mut states = std::mem::take(&mut self.states);
        self.expansion.states(&self.tableau, s, &mut states);
        self.states = states;
        for watched in turned {
            if let Watched::Pair(at) = *watched {
                self.on[at] = !self.on[at];
            }
        }
    }

    /// Segments by series that cost as many operations as the closed form of the mode: about 25 of the cube of the number
    /// of states for its spectrum (G. H. Golub, C. F. Van Loan, *Matrix Computations*, 4th ed., section 7.5.6) against
    /// two solves for each of some ten terms, and as many operations once more for guards and rows.
    pub fn worth(&self) -> f64 {
        let states = self.states.len() as f64;
        25.0 * states.powi(3) / (40.0 * self.tableau.entries() as f64)
    }

    /// A length within which polynomials of degree nine follow the unknowns to rounding [s].
    pub fn smooth_width(&self) -> f64 {
        let e = &self.expansion;
        let mut width = 1.0f64;
        for (k, y) in e.y.iter().enumerate().skip(10) {
            let sizes = self.tableau.largest(y).into_iter().zip(self.largest);
            let part = sizes.fold(0.0, |most, (size, all)| f64::max(most, size / all));
            if part > 0.0 {
                width = width.min((OF_SOLUTION / part).powf(1.0 / k as f64));
            }
        }
        width * e.h
    }
}

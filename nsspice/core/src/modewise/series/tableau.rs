//! One sparse matrix for all modes of a network.
//!
//! Unknowns are node voltages and the currents of sources, capacitors, inductors and pairs, one law for each:
//!
//! ```text
//! node        sum of currents that leave it        = what current sources bring
//! source      v                                    = its voltage
//! capacitor   v                                    = its state
//!   dependent i + sum of +-i_t C / C_t             = C f'       (see `normal_tree`)
//! inductor    i                                    = its state
//!   dependent v + sum of +-v_t L / L_t             = L f'
//! pair        v - series i = offset where it is active,   i = 0 elsewhere
//! ```

use super::normal_tree::{self, Dependent};
use crate::sparse::{Csc, Ordering, SparseLu};
use crate::structure::{Branch, Elements};
use std::sync::Arc;

/// What drives the equations: in terms of the assembled system, sources and what is known of the states.
#[derive(Clone, Copy)]
pub struct Drive<'a> {
    /// what sources bring into each equation of the network
    pub sources: &'a [f64],
    /// its derivative
    pub rising: &'a [f64],
    /// states; of dependent ones the derivative of `f` but for sources
    pub states: &'a [f64],
    /// offsets of pairs take part
    pub constant: bool,
}

/// The matrix, its factors, and where each branch is.
pub struct Tableau {
    /// what it is made of
    pub elements: Elements,
    /// constant slack of each pair
    offsets: Vec<f64>,
    matrix: Csc,
    /// which pairs are active in the factors
    on: Vec<bool>,
    /// which states are dependent in them, and how
    dependent: Vec<Option<Dependent>>,
    factor: SparseLu,
    ordering: Arc<Ordering>,
    /// first row of the sources, of the capacitors, of the inductors, of the pairs
    first: [usize; 4],
    changed: Vec<usize>,
    work: Vec<f64>,
}

impl Tableau {
    /// Of a network without coupled inductors; no pair is active.  States that follow others in every mode do so from
    /// the beginning, as if all pairs had some conductance.
    pub fn new(elements: Elements, offsets: &[f64]) -> Option<Tableau> {
        if !elements.groups.is_empty() {
            return None;
        }
        let nodes = elements.nodes - 1;
        let branches =
            [&elements.voltages, &elements.capacitors, &elements.inductors, &elements.pairs];
        let mut first = [nodes; 4];
        for k in 1..4 {
            first[k] = first[k - 1] + branches[k - 1].len();
        }
        let size = first[3] + elements.pairs.len();
        let mut entries = Vec::new();
        for r in &elements.resistors {
            for (row, of_row) in inner(r, nodes) {
                for (column, of_column) in inner(r, nodes) {
                    entries.push((row, column, of_row * of_column * r.value));
                }
            }
        }
        for (kind, list) in branches.iter().enumerate() {
            for (k, branch) in list.iter().enumerate() {
                let row = first[kind] + k;
                for (node, sign) in inner(branch, nodes) {
                    entries.push((node, row, sign));
                    // laws that change have their places from the beginning
                    entries.push((row, node, if kind == 0 { sign } else { 0.0 }));
                }
                if kind > 0 {
                    entries.push((row, row, 0.0));
                }
            }
        }
        let joining = elements.resistors.iter().chain(&elements.pairs).map(|b| b.ends);
        let mut structural = normal_tree::capacitors(&elements, &[]);
        structural.extend(normal_tree::inductors(&elements, joining));
        let mut dependent = vec![None; first[3] - first[1]];
        for one in structural {
            for &(other, _) in &one.others {
                if one.state < elements.capacitors.len() {
                    entries.push((first[1] + one.state, first[1] + other, 0.0));
                } else {
                    let other = &elements.inductors[other - elements.capacitors.len()];
                    let places = inner(other, nodes);
                    entries.extend(places.map(|(node, _)| (first[1] + one.state, node, 0.0)));
                }
            }
            let at = one.state;
            dependent[at] = Some(one);
        }
        let matrix = Csc::from_triplets(size, size, &entries);
        let ordering = Arc::new(Ordering::new(&matrix, size - first[1]));
        let mut out = Tableau {
            offsets: offsets.to_vec(),
            on: vec![false; elements.pairs.len()],
            dependent,
            factor: SparseLu::new(
                &Csc::zeros(0, 0),
                &Arc::new(Ordering::new(&Csc::zeros(0, 0), 0)),
            ),
            elements,
            matrix,
            ordering,
            first,
            changed: Vec::new(),
            work: vec![0.0; size],
        };
        (out.first[1]..size).for_each(|row| out.write_law(row));
        out.factor = SparseLu::new(&out.matrix, &out.ordering);
        Some(out)
    }

    /// Number of unknowns.
    pub fn size(&self) -> usize {
        self.matrix.nrows
    }

    /// Number of states, dependent ones included.
    pub fn states(&self) -> usize {
        self.dependent.len()
    }

    /// Whether a state follows from others.
    pub fn dependent(&self, state: usize) -> Option<&Dependent> {
        self.dependent[state].as_ref()
    }

    /// The capacitor or inductor of a state.
    pub fn store(&self, state: usize) -> &Branch {
        let capacitors = &self.elements.capacitors;
        capacitors.get(state).unwrap_or_else(|| &self.elements.inductors[state - capacitors.len()])
    }

    fn add(&mut self, row: usize, column: usize, value: f64) {
        let place = self.ordering.row(row).iter().find(|e| e.0 as usize == column);
        if let Some(&(_, at)) = place {
            self.matrix.values[at as usize] += value;
        }
    }

    fn add_voltage(&mut self, row: usize, branch: Branch, factor: f64) {
        for (node, sign) in inner(&branch, self.first[0]) {
            self.add(row, node, factor * sign);
        }
    }

    /// Writes the law of a capacitor, inductor or pair.
    fn write_law(&mut self, row: usize) {
        for &(_, at) in self.ordering.row(row) {
            self.matrix.values[at as usize] = 0.0;
        }
        if row >= self.first[3] {
            let pair = self.elements.pairs[row - self.first[3]];
            if self.on[row - self.first[3]] {
                self.add_voltage(row, pair, 1.0);
                self.add(row, row, -pair.value);
            } else {
                self.add(row, row, 1.0);
            }
            return;
        }
        let state = row - self.first[1];
        let (branch, one) = (*self.store(state), self.dependent[state].clone());
        let capacitor = row < self.first[2];
        if capacitor == one.is_none() {
            self.add_voltage(row, branch, 1.0);
        } else {
            self.add(row, row, 1.0);
        }
        for (other, sign) in one.iter().flat_map(|one| one.others.iter().copied()) {
            let store = *self.store(other);
            let factor = sign * branch.value / store.value;
            if capacitor {
                self.add(row, self.first[1] + other, factor);
            } else {
                self.add_voltage(row, store, factor);
            }
        }
    }

    /// Factorises the matrix of a mode, given by which pairs are active; true if it is regular.
    pub fn set_mode(&mut self, on: &[bool]) -> bool {
        self.changed.clear();
        for k in 0..self.on.len() {
            let active = self.elements.pairs[k].index.is_some_and(|at| on[at]);
            if active != self.on[k] {
                self.on[k] = active;
                self.write_law(self.first[3] + k);
                self.changed.push(self.first[3] + k);
            }
        }
        if !self.changed.is_empty() {
            self.factor.refactor_rows(&self.matrix, &self.changed);
        }
        self.factor.singular().is_none()
    }

    /// How much of the pivots is left of their terms.
    pub fn pivot_ratio(&self) -> f64 {
        self.factor.pivot_ratio()
    }

    /// Solves for all unknowns.
    pub fn solve(&mut self, drive: &Drive, y: &mut [f64]) -> bool {
        let Elements { voltages, pairs, .. } = &self.elements;
        y[..self.first[0]].copy_from_slice(&self.elements.entering(drive.sources)[..self.first[0]]);
        for (branch, y) in voltages.iter().zip(&mut y[self.first[0]..]) {
            *y = source(branch, drive.sources);
        }
        let mut rising = Vec::new();
        for (state, y) in y[self.first[1]..self.first[3]].iter_mut().enumerate() {
            *y = drive.states[state];
            let Some(one) = &self.dependent[state] else { continue };
            if state >= self.elements.capacitors.len() && rising.is_empty() {
                rising = self.elements.entering(drive.rising);
            }
            *y = self.store(state).value * (*y + self.forced_by(one, drive.rising, &rising));
        }
        for ((pair, &on), y) in pairs.iter().zip(&self.on).zip(&mut y[self.first[3]..]) {
            *y = if on && drive.constant { self.offset(pair) } else { 0.0 };
        }
        self.factor.solve(y, &mut self.work).is_ok()
    }

    /// What sources force upon a dependent state and the others that go with it.
    pub fn forced(&self, one: &Dependent, sources: &[f64]) -> f64 {
        self.forced_by(one, sources, &self.elements.entering(sources))
    }

    fn forced_by(&self, one: &Dependent, sources: &[f64], entering: &[f64]) -> f64 {
        let capacitor = one.state < self.elements.capacitors.len();
        let part = |&(from, sign): &(usize, f64)| {
            let list = &self.elements.voltages;
            sign * if capacitor { source(&list[from], sources) } else { entering[from] }
        };
        one.sources.iter().map(part).sum()
    }

    fn offset(&self, pair: &Branch) -> f64 {
        pair.index.map_or(0.0, |at| self.offsets[at])
    }

    /// The voltage of a branch in a solution.
    pub fn voltage(&self, branch: &Branch, y: &[f64]) -> f64 {
        inner(branch, self.first[0]).map(|(node, sign)| sign * y[node]).sum()
    }

    /// The rate of a state in a solution.
    pub fn rate(&self, state: usize, y: &[f64]) -> f64 {
        let branch = self.store(state);
        if state < self.elements.capacitors.len() {
            y[self.first[1] + state] / branch.value
        } else {
            self.voltage(branch, y) / branch.value
        }
    }

    /// A state in a solution.
    pub fn value(&self, state: usize, y: &[f64]) -> f64 {
        if state < self.elements.capacitors.len() {
            self.voltage(self.store(state), y)
        } else {
            y[self.first[1] + state]
        }
    }

    /// The current of a pair in a solution.
    pub fn pair_current(&self, k: usize, y: &[f64]) -> f64 {
        y[self.first[3] + k]
    }

    /// Multiplier of an active pair, slack of another, by its place among the pairs of the elements.
    pub fn guard(&self, k: usize, y: &[f64], constant: bool) -> f64 {
        let pair = &self.elements.pairs[k];
        match self.on[k] {
            true => y[self.first[3] + k],
            false => (if constant { self.offset(pair) } else { 0.0 }) - self.voltage(pair, y),
        }
    }

    /// The largest voltage and the largest current in a solution.
    pub fn largest(&self, y: &[f64]) -> [f64; 2] {
        let (voltages, currents) = y.split_at(self.first[0]);
        [voltages, currents].map(|list| list.iter().fold(0.0, |most, x| f64::max(most, x.abs())))
    }

    /// Whether a pair is active in the factors.
    pub fn is_on(&self, k: usize) -> bool {
        self.on[k]
    }

    /// The states: voltages of capacitors and currents of inductors, from the unknowns of the network.
    pub fn states_of(&self, z: &[f64], out: &mut Vec<f64>) {
        let potentials = self.elements.potentials(z);
        out.clear();
        let Elements { capacitors, inductors, .. } = &self.elements;
        out.extend(capacitors.iter().map(|c| potentials[c.ends[0]] - potentials[c.ends[1]]));
        out.extend(inductors.iter().map(|l| l.index.map_or(0.0, |row| z[row])));
    }
}

/// The nodes of a branch but for ground, with the signs of their voltages in its own.
fn inner(branch: &Branch, nodes: usize) -> impl Iterator<Item = (usize, f64)> + Clone {
    let [plus, minus] = branch.ends;
    let both = [(plus, 1.0), (minus, -1.0)];
    both.into_iter().filter(move |end| end.0 < nodes)
}

/// The voltage of a source.
fn source(branch: &Branch, list: &[f64]) -> f64 {
    -branch.index.map_or(0.0, |row| list[row])
}

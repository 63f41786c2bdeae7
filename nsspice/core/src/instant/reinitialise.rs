//! The four problems of an instant, see the module.

use super::mixed::{solve, Mixed, OneWay};
use crate::descriptor::Linear;
use crate::mlcp::Role;
use crate::sparse::Csc;
use crate::structure::{Basis, Branch, Elements, Law, Network};

/// Voltages that differ by no more than this part of the largest are one: each is a sum of up to some thousand
/// terms.
const ROUNDING: f64 = 4096.0 * f64::EPSILON;
/// Networks with more branches are left to sparse methods: the loops of one forest grow with their square.
const MOST: usize = 2000;

/// What is known from before.
#[derive(Clone, Copy)]
pub enum Before<'a> {
    /// charges and fluxes, one for each equation
    Stored(&'a [f64]),
    /// unknowns
    State(&'a [f64]),
}

/// The state right after an instant.
pub struct Consistent {
    /// unknowns
    pub z: Vec<f64>,
    /// rates of those that store something
    pub rates: Vec<f64>,
    /// multipliers
    pub l: Vec<f64>,
    /// pairs that conduct from here on
    pub active: Vec<bool>,
    /// pairs through which charges have passed
    pub through: Vec<bool>,
    /// impulses of the unknowns and of the multipliers [A s]
    pub impulses: [Vec<f64>; 2],
}

/// Finds the states right after instants of one network.
pub struct Reinitialiser {
    elements: Elements,
    sources: Csc,
    offsets: Vec<f64>,
    /// the network holds no inductor whose current could be cut off, whatever pairs do
    size: usize,
    pairs: usize,
}

impl Reinitialiser {
    /// Prepares a network; nothing if it holds elements that are not known here, or if the current of an inductor
    /// may have no way.
    pub fn new(
        linear: &Linear,
        capacitors: &[(isize, isize, f64)],
        resistors: &[(isize, isize, f64)],
    ) -> Option<Reinitialiser> {
        let elements = Elements::read(linear, capacitors, resistors)?;
        let branches = [
            &elements.capacitors,
            &elements.resistors,
            &elements.voltages,
            &elements.pairs,
            &elements.inductors,
        ];
        let all: usize = branches.iter().map(|list| list.len()).sum();
        if all > MOST {
            return None;
        }
        let ends: Vec<[usize; 2]> =
            branches[..3].iter().flat_map(|list| list.iter().map(|b| b.ends)).collect();
        let spanning = Basis::new(elements.nodes, &ends, 0..ends.len()).tree.len() + 1;
        if spanning < elements.nodes {
            return None;
        }
        Some(Reinitialiser {
            elements,
            sources: linear.s.clone(),
            offsets: linear.q.clone(),
            size: linear.g.nrows,
            pairs: linear.a.ncols,
        })
    }

    /// The state right after an instant, with the sources `u`, their slopes and the roles of all pairs; nothing if
    /// it was not found.
    pub fn after(
        &self,
        before: Before,
        [u, slopes]: [&[f64]; 2],
        roles: &[Role],
    ) -> Option<Consistent> {
        let instant = Instant::new(self, [u, slopes], roles);
        instant.solve(before)
    }

    fn ground(&self) -> usize {
        self.elements.nodes - 1
    }
}

/// One instant.
struct Instant<'a> {
    r: &'a Reinitialiser,
    roles: &'a [Role],
    /// what sources bring into each equation, and its rate
    driven: Vec<f64>,
    rising: Vec<f64>,
}

/// A network under construction, with the branches that its parts began with.
struct Draft {
    network: Network,
}

impl Draft {
    fn new(nodes: usize) -> Draft {
        let (ends, laws) = (Vec::new(), Vec::new());
        Draft { network: Network { nodes, ends, laws, injected: vec![0.0; nodes] } }
    }

    /// Adds branches and returns the range that they take.
    fn add(
        &mut self,
        branches: &[Branch],
        law: impl Fn(usize, &Branch) -> Law,
    ) -> std::ops::Range<usize> {
        let first = self.network.laws.len();
        for (k, branch) in branches.iter().enumerate() {
            self.network.ends.push(branch.ends);
            self.network.laws.push(law(k, branch));
        }
        first..self.network.laws.len()
    }

    /// Lets a current leave the positive end of a branch and enter the negative one.
    fn carry(&mut self, branch: &Branch, current: f64) {
        self.network.injected[branch.ends[0]] -= current;
        self.network.injected[branch.ends[1]] += current;
    }
}

impl<'a> Instant<'a> {
    fn new(r: &'a Reinitialiser, [u, slopes]: [&[f64]; 2], roles: &'a [Role]) -> Instant<'a> {
        let right = |u: &[f64]| {
            let mut out = vec![0.0; r.size];
            r.sources.mul_add(1.0, u, &mut out);
            out
        };
        Instant { r, roles, driven: right(u), rising: right(slopes) }
    }

    fn elements(&self) -> &'a Elements {
        &self.r.elements
    }

    fn role(&self, pair: &Branch) -> Role {
        pair.index.map_or(Role::Open, |k| self.roles[k])
    }

    fn offset(&self, pair: &Branch) -> f64 {
        pair.index.map_or(0.0, |k| self.r.offsets[k])
    }

    /// The voltage of a source.
    fn source(&self, list: &[f64], branch: &Branch) -> f64 {
        -branch.index.map_or(0.0, |row| list[row])
    }

    /// What current sources inject.
    fn inject(&self, list: &[f64], draft: &mut Draft) {
        for (node, &unknown) in self.elements().unknowns.iter().enumerate() {
            draft.network.injected[node] += list[unknown];
        }
    }

    /// Closed switches, as branches with or without resistance.
    fn closed(&self) -> Vec<Branch> {
        let pairs = self.elements().pairs.iter();
        pairs.filter(|p| self.role(p) == Role::Closed).copied().collect()
    }

    fn closed_law(&self, branch: &Branch) -> Law {
        let offset = self.offset(branch);
        if branch.value > 0.0 {
            Law::Weighted { weight: 1.0 / branch.value, offset }
        } else {
            Law::Fixed(offset)
        }
    }

    /// Pairs that decide for themselves.
    fn diodes(&self) -> Vec<Branch> {
        let pairs = self.elements().pairs.iter();
        pairs.filter(|p| self.role(p) == Role::Diode).copied().collect()
    }

    fn way(&self, pair: &Branch) -> OneWay {
        OneWay { ends: pair.ends, offset: self.offset(pair), series: pair.value }
    }

    fn solve(&self, before: Before) -> Option<Consistent> {
        let mut out = Consistent {
            z: vec![0.0; self.r.size],
            rates: vec![0.0; self.r.size],
            l: vec![0.0; self.r.pairs],
            active: self.roles.iter().map(|&r| r == Role::Closed).collect(),
            through: vec![false; self.r.pairs],
            impulses: [vec![0.0; self.r.size], vec![0.0; self.r.pairs]],
        };
        let stored = self.charges(before, &mut out)?;
        // with a way around every pair no flux jumps
        for inductor in &self.elements().inductors {
            let Some(row) = inductor.index else { continue };
            out.z[row] = match before {
                Before::Stored(fluxes) => fluxes[row] / inductor.value,
                Before::State(z) => z[row],
            };
        }
        let values = self.values(&stored, &mut out)?;
        self.rates(&stored, &values, &mut out)?;
        Some(out)
    }

    /// The voltages of the capacitors after the jump, and the charges that it moves.
    fn charges(&self, before: Before, out: &mut Consistent) -> Option<Vec<f64>> {
        let elements = self.elements();
        let mut draft = Draft::new(elements.nodes);
        let voltages =
            draft.add(&elements.voltages, |_, b| Law::Fixed(self.source(&self.driven, b)));
        let switches: Vec<Branch> = self.closed().into_iter().filter(|b| b.value == 0.0).collect();
        let closed = draft.add(&switches, |_, b| self.closed_law(b));
        let held = match before {
            Before::Stored(_) => vec![0.0; elements.capacitors.len()],
            Before::State(z) => {
                let v = elements.potentials(z);
                elements.capacitors.iter().map(|c| v[c.ends[0]] - v[c.ends[1]]).collect()
            }
        };
        let capacitors = draft
            .add(&elements.capacitors, |k, c| Law::Weighted { weight: c.value, offset: held[k] });
        if let Before::Stored(charges) = before {
            self.inject(charges, &mut draft);
        }
        let diodes: Vec<Branch> = self.diodes().into_iter().filter(|b| b.value == 0.0).collect();
        let ways: Vec<OneWay> = diodes.iter().map(|d| self.way(d)).collect();
        let found = solve(&draft.network, &ways)?;
        let [unknowns, multipliers] = &mut out.impulses;
        for (branch, at) in elements.voltages.iter().zip(voltages) {
            branch.index.iter().for_each(|&row| unknowns[row] = found.flow.current[at]);
        }
        for (branch, at) in switches.iter().zip(closed) {
            branch.index.iter().for_each(|&pair| multipliers[pair] = found.flow.current[at]);
        }
        for ((branch, &charge), &closed) in diodes.iter().zip(&found.carried).zip(&found.closed) {
            let Some(pair) = branch.index else { continue };
            multipliers[pair] = charge;
            out.through[pair] = closed;
        }
        Some(found.flow.voltage[capacitors].to_vec())
    }

    /// Diodes whose ends capacitors, sources and closed switches join: their voltages are given, and currents
    /// through them a matter of rates.
    fn rigid(&self) -> impl Fn(&Branch) -> bool {
        let elements = self.elements();
        let mut ends: Vec<[usize; 2]> = Vec::new();
        ends.extend(elements.voltages.iter().chain(&elements.capacitors).map(|b| b.ends));
        ends.extend(self.closed().iter().filter(|b| b.value == 0.0).map(|b| b.ends));
        let basis = Basis::new(elements.nodes, &ends, 0..ends.len());
        move |branch: &Branch| branch.value == 0.0 && basis.joins(branch.ends[0], branch.ends[1])
    }

    /// Potentials and the currents of resistors, with charges and fluxes as they are.
    fn values(&self, stored: &[f64], out: &mut Consistent) -> Option<Values> {
        let elements = self.elements();
        let mut draft = Draft::new(elements.nodes);
        draft.add(&elements.voltages, |_, b| Law::Fixed(self.source(&self.driven, b)));
        let switches = self.closed();
        draft.add(&switches, |_, b| self.closed_law(b));
        draft.add(&elements.capacitors, |k, _| Law::Fixed(stored[k]));
        let resistors =
            draft.add(&elements.resistors, |_, r| Law::Weighted { weight: r.value, offset: 0.0 });
        self.inject(&self.driven, &mut draft);
        for inductor in &elements.inductors {
            draft.carry(inductor, inductor.index.map_or(0.0, |row| out.z[row]));
        }
        let rigid = self.rigid();
        let diodes: Vec<Branch> = self.diodes().into_iter().filter(|d| !rigid(d)).collect();
        let ways: Vec<OneWay> = diodes.iter().map(|d| self.way(d)).collect();
        let found = solve(&draft.network, &ways)?;
        for (node, &unknown) in elements.unknowns.iter().enumerate() {
            out.z[unknown] = found.potentials[node] - found.potentials[self.r.ground()];
        }
        for (inductor, row) in elements.inductors.iter().filter_map(|l| Some((l, l.index?))) {
            let [plus, minus] = inductor.ends;
            out.rates[row] = (found.potentials[plus] - found.potentials[minus]) / inductor.value;
        }
        let currents = found.flow.current[resistors].to_vec();
        for (resistor, &current) in elements.resistors.iter().zip(&currents) {
            resistor.index.iter().for_each(|&row| out.z[row] = current);
        }
        Some(Values { found, diodes, currents })
    }

    /// The rates of capacitors, and currents that flow in loops of them.
    fn rates(&self, stored: &[f64], values: &Values, out: &mut Consistent) -> Option<()> {
        let elements = self.elements();
        let Values { found, diodes, currents } = values;
        let mut draft = Draft::new(elements.nodes);
        let voltages =
            draft.add(&elements.voltages, |_, b| Law::Fixed(self.source(&self.rising, b)));
        let switches: Vec<Branch> = self.closed().into_iter().filter(|b| b.value == 0.0).collect();
        let closed = draft.add(&switches, |_, _| Law::Fixed(0.0));
        draft.add(&elements.capacitors, |_, c| Law::Weighted { weight: c.value, offset: 0.0 });
        self.inject(&self.driven, &mut draft);
        for (resistor, &current) in elements.resistors.iter().zip(currents) {
            draft.carry(resistor, current);
        }
        for inductor in &elements.inductors {
            draft.carry(inductor, inductor.index.map_or(0.0, |row| out.z[row]));
        }
        for switch in self.closed().iter().filter(|b| b.value > 0.0) {
            let [plus, minus] = switch.ends;
            let across = found.potentials[plus] - found.potentials[minus] - self.offset(switch);
            let current = across / switch.value;
            draft.carry(switch, current);
            switch.index.iter().for_each(|&pair| out.l[pair] = current);
        }
        for ((diode, &current), &conducts) in diodes.iter().zip(&found.carried).zip(&found.closed) {
            draft.carry(diode, current);
            let Some(pair) = diode.index else { continue };
            out.l[pair] = current;
            out.active[pair] = conducts;
        }
        // those that rest on both their limits
        let volts = found.potentials.iter().chain(stored).fold(0.0f64, |a, v| a.max(v.abs()));
        let rigid = self.rigid();
        let rests = |d: &Branch| {
            let [plus, minus] = d.ends;
            let slack = self.offset(d) - (found.potentials[plus] - found.potentials[minus]);
            let carried = d.index.is_some_and(|pair| out.impulses[1][pair] > 0.0);
            rigid(d) && (carried || slack <= ROUNDING * volts.max(self.offset(d).abs()))
        };
        let resting: Vec<Branch> = self.diodes().into_iter().filter(rests).collect();
        let ways: Vec<OneWay> =
            resting.iter().map(|d| OneWay { ends: d.ends, offset: 0.0, series: 0.0 }).collect();
        let rates = solve(&draft.network, &ways)?;
        for (node, &unknown) in elements.unknowns.iter().enumerate() {
            out.rates[unknown] = rates.potentials[node] - rates.potentials[self.r.ground()];
        }
        for (branch, at) in elements.voltages.iter().zip(voltages) {
            branch.index.iter().for_each(|&row| out.z[row] = rates.flow.current[at]);
        }
        for (branch, at) in switches.iter().zip(closed) {
            branch.index.iter().for_each(|&pair| out.l[pair] = rates.flow.current[at]);
        }
        for ((branch, &current), &conducts) in resting.iter().zip(&rates.carried).zip(&rates.closed)
        {
            let Some(pair) = branch.index else { continue };
            out.l[pair] = current;
            out.active[pair] = conducts;
        }
        Some(())
    }
}

/// What the third problem has found.
struct Values {
    found: Mixed,
    /// the one-way branches that took part
    diodes: Vec<Branch>,
    /// of the resistors
    currents: Vec<f64>,
}

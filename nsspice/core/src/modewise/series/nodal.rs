//! The equations of a network between two instants, with what is stored as sources.
//!
//! Capacitors and sources of a forest join nodes to clusters whose voltages inside are known; inductors bring known
//! currents.  What is left are the potentials of the clusters, by conductances alone ([`Stars`]).  Currents of capacitors
//! and sources are then what their cut-sets have to carry, voltages of inductors differences of potentials.
//!
//! Where states follow from others ([`normal_tree`]): a capacitor that closes a loop carries what keeps its voltage
//! there, and a part of the network that inductors alone lead to has the potential at which the sum of their currents
//! stays what it is, by the same elimination with `1 / L` as conductances.

use super::normal_tree::Dependent;
use super::stars::Stars;
use crate::dense::{largest, Matrix};
use crate::structure::{Branch, Elements};

/// What sources bring: voltages, and currents that enter nodes.
#[derive(Clone, Debug, Default)]
pub struct Given {
    /// of each source
    pub volts: Vec<f64>,
    /// of each node
    pub entering: Vec<f64>,
}

/// A solution.
#[derive(Clone, Debug, Default)]
pub struct Solution {
    /// potentials of the nodes, ground last
    pub potentials: Vec<f64>,
    /// current and voltage of each joint
    pub currents: Vec<f64>,
    /// see `currents`
    pub across: Vec<f64>,
    /// currents of sources and capacitors
    pub flows: Vec<f64>,
    /// rates of the states
    pub rates: Vec<f64>,
}

/// All resistors and pairs between two nodes.
pub(super) struct Joint {
    pub(super) ends: [usize; 2],
    /// clusters of its ends
    pub(super) clusters: [usize; 2],
}

/// An unknown of the network.
#[derive(Clone, Copy)]
pub(super) enum Unknown {
    Between(usize, usize),
    /// the voltage of a capacitor, which a difference of potentials has fewer digits of
    Stored(usize, f64),
    Source(usize),
    Inductor(usize),
    Resistor(usize),
}

/// What is watched of a pair: factors of the current and the voltage of its joint, and a constant.
#[derive(Clone, Copy)]
pub(super) struct Guard {
    at: u32,
    joint: u32,
    factors: [f64; 3],
}

/// A branch of the forest, seen from the node that it leads to.
pub(super) struct Reached {
    pub(super) node: usize,
    pub(super) before: usize,
    pub(super) branch: usize,
    pub(super) sign: f64,
}

/// The network, and the factors of a mode.
pub struct Nodal {
    /// what it is made of
    pub elements: Elements,
    /// constant slack of each pair
    pub offsets: Vec<f64>,
    pub(super) forest: Vec<Reached>,
    /// of each node; ground's is the last
    pub(super) cluster: Vec<usize>,
    pub(super) joints: Vec<Joint>,
    /// what each unknown of the network is
    pub(super) unknowns: Vec<Unknown>,
    /// joint and direction of each pair and resistor
    pub(super) of_pair: Vec<(usize, f64)>,
    pub(super) of_resistor: Vec<(usize, f64)>,
    pub(super) dependent: Vec<Dependent>,
    /// currents of capacitors in loops by what they miss
    pub(super) loops: Matrix,
    pub(super) stars: Stars,
    /// nodes in parts that have no way to ground but through inductors, the parts between which these are, and how far
    /// the potentials of each are moved
    pub(super) part: Vec<(usize, usize)>,
    pub(super) between: Vec<[usize; 2]>,
    pub(super) shifts: Vec<f64>,
    pub(super) floating: Option<Stars>,
    pub(super) on: Vec<bool>,
    /// of each joint: conductance of the resistors, and of all
    pub(super) fixed: Vec<f64>,
    pub(super) conductance: Vec<f64>,
    pub(super) steepest: f64,
    /// number of pairs that conduct
    pub(super) conduct: Vec<u32>,
    pub(super) guards: Vec<Guard>,
    /// what the offsets of pairs that conduct drive through each joint
    pub(super) driven: Vec<f64>,
    pub(super) work: [Vec<f64>; 4],
    pub(super) known: Vec<f64>,
}

impl Nodal {
    /// The sum of the rates of the other capacitors in a loop.
    pub(super) fn moved(&self, one: &Dependent, flows: &[f64]) -> f64 {
        let (first, capacitors) = (self.elements.voltages.len(), &self.elements.capacitors);
        let rate =
            |&(other, sign): &(usize, f64)| sign * flows[first + other] / capacitors[other].value;
        one.others.iter().map(rate).sum()
    }

    /// Number of states, dependent ones included.
    pub fn states(&self) -> usize {
        self.elements.capacitors.len() + self.elements.inductors.len()
    }

    /// The states that follow from others, and how they do.
    pub fn dependent(&self) -> &[Dependent] {
        &self.dependent
    }

    /// What sources force upon a dependent state and the others that go with it.
    pub fn forced(&self, one: &Dependent, given: &Given) -> f64 {
        let capacitor = one.state < self.elements.capacitors.len();
        let list = if capacitor { &given.volts } else { &given.entering };
        one.sources.iter().map(|&(from, sign)| sign * list[from]).sum()
    }

    /// Operations of a solution, and of an elimination.
    pub fn work(&self) -> usize {
        2 * self.stars.work() + 4 * self.joints.len() + 4 * self.elements.nodes
    }

    /// Eliminates the clusters of a mode, given by which pairs conduct; true if it is regular.
    pub fn set_mode(&mut self, on: &[bool]) -> bool {
        for (own, pair) in self.on.iter_mut().zip(&self.elements.pairs) {
            *own = pair.index.is_some_and(|at| on[at]);
        }
        self.conductance.copy_from_slice(&self.fixed);
        self.driven.fill(0.0);
        self.conduct.fill(0);
        let pairs = self.elements.pairs.iter().zip(&self.of_pair).zip(&self.on);
        for ((pair, &(joint, sign)), _) in pairs.clone().filter(|pair| *pair.1) {
            self.conductance[joint] += 1.0 / pair.value;
            self.driven[joint] += sign * self.offset(pair) / pair.value;
            self.conduct[joint] += 1;
        }
        self.steepest = largest(&self.conductance);
        self.guards.clear();
        for ((pair, &(joint, sign)), &on) in pairs {
            let Some(at) = pair.index else { continue };
            let offset = self.offset(pair);
            let factors = match on {
                // alone it carries all of the current but for what resistors parallel to it do
                true if self.conduct[joint] == 1 => [sign, -sign * self.fixed[joint], 0.0],
                true => [0.0, sign / pair.value, -offset / pair.value],
                false => [0.0, -sign, offset],
            };
            self.guards.push(Guard { at: at as u32, joint: joint as u32, factors });
        }
        self.stars.set(&self.conductance)
    }

    /// The constant slack of a pair.
    fn offset(&self, pair: &Branch) -> f64 {
        pair.index.map_or(0.0, |at| self.offsets[at])
    }

    /// Solves for potentials, currents and rates.  The states that depend on others are those that do so; `rising` is the
    /// derivative of what is given, and offsets of pairs take part where the terms are `constant`.  Currents are known to
    /// the rounding of the largest current, or to that of `enough`.
    pub fn solve(
        &mut self,
        (given, rising): (&Given, &Given),
        states: &[f64],
        (constant, enough): (bool, f64),
        out: &mut Solution,
    ) {
        let Elements { inductors, capacitors, voltages, nodes, .. } = &self.elements;
        let (nodes, clusters) = (*nodes, self.work[1].len() - 1);
        let [enters, sums, more, found] = &mut self.work;
        let Solution { potentials, currents, across, flows, rates } = out;
        potentials.resize(nodes, 0.0);
        currents.resize(self.joints.len(), 0.0);
        across.resize(self.joints.len(), 0.0);
        flows.resize(self.known.len(), 0.0);
        rates.resize(states.len(), 0.0);
        self.known[..voltages.len()].copy_from_slice(&given.volts);
        self.known[voltages.len()..].copy_from_slice(&states[..capacitors.len()]);
        potentials.fill(0.0);
        for step in &self.forest {
            potentials[step.node] = potentials[step.before] + step.sign * self.known[step.branch];
        }
        enters.copy_from_slice(&given.entering);
        for (l, i) in inductors.iter().zip(&states[capacitors.len()..]) {
            enters[l.ends[0]] -= i;
            enters[l.ends[1]] += i;
        }
        sums.fill(0.0);
        let offset = if constant { 1.0 } else { 0.0 };
        enters.iter().zip(&self.cluster).for_each(|(i, &k)| sums[k] += i);
        more.copy_from_slice(sums);
        for ((joint, i), (g, driven)) in
            self.joints.iter().zip(&mut *currents).zip(self.conductance.iter().zip(&self.driven))
        {
            let [a, b] = joint.ends;
            *i = g * (potentials[a] - potentials[b]) - offset * driven;
            let [a, b] = joint.clusters;
            sums[a] -= *i;
            sums[b] += *i;
        }
        sums[clusters] = 0.0;
        self.stars.solve(&mut sums[..clusters]);
        found.copy_from_slice(sums);
        move_currents(&self.joints, &self.conductance, found, currents);
        // the second round leaves of Kirchhoff's law the rounding of currents, not that of what potentials drive
        if self.steepest * largest(potentials).max(largest(found)) > enough {
            for (joint, i) in self.joints.iter().zip(&*currents) {
                let [a, b] = joint.clusters;
                more[a] -= i;
                more[b] += i;
            }
            more[clusters] = 0.0;
            self.stars.solve(&mut more[..clusters]);
            found.iter_mut().zip(&*more).for_each(|(sum, v)| *sum += v);
            move_currents(&self.joints, &self.conductance, more, currents);
        }
        potentials.iter_mut().zip(&self.cluster).for_each(|(v, &k)| *v += found[k]);
        if let Some(floating) = &self.floating {
            let shifts = &mut self.shifts;
            shifts.fill(0.0);
            let ground = shifts.len() - 1;
            self.part.iter().for_each(|&(node, part)| shifts[part] += rising.entering[node]);
            for (l, [a, b]) in inductors.iter().zip(&self.between) {
                let rate = (potentials[l.ends[0]] - potentials[l.ends[1]]) / l.value;
                shifts[*a] -= rate;
                shifts[*b] += rate;
            }
            floating.solve(&mut shifts[..ground]);
            self.part.iter().for_each(|&(node, part)| potentials[node] += shifts[part]);
        }
        for (k, (joint, g)) in self.joints.iter().zip(&self.conductance).enumerate() {
            let [a, b] = joint.ends;
            across[k] = match *g > 0.0 {
                true => (currents[k] + offset * self.driven[k]) / g,
                false => potentials[a] - potentials[b],
            };
            enters[a] -= currents[k];
            enters[b] += currents[k];
        }
        carry(&self.forest, enters, flows);
        self.close_loops(rising, out);
        let Solution { potentials, flows, rates, .. } = out;
        let Elements { inductors, capacitors, voltages, .. } = &self.elements;
        let (of_capacitors, of_inductors) = rates.split_at_mut(capacitors.len());
        for ((rate, c), i) in of_capacitors.iter_mut().zip(capacitors).zip(&flows[voltages.len()..])
        {
            *rate = i / c.value;
        }
        for (rate, l) in of_inductors.iter_mut().zip(inductors) {
            *rate = (potentials[l.ends[0]] - potentials[l.ends[1]]) / l.value;
        }
    }

    /// Adds the currents of the capacitors that close loops.
    fn close_loops(&mut self, rising: &Given, out: &mut Solution) {
        let closing = &self.dependent[..self.loops.rows];
        if closing.is_empty() {
            return;
        }
        let first = self.elements.voltages.len();
        let missed: Vec<f64> = closing
            .iter()
            .map(|one| self.forced(one, rising) - self.moved(one, &out.flows))
            .collect();
        let mut found = vec![0.0; closing.len()];
        self.loops.apply(&missed, &mut found);
        let (mut sums, mut flows) = (vec![0.0; self.elements.nodes], vec![0.0; out.flows.len()]);
        for (one, i) in closing.iter().zip(&found) {
            let [plus, minus] = self.elements.capacitors[one.state].ends;
            sums[plus] -= i;
            sums[minus] += i;
        }
        carry(&self.forest, &mut sums, &mut flows);
        out.flows.iter_mut().zip(&flows).for_each(|(all, more)| *all += more);
        closing.iter().zip(&found).for_each(|(one, i)| out.flows[first + one.state] = *i);
    }

    /// Unknowns of the network, and guards of all pairs by their numbers, in a solution with these states.
    pub fn write(
        &self,
        of: &Solution,
        states: &[f64],
        constant: bool,
        [z, guards]: [&mut [f64]; 2],
    ) {
        for (z, unknown) in z.iter_mut().zip(&self.unknowns) {
            *z = match *unknown {
                Unknown::Between(a, b) => of.potentials[a] - of.potentials[b],
                Unknown::Stored(state, sign) => sign * states[state],
                Unknown::Source(k) => of.flows[k],
                Unknown::Inductor(state) => states[state],
                Unknown::Resistor(k) => {
                    let (joint, sign) = self.of_resistor[k];
                    sign * self.elements.resistors[k].value * of.across[joint]
                }
            };
        }
        let constant = if constant { 1.0 } else { 0.0 };
        for Guard { at, joint, factors: [of_current, of_voltage, offset] } in &self.guards {
            let joint = *joint as usize;
            guards[*at as usize] =
                of_current * of.currents[joint] + of_voltage * of.across[joint] + constant * offset;
        }
    }

    /// Number of unknowns of the network.
    pub fn unknowns(&self) -> usize {
        self.unknowns.len()
    }

    /// The conductance between the ends of a pair.
    pub fn beside(&self, k: usize) -> f64 {
        self.conductance[self.of_pair[k].0]
    }

    /// The largest voltage and the largest current in a solution.
    pub fn largest(&self, of: &Solution) -> [f64; 2] {
        [largest(&of.potentials), largest(&of.currents).max(largest(&of.flows))]
    }

    /// The states: voltages of capacitors and currents of inductors, from the unknowns of the network.
    pub fn states_of(&self, z: &[f64], out: &mut Vec<f64>) {
        let Elements { capacitors, inductors, .. } = &self.elements;
        out.clear();
        out.extend(capacitors.iter().map(|c| self.elements.voltage(z, c.ends)));
        out.extend(inductors.iter().map(|l| l.index.map_or(0.0, |row| z[row])));
    }
}

/// Changes the currents of joints by those of the potentials of clusters.
fn move_currents(joints: &[Joint], conductance: &[f64], clusters: &[f64], currents: &mut [f64]) {
    for ((joint, i), g) in joints.iter().zip(currents).zip(conductance) {
        let [a, b] = joint.clusters;
        *i += g * (clusters[a] - clusters[b]);
    }
}

/// What has to leave each node passes the branch of the forest that leads to it.
pub(super) fn carry(forest: &[Reached], sums: &mut [f64], flows: &mut [f64]) {
    for step in forest.iter().rev() {
        flows[step.branch] = step.sign * sums[step.node];
        sums[step.before] += sums[step.node];
    }
}

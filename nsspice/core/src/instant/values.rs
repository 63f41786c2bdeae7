//! Currents and voltages that follow from what is stored.

use super::active_set::{Mixed, OneWay};
use super::network_builder::Draft;
use super::reinitialise::{Consistent, Instant};
use crate::mlcp::Role;
use crate::structure::{Basis, Branch, Coupled, Law};
use std::ops::Range;

/// Values right after an instant.
pub struct Values {
    /// of all nodes
    pub potentials: Vec<f64>,
    /// of the resistors
    pub currents: Vec<f64>,
    /// pairs that decide for themselves, and how far each is from conducting
    pub diodes: Vec<Branch>,
    /// see `diodes`
    pub slack: Vec<f64>,
    /// of voltages
    pub rounding: f64,
}

/// Voltages of branches, by list.
struct Given<'a> {
    lists: [(&'a [Branch], Range<usize>); 4],
    found: Mixed,
}

impl Instant<'_> {
    /// Potentials and the currents of resistors, with charges and fluxes as they are.
    pub fn values(&self, charged: &[f64], out: &mut Consistent) -> Option<Values> {
        let elements = self.elements();
        let mut draft = Draft::new(elements.nodes);
        let voltages =
            draft.add(&elements.voltages, |_, b| Law::Fixed(self.source(&self.driven, b)));
        let switches = self.pairs(Role::Closed);
        let closed = draft.add(&switches, |_, b| self.closed_law(b));
        let capacitors = draft.add(&elements.capacitors, |k, _| Law::Fixed(charged[k]));
        let resistors =
            draft.add(&elements.resistors, |_, r| Law::Weighted { weight: r.value, offset: 0.0 });
        draft.inject(&elements.entering(&self.driven));
        let windings = self.carry_inductors(&mut draft, out);
        let diodes = self.pairs(Role::Diode);
        let ways: Vec<OneWay> = diodes.iter().map(|d| self.way(d)).collect();
        let found = draft.solve(&ways, &self.potentials)?;
        let currents = found.flow.current[resistors.clone()].to_vec();
        for ((diode, &current), &closed) in diodes.iter().zip(&found.carried).zip(&found.closed) {
            let Some(pair) = diode.index else { continue };
            (out.l[pair], out.active[pair]) = (current, closed);
        }
        for (branch, at) in windings {
            branch.index.iter().for_each(|&row| out.z[row] = found.flow.current[at]);
        }
        let lists = [
            (&elements.voltages[..], voltages),
            (&switches, closed),
            (&elements.capacitors, capacitors),
            (&elements.resistors, resistors),
        ];
        let given = Given { lists, found };
        let (potentials, slack, rounding) = self.potentials_by_rates(given, &diodes, out)?;
        elements.put(&potentials, &mut out.z);
        for (inductor, row) in elements.inductors.iter().filter_map(|l| Some((l, l.index?))) {
            let [plus, minus] = inductor.ends;
            out.rates[row] = (potentials[plus] - potentials[minus]) / inductor.value;
        }
        for group in &elements.groups {
            // of which the rates of the fluxes are the voltages of the cores
            let across = |k: usize| {
                let [plus, minus] = group.windings[k].ends;
                potentials[plus] - potentials[minus]
            };
            let rates = group.currents(&group.fluxes_of(across));
            for (winding, rate) in group.windings.iter().zip(rates) {
                winding.index.iter().for_each(|&row| out.rates[row] = rate);
            }
        }
        for (resistor, &current) in elements.resistors.iter().zip(&currents) {
            resistor.index.iter().for_each(|&row| out.z[row] = current);
        }
        Some(Values { potentials, currents, diodes, slack, rounding })
    }

    /// Lets inductors carry their currents; the branches whose currents are not determined by their fluxes, and where
    /// they are.
    pub fn carry_inductors(&self, draft: &mut Draft, out: &Consistent) -> Vec<(Branch, usize)> {
        let elements = self.elements();
        let leaking = elements.groups.iter().filter(|group| group.leaks());
        for inductor in elements.inductors.iter().chain(leaking.flat_map(|g| &g.windings)) {
            draft.carry(inductor, inductor.index.map_or(0.0, |row| out.z[row]));
        }
        let mut found = Vec::new();
        for (group, fluxes) in self.tight() {
            let [windings, _] = draft.wind(group, fluxes, false);
            found.extend(group.windings.iter().copied().zip(windings));
        }
        found
    }

    /// Potentials of all nodes, with those of parts that only inductors and blocking pairs join to others: the
    /// rates of currents must balance there.  Pairs that carry nothing yet may begin to.
    fn potentials_by_rates(
        &self,
        Given { lists, found }: Given,
        diodes: &[Branch],
        out: &mut Consistent,
    ) -> Option<(Vec<f64>, Vec<f64>, f64)> {
        let elements = self.elements();
        // what loose branches drive through is none
        let nothing = found.current_rounding.max(self.nothing);
        let carries = |d: &Branch| d.index.is_some_and(|k| out.l[k] > nothing);
        let conducts = |d: &&Branch| carries(d);
        let conducting: Vec<Branch> = diodes.iter().filter(conducts).copied().collect();
        let all = lists.iter().flat_map(|(list, _)| list.iter()).chain(&conducting);
        let ends: Vec<[usize; 2]> = all.map(|b| b.ends).collect();
        let rigid = Basis::new(elements.nodes, &ends, 0..ends.len());
        let cores: usize = elements.groups.iter().map(Coupled::cores).sum();
        if rigid.roots().count() == 1 + cores {
            return Some((found.potentials, found.slack, found.rounding));
        }
        // the common potential of windings that float is left to the motion that closes a pair
        let windings = elements.groups.iter().flat_map(|g| &g.windings).chain(&elements.inductors);
        let joined = ends.iter().copied().chain(windings.map(|w| w.ends)).collect::<Vec<_>>();
        let parts = Basis::new(elements.nodes, &joined, 0..joined.len()).roots().count();
        if cores > 0 && parts > 1 + cores {
            return None;
        }
        let mut draft = Draft::new(elements.nodes);
        for (list, at) in lists {
            let voltages = &found.flow.voltage[at];
            draft.add(list, |k, _| Law::Fixed(voltages[k]));
        }
        let v = &found.potentials;
        draft.add(&conducting, |_, d| Law::Fixed(v[d.ends[0]] - v[d.ends[1]]));
        let moves = |b: &&Branch| !rigid.joins(b.ends[0], b.ends[1]);
        let inductors: Vec<Branch> = elements.inductors.iter().filter(moves).copied().collect();
        draft.add(&inductors, |_, l| Law::Weighted { weight: 1.0 / l.value, offset: 0.0 });
        for group in elements.groups.iter().filter(|g| g.windings.iter().any(|w| moves(&w))) {
            draft.wind(group, &vec![0.0; group.cores()], true);
        }
        draft.inject(&elements.entering(&self.rising));
        let free: Vec<Branch> = diodes.iter().filter(moves).copied().collect();
        let way = |d: &Branch| OneWay { ends: d.ends, offset: self.offset(d), series: 0.0 };
        let ways: Vec<OneWay> = free.iter().map(way).collect();
        let rates = draft.solve(&ways, &self.potentials)?;
        for (diode, &closed) in free.iter().zip(&rates.closed) {
            diode.index.iter().for_each(|&pair| out.active[pair] = closed);
        }
        let v = &rates.potentials;
        let drop = |d: &Branch| d.value * d.index.map_or(0.0, |pair| out.l[pair]);
        let slack = |d: &Branch| self.offset(d) + drop(d) - (v[d.ends[0]] - v[d.ends[1]]);
        let slacks = diodes.iter().map(slack).collect();
        Some((rates.potentials, slacks, found.rounding.max(rates.rounding)))
    }
}

//! What capacitors and inductors store after the instant.

use super::active_set::OneWay;
use super::network_builder::Draft;
use super::reinitialise::{Before, Consistent, Instant};
use crate::mlcp::Role;
use crate::structure::{Basis, Branch, Coupled, Law};

impl Instant<'_> {
    /// The voltages of the capacitors after the jump, and the charges that it moves.
    pub fn charges(&self, before: Before, out: &mut Consistent) -> Option<Vec<f64>> {
        let elements = self.elements();
        let mut draft = Draft::new(elements.nodes);
        let voltages =
            draft.add(&elements.voltages, |_, b| Law::Fixed(self.source(&self.driven, b)));
        let switches = self.ideal(Role::Closed);
        let closed = draft.add(&switches, |_, b| self.closed_law(b));
        let held = |c: &Branch| match before {
            Before::Stored(_) => 0.0,
            Before::State(z) => elements.voltage(z, c.ends),
        };
        let capacitors = draft
            .add(&elements.capacitors, |_, c| Law::Weighted { weight: c.value, offset: held(c) });
        let mut windings = Vec::new();
        for (group, fluxes) in self.tight() {
            let [at, _] = draft.wind(group, &vec![0.0; fluxes.len()], false);
            windings.extend(group.windings.iter().zip(at));
        }
        if let Before::Stored(charges) = before {
            draft.inject(&elements.entering(charges));
        }
        let diodes = self.ideal(Role::Diode);
        let ways: Vec<OneWay> = diodes.iter().map(|d| self.way(d)).collect();
        let found = draft.solve(&ways, &self.potentials)?;
        let [unknowns, multipliers] = &mut out.impulses;
        for (branch, at) in elements.voltages.iter().zip(voltages) {
            branch.index.iter().for_each(|&row| unknowns[row] = found.flow.current[at]);
        }
        for (winding, at) in windings {
            winding.index.iter().for_each(|&row| unknowns[row] = found.flow.current[at]);
        }
        for (branch, at) in switches.iter().zip(closed) {
            branch.index.iter().for_each(|&pair| multipliers[pair] = found.flow.current[at]);
        }
        for ((branch, &charge), &closed) in diodes.iter().zip(&found.carried).zip(&found.closed) {
            let Some(pair) = branch.index else { continue };
            // where no capacitor is, loose branches alone say what is closed, and drive what flows there
            if closed && charge > found.loose {
                (multipliers[pair], out.through[pair]) = (charge, true);
            }
        }
        Some(found.flow.voltage[capacitors].to_vec())
    }

    /// The currents of the inductors after the jump, and the impulses of the potentials where those had no way;
    /// returns the pairs that blocked such an impulse.
    ///
    /// Across everything through which a current may change in no time there is no impulse: sources, capacitors,
    /// resistors, closed switches.
    pub fn jump_of_fluxes(&mut self, before: Before, out: &mut Consistent) -> Option<Vec<usize>> {
        let elements = self.elements();
        for inductor in &elements.inductors {
            let Some(row) = inductor.index else { continue };
            out.z[row] = match before {
                Before::Stored(fluxes) => fluxes[row] / inductor.value,
                Before::State(z) => z[row],
            };
        }
        self.carry_fluxes(out);
        let mut draft = Draft::new(elements.nodes);
        let mut ends = Vec::new();
        let closed = self.pairs(Role::Closed);
        for list in [&elements.voltages, &elements.capacitors, &elements.resistors, &closed] {
            draft.add(list, |_, _| Law::Fixed(0.0));
            ends.extend(list.iter().map(|b| b.ends));
        }
        let still = Basis::new(elements.nodes, &ends, 0..ends.len());
        let moves = |b: &&Branch| !still.joins(b.ends[0], b.ends[1]);
        let inductors: Vec<Branch> = elements.inductors.iter().filter(moves).copied().collect();
        let moving = |group: &Coupled| group.windings.iter().any(|w| moves(&w));
        let groups: Vec<usize> =
            (0..elements.groups.len()).filter(|&k| moving(&elements.groups[k])).collect();
        if inductors.is_empty() && groups.is_empty() {
            return Some(Vec::new());
        }
        let flux = |l: &Branch| l.value * l.index.map_or(0.0, |row| out.z[row]);
        let laws =
            draft.add(&inductors, |_, l| Law::Weighted { weight: 1.0 / l.value, offset: -flux(l) });
        let cores: Vec<_> = groups
            .iter()
            .map(|&k| draft.wind(&elements.groups[k], &self.fluxes[k], true)[1].clone())
            .collect();
        draft.inject(&elements.entering(&self.driven));
        for inductor in elements.inductors.iter().filter(|l| !moves(l)) {
            draft.carry(inductor, inductor.index.map_or(0.0, |row| out.z[row]));
        }
        let diodes: Vec<Branch> =
            self.pairs(Role::Diode).into_iter().filter(|d| moves(&d)).collect();
        let way = |d: &Branch| OneWay { ends: d.ends, offset: 0.0, series: 0.0 };
        let ways: Vec<OneWay> = diodes.iter().map(way).collect();
        let nothing = vec![0.0; elements.nodes];
        let found = draft.solve(&ways, &nothing)?;
        let all = laws.clone().chain(cores.iter().flat_map(Clone::clone));
        let jumps = all.into_iter().any(|at| found.flow.voltage[at] != 0.0);
        if !jumps {
            return Some(Vec::new());
        }
        for (inductor, at) in inductors.iter().zip(laws) {
            inductor.index.iter().for_each(|&row| out.z[row] = found.flow.current[at]);
        }
        for (&k, cores) in groups.iter().zip(&cores) {
            self.fluxes[k].copy_from_slice(&found.flow.current[cores.clone()]);
        }
        self.carry_fluxes(out);
        elements.put(&found.potentials, &mut out.impulses[0]);
        let blocked = |(_, slack): &(&Branch, &f64)| **slack > found.rounding;
        Some(diodes.iter().zip(&found.slack).filter(blocked).filter_map(|(d, _)| d.index).collect())
    }

    /// The currents determined by the fluxes of cores.
    fn carry_fluxes(&self, out: &mut Consistent) {
        for (group, fluxes) in self.elements().groups.iter().zip(&self.fluxes) {
            for (winding, current) in group.windings.iter().zip(group.currents(fluxes)) {
                winding.index.iter().for_each(|&row| out.z[row] = current);
            }
        }
    }
}

//! Rates of charges, and currents in loops of what has a fixed voltage.

use super::active_set::OneWay;
use super::network_builder::Draft;
use super::reinitialise::{Consistent, Instant};
use super::values::Values;
use crate::mlcp::Role;
use crate::structure::{Branch, Law};

impl Instant<'_> {
    /// The rates of capacitors, and currents that flow in loops of them.
    pub fn rates(&self, values: &Values, out: &mut Consistent) -> Option<()> {
        let elements = self.elements();
        let mut draft = Draft::new(elements.nodes);
        let voltages =
            draft.add(&elements.voltages, |_, b| Law::Fixed(self.source(&self.rising, b)));
        let switches = self.ideal(Role::Closed);
        let closed = draft.add(&switches, |_, _| Law::Fixed(0.0));
        draft.add(&elements.capacitors, |_, c| Law::Weighted { weight: c.value, offset: 0.0 });
        draft.inject(&elements.entering(&self.driven));
        for (resistor, &current) in elements.resistors.iter().zip(&values.currents) {
            draft.carry(resistor, current);
        }
        let windings = self.carry_inductors(&mut draft, out);
        let v = &values.potentials;
        for switch in self.pairs(Role::Closed).iter().filter(|b| b.value > 0.0) {
            let [plus, minus] = switch.ends;
            let current = (v[plus] - v[minus] - self.offset(switch)) / switch.value;
            draft.carry(switch, current);
            switch.index.iter().for_each(|&pair| out.l[pair] = current);
        }
        let mut resting: Vec<Branch> = Vec::new();
        for (diode, &slack) in values.diodes.iter().zip(&values.slack) {
            let Some(pair) = diode.index else { continue };
            if diode.value > 0.0 {
                draft.carry(diode, out.l[pair]);
            } else if slack <= values.rounding || out.impulses[1][pair] > 0.0 {
                resting.push(*diode);
            }
        }
        let ways: Vec<OneWay> =
            resting.iter().map(|d| OneWay { ends: d.ends, offset: 0.0, series: 0.0 }).collect();
        let rates = draft.solve(&ways, &vec![0.0; elements.nodes])?;
        elements.put(&rates.potentials, &mut out.rates);
        for (branch, at) in elements.voltages.iter().zip(voltages) {
            branch.index.iter().for_each(|&row| out.z[row] = rates.flow.current[at]);
        }
        for (branch, at) in windings {
            branch.index.iter().for_each(|&row| out.z[row] = rates.flow.current[at]);
        }
        for (branch, at) in switches.iter().zip(closed) {
            branch.index.iter().for_each(|&pair| out.l[pair] = rates.flow.current[at]);
        }
        for ((branch, &current), &conducts) in resting.iter().zip(&rates.carried).zip(&rates.closed)
        {
            let Some(pair) = branch.index else { continue };
            out.l[pair] = current;
            out.active[pair] |= conducts;
        }
        Some(())
    }
}

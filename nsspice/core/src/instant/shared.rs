//! How ideal pairs side by side share their current.
//!
//! Closed pairs without resistance between the same nodes leave it open; the smallest currents are taken, as the
//! engines do.  With the multipliers of KCL as potentials, `min sum i^2` over `i >= 0` is a network in which each of
//! these pairs has one ohm.

use super::active_set::OneWay;
use super::network_builder::Draft;
use super::reinitialise::{Consistent, Instant};
use super::values::Values;
use crate::mlcp::Role;
use crate::structure::{Basis, Branch, Law};

impl Instant<'_> {
    /// Closes pairs without voltage that lie across closed ones, and spreads the currents over all of them; what is
    /// there stays where that finds nothing.
    pub fn share(&self, values: &Values, out: &mut Consistent) {
        let ideal = |b: &Branch| b.value == 0.0 && self.offset(b) == 0.0;
        let is_active = |b: &Branch| b.index.is_some_and(|pair| out.active[pair]);
        let mut switches = self.ideal(Role::Closed);
        switches.retain(ideal);
        let diodes = values.diodes.iter().filter(|d| ideal(d));
        let (mut ways, open): (Vec<Branch>, Vec<Branch>) = diodes.partition(|d| is_active(d));
        let shorts: Vec<[usize; 2]> = ways.iter().chain(&switches).map(|b| b.ends).collect();
        let joined = Basis::new(self.elements().nodes, &shorts, 0..shorts.len());
        let beside = open.into_iter().filter(|d| joined.joins(d.ends[0], d.ends[1]));
        let carrying = ways.len();
        ways.extend(beside);
        if ways.len() == carrying {
            return;
        }
        let mut draft = Draft::new(self.elements().nodes);
        let twoway = draft.add(&switches, |_, _| Law::Weighted { weight: 1.0, offset: 0.0 });
        for branch in ways[..carrying].iter().chain(&switches) {
            branch.index.iter().for_each(|&pair| draft.carry(branch, -out.l[pair]));
        }
        let unit: Vec<OneWay> =
            ways.iter().map(|d| OneWay { ends: d.ends, offset: 0.0, series: 1.0 }).collect();
        let Some(found) = draft.solve(&unit, &vec![0.0; self.elements().nodes]) else { return };
        for (way, &current) in ways.iter().zip(&found.carried) {
            let Some(pair) = way.index else { continue };
            out.l[pair] = current;
            out.active[pair] |= current > found.current_rounding;
        }
        for (switch, &current) in switches.iter().zip(&found.flow.current[twoway]) {
            switch.index.iter().for_each(|&pair| out.l[pair] = current);
        }
    }
}

//! Points of segments by series: everything that follows a segment reads unknowns, multipliers and their rates at
//! instants of it.

use super::quadrature::gauss_legendre;
use crate::audit::{Points, Sums};
use crate::modewise::events::successor::roles;
use crate::modewise::run::Engine;
use crate::waveform::INSTANT;

/// Points of the quadrature of powers at most.
const POINTS: usize = 6;
/// Modes whose first segment is recorded at any cost.
const SOME_MODES: usize = 32;

/// What energies are formed from: unknowns at the beginning, then all at the points of a quadrature.
#[derive(Default)]
pub(in crate::modewise) struct Nodes {
    first: Vec<f64>,
    z: Vec<f64>,
    l: Vec<f64>,
    u: Vec<f64>,
    rate: Vec<f64>,
}

impl Nodes {
    fn begin(&mut self, z: &[f64]) {
        self.first.clear();
        self.first.extend_from_slice(z);
        [&mut self.z, &mut self.l, &mut self.u, &mut self.rate].into_iter().for_each(Vec::clear);
    }

    fn take(&mut self, lists: [&[f64]; 3], rate: Option<&[f64]>) {
        let own = [&mut self.z, &mut self.l, &mut self.u];
        own.into_iter().zip(lists).for_each(|(own, list)| own.extend_from_slice(list));
        self.rate.extend_from_slice(rate.unwrap_or_default());
    }
}

impl Engine {
    /// Unknowns, multipliers and sources at a time since the beginning of the segment.
    pub(super) fn expanded_at(&mut self, time: f64) {
        let e = &mut self.expanded;
        let Some(motion) = e.motion.as_ref().filter(|_| e.at != Some(time)) else { return };
        let s = time / motion.expansion.h;
        motion.expansion.at(s, &mut e.z);
        motion.multipliers(s, &mut e.l);
        e.v.resize(self.motion.segment.now.len(), 0.0);
        self.motion.segment.at(time, &mut e.v);
        for (k, u) in e.u.iter_mut().enumerate() {
            *u = self.prepared.inputs.value_of(k, &e.v);
        }
        e.at = Some(time);
    }

    /// The same with the rates of the unknowns.
    pub(super) fn expanded_rates(&mut self, time: f64) {
        self.expanded_at(time);
        let e = &mut self.expanded;
        if let Some(motion) = &e.motion {
            motion.expansion.rates(time / motion.expansion.h, &mut e.dz);
        }
    }

    /// The pairs that are active, if the present segment is a series.
    pub(in crate::modewise) fn expanded_pairs(&self) -> Option<Vec<bool>> {
        let motion = self.expanded.motion.as_ref().filter(|_| self.expanded.active);
        motion.map(|motion| motion.on.clone())
    }

    /// Unknowns, multipliers and sources at a time since the beginning of the segment.
    pub(in crate::modewise) fn expanded_into(&mut self, time: f64, out: [&mut Vec<f64>; 3]) {
        self.expanded_at(time);
        let e = &self.expanded;
        out.into_iter().zip([&e.z, &e.l, &e.u]).for_each(|(out, list)| out.clone_from(list));
    }

    /// Unknowns and multipliers at a time since the beginning of the segment.
    pub(in crate::modewise) fn expanded_state(&mut self, time: f64) -> (Vec<f64>, Vec<f64>) {
        self.expanded_at(time);
        (self.expanded.z.clone(), self.expanded.l.clone())
    }

    /// The outputs at a time since the beginning of the segment, without the first column.
    pub(in crate::modewise) fn write_expanded(&mut self, time: f64, row: &mut [f64]) {
        self.expanded_rates(time);
        let e = &self.expanded;
        self.table.outputs.write(&e.z, &e.l, &e.dz, &e.u, row);
    }

    /// Writes the next rows as far as they lie inside the segment and there is room for them.
    pub(in crate::modewise) fn expanded_rows(&mut self, out: &mut [f64]) -> usize {
        let last = self.span.end >= self.plan.stop && self.span.end < self.span.breakpoint;
        let before = self.span.end - INSTANT * self.span.end;
        let (begin, end, columns) = (self.span.time, self.span.end, self.columns());
        let mut count = 0;
        for row in out.chunks_exact_mut(columns) {
            let Some(target) = self.plan.rows.peek() else { break };
            if !(target < before || (last && target <= end)) {
                break;
            }
            row[0] = target;
            self.write_expanded((target - begin).max(0.0), &mut row[1..]);
            let e = &self.expanded;
            self.table.expected.see_series([&e.z, &e.l, &e.dz, &e.u]);
            self.plan.rows.advance();
            count += 1;
        }
        count
    }

    /// Adds up the energies of the segment.
    pub(super) fn balance_expanded(&mut self) {
        let Some(mut sums) = self.energy_balance.sums.take() else { return };
        self.add_energies(&mut sums);
        self.energy_balance.sums = Some(sums);
    }

    /// Adds up the energies of the present segment, by a quadrature whose error is that of rounding: terms fall from 1
    /// to the unit roundoff, and the products that it misses first are of the order of the last.
    pub(in crate::modewise) fn add_energies(&mut self, sums: &mut Sums) {
        let length = self.span.end - self.span.time;
        let terms = self.expanded.motion.as_ref().map_or(0, |m| m.expansion.z.len());
        let count = terms.div_ceil(2).clamp(1, POINTS);
        let parts = if terms <= 2 * POINTS { 1 } else { 4 };
        let mut rules = std::mem::take(&mut self.expanded.rules);
        rules.resize(POINTS + 1, None);
        let (places, weight) = rules[count].get_or_insert_with(|| {
            let (mut places, mut weights) = gauss_legendre(count);
            // the end has a place, and no weight
            places.push(1.0);
            weights.push(0.0);
            (places, weights)
        });
        let width = length / f64::from(parts);
        let mut nodes = std::mem::take(&mut self.expanded.nodes);
        let rated = sums.asks_rates();
        for part in 0..parts {
            self.expanded_at(f64::from(part) * width);
            nodes.begin(&self.expanded.z);
            for &place in &*places {
                let time = (f64::from(part) + place) * width;
                self.expanded_at(time);
                if rated {
                    self.expanded_rates(time);
                }
                let e = &self.expanded;
                nodes.take([&e.z, &e.l, &e.u], rated.then_some(&e.dz[..]));
            }
            let Nodes { first, z, l, u, rate } = &nodes;
            let [z, u, rate] = [(z, &self.expanded.z), (u, &self.expanded.u), (rate, first)]
                .map(|(list, one)| list.chunks_exact(one.len().max(1)).collect::<Vec<_>>());
            let (f, taken) = (&[][..], &[][..]);
            let (z, u, rate) = (&z[..], &u[..], &rate[..]);
            let all = Points { length: width, weight, taken, z, rate, l, u, f, f_rate: f };
            sums.points(first, &all);
        }
        self.expanded.nodes = nodes;
        self.expanded.rules = rules;
    }

    /// Records the segment for the checks.
    pub(super) fn sample_expanded(&mut self, fresh: bool) {
        let length = self.span.end - self.span.time;
        if !self.samples.takes(length, fresh, SOME_MODES) || self.span.time >= self.plan.stop {
            return;
        }
        let width = self.expanded.motion.as_ref().map_or(length, |m| m.smooth_width().min(length));
        let (nodes, weights) = crate::modewise::checks::samples::rule();
        for (k, (node, weight)) in nodes.iter().zip(weights).enumerate() {
            let t = 0.5 * width * (1.0 + node);
            self.expanded_rates(t);
            let e = &self.expanded;
            let taken = &mut self.samples.taken;
            taken.z.extend_from_slice(&e.z);
            taken.l.extend_from_slice(&e.l);
            taken.u.extend_from_slice(&e.u);
            taken.rate.extend_from_slice(&e.dz);
            if k == 0 {
                taken.first.extend_from_slice(&e.z);
                taken.first_u.extend_from_slice(&e.u);
            }
            taken.time.push(self.span.time + t);
            taken.weight.push(0.5 * width * weight);
        }
        let taken = &mut self.samples.taken;
        taken.begin.push(self.span.time);
        taken.end.push(self.span.time + width);
        taken.shortest.push(width);
        taken.swing.push(0.0);
        taken.steps.push(u8::from(width == length));
        taken.signed.push(1);
        let doubt = self.expanded.motion.as_ref().map_or(0.0, |m| m.doubt(&self.expanded.z));
        taken.doubt.push(doubt);
        if !self.prepared.switches.is_empty() {
            let all = roles(self.prepared.net.m, &self.prepared.switches, &self.control.gates);
            taken.roles.extend(all.iter().map(|&r| r as u8));
        }
    }

    /// Residual of all equations within the segment.
    pub(super) fn check_expanded(&mut self) {
        self.expanded_rates(0.618 * (self.span.end - self.span.time));
        let (e, linear) = (&self.expanded, &self.prepared.sys.linear);
        if let Some(sums) = &mut self.energy_balance.sums {
            sums.see(&e.z, &e.l);
        }
        let h = self.plan.fixed_step;
        let mut rhs = vec![0.0; e.z.len()];
        linear.e.mul_add(1.0 / h, &e.z, &mut rhs);
        linear.e.mul_add(-1.0, &e.dz, &mut rhs);
        linear.s.mul_add(1.0, &e.u, &mut rhs);
        let roles = roles(self.prepared.net.m, &self.prepared.switches, &self.control.gates);
        let found = self.implicit.residual(&self.prepared.sys, h, &rhs, &roles, &e.z, &e.l);
        self.stats.checks += 1;
        self.stats.residual_rows = self.stats.residual_rows.max(found.rows);
        self.stats.residual_complementarity =
            self.stats.residual_complementarity.max(found.complementarity);
    }

    /// Counts the present mode; whether it is met for the first time.
    pub(super) fn mark(&mut self) -> bool {
        let id = self.expanded.id;
        self.checked.resize(self.checked.len().max(id + 1), false);
        !std::mem::replace(&mut self.checked[id], true)
    }
}

//! Segments by series ([`super::series`]) in the run of the exact engine: large networks whose modes are hardly ever met
//! again.  Everything that follows a segment reads unknowns, multipliers and their rates at instants of it.

use super::inputs::Inputs;
use super::run::Engine;
use super::run_state::Phase;
use super::series::expansion::Sources;
use super::series::motion::{Begun, Motion, Watched};
use super::series::quadrature::gauss_legendre;
use super::successor::{cause_of, roles};
use crate::audit::{Points, Sums};
use crate::integrate::Failure;
use crate::structure::Elements;
use crate::switch::comparisons_first;
use crate::waveform::INSTANT;

/// Points of the quadrature of powers.
const POINTS: usize = 6;
/// Switches that react at one instant before it is left to closed forms.
const REACTIONS: usize = 16;

/// The present segment, if it is a series.
#[derive(Default)]
pub(super) struct Expanded {
    motion: Option<Box<Motion>>,
    /// the present segment is a series
    pub active: bool,
    /// the states are those of the series, and the energy coordinates are behind
    ahead: bool,
    /// segments in each mode
    visits: Vec<u32>,
    /// what ends the segment, and the part of the series that it is
    turned: Vec<Watched>,
    part: f64,
    y: Vec<f64>,
    states: Vec<f64>,
    dy: Vec<f64>,
    z: Vec<f64>,
    l: Vec<f64>,
    dz: Vec<f64>,
    u: Vec<f64>,
}

impl Engine {
    /// Prepares for series, if the network is one for them.
    pub(super) fn prepare_series(&mut self) {
        let (sys, net) = (&self.prepared.sys, &self.prepared.net);
        // where modes are derived from their neighbours, each costs as little as a series
        let derived = net.symmetric && self.prepared.switches.is_empty();
        if self.trace.on || derived || !net.controls.is_empty() {
            return;
        }
        let elements =
            Elements::read(&sys.linear, &sys.capacitors, &sys.conductors, &sys.coordinates);
        let motion = elements.and_then(|e| Motion::new(e, &sys.linear.q, &self.prepared.switches));
        self.expanded.motion = motion.map(Box::new);
        let (n, m) = (self.prepared.net.n, self.prepared.net.m);
        let e = &mut self.expanded;
        let size = e.motion.as_ref().map_or(0, |motion| motion.tableau.size());
        (e.y, e.dy) = (vec![0.0; size], vec![0.0; size]);
        (e.z, e.dz, e.l) = (vec![0.0; n], vec![0.0; n], vec![0.0; m]);
        e.u = vec![0.0; self.prepared.inputs.waveforms().len()];
    }

    /// Begins a segment as a series; false where it is left to closed forms.
    pub(super) fn begin_expanded(&mut self, crossing: &[usize], horizon: f64) -> bool {
        self.expanded.active = false;
        if self.expanded.motion.is_none()
            || horizon <= 0.0
            || self.control.sampling.on.contains(&true)
        {
            return false;
        }
        if self.follower_is_made(crossing) {
            self.leave_series();
            return false;
        }
        if !self.expanded.ahead {
            let mut z = vec![0.0; self.prepared.net.n];
            self.prepared.net.big_r.apply(&self.state.a, &mut z);
            let on = self.motion.present.as_ref().map(|p| self.registry.on(p.0).to_vec());
            let on = on.unwrap_or_else(|| self.log.pairs.clone());
            if let Some(motion) = &mut self.expanded.motion {
                motion.enter(&z, &on);
            }
        }
        for _ in 0..REACTIONS {
            let sources = Sources {
                inputs: &self.prepared.inputs,
                columns: &self.prepared.sys.linear.s,
                segment: &self.motion.segment,
            };
            let state = (&*self.prepared.switches, &self.control.gates[..]);
            let Some(motion) = &mut self.expanded.motion else { return false };
            match motion.begin(state, &sources, horizon) {
                Some(Begun::Lasts(length, turned)) => {
                    if self.comes_often() {
                        break;
                    }
                    self.walk_expanded(length, horizon, turned);
                    return true;
                }
                Some(Begun::Thrown(mut switches)) => {
                    comparisons_first(&self.prepared.switches, &mut switches);
                    for s in switches {
                        self.turn_at(0.0, s, false);
                        self.throw(s);
                    }
                }
                None => break,
            }
        }
        self.leave_series();
        false
    }

    /// Whether what has followed this mode in this way before is there in closed form.
    fn follower_is_made(&self, crossing: &[usize]) -> bool {
        let from = self.motion.present.as_ref().filter(|_| !self.expanded.ahead);
        let cause = cause_of(crossing, &self.control.gates);
        let follower = from.and_then(|present| self.registry.follower(present.0, cause));
        follower.is_some_and(|id| self.registry.is_made(id))
    }

    /// Counts a segment in the mode that has been found; whether so many have been followed by series that the closed
    /// form would have cost less.
    fn comes_often(&mut self) -> bool {
        let Some(motion) = &self.expanded.motion else { return false };
        let id = self.registry.id(&motion.on, &self.control.gates);
        let (visits, limit) = (&mut self.expanded.visits, motion.worth());
        visits.resize(visits.len().max(id + 1), 0);
        visits[id] += 1;
        f64::from(visits[id]) > limit
    }

    /// Goes over to closed forms.
    pub(super) fn leave_series(&mut self) {
        if !std::mem::take(&mut self.expanded.ahead) {
            return;
        }
        // the unknowns at the end of the last segment
        let mut charges = vec![0.0; self.prepared.net.n];
        self.prepared.sys.linear.e.mul_add(1.0, &self.expanded.z, &mut charges);
        self.prepared.net.energy(&charges, &mut self.state.a);
        self.scale.see_state(&self.state.a);
        self.motion.present = None;
    }

    fn walk_expanded(&mut self, length: f64, horizon: f64, turned: Vec<Watched>) {
        let Some(motion) = &self.expanded.motion else { return };
        let whole = turned.is_empty() && length >= horizon;
        self.expanded.part = length / motion.expansion.h;
        let at_breakpoint = whole && self.span.breakpoint - self.span.time <= horizon;
        self.span.end = if at_breakpoint { self.span.breakpoint } else { self.span.time + length };
        let on = motion.on.clone();
        self.expanded.turned = turned;
        (self.expanded.active, self.expanded.ahead) = (true, true);
        self.motion.present = None;
        self.samples.forget_end();
        self.stats.segments += 1;
        self.span.phase = Phase::Moving;
        self.span.crossing.clear();
        let changes = self.log.note(&on, self.span.time);
        (self.stats.events, self.stats.mode_changes) =
            (self.stats.events + changes, self.stats.mode_changes + u64::from(changes > 0));
        self.expanded_at(0.0);
        let (y, motion) = (&self.expanded.y, self.expanded.motion.as_ref());
        let doubt = motion.map_or(0.0, |motion| motion.doubt(y));
        let active: Vec<usize> = (0..on.len()).filter(|&pair| on[pair]).collect();
        let fastest = motion.map_or(0.0, |m| m.expansion.y.len() as f64 / m.expansion.h);
        self.look_at(None, (&active, fastest, doubt), length, 0, None);
        let fresh = self.mark(&on);
        self.sample_expanded(fresh);
        if fresh {
            self.check_expanded();
        }
        self.hand_segment();
    }

    /// Unknowns, multipliers, their rates and sources at a time since the beginning of the segment.
    fn expanded_at(&mut self, time: f64) {
        let e = &mut self.expanded;
        let Some(motion) = &e.motion else { return };
        let s = time / motion.expansion.h;
        motion.expansion.at(s, &mut e.y);
        motion.expansion.rates(s, &mut e.dy);
        let t = &motion.tableau;
        e.states.resize(t.states(), 0.0);
        for (state, rate) in e.states.iter_mut().enumerate() {
            *rate = t.rate(state, &e.y);
        }
        motion.write(&e.dy, &e.states, &mut e.dz, &mut e.l);
        motion.expansion.states(t, s, &mut e.states);
        motion.write(&e.y, &e.states, &mut e.z, &mut e.l);
        inside(&self.prepared.inputs, &self.motion.segment, time, &mut e.u);
    }

    /// The pairs that are active, if the present segment is a series.
    pub(super) fn expanded_pairs(&self) -> Option<Vec<bool>> {
        let motion = self.expanded.motion.as_ref().filter(|_| self.expanded.active);
        motion.map(|motion| motion.on.clone())
    }

    /// Unknowns, multipliers and sources at a time since the beginning of the segment.
    pub(super) fn expanded_into(&mut self, time: f64, out: [&mut Vec<f64>; 3]) {
        self.expanded_at(time);
        let e = &self.expanded;
        out.into_iter().zip([&e.z, &e.l, &e.u]).for_each(|(out, list)| out.clone_from(list));
    }

    /// Unknowns and multipliers at a time since the beginning of the segment.
    pub(super) fn expanded_state(&mut self, time: f64) -> (Vec<f64>, Vec<f64>) {
        self.expanded_at(time);
        (self.expanded.z.clone(), self.expanded.l.clone())
    }

    /// The outputs at a time since the beginning of the segment, without the first column.
    pub(super) fn write_expanded(&mut self, time: f64, row: &mut [f64]) {
        self.expanded_at(time);
        let e = &self.expanded;
        self.table.outputs.write(&e.z, &e.l, &e.dz, &e.u, row);
    }

    /// Writes the next rows as far as they lie inside the segment and there is room for them.
    pub(super) fn expanded_rows(&mut self, out: &mut [f64]) -> usize {
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

    /// Leaves the segment: state at its end, and on.
    pub(super) fn finish_expanded(&mut self) -> Result<(), Failure> {
        let length = self.span.end - self.span.time;
        self.expanded_at(length);
        if let Some(motion) = &self.expanded.motion {
            for (s, distance, noise) in motion.controls(&self.expanded.y) {
                self.control.resting.see(s, distance, noise);
            }
        }
        self.balance_expanded();
        self.write_pieces();
        self.note_left();
        let turned = std::mem::take(&mut self.expanded.turned);
        for watched in &turned {
            if let Watched::Switch(s) = *watched {
                self.turn_at(length, s, true);
                self.throw(s);
                self.control.sampling.note(s);
            }
        }
        let part = self.expanded.part;
        if let Some(motion) = &mut self.expanded.motion {
            motion.leave(part, &turned);
        }
        self.expanded.active = false;
        self.span.time = self.span.end;
        if turned.is_empty() {
            self.stats.breakpoints += u64::from(self.span.end >= self.span.breakpoint);
        }
        let stuck = self.too_fast()
            || (!turned.is_empty()
                && self.is_crowded()
                && !self.control.sampling.begin(self.span.time));
        if stuck {
            self.leave_series();
            return self.carry_on();
        }
        let result = self.begin(&[]);
        if result.is_ok() {
            self.note_right();
        }
        result
    }

    /// Notes where the control of a switch is that turns at a time since the beginning of the segment.
    fn turn_at(&mut self, time: f64, s: usize, located: bool) {
        if !self.log.turns.open() || self.control.sampling.on[s] {
            return;
        }
        let instant = if located { self.span.end } else { self.span.time };
        self.expanded_at(time);
        let of = (&self.prepared.switches[s], self.control.gates[s]);
        let e = &self.expanded;
        self.log.turns.note((instant, located), s, of, [&e.z, &e.l]);
    }

    /// Adds up the energies of the segment.
    fn balance_expanded(&mut self) {
        let Some(mut sums) = self.energy_balance.sums.take() else { return };
        self.add_energies(&mut sums);
        self.energy_balance.sums = Some(sums);
    }

    /// Adds up the energies of the present segment, by a quadrature whose error is that of rounding: terms fall from 1
    /// to the unit roundoff, and products of the twelfth order are the first that it misses.
    pub(super) fn add_energies(&mut self, sums: &mut Sums) {
        let length = self.span.end - self.span.time;
        let terms = self.expanded.motion.as_ref().map_or(0, |m| m.expansion.y.len());
        let parts = if terms <= 2 * POINTS { 1 } else { 4 };
        let (places, weights) = gauss_legendre(POINTS);
        let weight: Vec<f64> = weights.iter().copied().chain([0.0]).collect();
        let taken = vec![0.0; weight.len() * weight.len()];
        let width = length / f64::from(parts);
        self.expanded_at(0.0);
        for part in 0..parts {
            let first = self.expanded.z.clone();
            let mut points = [Vec::new(), Vec::new(), Vec::new()];
            let mut l = Vec::new();
            for place in places.iter().copied().chain([1.0]) {
                self.expanded_at((f64::from(part) + place) * width);
                let e = &self.expanded;
                for (list, now) in points.iter_mut().zip([&e.z, &e.dz, &e.u]) {
                    list.push(now.clone());
                }
                l.extend_from_slice(&e.l);
            }
            let [z, rate, u] = &points;
            let all = Points {
                length: width,
                weight: &weight,
                taken: &taken,
                z: &slices(z),
                rate: &slices(rate),
                l: &l,
                u: &slices(u),
                f: &[],
                f_rate: &[],
            };
            sums.points(&first, &all);
        }
    }

    /// Records the segment for the checks.
    fn sample_expanded(&mut self, fresh: bool) {
        let length = self.span.end - self.span.time;
        if !self.samples.takes(length, fresh) || self.span.time >= self.plan.stop {
            return;
        }
        let width = self.expanded.motion.as_ref().map_or(length, |m| m.smooth_width().min(length));
        let (nodes, weights) = super::samples::rule();
        for (k, (node, weight)) in nodes.iter().zip(weights).enumerate() {
            let t = 0.5 * width * (1.0 + node);
            self.expanded_at(t);
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
        let doubt = self.expanded.motion.as_ref().map_or(0.0, |m| m.doubt(&self.expanded.y));
        taken.doubt.push(doubt);
        if !self.prepared.switches.is_empty() {
            let all = roles(self.prepared.net.m, &self.prepared.switches, &self.control.gates);
            taken.roles.extend(all.iter().map(|&r| r as u8));
        }
    }

    /// Residual of all equations within the segment.
    fn check_expanded(&mut self) {
        self.expanded_at(0.618 * (self.span.end - self.span.time));
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

    /// Counts a mode; whether it is met for the first time.
    fn mark(&mut self, on: &[bool]) -> bool {
        let id = self.registry.id(on, &self.control.gates);
        self.checked.resize(self.checked.len().max(id + 1), false);
        !std::mem::replace(&mut self.checked[id], true)
    }
}

fn slices(list: &[Vec<f64>]) -> Vec<&[f64]> {
    list.iter().map(Vec::as_slice).collect()
}

/// Sources at a time since the beginning of a segment.
fn inside(inputs: &Inputs, segment: &super::inputs::Segment, time: f64, out: &mut [f64]) {
    let mut v = vec![0.0; segment.now.len()];
    segment.at(time, &mut v);
    for (k, u) in out.iter_mut().enumerate() {
        *u = inputs.value_of(k, &v);
    }
}

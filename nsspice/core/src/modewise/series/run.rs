//! Segments by series in the run of the exact engine: large networks whose modes are hardly ever met again.

use super::motion::{Begun, Motion};
use super::points::Nodes;
use super::quadrature::Rule;
use super::watch::Watched;
use crate::integrate::Failure;
use crate::modewise::events::successor::cause_of;
use crate::modewise::run::{Engine, CHECK};
use crate::modewise::run_state::Phase;
use crate::structure::Elements;
use crate::switch::comparisons_first;

/// Switches that react at one instant before it is left to closed forms.
const REACTIONS: usize = 16;

/// The present segment, if it is a series.
#[derive(Default)]
pub(in crate::modewise) struct Expanded {
    pub(super) motion: Option<Box<Motion>>,
    /// the present segment is a series
    pub active: bool,
    /// the states are those of the series, and the energy coordinates are behind
    ahead: bool,
    /// number of the present mode, and segments in each
    pub(super) id: usize,
    visits: Vec<u32>,
    /// what ends the segment, and the part of the series that it is
    turned: Vec<Watched>,
    part: f64,
    /// the time since the beginning of the segment to which the following belong
    pub(super) at: Option<f64>,
    pub(super) z: Vec<f64>,
    pub(super) l: Vec<f64>,
    pub(super) dz: Vec<f64>,
    pub(super) u: Vec<f64>,
    pub(super) v: Vec<f64>,
    /// quadratures by their number of points
    pub(super) rules: Vec<Option<Rule>>,
    pub(super) nodes: Nodes,
}

impl Engine {
    /// Prepares for series, if the network is one for them.
    pub(in crate::modewise) fn prepare_series(&mut self) {
        let (sys, net) = (&self.prepared.sys, &self.prepared.net);
        // where modes are derived from their neighbours, each costs as little as a series
        let derived = net.symmetric && self.prepared.switches.is_empty();
        if self.trace.on || derived || !net.controls.is_empty() {
            return;
        }
        let elements =
            Elements::read(&sys.linear, &sys.capacitors, &sys.conductors, &sys.coordinates);
        let from = (&self.prepared.inputs, &sys.linear.s);
        let motion =
            elements.and_then(|e| Motion::new(e, &sys.linear.q, &self.prepared.switches, from));
        self.expanded.motion = motion.map(Box::new);
        let (n, m) = (self.prepared.net.n, self.prepared.net.m);
        let e = &mut self.expanded;
        (e.z, e.dz, e.l) = (vec![0.0; n], vec![0.0; n], vec![0.0; m]);
        e.u = vec![0.0; self.prepared.inputs.waveforms().len()];
    }

    /// Begins a segment as a series; false where it is left to closed forms.
    pub(in crate::modewise) fn begin_expanded(&mut self, crossing: &[usize], horizon: f64) -> bool {
        (self.expanded.active, self.expanded.at) = (false, None);
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
            let Some(motion) = &mut self.expanded.motion else { return false };
            match motion.begin(&self.control.gates, &self.motion.segment, horizon) {
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
        self.expanded.id = id;
        visits.resize(visits.len().max(id + 1), 0);
        visits[id] += 1;
        f64::from(visits[id]) > limit
    }

    /// Goes over to closed forms.
    pub(in crate::modewise) fn leave_series(&mut self) {
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
        let (z, motion) = (&self.expanded.z, self.expanded.motion.as_ref());
        let doubt = motion.map_or(0.0, |motion| motion.doubt(z));
        let active: Vec<usize> = (0..on.len()).filter(|&pair| on[pair]).collect();
        let fastest = motion.map_or(0.0, |m| m.expansion.z.len() as f64 / m.expansion.h);
        self.look_at(None, (&active, fastest, doubt), length, 0, None);
        let fresh = self.mark();
        self.sample_expanded(fresh);
        // nothing has been reduced that a first segment would have to prove
        let first = fresh && self.stats.checks < CHECK;
        if first || self.stats.segments.is_multiple_of(CHECK) {
            self.check_expanded();
        }
        self.hand_segment();
    }

    /// Leaves the segment: state at its end, and on.
    pub(in crate::modewise) fn finish_expanded(&mut self) -> Result<(), Failure> {
        let length = self.span.end - self.span.time;
        self.expanded_at(length);
        if let Some(motion) = &self.expanded.motion {
            for (s, distance, noise) in motion.controls(&self.expanded.z) {
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
}

//! Looking at a run from outside: unknowns, residuals, jumps.

use crate::integrate::Jump;
use crate::modewise::events::successor::{fix, roles};
use crate::modewise::modes::mode::Mode;
use crate::modewise::modes::registry::Id;
use crate::modewise::run::Engine;
use crate::modewise::run_state::Phase;
use crate::rounding::OF_SOLUTION;
use crate::waveform::Side;
use std::sync::Arc;

/// Jumps kept in full; later ones are only counted.
pub(in crate::modewise) const MAX_JUMPS: usize = 4096;

impl Engine {
    /// Whether lists of charges and switch states have the right lengths.
    pub fn fits(&self, charges: usize, gates: usize) -> bool {
        charges == self.prepared.net.n && gates == self.prepared.switches.len()
    }

    /// Modes reduced, tried ones included.
    pub fn reduced(&self) -> u64 {
        self.registry.built
    }

    /// Unknowns and multipliers from a mode's state at the start or end of a segment.
    pub(in crate::modewise) fn unknowns(
        &self,
        mode: &Mode,
        x: &[f64],
        v: &[f64],
        d: &[f64],
        z: &mut [f64],
        l: &mut [f64],
    ) {
        self.unknowns_in(mode, [x, v, d], z, l, [&mut Vec::new(), &mut Vec::new()]);
    }

    /// The same with work space for energy coordinates and what is algebraic.
    pub(in crate::modewise) fn unknowns_in(
        &self,
        mode: &Mode,
        [x, v, d]: [&[f64]; 3],
        z: &mut [f64],
        l: &mut [f64],
        [a, b]: [&mut Vec<f64>; 2],
    ) {
        let k = self.prepared.net.kernel.cols;
        a.resize(self.prepared.net.states, 0.0);
        mode.leave(x, v, a);
        b.clear();
        b.resize(k + mode.active.len(), 0.0);
        mode.algebra([x, v, d], b);
        self.prepared.net.big_r.apply(a, z);
        self.prepared.net.kernel.apply_add(&b[..k], z);
        l.fill(0.0);
        for (&i, &value) in mode.active.iter().zip(&b[k..]) {
            l[i] = value;
        }
    }

    /// Residual of all equations at the end of the segment.
    pub(in crate::modewise) fn check(&mut self, mode: &Mode) {
        let (n, m) = (self.prepared.net.n, self.prepared.net.m);
        let mut x = vec![0.0; mode.n];
        self.motion.path.state(&self.motion.point, &mut x);
        let mut v = vec![0.0; self.state.v.len()];
        self.motion.path.inputs(&self.motion.segment, &self.motion.point, &mut v);
        let mut d = Vec::new();
        self.motion.segment.rates(&v, &mut d);
        let (mut z, mut l) = (vec![0.0; n], vec![0.0; m]);
        self.unknowns(mode, &x, &v, &d, &mut z, &mut l);
        self.balance_look(&z, &l);
        // E z' = E R a'
        let mut rate = vec![0.0; mode.n];
        self.motion.path.state_rate(&self.motion.point, &mut rate);
        let mut da = vec![0.0; self.prepared.net.states];
        mode.leave(&rate, &d, &mut da);
        let mut rhs = vec![0.0; n];
        self.prepared.net.charges.apply(&da, &mut rhs);
        // as a step sees it: against the charges that it moves, E z / h on both sides
        let h = self.plan.fixed_step;
        let mut stored = vec![0.0; n];
        self.prepared.sys.linear.e.mul_add(1.0 / h, &z, &mut stored);
        rhs.iter_mut().zip(&stored).for_each(|(q, s)| *q = s - *q);
        self.prepared.net.s.apply_add(&v, &mut rhs);
        let roles = roles(m, &self.prepared.switches, &self.control.gates);
        let found = self.implicit.residual(&self.prepared.sys, h, &rhs, &roles, &z, &l);
        self.stats.checks += 1;
        self.stats.residual_rows = self.stats.residual_rows.max(found.rows);
        self.stats.residual_complementarity =
            self.stats.residual_complementarity.max(found.complementarity);
    }

    /// Unknowns and multipliers at the present end of the segment.
    pub fn state(&mut self) -> (Vec<f64>, Vec<f64>) {
        self.state_within(1.0)
    }

    /// Unknowns and multipliers at the present time: a segment that has been begun is known up to its end.
    pub fn beginning(&mut self) -> (Vec<f64>, Vec<f64>) {
        self.state_within(0.0)
    }

    /// The same at a part of the segment; between segments, at the present time.
    fn state_within(&mut self, part: f64) -> (Vec<f64>, Vec<f64>) {
        if self.expanded.active {
            return self.expanded_state(part * (self.span.end - self.span.time));
        }
        let (Phase::Moving, Some((_, mode))) = (&self.span.phase, self.motion.present.clone())
        else {
            return (self.state.z.clone(), self.state.l.clone());
        };
        let mut point = self.motion.point.clone();
        if part < 1.0 {
            self.motion.path.at(part * self.motion.point.t, &mut point);
        }
        let mut x = vec![0.0; mode.n];
        self.motion.path.state(&point, &mut x);
        let mut v = vec![0.0; self.state.v.len()];
        self.motion.path.inputs(&self.motion.segment, &point, &mut v);
        let mut d = Vec::new();
        self.motion.segment.rates(&v, &mut d);
        let (mut z, mut l) = (vec![0.0; self.prepared.net.n], vec![0.0; self.prepared.net.m]);
        self.unknowns(&mode, &x, &v, &d, &mut z, &mut l);
        (z, l)
    }

    /// Unknowns in the mode so far at energy coordinates `a`, zero before the start.
    pub(in crate::modewise) fn unknowns_from(&self, a: &[f64]) -> Vec<f64> {
        let (mut z, mut l) = (vec![0.0; self.prepared.net.n], vec![0.0; self.prepared.net.m]);
        if let Some((_, mode)) = &self.motion.present {
            let mut x = vec![0.0; mode.n];
            mode.enter(a, &mut x);
            self.unknowns(mode, &x, &self.state.v, &self.motion.segment.rate, &mut z, &mut l);
        }
        z
    }

    /// Records a jump that ends in a mode, `origin` being the first and `entry` the last of the
    /// energy coordinates before it.
    pub(in crate::modewise) fn note_jump(
        &mut self,
        mode: &Arc<Mode>,
        id: Id,
        origin: &[f64],
        entry: &[f64],
    ) {
        let change = self.state.a.iter().zip(origin).fold(0.0f64, |m, (x, y)| m.hypot(x - y));
        if change <= OF_SOLUTION * self.scale.a {
            return;
        }
        self.count_jump(origin);
        if self.log.jumps.len() >= MAX_JUMPS {
            return;
        }
        let (n, m, k) = (self.prepared.net.n, self.prepared.net.m, self.prepared.net.kernel.cols);
        let before = self.unknowns_from(origin);
        let mut scrap = vec![0.0; m];
        let mut after = vec![0.0; n];
        self.unknowns(
            mode,
            self.motion.path.start(),
            &self.motion.segment.now,
            &self.motion.segment.rate,
            &mut after,
            &mut scrap,
        );
        let (mut unknowns, mut multipliers) = (vec![0.0; n], vec![0.0; m]);
        let mut steps: Vec<(Id, Vec<f64>)> =
            self.picker.state_jumps.iter().map(|l| (l.through, l.before.clone())).collect();
        steps.push((id, entry.to_vec()));
        for (through, mut joint) in steps {
            let Ok(mode) = self.registry.mode(through, &self.prepared.net, &self.prepared.switches)
            else {
                continue;
            };
            let Some(impulses) = &mode.impulses else { continue };
            joint.extend_from_slice(&self.motion.segment.now);
            let mut b = vec![0.0; k + mode.active.len()];
            impulses.algebraic.apply(&joint, &mut b);
            self.prepared.net.kernel.apply_add(&b[..k], &mut unknowns);
            for (&i, &value) in mode.active.iter().zip(&b[k..]) {
                multipliers[i] += value;
            }
        }
        self.keep_jump([before, after], [unknowns, multipliers], 0.0);
    }

    /// Notes where the control of a switch is that turns at the end of a segment, or, with it, at the begin of the
    /// next one by the sources alone.
    pub(in crate::modewise) fn note_turn(&mut self, mode: &Mode, s: usize, by_sources: bool) {
        if !self.log.turns.open() || self.control.sampling.on[s] {
            return;
        }
        let (x, segment) = (self.state.x.clone(), &self.motion.segment);
        let (v, d) = if by_sources {
            (segment.now.clone(), segment.rate.clone())
        } else {
            let mut d = Vec::new();
            segment.rates(&self.state.v, &mut d);
            (self.state.v.clone(), d)
        };
        self.keep_turn(mode, s, [&x, &v, &d], !by_sources);
    }

    /// The same of a switch that turns where the present segment begins.
    pub(in crate::modewise) fn note_turn_at_begin(&mut self, s: usize) {
        let Some((_, mode)) = self.motion.present.clone() else { return };
        if !self.log.turns.open() || self.control.sampling.on[s] {
            return;
        }
        let (x, segment) = (self.motion.path.start().to_vec(), &self.motion.segment);
        let (v, d) = (segment.now.clone(), segment.rate.clone());
        self.keep_turn(&mode, s, [&x, &v, &d], false);
    }

    fn keep_turn(&mut self, mode: &Mode, s: usize, [x, v, d]: [&[f64]; 3], located: bool) {
        if x.len() != mode.n {
            return; // implicit steps have passed since
        }
        let (mut z, mut l) = (vec![0.0; self.prepared.net.n], vec![0.0; self.prepared.net.m]);
        self.unknowns(mode, x, v, d, &mut z, &mut l);
        let of = (&self.prepared.switches[s], self.control.gates[s]);
        self.log.turns.note((self.span.time, located), s, of, [&z, &l]);
    }

    /// Keeps a jump at the present time, the limit of steps of this length [s] or a closed form.
    pub(in crate::modewise) fn keep_jump(
        &mut self,
        [before, after]: [Vec<f64>; 2],
        [unknowns, multipliers]: [Vec<f64>; 2],
        length: f64,
    ) {
        let (time, sources) = (self.span.time, self.sources(self.span.time));
        self.log.jumps.push(Jump {
            time,
            before,
            after,
            multipliers,
            unknowns,
            functions: Vec::new(),
            sources,
            length,
            span: 0.0,
        });
    }

    /// Counts a jump from `origin` to the present energy coordinates.
    pub(in crate::modewise) fn count_jump(&mut self, origin: &[f64]) {
        self.stats.jumps += 1;
        self.sample_end();
        self.balance_jump(origin);
    }

    /// Takes note of the size of the state at the present point.
    pub(in crate::modewise) fn see(&mut self, mode: &Mode) {
        self.motion.path.state(&self.motion.point, &mut self.state.x);
        if mode.orthonormal() {
            return self.scale.see_state(&self.state.x);
        }
        let mut a = std::mem::take(&mut self.state.spare);
        a.resize(self.prepared.net.states, 0.0);
        self.motion.path.inputs(&self.motion.segment, &self.motion.point, &mut self.state.v);
        mode.leave(&self.state.x, &self.state.v, &mut a);
        self.scale.see_state(&a);
        self.state.spare = a;
    }

    /// Takes the mode of the pairs that conduct for the one so far, if they are known.
    pub(in crate::modewise) fn enter_known(&mut self, active: Option<Vec<bool>>) {
        if let Some(mut on) = active {
            fix(&self.prepared.switches, &self.control.gates, &mut on);
            let id = self.registry.id(&on, &self.control.gates);
            let mode = self.registry.mode(id, &self.prepared.net, &self.prepared.switches);
            self.motion.present = mode.ok().map(|mode| (id, mode));
        }
    }

    /// Active pairs of the present mode.
    pub fn active(&self) -> Vec<bool> {
        self.log.pairs.clone()
    }

    /// Source values at a time.
    pub(in crate::modewise) fn sources(&self, time: f64) -> Vec<f64> {
        let mut u = vec![0.0; self.prepared.inputs.waveforms().len()];
        self.prepared.inputs.values(time, Side::Right, &mut u);
        u
    }
}

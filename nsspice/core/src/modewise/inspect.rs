//! Looking at a run from outside: unknowns, residuals, jumps.

use super::mode::Mode;
use super::pick::{fix, roles};
use super::registry::Id;
use super::run::{Engine, Phase};
use super::verify::NOISE;
use crate::moreau::Jump;
use crate::waveform::Side;
use std::sync::Arc;

/// Events kept in full; later ones are only counted.
const MAX_EVENTS: usize = 1 << 16;
/// Jumps kept in full; later ones are only counted.
pub(super) const MAX_JUMPS: usize = 4096;

impl Engine {
    /// Whether lists of charges and switch states have the right lengths.
    pub fn fits(&self, charges: usize, gates: usize) -> bool {
        charges == self.net.n && gates == self.switches.len()
    }

    /// Modes reduced, tried ones included.
    pub fn reduced(&self) -> u64 {
        self.registry.built
    }

    /// Unknowns and multipliers from a mode's state at the start or end of a segment.
    pub(super) fn unknowns(
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
    pub(super) fn unknowns_in(
        &self,
        mode: &Mode,
        [x, v, d]: [&[f64]; 3],
        z: &mut [f64],
        l: &mut [f64],
        [a, b]: [&mut Vec<f64>; 2],
    ) {
        let k = self.net.kernel.cols;
        a.resize(self.net.states, 0.0);
        mode.leave(x, v, a);
        b.clear();
        b.resize(k + mode.active.len(), 0.0);
        mode.algebra([x, v, d], b);
        self.net.big_r.apply(a, z);
        self.net.kernel.apply_add(&b[..k], z);
        l.fill(0.0);
        for (&i, &value) in mode.active.iter().zip(&b[k..]) {
            l[i] = value;
        }
    }

    /// Residual of all equations at the end of the segment.
    pub(super) fn check(&mut self, mode: &Mode) {
        let (n, m) = (self.net.n, self.net.m);
        let mut x = vec![0.0; mode.n];
        self.path.state(&self.point, &mut x);
        let mut v = vec![0.0; self.v.len()];
        self.path.inputs(&self.segment, &self.point, &mut v);
        let mut d = Vec::new();
        self.segment.rates(&v, &mut d);
        let (mut z, mut l) = (vec![0.0; n], vec![0.0; m]);
        self.unknowns(mode, &x, &v, &d, &mut z, &mut l);
        self.tally_look(&z, &l);
        // E z' = E R a'
        let mut rate = vec![0.0; mode.n];
        self.path.state_rate(&self.point, &mut rate);
        let mut da = vec![0.0; self.net.states];
        mode.leave(&rate, &d, &mut da);
        let mut rhs = vec![0.0; n];
        self.net.charges.apply(&da, &mut rhs);
        // as a step sees it: against the charges that it moves, E z / h on both sides
        let h = self.fixed_step;
        let mut stored = vec![0.0; n];
        self.sys.linear.e.mul_add(1.0 / h, &z, &mut stored);
        rhs.iter_mut().zip(&stored).for_each(|(q, s)| *q = s - *q);
        self.net.s.apply_add(&v, &mut rhs);
        let roles = roles(m, &self.switches, &self.gates);
        let found = self.implicit.residual(&self.sys, h, &rhs, &roles, &z, &l);
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
        let (Phase::Moving, Some((_, mode))) = (&self.phase, self.present.clone()) else {
            return (self.z.clone(), self.l.clone());
        };
        let mut point = self.point.clone();
        if part < 1.0 {
            self.path.at(part * self.point.t, &mut point);
        }
        let mut x = vec![0.0; mode.n];
        self.path.state(&point, &mut x);
        let mut v = vec![0.0; self.v.len()];
        self.path.inputs(&self.segment, &point, &mut v);
        let mut d = Vec::new();
        self.segment.rates(&v, &mut d);
        let (mut z, mut l) = (vec![0.0; self.net.n], vec![0.0; self.net.m]);
        self.unknowns(&mode, &x, &v, &d, &mut z, &mut l);
        (z, l)
    }

    /// Unknowns in the mode so far at energy coordinates `a`, zero before the start.
    pub(super) fn unknowns_from(&self, a: &[f64]) -> Vec<f64> {
        let (mut z, mut l) = (vec![0.0; self.net.n], vec![0.0; self.net.m]);
        if let Some((_, mode)) = &self.present {
            let mut x = vec![0.0; mode.n];
            mode.enter(a, &mut x);
            self.unknowns(mode, &x, &self.v, &self.segment.rate, &mut z, &mut l);
        }
        z
    }

    /// Records a jump that ends in a mode, `origin` being the first and `entry` the last of the
    /// energy coordinates before it.
    pub(super) fn note_jump(&mut self, mode: &Arc<Mode>, id: Id, origin: &[f64], entry: &[f64]) {
        let change = self.a.iter().zip(origin).fold(0.0f64, |m, (x, y)| m.hypot(x - y));
        if change <= NOISE * self.scale.a {
            return;
        }
        self.count_jump(origin);
        if self.jumps.len() >= MAX_JUMPS {
            return;
        }
        let (n, m, k) = (self.net.n, self.net.m, self.net.kernel.cols);
        let before = self.unknowns_from(origin);
        let mut scrap = vec![0.0; m];
        let mut x = vec![0.0; mode.n];
        mode.enter(entry, &mut x);
        let mut after = vec![0.0; n];
        self.unknowns(mode, &x, &self.segment.now, &self.segment.rate, &mut after, &mut scrap);
        let (mut unknowns, mut multipliers) = (vec![0.0; n], vec![0.0; m]);
        let mut steps: Vec<(Id, Vec<f64>)> =
            self.picker.leaps.iter().map(|l| (l.through, l.before.clone())).collect();
        steps.push((id, entry.to_vec()));
        for (through, mut joint) in steps {
            let Ok(mode) = self.registry.mode(through, &self.net, &self.switches) else { continue };
            let Some(impulses) = &mode.impulses else { continue };
            joint.extend_from_slice(&self.segment.now);
            let mut b = vec![0.0; k + mode.active.len()];
            impulses.algebraic.apply(&joint, &mut b);
            self.net.kernel.apply_add(&b[..k], &mut unknowns);
            for (&i, &value) in mode.active.iter().zip(&b[k..]) {
                multipliers[i] += value;
            }
        }
        self.keep_jump([before, after], [unknowns, multipliers], 0.0);
    }

    /// Keeps a jump at the present time, the limit of steps of this length [s] or a closed form.
    pub(super) fn keep_jump(
        &mut self,
        [before, after]: [Vec<f64>; 2],
        [unknowns, multipliers]: [Vec<f64>; 2],
        length: f64,
    ) {
        let (time, sources) = (self.time, self.sources(self.time));
        self.jumps.push(Jump {
            time,
            before,
            after,
            multipliers,
            unknowns,
            functions: Vec::new(),
            sources,
            length,
            span: 0.0,
            shortest: length,
        });
    }

    /// Counts a jump from `origin` to the present energy coordinates.
    pub(super) fn count_jump(&mut self, origin: &[f64]) {
        self.stats.jumps += 1;
        self.witness_end();
        self.tally_jump(origin);
    }

    /// Takes note of the size of the state at the present point.
    pub(super) fn see(&mut self, mode: &Mode) {
        self.path.state(&self.point, &mut self.x);
        if mode.orthonormal() {
            return self.scale.see_state(&self.x);
        }
        let mut a = std::mem::take(&mut self.spare);
        a.resize(self.net.states, 0.0);
        self.path.inputs(&self.segment, &self.point, &mut self.v);
        mode.leave(&self.x, &self.v, &mut a);
        self.scale.see_state(&a);
        self.spare = a;
    }

    /// Takes the mode of the pairs that conduct for the one so far, if they are known.
    pub(super) fn enter_known(&mut self, active: Option<Vec<bool>>) {
        if let Some(mut on) = active {
            fix(&self.switches, &self.gates, &mut on);
            let id = self.registry.id(&on, &self.gates);
            let mode = self.registry.mode(id, &self.net, &self.switches);
            self.present = mode.ok().map(|mode| (id, mode));
        }
    }

    /// Active pairs of the present mode.
    pub fn active(&self) -> Vec<bool> {
        self.logged.clone()
    }

    /// Source values at a time.
    pub(super) fn sources(&self, time: f64) -> Vec<f64> {
        let mut u = vec![0.0; self.inputs.waveforms().len()];
        self.inputs.values(time, Side::Right, &mut u);
        u
    }

    /// Notes which pairs have changed since the last time.
    pub(super) fn log(&mut self, id: Id) {
        if !self.log_open {
            return;
        }
        for (i, (old, &new)) in self.logged.iter_mut().zip(self.registry.on(id)).enumerate() {
            if *old != new {
                *old = new;
                self.stats.events += 1;
                if self.events.len() < MAX_EVENTS {
                    self.events.push((self.time, i, new));
                }
            }
        }
    }
}

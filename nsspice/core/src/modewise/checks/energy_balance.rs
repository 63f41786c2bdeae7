//! The balance of energy over all segments of a run: what is delivered and dissipated in each, from
//! its two ends and the powers of its mode.
//!
//! Powers are formed by [`crate::audit::Sums`] from the assembled arrays, of the unknowns and
//! multipliers that the maps of the mode make of its coordinates: a mode whose maps break the laws
//! gives an energy that does not lead from the first state of the run to the last.

use crate::audit::{Balance, Sums};
use crate::dense::Matrix;
use crate::modewise::checks::segment_energies::{energy, SegmentEnergies, Two};
use crate::modewise::functions::terms::Point;
use crate::modewise::modes::mode::Mode;
use crate::modewise::modes::registry::Id;
use crate::modewise::run::Engine;
use crate::modewise::run_state::Phase;

/// Where within a segment energy is looked at, as a part of its length: no zero of a wave that is one at both
/// ends.
const WITHIN: f64 = 0.382;

/// Adds up the energies of a run.
#[derive(Default)]
pub(in crate::modewise) struct EnergyBalance {
    pub sums: Option<Box<Sums>>,
    d: Vec<f64>,
    segment_energies: Option<Box<SegmentEnergies>>,
}

impl Engine {
    /// Lets the balance of energy go with the run; call it before the start.
    pub fn accompany(&mut self, sums: Option<Sums>) {
        self.energy_balance.sums = sums.map(Box::new);
    }

    /// The run begins at the present energy coordinates.
    pub(in crate::modewise) fn balance_start(&mut self) {
        if let Some(sums) = &mut self.energy_balance.sums {
            sums.start(&unknowns_of(&self.prepared.net.big_r, &self.state.a));
        }
    }

    /// Takes the largest voltage and current from a point.
    pub(in crate::modewise) fn balance_look(&mut self, z: &[f64], l: &[f64]) {
        if let Some(sums) = &mut self.energy_balance.sums {
            sums.see(z, l);
        }
    }

    /// The energy coordinates have jumped from `origin` to the present ones.
    pub(in crate::modewise) fn balance_jump(&mut self, origin: &[f64]) {
        if let Some(sums) = &mut self.energy_balance.sums {
            let r = &self.prepared.net.big_r;
            // where motions begin is compared with where the last ones ended by itself
            let after = unknowns_of(r, &self.state.a);
            sums.jump(&unknowns_of(r, origin), &after, Some(&after));
        }
    }

    /// An implicit step of the length `h` has been accepted, from the present energy coordinates.
    pub(in crate::modewise) fn balance_step(&mut self, h: f64, u: &[f64]) {
        if let Some(sums) = &mut self.energy_balance.sums {
            let from = unknowns_of(&self.prepared.net.big_r, &self.state.a);
            let (z, l, none) = (&self.implicit.z, &self.implicit.l, &[][..]);
            sums.step(h, [&from, z], l, [u, u], [none, none], false);
        }
    }

    /// The segment has come to its end, whose modal state and inputs are known.
    pub(in crate::modewise) fn balance_segment(&mut self, id: Id, mode: &Mode) {
        let Some(mut sums) = self.energy_balance.sums.take() else { return };
        let (energies, fresh) = self.energies(&mut sums, id, mode);
        sums.motion(self.motion.point.t, energies);
        if self.stats.segments.is_power_of_two() || fresh {
            self.see_end(&mut sums, mode);
            self.see_within(&mut sums, mode);
        }
        self.energy_balance.sums = Some(sums);
    }

    /// Takes the largest voltage and current at the end of the segment.
    fn see_end(&mut self, sums: &mut Sums, mode: &Mode) {
        self.motion.segment.rates(&self.state.v, &mut self.energy_balance.d);
        let (mut z, mut l) = (vec![0.0; self.prepared.net.n], vec![0.0; self.prepared.net.m]);
        self.unknowns(mode, &self.state.x, &self.state.v, &self.energy_balance.d, &mut z, &mut l);
        sums.see(&z, &l);
    }

    /// Takes what is stored somewhere within the segment: over whole periods it comes back, and the ends show
    /// nothing of what was turned over.
    fn see_within(&self, sums: &mut Sums, mode: &Mode) {
        if !self.motion.path.closed() {
            return;
        }
        let (mut point, mut x) = (Point::default(), vec![0.0; mode.n]);
        let (mut v, mut a) = (self.state.v.clone(), vec![0.0; self.state.a.len()]);
        self.motion.path.at(WITHIN * self.motion.point.t, &mut point);
        self.motion.path.state(&point, &mut x);
        self.motion.path.inputs(&self.motion.segment, &point, &mut v);
        sums.see_stored(energy(mode, &x, &v, &mut a));
    }

    /// The balance of energy up to the end of the present segment, if all of it was added up.
    pub fn balance(&mut self) -> Option<Balance> {
        let mut sums = self.energy_balance.sums.clone()?;
        if self.expanded.active {
            let length = if self.span.time < self.plan.stop { 1.0 } else { 0.0 };
            if length > 0.0 {
                self.add_energies(&mut sums);
            }
            let (z, _) = self.expanded_state(length * (self.span.end - self.span.time));
            return Some(sums.balance(&z));
        }
        let mut a = self.state.a.clone();
        if let (Phase::Moving, Some((id, mode)), true) =
            (&self.span.phase, self.motion.present.clone(), self.span.time < self.plan.stop)
        {
            self.state.x.resize(mode.n, 0.0);
            self.motion.path.state(&self.motion.point, &mut self.state.x);
            self.motion.path.inputs(&self.motion.segment, &self.motion.point, &mut self.state.v);
            let (energies, _) = self.energies(&mut sums, id, &mode);
            sums.motion(self.motion.point.t, energies);
            self.see_end(&mut sums, &mode);
            self.see_within(&mut sums, &mode);
            mode.leave(&self.state.x, &self.state.v, &mut a);
        }
        Some(sums.balance(&unknowns_of(&self.prepared.net.big_r, &a)))
    }

    /// What is dissipated and delivered in the segment, and whether it is the first one of its mode.
    fn energies(&mut self, sums: &mut Sums, id: Id, mode: &Mode) -> (Two, bool) {
        if self.motion.point.t <= 0.0 {
            return ([0.0; 2], false);
        }
        let fresh = self.registry.supply(id, mode, &self.prepared.net);
        let mut segment_energies = self.energy_balance.segment_energies.take().unwrap_or_default();
        let supplies = self.registry.supplies(id);
        let found = segment_energies.segment(self, sums, mode, supplies, fresh);
        self.energy_balance.segment_energies = Some(segment_energies);
        (found, fresh)
    }
}

/// Unknowns that store something, from energy coordinates.
fn unknowns_of(big_r: &Matrix, a: &[f64]) -> Vec<f64> {
    let mut z = vec![0.0; big_r.rows];
    big_r.apply(a, &mut z);
    z
}

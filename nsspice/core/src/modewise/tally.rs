//! The balance of energy over all segments of a run: what is delivered and dissipated in each, from
//! its two ends and the powers of its mode.
//!
//! Powers are formed by [`crate::audit::Sums`] from the assembled arrays, of the unknowns and
//! multipliers that the maps of the mode make of its coordinates: a mode whose maps break the laws
//! gives an energy that does not lead from the first state of the run to the last.

use super::integral::{Motion, SLOW};
use super::mode::Mode;
use super::products::{Integral, Two};
use super::registry::Id;
use super::retrace::{energy, Retrace};
use super::run::{Engine, Phase};
use super::terms::Point;
use crate::audit::{Balance, Sums};
use crate::dense::{dot, Matrix};

/// What one mode needs for its energies.
pub struct Powers {
    motion: Motion,
    /// unknowns, multipliers and sources of unit coordinates, one per row
    units: [Matrix; 3],
    /// made for segments of some lengths; those used last come first
    integrals: Vec<Integral>,
}

/// Integrals kept of a mode.
const KEPT: usize = 8;
/// What energies may cost, in multiplications: part of what a run costs by itself, and what is had in
/// advance, some two milliseconds.
const SHARE: f64 = 0.1;
const STOCK: f64 = 3e6;
/// Largest modes whose powers become forms: a segment of larger ones is followed for less.
const FORMED: usize = 16;
/// Where within a segment energy is looked at, as a part of its length: no zero of a wave that is one at both
/// ends.
const WITHIN: f64 = 0.382;
/// Cost of what is made once for a mode, with so many coordinates.
fn making(size: usize) -> f64 {
    5.0 * size.pow(3) as f64 + 8000.0
}

/// Adds up the energies of a run.
#[derive(Default)]
pub(super) struct Tally {
    pub sums: Option<Box<Sums>>,
    credit: f64,
    /// the mode of the last segment has been met for the first time
    fresh: bool,
    ends: [Vec<f64>; 2],
    point: Point,
    x: Vec<f64>,
    v: Vec<f64>,
    d: Vec<f64>,
    retrace: Retrace,
}

impl Powers {
    /// Numbers held.
    pub fn size(&self) -> usize {
        let units: usize = self.units.iter().map(|m| m.data.len()).sum();
        units + self.motion.size().pow(2) + self.integrals.iter().map(Integral::size).sum::<usize>()
    }
}

impl Engine {
    /// Lets the balance of energy go with the run; call it before the start.
    pub fn accompany(&mut self, sums: Option<Sums>) {
        self.tally.sums = sums.map(Box::new);
        self.tally.credit = STOCK;
    }

    /// The run begins at the present energy coordinates.
    pub(super) fn tally_start(&mut self) {
        if let Some(sums) = &mut self.tally.sums {
            sums.start(&unknowns_of(&self.net.big_r, &self.a));
        }
    }

    /// Takes the largest voltage and current from a point.
    pub(super) fn tally_look(&mut self, z: &[f64], l: &[f64]) {
        if let Some(sums) = &mut self.tally.sums {
            sums.see(z, l);
        }
    }

    /// The energy coordinates have jumped from `origin` to the present ones.
    pub(super) fn tally_jump(&mut self, origin: &[f64]) {
        if let Some(sums) = &mut self.tally.sums {
            let r = &self.net.big_r;
            sums.jump(&unknowns_of(r, origin), &unknowns_of(r, &self.a));
        }
    }

    /// An implicit step of the length `h` has been accepted, from the present energy coordinates.
    pub(super) fn tally_step(&mut self, h: f64, u: &[f64]) {
        if let Some(sums) = &mut self.tally.sums {
            let from = unknowns_of(&self.net.big_r, &self.a);
            let (z, l, none) = (&self.implicit.z, &self.implicit.l, &[][..]);
            sums.step(h, [&from, z], l, [u, u], [none, none], false);
        }
    }

    /// The segment has come to its end, whose modal state and inputs are known.
    pub(super) fn tally_segment(&mut self, id: Id, mode: &Mode) {
        let Some(mut sums) = self.tally.sums.take() else { return };
        let slots = (self.march.lately() * mode.guards.x.rows * self.path.slots) as f64;
        self.tally.credit += SHARE * (2000.0 + 4.0 * slots);
        if let Some(energies) = self.energies(&mut sums, id, mode) {
            sums.motion(self.point.t, energies);
            if self.stats.segments.is_power_of_two() || self.tally.fresh {
                self.see_end(&mut sums, mode);
                self.see_within(&mut sums, mode);
            }
            self.tally.sums = Some(sums);
        }
    }

    /// Takes the largest voltage and current at the end of the segment.
    fn see_end(&mut self, sums: &mut Sums, mode: &Mode) {
        self.segment.rates(&self.v, &mut self.tally.d);
        let (mut z, mut l) = (vec![0.0; self.net.n], vec![0.0; self.net.m]);
        self.unknowns(mode, &self.x, &self.v, &self.tally.d, &mut z, &mut l);
        sums.see(&z, &l);
    }

    /// Takes what is stored somewhere within the segment: over whole periods it comes back, and the ends tell
    /// nothing of what was turned over.
    fn see_within(&self, sums: &mut Sums, mode: &Mode) {
        if !self.path.closed() {
            return;
        }
        let (mut point, mut x) = (Point::default(), vec![0.0; mode.n]);
        let (mut v, mut a) = (self.v.clone(), vec![0.0; self.a.len()]);
        self.path.at(WITHIN * self.point.t, &mut point);
        self.path.state(&point, &mut x);
        self.path.inputs(&self.segment, &point, &mut v);
        sums.see_stored(energy(mode, &x, &v, &mut a));
    }

    /// The balance of energy up to the end of the present segment, if all of it was added up.
    pub fn balance(&mut self) -> Option<Balance> {
        let mut sums = self.tally.sums.clone()?;
        let mut a = self.a.clone();
        if let (Phase::Moving, Some((id, mode)), true) =
            (&self.phase, self.present.clone(), self.time < self.stop)
        {
            self.x.resize(mode.n, 0.0);
            self.path.state(&self.point, &mut self.x);
            self.path.inputs(&self.segment, &self.point, &mut self.v);
            let energies = self.energies(&mut sums, id, &mode)?;
            sums.motion(self.point.t, energies);
            self.see_end(&mut sums, &mode);
            self.see_within(&mut sums, &mode);
            mode.leave(&self.x, &self.v, &mut a);
        }
        Some(sums.balance(&unknowns_of(&self.net.big_r, &a)))
    }

    /// What is dissipated and delivered in the segment; None if neither way can tell.
    fn energies(&mut self, sums: &mut Sums, id: Id, mode: &Mode) -> Option<Two> {
        if self.point.t <= 0.0 {
            return Some([0.0; 2]);
        }
        self.tally.fresh = false;
        self.by_forms(sums, id, mode).or_else(|| self.retraced(sums, mode))
    }

    /// The same by the forms of the mode; None if it would cost too much.
    fn by_forms(&mut self, sums: &Sums, id: Id, mode: &Mode) -> Option<Two> {
        let h = self.point.t;
        let (mut powers, known) = match self.registry.take_powers(id) {
            Some(powers) => (powers, true),
            None if mode.n > FORMED && mode.blocks.is_empty() => return None,
            None => (Box::new(self.powers(mode)?), false),
        };
        let found = self.integrated(sums, &mut powers, h);
        self.registry.keep_powers(id, powers, known);
        found
    }

    /// The same by way of the laws: the segment once more, and what it misses.
    fn retraced(&mut self, sums: &mut Sums, mode: &Mode) -> Option<Two> {
        let mut retrace = std::mem::take(&mut self.tally.retrace);
        let found = retrace.segment(self, sums, mode);
        self.tally.retrace = retrace;
        found
    }

    /// The powers of a mode met for the first time.
    fn powers(&mut self, mode: &Mode) -> Option<Powers> {
        let delivers = |i: usize| (0..self.net.n).any(|r| self.net.s[(r, i)] != 0.0);
        let maps = [&mode.leave_v, &mode.algebraic.v, &mode.algebraic.d];
        let counts =
            |i: usize| delivers(i) || maps.iter().any(|m| (0..m.rows).any(|r| m[(r, i)] != 0.0));
        self.tally.fresh = true;
        let motion = Motion::new(&mode.poles, &mode.blocks, &mode.drive, &self.turns, counts);
        let size = motion.size();
        self.spend(making(size))?;
        let (n, m, p) = (self.net.n, self.net.m, self.inputs.waveforms().len());
        let mut units = [n, m, p].map(|count| Matrix::zeros(size, count));
        let sources: Vec<Vec<f64>> = (0..p).map(|k| self.inputs.combine(&[(k, 1.0)])).collect();
        let nv = self.v.len();
        let (mut x, mut v, mut d) = (vec![0.0; mode.n], vec![0.0; nv], vec![0.0; nv]);
        let (mut a, mut b) = (Vec::new(), Vec::new());
        let [z, l, u] = &mut units;
        for k in 0..size {
            motion.unit(k, [&mut x, &mut v, &mut d]);
            let work = [&mut a, &mut b];
            self.unknowns_in(mode, [&x, &v, &d], z.row_mut(k), l.row_mut(k), work);
            for (u, factors) in u.row_mut(k).iter_mut().zip(&sources) {
                *u = dot(factors, &v);
            }
        }
        Some(Powers { motion, units, integrals: Vec::new() })
    }

    /// Takes from what energies may cost.
    fn spend(&mut self, cost: f64) -> Option<()> {
        self.tally.credit -= cost;
        (self.tally.credit >= 0.0).then_some(())
    }

    fn integrated(&mut self, sums: &Sums, powers: &mut Powers, h: f64) -> Option<Two> {
        if let Some(()) = self.prepare(sums, powers, h)? {
            self.spend(2.0 * powers.integrals[0].work() as f64)?;
            let tally = &mut self.tally;
            tally.d.clear();
            self.segment.rates(&self.v, &mut tally.d);
            let begin = [self.path.start(), &self.segment.now[..], &self.segment.rate];
            let end = [&self.x[..], &self.v, &tally.d];
            for (y, at) in tally.ends.iter_mut().zip([begin, end]) {
                y.clear();
                powers.motion.gather(at, y);
            }
            let [a, b] = &mut tally.ends;
            return Some(powers.integrals[0].over(h, a, b));
        }
        self.by_stretches(sums, powers, h)
    }

    /// Puts an integral for this length first: None if it would cost too much, None inside if there
    /// is none.
    fn prepare(&mut self, sums: &Sums, powers: &mut Powers, h: f64) -> Option<Option<()>> {
        let fits = |i: &Integral| i.shortest <= h && h <= i.longest;
        match powers.integrals.iter().position(fits) {
            Some(0) => return Some(Some(())),
            Some(k) => {
                powers.integrals[..=k].rotate_right(1);
                return Some(Some(()));
            }
            None => {}
        }
        self.spend(making(powers.motion.size()))?;
        let [z, l, u] = &powers.units;
        let forms =
            |columns: &Matrix| sums.powers(&columns.times(z), &columns.times(l), &columns.times(u));
        let Some(integral) = powers.motion.integral(h, forms) else { return Some(None) };
        powers.integrals.truncate(KEPT - 1);
        powers.integrals.insert(0, integral);
        Some(Some(()))
    }

    /// The same of a segment in which some rates cannot be told apart: in pieces that are short for
    /// all of them.
    fn by_stretches(&mut self, sums: &Sums, powers: &mut Powers, h: f64) -> Option<Two> {
        let count = (powers.motion.fastest() * h / SLOW).ceil().max(1.0);
        self.spend(count * (200.0 + 20.0 * powers.motion.size() as f64))?;
        let piece = h / count;
        self.prepare(sums, powers, piece)??;
        self.spend(count * 2.0 * powers.integrals[0].work() as f64)?;
        let mut tally = std::mem::take(&mut self.tally);
        let mut sum = [0.0; 2];
        tally.x.resize(self.path.start().len(), 0.0);
        tally.v.resize(self.v.len(), 0.0);
        let mut last = Vec::new();
        for k in 0..=count as usize {
            let t = if k == count as usize { h } else { k as f64 * piece };
            self.path.at(t, &mut tally.point);
            self.path.state(&tally.point, &mut tally.x);
            self.path.inputs(&self.segment, &tally.point, &mut tally.v);
            self.segment.rates(&tally.v, &mut tally.d);
            let [a, b] = &mut tally.ends;
            b.clear();
            powers.motion.gather([&tally.x, &tally.v, &tally.d], b);
            let kept = b.clone();
            if k > 0 {
                a.clone_from(&last);
                let found = powers.integrals[0].over(piece, a, b);
                sum = [sum[0] + found[0], sum[1] + found[1]];
            }
            last = kept;
        }
        self.tally = tally;
        Some(sum)
    }
}

/// Unknowns that store something, from energy coordinates.
fn unknowns_of(big_r: &Matrix, a: &[f64]) -> Vec<f64> {
    let mut z = vec![0.0; big_r.rows];
    big_r.apply(a, &mut z);
    z
}

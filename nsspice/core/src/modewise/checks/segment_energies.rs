//! Energies of a segment: what is delivered and what is dissipated.
//!
//! With `rho = E z' + G z + A lambda - S u` the stored energy `W = z' E z / 2` changes by exactly what
//! is delivered, less what is dissipated, plus the integral of `z' rho`.  So the laws need not be
//! squared: the maps of a mode are put into the assembled matrices, all modal
//! coordinates at a time, each with a random sign and as large as its integral over the segment.  What
//! is left are charges and fluxes by which Kirchhoff's laws are missed, at any time; times the
//! largest voltage and current they are energy.  Several coordinates that break a law could hide each
//! other with one choice of signs, but every segment makes its own.  Products of `n` numbers are rounded
//! by `n u` of the largest (Higham: Accuracy and Stability of Numerical Algorithms, 2002, section 3.5):
//! so a fast rate times the rounding of all coordinates is what any mode with it misses.
//!
//! That the coordinates move as they should is seen by following them once more ([`crate::modewise::checks::modal_energies`],
//! [`crate::modewise::checks::gramian`]) from the state at the begin: the stored energy at both ends is that of these two
//! states, and a next segment that begins elsewhere breaks the balance of the run.

use crate::audit::Sums;
use crate::dense::{complex, dot, norm, Complex, Matrix};
use crate::modewise::checks::gramian::followed;
use crate::modewise::checks::modal_energies::ModalEnergies;
use crate::modewise::modes::implicit_step::later;
use crate::modewise::modes::input_power::Supply;
use crate::modewise::modes::mode::Mode;
use crate::modewise::run::Engine;
use crate::modewise::spectra::block::row_norm;
use crate::modewise::spectra::spectrum::Pole;
#[cfg(test)]
use crate::structure::Coordinates;

/// What is dissipated, and what is delivered [J].
pub type Two = [f64; 2];

/// Segments of which one is asked, which counts for so many: what is missed keeps its expected sum.
const ASKED: u64 = 8;

const ZERO: Complex = complex(0.0, 0.0);

/// Work space.
#[derive(Default)]
pub struct SegmentEnergies {
    modal: ModalEnergies,
    forces: Vec<Complex>,
    /// by function: what each input is, what follows all of them steadily in the current of each, what they give
    /// with a coordinate, and its steady part
    factors: Vec<Complex>,
    currents: Vec<Complex>,
    /// the sum of the sizes of its terms
    sizes: Vec<f64>,
    weights: Vec<Complex>,
    steady: Vec<Complex>,
    /// states at the end, and what the laws are asked with: states and their rates
    end: Vec<f64>,
    asked: Vec<f64>,
    change: Vec<f64>,
    v: Vec<f64>,
    d: Vec<f64>,
    a: Vec<f64>,
    b: Vec<f64>,
    rate: Vec<f64>,
    z: Vec<f64>,
    l: Vec<f64>,
    u: Vec<f64>,
}

/// Random numbers without a state: the same in every run.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Plus or minus a size.
    fn sign(&mut self, size: f64) -> f64 {
        if self.next() >> 63 == 0 {
            size
        } else {
            -size
        }
    }

    /// Between 0 and 1.
    fn part(&mut self) -> f64 {
        (self.next() >> 11) as f64 * 2f64.powi(-53)
    }
}

fn one_norm(z: Complex) -> f64 {
    z.re.abs() + z.im.abs()
}

/// Half the square of energy coordinates.
pub(in crate::modewise) fn energy(mode: &Mode, x: &[f64], v: &[f64], a: &mut [f64]) -> f64 {
    mode.leave(x, v, a);
    0.5 * dot(a, a)
}

impl SegmentEnergies {
    /// What is dissipated and delivered up to the present point of a segment; the laws are asked in the first
    /// one of a mode.
    pub fn segment(
        &mut self,
        engine: &Engine,
        sums: &mut Sums,
        mode: &Mode,
        supplies: &[Supply],
        fresh: bool,
    ) -> Two {
        let (h, start) = (engine.motion.point.t, engine.motion.path.start());
        self.modal.set(&engine.motion.segment, h);
        self.end.resize(mode.n, 0.0);
        self.begin(supplies);
        let mut delivered = 0.0;
        for pole in &mode.poles {
            delivered += self.pole(mode, pole, start, supplies);
        }
        for (at, matrix) in &mode.blocks {
            delivered += self.block(mode, *at, matrix, start, supplies);
        }
        self.clean((mode.n + mode.leave_v.cols) as f64);
        let count = self.weights.len();
        let rows = self.factors.chunks_exact(count).zip(self.currents.chunks_exact(count));
        delivered += rows.map(|(u, i)| self.modal.between(u, i).re).sum::<f64>();
        self.a.resize(engine.prepared.net.states, 0.0);
        let before = energy(mode, start, &engine.motion.segment.now, &mut self.a);
        self.modal.last(&mut self.v, mode.leave_v.cols);
        let after = energy(mode, &self.end, &self.v, &mut self.a);
        let mut chance = Chance(sums.steps());
        let count = if fresh { 1 } else { ASKED };
        if chance.next().is_multiple_of(count) {
            self.choose(mode, start, &mut chance, h);
            later(&engine.motion.segment, h * chance.part(), &mut self.v);
            engine.motion.segment.rates(&self.v, &mut self.d);
            self.ask(engine, sums, mode, count as f64, h);
        }
        [delivered - (after - before), delivered]
    }

    /// What inputs are, and what they give to one another.
    fn begin(&mut self, supplies: &[Supply]) {
        let count = self.modal.bases.len();
        for list in [&mut self.forces, &mut self.weights, &mut self.steady] {
            list.resize(count, ZERO);
        }
        for list in [&mut self.factors, &mut self.currents] {
            list.resize(supplies.len() * count, ZERO);
        }
        self.sizes.resize(supplies.len() * count, 0.0);
        let factors = self.factors.chunks_exact_mut(count);
        let lists = factors.zip(self.currents.chunks_exact_mut(count));
        for (supply, (factors, currents)) in supplies.iter().zip(lists) {
            let own = |j: usize| complex(f64::from(u8::from(j == supply.input)), 0.0);
            self.modal.forces(own, factors);
            self.modal.real_forces(&supply.v, currents);
            self.modal.rates(&supply.d, currents);
        }
        for (size, current) in self.sizes.iter_mut().zip(&self.currents) {
            *size = one_norm(*current);
        }
    }

    /// Takes what is left of currents whose terms cancel, but for the rounding of so many of them, for nothing: of
    /// a source that feeds a network at rest through little resistance it is watts.
    fn clean(&mut self, terms: f64) {
        let count = self.weights.len();
        for (currents, sizes) in
            self.currents.chunks_exact_mut(count).zip(self.sizes.chunks_exact(count))
        {
            for (b, base) in self.modal.bases.iter().enumerate() {
                if base.mirrored {
                    // currents are real
                    let mean = (currents[b - 1] + currents[b].conj()).scale(0.5);
                    (currents[b - 1], currents[b]) = (mean, mean.conj());
                } else if base.rate.im == 0.0 {
                    currents[b].im = 0.0;
                }
            }
            for (current, size) in currents.iter_mut().zip(sizes) {
                if one_norm(*current) <= terms * f64::EPSILON * size {
                    *current = ZERO;
                }
            }
        }
    }

    /// What all inputs give with a coordinate.
    fn weigh(&mut self, supplies: &[Supply], acts: impl Fn(&[f64]) -> Complex) {
        let count = self.weights.len();
        self.weights.fill(ZERO);
        for (supply, factors) in supplies.iter().zip(self.factors.chunks_exact(count)) {
            let acts = acts(&supply.x);
            for (weight, &factor) in self.weights.iter_mut().zip(factors) {
                *weight = *weight + acts * factor;
            }
        }
    }

    /// Follows a coordinate to the end; returns what the inputs give with it.
    fn pole(&mut self, mode: &Mode, pole: &Pole, start: &[f64], supplies: &[Supply]) -> f64 {
        let (at, pair) = (pole.at, pole.omega != 0.0);
        let both = |list: &[f64]| complex(list[at], if pair { list[at + 1] } else { 0.0 });
        let drive = mode.drive.row(at);
        if pair {
            let next = mode.drive.row(at + 1);
            self.modal.forces(|j| complex(drive[j], next[j]), &mut self.forces);
        } else {
            self.modal.real_forces(drive, &mut self.forces);
        }
        self.weigh(supplies, |x| both(x).conj());
        let rate = complex(pole.alpha, pole.omega);
        let lists = [&self.forces[..], &self.weights];
        let [end, given] = self.modal.follow(rate, both(start), lists, &mut self.steady);
        let count = self.weights.len();
        for (c, &steady) in self.steady.iter().enumerate().filter(|(_, part)| **part != ZERO) {
            for (supply, at) in supplies.iter().zip((c..).step_by(count)) {
                let part = both(&supply.x).conj() * steady;
                self.currents[at] = self.currents[at] + part;
                self.sizes[at] += one_norm(part);
            }
        }
        self.end[at] = end.re;
        if pair {
            self.end[at + 1] = end.im;
        }
        given.re
    }

    /// The same for coordinates without eigenvectors.
    fn block(
        &mut self,
        mode: &Mode,
        at: usize,
        matrix: &Matrix,
        start: &[f64],
        supplies: &[Supply],
    ) -> f64 {
        let places = at..at + matrix.rows;
        let (mut forces, mut weights) = (Vec::new(), Vec::new());
        for r in places.clone() {
            self.modal.real_forces(mode.drive.row(r), &mut self.forces);
            self.weigh(supplies, |x| complex(x[r], 0.0));
            forces.push(self.forces.clone());
            weights.push(self.weights.clone());
        }
        let begin = &start[places.clone()];
        let (end, given) = followed(&self.modal, matrix, begin, &forces, &weights);
        self.end[places].copy_from_slice(&end);
        given
    }

    /// Chooses coordinates to ask the laws with, and their change with the same rates.
    fn choose(&mut self, mode: &Mode, start: &[f64], chance: &mut Chance, h: f64) {
        for list in [&mut self.asked, &mut self.change] {
            list.resize(mode.n, 0.0);
        }
        // where coordinates are left at the end
        mode.turn(&self.end, &mut self.change);
        mode.drive.apply_add(&self.v, &mut self.change);
        let poles = mode.poles.iter().map(|p| (p.at..p.at + p.width(), p.size()));
        let blocks = mode.blocks.iter().map(|(at, m)| (*at..at + m.rows, row_norm(m)));
        for (at, rate) in poles.chain(blocks) {
            // as large as the integral
            let time = h.min(1.0 / rate);
            let moved = norm(&self.end[at.clone()]) + time * norm(&self.change[at.clone()]);
            let size = h * moved + time * norm(&start[at.clone()]);
            self.asked[at].iter_mut().for_each(|x| *x = chance.sign(size));
        }
        mode.turn(&self.asked, &mut self.change);
    }

    /// Asks the laws with these coordinates, with the inputs at an instant.
    fn ask(&mut self, engine: &Engine, sums: &mut Sums, mode: &Mode, count: f64, h: f64) {
        let net = &engine.prepared.net;
        for list in [&mut self.v, &mut self.d] {
            list.iter_mut().for_each(|v| *v *= count * h);
        }
        for list in [&mut self.asked, &mut self.change] {
            list.iter_mut().for_each(|x| *x *= count);
        }
        mode.drive.apply_add(&self.v, &mut self.change);
        mode.leave(&self.change, &self.d, &mut self.a);
        self.rate.resize(net.n, 0.0);
        net.big_r.apply(&self.a, &mut self.rate);
        self.z.resize(net.n, 0.0);
        self.l.resize(net.m, 0.0);
        let values = [&self.asked[..], &self.v, &self.d];
        let work = [&mut self.a, &mut self.b];
        engine.unknowns_in(mode, values, &mut self.z, &mut self.l, work);
        self.u.clear();
        let sources = engine.prepared.inputs.waveforms().len();
        self.u.extend((0..sources).map(|k| engine.prepared.inputs.value_of(k, &self.v)));
        // of coordinates whose energy is half the square of their length
        let rounding = mode.n as f64 * f64::EPSILON * mode.fastest * norm(&self.asked);
        sums.miss(count * h, [&self.rate, &self.z, &self.l, &self.u], rounding);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::audit::{Between, TOLERANCE};
    use crate::descriptor::Linear;
    use crate::modewise::functions::inputs::Inputs;
    use crate::modewise::modes::network::Assembly;
    use crate::modewise::modes::prepared::Prepared;
    use crate::modewise::run::Engine;
    use crate::sparse::Csc;
    use crate::waveform::{Smooth, Waveform};

    const STATES: usize = 20;

    /// A stage_equations of resistors and capacitors that a current feeds, in the middle of a segment of 0.3 s,
    /// and the sums of its energies.
    fn stage_equations() -> (Engine, Sums) {
        let diagonal: Vec<_> = (0..STATES).map(|k| (k, k, 1.0 + 0.1 * k as f64)).collect();
        let mut acting: Vec<_> = (0..STATES).map(|k| (k, k, 2.5)).collect();
        for k in 1..STATES {
            acting.extend([(k - 1, k, -1.0), (k, k - 1, -1.0)]);
        }
        let linear = Linear {
            e: Csc::from_triplets(STATES, STATES, &diagonal),
            g: Csc::from_triplets(STATES, STATES, &acting),
            a: Csc::zeros(STATES, 0),
            b: Csc::zeros(0, STATES),
            d: Csc::zeros(0, 0),
            q: Vec::new(),
            s: Csc::from_triplets(STATES, 1, &[(0, 0, 1.0)]),
            row_kind: vec![0; STATES],
        };
        let edge = |&(k, _, c): &(usize, usize, f64)| (k as isize, -1, c);
        let mut conductors: Vec<_> = (1..STATES as isize).map(|k| (k - 1, k, 1.0)).collect();
        for k in 0..STATES {
            let beside = if k == 0 || k + 1 == STATES { 1.0 } else { 2.0 };
            conductors.push((k as isize, -1, 2.5 - beside));
        }
        let capacitors: Vec<_> = diagonal.iter().map(edge).collect();
        let coordinates = Coordinates::of_nodes(linear.g.nrows);
        let coordinates = &coordinates;
        let between = Between { capacitors: &capacitors, conductors: &conductors, coordinates };
        let sums = Sums::new(&linear, between, None, None).unwrap_or_else(|| unreachable!());
        let (offset, amplitude, frequency) = (1.0, 3.0, 0.7);
        let (delay, damping, phase) = (0.0, 0.0, 0.0);
        let sine = Smooth::Sin { offset, amplitude, frequency, delay, damping, phase };
        let inputs = Inputs::new(vec![Waveform::Smooth(sine)]).unwrap_or_else(|_| unreachable!());
        let sys = Assembly { coordinates: coordinates.clone(), linear, capacitors, conductors };
        let prepared = Prepared::new(sys, inputs, [].into()).unwrap_or_else(|_| unreachable!());
        let mut engine = Engine::new(&prepared, Vec::new());
        engine.accompany(Some(sums.clone()));
        engine.plan(1.0, 0.0, 1.0, 0.01);
        let charges: Vec<f64> = (0..STATES).map(|k| 1.0 - 0.2 * k as f64).collect();
        assert!(engine.start(&charges, &[], None).is_ok());
        engine.motion.path.at(0.3, &mut engine.motion.point);
        (engine, sums)
    }

    /// The relative error of the balance if the motion is said to be that of a mode.
    fn drift(engine: &Engine, sums: &Sums, mode: &Mode) -> f64 {
        let mut sums = sums.clone();
        let unknowns = |a: &[f64]| {
            let mut z = vec![0.0; STATES];
            engine.prepared.net.big_r.apply(a, &mut z);
            z
        };
        let (_, own) = engine.motion.present.as_ref().unwrap_or_else(|| unreachable!());
        let (mut x, mut a) = (vec![0.0; own.n], vec![0.0; STATES]);
        energy(own, engine.motion.path.start(), &engine.motion.segment.now, &mut a);
        sums.start(&unknowns(&a));
        let supplies = Supply::all(&engine.prepared.net, mode);
        let found = SegmentEnergies::default().segment(engine, &mut sums, mode, &supplies, true);
        sums.motion(0.3, found);
        engine.motion.path.state(&engine.motion.point, &mut x);
        let mut v = vec![0.0; engine.state.v.len()];
        engine.motion.path.inputs(&engine.motion.segment, &engine.motion.point, &mut v);
        energy(own, &x, &v, &mut a);
        sums.balance(&unknowns(&a)).drift
    }

    #[test]
    fn one_wrong_number_of_a_mode_is_noticed() {
        let (engine, sums) = stage_equations();
        let (_, mode) = engine.motion.present.clone().unwrap_or_else(|| unreachable!());
        assert!(drift(&engine, &sums, &mode) < 1e-13);
        let spoil = |change: &dyn Fn(&mut Mode)| {
            let mut wrong = (*mode).clone();
            change(&mut wrong);
            drift(&engine, &sums, &wrong)
        };
        const OFF: f64 = 1.0 + 1e-6;
        // what the sources force in 0.3 s is small next to what is stored
        const FAR: f64 = 1.0 + 1e-4;
        for k in [0, 7, STATES - 1] {
            assert!(spoil(&|m| m.poles[k].alpha *= OFF) > TOLERANCE);
            assert!(spoil(&|m| m.drive[(k, 0)] *= FAR) > TOLERANCE);
            assert!(spoil(&|m| m.drive[(k, 1)] *= FAR) > TOLERANCE);
            for r in [0, 11] {
                assert!(spoil(&|m| m.leave_x[(r, k)] += 1e-4) > TOLERANCE);
            }
        }
        // not a number is no small one
        assert!(spoil(&|m| m.poles[3].alpha = f64::NAN).is_nan());
    }
}

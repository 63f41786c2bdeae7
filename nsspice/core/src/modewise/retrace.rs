//! Energies of a segment whose mode is too large, or too seldom met, for forms of its powers.
//!
//! With `rho = E z' + G z + A lambda - S u` the stored energy `W = z' E z / 2` changes by exactly what
//! is delivered, less what is dissipated, plus the integral of `z' rho`.  So the laws need not be
//! squared: the maps of a mode are put into the assembled matrices once in each segment, all modal
//! coordinates at a time, each with a random sign and as large as its integral over the segment.  What
//! is left are charges and fluxes by which Kirchhoff's laws are missed, whatever the time; times the
//! largest voltage and current they are energy.  Several coordinates that break a law could hide each
//! other with one choice of signs, but every segment makes its own.  Products of `n` numbers are rounded
//! by `n u` of the largest (Higham: Accuracy and Stability of Numerical Algorithms, 2002, section 3.5):
//! so a fast rate times the rounding of all coordinates is what any mode with it misses.
//!
//! That the coordinates move as they should is seen by following them once more ([`super::course`])
//! from the state at the begin: the stored energy at both ends is that of these two states, and a next
//! segment that begins elsewhere breaks the balance of the run.

use super::course::Course;
use super::mode::Mode;
use super::products::Two;
use super::run::Engine;
use crate::audit::Sums;
use crate::dense::{add_scaled, complex, dot, norm, Complex};
#[cfg(test)]
use crate::structure::Coordinates;

/// An input that acts somewhere: its number, and what it acts on, in energy coordinates and in the
/// unknowns that store nothing.
struct Given {
    input: usize,
    stored: Vec<f64>,
    free: Vec<(usize, f64)>,
}

/// A power in the coordinates of a mode: factors of states, inputs and their rates.
type Row = [Vec<f64>; 3];

/// Work space, and what sources act on.
#[derive(Default)]
pub struct Retrace {
    course: Course,
    given: Option<Vec<Given>>,
    rows: Vec<Row>,
    forces: Vec<Complex>,
    /// sources as sums of functions, and what they give with a coordinate
    factors: Vec<Complex>,
    weights: Vec<Complex>,
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

impl Given {
    fn all(engine: &Engine) -> Vec<Given> {
        let net = &engine.net;
        let column = |input: usize| {
            let s = net.s.col(input);
            let (mut stored, mut free) = (vec![0.0; net.states], vec![0.0; net.kernel.cols]);
            net.big_r.apply_transposed(&s, &mut stored);
            net.kernel.apply_transposed(&s, &mut free);
            if stored.iter().all(|v| *v == 0.0) {
                stored.clear();
            }
            let free: Vec<_> = free.into_iter().enumerate().filter(|(_, v)| *v != 0.0).collect();
            let acts = !stored.is_empty() || !free.is_empty();
            acts.then_some(Given { input, stored, free })
        };
        (0..net.s.cols).filter_map(column).collect()
    }

    /// The power of the input in a mode.
    fn row(&self, mode: &Mode, [x, v, d]: &mut Row) {
        let (n, nv) = (mode.n, mode.leave_v.cols);
        for (list, count) in [(&mut *x, n), (&mut *v, nv), (&mut *d, nv)] {
            list.clear();
            list.resize(count, 0.0);
        }
        if !self.stored.is_empty() {
            mode.leave_x.apply_transposed(&self.stored, x);
            mode.leave_v.apply_transposed(&self.stored, v);
        }
        for &(unknown, factor) in &self.free {
            let (rows, r) = mode.algebraic_row(unknown);
            add_scaled(x, factor, rows.x.row(r));
            add_scaled(v, factor, rows.v.row(r));
            add_scaled(d, factor, rows.d.row(r));
        }
    }
}

/// Half the square of energy coordinates.
pub(super) fn energy(mode: &Mode, x: &[f64], v: &[f64], a: &mut [f64]) -> f64 {
    mode.leave(x, v, a);
    0.5 * dot(a, a)
}

impl Retrace {
    /// What is dissipated and delivered up to the present point of a segment; None where rates have no
    /// eigenvectors.
    pub fn segment(&mut self, engine: &Engine, sums: &mut Sums, mode: &Mode) -> Option<Two> {
        if !mode.blocks.is_empty() {
            return None;
        }
        let h = engine.point.t;
        self.course.set(&engine.segment, h);
        let given = self.given.take().unwrap_or_else(|| Given::all(engine));
        self.rows.resize_with(given.len(), Row::default);
        for (given, row) in given.iter().zip(&mut self.rows) {
            given.row(mode, row);
        }
        let mut chance = Chance(sums.steps());
        let start = engine.path.start();
        let delivered = self.follow(mode, start, &given, &mut chance, h);
        self.given = Some(given);
        self.a.resize(engine.net.states, 0.0);
        let before = energy(mode, start, &engine.segment.now, &mut self.a);
        let nv = mode.leave_v.cols;
        self.v.resize(nv, 0.0);
        self.d.resize(nv, 0.0);
        self.course.last(&mut self.v);
        let after = energy(mode, &self.end, &self.v, &mut self.a);
        self.course.inputs(h * chance.part(), [&mut self.v, &mut self.d]);
        self.ask(engine, sums, mode, h);
        Some([delivered - (after - before), delivered])
    }

    /// Follows all coordinates to the end; returns what the sources give.
    fn follow(
        &mut self,
        mode: &Mode,
        start: &[f64],
        given: &[Given],
        chance: &mut Chance,
        h: f64,
    ) -> f64 {
        let count = self.course.count();
        self.forces.resize(count, complex(0.0, 0.0));
        for list in [&mut self.end, &mut self.asked, &mut self.change] {
            list.resize(mode.n, 0.0);
        }
        let zero = complex(0.0, 0.0);
        self.factors.clear();
        self.factors.resize(given.len() * count, zero);
        self.weights.resize(count, zero);
        let mut delivered = 0.0;
        let lists = self.rows.iter().zip(self.factors.chunks_exact_mut(count));
        for (given, (row, factors)) in given.iter().zip(lists) {
            let own = |j: usize| complex(f64::from(u8::from(j == given.input)), 0.0);
            self.course.forces(own, factors);
            self.course.real_forces(&row[1], &mut self.forces);
            self.course.rates(|j| complex(row[2][j], 0.0), &mut self.forces);
            delivered += self.course.between(factors, &self.forces).re;
        }
        for pole in &mode.poles {
            let (at, pair) = (pole.at, pole.omega != 0.0);
            let rate = complex(pole.alpha, pole.omega);
            let both = |list: &[f64]| complex(list[at], if pair { list[at + 1] } else { 0.0 });
            let drive = mode.drive.row(at);
            if pair {
                let next = mode.drive.row(at + 1);
                self.course.forces(|j| complex(drive[j], next[j]), &mut self.forces);
            } else {
                self.course.real_forces(drive, &mut self.forces);
            }
            let begin = both(start);
            let end = self.course.end(rate, begin, &self.forces);
            self.weights.fill(zero);
            for (row, factors) in self.rows.iter().zip(self.factors.chunks_exact(count)) {
                let acts = both(&row[0]).conj();
                for (weight, &factor) in self.weights.iter_mut().zip(factors) {
                    *weight = *weight + if pair { acts * factor } else { factor.scale(acts.re) };
                }
            }
            delivered += self.course.products(&self.weights, rate, [begin, end], &self.forces).re;
            // as large as the integral, and moving as the coordinate does
            let size = |z: Complex| match pair {
                true => (z.re * z.re + z.im * z.im).sqrt(),
                false => z.re.abs(),
            };
            let time = h.min(1.0 / size(rate));
            let left = rate * end + self.course.force_at_end(!pair, &self.forces);
            let size = h * (size(end) + time * size(left)) + time * size(begin);
            let asked = complex(chance.sign(size), if pair { chance.sign(size) } else { 0.0 });
            let change = rate * asked;
            (self.end[at], self.asked[at], self.change[at]) = (end.re, asked.re, change.re);
            if pair {
                let next = at + 1;
                (self.end[next], self.asked[next], self.change[next]) =
                    (end.im, asked.im, change.im);
            }
        }
        delivered
    }

    /// Asks the laws with these coordinates, beside the inputs at an instant.
    fn ask(&mut self, engine: &Engine, sums: &mut Sums, mode: &Mode, h: f64) {
        let net = &engine.net;
        for list in [&mut self.v, &mut self.d] {
            list.iter_mut().for_each(|v| *v *= h);
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
        let sources = engine.inputs.waveforms().len();
        self.u.extend((0..sources).map(|k| engine.inputs.value_of(k, &self.v)));
        // of coordinates whose energy is half the square of their length
        let fastest = mode.poles.iter().fold(0.0f64, |m, p| m.max(p.alpha.hypot(p.omega)));
        let rounding = mode.n as f64 * f64::EPSILON * fastest * norm(&self.asked);
        sums.miss(&self.rate, &self.z, &self.l, &self.u, rounding);
    }
}

#[cfg(test)]
mod tests {
    use super::super::inputs::Inputs;
    use super::super::network::Assembly;
    use super::super::prepared::Prepared;
    use super::super::run::Engine;
    use super::*;
    use crate::audit::{Between, TOLERANCE};
    use crate::descriptor::Linear;
    use crate::sparse::Csc;
    use crate::waveform::{Smooth, Waveform};

    const STATES: usize = 20;

    /// A ladder of resistors and capacitors that a current feeds, in the middle of a segment of 0.3 s,
    /// and the sums of its energies.
    fn ladder() -> (Engine, Sums) {
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
        engine.path.at(0.3, &mut engine.point);
        (engine, sums)
    }

    /// The relative error of the balance if the motion is said to be that of a mode.
    fn drift(engine: &Engine, sums: &Sums, mode: &Mode) -> f64 {
        let mut sums = sums.clone();
        let unknowns = |a: &[f64]| {
            let mut z = vec![0.0; STATES];
            engine.net.big_r.apply(a, &mut z);
            z
        };
        let (_, own) = engine.present.as_ref().unwrap_or_else(|| unreachable!());
        let (mut x, mut a) = (vec![0.0; own.n], vec![0.0; STATES]);
        energy(own, engine.path.start(), &engine.segment.now, &mut a);
        sums.start(&unknowns(&a));
        let found = Retrace::default().segment(engine, &mut sums, mode);
        sums.motion(0.3, found.unwrap_or_else(|| unreachable!()));
        engine.path.state(&engine.point, &mut x);
        let mut v = vec![0.0; engine.v.len()];
        engine.path.inputs(&engine.segment, &engine.point, &mut v);
        energy(own, &x, &v, &mut a);
        sums.balance(&unknowns(&a)).drift
    }

    #[test]
    fn one_wrong_number_of_a_mode_is_noticed() {
        let (engine, sums) = ladder();
        let (_, mode) = engine.present.clone().unwrap_or_else(|| unreachable!());
        assert!(drift(&engine, &sums, &mode) < 1e-13);
        let spoil = |change: &dyn Fn(&mut Mode)| {
            let mut wrong = (*mode).clone();
            change(&mut wrong);
            drift(&engine, &sums, &wrong)
        };
        const OFF: f64 = 1.0 + 1e-6;
        // what the sources force in 0.3 s is small beside what is stored
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

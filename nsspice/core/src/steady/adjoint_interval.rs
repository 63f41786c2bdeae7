//! One interval of a segment with constant weights: its adjoint in closed form, and the integrals of it times the
//! motion.
//!
//! Both are responses of first order: with `s` the time left, a coordinate of the adjoint is `m e^(p s) + g s
//! E[p s, 0]`, one of the motion `x e^(q t) + b t E[q t, 0] + c t^2 E[q t, 0, 0]`. The integral of their product is a
//! convolution, whose divided difference has the nodes of both.

use super::adjoint::Side;
use crate::dense::{complex, divided, dot, Complex, Matrix, NODES};
use crate::modewise::modes::mode::Mode;
use crate::modewise::spectra::spectrum::Pole;
use crate::modewise::Passage;

const ZERO: Complex = complex(0.0, 0.0);
const ONE: Complex = complex(1.0, 0.0);

/// Nodes beyond which a divided difference is taken from those without them: one digit is lost at most.
const FAR: f64 = 1.0;

/// A modal coordinate from the start of the interval on: what it is, and what drives it.
struct Coordinate {
    pole: Pole,
    rate: Complex,
    start: Complex,
    level: Complex,
    slope: Complex,
    /// rates and factors of the exponentials that drive it
    tones: Vec<(Complex, Complex)>,
}

/// What moves in an interval.
pub(super) struct Motion {
    coordinates: Vec<Coordinate>,
    /// of the inputs that are not stimuli
    level: Vec<f64>,
    slope: Vec<f64>,
    /// place, rate, value at the start: of two inputs that are its imaginary and its real part, or of one alone
    tones: Vec<(usize, Complex, Complex, bool)>,
}

impl Motion {
    /// From modal coordinates at a time since the start of a passage.
    pub(super) fn new(side: &Side, plain: &[usize], p: &Passage, from: f64, x: &[f64]) -> Motion {
        let inputs = &p.inputs;
        let level: Vec<f64> =
            plain.iter().map(|&i| inputs.level[i] + inputs.slope[i] * from).collect();
        let slope: Vec<f64> = plain.iter().map(|&i| inputs.slope[i]).collect();
        let place = |index: usize| plain.iter().position(|&i| i == index);
        let mut tones = Vec::new();
        for tone in &inputs.tones {
            let start = tone.rate.scale(from).exp() * tone.start;
            tones.extend(place(tone.index).map(|r| (r, tone.rate, start, true)));
        }
        for decay in &inputs.decays {
            let (rate, start) = (complex(decay.rate, 0.0), complex(decay.start, 0.0));
            let start = rate.scale(from).exp() * start;
            tones.extend(place(decay.index).map(|r| (r, rate, start, false)));
        }
        let coordinate = |pole: &Pole| {
            let at = pole.at;
            let second = (pole.omega != 0.0).then_some(at + 1);
            let of = |first: f64, f: &dyn Fn(usize) -> f64| complex(first, second.map_or(0.0, f));
            let by = |k: usize, list: &[f64]| dot(side.by_inputs.row(k), list);
            let entry = |r: usize| of(side.by_inputs[(at, r)], &|k| side.by_inputs[(k, r)]);
            let mut driving = Vec::new();
            for &(r, rate, start, both) in &tones {
                if !both {
                    driving.push((rate, entry(r) * start));
                    continue;
                }
                let (sin, cos) = (entry(r), entry(r + 1));
                let turned = complex(-sin.im, sin.re);
                driving.push((rate, ((cos - turned) * start).scale(0.5)));
                driving.push((rate.conj(), ((cos + turned) * start.conj()).scale(0.5)));
            }
            driving.retain(|(_, factor)| *factor != ZERO);
            Coordinate {
                pole: *pole,
                rate: complex(pole.alpha, pole.omega),
                start: of(x[at], &|k| x[k]),
                level: of(by(at, &level), &|k| by(k, &level)),
                slope: of(by(at, &slope), &|k| by(k, &slope)),
                tones: driving,
            }
        };
        Motion {
            coordinates: side.mode.poles.iter().map(coordinate).collect(),
            level,
            slope,
            tones,
        }
    }
}

/// `E[z]`, `E[z, 0]`, `E[z, 0, 0]`, `E[z, 0, 0, 0]`.
fn powers(z: Complex) -> [Complex; 4] {
    if z.abs() <= FAR {
        return [
            z.exp(),
            divided(&[z, ZERO]),
            divided(&[z, ZERO, ZERO]),
            divided(&[z, ZERO, ZERO, ZERO]),
        ];
    }
    let first = z.exp_m1() / z;
    let second = (first - ONE) / z;
    [first * z + ONE, first, second, (second - complex(0.5, 0.0)) / z]
}

/// A kernel `m e^(p s) + g s E[p s, 0]` over an interval of some length.
struct Kernel {
    rate: Complex,
    powers: [Complex; 4],
    m: Complex,
    g: Complex,
}

/// An interval.
pub(super) struct Interval<'a> {
    mode: &'a Mode,
    length: f64,
    motion: Motion,
    powers: Vec<[Complex; 4]>,
}

impl<'a> Interval<'a> {
    pub(super) fn new(mode: &'a Mode, length: f64, motion: Motion) -> Interval<'a> {
        let powers = motion.coordinates.iter().map(|c| powers(c.rate.scale(length))).collect();
        Interval { mode, length, motion, powers }
    }

    fn kernel(&self, k: usize, l: &[f64], g: &[f64]) -> Kernel {
        let Coordinate { pole, rate, .. } = &self.motion.coordinates[k];
        // the transposed block of a pair is that of the conjugate coordinate
        let of = |list: &[f64]| {
            let second = if pole.omega == 0.0 { 0.0 } else { -list[pole.at + 1] };
            complex(list[pole.at], second)
        };
        Kernel { rate: *rate, powers: self.powers[k], m: of(l), g: of(g) }
    }

    /// The adjoint at the start from that at the end, and the weights of the modal coordinates.
    pub(super) fn back(&self, l: &[f64], g: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.mode.n];
        for (k, c) in self.motion.coordinates.iter().enumerate() {
            let Kernel { powers, m, g, .. } = self.kernel(k, l, g);
            let start = powers[0] * m + (powers[1] * g).scale(self.length);
            out[c.pole.at] = start.re;
            if c.pole.omega != 0.0 {
                out[c.pole.at + 1] = -start.im;
            }
        }
        out
    }

    /// Adds the integrals of the adjoint times `[x; v; v'; v'']`, one row for each modal coordinate.
    pub(super) fn integrals(&self, l: &[f64], g: &[f64], w: &mut Matrix) {
        for (k, c) in self.motion.coordinates.iter().enumerate() {
            let kernel = self.kernel(k, l, g);
            if kernel.m == ZERO && kernel.g == ZERO {
                continue;
            }
            self.against(&kernel, |column, value| {
                w[(c.pole.at, column)] += value.re;
                if c.pole.omega != 0.0 {
                    w[(c.pole.at + 1, column)] -= value.im;
                }
            });
        }
    }

    /// The integrals of `[x; v; v'; v'']`.
    pub(super) fn whole(&self, columns: usize) -> Vec<f64> {
        let mut out = vec![0.0; columns];
        let kernel = Kernel { rate: ZERO, powers: powers(ZERO), m: ONE, g: ZERO };
        self.against(&kernel, |column, value| out[column] += value.re);
        out
    }

    /// Calls with the integral of a kernel times each of `[x; v; v'; v'']` that moves.
    fn against(&self, kernel: &Kernel, mut add: impl FnMut(usize, Complex)) {
        let (n, plain) = (self.mode.n, self.motion.level.len());
        for (k, c) in self.motion.coordinates.iter().enumerate() {
            let own = self.with_coordinate(kernel, c, self.powers[k], false);
            if c.pole.omega == 0.0 {
                add(c.pole.at, own);
                continue;
            }
            let other = self.with_coordinate(kernel, c, self.powers[k], true);
            let (sum, apart) = ((own + other).scale(0.5), (own - other).scale(0.5));
            add(c.pole.at, sum);
            add(c.pole.at + 1, complex(apart.im, -apart.re)); // divided by i
        }
        let (d, [_, first, second, third]) = (self.length, kernel.powers);
        let constant = kernel.m * first.scale(d) + kernel.g * second.scale(d * d);
        let ramp = kernel.m * second.scale(d * d) + kernel.g * third.scale(d * d * d);
        for (r, (level, slope)) in self.motion.level.iter().zip(&self.motion.slope).enumerate() {
            if *level != 0.0 || *slope != 0.0 {
                add(n + r, constant.scale(*level) + ramp.scale(*slope));
                add(n + plain + r, constant.scale(*slope));
            }
        }
        for &(r, rate, start, both) in &self.motion.tones {
            let with = |rate: Complex| {
                let [p, q] = [kernel.rate.scale(d), rate.scale(d)];
                let second =
                    if kernel.g == ZERO { ZERO } else { divided(&[p, ZERO, q]).scale(d * d) };
                kernel.m * divided(&[p, q]).scale(d) + kernel.g * second
            };
            let (own, other) = (with(rate), if both { with(rate.conj()) } else { ZERO });
            let mut turn = start;
            for order in 0..3 {
                let at = n + order * plain + r;
                if both {
                    let (one, two) = ((own * turn).scale(0.5), (other * turn.conj()).scale(0.5));
                    let apart = one - two;
                    add(at, complex(apart.im, -apart.re));
                    add(at + 1, one + two);
                } else {
                    add(at, own * turn);
                }
                turn = turn * rate;
            }
        }
    }

    /// The integral of a kernel times a modal coordinate, or times its conjugate.
    fn with_coordinate(
        &self,
        kernel: &Kernel,
        c: &Coordinate,
        powers: [Complex; 4],
        mirrored: bool,
    ) -> Complex {
        let turn = |z: Complex| if mirrored { z.conj() } else { z };
        let (d, p, q) =
            (self.length, kernel.rate.scale(self.length), turn(c.rate).scale(self.length));
        let (m, g) = (kernel.m, kernel.g);
        let (start, level, slope) = (turn(c.start), turn(c.level), turn(c.slope));
        // how many nodes at zero the last term has
        let most = match (level != ZERO, slope != ZERO, g != ZERO) {
            (_, true, true) => 3,
            (_, true, false) | (true, _, true) => 2,
            (true, ..) | (_, _, true) => 1,
            _ => 0,
        };
        let found = ladder(p, q, &kernel.powers, &powers.map(turn), most);
        let d2 = d * d;
        let mut sum = found[0].scale(d) * m * start
            + found[1].scale(d2) * (m * level + g * start)
            + found[2].scale(d2 * d) * (m * slope + g * level)
            + found[3].scale(d2 * d2) * g * slope;
        for &(rate, factor) in &c.tones {
            let (rate, factor) = (turn(rate).scale(d), turn(factor));
            sum = sum + divided(&[p, q, rate]).scale(d2) * m * factor;
            if g != ZERO {
                sum = sum + divided(&[p, ZERO, q, rate]).scale(d2 * d) * g * factor;
            }
        }
        sum
    }
}

/// `E[p, q]`, `E[p, q, 0]` ... with up to `most` nodes at zero.
fn ladder(
    p: Complex,
    q: Complex,
    of_p: &[Complex; 4],
    of_q: &[Complex; 4],
    most: usize,
) -> [Complex; 4] {
    let mut out = [ZERO; 4];
    out[0] = divided(&[p, q]);
    let (large, powers) = if p.abs() >= q.abs() { (p, of_q) } else { (q, of_p) };
    if large.abs() > FAR {
        for k in 1..=most {
            out[k] = (out[k - 1] - powers[k]) / large;
        }
        return out;
    }
    let mut nodes = [ZERO; NODES];
    (nodes[0], nodes[1]) = (p, q);
    for k in 1..=most {
        out[k] = divided(&nodes[..2 + k]);
    }
    out
}

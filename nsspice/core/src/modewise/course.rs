//! A segment once more, from the state at its begin: where its modal coordinates end and what they
//! contribute to powers of sources, by formulas of its own.
//!
//! A coordinate obeys `X' = rate X + sum beta_c f_c` with the functions `f` of which the inputs are
//! made: exponentials (1 among them) and `t`.  Its end is `e^(rate h) X(0)` and the responses to each.
//! With a function `f_b` of the rate `mu` its product follows by parts:
//!
//! ```text
//! (rate + mu) int f_b X = [f_b X] - sum beta_c int f_b f_c
//! ```

use super::inputs::Segment;
use crate::dense::{complex, Complex};

/// Sums of two rates times the length below which that division would lose digits: the rest of the
/// series in them is as small.
const STILL: f64 = 1e-5;
/// Rates that differ by less than this part of themselves are near to each other.
const NEAR: f64 = 0.05;
const ZERO: Complex = complex(0.0, 0.0);

/// A function of the time since the begin of the segment.
#[derive(Clone, Copy, Debug)]
struct Base {
    rate: Complex,
    /// `t`, not an exponential
    line: bool,
    /// value at the end, and that less 1
    end: Complex,
    less: Complex,
    /// the conjugate of the one before it
    mirrored: bool,
}

/// The inputs of a segment of some length as sums of exponentials.
#[derive(Clone, Debug, Default)]
pub struct Course {
    h: f64,
    bases: Vec<Base>,
    /// input, base, factor
    parts: Vec<(usize, usize, Complex)>,
    /// `int f_b f_c`
    products: Vec<Complex>,
    /// work space: values of the functions
    values: Vec<[Complex; 2]>,
}

#[inline]
fn square(z: Complex) -> f64 {
    z.re * z.re + z.im * z.im
}

/// `1 / z` of rates, which are far from overflow.
#[inline]
fn inverse(z: Complex) -> Complex {
    z.conj().scale(1.0 / square(z))
}

/// `int_0^h t^k e^(s t) dt`
fn moment(k: i32, s: Complex, h: f64) -> Complex {
    let z = s.scale(h);
    if square(z) < 0.25 {
        let (mut sum, mut term) = (ZERO, complex(1.0, 0.0));
        let mut j = 0;
        while 1.0 + term.abs() > 1.0 {
            sum = sum + term.scale(1.0 / f64::from(k + 1 + j));
            j += 1;
            term = (term * z).scale(1.0 / f64::from(j));
        }
        return sum.scale(h.powi(k + 1));
    }
    match k {
        0 => z.exp_m1() / s,
        _ => (z.exp().scale(h.powi(k)) - moment(k - 1, s, h).scale(f64::from(k))) / s,
    }
}

impl Course {
    /// Takes the inputs of a segment of the length `h`.
    pub fn set(&mut self, segment: &Segment, h: f64) {
        self.h = h;
        self.bases.clear();
        self.parts.clear();
        self.base(ZERO, false);
        for (j, &level) in segment.level.iter().enumerate().filter(|(_, v)| **v != 0.0) {
            self.parts.push((j, 0, complex(level, 0.0)));
        }
        if segment.sloped {
            let line = self.base(ZERO, true);
            for (j, &slope) in segment.slope.iter().enumerate().filter(|(_, v)| **v != 0.0) {
                self.parts.push((j, line, complex(slope, 0.0)));
            }
        }
        for tone in &segment.tones {
            let half = tone.start.scale(0.5);
            let both = [(tone.rate, half, 1.0), (tone.rate.conj(), half.conj(), -1.0)];
            for (rate, part, side) in both {
                let base = self.base(rate, false);
                // `-i` of it, `i` of the conjugate
                self.parts.push((tone.index, base, complex(part.im, -part.re).scale(side)));
                self.parts.push((tone.index + 1, base, part));
            }
        }
        for decay in &segment.decays {
            let base = self.base(complex(decay.rate, 0.0), false);
            self.parts.push((decay.index, base, complex(decay.start, 0.0)));
        }
        self.products.clear();
        self.products.resize(self.bases.len().pow(2), ZERO);
        for b in 0..self.bases.len() {
            for c in 0..=b {
                let product = self.both(b, c, 0);
                self.products[b * self.bases.len() + c] = product;
                self.products[c * self.bases.len() + b] = product;
            }
        }
    }

    /// `int t^k f_b f_c`
    fn both(&self, b: usize, c: usize, k: i32) -> Complex {
        let (b, c) = (&self.bases[b], &self.bases[c]);
        moment(k + i32::from(b.line) + i32::from(c.line), b.rate + c.rate, self.h)
    }

    fn base(&mut self, rate: Complex, line: bool) -> usize {
        let less = rate.scale(self.h).exp_m1();
        let end = if line { complex(self.h, 0.0) } else { less + complex(1.0, 0.0) };
        let mirrored = rate.im < 0.0;
        self.bases.push(Base { rate, line, end, less, mirrored });
        self.bases.len() - 1
    }

    /// Number of functions.
    pub fn count(&self) -> usize {
        self.bases.len()
    }

    /// `[1; inputs]` and their rates at a time.
    pub fn inputs(&mut self, t: f64, [v, d]: [&mut [f64]; 2]) {
        v.fill(0.0);
        d.fill(0.0);
        let at = |b: &Base| {
            if b.line {
                return [complex(t, 0.0), complex(1.0, 0.0)];
            }
            let value = b.rate.scale(t).exp();
            [value, b.rate * value]
        };
        self.values.clear();
        self.values.extend(self.bases.iter().map(at));
        for &(j, b, factor) in &self.parts {
            v[j] += (factor * self.values[b][0]).re;
            d[j] += (factor * self.values[b][1]).re;
        }
    }

    /// `[1; inputs]` at the end.
    pub fn last(&self, v: &mut [f64]) {
        v.fill(0.0);
        for &(j, b, factor) in &self.parts {
            v[j] += (factor * self.bases[b].end).re;
        }
    }

    /// The forces on a coordinate, by function, that the inputs drive with these factors.
    #[inline]
    pub fn forces(&self, drive: impl Fn(usize) -> Complex, out: &mut [Complex]) {
        out.fill(ZERO);
        for &(j, b, factor) in &self.parts {
            out[b] = out[b] + drive(j) * factor;
        }
    }

    /// The same of a real coordinate, with the factors of all inputs.
    #[inline]
    pub fn real_forces(&self, drive: &[f64], out: &mut [Complex]) {
        out.fill(ZERO);
        for &(j, b, factor) in &self.parts {
            if !self.bases[b].mirrored {
                out[b] = out[b] + factor.scale(drive[j]);
            }
        }
        for (b, _) in self.bases.iter().enumerate().filter(|(_, base)| base.mirrored) {
            out[b] = out[b - 1].conj();
        }
    }

    /// The same of the rates of the inputs.
    pub fn rates(&self, drive: impl Fn(usize) -> Complex, out: &mut [Complex]) {
        for &(j, b, factor) in &self.parts {
            let Base { rate, line, .. } = self.bases[b];
            // the rate of a line is constant
            let (to, rate) = if line { (0, complex(1.0, 0.0)) } else { (b, rate) };
            out[to] = out[to] + drive(j) * rate * factor;
        }
    }

    /// The sum of what belongs to each function; of a real coordinate conjugates bring conjugates.
    #[inline]
    fn sum(&self, real: bool, each: impl Fn(usize, &Base) -> Complex) -> Complex {
        let mut sum = ZERO;
        for (b, base) in self.bases.iter().enumerate() {
            if !real {
                sum = sum + each(b, base);
            } else if !base.mirrored {
                let twice = if base.rate.im == 0.0 { 1.0 } else { 2.0 };
                sum.re += twice * each(b, base).re;
            }
        }
        sum
    }

    /// Forces at the end, added up.
    #[inline]
    pub fn force_at_end(&self, real: bool, forces: &[Complex]) -> Complex {
        self.sum(real, |b, base| base.end * forces[b])
    }

    /// Where a coordinate ends.
    #[inline]
    pub fn end(&self, rate: Complex, start: Complex, forces: &[Complex]) -> Complex {
        let h = self.h;
        let less = rate.scale(h).exp_m1();
        let forced = self.sum(rate.im == 0.0, |b, base| {
            let force = forces[b];
            if force == ZERO {
                return ZERO;
            }
            if base.line {
                // int_0^h e^(rate (h - t)) t dt
                return if square(rate.scale(h)) < 0.25 {
                    force * (moment(0, rate, h).scale(h) - moment(1, rate, h))
                } else {
                    force * (less - rate.scale(h)) / (rate * rate)
                };
            }
            let apart = base.rate - rate;
            // squares of rates far below one per run are none
            let still = square(apart.scale(h)) < STILL * STILL;
            if still || square(apart) <= NEAR * NEAR * (square(base.rate) + square(rate)) {
                force * (less + complex(1.0, 0.0)) * moment(0, apart, h)
            } else {
                force * (base.less - less) * inverse(apart)
            }
        });
        start + less * start + forced
    }

    /// The sum of `int f_b X`, with a factor each, for a coordinate of which both ends are known.
    #[inline]
    pub fn products(
        &self,
        factors: &[Complex],
        rate: Complex,
        ends: [Complex; 2],
        forces: &[Complex],
    ) -> Complex {
        self.sum(rate.im == 0.0, |b, _| {
            if factors[b] == ZERO {
                ZERO
            } else {
                factors[b] * self.product(b, rate, ends, forces)
            }
        })
    }

    /// `int f_b X`
    #[inline]
    fn product(
        &self,
        b: usize,
        rate: Complex,
        [start, end]: [Complex; 2],
        forces: &[Complex],
    ) -> Complex {
        let (base, h) = (&self.bases[b], self.h);
        let s = base.rate + rate;
        let last = base.end * end;
        if square(s.scale(h)) < STILL * STILL {
            // int g = [t g] - int t g', g' = s g + forces; and once more for int t g
            let forced = |k: i32| {
                let each = |(c, &f): (usize, &Complex)| self.both(b, c, k) * f;
                forces.iter().enumerate().map(each).fold(ZERO, |sum, f| sum + f)
            };
            let lines = f64::from(u8::from(base.line));
            let first = last.scale(h) - forced(1);
            let second = (last.scale(h * h) - forced(2)).scale(1.0 / (2.0 + lines));
            return (first - s * second).scale(1.0 / (1.0 + lines));
        }
        let row = &self.products[b * self.bases.len()..(b + 1) * self.bases.len()];
        let forced = row.iter().zip(forces).fold(ZERO, |sum, (&product, &f)| sum + product * f);
        if base.line {
            // (t X)' = X + rate t X + forces t
            let plain = self.product(0, rate, [start, end], forces);
            return (last - plain - forced) * inverse(s);
        }
        (last - start - forced) * inverse(s)
    }

    /// `int (sum a_b f_b) (sum c_c f_c)`
    pub fn between(&self, a: &[Complex], c: &[Complex]) -> Complex {
        let rows = self.products.chunks_exact(self.bases.len());
        a.iter().zip(rows).fold(ZERO, |sum, (&a, row)| {
            sum + a * row.iter().zip(c).fold(ZERO, |sum, (&p, &c)| sum + p * c)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::inputs::{Decay, Tone};
    use super::*;

    /// A line, a tone and a decay.
    fn segment(swing: f64) -> Segment {
        Segment {
            level: vec![1.0, 0.4, 0.0, 0.0, 0.0],
            slope: vec![0.0, 0.7, 0.0, 0.0, 0.0],
            sloped: true,
            tones: vec![Tone { index: 2, rate: complex(-0.1, swing), start: complex(0.8, -0.6) }],
            decays: vec![Decay { index: 4, rate: -1.5, start: 1.3 }],
            ..Segment::default()
        }
    }

    /// Inputs as they are defined.
    fn inputs(swing: f64, t: f64) -> [f64; 5] {
        let tone = complex(-0.1, swing).scale(t).exp() * complex(0.8, -0.6);
        [1.0, 0.4 + 0.7 * t, tone.im, tone.re, 1.3 * (-1.5 * t).exp()]
    }

    const DRIVE: [f64; 5] = [0.3, -1.0, 2.0, 0.5, -0.7];
    const TURNED: [f64; 5] = [-0.2, 0.6, 0.9, -1.1, 0.4];

    /// The end of `X' = rate X + drive v` from 1 + 0.5 i (1, if it is real) and the integrals of the
    /// inputs times `X`, by the classical steps of Runge and Kutta of two lengths, extrapolated.
    fn stepped(rate: Complex, swing: f64, h: f64) -> (Complex, [Complex; 5]) {
        let real = rate.im == 0.0;
        let slope = |t: f64, x: Complex| {
            let v = inputs(swing, t);
            let sum = |drive: &[f64; 5]| (0..5).map(|j| drive[j] * v[j]).sum::<f64>();
            let force = complex(sum(&DRIVE), if real { 0.0 } else { sum(&TURNED) });
            let mut out = [rate * x + force; 6];
            (0..5).for_each(|j| out[1 + j] = x.scale(v[j]));
            out
        };
        let run = |count: usize| {
            let step = h / count as f64;
            let mut y = [ZERO; 6];
            y[0] = complex(1.0, if real { 0.0 } else { 0.5 });
            for k in 0..count {
                let t = k as f64 * step;
                let a = slope(t, y[0]);
                let b = slope(t + 0.5 * step, y[0] + a[0].scale(0.5 * step));
                let c = slope(t + 0.5 * step, y[0] + b[0].scale(0.5 * step));
                let d = slope(t + step, y[0] + c[0].scale(step));
                for (i, y) in y.iter_mut().enumerate() {
                    *y = *y + (a[i] + b[i].scale(2.0) + c[i].scale(2.0) + d[i]).scale(step / 6.0);
                }
            }
            y
        };
        let (few, many) = (run(20_000), run(40_000));
        let best: [Complex; 6] =
            std::array::from_fn(|i| (many[i].scale(16.0) - few[i]).scale(1.0 / 15.0));
        (best[0], std::array::from_fn(|j| best[1 + j]))
    }

    #[test]
    fn ends_and_products_are_those_of_small_steps() {
        let mut course = Course::default();
        let rates = [
            (-3.0, 0.0),
            (-1e-7, 0.0),
            (-1e-160, 0.0),
            (0.0, 0.0),
            (-40.0, 0.0),
            (-1.5, 0.0),
            (-1.49, 0.0),
            (-0.2, 5.0),
            (-0.1, 9.0),
            (-0.1, 8.9),
            (-0.1, -9.0),
            (0.0, 30.0),
            (0.1, -9.0),
        ];
        for (rate, swing) in rates.into_iter().flat_map(|r| [(r, 9.0), (r, 0.01)]) {
            let rate = complex(rate.0, rate.1);
            for h in [1e-6, 0.02, 0.3, 2.0] {
                course.set(&segment(swing), h);
                let count = course.count();
                let (mut forces, mut factors) = (vec![ZERO; count], vec![ZERO; count]);
                let pair = rate.im != 0.0;
                if pair {
                    course.forces(|j| complex(DRIVE[j], TURNED[j]), &mut forces);
                } else {
                    course.real_forces(&DRIVE, &mut forces);
                }
                let (expected, products) = stepped(rate, swing, h);
                let begin = complex(1.0, if pair { 0.5 } else { 0.0 });
                let end = course.end(rate, begin, &forces);
                let case = format!("{rate:?} {swing} {h}");
                assert!((end - expected).abs() < 1e-11 * (1.0 + expected.abs()), "{case}");
                for (j, product) in products.into_iter().enumerate() {
                    course.forces(|k| complex(f64::from(u8::from(k == j)), 0.0), &mut factors);
                    let found = course.products(&factors, rate, [begin, end], &forces);
                    // by parts: 1e-16 over the smallest divisor
                    let off = (found.re - product.re).abs();
                    assert!(off < 1e-10 * h * (1.0 + product.abs() / h), "{case} {j}");
                }
                let mut v = [[0.0; 5]; 2];
                let [now, rates] = &mut v;
                course.inputs(h, [now, rates]);
                let known = inputs(swing, h);
                assert!(now.iter().zip(&known).all(|(a, b)| (a - b).abs() < 1e-14));
                let mut last = [0.0; 5];
                course.last(&mut last);
                assert!(last.iter().zip(&known).all(|(a, b)| (a - b).abs() < 1e-14));
                let step = 1e-5;
                let (a, b) = (inputs(swing, h - step), inputs(swing, h + step));
                assert!((0..5).all(|j| (rates[j] - (b[j] - a[j]) / (2.0 * step)).abs() < 1e-6));
                // what two inputs have in common
                course.real_forces(&DRIVE, &mut forces);
                course.forces(|k| complex(f64::from(u8::from(k == 2)), 0.0), &mut factors);
                let rule = |count: usize| {
                    let at = |k: usize| {
                        let v = inputs(swing, h * k as f64 / count as f64);
                        v[2] * (0..5).map(|j| DRIVE[j] * v[j]).sum::<f64>()
                    };
                    let inner =
                        |odd: usize| (1..count).filter(|k| k % 2 == odd).map(at).sum::<f64>();
                    h / (3.0 * count as f64) * (at(0) + 4.0 * inner(1) + 2.0 * inner(0) + at(count))
                };
                let found = course.between(&factors, &forces).re;
                assert!((found - rule(4000)).abs() < 1e-11 * h.max(1.0), "{case}");
            }
        }
    }
}

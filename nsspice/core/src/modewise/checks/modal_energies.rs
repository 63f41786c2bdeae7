//! A segment once more, from the state at its begin: where its modal coordinates end and what they
//! contribute to powers of sources, by formulas of its own.
//!
//! A coordinate obeys `X' = rate X + sum beta_c f_c` with the functions `f` of which the inputs are
//! made: exponentials (1 among them) and `t`.  What follows them steadily, `beta_c / (rate_c - rate) f_c`,
//! is distinguished from what dies away, so that it meets the inputs' own part of a current before either is
//! integrated: of a source with little resistance both are large and cancel.  Where a pole is near to that of a function
//! nothing is steady; the response and its products are divided differences of the exponential function
//! ([`crate::dense::divided`]), in units of the length of the segment.

use crate::dense::{complex, divided, pair, Complex, NODES};
use crate::modewise::functions::exponential::{at_zero, near};
use crate::modewise::functions::inputs::Segment;

const ZERO: Complex = complex(0.0, 0.0);
const ONE: Complex = complex(1.0, 0.0);

/// A function of the time since the begin of the segment.
#[derive(Clone, Copy, Debug)]
pub struct Base {
    /// in the length of the segment
    pub rate: Complex,
    /// in a second
    speed: Complex,
    /// the time in lengths of the segment, not an exponential
    pub line: bool,
    /// the conjugate of the one before it
    pub mirrored: bool,
    /// value at the end
    end: Complex,
}

impl Base {
    /// Poles of its Laplace transform: a line has two at 0.
    fn poles(&self) -> [Complex; 2] {
        [self.rate, ZERO]
    }

    fn count(&self) -> usize {
        1 + usize::from(self.line)
    }

    /// `int f e^(zt)` for an exponential, with `e^z`.
    #[inline]
    fn with(&self, z: Complex, value: Complex) -> Complex {
        let sum = z + self.rate;
        if near(sum, ZERO) {
            pair(sum, ZERO)
        } else {
            (value * self.end - ONE) / sum
        }
    }
}

/// The inputs of a segment of some length as sums of exponentials.
#[derive(Clone, Debug, Default)]
pub struct ModalEnergies {
    pub h: f64,
    pub bases: Vec<Base>,
    /// input, base, factor
    parts: Vec<(usize, usize, Complex)>,
    /// `int f_b f_c`, in units of the length
    products: Vec<Complex>,
}

impl ModalEnergies {
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
                self.parts.push((j, line, complex(slope * h, 0.0)));
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
        let count = self.bases.len();
        self.products.clear();
        self.products.resize(count * count, ZERO);
        for b in 0..count {
            for c in 0..=b {
                let product = self.product(b, c);
                self.products[b * count + c] = product;
                self.products[c * count + b] = product;
            }
        }
    }

    fn base(&mut self, rate: Complex, line: bool) -> usize {
        let (speed, rate) = (rate, rate.scale(self.h));
        let end = match self.bases.last() {
            Some(last) if rate.im < 0.0 => last.end.conj(),
            _ if rate == ZERO => ONE,
            _ => rate.exp(),
        };
        self.bases.push(Base { rate, speed, line, mirrored: rate.im < 0.0, end });
        self.bases.len() - 1
    }

    /// `int f_b f_c`, `c` not being behind `b`.
    fn product(&self, b: usize, c: usize) -> Complex {
        let (base, other) = (self.bases[b], self.bases[c]);
        if base.rate == ZERO && other.rate == ZERO {
            complex(1.0 / (base.count() + other.count() - 1) as f64, 0.0)
        } else if base.mirrored && c + 1 != b {
            let behind = self.bases[..b].get(c + 1).is_some_and(|next| next.mirrored);
            let conjugate = if other.mirrored { c - 1 } else { c + usize::from(behind) };
            self.products[(b - 1) * self.bases.len() + conjugate].conj()
        } else if base.line || other.line {
            self.against(b, &other.poles()[..other.count()])
        } else {
            base.with(other.rate, other.end)
        }
    }

    /// `int f_b X` for `X` with the given poles.
    fn against(&self, b: usize, poles: &[Complex]) -> Complex {
        let base = &self.bases[b];
        let mut all = [ZERO; NODES];
        for (to, pole) in all[1..].iter_mut().zip(poles) {
            *to = *pole + base.rate;
        }
        let once = divided(&all[..=poles.len()]);
        if base.line {
            // int t X = int X - int int X
            once - divided(&all[..poles.len() + 2])
        } else {
            once
        }
    }

    /// `[1; inputs]` at the end.
    pub fn last(&self, v: &mut Vec<f64>, count: usize) {
        v.clear();
        v.resize(count, 0.0);
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

    /// Adds the same of the rates of the inputs.
    pub fn rates(&self, drive: &[f64], out: &mut [Complex]) {
        for &(j, b, factor) in &self.parts {
            let Base { rate, line, .. } = self.bases[b];
            // the rate of a line is constant
            let (to, rate) = if line { (0, complex(1.0, 0.0)) } else { (b, rate) };
            out[to] = out[to] + rate * factor.scale(drive[j] / self.h);
        }
    }

    /// Where a coordinate ends that the forces drive, and the sum of `int f_b X` of what is not steady, with
    /// a factor each; its steady part is put into a list, by function.
    #[inline]
    pub fn follow(
        &self,
        rate: Complex,
        start: Complex,
        [forces, factors]: [&[Complex]; 2],
        steady: &mut [Complex],
    ) -> [Complex; 2] {
        let (z, real) = (rate.scale(self.h), rate.im == 0.0);
        let known = at_zero(z);
        let value = ONE + z * known[0];
        steady.fill(ZERO);
        let (mut rest, mut end, mut product) = (start, ZERO, ZERO);
        for (c, (base, &force)) in self.bases.iter().zip(forces).enumerate() {
            // of a real coordinate conjugates bring conjugates
            if force == ZERO || real && base.mirrored {
                continue;
            }
            let pair = real && base.rate.im != 0.0;
            let twice = if pair { 2.0 } else { 1.0 };
            if near(z, base.rate) {
                let force = force.scale(twice * self.h);
                let [response, products] = self.near(c, z, &known, factors);
                (end, product) = (end + force * response, product + force * products);
                continue;
            }
            let part = force / (base.speed - rate);
            steady[c] = steady[c] + part;
            end = end + (part * base.end).scale(twice);
            rest = rest - if base.line { ZERO } else { part.scale(twice) };
            if pair {
                steady[c + 1] = part.conj();
            }
            if base.line {
                // its rate is met as well
                let part = part / z;
                (steady[0], end, rest) = (steady[0] + part, end + part, rest - part);
            }
        }
        if real {
            rest.im = 0.0;
        }
        // what nothing has set in motion stays at rest however unstable it is
        if rest != ZERO {
            let own = self.weighed(factors, |b| match &self.bases[b] {
                Base { line: true, .. } => known[0] - known[1],
                base if base.rate == ZERO => known[0],
                base => base.with(z, value),
            });
            (end, product) = (end + rest * value, product + rest * own);
        }
        if real {
            (end.im, product.im) = (0.0, 0.0);
        }
        [end, product.scale(self.h)]
    }

    /// The response to a function whose pole is near, and the sum of its products with all of them.
    fn near(&self, c: usize, z: Complex, known: &[Complex], factors: &[Complex]) -> [Complex; 2] {
        let other = &self.bases[c];
        if other.rate != ZERO {
            let products = self.weighed(factors, |b| self.against(b, &[z, other.rate]));
            return [pair(z, other.rate), products];
        }
        let order = other.count();
        let products = self.weighed(factors, |b| match &self.bases[b] {
            Base { line: true, .. } => known[order] - known[order + 1],
            base if base.rate == ZERO => known[order],
            _ => self.against(b, &[z, ZERO, ZERO][..=order]),
        });
        [known[order - 1], products]
    }

    /// The sum over all functions, with a factor each.
    #[inline]
    fn weighed(&self, factors: &[Complex], each: impl Fn(usize) -> Complex) -> Complex {
        let mut sum = ZERO;
        for (b, &factor) in factors.iter().enumerate().filter(|(_, factor)| **factor != ZERO) {
            sum = sum + factor * each(b);
        }
        sum
    }

    /// `int (sum a_b f_b) (sum c_c f_c)`
    pub fn between(&self, a: &[Complex], c: &[Complex]) -> Complex {
        let rows = self.products.chunks_exact(self.bases.len());
        let sum = a.iter().zip(rows).fold(ZERO, |sum, (&a, row)| {
            sum + a * row.iter().zip(c).fold(ZERO, |sum, (&p, &c)| sum + p * c)
        });
        sum.scale(self.h)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modewise::functions::inputs::{Decay, Tone};

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
        let mut modal = ModalEnergies::default();
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
                modal.set(&segment(swing), h);
                let count = modal.bases.len();
                let (mut forces, mut factors) = (vec![ZERO; count], vec![ZERO; count]);
                let pair = rate.im != 0.0;
                if pair {
                    modal.forces(|j| complex(DRIVE[j], TURNED[j]), &mut forces);
                } else {
                    modal.real_forces(&DRIVE, &mut forces);
                }
                let (expected, products) = stepped(rate, swing, h);
                let begin = complex(1.0, if pair { 0.5 } else { 0.0 });
                let mut steady = vec![ZERO; count];
                let [end, _] = modal.follow(rate, begin, [&forces, &factors], &mut steady);
                let case = format!("{rate:?} {swing} {h}");
                assert!((end - expected).abs() < 1e-11 * (1.0 + expected.abs()), "{case}");
                for (j, product) in products.into_iter().enumerate() {
                    modal.forces(|k| complex(f64::from(u8::from(k == j)), 0.0), &mut factors);
                    let [_, rest] = modal.follow(rate, begin, [&forces, &factors], &mut steady);
                    let found = rest + modal.between(&factors, &steady);
                    let off = (found.re - product.re).abs();
                    assert!(off < 1e-11 * h * (1.0 + product.abs() / h), "{case} {j}");
                }
                // what two inputs have in common
                modal.real_forces(&DRIVE, &mut forces);
                modal.forces(|k| complex(f64::from(u8::from(k == 2)), 0.0), &mut factors);
                let rule = |count: usize| {
                    let at = |k: usize| {
                        let v = inputs(swing, h * k as f64 / count as f64);
                        v[2] * (0..5).map(|j| DRIVE[j] * v[j]).sum::<f64>()
                    };
                    let inner =
                        |odd: usize| (1..count).filter(|k| k % 2 == odd).map(at).sum::<f64>();
                    h / (3.0 * count as f64) * (at(0) + 4.0 * inner(1) + 2.0 * inner(0) + at(count))
                };
                let found = modal.between(&factors, &forces).re;
                assert!((found - rule(4000)).abs() < 1e-11 * h.max(1.0), "{case}");
            }
        }
    }
}

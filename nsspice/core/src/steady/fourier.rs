//! Fourier coefficients of outputs along a run, and averages of their products.

use super::orbit::Orbit;
use crate::dense::{complex, divided, dot, Complex};
use crate::modewise::functions::terms::{Point, Term};
use crate::modewise::segments::bundle::Bundle;
use crate::modewise::segments::trajectory::Trajectory;
use crate::modewise::Passage;
use crate::rounding::UNIT;

/// Nodes and weights of Gauss and Legendre with sixteen points on [-1, 1], the positive half.
const NODES: [[f64; 2]; 8] = [
    [0.095_012_509_837_637_44, 0.189_450_610_455_068_5],
    [0.281_603_550_779_258_9, 0.182_603_415_044_923_6],
    [0.458_016_777_657_227_4, 0.169_156_519_395_002_54],
    [0.617_876_244_402_643_7, 0.149_595_988_816_576_73],
    [0.755_404_408_355_003, 0.124_628_971_255_533_87],
    [0.865_631_202_387_831_7, 0.095_158_511_682_492_78],
    [0.944_575_023_073_232_6, 0.062_253_523_938_647_9],
    [0.989_400_934_991_649_9, 0.027_152_459_411_754_095],
];
/// Longest panel in units of the time constant of a term. The rule errs by `2^33 (16!)^4 / (33 (32!)^3) z^32`
/// of an exponential `e^(z x)`, x in [-1, 1], which is 2e-18 at `z = 7`: the product of two such terms.
const REACH: f64 = 7.0;

/// The part of a segment in a window, in closed form with all outputs; times count from its start.
pub(super) struct Piece {
    pub path: Trajectory,
    pub bundle: Bundle,
    start: f64,
    from: f64,
    pub to: f64,
}

impl Orbit {
    fn pieces(&self, window: [f64; 2]) -> Vec<Piece> {
        let meets = |p: &&Passage| p.end > window[0] && p.start < window[1];
        self.passages.iter().filter(meets).map(|p| self.piece(p, window)).collect()
    }

    pub(super) fn piece(&self, p: &Passage, window: [f64; 2]) -> Piece {
        let length = p.end - p.start;
        let mut path = Trajectory::default();
        let mut a = vec![0.0; self.states()];
        p.mode.leave(&p.first, &p.inputs.now, &mut a);
        path.begin(&p.mode, &a, &p.inputs, length.max(f64::MIN_POSITIVE));
        let mut bundle = Bundle::default();
        path.bundle(&self.nominal_rows(p), &p.inputs, &mut bundle);
        let from = (window[0] - p.start).max(0.0);
        let to = if window[1] >= p.end { length } else { window[1] - p.start };
        Piece { path, bundle, start: p.start, from, to }
    }

    /// Fourier coefficients `1/T integral of e^(-i n w (t - t0)) y` of all outputs over a window from t0 on, of
    /// which `w` is the own frequency, by output and order.
    pub fn coefficients(&self, orders: &[f64], window: [f64; 2]) -> Vec<Complex> {
        let length = window[1] - window[0];
        let own = std::f64::consts::TAU / length;
        let outputs = self.outputs.len();
        let mut out = vec![Complex::default(); outputs * orders.len()];
        for piece in self.pieces(window) {
            let slots = piece.path.slots;
            for (k, &order) in orders.iter().enumerate() {
                let shift = complex(0.0, order * own);
                let phase = (-shift.scale(piece.start - window[0])).exp();
                for placed in &piece.path.terms {
                    let Some([own, mirrored]) = piece.integrals(&placed.term, shift) else {
                        let sum = phase * piece.numerically(placed.slot, shift);
                        for (o, factors) in piece.bundle.factor.chunks_exact(slots).enumerate() {
                            let to = &mut out[o * orders.len() + k];
                            *to = *to + sum.scale(factors[placed.slot]);
                        }
                        continue;
                    };
                    for (o, factors) in piece.bundle.factor.chunks_exact(slots).enumerate() {
                        let sum = &mut out[o * orders.len() + k];
                        let re = factors[placed.slot];
                        if placed.width == 1 {
                            *sum = *sum + phase * own.scale(re);
                            continue;
                        }
                        let f = complex(re, -factors[placed.slot + 1]).scale(0.5);
                        *sum = *sum + phase * (f * own + f.conj() * mirrored);
                    }
                }
            }
        }
        out.iter_mut().for_each(|v| *v = v.scale(1.0 / length));
        out
    }

    /// Averages of products of outputs, given by their numbers, over a window.
    pub fn products(&self, pairs: &[(usize, usize)], window: [f64; 2]) -> Vec<f64> {
        let mut sums = vec![0.0; pairs.len()];
        for piece in self.pieces(window) {
            piece.add_products(self.outputs.len(), pairs, &mut sums);
        }
        sums.iter_mut().for_each(|v| *v /= window[1] - window[0]);
        sums
    }
}

/// Integrals of `e^(-shift t)` times a term and times its conjugate; `None` if it has no closed form.
fn integrals(term: &Term, shift: Complex, d: f64) -> Option<[Complex; 2]> {
    let zero = Complex::default();
    let of = |nodes: &[Complex]| {
        let mut scaled = [zero; crate::dense::NODES];
        for (to, node) in scaled.iter_mut().zip(nodes) {
            *to = (*node - shift).scale(d);
        }
        divided(&scaled[..=nodes.len()]).scale(d.powi(nodes.len() as i32))
    };
    Some(match *term {
        Term::One => [of(&[zero]); 2],
        Term::Time => [of(&[zero, zero]); 2],
        Term::Exp { rate } => [of(&[rate]), of(&[rate.conj()])],
        Term::Near { own, apart, .. } => {
            let forced = own + apart;
            [of(&[own, forced]), of(&[own.conj(), forced.conj()])]
        }
        Term::Ramp { own } => [of(&[own, zero, zero]), of(&[own.conj(), zero, zero])],
        Term::Numerical { .. } => return None,
    })
}

impl Piece {
    /// Integrals over the piece; see [`integrals`].
    fn integrals(&self, term: &Term, shift: Complex) -> Option<[Complex; 2]> {
        let [a, b] = integrals(term, shift, self.to)?;
        if self.from == 0.0 {
            return Some([a, b]);
        }
        let [c, d] = integrals(term, shift, self.from)?;
        Some([a - c, b - d])
    }

    pub(super) fn values(&self, point: &Point, out: &mut [f64]) {
        for (value, factors) in out.iter_mut().zip(self.bundle.factor.chunks_exact(self.path.slots))
        {
            *value = dot(factors, &point.value);
        }
    }

    /// Adds the integrals of products of outputs, given by their numbers.
    pub(super) fn add_products(&self, outputs: usize, pairs: &[(usize, usize)], sums: &mut [f64]) {
        let mut values = vec![0.0; outputs];
        self.quadrature(f64::INFINITY, |_, weight, point| {
            self.values(point, &mut values);
            for (sum, &(i, j)) in sums.iter_mut().zip(pairs) {
                *sum += weight * values[i] * values[j];
            }
        });
    }

    /// Calls for time, weight and terms at all nodes of a quadrature that integrates products of two terms, on
    /// panels of at most a length.
    pub(super) fn quadrature(&self, longest: f64, mut visit: impl FnMut(f64, f64, &Point)) {
        let mut point = Point::default();
        let mut t = self.from;
        while t < self.to {
            let width = self.panel(t).min(longest);
            let end = if t + 1.01 * width >= self.to { self.to } else { t + width };
            let (half, middle) = (0.5 * (end - t), 0.5 * (end + t));
            for [node, weight] in NODES {
                for side in [-1.0, 1.0] {
                    let at = middle + side * node * half;
                    self.path.at(at, &mut point);
                    visit(at, weight * half, &point);
                }
            }
            t = end;
        }
    }

    /// The longest panel for a factor that turns with an angular frequency [s].
    pub(super) fn longest(omega: f64) -> f64 {
        REACH / omega.abs()
    }

    /// How long the panel that begins at `t` may be.
    fn panel(&self, t: f64) -> f64 {
        let mut width = self.to - t;
        for placed in &self.path.terms {
            let rates = match placed.term {
                Term::One | Term::Time => continue,
                Term::Exp { rate } | Term::Ramp { own: rate } => [rate; 2],
                Term::Near { own, apart, .. } => [own, own + apart],
                Term::Numerical { rate } => [complex(0.0, rate); 2],
            };
            for rate in rates {
                let left = (rate.re * t).exp();
                if rate.abs() > 0.0 && left > UNIT {
                    width = width.min(REACH / rate.abs() * left.min(1.0).powf(-1.0 / 32.0));
                }
            }
        }
        width
    }

    /// The weighted integral of a term without closed form.
    fn numerically(&self, slot: usize, shift: Complex) -> Complex {
        let mut sum = Complex::default();
        self.quadrature(Piece::longest(shift.abs()), |t, weight, point| {
            sum = sum + (-shift.scale(t)).exp().scale(weight * point.value[slot]);
        });
        sum
    }
}

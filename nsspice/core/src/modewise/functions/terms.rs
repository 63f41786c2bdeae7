//! The functions of time of which a segment is made, with derivatives and bounds.

use crate::dense::{complex, Complex};

/// Largest exponent of what grows: below the range of numbers, which ends at 709, so that there is room for factors
/// of 1e8, and beyond that of energies.
const LARGEST: f64 = 690.0;

/// A function of the time since the start of the segment.
#[derive(Clone, Copy, Debug)]
pub enum Term {
    /// 1
    One,
    /// t
    Time,
    /// `e^(rate t)`; real if the rate is
    Exp {
        /// [1/s]
        rate: Complex,
    },
    /// `(e^(forced t) - e^(own t)) / (forced - own)`: a mode driven near its own rate
    Near {
        /// rate of the mode [1/s]
        own: Complex,
        /// `forced - own` [1/s]
        apart: Complex,
        /// the larger absolute rate [1/s]
        size: f64,
    },
    /// `(e^(own t) - 1 - own t) / own^2`: a slow mode driven by a ramp
    Ramp {
        /// rate of the mode [1/s]
        own: Complex,
    },
    /// a coordinate that is computed elsewhere
    Numerical {
        /// no faster than this [1/s]
        rate: f64,
    },
}

/// A term and its place: one slot, or two for real and imaginary part.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// what
    pub term: Term,
    /// first slot
    pub slot: usize,
    /// 1 or 2
    pub width: usize,
}

/// All terms at one instant.
#[derive(Clone, Debug, Default)]
pub struct Point {
    /// time since the start of the segment [s]
    pub t: f64,
    /// values by slot
    pub value: Vec<f64>,
    /// derivatives by slot
    pub slope: Vec<f64>,
    /// size of each term's exponentials
    pub envelope: Vec<f64>,
}

impl Point {
    /// Takes another point, in the space that is there.
    pub fn copy_from(&mut self, other: &Point) {
        self.t = other.t;
        self.value.clone_from(&other.value);
        self.slope.clone_from(&other.slope);
        self.envelope.clone_from(&other.envelope);
    }
}

impl Term {
    /// How fast it moves at most [1/s].
    pub fn speed(&self) -> f64 {
        match *self {
            Term::One | Term::Time => 0.0,
            Term::Exp { rate } => rate.abs(),
            Term::Near { size, .. } => size,
            Term::Ramp { own } => own.abs(),
            Term::Numerical { rate } => rate,
        }
    }

    /// Rate at which its exponentials grow, negative if they decay [1/s].
    #[inline]
    pub fn growth(&self) -> f64 {
        match *self {
            Term::One | Term::Time | Term::Numerical { .. } => 0.0,
            Term::Exp { rate } => rate.re,
            Term::Near { own, apart, .. } => own.re.max(own.re + apart.re),
            Term::Ramp { own } => own.re,
        }
    }

    /// Value, derivative and size of the exponentials.
    #[inline]
    pub fn at(&self, t: f64) -> (Complex, Complex, f64) {
        let real = |x| complex(x, 0.0);
        if t == 0.0 {
            return match *self {
                Term::One => (real(1.0), real(0.0), 1.0),
                Term::Exp { rate } => (real(1.0), rate, 1.0),
                Term::Time | Term::Near { .. } => (real(0.0), real(1.0), 1.0),
                Term::Ramp { .. } => (real(0.0), real(0.0), 1.0),
                Term::Numerical { .. } => (real(0.0), real(0.0), 0.0),
            };
        }
        // what nothing has set in motion stays at rest however unstable it is: 0 times infinity is no number
        let growth = self.growth();
        let t = if growth * t > LARGEST { LARGEST / growth } else { t };
        match *self {
            Term::One => (real(1.0), real(0.0), 1.0),
            Term::Time => (real(t), real(1.0), 1.0),
            Term::Exp { rate } => {
                let size = (rate.re * t).exp();
                if rate.im == 0.0 {
                    return (real(size), real(rate.re * size), size);
                }
                let (sin, cos) = (rate.im * t).sin_cos();
                let f = complex(size * cos, size * sin);
                (f, rate * f, size)
            }
            Term::Near { own, apart, .. } => {
                let size = match growth * t {
                    0.0 => 1.0,
                    most => most.exp(),
                };
                if apart == -own && own != real(0.0) {
                    // a constant drives it
                    let less = own.scale(t).exp_m1();
                    return (less / own, less + real(1.0), size);
                }
                let e = own.scale(t).exp();
                let z = apart.scale(t);
                let less = z.exp_m1();
                let f = if apart.re == 0.0 && apart.im == 0.0 {
                    e.scale(t)
                } else {
                    e * (less / apart)
                };
                let forced = e * (less + real(1.0));
                (f, forced + own * f, size)
            }
            Term::Ramp { own } => {
                let z = own.scale(t);
                let size = (own.re * t).exp().max(1.0);
                if z.abs() < 0.5 {
                    // t^2 (1/2 + z/6 + z^2/24 + ...), t (1 + z/2 + z^2/6 + ...)
                    let (mut second, mut first) = (real(0.0), real(0.0));
                    for k in (0..14).rev() {
                        second = (second * z).scale(1.0 / (k as f64 + 3.0)) + real(1.0);
                        first = (first * z).scale(1.0 / (k as f64 + 2.0)) + real(1.0);
                    }
                    return (second.scale(0.5 * t * t), first.scale(t), size);
                }
                let less = z.exp_m1();
                ((less - z) / (own * own), less / own, size)
            }
            Term::Numerical { .. } => (real(0.0), real(0.0), 0.0),
        }
    }

    /// Largest value within a time, for terms that do not grow exponentially.
    #[inline]
    pub fn reach(&self, t: f64) -> f64 {
        match self {
            Term::One | Term::Exp { .. } | Term::Numerical { .. } => 1.0,
            Term::Time | Term::Near { .. } => t,
            Term::Ramp { .. } => t * t,
        }
    }

    /// Bounds of the second and fourth derivative up to time `t`, but for the envelope.
    #[inline]
    pub fn bounds(&self, t: f64) -> (f64, f64) {
        match *self {
            Term::One | Term::Time => (0.0, 0.0),
            Term::Exp { rate } => {
                let s = rate.re * rate.re + rate.im * rate.im;
                (s, s * s)
            }
            Term::Numerical { rate } => {
                let s = rate * rate;
                (s, s * s)
            }
            Term::Near { size, .. } => {
                (size * (2.0 + t * size), size * size * size * (4.0 + t * size))
            }
            Term::Ramp { own } => (1.0, own.re * own.re + own.im * own.im),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Derivatives by differences, continuity between the branches.
    #[test]
    fn derivatives_belong_to_the_values() {
        let terms = [
            Term::Exp { rate: complex(-2.0, 3.0) },
            Term::Near { own: complex(-1.0, 2.0), apart: complex(0.5, -0.3), size: 2.0 },
            Term::Near { own: complex(-1.0, 0.0), apart: complex(0.0, 0.0), size: 1.0 },
            Term::Ramp { own: complex(-1.0, 0.2) },
            Term::Ramp { own: complex(0.0, 0.0) },
        ];
        for term in terms {
            for t in [0.1, 0.4, 0.49, 0.51, 2.0] {
                let h = 1e-5;
                let (a, b) = (term.at(t - h).0, term.at(t + h).0);
                let slope = (b - a).scale(0.5 / h);
                assert!((slope - term.at(t).1).abs() < 1e-8, "{term:?} at {t}");
            }
        }
    }
}

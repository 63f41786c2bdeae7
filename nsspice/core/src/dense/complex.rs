//! Complex numbers, as far as closed forms need them.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A complex number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Complex {
    /// real part
    pub re: f64,
    /// imaginary part
    pub im: f64,
}

/// A complex number from its parts.
#[inline]
pub const fn complex(re: f64, im: f64) -> Complex {
    Complex { re, im }
}

impl Complex {
    /// The conjugate.
    #[inline]
    pub fn conj(self) -> Complex {
        complex(self.re, -self.im)
    }

    /// The absolute value.
    #[inline]
    pub fn abs(self) -> f64 {
        self.re.hypot(self.im)
    }

    /// A multiple.
    #[inline]
    pub fn scale(self, f: f64) -> Complex {
        complex(self.re * f, self.im * f)
    }

    /// `e^z`
    #[inline]
    pub fn exp(self) -> Complex {
        if self.im == 0.0 {
            return complex(self.re.exp(), 0.0);
        }
        let (sin, cos) = self.im.sin_cos();
        if self.re == 0.0 {
            return complex(cos, sin);
        }
        let size = self.re.exp();
        complex(size * cos, size * sin)
    }

    /// `e^z - 1` without cancellation near 0.
    #[inline]
    pub fn exp_m1(self) -> Complex {
        if self.im == 0.0 {
            return complex(self.re.exp_m1(), 0.0);
        }
        let less = self.re.exp_m1();
        let (sin, cos) = (0.5 * self.im).sin_cos();
        let rest = 2.0 * sin * sin; // 1 - cos of the whole angle
        complex(less * (1.0 - rest) - rest, (less + 1.0) * (2.0 * sin * cos))
    }
}

impl Add for Complex {
    type Output = Complex;
    #[inline]
    fn add(self, o: Complex) -> Complex {
        complex(self.re + o.re, self.im + o.im)
    }
}

impl Sub for Complex {
    type Output = Complex;
    #[inline]
    fn sub(self, o: Complex) -> Complex {
        complex(self.re - o.re, self.im - o.im)
    }
}

impl Neg for Complex {
    type Output = Complex;
    #[inline]
    fn neg(self) -> Complex {
        complex(-self.re, -self.im)
    }
}

impl Mul for Complex {
    type Output = Complex;
    #[inline]
    fn mul(self, o: Complex) -> Complex {
        complex(self.re * o.re - self.im * o.im, self.re * o.im + self.im * o.re)
    }
}

impl Div for Complex {
    type Output = Complex;
    #[inline]
    fn div(self, o: Complex) -> Complex {
        if o.im == 0.0 {
            return complex(self.re / o.re, self.im / o.re);
        }
        // Smith's rule: no overflow on the way
        if o.re.abs() >= o.im.abs() {
            let r = o.im / o.re;
            let d = o.re + r * o.im;
            complex((self.re + r * self.im) / d, (self.im - r * self.re) / d)
        } else {
            let r = o.re / o.im;
            let d = o.im + r * o.re;
            complex((r * self.re + self.im) / d, (r * self.im - self.re) / d)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arithmetic() {
        let (a, b) = (complex(1.0, -2.0), complex(3e-3, 4.0));
        let back = a * b / b;
        assert!((back - a).abs() < 1e-15);
        let small = complex(1e-12, 2e-12);
        assert!((small.exp_m1() - small).abs() < 1e-23);
        let big = complex(0.3, 2.0);
        assert!((big.exp_m1() + complex(1.0, 0.0) - big.exp()).abs() < 1e-15);
    }
}

//! Divided differences of the exponential function.
//!
//! What has the Laplace transform `1 / ((s - z_1) ... (s - z_n))` is `exp[z_1, ..., z_n]` at the time 1: so
//! responses to exponentials and powers of the time are divided differences, and so are integrals of their
//! products, whatever poles are near to each other (McCurdy, Ng, Parlett: Accurate computation of divided
//! differences of the exponential function, Mathematics of Computation 43, 1984).

use crate::dense::{complex, Complex};
use crate::rounding::UNIT;

/// Points closer than this have a series, of seven terms at most.  Each division by a distance that is no smaller
/// makes 32 roundings of one: three of them, of the time and the time, leave 11 digits, two of exponentials 13.
const NEAR: f64 = 1.0 / 32.0;
/// Points that may be given.
pub const MOST: usize = 5;
const ZERO: Complex = complex(0.0, 0.0);

/// Whether two points are near to each other.
#[inline]
pub fn near(a: Complex, b: Complex) -> bool {
    square(a - b) < NEAR * NEAR
}

fn square(z: Complex) -> f64 {
    z.re * z.re + z.im * z.im
}

/// `exp[points]`
pub fn difference(points: &[Complex]) -> Complex {
    if let [a, b] = *points {
        return pair(a, b);
    }
    let (mut far, mut ends) = (0.0, [0, 0]);
    for (i, a) in points.iter().enumerate() {
        for (j, b) in points[..i].iter().enumerate() {
            let apart = square(*a - *b);
            if apart > far {
                (far, ends) = (apart, [i, j]);
            }
        }
    }
    if far < NEAR * NEAR {
        return series(points, far.sqrt());
    }
    let without = |k: usize| {
        let (mut rest, last) = ([ZERO; MOST], points.len() - 1);
        rest[..k].copy_from_slice(&points[..k]);
        rest[k..last].copy_from_slice(&points[k + 1..]);
        difference(&rest[..last])
    };
    (without(ends[0]) - without(ends[1])) / (points[ends[1]] - points[ends[0]])
}

/// `exp[a, b]`, from the one that grows faster: the exponential of the difference does not overflow.
#[inline]
pub fn pair(a: Complex, b: Complex) -> Complex {
    let (slow, fast) = if a.re > b.re { (b, a) } else { (a, b) };
    let apart = slow - fast;
    let ratio = if apart == ZERO { complex(1.0, 0.0) } else { apart.exp_m1() / apart };
    if fast == ZERO {
        ratio
    } else {
        fast.exp() * ratio
    }
}

/// `e^c` times the sum of `h_k / (k + n - 1)!`, `h_k` the sum of all products of `k` of the distances from one
/// of the points, `c`, none of which is above `far`: its part of the first term is at most `far^k / k!`.
fn series(points: &[Complex], far: f64) -> Complex {
    let mut products = [complex(1.0, 0.0); MOST];
    let mut factor = (1..points.len()).fold(1.0, |f, k| f / k as f64);
    let (mut sum, mut part) = (complex(factor, 0.0), 1.0);
    for k in 1.. {
        part *= far / k as f64;
        if part < UNIT {
            break;
        }
        factor /= (k + points.len() - 1) as f64;
        let mut all = ZERO;
        for (product, point) in products.iter_mut().zip(&points[1..]) {
            *product = all + (*point - points[0]) * *product;
            all = *product;
        }
        sum = sum + all.scale(factor);
    }
    points[0].exp() * sum
}

/// `exp[z, 0]`, `exp[z, 0, 0]` and so on.
#[inline]
pub fn at_zero(z: Complex) -> [Complex; MOST - 1] {
    // each from the one after it, or from the one before it: exp[z, 0, ...] = 1/k! + z exp[z, 0, ..., 0]
    const FIRST: [Complex; 3] = [complex(1.0, 0.0), complex(0.5, 0.0), complex(1.0 / 6.0, 0.0)];
    if near(z, ZERO) {
        let next = |sum: Complex, k: usize| (sum * z).scale(1.0 / k as f64) + FIRST[0];
        let last = (MOST..MOST + 7).rev().fold(FIRST[0], next).scale(1.0 / 24.0);
        let third = FIRST[2] + z * last;
        let second = FIRST[1] + z * third;
        return [FIRST[0] + z * second, second, third, last];
    }
    let inverse = FIRST[0] / z;
    let first = z.exp_m1() * inverse;
    let second = (first - FIRST[0]) * inverse;
    let third = (second - FIRST[1]) * inverse;
    [first, second, third, (third - FIRST[2]) * inverse]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same with one point 0 more: the integral of `exp[t points] t^(n - 1)` up to 1, by the rule of Simpson.
    fn integrated(points: &[Complex]) -> Complex {
        let at = |t: f64| {
            let scaled: Vec<_> = points.iter().map(|p| p.scale(t)).collect();
            difference(&scaled).scale(t.powi(points.len() as i32 - 1))
        };
        let count = 2000;
        let inner = (1..count).map(|k| {
            let weight = if k % 2 == 1 { 4.0 } else { 2.0 };
            at(k as f64 / count as f64).scale(weight)
        });
        let ends = at(0.0) + at(1.0);
        inner.fold(ends, |sum, v| sum + v).scale(1.0 / (3.0 * count as f64))
    }

    #[test]
    fn each_point_is_an_integration() {
        let known = [(0.0, 0.0), (0.3, 0.0), (0.0, 7.0), (-2.0, 0.2), (-9.0, 0.0), (-0.1, 6.9)];
        let known = known.map(|(re, im)| complex(re, im));
        for a in known {
            assert!((difference(&[a]) - a.exp()).abs() < 1e-15);
            for z in [a, a.scale(0.999 * NEAR / a.abs().max(1.0))] {
                for (k, value) in at_zero(z).into_iter().enumerate() {
                    let expected = difference(&[z, ZERO, ZERO, ZERO, ZERO][..k + 2]);
                    assert!((value - expected).abs() < 1e-14, "{z:?} {k}");
                }
            }
            for b in known {
                for c in [b, a + complex(1e-9, 0.0), ZERO] {
                    for list in [&[a][..], &[a, b], &[a, b, c], &[a, b, c, c]] {
                        let mut more = vec![ZERO];
                        more.extend(list);
                        let (found, expected) = (difference(&more), integrated(list));
                        // of Simpson's rule: (h w)^4 / 180
                        assert!(
                            (found - expected).abs() < 1e-11,
                            "{list:?} {found:?} {expected:?}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn what_has_decayed_or_grown_does_not_overflow() {
        let (gone, grown) = (complex(-1e5, 0.0), complex(700.0, 0.0));
        assert!((pair(gone, ZERO).re - 1e-5).abs() < 1e-20);
        assert!((pair(gone, grown) / pair(ZERO, grown)).re < 1.0);
        assert_eq!(difference(&[gone, gone]), ZERO);
    }
}

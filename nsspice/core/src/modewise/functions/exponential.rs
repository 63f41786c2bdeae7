//! Responses to powers of the time: divided differences of the exponential function with one node and zeros.

use crate::dense::{complex, Complex, NODES};

/// Points closer than this are near to each other.  Each division by a distance that is no smaller makes 32
/// roundings of one: three of them, of the time and the time, leave 11 digits, two of exponentials 13.
const NEAR: f64 = 1.0 / 32.0;
const ZERO: Complex = complex(0.0, 0.0);

/// Whether two points are near to each other.
#[inline]
pub fn near(a: Complex, b: Complex) -> bool {
    square(a - b) < NEAR * NEAR
}

fn square(z: Complex) -> f64 {
    z.re * z.re + z.im * z.im
}

/// `exp[z, 0]`, `exp[z, 0, 0]` and so on.
#[inline]
pub fn at_zero(z: Complex) -> [Complex; NODES - 1] {
    // each from the one after it, or from the one before it: exp[z, 0, ...] = 1/k! + z exp[z, 0, ..., 0]
    const FIRST: [Complex; 3] = [complex(1.0, 0.0), complex(0.5, 0.0), complex(1.0 / 6.0, 0.0)];
    if near(z, ZERO) {
        let next = |sum: Complex, k: usize| (sum * z).scale(1.0 / k as f64) + FIRST[0];
        let last = (NODES..NODES + 7).rev().fold(FIRST[0], next).scale(1.0 / 24.0);
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
    use crate::dense::{divided, pair};

    /// The same with one point 0 more: the integral of `exp[t points] t^(n - 1)` up to 1, by the rule of Simpson.
    fn integrated(points: &[Complex]) -> Complex {
        let at = |t: f64| {
            let scaled: Vec<_> = points.iter().map(|p| p.scale(t)).collect();
            divided(&scaled).scale(t.powi(points.len() as i32 - 1))
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
            assert!((divided(&[a]) - a.exp()).abs() < 1e-15);
            for z in [a, a.scale(0.999 * NEAR / a.abs().max(1.0))] {
                for (k, value) in at_zero(z).into_iter().enumerate() {
                    let expected = divided(&[z, ZERO, ZERO, ZERO, ZERO][..k + 2]);
                    assert!((value - expected).abs() < 1e-14, "{z:?} {k}");
                }
            }
            for b in known {
                for c in [b, a + complex(1e-9, 0.0), ZERO] {
                    for list in [&[a][..], &[a, b], &[a, b, c], &[a, b, c, c]] {
                        let mut more = vec![ZERO];
                        more.extend(list);
                        let (found, expected) = (divided(&more), integrated(list));
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
        assert_eq!(divided(&[gone, gone]), ZERO);
    }
}

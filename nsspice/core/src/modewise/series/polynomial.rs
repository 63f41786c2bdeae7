//! Where a polynomial on `[0, 1]` ceases to be positive.

/// Halvings of an interval in which a root is looked for: what is left then is rounding.
const HALVINGS: u32 = 50;

/// The value at `s`.
#[inline]
pub fn value(c: &[f64], s: f64) -> f64 {
    c.iter().rev().fold(0.0, |sum, &c| sum * s + c)
}

/// The first `s` in `(0, most]` at which the polynomial is no longer positive; it is at 0.
///
/// A chord lies above what is left of the polynomial by a bound of its curvature at most, so that intervals on which
/// that leaves it positive have no root; the others are halved.
pub fn first_root(c: &[f64], most: f64) -> Option<f64> {
    let rest: f64 = c[1..].iter().map(|c| c.abs()).sum();
    if c[0] > rest {
        return None;
    }
    let factor = |k: usize| (k * k.saturating_sub(1)) as f64;
    let curvature: f64 = c.iter().enumerate().map(|(k, c)| factor(k) * c.abs()).sum();
    scan(c, curvature, [0.0, c[0]], [most, value(c, most)], 0)
}

fn scan(
    c: &[f64],
    curvature: f64,
    [a, at_a]: [f64; 2],
    [b, at_b]: [f64; 2],
    depth: u32,
) -> Option<f64> {
    if at_b > 0.0 && at_a.min(at_b) > 0.125 * curvature * (b - a) * (b - a) {
        return None;
    }
    let middle = 0.5 * (a + b);
    if depth > HALVINGS || middle <= a || middle >= b {
        return (at_b <= 0.0).then_some(b);
    }
    let slope = at_b - at_a;
    // where the curvature cannot turn the slope round there is one root
    if at_b <= 0.0 && slope < 0.0 && -slope > curvature * (b - a) * (b - a) {
        return Some(between(c, [a, at_a], [b, at_b]));
    }
    let at = value(c, middle);
    let first = if at_a > 0.0 || at > 0.0 || depth == 0 {
        scan(c, curvature, [a, at_a], [middle, at], depth + 1)
    } else {
        Some(a)
    };
    if first.is_some() || at <= 0.0 {
        return first;
    }
    scan(c, curvature, [middle, at], [b, at_b], depth + 1)
}

/// The root between a positive and a negative value, by the rule of false position with halved ends (Illinois).
fn between(c: &[f64], [mut a, mut at_a]: [f64; 2], [mut b, mut at_b]: [f64; 2]) -> f64 {
    let mut side = 0;
    for round in 0..80 {
        let chord = (at_a * b - at_b * a) / (at_a - at_b);
        let inside = round % 8 != 7 && chord > a && chord < b;
        let s = if inside { chord } else { 0.5 * (a + b) };
        if s <= a || s >= b {
            break;
        }
        let at = value(c, s);
        if at > 0.0 {
            (a, at_a) = (s, at);
            at_b *= if side == 1 { 0.5 } else { 1.0 };
            side = 1;
        } else {
            (b, at_b) = (s, at);
            at_a *= if side == -1 { 0.5 } else { 1.0 };
            side = -1;
            if at == 0.0 {
                break;
            }
        }
    }
    b
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_of_two_close_roots_is_found() {
        // (s - 0.3) (s - 0.3 - gap), positive at 0
        for gap in [0.3, 1e-3, 1e-6] {
            let c = [0.3 * (0.3 + gap), -(0.6 + gap), 1.0];
            let root = first_root(&c, 1.0).unwrap();
            // the roots are known to rounding over their distance
            assert!((root - 0.3).abs() < 1e-15 / gap, "{root}");
        }
    }

    #[test]
    fn what_stays_positive_has_no_root() {
        assert_eq!(first_root(&[0.09 + 1e-9, -0.6, 1.0], 1.0), None);
        assert_eq!(first_root(&[1.0, -0.5, -0.4], 1.0), None);
        assert_eq!(first_root(&[1.0, -2.0], 0.4), None);
    }

    #[test]
    fn a_simple_root_is_found_to_rounding() {
        let root = first_root(&[1.0, 0.0, -2.0], 1.0).unwrap();
        assert!((root - 0.5f64.sqrt()).abs() < 2e-16);
        let cubic = [1e-9, 1.0, -3.0, 1.0];
        let root = first_root(&cubic, 1.0).unwrap();
        assert!(value(&cubic, root) <= 0.0 && value(&cubic, root - 1e-15) > 0.0);
    }
}

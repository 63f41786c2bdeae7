//! Instructions with constants: values and slopes.

/// `Is expm1(v / nVt)` and its slope, with one exponential.
pub(super) fn junction(saturation: f64, unit: f64, v: f64) -> (f64, f64) {
    let x = v / unit;
    let (grown, power) = if x.abs() < 0.5 {
        let grown = x.exp_m1();
        (grown, grown + 1.0)
    } else {
        let power = x.exp();
        (power - 1.0, power)
    };
    (saturation * grown, saturation / unit * power)
}

/// Arguments from which on `ln(1 + x)` and `exp(x) - 1` keep their digits as they stand, but for two
/// bits.
const FAR: f64 = 0.25;

/// Charge of a depletion layer and its capacitance (SPICE's formula, continued linearly in the
/// capacitance beyond `FC VJ`).
///
/// With `t = 1 - v/VJ`: `Q = CJ0 VJ (1 - t^(1-M)) / (1-M)`, computed by `expm1` and `log1p` where
/// digits would be lost otherwise: near v = 0 and near M = 1.
pub(super) fn depletion(constants: &[f64], v: f64) -> (f64, f64) {
    let (c, vj, m, fc) = (constants[0], constants[1], constants[2], constants[3]);
    let edge = fc * vj;
    // (1 - t^(1-m)) / (1-m) with ln t = log
    let gathered = |log: f64| {
        let exponent = (1.0 - m) * log;
        if exponent.abs() < 1e-300 {
            -log
        } else {
            -log * (exponent.exp_m1() / exponent)
        }
    };
    if v < edge {
        let x = -v / vj;
        if x.abs() < FAR {
            let log = x.ln_1p();
            return (c * vj * gathered(log), c * (-m * log).exp());
        }
        // half the cost: one logarithm and one exponential
        let t = 1.0 + x;
        let log = t.ln();
        let power = (-m * log).exp();
        let exponent = (1.0 - m) * log;
        let gathered =
            if exponent.abs() < FAR { gathered(log) } else { (1.0 - t * power) / (1.0 - m) };
        return (c * vj * gathered, c * power);
    }
    let log = (-fc).ln_1p();
    let beyond = v - edge;
    let at_edge = c * (-m * log).exp();
    // the capacitance goes on along its tangent at the edge
    let slope = at_edge * m / (vj * (1.0 - fc));
    let charge = c * vj * gathered(log) + beyond * (at_edge + 0.5 * slope * beyond);
    (charge, at_edge + slope * beyond)
}

/// The part of the values on both sides of a zero below which a broken line is known by its zero.
const NEAR_ZERO: f64 = 0.1;

/// Points `x1, y1, x2, y2 ...` behind a count: value and slope of the broken line, constant beyond
/// its ends; at a kink the slope to the right, at a jump the value to the right.
pub(super) fn table(constants: &[f64], x: f64) -> (f64, f64) {
    let points = &constants[1..=2 * constants[0] as usize];
    let above = points.chunks_exact(2).position(|p| x < p[0]);
    match above {
        Some(0) => (points[1], 0.0),
        None if x.is_nan() => (f64::NAN, f64::NAN),
        None => (points[points.len() - 1], 0.0),
        Some(k) => {
            let [x0, y0, x1, y1] = [0, 1, 2, 3].map(|i| points[2 * (k - 1) + i]);
            let slope = (y1 - y0) / (x1 - x0);
            let value = y0 + (x - x0) * slope;
            // beside a zero between the points rounding of these is all that is left of their difference:
            // an amplifier at rest would never find it
            let crosses = y0.min(y1) < 0.0 && y0.max(y1) > 0.0;
            if crosses && value.abs() <= NEAR_ZERO * y0.abs().min(y1.abs()) {
                return (slope * (x - (x0 * y1 - x1 * y0) / (y1 - y0)), slope);
            }
            (value, slope)
        }
    }
}

/// Each y holds on `[x, next x)`; zero outside.
pub(super) fn staircase(constants: &[f64], x: f64) -> f64 {
    let points = &constants[1..=2 * constants[0] as usize];
    match points.chunks_exact(2).position(|p| x < p[0]) {
        Some(0) => 0.0,
        None => {
            if x.is_nan() {
                f64::NAN
            } else {
                0.0
            }
        }
        Some(k) => points[2 * k - 1],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is left of 12 V beside the zero of an amplifier is no rounding of them, and where one form takes
    /// the place of the other nothing jumps.
    #[test]
    fn a_broken_line_is_known_beside_its_zero() {
        for shift in [0.0, 1e-7] {
            let points = [2.0, -1.2e-6 + shift, -12.0, 1.2e-6 + shift, 12.0];
            for x in [1e-30, -3e-20, 1e-12] {
                let (value, slope) = table(&points, x + shift);
                let moved = x + shift - shift;
                assert!(
                    (value - slope * moved).abs() <= 4.0 * f64::EPSILON * slope * (x.abs() + shift)
                );
            }
        }
        let points = [2.0, -1.2e-6, -12.0, 1.2e-6, 12.0];
        let edge = NEAR_ZERO * 1.2e-6;
        let [below, above] = [1.0 - 1e-15, 1.0 + 1e-15].map(|part| table(&points, edge * part).0);
        assert!((below - above).abs() <= 1e-14, "{below} {above}");
    }
}

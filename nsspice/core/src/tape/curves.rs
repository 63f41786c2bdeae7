//! Instructions with constants: values and slopes.

use super::ops::Op;

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

/// Arguments from which on `ln(1 + x)` and `exp(x) - 1` keep their digits as they are, but for two
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
            // next to a zero between the points rounding of these is all that is left of their difference:
            // an amplifier at rest would never find it
            let crosses = y0.min(y1) < 0.0 && y0.max(y1) > 0.0;
            if crosses && value.abs() <= NEAR_ZERO * y0.abs().min(y1.abs()) {
                return (slope * (x - (x0 * y1 - x1 * y0) / (y1 - y0)), slope);
            }
            (value, slope)
        }
    }
}

/// Value and slope of a curve that constants shape, see `Op::shaped`.
pub(super) fn shaped(op: Op, constants: &[f64], x: f64) -> (f64, f64) {
    match op {
        Op::Softplus => softplus(constants[0], x),
        Op::GateDrain => gate_drain(constants[0], constants[1], constants[2], x),
        _ => body(constants[0], x),
    }
}

/// `k ln(1 + exp(x/k))`: zero far below zero, x far above.
fn softplus(k: f64, x: f64) -> (f64, f64) {
    let e = (-(x / k).abs()).exp();
    let slope = if x > 0.0 { 1.0 } else { e } / (1.0 + e);
    (x.max(0.0) + k * e.ln_1p(), slope)
}

/// Charge between gate and drain of a VDMOS, whose capacitance falls from `most` to `least`:
/// `y + s tanh(a v)` for positive v, `y + s atan(a v)` for negative ones.
fn gate_drain(least: f64, most: f64, a: f64, v: f64) -> (f64, f64) {
    let s = (most - least) / (1.0 + std::f64::consts::FRAC_PI_2);
    let (y, x) = (most - s, a * v);
    if v > 0.0 {
        // ln cosh x = x - ln 2 + ln(1 + exp(-2x)), which loses digits near zero: sinh^2 there
        let log = if x < 0.5 {
            0.5 * (x.sinh() * x.sinh()).ln_1p()
        } else {
            x - std::f64::consts::LN_2 + (-2.0 * x).exp().ln_1p()
        };
        (y * v + s * log / a, y + s * x.tanh())
    } else {
        (y * v + s * (v * x.atan() - (x * x).ln_1p() / (2.0 * a)), y + s * x.atan())
    }
}

/// `sqrt(phi - v)`, for positive v along its tangent down to zero: the effect of the body on a
/// threshold in SPICE's LEVEL=1.
fn body(phi: f64, v: f64) -> (f64, f64) {
    let root = phi.sqrt();
    if v <= 0.0 {
        let value = (phi - v).sqrt();
        (value, -0.5 / value)
    } else if v < 2.0 * phi {
        (root - 0.5 * v / root, -0.5 / root)
    } else {
        (0.0 * v, 0.0)
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

    /// What is left of 12 V next to the zero of an amplifier is no rounding of them, and where one form takes
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

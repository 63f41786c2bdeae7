//! Exponential and logarithm of several numbers at a time.
//!
//! Operation by operation as in fdlibm (Sun Microsystems 1993; `e_exp.c`, `s_log1p.c`), without its
//! branches: the exponent is split off, the rest goes through a minimax polynomial.  Within 1.5 units
//! in the last place (`tests` below), the same on every processor.

/// Numbers that go through the same operations.
pub(super) type Lanes<const W: usize> = [f64; W];

const LN2_HIGH: f64 = 6.931_471_803_691_238e-1;
const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;
/// Adding it rounds to a whole number, which is then in the last bits.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// Exponents beyond are beyond the range of normal numbers.
const RANGE: [f64; 2] = [-708.0, 709.0];

const P: [f64; 5] = [
    1.666_666_666_666_660_2e-1,
    -2.777_777_777_701_559_3e-3,
    6.613_756_321_437_934e-5,
    -1.653_390_220_546_525_2e-6,
    4.138_136_797_057_238_5e-8,
];

const L: [f64; 7] = [
    6.666_666_666_666_735e-1,
    3.999_999_999_940_942e-1,
    2.857_142_874_366_239e-1,
    2.222_219_843_214_978_4e-1,
    1.818_357_216_161_805e-1,
    1.531_383_769_920_937_3e-1,
    1.479_819_860_511_658_6e-1,
];

/// `exp(x) - 1` and `exp(x)`; zero below the range of normal numbers, infinite above.
#[inline(always)]
pub(super) fn growth<const W: usize>(x: &Lanes<W>) -> (Lanes<W>, Lanes<W>) {
    // junctions far below their knees, and above their breakdown: mostly all of them are
    if x.iter().all(|x| *x < RANGE[0]) {
        return ([-1.0; W], [0.0; W]);
    }
    let (mut grown, mut power) = ([0.0; W], [0.0; W]);
    for i in 0..W {
        let (one, all) = one_growth(x[i]);
        grown[i] = one;
        power[i] = all;
    }
    (grown, power)
}

#[inline(always)]
fn one_growth(x: f64) -> (f64, f64) {
    // NaN stays; below the range anything else will do, but subnormal numbers take a hundred times as long
    let inside = if x < RANGE[0] { 0.0 } else { x };
    let shifted = inside * std::f64::consts::LOG2_E + ROUND;
    let k = shifted - ROUND;
    let (high, low) = (inside - k * LN2_HIGH, k * LN2_LOW);
    let r = high - low;
    let s = r * r;
    let c = r - s * (P[0] + s * (P[1] + s * (P[2] + s * (P[3] + s * P[4]))));
    let rest = high - (low - r * c / (2.0 - c));
    let scale = f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52);
    let scaled = scale * rest;
    let (grown, power) = (scaled + (scale - 1.0), scaled + scale);
    let (grown, power) = if x < RANGE[0] { (-1.0, 0.0) } else { (grown, power) };
    if x > RANGE[1] {
        (f64::INFINITY, f64::INFINITY)
    } else {
        (grown, power)
    }
}

/// `ln(1 + x)` for x from -1 to 1e300, else NaN.
#[inline(always)]
pub(super) fn log_near_one<const W: usize>(x: &Lanes<W>) -> Lanes<W> {
    let mut out = [0.0; W];
    for i in 0..W {
        out[i] = one_log(x[i]);
    }
    out
}

#[inline(always)]
fn one_log(x: f64) -> f64 {
    const ONE: u64 = 0x3ff0_0000_0000_0000;
    /// square root of one half
    const LEAST: u64 = 0x3fe6_a09e_0000_0000;
    const WHOLE: u64 = 0x4330_0000_0000_0000;
    let u = 1.0 + x;
    // what rounding has taken from the sum
    let lost = if x > 1.0 { 1.0 - (u - x) } else { x - (u - 1.0) };
    let bits = u.to_bits().wrapping_add(ONE - LEAST);
    let k = f64::from_bits(bits >> 52 | WHOLE) - (f64::from_bits(WHOLE) + 1023.0);
    let f = f64::from_bits((bits & !(0xfff << 52)).wrapping_add(LEAST)) - 1.0;
    let s = f / (2.0 + f);
    let z = s * s;
    let w = z * z;
    let even = w * (L[1] + w * (L[3] + w * L[5]));
    let odd = z * (L[0] + w * (L[2] + w * (L[4] + w * L[6])));
    let half = 0.5 * f * f;
    let found = s * (half + (odd + even)) + (k * LN2_LOW + lost / u) - half + f + k * LN2_HIGH;
    if x > -1.0 && x < 1e300 {
        found
    } else {
        f64::NAN
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distance in units in the last place of the expected number.
    fn units(found: f64, expected: f64) -> f64 {
        let ulp = f64::from_bits(expected.abs().to_bits() + 1) - expected.abs();
        (found - expected).abs() / ulp
    }

    /// Numbers of both signs and all sizes, dense near the ends of the parts of the formulas.
    fn numbers(largest: f64) -> Vec<f64> {
        let mut out: Vec<f64> = (0..40_000).map(|k| largest * (k as f64 / 2e4 - 1.0)).collect();
        out.extend((0..40_000).map(|k| 2.0 * (k as f64 / 2e4 - 1.0) + 1e-7));
        let sizes = (0..3000).map(|k| 10f64.powf(-k as f64 / 10.0));
        out.extend(sizes.flat_map(|s| [s, -s]).filter(|s| s.abs() > 1e-300));
        let ends = (-40..40).map(|k| (f64::from(k) + 0.5) * std::f64::consts::LN_2);
        out.extend(ends.flat_map(|e| [e * (1.0 - 1e-15), e, e * (1.0 + 1e-15)]));
        out
    }

    // the functions of the system are within one unit themselves
    const BOUND: f64 = 2.5;

    #[test]
    fn exponentials_are_those_of_the_system() {
        let mut worst = [0.0f64; 2];
        for x in numbers(707.0) {
            let ([grown], [power]) = growth(&[x]);
            worst[0] = worst[0].max(units(grown, x.exp_m1()));
            worst[1] = worst[1].max(units(power, x.exp()));
        }
        assert!(worst.iter().all(|w| *w <= BOUND), "{worst:?}");
    }

    #[test]
    fn logarithms_are_those_of_the_system() {
        let mut worst = 0.0f64;
        for x in numbers(1e6).into_iter().filter(|x| *x > -1.0) {
            worst = worst.max(units(log_near_one(&[x])[0], x.ln_1p()));
        }
        for k in 1..2990 {
            let x = 10f64.powf(k as f64 / 10.0);
            worst = worst.max(units(log_near_one(&[x])[0], x.ln_1p()));
        }
        assert!(worst <= BOUND, "{worst}");
    }

    #[test]
    fn what_is_out_of_range_is_told() {
        let wild = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 710.0, -709.0, 0.0, -0.0, 1e300];
        let (grown, power) = growth(&wild);
        assert!(grown[0].is_nan() && power[0].is_nan());
        assert_eq!(&grown[1..6], &[f64::INFINITY, -1.0, f64::INFINITY, -1.0, 0.0]);
        assert_eq!(&power[1..6], &[f64::INFINITY, 0.0, f64::INFINITY, 0.0, 1.0]);
        assert_eq!((power[6], grown[7]), (1.0, f64::INFINITY));
        let outside = log_near_one(&[-1.0, -2.0, f64::NAN, f64::INFINITY]);
        assert!(outside.iter().all(|v| v.is_nan()));
    }

    #[test]
    fn all_lanes_do_the_same() {
        let x: [f64; 8] = std::array::from_fn(|i| -30.0 + 9.7 * i as f64);
        let (grown, power) = growth(&x);
        let logs = log_near_one(&x.map(f64::abs));
        for i in 0..8 {
            assert_eq!((grown[i], power[i]), one_growth(x[i]));
            assert_eq!(logs[i], one_log(x[i].abs()));
        }
    }
}

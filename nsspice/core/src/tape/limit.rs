//! Linearisation points that keep Newton's method from running away along an exponential.
//!
//! Where a step lands far up an exponential, its tangent is so steep that the next steps crawl back
//! one unit at a time; where it lands far down, the tangent is so flat that the next step leaves
//! the range of doubles.  The remedy of L. Nagel (SPICE2, UCB/ERL M520, 1975, ch. 5) is to read the
//! step as one in the *value* of the exponential where that is the larger quantity: the tangent at
//! the old point predicts a value, and the new linearisation point is where the exponential has it.
//! The equations are not changed: at a solution the linearisation point is the argument itself.

/// So many units above its knee an exponential is entered at most.  An inductor that has lost its way asks for
/// gigavolts from where the curve is flat: each unit too high costs a step down again, from one too low a
/// single step leads to the right value.
const HIGHEST: f64 = 4.0;

/// The next linearisation point of `exp(x / unit)`, proposed `x` with the last one `old`; arguments
/// below `knee` need no care.
pub(super) fn exponential(x: f64, old: f64, unit: f64, knee: f64) -> f64 {
    if x <= knee || (x - old).abs() <= 2.0 * unit {
        return x;
    }
    if old >= knee {
        let ratio = (x - old) / unit;
        if ratio > -1.0 {
            old + unit * ratio.ln_1p()
        } else {
            knee
        }
    } else {
        // from where the curve is flat: read the step from the knee on
        knee + unit * ((x - knee) / unit).ln_1p().min(HIGHEST)
    }
}

/// What a reverse tangent asks for, as a part of the saturation current, that is a current of its own.
const OWN: f64 = 0.5;

/// The same for a junction, `expm1(x / unit)`.  On a node that nothing else connects (behind an open switch) a
/// blocking one has a tangent of 1e-20 S and less, which reaches nearly no current at megavolts only: that
/// flows next to zero, and from the knee it would be a long way back.
pub(super) fn junction(x: f64, old: f64, unit: f64, knee: f64) -> f64 {
    if old < 0.0 && x > knee {
        let power = (old / unit).exp();
        let asked = power - 1.0 + power * ((x - old) / unit);
        if asked.abs() <= OWN {
            return unit * asked.ln_1p();
        }
    }
    exponential(x, old, unit, knee)
}

/// The same for functions that grow exponentially on both sides (sinh, cosh).
pub(super) fn two_sided(x: f64, old: f64) -> f64 {
    const KNEE: f64 = 1.0;
    if x.abs() <= KNEE || (x - old).abs() <= 2.0 {
        return x;
    }
    if x * old > 0.0 && old.abs() > KNEE {
        let (size, before) = (x.abs(), old.abs());
        let ratio = size - before;
        let point = if ratio > -1.0 { before + ratio.ln_1p() } else { KNEE };
        point.copysign(x)
    } else {
        (KNEE + (x.abs() - KNEE).ln_1p()).copysign(x)
    }
}

/// The next linearisation point of a function whose domain ends at `edge`: no more than a tenth of
/// the way there is left in one step.
pub(super) fn domain(x: f64, old: f64, edge: f64) -> f64 {
    let room = old - edge;
    if x > edge && x - edge >= 0.1 * room {
        x
    } else if room > 0.0 {
        edge + 0.1 * room
    } else {
        edge + 1.0
    }
}

/// Where the slope of `saturation * exp(x / unit)` reaches about one: the knee of a junction.
pub(super) fn knee(saturation: f64, unit: f64) -> f64 {
    let value = (unit / (std::f64::consts::SQRT_2 * saturation.abs())).ln();
    if value.is_finite() {
        unit * value
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::{exponential, junction, knee};

    /// Newton's method for `expm1(x / unit) = 0` from a blocking junction; steps until it is there.
    fn steps(limit: impl Fn(f64, f64, f64, f64) -> f64) -> usize {
        let (saturation, unit) = (1e-14, 0.02585);
        let (knee, mut point) = (knee(saturation, unit), -0.62);
        for step in 0..100 {
            let grown = f64::exp_m1(point / unit);
            if grown.abs() <= 1e-12 {
                return step;
            }
            point = limit(point - unit * grown / (grown + 1.0), point, unit, knee);
        }
        100
    }

    /// Newton's method for a junction that takes over the ampere of an inductor, which has 1e8 Ohm in a short
    /// step, from far below its knee; steps until it is there.
    #[test]
    fn a_junction_takes_over_the_current_of_an_inductor() {
        let (saturation, unit, far) = (1e-9, 0.02585, 1e8);
        let (knee, mut point) = (knee(saturation, unit), -12.0);
        let mut steps = 0;
        loop {
            let power = f64::exp(point / unit);
            let (current, slope) = (saturation * (power - 1.0), saturation / unit * power);
            if (current - 1.0).abs() <= 1e-6 {
                break;
            }
            let next = (1.0 - current + slope * point) / (slope + 1.0 / far);
            point = exponential(next, point, unit, knee);
            steps += 1;
        }
        assert!(steps <= 8, "{steps}");
    }

    #[test]
    fn a_junction_on_an_open_node_comes_to_rest_at_once() {
        assert!(steps(junction) <= 2 && steps(exponential) > 4);
    }
}

//! Linearisation points that keep Newton's method from running away along an exponential.
//!
//! Where a step lands far up an exponential, its tangent is so steep that the next steps crawl back
//! one unit at a time; where it lands far down, the tangent is so flat that the next step leaves
//! the range of doubles.  The remedy of L. Nagel (SPICE2, UCB/ERL M520, 1975, ch. 5) is to read the
//! step as one in the *value* of the exponential where that is the larger quantity: the tangent at
//! the old point predicts a value, and the new linearisation point is where the exponential has it.
//! The equations are not changed: at a solution the linearisation point is the argument itself.

/// The next linearisation point of `exp(x / unit)`, proposed `x` with the last one `old`; arguments
/// below `knee` need no care.
pub(super) fn exponential(x: f64, old: f64, unit: f64, knee: f64) -> f64 {
    if x <= knee || (x - old).abs() <= 2.0 * unit {
        return x;
    }
    if old > knee {
        let ratio = (x - old) / unit;
        if ratio > -1.0 {
            old + unit * ratio.ln_1p()
        } else {
            knee
        }
    } else {
        // from where the curve is flat: read the step from the knee on
        knee + unit * ((x - knee) / unit).ln_1p()
    }
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
/// the way there is left over at once.
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

//! Source values as functions of time, with both limits at ideal edges and the list of breakpoints.
//!
//! Values are computed from absolute time (never integrated), so that nothing drifts.  Read this file, then
//! `piecewise` (PULSE, PWL), `smooth` (SIN, EXP, SFFM, AM) and `polynomial` (signals passed on by another block).
//! Imports: bounds of rounding only.

mod piecewise;
mod polynomial;
mod smooth;

pub use piecewise::PiecewiseLinear;
pub use polynomial::Polynomial;
pub use smooth::Smooth;

/// Two instants closer than this, relative to the time, cannot be distinguished.
pub const INSTANT: f64 = 64.0 * f64::EPSILON;

/// Which limit to take where a waveform jumps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// the value just before
    Left,
    /// the value from that instant on
    Right,
}

/// A time at which a waveform is not smooth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Breakpoint {
    /// when [s]
    pub time: f64,
    /// true if the value itself jumps, false for a kink
    pub jump: bool,
}

/// A source waveform.
#[derive(Clone, Debug)]
pub enum Waveform {
    /// constant value
    Dc(f64),
    /// PULSE and PWL
    Piecewise(PiecewiseLinear),
    /// SIN, EXP, SFFM, AM
    Smooth(Smooth),
    /// what another block of the circuit computes
    Polynomial(Polynomial),
}

impl Waveform {
    /// Builds a waveform from its netlist name and complete parameters; `repeat` is NaN for none.
    pub fn new(kind: &str, p: &[f64], repeat: f64, scale: f64) -> Result<Self, String> {
        let need = |count: usize| {
            if p.len() == count {
                Ok(())
            } else {
                Err(format!("waveform {kind} takes {count} values, got {}", p.len()))
            }
        };
        Ok(match kind {
            "dc" => {
                need(1)?;
                Waveform::Dc(p[0] * scale)
            }
            "pulse" => {
                need(8)?;
                Waveform::Piecewise(PiecewiseLinear::pulse(p, scale))
            }
            "pwl" => Waveform::Piecewise(PiecewiseLinear::pwl(p, repeat, scale)?),
            _ => Waveform::Smooth(Smooth::new(kind, p, scale)?),
        })
    }

    /// The constant value, if there is only one.
    pub fn constant(&self) -> Option<f64> {
        match self {
            Waveform::Dc(v) => Some(*v),
            _ => None,
        }
    }

    /// Value at time `t` [s].
    pub fn value(&self, t: f64, side: Side) -> f64 {
        match self {
            Waveform::Dc(v) => *v,
            Waveform::Piecewise(p) => p.value(t, side),
            Waveform::Smooth(s) => s.value(t),
            Waveform::Polynomial(p) => p.value(t, side),
        }
    }

    /// Slope to the right of `t` [1/s].
    pub fn slope(&self, t: f64) -> f64 {
        match self {
            Waveform::Dc(_) => 0.0,
            Waveform::Piecewise(p) => p.line(t).1,
            Waveform::Smooth(s) => s.slope(t),
            Waveform::Polynomial(p) => p.slope(t),
        }
    }

    /// Value at `t` as if the breakpoint (at time `breakpoint`, the first one after `from`) were not there:
    /// the law that holds from `from` on is continued beyond it.
    pub fn continued(&self, t: f64, from: f64, breakpoint: f64) -> f64 {
        match self {
            Waveform::Dc(v) => *v,
            Waveform::Piecewise(p) => {
                let (start, end) = (p.value(from, Side::Right), p.value(breakpoint, Side::Left));
                end + (end - start) * ((t - breakpoint) / (breakpoint - from))
            }
            Waveform::Smooth(s) => s.continued(t, from),
            Waveform::Polynomial(p) => p.continued(t, from),
        }
    }

    /// Longest step that does not overlook a swing of the waveform [s].
    pub fn pace(&self) -> f64 {
        match self {
            Waveform::Smooth(s) => s.pace(),
            _ => f64::INFINITY, // breakpoints are hit anyway
        }
    }

    /// Time after which it repeats, of modulated ones that of the fastest part [s]; infinite if it does not.
    pub fn period(&self) -> f64 {
        match self {
            Waveform::Dc(_) | Waveform::Polynomial(_) => f64::INFINITY,
            Waveform::Piecewise(p) => p.period(),
            Waveform::Smooth(s) => s.period(),
        }
    }

    /// The first breakpoint later than `t`.
    pub fn next_breakpoint(&self, t: f64) -> Option<Breakpoint> {
        match self {
            Waveform::Dc(_) => None,
            Waveform::Piecewise(p) => p.next_breakpoint(t),
            Waveform::Smooth(s) => s.next_breakpoint(t),
            Waveform::Polynomial(p) => p.next_breakpoint(t),
        }
    }

    /// Whether derivatives may jump at the first breakpoint later than `t`.
    pub fn bends(&self, t: f64) -> bool {
        match self {
            Waveform::Polynomial(p) => p.bends(t),
            _ => true,
        }
    }

    /// Values are known to the rounding of a number of this size, 0 if to that of their own.
    pub fn rounded(&self) -> f64 {
        match self {
            Waveform::Polynomial(p) => p.size(),
            _ => 0.0,
        }
    }

    /// Whether somebody may set another value at an instant.
    pub fn is_set_at(&self, t: f64) -> bool {
        matches!(self, Waveform::Polynomial(p) if p.is_set_at(t))
    }

    /// Up to where it is known [s].
    pub fn known(&self) -> f64 {
        match self {
            Waveform::Polynomial(p) => p.end(),
            _ => f64::INFINITY,
        }
    }

    /// The time of the first breakpoint later than `t` [s].
    pub fn next_breakpoint_time(&self, t: f64) -> Option<f64> {
        match self {
            Waveform::Dc(_) => None,
            Waveform::Piecewise(p) => p.next_vertex(t),
            Waveform::Smooth(s) => s.next_breakpoint(t).map(|c| c.time),
            Waveform::Polynomial(p) => p.next_breakpoint(t).map(|c| c.time),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn periods_are_those_of_what_repeats_fastest() {
        let of = |kind: &str, p: &[f64]| Waveform::new(kind, p, f64::NAN, 1.0).unwrap().period();
        assert_eq!(of("pulse", &[0.0, 5.0, 1.0, 0.5, 0.5, 2.0, 10.0, f64::INFINITY]), 10.0);
        assert_eq!(of("pwl", &[0.0, 0.0, 1.0, 5.0]), f64::INFINITY);
        assert_eq!(of("dc", &[5.0]), f64::INFINITY);
        let again = Waveform::new("pwl", &[0.0, 0.0, 1.0, 5.0, 3.0, 0.0], 1.0, 1.0).unwrap();
        assert_eq!(again.period(), 2.0);
        let sine = of("sin", &[0.0, 1.0, 50.0, 0.0, 0.0, 0.0]);
        assert_eq!(sine, 0.02);
    }

    #[test]
    fn an_edge_is_continued_by_its_own_slope() {
        let pulse = [0.0, 5.0, 1.0, 0.5, 0.5, 2.0, 10.0, f64::INFINITY];
        let w = Waveform::new("pulse", &pulse, f64::NAN, 1.0).unwrap();
        assert!((w.continued(1.75, 1.0, 1.5) - 7.5).abs() < 1e-14);
        assert!((w.continued(4.0, 1.5, 3.5) - 5.0).abs() < 1e-14);
    }
}

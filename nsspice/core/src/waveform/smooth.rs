//! SIN, EXP, SFFM and AM sources.

use super::Breakpoint;
use std::f64::consts::TAU;

/// A waveform without jumps.
#[derive(Clone, Debug)]
#[allow(missing_docs)] // the fields are SPICE's, in SPICE's order
pub enum Smooth {
    /// `offset + amplitude exp(-damping s) sin(2 pi frequency s + phase)`, `s = t - delay`, held
    /// before the delay
    Sin { offset: f64, amplitude: f64, frequency: f64, delay: f64, damping: f64, phase: f64 },
    /// two exponential transitions
    Exp { v1: f64, v2: f64, td1: f64, tau1: f64, td2: f64, tau2: f64 },
    /// single-frequency frequency modulation
    Sffm { offset: f64, amplitude: f64, carrier: f64, index: f64, signal: f64 },
    /// amplitude modulation, zero before the delay
    Am { amplitude: f64, offset: f64, modulation: f64, carrier: f64, delay: f64 },
}

/// `sin(2 pi turns + phase)` without losing digits to many turns.
fn sine(turns: f64, phase: f64) -> f64 {
    (TAU * (turns - turns.floor()) + phase).sin()
}

impl Smooth {
    /// Builds the waveform `kind` from complete parameters.
    pub fn new(kind: &str, p: &[f64], scale: f64) -> Result<Self, String> {
        let made = match (kind, p) {
            ("sin", &[offset, amplitude, frequency, delay, damping, phase]) => Smooth::Sin {
                offset: offset * scale,
                amplitude: amplitude * scale,
                frequency,
                delay,
                damping,
                phase: phase.to_radians(),
            },
            ("exp", &[v1, v2, td1, tau1, td2, tau2]) => {
                Smooth::Exp { v1: v1 * scale, v2: v2 * scale, td1, tau1, td2, tau2 }
            }
            ("sffm", &[offset, amplitude, carrier, index, signal]) => Smooth::Sffm {
                offset: offset * scale,
                amplitude: amplitude * scale,
                carrier,
                index,
                signal,
            },
            ("am", &[amplitude, offset, modulation, carrier, delay]) => {
                Smooth::Am { amplitude: amplitude * scale, offset, modulation, carrier, delay }
            }
            _ => return Err(format!("waveform {kind} with {} values is not known", p.len())),
        };
        Ok(made)
    }

    /// Value at `t`.
    pub fn value(&self, t: f64) -> f64 {
        self.continued(t, t)
    }

    /// Value at `t` of the law that holds from `from` on, past any breakpoint in between.
    pub fn continued(&self, t: f64, from: f64) -> f64 {
        match *self {
            Smooth::Sin { offset, amplitude, frequency, delay, damping, phase } => {
                let s = if from >= delay { t - delay } else { 0.0 };
                let envelope = if damping == 0.0 { 1.0 } else { (-damping * s).exp() };
                offset + amplitude * envelope * sine(frequency * s, phase)
            }
            Smooth::Exp { v1, v2, td1, tau1, td2, tau2 } => {
                let rise = if from >= td1 && t > td1 { -(-(t - td1) / tau1).exp_m1() } else { 0.0 };
                let fall = if from >= td2 && t > td2 { -(-(t - td2) / tau2).exp_m1() } else { 0.0 };
                v1 + (v2 - v1) * (rise - fall)
            }
            Smooth::Sffm { offset, amplitude, carrier, index, signal } => {
                offset + amplitude * sine(carrier * t, index * sine(signal * t, 0.0))
            }
            Smooth::Am { amplitude, offset, modulation, carrier, delay } => {
                if from < delay {
                    return 0.0;
                }
                let s = t - delay;
                amplitude * (offset + sine(modulation * s, 0.0)) * sine(carrier * s, 0.0)
            }
        }
    }

    /// Slope to the right of `t`.
    pub fn slope(&self, t: f64) -> f64 {
        let cosine = |turns: f64, phase: f64| sine(turns, phase + 0.25 * TAU);
        match *self {
            Smooth::Sin { amplitude, frequency, delay, damping, phase, .. } => {
                let s = t - delay;
                if s < 0.0 {
                    return 0.0;
                }
                let envelope = if damping == 0.0 { 1.0 } else { (-damping * s).exp() };
                let turns = frequency * s;
                let rate = TAU * frequency * cosine(turns, phase) - damping * sine(turns, phase);
                amplitude * envelope * rate
            }
            Smooth::Exp { v1, v2, td1, tau1, td2, tau2 } => {
                let rate =
                    |td: f64, tau: f64| if t < td { 0.0 } else { (-(t - td) / tau).exp() / tau };
                (v2 - v1) * (rate(td1, tau1) - rate(td2, tau2))
            }
            Smooth::Sffm { amplitude, carrier, index, signal, .. } => {
                let phase = index * sine(signal * t, 0.0);
                let rate = TAU * (carrier + index * signal * cosine(signal * t, 0.0));
                amplitude * rate * cosine(carrier * t, phase)
            }
            Smooth::Am { amplitude, offset, modulation, carrier, delay } => {
                let s = t - delay;
                if s < 0.0 {
                    return 0.0;
                }
                let (m, c) = (modulation * s, carrier * s);
                let product = modulation * cosine(m, 0.0) * sine(c, 0.0)
                    + carrier * (offset + sine(m, 0.0)) * cosine(c, 0.0);
                TAU * amplitude * product
            }
        }
    }

    /// Longest step that does not overlook a swing [s].
    pub fn pace(&self) -> f64 {
        self.period() / 16.0
    }

    /// Period, of modulated ones that of the fastest part [s]; infinite without a swing.
    pub fn period(&self) -> f64 {
        let fastest = match *self {
            Smooth::Sin { frequency, .. } => frequency.abs(),
            Smooth::Exp { .. } => 0.0,
            Smooth::Sffm { carrier, index, signal, .. } => {
                carrier.abs() + (index * signal).abs() + signal.abs()
            }
            Smooth::Am { modulation, carrier, .. } => modulation.abs() + carrier.abs(),
        };
        1.0 / fastest
    }

    /// The kinks at delays.
    pub fn next_breakpoint(&self, t: f64) -> Option<Breakpoint> {
        let kinks = match *self {
            Smooth::Sin { delay, .. } | Smooth::Am { delay, .. } => [delay, f64::INFINITY],
            Smooth::Exp { td1, td2, .. } => [td1, td2],
            Smooth::Sffm { .. } => return None,
        };
        let time =
            kinks.into_iter().filter(|&k| k > t && k.is_finite()).fold(f64::INFINITY, f64::min);
        time.is_finite().then_some(Breakpoint { time, jump: false })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_starts_at_its_delay_and_is_damped() {
        let w = Smooth::new("sin", &[1.0, 2.0, 50.0, 1e-3, 10.0, 30.0], 1.0).unwrap();
        assert!((w.value(0.0) - 2.0).abs() < 1e-15); // 1 + 2 sin 30 deg
        let t = 0.013;
        let s = t - 1e-3;
        let expected = 1.0 + 2.0 * f64::exp(-10.0 * s) * (TAU * 50.0 * s + TAU / 12.0).sin();
        assert!((w.value(t) - expected).abs() < 1e-14);
        assert_eq!(w.next_breakpoint(0.0), Some(Breakpoint { time: 1e-3, jump: false }));
        assert_eq!(w.next_breakpoint(1e-3), None);
    }

    #[test]
    fn slopes_agree_with_difference_quotients() {
        let list = [
            ("sin", vec![1.0, 2.0, 50.0, 1e-3, 10.0, 30.0]),
            ("exp", vec![0.0, 4.0, 1e-3, 5e-3, 8e-3, 2e-3]),
            ("sffm", vec![1.0, 2.0, 200.0, 3.0, 20.0]),
            ("am", vec![2.0, 1.5, 20.0, 300.0, 1e-3]),
        ];
        for (kind, values) in list {
            let w = Smooth::new(kind, &values, 1.0).unwrap();
            for k in 0..40 {
                let t = 2.5e-4 + 5e-4 * f64::from(k);
                let step = 1e-7;
                let quotient = (w.value(t + step) - w.value(t - step)) / (2.0 * step);
                // third derivatives up to (2 pi 300)^3 2 times step^2 / 6
                assert!((w.slope(t) - quotient).abs() < 1e-4, "{kind} at {t}");
            }
        }
    }

    #[test]
    fn a_law_continues_past_its_kink() {
        let w = Smooth::new("sin", &[1.0, 2.0, 50.0, 1e-3, 0.0, 30.0], 1.0).unwrap();
        assert_eq!(w.continued(2e-3, 0.0), w.value(0.0));
        assert_eq!(w.continued(2e-3, 1e-3), w.value(2e-3));
        assert_eq!(w.pace(), 1.0 / 800.0);
        let w = Smooth::new("exp", &[0.0, 4.0, 1.0, 0.5, 2.0, 0.25], 1.0).unwrap();
        assert!((w.continued(3.0, 1.5) - 4.0 * (1.0 - (-4.0f64).exp())).abs() < 1e-15);
    }

    #[test]
    fn many_turns_lose_no_digits() {
        let w = Smooth::new("sin", &[0.0, 1.0, 1.0, 0.0, 0.0, 0.0], 1.0).unwrap();
        assert!((w.value(1e9 + 0.25) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn exponential_source_rises_and_falls() {
        let w = Smooth::new("exp", &[0.0, 4.0, 1.0, 0.5, 2.0, 0.25], 1.0).unwrap();
        assert_eq!(w.value(1.0), 0.0);
        assert!((w.value(1.5) - 4.0 * (1.0 - (-1.0f64).exp())).abs() < 1e-15);
        let both = 4.0 * ((1.0 - (-4.0f64).exp()) - (1.0 - (-4.0f64).exp()));
        assert!((w.value(3.0) - both).abs() < 1e-15);
    }
}

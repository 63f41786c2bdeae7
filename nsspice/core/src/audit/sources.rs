//! Source values once more: what the engines were driven by, against the waveforms of the deck.
//!
//! The formulas are those of the definitions, one value at a time; nothing is shared with the
//! waveforms that engines see.

use super::{worse, TOLERANCE};
use crate::waveform::{Polynomial, Side, INSTANT};
use std::f64::consts::PI;

/// Instants looked at in one block of records.
const MOST: usize = 256;

/// A waveform as the deck describes it.
#[derive(Clone, Debug)]
pub struct Described {
    shape: Shape,
    scale: f64,
    /// the largest slope between jumps, where there may be any
    steepest: Option<f64>,
}

#[derive(Clone, Debug)]
enum Shape {
    Dc(f64),
    /// offset, amplitude, frequency, delay, damping, degrees
    Sine([f64; 6]),
    /// low, high, delay, rise, fall, width, period, count
    Pulse([f64; 8]),
    /// instants and values, and from where they repeat
    Lines(Vec<f64>, Vec<f64>, f64),
    /// first, second, and delay and time constant of the way there and back
    Exponential([f64; 6]),
    /// offset, amplitude, carrier, index, signal
    Sffm([f64; 5]),
    /// amplitude, offset, modulation, carrier, delay
    Am([f64; 5]),
    /// what another block has handed on
    Polynomial(Polynomial),
}

/// The sine of so many turns.
fn sine(turns: f64) -> f64 {
    (2.0 * PI * (turns % 1.0)).sin()
}

/// How much of an edge is past.
fn edge(t: f64, begin: f64, length: f64) -> f64 {
    if length > 0.0 && begin.is_finite() {
        ((t - begin) / length).clamp(0.0, 1.0)
    } else {
        f64::from(u8::from(t >= begin))
    }
}

/// By how much engines may know an instant otherwise.
pub(super) fn known(t: f64) -> f64 {
    INSTANT * t.abs() + f64::MIN_POSITIVE
}

impl Shape {
    /// The largest slope between jumps of waveforms that may jump.
    fn steepest(&self) -> Option<f64> {
        let slope = |rise: f64, run: f64| if run > 0.0 { (rise / run).abs() } else { 0.0 };
        match self {
            Shape::Pulse([low, high, _, rise, fall, ..]) => {
                Some(slope(high - low, *rise).max(slope(high - low, *fall)))
            }
            Shape::Lines(times, levels, _) => {
                let pieces = times.windows(2).zip(levels.windows(2));
                let slopes = pieces.map(|(t, v)| slope(v[1] - v[0], t[1] - t[0]));
                Some(slopes.fold(0.0, f64::max))
            }
            Shape::Exponential([first, second, _, rise, _, fall]) => {
                Some(slope(second - first, *rise).max(slope(second - first, *fall)))
            }
            _ => None,
        }
    }
}

impl Described {
    /// Takes the kind and its values, as of `nsspice.problems.Waveform`.
    pub fn new(kind: &str, values: &[f64], repeat: f64, scale: f64) -> Result<Described, String> {
        let misfit = |_| format!("a waveform {kind} of {} values", values.len());
        let shape = match kind {
            "dc" => Shape::Dc(<[f64; 1]>::try_from(values).map_err(misfit)?[0]),
            "sin" => Shape::Sine(values.try_into().map_err(misfit)?),
            "pulse" => Shape::Pulse(values.try_into().map_err(misfit)?),
            "pwl" => {
                let pairs = || values.chunks_exact(2);
                let (times, levels) = (pairs().map(|p| p[0]), pairs().map(|p| p[1]));
                Shape::Lines(times.collect(), levels.collect(), repeat)
            }
            "exp" => Shape::Exponential(values.try_into().map_err(misfit)?),
            "sffm" => Shape::Sffm(values.try_into().map_err(misfit)?),
            "am" => Shape::Am(values.try_into().map_err(misfit)?),
            _ => return Err(format!("no waveform is called {kind}")),
        };
        let steepest = shape.steepest().map(|slope| (scale * slope).abs());
        Ok(Described { shape, scale, steepest })
    }

    /// No value is larger than this.
    pub fn bound(&self) -> f64 {
        let largest = |values: &[f64]| values.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        let bound = match &self.shape {
            Shape::Dc(value) => value.abs(),
            Shape::Sine([offset, amplitude, ..]) | Shape::Sffm([offset, amplitude, ..]) => {
                offset.abs() + amplitude.abs()
            }
            Shape::Pulse(values) => largest(&values[..2]),
            Shape::Exponential(values) => largest(&values[..2]),
            Shape::Lines(_, levels, _) => largest(levels),
            Shape::Am([amplitude, offset, ..]) => amplitude.abs() * (1.0 + offset.abs()),
            Shape::Polynomial(_) => 0.0,
        };
        self.scale.abs() * bound
    }

    /// The value, if it is one for all times.
    pub fn constant(&self) -> Option<f64> {
        match &self.shape {
            Shape::Dc(value) => Some(self.scale * value),
            _ => None,
        }
    }

    /// What another block hands on, whose laws are checked there.
    pub fn polynomial(polynomial: Polynomial) -> Described {
        Described { shape: Shape::Polynomial(polynomial), scale: 1.0, steepest: None }
    }

    /// The value at an instant, that after it where the waveform jumps.
    pub fn value(&self, t: f64) -> f64 {
        self.scale
            * match &self.shape {
                Shape::Dc(value) => *value,
                Shape::Sine([offset, amplitude, frequency, delay, damping, degrees]) => {
                    let s = (t - delay).max(0.0);
                    let swing = sine(frequency * s + degrees / 360.0);
                    offset + amplitude * swing * (-damping * s).exp()
                }
                Shape::Pulse([low, high, delay, rise, fall, width, period, count]) => {
                    let s = t - delay;
                    let lap = if period.is_finite() { (s / period).floor() } else { 0.0 };
                    let local = if period.is_finite() { s - lap * period } else { s };
                    let share = edge(local, 0.0, *rise) - edge(local, rise + width, *fall);
                    let on = s >= 0.0 && lap < *count;
                    low + (high - low) * if on { share } else { 0.0 }
                }
                Shape::Lines(times, levels, repeat) => lines(times, levels, *repeat, t),
                Shape::Exponential([first, second, rise @ .., td, tau]) => {
                    let gone = |delay: f64, tau: f64| {
                        let s = (t - delay).max(0.0);
                        match tau > 0.0 {
                            true => -(-s / tau).exp_m1(),
                            false => f64::from(u8::from(s > 0.0)),
                        }
                    };
                    first + (second - first) * (gone(rise[0], rise[1]) - gone(*td, *tau))
                }
                Shape::Sffm([offset, amplitude, carrier, index, signal]) => {
                    let turns = carrier * t + index / (2.0 * PI) * sine(signal * t);
                    offset + amplitude * sine(turns)
                }
                Shape::Am([amplitude, offset, modulation, carrier, delay]) => {
                    let s = t - delay;
                    let swing = (offset + sine(modulation * s)) * sine(carrier * s);
                    amplitude * if s >= 0.0 { swing } else { 0.0 }
                }
                Shape::Polynomial(polynomial) => polynomial.value(t, Side::Right),
            }
    }

    /// The value before an instant.
    fn before(&self, t: f64, known: f64) -> f64 {
        match &self.shape {
            Shape::Polynomial(polynomial) => self.scale * polynomial.value(t, Side::Left),
            _ => self.value(t - known),
        }
    }

    /// How far a value is from those around an instant.
    pub(super) fn outside(&self, t: f64, found: f64) -> f64 {
        let known = known(t);
        let around = [self.before(t, known), self.value(t), self.value(t + known)];
        let low = around.iter().fold(f64::INFINITY, |a, v| a.min(*v));
        let high = around.iter().fold(f64::NEG_INFINITY, |a, v| a.max(*v));
        // a line that is continued over the rounding of its end leaves its range by as much
        let (below, above) = (low - found, found - high);
        if found.is_nan() || around.iter().any(|v| v.is_nan()) {
            f64::NAN
        } else {
            below.max(above) - (high - low)
        }
    }
}

impl Described {
    /// The instants within a span at which the waveform jumps, as far as they are no more than `most`.
    pub(super) fn jumps_within(&self, [from, to]: [f64; 2], most: usize, out: &mut Vec<f64>) {
        let mut repeated = |first: f64, period: f64, count: f64| {
            let laps = if period.is_finite() && period > 0.0 { period } else { f64::INFINITY };
            let mut lap = ((from - first) / laps).ceil().max(0.0);
            while lap < count && out.len() < most {
                let at = if lap > 0.0 { first + lap * laps } else { first };
                if at > to || at.is_nan() {
                    break;
                }
                if at >= from {
                    out.push(at);
                }
                lap += 1.0;
            }
        };
        match &self.shape {
            Shape::Pulse([_, _, delay, rise, fall, width, period, count]) => {
                if *rise <= 0.0 {
                    repeated(*delay, *period, *count);
                }
                if *fall <= 0.0 {
                    repeated(delay + rise + width, *period, *count);
                }
            }
            Shape::Lines(times, _, repeat) => {
                let end = times.last().copied().unwrap_or(0.0);
                for at in times.windows(2).filter(|pair| pair[0] == pair[1]).map(|pair| pair[0]) {
                    let again = repeat.is_finite() && end > *repeat && at > *repeat;
                    let period = if again { end - repeat } else { f64::INFINITY };
                    repeated(at, period, f64::INFINITY);
                }
            }
            _ => {}
        }
    }

    /// The value right after an instant at which the waveform jumps, and how much it may change there otherwise.
    ///
    /// The instant may be off by half of what engines take for one: what is further away may be another.
    fn after_jump(&self, t: f64) -> Option<[f64; 2]> {
        let near = 0.5 * known(t);
        let drift = self.steepest? * 2.0 * near;
        let after = self.value(t + near);
        ((after - self.value(t - near)).abs() > 2.0 * drift).then_some([after, drift])
    }

    /// How far the value that a run goes on with from an instant is from that of the waveform.
    pub(super) fn outside_after(&self, t: f64, found: f64) -> f64 {
        match self.after_jump(t) {
            Some([after, drift]) => (found - after).abs() - drift,
            None => self.outside(t, found),
        }
    }

    /// How much it changes within the rounding of an instant.
    pub(super) fn swing(&self, t: f64) -> f64 {
        let known = known(t);
        let (before, now, after) = (self.before(t, known), self.value(t), self.value(t + known));
        (now - before).abs() + (after - now).abs()
    }
}

/// A polygon, level outside; it repeats from an instant on if that is finite and before its end.
fn lines(times: &[f64], levels: &[f64], repeat: f64, mut t: f64) -> f64 {
    let Some(&end) = times.last() else { return 0.0 };
    if repeat.is_finite() && end > repeat && t > repeat {
        t = repeat + (t - repeat).rem_euclid(end - repeat);
    }
    let after = times.partition_point(|&x| x <= t);
    let (left, right) = (after.saturating_sub(1), after.min(times.len() - 1));
    let length = times[right] - times[left];
    let share = if after > 0 && length > 0.0 { (t - times[left]) / length } else { 0.0 };
    levels[left] + (levels[right] - levels[left]) * share
}

/// Compares the source values of records with the waveforms of the deck.
#[derive(Clone, Debug)]
pub struct Sources {
    waveforms: Vec<Described>,
    /// largest value of each so far
    largest: Vec<f64>,
    /// worst relative error
    pub error: f64,
    /// the waveform that is off most
    pub worst: Option<usize>,
}

impl Sources {
    /// Takes the waveforms of the deck.
    pub fn new(waveforms: &[Described]) -> Sources {
        let largest = vec![0.0; waveforms.len()];
        Sources { waveforms: waveforms.to_vec(), largest, error: 0.0, worst: None }
    }

    /// Compares rows of `u` at instants, some of them if they are many.
    pub fn take(&mut self, instants: &[(f64, usize)], u: &[f64]) {
        let stride = instants.len().div_ceil(MOST).max(1);
        self.take_all(instants.iter().copied().step_by(stride), u);
    }

    /// Compares rows of `u` at all of these instants.
    pub fn take_all(&mut self, instants: impl Iterator<Item = (f64, usize)> + Clone, u: &[f64]) {
        let count = self.waveforms.len();
        for (k, waveform) in self.waveforms.iter().enumerate() {
            let some = || instants.clone();
            let (mut largest, mut off) = (self.largest[k], 0.0);
            let compared = |t: f64, row: usize| (waveform.value(t), u[row * count + k]);
            for (t, row) in some() {
                let (value, found) = compared(t, row);
                largest = value.abs().max(largest);
                let error = (found - value).abs();
                off = if worse(error, off) { error } else { off };
            }
            self.largest[k] = largest;
            // only then does it matter whether the instant explains it
            if off <= TOLERANCE * largest {
                continue;
            }
            let mut error = 0.0;
            for (t, row) in some() {
                let outside = waveform.outside(t, compared(t, row).1);
                error = if worse(outside, error) { outside } else { error };
            }
            if error != 0.0 {
                let error = if largest > 0.0 { error / largest } else { f64::INFINITY };
                if worse(error, self.error) {
                    (self.error, self.worst) = (error, Some(k));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(kind: &str, values: &[f64], repeat: f64, scale: f64, points: &[(f64, f64)]) {
        let waveform = Described::new(kind, values, repeat, scale).unwrap();
        for &(t, expected) in points {
            let found = waveform.value(t);
            assert!((found - expected).abs() < 1e-12, "{kind} at {t}: {found}, not {expected}");
        }
    }

    #[test]
    fn values_are_those_of_closed_forms() {
        let (never, none) = (f64::INFINITY, f64::NAN);
        check("dc", &[3.0], none, 2.0, &[(0.0, 6.0), (1.0, 6.0)]);
        let points = [(0.0, 3.0), (0.01, -1.0), (0.005, 1.0)];
        check("sin", &[1.0, 2.0, 50.0, 0.0, 0.0, 90.0], none, 1.0, &points);
        let points = [(0.5, 0.0), (2.0, 2.0 * f64::exp(-3.0))];
        check("sin", &[0.0, 2.0, 0.25, 1.0, 3.0, 0.0], none, 1.0, &points);
        let points = [(1.9, 1.0), (2.5, 3.0), (4.0, 5.0), (7.0, 3.0), (9.0, 1.0), (12.25, 2.0)];
        check("pulse", &[1.0, 5.0, 2.0, 1.0, 2.0, 3.0, 10.0, 2.0], none, 1.0, &points);
        let points = [(17.0, 3.0), (24.0, 1.0)];
        check("pulse", &[1.0, 5.0, 2.0, 1.0, 2.0, 3.0, 10.0, 2.0], none, 1.0, &points);
        let points = [(0.0, 1.0), (1.0, 0.0)];
        check("pulse", &[0.0, 1.0, 0.0, 0.0, 0.0, 1.0, never, never], none, 1.0, &points);
        let points = [(0.5, 0.0), (1.0, 5.0), (3.9, 5.0), (5.0, 2.5), (8.0, 0.0), (11.0, 5.0)];
        check("pulse", &[0.0, 5.0, 1.0, 0.0, 2.0, 3.0, 10.0, never], none, 1.0, &points);
        // cut by its period
        let points = [(3.0, 1.0), (5.0, 0.5)];
        check("pulse", &[0.0, 1.0, 0.0, 2.0, 1.0, 9.0, 4.0, never], none, 1.0, &points);
        let points = [(0.0, 2.0), (2.0, 4.0), (3.0, 0.0), (4.0, 2.0), (9.0, 4.0)];
        check("pwl", &[1.0, 2.0, 3.0, 6.0, 3.0, 0.0, 5.0, 4.0], none, 1.0, &points);
        let points = [(0.5, 1.0), (1.5, 1.0), (2.5, 1.0)];
        check("pwl", &[0.0, 0.0, 1.0, 2.0, 2.0, 0.0], 1.0, 1.0, &points);
        let back = 1.0 + 2.0 * (f64::exp(-1.0) - f64::exp(-4.0));
        let points = [(0.0, 1.0), (3.0, 3.0 - 2.0 * f64::exp(-1.0)), (9.0, back)];
        check("exp", &[1.0, 3.0, 1.0, 2.0, 5.0, 4.0], none, 1.0, &points);
        let points = [(0.25, 1.0 + 2.0 * f64::sin(5.0 * PI + 3.0))];
        check("sffm", &[1.0, 2.0, 10.0, 3.0, 1.0], none, 1.0, &points);
        let points = [(0.5, 0.0), (2.0, 4.0)];
        check("am", &[2.0, 1.0, 0.25, 1.25, 1.0], none, 1.0, &points);
        assert!(Described::new("sin", &[1.0], none, 1.0).is_err());
        assert!(Described::new("saw", &[1.0], none, 1.0).is_err());
    }

    #[test]
    fn both_sides_of_an_edge_are_right_and_nothing_between_or_beside_them() {
        let values = [0.0, 5.0, 1.0, 0.0, 0.0, 3.0, 10.0, f64::INFINITY];
        let pulse = [Described::new("pulse", &values, f64::NAN, 1.0).unwrap()];
        let error = |t: f64, found: f64| {
            let mut sources = Sources::new(&pulse);
            sources.take(&[(2.0, 0), (t, 1)], &[5.0, found]);
            (sources.error, sources.worst)
        };
        for (t, found) in [(1.0, 0.0), (1.0, 5.0), (1.0 + 1e-15, 0.0), (2.0, 5.0)] {
            assert_eq!(error(t, found), (0.0, None));
        }
        assert_eq!(error(1.0, 11.0), (0.2, Some(0)));
        assert_eq!(error(1.0 + 1e-9, 0.0), (1.0, Some(0)));
        assert_eq!(error(2.0, 5.0 + 5e-6).1, Some(0));
        assert!(error(2.0, f64::NAN).0.is_nan());
    }

    #[test]
    fn jumps_are_listed_lap_by_lap() {
        let within = |kind: &str, values: &[f64], repeat: f64, span: [f64; 2]| {
            let mut found = Vec::new();
            let described = Described::new(kind, values, repeat, 1.0).unwrap();
            described.jumps_within(span, 9, &mut found);
            found.sort_by(f64::total_cmp);
            found
        };
        let never = f64::INFINITY;
        let pulse = [0.0, 5.0, 1.0, 0.0, 0.0, 3.0, 10.0, never];
        assert_eq!(within("pulse", &pulse, f64::NAN, [0.5, 14.5]), [1.0, 4.0, 11.0, 14.0]);
        let once = [0.0, 5.0, 1.0, 0.0, 2.0, 3.0, 10.0, 1.0];
        assert_eq!(within("pulse", &once, f64::NAN, [0.0, 50.0]), [1.0]);
        let step = [0.0, 5.0, 1.0, 0.0, 0.0, never, never, never];
        assert_eq!(within("pulse", &step, f64::NAN, [0.0, 50.0]), [1.0]);
        let lines = [0.0, 1.0, 2.0, 1.0, 2.0, 3.0, 4.0, 1.0];
        assert_eq!(within("pwl", &lines, 0.0, [1.0, 11.0]), [2.0, 6.0, 10.0]);
        assert_eq!(within("pwl", &lines, f64::NAN, [1.0, 11.0]), [2.0]);
    }

    #[test]
    fn a_run_goes_on_with_the_value_after_an_edge_without_length() {
        let outside = |rise: f64, t: f64, found: f64| {
            let values = [0.0, 5.0, 1.0, rise, 0.0, 3.0, 10.0, f64::INFINITY];
            let pulse = Described::new("pulse", &values, f64::NAN, 1.0).unwrap();
            pulse.outside_after(t, found)
        };
        assert_eq!([outside(0.0, 1.0, 5.0), outside(0.0, 1.0, 0.0)], [0.0, 5.0]);
        // an instant before the edge by rounding is the edge
        assert_eq!([outside(0.0, 1.0 - 1e-15, 5.0), outside(0.0, 1.0 - 1e-15, 0.0)], [0.0, 5.0]);
        // 1 fs and 1 s are ramps
        assert!([1e-15, 1.0].into_iter().all(|rise| outside(rise, 1.0, 0.0) <= 0.0));
        // a jump behind a ramp is one: but for what the ramp may move within the rounding of the instant
        assert!((outside(1.0, 5.0, 5.0) - 5.0).abs() < 1e-12);
    }
}

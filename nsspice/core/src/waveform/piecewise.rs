//! PULSE and PWL as one law: a polygon, possibly repeated, possibly with vertical edges.

use super::{Breakpoint, Side, INSTANT};

/// A polygon through `(time, value)`; two equal times make an ideal edge.
#[derive(Clone, Debug)]
pub struct PiecewiseLinear {
    times: Vec<f64>,
    values: Vec<f64>,
    repeat: Option<Repeat>,
}

/// The interval `[start, start + period]` is repeated `count` times, then the last value holds.
#[derive(Clone, Copy, Debug)]
struct Repeat {
    start: f64,
    period: f64,
    count: f64,
}

/// Rounding of a sum of times of this size: two instants closer than this are one.
fn slack(t: f64) -> f64 {
    INSTANT * t.abs()
}

impl PiecewiseLinear {
    /// `v1 v2 delay rise fall width period count`; a pulse longer than its period is cut.
    pub fn pulse(p: &[f64], scale: f64) -> Self {
        let (v1, v2, delay, rise, fall, width, period, count) =
            (p[0] * scale, p[1] * scale, p[2], p[3], p[4], p[5], p[6], p[7]);
        let mut breakpoints =
            vec![(0.0, v1), (rise, v2), (rise + width, v2), (rise + width + fall, v1)];
        breakpoints.retain(|c| c.0.is_finite());
        let repeat =
            (period.is_finite() && period > 0.0).then_some(Repeat { start: delay, period, count });
        if repeat.is_some() {
            cut(&mut breakpoints, period);
        }
        PiecewiseLinear {
            times: breakpoints.iter().map(|c| delay + c.0).collect(),
            values: breakpoints.iter().map(|c| c.1).collect(),
            repeat,
        }
    }

    /// `t1 v1 t2 v2 ...`; `repeat` is the time from which the curve starts again, NaN for none.
    pub fn pwl(p: &[f64], repeat: f64, scale: f64) -> Result<Self, String> {
        if p.is_empty() || p.len() % 2 == 1 {
            return Err("pwl takes pairs of time and value".into());
        }
        let times: Vec<f64> = p.iter().step_by(2).copied().collect();
        if times.windows(2).any(|w| w[1] < w[0]) {
            return Err("pwl times must not decrease".into());
        }
        let end = times[times.len() - 1];
        let repeat = (repeat.is_finite() && end > repeat).then_some(Repeat {
            start: repeat,
            period: end - repeat,
            count: f64::INFINITY,
        });
        let values = p.iter().skip(1).step_by(2).map(|v| v * scale).collect();
        Ok(PiecewiseLinear { times, values, repeat })
    }

    /// Time after which it repeats [s]; infinite if it does not.
    pub fn period(&self) -> f64 {
        self.repeat.map_or(f64::INFINITY, |repeat| repeat.period)
    }

    /// Value at `t`; within rounding of an edge the side decides.
    pub fn value(&self, t: f64, side: Side) -> f64 {
        let eps = slack(t);
        let Some(Repeat { start, period, count }) = self.repeat else {
            return self.polygon(t, eps, side);
        };
        let mut lap = ((t - start) / period).floor();
        let mut local = t - start - lap * period; // in [0, period)
        match side {
            Side::Right if period - local <= eps => {
                lap += 1.0;
                local = 0.0;
            }
            Side::Left if local <= eps && lap > 0.0 => {
                lap -= 1.0;
                local = period;
            }
            _ => {}
        }
        if lap < 0.0 {
            self.polygon(t, eps, side)
        } else if lap >= count {
            self.polygon(start, 0.0, Side::Left)
        } else {
            self.polygon(start + local, eps, side)
        }
    }

    /// Value and slope of the line that begins at `t` or goes through it.
    pub fn line(&self, t: f64) -> (f64, f64) {
        let eps = slack(t);
        let Some(Repeat { start, period, count }) = self.repeat else {
            return (self.polygon(t, eps, Side::Right), self.slope(t, eps));
        };
        let mut lap = ((t - start) / period).floor();
        let mut local = t - start - lap * period;
        if period - local <= eps {
            lap += 1.0;
            local = 0.0;
        }
        if lap < 0.0 {
            (self.polygon(t, eps, Side::Right), self.slope(t, eps))
        } else if lap >= count {
            (self.polygon(start, 0.0, Side::Left), 0.0)
        } else {
            let t = start + local;
            (self.polygon(t, eps, Side::Right), self.slope(t, eps))
        }
    }

    fn slope(&self, t: f64, eps: f64) -> f64 {
        let k = self.times.partition_point(|&s| s <= t + eps);
        if k == 0 || k == self.times.len() {
            return 0.0;
        }
        let length = self.times[k] - self.times[k - 1];
        if length > 0.0 {
            (self.values[k] - self.values[k - 1]) / length
        } else {
            0.0
        }
    }

    fn polygon(&self, t: f64, eps: f64, side: Side) -> f64 {
        let (times, values) = (&self.times, &self.values);
        // k = number of vertices that lie before t (Left) or not after t (Right)
        let k = match side {
            Side::Left => times.partition_point(|&s| s < t - eps),
            Side::Right => times.partition_point(|&s| s <= t + eps),
        };
        if k == 0 {
            return values[0];
        }
        if k == times.len() {
            return values[k - 1];
        }
        let (t0, t1, v0, v1) = (times[k - 1], times[k], values[k - 1], values[k]);
        if t1 - t0 <= 0.0 {
            return v1;
        }
        let x = ((t - t0) / (t1 - t0)).clamp(0.0, 1.0);
        v0 + (v1 - v0) * x
    }

    /// The first vertex later than `t` (by more than rounding).
    pub fn next_breakpoint(&self, t: f64) -> Option<Breakpoint> {
        self.next_vertex(t).map(|time| self.breakpoint(time))
    }

    /// Its time [s].
    pub fn next_vertex(&self, t: f64) -> Option<f64> {
        let after = t + slack(t);
        let Some(Repeat { start, period, count }) = self.repeat else {
            let k = self.times.partition_point(|&s| s <= after);
            return self.times.get(k).copied();
        };
        if let Some(&first) = self.times.iter().find(|&&s| s > after && s < start) {
            return Some(first);
        }
        let mut lap = ((t - start) / period).floor().max(0.0);
        for _ in 0..2 {
            if lap > count || (lap == count && count == 0.0) {
                return None;
            }
            let base = lap * period;
            let candidates = self.times.iter().filter(|&&s| s >= start).copied();
            for s in std::iter::once(start).chain(candidates).chain(std::iter::once(start + period))
            {
                if s + base > after && (lap < count || s <= start) {
                    return Some(s + base);
                }
            }
            lap += 1.0;
        }
        None
    }

    /// Describes the breakpoint at global time `time`.
    fn breakpoint(&self, time: f64) -> Breakpoint {
        let (left, right) = (self.value(time, Side::Left), self.value(time, Side::Right));
        let size = self.values.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        // an edge of a few ulp is rounding of the interpolation, not an edge
        Breakpoint { time, jump: (left - right).abs() > 64.0 * f64::EPSILON * size }
    }
}

/// Cuts a polygon that starts at 0 at time `period`.
fn cut(breakpoints: &mut Vec<(f64, f64)>, period: f64) {
    let Some(k) = breakpoints.iter().position(|c| c.0 > period) else {
        return;
    };
    let ((t0, v0), (t1, v1)) = (breakpoints[k - 1], breakpoints[k]);
    breakpoints.truncate(k);
    breakpoints.push((period, v0 + (v1 - v0) * (period - t0) / (t1 - t0)));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn breakpoints(w: &PiecewiseLinear, until: f64) -> Vec<(f64, bool)> {
        let mut out = Vec::new();
        let mut t = 0.0;
        while let Some(c) = w.next_breakpoint(t) {
            if c.time > until {
                break;
            }
            assert!(c.time > t);
            out.push((c.time, c.jump));
            t = c.time;
        }
        out
    }

    #[test]
    fn ideal_pulse_has_both_limits_at_its_edges() {
        let w = PiecewiseLinear::pulse(&[0.0, 5.0, 1e-6, 0.0, 0.0, 2e-6, 5e-6, f64::INFINITY], 1.0);
        for k in 0..1000 {
            let t = 1e-6 + k as f64 * 5e-6;
            assert_eq!((w.value(t, Side::Left), w.value(t, Side::Right)), (0.0, 5.0), "lap {k}");
            let t = t + 2e-6;
            assert_eq!((w.value(t, Side::Left), w.value(t, Side::Right)), (5.0, 0.0), "lap {k}");
        }
        let list = breakpoints(&w, 11.5e-6);
        assert_eq!(list.len(), 5);
        assert!(list.iter().all(|c| c.1));
    }

    #[test]
    fn slopes_look_to_the_right() {
        let w = PiecewiseLinear::pwl(&[1.0, 0.0, 2.0, 3.0, 4.0, 3.0], f64::NAN, 2.0).unwrap();
        let slopes = [0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 9.0].map(|t| w.line(t).1);
        assert_eq!(slopes, [0.0, 6.0, 6.0, 0.0, 0.0, 0.0, 0.0]);
        let w = PiecewiseLinear::pulse(&[0.0, 5.0, 1.0, 0.5, 0.5, 1.0, 4.0, f64::INFINITY], 1.0);
        let slopes = [0.5, 1.25, 2.0, 2.75, 5.25].map(|t| w.line(t).1);
        assert_eq!(slopes, [0.0, 10.0, 0.0, -10.0, 10.0]);
    }

    #[test]
    fn a_train_ends_after_its_count() {
        let w = PiecewiseLinear::pulse(&[0.0, 1.0, 0.0, 0.1, 0.1, 0.3, 1.0, 2.0], 1.0);
        assert_eq!(w.value(0.3, Side::Right), 1.0);
        assert_eq!(w.value(1.3, Side::Right), 1.0);
        assert_eq!(w.value(2.3, Side::Right), 0.0);
        assert!(breakpoints(&w, 100.0).last().unwrap().0 <= 2.0);
    }

    #[test]
    fn a_pulse_longer_than_its_period_is_cut() {
        let w = PiecewiseLinear::pulse(&[0.0, 1.0, 0.0, 1.0, 0.0, 9.0, 0.5, f64::INFINITY], 1.0);
        assert!((w.value(0.5, Side::Left) - 0.5).abs() < 1e-15);
        assert_eq!(w.value(0.5, Side::Right), 0.0);
        assert_eq!(breakpoints(&w, 1.1), vec![(0.5, true), (1.0, true)]);
    }

    #[test]
    fn a_pwl_curve_repeats_from_its_mark() {
        let w = PiecewiseLinear::pwl(&[0.0, 0.0, 1.0, 1.0, 2.0, 1.0, 3.0, 0.0], 1.0, 2.0).unwrap();
        assert_eq!(w.value(0.5, Side::Right), 1.0);
        assert_eq!(w.value(2.5, Side::Right), 1.0);
        assert_eq!(w.value(4.5, Side::Right), 1.0); // 4.5 is 2.5 of the second lap
        assert_eq!((w.value(3.0, Side::Left), w.value(3.0, Side::Right)), (0.0, 2.0));
        assert_eq!(breakpoints(&w, 5.0).len(), 5);
    }

    #[test]
    fn a_single_pulse_without_period_stays_low() {
        let inf = f64::INFINITY;
        let w = PiecewiseLinear::pulse(&[1.0, 2.0, 1.0, 0.0, 0.0, inf, inf, inf], 1.0);
        assert_eq!((w.value(0.0, Side::Right), w.value(1e9, Side::Right)), (1.0, 2.0));
        assert_eq!(breakpoints(&w, 1e12), vec![(1.0, true)]);
    }
}

//! The search for the first guard that fails, interval by interval.
//!
//! On each interval the cubic Hermite polynomial of a guard, together with a bound of its fourth
//! derivative, proves that the guard stays positive or that it has exactly one root; everything else
//! halves the interval. No crossing is missed, up to rounding.

use crate::modewise::functions::inputs::resolution;
use crate::modewise::functions::terms::{Point, Term};
use crate::modewise::segments::bundle::{Bundle, Looks};
use crate::modewise::segments::trajectory::Trajectory;

/// How a segment ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// all guards hold up to the horizon
    Horizon,
    /// some guards fail; see `crossing`
    Crossing,
}

/// Intervals walked without a look at the clock.
const PATIENCE: u64 = 20_000;

/// Guards evaluated at a time: often an early one decides already that the interval is too long.
const GROUP: usize = 16;

/// After an interval that served the next one is so many times as long: fast motions have decayed further, and an
/// interval that is too long costs one look.
pub(in crate::modewise) const GROWTH: f64 = 3.0;

/// Work space of the event_search.
#[derive(Default)]
pub struct EventSearch {
    /// guards that fail at the end
    pub crossing: Vec<usize>,
    from: Point,
    to: Point,
    probe: Point,
    /// guards at both ends of the interval, with bounds of their fourth derivatives
    old: Looks,
    new: Looks,
    second: Vec<f64>,
    fourth: Vec<f64>,
    falling: Vec<usize>,
    roots: Vec<(f64, usize)>,
    /// how low a guard has dipped between its values at both ends of an interval, as a part of them, and when
    lowest: (f64, f64),
    /// intervals looked at
    pub intervals: u64,
}

#[derive(PartialEq)]
enum Verdict {
    Holds,
    Falls,
    Unclear,
}

impl EventSearch {
    /// Walks from 0 to `horizon`; returns the time reached. `clear[j]`: guard j is known to hold up
    /// to that time; `start` is the start of the path. `begin` is the absolute time of the start, for the resolution of time.
    #[allow(clippy::too_many_arguments)] // one per ingredient
    pub fn walk(
        &mut self,
        path: &Trajectory,
        start: &Point,
        guards: &Bundle,
        noise: &[f64],
        clear: &[f64],
        horizon: f64,
        begin: f64,
    ) -> (f64, Ending) {
        self.crossing.clear();
        self.lowest = (f64::INFINITY, f64::NAN);
        self.to.t = f64::NAN;
        let count = guards.count;
        if count == 0 || horizon <= 0.0 {
            return (horizon.max(0.0), Ending::Horizon);
        }
        self.old.resize(count);
        self.new.resize(count);
        let resolution = resolution(begin.abs() + horizon).max(f64::MIN_POSITIVE);
        self.from.copy_from(start);
        path.bounds(&self.from, &self.from, &mut self.second, &mut self.fourth);
        guards.look(0..count, &self.from, &self.fourth, &mut self.old);
        let limit = self.intervals + PATIENCE;
        let mut t = 0.0;
        let mut h = self.first_step(horizon);
        loop {
            let end = if t + 1.01 * h >= horizon { horizon } else { t + h };
            let length = end - t;
            self.intervals += 1;
            if self.intervals >= limit && t > 0.0 {
                return (t, Ending::Horizon); // not all of it, but the caller gets a look
            }
            path.at(end, &mut self.to);
            path.bounds(&self.from, &self.to, &mut self.second, &mut self.fourth);
            let forced = length <= 4.0 * resolution;
            self.falling.clear();
            let mut unclear = false;
            for j in 0..count {
                if j % GROUP == 0 {
                    let group = j..count.min(j + GROUP);
                    guards.look(group, &self.to, &self.fourth, &mut self.new);
                }
                fault!("third_guard_missed" => if j % 3 == 2 { continue; });
                if end <= clear[j] {
                    continue;
                }
                match self.judge(path, guards, j, length, noise[j]) {
                    Verdict::Holds => {}
                    Verdict::Falls => self.falling.push(j),
                    Verdict::Unclear if forced => {
                        if self.new.value[j] < -noise[j] {
                            self.falling.push(j);
                        }
                    }
                    Verdict::Unclear => {
                        unclear = true;
                        break;
                    }
                }
            }
            if unclear {
                h = if t == 0.0 { 0.25 * length } else { 0.5 * length };
                continue;
            }
            if !self.falling.is_empty() {
                let root = self.earliest(path, guards, t, end, resolution);
                fault!("event_late_1e-2" => return (root + 1e-2 * (end - root), Ending::Crossing));
                fault!("event_late_1e-4" => return (root + 1e-4 * (end - root), Ending::Crossing));
                fault!("event_late_1e-6" => return (root + 1e-6 * (end - root), Ending::Crossing));
                fault!("event_early_1e-3" => return (root - 1e-3 * (root - t), Ending::Crossing));
                fault!("event_at_interval_end" => return (end, Ending::Crossing));
                fault!("event_halfway" => return (0.5 * (t + root), Ending::Crossing));
                return (root, Ending::Crossing);
            }
            self.note_dips(clear, t, length);
            if end >= horizon {
                return (horizon, Ending::Horizon);
            }
            t = end;
            std::mem::swap(&mut self.from, &mut self.to);
            std::mem::swap(&mut self.old, &mut self.new);
            h = GROWTH * length;
        }
    }

    /// When a guard came nearest to zero between the ends of intervals, if any has been lower there than at both.
    pub fn nearest(&self) -> Option<f64> {
        self.lowest.0.is_finite().then_some(self.lowest.1)
    }

    /// Looks for the guard that dips deepest in an interval of the length `h` that begins at `t`.
    fn note_dips(&mut self, clear: &[f64], t: f64, h: f64) {
        for j in (0..clear.len()).filter(|&j| clear[j] <= t) {
            let [g0, g1, d0, d1] = self.ends(j);
            let (d0, d1) = (h * d0, h * d1);
            let low = (g0 + d0 / 3.0).min(g1 - d1 / 3.0);
            if d0 >= 0.0 || d1 <= 0.0 || low >= self.lowest.0 * g0.abs().max(g1.abs()) {
                continue;
            }
            // the minimum of the Hermite polynomial g0 + s (d0 + s (c2 + s c3))
            let (c2, c3) = (3.0 * (g1 - g0) - 2.0 * d0 - d1, 2.0 * (g0 - g1) + d0 + d1);
            let s = -d0 / (c2 + (c2 * c2 - 3.0 * c3 * d0).max(0.0).sqrt());
            if s > 0.0 && s < 1.0 {
                self.lowest = (low / g0.abs().max(g1.abs()), t + h * s);
            }
        }
    }

    /// The terms at the time reached, if they have been evaluated there.
    pub fn reached(&mut self, time: f64) -> Option<&mut Point> {
        (self.to.t == time).then_some(&mut self.to)
    }

    /// A first interval on which most guards can be judged: of a rising guard somewhat less than half a
    /// swing, so that its fall lies within the second one.
    fn first_step(&self, horizon: f64) -> f64 {
        let mut h = horizon;
        let guards = self.old.value.iter().zip(&self.old.slope).zip(&self.old.bound);
        for ((value, slope), &m4) in guards {
            if m4 == 0.0 {
                continue;
            }
            // most guards do not shorten it: roots are drawn of those that do
            let cube = m4 * h * h * h;
            if 7.0 * slope.abs() >= cube || 200.0 * value.abs() >= cube * h {
                continue;
            }
            let by_slope = (7.0 * slope.abs() / m4).cbrt();
            let by_value = (200.0 * value.abs() / m4).sqrt().sqrt();
            h = h.min(by_slope.max(by_value).max(1e-9 * horizon));
        }
        h
    }

    /// Values at both ends of the interval, then slopes.
    fn ends(&self, j: usize) -> [f64; 4] {
        [self.old.value[j], self.new.value[j], self.old.slope[j], self.new.slope[j]]
    }

    fn judge(&self, path: &Trajectory, guards: &Bundle, j: usize, h: f64, noise: f64) -> Verdict {
        let [g0, g1, d0, d1] = self.ends(j);
        let m4 = self.new.bound[j];
        let (b1, b2) = (g0 + h * d0 / 3.0, g1 - h * d1 / 3.0);
        let error = m4 * h * h * h * h / 384.0;
        fault!("guards_at_ends_only" => if g1 >= -noise { return Verdict::Holds; });
        if g0.min(g1).min(b1).min(b2) - error >= -noise {
            return Verdict::Holds;
        }
        if g0 >= -noise && d0 > 0.0 && d0 >= 0.5 * h * guards.bound(j, &self.second) {
            return Verdict::Holds;
        }
        if g1 < -noise {
            let steepest = (b1 - g0).max(b2 - b1).max(g1 - b2) * 3.0 / h;
            if steepest + 0.0081 * m4 * h * h * h < 0.0 {
                return Verdict::Falls;
            }
        }
        if self.holds_without_fast(path, guards, j, h, noise) {
            return Verdict::Holds;
        }
        Verdict::Unclear
    }

    /// Fast terms of small size cannot do harm: they are bounded by their amplitude, and the
    /// polynomial is made for the rest.
    fn holds_without_fast(
        &self,
        path: &Trajectory,
        guards: &Bundle,
        j: usize,
        h: f64,
        noise: f64,
    ) -> bool {
        let factor = &guards.factor[j * path.slots..(j + 1) * path.slots];
        let [mut g0, mut g1, mut d0, mut d1] = self.ends(j);
        let (mut m4, mut loss) = (0.0, 0.0);
        for (k, placed) in path.terms.iter().enumerate() {
            let fast = match placed.term {
                Term::Exp { rate } => (rate.re * rate.re + rate.im * rate.im) * h * h >= 4.0,
                _ => false,
            };
            for (s, f) in factor.iter().enumerate().skip(placed.slot).take(placed.width) {
                if !fast {
                    m4 += f.abs() * self.fourth[s];
                    continue;
                }
                loss += f.abs() * self.from.envelope[k].max(self.to.envelope[k]);
                g0 -= f * self.from.value[s];
                g1 -= f * self.to.value[s];
                d0 -= f * self.from.slope[s];
                d1 -= f * self.to.slope[s];
            }
        }
        let least = g0.min(g1).min(g0 + h * d0 / 3.0).min(g1 - h * d1 / 3.0);
        loss > 0.0 && least - loss - m4 * h * h * h * h / 384.0 >= -noise
    }

    /// The earliest root of the falling guards; those within the resolution of time go with it.
    fn earliest(
        &mut self,
        path: &Trajectory,
        guards: &Bundle,
        t: f64,
        end: f64,
        resolution: f64,
    ) -> f64 {
        self.roots.clear();
        for k in 0..self.falling.len() {
            let j = self.falling[k];
            let root = self.root(path, guards, j, t, end, resolution);
            self.roots.push((root, j));
        }
        let first = self.roots.iter().fold(f64::INFINITY, |m, r| m.min(r.0));
        let same = first + resolution;
        self.crossing.extend(self.roots.iter().filter(|r| r.0 <= same).map(|r| r.1));
        self.crossing.sort_unstable();
        fault!("one_crossing_alone" => self.crossing.truncate(1));
        first
    }

    /// The root of a guard that falls throughout `[t, end]`.
    fn root(
        &mut self,
        path: &Trajectory,
        guards: &Bundle,
        j: usize,
        t: f64,
        end: f64,
        resolution: f64,
    ) -> f64 {
        let h = end - t;
        let [g0, g1, d0, d1] = self.ends(j);
        let (d0, d1) = (h * d0, h * d1);
        if g0 <= 0.0 {
            return t;
        }
        // root of the Hermite polynomial g0 + s (d0 + s (c2 + s c3)) on [0, 1]
        let c2 = 3.0 * (g1 - g0) - 2.0 * d0 - d1;
        let c3 = 2.0 * (g0 - g1) + d0 + d1;
        let (mut low, mut high, mut s) = (0.0, 1.0, g0 / (g0 - g1));
        for _ in 0..30 {
            let f = g0 + s * (d0 + s * (c2 + s * c3));
            if f > 0.0 {
                low = s;
            } else {
                high = s;
            }
            let next = s - f / (d0 + s * (2.0 * c2 + 3.0 * s * c3));
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            let change = (next - s).abs();
            s = next;
            if change < 1e-9 {
                break;
            }
        }
        let (mut low, mut high) = (t, end);
        let mut x = t + h * s;
        let mut last = f64::INFINITY;
        for _ in 0..60 {
            path.at(x, &mut self.probe);
            let (f, d) = (guards.value(j, &self.probe), guards.slope(j, &self.probe));
            if f > 0.0 {
                low = x;
            } else {
                high = x;
            }
            let newton = x - f / d;
            let inside = newton >= low && newton <= high;
            let next = if inside { newton } else { 0.5 * (low + high) };
            let change = (next - x).abs();
            x = next;
            if change <= resolution || (inside && change > 0.5 * last) {
                break;
            }
            last = if inside { change } else { f64::INFINITY };
        }
        x
    }
}

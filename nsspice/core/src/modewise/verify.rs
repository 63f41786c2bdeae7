//! Is a mode the right one from here on?  Consistency, impulses, values, and what follows immediately.

use super::bundle::{Bundle, Looks};
use super::inputs::Segment;
use super::mode::{Mode, Watch};
use super::terms::Point;
use super::trajectory::Trajectory;
use crate::dense::{dot, norm};
use crate::rounding::OF_SOLUTION;

/// Largest values so far, against which rounding is judged.
#[derive(Clone, Debug, Default)]
pub struct Scale {
    /// norm of the energy coordinates
    pub a: f64,
    /// of each of `[1; inputs]`
    pub v: Vec<f64>,
    /// of their rates
    pub rate: Vec<f64>,
    /// factor on all noise, above 1 where a mode had to be accepted within it
    pub widened: f64,
}

/// Squares of numbers below this lose digits.
const SMALL: f64 = 1e-140;

impl Scale {
    /// Takes note of a state.
    pub fn see_state(&mut self, a: &[f64]) {
        // squares of what is left of a decay underflow
        let largest = a.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let unit = if largest > SMALL || largest == 0.0 { 1.0 } else { largest };
        let size = unit * a.iter().map(|x| (x / unit).powi(2)).sum::<f64>().sqrt();
        if size > self.a {
            self.a = size;
        }
    }

    /// Takes note of the inputs of a segment of the given length.
    pub fn see_inputs(&mut self, segment: &Segment, length: f64) {
        for (i, v) in self.v.iter_mut().enumerate() {
            let size = segment.now[i].abs().max((segment.now[i] + segment.rate[i] * length).abs());
            let size = if segment.slope[i] == 0.0 { segment.now[i].abs() } else { size };
            *v = v.max(size);
            self.rate[i] = self.rate[i].max(segment.rate[i].abs());
        }
        for tone in &segment.tones {
            for i in [tone.index, tone.index + 1] {
                self.v[i] = self.v[i].max(tone.start.abs());
                self.rate[i] = self.rate[i].max(tone.start.abs() * tone.rate.abs());
            }
        }
    }
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub enum Finding {
    /// the mode holds
    Good,
    /// some law cannot hold in it at all
    Inconsistent,
    /// entering it needs an impulse of the wrong sign; how wrong, relative to the tolerance
    Impulse(f64),
    /// a guard is negative immediately, or soon: which, how much in units of its noise
    Guard(usize, f64),
}

/// Work space.
#[derive(Default)]
pub struct Verifier {
    /// guards along the trajectory
    pub guards: Bundle,
    /// their noise
    pub noise: Vec<f64>,
    /// up to when each is known to hold
    pub clear: Vec<f64>,
    /// guards that vanish at the start
    pub zeros: Vec<usize>,
    /// guards of which nothing is known yet
    open: Vec<usize>,
    /// switches whose control lies beyond the threshold
    pub thrown: Vec<usize>,
    /// switches that are sampled
    pub sampled: Vec<bool>,
    /// whether these look at their controls now
    pub looking: bool,
    /// how far the control of each of them was from its threshold where they looked last
    pub seen: Vec<f64>,
    /// switches whose control stays at the threshold, with what rounding leaves of it
    pub resting: Vec<(usize, f64)>,
    /// guards that are negative at the start
    pub negative: Vec<usize>,
    /// values and slopes of the guards at the start, and how large their terms become
    looks: Looks,
    reaches: Vec<f64>,
    /// start of the trajectory
    pub start: Point,
    probe: Point,
    second: Vec<f64>,
    fourth: Vec<f64>,
    joint: Vec<f64>,
}

/// Does a combination of inputs vanish during the whole segment?
fn vanishes(row: &[f64], bound: &[f64], segment: &Segment) -> bool {
    let still = |x: &[f64]| {
        let size: f64 = bound.iter().zip(x).map(|(b, x)| b * x.abs()).sum();
        dot(row, x).abs() <= 1e-11 * size
    };
    still(&segment.level)
        && still(&segment.slope)
        && segment.tones.iter().all(|tone| {
            let (s, c) = (tone.index, tone.index + 1);
            // tones of one rate were merged into one input
            row[s].hypot(row[c]) <= 1e-11 * (bound[s] + bound[c])
        })
        && segment.decays.iter().all(|d| row[d.index].abs() <= 1e-11 * bound[d.index])
}

impl Verifier {
    /// Tries a mode from energy coordinates `a`. If it holds, `path`, `guards`, `noise` and `clear`
    /// are ready for the event_search.
    pub fn verify(
        &mut self,
        mode: &Mode,
        a: &[f64],
        segment: &Segment,
        horizon: f64,
        scale: &mut Scale,
        path: &mut Trajectory,
    ) -> Finding {
        self.zeros.clear();
        self.thrown.clear();
        self.resting.clear();
        self.negative.clear();
        for r in 0..mode.consistency.rows {
            fault!("consistency_ignored" => break);
            if !vanishes(mode.consistency.row(r), mode.consistency_bound.row(r), segment) {
                return Finding::Inconsistent;
            }
        }
        let worst = self.impulses(mode, a, segment, scale);
        if worst > 1.0 {
            return Finding::Impulse(worst);
        }
        path.begin(mode, a, segment, horizon);
        path.bundle(&mode.guards.rows, segment, &mut self.guards);
        path.at(0.0, &mut self.start);
        let count = self.guards.count;
        path.reaches(horizon, &mut self.reaches);
        self.looks.resize(count);
        self.guards.look(0..count, &self.start, &self.reaches, &mut self.looks);
        self.measure_noise(mode, scale);
        self.clear.clear();
        self.clear.resize(count, 0.0);
        let mut worst = (0usize, 0.0f64);
        for &(j, pair) in &mode.guards.held {
            self.clear[j] = horizon;
            let carries = self.looks.value[pair] > self.noise[pair];
            if let (Watch::Switch(s), false) = (mode.guards.watch[j], carries) {
                if self.looks.value[j] < -self.noise[j] {
                    self.thrown.push(s);
                }
            }
        }
        if self.sampled.contains(&true) {
            self.sample(mode, horizon);
        }
        for j in 0..count {
            let (g, noise) = (self.looks.value[j], self.noise[j]);
            fault!("switch_guards_missed" => if matches!(mode.guards.watch[j], Watch::Switch(_)) {
                self.clear[j] = horizon;
            });
            if g > noise || self.clear[j] > 0.0 {
                continue;
            }
            #[cfg(feature = "faults")]
            if g < -noise && matches!(mode.guards.watch[j], Watch::Pair(_)) {
                let slack = mode.guards.slack[j];
                let ignored = fault!("mode_unverified", false, true)
                    || !slack && fault!("current_signs_ignored", false, true)
                    || slack && fault!("voltage_signs_ignored", false, true);
                if ignored {
                    self.clear[j] = horizon;
                    continue;
                }
            }
            // a steep ramp that has just risen through zero, but for the rounding of that instant
            let blur = segment.resolution * self.looks.slope[j];
            if g < -noise && g >= -noise - blur {
                self.noise[j] += blur;
                self.zeros.push(j);
                continue;
            }
            if g < -noise || g.is_nan() {
                match mode.guards.watch[j] {
                    Watch::Switch(s) => self.thrown.push(s),
                    Watch::Pair(_) => {
                        self.negative.push(j);
                        let much = if g.is_nan() { f64::INFINITY } else { -g / noise };
                        if much > worst.1 {
                            worst = (j, much);
                        }
                    }
                }
                continue;
            }
            self.zeros.push(j);
        }
        if worst.1 > 0.0 {
            return Finding::Guard(worst.0, worst.1);
        }
        self.rise(mode, path, horizon)
    }

    /// Sampled switches turn when they look, and are not watched in between.
    fn sample(&mut self, mode: &Mode, horizon: f64) {
        for (j, watch) in mode.guards.watch.iter().enumerate() {
            let Watch::Switch(s) = *watch else { continue };
            if !self.sampled[s] || self.clear[j] > 0.0 {
                continue;
            }
            self.clear[j] = horizon;
            if self.looking {
                self.seen[s] = self.looks.value[j];
            }
            if self.looking && self.looks.value[j] < -self.noise[j] {
                self.thrown.push(s);
            }
        }
    }

    /// The worst impulse of the wrong sign, in units of its tolerance.
    pub fn impulses(&mut self, mode: &Mode, a: &[f64], segment: &Segment, scale: &Scale) -> f64 {
        let Some(impulses) = &mode.impulses else {
            return 0.0;
        };
        self.joint.clear();
        self.joint.extend_from_slice(a);
        self.joint.extend_from_slice(&segment.now);
        let mut worst = 0.0f64;
        for &i in &impulses.pairs {
            let row = impulses.guards.row(i);
            let value = dot(row, &self.joint);
            fault!("impulse_signs_ignored" => break);
            #[cfg(feature = "faults")]
            let value = fault!("impulse_signs_reversed", value, -value);
            if value < 0.0 {
                let bound = impulses.bounds.row(i);
                let (head, tail) = bound.split_at(a.len());
                let size = norm(head) * scale.a + dot(tail, &scale.v);
                worst = worst.max(-value / (1e-11 * scale.widened.max(1.0) * size));
            }
        }
        worst
    }

    fn measure_noise(&mut self, mode: &Mode, scale: &Scale) {
        self.noise.clear();
        let mut floor = [0.0f64; 2]; // of multipliers and of slacks
        let widened = scale.widened.max(1.0);
        for (j, size) in mode.guards.sizes.iter().enumerate() {
            let inputs: f64 =
                mode.guards.rows.v.row(j).iter().zip(&scale.v).map(|(g, v)| g.abs() * v).sum();
            let rates: f64 =
                mode.guards.rows.d.row(j).iter().zip(&scale.rate).map(|(g, v)| g.abs() * v).sum();
            // what the sum of terms may lose by itself
            let sum = self.looks.bound[j];
            let whole = size.x * scale.a + inputs + rates;
            let kind = usize::from(mode.guards.slack[j]);
            floor[kind] = floor[kind].max(1e-15 * whole * widened);
            let noise = OF_SOLUTION * whole + 2e-15 * size.bound * scale.a + 4e-15 * sum;
            #[cfg(feature = "faults")]
            let noise = fault!("guards_ignored_1e-8", noise, noise.max(1e-8 * whole));
            #[cfg(feature = "faults")]
            let noise = fault!("guards_ignored_1e-4", noise, noise.max(1e-4 * whole));
            self.noise.push((noise * widened).max(f64::MIN_POSITIVE));
        }
        for (noise, &slack) in self.noise.iter_mut().zip(&mode.guards.slack) {
            *noise = noise.max(floor[usize::from(slack)]);
        }
    }

    /// Guards that vanish at the start have to rise first: notes up to when they are known to.
    fn rise(&mut self, mode: &Mode, path: &Trajectory, horizon: f64) -> Finding {
        self.open.clear();
        self.resting.extend(mode.guards.idle.iter().map(|&s| (s, 0.0)));
        fault!("first_slope_ignored" => return Finding::Good);
        if self.zeros.is_empty() {
            return Finding::Good;
        }
        path.bounds(&self.start, &self.start, &mut self.second, &mut self.fourth);
        for k in 0..self.zeros.len() {
            let j = self.zeros[k];
            let slope = self.looks.slope[j];
            // until then the slope decides
            let until = (slope.abs() / self.guards.bound(j, &self.second)).min(horizon);
            let change = 0.5 * slope.abs() * until;
            if slope != 0.0 && change > 4.0 * self.noise[j] {
                if slope < 0.0 && matches!(mode.guards.watch[j], Watch::Pair(_)) {
                    return Finding::Guard(j, change / self.noise[j]);
                }
            } else {
                self.open.push(j);
            }
        }
        if self.open.is_empty() {
            return Finding::Good;
        }
        // the first value outside the noise decides
        let steps =
            ((mode.fastest * horizon).max(1.0).log2() + 10.0).ceil().clamp(1.0, 80.0) as i32;
        for k in (0..=steps).rev() {
            let t = horizon * f64::from(-k).exp2();
            path.at(t, &mut self.probe);
            let mut at = 0;
            while at < self.open.len() {
                let j = self.open[at];
                let (g, noise) = (self.guards.value(j, &self.probe), self.noise[j]);
                if g.abs() <= noise {
                    at += 1;
                    continue;
                }
                if g < 0.0 && matches!(mode.guards.watch[j], Watch::Pair(_)) {
                    return Finding::Guard(j, -g / noise);
                }
                self.clear[j] = if g > 0.0 { t } else { 0.0 };
                self.open.swap_remove(at);
            }
            if self.open.is_empty() {
                return Finding::Good;
            }
        }
        for &j in &self.open {
            self.clear[j] = horizon;
            if let Watch::Switch(s) = mode.guards.watch[j] {
                self.resting.push((s, self.noise[j]));
            }
        }
        Finding::Good
    }
}

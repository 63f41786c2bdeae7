//! Is a mode the right one from here on?  Consistency, impulses, values, and what follows immediately.

use crate::dense::{dot, norm};
use crate::modewise::functions::inputs::Segment;
use crate::modewise::functions::terms::Point;
use crate::modewise::modes::mode::{Mode, Watch};
use crate::modewise::segments::bundle::{Bundle, Looks};
use crate::modewise::segments::trajectory::Trajectory;
use crate::rounding::OF_SOLUTION;

/// Largest values so far, against which states and jumps are judged.
#[derive(Clone, Debug, Default)]
pub struct Scale {
    /// norm of the energy coordinates
    pub a: f64,
    /// of each of `[1; inputs]`
    pub v: Vec<f64>,
    /// of their rates
    pub rate: Vec<f64>,
    /// factor on all noise while one mode is chosen, above 1 where none holds within it
    pub widened: f64,
    /// whether noise is measured by the largest values so far, where no mode holds within that of the segment
    pub coarse: bool,
}

/// What rounding leaves of impulses, as a part of their terms.
pub const OF_IMPULSE: f64 = 1e-11;
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
    /// the signs of one solve refute it, and it has not been reduced
    Signs,
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
    /// sizes of the terms of each modal coordinate, and of `[1; inputs]` and their rates, in the segment
    terms: Vec<f64>,
    driven: [Vec<f64>; 2],
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
        self.measure_terms(mode, a, segment, horizon, path);
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
            self.sample(mode, scale.a, horizon);
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
    fn sample(&mut self, mode: &Mode, largest: f64, horizon: f64) {
        for (j, watch) in mode.guards.watch.iter().enumerate() {
            let Watch::Switch(s) = *watch else { continue };
            if !self.sampled[s] || self.clear[j] > 0.0 {
                continue;
            }
            self.clear[j] = horizon;
            if self.looking {
                self.seen[s] = self.looks.value[j];
            }
            // what has come back to a threshold has the rounding of where it was
            let known = self.noise[j].max(OF_SOLUTION * mode.guards.sizes[j].x * largest);
            if self.looking && self.looks.value[j] < -known {
                self.thrown.push(s);
            }
        }
    }

    /// A miss in units of its noise as a part of how large the guard becomes in the segment.
    pub fn part_of(&self, guard: usize, miss: f64) -> f64 {
        miss * self.noise[guard] / self.looks.bound[guard].max(f64::MIN_POSITIVE)
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
                worst = worst.max(-value / (OF_IMPULSE * scale.widened.max(1.0) * size));
            }
        }
        worst
    }

    /// Finds how large the terms become that guards are sums of: the modal coordinates, which are sums themselves, as
    /// they are entered and on their way, and the inputs.
    fn measure_terms(
        &mut self,
        mode: &Mode,
        a: &[f64],
        segment: &Segment,
        horizon: f64,
        path: &Trajectory,
    ) {
        self.terms.resize(mode.n, 0.0);
        path.sizes(horizon, &mut self.reaches, &mut self.terms);
        mode.enter_sizes(a, &mut self.terms);
        let [values, rates] = &mut self.driven;
        segment.sizes(horizon, values, rates);
    }

    /// What rounding leaves of each guard: a part of its own terms in this segment.
    ///
    /// What is large elsewhere, or was so before, is no excuse: a spike of 100 kV at a winding that is interrupted says
    /// nothing of a diode at 1 V next to it.  Where no mode holds so, a state that has the rounding of larger ones before
    /// it is the reason.
    fn measure_noise(&mut self, mode: &Mode, scale: &Scale) {
        let widened = scale.widened.max(1.0);
        self.noise.clear();
        let mut floor = [0.0f64; 2]; // of multipliers and of slacks
        let rows = &mode.guards.rows;
        let sum = |row: &[f64], sizes: &[f64]| {
            row.iter().zip(sizes).map(|(g, size)| g.abs() * size).sum::<f64>()
        };
        for (j, size) in mode.guards.sizes.iter().enumerate() {
            let mut state = sum(rows.x.row(j), &self.terms);
            let [mut values, mut rates] = [&self.driven[0], &self.driven[1]];
            if scale.coarse {
                (state, values, rates) = (state.max(size.x * scale.a), &scale.v, &scale.rate);
            }
            let whole = state + sum(rows.v.row(j), values) + sum(rows.d.row(j), rates);
            let kind = usize::from(mode.guards.slack[j]);
            floor[kind] = floor[kind].max(1e-15 * whole * widened);
            // entries that are what is left of larger ones
            let behind = if size.x > 0.0 { state * (size.bound / size.x) } else { 0.0 };
            // what the sum of terms may lose by itself
            let noise = OF_SOLUTION * whole + 2e-15 * behind + 4e-15 * self.looks.bound[j];
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

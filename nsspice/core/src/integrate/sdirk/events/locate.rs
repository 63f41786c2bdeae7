//! The first instant of a step at which a guard becomes negative.

use super::guards::{Scales, VIOLATED};
use crate::integrate::implicit::stepper::Stepper;
use crate::integrate::sdirk::controller::stage_equations::{Fit, StageEquations};
use crate::integrate::sdirk::step::Trial;
use crate::integrate::sdirk::tableau::{Tableau, MOST as STAGES};
use crate::waveform::INSTANT;

/// Evaluations spent on one root.
const MOST: usize = 80;
/// Points at which a guard is looked at that may dip below zero between the stages.
const LOOKS: usize = 4;
/// A dip this near to a sample, as a part of the distance of the samples, is as deep as that.
const SETTLED: f64 = 1e-3;
/// Secants in a row that do not halve the bracket: the least of several guards has a kink at its root.
const SLOW: usize = 8;
/// Width of the bracket at which the search ends, as a part of the step.
const NARROW: f64 = 1e-14;

/// NaN is a violation.
fn violated(margin: f64) -> bool {
    fault!("steps_guards_1e-4" => return margin < -1e-4 || margin.is_nan());
    fault!("steps_guards_1e-6" => return margin < -1e-6 || margin.is_nan());
    margin < -VIOLATED || margin.is_nan()
}

/// Computes points of one trial step and their margins.
pub struct Locator<'a> {
    pub s: &'a mut Stepper,
    pub stage_equations: &'a mut StageEquations,
    pub scales: &'a Scales,
    pub tableau: &'a Tableau,
    pub trial: &'a mut Trial,
}

impl Locator<'_> {
    /// Margin at `theta`; where the laws of the mode contradict each other it counts as negative.
    pub fn margin(&mut self, theta: f64) -> f64 {
        match self.trial.evaluate(self.s, self.stage_equations, self.tableau, theta) {
            Fit::Solved | Fit::Open => self.scales.margin(self.s, &self.trial.at.x),
            Fit::Contradiction => f64::NEG_INFINITY,
        }
    }

    /// A place within `(0, end]` after the end of the mode, and how negative a guard is there, relative
    /// to its scale; None if the mode lasts.
    pub fn violation(&mut self, end: f64) -> Option<(f64, f64)> {
        if self.s.state.diodes.is_empty() && self.s.switching.switches.is_empty() {
            return None;
        }
        let (tableau, scales) = (self.tableau, self.scales);
        let last = tableau.stages() - 1;
        let mut order: [usize; STAGES] = std::array::from_fn(|i| i);
        let order = &mut order[tableau.first()..=last];
        order.sort_by(|&i, &j| tableau.c[i].total_cmp(&tableau.c[j]));
        for &i in order.iter().filter(|&&i| tableau.c[i] <= end) {
            // inner stages are of low order: where the
            // continuous solution is fine, they prove nothing
            let mut margin = scales.margin(self.s, &self.trial.stages.ends[i]);
            if violated(margin) && i != last {
                margin = self.margin(tableau.c[i]);
            }
            if violated(margin) {
                return Some((tableau.c[i], -margin));
            }
        }
        let whole = end == 1.0;
        let middle = if whole { tableau.c[tableau.middle] } else { 0.5 * end };
        if !whole {
            for (k, theta) in [middle, end].into_iter().enumerate() {
                let margin = self.margin(theta);
                if violated(margin) {
                    return Some((theta, -margin));
                }
                self.trial.remember(k, theta, tableau.stages());
            }
        }
        let (at_middle, at_end) = if whole {
            (&self.trial.stages.ends[tableau.middle][..], &self.trial.stages.ends[last][..])
        } else {
            (&self.trial.samples[0].at.x[..], &self.trial.samples[1].at.x[..])
        };
        let mut at = [0.0, middle, end];
        // most steps have no dip, and nothing is kept
        let mut place = scales.dip(self.s, at, [&self.trial.first, at_middle, at_end])?;
        let mut points = [self.trial.first.clone(), at_middle.to_vec(), at_end.to_vec()];
        for _ in 0..LOOKS {
            let margin = self.margin(place);
            if violated(margin) {
                return Some((place, -margin));
            }
            // closer, between the middle sample and the one beyond the dip
            let away = place - at[1];
            if away.abs() <= SETTLED * (at[2] - at[0]) {
                return None;
            }
            let point = std::mem::replace(&mut points[1], self.trial.at.x.clone());
            let side = if away > 0.0 { 0 } else { 2 };
            (at[side], points[side]) = (at[1], point);
            at[1] = place;
            place = scales.dip(self.s, at, [&points[0], &points[1], &points[2]])?;
        }
        None
    }

    /// The end of the mode within `(0, high]`, where a guard is negative at `high`.
    pub fn end_of_mode(&mut self, high: f64) -> f64 {
        let root = self.root(high);
        fault!("steps_event_late_1e-2" => return root + 1e-2 * (high - root));
        fault!("steps_event_late_1e-4" => return root + 1e-4 * (high - root));
        fault!("steps_event_at_end" => return high);
        fault!("steps_event_early" => return 0.99 * root);
        if self.s.switching.count() < 2 {
            return root;
        }
        // gates that take turns do so at one instant, which rounding separates
        let (start, length) = (self.trial.start, self.trial.length);
        let later = (root + INSTANT * (start + root * length) / length).min(high);
        let [turned, more] = [root, later].map(|theta| self.turned(theta));
        if more > turned {
            later
        } else {
            root
        }
    }

    /// How many switches have reached their thresholds at `theta`.
    fn turned(&mut self, theta: f64) -> usize {
        self.margin(theta);
        self.scales.turned(self.s, &self.trial.at.x)
    }

    /// The root of the margin in `(0, high]`: the latest point found at which it is not above zero.
    fn root(&mut self, high: f64) -> f64 {
        let (mut a, mut b) = (0.0f64, high);
        // the stage value that raised the alarm may differ from the continuous solution
        let mut fb = self.margin(b);
        if fb >= 0.0 {
            return b;
        }
        let mut followed = Vec::new();
        self.scales.violated(self.s, &self.trial.at.x, &mut followed);
        let alarmed = fb.is_finite() && followed.contains(&true);
        let mut fa = f64::NAN; // unknown, or zero of a pair that has just changed
        let mut side = 0;
        let (mut width, mut slow) = (f64::INFINITY, 0);
        for _ in 0..MOST {
            if slow < SLOW {
                slow = if b - a > 0.5 * width { slow + 1 } else { 0 };
            }
            width = b - a;
            if b - a <= NARROW.max(8.0 * f64::EPSILON * self.trial.start / self.trial.length) {
                break;
            }
            let secant = b - fb * (b - a) / (fb - fa);
            let inside = secant > a && secant < b && fb.is_finite() && slow < SLOW;
            let c = if inside && fa > 0.0 { secant } else { 0.5 * (a + b) };
            let mut fc = self.margin(c);
            if alarmed && fc.is_finite() {
                fc = self.scales.margin_of(self.s, &self.trial.at.x, &followed);
            }
            if fc > 0.0 {
                a = c;
                fa = fc;
                if side == 1 {
                    fb *= 0.5; // Illinois
                }
                side = 1;
            } else {
                b = c;
                fb = fc;
                if side == 2 {
                    fa *= 0.5;
                }
                side = 2;
                if fc == 0.0 {
                    break;
                }
            }
        }
        b
    }
}

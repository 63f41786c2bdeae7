//! How large the error of a step is, relative to what is allowed.

use super::energies::Point;
use super::estimate::Estimate;
use super::step_matrices::SMALL;
use crate::integrate::implicit::stepper::Stepper;
use crate::integrate::sdirk::events::across_kinks::{CLOSE, NOTICED};
use crate::integrate::sdirk::run::Sdirk;
use crate::integrate::sdirk::step::Trial;
use crate::rounding::OF_EQUATION;

/// So many times what Newton's method leaves open, less than a thousandth of the tolerance, is no motion.
const STILL: f64 = 256.0;

/// So many times the estimate at its end the quartic term of a step's continuous solution is where both are about the
/// error: of a decay by `e^-z` it is 2.5 times the estimate for small `z`, 4 times at 1, 9 times at 3 and 190 times at
/// 25; the error inside is all of the estimate at 1, and half of the quartic term from 2 on.
const INSIDE: f64 = 8.0;

/// Most by which the error of the next step is expected to rise.
const STEEPEST: f64 = 4.0;

/// A step is taken again at most so many levels shorter in one go.
const BACK: usize = 3;

impl Sdirk {
    /// Whether errors are measured as energies: that has been asked for, and something stores.
    pub fn measures_energies(&self) -> bool {
        self.energies.is_some()
    }

    /// Estimated error of the trial step relative to what is allowed.
    pub(in crate::integrate::sdirk) fn error(&mut self, s: &mut Stepper) -> f64 {
        self.trial.estimate(s, &mut self.stage_equations, self.tableau);
        if self.tableau.looks_back() {
            self.trial.look_back(s, &mut self.stage_equations, self.tableau);
        } else {
            // what a step damps moves its inside, not its end: ringing, and what decays within the first
            // step of a mode
            let whole = self.fresh || self.trial.crossing || self.energies.is_some();
            let shown = if whole || s.solver.smooth.is_some() { 0.0 } else { INSIDE };
            self.trial.look_inside(s, &mut self.stage_equations, self.tableau, shown);
        }
        let end = &self.trial.stages.ends[self.tableau.stages() - 1];
        let mut largest = self.scales.largest;
        for (v, &kind) in end.iter().zip(&s.solver.sys.linear.row_kind) {
            let largest = &mut largest[usize::from(kind)];
            *largest = largest.max(v.abs());
        }
        let allowed = [self.settings.accuracy.voltage, self.settings.accuracy.current];
        // within the first of the longest steps little of the ranges has been seen: they go on as now
        let young = s.state.time < self.settings.start + self.stage_equations.longest;
        let ahead = if young { self.stage_equations.longest / self.trial.length } else { 0.0 };
        if let Some(energies) = &mut self.energies {
            let (z, f) = (&end[..s.state.z.len()], &end[s.state.z.len() + s.state.l.len()..]);
            let slopes = s.solver.smooth.as_ref().map_or(&[][..], |smooth| smooth.newton.slopes());
            energies.weigh(Point { z, f }, slopes, ahead, self.trial.length);
        }
        let mut worst = 0.0f64;
        let n = s.state.z.len();
        if let Some(nodes) = &mut self.nodes {
            let ends = [&self.trial.first[..n], &end[..n]];
            nodes.take(
                &self.stage_equations.stored,
                [&self.trial.estimate.errors, &self.trial.estimate.charged.errors],
                ends,
            );
        }
        // what sources alone determine is no result of the step
        for &j in self.stage_equations.stored.iter().filter(|&&j| !s.facts.fixed[j]) {
            let kind = usize::from(s.solver.sys.linear.row_kind[j]);
            let beyond = ahead * (end[j] - self.trial.first[j]).abs();
            let small = if self.trial.estimate.constrained[j] { 1.0 } else { SMALL };
            let range = self.scales.size(j, end[j], beyond).max(small * largest[kind]);
            let (slope, range) = match &self.nodes {
                Some(nodes) if kind == 0 => {
                    nodes.worse(j, &self.scales, ahead, small * largest[kind])
                }
                _ => (self.trial.estimate.errors[j], range),
            };
            let size = match &self.energies {
                Some(energies) => energies.size(j, self.trial.estimate.errors[j], range),
                None => range,
            };
            // of the largest voltage (current), in the rates of the stages
            let rounding = OF_EQUATION * self.trial.estimate.terms[j].max(largest[kind]);
            let ratio = slope.abs()
                / (self.settings.accuracy.relative * size
                    + allowed[kind]
                    + rounding
                    + f64::MIN_POSITIVE);
            self.control.tied[j] = self.trial.estimate.constrained[j] && ratio > NOTICED;
            // NaN is the worst
            (worst, self.control.erring) =
                if ratio <= worst { (worst, self.control.erring) } else { (ratio, j) };
        }
        if let Some(energies) = &mut self.energies {
            let taken = energies.taken(self.tableau, self.trial.length, &self.trial.stages.rates);
            worst = worst.max(taken / self.settings.accuracy.relative);
        }
        // so short a step shows the rounding of fluxes as voltages: longer ones show less
        if worst > NOTICED && self.is_still(s) {
            NOTICED
        } else {
            worst
        }
    }

    /// The error of the next step if it were as long as the last one: an error that rises goes on rising.
    pub(in crate::integrate::sdirk) fn trend(&mut self, error: f64) -> f64 {
        let length = self.trial.length;
        let (before, last) = std::mem::replace(&mut self.control.last_error, (length, error));
        let expected = last * (length / before).powi(self.tableau.error_order);
        let rise = if expected > 0.0 { error / expected } else { 1.0 };
        error * rise.clamp(1.0, STEEPEST)
    }

    /// The level of the next step, `up` levels above that of a step that ended at `time`, or as many
    /// as let the ends of longer steps fall on rows, which then cost nothing.
    pub(in crate::integrate::sdirk) fn grown(&self, level: usize, up: usize, time: f64) -> usize {
        let falls = |level: usize| {
            let steps = (time - self.shown.rows.start()) / self.stage_equations.length(level);
            (steps - steps.round()).abs() <= CLOSE
        };
        let steps = self.shown.rows.step() / self.stage_equations.longest;
        let meets = steps.round() >= 1.0 && (steps - steps.round()).abs() <= CLOSE;
        let top = level.saturating_sub(up);
        if !(meets && falls(level)) {
            return top;
        }
        (top..level).find(|&l| falls(l)).unwrap_or(level)
    }

    /// Whether the trial step moves what is stored by no more than its stages leave open.  What a stage leaves of
    /// the charges of junctions flows somewhere, too.
    fn is_still(&mut self, s: &Stepper) -> bool {
        let Some(smooth) = &s.solver.smooth else { return false };
        let (n, m) = (s.state.z.len(), s.state.l.len());
        let part = STILL * smooth.newton.accuracy().max(f64::EPSILON);
        let Trial { first, stages, length, estimate, .. } = &mut self.trial;
        let Estimate { terms, diagonals, stored, .. } = estimate;
        let end = &stages.ends[self.tableau.stages() - 1];
        stored.fill(0.0);
        smooth.newton.add_stored(1.0, &end[n + m..], stored);
        let most = s.solver.sys.largest(&[stored]);
        let mut linear = self.stage_equations.stored.iter().filter(|&&j| terms[j] > 0.0);
        let rests = linear.all(|&j| {
            let kind = usize::from(s.solver.sys.linear.row_kind[j]);
            let came = (most[kind] / diagonals.storage[j]).max(most[1 - kind] / *length);
            (end[j] - first[j]).abs() <= part * terms[j].max(came)
        });
        if !rests {
            return false;
        }
        smooth.newton.add_stored(-1.0, &first[n + m..], stored);
        let moved = s.solver.sys.largest(&[stored]);
        (0..2).all(|kind| moved[kind] <= part * most[kind])
    }
}

/// How many levels shorter a step has to be taken again whose error, of this order, was so large.
pub fn back(error: f64, order: i32) -> usize {
    let wanted = (2.0 * error).log2() / f64::from(order);
    if wanted < BACK as f64 {
        (wanted.ceil() as usize).max(1)
    } else {
        BACK
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_shortened_until_half_the_tolerance_is_left() {
        for order in [2, 4] {
            for error in [1.01, 3.0, 7.9, 100.0, 1e6] {
                let levels = back(error, order);
                let left = |levels: usize| error / 2.0f64.powi(order * levels as i32);
                assert!(levels == BACK || left(levels) <= 0.5, "{order} {error}");
                assert!(levels == 1 || left(levels - 1) > 0.5, "{order} {error}");
            }
        }
    }

    #[test]
    fn an_error_without_measure_shortens_most() {
        assert_eq!(back(f64::NAN, 4), BACK);
        assert_eq!(back(f64::INFINITY, 4), BACK);
    }
}

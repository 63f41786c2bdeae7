//! How large the error of a step is, beside what is allowed.

use super::super::stepper::Stepper;
use super::energies::Point;
use super::guards::Scales;
use super::ladder::SMALL;
use super::pass::NOTICED;
use super::run::Sdirk;
use super::step::Trial;
use crate::structure::Coordinates;

/// Rounding of an estimated error: that of the largest voltage (current), in the rates of all stages.
const ROUNDING: f64 = 32.0 * f64::EPSILON;
/// So many times what Newton's method leaves open, less than a thousandth of the tolerance, is no motion.
const STILL: f64 = 256.0;

/// Instants that differ by so small a part of a step are one.
const SAME_PLACE: f64 = 1e-6;

/// Most by which the error of the next step is expected to rise.
const STEEPEST: f64 = 4.0;
/// A step is taken again at most so many levels shorter at once.
const BACK: usize = 3;

/// Errors at nodes where voltages along a tree are the unknowns: of the charge that each one holds, as a voltage of
/// all its capacitors, and the potentials at both ends of a step.
struct Nodes<'a> {
    tree: &'a Coordinates,
    errors: Vec<f64>,
    first: Vec<f64>,
    last: Vec<f64>,
}

impl Nodes<'_> {
    /// Of both nodes of an unknown the error and what it is measured by, of that which errs more beside it.
    fn worse(&self, own: usize, scales: &Scales, ahead: f64, least: f64) -> (f64, f64) {
        let of = |j: usize| {
            let beyond = ahead * (self.last[j] - self.first[j]).abs();
            (self.errors[j].abs(), scales.size_of_potential(j, self.last[j], beyond).max(least))
        };
        let one = of(own);
        let other = usize::try_from(self.tree.before(own)).map_or((0.0, 1.0), of);
        let more = other.0 * one.1 > one.0 * other.1 || other.0.is_nan();
        if more {
            other
        } else {
            one
        }
    }
}

impl Sdirk {
    /// Whether errors are measured as energies: that has been asked for, and something stores.
    pub fn measures_energies(&self) -> bool {
        self.energies.is_some()
    }

    /// Estimated error of the trial step relative to what is allowed.
    pub(super) fn error(&mut self, s: &mut Stepper) -> f64 {
        self.trial.estimate(s, &mut self.ladder, self.tableau);
        if self.tableau.looks_back() {
            self.trial.look_back(s, &mut self.ladder, self.tableau);
        } else if self.fresh || s.smooth.is_some() || self.trial.crossing || self.energies.is_some()
        {
            // what a step damps moves its inside, not its end: ringing, and what decays within the first
            // step of a mode; elsewhere the motion in a mode is smooth: the ends of steps tell enough
            self.trial.look_inside(s, &mut self.ladder, self.tableau);
        }
        let end = &self.trial.stages[self.tableau.stages() - 1];
        let mut largest = self.scales.largest;
        for (v, &kind) in end.iter().zip(&s.sys.linear.row_kind) {
            let largest = &mut largest[usize::from(kind)];
            *largest = largest.max(v.abs());
        }
        let allowed = [self.accuracy.voltage, self.accuracy.current];
        // within the first of the longest steps little of the ranges has been seen: they go on as now
        let young = s.time < self.start + self.ladder.longest;
        let ahead = if young { self.ladder.longest / self.trial.length } else { 0.0 };
        if let Some(energies) = &mut self.energies {
            let (z, f) = (&end[..s.z.len()], &end[s.z.len() + s.l.len()..]);
            let slopes = s.smooth.as_ref().map_or(&[][..], |smooth| smooth.newton.slopes());
            energies.weigh(Point { z, f }, slopes, ahead, self.trial.length);
        }
        let mut worst = 0.0f64;
        // voltages along a tree are measured by the potentials between which they lie: that of a diode that conducts is
        // not followed to its own digits
        let n = s.z.len();
        let by_potentials = s.coordinates.as_ref().filter(|_| self.energies.is_none());
        let nodes = by_potentials.map(|tree| {
            let mut charges = vec![0.0; n];
            let mut errors = vec![0.0; n];
            for &j in &self.ladder.stored {
                errors[j] = self.trial.slope[j];
            }
            s.sys.linear.e.mul_add(1.0, &errors, &mut charges);
            let mut errors = tree.at_nodes(&charges);
            for (error, storage) in errors.iter_mut().zip(&s.node_storage) {
                *error = if *storage > 0.0 { *error / storage } else { 0.0 };
            }
            Nodes {
                tree,
                errors,
                first: tree.potentials(&self.trial.first[..n]),
                last: tree.potentials(&end[..n]),
            }
        });
        // what sources alone determine is no result of the step
        for &j in self.ladder.stored.iter().filter(|&&j| !s.fixed[j]) {
            let kind = usize::from(s.sys.linear.row_kind[j]);
            let beyond = ahead * (end[j] - self.trial.first[j]).abs();
            let small = if self.trial.constrained[j] { 1.0 } else { SMALL };
            let range = self.scales.size(j, end[j], beyond).max(small * largest[kind]);
            let (slope, range) = match &nodes {
                Some(nodes) if kind == 0 => {
                    nodes.worse(j, &self.scales, ahead, small * largest[kind])
                }
                _ => (self.trial.slope[j], range),
            };
            let size = match &self.energies {
                Some(energies) => energies.size(j, self.trial.slope[j], range),
                None => range,
            };
            let rounding = ROUNDING * self.trial.terms[j].max(largest[kind]);
            let ratio = slope.abs()
                / (self.accuracy.relative * size + allowed[kind] + rounding + f64::MIN_POSITIVE);
            self.tied[j] = self.trial.constrained[j] && ratio > NOTICED;
            // NaN is the worst
            (worst, self.erring) = if ratio <= worst { (worst, self.erring) } else { (ratio, j) };
        }
        if let Some(energies) = &mut self.energies {
            let taken = energies.taken(self.tableau, self.trial.length, &self.trial.rates);
            worst = worst.max(taken / self.accuracy.relative);
        }
        // so short a step shows the rounding of fluxes as voltages: longer ones show less
        if worst > NOTICED && self.is_still(s) {
            NOTICED
        } else {
            worst
        }
    }

    /// The error of the next step if it were as long as the last one: an error that rises goes on rising.
    pub(super) fn trend(&mut self, error: f64) -> f64 {
        let length = self.trial.length;
        let (before, last) = std::mem::replace(&mut self.last_error, (length, error));
        let expected = last * (length / before).powi(self.tableau.error_order);
        let rise = if expected > 0.0 { error / expected } else { 1.0 };
        error * rise.clamp(1.0, STEEPEST)
    }

    /// The level of the next step, `up` levels above that of a step that ended at `time`, or as many
    /// as let the ends of longer steps fall on rows, which then cost nothing.
    pub(super) fn grown(&self, level: usize, up: usize, time: f64) -> usize {
        let falls = |level: usize| {
            let steps = (time - self.rows.start()) / self.ladder.length(level);
            (steps - steps.round()).abs() <= SAME_PLACE
        };
        let steps = self.rows.step() / self.ladder.longest;
        let meets = steps.round() >= 1.0 && (steps - steps.round()).abs() <= SAME_PLACE;
        let top = level.saturating_sub(up);
        if !(meets && falls(level)) {
            return top;
        }
        (top..level).find(|&l| falls(l)).unwrap_or(level)
    }

    /// Whether the trial step moves what is stored by no more than its stages leave open.  What a stage leaves of
    /// the charges of junctions flows somewhere, too.
    fn is_still(&mut self, s: &Stepper) -> bool {
        let Some(smooth) = &s.smooth else { return false };
        let (n, m) = (s.z.len(), s.l.len());
        let part = STILL * smooth.newton.accuracy().max(f64::EPSILON);
        let Trial { first, stages, terms, storage, length, stored, .. } = &mut self.trial;
        let end = &stages[self.tableau.stages() - 1];
        stored.fill(0.0);
        smooth.newton.add_stored(1.0, &end[n + m..], stored);
        let most = s.sys.largest(&[stored]);
        let mut linear = self.ladder.stored.iter().filter(|&&j| terms[j] > 0.0);
        let rests = linear.all(|&j| {
            let kind = usize::from(s.sys.linear.row_kind[j]);
            let came = (most[kind] / storage[j]).max(most[1 - kind] / *length);
            (end[j] - first[j]).abs() <= part * terms[j].max(came)
        });
        if !rests {
            return false;
        }
        smooth.newton.add_stored(-1.0, &first[n + m..], stored);
        let moved = s.sys.largest(&[stored]);
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

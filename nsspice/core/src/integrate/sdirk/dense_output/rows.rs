//! When rows are written, and where those inside a step come from.

use super::polynomial::Moments;
use crate::integrate::implicit::stepper::Stepper;
use crate::integrate::sdirk::controller::stage_equations::{Fit, StageEquations};
use crate::integrate::sdirk::run::Sdirk;
use crate::integrate::sdirk::samples::no_length;
use crate::integrate::sdirk::step::Trial;
use crate::integrate::sdirk::tableau::Tableau;
use crate::tolerances::CLEARLY;

/// How often a step is halved at most to follow outputs to a part `floor` of their sizes.  With each halving a kink
/// counts for half as much in its piece, so that these do for one that is as large as the output; and a jump, which
/// no polynomial follows, is left in so small a part of the step that integrals do not see it.
fn halvings(floor: f64) -> usize {
    // rounding of the instants ends it at the latest
    -floor.clamp(f64::EPSILON, 1.0).log2().floor() as usize
}

/// Kinks and jumps of the outputs in a step that are followed, each by halves of halves around it.  Rounding of an
/// output that is nothing else has one everywhere, and no end of halves.
const KINKS: usize = 8;

/// Where the rows inside a step come from.
#[derive(Clone, Copy, Debug)]
pub(in crate::integrate::sdirk) enum Origin {
    /// the continuous solution: they are stored quantities
    Continuous,
    /// a polynomial through some that obey the laws
    Between,
    /// the laws, row by row
    Laws,
}

/// A step that has been accepted, and what is asked of its rows.
pub(in crate::integrate::sdirk) struct Inside<'a> {
    pub s: &'a mut Stepper,
    pub trial: &'a mut Trial,
    pub stage_equations: &'a mut StageEquations,
    pub tableau: &'a Tableau,
    /// where it ends, as a part of the step that was tried
    pub end: f64,
    /// rows up to there
    pub rows: f64,
    /// errors of the outputs, as parts of their sizes
    pub tolerance: f64,
}

impl Inside<'_> {
    /// The outputs at the part `theta` of the step by the laws; true if the mode of the step solves them.
    pub fn by_laws(&mut self, theta: f64, row: &mut [f64]) -> bool {
        let fit = self.trial.evaluate(self.s, self.stage_equations, self.tableau, theta);
        self.trial.write(self.s, self.stage_equations, row);
        fit == Fit::Solved
    }
}

impl Sdirk {
    /// Rows of the table inside the accepted step, which ends at a time: as many as there are or as there is
    /// room for.
    pub(in crate::integrate::sdirk) fn write_inside(
        &mut self,
        s: &mut Stepper,
        end: f64,
        out: &mut [f64],
    ) -> usize {
        let end = end - self.at_once(end);
        let mut count = 0;
        let mut moments = Moments::default();
        for row in out.chunks_exact_mut(s.recorder.columns()) {
            let label = self.shown.rows.time();
            if label >= end {
                break;
            }
            self.write_at(s, label, row);
            self.expect(s, label, &mut moments);
            if s.recorder.samples.keep_sides {
                self.shown.points.see(row);
            }
            self.shown.rows.advance();
            count += 1;
        }
        self.close_expected(s, &moments);
        count
    }

    /// Takes a row of the table, written last, into the sums of all.
    fn expect(&mut self, s: &mut Stepper, label: f64, moments: &mut Moments) {
        if !s.recorder.expected.wanted {
            return;
        }
        let theta = (label - self.trial.start) / self.trial.length;
        let place = match self.shown.origin {
            Some(Origin::Continuous) => theta,
            Some(Origin::Between) => self.shown.between.place(theta),
            _ => return s.recorder.expect_last(),
        };
        moments.add(s.recorder.expected.next(), place, &self.trial.at.u);
    }

    /// Brings sums over rows of polynomials into outputs.
    fn close_expected(&mut self, s: &mut Stepper, moments: &Moments) {
        if moments.is_empty() {
            return;
        }
        let mut sums = vec![0.0; s.recorder.outputs.len()];
        match self.shown.origin {
            Some(Origin::Continuous) => self.shown.stored.write_sums(moments, &mut sums),
            Some(Origin::Between) => self.shown.between.write_sums(moments, &mut sums),
            _ => {}
        }
        s.recorder.expected.add(1.0, &sums);
    }

    /// Keeps the accepted step, which ends at a time, as polynomials, for measures.
    pub(in crate::integrate::sdirk) fn keep_pieces(&mut self, s: &mut Stepper, end: f64) {
        let start = self.trial.start;
        // a mode that ends where it begins has not been
        if no_length(start, end, self.trial.length) {
            return;
        }
        if let Some([from, to]) = s.recorder.samples.pieces.wanted(start, end) {
            let mut row = vec![0.0; s.recorder.columns()];
            let halvings = halvings(CLEARLY * self.settings.accuracy.relative);
            let mut halves = 2 * KINKS * halvings;
            self.cut(s, [from, to], &mut row, (halvings, &mut halves));
        }
    }

    /// Keeps a part of the accepted step, in halves where one polynomial does not follow the outputs: it is halved so
    /// often at most, the whole step into so many `halves`.
    fn cut(
        &mut self,
        s: &mut Stepper,
        [from, to]: [f64; 2],
        row: &mut [f64],
        (halvings, halves): (usize, &mut usize),
    ) {
        let mut pieces = std::mem::take(&mut s.recorder.samples.pieces);
        pieces.begin(from, to - from);
        let mut solved = true;
        for point in 0..pieces.places.len() {
            let label = (from + pieces.places[point] * (to - from)).min(to);
            if label <= self.trial.start {
                s.write(label, row); // the continuous solution begins there to the tolerance only
            } else {
                solved &= self.write_at(s, label, row);
            }
            pieces.put(point, &row[1..]);
        }
        let middle = 0.5 * (from + to);
        // where the laws have no solution in the course of a step, halves of it have none either
        let last = halvings == 0 || *halves == 0 || !solved || !(from < middle && middle < to);
        let floor = CLEARLY * self.settings.accuracy.relative;
        let follows = last || pieces.follows(0.0, floor);
        if last {
            pieces.straighten(0.0, floor);
        }
        if follows {
            pieces.keep();
        } else {
            pieces.drop_last();
        }
        s.recorder.samples.pieces = pieces;
        if !follows {
            *halves = halves.saturating_sub(2);
            self.cut(s, [from, middle], row, (halvings - 1, halves));
            self.cut(s, [middle, to], row, (halvings - 1, halves));
        }
    }

    /// The outputs at a time inside the accepted step; whether the laws, where they were asked, have a solution,
    /// in the mode of the step or in another.
    pub(in crate::integrate::sdirk) fn write_at(
        &mut self,
        s: &mut Stepper,
        label: f64,
        row: &mut [f64],
    ) -> bool {
        let theta = (label - self.trial.start) / self.trial.length;
        let origin = match self.shown.origin {
            Some(origin) => origin,
            None => self.find_origin(s, theta),
        };
        row[0] = label;
        let outputs = &mut row[1..];
        match origin {
            Origin::Between => self.shown.between.write(s, &mut self.trial, theta, outputs),
            Origin::Continuous => self.shown.stored.write(s, &mut self.trial, theta, outputs),
            Origin::Laws => {
                let fit = self.trial.evaluate(s, &mut self.stage_equations, self.tableau, theta);
                self.trial.write(s, &self.stage_equations, outputs);
                return fit != Fit::Contradiction;
            }
        }
        true
    }

    /// Where the rows of the accepted step come from, which are asked for from the part `theta` on.
    fn find_origin(&mut self, s: &mut Stepper, theta: f64) -> Origin {
        let end = self.accepted.map_or(1.0, |a| a.theta);
        let rows = (end - theta) * self.trial.length / self.shown.rows.step();
        let (trial, stage_equations, tableau) =
            (&mut self.trial, &mut self.stage_equations, self.tableau);
        let tolerance = self.settings.accuracy.relative;
        let mut step = Inside { s, trial, stage_equations, tableau, end, rows, tolerance };
        let origin = if self.shown.stored.plain(&mut step) {
            Origin::Continuous
        } else if self.shown.between.serves(&mut step) {
            Origin::Between
        } else {
            Origin::Laws
        };
        self.shown.origin = Some(origin);
        origin
    }
}

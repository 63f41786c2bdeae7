//! When rows are written, and where those inside a step come from.

use super::super::stepper::Stepper;
use super::ladder::{Fit, Ladder};
use super::run::Sdirk;
use super::step::Trial;
use super::tableau::Tableau;
use super::witness::no_length;

/// Pieces of a step that lines join.
const PIECES: usize = 8;

/// Where the rows inside a step come from.
#[derive(Clone, Copy, Debug)]
pub(super) enum Origin {
    /// the continuous solution: they are stored quantities
    Continuous,
    /// a polynomial through some that obey the laws
    Between,
    /// the laws, row by row
    Laws,
}

/// A step that has been accepted, and what is asked of its rows.
pub(super) struct Inside<'a> {
    pub s: &'a mut Stepper,
    pub trial: &'a mut Trial,
    pub ladder: &'a mut Ladder,
    pub tableau: &'a Tableau,
    /// where it ends, as a part of the step that was tried
    pub end: f64,
    /// rows up to there
    pub rows: f64,
    /// errors of the outputs, as parts of their sizes
    pub tolerance: f64,
}

impl Inside<'_> {
    /// The outputs at the part `theta` of the step by the laws; true if these could be solved.
    pub fn by_laws(&mut self, theta: f64, row: &mut [f64]) -> bool {
        let fit = self.trial.evaluate(self.s, self.ladder, self.tableau, theta);
        self.trial.write(self.s, self.ladder, row);
        fit == Fit::Solved
    }
}

impl Sdirk {
    /// Rows of the table inside the accepted step, which ends at a time: as many as there are or as there is
    /// room for.
    pub(super) fn write_inside(&mut self, s: &mut Stepper, end: f64, out: &mut [f64]) -> usize {
        let end = end - self.at_once(end);
        let mut count = 0;
        for row in out.chunks_exact_mut(s.columns()) {
            let label = self.rows.time();
            if label >= end {
                break;
            }
            self.write_at(s, label, row);
            if s.witness.keep_sides {
                self.points.see(row);
            }
            self.rows.advance();
            count += 1;
        }
        count
    }

    /// Keeps points inside the accepted step beside the rows, for measures: a surge may come and go between
    /// two of them, and of few steps lines do not tell what a polynomial of the fourth degree does.
    pub(super) fn keep_pieces(&mut self, s: &mut Stepper, end: f64) {
        let (start, length) = (self.trial.start, self.trial.length);
        let piece = (end - start) / PIECES as f64;
        // a mode that ends where it begins has not been, and rows that are closer tell all
        let wanted = s.witness.between(start) || s.witness.between(end);
        if !wanted || no_length(start, end, length) || self.rows.step() <= piece {
            return;
        }
        let mut row = vec![0.0; s.columns()];
        for k in 1..PIECES {
            let label = start + k as f64 * piece;
            self.write_at(s, label, &mut row);
            s.witness.sides.extend_from_slice(&row);
        }
    }

    /// The outputs at a time inside the accepted step.
    fn write_at(&mut self, s: &mut Stepper, label: f64, row: &mut [f64]) {
        let theta = (label - self.trial.start) / self.trial.length;
        let origin = match self.origin {
            Some(origin) => origin,
            None => self.find_origin(s, theta),
        };
        row[0] = label;
        let outputs = &mut row[1..];
        match origin {
            Origin::Between => self.between.write(s, &mut self.trial, theta, outputs),
            Origin::Continuous => self.stored.write(s, &mut self.trial, theta, outputs),
            Origin::Laws => {
                self.trial.evaluate(s, &mut self.ladder, self.tableau, theta);
                self.trial.write(s, &self.ladder, outputs);
            }
        }
    }

    /// Where the rows of the accepted step come from, which are asked for from the part `theta` on.
    fn find_origin(&mut self, s: &mut Stepper, theta: f64) -> Origin {
        let end = self.accepted.map_or(1.0, |a| a.theta);
        let rows = (end - theta) * self.trial.length / self.rows.step();
        let (trial, ladder, tableau) = (&mut self.trial, &mut self.ladder, self.tableau);
        let tolerance = self.accuracy.relative;
        let mut step = Inside { s, trial, ladder, tableau, end, rows, tolerance };
        let origin = if self.stored.plain(&mut step) {
            Origin::Continuous
        } else if self.between.serves(&mut step) {
            Origin::Between
        } else {
            Origin::Laws
        };
        self.origin = Some(origin);
        origin
    }
}

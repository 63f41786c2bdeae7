//! Outputs inside segments as polynomials, for measures: to rounding, independent of the rows.
//!
//! A segment is a sum of exponentials and sines.  A piece of it is as long as the fastest of them that has
//! not decayed allows, or longer where the coefficients of the polynomials show that it does not take part.

use crate::modewise::run::Engine;
use crate::modewise::run_state::Phase;
use crate::modewise::segments::root_bracketing::GROWTH;
use crate::pieces::Pieces;
use crate::rounding::{OF_SOLUTION, UNIT};

/// Points of a piece.
pub const POINTS: usize = 12;
/// Length of a piece in time constants of a term: the polynomial through the points errs by
/// `2 (1.4 / 4)^12 / 12! = 1.4e-14` of it at most.
const REACH: f64 = 1.4;

/// Parts of a segment by series, whose terms fall below rounding at its end, in which a polynomial through the points
/// follows it: `16^-12 = 4e-15`.
const SERIES: f64 = 16.0;

impl Engine {
    /// Keeps some outputs between two instants as polynomials.
    pub fn keep_pieces(&mut self, outputs: Vec<usize>, window: [f64; 2]) {
        self.table.pieces = Pieces::new(outputs, window, POINTS);
    }

    /// Keeps the segment that ends here.
    pub(in crate::modewise) fn write_pieces(&mut self) {
        let mut pieces = std::mem::take(&mut self.table.pieces);
        // what begins at the end of the run serves its last row
        self.split(&mut pieces, self.span.end.min(self.plan.stop));
        self.table.pieces = pieces;
    }

    /// Puts the outputs of the present segment down as polynomials, up to an instant [s].
    pub(in crate::modewise) fn split(&mut self, pieces: &mut Pieces, until: f64) {
        let (begin, length) = (self.span.time, self.span.end - self.span.time);
        let Some([from, to]) = pieces.wanted(begin, until) else { return };
        self.prepare_rows(POINTS as f64);
        let last = if to >= self.span.end { length } else { to - begin };
        self.table.inside.choose(&pieces.outputs);
        let mut row = vec![0.0; self.columns()];
        let mut at = from - begin;
        let mut width = last - at;
        while at < last && pieces.wanted(begin + at, self.span.end).is_some() {
            let (rest, sure) = (last - at, self.sure(at, last - at));
            width = (GROWTH * width).min(rest);
            while !self.piece(pieces, at, width, &mut row) && width > sure {
                pieces.drop_last();
                width = (width / GROWTH).max(sure);
            }
            pieces.keep();
            if rest - width <= f64::EPSILON * length {
                break;
            }
            at += width;
        }
    }

    /// Does so with the last segment, which nothing ends.
    pub(in crate::modewise) fn end_pieces(&mut self) {
        if matches!(self.span.phase, Phase::Moving) {
            self.write_pieces();
        }
        self.table.pieces.window = [f64::INFINITY; 2];
    }

    /// Puts down a piece; true if polynomials follow it.
    fn piece(&mut self, pieces: &mut Pieces, at: f64, width: f64, row: &mut [f64]) -> bool {
        pieces.begin(self.span.time + at, width);
        for point in 0..POINTS {
            let time = at + pieces.places[point] * width;
            match self.chosen_at(time) {
                Some(values) => pieces.put_own(point, values),
                None => {
                    self.write_inside(time, row);
                    pieces.put(point, &row[1..]);
                }
            }
        }
        // the coefficients fall from the last one on that is looked at
        pieces.follows(OF_SOLUTION, f64::EPSILON)
    }

    /// How long a piece from a time on may be at least, for all terms.
    fn sure(&self, at: f64, rest: f64) -> f64 {
        if self.expanded.active {
            return rest / SERIES;
        }
        self.motion.path.terms.iter().fold(rest, |width, placed| {
            let (speed, growth) = (placed.term.speed(), placed.term.growth());
            if speed == 0.0 {
                return width;
            }
            let left = (growth * at).exp().min(1.0);
            if left < UNIT {
                return width;
            }
            // the error grows with a power of the length
            width.min(REACH / speed * left.powf(-1.0 / POINTS as f64))
        })
    }
}

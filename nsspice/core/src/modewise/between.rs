//! Points between rows, for measures: lines between all of them follow the outputs closely.
//!
//! Rows are as far apart as the deck asks, and between two of them a surge may come and go: charged
//! through 10 mOhm, 100 pF draw 2 kA for a picosecond.  Where something in the present mode is fast
//! beside the distance of the rows, two points between two neighbours are tested; where one lies off
//! the line, all three pieces are looked at in turn.

use super::run::{Engine, Phase};
use super::terms::Term;

/// Places of the points that are tested; a period that divides the piece does not hide from them.
const PLACES: [f64; 2] = [0.31, 0.66];
/// So far off the line is on it, relative to the values there ...
const FLAT: f64 = 1e-4;
/// ... and to what the output changes by in the segment, since the peaks of a ripple lie inside of
/// segments and are far below the values: `pp` is to see them.
const BENT: f64 = 1e-3;
/// As near to the line as this part of the largest of that output is rounding.
const TRACE: f64 = 1e-9;
/// A piece is cut into three so often at most.
const DEPTH: usize = 30;
/// Rates that turn or decay by less than this between two rows bend no line: what changes by one
/// with the rate `r` is off its line by `r length / 8`.
const SLOW: f64 = 8.0 * FLAT;
/// Time constants after which nothing is left of a motion that decays.
const GONE: f64 = 30.0;
/// Points that are looked at in a segment at least: its ends, and one third and two of a piece.
const POINTS: f64 = 4.0;
/// Numbers kept at most in a run: what rings for ever has no end of points.
const MOST: usize = 1 << 24;

impl Engine {
    /// Keeps points inside the segment that ends here, beside the rows.
    pub(super) fn write_between(&mut self) {
        let (begin, length, [from, to]) = (self.time, self.end - self.time, self.ends.window);
        if self.ends.watched.is_empty() || length <= 0.0 || begin > to || self.end < from {
            return;
        }
        let step = self.rows.step().min(length);
        let lively = self.lively(step).min(length);
        if lively <= 0.0 {
            return;
        }
        self.prepare_rows(POINTS);
        self.ends.span =
            self.ends.watched.iter().map(|_| [f64::INFINITY, f64::NEG_INFINITY]).collect();
        self.point_at(0.0);
        self.point_at(length);
        let (mut start, mut left) = (begin, None);
        for end in self.rows.within(begin, self.end).chain([self.end]) {
            if from <= end && start <= to {
                let first = left.take().unwrap_or_else(|| self.point_at(start - begin));
                let second = self.point_at(end - begin);
                self.cut(&first, &second, DEPTH);
                left = Some(second);
            }
            if end - begin >= lively || end > to {
                return;
            }
            start = end;
        }
    }

    /// Does so in the last segment, which nothing ends.
    pub(super) fn end_between(&mut self) {
        if matches!(self.phase, Phase::Moving) {
            self.write_between();
        }
        self.ends.watched.clear();
    }

    /// For how long from the start of the segment something bends a line of this length.
    fn lively(&self, step: f64) -> f64 {
        let terms = self.path.terms.iter().map(|placed| placed.term);
        let bends = |term: &Term| matches!(term, Term::Ramp { .. }); // a parabola, however slow the mode
        let fast = terms.filter(|term| bends(term) || term.speed() * step > SLOW);
        fast.fold(0.0, |until, term| {
            let damping = -term.growth();
            f64::max(until, if damping > 0.0 { GONE / damping } else { f64::INFINITY })
        })
    }

    /// The outputs at a time since the start of the segment.
    fn point_at(&mut self, time: f64) -> Vec<f64> {
        let mut row = vec![0.0; self.columns()];
        self.write_inside(time, &mut row);
        row[0] = self.time + time;
        self.ends.rows.see(&row);
        for (span, output) in self.ends.span.iter_mut().zip(&self.ends.watched) {
            let value = row[1 + output];
            *span = [span[0].min(value), span[1].max(value)];
        }
        row
    }

    /// Keeps points between two that a line does not join.
    fn cut(&mut self, left: &[f64], right: &[f64], depth: usize) {
        let (from, length) = (left[0] - self.time, right[0] - left[0]);
        if depth == 0 || self.ends.written > MOST || length <= 0.0 {
            return;
        }
        let points = PLACES.map(|place| self.point_at(from + place * length));
        let (sizes, watched, spans) = (&self.ends.rows.sizes, &self.ends.watched, &self.ends.span);
        let off = |point: &Vec<f64>, place: f64| {
            watched.iter().map(|output| 1 + output).zip(spans).any(|(k, [low, high])| {
                let (a, b, v) = (left[k], right[k], point[k]);
                let local = a.abs().max(b.abs()).max(v.abs());
                let allowed = f64::min(FLAT * local, BENT * (high - low)) + TRACE * sizes[k];
                (v - a - place * (b - a)).abs() > allowed
            })
        };
        if !points.iter().zip(PLACES).any(|(point, place)| off(point, place)) {
            return;
        }
        let [first, second] = points;
        for (piece, end) in [([left, &first], &first), ([&first, &second], &second)] {
            self.cut(piece[0], piece[1], depth - 1);
            if let Some(kept) = &mut self.ends.kept {
                kept.extend_from_slice(end);
                self.ends.written += end.len();
            }
        }
        self.cut(&second, right, depth - 1);
    }
}

//! Rows at the ends of segments: on both sides of what jumps there.

use super::run::{Engine, Phase, SAME};
use super::terms::Point;
use crate::sides::{Home, Sides};

/// Rows at the ends of segments.
pub(super) struct Ends {
    /// rows on both sides of jumps, one after the other, where they are kept beside the table
    pub kept: Option<Vec<f64>>,
    /// from here on the ends of all segments are rows of the table [s]
    pub all_from: f64,
    pub rows: Sides,
    point: Point,
    x: Vec<f64>,
    v: Vec<f64>,
    d: Vec<f64>,
}

impl Default for Ends {
    fn default() -> Ends {
        Ends {
            kept: None,
            all_from: f64::INFINITY,
            rows: Sides::default(),
            point: Point::default(),
            x: Vec::new(),
            v: Vec::new(),
            d: Vec::new(),
        }
    }
}

impl Engine {
    /// Whether rows on both sides of jumps are kept.
    pub fn keep_sides(&mut self, keep: bool) {
        self.ends.kept = keep.then(Vec::new);
    }

    /// Makes the end of every segment from a time on a row, and two where something jumps.
    pub fn show_all_points(&mut self, from: f64) {
        self.ends.all_from = from;
    }

    /// The rows on both sides of jumps since the last call.
    pub fn take_sides(&mut self) -> Vec<f64> {
        self.ends.kept.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// Evaluates the outputs at one instant of the segment: as `write`, without work for further rows.
    fn sample(&mut self, time: f64, row: &mut [f64]) {
        let Some((id, mode)) = self.present.clone() else { return };
        let outputs = &self.outputs;
        let rows = self.registry.outputs(id, || outputs.rows(&mode));
        let ends = &mut self.ends;
        self.path.at((time - self.time).max(0.0), &mut ends.point);
        ends.x.resize(mode.n, 0.0);
        ends.v.resize(self.v.len(), 0.0);
        self.path.state(&ends.point, &mut ends.x);
        self.path.inputs(&self.segment, &ends.point, &mut ends.v);
        self.segment.rates(&ends.v, &mut ends.d);
        row[0] = time;
        rows.value.apply([&ends.x, &ends.v, &ends.d], &mut row[1..]);
        // a sum of terms that cancel has the rounding of the terms
        let sizes = &mut ends.rows.sizes;
        sizes.resize(row.len(), 0.0);
        rows.value.sizes([&ends.x, &ends.v, &ends.d], &mut sizes[1..]);
        if let Some(rate) = &rows.rate {
            self.path.state_rate(&ends.point, &mut ends.x);
            self.segment.curvatures(&ends.d, &mut ends.v);
            rate.apply_add([&ends.x, &ends.d, &ends.v], &mut row[1..]);
        }
    }

    /// Before a segment is left: the row at its end, if that is wanted.
    pub(super) fn note_left(&mut self) {
        if self.ends.kept.is_none() && self.end < self.ends.all_from {
            return;
        }
        let columns = self.columns();
        if self.ends.rows.open() {
            return;
        }
        let mut row = vec![0.0; columns];
        self.sample(self.end, &mut row);
        self.ends.rows.left(&row);
    }

    /// After the next segment has begun: the row at its start.
    pub(super) fn note_right(&mut self) {
        let (instant, moving) = (self.time, matches!(self.phase, Phase::Moving));
        // segments without length lie between the two sides of one instant
        if !self.ends.rows.open() || (moving && self.end <= instant) {
            return;
        }
        let mut right = vec![0.0; self.columns()];
        if moving {
            self.sample(instant, &mut right);
        }
        let row = self.rows.peek().filter(|t| (t - instant).abs() <= SAME * instant);
        let ends = &mut self.ends;
        let home = match &mut ends.kept {
            _ if instant >= ends.all_from => Home::Table,
            Some(kept) => Home::Beside(kept),
            None => return,
        };
        ends.rows.right(moving.then_some(&right[..]), instant, row, home);
    }
}

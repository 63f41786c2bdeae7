//! Rows at the ends of segments: on both sides of what jumps there.

use crate::limits::{Home, Sides};
use crate::modewise::functions::terms::Point;
use crate::modewise::output::rows::Table;
use crate::modewise::run::Engine;
use crate::modewise::run_state::Phase;
use crate::modewise::run_state::{Motion, State};
use crate::modewise::segments::single::Single;
use crate::waveform::INSTANT;

/// Rows at the ends of segments.
pub(in crate::modewise) struct Ends {
    /// rows on both sides of jumps, one after the other, where they are kept besides the table
    pub kept: Option<Vec<f64>>,
    /// from here on the ends of all segments are rows of the table [s]
    pub all_from: f64,
    pub rows: Sides,
    row: Vec<f64>,
    point: Point,
    single: Single,
}

impl Default for Ends {
    fn default() -> Ends {
        Ends {
            kept: None,
            all_from: f64::INFINITY,
            rows: Sides::default(),
            row: Vec::new(),
            point: Point::default(),
            single: Single::default(),
        }
    }
}

impl Engine {
    /// Whether rows on both sides of jumps are kept.
    pub fn keep_sides(&mut self, keep: bool) {
        self.table.ends.kept = keep.then(Vec::new);
    }

    /// Makes the end of every segment from a time on a row, and two where something jumps.
    pub fn show_all_points(&mut self, from: f64) {
        self.table.ends.all_from = from;
    }

    /// The rows on both sides of jumps since the last call.
    pub fn take_sides(&mut self) -> Vec<f64> {
        self.table.ends.kept.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// The outputs at the begin of the run, or where it waits: at the end of a segment or of an implicit step.
    pub fn at_wait(&mut self, begin: bool) -> Option<Vec<f64>> {
        if !matches!(self.span.phase, Phase::Moving) {
            return (!begin).then(|| self.table.stepped.clone());
        }
        if !begin && !self.expanded.active {
            self.motion.path.state(&self.motion.point, &mut self.state.x);
            self.motion.path.inputs(&self.motion.segment, &self.motion.point, &mut self.state.v);
        }
        let mut row = vec![0.0; self.columns()];
        row[0] = if begin { self.span.time } else { self.span.end };
        self.sample(!begin, &mut row);
        Some(row)
    }

    /// Evaluates the outputs at the end of the segment (`left`), whose state and inputs are known, or
    /// at its start.
    fn sample(&mut self, left: bool, row: &mut [f64]) {
        if self.expanded.active {
            let time = if left { self.span.end - self.span.time } else { 0.0 };
            return self.write_expanded(time, &mut row[1..]);
        }
        let Motion { present, path, segment, point: end } = &self.motion;
        let (Table { outputs, ends, .. }, State { x, v, .. }) = (&mut self.table, &self.state);
        let Some((id, mode)) = present else { return };
        let Ends { point, single, rows: Sides { sizes, .. }, .. } = ends;
        if !left && outputs.rate.is_some() {
            path.at(0.0, point);
        }
        let at =
            if left { (end, &x[..], &v[..]) } else { (&*point, path.start(), &segment.now[..]) };
        // a sum of terms that cancel has the rounding of the terms
        sizes.resize(row.len(), 0.0);
        let rows = self.registry.outputs(*id, mode, outputs, 1.0);
        let (row, sizes) = (&mut row[1..], &mut sizes[1..]);
        single.write((outputs, mode, rows), (path, segment), at, row, sizes);
    }

    /// Before a segment is left: the row at its end, if that is wanted.
    pub(in crate::modewise) fn note_left(&mut self) {
        if self.table.ends.kept.is_none() && self.span.end < self.table.ends.all_from {
            return;
        }
        if self.table.ends.rows.open() {
            return;
        }
        let mut row = self.blank_row(self.span.end);
        self.sample(true, &mut row);
        self.table.ends.rows.left(&row);
        self.table.ends.row = row;
    }

    /// After the next segment has begun: the row at its start.
    pub(in crate::modewise) fn note_right(&mut self) {
        let (instant, moving) = (self.span.time, matches!(self.span.phase, Phase::Moving));
        // segments without length lie between the two sides of one instant
        if !self.table.ends.rows.open() || (moving && self.span.end <= instant) {
            return;
        }
        let mut right = self.blank_row(instant);
        if moving {
            self.sample(false, &mut right);
        }
        let row = self.plan.rows.peek().filter(|t| (t - instant).abs() <= INSTANT * instant);
        let ends = &mut self.table.ends;
        let home = match &mut ends.kept {
            _ if instant >= ends.all_from => Home::Table,
            Some(kept) => Home::Beside(kept),
            None => return,
        };
        ends.rows.right(moving.then_some(&right[..]), instant, row, home);
        ends.row = right;
    }

    /// A row of zeros at an instant, in work space to be given back.
    fn blank_row(&mut self, time: f64) -> Vec<f64> {
        let mut row = std::mem::take(&mut self.table.ends.row);
        row.clear();
        row.resize(self.columns(), 0.0);
        row[0] = time;
        row
    }
}

//! Rows at the ends of steps: on both sides of what jumps there.

use crate::integrate::implicit::stepper::Stepper;
use crate::limits::{Home, Sides};

/// Rows at the ends of steps.
#[derive(Default)]
pub struct PointRows {
    rows: Sides,
}

impl PointRows {
    /// Before anything may jump: the row with the sources `s.state.u1`.
    pub fn note_left(&mut self, s: &mut Stepper) {
        if !s.recorder.samples.keep_sides && s.state.time < s.recorder.all_points {
            return;
        }
        if !self.rows.open() {
            s.write_left(s.state.time);
            self.rows.left(&s.recorder.left);
        }
    }

    /// At the end of a step: the row with the state as it is now; `row` is the table's own row
    /// there, if there is one.
    pub fn note_right(&mut self, s: &mut Stepper, row: Option<f64>) {
        let all = s.state.time >= s.recorder.all_points;
        if !all && !self.rows.open() {
            return;
        }
        let mut right = vec![0.0; s.recorder.columns()];
        s.write(s.state.time, &mut right);
        self.rows.left(&right); // nothing could jump here if there is no row before it
        let home = match &mut s.recorder.samples.sides {
            _ if all => Home::Table,
            sides => Home::Beside(sides),
        };
        self.rows.right(Some(&right), s.state.time, row, home);
    }

    /// Takes notice of a row of the table.
    pub fn see(&mut self, row: &[f64]) {
        self.rows.see(row);
    }

    /// A row of the table inside a step whose end follows.
    pub fn wait(&mut self, row: &[f64]) {
        self.rows.wait(row);
    }

    /// True if no row waits for its place in the table.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Writes the next row that waits, if there is one.
    pub fn next(&mut self, row: &mut [f64]) -> bool {
        self.rows.next(row)
    }
}

//! Rows inside segments: evaluated where they stand.

use super::bundle::Bundle;
use super::run::{Engine, SAME};
use super::stride::{Strides, FEW, RUN};
use super::terms::Point;

/// The outputs along the present segment.
#[derive(Default)]
pub(super) struct Inside {
    /// what is below belongs to the present segment
    pub ready: bool,
    values: Bundle,
    rates: Bundle,
    rated: bool,
    strides: Strides,
    anchor: Point,
    point: Point,
}

impl Inside {
    /// The outputs at a point.
    fn write(&self, point: &Point, row: &mut [f64]) {
        for (j, value) in row.iter_mut().enumerate() {
            *value = self.values.value(j, point);
            if self.rated {
                *value += self.rates.slope(j, point);
            }
        }
    }
}

impl Engine {
    /// Writes the next rows as far as they lie inside the segment and there is room for them;
    /// returns their number.
    pub(super) fn write_rows(&mut self, out: &mut [f64]) -> usize {
        let last = self.end >= self.stop && self.end < self.corner;
        let before = self.end - SAME * self.end;
        let (time, end) = (self.time, self.end);
        let within = move |target: &f64| *target < before || (last && *target <= end);
        let Some(first) = self.rows.peek().filter(within) else { return 0 };
        self.prepare_rows();
        let (step, columns) = (self.rows.step(), self.columns());
        let evenly = self.path.closed() && end - first >= FEW * step;
        if evenly {
            self.inside.strides.begin(&self.path, step);
        }
        let Engine { rows: clock, path, inside, .. } = self;
        // rows since the last one that was evaluated anew, and its time
        let (mut run, mut anchor) = (RUN, first);
        let mut count = 0;
        for row in out.chunks_exact_mut(columns) {
            let Some(target) = clock.peek().filter(within) else { break };
            let t = (target - time).max(0.0);
            // the last row need not stand where the others would have it
            let regular = (anchor + run as f64 * step - target).abs() <= SAME * target;
            row[0] = target;
            if evenly && run < RUN && regular {
                let mut point = std::mem::take(&mut inside.point);
                inside.strides.at(path, &inside.anchor, run, t, &mut point);
                inside.write(&point, &mut row[1..]);
                inside.point = point;
            } else {
                (run, anchor) = (0, target);
                path.at(t, &mut inside.anchor);
                if evenly {
                    inside.strides.anchor(path, &inside.anchor);
                }
                inside.write(&inside.anchor, &mut row[1..]);
            }
            run += 1;
            count += 1;
            clock.advance();
        }
        count
    }

    /// Brings the outputs of the mode into the terms of the segment.
    fn prepare_rows(&mut self) {
        let Some((id, mode)) = &self.present else { return };
        let inside = &mut self.inside;
        if inside.ready {
            return;
        }
        inside.ready = true;
        let outputs = &self.outputs;
        let rows = self.registry.outputs(*id, || outputs.rows(mode));
        self.path.bundle(&rows.value, &self.segment, &mut inside.values);
        inside.rated = rows.rate.is_some();
        if let Some(rate) = &rows.rate {
            self.path.bundle(rate, &self.segment, &mut inside.rates);
        }
    }
}

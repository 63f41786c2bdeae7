//! Outputs that drive another block of the circuit: as soon as a segment is known to its end, it is handed on.

use crate::modewise::output::pieces::POINTS;
use crate::modewise::run::Engine;
use crate::pieces::{transform, Pieces};
use crate::waveform::Polynomial;

/// Outputs with the polynomials that others read.
#[derive(Default)]
pub(in crate::modewise) struct Handed {
    pieces: Pieces,
    to: Vec<Polynomial>,
    /// from values at the points to coefficients
    transform: Vec<Vec<f64>>,
    coefficients: Vec<f64>,
    /// begin and length of the last piece
    last: [f64; 2],
}

impl Handed {
    /// Hands on what has been put down: a segment, or a step between whose ends nothing is known.
    fn hand_on(&mut self) {
        let Handed { pieces, to, transform, coefficients, last } = self;
        let mut first = true;
        pieces.hand_on(|begin, length, values| {
            for (values, polynomial) in values.chunks_exact(POINTS).zip(&*to) {
                coefficients.clear();
                coefficients.extend(transform.iter().enumerate().map(|(k, row)| {
                    let c: f64 = row.iter().zip(values).map(|(factor, v)| factor * v).sum();
                    // the points run from the end of [-1, 1] to its beginning
                    if k % 2 == 0 {
                        c
                    } else {
                        -c
                    }
                }));
                let largest = coefficients.iter().fold(0.0f64, |m, c| m.max(c.abs()));
                // the rest does not change a digit
                let kept = coefficients.iter().rposition(|c| largest + c.abs() > largest);
                coefficients.truncate(kept.map_or(1, |k| k + 1));
                polynomial.push(begin, length, coefficients, first);
            }
            (first, *last) = (false, [begin, length]);
        });
    }
}

impl Engine {
    /// Hands some outputs on, from the start to the end of the run.
    pub fn hand_on(&mut self, outputs: Vec<usize>, to: Vec<Polynomial>) {
        self.table.handed = Handed {
            pieces: Pieces::new(outputs, [0.0, f64::INFINITY], POINTS),
            to,
            transform: transform(POINTS),
            coefficients: Vec::with_capacity(POINTS),
            last: [0.0; 2],
        };
    }

    /// Hands the present segment on, whose end is known.
    pub(in crate::modewise) fn hand_segment(&mut self) {
        if self.table.handed.to.is_empty() {
            return;
        }
        // rows follow, and are worth what the points alone are not
        let rows = self
            .plan
            .rows
            .peek()
            .map_or(0.0, |row| (self.span.end - row) / self.plan.rows.step() + 1.0);
        self.prepare_rows(rows.max(0.0) + POINTS as f64);
        let mut handed = std::mem::take(&mut self.table.handed);
        self.split(&mut handed.pieces, self.span.end);
        handed.hand_on();
        self.table.handed = handed;
        self.compare_handed();
    }

    /// Compares the last piece with the closed form between its points.
    fn compare_handed(&mut self) {
        let [begin, length] = self.table.handed.last;
        if begin < self.span.time {
            return; // the segment has no length
        }
        let mut row = vec![0.0; self.columns()];
        let t = begin + 0.5 * length;
        self.write_inside(t - self.span.time, &mut row);
        let outputs = self.table.handed.pieces.outputs.iter();
        outputs.zip(&self.table.handed.to).for_each(|(&output, to)| to.compare(t, row[1 + output]));
    }

    /// Whether anything is handed on.
    pub(in crate::modewise) fn hands_on(&self) -> bool {
        !self.table.handed.to.is_empty()
    }

    /// Hands an implicit step on, with the outputs at its end.
    pub(in crate::modewise) fn hand_step(&mut self, step: [f64; 2], outputs: &[f64]) {
        self.table.handed.pieces.line(step, None, outputs);
        self.table.handed.hand_on();
    }
}

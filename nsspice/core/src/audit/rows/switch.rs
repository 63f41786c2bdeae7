//! Switches: which state a row shows, and whether the control has crossed the threshold that ends it.

use super::block::{largest, Block};
use super::{Size, Terms, Unit, Valve, Work, Worst};
use crate::audit::TOLERANCE;
use crate::waveform::INSTANT;

/// Part of the largest that a control is known to where it reaches a threshold.
const KNOWN: f64 = 1e-6;

/// One of them.
pub struct Gate {
    /// the number of its law: the line of the conducting state is the first, that of the other the second
    pub valve: usize,
    control: Terms,
    unit: Unit,
    on_above: f64,
    off_below: f64,
    inverted: bool,
    swing: f64,
    /// largest sum of the sizes of the terms of the control
    terms: f64,
    /// time and control of the last row
    last: Option<(f64, f64)>,
    worst: Worst,
}

impl Gate {
    /// Nothing is known of it yet.
    pub fn new(
        valve: usize,
        (control, unit): (Terms, Unit),
        [on_above, off_below]: [f64; 2],
        inverted: bool,
    ) -> Gate {
        let swing = on_above.abs().max(off_below.abs());
        Gate {
            valve,
            control,
            unit,
            on_above,
            off_below,
            inverted,
            swing,
            terms: 0.0,
            last: None,
            worst: Worst::default(),
        }
    }

    pub(super) fn take(&mut self, block: &Block, valve: &Valve, size: &Size, work: &mut Work) {
        let [controls, sizes, ..] = work;
        self.terms = self.terms.max(block.combine(&self.control, controls, sizes));
        self.swing = self.swing.max(largest(controls));
        let (times, rounding) =
            (block.column(0), size.rounding(self.unit).max(size.known * self.terms));
        let (low, high) = (self.off_below - rounding, self.on_above + rounding);
        let [on, off] = &valve.distances;
        for (k, &control) in controls.iter().enumerate() {
            // one state is excluded, and the control is beyond the threshold of the other
            let (on, off) = (on[k] <= TOLERANCE, off[k] <= TOLERANCE);
            let beyond = if on != self.inverted { low - control } else { control - high };
            if on != off && beyond > 0.0 {
                let last = if k > 0 { Some((times[k - 1], controls[k - 1])) } else { self.last };
                self.look(times[k], control, beyond, last);
            }
        }
        self.last = times.last().copied().zip(controls.last().copied());
    }

    /// Takes notice of a control that lies beyond its threshold, unless that is the rounding of the instant.
    fn look(&mut self, time: f64, control: f64, beyond: f64, last: Option<(f64, f64)>) {
        let (apart, moved) =
            last.map_or((f64::INFINITY, 0.0), |(t, c)| (time - t, (control - c).abs()));
        // on both sides of an instant either state is right
        if apart <= INSTANT * time.abs() {
            return;
        }
        let blur = (INSTANT * time.abs() / apart).min(1.0) * moved;
        let excess = (beyond - blur).max(0.0) / self.swing.max(f64::MIN_POSITIVE);
        self.worst.note(excess * TOLERANCE / KNOWN, time);
    }

    /// Measures errors by the same control in other rows, too.
    pub(super) fn see(&mut self, other: &Gate) {
        self.swing = self.swing.max(other.swing);
        self.terms = self.terms.max(other.terms);
    }

    pub(super) fn worst(&self) -> Worst {
        self.worst
    }
}

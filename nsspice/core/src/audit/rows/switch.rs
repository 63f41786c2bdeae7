//! Switches: which state a row shows, and whether the control has crossed the threshold that ends it.

use super::{value, Size, Terms, Valve, Worst};
use crate::audit::TOLERANCE;
use crate::waveform::INSTANT;

/// Part of the largest that a control is known to where it reaches a threshold.
const KNOWN: f64 = 1e-6;

/// One of them.
pub struct Gate {
    /// the number of its law: the line of the conducting state is the first, that of the other the second
    pub valve: usize,
    control: Terms,
    on_above: f64,
    off_below: f64,
    inverted: bool,
    swing: f64,
    last: Option<f64>,
    worst: Worst,
}

impl Gate {
    /// Nothing is known of it yet.
    pub fn new(
        valve: usize,
        control: Terms,
        [on_above, off_below]: [f64; 2],
        inverted: bool,
    ) -> Gate {
        let swing = on_above.abs().max(off_below.abs());
        Gate {
            valve,
            control,
            on_above,
            off_below,
            inverted,
            swing,
            last: None,
            worst: Worst::default(),
        }
    }

    pub(super) fn take(&mut self, before: &[f64], row: &[f64], valve: &Valve, size: &Size) {
        let control = value(&self.control, row);
        self.swing = self.swing.max(control.abs());
        let moved = self.last.map_or(0.0, |last| (control - last).abs());
        self.last = Some(control);
        let apart = before.first().map_or(f64::INFINITY, |time| row[0] - time);
        // on both sides of an instant either state is right
        if apart <= INSTANT * row[0].abs() {
            return;
        }
        let [on, off] = valve.distances(size);
        let up = match (on <= TOLERANCE, off <= TOLERANCE) {
            (true, false) => !self.inverted,
            (false, true) => self.inverted,
            _ => return,
        };
        let beyond = if up { self.off_below - control } else { control - self.on_above };
        let blur = (INSTANT * row[0].abs() / apart).min(1.0) * moved;
        let excess = (beyond - blur).max(0.0) / self.swing.max(f64::MIN_POSITIVE);
        self.worst.note(excess * TOLERANCE / KNOWN, row[0]);
    }

    pub(super) fn worst(&self) -> Worst {
        self.worst
    }
}

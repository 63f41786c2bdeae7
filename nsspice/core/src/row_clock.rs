//! Instants of the output rows: multiples of their distance, and the end of the run.

/// Rows at `start + k step` up to `stop`, and at `stop`.
#[derive(Clone, Copy, Debug)]
pub struct RowClock {
    start: f64,
    step: f64,
    stop: f64,
    /// number of the last row at a multiple of the step
    whole: u64,
    count: u64,
    /// number of the next one
    next: u64,
}

impl RowClock {
    /// A clock before its first row.
    pub fn new(start: f64, step: f64, stop: f64) -> RowClock {
        let whole = ((stop - start) / step * (1.0 + 1e-12)).floor();
        let rest = stop - (start + whole * step) > 1e-9 * step;
        let whole = whole as u64;
        RowClock { start, step, stop, whole, count: whole + 1 + u64::from(rest), next: 0 }
    }

    /// Time of the first row [s].
    pub fn start(&self) -> f64 {
        self.start
    }

    /// Distance of the rows [s].
    pub fn step(&self) -> f64 {
        self.step
    }

    /// Number of the last row at a multiple of the step.
    pub fn whole(&self) -> u64 {
        self.whole
    }

    /// Number of rows in all.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Time of a row [s].
    #[inline]
    pub fn at(&self, row: u64) -> f64 {
        // by rounding a multiple of the step may lie beyond the end
        (self.start + row as f64 * self.step).min(self.stop)
    }

    /// Time of the next row [s]; none after the last.
    #[inline]
    pub fn peek(&self) -> Option<f64> {
        (self.next < self.count).then(|| self.at(self.next))
    }

    /// Time of the next row [s]; infinite after the last.
    pub fn time(&self) -> f64 {
        self.peek().unwrap_or(f64::INFINITY)
    }

    /// Goes on to the next row.
    #[inline]
    pub fn advance(&mut self) {
        self.next += 1;
    }

    /// The row at `time`, if one is there up to rounding of steps of this `length`; else `time`.
    pub fn meet(&self, time: f64, length: f64) -> f64 {
        let row = self.start + ((time - self.start) / self.step).round() * self.step;
        if (row - time).abs() <= 1e-9 * length && row <= self.stop {
            row
        } else {
            time
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(mut clock: RowClock) -> Vec<f64> {
        let next = || clock.peek().inspect(|_| clock.advance());
        std::iter::from_fn(next).collect()
    }

    #[test]
    fn the_last_row_is_the_end() {
        // three times 0.1 is 0.30000000000000004
        assert_eq!(all(RowClock::new(0.0, 0.1, 0.3)), [0.0, 0.1, 0.2, 0.3]);
        assert_eq!(all(RowClock::new(0.1, 0.2, 0.4)), [0.1, 0.1 + 0.2, 0.4]);
    }
}

//! Which instants are visited: the output grid, its subdivision into steps, and source breakpoints.
//!
//! Times are computed by multiplication from the start of a piece, never by adding up steps, and
//! breakpoints are hit exactly; a breakpoint off the grid costs one short step to it and one to the grid.

use crate::row_clock::RowClock;
use crate::waveform::{Side, Waveform, INSTANT};

/// The next instant to step to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// end of the step [s]; a breakpoint's own time where there is one
    pub time: f64,
    /// the time an output row here is labelled with: the grid's
    pub label: f64,
    /// length of the step [s]; on the grid exactly the nominal one, for any rounding of `time`
    pub length: f64,
    /// the end is an output row
    pub row: bool,
    /// a source jumps at the end
    pub jump: bool,
}

/// No output rows within a piece.
const NEVER: u64 = u64::MAX;

/// A uniform interval of steps `origin + k length`, `k = 1..=count`.
#[derive(Clone, Debug)]
struct Piece {
    origin: f64,
    end: f64,
    length: f64,
    count: u64,
    /// an output row every this many steps
    row_every: u64,
    /// distance of the output rows, so that they are multiples of it and not of the step
    row_step: f64,
}

/// The plan of instants of one run.
#[derive(Clone, Debug)]
pub struct Clock {
    pieces: Vec<Piece>,
    piece: usize,
    /// next grid point of the current piece
    next: u64,
    /// grid points to the next output row, that one included
    until_row: u64,
    /// number of that output row in the present piece
    row: u64,
    now: f64,
    /// next breakpoint of any source and whether it is a jump; infinite if there is none
    breakpoint: (f64, bool),
    /// the last target was a breakpoint inside a grid step
    inside: bool,
    rows: u64,
    first_row_now: bool,
}

impl Clock {
    /// Steps of length `step` (at most) from `start` to `stop`; rows at `out_start + k out_step` and
    /// at `stop`.
    pub fn grid(start: f64, stop: f64, step: f64, out_start: f64, out_step: f64) -> Clock {
        let mut pieces = Vec::new();
        let whole = |length: f64, unit: f64| ((length / unit) * (1.0 - 1e-12)).ceil().max(1.0);
        if out_start > start {
            let count = whole(out_start - start, step);
            pieces.push(Piece {
                origin: start,
                end: out_start,
                length: (out_start - start) / count,
                count: count as u64,
                row_every: NEVER,
                row_step: 0.0,
            });
        }
        let rows = RowClock::new(out_start, out_step, stop);
        let per_row = whole(out_step, step);
        let reached = rows.at(rows.whole());
        if rows.whole() > 0 {
            pieces.push(Piece {
                origin: out_start,
                end: reached,
                length: out_step / per_row,
                count: rows.whole() * per_row as u64,
                row_every: per_row as u64,
                row_step: out_step,
            });
        }
        if rows.count() > rows.whole() + 1 {
            let rest = stop - reached;
            let count = whole(rest, step);
            pieces.push(Piece {
                origin: reached,
                end: stop,
                length: rest / count,
                count: count as u64,
                row_every: NEVER,
                row_step: 0.0,
            });
        }
        let mut clock = Clock {
            pieces,
            piece: 0,
            next: 1,
            until_row: 0,
            row: 1,
            now: start,
            breakpoint: (f64::NEG_INFINITY, false),
            inside: false,
            rows: rows.count(),
            first_row_now: out_start <= start,
        };
        clock.enter_piece();
        clock
    }

    fn enter_piece(&mut self) {
        self.next = 1;
        self.row = 1;
        self.until_row = self.pieces.get(self.piece).map_or(NEVER, |p| p.row_every);
    }

    /// Number of output rows in all, the one at the start included.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// True if the start itself is an output row.
    pub fn first_row_now(&self) -> bool {
        self.first_row_now
    }

    /// The next instant, or None at the end of the run.
    pub fn next(&mut self, waveforms: &[Waveform]) -> Option<Target> {
        let piece = self.pieces.get(self.piece)?;
        let (k, h) = (self.next, piece.length);
        let at_end = k == piece.count;
        let at_row = self.until_row == 1 || at_end;
        let grid = if at_end {
            piece.end
        } else if at_row {
            piece.origin + self.row as f64 * piece.row_step
        } else {
            piece.origin + k as f64 * h
        };
        if self.breakpoint.0 <= self.now {
            self.breakpoint = first_breakpoint(waveforms, self.now);
        }
        let near = 1e-9 * h;
        let mut target = Target { time: grid, label: grid, length: h, row: at_row, jump: false };
        let (breakpoint, jump) = self.breakpoint;
        if breakpoint < grid - near {
            let length = breakpoint - self.now;
            target = Target { time: breakpoint, label: breakpoint, length, row: false, jump };
            self.inside = true;
        } else {
            if self.inside {
                target.length = grid - self.now;
                self.inside = false;
            }
            if breakpoint <= grid + near {
                // keep the breakpoint's own time: sources are evaluated there
                target.time = breakpoint;
                target.jump = jump;
            }
            self.next += 1;
            // counted, since a division per step would be a good part of a small step's cost
            if self.until_row == 1 {
                self.until_row = piece.row_every;
                self.row += 1;
            } else {
                self.until_row -= 1;
            }
            if at_end {
                self.piece += 1;
                self.enter_piece();
            }
        }
        self.now = target.time;
        Some(target)
    }
}

/// Earliest breakpoint of all sources after `t`; breakpoints within rounding of each other are one.
pub(in crate::integrate) fn first_breakpoint(waveforms: &[Waveform], t: f64) -> (f64, bool) {
    let breakpoints: Vec<_> = waveforms.iter().filter_map(|w| w.next_breakpoint(t)).collect();
    let first = breakpoints.iter().map(|c| c.time).fold(f64::INFINITY, f64::min);
    let same = first + INSTANT * first.abs();
    // the latest of the merged instants: a value taken there is past every one of the edges
    let merged = || breakpoints.iter().filter(|c| c.time <= same);
    (merged().map(|c| c.time).fold(first, f64::max), merged().any(|c| c.jump))
}

/// The same, and whether something may jump there: a value, or what follows the slopes of sources with `kinks`.
pub(in crate::integrate) fn next_breakpoint(
    waveforms: &[Waveform],
    kinks: &[bool],
    t: f64,
) -> (f64, bool) {
    let (time, jump) = first_breakpoint(waveforms, t);
    let here = |w: &Waveform| w.next_breakpoint_time(t).is_some_and(|c| c <= time) && w.bends(t);
    let kink = waveforms.iter().zip(kinks).any(|(w, &kink)| kink && here(w));
    (time, jump || kink || waveforms.iter().any(|w| w.is_set_at(time)))
}

/// Up to where all waveforms are known.
pub(in crate::integrate) fn known(waveforms: &[Waveform]) -> f64 {
    waveforms.iter().map(Waveform::known).fold(f64::INFINITY, f64::min)
}

/// Writes the value of every waveform at `t`.
pub fn evaluate(waveforms: &[Waveform], t: f64, side: Side, out: &mut [f64]) {
    for (value, w) in out.iter_mut().zip(waveforms) {
        *value = w.value(t, side);
    }
}

/// Sources at a time after `start`: after their next breakpoint, `breakpoint`, as they would go on without it.
pub(in crate::integrate) fn evaluate_after(
    waveforms: &[Waveform],
    t: f64,
    start: f64,
    breakpoint: f64,
    u: &mut [f64],
) {
    // after an edge at the begin and before that at the breakpoint, within rounding of them too
    let side = if t - start <= breakpoint - t { Side::Right } else { Side::Left };
    for (u, w) in u.iter_mut().zip(waveforms) {
        *u = if t <= breakpoint { w.value(t, side) } else { w.continued(t, start, breakpoint) };
    }
}

/// Writes the slope of every waveform to the right of `t`.
pub(in crate::integrate) fn slopes(waveforms: &[Waveform], t: f64, out: &mut [f64]) {
    for (slope, w) in out.iter_mut().zip(waveforms) {
        *slope = w.slope(t);
    }
}

/// The slope of every waveform to the right of `t`.
pub(in crate::integrate) fn slopes_at(waveforms: &[Waveform], t: f64) -> Vec<f64> {
    waveforms.iter().map(|w| w.slope(t)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(clock: &mut Clock, sources: &[Waveform]) -> Vec<Target> {
        let mut out = Vec::new();
        while let Some(t) = clock.next(sources) {
            out.push(t);
        }
        out
    }

    #[test]
    fn rows_lie_on_multiples_of_the_output_step() {
        let mut clock = Clock::grid(0.0, 1.0, 0.03, 0.0, 0.1);
        assert_eq!(clock.rows(), 11);
        let visited = all(&mut clock, &[]);
        let rows: Vec<f64> = visited.iter().filter(|t| t.row).map(|t| t.time).collect();
        let expected: Vec<f64> = (1..=10).map(|k| k as f64 * 0.1).collect();
        assert_eq!(rows, expected);
        assert_eq!(visited.len(), 40);
        assert!(visited.iter().all(|t| t.length == 0.025));
    }

    #[test]
    fn late_start_and_odd_stop_are_hit() {
        let mut clock = Clock::grid(0.0, 1.05, 0.05, 0.33, 0.1);
        let visited = all(&mut clock, &[]);
        let rows: Vec<f64> = visited.iter().filter(|t| t.row).map(|t| t.time).collect();
        assert_eq!(clock.rows() as usize, rows.len());
        assert_eq!(rows[0], 0.33);
        assert_eq!(*rows.last().unwrap(), 1.05);
    }

    #[test]
    fn breakpoints_off_the_grid_are_hit_exactly() {
        let pulse = [0.0, 1.0, 0.33, 0.0, 0.0, 0.21, 10.0, f64::INFINITY];
        let source = Waveform::new("pulse", &pulse, f64::NAN, 1.0).unwrap();
        let mut clock = Clock::grid(0.0, 1.0, 0.1, 0.0, 0.1);
        let visited = all(&mut clock, &[source]);
        assert_eq!(visited.len(), 12);
        let jumps: Vec<f64> = visited.iter().filter(|t| t.jump).map(|t| t.time).collect();
        assert_eq!(jumps, vec![0.33, 0.33 + 0.21]);
        let length: f64 = visited.iter().map(|t| t.length).sum();
        assert!((length - 1.0).abs() < 1e-12);
    }

    #[test]
    fn breakpoints_on_the_grid_make_no_extra_step() {
        let pulse = [0.0, 1.0, 0.3, 0.0, 0.0, 0.2, 10.0, f64::INFINITY];
        let source = Waveform::new("pulse", &pulse, f64::NAN, 1.0).unwrap();
        let mut clock = Clock::grid(0.0, 1.0, 0.1, 0.0, 0.1);
        let visited = all(&mut clock, &[source]);
        assert_eq!(visited.len(), 10);
        assert_eq!(visited.iter().filter(|t| t.jump).count(), 2);
        assert!(visited.iter().all(|t| t.length == 0.1));
    }
}

//! When a single implicit step has to step across what cannot be located, and how long it is.
//!
//! Where events accumulate (Zeno) and where steps fail the time hardly moves.  An implicit step needs no instants.
//! The first is short; while the next one is needed soon after the last they are doubled, and fewer events
//! are waited for: what accumulates goes on doing so.  Switches that chatter are sampled
//! ([`crate::sampling`]), once a step has not led away from there.

/// Level of the first such step.
pub(in crate::integrate::sdirk) const FALLBACK_LEVEL: usize = 20;
/// That of the longest.
const LONGEST: usize = 10;
/// Events in a row, without an accepted whole step between them, before a step is forced; and soon after
/// such a step.
const IN_A_ROW: u32 = 12;
const AGAIN: u32 = 2;
/// Soon is within so many lengths of the last one; so long these events may take.  A step that overshoots the
/// threshold may take far longer to come back.
const SOON: f64 = 4096.0;
/// See [`SOON`]: five lengths for each of [`IN_A_ROW`] events.
const BURST: f64 = 64.0;
/// Most implicit steps in a row before others are tried.
const PATIENCE: u32 = 8;
/// Steps without a solution or with too large an error, while the time hardly moves, before one is forced.
const FAILED_IN_A_ROW: u32 = 40;

/// Counts what keeps the time from moving.
pub struct Fallback {
    /// events without a whole step between them, and when the first of them was [s]
    events: u32,
    since: f64,
    /// since when steps fail [s], and how many have
    failures: (f64, u32),
    level: usize,
    /// end and length of the last one [s]
    last: (f64, f64),
    /// how many are to follow one another, and how many are still to come
    wait: u32,
    left: u32,
}

impl Fallback {
    /// Nothing keeps the time from moving yet.
    pub fn new() -> Fallback {
        let never = f64::NEG_INFINITY;
        Fallback {
            events: 0,
            since: never,
            failures: (never, 0),
            level: FALLBACK_LEVEL,
            last: (never, 0.0),
            wait: 0,
            left: 0,
        }
    }

    /// Notes an event at a time, without a whole step since the last one.  So many events that an implicit
    /// step, which is at least `little` long, would not step across do not accumulate: they are counted again.
    pub fn note_event(&mut self, time: f64, little: f64) {
        let slow = self.events >= IN_A_ROW && time - self.since > BURST * little;
        if self.events == 0 || slow {
            (self.events, self.since) = (0, time);
        }
        self.events += 1;
    }

    /// Notes that a whole step has led away from the last event.
    pub fn note_progress(&mut self) {
        self.events = 0;
    }

    /// Notes that a step from `time` has failed; whether so many have, while the time has moved less than
    /// `little`, that an implicit one has to step across what is there.
    pub fn is_stuck(&mut self, time: f64, little: f64) -> bool {
        if time > self.failures.0 + little {
            self.failures = (time, 0);
        }
        self.failures.1 += 1;
        let stuck = self.failures.1 > FAILED_IN_A_ROW;
        if stuck {
            self.failures.1 = 0;
        }
        stuck
    }

    fn is_soon(&self, time: f64) -> bool {
        let (end, length) = self.last;
        let burst = self.events == 0 || time - self.since <= BURST * length;
        burst && time - end <= SOON * length
    }

    /// Whether events accumulate at a time.
    pub fn is_crowded(&self, time: f64) -> bool {
        let most = if self.is_soon(time) { AGAIN } else { IN_A_ROW };
        self.left > 0 || self.events > most
    }

    /// Whether the events that accumulate began to do so immediately after an implicit step: what it has stepped across
    /// is still there.  The length of that step is the only measure; that of the run says nothing of it.
    pub fn has_returned(&self) -> bool {
        self.events > 0 && self.since - self.last.0 <= BURST * self.last.1
    }

    /// The level of an implicit step from a time on.
    pub fn enter(&mut self, time: f64) -> usize {
        let again = self.is_soon(time);
        let crowded = self.is_crowded(time);
        if self.left > 0 {
            self.left -= 1;
        } else {
            self.wait = if again && crowded { (2 * self.wait).clamp(1, PATIENCE) } else { 0 };
            self.left = self.wait;
        }
        self.level = if again { self.level.saturating_sub(1).max(LONGEST) } else { FALLBACK_LEVEL };
        self.level
    }

    /// Notes such a step by its end and its length.
    pub fn leave(&mut self, end: f64, length: f64) {
        self.last = (end, length);
        self.events = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LITTLE: f64 = 1e-9;

    /// Notes events at instants that are `apart`.
    fn after_events(count: u32, apart: f64) -> Fallback {
        let mut fallback = Fallback::new();
        (0..count).for_each(|k| fallback.note_event(1.0 + apart * f64::from(k), LITTLE));
        fallback
    }

    #[test]
    fn events_pile_up_if_they_leave_no_time() {
        assert!(!after_events(IN_A_ROW, 0.1 * LITTLE).is_crowded(1.0));
        assert!(after_events(IN_A_ROW + 1, 0.1 * LITTLE).is_crowded(1.0));
        // those that an implicit step would not step across are counted again
        assert!(!after_events(3 * IN_A_ROW, BURST * LITTLE).is_crowded(1.0));
        let mut progress = after_events(IN_A_ROW + 1, 0.0);
        progress.note_progress();
        assert!(!progress.is_crowded(1.0));
    }

    #[test]
    fn steps_that_follow_one_another_are_doubled() {
        let mut fallback = after_events(IN_A_ROW + 1, 0.0);
        assert_eq!(fallback.enter(1.0), FALLBACK_LEVEL);
        let mut time = 1.0;
        for level in (LONGEST..FALLBACK_LEVEL).rev().chain([LONGEST, LONGEST]) {
            fallback.leave(time, LITTLE);
            assert_eq!(fallback.enter(time), level);
            time += LITTLE;
        }
        // long after the last one the first is short again
        assert_eq!(fallback.enter(time + 2.0 * SOON * LITTLE), FALLBACK_LEVEL);
    }

    #[test]
    fn failures_count_while_the_time_hardly_moves() {
        let mut fallback = Fallback::new();
        let stuck = |fallback: &mut Fallback, k: u32, apart: f64| {
            fallback.is_stuck(1.0 + apart * f64::from(k), LITTLE)
        };
        let still = (0..=FAILED_IN_A_ROW).map(|k| stuck(&mut fallback, k, 0.0)).collect::<Vec<_>>();
        assert_eq!(still.iter().position(|&s| s), Some(FAILED_IN_A_ROW as usize));
        assert!((0..1000).all(|k| !stuck(&mut fallback, k, 1.5 * LITTLE)));
    }

    #[test]
    fn what_was_passed_over_returns_at_once() {
        let mut fallback = Fallback::new();
        fallback.leave(1.0, LITTLE);
        assert!(!fallback.has_returned());
        fallback.note_event(1.0 + LITTLE, LITTLE);
        assert!(fallback.has_returned());
        fallback.leave(1.0, LITTLE);
        fallback.note_event(1.0 + 2.0 * BURST * LITTLE, LITTLE);
        assert!(!fallback.has_returned());
    }
}

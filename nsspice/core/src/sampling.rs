//! Switches that chatter look at their controls at fixed instants only.
//!
//! A switch without hysteresis whose states take its own control back across the threshold changes without
//! end: between two changes lies what rounding leaves.  The motion is one along the threshold (A. F. Filippov,
//! *Differential Equations with Discontinuous Righthand Sides* (1988), doi:10.1007/978-94-015-7793-9), and a
//! switch that reacts a little later moves about it: the nearer, the shorter it waits (V. I. Utkin, *Sliding
//! Modes in Control and Optimization* (1992), doi:10.1007/978-3-642-84379-2, chapter 2).  All that chatter look
//! at common instants, so that the two switches of a leg go on changing together.

use crate::switch::Switch;
use crate::waveform::INSTANT;

/// Turns while events accumulate that are chatter.
const AGAIN: u32 = 2;
/// A switch that stays as it is for so many looks has ceased to chatter.
const QUIET: u32 = 16;
/// So has one whose control has gone away from its threshold at so many looks in a row: what slides is driven
/// back to it by either state of the switch (Filippov), for any time between two looks.
const LEAVING: u32 = 3;

/// Which switches are sampled, and when.
pub struct Sampling {
    /// between two looks [s]
    pub interval: f64,
    /// the next look [s]; infinite while nobody is sampled
    pub next: f64,
    /// which switches are sampled
    pub on: Vec<bool>,
    /// how often each has turned at a look, and how far its control had passed the threshold at most
    turns: Vec<(u64, f64)>,
    /// looks since the last turn
    quiet: Vec<u32>,
    /// how far each control was from its threshold at the last look, and for how many looks it has gone away
    leaving: Vec<(f64, u32)>,
    /// turns at thresholds since events began to accumulate
    turned: Vec<u32>,
}

impl Sampling {
    /// Nobody is sampled yet.
    pub fn new(switches: usize, interval: f64) -> Sampling {
        let none = vec![false; switches];
        let zeros = vec![0; switches];
        Sampling {
            interval,
            next: f64::INFINITY,
            on: none,
            turns: vec![(0, 0.0); switches],
            quiet: zeros.clone(),
            leaving: vec![(f64::INFINITY, 0); switches],
            turned: zeros,
        }
    }

    /// Notes that a switch turns at its threshold.
    pub fn note(&mut self, switch: usize) {
        self.turned[switch] += 1;
    }

    /// Notes that events do not accumulate.
    pub fn forget(&mut self) {
        self.turned.fill(0);
    }

    /// Events have accumulated at a time: samples the switches that turned again and again; false if there are
    /// none but those that are.
    pub fn begin(&mut self, time: f64) -> bool {
        let again = |&k: &usize| self.turned[k] >= AGAIN && !self.on[k];
        let chattering: Vec<usize> = (0..self.on.len()).filter(again).collect();
        self.sample(&chattering, time);
        self.forget();
        !chattering.is_empty()
    }

    /// Samples switches from a time on.
    pub fn sample(&mut self, switches: &[usize], time: f64) {
        for &k in switches {
            if !self.on[k] {
                (self.on[k], self.quiet[k]) = (true, 0);
                self.leaving[k] = (f64::INFINITY, 0);
            }
        }
        if !switches.is_empty() && self.next.is_infinite() {
            self.plan(time);
        }
    }

    fn plan(&mut self, time: f64) {
        self.next = ((latest(time) / self.interval).floor() + 1.0) * self.interval;
    }

    /// Whether the sampled switches look at their controls at a time; if so, plans the next look.
    pub fn looks(&mut self, time: f64) -> bool {
        if latest(time) < self.next {
            return false;
        }
        self.plan(time);
        self.quiet.iter_mut().for_each(|quiet| *quiet += 1);
        true
    }

    /// Notes how far the control of a switch is from its threshold at a look at which it does not turn; of no
    /// account if the switch is not sampled.
    pub fn stays(&mut self, switch: usize, distance: f64) {
        let (last, count) = self.leaving[switch];
        self.leaving[switch] = (distance, if distance > last { count + 1 } else { 0 });
    }

    /// Notes that a switch turns at a look at which its control lies so far beyond its threshold.
    pub fn turn(&mut self, switch: usize, beyond: f64) {
        self.quiet[switch] = 0;
        self.leaving[switch] = (f64::INFINITY, 0);
        let (count, most) = &mut self.turns[switch];
        (*count, *most) = (*count + 1, most.max(beyond));
    }

    /// The switches that have turned while they were sampled: the pair of each, how often, and how late (the part
    /// of its `scale` by which its control had passed the threshold); and the time between two looks [s].
    pub fn chattering(
        &self,
        switches: &[Switch],
        scale: impl Fn(usize) -> f64,
    ) -> (Vec<(usize, u64, f64)>, f64) {
        let turned = (0..switches.len()).filter(|&k| self.turns[k].0 > 0).map(|k| {
            let (count, most) = self.turns[k];
            (switches[k].pair, count, most / scale(k))
        });
        (turned.collect(), self.interval)
    }

    /// Lets those go that have come to rest; true if any.
    pub fn release(&mut self) -> bool {
        let mut any = false;
        for (on, (quiet, leaving)) in self.on.iter_mut().zip(self.quiet.iter().zip(&self.leaving)) {
            let over = *quiet >= QUIET || leaving.1 >= LEAVING;
            any |= *on && over;
            *on &= !over;
        }
        if any && !self.on.contains(&true) {
            self.next = f64::INFINITY;
        }
        any
    }
}

/// The latest time that cannot be distinguished from this one.
fn latest(time: f64) -> f64 {
    time + INSTANT * time.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_turns_again_and_again_is_sampled_until_it_rests() {
        let mut sampling = Sampling::new(2, 0.25);
        assert!(!sampling.looks(1e9));
        sampling.note(0);
        sampling.note(1);
        sampling.forget();
        sampling.note(0);
        sampling.note(1);
        sampling.note(1);
        assert!(sampling.begin(1.1));
        assert_eq!((sampling.on.clone(), sampling.next), (vec![false, true], 1.25));
        assert!(!sampling.begin(1.1), "nobody else chatters");
        assert!(!sampling.looks(1.2));
        for k in 0..QUIET {
            assert!(sampling.looks(1.25 + 0.25 * f64::from(k)));
            assert_eq!(sampling.next, 1.5 + 0.25 * f64::from(k));
            assert_eq!(sampling.release(), k + 1 == QUIET);
        }
        assert!(sampling.next.is_infinite());
    }

    #[test]
    fn what_leaves_its_threshold_is_let_go_at_once() {
        let mut sampling = Sampling::new(1, 1.0);
        sampling.sample(&[0], 0.0);
        for k in 1..=64 {
            // sliding: over the threshold, then slowly back to it
            assert!(sampling.looks(f64::from(k)));
            match k % 4 {
                0 => sampling.turn(0, 0.25),
                phase => sampling.stays(0, 1.0 / f64::from(phase)),
            }
            assert!(!sampling.release(), "{k}");
        }
        for k in 65..=68 {
            assert!(sampling.looks(f64::from(k)));
            sampling.stays(0, f64::from(k));
            assert_eq!(sampling.release(), k == 68, "{k}");
        }
        let switch = Switch {
            pair: 7,
            control: vec![],
            on_above: 0.0,
            off_below: 0.0,
            inverted: false,
            latching: false,
            at_threshold: crate::switch::AtThreshold::Reached,
        };
        assert_eq!(sampling.chattering(&[switch], |_| 0.5), (vec![(7, 16, 0.5)], 1.0));
    }
}

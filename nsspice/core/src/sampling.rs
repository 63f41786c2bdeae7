//! Switches that chatter look at their controls at fixed instants only.
//!
//! A switch without hysteresis whose states take its own control back across the threshold changes without
//! end: between two changes lies what rounding leaves.  The motion is one along the threshold (A. F. Filippov,
//! *Differential Equations with Discontinuous Righthand Sides* (1988), doi:10.1007/978-94-015-7793-9), and a
//! switch that reacts a little later moves about it: the nearer, the shorter it waits (V. I. Utkin, *Sliding
//! Modes in Control and Optimization* (1992), doi:10.1007/978-3-642-84379-2, chapter 2).  All that chatter look
//! at common instants, so that the two switches of a leg go on changing together.

use crate::switch::Switch;

/// Turns while events pile up that are chatter.
const AGAIN: u32 = 2;
/// A switch that stays as it is for so many looks has ceased to chatter.
const QUIET: u32 = 16;
/// Turns at looks that are worth a word.
const TOLD: u64 = 8;
/// An instant this near to the next look, as a part of the interval, is that.
const NEAR: f64 = 1e-6;

/// Which switches are sampled, and when.
pub struct Sampling {
    /// between two looks [s]
    pub interval: f64,
    /// the next look [s]; infinite while nobody is sampled
    pub next: f64,
    /// which switches are sampled
    pub on: Vec<bool>,
    /// how often each has turned at a look
    turns: Vec<u64>,
    /// looks since the last turn
    quiet: Vec<u32>,
    /// turns at thresholds since events began to pile up
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
            turns: vec![0; switches],
            quiet: zeros.clone(),
            turned: zeros,
        }
    }

    /// Notes that a switch turns at its threshold.
    pub fn note(&mut self, switch: usize) {
        self.turned[switch] += 1;
    }

    /// Notes that events do not pile up.
    pub fn forget(&mut self) {
        self.turned.fill(0);
    }

    /// Events have piled up at a time: samples the switches that turned again and again; false if there are
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
            }
        }
        if !switches.is_empty() && self.next.is_infinite() {
            self.plan(time);
        }
    }

    fn plan(&mut self, time: f64) {
        self.next = ((time / self.interval + NEAR).floor() + 1.0) * self.interval;
    }

    /// Whether the sampled switches look at their controls at a time; if so, plans the next look.
    pub fn looks(&mut self, time: f64) -> bool {
        if time < self.next - NEAR * self.interval {
            return false;
        }
        self.plan(time);
        self.quiet.iter_mut().for_each(|quiet| *quiet += 1);
        true
    }

    /// Notes that a switch turns at a look.
    pub fn turn(&mut self, switch: usize) {
        self.quiet[switch] = 0;
        self.turns[switch] += 1;
    }

    /// Pairs of the switches that have gone on turning while they were sampled, and the time between two
    /// looks [s].
    pub fn chattering(&self, switches: &[Switch]) -> (Vec<usize>, f64) {
        let told = switches.iter().zip(&self.turns).filter(|e| *e.1 >= TOLD);
        (told.map(|e| e.0.pair).collect(), self.interval)
    }

    /// Lets those go that have come to rest; true if any.
    pub fn release(&mut self) -> bool {
        let mut any = false;
        for (on, quiet) in self.on.iter_mut().zip(&self.quiet) {
            any |= *on && *quiet >= QUIET;
            *on &= *quiet < QUIET;
        }
        if any && !self.on.contains(&true) {
            self.next = f64::INFINITY;
        }
        any
    }
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
}

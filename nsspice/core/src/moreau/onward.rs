//! Right after an instant: sources move on, and laws tell the rates of what is stored.
//!
//! The short steps that show the values after a jump or a corner hold the sources, and are so short that of
//! what they move little more than rounding is left in the unknowns.  Rates therefore are those of the laws,
//!
//! ```text
//! (E + h G) z' + h A l' = s - G z - A l        where something is stored,
//!         G z'  +    A l' = S u'               where nothing is,
//! ```
//!
//! with a small `h`: the increment of a step, without the unknowns to which it would be added (E. Hairer,
//! G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., Springer 1996, section VII.3).  What of it
//! does not vanish with `h` is what the motion of the sources itself calls for: the current of a capacitor
//! across a source that rises.

use super::clock::slopes;
use super::failure::Outcome;
use super::increment::{AGAIN, BEFORE};
use super::jumps::ROUNDING;
use super::stepper::Stepper;
use crate::mlcp::Start;

/// Length of a step that shows what the motion of the sources turns, relative to that of those that have shown the
/// values.
const TURNING: f64 = 1e-3;
/// Part by which slopes of sources change at a corner.
const CHANGED: f64 = 1e-3;
/// Increments have something alike if the ratio of their rates differs by no more than this part from the inverse of
/// that of their lengths.
const ALIKE: f64 = 0.1;
/// Signs may be missed by this part of the largest value: what moves has not got far.
const SLIGHT: f64 = 1e-7;
/// Where they turn, by a tenth of what the certificate grants.
const SIGNS: f64 = 1e-9;

/// Whether two increments have something alike, so that their rates are in the inverse ratio of their lengths; what
/// moves has the same rate in both, or less.
fn alike(long: f64, short: f64) -> bool {
    (AGAIN * short - long).abs() <= ALIKE * long.abs()
}

/// Rates at length 0 from those of two increments, without what these have alike.
fn at_once(longer: &[f64], shorter: &[f64]) -> Vec<f64> {
    let rate = |(&long, &short): (&f64, &f64)| {
        let rest = if alike(long, short) { long - AGAIN * short } else { short - AGAIN * long };
        rest / (1.0 - AGAIN)
    };
    longer.iter().zip(shorter).map(rate).collect()
}

impl Stepper {
    /// Slopes of the sources to the right of a time.
    pub(super) fn source_slopes(&self, time: f64) -> Vec<f64> {
        let mut found = vec![0.0; self.waveforms.len()];
        slopes(&self.waveforms, time, &mut found);
        found
    }

    /// A short step of this length in which the sources move on.
    fn onward_step(&mut self, before: &[f64], slopes: &[f64], length: f64) -> Outcome {
        let now = self.u0.clone();
        self.u0.iter_mut().zip(slopes).for_each(|(u, slope)| *u += length * slope);
        let found = self.short_step(None, before, length, Start::Warm);
        self.u0 = now;
        found
    }

    /// Takes the rates at the present state, where held sources and steps of this length have shown the
    /// values, and adds to these what the motion of the sources calls for.
    pub(super) fn move_on(&mut self, shown: f64) {
        let slopes = self.source_slopes(self.time);
        let moving = slopes.iter().any(|slope| *slope != 0.0);
        if !(moving || self.is_rounded() || self.recorder.outputs.needs_rates()) {
            return;
        }
        let found = self.onward_rates(&slopes, moving, shown);
        if let Some(rates) = found.filter(|_| self.recorder.outputs.needs_rates()) {
            self.recorder.rates.copy_from_slice(&rates[..self.z.len()]);
            if let Some(smooth) = &mut self.smooth {
                smooth.newton.function_rates(&rates, &slopes, &mut smooth.rates);
            }
        }
        if let Some(smooth) = &mut self.smooth {
            let clock = smooth.clock(self.time);
            smooth.newton.evaluate(&self.z, &self.u0, clock, &mut smooth.f);
        }
    }

    /// The rates from here on, with the values that belong to them; none if no mode is found in which they obey
    /// all signs.
    fn onward_rates(&mut self, slopes: &[f64], moving: bool, shown: f64) -> Option<Vec<f64>> {
        let (mut rates, mut length) = self.first_increment(slopes, shown)?;
        // the values to which something has been added
        let mut begun = None;
        if self.is_rounded() && self.is_felt(&rates, length) {
            let (z, l) = (self.z.clone(), self.l.clone());
            // what rounding has left of potentials says nothing of signs to come
            let found = self.add_increments(slopes, rates.clone(), length, shown);
            if self.obeys_signs() {
                (rates, begun) = (found, Some((z, l)));
            } else {
                (self.z, self.l) = (z, l);
            }
        }
        if !self.lawful_after(&rates, length) {
            if !(moving && self.at_corner(slopes)) {
                return None;
            }
            if let Some(values) = begun.take() {
                (self.z, self.l) = values;
            }
            (rates, length) = self.turned_increment(slopes, shown)?;
        }
        if moving && begun.is_none() {
            rates = self.add_increments(slopes, rates, length, shown);
        }
        Some(rates)
    }

    /// Adds to the values what increments ask for at once, given the rates by one of this length, and returns the
    /// rates from there on; where there are no two increments, the given ones.
    fn add_increments(
        &mut self,
        slopes: &[f64],
        rates: Vec<f64>,
        length: f64,
        shown: f64,
    ) -> Vec<f64> {
        match self.two_increments(slopes, rates.clone(), length, shown) {
            Some((longer, shorter, length)) => {
                self.add_what_stays([&longer, &shorter], length);
                at_once(&longer, &shorter)
            }
            None => rates,
        }
    }

    /// Whether rates make anything of unknowns in a time.
    fn is_felt(&self, rates: &[f64], length: f64) -> bool {
        let largest = self.sys.largest(&[&self.z]);
        let sizes = self.sys.linear.row_kind.iter().map(|&kind| largest[usize::from(kind)]);
        rates.iter().zip(sizes).any(|(rate, size)| (length * rate).abs() > ROUNDING * size)
    }

    /// Adds to unknowns that store nothing, to the potentials of capacitors without a connection to ground, and to
    /// multipliers, what increments of this length and of a shorter one have alike.
    fn add_what_stays(&mut self, [longer, shorter]: [&[f64]; 2], length: f64) {
        let stays = |(long, short): (&f64, &f64)| {
            if alike(*long, *short) {
                length * AGAIN * (short - long) / (1.0 - AGAIN)
            } else {
                0.0
            }
        };
        let mut more: Vec<f64> = longer.iter().zip(shorter).map(stays).collect();
        self.facts.storage.keep(&mut more);
        let (z, l, before) = (self.z.clone(), self.l.clone(), self.at_present(Stepper::missed_by));
        self.z.iter_mut().chain(&mut self.l).zip(&more).for_each(|(value, more)| *value += more);
        // junctions through which a charge still rushes bend more than a line tells
        if self.at_present(Stepper::missed_by) > before.max(SIGNS) {
            (self.z, self.l) = (z, l);
        }
    }

    /// Whether diodes obey their signs so long after the present state, as far as they do now, and those that
    /// neither carry nor bear anything as soon as they move.
    fn lawful_after(&self, rates: &[f64], length: f64) -> bool {
        let (z_rates, l_rates) = rates.split_at(self.z.len());
        let ahead = |values: &[f64], rates: &[f64]| -> Vec<f64> {
            values.iter().zip(rates).map(|(v, rate)| v + length * rate).collect()
        };
        let (z, l) = (ahead(&self.z, z_rates), ahead(&self.l, l_rates));
        let linear = &self.sys.linear;
        let still = vec![0.0; rates.len()];
        let rest = linear.slacks_of(&still[..z.len()], &still[z.len()..]);
        let moved = linear.slacks_of(z_rates, l_rates);
        let slopes = [moved.iter().zip(&rest).map(|(w, w0)| w - w0).collect(), l_rates.to_vec()];
        let (now, then) = (self.of_pairs(), [linear.slacks_of(&z, &l), l]);
        let idle = |i: usize| now.iter().all(|(list, most)| list[i].abs() <= SIGNS * most);
        let largest = |list: &[f64]| list.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        now.iter().zip(&then).zip(&slopes).all(|(((now, most), then), slopes)| {
            let (most, steepest) = (most.max(largest(then)), largest(slopes));
            self.switching.diodes.iter().all(|&i| {
                then[i] >= now[i].min(0.0) - SLIGHT * most
                    && !(idle(i) && slopes[i] < -SLIGHT * steepest)
            })
        })
    }

    /// Whether the slopes of sources change here; at an event that a guard tells diodes have turned already.
    fn at_corner(&self, slopes: &[f64]) -> bool {
        let before = self.source_slopes(self.time - BEFORE * self.schedule.step_length);
        let changes =
            |(now, last): (&f64, &f64)| (now - last).abs() > CHANGED * now.abs().max(last.abs());
        self.stats.steps == 0 || slopes.iter().zip(&before).any(changes)
    }

    /// The rates in the mode to which the motion of the sources turns diodes in a step, and the values right
    /// before it there; none if there is no such mode. Returns the length of their increment, too.
    fn turned_increment(&mut self, slopes: &[f64], shown: f64) -> Option<(Vec<f64>, f64)> {
        // so short a step of Newton's method shows but the rounding of charges
        let step = if self.smooth.is_some() { shown } else { TURNING * shown };
        let (z, l, mode) = (self.z.clone(), self.l.clone(), self.active.clone());
        let solved = self.onward_step(&z, slopes, step).is_ok();
        let rates = if !solved {
            None
        } else if self.smooth.is_some() {
            // the mode alone, if both have the same values
            (self.z, self.l) = (z.clone(), l.clone());
            let found =
                if self.neutral(&mode) { self.first_increment(slopes, shown) } else { None };
            found.filter(|(rates, length)| self.lawful_after(rates, *length))
        } else {
            self.go_back(&z, slopes, shown, step)
        };
        if rates.is_none() {
            (self.z, self.l) = (z, l);
            self.turn_to(&mode);
        }
        rates
    }

    /// Whether diodes that the present mode and another one treat differently carry and bear nothing.
    fn neutral(&self, other: &[bool]) -> bool {
        self.of_pairs().iter().all(|(list, most)| {
            let turned = self.active.iter().zip(other).zip(list).filter(|((a, b), _)| a != b);
            turned.into_iter().all(|(_, v)| v.abs() <= SIGNS * most)
        })
    }

    /// From the end of a step of this length to its begin at `z`, in the mode at its end; the rates there if this
    /// obeys all signs.
    fn go_back(
        &mut self,
        z: &[f64],
        slopes: &[f64],
        shown: f64,
        step: f64,
    ) -> Option<(Vec<f64>, f64)> {
        self.take_stored(z);
        let (rates, length) = self.first_increment(slopes, shown)?;
        if !self.lawful_after(&rates, length) {
            return None;
        }
        let values = self.z.iter_mut().chain(&mut self.l);
        values.zip(&rates).for_each(|(value, rate)| *value -= step * rate);
        self.take_stored(z);
        // storage gives way a little in so short a step: once more, from what that leaves
        self.obey(shown);
        self.obey(shown);
        if self.obeys_signs() {
            Some((self.increment(slopes, length)?, length))
        } else {
            None
        }
    }

    /// Takes what is stored from a state.
    pub(super) fn take_stored(&mut self, z: &[f64]) {
        for j in self.facts.storage.unknowns() {
            self.z[j] = z[j];
        }
    }

    /// Slacks and multipliers at the present state, and the largest of each.
    fn of_pairs(&self) -> [(Vec<f64>, f64); 2] {
        [self.sys.linear.slacks_of(&self.z, &self.l), self.l.clone()].map(|list| {
            let most = list.iter().fold(0.0f64, |most, v| most.max(v.abs()));
            (list, most)
        })
    }

    /// Whether diodes obey their signs at the present state.
    fn obeys_signs(&self) -> bool {
        let obeyed = |(list, most): &(Vec<f64>, f64)| {
            self.switching.diodes.iter().all(|&i| list[i] >= -SIGNS * most)
        };
        self.of_pairs().iter().all(obeyed)
    }
}

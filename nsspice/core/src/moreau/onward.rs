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
use super::stepper::Stepper;
use crate::mlcp::Start;

/// Length of the increment, relative to that of the steps that have shown the values: it does not lose digits by
/// being short;
const SHORTER: f64 = 1e-6;
/// and that of a step that shows what the motion of the sources turns.
const TURNING: f64 = 1e-3;
/// How long before the present time sources are asked for their slopes, relative to the nominal step, and the
/// part by which these change at a corner.
const BEFORE: f64 = 1e-6;
const CHANGED: f64 = 1e-3;
/// Ratio of two lengths that tell what does not vanish with them.
const AGAIN: f64 = 0.1;
/// The part by which it may differ.
const ALIKE: f64 = 0.1;
/// Signs may be missed by this part of the largest value: what moves has not got far.
const SLIGHT: f64 = 1e-7;
/// Where they turn, by a tenth of what the certificate grants.
const SIGNS: f64 = 1e-9;

impl Stepper {
    /// Slopes of the sources to the right of a time.
    fn source_slopes(&self, time: f64) -> Vec<f64> {
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
        if !(moving || self.outputs.needs_rates()) {
            return;
        }
        let found = self.onward_rates(&slopes, moving, shown);
        if let Some(rates) = found.filter(|_| self.outputs.needs_rates()) {
            self.rates.copy_from_slice(&rates[..self.z.len()]);
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
        let length = SHORTER * shown;
        let mut rates = self.increment(slopes, length)?;
        if !self.lawful_after(&rates, length) {
            if !(moving && self.at_corner(slopes)) {
                return None;
            }
            rates = self.turned_increment(slopes, length, shown)?;
        }
        if moving {
            if let Some(shorter) = self.increment(slopes, AGAIN * length) {
                self.add_what_stays([&rates, &shorter], length);
                rates = shorter;
            }
        }
        Some(rates)
    }

    /// Adds to unknowns that store nothing, and to multipliers, what increments of this length and of a shorter
    /// one have alike.
    fn add_what_stays(&mut self, [longer, shorter]: [&[f64]; 2], length: f64) {
        let n = self.z.len();
        let mut stored = vec![false; n];
        self.storage.unknowns().for_each(|j| stored[j] = true);
        for (j, (long, short)) in longer.iter().zip(shorter).enumerate() {
            // what moves has the same rate in both, or less
            let alike = (AGAIN * short - long).abs() <= ALIKE * long.abs();
            if stored.get(j) == Some(&true) || !alike {
                continue;
            }
            let stays = length * AGAIN * (short - long) / (1.0 - AGAIN);
            match self.z.get_mut(j) {
                Some(z) => *z += stays,
                None => self.l[j - n] += stays,
            }
        }
    }

    /// Whether diodes obey their signs so long after the present state, as far as they do now.
    fn lawful_after(&self, rates: &[f64], length: f64) -> bool {
        let (z_rates, l_rates) = rates.split_at(self.z.len());
        let ahead = |values: &[f64], rates: &[f64]| -> Vec<f64> {
            values.iter().zip(rates).map(|(v, rate)| v + length * rate).collect()
        };
        let (z, l) = (ahead(&self.z, z_rates), ahead(&self.l, l_rates));
        let slacks = |z: &[f64], l: &[f64]| self.sys.linear.slacks_of(z, l);
        let lists = [(slacks(&self.z, &self.l), slacks(&z, &l)), (self.l.clone(), l)];
        lists.iter().all(|(now, then)| {
            let most = now.iter().chain(then).fold(0.0f64, |most, v| most.max(v.abs()));
            self.diodes.iter().all(|&i| then[i] >= now[i].min(0.0) - SLIGHT * most)
        })
    }

    /// Whether the slopes of sources change here; at an event that a guard tells diodes have turned already.
    fn at_corner(&self, slopes: &[f64]) -> bool {
        let before = self.source_slopes(self.time - BEFORE * self.step_length);
        let changes =
            |(now, last): (&f64, &f64)| (now - last).abs() > CHANGED * now.abs().max(last.abs());
        self.stats.steps == 0 || slopes.iter().zip(&before).any(changes)
    }

    /// The rates in the mode to which the motion of the sources turns diodes in a step, and the values right
    /// before it there; none if there is no such mode.
    fn turned_increment(&mut self, slopes: &[f64], length: f64, shown: f64) -> Option<Vec<f64>> {
        // so short a step of Newton's method shows but the rounding of charges
        let step = if self.smooth.is_some() { shown } else { TURNING * shown };
        let (z, l, mode) = (self.z.clone(), self.l.clone(), self.active.clone());
        let solved = self.onward_step(&z, slopes, step).is_ok();
        let rates = if !solved {
            None
        } else if self.smooth.is_some() {
            // the mode alone, if both have the same values
            (self.z, self.l) = (z.clone(), l.clone());
            let rates = if self.neutral(&mode) { self.increment(slopes, length) } else { None };
            rates.filter(|rates| self.lawful_after(rates, length))
        } else {
            self.go_back(&z, slopes, length, step)
        };
        if rates.is_none() {
            (self.z, self.l) = (z, l);
            if self.active != mode {
                self.active = mode;
                self.epoch += 1;
            }
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
    fn go_back(&mut self, z: &[f64], slopes: &[f64], length: f64, step: f64) -> Option<Vec<f64>> {
        self.take_stored(z);
        let rates = self.increment(slopes, length)?;
        if !self.lawful_after(&rates, length) {
            return None;
        }
        let values = self.z.iter_mut().chain(&mut self.l);
        values.zip(&rates).for_each(|(value, rate)| *value -= step * rate);
        self.take_stored(z);
        self.obey(length);
        if self.obeys_signs() {
            self.increment(slopes, length)
        } else {
            None
        }
    }

    /// Takes what is stored from a state.
    pub(super) fn take_stored(&mut self, z: &[f64]) {
        for j in self.storage.unknowns() {
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
        let obeyed =
            |(list, most): &(Vec<f64>, f64)| self.diodes.iter().all(|&i| list[i] >= -SIGNS * most);
        self.of_pairs().iter().all(obeyed)
    }

    /// What linear laws miss at the present state.
    fn missed(&self) -> Vec<f64> {
        let linear = &self.sys.linear;
        let mut missed = vec![0.0; self.z.len()];
        linear.s.mul_add(1.0, &self.u0, &mut missed);
        linear.g.mul_add(-1.0, &self.z, &mut missed);
        linear.a.mul_add(-1.0, &self.l, &mut missed);
        missed
    }

    /// Lets unknowns that store nothing and multipliers obey all laws without storage in the present mode.
    fn obey(&mut self, length: f64) {
        let (mut x, linear) = (self.missed(), &self.sys.linear);
        linear.e.iter().for_each(|e| x[e.0] = 0.0);
        let slacks = linear.slacks_of(&self.z, &self.l);
        x.extend(slacks.iter().zip(&self.active).map(|(w, &on)| if on { -w } else { 0.0 }));
        let k = self.stage_index(length, true);
        self.stages[k].factor(&self.active, self.epoch).solve(&mut x, &mut self.work);
        self.storage.unknowns().for_each(|j| x[j] = 0.0);
        self.z.iter_mut().chain(&mut self.l).zip(&x).for_each(|(value, change)| *value += change);
    }

    /// The rates of unknowns and multipliers in the present mode; none if it does not determine them.
    fn increment(&mut self, slopes: &[f64], length: f64) -> Option<Vec<f64>> {
        let (n, m) = (self.z.len(), self.l.len());
        let mut driven = vec![0.0; n];
        self.sys.linear.s.mul_add(1.0, slopes, &mut driven);
        if self.smooth.is_some() {
            let (z, l) = (self.z.clone(), self.l.clone());
            let [acting, _] = self.acting_at(&z, &l)?;
            let missed: Vec<f64> = acting.iter().map(|acting| -acting).collect();
            let state = [&z[..], &self.u0, slopes];
            let smooth = self.smooth.as_mut()?;
            let clock = smooth.clock(self.time);
            smooth.newton.set_rate(1.0 / length);
            return smooth.newton.rates(state, clock, [&missed, &driven]);
        }
        let mut x = driven;
        let mut stores = vec![false; n];
        self.sys.linear.e.iter().for_each(|e| stores[e.0] = true);
        let missed = self.missed();
        let rows = x.iter_mut().zip(&missed).zip(&stores).filter(|row| *row.1);
        rows.for_each(|((x, missed), _)| *x += missed / length);
        x.resize(n + m, 0.0);
        let k = self.stage_index(length, true);
        let stage = &mut self.stages[k];
        let factor = stage.factor(&self.active, self.epoch);
        if !factor.regular() || stage.slot(&self.active, self.epoch).summed.is_some() {
            return None;
        }
        factor.solve(&mut x, &mut self.work);
        x.iter().all(|rate| rate.is_finite()).then_some(x)
    }
}

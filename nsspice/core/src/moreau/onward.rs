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

/// Lengths of the increment, relative to that of the steps that have shown the values: it does not lose digits by
/// being short, but beside the storage of so short a one leakage may be drowned;
const LENGTHS: [f64; 5] = [1e-6, 1e-3, 1.0, 1e3, 1e6];
/// and that of a step that shows what the motion of the sources turns.
const TURNING: f64 = 1e-3;
/// Laws without storage are obeyed where no more than this part of what they missed is left, or of the largest
/// value.
const SHARE: f64 = 0.1;
const OBEYED: f64 = 1e-15;
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
        let (mut rates, mut length) = self.first_increment(slopes, shown)?;
        if !self.lawful_after(&rates, length) {
            if !(moving && self.at_corner(slopes)) {
                return None;
            }
            (rates, length) = self.turned_increment(slopes, shown)?;
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
            self.diodes.iter().all(|&i| {
                then[i] >= now[i].min(0.0) - SLIGHT * most
                    && !(idle(i) && slopes[i] < -SLIGHT * steepest)
            })
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
        self.obey(shown);
        if self.obeys_signs() {
            Some((self.increment(slopes, length)?, length))
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
    pub(super) fn obey(&mut self, shown: f64) {
        let (z, l) = (self.z.clone(), self.l.clone());
        let missed = self.missed_without_storage();
        let [volts, amperes] = self.sys.largest(&[&z]).map(|size| OBEYED * size);
        let before = self.sys.largest(&[&missed]);
        let goal = [before[0].max(amperes / SHARE), before[1].max(volts / SHARE)];
        let slacks = self.sys.linear.slacks_of(&z, &l);
        let off = slacks.iter().zip(&self.active).map(|(w, &on)| if on { -w } else { 0.0 });
        let change: Vec<f64> = missed.into_iter().chain(off).collect();
        // what is stored stands still in short steps alone, beside which leakage may be drowned
        for ratio in LENGTHS {
            let mut x = change.clone();
            if self.solve_increment(ratio * shown, &mut x).is_none() {
                continue;
            }
            self.storage.unknowns().for_each(|j| x[j] = 0.0);
            self.z.iter_mut().chain(&mut self.l).zip(&x).for_each(|(value, x)| *value += x);
            let after = self.sys.largest(&[&self.missed_without_storage()]);
            if after.iter().zip(goal).all(|(after, goal)| *after <= SHARE * goal) {
                return;
            }
            (self.z, self.l) = (z.clone(), l.clone());
        }
    }

    /// What linear laws without storage miss at the present state.
    fn missed_without_storage(&self) -> Vec<f64> {
        let mut missed = self.missed();
        self.sys.linear.e.iter().for_each(|e| missed[e.0] = 0.0);
        missed
    }

    /// Solves the matrix of an increment in the present mode; none if this is singular.
    fn solve_increment(&mut self, length: f64, x: &mut [f64]) -> Option<()> {
        let k = self.stage_index(length, true);
        let stage = &mut self.stages[k];
        let factor = stage.factor(&self.active, self.epoch);
        if !factor.regular() {
            return None;
        }
        factor.solve(x, &mut self.work);
        x.iter().all(|value| value.is_finite()).then_some(())
    }

    /// The rates of unknowns and multipliers by the shortest increment that determines them, and its length.
    fn first_increment(&mut self, slopes: &[f64], shown: f64) -> Option<(Vec<f64>, f64)> {
        let longest = shown.max(BEFORE * self.step_length);
        LENGTHS.iter().map(|ratio| ratio * shown).find_map(|length| {
            let rates = if length > longest { None } else { self.increment(slopes, length) };
            rates.map(|rates| (rates, length))
        })
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
        self.solve_increment(length, &mut x)?;
        let k = self.stage_index(length, true);
        self.stages[k].slot(&self.active, self.epoch).summed.is_none().then_some(x)
    }
}

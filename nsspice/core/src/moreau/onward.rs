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

use super::stepper::Stepper;
use crate::mlcp::Start;
use crate::waveform::Waveform;

/// Length of the increment, relative to that of the steps that have shown the values: it does not lose digits by
/// being short.
const SHORTER: f64 = 1e-3;
/// Ratio of two lengths that tell what does not vanish with them.
const AGAIN: f64 = 0.1;
/// The part by which it may differ.
const ALIKE: f64 = 0.1;
/// Signs may be missed by this part of the largest value: what moves has not got far.
const SLIGHT: f64 = 1e-7;

impl Stepper {
    /// Takes the rates at the present state, where held sources and steps of this length have shown the
    /// values, and adds to these what the motion of the sources calls for.
    pub(super) fn move_on(&mut self, length: f64) {
        let slopes = self.waveforms.iter().map(|w| Waveform::slope(w, self.time));
        let slopes: Vec<f64> = slopes.collect();
        let moving = slopes.iter().any(|slope| *slope != 0.0);
        if !(moving || self.outputs.needs_rates()) {
            return;
        }
        let length = SHORTER * length;
        let Some(mut rates) = self.increment(&slopes, length) else { return };
        let mode = self.active.clone();
        if moving {
            let mut lawful = self.lawful_after(&rates, length);
            if !lawful {
                let turned = self.turned_increment(&slopes, length);
                lawful = turned.is_some();
                rates = turned.unwrap_or(rates);
            }
            if let (true, Some(shorter)) = (lawful, self.increment(&slopes, AGAIN * length)) {
                self.add_what_stays([&rates, &shorter], length);
                rates = shorter;
            }
        }
        if self.active != mode {
            // the next step looks for itself
            self.active = mode;
            self.epoch += 1;
        }
        if self.outputs.needs_rates() {
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

    /// The rates in the mode to which the motion of the sources turns diodes that carry and bear nothing, if
    /// there is such.
    fn turned_increment(&mut self, slopes: &[f64], length: f64) -> Option<Vec<f64>> {
        let (z, l, now) = (self.z.clone(), self.l.clone(), self.u0.clone());
        self.u0.iter_mut().zip(slopes).for_each(|(u, slope)| *u += length * slope);
        let solved = self.short_step(None, &z, length, Start::Warm).is_ok();
        (self.z, self.l, self.u0) = (z, l, now);
        let rates = if solved { self.increment(slopes, length) } else { None };
        rates.filter(|rates| self.lawful_after(rates, length))
    }

    /// The rates of unknowns and multipliers in the present mode; none if it does not determine them.
    fn increment(&mut self, slopes: &[f64], length: f64) -> Option<Vec<f64>> {
        let (n, m) = (self.z.len(), self.l.len());
        let linear = &self.sys.linear;
        let (mut missed, mut driven) = (vec![0.0; n], vec![0.0; n]);
        linear.s.mul_add(1.0, slopes, &mut driven);
        if self.smooth.is_some() {
            let (z, l) = (self.z.clone(), self.l.clone());
            let [acting, _] = self.acting_at(&z, &l)?;
            missed.iter_mut().zip(acting).for_each(|(missed, acting)| *missed = -acting);
            let state = [&z[..], &self.u0, slopes];
            let smooth = self.smooth.as_mut()?;
            let clock = smooth.clock(self.time);
            smooth.newton.set_rate(1.0 / length);
            return smooth.newton.rates(state, clock, [&missed, &driven]);
        }
        linear.s.mul_add(1.0, &self.u0, &mut missed);
        linear.g.mul_add(-1.0, &self.z, &mut missed);
        linear.a.mul_add(-1.0, &self.l, &mut missed);
        let mut x = driven;
        let mut stores = vec![false; n];
        linear.e.iter().for_each(|e| stores[e.0] = true);
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

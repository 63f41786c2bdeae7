//! Moreau's law of impacts: charges pass only through pairs that a jump leaves closed, and fluxes lie only
//! across pairs that it leaves open.
//!
//! In a passive network it tells a jump from all others.  Charges and fluxes that balance with impulses of
//! the right sign, none of which passes a pair with slack or lies across one that conducts afterwards,
//! are the projection of those before onto what the pairs allow, in the norm of the energy, of which
//! there is only one [Moreau, Unilateral contact and dry friction in finite freedom dynamics, 1988].
//! Where an impulsive step could not be solved at once, but was reached by longer ones or continued by
//! others, each of its parts obeys the law, and their sum may not: a diode that has carried a part of the
//! charge opens in the next one.
//!
//! A step that was solved at once may break it, too.  Beside the gigavolts of a flux a floating capacitor
//! hides amperes in the rounding of its charge, among them the current that tells whether a diode conducts.

use super::aftermath::Rest;
use super::jumps::Leap;
use super::stepper::Stepper;
use crate::mlcp::Start;

/// Lengths of the steps that are tried then, relative to the shortest time: in longer ones less hides
/// behind the rounding of impulses.
const LONGER: [f64; 3] = [1e-6, 1e-5, 1e-4];
/// What breaks the law by less than this part of the largest impulse, or of the largest voltage, is
/// rounding or motion.
const KEPT: f64 = 1e-7;

impl Stepper {
    /// An impulsive step that moves something, or a longer one from where it `begun` that obeys the law if
    /// it does not.
    pub(super) fn lawful(
        &mut self,
        charges: Option<&[f64]>,
        begun: &(Vec<f64>, Vec<f64>),
        leap: Leap,
        shortest: f64,
        start: Start,
    ) -> Leap {
        let (mut best, mut torn) = (None, self.torn(&leap));
        for part in LONGER {
            if torn <= KEPT {
                break;
            }
            (self.z, self.l) = begun.clone();
            let Ok(next) = self.leap(charges, part, shortest, start) else { continue };
            let found = self.torn(&next);
            if found < torn && self.rest(&next) > Rest::Impulsive {
                (best, torn) = (Some(next), found);
            }
        }
        best.unwrap_or(leap)
    }

    /// The largest impulse that breaks the law, as a part of the largest: a charge through a pair with slack
    /// afterwards, or a flux across a pair that then conducts.  Only passive networks are judged; what
    /// junctions store moves in times of its own.
    fn torn(&self, leap: &Leap) -> f64 {
        let Some((_, after, _)) = &leap.settled else { return 0.0 };
        if self.instants.impacts.active || self.smooth.is_some() {
            return 0.0;
        }
        let largest = |list: &[f64], floor: f64| list.iter().fold(floor, |a, v| a.max(v.abs()));
        let [unknowns, multipliers, _] = &leap.impulses;
        let linear = &self.sys.linear;
        let slacks = linear.slacks_of(&after.z, &after.l);
        // thresholds have no impulse
        let across = linear.slacks_of(unknowns, multipliers);
        let across: Vec<f64> = across.iter().zip(&linear.q).map(|(w, q)| w - q).collect();
        let values = self.sys.largest(&[&after.z]);
        let share = |value: f64, largest: f64| if value > 0.0 { value / largest } else { 0.0 };
        let broken = |impulses: &[f64], floor, carried: &[f64], left: &[f64], least| {
            let (impulse, most) = (largest(impulses, floor), largest(left, least));
            // what ordinary values carry meanwhile is none
            let ordinary = leap.span * largest(carried, 0.0);
            let pairs = self.switching.diodes.iter().map(|&i| (impulses[i], left[i]));
            let parts = pairs
                .map(|(passed, left)| share(passed - ordinary, impulse).min(share(left, most)));
            parts.fold(0.0, f64::max)
        };
        let charges = broken(multipliers, 0.0, &after.l, &slacks, values[0]);
        // extrapolation leaves rounding of what ordinary voltages are in no time: beside fluxes it is none
        let fluxes = broken(&across, self.instants.largest[1], &slacks, &after.l, values[1]);
        charges.max(fluxes)
    }
}

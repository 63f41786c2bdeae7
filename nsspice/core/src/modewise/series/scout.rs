//! Signs of the pairs in a mode that has not been reduced, from one sparse solve.
//!
//! Most candidates for the next mode are wrong, and most wrong ones show a sign that is far from rounding.  To see it
//! takes no spectrum.  What is near rounding, or depends on what follows, is left to the proof in the reduced mode.

use super::tableau::{Drive, Tableau};
use crate::mlcp::Role;
use crate::rounding::OF_SOLUTION;
use crate::tolerances::{CLEARLY, TOLERANCE};

/// Pivots of which less is left are those of modes that fix the states themselves: their signs are those of impulses
/// and of derivatives, which one solve does not show.
pub(super) const REGULAR: f64 = 1e-11;
/// Part of the largest voltage (current) beyond which a sign is not one of rounding: clearly more than what any proof
/// accepts.
const SIGN: f64 = TOLERANCE / CLEARLY;
/// Part within which a sign may be one of rounding.
const ROUNDING: f64 = OF_SOLUTION / CLEARLY;

/// What signs say about a candidate.
#[derive(Clone, Debug, PartialEq)]
pub struct Refuted {
    /// the pair with the worst sign
    pub worst: usize,
    /// pairs whose guard is within rounding of zero
    pub zeros: Vec<usize>,
}

/// What drives the network at an instant.
pub struct Present<'a> {
    /// unknowns, of which those count that are stored
    pub z: &'a [f64],
    /// what sources bring into the equations, with first and second derivatives
    pub sources: [&'a [f64]; 3],
    /// the most that they have brought
    pub most: &'a [f64],
}

/// The judge by signs.
pub struct Scout {
    tableau: Tableau,
    states: Vec<f64>,
    value: Vec<f64>,
    rate: Vec<f64>,
    /// largest voltage and current that were stored
    stored: [f64; 2],
}

impl Scout {
    /// Judges the modes of a network.
    pub fn new(tableau: Tableau) -> Scout {
        let value = vec![0.0; tableau.size()];
        Scout { tableau, states: Vec::new(), rate: value.clone(), value, stored: [0.0; 2] }
    }

    /// Whether a mode is wrong right away; nothing where that is not certain.
    pub fn refute(&mut self, on: &[bool], roles: &[Role], present: &Present) -> Option<Refuted> {
        fault!("mode_unverified" => return None);
        fault!("current_signs_ignored" => return None);
        fault!("voltage_signs_ignored" => return None);
        fault!("first_slope_ignored" => return None);
        let t = &mut self.tableau;
        if !t.set_mode(on) || t.pivot_ratio() < REGULAR {
            return None;
        }
        let [sources, rising, bending] = present.sources;
        t.states_of(present.z, &mut self.states);
        let now = largest(t, &self.states, sources);
        for ((stored, most), now) in
            self.stored.iter_mut().zip(largest(t, &self.states, present.most)).zip(now)
        {
            *stored = stored.max(most).max(now);
        }
        // where all is small at present, it is known no better than what was large before
        let lost =
            self.stored.iter().zip(now).map(|(all, now)| if *all > 0.0 { all / now } else { 1.0 });
        let lost = lost.fold(1.0, f64::max);
        forget_dependent(t, &mut self.states);
        let drive = Drive { sources, rising, states: &self.states, constant: true };
        if !t.solve(&drive, &mut self.value) {
            return None;
        }
        let Judged { worst, zeros, low } = judged(t, roles, &self.value, lost, None);
        if let Some(worst) = worst {
            return Some(Refuted { worst, zeros });
        }
        if low.is_empty() {
            return None;
        }
        // what is not above zero now has to rise, unless all is at rest but for rounding; what seems to be above it by
        // little may be so, and fall to it in picoseconds: the proof decides
        for (k, x) in self.states.iter_mut().enumerate() {
            *x = t.rate(k, &self.value);
        }
        forget_dependent(t, &mut self.states);
        let [voltage, current] = t.largest(&self.value);
        let (rates, capacitors) = (largest(t, &self.states, rising), t.elements.capacitors.len());
        let at_rest = (0..self.states.len()).any(|k| {
            let (rate, other, all) = match k < capacitors {
                true => (rates[0], current, self.stored[1]),
                false => (rates[1], voltage, self.stored[0]),
            };
            let stands = t.dependent(k).is_some();
            !stands && SIGN * rate <= ROUNDING * other.max(all) / t.store(k).value
        });
        if at_rest {
            return None;
        }
        let drive =
            Drive { sources: rising, rising: bending, states: &self.states, constant: false };
        if !t.solve(&drive, &mut self.rate) {
            return None;
        }
        let Judged { worst, .. } = judged(t, roles, &self.rate, 1.0, Some(&low));
        worst.map(|worst| Refuted { worst, zeros })
    }
}

fn forget_dependent(t: &Tableau, states: &mut [f64]) {
    for (k, x) in states.iter_mut().enumerate() {
        if t.dependent(k).is_some() {
            *x = 0.0;
        }
    }
}

/// The largest voltage and current that states and sources bring.
fn largest(t: &Tableau, states: &[f64], sources: &[f64]) -> [f64; 2] {
    let most = |list: &[f64]| list.iter().fold(0.0, |most, x| f64::max(most, x.abs()));
    let (voltages, currents) = states.split_at(t.elements.capacitors.len());
    let given = t.elements.voltages.iter().filter_map(|b| b.index).map(|row| sources[row].abs());
    let entering = t.elements.entering(sources);
    [given.fold(most(voltages), f64::max), most(currents).max(most(&entering))]
}

/// Guards of diodes, or their rates.
struct Judged {
    /// the one that is clearly negative and the most so
    worst: Option<usize>,
    /// those that are zero but for rounding
    zeros: Vec<usize>,
    /// those of them that are not above zero by more than the rounding of one number
    low: Vec<usize>,
}

/// Judges the guards of diodes with `lost` times as much rounding as usual, or the rates of some alone.
fn judged(t: &Tableau, roles: &[Role], y: &[f64], lost: f64, some: Option<&[usize]>) -> Judged {
    let [voltage, current] = t.largest(y);
    let (mut worst, mut zeros, mut low) = ((None, 0.0), Vec::new(), Vec::new());
    for (k, pair) in t.elements.pairs.iter().enumerate() {
        let Some(at) = pair.index.filter(|&at| roles[at] == Role::Diode) else { continue };
        if some.is_some_and(|some| !some.contains(&at)) {
            continue;
        }
        // the current of a small resistance has the rounding of the voltages around it
        let (size, blur) = match t.is_on(k) {
            true if pair.value > 0.0 => (current, voltage / pair.value),
            true => (current, 0.0),
            false => (voltage, 0.0),
        };
        let (guard, rounding) = (t.guard(k, y, some.is_none()), ROUNDING * lost * (size + blur));
        if guard.abs() <= rounding || rounding.is_nan() {
            zeros.push(at);
            low.extend((guard <= f64::EPSILON * (size + blur) || rounding.is_nan()).then_some(at));
        }
        // one that is positive beyond rounding may fall: it ends the segment soon, and does not refute the mode
        let part = guard / (SIGN * size + rounding);
        if part < worst.1 && part < -1.0 {
            worst = (Some(at), part);
        }
    }
    Judged { worst: worst.0, zeros, low }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::{Branch, Coordinates, Elements};

    fn branch(ends: [usize; 2], value: f64, index: usize) -> Branch {
        Branch { ends, value, index: Some(index) }
    }

    /// A source of the unknown 2 at node 0, a diode of 1 mOhm from there to node 1, 1 uF and 10 Ohm to ground.
    fn rectifier() -> Scout {
        let between = |ends, value| Branch { ends, value, index: None };
        let elements = Elements {
            nodes: 3,
            coordinates: Coordinates::of_nodes(3),
            unknowns: vec![0, 1],
            capacitors: vec![between([1, 2], 1e-6)],
            resistors: vec![between([1, 2], 0.1)],
            voltages: vec![branch([0, 2], 0.0, 2)],
            pairs: vec![branch([0, 1], 1e-3, 0)],
            ..Elements::default()
        };
        Scout::new(Tableau::new(elements, &[0.0]).unwrap())
    }

    /// The verdict where the source is `v`, with a slope, and the capacitor has 5 V.
    fn verdict(on: bool, v: f64, slope: f64) -> Option<Refuted> {
        let (z, none) = ([v, 5.0, 0.0], [0.0; 3]);
        let [sources, rising] = [v, slope].map(|v| [0.0, 0.0, -v]);
        let present =
            Present { z: &z, sources: [&sources, &rising, &none], most: &[0.0, 0.0, -10.0] };
        rectifier().refute(&[on], &[Role::Diode], &present)
    }

    #[test]
    fn a_value_of_the_wrong_sign_refutes() {
        assert!(verdict(true, 6.0, 0.0).is_none() && verdict(false, 4.0, 0.0).is_none());
        let refuted = Refuted { worst: 0, zeros: vec![] };
        assert_eq!(verdict(true, 4.0, 0.0), Some(refuted.clone()));
        assert_eq!(verdict(false, 6.0, 0.0), Some(refuted));
    }

    #[test]
    fn rates_decide_where_the_value_is_zero() {
        // the capacitor falls by 5 V over 10 us
        let refuted = Refuted { worst: 0, zeros: vec![0] };
        assert_eq!(verdict(false, 5.0, 0.0), Some(refuted.clone()));
        assert!(verdict(false, 5.0, -1e6).is_none());
        assert_eq!(verdict(true, 5.0, -1e6), Some(refuted));
        assert!(verdict(true, 5.0, 0.0).is_none());
    }

    #[test]
    fn a_small_current_that_falls_refutes_nothing() {
        // it may have a fraction of a femtosecond left
        assert!(verdict(true, 5.0 + 4e-13, -1e6).is_none());
    }

    #[test]
    fn what_is_within_rounding_of_larger_values_refutes_nothing() {
        assert!(verdict(true, 5.0 - 1e-13, -1e6 * 0.4).is_none());
    }
}

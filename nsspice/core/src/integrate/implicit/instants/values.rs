//! Right after an instant: the values and the rates to which given charges and fluxes lead.
//!
//! An implicit step obeys all laws at its end, for any length. So the values that belong to charges `c` are
//! those at the end of the step that ends with them,
//!
//! ```text
//! E z+ = c,   E (z+ - z-) / h + G z+ + A l+ = S u,   the signs of l+ and of all slacks,
//! ```
//!
//! and `(z+ - z-) / h` are the rates right there: no limit of short lengths is taken. Where it begins is found by
//! deferred correction: `z-` gets what the last trial has missed of `c`, of which a step short compared with the
//! times of the network leaves little (H. J. Stetter, The defect correction principle, Numer. Math. 29, 1978).
//! Sources move on from here; the first trial begins where a step with them leads, backwards, since laws of charges
//! and fluxes alone (capacitors across a source, inductors in series) hold in all of them and are corrected by none.
//!
//! Charges that no step ends with break such a law: an impulse is left.

use super::jumps::{DESCENT, JUMP, LOOSE};
use crate::integrate::implicit::failure::{Failure, Outcome};
use crate::integrate::implicit::instants::state_jumps::StateJumps;
use crate::integrate::implicit::solver::Solver;
use crate::integrate::implicit::time_grid::slopes_at;
use crate::mlcp::Start;
use crate::rounding::{OF_EQUATION, OF_SOLUTION};
use crate::tolerances::{CLEARLY, PROGRESS};

/// The longest step, relative to an ordinary one: what moves much in it is not corrected, and the next one is shorter
/// by
/// [`DESCENT`].  Junctions that block make times of 1e-22 s that nothing happens in, compared with which no step is
/// short.
const AT_ONCE: f64 = 1e-6;
/// The same relative to the fastest time that is known: each correction then leaves that part of what it corrects,
/// and three of them lead from the charges of a volt to [`HELD`].
const LONGEST: f64 = 1e-4;
/// The least relative to that time: rounding of charges counts by the inverse, so that six digits of the rates are
/// left.
const LEAST: f64 = 1e-10;
/// Next to the currents of blocking junctions the first motion from rest is large in any of them.
const TRIALS: usize = 20;
/// Corrections, each of which has to leave at most half of what it corrects.
const CORRECTIONS: usize = 32;
/// The part of the largest charge that may be missed: with what rounding leaves of one solution alone (a decade less)
/// jumps of capacitors through perfectly coupled inductors are not found.
pub(in crate::integrate) const HELD: f64 = 10.0 * OF_SOLUTION;
/// The part of it, or of what moves in the step, that is missed where there is no impulse: little of what the
/// certificate grants.
pub(in crate::integrate) const CLOSE: f64 = 2e-9;
/// What a step moves by more than this part, and one shorter by a hundred by the same but for a tenth, has no time.
const IMPULSE: f64 = 1e-3;

/// What steps from where an impulsive one led say of it, worst first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::integrate) enum Rest {
    /// charges move as only in a jump
    Impulsive,
    /// no step was solved
    Unclear,
    /// no step ends with these charges
    Bent,
    /// one does
    Calm,
}

/// The values that belong to charges.
#[derive(Clone)]
pub(in crate::integrate) struct Settled {
    /// unknowns and multipliers
    pub z: Vec<f64>,
    pub l: Vec<f64>,
    /// where the step began, unknowns and functions, and its length
    pub from: Vec<f64>,
    pub functions: Vec<f64>,
    pub length: f64,
    /// the part of the largest charge by which its end misses them
    pub missed: f64,
    /// these are its charges: but for rounding, or next to nothing of what moves in the step
    pub calm: bool,
}

impl Settled {
    /// Rates of what is stored.
    pub fn rates(&self) -> impl Iterator<Item = f64> + '_ {
        self.z.iter().zip(&self.from).map(|(end, begin)| (end - begin) / self.length)
    }
}

/// Values at length 0 from those at length 1, 2 and 3.
pub fn to_zero([once, twice, thrice]: [&[f64]; 3]) -> Vec<f64> {
    let points = once.iter().zip(twice).zip(thrice);
    points.map(|((a, b), c)| 3.0 * a - 3.0 * b + c).collect()
}

impl StateJumps<'_> {
    /// The values that belong to the charges of `after`, and what the steps say that were tried; the longest that
    /// decides.
    pub(in crate::integrate) fn settle(
        &mut self,
        after: &[f64],
        shortest: f64,
    ) -> Result<(Option<Settled>, Rest), Box<Failure>> {
        let slopes = slopes_at(self.sources, self.state.time);
        let scale = self.scale_of(after);
        let (mut best, mut last): (Option<Settled>, _) = (None, f64::INFINITY);
        let least = LEAST * shortest;
        let mut length = (AT_ONCE * self.step_length).max(LONGEST * shortest);
        for _ in 0..TRIALS {
            match self.ends_with(after, scale, &slopes, length) {
                Ok((found, moved)) => {
                    let before = best.as_ref().map_or(f64::INFINITY, |best| best.missed);
                    let (calm, better) = (found.calm, found.missed < before);
                    // shorter steps miss less than longer ones do, but for rounding
                    let rounding = length < least && found.missed > PROGRESS * before;
                    if calm || better {
                        best = Some(found);
                    }
                    // what breaks a law moves as much in a step as in a shorter one, if these are short compared with
                    // all times
                    let short = length <= JUMP * shortest;
                    let impulse =
                        short && moved > IMPULSE && (moved - last).abs() < CLEARLY * moved;
                    if calm || impulse || rounding {
                        break;
                    }
                    last = moved;
                }
                // what an ordinary step cannot reach either is a conflict of sources with diodes, which shorter
                // steps would but hide behind their multipliers
                Err(_) if best.is_none() => {
                    self.solver.short_step(
                        self.state,
                        None,
                        after,
                        self.step_length,
                        Start::Warm,
                    )?;
                }
                Err(_) => {}
            }
            length *= DESCENT;
        }
        let rest = best.as_ref().map_or(Rest::Unclear, |best| match best.missed {
            _ if best.calm => Rest::Calm,
            missed if missed <= IMPULSE => Rest::Bent,
            _ => Rest::Impulsive,
        });
        Ok((best, rest))
    }

    /// The step of a length that ends with the charges of `after`, or, where corrections do not lead there, the one
    /// that begins with them, and the part of them that this moves.
    fn ends_with(
        &mut self,
        after: &[f64],
        scale: [f64; 2],
        slopes: &[f64],
        length: f64,
    ) -> Result<(Settled, f64), Box<Failure>> {
        self.next_step(after, slopes, length)?;
        let ahead = self.state.z.clone();
        let (onward, carried) = (self.state.active.clone(), self.state.l.clone());
        let back = |now: &[f64], then: &[f64]| -> Vec<f64> {
            now.iter().zip(then).map(|(now, then)| now - (then - now)).collect()
        };
        let correct = |from: &mut [f64], now: &[f64], then: &[f64]| {
            from.iter_mut()
                .zip(now.iter().zip(then))
                .for_each(|(from, (now, then))| *from += now - then);
        };
        let moving = self.charges_apart(after, &ahead, scale);
        let moved = moving[0].max(moving[1]);
        let held = self.solver.functions_at(self.state, after);
        let mut from = back(after, &ahead);
        let mut functions = back(&held, &self.solver.functions_at(self.state, &ahead));
        let mut best: Option<Settled> = None;
        for _ in 0..CORRECTIONS {
            let step = |solver: &mut Solver| {
                solver.step_from(self.state, &from, &functions, length, Start::Warm)
            };
            if self.solver.exactly(step).is_err() {
                break;
            }
            let (z, l) = (self.state.z.clone(), self.state.l.clone());
            let missing = self.charges_apart(after, &z, scale);
            let missed = missing[0].max(missing[1]);
            // fluxes that have only begun to move say nothing about charges
            let little = |(missed, moved): (f64, f64)| missed <= HELD.max(CLOSE * moved);
            if missed.is_nan() || best.as_ref().is_some_and(|best| missed >= PROGRESS * best.missed)
            {
                break;
            }
            best = Some(Settled {
                z,
                l,
                from: from.clone(),
                functions: functions.clone(),
                length,
                missed,
                calm: missed <= CLOSE || missing.into_iter().zip(moving).all(little),
            });
            if missed <= f64::EPSILON {
                break;
            }
            correct(&mut from, after, &self.state.z);
            // what functions store is corrected by itself: exponentials say little of voltages
            let then = self.solver.functions_at(self.state, &self.state.z.clone());
            correct(&mut functions, &held, &then);
        }
        let Some(best) = best.filter(|best| best.missed <= HELD.max(moved)) else {
            self.solver.short_step(self.state, None, after, length, Start::Warm)?;
            let (z, l, from) = (self.state.z.clone(), self.state.l.clone(), after.to_vec());
            let missed = self.charges_apart(after, &z, scale);
            let missed = missed[0].max(missed[1]);
            let calm = missed <= HELD;
            return Ok((Settled { z, l, from, functions: held, length, missed, calm }, moved));
        };
        (self.state.z, self.state.l) = (best.z.clone(), best.l.clone());
        // pairs that carry and bear nothing do what they do from here on
        if self.neutral(&onward, [&ahead, &carried]) {
            self.state.turn_to(&onward);
        }
        Ok((best, moved))
    }

    /// The largest voltage and current of what is stored and of sources: other potentials of a reinitialising step are none.
    pub(in crate::integrate) fn scale_of(&self, after: &[f64]) -> [f64; 2] {
        let mut driven = vec![0.0; after.len()];
        self.solver.sys.linear.s.mul_add(1.0, &self.state.u0, &mut driven);
        let [amperes, volts] = self.solver.sys.largest(&[&driven]);
        let mut scale = [volts, amperes];
        for j in self.facts.storage.unknowns() {
            let kind = usize::from(self.solver.sys.linear.row_kind[j]);
            scale[kind] = scale[kind].max(after[j].abs());
        }
        scale
    }

    /// The largest charge and the largest flux by which two states differ, each as a part of what the largest voltage
    /// (current) would store there: picofarads count next to farads.
    fn charges_apart(&mut self, one: &[f64], other: &[f64], largest: [f64; 2]) -> [f64; 2] {
        let (e, kinds) = (&self.solver.sys.linear.e, &self.solver.sys.linear.row_kind);
        let scale: Vec<f64> = kinds.iter().map(|&kind| largest[usize::from(kind)]).collect();
        let change: Vec<f64> = one.iter().zip(other).map(|(a, b)| a - b).collect();
        let [mut gaps, mut sizes] = [(); 2].map(|()| vec![0.0; other.len()]);
        e.mul_add(1.0, &change, &mut gaps);
        e.abs_mul_add(&scale, &mut sizes);
        if let Some(smooth) = self.solver.smooth.as_mut().filter(|smooth| smooth.newton.stores()) {
            let clock = smooth.clock(self.state.time);
            let slopes = smooth.newton.stored_slopes(other, &self.state.u0, clock);
            // what a blocking junction has left is nothing next to the largest charge so far, or what the largest
            // current brings in an ordinary step
            let passing = largest[1] * self.step_length;
            for (row, c, slope) in slopes {
                let stored = self.instants.largest[usize::from(kinds[row])];
                sizes[row] += (slope.abs() * scale[c]).max(stored).max(passing);
            }
            smooth.add_stored_at(one, &self.state.u0, self.state.time, 1.0, &mut gaps);
            smooth.add_stored_at(other, &self.state.u0, self.state.time, -1.0, &mut gaps);
        }
        // perfectly coupled inductors carry currents that their fluxes do not determine, but for rounding
        let rounding = self.solver.stored_sizes(&change);
        let part = |((gap, size), rounding): ((&f64, &f64), &f64)| {
            // of a node few capacitors and functions meet, of a winding few others
            let open = gap.abs() - OF_EQUATION * rounding;
            // functions beyond all numbers obey nothing
            let open = if open.is_nan() { f64::INFINITY } else { open.max(0.0) };
            open / f64::max(*size, f64::MIN_POSITIVE.sqrt())
        };
        let parts: Vec<f64> = gaps.iter().zip(&sizes).zip(&rounding).map(part).collect();
        let mut apart = [0.0f64; 2];
        for (&kind, &part) in self.solver.sys.linear.row_kind.iter().zip(&parts) {
            let apart = &mut apart[usize::from(kind)];
            *apart = apart.max(part);
        }
        apart
    }

    /// Whether a state stores what the present one does.
    pub(in crate::integrate) fn keeps_charges(&mut self, z: &[f64]) -> bool {
        let before = self.state.z.clone();
        let [volts, amperes] = self.scale_of(&before);
        let scale = [volts, amperes.max(self.instants.felt)];
        let apart = self.charges_apart(&before, z, scale);
        apart[0].max(apart[1]) <= CLOSE
    }

    /// A short step of this length in which the sources move on.
    pub(in crate::integrate) fn next_step(
        &mut self,
        before: &[f64],
        slopes: &[f64],
        length: f64,
    ) -> Outcome {
        let now = self.state.u0.clone();
        self.state.u0.iter_mut().zip(slopes).for_each(|(u, slope)| *u += length * slope);
        let found = self.solver.short_step(self.state, None, before, length, Start::Warm);
        self.state.u0 = now;
        found
    }

    /// Whether pairs that the present mode and another one treat differently carry and bear next to nothing relative
    /// to the largest voltage and current here and in that one.
    fn neutral(&self, other: &[bool], [z, l]: [&[f64]; 2]) -> bool {
        let [volts, amperes] = self.solver.sys.largest(&[&self.state.z, z]);
        let slacks = [
            self.solver.sys.linear.slacks_of(&self.state.z, &self.state.l),
            self.solver.sys.linear.slacks_of(z, l),
        ];
        let nothing = |now: &[f64], then: &[f64], floor: f64| {
            let most = now.iter().chain(then).fold(floor, |most, v| most.max(v.abs()));
            let turned = self.state.active.iter().zip(other).zip(now).filter(|((a, b), _)| a != b);
            turned.into_iter().all(|(_, v)| v.abs() <= LOOSE * most)
        };
        nothing(&slacks[0], &slacks[1], volts) && nothing(&self.state.l, l, amperes)
    }

    /// Takes what is stored from a state.
    pub(in crate::integrate) fn take_stored(&mut self, z: &[f64]) {
        for j in self.facts.storage.unknowns() {
            self.state.z[j] = z[j];
        }
    }
}

//! Right after a jump: what a few longer steps from where it led show of it.

use super::failure::Failure;
use super::jumps::{Leap, Short, LOOSE};
use super::stepper::Stepper;
use crate::mlcp::Start;

/// Lengths of the steps that show the values right after a jump, longest first: the extrapolation of
/// three of them errs by the cube of this, rounding by its inverse.  Shorter ones serve where these
/// do not end in one mode.
pub(super) const AFTER_JUMP: [f64; 5] = [2e-4, 1e-5, 1e-6, 1e-8, 1e-10];
/// The last of them shows little but rounding.  It serves where the curve straightens by so much from
/// one to the next: then something goes on that is faster than all that is known of the circuit.
const STRAIGHTENS: f64 = 0.1;
/// Junctions make time constants that nothing foretells: of circuits with smooth laws the first two are
/// too long.
const TOO_LONG: usize = 2;
/// Nor are they longer than this part of the ordinary ones: charges of a battery are rounded by more than moves.
const AT_ONCE: f64 = 1e-6;
/// Steps right after a jump are short enough if their ends deviate from a line by no more than this
/// part: the extrapolation then errs by less than 1e-8.
const BEND: f64 = 1e-6;
/// Roundings that a second difference of three solutions may show.
const NOISE: f64 = 64.0;
/// Currents and voltages of the wrong sign that the limit of such steps may have, relative to the
/// largest: what the certificate grants.
const SIGNS: f64 = 1e-8;
/// Values that fall with the length of the step, as those of an impulse do, bend by a third.
const IMPULSIVE: f64 = 0.1;
/// Where longer steps look like that, shorter ones have to show this part of the largest value
/// above what may hide in their residual.
const SHOWN: f64 = 1e-3;
/// The part of the largest charge (flux) so far that has to move for that.
const CONTRADICTED: f64 = 1e-4;

/// Corrections that make a short step end with given charges, at most, and how much of the largest
/// charge may be missed in the end.
const HOLDS: usize = 8;
const HELD: f64 = 1e-10;
/// Steps of these parts of the length: a resistance in a pair makes time constants that are not known
/// of the circuit.
const SHORTER: [f64; 3] = [1.0, 1e-3, 1e-6];

/// What steps from where an impulsive one led say of it, worst first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Rest {
    /// they move charges as only a jump does
    Contradicted,
    /// their currents fall with their length: an impulse is left
    Impulsive,
    /// they end in different modes
    Unclear,
    /// they lie on a curve
    Bent,
    /// they lie on a line
    Calm,
}

/// A short step, the values where it begins, and the part of the largest charge that these leave
/// open, if they need no impulse.
pub(super) type Settled = Option<(Short, Short, f64)>;

/// Three steps from a state, as one way to tell the values right there.
struct Candidate {
    /// their residual leaves something to be seen
    shown: bool,
    /// how far they are from a line, and from obeying the signs
    fault: f64,
    /// how far from a line
    bend: f64,
    /// the shortest of them
    once: Short,
    /// their limit
    limit: Short,
}

/// Second difference of three equidistant points, relative to the largest value.
fn bend_of(points: impl Iterator<Item = (f64, f64, f64)>) -> f64 {
    let (bend, largest) = points.fold((0.0f64, 0.0f64), |(bend, largest), (a, b, c)| {
        (bend.max((a - 2.0 * b + c).abs()), largest.max(a.abs()).max(c.abs()))
    });
    if bend > 0.0 {
        bend / largest
    } else {
        0.0
    }
}

/// Values at length 0 from those at length 1, 2 and 3.
pub fn to_zero([once, twice, thrice]: [&[f64]; 3]) -> Vec<f64> {
    let points = once.iter().zip(twice).zip(thrice);
    points.map(|((a, b), c)| 3.0 * a - 3.0 * b + c).collect()
}

impl Stepper {
    /// What the steps that follow an impulsive one say of it.
    pub(super) fn rest(&mut self, leap: &Leap) -> Rest {
        if self.contradicted(leap) {
            Rest::Contradicted
        } else if self.smooth.is_some() {
            // junctions move charge in times that nothing foretells: no sign of an impulse; but where one
            // dies away as the inverse of the time, its values right behind the jump cannot be told
            match &leap.settled {
                Some((_, now, _)) if self.missed_by(&now.z, &now.l) > SIGNS => Rest::Bent,
                _ => Rest::Calm,
            }
        } else {
            leap.rest
        }
    }

    /// Do the steps that follow an impulsive one move charges (fluxes) as only a jump does?
    fn contradicted(&mut self, leap: &Leap) -> bool {
        let Some((once, settled, _)) = &leap.settled else { return false };
        if !self.jumped(None, &leap.after, &once.z, &settled.z, CONTRADICTED) {
            return false;
        }
        // against the charges that the voltages of the network would store: theirs may be nearly 0
        let largest = self.sys.largest(&[&leap.after]);
        let n = leap.after.len();
        let scale: Vec<f64> =
            self.sys.linear.row_kind.iter().map(|&k| largest[usize::from(k)]).collect();
        let moved: Vec<f64> = settled.z.iter().zip(&leap.after).map(|(a, b)| a - b).collect();
        let (mut sizes, mut change) = (vec![0.0; n], vec![0.0; n]);
        self.sys.linear.e.abs_mul_add(&scale, &mut sizes);
        self.sys.linear.e.mul_add(1.0, &moved, &mut change);
        change.iter().zip(&sizes).any(|(c, s)| c.abs() > CONTRADICTED * s)
    }

    /// The shortest of three steps from the charges of `after`, and the values at length 0; what they
    /// look like.
    ///
    /// The steps have to end in one mode, nearly on a line, and to leave the charges alone; if none
    /// do, those that come nearest to a line serve.
    pub(super) fn settle(
        &mut self,
        after: &[f64],
        shortest: f64,
    ) -> Result<(Settled, Rest), Box<Failure>> {
        // ends in different modes: how far they are from a line, and the shortest of them
        let mut last: Option<(f64, Short)> = None;
        let (mut rest, mut impulsive) = (Rest::Unclear, false);
        let mut best: Option<Candidate> = None;
        let mut bends = [f64::NAN; 2];
        let lengths = self.lengths_after(after, shortest);
        for (k, &length) in lengths.iter().enumerate() {
            let straightens = rest == Rest::Bent && bends[1] <= STRAIGHTENS * bends[0];
            if k + 1 == lengths.len() && !straightens {
                break;
            }
            let mut steps = Vec::with_capacity(3);
            let mut one_mode = true;
            for k in [3.0, 2.0, 1.0] {
                let epoch = self.epoch;
                if self.short_step(None, after, k * length, Start::Warm).is_err() {
                    // what an ordinary step cannot reach either is a conflict of sources with
                    // diodes, which shorter steps would but hide behind their multipliers
                    if steps.is_empty() && best.is_none() && last.is_none() {
                        self.short_step(None, after, self.schedule.step_length, Start::Warm)?;
                    }
                    break;
                }
                one_mode &= steps.is_empty() || epoch == self.epoch;
                steps.push(Short { z: self.z.clone(), l: self.l.clone(), length: k * length });
            }
            let Ok([thrice, twice, once]) = <[Short; 3]>::try_from(steps) else { continue };
            let bend = self.bend([&once.z, &twice.z, &thrice.z]);
            bends = [bends[1], bend];
            // modes of equal values, where the laws leave something open, are as good as one
            let carried = once.l.iter().zip(&twice.l).zip(&thrice.l);
            let carried = carried.map(|((a, b), c)| (*a, *b, *c));
            if !one_mode && (bend > BEND || bend_of(carried) > BEND) {
                if last.as_ref().is_none_or(|(least, _)| bend < *least) {
                    last = Some((bend, once));
                }
                continue;
            }
            let limit = self.limit_of([&once, &twice, &thrice]);
            let Short { z, l, .. } = &limit;
            // a diode may block (conduct) after less than the shortest of them: then they lie on the
            // line of the mode that follows, and its start breaks the laws
            let broken = self.broken(z, l, &once) / SIGNS;
            let fine =
                bend <= BEND && broken <= 1.0 && !self.jumped(None, after, &once.z, z, LOOSE);
            let fault = bend.max(BEND * broken);
            impulsive |= bend > IMPULSIVE;
            let shown = self.smooth.is_some() || self.shows(after, &once);
            rest = if bend > IMPULSIVE || (impulsive && !shown) {
                Rest::Impulsive
            } else if fine {
                Rest::Calm
            } else {
                Rest::Bent
            };
            // motion straightens in shorter steps, rounding bends them more
            let better = |best: &Candidate| {
                (shown || !best.shown) && fault < best.fault && bend <= best.bend.max(BEND)
            };
            if fine || best.as_ref().is_none_or(better) {
                best = Some(Candidate { shown, fault, bend, once, limit });
            }
            if fine {
                break;
            }
        }
        // a diode at rest turns with rounding, and shorter steps show nothing else
        let rounding = |bend: f64| {
            let least = last.as_ref().map_or(f64::INFINITY, |last| last.0);
            bend > BEND && least <= STRAIGHTENS * bend
        };
        if let Some(best) = best.filter(|best| !rounding(best.bend)) {
            let Candidate { bend, once, limit: settled, .. } = best;
            let (mut settled, missed) = match rest {
                Rest::Calm | Rest::Bent => self.held(after, &once, settled, bend),
                _ => (settled, 0.0),
            };
            // what bends more in shorter steps, and by no more than rounding may, is a line
            let noise = || self.noise(&once.z, once.length).into_iter().fold(0.0, f64::max);
            let line = rest == Rest::Bent && bends[1] > bend && bend <= noise();
            let calm = line && self.broken(&settled.z, &settled.l, &once) <= SIGNS;
            let rest = if calm { Rest::Calm } else { rest };
            self.centre_neutrals(&mut settled.z, &settled.l);
            return Ok((Some((once, settled, missed)), rest));
        }
        let length = AFTER_JUMP[0] * shortest;
        let once = match last {
            Some((_, once)) => Some(once),
            None => self.two_steps(None, after, length, Start::Warm).ok().map(|(once, _)| once),
        };
        let pair = once.map(|once| {
            let mut settled = once.clone();
            self.centre_neutrals(&mut settled.z, &settled.l);
            (once, settled, 0.0)
        });
        Ok((pair, Rest::Unclear))
    }

    /// Lengths of the steps that show the values right after a jump, longest first.
    fn lengths_after(&self, after: &[f64], shortest: f64) -> Vec<f64> {
        if self.smooth.is_none() {
            return AFTER_JUMP.map(|part| part * shortest).to_vec();
        }
        // what rounding of stored quantities drives in them shall be a line as well: where a blocking junction
        // ties windings, they would show nothing else
        let noise = self.noise(after, 1.0).into_iter().fold(0.0, f64::max);
        let quiet = (noise / BEND).min(AT_ONCE * self.schedule.step_length);
        let parts = AFTER_JUMP[TOO_LONG..].iter().map(|part| part * shortest);
        let quiet = Some(quiet).filter(|quiet| *quiet > AFTER_JUMP[TOO_LONG] * shortest);
        quiet.into_iter().chain(parts).collect()
    }

    /// The limit of three steps, or the shortest of them, if junctions would store there what no step in
    /// between does: their charges are exponentials of what is extrapolated.
    fn limit_of(&mut self, [once, twice, thrice]: [&Short; 3]) -> Short {
        let z = to_zero([&once.z, &twice.z, &thrice.z]);
        if self.functions_store() {
            let [limit, first, last] =
                [&z, &once.z, &thrice.z].map(|z| self.stored_by_functions(z));
            let astray = |i: usize| {
                let rounding = LOOSE * (first[i].abs() + last[i].abs());
                let known =
                    (limit[i] - first[i]).abs() <= 2.0 * (first[i] - last[i]).abs() + rounding;
                !known
            };
            if (0..z.len()).any(astray) {
                return (*once).clone();
            }
        }
        Short { z, l: to_zero([&once.l, &twice.l, &thrice.l]), length: 0.0 }
    }

    /// The values at which a short step ends with the charges of `after`, if they obey the signs as
    /// well as the limit of several, and the part of the largest charge that they miss.  Those of a step
    /// that is farther from the limit than its own points from a line are rounding: fluxes of windings
    /// without leakage are known to that of their currents.
    fn held(&mut self, after: &[f64], once: &Short, limit: Short, bend: f64) -> (Short, f64) {
        let mut open = 0.0;
        // exponentials make much of what extrapolation leaves open
        if self.smooth.is_none() || self.missed_by(&limit.z, &limit.l) > SIGNS {
            for part in SHORTER {
                let Some((held, missed)) = self.hold(after, &once.z, part * once.length) else {
                    break;
                };
                let broken = [&held, &limit].map(|s| self.broken(&s.z, &s.l, once));
                let near = self.sys.apart(&held.z, &limit.z, &once.z) <= bend.max(LOOSE);
                // the voltage of a junction may be the logarithm of the time: no line leads to its begin
                let known = || {
                    self.smooth.is_some()
                        && !self.facts.storage.tight()
                        && self.noise(&once.z, part * once.length)[0] <= LOOSE
                };
                if missed <= HELD && broken[0] <= broken[1].max(SIGNS) && (near || known()) {
                    return (held, missed);
                }
                // motion is missed less by shorter steps, a law that ties charges is not
                open = if missed <= LOOSE { missed } else { 0.0 };
            }
            // the step itself obeys the laws
            if self.smooth.is_some() {
                return (once.clone(), open);
            }
        }
        (limit, open)
    }

    /// Deferred correction: the step begins with as much more as it loses.  All laws without storage
    /// then hold as well as in any step, whatever the rates are; an extrapolation has the rounding
    /// and the curvature of all its points.
    fn hold(&mut self, after: &[f64], sizes: &[f64], length: f64) -> Option<(Short, f64)> {
        let mut from = after.to_vec();
        let mut last = f64::INFINITY;
        for _ in 0..HOLDS {
            self.short_step(None, &from, length, Start::Warm).ok()?;
            let missed: Vec<f64> = after.iter().zip(&self.z).map(|(a, z)| a - z).collect();
            let share = self.part_of_charges(&missed, sizes);
            if share.is_nan() || share >= 0.5 * last {
                break;
            }
            last = share;
            if share <= f64::EPSILON {
                break;
            }
            from.iter_mut().zip(&missed).for_each(|(f, m)| *f += m);
        }
        Some((Short { z: self.z.clone(), l: self.l.clone(), length: 0.0 }, last))
    }

    /// The largest charge (flux) of a change, relative to the largest of a state.
    fn part_of_charges(&self, change: &[f64], state: &[f64]) -> f64 {
        let (mut gaps, sizes) = (vec![0.0; state.len()], self.stored_sizes(state));
        self.sys.linear.e.mul_add(1.0, change, &mut gaps);
        let [gap, size] = [&gaps[..], &sizes].map(|list| self.sys.largest(&[list]));
        let part = |kind: usize| if gap[kind] > 0.0 { gap[kind] / size[kind] } else { 0.0 };
        part(0).max(part(1))
    }

    /// The largest current or voltage of the wrong sign among all pairs, relative to the largest; that
    /// of a short step counts too: where all currents vanish, rounding of theirs is all that is left.
    fn broken(&self, z: &[f64], l: &[f64], once: &Short) -> f64 {
        let w = self.sys.linear.slacks_of(z, l);
        let largest = self.sys.largest(&[z, &once.z]);
        let size = |list: &[f64], floor: f64| list.iter().fold(floor, |a, v| a.max(v.abs()));
        let share = |list: &[f64], size: f64| {
            let least = self.switching.diodes.iter().fold(0.0f64, |a, &i| a.min(list[i]));
            if least < 0.0 {
                -least / size
            } else {
                0.0
            }
        };
        share(l, size(l, size(&once.l, largest[1]))).max(share(&w, size(&w, largest[0])))
    }

    /// Whether the residual of a short step from `after` leaves anything to be seen of ordinary voltages
    /// and currents.
    fn shows(&self, after: &[f64], short: &Short) -> bool {
        let (n, linear) = (short.z.len(), &self.sys.linear);
        let moved: Vec<f64> =
            short.z.iter().zip(after).map(|(z, a)| (z - a) / short.length).collect();
        let mut missed = vec![0.0; n];
        linear.e.mul_add(1.0, &moved, &mut missed);
        linear.g.mul_add(1.0, &short.z, &mut missed);
        linear.a.mul_add(1.0, &short.l, &mut missed);
        linear.s.mul_add(-1.0, &self.u0, &mut missed);
        let stored = self.stored_sizes(&short.z);
        let (mut hidden, mut largest) = ([0.0f64; 2], [0.0f64; 2]);
        for (i, &kind) in linear.row_kind.iter().enumerate() {
            let kind = usize::from(kind);
            // what is there, and what rounding of that which is stored may hide from it
            let here = missed[i].abs() + f64::EPSILON * stored[i] / short.length;
            hidden[kind] = hidden[kind].max(here);
            // voltages of nodes belong to laws of voltages, currents to laws of currents
            largest[1 - kind] = largest[1 - kind].max(short.z[i].abs());
        }
        (0..2).all(|kind| hidden[kind] <= SHOWN * largest[kind])
    }

    /// The sizes of the terms of charges and fluxes of a state.
    pub(super) fn stored_sizes(&self, z: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; z.len()];
        self.sys.linear.e.abs_mul_add(z, &mut out);
        out
    }

    /// What rounding of stored quantities may make of the largest voltage and current in a short step,
    /// relative to them.
    pub(super) fn noise(&self, z: &[f64], length: f64) -> [f64; 2] {
        let stored = self.stored_sizes(z);
        // charges make currents, fluxes voltages
        let [currents, voltages] = self.sys.largest(&[&stored]);
        let largest = self.sys.largest(&[z]);
        let part = |made: f64, largest: f64| if made > 0.0 { made / largest } else { 0.0 };
        let rounding = NOISE * f64::EPSILON / length;
        [part(voltages, largest[0]), part(currents, largest[1])].map(|part| rounding * part)
    }

    /// Second difference of three equidistant points, relative to the largest value of its kind.
    fn bend(&self, [a, b, c]: [&[f64]; 3]) -> f64 {
        let of_kind = |kind: u8| {
            let here = (0..a.len()).filter(move |&j| self.sys.linear.row_kind[j] == kind);
            bend_of(here.map(|j| (a[j], b[j], c[j])))
        };
        of_kind(0).max(of_kind(1))
    }
}

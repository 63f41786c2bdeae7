//! Jump or motion: what a reinitialising step moved has to be the same in a shorter one.
//!
//! Reinitialising steps are short compared with the time constants of a circuit.  What ends motion between two
//! set-valued elements is no time constant: a voltage drives the current of a small inductance to where the next
//! diode takes over, in nanoseconds, and a step longer than that ends after it for any length.

use super::jumps::{StateJump, JUMP};
use super::values::{Rest, Settled};
use crate::integrate::implicit::instants::state_jumps::StateJumps;
use crate::mlcp::Start;
use crate::rounding::OF_SOLUTION;
use crate::tolerances::{CLEARLY, NO_JUMP};

/// Ratio of lengths at which a jump is looked at again: motion falls by that, a jump stays, and the two are distinguished by
/// [`CLEARLY`], which is between them with a decade or more on either side.
const AGAIN: f64 = 1e-3;

/// Where a jump has led, less what the rates right after it move during the one short step, of the length
/// `span`, that had to show it.
pub(in crate::integrate) fn values_after(
    after: &[f64],
    span: f64,
    settled: Option<&Settled>,
) -> Vec<f64> {
    let Some(settled) = settled.filter(|_| span > 0.0) else { return after.to_vec() };
    after.iter().zip(settled.rates()).map(|(z, rate)| z - span * rate).collect()
}

impl StateJumps<'_> {
    /// Whether a reinitialising step has moved anything but as motion does.
    pub(in crate::integrate) fn has_jumped(
        &mut self,
        charges: Option<&[f64]>,
        before: &[f64],
        state_jump: &StateJump,
    ) -> bool {
        let mut largest = self.instants.largest;
        let begun = values_after(&state_jump.after, state_jump.span, state_jump.settled.as_ref());
        let sides = [before, &state_jump.first, &begun];
        self.moved(sides, charges, NO_JUMP, None, &mut largest, &[])
    }

    /// Is there a jump to report, relative to `values` to which it leads?  A charge `q` of a capacitor `C`
    /// counts as `q / sqrt(C)`, the root of its energy: a small one next to large ones may jump too.
    pub(in crate::integrate) fn noticed(
        &mut self,
        charges: Option<&[f64]>,
        sides: [&[f64]; 3],
        values: &[f64],
    ) -> bool {
        let weights = std::mem::take(&mut self.instants.weights);
        let mut largest = self.instants.heaviest;
        let found = self.moved(sides, charges, NO_JUMP, Some(&weights), &mut largest, values);
        self.instants.heaviest = largest;
        self.instants.weights = weights;
        found
    }

    /// Did stored charges or fluxes, by their weights if they have any, change by more than `share` of the
    /// `largest_so_far`?  A change that extrapolation to length 0 takes away was not a jump but the ordinary
    /// motion during the short step; one that it turns round was motion that begins with the square
    /// of the time.
    fn moved(
        &mut self,
        [before, first, after]: [&[f64]; 3],
        charges: Option<&[f64]>,
        share: f64,
        weights: Option<&[f64]>,
        largest_so_far: &mut [f64; 2],
        values: &[f64],
    ) -> bool {
        let mut lists = std::mem::take(&mut self.instants.moving);
        let [old, once, new, scale, noise] = &mut lists;
        match charges {
            Some(charges) => {
                old.clear();
                old.extend_from_slice(charges);
            }
            None => self.solver.store_at(self.state, before, old),
        }
        self.solver.store_at(self.state, first, once);
        self.solver.store_at(self.state, after, new);
        // what rounding of the largest voltage (current) makes of each charge (flux)
        let (kinds, largest) =
            (&self.solver.sys.linear.row_kind, self.solver.sys.largest(&[after, values]));
        scale.clear();
        scale.extend(kinds.iter().map(|&k| largest[usize::from(k)]));
        noise.clear();
        noise.resize(kinds.len(), 0.0);
        self.solver.sys.linear.e.abs_mul_add(scale, noise);
        let weight = |i: usize| weights.map_or(1.0, |weights| weights[i]);
        // a current that flows on through other stores is extrapolated to rounding of it
        let mut most = [0.0f64; 2];
        for (i, &kind) in kinds.iter().enumerate() {
            let kind = usize::from(kind);
            // against the largest so far: a flux that has just decayed to rounding does not jump
            let largest = &mut largest_so_far[kind];
            *largest = largest.max(weight(i) * old[i].abs().max(new[i].abs()));
            most[kind] = most[kind].max((once[i] - old[i]).abs());
        }
        let found = kinds.iter().enumerate().any(|(i, &kind)| {
            let kind = usize::from(kind);
            let (change, moved) = (new[i] - old[i], once[i] - old[i]);
            weight(i) * change.abs() > share * largest_so_far[kind]
                && change.abs() > OF_SOLUTION * noise[i].max(most[kind])
                && change.abs() > CLEARLY * moved.abs()
                && change.signum() == moved.signum()
        });
        self.instants.moving = lists;
        found
    }

    /// A reinitialising step from the state `begun` that has moved something, or a shorter one in which most of
    /// that did not move.
    pub(in crate::integrate) fn without_motion(
        &mut self,
        charges: Option<&[f64]>,
        begun: &(Vec<f64>, Vec<f64>),
        mut state_jump: StateJump,
        shortest: f64,
        start: Start,
    ) -> StateJump {
        // what junctions end has no time constant that is known: a step short compared with all that are
        // may be long compared with it, and its square is no jump
        let shortest_part = if self.solver.smooth.is_some() { AGAIN * JUMP } else { JUMP };
        while state_jump.part > shortest_part && self.has_jumped(charges, &begun.0, &state_jump) {
            (self.state.z, self.state.l) = begun.clone();
            let part = (AGAIN * state_jump.part).max(shortest_part);
            let Ok(next) = self.state_jump(charges, part, shortest, start) else { break };
            if self.alike(charges, &begun.0, [&state_jump, &next])
                || next.rest < state_jump.rest.min(Rest::Bent)
            {
                break;
            }
            state_jump = next;
        }
        state_jump
    }

    /// What follows from the present charges and fluxes, if laws leave them where they are.
    pub(in crate::integrate) fn unmoved(
        &mut self,
        begun: &(Vec<f64>, Vec<f64>),
        shortest: f64,
    ) -> Option<StateJump> {
        let (mut before, multipliers) = begun.clone();
        self.facts.storage.project(&mut before);
        let (settled, rest) = self.settle(&before, shortest).ok()?;
        let functions = self.solver.smooth.as_ref().map_or(0, |smooth| smooth.f.len());
        let impulses = [before.len(), multipliers.len(), functions].map(|len| vec![0.0; len]);
        let first = before.clone();
        let [length, span] = [0.0; 2];
        let still = StateJump {
            first,
            part: 0.0,
            after: before,
            impulses,
            length,
            span,
            multipliers,
            settled,
            rest,
        };
        (rest == Rest::Calm).then_some(still)
    }

    /// Whether two reinitialising steps from the state `before` have moved the same.
    fn alike(
        &mut self,
        charges: Option<&[f64]>,
        before: &[f64],
        state_jumps: [&StateJump; 2],
    ) -> bool {
        let old =
            charges.map_or_else(|| self.solver.stored_at(self.state, before), <[f64]>::to_vec);
        let [once, again] =
            state_jumps.map(|state_jump| self.solver.stored_at(self.state, &state_jump.after));
        let kinds = &self.solver.sys.linear.row_kind;
        let largest = |a: &[f64], b: &[f64], of: usize| {
            let rows = a.iter().zip(b).zip(kinds).filter(|row| usize::from(*row.1) == of);
            rows.fold(0.0f64, |most, ((a, b), _)| most.max((a - b).abs()))
        };
        (0..2).all(|kind| {
            let moved = largest(&once, &old, kind);
            moved <= NO_JUMP * self.instants.largest[kind]
                || largest(&once, &again, kind) <= CLEARLY * moved
        })
    }
}

//! Where diodes change but nothing jumps: the next mode, and the values with which it begins.
//!
//! In a passive network charges and fluxes are continuous unless a source or a switch acts.  The mode
//! that follows is that of a step from where the last one ended, short beside all that moves, but long
//! enough for the change to show: what has just become zero is zero up to rounding after a shorter one.
//! The sources move on in it: where all that is stored is constant, they alone end a mode.

use super::jumps::JUMP;
use crate::integrate::sdirk::sources;
use crate::integrate::theta::stepper::Stepper;
use crate::mlcp::Start;

/// The first, relative to the shortest time: it moves by that part, far above rounding of what has just become zero.
const FIRST: f64 = 2e-4;
/// Ratio of the lengths tried: any finds the same mode, and with this one five lengths span four decades.
const LONGER: f64 = 8.0;

/// What was found after an instant at which guards vanish.
pub(in crate::integrate) enum Turn {
    /// something may jump here: the state is as it was
    Jump,
    /// no change that so short steps tell: the state is as it was
    Nothing,
    /// the next mode, and the values with which it begins
    Begun,
}

impl Stepper {
    /// Finds the mode after an instant at which guards vanish, from steps of at most `longest` whose ends are
    /// `lawful`; sources have no breakpoint before the time `breakpoint`.
    pub(in crate::integrate) fn turn(
        &mut self,
        longest: f64,
        breakpoint: f64,
        lawful: impl Fn(&Stepper) -> bool,
    ) -> Turn {
        if self.instants.impacts.active
            || self.solver.smooth.is_some()
            || self.facts.storage.tight()
        {
            return Turn::Jump;
        }
        let (z, l, active) =
            (self.state.z.clone(), self.state.l.clone(), self.state.active.clone());
        let now = self.state.u0.clone();
        let shortest = self.schedule.step_length.min(self.facts.fastest);
        let mut length = FIRST * shortest;
        while length <= longest {
            sources(
                &self.waveforms,
                self.state.time + length,
                self.state.time,
                breakpoint,
                &mut self.state.u0,
            );
            let solved =
                self.solver.short_step(&mut self.state, None, &z, length, Start::Warm).is_ok();
            self.state.u0.copy_from_slice(&now);
            // what charges in so short a step round off decides about no pair
            let turned = solved && self.state.active != active && lawful(self);
            if turned && self.begin_mode(&z, shortest) {
                return Turn::Begun;
            }
            self.state.z.copy_from_slice(&z);
            self.state.l.copy_from_slice(&l);
            self.state.turn_to(&active);
            if turned {
                return Turn::Nothing;
            }
            length *= LONGER;
        }
        Turn::Nothing
    }

    /// The values at the begin of the mode just found, from shorter steps that stay in it; false if
    /// there are none.
    fn begin_mode(&mut self, z: &[f64], shortest: f64) -> bool {
        let mode = self.state.active.clone();
        self.state.z.copy_from_slice(z);
        // what should vanish, but does not quite where the last mode ended, is thrown out
        let Ok(state_jump) = self.jumps().state_jump(None, JUMP, shortest, Start::Warm) else {
            return false;
        };
        if self.state.active != mode {
            return false;
        }
        self.enter(None, z.to_vec(), state_jump);
        if let Some(sums) = &mut self.recorder.sums {
            sums.jump(z, &self.state.z);
        }
        true
    }
}

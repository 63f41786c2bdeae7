//! Impacts: jumps where no mode can be entered, since a gap closes at speed (an index above 2).
//!
//! The state after the impact is the limit of three short implicit steps, as in time stepping.

use crate::integrate::to_zero;
use crate::modewise::events::successor::roles;
use crate::modewise::modes::implicit_step::later;
use crate::modewise::output::inspect::MAX_JUMPS;
use crate::modewise::run::Engine;
use crate::rounding::OF_SOLUTION;
use crate::tolerances::CLEARLY;

/// Lengths of the first of the steps, relative to the segment that follows.
const PARTS: [f64; 2] = [1e-6, 1e-8];
/// The same relative to the fastest time constant so far: a decay that ended within a step would look like a jump.  No
/// test distinguishes a decade more or less.
const FASTEST: f64 = 1e-3;
/// The ends of the steps deviate from a line by no more than this part of the largest value, and by
/// no more than a tenth of what jumps; no test distinguishes a decade more or less.
const BEND: f64 = 1e-6;

impl Engine {
    /// Jumps from the present state if short steps show that it does; false if it stays.
    pub(in crate::modewise) fn impact(&mut self, horizon: f64) -> bool {
        let fastest = self.motion.present.as_ref().map_or(0.0, |p| p.1.fastest);
        let most = if fastest > 0.0 { FASTEST / fastest } else { f64::INFINITY };
        PARTS.iter().any(|part| self.impact_within((part * horizon).min(most)))
    }

    fn impact_within(&mut self, h: f64) -> bool {
        let roles = roles(self.prepared.net.m, &self.prepared.switches, &self.control.gates);
        let (mut v, mut steps) = (Vec::new(), Vec::with_capacity(3));
        for k in [1.0, 2.0, 3.0] {
            later(&self.motion.segment, k * h, &mut v);
            let length = k * h;
            let taken = self.try_step(&v, &roles, length);
            if !taken.is_ok_and(|t| !t.suspect) {
                return false;
            }
            let scaled = |list: &[f64]| list.iter().map(|v| v * length).collect::<Vec<f64>>();
            let (z, l) = (&self.implicit.z, &self.implicit.l);
            steps.push([self.coordinates(z), z.clone(), scaled(z), scaled(l)]);
        }
        let of = |k: usize| [0, 1, 2].map(|step: usize| steps[step][k].as_slice());
        let a = to_zero(of(0));
        let norm = |f: &dyn Fn(usize) -> f64| (0..a.len()).fold(0.0f64, |m, i| m.hypot(f(i)));
        let [first, second, third] = of(0);
        let bend = norm(&|i| first[i] - 2.0 * second[i] + third[i]);
        let change = norm(&|i| a[i] - self.state.a[i]);
        let clear = bend <= BEND * self.scale.a && bend <= CLEARLY * change;
        if !clear || change <= OF_SOLUTION * self.scale.a {
            return false;
        }
        let before = self.unknowns_from(&self.state.a);
        let [after, unknowns, multipliers] = [1, 2, 3].map(|k| to_zero(of(k)));
        let origin = std::mem::replace(&mut self.state.a, a);
        self.count_jump(&origin);
        if self.log.jumps.len() < MAX_JUMPS {
            self.keep_jump([before, after], [unknowns, multipliers], h);
        }
        true
    }
}

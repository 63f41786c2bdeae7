//! The balance of energy over a whole run, in a few sums.
//!
//! Every step gives what its sources delivered, what was dissipated and what its scheme has taken,
//! each from the state at its points (see [`super::steps`] and [`super::intervals`]).  If all steps
//! obey the laws and each begins where the last one ended, the sums lead from the first stored energy
//! to the last one, jumps aside:
//!
//! ```text
//! W(end) - W(begin) = delivered - dissipated - scheme + sum over jumps of (W(after) - W(before))
//! ```
//!
//! Stored energies are computed at the two ends of the run and around jumps alone, so that a state
//! that changes between two steps breaks the equation as much as a step that breaks a law.  Nothing is
//! kept of a step but the sums.

use super::powers::Powers;
use super::step_errors::{ErringStep, StepErrors};
use super::{ratio, worse, Between, TOLERANCE};
use crate::dense::dot;
use crate::descriptor::{Linear, Smooth};
use crate::sparse::Csc;

/// What the sums of a run came to [J].
#[derive(Clone, Copy, Debug, Default)]
pub struct Balance {
    /// stored energy at the end less that at the begin, jumps aside
    pub stored: f64,
    /// by independent sources
    pub delivered: f64,
    /// in resistors, controlled sources and set-valued elements
    pub dissipated: f64,
    /// taken by the scheme
    pub scheme: f64,
    /// lost in steps over instants: see [`Sums::pass_over`]
    pub instants: f64,
    /// all that was delivered and dissipated, and the largest that was stored
    pub turned: f64,
    /// relative error of the sums
    pub drift: f64,
    /// steps
    pub steps: u64,
    /// largest error of a recorded step in units of what was asked
    pub step_error: f64,
    /// largest change of what is stored between steps that no jump reports, as the root of its energy, relative to that
    /// of the largest
    pub unreported: f64,
}

/// How much more a step may move than all before it to count in full: what one stage beyond all bounds
/// turns over is no measure of the run.
const STATE_JUMP: f64 = 1e3;
/// Steps between which rounding is looked at where the mode stays.
const LOOKED_AT: u64 = 16;
/// Powers of two by which rounding in such steps is beyond the usual one.
const FAR: i64 = 10;
/// What it may be, in units of the tolerance: a hundredth of all energies.
const STATE_JUMPS: f64 = 1e6;

/// A step with several points.
pub struct Points<'a> {
    /// its length [s]
    pub length: f64,
    /// weights of the points, as parts of the length
    pub weight: &'a [f64],
    /// `w_i a_ij + w_j a_ji - w_i w_j`, row by row, as parts of its square; none where the scheme takes no energy
    pub taken: &'a [f64],
    /// unknowns at each point, and the rates of those that are stored
    pub z: &'a [&'a [f64]],
    /// see `z`
    pub rate: &'a [&'a [f64]],
    /// multipliers, (points, m)
    pub l: &'a [f64],
    /// sources at each point
    pub u: &'a [&'a [f64]],
    /// smooth functions at each point, and their rates
    pub f: &'a [&'a [f64]],
    /// see `f`
    pub f_rate: &'a [&'a [f64]],
}

/// What has been added up [J].
#[derive(Clone, Debug, Default)]
struct Totals {
    /// stored at the begin
    first: Option<f64>,
    /// by jumps
    jumped: f64,
    delivered: f64,
    dissipated: f64,
    scheme: f64,
    /// of this, in steps over instants
    instants: f64,
    /// all of it without signs, of a state_jump as much as counts
    moved: f64,
    /// largest stored energy, according to the sums
    peak: f64,
    /// energy of the largest change between steps that no jump reports
    unreported: f64,
    steps: u64,
}

impl Totals {
    /// Takes what a step has moved that ends at `z`.
    #[inline]
    fn add(&mut self, parts: [f64; 3], powers: &Powers, z: &[f64]) {
        let moved: f64 = parts.iter().map(|part| part.abs()).sum();
        let known = self.moved + self.peak;
        self.sum(parts);
        if moved <= STATE_JUMP * known {
            self.moved += moved;
            self.peak = self.peak.max(self.expected().abs());
        } else {
            let energy = powers.energy(z).abs();
            self.moved += moved.min(STATE_JUMP * (known + energy));
            self.peak = self.peak.max(energy);
        }
    }

    #[inline]
    fn sum(&mut self, [delivered, dissipated, scheme]: [f64; 3]) {
        self.delivered += delivered;
        self.dissipated += dissipated;
        self.scheme += scheme;
        self.steps += 1;
    }

    /// Stored energy according to the sums.
    fn expected(&self) -> f64 {
        let begin = self.first.unwrap_or(0.0) + self.jumped;
        begin + (self.delivered - self.dissipated - self.scheme)
    }
}

/// Rounding that steps may have left in the laws.
#[derive(Clone, Debug, Default)]
struct Rounding {
    /// as energy, and that of steps beyond all others
    held: f64,
    state_jumps: f64,
    /// sum of the binary exponents of its parts, and how many
    usual: (i64, i64),
    /// points and time of steps since then, and the largest voltage and current of the last point
    recent: (u64, f64),
    present: [f64; 2],
    /// points of all steps and motions; points and time of motions
    points: u64,
    motions: (u64, f64),
    largest: [f64; 2],
}

impl Rounding {
    /// Whether a number is far beyond the geometric mean of all so far, which a few of them hardly move.
    fn is_unusual(&mut self, number: f64) -> bool {
        let exponent = (number.to_bits() >> 52) as i64;
        let (sum, count) = &mut self.usual;
        let unusual = *count > 0 && exponent - *sum / *count > FAR;
        if number > 0.0 {
            (*sum, *count) = (*sum + exponent, *count + 1);
        }
        unusual
    }

    /// Counts points of steps and their time.
    #[inline]
    fn pass(&mut self, points: u64, time: f64) {
        self.recent = (self.recent.0 + points, self.recent.1 + time);
        self.points += points;
    }
}

/// Adds up the energies of the steps of a run.
#[derive(Clone, Debug)]
pub struct Sums {
    powers: Powers,
    totals: Totals,
    rounded: Rounding,
    /// charge and flux by which laws are missed
    missed: [f64; 2],
    residual: Vec<f64>,
    /// where the last step, or the jump after it, has ended
    left: Vec<f64>,
    /// of these, what currents of conducting pairs are known to
    known: Vec<f64>,
    /// errors of steps, where nothing is smooth
    errors: Option<StepErrors>,
}

impl Sums {
    /// Nothing so far; none where nothing is stored.
    pub fn new(
        linear: &Linear,
        between: Between,
        averaging: Option<&(Csc, Csc)>,
        smooth: Option<&Smooth>,
    ) -> Option<Sums> {
        if linear.e.values.iter().all(|&v| v == 0.0) {
            return None;
        }
        let powers = Powers::new(linear, between, averaging, smooth);
        Some(Sums {
            powers,
            totals: Totals::default(),
            rounded: Rounding::default(),
            missed: [0.0; 2],
            residual: Vec::new(),
            left: Vec::new(),
            known: Vec::new(),
            errors: smooth.is_none().then(|| StepErrors::new(linear, between)),
        })
    }

    fn begin(&mut self, z: &[f64]) {
        if self.totals.first.is_none() {
            let energy = self.powers.energy(z);
            (self.totals.first, self.totals.peak) = (Some(energy), energy.abs());
            self.look(z, &[], &[]);
        }
    }

    /// Takes the largest voltage and current at the end of steps.
    fn look(&mut self, z: &[f64], l: &[f64], f: &[f64]) {
        let mut here = [0.0; 2];
        self.powers.reach.see(&self.powers.kinds, z, l, &mut here);
        let most = |a: [f64; 2]| [a[0].max(here[0]), a[1].max(here[1])];
        (self.rounded.largest, self.rounded.present) =
            (most(self.rounded.largest), most(self.rounded.present));
        let recent = std::mem::take(&mut self.rounded.recent);
        let told = self.powers.rounding(recent, &self.rounded.present);
        let unusual = self.rounded.is_unusual(told);
        if unusual && told > self.totals.moved + self.totals.peak {
            // where an inductor loses its last current one node has kilovolts, and what is stored elsewhere none
            self.rounded.state_jumps += told.min(self.powers.rounding_at(recent, [z, l, f]));
        } else {
            self.rounded.held += told;
        }
        self.rounded.present = here;
    }

    /// Takes an implicit step of the length `h` from `z0`, `u0` to `z`, `l`, `u`; `f` are the smooth
    /// functions at its end and their rates; `new` if its mode is another one than before.
    pub fn step(
        &mut self,
        h: f64,
        [z0, z]: [&[f64]; 2],
        l: &[f64],
        [u0, u]: [&[f64]; 2],
        [f, f_rate]: [&[f64]; 2],
        new: bool,
    ) {
        self.begin(z0);
        self.pass(z0, z);
        if new || self.totals.steps.is_multiple_of(LOOKED_AT) {
            self.look(z, l, f);
        }
        let mut scheme = 0.5 * self.powers.stored.at(|k| z[k] - z0[k]);
        if let Some((by_unknowns, by_sources)) = &self.powers.averaging {
            let unknowns = by_unknowns.between(z, |k| z[k] - z0[k]);
            scheme += h * (unknowns + by_sources.between(z, |k| u[k] - u0[k]));
        }
        let power = self.powers.lost(z, l, [f, f_rate]);
        let dissipated = h * power + self.powers.controls.between(z, |k| z[k] - z0[k]);
        let delivered = h * self.powers.s.between(z, |k| u[k]);
        self.rounded.pass(1, h);
        self.totals.add([delivered, dissipated, scheme], &self.powers, z);
    }

    /// What the scheme has taken so far.
    pub fn taken(&self) -> f64 {
        self.totals.scheme
    }

    /// Notes that the last step has stepped across an instant, before which the scheme had taken `taken`: a winding
    /// that is torn off loses its energy in no time, in the step as in a jump.
    pub fn pass_over(&mut self, taken: f64) {
        self.totals.instants += self.taken() - taken;
    }

    /// Whether energies of steps with several points, none of which the scheme takes, depend on rates.
    pub fn asks_rates(&self) -> bool {
        !self.powers.controls.is_empty()
    }

    /// Takes a step with several points from `z0`.
    pub fn points(&mut self, z0: &[f64], all: &Points) {
        self.begin(z0);
        if let Some(last) = all.z.last() {
            self.pass(z0, last);
        }
        let (m, count) = (self.powers.pairs, all.weight.len());
        let (mut delivered, mut dissipated, mut time) = (0.0, 0.0, 0.0);
        for (i, &weight) in all.weight.iter().enumerate() {
            if weight == 0.0 {
                continue;
            }
            let (z, l, u) = (all.z[i], &all.l[i * m..], all.u[i]);
            let [f, f_rate, rate] =
                [all.f, all.f_rate, all.rate].map(|points| points.get(i).copied().unwrap_or(&[]));
            let power = self.powers.lost(z, l, [f, f_rate]);
            dissipated += weight * (power + self.powers.controls.between(z, |k| rate[k]));
            delivered += weight * self.powers.s.between(z, |k| u[k]);
            time += all.length * weight.abs();
        }
        let scheme = match all.taken {
            [] => 0.0,
            taken => 0.5 * self.powers.stored.products(all.rate, taken),
        };
        self.rounded.pass(count as u64, time);
        let h = all.length;
        if let Some(last) = all.z.last() {
            self.totals.add([h * delivered, h * dissipated, h * h * scheme], &self.powers, last);
            let l = all.l.get((count - 1) * m..).unwrap_or(&[]);
            self.look(last, l, all.f.last().copied().unwrap_or(&[]));
        }
    }

    /// Finds the error of a recorded step.
    pub fn recorded(&mut self, step: &ErringStep) {
        if let Some(errors) = &mut self.errors {
            errors.take(step);
        }
    }

    /// The state from which a run begins, whose steps are handed over one by one.
    pub fn start(&mut self, z: &[f64]) {
        self.totals.first = None;
        self.begin(z);
    }

    /// Takes a motion of some length, of which the integrals of both powers are known.
    pub fn motion(&mut self, length: f64, [dissipated, delivered]: [f64; 2]) {
        self.left.clear(); // where a motion begins and ends is compared by those who know it
        self.rounded.motions = (self.rounded.motions.0 + 1, self.rounded.motions.1 + length);
        self.rounded.points += 1;
        self.totals.sum([delivered, dissipated, 0.0]);
        self.totals.moved += delivered.abs() + dissipated.abs();
        self.totals.peak = self.totals.peak.max(self.totals.expected().abs());
    }

    /// Takes integrals of the rates of what is stored, unknowns, multipliers and sources over a motion:
    /// what they miss the laws by is charge and flux that times its unknown is missing in the balance.
    /// Rounding of what stores half a joule alone is no miss, nor is that of the voltages of pairs that conduct through
    /// a resistance over this `time`.
    pub fn miss(&mut self, time: f64, [rate, z, l, u]: [&[f64]; 4], rounding: f64) {
        self.residual.clear();
        self.residual.resize(z.len(), 0.0);
        self.powers.laws[0].add(1.0, rate, &mut self.residual);
        self.powers.laws[1].add(1.0, z, &mut self.residual);
        self.powers.a.add(1.0, l, &mut self.residual);
        self.powers.s.add(-1.0, u, &mut self.residual);
        self.known.clear();
        self.known.resize(z.len(), 0.0);
        let size = |j: usize| z[j].abs();
        self.powers.reach.through_pairs(|pair| l[pair] != 0.0, time, size, &mut self.known);
        let part = TOLERANCE * self.powers.share;
        let rows = self.residual.iter().zip(&self.known).zip(&self.powers.joule);
        for (((missed, known), joule), &kind) in rows.zip(&self.powers.kinds) {
            let excess = missed.abs() - rounding * joule - part * known;
            self.missed[usize::from(kind)] += excess.max(0.0);
        }
    }

    /// Steps so far.
    pub fn steps(&self) -> u64 {
        self.totals.steps
    }

    /// Takes the largest voltage and current from a point.
    pub fn see(&mut self, z: &[f64], l: &[f64]) {
        self.powers.reach.see(&self.powers.kinds, z, l, &mut self.rounded.largest);
    }

    /// Takes an energy that was stored at some instant.
    pub fn see_stored(&mut self, energy: f64) {
        self.totals.peak = self.totals.peak.max(energy);
    }

    /// A step leads from `begin`, where the last one should have ended, to `end`.
    fn pass(&mut self, begin: &[f64], end: &[f64]) {
        if !self.left.is_empty() && self.left != begin {
            let left = std::mem::take(&mut self.left);
            self.compare(&left, begin);
            self.left = left;
        }
        self.left.clear();
        self.left.extend_from_slice(end);
    }

    /// What is stored in one state should be what is stored in the other.
    fn compare(&mut self, one: &[f64], other: &[f64]) {
        let change = 0.5 * self.powers.stored.at(|k| other[k] - one[k]).abs();
        if worse(change, self.totals.unreported) {
            self.totals.unreported = change;
        }
        self.totals.peak = self.totals.peak.max(self.powers.energy(other).abs());
    }

    /// Takes a jump; what it leads to is `reported`, or nothing is, where it is none.
    pub fn jump(&mut self, before: &[f64], after: &[f64], reported: Option<&[f64]>) {
        if self.totals.first.is_none() {
            return;
        }
        self.compare(reported.unwrap_or(before), after);
        self.left.clear();
        self.left.extend_from_slice(after);
        let change = self.powers.energy(after) - self.powers.energy(before);
        self.totals.jumped += change;
        self.totals.moved += change.abs();
        self.totals.peak = self.totals.peak.max(self.totals.expected().abs());
    }

    /// The balance of a run that has come to `z`.
    ///
    /// What rounding may add up to in all steps is no error.  Their sums are rounded once for each point.
    pub fn balance(&mut self, z: &[f64]) -> Balance {
        let Some(first) = self.totals.first else { return Balance::default() };
        let last = self.powers.energy(z);
        let held = self.rounded.held
            + self.powers.rounding(self.rounded.recent, &self.rounded.present)
            + self.powers.rounding(self.rounded.motions, &self.rounded.largest);
        let points = self.rounded.points as f64;
        let added = points * f64::EPSILON / TOLERANCE * self.totals.moved;
        let known = self.totals.moved + self.totals.peak + first.abs() + last.abs();
        let scale = known + held + added + self.rounded.state_jumps.min(STATE_JUMPS * known);
        let missing = dot(&self.missed, &self.rounded.largest);
        let error = (last - self.totals.expected()).abs() + missing;
        Balance {
            stored: last - first - self.totals.jumped,
            delivered: self.totals.delivered,
            dissipated: self.totals.dissipated,
            scheme: self.totals.scheme - self.totals.instants,
            instants: self.totals.instants,
            // next to active sources elsewhere, a network at rest moves with their rounding
            turned: self.totals.moved
                + self.totals.peak.max(first.abs()).max(last.abs())
                + TOLERANCE * held,
            drift: ratio(error, scale.max(f64::MIN_POSITIVE / TOLERANCE)),
            steps: self.totals.steps,
            step_error: self.errors.as_ref().map_or(0.0, StepErrors::result),
            unreported: ratio(self.totals.unreported.sqrt(), self.totals.peak.sqrt()),
        }
    }
}

#[cfg(test)]
mod tests;

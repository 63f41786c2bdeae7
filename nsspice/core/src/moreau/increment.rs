//! Increments: rates by the laws, where steps would subtract numbers that are nearly equal.
//!
//! An increment of a short length solves the equations of a step without the unknowns to which it would be added,
//! so that it loses no digits by being short; but beside the storage of so short a one leakage may be drowned.

use super::stepper::Stepper;

/// Their lengths, relative to that of the steps that have shown the values.
const LENGTHS: [f64; 5] = [1e-6, 1e-3, 1.0, 1e3, 1e6];
/// How long before the present time sources are asked for their slopes, and the longest increment, relative to the
/// nominal step.
pub(super) const BEFORE: f64 = 1e-6;
/// Ratio of two lengths that tell what does not vanish with them.
pub(super) const AGAIN: f64 = 0.1;
/// Laws without storage are obeyed where no more than this part of what they missed is left, or of the largest
/// value.
const SHARE: f64 = 0.1;
const OBEYED: f64 = 1e-15;

impl Stepper {
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
            self.facts.storage.unknowns().for_each(|j| x[j] = 0.0);
            self.z.iter_mut().chain(&mut self.l).zip(&x).for_each(|(value, x)| *value += x);
            let after = self.missed_without_storage();
            let after = self.sys.largest(&[&after]);
            if after.iter().zip(goal).all(|(after, goal)| *after <= SHARE * goal) {
                return;
            }
            (self.z, self.l) = (z.clone(), l.clone());
        }
    }

    /// What linear laws without storage miss at the present state.
    fn missed_without_storage(&mut self) -> Vec<f64> {
        let [acting, _] = self.at_present(Stepper::acting_at);
        let laws = acting.iter().zip(&self.facts.at_once.stores);
        laws.map(|(acting, stores)| if *stores { 0.0 } else { -acting }).collect()
    }

    /// Solves the matrix of an increment in the present mode; none if this is singular.
    fn solve_increment(&mut self, length: f64, x: &mut [f64]) -> Option<()> {
        let k = self.stage_index(length, true);
        let stage = &mut self.levels.stages[k];
        let factor = stage.factor(&self.active, self.epoch);
        if !factor.regular() {
            return None;
        }
        factor.solve(x, &mut self.scratch.work);
        x.iter().all(|value| value.is_finite()).then_some(())
    }

    /// Whether little but the rounding of fluxes may be left of some potentials in short steps: junctions and small
    /// capacitors ask for very short ones.
    pub(super) fn is_rounded(&self) -> bool {
        self.facts.storage.tight() || self.facts.at_once.ties_rates
    }

    /// Lengths of increments, shortest first; where short steps are rounded, that of those that have shown the values
    /// is short enough.
    fn lengths(&self, shown: f64) -> impl Iterator<Item = f64> {
        let longest = shown.max(BEFORE * self.schedule.step_length);
        let least = if self.is_rounded() { 1.0 } else { 0.0 };
        let ratios = LENGTHS.into_iter().filter(move |&ratio| ratio >= least);
        ratios.map(move |ratio| ratio * shown).filter(move |&length| length <= longest)
    }

    /// The rates of unknowns and multipliers by the shortest increment that determines them, and its length.
    pub(super) fn first_increment(
        &mut self,
        slopes: &[f64],
        shown: f64,
    ) -> Option<(Vec<f64>, f64)> {
        self.lengths(shown).find_map(|length| Some((self.increment(slopes, length)?, length)))
    }

    /// The rates by two increments, given those by one of some length or by longer ones: by the longer, whose
    /// length comes last, and by the shorter.
    pub(super) fn two_increments(
        &mut self,
        slopes: &[f64],
        rates: Vec<f64>,
        first: f64,
        shown: f64,
    ) -> Option<(Vec<f64>, Vec<f64>, f64)> {
        let mut known = Some(rates);
        self.lengths(shown).filter(|&length| length >= first).find_map(|length| {
            let longer = known.take().or_else(|| self.increment(slopes, length))?;
            Some((longer, self.increment(slopes, AGAIN * length)?, length))
        })
    }

    /// The rates of unknowns and multipliers in the present mode;
    /// none if it does not determine them.
    pub(super) fn increment(&mut self, slopes: &[f64], length: f64) -> Option<Vec<f64>> {
        let (n, m) = (self.z.len(), self.l.len());
        let mut driven = vec![0.0; n];
        self.sys.linear.s.mul_add(1.0, slopes, &mut driven);
        if self.smooth.is_some() {
            let [mut missed, _] = self.at_present(Stepper::acting_at);
            missed.iter_mut().for_each(|missed| *missed = -*missed);
            let state = [&self.z[..], &self.u0, slopes];
            let smooth = self.smooth.as_mut()?;
            let clock = smooth.clock(self.time);
            smooth.newton.set_rate(1.0 / length);
            return smooth.newton.rates(state, clock, [&missed, &driven]);
        }
        let mut x = driven;
        let [acting, _] = self.at_present(Stepper::acting_at);
        let rows = x.iter_mut().zip(&acting).zip(&self.facts.at_once.stores).filter(|row| *row.1);
        rows.for_each(|((x, acting), _)| *x -= acting / length);
        x.resize(n + m, 0.0);
        self.solve_increment(length, &mut x)?;
        Some(x)
    }
}

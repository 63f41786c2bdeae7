//! A block of points: the sizes of the terms in each law are found for all of them, then each is
//! judged.

use super::laws::{Auditor, Seen};
use super::matrix::Entries;
use super::rounding::RoundingUnit;
use super::{ratio, worse, TOLERANCE};
use crate::tolerances::{CLEARLY, FLOOR};

/// Numbers in a block at which it is judged: what is kept of them fits into a fast cache.
const FULL: usize = 1 << 12;

/// Rounding of what is stored excuses no more than this part of the terms of the laws of a group, or of the largest
/// voltage of a branch, which would leave nothing to be judged.
pub(super) const EXCUSED: f64 = 1e-3;
/// Where potentials are distant, rounding counts that exceeds this part of the largest current.
const COUNTS: f64 = 1e-2;

/// What is known of one point.
pub struct Point<'a> {
    pub z: &'a [f64],
    pub l: &'a [f64],
    pub u: &'a [f64],
    /// values of the smooth functions
    pub f: &'a [f64],
    /// 0 complementary pair, 1 closed (w = 0), 2 open (lambda = 0); empty if all are complementary
    pub roles: &'a [u8],
    /// a state right after a jump: laws with storage say nothing, but sums of those of groups do,
    /// beyond what rounding of charges makes of currents
    pub after_jump: bool,
    /// signs of the pairs are not promised here
    pub unsigned: bool,
}

/// Points to be judged together.
#[derive(Default)]
pub struct Block {
    count: usize,
    error: Vec<f64>,
    scale: Vec<f64>,
    floor: Vec<f64>,
    l: Vec<f64>,
    w: Vec<f64>,
    volts: Vec<f64>,
    roles: Vec<u8>,
    unsigned: Vec<bool>,
    /// what currents and voltages of pairs are measured by at least
    least: Vec<Vec<[f64; 2]>>,
    /// share of rounding, and rate of what is stored
    unit: Vec<[f64; 2]>,
    /// rate of increments whose quotients the rates are
    quotients: Vec<f64>,
    /// how far multipliers and slacks may be off because instants are rounded
    slack: Vec<[f64; 2]>,
}

/// `value` less what may be rounding.
fn beyond(value: f64, slack: f64) -> f64 {
    if value.abs() <= slack {
        0.0
    } else {
        value - slack.copysign(value)
    }
}

/// A law of currents of which too little is known where potentials are far from all that sources (the largest value of
/// each so far, `given`: a sine at its zero is small next to a threshold) and thresholds [V] give (at teravolts
/// junctions and ohms carry anything): rounding of its terms exceeds a part of the currents that counts; or the law
/// is plainly broken, and only rounding of what it does not depend on would excuse that.
fn unknown_law(
    kinds: &[u8],
    point: &Point,
    (errors, scale): (&[f64], &[f64]),
    [conductances, sources_in]: [&Entries; 2],
    (given, threshold, current): (&[f64], f64, f64),
    taken: impl Fn(usize) -> Option<f64>,
) -> Option<usize> {
    let most = |list: &[f64]| list.iter().fold(0.0f64, |most, v| most.max(v.abs()));
    let nodes = || (0..kinds.len()).filter(|&row| kinds[row] == 0);
    let potential = nodes().fold(0.0f64, |most, row| most.max(point.z[row].abs()));
    // a decade beyond where rounding of potentials is all that the tolerance grants to what is given
    let near = |given: f64| f64::EPSILON * potential <= CLEARLY * TOLERANCE * given;
    let sources = most(given).max(threshold);
    // nearly always so: all else need not be looked at
    if near(sources) {
        return None;
    }
    let mut driven = vec![0.0; kinds.len()];
    sources_in.add_sizes(1.0, given, &mut driven);
    let [flowing, volts] = [0, 1].map(|kind| {
        let rows = (0..kinds.len()).filter(|&row| kinds[row] == kind);
        rows.fold(0.0f64, |most, row| most.max(driven[row]))
    });
    let given = volts.max(sources);
    if given == 0.0 || near(given) {
        return None;
    }
    let flowing = flowing.max(current).max(most(point.f));
    let flowing = nodes().filter_map(&taken).fold(flowing, f64::max);
    let mut terms = vec![0.0; kinds.len()];
    conductances.add_sizes(1.0, point.z, &mut terms);
    let unknown = |&row: &usize| {
        let (error, scale) = (errors[row].abs(), scale[row].max(terms[row]));
        let broken = taken(row).is_none() && error > (EXCUSED * scale).max(FLOOR * flowing);
        broken || f64::EPSILON * scale > COUNTS * flowing
    };
    nodes().find(unknown)
}

impl Auditor {
    /// Takes a point; `rates` are those of stored charge and flux, and functions have been
    /// evaluated last.  Leaves in `floor` what each law is measured by.
    pub(super) fn point(
        &mut self,
        point: &Point,
        rates: &[f64],
        unit: &RoundingUnit,
        floor: &mut [f64],
    ) {
        let (n, m) = (self.arrays.n, self.arrays.m);
        self.seen.given.iter_mut().zip(point.u).for_each(|(given, u)| *given = given.max(u.abs()));
        floor.fill(0.0);
        self.arrays.s.add_sizes(1.0, point.u, floor);
        if let Some(smooth) = &mut self.smooth {
            let part = self.share * TOLERANCE;
            smooth.add_sizes(&self.arrays.kinds, &unit.largest, point.u, unit.rate, part, floor);
        }
        let pairs = self.block.l.len();
        let block = &mut self.block;
        block.l.extend_from_slice(point.l);
        block.w.extend_from_slice(&self.arrays.q);
        block.volts.extend(self.arrays.q.iter().map(|q| q.abs()));
        let (w, volts) = (&mut block.w[pairs..], &mut block.volts[pairs..]);
        self.arrays.b.add_both(-1.0, point.z, w, volts);
        self.arrays.d.add_both(1.0, point.l, w, volts);
        // at its kink rounding decides whether a pair conducts
        let part = self.share * TOLERANCE;
        let conducts = |i: usize| point.l[i] != 0.0 || w[i].abs() <= part * volts[i];
        let largest = |j: usize| unit.largest[usize::from(self.arrays.kinds[j])];
        self.reach.through_pairs(conducts, 1.0, largest, floor);
        let Seen { parts, currents, .. } = &mut self.seen;
        self.reach.see_parts(&self.arrays.kinds, parts, [point.z, point.l], currents);
        let least = self.floor(unit, floor);
        let block = &mut self.block;
        let rows = block.count * n;
        block.count += 1;
        block.least.push(least);
        // what is stored is put back right after a jump, and says nothing of voltages there
        let rate = if point.after_jump { 0.0 } else { 2.0 * unit.rate };
        block.unit.push([unit.share.max(unit.settled), rate]);
        block.quotients.push(2.0 * unit.quotients);
        block.error.extend_from_slice(rates);
        block.scale.extend(rates.iter().map(|r| r.abs()));
        block.floor.extend_from_slice(floor);
        let (error, scale) = (&mut block.error[rows..], &mut block.scale[rows..]);
        self.arrays.g.add_both(1.0, point.z, error, scale);
        self.arrays.a.add_both(1.0, point.l, error, scale);
        self.arrays.s.add_both(-1.0, point.u, error, scale);
        if let Some(smooth) = &self.smooth {
            smooth.f.add_both(1.0, point.f, error, scale);
        }
        let taken = |row: usize| {
            (!self.places.algebraic[row]).then(|| rates[row].abs().max(error[row].abs()))
        };
        let sizes = (&error[..], &scale[..]);
        let lost = unknown_law(
            &self.arrays.kinds,
            point,
            sizes,
            [&self.arrays.conductances, &self.arrays.s],
            (&self.seen.given, self.seen.threshold, unit.largest[1]),
            taken,
        );
        let mut tied = (0.0, None);
        if point.after_jump {
            // resistances carry currents that are no unknowns
            let laws = scale.iter().zip(&self.arrays.kinds).filter(|e| *e.1 == 0);
            let flowing = laws.fold(unit.largest[1], |most, (size, _)| most.max(*size));
            for group in &self.places.groups {
                let sum = |list: &[f64]| group.iter().map(|&row| list[row]).sum::<f64>();
                let size = sum(scale).max(FLOOR * flowing);
                let floor = sum(floor).min(EXCUSED / TOLERANCE * size);
                let found = ratio(sum(error).abs(), size.max(floor));
                if worse(found, tied.0) {
                    tied = (found, Some(group[0]));
                }
            }
            let stored = error.iter_mut().zip(&self.places.algebraic).filter(|e| !e.1);
            stored.for_each(|(error, _)| *error = 0.0);
        }
        self.branches.see(point.z, scale);
        self.seen.all = [0, 1].map(|kind| self.seen.all[kind].max(unit.largest[kind]));
        floor.iter_mut().zip(&*scale).for_each(|(floor, scale)| *floor = floor.max(*scale));
        if point.roles.is_empty() {
            block.roles.resize(pairs + m, 0);
        } else {
            block.roles.extend_from_slice(point.roles);
        }
        block.unsigned.push(point.unsigned);
        block.slack.resize(pairs + m, [0.0; 2]);
        if let (found, Some(row)) = tied {
            self.found.note_law(found, row);
        }
        if let Some(row) = lost {
            self.found.note_law(1.0, row);
        }
    }

    /// The last points of the block, an interval, belong to instants that are known up to this part
    /// of its length: multipliers and slacks may be off by that part of their changes.
    pub(super) fn blur(&mut self, points: usize, part: f64) {
        let (m, block) = (self.arrays.m, &mut self.block);
        let first = block.count - points;
        for i in 0..m {
            let mut slack = [0.0; 2];
            for (slack, list) in slack.iter_mut().zip([&block.l, &block.w]) {
                let values = (first..block.count).map(|k| list[k * m + i]);
                let ends = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
                    [low.min(v), high.max(v)]
                });
                *slack = part * (ends[1] - ends[0]);
            }
            for k in first..block.count {
                block.slack[k * m + i] = slack;
            }
        }
    }

    /// Judges the points taken so far once they are many: the memory of a block is bounded, for any
    /// was handed over in one call.
    pub(super) fn judge_full(&mut self) {
        if self.block.error.len() + self.block.l.len() >= FULL {
            self.judge();
        }
    }

    /// Judges the points taken since the last call.
    pub(super) fn judge(&mut self) {
        let block = std::mem::take(&mut self.block);
        self.found.checks += block.count as u64;
        if self.arrays.n > 0 {
            self.judge_rows(&block);
        }
        if self.arrays.m > 0 {
            self.judge_pairs(&block);
        }
    }

    fn judge_rows(&mut self, block: &Block) {
        let (mut worst, mut place) = (self.found.laws, None);
        let points = block.error.chunks_exact(self.arrays.n);
        let scales =
            block.scale.chunks_exact(self.arrays.n).zip(block.floor.chunks_exact(self.arrays.n));
        for (k, (errors, (scales, floors))) in points.zip(scales).enumerate() {
            for (row, (error, (scale, floor))) in
                errors.iter().zip(scales.iter().zip(floors)).enumerate()
            {
                let unit = block.unit[k];
                let most = if self.arrays.kinds[row] == 1 {
                    let unit = [unit[0], block.quotients[k]];
                    self.branches.floor(row, unit, &self.reach, &self.seen.all, scales)
                } else {
                    f64::INFINITY
                };
                let mut found = ratio(error.abs(), scale.max(floor.min(most)));
                if found > TOLERANCE && worse(found, worst) {
                    let unseen = self.unseen(row, [scales, floors], unit);
                    found = ratio(error.abs(), scale.max(floor.max(unseen).min(most)));
                }
                if worse(found, worst) {
                    (worst, place) = (found, Some(row));
                }
            }
        }
        if let Some(row) = place {
            self.found.note_law(worst, row);
        }
    }

    /// What a law makes of that by which its unknowns could move without being seen in their own laws.
    fn unseen(&self, row: usize, [scales, floors]: [&[f64]; 2], unit: [f64; 2]) -> f64 {
        let terms = self.arrays.conductances.entries().filter(|e| e.0 == row && e.1 != row);
        let move_of = |j: usize| self.hidden(j, self.arrays.kinds[j], [scales[j], floors[j]], unit);
        terms.map(|(_, j, v)| v.abs() * move_of(j)).sum()
    }

    /// By how much voltages (kind 0) or currents may move without being seen in a law of this scale and floor.
    fn hidden(
        &self,
        row: usize,
        kind: u8,
        [scale, floor]: [f64; 2],
        [share, rate]: [f64; 2],
    ) -> f64 {
        let slope = self.reach.slope(row, kind, rate);
        // what sources fix does not move
        if slope > 0.0 && self.seen.parts.of(row).is_some() {
            (share * scale).max(floor) / slope
        } else {
            0.0
        }
    }

    fn judge_pairs(&mut self, block: &Block) {
        let (n, m) = (self.arrays.n, self.arrays.m);
        let amperes = |k: usize, i: usize| {
            let scale = &block.scale[k * n..(k + 1) * n];
            let rows = &self.places.touched[i];
            let mean = rows.iter().map(|&r| scale[r]).sum::<f64>() / rows.len().max(1) as f64;
            block.l[k * m + i].abs().max(mean)
        };
        // a voltage that changes no law of its nodes by more than that is measured by
        let unseen = |k: usize, i: usize| {
            let sizes = |r: usize| [block.scale[k * n + r], block.floor[k * n + r]];
            let rows = self.places.touched[i].iter();
            rows.map(|&r| self.hidden(r, 0, sizes(r), block.unit[k])).fold(0.0, f64::max)
        };
        let (mut worst, mut place) = (self.found.complementarity, self.found.worst_pair);
        for k in (0..block.count).filter(|&k| !block.unsigned[k]) {
            // a pair's voltage is a difference of several, its current the rest of others
            let of_parts = &block.least[k];
            for i in 0..m {
                let at = k * m + i;
                let least = of_parts[self.seen.parts.of_pair(i)];
                let (l, w) = (block.l[at], block.w[at]);
                let [slack_l, slack_w] = block.slack[at];
                let current = ratio(beyond(l, slack_l), amperes(k, i).max(least[0]));
                let beyond_w = beyond(w, slack_w);
                let mut voltage = ratio(beyond_w, block.volts[at].max(least[1]));
                if voltage.abs() > TOLERANCE {
                    voltage = ratio(beyond_w, block.volts[at].max(least[1]).max(unseen(k, i)));
                }
                let found = match block.roles[at] {
                    1 => voltage.abs(),
                    2 => current.abs(),
                    _ if current.is_nan() || voltage.is_nan() => f64::NAN,
                    _ => current.min(voltage).abs(),
                };
                if worse(found, worst) {
                    (worst, place) = (found, Some(i));
                }
            }
        }
        self.found.complementarity = worst;
        self.found.worst_pair = place;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::Csc;

    /// A node connected to others by 2000 S in all, and a source of 325 V; currents of up to 1 A, of which a capacitor
    /// of the node may have `taken` some.
    fn law_with(potential: f64, error: f64, taken: Option<f64>) -> Option<usize> {
        let (kinds, z) = ([0, 1], [potential, 0.3]);
        let point = Point {
            z: &z,
            l: &[],
            u: &[325.0],
            f: &[],
            roles: &[],
            after_jump: true,
            unsigned: false,
        };
        let one = |row, value| Entries::new(&Csc::from_triplets(2, 2, &[(row, 0, value)]));
        let (conductances, sources) = (one(0, 2e3), one(1, 1.0));
        let sizes = (&[error, 0.0][..], &[1.0, 0.0][..]);
        let given = (&[325.0][..], 0.0, 1.0);
        let matrices = [&conductances, &sources];
        unknown_law(&kinds, &point, sizes, matrices, given, |_| taken)
    }

    fn law_at(potential: f64, error: f64) -> Option<usize> {
        law_with(potential, error, None)
    }

    #[test]
    fn a_capacitor_that_floats_holds_no_potential() {
        // at 1e16 V the rounding of what 2000 S carry is 4 kA
        assert_eq!(law_with(1e16, 0.0, Some(0.5)), Some(0));
        assert_eq!(law_with(1e3, 0.0, Some(0.5)), None);
    }

    #[test]
    fn currents_are_unknown_where_potentials_round_them_away() {
        // 1e13 V are rounded by 2 mV, which drive 4 A
        let found = [1e3, 1e10, 1e13, 1e16, 1e19].map(|potential| law_at(potential, 0.0));
        assert_eq!(found, [None, None, Some(0), Some(0), Some(0)]);
    }

    #[test]
    fn a_law_that_is_broken_at_a_distant_potential_is_not_excused() {
        // up to a millionth of what sources give nothing is distant, and others judge
        assert_eq!([1e3, 1e9].map(|potential| law_at(potential, 0.5)), [None; 2]);
        let terms = |potential: f64| 2e3 * potential;
        assert_eq!(law_at(1e10, 0.5 * terms(1e10)), Some(0));
    }

    #[test]
    fn a_source_at_its_zero_is_no_measure_of_thresholds() {
        let (kinds, z, u) = ([0, 1], [-0.6, 0.0], [2.8e-14]);
        let (l, f, roles) = (&[][..], &[][..], &[][..]);
        let point = Point { z: &z, l, u: &u, f, roles, after_jump: false, unsigned: false };
        let one = |row, value| Entries::new(&Csc::from_triplets(2, 2, &[(row, 0, value)]));
        let (conductances, sources) = (one(0, 3e-5), one(1, 1.0));
        let judge = |given: f64, threshold: f64| {
            let (matrices, known) = ([&conductances, &sources], (&[given][..], threshold, 0.0));
            let sizes = (&[0.0; 2][..], &[1.8e-5, 0.6][..]);
            unknown_law(&kinds, &point, sizes, matrices, known, |_| None)
        };
        // relative to the present value alone even 0.6 V would be far away
        assert_eq!(judge(2.8e-14, 0.0), Some(0));
        assert_eq!([judge(10.0, 0.0), judge(2.8e-14, 0.6)], [None; 2]);
    }
}

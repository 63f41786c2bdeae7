//! Steps of the implicit scheme `E dz / h + H dz + Hs du + G z + A lambda = S u`, at their ends.

use super::judge::Point;
use super::laws::Auditor;
use super::rounding::RoundingUnit;
use super::{ITERATED, TOLERANCE};

/// Recorded steps, one array per quantity.
pub struct Steps<'a> {
    /// end of each [s]
    pub time: &'a [f64],
    /// length [s]; infinite for static solutions, negative for states right after a jump
    pub length: &'a [f64],
    /// unknowns at the end
    pub z: &'a [f64],
    /// their change
    pub change: &'a [f64],
    /// multipliers at the end
    pub l: &'a [f64],
    /// sources at the end
    pub u: &'a [f64],
    /// their change
    pub source_change: &'a [f64],
    /// roles of the pairs; empty without switches
    pub roles: &'a [u8],
    /// the time that smooth functions see, if that of the records counts something else
    pub frozen: Option<f64>,
}

impl Auditor {
    /// Checks recorded steps.
    pub fn take_steps(&mut self, steps: &Steps) {
        let (n, m, p) = (self.arrays.n, self.arrays.m, self.arrays.p);
        if let Some(sources) = &mut self.sources {
            let rows = steps.time.iter().enumerate().map(|(i, &t)| (t, i));
            sources.take(&rows.collect::<Vec<_>>(), steps.u);
        }
        let (mut rates, mut floor) = (vec![0.0; n], vec![0.0; n]);
        let (mut old_z, mut old_u) = (vec![0.0; n], vec![0.0; p]);
        let (mut f, mut f_old, mut f_change) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..steps.time.len() {
            let (z, l) = (&steps.z[k * n..][..n], &steps.l[k * m..][..m]);
            self.reach.see(&self.arrays.kinds, z, l, &mut self.seen.largest);
        }
        // Newton's method comes from other points, and brings their rounding along; what is less
        // than rounding of what was there once has no digits that are right
        let part = if self.smooth.is_some() { 1.0 } else { f64::EPSILON };
        for k in 0..steps.time.len() {
            let of = |list: &'_ [f64], size: usize| -> std::ops::Range<usize> {
                debug_assert!(list.len() >= (k + 1) * size);
                k * size..(k + 1) * size
            };
            let (z, change) = (&steps.z[of(steps.z, n)], &steps.change[of(steps.z, n)]);
            let (u, du) = (&steps.u[of(steps.u, p)], &steps.source_change[of(steps.u, p)]);
            let l = &steps.l[of(steps.l, m)];
            let roles = if steps.roles.is_empty() { &[][..] } else { &steps.roles[k * m..][..m] };
            let h = steps.length[k];
            let size = h.abs();
            let moving = h.is_finite() && h > 0.0;
            for (old, (z, change)) in old_z.iter_mut().zip(z.iter().zip(change)) {
                *old = z - change;
            }
            rates.fill(0.0);
            self.arrays.e.add(1.0 / size, change, &mut rates);
            let mut largest = self.seen.largest.map(|v| part * v);
            self.reach.see(&self.arrays.kinds, z, l, &mut largest);
            self.reach.see(&self.arrays.kinds, &old_z, &[], &mut largest);
            if let Some(smooth) = &mut self.smooth {
                let clock = |t: f64| steps.frozen.unwrap_or(t);
                if !smooth.q.is_empty() {
                    for (old, (u, du)) in old_u.iter_mut().zip(u.iter().zip(du)) {
                        *old = u - du;
                    }
                    let earlier = steps.time[k] - if h.is_finite() { size } else { 0.0 };
                    smooth.values(&old_z, &old_u, clock(earlier), &mut f_old);
                }
                smooth.values(z, u, clock(steps.time[k]), &mut f);
                if !smooth.q.is_empty() {
                    f_change.clear();
                    f_change.extend(f.iter().zip(&f_old).map(|(a, b)| a - b));
                    smooth.q.add(1.0 / size, &f_change, &mut rates);
                }
            }
            if let Some((by_unknowns, by_sources)) = &self.arrays.averaging {
                by_unknowns.add(1.0, change, &mut rates);
                by_sources.add(1.0, du, &mut rates);
            }
            if h.is_infinite() || h < 0.0 {
                rates.fill(0.0);
            }
            let after_jump = h < 0.0;
            let iterated = self.smooth.is_some() && h.is_finite();
            let share = if iterated { self.share.max(ITERATED / TOLERANCE) } else { self.share };
            // a state right after a jump is as a rule the limit of short steps, known to the tolerance: they lie on
            // a line but for 1e-6, and what is curved that little errs by less than its hundredth
            let settled = if after_jump { 1.0 } else { 0.0 };
            let rate = 1.0 / size;
            let (quotients, swing) = (rate, 0.0);
            let unit = RoundingUnit { largest, rate, quotients, share, settled, swing };
            let point = Point { z, l, u, f: &f, roles, after_jump, unsigned: false };
            self.point(&point, &rates, &unit, &mut floor);
            if after_jump {
                self.cut_set_rates(&point);
            }
            self.judge_full();
            self.found.steps += u64::from(moving);
        }
        self.judge();
    }

    /// The rates of inductors that a law of currents cut_sets to each other, right after a jump.
    fn cut_set_rates(&mut self, at: &Point) {
        let Some(cut_sets) = &self.cut_sets else { return };
        let matrices = [&self.arrays.conductances, &self.arrays.a, &self.arrays.s];
        let (part, largest) = (self.share * TOLERANCE, self.seen.largest);
        let rounding = |row: usize| part * self.reach.acting(row, &largest);
        if let Some((found, row)) = cut_sets.worst(matrices, at, rounding) {
            self.found.note_law(found, row);
        }
    }
}

//! Steps of the implicit scheme, whose balance of energy is known exactly:
//!
//! ```text
//! dW = z1' E dz - dz' E dz / 2,
//! z1' (E dz + h H dz + h Hs du) + h z1' G z1 + h z1' A lambda = h z1' S u
//! ```
//!
//! so that stored + dissipated + `dz' E dz / 2` (+ what averaging adds) = delivered.

use super::energy::Entry;
use super::laws::Auditor;
use super::points::Point;
use super::rounding::Grain;
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
        let (n, m, p) = (self.n, self.m, self.p);
        if let Some(sources) = &mut self.sources {
            let rows = steps.time.iter().enumerate().map(|(i, &t)| (t, i));
            sources.take(&rows.collect::<Vec<_>>(), steps.u);
        }
        let (mut rates, mut floor) = (vec![0.0; n], vec![0.0; n]);
        let (mut old_z, mut old_u) = (vec![0.0; n], vec![0.0; p]);
        let (mut f, mut f_old, mut f_change) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..steps.time.len() {
            let (z, l) = (&steps.z[k * n..][..n], &steps.l[k * m..][..m]);
            self.reach.see(&self.kinds, z, l, &mut self.largest);
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
            self.e.add(1.0 / size, change, &mut rates);
            let mut largest = self.largest.map(|v| part * v);
            self.reach.see(&self.kinds, z, l, &mut largest);
            self.reach.see(&self.kinds, &old_z, &[], &mut largest);
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
            if let Some((by_unknowns, by_sources)) = &self.averaging {
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
            // a line but for 1e-6, and what bends that little errs by less than its hundredth
            let settled = if after_jump { 1.0 } else { 0.0 };
            let rate = 1.0 / size;
            let grain = Grain { largest, rate, quotients: rate, share, settled };
            let point = Point { z, l, u, f: &f, roles, after_jump, unsigned: false };
            self.point(&point, &rates, &grain, &mut floor);
            if after_jump {
                self.tie_rates(&point);
            }
            self.judge_full();
            if moving {
                self.enter_step(&point, change, du, h, &rates, &floor, steps.time[k]);
            }
        }
        self.judge();
        if let Some(ledger) = &mut self.ledger {
            ledger.judge();
        }
    }

    /// The rates of coils that a law of currents ties to each other, right after a jump.
    fn tie_rates(&mut self, at: &Point) {
        let ties = self.ties.as_ref();
        if let Some((found, row)) =
            ties.and_then(|t| t.worst([&self.conductances, &self.a, &self.s], at))
        {
            self.note_law(found, row);
        }
    }

    #[allow(clippy::too_many_arguments)] // a step and what has been computed of it
    fn enter_step(
        &mut self,
        at: &Point,
        change: &[f64],
        du: &[f64],
        h: f64,
        rates: &[f64],
        measure: &[f64],
        time: f64,
    ) {
        let Some(ledger) = &mut self.ledger else { return };
        let z = at.z;
        let (moved, moved_size) = self.storage.between(z, change);
        let (half, half_size) = self.storage.between(change, change);
        let (half, half_size) = (0.5 * half, 0.5 * half_size);
        let controlled = self.controls.form(z, change);
        let resisted = self.resisted.between(z, z).0 + self.a.form(z, at.l);
        // the balance is what the laws are off by, times their unknowns: as much as they are measured by; a mass that
        // comes to rest leaves nothing but what the change and the scheme have in common
        let off: f64 = z.iter().zip(measure).map(|(z, r)| h * (z * r).abs()).sum();
        let mut entry = Entry {
            change: moved - half,
            scheme: half,
            dissipated: h * resisted + controlled,
            delivered: h * self.s.form(z, at.u),
            size: moved_size + half_size + off,
            after: 0.5 * self.storage.at(|k| z[k]),
            ..Entry::default()
        };
        let old: Vec<f64> = z.iter().zip(change).map(|(z, d)| z - d).collect();
        entry.before = 0.5 * self.storage.at(|k| old[k]);
        if let Some((by_unknowns, by_sources)) = &self.averaging {
            entry.scheme += h * (by_unknowns.form(z, change) + by_sources.form(z, du));
        }
        if let Some(smooth) = &self.smooth {
            // what smooth elements store cannot be told from what they dissipate
            let by_f = smooth.f.form(z, at.f);
            let all: f64 = z.iter().zip(rates).map(|(z, r)| z * r).sum();
            entry.dissipated += h * (by_f + all) - moved - controlled;
            if let Some((by_unknowns, by_sources)) = &self.averaging {
                entry.dissipated -= h * (by_unknowns.form(z, change) + by_sources.form(z, du));
            }
        }
        ledger.take(entry, time - h, time, 1);
    }
}

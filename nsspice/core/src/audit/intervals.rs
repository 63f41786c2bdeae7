//! Intervals of a continuous solution: its points at the nodes of a quadrature, or the stages of a
//! Runge-Kutta step.

use super::form::Form;
use super::judge::Point;
use super::laws::Auditor;
use super::recorded::Taken;
use super::rounding::{share, RoundingUnit};
use super::{ratio, worse, TOLERANCE};
use crate::waveform::INSTANT;

/// States at which one motion ends and the next begins: nothing changes between them but in jumps
/// that are reported.
#[derive(Clone, Copy, Debug, Default)]
pub struct Boundaries {
    /// largest energy of a change [J]
    changed: f64,
    /// largest stored energy [J]
    stored: f64,
}

/// Energy that is stored in a state [J].
fn stored(storage: &Form, z: &[f64]) -> f64 {
    0.5 * storage.at(|k| z[k]).abs()
}

impl Boundaries {
    /// The largest change as the root of its energy, relative to that of the largest energy.
    pub fn error(&self) -> f64 {
        ratio(self.changed.sqrt(), self.stored.sqrt())
    }
}

impl Auditor {
    /// Checks recorded intervals.
    pub fn take_intervals(&mut self, all: &Taken) {
        let (n, m, p, s) = (self.arrays.n, self.arrays.m, self.arrays.p, all.nodes);
        let count = all.begin.len();
        let functions = self.smooth.as_ref().map_or(0, |f| f.tape.program().len());
        if let Some(sources) = &mut self.sources {
            // stages after the end of a step see a law of a source that has ended
            let rows = all.time.iter().enumerate().filter(|(i, t)| **t <= all.end[i / s]);
            sources.take(&rows.map(|(i, &t)| (t, i)).collect::<Vec<_>>(), &all.u);
        }
        if let Some(gates) = &mut self.gates {
            gates.take(all, &self.arrays.kinds, m);
        }
        let (mut charge_rate, mut floor) = (vec![0.0; n], vec![0.0; n]);
        let (mut f, mut f_first) = (Vec::new(), Vec::new());
        // what has decayed keeps the rounding of what it was: a closed form is a sum of terms that
        // cancel
        for i in 0..count * s {
            let (z, l) = (&all.z[i * n..][..n], &all.l[i * m..][..m]);
            self.reach.see(&self.arrays.kinds, z, l, &mut self.seen.largest);
        }
        let known = all.known / TOLERANCE;
        if n > 0 {
            let sides = all.boundary_end.chunks_exact(n).zip(all.boundary_begin.chunks_exact(n));
            sides.for_each(|(end, begin)| self.take_boundary(end, begin));
        }
        for k in 0..count {
            let h = all.end[k] - all.begin[k];
            let unit = RoundingUnit {
                largest: self.seen.largest,
                rate: 1.0 / all.shortest[k],
                quotients: if all.inner.is_empty() { 0.0 } else { 1.0 / all.shortest[k] },
                // a closed form has the rounding of three computations of the size of an elimination: the
                // reduction to states, their decomposition, and the way back to the unknowns
                share: if all.inner.is_empty() {
                    share(3 * (n + m))
                } else {
                    self.share.max(known)
                },
                settled: 0.0,
                swing: all.swing[k],
            };
            let roles = if all.roles.is_empty() { &[][..] } else { &all.roles[k * m..][..m] };
            let first = &all.first[k * n..][..n];
            let weight = &all.weight[k * s..][..s];
            // charge and flux: what is there in the end, minus what was there, minus what came
            let [mut error, mut sizes, mut contents] = [(); 3].map(|()| vec![0.0; n]);
            self.arrays.e.add_both(-1.0, first, &mut error, &mut sizes);
            let at = |i: usize, size: usize| (k * s + i) * size..(k * s + i + 1) * size;
            for (i, &weight) in weight.iter().enumerate() {
                let (z, l, u) = (&all.z[at(i, n)], &all.l[at(i, m)], &all.u[at(i, p)]);
                let rate = &all.rate[at(i, n)];
                // states may vanish wherever a motion ends
                self.boundaries.stored =
                    self.boundaries.stored.max(stored(&self.arrays.storage, z));
                charge_rate.fill(0.0);
                self.arrays.e.add(1.0, rate, &mut charge_rate);
                if let Some(smooth) = &mut self.smooth {
                    smooth.values(z, u, all.time[k * s + i], &mut f);
                    if !smooth.q.is_empty() {
                        let df = &all.function_rate[at(i, functions)];
                        smooth.q.add(1.0, df, &mut charge_rate);
                    }
                }
                for ((e, size), r) in error.iter_mut().zip(&mut sizes).zip(&charge_rate) {
                    *e -= weight * r;
                    *size += (weight * r).abs();
                }
                let unsigned = all.signed[k] == 0 && i + 1 < s;
                let point = Point { z, l, u, f: &f, roles, after_jump: false, unsigned };
                self.point(&point, &charge_rate, &unit, &mut floor);
                if i + 1 == s {
                    self.arrays.e.add_both(1.0, z, &mut error, &mut sizes);
                    if let Some(smooth) = self.smooth.as_mut().filter(|f| !f.q.is_empty()) {
                        smooth.q.add_both(1.0, &f, &mut error, &mut sizes);
                        let u = &all.first_u[k * p..][..p];
                        smooth.values(first, u, all.begin[k], &mut f_first);
                        smooth.q.add_both(-1.0, &f_first, &mut error, &mut sizes);
                        // what rounding of the largest voltage makes of a junction's charge, however little it is
                        smooth.q.add_sizes(1.0, &smooth.reach, &mut contents);
                    }
                }
            }
            let rounding = INSTANT * all.begin[k].abs().max(all.end[k].abs());
            self.blur(s, (rounding / h).min(1.0));
            self.judge_full();
            self.motion(&error, &sizes, &contents, unit.share, [h, all.swing[k]]);
            self.found.steps += u64::from(all.steps[k]);
        }
        self.judge();
    }

    /// The balance of charge and flux over an interval of length `h`; a content is known to this share
    /// of what the largest voltage and current would make of it and of what functions store (their `contents`), and
    /// of what they would bring.  A
    /// closed form is a sum of terms, which may be larger than all that is left of them: what they
    /// would store without cancelling, the `swing`, could all be in this element.
    fn motion(
        &mut self,
        error: &[f64],
        sizes: &[f64],
        contents: &[f64],
        share: f64,
        [h, swing]: [f64; 2],
    ) {
        let (mut worst, mut place) = (self.found.laws, None);
        for (row, (e, size)) in error.iter().zip(sizes).enumerate() {
            let brought = h * self.reach.acting(row, &self.seen.largest);
            let linear = self.reach.content(row, &self.seen.largest) + f64::MIN_POSITIVE;
            let content = linear + contents[row];
            let floor = share * (content + brought);
            let summed = share * self.reach.holding(row, self.arrays.kinds[row], swing);
            let found = ratio(e.abs(), size.max(floor).max(summed));
            if worse(found, worst) {
                (worst, place) = (found, Some(row));
            }
        }
        if let Some(row) = place {
            self.found.note_law(worst, row);
        }
    }

    /// Takes a state at which a motion ends, and the one at which the next begins.
    fn take_boundary(&mut self, end: &[f64], begin: &[f64]) {
        let change: Vec<f64> = end.iter().zip(begin).map(|(a, b)| b - a).collect();
        let changed = stored(&self.arrays.storage, &change);
        let boundaries = &mut self.boundaries;
        if worse(changed, boundaries.changed) {
            boundaries.changed = changed;
        }
        boundaries.stored = boundaries
            .stored
            .max(stored(&self.arrays.storage, end))
            .max(stored(&self.arrays.storage, begin));
    }
}

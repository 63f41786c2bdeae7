//! What a run leaves for those who check it: sampled steps with all their stages.

use super::super::stepper::Stepper;
use super::ladder::Ladder;
use super::step::{sources, Trial};
use super::tableau::{Tableau, MOST};
use crate::audit::Taken;

/// Price of a step in steps, so that records cost a twentieth of a run, and how many can be had at
/// once.
const PRICE: u64 = 16;
const STOCK: u64 = 64 * PRICE;
/// A step that ends this close to its beginning, relative to the time, has no length.
const SAME: f64 = 64.0 * f64::EPSILON;
/// Records are handed over when they hold this many numbers.
const FULL: usize = 1 << 18;

/// Chooses the steps to record and keeps them.
#[derive(Default)]
pub struct Witness {
    spent: u64,
    seen: u64,
    /// steps without length since the last record
    empty: u8,
    pub taken: Taken,
}

impl Witness {
    /// True when the records should be taken.
    pub fn full(&self) -> bool {
        self.taken.size() >= FULL
    }

    /// The steps recorded since the last call.
    pub fn take(&mut self, tableau: &Tableau, known: f64) -> Taken {
        let nodes = tableau.stages() + 1;
        (self.taken.nodes, self.taken.known) = (nodes, known);
        std::mem::replace(&mut self.taken, Taken { nodes, known, ..Taken::default() })
    }

    /// Takes notice of an accepted step up to `theta` of its length, before the state of `s` moves
    /// to the point of `trial`.
    pub fn step(
        &mut self,
        s: &Stepper,
        trial: &Trial,
        ladder: &Ladder,
        tableau: &Tableau,
        theta: f64,
        end: f64,
    ) {
        if end - trial.start <= SAME * end.max(trial.length) {
            self.empty = self.empty.saturating_add(1);
            return;
        }
        self.seen += 1;
        if !s.witness.watches() || self.spent + PRICE > STOCK + self.seen {
            return;
        }
        self.spent += PRICE;
        let (n, m, p) = (s.z.len(), s.l.len(), s.u0.len());
        let (stages, h) = (tableau.stages(), trial.length);
        // the step that ends in the point: its last row, in units of time
        let stage = tableau.gamma * h;
        let mut weights = [0.0; MOST + 1];
        if theta == 1.0 {
            for (w, a) in weights.iter_mut().zip(tableau.a[stages - 1]) {
                *w = h * a;
            }
            weights[stages - 1] = stage;
        } else {
            let (value, slope) = tableau.weights(theta);
            for (w, (v, d)) in weights.iter_mut().zip(value.iter().zip(&slope)).take(stages) {
                *w = h * v - stage * d;
            }
            weights[stages] = stage;
        }
        let weights = &weights[..=stages];
        let taken = &mut self.taken;
        taken.begin.push(trial.start);
        taken.end.push(end);
        taken.grain.push(stage);
        taken.steps.push(1u8.saturating_add(std::mem::take(&mut self.empty)));
        taken.signed.push(0); // inner stages are of low order
        taken.first.extend_from_slice(&trial.first[..n]);
        taken.first_u.extend_from_slice(&s.u0);
        taken.weight.extend_from_slice(weights);
        if !s.switches.is_empty() {
            taken.roles.extend(s.roles.iter().map(|&r| r as u8));
        }
        let mut u = vec![0.0; p];
        for i in 0..=stages {
            let inside = i < stages;
            // a first stage that counts for nothing has no rates: the next one stands for it
            let i = if i < tableau.first() && !tableau.continues() { tableau.first() } else { i };
            let part = if inside { tableau.c[i] } else { theta };
            let t = trial.start + part * h;
            sources(&s.waveforms, t, trial.start, trial.corner, &mut u);
            let x = if inside { &trial.stages[i] } else { &trial.point };
            let rates = if inside { &trial.rates[i] } else { &trial.slope };
            taken.time.push(t);
            taken.z.extend_from_slice(&x[..n]);
            let guards = x[n..n + m].iter().zip(s.active.iter().zip(&s.roles));
            let open = trial.open[i];
            taken.l.extend(guards.map(|(&g, (&on, &role))| ladder.multiplier(g, on, role, open)));
            taken.u.extend_from_slice(&u);
            taken.rate.extend_from_slice(&rates[..n]);
            taken.function_rate.extend_from_slice(&rates[n..]);
            if !inside {
                taken.inner.extend_from_slice(weights);
                continue;
            }
            for j in 0..=stages {
                taken.inner.push(match tableau.a[i].get(j) {
                    Some(a) => h * a,
                    None if i == j && i >= tableau.first() => stage,
                    None => 0.0,
                });
            }
        }
    }
}

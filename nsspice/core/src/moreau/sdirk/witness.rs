//! What a run leaves for those who check it: sampled steps with all their stages.

use super::super::stepper::Stepper;
use super::ladder::Ladder;
use super::step::Trial;
use super::tableau::{Tableau, MOST};
use crate::audit::{Points, Taken};

/// Price of a step in steps, so that records cost a twentieth of a run, and how many can be had at
/// once.
const PRICE: u64 = 16;
const STOCK: u64 = 64 * PRICE;
/// A step that ends this close to its beginning, relative to the time, has no length.
const SAME: f64 = 64.0 * f64::EPSILON;
/// Records are handed over when they hold this many numbers.
const FULL: usize = 1 << 18;

/// Most points of a step: its stages and its end.
const POINTS: usize = MOST + 1;

/// How the rates at the points of a step make up its change and its points [s].
pub struct Weights {
    /// points with any weight
    pub count: usize,
    /// in the change over the step
    pub own: [f64; POINTS],
    /// in each point
    pub inner: [[f64; POINTS]; POINTS],
}

/// The stage whose point and rates stand for one: a first stage that counts for nothing has no rates.
fn standing(tableau: &Tableau, i: usize) -> usize {
    if i < tableau.first() && !tableau.continues() {
        tableau.first()
    } else {
        i
    }
}

impl Weights {
    /// Of a step of the length `h` that ends at the part `theta` of it.
    pub fn new(tableau: &Tableau, theta: f64, h: f64) -> Weights {
        let stages = tableau.stages();
        // the step that ends in the point: its last row, in units of time
        let stage = tableau.gamma * h;
        let (mut own, mut inner) = ([0.0; POINTS], [[0.0; POINTS]; POINTS]);
        for (i, row) in inner.iter_mut().enumerate().take(stages) {
            let i = standing(tableau, i);
            for (w, a) in row.iter_mut().zip(tableau.a[i]) {
                *w = h * a;
            }
            if i >= tableau.first() {
                row[i] = stage;
            }
        }
        if theta == 1.0 {
            own = inner[stages - 1];
        } else {
            let (value, slope) = tableau.weights(theta);
            for (w, (v, d)) in own.iter_mut().zip(value.iter().zip(&slope)).take(stages) {
                *w = h * v - stage * d;
            }
            own[stages] = stage;
        }
        inner[stages] = own;
        Weights { count: stages + usize::from(theta != 1.0), own, inner }
    }
}

/// Whether a step, tried with a length, ends where it begins.
pub fn no_length(start: f64, end: f64, tried: f64) -> bool {
    end - start <= SAME * end.max(tried)
}

/// Adds an accepted step to the balance of energy of `s`, as [`Witness::step`] would record it.
pub fn sum_up(s: &mut Stepper, trial: &Trial, ladder: &Ladder, tableau: &Tableau, theta: f64) {
    let Some(sums) = &mut s.sums else { return };
    let (n, m, p) = (s.z.len(), s.l.len(), s.u0.len());
    let Weights { count, own, inner } = Weights::new(tableau, theta, trial.length);
    let mut taken = [0.0; POINTS * POINTS];
    for i in 0..count {
        for j in 0..count {
            taken[i * count + j] = own[i] * inner[i][j] + own[j] * inner[j][i] - own[i] * own[j];
        }
    }
    let [mut z, mut rate, mut f, mut f_rate] = [[&[][..]; POINTS]; 4];
    let (mut l, mut u) = (Vec::with_capacity(count * m), Vec::with_capacity(count * p));
    for i in 0..count {
        let inside = i < tableau.stages();
        let (place, i) = (i, standing(tableau, i));
        u.extend_from_slice(if inside { &trial.inputs[i] } else { &trial.u });
        let x = if inside { &trial.stages[i] } else { &trial.point };
        let rates = if inside { &trial.rates[i] } else { &trial.slope };
        (z[place], f[place]) = (&x[..n], &x[n + m..]);
        (rate[place], f_rate[place]) = rates.split_at(n);
        let guards = x[n..n + m].iter().zip(s.active.iter().zip(&s.roles));
        let open = trial.open[i];
        l.extend(guards.map(|(&g, (&on, &role))| ladder.multiplier(g, on, role, open)));
    }
    sums.points(
        &trial.first[..n],
        &Points {
            weight: &own[..count],
            taken: &taken[..count * count],
            z: &z[..count],
            rate: &rate[..count],
            l: &l,
            u: &u,
            f: &f[..count],
            f_rate: &f_rate[..count],
        },
    );
}

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
        if no_length(trial.start, end, trial.length) {
            self.empty = self.empty.saturating_add(1);
            return;
        }
        self.seen += 1;
        if !s.witness.watches() || self.spent + PRICE > STOCK + self.seen {
            return;
        }
        self.spent += PRICE;
        let (n, m) = (s.z.len(), s.l.len());
        let (stages, h) = (tableau.stages(), trial.length);
        let Weights { own, inner, .. } = Weights::new(tableau, theta, h);
        let taken = &mut self.taken;
        taken.begin.push(trial.start);
        taken.end.push(end);
        taken.grain.push(tableau.gamma * h);
        taken.swing.push(0.0);
        taken.steps.push(1u8.saturating_add(std::mem::take(&mut self.empty)));
        taken.signed.push(0); // inner stages are of low order
        taken.first.extend_from_slice(&trial.first[..n]);
        taken.first_u.extend_from_slice(&s.u0);
        taken.weight.extend_from_slice(&own[..=stages]);
        if !s.switches.is_empty() {
            taken.roles.extend(s.roles.iter().map(|&r| r as u8));
        }
        for i in 0..=stages {
            let inside = i < stages;
            let i = standing(tableau, i);
            let part = if inside { tableau.c[i] } else { theta };
            let t = trial.start + part * h;
            let x = if inside { &trial.stages[i] } else { &trial.point };
            let rates = if inside { &trial.rates[i] } else { &trial.slope };
            taken.time.push(t);
            taken.z.extend_from_slice(&x[..n]);
            let guards = x[n..n + m].iter().zip(s.active.iter().zip(&s.roles));
            let open = trial.open[i];
            taken.l.extend(guards.map(|(&g, (&on, &role))| ladder.multiplier(g, on, role, open)));
            taken.u.extend_from_slice(if inside { &trial.inputs[i] } else { &trial.u });
            taken.rate.extend_from_slice(&rates[..n]);
            taken.function_rate.extend_from_slice(&rates[n..]);
            taken.inner.extend_from_slice(&inner[i][..=stages]);
        }
    }
}

//! What a run leaves for those who check it: sampled steps with all their stages.

use super::controller::stage_equations::StageEquations;
use super::step::Trial;
use super::tableau::{Tableau, MOST};
use crate::audit::{Asked, ErringStep, Node, Points, Taken, NODES};
use crate::integrate::implicit::stepper::Stepper;
use crate::waveform::INSTANT;

/// Price of a step in steps, so that records cost a twentieth of a run, and how many can be had at
/// once.
const PRICE: u64 = 16;
const STOCK: u64 = 64 * PRICE;
/// Records are handed over when they hold this many numbers.
const FULL: usize = 1 << 18;

/// Most points of a step: its stages and its end.
const POINTS: usize = MOST + 1;

/// How the rates at the points of a step make up its change and its points, as parts of its length.
#[derive(Clone, Copy)]
pub struct Weights {
    /// points with any weight
    pub count: usize,
    /// in the change over the step
    pub own: [f64; POINTS],
    /// in each point
    pub inner: [[f64; POINTS]; POINTS],
    /// in what the scheme takes: see [`Points`]
    pub taken: [f64; POINTS * POINTS],
}

/// The stage whose point and rates represent one: a first stage that counts for nothing has no rates.
fn standing(tableau: &Tableau, i: usize) -> usize {
    if i < tableau.first() && !tableau.continues() {
        tableau.first()
    } else {
        i
    }
}

/// The multipliers at a point, from the guards that are its unknowns.
fn multipliers<'a>(
    s: &'a Stepper,
    stage_equations: &'a StageEquations,
    x: &'a [f64],
    open: bool,
) -> impl Iterator<Item = f64> + 'a {
    let (n, m) = (s.state.z.len(), s.state.l.len());
    let guards = x[n..n + m].iter().zip(s.state.active.iter().zip(&s.state.roles));
    guards.enumerate().map(move |(i, (&g, (&on, &role)))| {
        stage_equations.resistances.multiplier(i, g, on, role, open)
    })
}

impl Weights {
    /// Of a step that ends at the part `theta` of its length.
    pub fn new(tableau: &Tableau, theta: f64) -> Weights {
        let stages = tableau.stages();
        // the step that ends in the point: its last row
        let stage = tableau.gamma;
        let (mut own, mut inner) = ([0.0; POINTS], [[0.0; POINTS]; POINTS]);
        for (i, row) in inner.iter_mut().enumerate().take(stages) {
            let i = standing(tableau, i);
            row[..tableau.a[i].len()].copy_from_slice(tableau.a[i]);
            if i >= tableau.first() {
                row[i] = stage;
            }
        }
        if theta == 1.0 {
            own = inner[stages - 1];
        } else {
            let (value, slope) = tableau.weights(theta);
            for (w, (v, d)) in own.iter_mut().zip(value.iter().zip(&slope)).take(stages) {
                *w = v - stage * d;
            }
            own[stages] = stage;
        }
        inner[stages] = own;
        let count = stages + usize::from(theta != 1.0);
        let mut taken = [0.0; POINTS * POINTS];
        for i in 0..count {
            for j in 0..count {
                taken[i * count + j] =
                    own[i] * inner[i][j] + own[j] * inner[j][i] - own[i] * own[j];
            }
        }
        Weights { count, own, inner, taken }
    }
}

/// Whether a step, tried with a length, ends where it begins.
pub fn no_length(start: f64, end: f64, tried: f64) -> bool {
    end - start <= INSTANT * end.max(tried)
}

/// Chooses the steps to record and keeps them.
#[derive(Default)]
pub struct Samples {
    spent: u64,
    seen: u64,
    /// steps without length since the last record
    empty: u8,
    pub taken: Taken,
    /// those of the last step, of such a method and with such an end
    weights: Option<(&'static Tableau, f64, Weights)>,
    /// scratch: multipliers at the points
    multipliers: Vec<f64>,
    /// points of the present step at which its error is found, unknowns, multipliers and sources of each
    nodes: Vec<[Vec<f64>; 3]>,
}

impl Samples {
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

    /// How the points of a step make it up that is accepted up to `theta` of its length; most are whole.
    fn weights(&mut self, tableau: &'static Tableau, theta: f64) -> Weights {
        match &self.weights {
            Some((of, end, known)) if std::ptr::eq(*of, tableau) && *end == theta => *known,
            _ => {
                let weights = Weights::new(tableau, theta);
                self.weights = Some((tableau, theta, weights));
                weights
            }
        }
    }

    /// Adds an accepted step to the balance of energy of `s`, as [`Samples::step`] would record it.
    pub fn sum_up(
        &mut self,
        s: &mut Stepper,
        trial: &Trial,
        stage_equations: &StageEquations,
        tableau: &'static Tableau,
        theta: f64,
    ) {
        let Some(sums) = &mut s.recorder.sums else { return };
        let (n, m) = (s.state.z.len(), s.state.l.len());
        let Weights { count, own, taken, .. } = &self.weights(tableau, theta);
        let [mut z, mut rate, mut u, mut f, mut f_rate] = [[&[][..]; POINTS]; 5];
        self.multipliers.clear();
        for place in 0..*count {
            let inside = place < tableau.stages();
            let i = standing(tableau, place);
            let (x, rates, sources) = if inside {
                (&trial.stages.ends[i], &trial.stages.rates[i], &trial.stages.inputs[i])
            } else {
                (&trial.at.x, &trial.at.slope, &trial.at.u)
            };
            u[place] = sources;
            (z[place], f[place]) = (&x[..n], &x[n + m..]);
            (rate[place], f_rate[place]) = rates.split_at(n);
            let guards = x[n..n + m].iter().zip(s.state.active.iter().zip(&s.state.roles));
            let open = trial.stages.open[i];
            let multiplier = |(i, (&g, (&on, &role)))| {
                stage_equations.resistances.multiplier(i, g, on, role, open)
            };
            self.multipliers.extend(guards.enumerate().map(multiplier));
        }
        sums.points(
            &trial.first[..n],
            &Points {
                length: trial.length,
                weight: &own[..*count],
                taken: &taken[..count * count],
                z: &z[..*count],
                rate: &rate[..*count],
                l: &self.multipliers,
                u: &u[..*count],
                f: &f[..*count],
                f_rate: &f_rate[..*count],
            },
        );
    }

    /// Whether the present step, tried with a length, is recorded; asked once.
    pub fn chooses(&mut self, s: &Stepper, start: f64, end: f64, tried: f64) -> bool {
        self.nodes.clear();
        if no_length(start, end, tried) {
            self.empty = self.empty.saturating_add(1);
            return false;
        }
        self.seen += 1;
        let affordable = self.spent + PRICE <= STOCK + self.seen;
        let chosen = s.recorder.samples.all || s.recorder.samples.watches() && affordable;
        self.spent += if chosen { PRICE } else { 0 };
        chosen
    }

    /// Keeps the point evaluated last as the next of those at which the error of a recorded step is found.
    pub fn node(&mut self, s: &Stepper, trial: &Trial, stage_equations: &StageEquations) {
        let x = &trial.at.x;
        let l = multipliers(s, stage_equations, x, trial.open()).collect();
        self.nodes.push([x[..s.state.z.len()].to_vec(), l, trial.at.u.clone()]);
    }

    /// Hands these points, the last of them the end of the step, to the certificate.
    pub fn find_errors(&self, s: &mut Stepper, trial: &Trial, theta: f64, asked: Asked) {
        let first = &trial.first[..s.state.z.len()];
        let (Some(sums), [a, b, c]) = (&mut s.recorder.sums, &self.nodes[..]) else { return };
        let nodes: [Node; NODES] = [a, b, c].map(|[z, l, u]| Node { z, l, u });
        let length = theta * trial.length;
        sums.recorded(&ErringStep { asked, length, first, nodes });
    }

    /// Records an accepted step up to `theta` of its length, before the state of `s` moves
    /// to the point of `trial`.
    pub fn step(
        &mut self,
        s: &Stepper,
        trial: &Trial,
        stage_equations: &StageEquations,
        tableau: &'static Tableau,
        theta: f64,
        end: f64,
    ) {
        let n = s.state.z.len();
        let (stages, h) = (tableau.stages(), trial.length);
        let Weights { own, inner, .. } = self.weights(tableau, theta);
        let taken = &mut self.taken;
        taken.begin.push(trial.start);
        taken.end.push(end);
        taken.shortest.push(tableau.gamma * h);
        taken.swing.push(0.0);
        taken.steps.push(1u8.saturating_add(std::mem::take(&mut self.empty)));
        taken.signed.push(0); // inner stages are of low order
        taken.doubt.push(if s.switching.sampled.contains(&true) { f64::INFINITY } else { 0.0 });
        taken.first.extend_from_slice(&trial.first[..n]);
        taken.first_u.extend_from_slice(&s.state.u0);
        taken.weight.extend(own[..=stages].iter().map(|w| h * w));
        if !s.switching.switches.is_empty() {
            taken.roles.extend(s.state.roles.iter().map(|&r| r as u8));
        }
        for i in 0..=stages {
            let inside = i < stages;
            let i = standing(tableau, i);
            let part = if inside { tableau.c[i] } else { theta };
            let t = trial.start + part * h;
            let x = if inside { &trial.stages.ends[i] } else { &trial.at.x };
            let rates = if inside { &trial.stages.rates[i] } else { &trial.at.slope };
            taken.time.push(t);
            taken.z.extend_from_slice(&x[..n]);
            taken.l.extend(multipliers(s, stage_equations, x, trial.stages.open[i]));
            taken.u.extend_from_slice(if inside { &trial.stages.inputs[i] } else { &trial.at.u });
            taken.rate.extend_from_slice(&rates[..n]);
            taken.function_rate.extend_from_slice(&rates[n..]);
            taken.inner.extend(inner[i][..=stages].iter().map(|w| h * w));
        }
    }
}

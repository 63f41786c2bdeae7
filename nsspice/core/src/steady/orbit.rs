//! A run from given charges over one period, and how its end depends on its beginning.
//!
//! At the end of a segment a guard `g(x, v, v') = 0` decides when the mode changes. With its rate `r` along
//! the run a perturbation moves the instant by `dt = -dg / r`. With the velocities `f-` and `f+` of the energy
//! coordinates before and after, and the jump `R` (a projection, most often the identity), the state after it
//! is perturbed by
//!
//! ```text
//! da+ = R (da- + f- dt) - f+ dt.
//! ```

use super::modal::{carry, rates};
use crate::dense::{dot, norm, Matrix};
use crate::integrate::Failure;
use crate::modewise::modes::mode::{Mode, Watch};
use crate::modewise::modes::outputs::{Outputs, Spec};
use crate::modewise::{Engine, Passage, Passed, Prepared};

/// Why a run has no derivative.
#[derive(Clone, Debug)]
pub struct Fault {
    /// `grazing` or `together`
    pub kind: &'static str,
    /// when [s]
    pub time: f64,
    /// pairs whose guards take part
    pub pairs: Vec<usize>,
}

/// What a perturbation does across an event, over the modal coordinates before it, the stimuli and their rates.
pub struct Event {
    /// modal coordinates after it
    pub after: [Matrix; 3],
    /// moved instant, one row each; empty if it is fixed
    pub shift: Option<[Matrix; 3]>,
    /// the energy coordinates jump
    pub jumps: bool,
}

/// A system whose runs are differentiated.
pub struct Orbit {
    pub(super) prepared: Prepared,
    pub(super) outputs: Outputs,
    /// outputs with rates, which a jump of the state makes an impulse
    pub(super) rated: Vec<bool>,
    /// energy coordinates at the beginning of the last run
    pub(super) origin: Vec<f64>,
    /// stimuli as columns over `[1; inputs]`
    pub(super) stimuli: Matrix,
    /// the last run
    pub(super) passages: Vec<Passage>,
    /// between segment k - 1 and k; the first one leads from the end back to the beginning
    pub(super) events: Vec<Event>,
    /// gates at the end of the last run
    gates: Vec<bool>,
    /// duration of the last run [s]
    pub(super) period: f64,
}

fn rank_one(out: &mut Matrix, column: &[f64], row: &Matrix) {
    for (r, &f) in column.iter().enumerate() {
        for c in 0..row.cols {
            out[(r, c)] += f * row[(0, c)];
        }
    }
}

/// Velocities of modal coordinates, inputs, and rates of these, at the end of a passage.
pub(super) fn at_end(p: &Passage) -> [Vec<f64>; 3] {
    let (mut d, mut dd) = (Vec::new(), Vec::new());
    p.inputs.rates(&p.v, &mut d);
    p.inputs.curvatures(&d, &mut dd);
    [velocity(&p.mode, &p.last, &p.v), d, dd]
}

/// Rates of modal coordinates.
pub(super) fn velocity(mode: &Mode, x: &[f64], v: &[f64]) -> Vec<f64> {
    let column = Matrix { rows: x.len(), cols: 1, data: x.to_vec() };
    let mut out = rates(mode, &column).data;
    mode.drive.apply_add(v, &mut out);
    out
}

/// A mode's map from energy coordinates to modal ones.
pub(super) fn entering(mode: &Mode, a: &Matrix) -> Matrix {
    match &mode.enter {
        Some(enter) => enter.times(a),
        None => mode.leave_x.transpose_times(a),
    }
}

impl Orbit {
    /// Prepares runs; stimuli are waveforms by number.
    pub fn new(prepared: &Prepared, outputs: Vec<Spec>, stimuli: &[usize]) -> Orbit {
        let columns: Vec<Vec<f64>> =
            stimuli.iter().map(|&w| prepared.inputs.combine(&[(w, 1.0)])).collect();
        let rows = 1 + prepared.inputs.len();
        Orbit {
            rated: outputs.iter().map(|o| !o[2].is_empty()).collect(),
            origin: Vec::new(),
            outputs: Outputs::new(outputs, &prepared.net, &prepared.inputs),
            prepared: prepared.clone(),
            stimuli: Matrix::from_fn(rows, columns.len(), |r, c| columns[c][r]),
            passages: Vec::new(),
            events: Vec::new(),
            gates: Vec::new(),
            period: 0.0,
        }
    }

    /// Number of energy coordinates.
    pub fn states(&self) -> usize {
        self.prepared.net.states
    }

    /// Charges and fluxes from energy coordinates.
    pub fn charges_of(&self, a: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.prepared.net.n];
        self.prepared.net.charges.apply(a, &mut out);
        out
    }

    /// Energy coordinates of charges and fluxes.
    pub fn energy_of(&self, charges: &[f64]) -> Vec<f64> {
        let mut a = vec![0.0; self.states()];
        self.prepared.net.energy(charges, &mut a);
        a
    }

    /// Runs from time 0 and energy coordinates to `stop`, or until the gate of a switch goes up.
    pub fn run(
        &mut self,
        a: &[f64],
        gates: &[bool],
        stop: f64,
        trigger: Option<usize>,
    ) -> Result<Passed, Failure> {
        // a fresh one: what it finds does not depend on the runs before
        let mut engine = Engine::new(&self.prepared, Vec::new());
        engine.plan(stop, 0.0, stop, 1e-3 * stop);
        engine.trace();
        self.events.clear();
        self.passages.clear();
        self.origin = a.to_vec();
        engine.start(&self.charges_of(a), gates, None)?;
        let passed = engine.pass(trigger)?;
        self.passages = engine.take_passages();
        self.gates = engine.gates().to_vec();
        self.period = self.passages.last().map_or(0.0, |p| p.end);
        Ok(passed)
    }

    /// Segments of the last run.
    pub fn passages(&self) -> &[Passage] {
        &self.passages
    }

    /// Duration of the last run [s].
    pub fn period(&self) -> f64 {
        self.period
    }

    /// Gates at the end of the last run.
    pub fn gates(&self) -> &[bool] {
        &self.gates
    }

    /// Energy coordinates at the end of the last run, left limit.
    pub fn end(&self) -> Vec<f64> {
        let mut a = vec![0.0; self.states()];
        if let Some(p) = self.passages.last() {
            p.mode.leave(&p.last, &p.v, &mut a);
        }
        a
    }

    /// The largest energy coordinates met.
    pub fn sizes(&self) -> Vec<f64> {
        let mut most = self.end().iter().map(|v| v.abs()).collect::<Vec<f64>>();
        let mut a = vec![0.0; most.len()];
        for p in &self.passages {
            p.mode.leave(&p.first, &p.inputs.now, &mut a);
            most.iter_mut().zip(&a).for_each(|(m, v)| *m = m.max(v.abs()));
        }
        most
    }

    /// Derives the events of the last run.
    pub fn differentiate(&mut self) -> Result<(), Fault> {
        let count = self.passages.len();
        let mut events = Vec::with_capacity(count);
        for k in 0..count {
            let from = &self.passages[(k + count - 1) % count];
            events.push(self.event(from, &self.passages[k])?);
        }
        self.events = events;
        Ok(())
    }

    pub(super) fn pair_of(&self, watch: Watch) -> usize {
        match watch {
            Watch::Pair(pair) => pair,
            Watch::Switch(switch) => self.prepared.switches[switch].pair,
        }
    }

    /// By how much perturbations move the end of a passage, over its modal coordinates, stimuli and their
    /// rates; `None` if it is fixed.
    fn shift(&self, p: &Passage, ends: &[Vec<f64>; 3]) -> Result<Option<[Matrix; 3]>, Fault> {
        let rows = &p.mode.guards.rows;
        let [dx, dv, dd] = ends;
        let mut found: Option<[Matrix; 3]> = None;
        let named = |guards: &[usize]| {
            guards.iter().map(|&j| self.pair_of(p.mode.guards.watch[j])).collect()
        };
        for &j in &p.crossing {
            let parts = [(rows.x.row(j), dx), (rows.v.row(j), dv), (rows.d.row(j), dd)];
            let rate: f64 = parts.iter().map(|(row, d)| dot(row, d)).sum();
            let terms = parts.iter().flat_map(|(row, d)| row.iter().zip(d.iter()));
            let (size, count) = terms.fold((0.0, 0), |(s, n), (f, y)| (s + (f * y).abs(), n + 1));
            // a rate that is nothing but the rounding of its terms
            if rate.abs() <= f64::from(count) * f64::EPSILON * size {
                return Err(Fault { kind: "grazing", time: p.end, pairs: named(&[j]) });
            }
            let line = |row: &[f64]| Matrix {
                rows: 1,
                cols: row.len(),
                data: row.iter().map(|f| -f / rate).collect(),
            };
            let by_v = line(rows.v.row(j)).times(&self.stimuli);
            let by_d = line(rows.d.row(j)).times(&self.stimuli);
            let shift = [line(rows.x.row(j)), by_v, by_d];
            let Some(first) = &found else {
                found = Some(shift);
                continue;
            };
            // guards that agree about the instant are one event; 1e-9: they are rows of one mode, computed
            // apart from each other
            let apart = |a: &Matrix, b: &Matrix| {
                let most = a.max_abs().max(b.max_abs());
                a.data.iter().zip(&b.data).any(|(x, y)| (x - y).abs() > 1e-9 * most)
            };
            if first.iter().zip(&shift).any(|(a, b)| apart(a, b)) {
                return Err(Fault { kind: "together", time: p.end, pairs: named(&p.crossing) });
            }
        }
        Ok(found)
    }

    /// The variation across the event between two passages.
    fn event(&self, from: &Passage, to: &Passage) -> Result<Event, Fault> {
        let ends = at_end(from);
        let shift = self.shift(from, &ends)?;
        let stimuli = &self.stimuli;
        let zero = Matrix::zeros(from.mode.leave_x.rows, stimuli.cols);
        // energy coordinates at the moved instant
        let mut u = [from.mode.leave_x.clone(), from.mode.leave_v.times(stimuli), zero];
        if let Some(shift) = &shift {
            let mut f = vec![0.0; u[0].rows];
            from.mode.leave(&ends[0], &ends[1], &mut f);
            u.iter_mut().zip(shift).for_each(|(u, t)| rank_one(u, &f, t));
        }
        for mode in &to.state_jumps {
            let mut next = u.map(|u| mode.leave_x.times(&entering(mode, &u)));
            next[1].add_scaled(1.0, &mode.leave_v.times(stimuli));
            if let Some(shift) = &shift {
                let mut f = vec![0.0; next[0].rows];
                mode.leave_v.apply(&to.inputs.rate, &mut f);
                next.iter_mut().zip(shift).for_each(|(u, t)| rank_one(u, &f, t));
            }
            u = next;
        }
        let mut after = u.map(|u| entering(&to.mode, &u));
        if let Some(shift) = &shift {
            let mut f = velocity(&to.mode, &to.first, &to.inputs.now);
            f.iter_mut().for_each(|v| *v = -*v);
            after.iter_mut().zip(shift).for_each(|(x, t)| rank_one(x, &f, t));
        }
        let states = from.mode.leave_x.rows;
        let (mut before, mut then) = (vec![0.0; states], vec![0.0; states]);
        from.mode.leave(&from.last, &from.v, &mut before);
        to.mode.leave(&to.first, &to.inputs.now, &mut then);
        let size = norm(&before).max(norm(&then));
        before.iter_mut().zip(&then).for_each(|(a, b)| *a -= b);
        // both are sums of products over all states, of numbers up to their size
        let jumps = norm(&before) > 64.0 * (1 + states) as f64 * f64::EPSILON * size;
        Ok(Event { after, shift, jumps })
    }

    /// Perturbations of the modal coordinates at the end of the run from those at its beginning, carried on.
    fn carried(&self, mut x: Matrix) -> Matrix {
        for (k, p) in self.passages.iter().enumerate() {
            if k > 0 {
                x = self.events[k].after[0].times(&x);
            }
            carry(&p.mode, p.end - p.start, &mut x);
        }
        x
    }

    /// The derivative of the energy coordinates at the end of the run by those at its beginning; with a
    /// `moving` end at the instant of the event that ends it.
    pub fn derivative(&self, moving: bool) -> Matrix {
        let states = self.states();
        let (Some(first), Some(last)) = (self.passages.first(), self.passages.last()) else {
            return Matrix::identity(states);
        };
        let mut entry = Matrix::identity(states);
        for mode in &first.state_jumps {
            entry = mode.leave_x.times(&entering(mode, &entry));
        }
        let mut out = last.mode.leave_x.clone();
        if let (true, Some(shift)) = (moving, &self.events[0].shift) {
            let [x, v, _] = at_end(last);
            let mut f = vec![0.0; states];
            last.mode.leave(&x, &v, &mut f);
            rank_one(&mut out, &f, &shift[0]);
        }
        out.times(&self.carried(entering(&first.mode, &entry)))
    }

    /// The monodromy matrix, in the modal coordinates at the beginning.
    pub fn monodromy(&self) -> Matrix {
        let (Some(first), Some(event)) = (self.passages.first(), self.events.first()) else {
            return Matrix::zeros(0, 0);
        };
        event.after[0].times(&self.carried(Matrix::identity(first.mode.n)))
    }
}

//! Derivatives of a functional of a run by everything that acts on it, by one pass backwards.
//!
//! A functional is a sum of weighted integrals and values of outputs. Its derivative by the state is the adjoint
//! `l(t)`: within a segment `l' = -J' l - C' w` with the weights `w` of the outputs, across an event the transposed
//! map of perturbations, and where an output jumps at a moved instant, what the shift of that instant makes of the
//! integral. A parameter acts as a *driver*: a stimulus (a source in a row of the equations, in the slack of a pair
//! or in the control of a switch) that carries an output of the run: of a conductance minus its own voltage. So its
//! derivative is an integral of the adjoint of that row times the output (Tellegen's theorem). These integrals are
//! collected as matrices, one for each mode, before they are multiplied by the rows of the drivers: a pass costs the
//! same for any number of parameters.

use super::adjoint_interval::{Interval, Motion};
use super::goal::{Goal, Limit};
use super::orbit::{at_end, velocity, Orbit};
use crate::dense::{add_scaled, dot, Lu, Matrix};
use crate::modewise::functions::terms::Point;
use crate::modewise::modes::mode::Mode;
use crate::modewise::segments::trajectory::Trajectory;
use crate::modewise::Passage;
use std::collections::HashMap;
use std::sync::Arc;

/// How a parameter acts: a stimulus that carries an output and a constant.
#[derive(Clone, Copy, Debug)]
pub struct Driver {
    /// which stimulus
    pub stimulus: usize,
    /// which output it carries
    pub output: Option<usize>,
    /// the charge or flux behind the rates in that output, which counts where it jumps
    pub stored: Option<usize>,
    /// what it carries besides
    pub constant: f64,
}

/// Derivatives of a functional.
pub struct Gradient {
    /// by the parameter behind each driver
    pub drivers: Vec<f64>,
    /// by the charges and fluxes with which the run begins
    pub charges: Vec<f64>,
    /// by the instants at which sources end segments: instant, derivative, which is no number where a window ends or
    /// a value is taken at that instant and the output jumps or turns there
    pub instants: Vec<(f64, f64)>,
    /// by the period of an orbit, beyond what the windows of integrals end with it
    pub period: f64,
}

/// One mode in a pass: its rows, and what is collected in it.
pub(super) struct Side {
    pub mode: Arc<Mode>,
    /// outputs over modal coordinates
    x: Matrix,
    /// outputs over stimuli, their first and second rates
    stimuli: [Matrix; 3],
    /// outputs over `z = [x; v; v'; v'']`, the inputs without stimuli
    over: Matrix,
    /// drive of the modal coordinates by stimuli and by the other inputs
    by_stimuli: Matrix,
    pub by_inputs: Matrix,
    /// integrals of the adjoint times `z`
    w: Matrix,
    /// what else multiplies the values of drivers, stimulus by stimulus, over `z`
    c: Matrix,
    /// the same of the charges behind their rates
    k: Matrix,
}

impl Side {
    fn new(orbit: &Orbit, mode: &Arc<Mode>, plain: &[usize]) -> Side {
        let (x, inputs) = orbit.rows_of(mode);
        let over = inputs.iter().fold(x.clone(), |o, m| o.beside(&m.select_cols(plain)));
        Side {
            mode: mode.clone(),
            stimuli: inputs.map(|m| m.times(&orbit.stimuli)),
            by_stimuli: mode.drive.times(&orbit.stimuli),
            by_inputs: mode.drive.select_cols(plain),
            w: Matrix::zeros(mode.n, over.cols),
            c: Matrix::zeros(orbit.stimuli.cols, over.cols),
            k: Matrix::zeros(orbit.stimuli.cols, over.cols),
            x,
            over,
        }
    }

    fn outputs(&self, z: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.over.rows];
        self.over.apply(z, &mut out);
        out
    }

    /// Adds to what multiplies the values of drivers at a point.
    fn collect(&mut self, stimuli: &[f64], z: &[f64]) {
        outer(&mut self.c, stimuli, z);
    }
}

/// `[x; v; v'; v'']` at a point, and its rate.
struct Place {
    z: Vec<f64>,
    rate: Vec<f64>,
}

/// One pass.
struct Pass<'a> {
    orbit: &'a Orbit,
    goal: &'a Goal,
    /// inputs that are not stimuli
    plain: Vec<usize>,
    sides: Vec<Side>,
    known: HashMap<*const Mode, usize>,
    /// which of them each passage is in
    side_of: Vec<usize>,
    instants: Vec<(f64, f64)>,
    period: f64,
    /// whether integrals are collected
    collects: bool,
}

fn outer(to: &mut Matrix, column: &[f64], row: &[f64]) {
    for (r, &f) in column.iter().enumerate().filter(|f| *f.1 != 0.0) {
        add_scaled(to.row_mut(r), f, row);
    }
}

fn transposed(m: &Matrix, x: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; m.cols];
    m.apply_transposed(x, &mut out);
    out
}

/// The transposed map from energy coordinates into a mode.
fn entering_back(mode: &Mode, l: &[f64]) -> Vec<f64> {
    if let Some(enter) = &mode.enter {
        return transposed(enter, l);
    }
    let mut out = vec![0.0; mode.leave_x.rows];
    mode.leave_x.apply(l, &mut out);
    out
}

fn entered(mode: &Mode, a: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; mode.n];
    mode.enter(a, &mut out);
    out
}

impl Orbit {
    /// Whether a functional and drivers name outputs and stimuli that are there.
    pub fn carries(&self, goal: &Goal, drivers: &[Driver]) -> bool {
        let known = |d: &Driver| {
            let outputs = [d.output, d.stored].into_iter().flatten();
            d.stimulus < self.stimuli.cols && outputs.into_iter().all(|o| o < self.rated.len())
        };
        goal.fits(self.rated.len()) && drivers.iter().all(known)
    }

    /// Derivatives of a functional of the last run, which has been differentiated; of one along a periodic orbit
    /// with its beginning, which is its end. `None` where a mode has no eigenvectors, nothing pulls the orbit back,
    /// or an output is the rate of what jumps.
    pub fn gradient(&self, goal: &Goal, drivers: &[Driver], periodic: bool) -> Option<Gradient> {
        if self.passages.iter().any(|p| !p.mode.blocks.is_empty()) {
            return None;
        }
        let mut pass = Pass::new(self, goal);
        let n = self.passages.first()?.mode.n;
        let mut last = vec![0.0; self.passages.last()?.mode.n];
        if periodic {
            pass.collects = false;
            last = pass.event(0, &vec![0.0; n])?;
            let free = pass.back(last)?;
            let mut matrix = Matrix::identity(n);
            matrix.add_scaled(-1.0, &self.monodromy().transpose());
            let factor = Lu::new(&matrix);
            if n > 0 && factor.ratio <= 1e3 * f64::EPSILON {
                return None; // the rounding of the matrix is as large as what is left of it
            }
            let column = Matrix { rows: n, cols: 1, data: free };
            let first = factor.solve_refined(&matrix, &column).data;
            pass.collects = true;
            last = pass.event(0, &first)?;
        }
        let first = pass.back(last)?;
        let charges = if periodic { Vec::new() } else { pass.beginning(&first) };
        let drivers = pass.contracted(drivers);
        if drivers.iter().chain(&charges).any(|v| v.is_nan()) {
            return None;
        }
        pass.instants.reverse();
        Some(Gradient { drivers, charges, instants: pass.instants, period: pass.period })
    }
}

impl<'a> Pass<'a> {
    fn new(orbit: &'a Orbit, goal: &'a Goal) -> Pass<'a> {
        let stimuli = &orbit.stimuli;
        let plain: Vec<usize> =
            (0..stimuli.rows).filter(|&r| stimuli.row(r).iter().all(|v| *v == 0.0)).collect();
        let mut pass = Pass {
            orbit,
            goal,
            plain,
            sides: Vec::new(),
            known: HashMap::new(),
            side_of: Vec::new(),
            instants: Vec::new(),
            period: 0.0,
            collects: true,
        };
        pass.side_of = orbit.passages.iter().map(|p| pass.side(&p.mode)).collect();
        pass
    }

    /// The number of a mode.
    fn side(&mut self, mode: &Arc<Mode>) -> usize {
        let (sides, orbit, plain) = (&mut self.sides, self.orbit, &self.plain);
        *self.known.entry(Arc::as_ptr(mode)).or_insert_with(|| {
            sides.push(Side::new(orbit, mode, plain));
            sides.len() - 1
        })
    }

    /// A point of a passage by its modal coordinates and inputs.
    fn place(&self, p: &Passage, x: &[f64], v: &[f64]) -> Place {
        let (mut d, mut dd, mut ddd) = (Vec::new(), Vec::new(), Vec::new());
        p.inputs.rates(v, &mut d);
        p.inputs.curvatures(&d, &mut dd);
        p.inputs.curvatures(&dd, &mut ddd);
        let moves = velocity(&p.mode, x, v);
        Place { z: self.joined(x, [v, &d, &dd]), rate: self.joined(&moves, [&d, &dd, &ddd]) }
    }

    fn joined(&self, x: &[f64], inputs: [&[f64]; 3]) -> Vec<f64> {
        let own = inputs.into_iter().flat_map(|list| self.plain.iter().map(|&i| list[i]));
        x.iter().copied().chain(own).collect()
    }

    fn begins(&self, p: &Passage) -> Place {
        self.place(p, &p.first, &p.inputs.now)
    }

    fn ends(&self, p: &Passage) -> Place {
        self.place(p, &p.last, &p.v)
    }

    /// Adds weighted values of outputs at a point to the adjoint; `None` if they are rates of drivers' rates.
    fn value(&mut self, side: usize, weights: &[f64], at: &Place, l: &mut [f64]) -> Option<()> {
        let side = &mut self.sides[side];
        add_scaled(l, 1.0, &transposed(&side.x, weights));
        let [by_value, by_rate, by_second] =
            [0, 1, 2].map(|k| transposed(&side.stimuli[k], weights));
        if self.collects {
            side.collect(&by_value, &at.z);
            side.collect(&by_rate, &at.rate);
        }
        by_second.iter().all(|f| *f == 0.0).then_some(())
    }

    /// The adjoint at the beginning of the run from that at its end.
    fn back(&mut self, mut l: Vec<f64>) -> Option<Vec<f64>> {
        let (orbit, outputs) = (self.orbit, self.orbit.outputs.len());
        for (k, p) in orbit.passages.iter().enumerate().rev() {
            let side = self.side_of[k];
            if let Some(weights) = self.goal.values_at(p.end, &[Limit::Left, Limit::Fixed], outputs)
            {
                let at = self.ends(p);
                self.value(side, &weights, &at, &mut l)?;
            }
            l = self.through(p, side, l)?;
            let limits: &[Limit] =
                if k > 0 { &[Limit::Right] } else { &[Limit::Right, Limit::Fixed] };
            if let Some(weights) = self.goal.values_at(p.start, limits, outputs) {
                let at = self.begins(p);
                self.value(side, &weights, &at, &mut l)?;
            }
            if k > 0 {
                l = self.event(k, &l)?;
            }
        }
        Some(l)
    }

    /// The adjoint at the beginning of a passage from that at its end.
    fn through(&mut self, p: &Passage, side: usize, mut l: Vec<f64>) -> Option<Vec<f64>> {
        let cuts = self.orbit.cuts(p, self.goal);
        let (mut path, mut point) = (Trajectory::default(), Point::default());
        if !cuts.is_empty() {
            let mut a = vec![0.0; self.orbit.states()];
            p.mode.leave(&p.first, &p.inputs.now, &mut a);
            path.begin(&p.mode, &a, &p.inputs, (p.end - p.start).max(f64::MIN_POSITIVE));
        }
        let (mut x, mut v) = (vec![0.0; p.mode.n], p.inputs.now.clone());
        let mut last = (p.end - p.start, self.ends(p));
        for cut in cuts.iter().rev() {
            path.at(cut.at, &mut point);
            path.state(&point, &mut x);
            path.inputs(&p.inputs, &point, &mut v);
            let at = self.place(p, &x, &v);
            l = self.along(side, p, [cut.at, last.0], [&at, &last.1], &l);
            self.value(side, &cut.weights, &at, &mut l)?;
            last = (cut.at, at);
        }
        let at = self.begins(p);
        Some(self.along(side, p, [0.0, last.0], [&at, &last.1], &l))
    }

    /// The adjoint at the beginning of an interval, inside of which no values count, from that at its end.
    fn along(
        &mut self,
        side: usize,
        p: &Passage,
        [from, to]: [f64; 2],
        [begin, end]: [&Place; 2],
        l: &[f64],
    ) -> Vec<f64> {
        let outputs = self.orbit.outputs.len();
        let weights = self.goal.constant(p.start + 0.5 * (from + to), outputs);
        let own = &self.sides[side];
        let g = weights.as_ref().map_or_else(|| vec![0.0; l.len()], |w| transposed(&own.x, w));
        let motion = Motion::new(own, &self.plain, p, from, &begin.z[..p.mode.n]);
        let interval = Interval::new(&p.mode, to - from, motion);
        let out = interval.back(l, &g);
        if !self.collects {
            return out;
        }
        let side = &mut self.sides[side];
        interval.integrals(l, &g, &mut side.w);
        if let Some(weights) = weights {
            let by = [0, 1, 2].map(|k| transposed(&side.stimuli[k], &weights));
            let less =
                |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>();
            side.collect(&by[0], &interval.whole(side.over.cols));
            side.collect(&by[1], &less(&end.z, &begin.z));
            side.collect(&by[2], &less(&end.rate, &begin.rate));
        }
        out
    }

    /// The adjoint before the event at the beginning of a passage from that after it.
    fn event(&mut self, k: usize, l: &[f64]) -> Option<Vec<f64>> {
        let (orbit, outputs) = (self.orbit, self.orbit.outputs.len());
        let count = orbit.passages.len();
        let before = (k + count - 1) % count;
        let (from, to, event) = (&orbit.passages[before], &orbit.passages[k], &orbit.events[k]);
        let (side, next) = (self.side_of[before], self.side_of[k]);
        let (end, start) = (self.ends(from), self.begins(to));
        // what the functional gains as the event comes later
        let values = [(side, &end.z), (next, &start.z)].map(|(s, z)| self.sides[s].outputs(z));
        let mut gain = self.goal.jump([from.end, to.start], &values[0], &values[1]);
        if event.jumps && self.goal.integrated().any(|o| orbit.rated[o]) {
            return None; // an impulse
        }
        let rates = [(side, &end.rate), (next, &start.rate)].map(|(s, z)| self.sides[s].outputs(z));
        for (rates, t, limit) in
            [(&rates[0], from.end, Limit::Left), (&rates[1], to.start, Limit::Right)]
        {
            if let Some(weights) = self.goal.values_at(t, &[limit], outputs) {
                gain += dot(&weights, rates);
                if k == 0 && limit == Limit::Left {
                    self.period = dot(&weights, rates);
                }
            }
        }
        // two modes compute one number apart from each other
        let differ = |a: f64, b: f64| (a - b).abs() > 1e-9 * a.abs().max(b.abs());
        let fixed = self.goal.values_at(from.end, &[Limit::Fixed], outputs);
        let turned = fixed.is_some_and(|weights| {
            let sums =
                |lists: &[Vec<f64>; 2]| differ(dot(&weights, &lists[0]), dot(&weights, &lists[1]));
            sums(&values) || sums(&rates)
        });
        let cut = |&o: &usize| differ(values[0][o], values[1][o]);
        let blurred = turned || (k > 0 && self.goal.ending_at(from.end).any(|o| cut(&o)));
        let mut out = transposed(&event.after[0], l);
        let mut by = [1, 2].map(|i| transposed(&event.after[i], l));
        match &event.shift {
            Some(_) if blurred => return None,
            Some(shift) => {
                add_scaled(&mut out, gain, &shift[0].data);
                by.iter_mut().zip(&shift[1..]).for_each(|(b, s)| add_scaled(b, gain, &s.data));
            }
            None if self.collects => {
                let moved = dot(l, &self.arriving(from, to));
                let apart = gain + moved - dot(l, &velocity(&to.mode, &to.first, &to.inputs.now));
                self.instants.push((from.end, if blurred { f64::NAN } else { apart }));
                if k == 0 {
                    self.period += moved;
                }
            }
            None => {}
        }
        if self.collects {
            self.sides[side].collect(&by[0], &end.z);
            self.sides[side].collect(&by[1], &end.rate);
            let mut a = vec![0.0; orbit.states()];
            from.mode.leave(&from.last, &from.v, &mut a);
            self.kicked(to, l, &a, Some((side, end.z)));
        }
        Some(out)
    }

    /// Rates of modal coordinates before an event at a fixed instant, as they arrive after it.
    fn arriving(&self, from: &Passage, to: &Passage) -> Vec<f64> {
        let [x, d, _] = at_end(from);
        let mut a = vec![0.0; self.orbit.states()];
        from.mode.leave(&x, &d, &mut a);
        for mode in &to.state_jumps {
            let x = entered(mode, &a);
            mode.leave(&x, &to.inputs.rate, &mut a);
        }
        entered(&to.mode, &a)
    }

    /// Adjoint of the energy coordinates `a` before the jumps into a passage. What parameters change of charges and
    /// fluxes moves on the way as these do, beginning with nothing at the start of the run.
    fn kicked(
        &mut self,
        to: &Passage,
        l: &[f64],
        a: &[f64],
        before: Option<(usize, Vec<f64>)>,
    ) -> Vec<f64> {
        let (now, rate) = (&to.inputs.now, &to.inputs.rate);
        let mut places = vec![before];
        let mut a = a.to_vec();
        for mode in &to.state_jumps {
            let x = entered(mode, &a);
            mode.leave(&x, now, &mut a);
            let still = vec![0.0; now.len()];
            let z = self.joined(&x, [now, rate, &still]);
            places.push(Some((self.side(mode), z)));
        }
        places.push(Some((self.side(&to.mode), self.begins(to).z)));
        let mut back = entering_back(&to.mode, l);
        for k in (1..places.len()).rev() {
            let by = self.by_charges(&back);
            for (place, sign) in [(&places[k], 1.0), (&places[k - 1], -1.0)] {
                if let Some((side, z)) = place {
                    let by: Vec<f64> = by.iter().map(|f| sign * f).collect();
                    outer(&mut self.sides[*side].k, &by, z);
                }
            }
            if k > 1 {
                let mode = &to.state_jumps[k - 2];
                back = entering_back(mode, &transposed(&mode.leave_x, &back));
            }
        }
        back
    }

    /// What charges put in by the stimuli make of energy coordinates, transposed.
    fn by_charges(&self, back: &[f64]) -> Vec<f64> {
        let net = &self.orbit.prepared.net;
        let mut by_inputs = vec![0.0; net.rs.cols];
        net.rs.apply_transposed(back, &mut by_inputs);
        transposed(&self.orbit.stimuli, &by_inputs)
    }

    /// Derivatives by charges and fluxes at the beginning, from the adjoint of the first passage.
    fn beginning(&mut self, l: &[f64]) -> Vec<f64> {
        let (orbit, first) = (self.orbit, &self.orbit.passages[0]);
        let back = self.kicked(first, l, &orbit.origin, None);
        // stimuli that jumps let through
        let at = self.begins(first);
        let mut energy = entering_back(&first.mode, l);
        for mode in first.state_jumps.iter().rev() {
            let by = transposed(&orbit.stimuli, &transposed(&mode.leave_v, &energy));
            self.sides[self.side_of[0]].collect(&by, &at.z);
            energy = entering_back(mode, &transposed(&mode.leave_x, &energy));
        }
        let mut charges = vec![0.0; orbit.prepared.net.n];
        orbit.prepared.net.big_r.apply(&back, &mut charges);
        charges
    }

    /// Derivatives by the parameters behind the drivers, from what was collected.
    fn contracted(&self, drivers: &[Driver]) -> Vec<f64> {
        let mut out = vec![0.0; drivers.len()];
        let one = self.plain.iter().position(|&i| i == 0);
        for side in &self.sides {
            let mut all = side.by_stimuli.transpose_times(&side.w);
            all.add_scaled(1.0, &side.c);
            for (sum, driver) in out.iter_mut().zip(drivers) {
                let row = all.row(driver.stimulus);
                *sum += one.map_or(0.0, |r| driver.constant * row[side.mode.n + r]);
                *sum += driver.output.map_or(0.0, |o| dot(row, side.over.row(o)));
                let row = side.k.row(driver.stimulus);
                *sum += driver.stored.map_or(0.0, |o| dot(row, side.over.row(o)));
            }
        }
        out
    }
}

//! Errors as energies: what a step errs by is measured by the energy that the network exchanges.
//!
//! An error `dx` of an unknown is worth `W |x dx| + W dx^2 / 2` in the elements that store there (`W` capacitance,
//! inductance, slope of a charge).  It may be the tolerance times the largest energy that one element of the same part
//! of the network takes up and gives back within a period of the sources: of the shortest, in the last one or the
//! present one; without any, since the begin.  Nor may it move the mean of the unknown over such a period by more than
//! the tolerance: ringing of little energy is followed or damped by the method (L-stable), not sampled.
//!
//! Signals are no energies: unknowns that switches, controlled sources or functions read where they do not flow are
//! left to the usual measure.

use crate::integrate::implicit::stepper::Stepper;
use crate::integrate::sdirk::tableau::Tableau;
use crate::newton::StoredFunction;
use crate::rounding::of_entries;
use crate::sparse::Csc;
use crate::union_find::UnionFind;

/// A capacitance between two unknowns, or to ground.
#[derive(Clone, Copy, Debug)]
struct Capacitor {
    ends: (usize, Option<usize>),
    value: f64,
}

/// What stores energy: capacitors, windings, stored functions.
struct Elements {
    capacitors: Vec<Capacitor>,
    /// rows of fluxes: the current, and its row of the storage matrix
    windings: Vec<(usize, Vec<(usize, f64)>)>,
    charges: Vec<StoredFunction>,
    /// part of the network to which each belongs
    part: Vec<usize>,
}

/// A period of the sources, and what has been exchanged within it.
struct Window {
    /// period [s], and when the next one begins
    period: f64,
    next: f64,
    /// begin of the run and of the step [s]
    start: f64,
    time: f64,
    /// least and largest energy of each element since the window began
    span: Vec<[f64; 2]>,
    /// largest energy exchanged in each part in the last period [J]
    exchanged: Vec<f64>,
}

/// Energy of an error: its linear and its quadratic coefficient for each unknown.
struct Worth {
    force: Vec<f64>,
    mass: Vec<f64>,
}

/// What is stored, what one part of it exchanges, and what errors of the trial step are worth.
pub struct Energies {
    elements: Elements,
    /// voltage and value of each stored function at the begin of the step
    last: Vec<[f64; 2]>,
    /// energy of each element there
    before: Vec<f64>,
    now: Vec<f64>,
    /// part of each unknown
    part_of: Vec<usize>,
    /// unknowns that are signals
    signal: Vec<bool>,
    /// the storage matrix and its diagonal
    stored: Csc,
    own: Vec<f64>,
    window: Window,
    /// the period, or what of it has been, by the length of the trial step
    share: f64,
    /// energy exchanged in each part with what this period has brought, and the trial step [J]
    reached: Vec<f64>,
    worth: Worth,
    /// scratch: charges and fluxes of the rates of a stage, what the step takes out of each part
    flow: Vec<f64>,
    taken: Vec<f64>,
}

/// A point as the trial step has it: unknowns, and functions behind the guards.
#[derive(Clone, Copy)]
pub struct Point<'a> {
    pub z: &'a [f64],
    pub f: &'a [f64],
}

impl Capacitor {
    fn voltage(&self, z: &[f64]) -> f64 {
        z[self.ends.0] - self.ends.1.map_or(0.0, |j| z[j])
    }
}

/// The elements of which a symmetric matrix between these unknowns is the sum.
fn capacitors(stored: &Csc, kinds: &[u8]) -> Vec<Capacitor> {
    let (mut found, mut sum, mut size) =
        (Vec::new(), vec![0.0; stored.nrows], vec![0.0f64; stored.nrows]);
    for (r, c, v) in stored.iter().filter(|e| kinds[e.0] == 0 && kinds[e.1] == 0 && e.2 != 0.0) {
        (sum[r], size[r]) = (sum[r] + v, size[r] + v.abs());
        if r < c {
            found.push(Capacitor { ends: (r, Some(c)), value: v.abs() });
        }
    }
    // row sums that are rounding are no capacitance to ground
    let rounding = of_entries(stored.nrows);
    let grounded = (0..stored.nrows).filter(|&j| f64::abs(sum[j]) > rounding * size[j]);
    found.extend(grounded.map(|j| Capacitor { ends: (j, None), value: f64::abs(sum[j]) }));
    found
}

/// Parts within which power flows, each by one of its unknowns or, behind these, pairs, and which unknowns are read elsewhere.
fn parts_and_signals(s: &Stepper, controls: &Csc) -> (Vec<usize>, Vec<bool>) {
    let linear = &s.solver.sys.linear;
    let (n, m, _) = linear.sizes();
    let mut together = UnionFind::new(n + m);
    let mut signal = vec![false; n];
    let mut join = |a: usize, b: usize| {
        if [a, b].iter().all(|&k| k >= n || !s.facts.fixed[k]) {
            together.join(a, b);
        }
    };
    // a law that reads an unknown whose own law it does not enter takes no power from there
    let back = linear.g.transpose();
    for (row, column, _) in linear.g.iter().filter(|e| e.2 != 0.0) {
        if back.get(row, column) != 0.0 {
            join(row, column);
        } else {
            signal[column] = true;
        }
    }
    controls.iter().for_each(|(_, column, _)| signal[column] = true);
    linear.e.iter().for_each(|(row, column, _)| join(row, column));
    linear.a.iter().for_each(|(row, pair, _)| join(row, n + pair));
    for (pair, column, _) in linear.b.iter().filter(|e| e.2 != 0.0) {
        signal[column] |= linear.a.get(column, pair) == 0.0;
    }
    for (rows, unknowns) in s.solver.smooth.iter().flat_map(|smooth| smooth.newton.reads()) {
        rows.windows(2).for_each(|pair| join(pair[0], pair[1]));
        unknowns.iter().for_each(|&j| signal[j] |= !rows.contains(&j));
    }
    s.switching.switches.iter().flat_map(|w| &w.control).for_each(|&(j, _)| signal[j] = true);
    ((0..n).map(|j| together.root(j)).collect(), signal)
}

impl Window {
    /// Takes notice of the energies of all elements, and of the parts to which these belong, at the begin of a step.
    fn note(&mut self, time: f64, energies: &[f64], parts: &[usize]) {
        self.time = time;
        if time >= self.next {
            self.next = time + self.period;
            self.exchanged.fill(0.0);
            for ([least, most], &part) in self.span.iter().zip(parts) {
                self.exchanged[part] = self.exchanged[part].max(most - least);
            }
            self.span.fill([f64::INFINITY, f64::NEG_INFINITY]);
        }
        for ([least, most], energy) in self.span.iter_mut().zip(energies) {
            (*least, *most) = (least.min(*energy), most.max(*energy));
        }
    }
}

impl Worth {
    /// That at a point, with the slopes of functions near there and the diagonal of the storage matrix.
    fn take(&mut self, elements: &Elements, own: &[f64], end: Point, slopes: &[f64]) {
        self.force.fill(0.0);
        for c in &elements.capacitors {
            let voltage = c.voltage(end.z).abs();
            for j in [Some(c.ends.0), c.ends.1].into_iter().flatten() {
                self.force[j] = self.force[j].max(own[j] * voltage);
            }
        }
        for &(j, _) in &elements.windings {
            self.force[j] = own[j] * end.z[j].abs();
        }
        self.mass.copy_from_slice(own);
        for q in &elements.charges {
            let voltage = q.voltage(end.z).abs();
            for &(j, slot) in &q.slopes {
                self.force[j] += (voltage * slopes[slot]).abs();
                self.mass[j] += (q.size * slopes[slot]).abs();
            }
        }
    }

    /// That of an error for each unit of it.
    fn of(&self, j: usize, error: f64) -> f64 {
        self.force[j] + 0.5 * self.mass[j] * error.abs()
    }
}

impl Energies {
    /// Finds what stores energy; nothing if nothing does.
    pub fn new(s: &Stepper) -> Option<Energies> {
        let linear = &s.solver.sys.linear;
        let n = linear.g.nrows;
        let [stored, controls] = linear.storage_and_controls();
        let (part_of, signal) = parts_and_signals(s, &controls);
        let rows = stored.transpose();
        let of_row = |j: usize| {
            let (index, values) = rows.col(j);
            index.iter().copied().zip(values.iter().copied()).collect::<Vec<_>>()
        };
        let fluxes = (0..n).filter(|&j| linear.row_kind[j] == 1 && stored.get(j, j) != 0.0);
        let windings: Vec<_> = fluxes.map(|j| (j, of_row(j))).collect();
        let capacitors = capacitors(&stored, &linear.row_kind);
        let charges: Vec<_> =
            s.solver.smooth.iter().flat_map(|smooth| smooth.newton.stored_functions()).collect();
        let places = capacitors.iter().map(|c| c.ends.0).chain(windings.iter().map(|w| w.0));
        let places = places.chain(charges.iter().map(|q| q.rows[0].0));
        let part: Vec<usize> = places.map(|j| part_of[j]).collect();
        let count = part.len();
        let periods = s.waveforms.iter().map(|w| w.period());
        (count > 0).then(|| Energies {
            own: (0..n).map(|j| stored.get(j, j).abs()).collect(),
            last: vec![[0.0; 2]; charges.len()],
            elements: Elements { capacitors, windings, charges, part },
            before: vec![0.0; count],
            now: vec![0.0; count],
            part_of,
            signal,
            window: Window {
                period: periods.fold(f64::INFINITY, f64::min),
                next: f64::NEG_INFINITY,
                start: 0.0,
                time: 0.0,
                span: vec![[f64::INFINITY, f64::NEG_INFINITY]; count],
                exchanged: vec![0.0; n + linear.a.ncols],
            },
            share: 1.0,
            reached: vec![0.0; n + linear.a.ncols],
            stored,
            flow: vec![0.0; n],
            taken: vec![0.0; n + linear.a.ncols],
            worth: Worth { force: vec![0.0; n], mass: vec![0.0; n] },
        })
    }

    /// Energies of all elements at a point, into `now`; of stored functions that since the begin of the run, by
    /// the trapezoidal rule over the steps.
    fn look(&mut self, at: Point) {
        let plain =
            self.elements.capacitors.iter().map(|c| 0.5 * c.value * c.voltage(at.z).powi(2));
        let flux = |row: &[(usize, f64)]| row.iter().map(|&(j, l)| l * at.z[j]).sum::<f64>();
        let wound = self.elements.windings.iter().map(|(j, row)| 0.5 * at.z[*j] * flux(row));
        let linear = self.elements.capacitors.len() + self.elements.windings.len();
        let functions = self.elements.charges.iter().zip(&self.last).zip(&self.before[linear..]);
        let kept = functions.map(|((q, last), before)| {
            before + 0.5 * (last[0] + q.voltage(at.z)) * (at.f[q.function] - last[1])
        });
        let all = plain.chain(wound).chain(kept);
        self.now.iter_mut().zip(all).for_each(|(now, energy)| *now = energy);
    }

    /// Takes notice of the state at the begin of a step.  Over what has jumped since the last one stored functions
    /// are integrated along a line.
    pub fn note(&mut self, at: Point, time: f64) {
        if self.window.next == f64::NEG_INFINITY {
            self.begin_with(at);
            self.window.start = time;
        }
        self.look(at);
        std::mem::swap(&mut self.before, &mut self.now);
        self.begin_with(at);
        self.window.note(time, &self.before, &self.elements.part);
    }

    fn begin_with(&mut self, at: Point) {
        for (last, q) in self.last.iter_mut().zip(&self.elements.charges) {
            *last = [q.voltage(at.z), at.f[q.function]];
        }
    }

    /// Prepares for the errors of a step that ends at a point, with the slopes of functions near there and how many
    /// times farther the motion may go on.
    pub fn weigh(&mut self, end: Point, slopes: &[f64], ahead: f64, length: f64) {
        self.look(end);
        let (window, elements) = (&self.window, &self.elements);
        let seen = (window.time - window.start) + length;
        self.share = window.period.min(seen) / length;
        self.reached.copy_from_slice(&window.exchanged);
        let moved = self.now.iter().zip(&self.before).zip(&window.span);
        for (((now, before), span), &part) in moved.zip(&elements.part) {
            let swing = now.max(span[1]) - now.min(span[0]) + ahead * (now - before).abs();
            self.reached[part] = self.reached[part].max(swing);
        }
        self.worth.take(elements, &self.own, end, slopes);
    }

    /// The largest energy, by what is exchanged, that a step of this method takes out of a part itself: with the rates
    /// `k_i` of its stages that is `h^2/2 sum m_ij k_i' E k_j`, `m_ij = b_i a_ij + b_j a_ji - b_i b_j` (Hairer and
    /// Wanner, section IV.12).  A spike that the stages miss shows here: its estimated error is smoothed away.
    pub fn taken(&mut self, tableau: &Tableau, length: f64, rates: &[Vec<f64>]) -> f64 {
        let n = self.own.len();
        self.taken.fill(0.0);
        for (j, rate) in rates.iter().enumerate() {
            self.flow.fill(0.0);
            self.stored.mul_add(1.0, &rate[..n], &mut self.flow);
            for (i, other) in rates.iter().enumerate() {
                let weight = 0.5 * length * length * tableau.algebraic(i, j);
                for ((a, b), &part) in other.iter().zip(&self.flow).zip(&self.part_of) {
                    self.taken[part] += weight * a * b;
                }
            }
        }
        let ratios = self.taken.iter().zip(&self.reached).filter(|e| *e.0 != 0.0);
        ratios.map(|(taken, reached)| taken.abs() / reached).fold(0.0, f64::max)
    }

    /// What an error of an unknown with this range is measured by in the trial step: that which would be worth the
    /// energy exchanged if it were as large as the `error` at hand for each unit, and no more than moves the mean over
    /// a period by the range.
    pub fn size(&self, j: usize, error: f64, range: f64) -> f64 {
        if self.signal[j] {
            return range;
        }
        let worth = self.worth.of(j, error);
        let energy = self.reached[self.part_of[j]];
        let size = if worth > 0.0 { energy / worth } else { 0.0 };
        size.min(self.share * range)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_is_read_as_capacitors() {
        // 3 F between two nodes, 2 F from the first to ground, an inductance of 7 H
        let stored = [(0, 0, 5.0), (0, 1, -3.0), (1, 0, -3.0), (1, 1, 3.0), (2, 2, 7.0)];
        let found = capacitors(&Csc::from_triplets(3, 3, &stored), &[0, 0, 1]);
        let list: Vec<_> = found.iter().map(|c| (c.ends, c.value)).collect();
        assert_eq!(list, [((0, Some(1)), 3.0), ((0, None), 2.0)]);
        assert_eq!(found[0].voltage(&[5.0, 1.0, 9.0]), 4.0);
        assert_eq!(found[1].voltage(&[5.0, 1.0, 9.0]), 5.0);
    }
}

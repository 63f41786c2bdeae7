//! The equations of a mode over a step, factorised: what rounding makes of a combination of unknowns is a solution with
//! their transpose ([`super::forward`]).
//!
//! A pair that conducts has the row of its slack, any other its multiplier alone.  The order of elimination is that of
//! all entries of all modes; those that a mode does not have would fill its factors, and are left out.

use super::matrix::Entries;
use crate::linear::{ordering, Factor};
use crate::sparse::{Csc, Ordering};
use std::sync::Arc;

/// An entry: its place in the matrix, and its value.
type Placed = (usize, f64);

/// The equations of a step of one length.
pub(super) struct Probe {
    /// with all entries of all modes, and with those of the present one
    all: Csc,
    matrix: Csc,
    ordering: Arc<Ordering>,
    factor: Option<Factor>,
    /// what is stored, what is not, and the places of each pair: slack, and multiplier
    stored: Vec<Placed>,
    acting: Vec<Placed>,
    slacks: Vec<(usize, Placed)>,
    alone: Vec<usize>,
    /// of each equation
    scale: Vec<f64>,
    /// reciprocal of the length [1/s]
    pub rate: f64,
}

impl Probe {
    /// Of the matrices `E`, `G`, `A`, `B` and `D`.
    pub fn new(n: usize, m: usize, [e, g, a, b, d]: [&Entries; 5]) -> Probe {
        let stored: Vec<_> = e.entries().collect();
        let multipliers = a.entries().map(|(row, pair, v)| (row, n + pair, v));
        let acting: Vec<_> = g.entries().chain(multipliers).collect();
        let voltages = b.entries().map(|(pair, column, v)| (n + pair, column, -v));
        let series = d.entries().map(|(pair, other, v)| (n + pair, n + other, v));
        let slacks: Vec<_> = voltages.chain(series).collect();
        let alone: Vec<_> = (0..m).map(|pair| (n + pair, n + pair, 1.0)).collect();
        let all = [&stored[..], &acting, &slacks, &alone].concat();
        let all = Csc::from_triplets(n + m, n + m, &all);
        let place = |&(row, column, value): &(usize, usize, f64)| -> Placed {
            let rows = all.col(column).0;
            (all.colptr[column] + rows.partition_point(|&other| other < row), value)
        };
        Probe {
            stored: stored.iter().map(place).collect(),
            acting: acting.iter().map(place).collect(),
            slacks: slacks.iter().map(|entry| (entry.0 - n, place(entry))).collect(),
            alone: alone.iter().map(|entry| place(entry).0).collect(),
            ordering: Arc::new(ordering(&all, 0)),
            factor: None,
            scale: vec![0.0; n + m],
            rate: 0.0,
            matrix: Csc::zeros(n + m, n + m),
            all,
        }
    }

    /// Factorises the equations of a mode, given by which pairs conduct, over a step of the length `1 / rate`.
    pub fn set(&mut self, rate: f64, conducts: &[bool]) {
        self.rate = rate;
        let values = &mut self.all.values;
        values.fill(0.0);
        self.stored.iter().for_each(|&(place, v)| values[place] += rate * v);
        self.acting.iter().for_each(|&(place, v)| values[place] += v);
        let slacks = self.slacks.iter().filter(|slack| conducts[slack.0]);
        slacks.for_each(|&(_, (place, v))| values[place] += v);
        let others = self.alone.iter().zip(conducts).filter(|pair| !*pair.1);
        others.for_each(|(&place, _)| values[place] = 1.0);
        self.scale.fill(0.0);
        for (&row, v) in self.all.rowidx.iter().zip(&*values) {
            self.scale[row] = self.scale[row].max(v.abs());
        }
        self.scale.iter_mut().for_each(|s| *s = if *s > 0.0 { 1.0 / *s } else { 1.0 });
        let Csc { colptr, rowidx, values, .. } = &mut self.matrix;
        rowidx.clear();
        values.clear();
        for (column, end) in colptr[1..].iter_mut().enumerate() {
            let (rows, entries) = self.all.col(column);
            for (&row, v) in rows.iter().zip(entries).filter(|entry| *entry.1 != 0.0) {
                rowidx.push(row);
                values.push(self.scale[row] * v);
            }
            *end = rowidx.len();
        }
        let factor = self.factor.get_or_insert_with(|| {
            let mut factor = Factor::new(&self.matrix, &self.ordering);
            // what no equation determines is taken as it is
            factor.set_hold(1.0);
            factor
        });
        factor.factor(&self.matrix);
    }

    /// `y := K^-T y`, zero where that is not possible.
    pub fn solve(&self, y: &mut [f64]) {
        let mut work = vec![0.0; y.len()];
        let solved = self.factor.as_ref().map(|factor| factor.solve_transposed(y, &mut work));
        if !matches!(solved, Some(Ok(()))) {
            y.fill(0.0);
        }
        y.iter_mut().zip(&self.scale).for_each(|(y, scale)| *y *= scale);
    }
}

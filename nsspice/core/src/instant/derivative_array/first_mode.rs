//! A mode to begin with, where signs and rates lead from the last one nowhere.

use super::{DerivativeArray, Moment};
use crate::dense::Matrix;
use crate::descriptor::Linear;
use crate::mlcp::{Driver, Problem, Role, Start};
use crate::newton::Newton;
use crate::sparse::Csc;
use crate::tape::Linearisation;

impl DerivativeArray {
    /// The mode of the complementarity problem of all laws in which nothing is stored, to first order.
    pub(super) fn propose(
        &mut self,
        linear: &Linear,
        newton: &mut Option<&mut Newton>,
        [z, _]: [&[f64]; 2],
        at: &Moment,
    ) -> bool {
        if !at.roles.contains(&Role::Diode) {
            return false;
        }
        self.z.copy_from_slice(z);
        self.l.fill(0.0);
        self.linearise(linear, newton, z, at, Linearisation::Exact);
        let (mut conducting, mut b) = (self.conducting.clone(), self.b.clone());
        [&mut conducting, &mut b].into_iter().for_each(|matrix| self.combine_columns(matrix));
        let rest: Vec<usize> = (0..self.n).filter(|&j| !self.stored[j]).collect();
        let sparse = |matrix: &Matrix, rows: &[usize], columns: &[usize]| {
            let all = rows.iter().enumerate().flat_map(|(i, &r)| {
                columns.iter().enumerate().map(move |(j, &c)| (i, j, matrix[(r, c)]))
            });
            let entries: Vec<_> = all.filter(|e| e.2 != 0.0).collect();
            Csc::from_triplets(rows.len(), columns.len(), &entries)
        };
        let pairs: Vec<usize> = (0..self.m).collect();
        let mut driver = Driver::new(Problem {
            k: sparse(&conducting, &rest, &rest),
            a: sparse(&self.a, &rest, &pairs),
            b: sparse(&b, &pairs, &rest),
            d: linear.d.clone(),
            row_kind: rest.iter().map(|&j| linear.row_kind[j]).collect(),
        });
        let flow = self.in_basis(self.flow.clone());
        let right: Vec<f64> = rest.iter().map(|&j| flow[j]).collect();
        let (mut y, mut l) = (vec![0.0; rest.len()], vec![0.0; self.m]);
        let found = driver.solve(&right, &self.slack, at.roles, &mut y, &mut l, Start::Cold);
        let differs = found.is_ok() && driver.active() != self.active;
        if differs {
            self.active.copy_from_slice(driver.active());
        }
        differs
    }
}

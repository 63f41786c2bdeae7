//! The choice among values that the laws leave undetermined: those of least norm.

use crate::dense::{Lu, Matrix};
use crate::modewise::modes::error_carrying::Tracked;
use crate::modewise::modes::guard_rows::impulse_rows;
use crate::modewise::modes::network::Network;
use crate::rounding::OF_SOLUTION;

/// How undetermined directions are chosen: least multipliers and slacks (equal sharing), and among
/// those the least unknowns.
pub(in crate::modewise) struct Share {
    /// amounts = first * guards + second * unknowns
    first: Matrix,
    second: Matrix,
}

impl Share {
    pub fn new(net: &Network, on: &[bool], active: &[usize], open: &Matrix) -> Share {
        let k = net.kernel.cols;
        let directions = Tracked::exact(open.clone());
        let still = Tracked::zeros(net.states, open.cols);
        let mut seen = impulse_rows(net, on, active, &still, &directions);
        seen.clean(net.n + net.m);
        let seen = seen.value; // m x open
        let part: Vec<usize> = (0..k).collect();
        let on_unknowns = net.kernel.times(&open.select_rows(&part)); // n x open

        // directions that some pair sees, and combinations that none sees
        let split = crate::dense::Echelon::new(seen.clone(), 0..open.cols);
        let (visible, hidden) = (split.pivots.clone(), split.kernel());
        let least = |m: &Matrix| {
            // -(m' m)^-1 m'
            let gram = Lu::new(&m.transpose_times(m));
            let mut out = gram.solve(&m.transpose());
            out.data.iter_mut().for_each(|v| *v = -*v);
            out
        };
        let small = least(&seen.select_cols(&visible));
        let mut first = Matrix::zeros(open.cols, net.m);
        for (i, &c) in visible.iter().enumerate() {
            first.row_mut(c).copy_from_slice(small.row(i));
        }
        let hidden_unknowns = on_unknowns.times(&hidden);
        let moves = hidden_unknowns.max_abs() > 0.0;
        let second = if hidden.cols > 0 && moves {
            let tall = hidden_unknowns.clone();
            let gram = tall.transpose_times(&tall);
            if Lu::new(&gram).ratio > OF_SOLUTION {
                hidden.times(&least(&tall))
            } else {
                Matrix::zeros(open.cols, net.n)
            }
        } else {
            Matrix::zeros(open.cols, net.n)
        };
        // the second step starts from unknowns that the first has moved
        let moved = second.times(&on_unknowns.times(&first));
        first.add_scaled(1.0, &moved);
        Share { first, second }
    }

    pub fn amounts(&self, guards: &Tracked, unknowns: &Tracked) -> Tracked {
        let mut out = guards.under(&self.first);
        out.add(1.0, &unknowns.under(&self.second));
        out
    }
}

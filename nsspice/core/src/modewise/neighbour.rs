//! A mode from one that differs in a single pair.
//!
//! Let `d` be what disturbs the pairs (the multiplier of an inactive one, the slack of an active one)
//! and `y` what answers (slack and multiplier). A mode maps `[x; v; d]` to `[x'; y]`; exchanging `d_p`
//! and `y_p` of one pair is a pivot of that map. In reciprocal networks with one kind of storage the
//! column of `x'` is, but for its sign, the row of `y_p`, so that the state matrix changes by a
//! symmetric matrix of rank one and its eigenvectors follow by [`RankOne`].

use super::guard_rows::impulse_rows;
use super::mode::{GuardSize, Mode, Rows, Watch};
use super::network::Network;
use super::spectrum::Pole;
use super::tracked::Tracked;
use crate::dense::{norm, Matrix, RankOne};

/// Updates in a row before a mode is reduced from the network again: their rounding adds up.
const GENERATIONS: u32 = 200;
/// A pivot or a row that has lost more than this part of its size to cancellation is not used.
const LOST: f64 = 1e-3;

/// How guards and kernel unknowns answer to a disturbance of each pair.
pub struct Ports {
    /// one row per guard, then per kernel unknown; one column per pair
    answer: Matrix,
    /// updates since the network was last reduced
    generation: u32,
}

impl Ports {
    /// Of a mode without constraints and open directions; `inverse` is that of its algebraic block.
    pub(super) fn new(net: &Network, on: &[bool], active: &[usize], inverse: &Matrix) -> Ports {
        let k = net.kernel.cols;
        let mut right = Matrix::zeros(k + active.len(), net.m);
        for p in (0..net.m).filter(|&p| !on[p]) {
            for i in 0..k {
                right[(i, p)] = -net.na[(i, p)];
            }
        }
        for (i, &p) in active.iter().enumerate() {
            right[(k + i, p)] = 1.0;
        }
        let algebraic = Tracked::exact(inverse.times(&right));
        let still = Tracked::zeros(net.states, net.m);
        let mut guards = impulse_rows(net, on, active, &still, &algebraic).value;
        for p in (0..net.m).filter(|&p| !on[p]) {
            guards[(p, p)] += net.d[(p, p)];
        }
        let kernel: Vec<usize> = (0..k).collect();
        Ports { answer: guards.above(&algebraic.value.select_rows(&kernel)), generation: 0 }
    }

    /// Numbers held.
    pub(super) fn len(&self) -> usize {
        self.answer.data.len()
    }

    /// The same after the exchange of one pair; `None` if too many digits are lost.
    fn exchanged(&self, p: usize) -> Option<Ports> {
        let mut answer = self.answer.clone();
        let pairs = answer.cols;
        let pivot = answer[(p, p)];
        if pivot <= 0.0 || !pivot.is_finite() || self.generation >= GENERATIONS {
            return None;
        }
        let f = 1.0 / pivot;
        let row: Vec<f64> = answer.row(p).to_vec();
        for i in (0..answer.rows).filter(|&i| i != p) {
            let own = answer[(i, p)];
            if own == 0.0 {
                continue;
            }
            let before = if i < pairs { answer[(i, i)] } else { 0.0 };
            let target = answer.row_mut(i);
            crate::dense::add_scaled(target, -own * f, &row);
            target[p] = own * f;
            if i < pairs && target[i].abs() < LOST * before.abs() {
                return None;
            }
        }
        answer.row_mut(p).iter_mut().zip(&row).for_each(|(t, v)| *t = -f * v);
        answer[(p, p)] = f;
        Some(Ports { answer, generation: self.generation + 1 })
    }
}

impl Mode {
    /// This mode with one pair turned over; `None` if it has to be reduced from the network.
    pub fn neighbour(&self, net: &Network, p: usize) -> Option<Mode> {
        let ports = self.ports.as_ref()?;
        let next = ports.exchanged(p)?;
        let f = 1.0 / ports.answer[(p, p)];
        let was_on = self.active.binary_search(&p).is_ok();
        // the column of x' is this times the row
        let sign = if was_on == net.inductive { -1.0 } else { 1.0 };
        let row = self.guards.x.row(p).to_vec();
        let source = self.guards.v.row(p).to_vec();
        let rates: Vec<f64> = self.poles.iter().map(|pole| pole.alpha).collect();
        let turn = RankOne::new(&rates, sign * f, &row)?;

        let mut drive = self.drive.clone();
        for (i, x) in row.iter().enumerate() {
            crate::dense::add_scaled(drive.row_mut(i), sign * f * x, &source);
        }
        let mut drive = drive.transpose();
        turn.turn(&mut drive);
        let k = net.kernel.cols;
        let kernel: Vec<usize> = (0..k).collect();
        let mut guards = Rows {
            x: self.guards.x.above(&self.algebraic.x.select_rows(&kernel)),
            v: self.guards.v.above(&self.algebraic.v.select_rows(&kernel)),
            d: self.guards.d.clone(),
        };
        let mut sizes = self.sizes.clone();
        let own = sizes[p].bound;
        for i in (0..guards.x.rows).filter(|&i| i != p) {
            let factor = -f * ports.answer[(i, p)];
            if factor != 0.0 {
                crate::dense::add_scaled(guards.x.row_mut(i), factor, &row);
                crate::dense::add_scaled(guards.v.row_mut(i), factor, &source);
            }
            if let Some(size) = sizes.get_mut(i) {
                size.bound += factor.abs() * own;
            }
        }
        for rows in [&mut guards.x, &mut guards.v] {
            rows.row_mut(p).iter_mut().for_each(|v| *v *= -f);
        }
        sizes[p].bound *= f;
        turn.turn(&mut guards.x);
        let pairs: Vec<usize> = (0..net.m).collect();
        let bottom: Vec<usize> = (net.m..net.m + k).collect();
        let rows = |x: &Matrix, which: &[usize]| x.select_rows(which);
        for (i, size) in sizes.iter_mut().enumerate() {
            *size = GuardSize { x: norm(guards.x.row(i)), bound: size.bound };
            if size.x < LOST * size.bound {
                return None;
            }
        }
        let mut active = self.active.clone();
        match active.binary_search(&p) {
            Ok(at) => drop(active.remove(at)),
            Err(at) => active.insert(at, p),
        }
        let unknowns: Vec<usize> = bottom.iter().chain(&active).copied().collect();
        let algebraic = Rows {
            x: rows(&guards.x, &unknowns),
            v: rows(&guards.v, &unknowns),
            d: Matrix::zeros(unknowns.len(), guards.d.cols),
        };
        let guards = Rows { x: rows(&guards.x, &pairs), v: rows(&guards.v, &pairs), d: guards.d };
        let mut slack = self.slack.clone();
        slack[p] = was_on;
        let mut leave_x = self.leave_x.clone();
        turn.turn(&mut leave_x);
        let poles: Vec<Pole> = (turn.values.iter().enumerate())
            .map(|(at, &alpha)| Pole { at, alpha, omega: 0.0 })
            .collect();
        Some(Mode {
            active,
            gates: self.gates.clone(),
            n: self.n,
            fastest: poles.iter().map(Pole::size).fold(0.0, f64::max),
            poles,
            enter: leave_x.transpose(),
            drive: drive.transpose(),
            leave_x,
            leave_v: self.leave_v.clone(),
            algebraic,
            guards,
            watch: (0..net.m).map(Watch::Pair).collect(),
            slack,
            direct: Vec::new(),
            sizes,
            consistency: self.consistency.clone(),
            consistency_bound: self.consistency_bound.clone(),
            impulses: None,
            open: 0,
            plain: None,
            ports: Some(next),
        })
    }
}

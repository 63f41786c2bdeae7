//! A mode from one that differs in a single pair.
//!
//! Where every active pair has a series resistance, `l = (B z - q) / D` leaves the kernel unknowns alone
//! as algebra, a small system in which conductances only add up. Let `w` be the slack's row of the pair
//! that is turned over, taken where it is inactive, and `rho` the resistance that the pair sees there.
//! In reciprocal networks with one kind of storage the state matrices of the two modes differ by
//! `w' w / rho`, a symmetric matrix of rank one, and the eigenvectors follow by [`RankOne`]; slow rates
//! keep their digits beside fast ones, which a decomposition of the whole matrix cannot offer.

use super::mode::{GuardSize, Mode, Rows, Watch};
use super::network::Network;
use super::spectrum::Pole;
use super::tracked::Tracked;
use crate::dense::{add_scaled, dot, norm, Lu, Matrix, RankOne};

/// Updates in a row, beyond twice the number of pairs, before a mode is made afresh: the vectors lose
/// their orthogonality one rounding after the other.
const GENERATIONS: usize = 400;

/// Algebra of the kernel unknowns: its inverse, in a mode whose active pairs are conductances.
fn kernel_inverse(net: &Network, active: &[usize]) -> Option<Matrix> {
    let mut algebra = net.ngn.clone();
    for &p in active {
        let conductance = 1.0 / net.d[(p, p)];
        if !conductance.is_finite() {
            return None;
        }
        for i in 0..algebra.rows {
            let f = net.na[(i, p)] * conductance;
            if f != 0.0 {
                add_scaled(algebra.row_mut(i), f, net.bn.row(p));
            }
        }
    }
    let factor = Lu::new(&algebra);
    let unit = Matrix::identity(algebra.rows);
    (factor.ratio > 0.0).then(|| factor.solve_refined(&algebra, &unit))
}

/// Rows over `[a | v]` of a mode.
struct Answers {
    guards: Tracked,
    kernel: Tracked,
    drive: Matrix,
}

impl Answers {
    fn new(net: &Network, active: &[usize]) -> Option<Answers> {
        let (k, n, nv) = (net.kernel.cols, net.states, net.rs.cols);
        let beside = |a: &Matrix, v: &Matrix| Tracked::exact(a.beside(v));
        let mut right = beside(&net.ngr, &net.ns);
        for i in 0..k {
            right.value.row_mut(i)[..n].iter_mut().for_each(|x| *x = -*x);
        }
        for &p in active {
            for i in 0..k {
                let f = net.na[(i, p)] / net.d[(p, p)];
                if f != 0.0 {
                    add_scaled(&mut right.value.row_mut(i)[..n], -f, net.br.row(p));
                    for (b, x) in right.bound.row_mut(i).iter_mut().zip(net.br.row(p)) {
                        *b += (f * x).abs();
                    }
                    right.value[(i, n)] += f * net.q[p];
                    right.bound[(i, n)] += (f * net.q[p]).abs();
                }
            }
        }
        let kernel = right.under(&kernel_inverse(net, active)?);
        // slacks, and for active pairs what they would be without the series resistance
        let mut guards = kernel.under(&net.bn);
        for i in 0..net.m {
            let scale = match active.binary_search(&i) {
                Ok(_) => 1.0 / net.d[(i, i)],
                Err(_) => -1.0,
            };
            let (value, bound) = (guards.value.row_mut(i), guards.bound.row_mut(i));
            for ((v, b), x) in value.iter_mut().zip(&mut *bound).zip(net.br.row(i)) {
                *v += x;
                *b += x.abs();
            }
            value[n] -= net.q[i];
            bound[n] += net.q[i].abs();
            value.iter_mut().for_each(|v| *v *= scale);
            bound.iter_mut().for_each(|b| *b *= scale.abs());
        }
        guards.clean(net.n + net.m);
        let mut drive = net.rs.clone();
        drive.add_scaled(-1.0, &net.rgn.times(&kernel.value.columns(n, nv)));
        let inflow = guards.value.select_rows(active).columns(n, nv);
        drive.add_scaled(-1.0, &net.ra.select_cols(active).times(&inflow));
        Some(Answers { guards, kernel, drive })
    }
}

impl Mode {
    /// This mode with one pair turned over; `None` if it has to be reduced from the network.
    pub fn neighbour(&self, net: &Network, p: usize) -> Option<Mode> {
        let generation = self.generation?;
        if generation >= GENERATIONS + 2 * net.m {
            return None;
        }
        let mut active = self.active.clone();
        let was_on = match active.binary_search(&p) {
            Ok(at) => {
                active.remove(at);
                true
            }
            Err(at) => {
                active.insert(at, p);
                false
            }
        };
        let answers = Answers::new(net, &active)?;
        // the resistance that the pair sees, from the mode in which it is inactive
        let seen = kernel_inverse(net, if was_on { &active } else { &self.active })?;
        let mut injected = vec![0.0; seen.rows];
        seen.apply(&net.na.col(p), &mut injected);
        let resistance = net.d[(p, p)] + dot(net.bn.row(p), &injected);
        if resistance <= 0.0 || !resistance.is_finite() {
            return None;
        }
        let change = if was_on { resistance } else { -1.0 / resistance };
        let change = if net.inductive { -change } else { change };
        let rates: Vec<f64> = self.poles.iter().map(|pole| pole.alpha).collect();
        let turn = RankOne::new(&rates, change, self.guards.x.row(p))?;
        let mut leave_x = self.leave_x.clone();
        turn.turn(&mut leave_x);
        let enter = leave_x.transpose();

        let n = self.n;
        let nv = net.rs.cols;
        let sizes: Vec<GuardSize> = (0..net.m)
            .map(|i| GuardSize {
                x: norm(&answers.guards.value.row(i)[..n]),
                bound: norm(&answers.guards.bound.row(i)[..n]),
            })
            .collect();
        if (0..net.m).any(|i| answers.guards.value.row(i).iter().all(|v| *v == 0.0)) {
            return None;
        }
        let rows = |t: &Matrix| Rows {
            x: t.columns(0, n).product(&leave_x),
            v: t.columns(n, nv),
            d: Matrix::zeros(t.rows, nv),
        };
        let (guards, kernel) = (rows(&answers.guards.value), rows(&answers.kernel.value));
        let algebraic = Rows {
            x: kernel.x.above(&guards.x.select_rows(&active)),
            v: kernel.v.above(&guards.v.select_rows(&active)),
            d: Matrix::zeros(kernel.x.rows + active.len(), nv),
        };
        let mut slack = self.slack.clone();
        slack[p] = was_on;
        let poles: Vec<Pole> = (turn.values.iter().enumerate())
            .map(|(at, &alpha)| Pole { at, alpha, omega: 0.0 })
            .collect();
        Some(Mode {
            active,
            gates: self.gates.clone(),
            n,
            fastest: poles.iter().map(Pole::size).fold(0.0, f64::max),
            poles,
            drive: answers.drive.transpose().product(&leave_x).transpose(),
            enter,
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
            generation: Some(generation + 1),
        })
    }
}

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
use super::tracked::{negligible, Tracked};
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

/// What the kernel unknowns answer to `[a | v]`.
fn kernel_answers(net: &Network, active: &[usize]) -> Option<Tracked> {
    let (k, n) = (net.kernel.cols, net.states);
    let mut right = Tracked::exact(net.ngr.beside(&net.ns));
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
    Some(right.under(&kernel_inverse(net, active)?))
}

/// Guards in modal coordinates: slacks, and for active pairs what they would be without the series
/// resistance, over it. `None` if some guard vanishes identically.
fn guards(
    net: &Network,
    active: &[usize],
    kernel: &Tracked,
    kernel_x: &Matrix,
    leave_x: &Matrix,
) -> Option<(Rows, Vec<GuardSize>)> {
    let (k, n, nv) = (net.kernel.cols, net.states, net.rs.cols);
    let reach: Vec<f64> = (0..k).map(|i| norm(&kernel.bound.row(i)[..n])).collect();
    let mut rows = Rows {
        x: net.steps.as_ref()?.product(leave_x),
        v: Matrix::zeros(net.m, nv),
        d: Matrix::zeros(net.m, nv),
    };
    let mut sizes = Vec::with_capacity(net.m);
    let mut bound_v = vec![0.0; nv];
    for i in 0..net.m {
        let (x, v) = (rows.x.row_mut(i), rows.v.row_mut(i));
        let mut bound_x = norm(net.br.row(i));
        v[0] = -net.q[i];
        bound_v.fill(0.0);
        bound_v[0] = net.q[i].abs();
        for (j, &f) in net.bn.row(i).iter().enumerate().filter(|f| *f.1 != 0.0) {
            add_scaled(x, f, kernel_x.row(j));
            add_scaled(v, f, &kernel.value.row(j)[n..]);
            add_scaled(&mut bound_v, f.abs(), &kernel.bound.row(j)[n..]);
            bound_x += f.abs() * reach[j];
        }
        let scale = match active.binary_search(&i) {
            Ok(_) => 1.0 / net.d[(i, i)],
            Err(_) => -1.0,
        };
        x.iter_mut().for_each(|x| *x *= scale);
        let tiny = negligible(net.n + net.m);
        for (v, b) in v.iter_mut().zip(&bound_v) {
            *v = if v.abs() <= tiny * b { 0.0 } else { scale * *v };
        }
        // the vectors are orthonormal: the norm is that over the energy coordinates
        let size = GuardSize { x: norm(x), bound: scale.abs() * bound_x };
        if size.x <= tiny * size.bound && v.iter().all(|v| *v == 0.0) {
            return None;
        }
        sizes.push(size);
    }
    Some((rows, sizes))
}

/// The drive of the modal coordinates by v.
fn drive(
    net: &Network,
    active: &[usize],
    kernel: &Tracked,
    inflow: &Matrix,
    leave_x: &Matrix,
) -> Matrix {
    let (n, nv) = (net.states, net.rs.cols);
    let mut drive = net.rs.clone();
    drive.add_scaled(-1.0, &net.rgn.times(&kernel.value.columns(n, nv)));
    let mut drive = drive.transpose();
    for &p in active {
        for (c, &f) in inflow.row(p).iter().enumerate().filter(|f| *f.1 != 0.0) {
            // R' A = (B R)' in a reciprocal network
            add_scaled(drive.row_mut(c), -f, net.br.row(p));
        }
    }
    drive.product(leave_x).transpose()
}

impl Mode {
    /// This mode with one pair turned over; `None` if it has to be reduced from the network. `turn` is
    /// work space.
    pub fn neighbour(&self, net: &Network, p: usize, turn: &mut RankOne) -> Option<Mode> {
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
        let kernel = kernel_answers(net, &active)?;
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
        turn.decompose(&rates, change, self.guards.x.row(p))?;
        let leave_x = turn.turned(&self.leave_x);
        let (n, nv) = (self.n, net.rs.cols);
        let kernel_x = kernel.value.columns(0, n).product(&leave_x);
        let (guards, sizes) = guards(net, &active, &kernel, &kernel_x, &leave_x)?;
        let algebraic = Rows {
            v: kernel.value.columns(n, nv),
            d: Matrix::zeros(kernel_x.rows, nv),
            x: kernel_x,
        };
        let mut slack = self.slack.clone();
        slack[p] = was_on;
        let poles: Vec<Pole> = (turn.values.iter().enumerate())
            .map(|(at, &alpha)| Pole { at, alpha, omega: 0.0 })
            .collect();
        Some(Mode {
            gates: self.gates.clone(),
            n,
            fastest: poles.iter().map(Pole::size).fold(0.0, f64::max),
            poles,
            drive: drive(net, &active, &kernel, &guards.v, &leave_x),
            active,
            enter: None,
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
            blocks: Vec::new(),
            generation: Some(generation + 1),
        })
    }
}

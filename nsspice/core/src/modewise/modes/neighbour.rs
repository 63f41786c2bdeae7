//! A mode from one that differs in a single pair.
//!
//! Where every active pair has a series resistance, the kernel unknowns and the multipliers that they
//! see are a small system of their own; the others are `l = (B z - q) / D`. Let `w` be the slack's row of the pair
//! that is turned over, taken where it is inactive, and `rho` the resistance that the pair sees there.
//! In reciprocal networks with one kind of storage the state matrices of the two modes differ by
//! `w' w / rho`, a symmetric matrix of rank one, and the eigenvectors follow by [`RankOne`]; slow rates
//! keep their digits next to fast ones, which a decomposition of the whole matrix cannot offer.

use crate::dense::{add_scaled, dot, norm, Lu, Matrix, RankOne};
use crate::modewise::modes::error_carrying::{negligible, Tracked};
use crate::modewise::modes::mode::{GuardSize, Guards, Mode, Rows, Watch};
use crate::modewise::modes::network::Network;
use crate::modewise::modes::staircase::Algebra;
use crate::modewise::spectra::spectrum::Pole;

/// Updates in a row, beyond twice the number of pairs, before a mode is made afresh: the vectors lose
/// their orthogonality one rounding after the other.
const GENERATIONS: usize = 400;

/// Part of the fastest rate that has to be left of a rate that a diode's opening slows down: what is
/// left of a faster one is what its rounding leaves.  No test distinguishes a decade more or less.
const LEFT: f64 = 1e-3;
/// Multipliers up to which they are unknowns in addition to those of the kernel.
const UNKNOWNS: usize = 16;
/// States up to which such a mode is made afresh instead, which costs little there.
const SMALL: usize = 24;

/// What is algebraic in a mode whose active pairs have series resistances.
struct Kernel {
    /// active pairs that kernel unknowns see
    touching: Vec<usize>,
    /// what the kernel unknowns and these multipliers answer to `[a | v]`
    answers: Tracked,
}

/// The joint algebra of the kernel unknowns and of the multipliers they see.
struct Joint {
    /// active pairs that are unknowns
    touching: Vec<usize>,
    matrix: Matrix,
    factor: Lu,
    /// right-hand sides by `[a | v]`
    right: Tracked,
}

/// Whether kernel unknowns see a pair.
fn touches(net: &Network, p: usize) -> bool {
    net.split.bn.row(p).iter().any(|v| *v != 0.0)
}

impl Joint {
    /// As unknowns in addition to the voltages the multipliers keep their digits; as conductances, which
    /// costs less where there are many, they are differences of the large currents that small
    /// resistances carry.
    fn new(net: &Network, active: &[usize]) -> Option<Joint> {
        if active.iter().any(|&p| net.d[(p, p)] == 0.0) {
            return None;
        }
        let mut touching: Vec<usize> =
            active.iter().copied().filter(|&p| touches(net, p)).collect();
        let mut conducting = Vec::new();
        if touching.len() > UNKNOWNS {
            std::mem::swap(&mut touching, &mut conducting);
        }
        let (k, n, nv) = (net.kernel.cols, net.states, net.rs.cols);
        let Algebra { mut knn, kna, .. } = Algebra::new(net, &touching);
        let mut right = Tracked::exact(Matrix::from_fn(knn.rows, n + nv, |i, c| match i < k {
            _ if c < n => -kna[(i, c)],
            true => net.ns[(i, c - n)],
            false => -net.q[(touching[i - k], c - n)],
        }));
        for &p in &conducting {
            for i in 0..k {
                let f = net.split.na[(i, p)] / net.d[(p, p)];
                if f != 0.0 {
                    add_scaled(&mut knn.row_mut(i)[..k], f, net.split.bn.row(p));
                    add_scaled(&mut right.value.row_mut(i)[..n], -f, net.split.br.row(p));
                    for (b, x) in right.bound.row_mut(i).iter_mut().zip(net.split.br.row(p)) {
                        *b += (f * x).abs();
                    }
                    add_scaled(&mut right.value.row_mut(i)[n..], f, net.q.row(p));
                    for (b, q) in right.bound.row_mut(i)[n..].iter_mut().zip(net.q.row(p)) {
                        *b += (f * q).abs();
                    }
                }
            }
        }
        let factor = Lu::new(&knn);
        (factor.ratio > 0.0).then_some(Joint { touching, matrix: knn, factor, right })
    }

    fn answers_to(&self, right: &Matrix) -> Matrix {
        self.factor.solve_refined(&self.matrix, right)
    }

    /// The resistance that an inactive pair sees besides its own.
    fn seen_by(&self, net: &Network, p: usize) -> f64 {
        let mut injected = net.split.na.col(p);
        injected.resize(self.matrix.rows, 0.0);
        let column = Matrix { rows: injected.len(), cols: 1, data: injected };
        dot(net.split.bn.row(p), &self.answers_to(&column).data[..net.kernel.cols])
    }
}

impl Kernel {
    fn new(joint: Joint, inverse: &Matrix) -> Kernel {
        Kernel { answers: joint.right.under(inverse), touching: joint.touching }
    }
}

/// Guards in modal coordinates: slacks, and for active pairs what they would be without the series
/// resistance, over it. `None` if some guard vanishes identically.
fn guards(
    net: &Network,
    active: &[usize],
    Kernel { touching, answers: kernel }: &Kernel,
    kernel_x: &Matrix,
    leave_x: &Matrix,
) -> Option<(Rows, Vec<GuardSize>)> {
    let (k, n, nv) = (net.kernel.cols, net.states, net.rs.cols);
    let reach: Vec<f64> = (0..kernel.value.rows).map(|i| norm(&kernel.bound.row(i)[..n])).collect();
    let mut rows = Rows {
        x: net.steps.as_ref()?.product(leave_x),
        v: Matrix::zeros(net.m, nv),
        d: Matrix::zeros(net.m, nv),
    };
    let mut sizes = Vec::with_capacity(net.m);
    let mut bound_v = vec![0.0; nv];
    for i in 0..net.m {
        let (x, v) = (rows.x.row_mut(i), rows.v.row_mut(i));
        let mut bound_x = norm(net.split.br.row(i));
        let mut scale = -1.0;
        if let Ok(at) = touching.binary_search(&i) {
            x.copy_from_slice(kernel_x.row(k + at));
            v.copy_from_slice(&kernel.value.row(k + at)[n..]);
            bound_v.copy_from_slice(&kernel.bound.row(k + at)[n..]);
            (bound_x, scale) = (reach[k + at], 1.0);
        } else {
            for ((v, b), q) in v.iter_mut().zip(&mut bound_v).zip(net.q.row(i)) {
                (*v, *b) = (-q, q.abs());
            }
            for (j, &f) in net.split.bn.row(i).iter().enumerate().filter(|f| *f.1 != 0.0) {
                add_scaled(x, f, kernel_x.row(j));
                add_scaled(v, f, &kernel.value.row(j)[n..]);
                add_scaled(&mut bound_v, f.abs(), &kernel.bound.row(j)[n..]);
                bound_x += f.abs() * reach[j];
            }
            if active.binary_search(&i).is_ok() {
                scale = 1.0 / net.d[(i, i)];
            }
        }
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
    kernel: &Matrix,
    inflow: &Matrix,
    leave_x: &Matrix,
) -> Matrix {
    let mut drive = net.rs.clone();
    drive.add_scaled(-1.0, &net.split.rgn.times(kernel));
    let mut drive = drive.transpose();
    for &p in active {
        for (c, &f) in inflow.row(p).iter().enumerate().filter(|f| *f.1 != 0.0) {
            // R' A = (B R)' in a reciprocal network
            add_scaled(drive.row_mut(c), -f, net.split.br.row(p));
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
        let joint = Joint::new(net, &active)?;
        let inverse = joint.answers_to(&Matrix::identity(joint.matrix.rows));
        // the resistance that the pair sees where it is inactive: in this mode, in the other one, or
        // what is left in the other one without the unknowns before it, whose inverse is an entry
        let resistance = match joint.touching.binary_search(&p) {
            Ok(at) => 1.0 / inverse[(net.kernel.cols + at, net.kernel.cols + at)],
            _ if !touches(net, p) => net.d[(p, p)],
            _ if was_on => net.d[(p, p)] + joint.seen_by(net, p),
            _ => net.d[(p, p)] + Joint::new(net, &self.active)?.seen_by(net, p),
        };
        let kernel = Kernel::new(joint, &inverse);
        if resistance <= 0.0 || !resistance.is_finite() {
            return None;
        }
        let change = if was_on { resistance } else { -1.0 / resistance };
        let change = if net.inductive { -change } else { change };
        let rates: Vec<f64> = self.poles.iter().map(|pole| pole.alpha).collect();
        turn.decompose(&rates, change, self.guards.rows.x.row(p))?;
        let size = |rates: &[f64]| rates.iter().fold(0.0f64, |a, r| a.max(r.abs()));
        if self.n <= SMALL && size(&turn.values) < LEFT * size(&rates) {
            return None;
        }
        let leave_x = turn.turned(&self.leave_x);
        let (n, nv) = (self.n, net.rs.cols);
        let kernel_x = kernel.answers.value.columns(0, n).product(&leave_x);
        let (guards, sizes) = guards(net, &active, &kernel, &kernel_x, &leave_x)?;
        let unknowns: Vec<usize> = (0..net.kernel.cols).collect();
        let algebraic = Rows {
            v: kernel.answers.value.columns(n, nv).select_rows(&unknowns),
            d: Matrix::zeros(unknowns.len(), nv),
            x: kernel_x.select_rows(&unknowns),
        };
        let mut slack = self.guards.slack.clone();
        slack[p] = was_on;
        let poles: Vec<Pole> = (turn.values.iter().enumerate())
            .map(|(at, &alpha)| Pole { at, alpha, omega: 0.0 })
            .collect();
        Some(Mode {
            gates: self.gates.clone(),
            n,
            fastest: poles.iter().map(Pole::size).fold(0.0, f64::max),
            poles,
            drive: drive(net, &active, &algebraic.v, &guards.v, &leave_x),
            active,
            enter: None,
            leave_x,
            leave_v: self.leave_v.clone(),
            algebraic,
            guards: Guards {
                rows: guards,
                watch: (0..net.m).map(Watch::Pair).collect(),
                slack,
                held: Vec::new(),
                idle: Vec::new(),
                direct: Vec::new(),
                sizes,
            },
            consistency: self.consistency.clone(),
            consistency_bound: self.consistency_bound.clone(),
            impulses: None,
            open: 0,
            blocks: Vec::new(),
            generation: Some(generation + 1),
        })
    }
}

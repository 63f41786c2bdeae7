//! One mode as a minimal linear system, with everything that the run needs of it.
//!
//! ```text
//! a = Q x + Yc v,   x' = J x + Jv v,   b = Bx x + Bv v + Bd v'      (v = [1; inputs])
//! ```
//!
//! `Q` is orthonormal, so that in passive networks a jump is the projection `x = Q' a`; what the
//! constraints take away leaves as impulses.

use crate::dense::{add_scaled, dot, larger, norm, Lu, Matrix};
use crate::mlcp::Role;
use crate::modewise::modes::align::fastest_first;
use crate::modewise::modes::error_carrying::Tracked;
use crate::modewise::modes::guard_rows::{control_rows, guard_rows, impulse_rows};
use crate::modewise::modes::least_norm::Share;
use crate::modewise::modes::network::Network;
use crate::modewise::modes::staircase::{Algebra, Staircase};
use crate::modewise::spectra::block::row_norm;
use crate::modewise::spectra::orthogonal::graded_qr;
use crate::modewise::spectra::spectrum::{Pole, Spectrum};
use crate::rounding::OF_SOLUTION;
use crate::switch::Switch;

/// What a guard watches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Watch {
    /// multiplier of an active diode, slack of an inactive one
    Pair(usize),
    /// distance of a switch's control from its threshold
    Switch(usize),
}

/// Rows over `[modal state; v; v']`.
#[derive(Clone, Debug)]
pub struct Rows {
    /// factors of the modal coordinates
    pub x: Matrix,
    /// factors of v
    pub v: Matrix,
    /// factors of v'
    pub d: Matrix,
}

impl Rows {
    /// Adds a multiple of an algebraic unknown to one row.
    pub fn add_algebraic(&mut self, row: usize, factor: f64, mode: &Mode, unknown: usize) {
        let (from, r) = mode.algebraic_row(unknown);
        add_scaled(self.x.row_mut(row), factor, from.x.row(r));
        add_scaled(self.v.row_mut(row), factor, from.v.row(r));
        add_scaled(self.d.row_mut(row), factor, from.d.row(r));
    }
}

/// A guard's size, for its rounding noise.
#[derive(Clone, Copy, Debug, Default)]
pub struct GuardSize {
    /// norm of the state part
    pub x: f64,
    /// norm of the bounds behind it
    pub bound: f64,
}

#[derive(Clone)]
/// Consequences of a jump: impulses of the algebraic unknowns and of the guards.
pub struct Impulses {
    /// of `[kernel part; active multipliers]`, over `[a-; v]`
    pub algebraic: Matrix,
    /// of each diode's multiplier or slack, over `[a-; v]`; must not be negative
    pub guards: Matrix,
    /// bounds behind them
    pub bounds: Matrix,
    /// diodes with such a row
    pub pairs: Vec<usize>,
}

/// Guards of a mode: what must stay positive while it lasts.
#[derive(Clone)]
pub struct Guards {
    /// over the modal state and the inputs
    pub rows: Rows,
    /// what they watch
    pub watch: Vec<Watch>,
    /// which guards are voltages (slacks, controls), the others being currents
    pub slack: Vec<bool>,
    /// guards of thyristors that stay closed while that of their pair, which follows, is positive
    pub held: Vec<(usize, usize)>,
    /// switches whose controls are at their thresholds in any state
    pub idle: Vec<usize>,
    /// guards of switches that depend on the inputs alone, with their switches
    pub direct: Vec<(usize, usize)>,
    /// their sizes
    pub sizes: Vec<GuardSize>,
}

/// A mode.
#[derive(Clone)]
pub struct Mode {
    /// which pairs are active
    pub active: Vec<usize>,
    /// state of each switch's control: above its thresholds
    pub gates: Vec<bool>,
    /// number of states
    pub n: usize,
    /// eigenvalues
    pub poles: Vec<Pole>,
    /// modal state from energy coordinates, where it is not the transpose of `leave_x`
    pub enter: Option<Matrix>,
    /// modal drive from v
    pub drive: Matrix,
    /// energy coordinates from modal state and v
    pub leave_x: Matrix,
    /// see `leave_x`
    pub leave_v: Matrix,
    /// algebraic unknowns `[kernel part; active multipliers]`; multipliers that are missing here are
    /// the guards of their pairs
    pub algebraic: Rows,
    /// what must stay positive
    pub guards: Guards,
    /// what must vanish for the mode to exist, over v
    pub consistency: Matrix,
    /// bounds behind it
    pub consistency_bound: Matrix,
    /// jumps into the mode may need impulses
    pub impulses: Option<Impulses>,
    /// undetermined directions
    pub open: usize,
    /// largest eigenvalue [1/s]
    pub fastest: f64,
    /// modal coordinates without eigenvectors: first of them, their matrix
    pub blocks: Vec<(usize, Matrix)>,
    /// by how many modes it was derived from the network, where others can be derived from it
    pub generation: Option<usize>,
}

/// Unit rows, for constraints of very different size.
fn unit_rows(a: &Matrix) -> (Matrix, Vec<f64>) {
    let mut out = a.clone();
    let mut sizes = Vec::with_capacity(a.rows);
    for r in 0..a.rows {
        let size = norm(a.row(r));
        let size = if size > 0.0 { size } else { 1.0 };
        out.row_mut(r).iter_mut().for_each(|v| *v /= size);
        sizes.push(size);
    }
    (out, sizes)
}

/// `A^-1 B`, with zeros where it has nothing but rounding: currents that cannot flow must not look like
/// currents.
pub(in crate::modewise) fn solved(a: &Matrix, factor: &Lu, b: &Matrix) -> Matrix {
    let (mut solution, correction) = factor.refine(a, b);
    for (v, c) in solution.data.iter_mut().zip(&correction.data) {
        if v.abs() <= c.abs() {
            *v = 0.0;
        }
    }
    solution
}

/// Why a mode is not reduced whose voltages follow second derivatives of sources.
pub const HIGH_INDEX: &str = "its index is above 2";

impl Mode {
    /// Reduces the equations of a mode; the error says what is wrong with it.
    pub fn new(
        net: &Network,
        switches: &[Switch],
        on: &[bool],
        gates: &[bool],
    ) -> Result<Mode, String> {
        let active: Vec<usize> = (0..net.m).filter(|&i| on[i]).collect();
        let (k, r) = (net.kernel.cols, net.states);
        let nv = net.rs.cols;
        let algebra = Algebra::new(net, &active);
        let stairs = Staircase::new(net, &active, &algebra)?;
        let Algebra { knn, kna, kan } = algebra;
        let size = knn.rows;
        let force = Matrix::from_fn(size, nv, |i, c| {
            if i < k {
                net.ns[(i, c)]
            } else {
                -net.q[(active[i - k], c)]
            }
        });
        // constraints H a = F v with orthonormal rows, enforced through the columns of Hf
        let constraints = stairs.constraint_rows.cols;
        let (mut q2, yc, mut pi, constraints_h, constraints_f, constraint_cols, solve_g);
        if constraints == 0 {
            q2 = Matrix::identity(r);
            pi = Matrix::identity(r);
            yc = Matrix::zeros(r, nv);
            (constraints_h, constraints_f) = (Matrix::zeros(0, r), Matrix::zeros(0, nv));
            constraint_cols = Matrix::zeros(size, 0);
            solve_g = Matrix::zeros(0, 0);
        } else {
            let h0 = match &stairs.constraint_demand {
                Some(demand) => demand.times(&net.big_r),
                None => stairs.constraint_rows.transpose_times(&kna),
            };
            let f0 = stairs.constraint_rows.transpose_times(&force);
            let (h0, sizes) = unit_rows(&h0);
            let (q, tri) = graded_qr(&h0.transpose());
            let others: Vec<usize> = (constraints..r).collect();
            let firsts: Vec<usize> = (0..constraints).collect();
            let lu = Lu::new(&tri.transpose());
            if lu.ratio < OF_SOLUTION {
                return Err("its constraints depend on each other".into());
            }
            let scaled = Matrix::from_fn(constraints, nv, |i, c| f0[(i, c)] / sizes[i]);
            constraints_h = q.select_cols(&firsts).transpose();
            constraints_f = lu.solve(&scaled);
            q2 = q.select_cols(&others);
            if net.passive {
                let columns = Matrix::from_fn(size, constraints, |i, j| {
                    stairs.constraint_cols[(i, j)] / sizes[j]
                });
                // columns tri^-1
                constraint_cols = lu.solve(&columns.transpose()).transpose();
                solve_g = {
                    let mut g = Matrix::identity(constraints);
                    g.data.iter_mut().for_each(|v| *v = -*v);
                    g
                };
                pi = q2.transpose();
            } else {
                let (hf0, sizes) = unit_rows(&kan.times(&stairs.constraint_cols).transpose());
                let (ql, tri) = graded_qr(&hf0.transpose());
                let lu = Lu::new(&tri.transpose());
                if lu.ratio < OF_SOLUTION {
                    return Err("its constraints depend on each other".into());
                }
                let columns = Matrix::from_fn(size, constraints, |i, j| {
                    stairs.constraint_cols[(i, j)] / sizes[j]
                });
                constraint_cols = lu.solve(&columns.transpose()).transpose();
                let g = Lu::new(&constraints_h.times(&ql.select_cols(&firsts)));
                let complement = ql.select_cols(&others).transpose();
                let square = Lu::new(&complement.times(&q2));
                if g.ratio < OF_SOLUTION || square.ratio < OF_SOLUTION {
                    return Err(HIGH_INDEX.into());
                }
                solve_g = g.solve(&Matrix::identity(constraints));
                pi = square.solve(&complement);
            }
            let hf = kan.times(&constraint_cols);
            yc = if net.passive {
                constraints_h.transpose_times(&constraints_f)
            } else {
                hf.times(&solve_g).times(&constraints_f)
            };
        }
        // the regular block of the algebraic equations
        let block = knn.select_rows(&stairs.rows).select_cols(&stairs.cols);
        let factor = Lu::new(&block);
        if factor.ratio == 0.0 {
            return Err("its algebraic equations are singular".into());
        }
        let inverse = solved(&block, &factor, &Matrix::identity(block.rows));
        let forcing = kna.select_rows(&stairs.rows);
        let response = inverse.times(&forcing.times(&q2));
        let indirect = pi.times(&kan.select_cols(&stairs.cols).times(&response));
        if let Some(turn) = fastest_first(&indirect, &pi.times(&net.split.rgr.times(&q2))) {
            (q2, pi) = (q2.times(&turn), turn.transpose_times(&pi));
        }
        let n = q2.cols;
        // columns [x | v | v']
        let width = n + 2 * nv;
        let place = |x: &Matrix, v: &Matrix, d: Option<&Matrix>| {
            let mut out = Matrix::zeros(x.rows, width);
            for r in 0..x.rows {
                let (of_x, rest) = out.row_mut(r).split_at_mut(n);
                let (of_v, of_d) = rest.split_at_mut(nv);
                of_x.copy_from_slice(x.row(r));
                of_v.copy_from_slice(v.row(r));
                d.iter().for_each(|d| of_d.copy_from_slice(d.row(r)));
            }
            out
        };
        let states = Tracked::exact(place(&q2, &yc, None));
        let zeros_x = Matrix::zeros(stairs.rows.len(), n);
        let mut right = Tracked::exact(place(&zeros_x, &force.select_rows(&stairs.rows), None));
        right.add(-1.0, &states.under(&forcing));
        let mut algebraic = right.under(&inverse).placed(&stairs.cols, size);
        // a' but for the constraints' share
        let mut change = Tracked::exact(place(&Matrix::zeros(r, n), &net.rs, None));
        change.add(-1.0, &states.under(&net.split.rgr));
        change.add(-1.0, &algebraic.under(&kan));
        if constraints > 0 {
            let mut kappa = change.under(&solve_g.times(&constraints_h));
            let zero = (Matrix::zeros(constraints, n), Matrix::zeros(constraints, nv));
            let drift = place(&zero.0, &zero.1, Some(&solve_g.times(&constraints_f)));
            kappa.add(-1.0, &Tracked::exact(drift));
            algebraic.add(1.0, &kappa.under(&constraint_cols));
        }
        let mut change = change.under(&pi);
        change.clean(1);
        let (j, jv) = (change.value.columns(0, n), change.value.columns(n, nv));

        // what no equation determines: least multipliers and slacks, then least voltages
        let open = stairs.open_cols.cols;
        let mut diodes = guard_rows(net, on, &active, &states, &algebraic, n);
        let share = (open > 0).then(|| Share::new(net, on, &active, &stairs.open_cols));
        if let Some(share) = &share {
            let mut unknowns = states.under(&net.big_r);
            let part: Vec<usize> = (0..k).collect();
            unknowns.add(1.0, &algebraic.rows(&part).under(&net.kernel));
            let amounts = share.amounts(&diodes, &unknowns);
            algebraic.add(1.0, &amounts.under(&stairs.open_cols));
            diodes = guard_rows(net, on, &active, &states, &algebraic, n);
        }
        diodes.clean(net.n + net.m);
        let fixed = switches.iter().zip(gates).filter(|(s, &gate)| s.role(gate) != Role::Diode);
        let switched: Vec<usize> = fixed.map(|(s, _)| s.pair).collect();
        let impulses = (constraints > 0).then(|| {
            let joint = Matrix::from_fn(constraints, r + nv, |i, c| {
                if c < r {
                    constraints_h[(i, c)]
                } else {
                    -constraints_f[(i, c - r)]
                }
            });
            let content = Tracked::exact(solve_g.times(&joint));
            let mut algebraic = content.under(&constraint_cols);
            let still = Tracked::zeros(r, r + nv);
            let mut guards = impulse_rows(net, on, &active, &still, &algebraic);
            if let Some(share) = &share {
                let part: Vec<usize> = (0..k).collect();
                let unknowns = algebraic.rows(&part).under(&net.kernel);
                let amounts = share.amounts(&guards, &unknowns);
                algebraic.add(1.0, &amounts.under(&stairs.open_cols));
                guards = impulse_rows(net, on, &active, &still, &algebraic);
            }
            guards.clean(net.n + net.m);
            let diode = |&i: &usize| {
                !switched.contains(&i) && guards.value.row(i).iter().any(|v| *v != 0.0)
            };
            let pairs = (0..net.m).filter(diode).collect();
            Impulses {
                algebraic: algebraic.value,
                guards: guards.value,
                bounds: guards.bound,
                pairs,
            }
        });
        let mut consistency = Tracked::exact(force).under(&stairs.open_rows.transpose());
        consistency.clean(net.n + net.m);

        // guards: diodes, then switch thresholds
        let Some(spectrum) = Spectrum::new(&j, net.symmetric) else {
            return Err(format!("its {n} states have no basis of eigenvectors"));
        };
        let Spectrum { poles, blocks, from_modal: from, to_modal: to, .. } = spectrum;
        let to_rows = |t: &Matrix| Rows {
            x: t.columns(0, n).times(&from),
            v: t.columns(n, nv),
            d: t.columns(n + nv, nv),
        };
        let mut kept = Vec::new();
        let mut watch = Vec::new();
        for i in 0..net.m {
            if !switched.contains(&i) && diodes.value.row(i).iter().any(|v| *v != 0.0) {
                kept.push(i);
                watch.push(Watch::Pair(i));
            }
        }
        let mut all = diodes.rows(&kept);
        let controls = control_rows(net, switches, gates, &states, &algebraic, n, width);
        let (mut held, mut idle) = (Vec::new(), Vec::new());
        for (s, switch) in switches.iter().enumerate() {
            if controls.value.row(s).iter().all(|v| *v == 0.0) {
                if !switch.held(gates[s], on[switch.pair]) {
                    idle.push(s);
                }
                continue;
            }
            let latch = |&i: &usize| i == switch.pair && switch.held(gates[s], on[i]);
            let pair = kept.iter().position(latch);
            held.extend(pair.map(|pair| (watch.len(), pair)));
            watch.push(Watch::Switch(s));
            let row = controls.rows(&[s]);
            all =
                Tracked { value: all.value.above(&row.value), bound: all.bound.above(&row.bound) };
        }
        let sizes = (0..all.value.rows)
            .map(|i| GuardSize {
                x: norm(&all.value.row(i)[..n]),
                bound: norm(&all.bound.row(i)[..n]),
            })
            .collect();
        let direct = watch
            .iter()
            .enumerate()
            .filter_map(|(j, w)| match *w {
                Watch::Switch(s)
                    if all.value.row(j)[..n].iter().all(|v| *v == 0.0)
                        && held.iter().all(|h| h.0 != j) =>
                {
                    Some((j, s))
                }
                _ => None,
            })
            .collect();
        let regular = constraints == 0 && open == 0 && switches.is_empty() && watch.len() == net.m;
        let generation = (regular && net.symmetric && poles.len() == n).then_some(0);
        let rates = poles.iter().map(Pole::size).chain(blocks.iter().map(|b| row_norm(&b.1)));
        let fastest = rates.fold(0.0, f64::max);
        Ok(Mode {
            active,
            gates: gates.to_vec(),
            n,
            enter: Some(to.times(&pi)),
            drive: to.times(&jv),
            leave_x: q2.times(&from),
            leave_v: yc,
            algebraic: to_rows(&algebraic.value),
            guards: Guards {
                rows: to_rows(&all.value),
                slack: watch.iter().map(|w| !matches!(w, Watch::Pair(i) if on[*i])).collect(),
                watch,
                held,
                idle,
                direct,
                sizes,
            },
            consistency: consistency.value,
            consistency_bound: consistency.bound,
            impulses,
            open,
            fastest,
            blocks,
            generation,
            poles,
        })
    }

    /// Modal state from energy coordinates.
    pub fn enter(&self, a: &[f64], x: &mut [f64]) {
        match &self.enter {
            Some(enter) => enter.apply(a, x),
            None => self.leave_x.apply_transposed(a, x),
        }
    }

    /// Raises sizes of the modal state to those of the terms that it is summed from where it is entered.
    pub fn enter_sizes(&self, a: &[f64], sizes: &mut [f64]) {
        let sum = |row: &[f64]| row.iter().zip(a).map(|(c, a)| (c * a).abs()).sum::<f64>();
        match &self.enter {
            Some(enter) => {
                sizes.iter_mut().enumerate().for_each(|(k, s)| *s = larger(*s, sum(enter.row(k))));
            }
            None => {
                for (k, size) in sizes.iter_mut().enumerate() {
                    let column = (0..a.len()).map(|j| (self.leave_x[(j, k)] * a[j]).abs());
                    *size = larger(*size, column.sum());
                }
            }
        }
    }

    /// Rates of a modal state that nothing drives.
    pub fn turn(&self, x: &[f64], out: &mut [f64]) {
        for pole in &self.poles {
            let at = pole.at;
            if pole.omega == 0.0 {
                out[at] = pole.alpha * x[at];
            } else {
                out[at] = pole.alpha * x[at] - pole.omega * x[at + 1];
                out[at + 1] = pole.omega * x[at] + pole.alpha * x[at + 1];
            }
        }
        for (at, block) in &self.blocks {
            let places = *at..at + block.rows;
            block.apply(&x[places.clone()], &mut out[places]);
        }
    }

    /// Energy coordinates from modal state and inputs, and their rates from those of both.
    pub fn leave(&self, x: &[f64], v: &[f64], a: &mut [f64]) {
        self.leave_x.apply(x, a);
        // where sources charge nothing by themselves, no jump brings impulses
        if self.impulses.is_some() {
            self.leave_v.apply_add(v, a);
        }
    }

    /// Whether the modal state is as long as the energy coordinates are.
    pub fn orthonormal(&self) -> bool {
        self.enter.is_none()
    }

    /// Where the row of an algebraic unknown is.
    #[inline]
    pub fn algebraic_row(&self, i: usize) -> (&Rows, usize) {
        let listed = self.algebraic.x.rows;
        if i < listed {
            (&self.algebraic, i)
        } else {
            (&self.guards.rows, self.active[i - listed])
        }
    }

    /// The size of an algebraic unknown's largest part where the modal state is of some size.
    pub fn algebraic_size(&self, i: usize, state: f64, inputs: [&[f64]; 2]) -> f64 {
        let (rows, r) = self.algebraic_row(i);
        let of_x =
            if i < self.algebraic.x.rows { norm(rows.x.row(r)) } else { self.guards.sizes[r].x };
        let parts = inputs.into_iter().zip([rows.v.row(r), rows.d.row(r)]);
        let terms = parts.flat_map(|(list, row)| list.iter().zip(row).map(|(y, f)| (y * f).abs()));
        terms.fold(of_x * state, larger)
    }

    /// Algebraic unknowns at a state, with inputs and their rates.
    pub fn algebra(&self, [x, v, d]: [&[f64]; 3], out: &mut [f64]) {
        let Rows { x: of_x, v: of_v, d: of_d } = &self.algebraic;
        let (listed, others) = out.split_at_mut(of_x.rows);
        of_x.apply(x, listed);
        of_v.apply_add(v, listed);
        if d.iter().any(|rate| *rate != 0.0) {
            of_d.apply_add(d, listed);
        }
        for (i, out) in others.iter_mut().enumerate() {
            let (rows, r) = self.algebraic_row(of_x.rows + i);
            *out = dot(rows.x.row(r), x) + dot(rows.v.row(r), v) + dot(rows.d.row(r), d);
        }
    }

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        let rows = |r: &Rows| r.x.data.len() + r.v.data.len() + r.d.data.len();
        let mut count = self.leave_x.data.len() + self.enter.as_ref().map_or(0, |e| e.data.len());
        count += self.drive.data.len() + self.leave_v.data.len();
        count += rows(&self.algebraic) + rows(&self.guards.rows);
        if let Some(i) = &self.impulses {
            count += i.algebraic.data.len() + 2 * i.guards.data.len();
        }
        8 * count + 64 * self.guards.watch.len() + 1024
    }
}

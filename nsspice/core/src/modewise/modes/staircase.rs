//! Which combinations of the algebraic unknowns are determined by algebra, which by constraints on
//! the states, and which not at all.
//!
//! With `K` the algebraic equations of a mode: the kernel of `K` gives the *constraint* directions
//! (loops of capacitors and sources, cut-sets of inductors) and the *open* ones (floating islands,
//! ideal diodes in parallel).  In passive networks all of this is a property of the graph.

use crate::dense::{add_scaled, equilibrate, norm, Echelon, Lu, Matrix};
use crate::modewise::modes::error_carrying::Tracked;
use crate::modewise::modes::mode::HIGH_INDEX;
use crate::modewise::modes::network::Network;
use crate::rounding::of_elimination;

/// The directions; columns live on the algebraic unknowns `[kernel part; active multipliers]`.
pub struct Staircase {
    /// constraints: combinations of equations
    pub constraint_rows: Matrix,
    /// what enforces them: combinations of unknowns
    pub constraint_cols: Matrix,
    /// passive networks: the constraints as demands on the unknowns, free of cancellation
    pub constraint_demand: Option<Matrix>,
    /// combinations of equations that must hold by themselves
    pub open_rows: Matrix,
    /// undetermined combinations of unknowns
    pub open_cols: Matrix,
    /// a regular block: equations
    pub rows: Vec<usize>,
    /// a regular block: unknowns
    pub cols: Vec<usize>,
}

/// The algebraic matrices of a mode.
pub struct Algebra {
    /// `N' K N`
    pub knn: Matrix,
    /// `N' K R`
    pub kna: Matrix,
    /// `R' K N`
    pub kan: Matrix,
}

impl Algebra {
    /// Assembles for the given active pairs.
    pub fn new(net: &Network, active: &[usize]) -> Algebra {
        let (k, r) = (net.kernel.cols, net.states);
        let size = k + active.len();
        let list = |rows: usize, cols: usize| Vec::with_capacity(rows * cols);
        let (mut knn, mut kna, mut kan) = (list(size, size), list(size, r), list(r, size));
        for i in 0..k {
            knn.extend_from_slice(net.split.ngn.row(i));
            knn.extend(active.iter().map(|&p| net.split.na[(i, p)]));
            kna.extend_from_slice(net.split.ngr.row(i));
        }
        for &p in active {
            knn.extend(net.split.bn.row(p).iter().map(|v| -v));
            knn.extend(active.iter().map(|&q| net.d[(p, q)]));
            kna.extend(net.split.br.row(p).iter().map(|v| -v));
        }
        for i in 0..r {
            kan.extend_from_slice(net.split.rgn.row(i));
            kan.extend(active.iter().map(|&p| net.split.ra[(i, p)]));
        }
        Algebra {
            knn: Matrix { rows: size, cols: size, data: knn },
            kna: Matrix { rows: size, cols: r, data: kna },
            kan: Matrix { rows: r, cols: size, data: kan },
        }
    }
}

impl Staircase {
    /// Finds all directions; the error says why the mode has none.
    pub fn new(net: &Network, active: &[usize], algebra: &Algebra) -> Result<Staircase, String> {
        if net.passive {
            Ok(by_graph(net, active))
        } else {
            by_numbers(algebra)
        }
    }
}

/// Adds `sign * column * row`.
fn add_products(out: &mut Matrix, column: &[f64], row: &[f64], sign: f64) {
    for (u, &f) in column.iter().enumerate().filter(|f| *f.1 != 0.0) {
        add_scaled(out.row_mut(u), sign * f, row);
    }
}

/// Passive networks: everything from matrices of small integers.
fn by_graph(net: &Network, active: &[usize]) -> Staircase {
    let (k, n) = (net.kernel.cols, net.n);
    let size = k + active.len();
    // no resistor sees the direction: combinations of `loose` and pairs without series resistance
    let ideal: Vec<usize> =
        (0..active.len()).filter(|&j| net.d[(active[j], active[j])] == 0.0).collect();
    let free = net.loose.basis.cols;
    let width = free + ideal.len();
    let (skew_loose, at_loose) = (&net.loose.skew_basis, &net.loose.at_basis);
    let mut data = Vec::with_capacity(size * width);
    for i in 0..k {
        data.extend_from_slice(skew_loose.row(i));
        data.extend(ideal.iter().map(|&j| net.split.na[(i, active[j])]));
    }
    for &p in active {
        data.extend(at_loose.row(p).iter().map(|v| -v));
        data.extend(ideal.iter().map(|_| 0.0));
    }
    let joint = Matrix { rows: size, cols: width, data };
    let directions = Echelon::new(joint, 0..width).kernel();
    let mut t = Matrix::zeros(size, directions.cols);
    for c in 0..directions.cols {
        for j in 0..free {
            let f = directions[(j, c)];
            if f != 0.0 {
                for i in 0..k {
                    t[(i, c)] += f * net.loose.basis[(i, j)];
                }
            }
        }
        for (j, &p) in ideal.iter().enumerate() {
            t[(k + p, c)] = directions[(free + j, c)];
        }
    }
    // what each direction demands of the states: t' [N' G_skew; -A'] on all unknowns
    let mut demand = Matrix::zeros(n, t.cols);
    for i in 0..k {
        add_products(&mut demand, net.loose.n_skew.row(i), t.row(i), 1.0);
    }
    for (j, &p) in active.iter().enumerate() {
        add_products(&mut demand, net.loose.at.row(p), t.row(k + j), -1.0);
    }
    let found = Echelon::new(demand.clone(), 0..t.cols);
    let constraint_demand = Some(demand.select_cols(&found.pivots).transpose());
    let constraint = t.select_cols(&found.pivots);
    let open = t.times(&found.kernel());
    // a regular block: drop one unknown per direction
    let dropped = Echelon::new(t.transpose(), (0..size).rev()).pivots;
    let kept: Vec<usize> = (0..size).filter(|i| !dropped.contains(i)).collect();
    Staircase {
        constraint_rows: constraint.clone(),
        constraint_cols: constraint,
        constraint_demand,
        open_rows: open.clone(),
        open_cols: open,
        rows: kept.clone(),
        cols: kept,
    }
}

/// Column-pivoted elimination with orthogonal reflections: pivot columns and kernel.
fn pivoted(a: &Matrix) -> (Vec<usize>, Matrix) {
    let (order, rank, w) = reflected(a);
    let cols = a.cols;
    let mut kernel = Matrix::zeros(cols, cols - rank);
    for (k, &f) in order[rank..].iter().enumerate() {
        let mut x = vec![0.0; rank];
        for i in (0..rank).rev() {
            let sum: f64 = (i + 1..rank).map(|j| w[(i, order[j])] * x[j]).sum();
            x[i] = (-w[(i, f)] - sum) / w[(i, order[i])];
        }
        kernel[(f, k)] = 1.0;
        let largest = x.iter().fold(1.0f64, |m, v| m.max(v.abs()));
        for (i, v) in x.iter().enumerate() {
            // a trace of the reflections would be a constraint of its own once its row has unit length
            kernel[(order[i], k)] =
                if v.abs() > of_elimination(x.len()) * largest { *v } else { 0.0 };
        }
    }
    (order[..rank].to_vec(), kernel)
}

/// Reflects a matrix to a triangle: the order of its columns, their rank, and the triangle.
fn reflected(a: &Matrix) -> (Vec<usize>, usize, Matrix) {
    let (rows, cols) = (a.rows, a.cols);
    let mut w = a.clone();
    let mut order: Vec<usize> = (0..cols).collect();
    let mut rank = 0;
    let mut first = 0.0f64;
    while rank < rows.min(cols) {
        let left =
            |c: usize, w: &Matrix| (rank..rows).fold(0.0f64, |m, r| m.hypot(w[(r, order[c])]));
        let (mut best, mut size) = (rank, -1.0);
        for c in rank..cols {
            let s = left(c, &w);
            if s > size {
                (best, size) = (c, s);
            }
        }
        first = first.max(size);
        if size <= of_elimination(rows.max(cols)) * first || size == 0.0 {
            break;
        }
        order.swap(rank, best);
        let p = order[rank];
        let mut v: Vec<f64> = (rank..rows).map(|r| w[(r, p)]).collect();
        v[0] += size.copysign(v[0]);
        let f = 2.0 / v.iter().map(|x| x * x).sum::<f64>();
        for &c in &order[rank..] {
            let s: f64 = v.iter().enumerate().map(|(i, x)| x * w[(rank + i, c)]).sum::<f64>() * f;
            for (i, x) in v.iter().enumerate() {
                w[(rank + i, c)] -= s * x;
            }
        }
        rank += 1;
    }
    (order, rank, w)
}

/// The kernel of a matrix whose rank is that of the block of these rows and columns, and how far it is
/// known.
///
/// A large resistance to ground next to milliohms leaves 1e-10 of a voltage in what reflections make of a
/// loop of closed switches, which has none: the loop, which nothing determines, would then seem to move
/// a charge, and impulses without bound go round in it.  Solved from the equations themselves, with
/// residuals of twice the precision, sums of one and minus one vanish.
fn kernel_beside(a: &Matrix, rows: &[usize], cols: &[usize]) -> Tracked {
    let free: Vec<usize> = (0..a.cols).filter(|c| !cols.contains(c)).collect();
    let mut out = Tracked::zeros(a.cols, free.len());
    if free.is_empty() {
        return out;
    }
    let some = a.select_rows(rows);
    let block = some.select_cols(cols);
    let factor = Lu::new(&block);
    let (solved, correction) = factor.refine(&block, &some.select_cols(&free));
    for (k, &f) in free.iter().enumerate() {
        out.value[(f, k)] = 1.0;
        let largest = (0..cols.len()).fold(1.0f64, |m, i| m.max(solved[(i, k)].abs()));
        for (i, &c) in cols.iter().enumerate() {
            let (v, doubt) = (solved[(i, k)], correction[(i, k)].abs());
            // a trace of rounding would be a constraint of its own once its row has unit length
            if v.abs() > doubt.max(of_elimination(a.cols) * largest) {
                out.value[(c, k)] = -v;
            }
            out.bound[(c, k)] = doubt;
        }
    }
    out
}

/// Rows of unit length.
fn normalised_rows(a: &Matrix) -> Matrix {
    let mut out = a.clone();
    for r in 0..a.rows {
        let size = norm(a.row(r));
        if size > 0.0 {
            out.row_mut(r).iter_mut().for_each(|v| *v /= size);
        }
    }
    out
}

/// Networks with controlled sources: numerical ranks of the equilibrated matrices.
fn by_numbers(algebra: &Algebra) -> Result<Staircase, String> {
    let knn = &algebra.knn;
    let size = knn.rows;
    let (row, col) = equilibrate(knn);
    let scaled = Matrix::from_fn(size, size, |i, j| knn[(i, j)] * row[i] * col[j]);
    let ranked = |m: &Matrix| {
        let (mut order, rank, _) = reflected(m);
        order.truncate(rank);
        order
    };
    let (cols, rows) = (ranked(&scaled), ranked(&scaled.transpose()));
    if rows.len() != cols.len() {
        return Err("the rank of its algebraic equations is not certain".into());
    }
    let back = |mut kernel: Tracked, scale: &[f64]| {
        for (i, f) in scale.iter().enumerate() {
            kernel.value.row_mut(i).iter_mut().for_each(|v| *v *= f);
            kernel.bound.row_mut(i).iter_mut().for_each(|v| *v *= f);
        }
        kernel
    };
    let right = back(kernel_beside(&scaled, &rows, &cols), &col);
    let left = back(kernel_beside(&scaled.transpose(), &cols, &rows), &row);
    // a sum that vanishes but for rounding is zero: compare with the sum of absolute values, and with
    // what is not known of the kernel
    let clean = |kernel: &Tracked, y: &Matrix| {
        let (value, y_size) = (kernel.value.transpose(), y.abs());
        let (mut sum, size) = (value.times(y), value.abs().times(&y_size));
        let doubt = kernel.bound.transpose().times(&y_size);
        for ((v, s), d) in sum.data.iter_mut().zip(&size.data).zip(&doubt.data) {
            if v.abs() <= (1e-12 * s).max(*d) {
                *v = 0.0;
            }
        }
        sum
    };
    let demands = clean(&left, &algebra.kna); // one row per direction
    let effects = clean(&right, &algebra.kan.transpose());
    let (left, right) = (left.value, right.value);
    let (constraint_left, open_left) = pivoted(&normalised_rows(&demands).transpose());
    let (constraint_right, open_right) = pivoted(&normalised_rows(&effects).transpose());
    if constraint_left.len() != constraint_right.len() {
        return Err(HIGH_INDEX.into());
    }
    let scale = |x: &Matrix, combos: &Matrix, of: &Matrix| {
        // the kernel was found for unit rows
        let mut c = combos.clone();
        for r in 0..c.rows {
            let size = norm(of.row(r));
            if size > 0.0 {
                c.row_mut(r).iter_mut().for_each(|v| *v /= size);
            }
        }
        x.times(&c)
    };
    Ok(Staircase {
        constraint_rows: left.select_cols(&constraint_left),
        constraint_cols: right.select_cols(&constraint_right),
        constraint_demand: None,
        open_rows: scale(&left, &open_left, &demands),
        open_cols: scale(&right, &open_right, &effects),
        rows,
        cols,
    })
}

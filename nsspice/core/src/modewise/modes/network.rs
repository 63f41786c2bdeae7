//! What does not depend on the mode: energy coordinates of the stored quantities, and all matrices
//! of the network in them.
//!
//! With the capacitors' incidence columns and the unit columns of inductor currents in `P`, the
//! unknowns split into `z = R a + N b`: `N` spans what stores nothing (the kernel of `P'`), and `R` is
//! scaled so that `R' E R = 1`. Then `a = R' E z` and `|a|^2 / 2` is the stored energy, for any
//! element values are.

use crate::dense::{eigen_symmetric, Differences, Echelon, Matrix};
use crate::descriptor::Linear;
use crate::modewise::functions::inputs::Inputs;
use crate::rounding::OF_SOLUTION;
use crate::sparse::Csc;
use crate::structure::{Coordinates, Edge};

/// The system as assembled, with the elements behind its storage and conductance matrices.
pub struct Assembly {
    /// the system
    pub linear: Linear,
    /// capacitors
    pub capacitors: Vec<Edge>,
    /// resistors, as conductances
    pub conductors: Vec<Edge>,
    /// the voltages that are unknowns
    pub coordinates: Coordinates,
}

/// The matrices of conductances and pairs between what stores and what does not.
pub struct Split {
    /// `R' G R`
    pub rgr: Matrix,
    /// `R' G N`
    pub rgn: Matrix,
    /// `N' G R`
    pub ngr: Matrix,
    /// `N' G N`
    pub ngn: Matrix,
    /// `R' A`
    pub ra: Matrix,
    /// `N' A`
    pub na: Matrix,
    /// `B R`
    pub br: Matrix,
    /// `B N`
    pub bn: Matrix,
}

/// What the graph says about unknowns on which no resistor acts.
pub struct Loose {
    /// their combinations of kernel vectors
    pub basis: Matrix,
    /// `N' G_skew N` on them
    pub skew_basis: Matrix,
    /// `A' N` on them
    pub at_basis: Matrix,
    /// `N' G_skew`, by unknown
    pub n_skew: Matrix,
    /// `A'`, by unknown
    pub at: Matrix,
}

/// The mode-independent part of the reduction.
pub struct Network {
    /// unknowns, pairs, energy coordinates, unknowns without storage
    pub n: usize,
    /// number of pairs
    pub m: usize,
    /// number of energy coordinates
    pub states: usize,
    /// all ranks follow from the graph
    pub passive: bool,
    /// `z = big_r a + kernel b`
    pub big_r: Matrix,
    /// `E R`: charges and fluxes from energy coordinates
    pub charges: Matrix,
    /// basis of what stores nothing, n x k
    pub kernel: Matrix,
    /// conductances and pairs in these coordinates
    pub split: Split,
    /// `B R` once more where modes follow from one another
    pub steps: Option<Differences>,
    /// series resistances
    pub d: Matrix,
    /// slacks by `[1; inputs]`; but for the first column, which is constant, zero in what is simulated
    pub q: Matrix,
    /// what inputs add to the controls of switches, in one state of them: switch, whether it is above its threshold,
    /// column of `[1; inputs]`, factor
    pub controls: Vec<(usize, bool, usize, f64)>,
    /// `R' S`, `N' S`; first column: all that is constant, then one per input
    pub rs: Matrix,
    /// see `rs`
    pub ns: Matrix,
    /// `S` by constant and input
    pub s: Matrix,
    /// what no resistor acts on
    pub loose: Loose,
    /// one kind of storage in a reciprocal network: the state matrix is symmetric
    pub symmetric: bool,
    /// that kind is inductors
    pub inductive: bool,
}

/// Voltages of two-terminal elements as rows, applied to columns of a matrix.
fn across(rows: &[Vec<(usize, f64)>], columns: &Matrix) -> Matrix {
    Matrix::from_fn(rows.len(), columns.cols, |k, c| {
        rows[k].iter().map(|&(i, sign)| sign * columns[(i, c)]).sum()
    })
}

/// `X' diag(w) Y`
fn weighted(x: &Matrix, weights: &[f64], y: &Matrix) -> Matrix {
    let mut scaled = y.clone();
    for (r, &w) in weights.iter().enumerate() {
        scaled.row_mut(r).iter_mut().for_each(|v| *v *= w);
    }
    x.transpose_times(&scaled)
}

fn dense(m: &Csc) -> Matrix {
    let mut out = Matrix::zeros(m.nrows, m.ncols);
    for (r, c, v) in m.iter() {
        out[(r, c)] += v;
    }
    out
}

/// Scaled Cholesky factor: `L` with `S = L L'`, and the smallest pivot.
fn cholesky(s: &Matrix) -> (Matrix, f64) {
    let n = s.rows;
    let mut l = Matrix::zeros(n, n);
    let mut least = f64::INFINITY;
    for i in 0..n {
        for j in 0..=i {
            let sum = crate::dense::dot(&l.row(i)[..j], &l.row(j)[..j]);
            if i == j {
                let pivot = s[(i, i)] - sum;
                least = least.min(pivot);
                l[(i, i)] = pivot.max(0.0).sqrt();
            } else {
                l[(i, j)] = (s[(i, j)] - sum) / l[(j, j)];
            }
        }
    }
    (l, least)
}

/// `R` with `R' E R = 1` from the columns `base` and `M = base' E base`; the second result spans what
/// turns out to store nothing (perfectly coupled windings).
fn energy_basis(base: &Matrix, m: &Matrix) -> Result<(Matrix, Matrix), String> {
    let r = m.rows;
    let scale: Vec<f64> = (0..r).map(|i| 1.0 / m[(i, i)].sqrt()).collect();
    if scale.iter().any(|s| !s.is_finite()) {
        return Err("a stored energy is not positive".into());
    }
    let unit = Matrix::from_fn(r, r, |i, j| m[(i, j)] * scale[i] * scale[j]);
    let scaled = Matrix::from_fn(base.rows, r, |i, j| base[(i, j)] * scale[j]);
    let (l, least) = cholesky(&unit);
    if least > 1e-9 {
        // R = scaled L'^-1: solve R L' = scaled, row by row
        let mut out = scaled;
        for row in 0..out.rows {
            for j in 0..r {
                let sum = crate::dense::dot(&out.row(row)[..j], &l.row(j)[..j]);
                out[(row, j)] = (out[(row, j)] - sum) / l[(j, j)];
            }
        }
        return Ok((out, Matrix::zeros(base.rows, 0)));
    }
    let (values, vectors) = eigen_symmetric(&unit).ok_or("the stored energy is not finite")?;
    if values.iter().any(|&v| v < -1e-9) {
        return Err("a stored energy is negative".into());
    }
    let kept: Vec<usize> = (0..r).filter(|&k| values[k] > OF_SOLUTION).collect();
    let lost: Vec<usize> = (0..r).filter(|&k| values[k] <= OF_SOLUTION).collect();
    let mut good = vectors.select_cols(&kept);
    for i in 0..r {
        for (c, &k) in kept.iter().enumerate() {
            good[(i, c)] /= values[k].sqrt();
        }
    }
    Ok((scaled.times(&good), scaled.times(&vectors.select_cols(&lost))))
}

/// Coordinates with `forms * base = 1`, which are integers, at the pivots of some independent forms of integers, and
/// what no form sees.
fn coordinates(forms: &Matrix) -> (Matrix, Matrix) {
    let split = Echelon::new(forms.clone(), 0..forms.cols);
    let square = forms.select_cols(&split.pivots);
    let inverse = crate::dense::Lu::new(&square).solve(&Matrix::identity(forms.rows));
    let mut base = Matrix::zeros(forms.cols, forms.rows);
    for (k, &p) in split.pivots.iter().enumerate() {
        for c in 0..forms.rows {
            base[(p, c)] = inverse[(k, c)].round();
        }
    }
    (base, split.kernel())
}

/// The heaviest of some elements, given by their rows, that depend on each other by no loop.
fn heaviest_tree(rows: &Matrix, weights: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..weights.len()).filter(|&k| weights[k] > 0.0).collect();
    order.sort_by(|&i, &j| weights[j].total_cmp(&weights[i]).then(i.cmp(&j)));
    Echelon::new(rows.transpose(), order).pivots
}

/// The kernel in the voltages of sources and of the heaviest tree of resistors, and what neither sees: in the sum of
/// the laws of a part that 1 MOhm joins to the rest, no conductance of its inside is left that the small one is
/// known as well.
fn by_tree(kernel: &Matrix, sources: &Matrix, resistors: &Matrix, conductances: &[f64]) -> Matrix {
    let rows = sources.above(resistors);
    let fixed = std::iter::repeat_n(f64::INFINITY, sources.rows);
    let weights: Vec<f64> = fixed.chain(conductances.iter().copied()).collect();
    let (base, unseen) = coordinates(&rows.select_rows(&heaviest_tree(&rows, &weights)));
    kernel.times(&base.beside(&unseen))
}

/// Which branches store nothing and give the voltage between two nodes: sources.
fn sources(linear: &Linear, inductive: &[usize]) -> Vec<usize> {
    let kinds = &linear.row_kind;
    let mut ends = vec![(0.0, 0, true); kinds.len()];
    for (r, c, v) in linear.g.iter().filter(|e| e.2 != 0.0) {
        let (sum, count, plain) = &mut ends[r];
        *sum += v;
        *count += 1;
        *plain &= kinds[c] == 0 && v.abs() == 1.0;
    }
    let between = |&r: &usize| {
        let (sum, count, plain) = ends[r];
        plain && (count == 1 || count == 2 && sum == 0.0)
    };
    let branches = (0..kinds.len()).filter(|&r| kinds[r] == 1 && !inductive.contains(&r));
    branches.filter(between).collect()
}

impl Network {
    /// Reduces an assembled system; the error says why it cannot be treated.
    pub fn new(sys: &Assembly, inputs: &Inputs) -> Result<Network, String> {
        let (n, m) = (sys.linear.g.nrows, sys.linear.a.ncols);
        // storage: capacitors, and what is left of E on the unknowns of inductors
        let [cap_rows, con_rows] =
            [&sys.capacitors, &sys.conductors].map(|edges| sys.coordinates.rows(edges));
        let other = dense(&sys.coordinates.remainder(&sys.linear.e, &sys.capacitors));
        let size = other.max_abs();
        let asymmetric =
            |x: &Matrix, sign: f64| (0..n).any(|i| (0..i).any(|j| x[(i, j)] != sign * x[(j, i)]));
        if asymmetric(&other, 1.0) {
            return Err("the current of a storage element controls something".into());
        }
        let inductive: Vec<usize> =
            (0..n).filter(|&i| other.row(i).iter().any(|v| *v != 0.0)).collect();
        let unit = Matrix::identity(n);
        let caps = across(&cap_rows, &unit); // one row per capacitor
        let incidence = caps.above(&unit.select_rows(&inductive));
        let weights: Vec<f64> = sys
            .capacitors
            .iter()
            .map(|c| c.2)
            .chain(inductive.iter().map(|&i| other[(i, i)] / size.max(f64::MIN_POSITIVE)))
            .collect();
        if weights.iter().any(|w| w.is_nan() || *w < 0.0) {
            return Err("a capacitance or inductance is negative".into());
        }
        // the tree of the largest elements: M stays well conditioned
        let (base, kernel) =
            coordinates(&incidence.select_rows(&heaviest_tree(&incidence, &weights)));
        let conductances: Vec<f64> = sys.conductors.iter().map(|c| c.2).collect();
        let given = dense(&sys.linear.g).select_rows(&sources(&sys.linear, &inductive));
        let seen = across(&con_rows, &kernel);
        let kernel = by_tree(&kernel, &given.times(&kernel), &seen, &conductances);
        let values: Vec<f64> = sys.capacitors.iter().map(|c| c.2).collect();
        let caps_base = across(&cap_rows, &base);
        let mut energy = weighted(&caps_base, &values, &caps_base);
        energy.add_scaled(1.0, &base.transpose_times(&other.times(&base)));
        let (big_r, silent) = energy_basis(&base, &energy)?;
        let kernel = kernel.beside(&silent);
        let states = big_r.cols;
        let caps_r = across(&cap_rows, &big_r);
        let mut charges = weighted(&caps, &values, &caps_r);
        charges.add_scaled(1.0, &other.times(&big_r));

        // conductances from the elements, so that nothing cancels; the rest is skew if passive
        let skew = dense(&sys.coordinates.remainder(&sys.linear.g, &sys.conductors));
        let (b, at) = (dense(&sys.linear.b), dense(&sys.linear.a).transpose());
        let d = dense(&sys.linear.d);
        let moderate =
            |x: &Matrix| x.data.iter().all(|v| *v == 0.0 || (1e-4..=1e4).contains(&v.abs()));
        let passive = !asymmetric(&skew, -1.0)
            && (0..n).all(|i| skew[(i, i)] == 0.0)
            && moderate(&skew)
            && b == at
            && conductances.iter().all(|g| *g >= 0.0)
            && (0..m).all(|i| d[(i, i)] >= 0.0 && (0..m).all(|j| i == j || d[(i, j)] == 0.0));
        let (gr, gn) = (across(&con_rows, &big_r), across(&con_rows, &kernel));
        let (sr, sn) = (skew.times(&big_r), skew.times(&kernel));
        let both = |x: &Matrix, gx: &Matrix, gy: &Matrix, sy: &Matrix| {
            let mut out = weighted(gx, &conductances, gy);
            out.add_scaled(1.0, &x.transpose_times(sy));
            out
        };
        let basis = Echelon::new(gn.clone(), 0..kernel.cols).kernel();
        // branches couple to nodes alone: no gyrator
        let reciprocal = (0..n).all(|i| {
            (0..n).all(|j| skew[(i, j)] == 0.0 || sys.linear.row_kind[i] != sys.linear.row_kind[j])
        });
        let one_kind = inductive.is_empty()
            || (sys.capacitors.is_empty()
                && inductive.iter().all(|&i| sys.linear.row_kind[i] == 1));
        let bn = b.times(&kernel);
        let n_skew = kernel.transpose_times(&skew);
        let a = at.transpose();
        let s = inputs.columns(&sys.linear.s);
        let symmetric = passive && reciprocal && one_kind;
        let br = b.times(&big_r);
        let steps = symmetric.then(|| Differences::new(br.clone()));
        let loose = Loose {
            skew_basis: n_skew.times(&kernel).times(&basis),
            at_basis: bn.times(&basis),
            basis,
            n_skew,
            at,
        };
        Ok(Network {
            n,
            m,
            states,
            passive,
            split: Split {
                rgr: both(&big_r, &gr, &gr, &sr),
                rgn: both(&big_r, &gr, &gn, &sn),
                ngr: both(&kernel, &gn, &gr, &sr),
                ngn: both(&kernel, &gn, &gn, &sn),
                ra: big_r.transpose_times(&a),
                na: kernel.transpose_times(&a),
                br,
                bn,
            },
            steps,
            loose,
            symmetric,
            inductive: !inductive.is_empty(),
            d,
            q: Matrix::from_fn(m, s.cols, |i, c| if c == 0 { sys.linear.q[i] } else { 0.0 }),
            controls: Vec::new(),
            rs: big_r.transpose_times(&s),
            ns: kernel.transpose_times(&s),
            s,
            big_r,
            charges,
            kernel,
        })
    }

    /// Energy coordinates of charges and fluxes `E z`.
    pub fn energy(&self, charges: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for (i, &q) in charges.iter().enumerate() {
            if q != 0.0 {
                crate::dense::add_scaled(out, q, self.big_r.row(i));
            }
        }
    }
}

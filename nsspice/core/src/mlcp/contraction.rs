//! A mode as a contraction: conducting pairs without resistance join what they connect.
//!
//! In circuits their laws `-B z = r` are sums of voltages.  Solved for the lightest unknowns they leave
//!
//! ```text
//! z = Z y + z0,   W' K Z y = W' (b - K z0),   B Z = 0,   W' A = 0,
//! ```
//!
//! in which the weights of what is joined add up, so that no digits are lost for any values.  The
//! multipliers follow from the laws that were left out; what loops of such pairs leave open stays nearest to
//! zero.

use super::model::Model;
use crate::dense::{equilibrate, Echelon, LeastNorm, Lu, Matrix};
use crate::rounding::OF_SOLUTION;
use crate::sparse::Csc;

/// Unknowns and pairs beyond which dense matrices take too long.
pub(crate) const MOST: usize = 400;
/// Numbers of work space for each unknown and pair that a step needs.
pub(crate) const STEP_WORK: usize = 5;

/// The laws of joined pairs, solved for some unknowns.
struct Joined {
    /// unknowns (rows) that they determine, and the others
    pivots: Vec<usize>,
    free: Vec<usize>,
    /// what the former are of the latter
    of_free: Matrix,
    /// and of the right-hand sides
    of_laws: Matrix,
    /// combinations of laws that vanish: the loops
    loops: Matrix,
}

impl Joined {
    /// `laws`, a row for each pair, solved for unknowns that come early in `order`.
    fn new(laws: &Matrix, order: &[usize]) -> Joined {
        let (count, n) = (laws.rows, laws.cols);
        let both = laws.beside(&Matrix::identity(count));
        let found = Echelon::new(both, order.iter().copied().chain(n..n + count));
        let rank = found.pivots.iter().take_while(|&&c| c < n).count();
        let free: Vec<usize> = found.free.iter().copied().filter(|&c| c < n).collect();
        let rows: Vec<usize> = (0..rank).collect();
        let rest: Vec<usize> = (rank..found.pivots.len()).collect();
        let solved = found.reduced.select_rows(&rows);
        Joined {
            pivots: found.pivots[..rank].to_vec(),
            of_free: solved.select_cols(&free),
            of_laws: solved.columns(n, count),
            loops: found.reduced.select_rows(&rest).columns(n, count),
            free,
        }
    }
}

impl Joined {
    /// The same of laws with the opposite sign: each is to be taken that way round in what solves them.
    fn negated(&self) -> Joined {
        let mut of_laws = self.of_laws.clone();
        of_laws.data.iter_mut().for_each(|v| *v = -*v);
        let (pivots, free) = (self.pivots.clone(), self.free.clone());
        let (of_free, loops) = (self.of_free.clone(), self.loops.clone());
        Joined { pivots, free, of_free, of_laws, loops }
    }
}

/// What solves the contracted equations.
enum Solver {
    Regular(Lu),
    Singular(LeastNorm, Vec<f64>, Vec<f64>),
}

/// One mode, contracted.
pub(crate) struct Contraction {
    n: usize,
    /// conducting pairs without resistance, and the other conducting ones
    joined: Vec<usize>,
    others: Vec<usize>,
    /// unknowns by the laws of pairs, laws by the places of their multipliers
    unknowns: Joined,
    laws: Joined,
    solver: Solver,
    /// of loops: `(N N')^-1 N`
    share: Option<Matrix>,
    size: usize,
}

impl Contraction {
    /// Contracts a mode; nothing if its pairs have other laws than sums, whose ranks are no matter of integers,
    /// or do not act where they are meant to.
    pub fn new(model: &Model, active: &[bool]) -> Option<Contraction> {
        let (n, size) = (model.n, model.size());
        if !model.h.values.iter().all(|v| v.is_finite()) {
            return None;
        }
        let mut resists = vec![false; model.m];
        let mut weights = vec![0.0; n];
        let mut own = vec![false; n];
        for (r, c, v) in model.h.iter().filter(|e| e.2 != 0.0) {
            if r >= n && c >= n {
                (resists[r - n], resists[c - n]) = (true, true);
            } else if r == c {
                weights[r] = v.abs();
                own[r] = true;
            }
        }
        // what a source fixes is the heaviest
        for (_, c, _) in model
            .h
            .iter()
            .filter(|&(r, c, v)| r < n && c < n && v != 0.0 && model.kind(r) == 1 && !own[r])
        {
            weights[c] = f64::INFINITY;
        }
        let of = |resists_too: bool| -> Vec<usize> {
            (0..model.m).filter(|&i| active[i] && resists[i] == resists_too).collect()
        };
        let (joined, others) = (of(false), of(true));
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&a, &b| weights[a].total_cmp(&weights[b]));
        let (mut b, mut a) = (Matrix::zeros(joined.len(), n), Matrix::zeros(joined.len(), n));
        let mut place = vec![None; model.m];
        joined.iter().enumerate().for_each(|(k, &i)| place[i] = Some(k));
        for (r, c, v) in model.h.iter() {
            if let (true, Some(k)) =
                (r >= n && c < n, place.get(r.wrapping_sub(n)).copied().flatten())
            {
                b[(k, c)] = v;
            }
            if let (true, Some(k)) =
                (r < n && c >= n, place.get(c.wrapping_sub(n)).copied().flatten())
            {
                a[(k, r)] = v;
            }
        }
        if b.data.iter().chain(&a.data).any(|v| *v != 0.0 && v.abs() != 1.0) {
            return None;
        }
        let unknowns = Joined::new(&b, &order);
        let reciprocal = a.data.iter().zip(&b.data).all(|(a, b)| *a == -b);
        let laws = if reciprocal { unknowns.negated() } else { Joined::new(&a, &order) };
        if unknowns.free.len() != laws.free.len() {
            return None;
        }
        let reduced = contract(model, &unknowns, &laws, &others);
        let lu = Lu::new(&reduced);
        let solver = if lu.ratio > OF_SOLUTION {
            Solver::Regular(lu)
        } else {
            let (row, column) = equilibrate(&reduced);
            let mut entries = Vec::new();
            for (r, scale) in row.iter().enumerate() {
                for (c, &v) in reduced.row(r).iter().enumerate().filter(|e| *e.1 != 0.0) {
                    entries.push((r, c, v * scale * column[c]));
                }
            }
            let scaled = Csc::from_triplets(reduced.rows, reduced.cols, &entries);
            Solver::Singular(LeastNorm::new(&scaled)?, row, column)
        };
        let loops = &laws.loops;
        let share = if loops.rows > 0 {
            let gram = loops.times(&loops.transpose());
            Some(Lu::new(&gram).solve(loops))
        } else {
            None
        };
        Some(Contraction { n, joined, others, unknowns, laws, solver, share, size })
    }

    /// The least change that makes up for a defect of the laws, in its place; defects of pairs that block are zero.
    /// `work` holds [`STEP_WORK`] numbers for each unknown and pair.
    pub fn step(&self, model: &Model, defect: &mut [f64], work: &mut [f64]) {
        let (n, size, unknowns, laws) = (self.n, self.size, &self.unknowns, &self.laws);
        let (x, work) = work.split_at_mut(size);
        let (left, work) = work.split_at_mut(size);
        let (right, work) = work.split_at_mut(size);
        let (some, work) = work.split_at_mut(size);
        x.fill(0.0);
        gather(&self.joined, |i| defect[n + i], right);
        let solved = &mut some[..unknowns.pivots.len()];
        unknowns.of_laws.apply(&right[..self.joined.len()], solved);
        unknowns.pivots.iter().zip(&*solved).for_each(|(&p, v)| x[p] = *v);
        left.copy_from_slice(defect);
        model.h.mul_add(-1.0, x, left);
        // W' of what is left, then the pairs with resistance
        let count = laws.free.len();
        gather(&laws.pivots, |p| left[p], some);
        laws.of_free.apply_transposed(&some[..laws.pivots.len()], &mut right[..count]);
        right.iter_mut().zip(&laws.free).for_each(|(away, &f)| *away = left[f] - *away);
        gather(&self.others, |i| left[n + i], &mut right[count..]);
        let y = &mut right[..count + self.others.len()];
        self.solver.solve(y, some, work);
        let (y, l) = y.split_at(count);
        let more = &mut some[..unknowns.pivots.len()];
        unknowns.of_free.apply(y, more);
        unknowns.free.iter().zip(y).for_each(|(&f, v)| x[f] = *v);
        unknowns.pivots.iter().zip(&*more).for_each(|(&p, v)| x[p] -= v);
        self.others.iter().zip(l).for_each(|(&i, v)| x[n + i] = *v);
        left.copy_from_slice(defect);
        model.h.mul_add(-1.0, x, left);
        gather(&laws.pivots, |p| left[p], some);
        let l = &mut right[..self.joined.len()];
        laws.of_laws.apply_transposed(&some[..laws.pivots.len()], l);
        if let Some(share) = &self.share {
            let (around, turned) = (&mut some[..share.rows], &mut left[..l.len()]);
            share.apply(l, around);
            laws.loops.apply_transposed(around, turned);
            l.iter_mut().zip(&*turned).for_each(|(l, turned)| *l -= turned);
        }
        self.joined.iter().zip(&*l).for_each(|(&i, v)| x[n + i] = *v);
        defect.copy_from_slice(x);
    }
}

/// The values of some places, into the front of `out`.
fn gather(places: &[usize], value: impl Fn(usize) -> f64, out: &mut [f64]) {
    out.iter_mut().zip(places).for_each(|(out, &place)| *out = value(place));
}

/// The equations of the unknowns that are left and of the multipliers of pairs with resistance.
fn contract(model: &Model, unknowns: &Joined, laws: &Joined, others: &[usize]) -> Matrix {
    let n = model.n;
    let size = unknowns.free.len() + others.len();
    // by columns: all laws of what one unknown moves
    let mut column = vec![None; model.size()];
    unknowns.free.iter().enumerate().for_each(|(k, &f)| column[f] = Some(k));
    others.iter().enumerate().for_each(|(k, &i)| column[n + i] = Some(unknowns.free.len() + k));
    let mut pivot = vec![None; n];
    unknowns.pivots.iter().enumerate().for_each(|(k, &p)| pivot[p] = Some(k));
    let mut moved = Matrix::zeros(model.size(), size);
    for (r, c, v) in model.h.iter().filter(|e| e.2 != 0.0) {
        if let Some(k) = column[c] {
            moved[(r, k)] += v;
        } else if let Some(p) = pivot.get(c).copied().flatten() {
            let row = unknowns.of_free.row(p);
            moved.row_mut(r)[..row.len()].iter_mut().zip(row).for_each(|(m, t)| *m -= v * t);
        }
    }
    let mut rows = moved.select_rows(&laws.free);
    for (k, &p) in laws.pivots.iter().enumerate() {
        for f in 0..laws.free.len() {
            let part = laws.of_free[(k, f)];
            if part != 0.0 {
                rows.row_mut(f).iter_mut().zip(moved.row(p)).for_each(|(r, m)| *r -= part * m);
            }
        }
    }
    let pairs: Vec<usize> = others.iter().map(|&i| n + i).collect();
    rows.above(&moved.select_rows(&pairs))
}

impl Solver {
    /// Solves in place; both work spaces are at least as long as the right-hand side.
    fn solve(&self, right: &mut [f64], some: &mut [f64], work: &mut [f64]) {
        match self {
            Solver::Regular(lu) => lu.solve_one(right, some),
            Solver::Singular(pseudo, row, column) => {
                right.iter_mut().zip(row).for_each(|(r, s)| *r *= s);
                let x = &mut some[..right.len()];
                x.fill(0.0);
                pseudo.correct(right, x, work);
                right.iter_mut().zip(&*x).zip(column).for_each(|((r, x), s)| *r = x * s);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mlcp::Problem;

    /// Tree voltages 0 and 1 with conductances, and a source of `kind` 1 that fixes voltage 2 by its current 3;
    /// pairs across 0, across 0 once more, and across 0 and 1 together with a resistance.
    fn network(conductances: [f64; 2]) -> Model {
        let [g, h] = conductances;
        let k = [(0, 0, g), (1, 1, h), (2, 3, 1.0), (3, 2, -1.0)];
        let laws = [(0, 0, 1.0), (1, 0, -1.0), (2, 0, 1.0), (2, 1, 1.0)];
        let turned: Vec<_> = laws.iter().map(|&(r, c, v)| (c, r, v)).collect();
        Model::new(Problem {
            k: Csc::from_triplets(4, 4, &k),
            a: Csc::from_triplets(4, 3, &turned),
            b: Csc::from_triplets(3, 4, &laws),
            d: Csc::from_triplets(3, 3, &[(2, 2, 0.5)]),
            row_kind: vec![0, 0, 0, 1],
        })
    }

    /// `H x` with the rows of pairs as laws of a mode.
    fn laws(model: &Model, active: &[bool], x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; model.size()];
        model.h.mul_add(1.0, x, &mut out);
        for (i, _) in active.iter().enumerate().filter(|(_, &a)| !a) {
            out[model.n + i] = x[model.n + i];
        }
        out
    }

    #[test]
    fn pairs_beside_each_other_share_and_the_laws_hold() {
        for conductances in [[1.0, 2.0], [1e-9, 1e9], [1e12, 1e-12], [0.0, 3.0]] {
            let model = network(conductances);
            let active = [true, true, true];
            let mode = Contraction::new(&model, &active).unwrap();
            let right = [3.0, 5.0, 7.0, -2.0, 0.0, 0.0, 0.25];
            let mut x = right.to_vec();
            mode.step(&model, &mut x, &mut vec![0.0; STEP_WORK * right.len()]);
            let found = laws(&model, &active, &x);
            let sizes = right.map(f64::abs).into_iter().fold(0.0, f64::max);
            for (found, right) in found.iter().zip(right) {
                assert!((found - right).abs() <= 1e-14 * sizes, "{conductances:?} {x:?}");
            }
            // against each other around their loop: each takes half
            assert!((x[4] + x[5]).abs() <= 1e-14 * x[4].abs().max(1.0), "{x:?}");
            assert_eq!(x[2], 2.0);
        }
    }

    #[test]
    fn what_nothing_holds_stays_where_it_is() {
        // a blocking pair alone leads to voltage 1
        let model = network([2.0, 0.0]);
        let active = [true, false, false];
        let mode = Contraction::new(&model, &active).unwrap();
        let mut x = [4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        mode.step(&model, &mut x, &mut [0.0; 7 * STEP_WORK]);
        assert_eq!(x, [0.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0]);
    }
}

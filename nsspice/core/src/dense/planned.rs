//! LU factorisation of small matrices of one pattern, which are factorised again and again: a list of operations.
//!
//! A block of ten equations of a circuit has some thirty entries, and elimination in a good order fills in a few more:
//! sixty multiplications instead of three hundred.  Pivots are chosen for few of them among those that are at least a
//! part [`LEAST`] of their column (threshold pivoting: I. S. Duff, A. M. Erisman, J. K. Reid, *Direct Methods for Sparse
//! Matrices*, 2nd ed., Oxford 2017, sections 5.2 and 7.2), and serve as long as they are.

use crate::tolerances::CLEARLY;

/// A pivot serves unless it is clearly less than what partial pivoting would take in its column.
const LEAST: f64 = CLEARLY;

/// One pivot: its place, the places below it, and `a[target] -= a[below] * a[right]` for each pair of an entry below it
/// and one to its right; places are those of a matrix column by column.
#[derive(Clone, Debug)]
struct Pivot {
    at: u32,
    below: Vec<u32>,
    updates: Vec<[u32; 3]>,
}

/// Operations of elimination and substitution.
#[derive(Clone, Debug, Default)]
struct Plan {
    pivots: Vec<Pivot>,
    /// row and column of each pivot
    rows: Vec<u32>,
    columns: Vec<u32>,
    /// `y[target] -= a[at] * y[source]`, first down and then, for each pivot, up
    down: Vec<[u32; 3]>,
    up: Vec<Vec<[u32; 2]>>,
}

/// The matrix that is left of a plan in the making: numbers, where entries may be, and which rows and columns are free.
struct Rest {
    n: usize,
    a: Vec<f64>,
    there: Vec<bool>,
    free: [Vec<usize>; 2],
}

impl Rest {
    /// The pivot, row and column, that fills in least; None if no column has one.
    fn choose(&self) -> Option<[usize; 2]> {
        let [rows, columns] = &self.free;
        let is_there = |r: usize, c: usize| self.there[c * self.n + r];
        let mut best: Option<(usize, [usize; 2])> = None;
        for &c in columns {
            let size = |r: usize| self.a[c * self.n + r].abs();
            let largest = rows.iter().fold(0.0f64, |most, &r| most.max(size(r)));
            let height = rows.iter().filter(|&&r| is_there(r, c)).count();
            for &r in rows.iter().filter(|&&r| size(r) > 0.0 && size(r) >= LEAST * largest) {
                let width = columns.iter().filter(|&&c| is_there(r, c)).count();
                let fills = (height - 1) * (width - 1);
                if best.is_none_or(|(least, _)| fills < least) {
                    best = Some((fills, [r, c]));
                }
            }
        }
        best.map(|(_, pivot)| pivot)
    }

    /// Eliminates with a pivot, and says how.
    fn eliminate(&mut self, [row, column]: [usize; 2]) -> Pivot {
        self.free[0].retain(|&r| r != row);
        self.free[1].retain(|&c| c != column);
        let n = self.n;
        let place = |r: usize, c: usize| c * n + r;
        let below = self.free[0].iter().copied().filter(|&r| self.there[place(r, column)]);
        let below: Vec<usize> = below.collect();
        let right = self.free[1].iter().copied().filter(|&c| self.there[place(row, c)]);
        let right: Vec<usize> = right.collect();
        let reciprocal = 1.0 / self.a[place(row, column)];
        below.iter().for_each(|&r| self.a[place(r, column)] *= reciprocal);
        let mut updates = Vec::new();
        for &c in &right {
            for &r in &below {
                let [target, left, right] = [place(r, c), place(r, column), place(row, c)];
                self.there[target] = true;
                self.a[target] -= self.a[left] * self.a[right];
                updates.push([target, left, right].map(|at| at as u32));
            }
        }
        let below = below.iter().map(|&r| place(r, column) as u32).collect();
        Pivot { at: place(row, column) as u32, below, updates }
    }
}

impl Plan {
    /// For a matrix and the places where there may be entries; None if it has no inverse.
    fn new(n: usize, a: &[f64], there: &[bool]) -> Option<Plan> {
        let all: Vec<usize> = (0..n).collect();
        let mut rest = Rest { n, a: a.to_vec(), there: there.to_vec(), free: [all.clone(), all] };
        let (mut plan, mut order) = (Plan::default(), vec![0; n]);
        for k in 0..n {
            let pivot = rest.choose()?;
            plan.rows.push(pivot[0] as u32);
            plan.columns.push(pivot[1] as u32);
            order[pivot[0]] = k;
            plan.pivots.push(rest.eliminate(pivot));
        }
        for (k, pivot) in plan.pivots.iter().enumerate() {
            let below = pivot.below.iter();
            plan.down.extend(below.map(|&at| [order[at as usize % n] as u32, at, k as u32]));
            let column = plan.columns[k] as usize;
            let rows = (0..n).filter(|&r| order[r] < k && rest.there[column * n + r]);
            plan.up.push(rows.map(|r| [order[r] as u32, (column * n + r) as u32]).collect());
        }
        Some(plan)
    }
}

/// Factors of matrices of one pattern.
#[derive(Clone, Debug, Default)]
pub struct PlannedLu {
    n: usize,
    there: Vec<bool>,
    a: Vec<f64>,
    /// reciprocals of the pivots
    inverse: Vec<f64>,
    extremes: [f64; 2],
    plan: Option<Plan>,
    /// how often it has been made
    plans: u64,
}

impl PlannedLu {
    /// For matrices of `n` columns with entries where `there` says so, column by column.
    pub fn new(n: usize, there: Vec<bool>) -> PlannedLu {
        let (a, inverse) = (vec![0.0; n * n], vec![0.0; n]);
        PlannedLu { n, there, a, inverse, ..PlannedLu::default() }
    }

    /// Factorises a matrix, which `fill` writes column by column; false if it has no inverse, or entries that are no
    /// numbers.
    pub fn factor_by(&mut self, fill: impl Fn(&mut [f64])) -> bool {
        fill(&mut self.a);
        if self.eliminate() {
            return true;
        }
        fill(&mut self.a);
        self.plan = Plan::new(self.n, &self.a, &self.there);
        self.plans += 1;
        self.eliminate()
    }

    /// Eliminates as planned; false if there is no plan, or it does not serve this matrix.
    fn eliminate(&mut self) -> bool {
        let Some(plan) = &self.plan else { return false };
        let a = &mut self.a[..];
        let (mut least, mut greatest) = (f64::INFINITY, 0.0f64);
        for (pivot, inverse) in plan.pivots.iter().zip(&mut self.inverse) {
            let own = a[pivot.at as usize];
            let (size, reciprocal) = (own.abs(), 1.0 / own);
            let mut largest = size;
            for &at in &pivot.below {
                let entry = &mut a[at as usize];
                let own = entry.abs();
                largest = if own <= largest { largest } else { own }; // also if it is no number
                *entry *= reciprocal;
            }
            // also if so small that its reciprocal overflows
            let serves = size >= LEAST * largest && reciprocal.is_finite() && size.is_finite();
            if !serves {
                return false;
            }
            *inverse = reciprocal;
            (least, greatest) = (least.min(size), greatest.max(size));
            for &[target, below, right] in &pivot.updates {
                a[target as usize] -= a[below as usize] * a[right as usize];
            }
        }
        self.extremes = [least, greatest];
        true
    }

    /// Sizes of the least and the largest pivot; infinity and zero for the empty matrix.
    pub fn extremes(&self) -> [f64; 2] {
        self.extremes
    }

    /// `x := A^-1 x` for the matrix factorised last, which has an inverse; `y` is scratch of the same length.
    pub fn solve(&self, x: &mut [f64], y: &mut [f64]) {
        let Some(plan) = &self.plan else { return };
        let y = &mut y[..self.n];
        for (y, &row) in y.iter_mut().zip(&plan.rows) {
            *y = x[row as usize];
        }
        for &[target, at, source] in &plan.down {
            y[target as usize] -= self.a[at as usize] * y[source as usize];
        }
        for (k, up) in plan.up.iter().enumerate().rev() {
            let own = y[k] * self.inverse[k];
            x[plan.columns[k] as usize] = own;
            for &[target, at] in up {
                y[target as usize] -= self.a[at as usize] * own;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rounding::of_elimination;

    /// Numbers between -1 and 1 by a linear congruential generator.
    fn random(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn times(n: usize, a: &[f64], x: &[f64]) -> Vec<f64> {
        (0..n).map(|r| (0..n).map(|c| a[c * n + r] * x[c]).sum()).collect()
    }

    fn sizes(v: &[f64]) -> Vec<f64> {
        v.iter().map(|v| v.abs()).collect()
    }

    /// Sparse matrices whose steep column changes are solved as the definition says: the residual is that of elimination,
    /// whose entries grow by `1 + 1 / LEAST` with each pivot that changes a column at the most, here of few.
    #[test]
    fn solutions_obey_the_equations() {
        let mut state = 7;
        for n in 1..14usize {
            let filled = |state: &mut u64, at: usize| at % n == at / n || random(state) > 0.3;
            let there: Vec<bool> = (0..n * n).map(|at| filled(&mut state, at)).collect();
            let mut lu = PlannedLu::new(n, there.clone());
            let rounds = 40;
            for round in 0..rounds {
                let steep = |at: usize| if at / n == round / 8 { 1e6 } else { 1.0 };
                let entry = |(at, there): (usize, &bool)| match there {
                    true if at % n == at / n => 4.0 * steep(at),
                    true => steep(at) * random(&mut state),
                    false => 0.0,
                };
                let a: Vec<f64> = there.iter().enumerate().map(entry).collect();
                assert!(lu.factor_by(|out| out.copy_from_slice(&a)));
                let x: Vec<f64> = (0..n).map(|_| random(&mut state)).collect();
                let b = times(n, &a, &x);
                let mut found = b.clone();
                lu.solve(&mut found, &mut vec![0.0; n]);
                let back = times(n, &a, &found);
                let terms = times(n, &sizes(&a), &sizes(&found));
                let largest = terms.iter().fold(0.0f64, |most, v| most.max(*v));
                for (back, b) in back.iter().zip(&b) {
                    assert!((back - b).abs() <= of_elimination(n) * largest, "{n} {round}");
                }
            }
            assert!(lu.plans < rounds as u64, "{n}: a plan serves for more than one matrix");
        }
    }

    /// A matrix whose pivot has vanished is factorised with others; one without an inverse, or with an entry that is no
    /// number, is reported.
    #[test]
    fn a_plan_that_does_not_serve_is_left() {
        let mut lu = PlannedLu::new(2, vec![true; 4]);
        let factor = |lu: &mut PlannedLu, a: [f64; 4]| lu.factor_by(|out| out.copy_from_slice(&a));
        assert!(factor(&mut lu, [4.0, 1.0, 1.0, 3.0]) && factor(&mut lu, [4.0, 1.0, 1.0, 2.0]));
        assert_eq!(lu.plans, 1);
        assert!(factor(&mut lu, [0.0, 1.0, 1.0, 3.0]));
        assert_eq!(lu.plans, 2);
        let mut x = [1.0, 4.0];
        lu.solve(&mut x, &mut [0.0; 2]);
        assert_eq!(x, [1.0, 1.0]);
        assert!(!factor(&mut lu, [1.0, 1.0, 1.0, 1.0]));
        assert!(!factor(&mut lu, [f64::NAN, 1.0, 1.0, 3.0]));
        assert!(factor(&mut lu, [4.0, 1.0, 1.0, 3.0]));
    }
}

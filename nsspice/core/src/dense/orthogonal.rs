//! Householder triangularisation with column pivoting.

/// `A[:, order] = Q R` of an `m x n` matrix stored by columns.
pub(super) struct Triangularisation {
    m: usize,
    /// `R` above the diagonal, the Householder vectors on and below it
    a: Vec<f64>,
    /// diagonal of `R`
    diagonal: Vec<f64>,
    /// original number of each column
    pub order: Vec<usize>,
    /// number of columns triangularised before all that was left fell under the tolerance
    pub rank: usize,
}

impl Triangularisation {
    /// Takes at each step the column of which most is left (Businger & Golub 1965), until less than
    /// `tolerance` times the first diagonal entry is left of any.  The diagonal then decays like the
    /// singular values, up to factors that grow slowly with the size.
    pub fn new(mut a: Vec<f64>, m: usize, n: usize, tolerance: f64) -> Self {
        let mut order: Vec<usize> = (0..n).collect();
        let mut diagonal = Vec::with_capacity(m.min(n));
        for k in 0..m.min(n) {
            // recomputed at every step: cheap compared with the updates, and free of the cancellation
            // that spoils norms kept by downdating
            let left = |c: usize| norm(&a[c * m + k..(c + 1) * m]);
            let (mut best, mut largest) = (k, left(k));
            for c in k + 1..n {
                let size = left(c);
                if size > largest {
                    (best, largest) = (c, size);
                }
            }
            let first = diagonal.first().map_or(largest, |d: &f64| d.abs());
            if largest <= tolerance * first {
                break;
            }
            order.swap(k, best);
            for i in 0..m {
                a.swap(k * m + i, best * m + i);
            }
            let (done, rest) = a.split_at_mut((k + 1) * m);
            let v = &mut done[k * m + k..];
            // a unit vector: `I - 2 v v'` maps the column to a multiple of the first axis
            let target = if v[0] > 0.0 { -largest } else { largest };
            v[0] -= target;
            let length = norm(v);
            v.iter_mut().for_each(|x| *x /= length);
            rest.chunks_exact_mut(m).for_each(|column| reflect(v, &mut column[k..]));
            diagonal.push(target);
        }
        Triangularisation { m, a, rank: diagonal.len(), diagonal, order }
    }

    /// Entry of `R` in row `r < rank`, column `c >= r` (in the order of elimination).
    pub fn r(&self, r: usize, c: usize) -> f64 {
        if r == c {
            self.diagonal[r]
        } else {
            self.a[c * self.m + r]
        }
    }

    fn reflector(&self, k: usize) -> &[f64] {
        &self.a[k * self.m + k..(k + 1) * self.m]
    }

    /// `x := Q x`
    pub fn rotate(&self, x: &mut [f64]) {
        (0..self.rank).rev().for_each(|k| reflect(self.reflector(k), &mut x[k..]));
    }

    /// `x := Q' x`
    pub fn rotate_back(&self, x: &mut [f64]) {
        (0..self.rank).for_each(|k| reflect(self.reflector(k), &mut x[k..]));
    }

    /// `x := R'^-1 x` with the leading `rank` rows and columns of `R`.
    pub fn solve_transpose(&self, x: &mut [f64]) {
        for c in 0..self.rank {
            let column = &self.a[c * self.m..c * self.m + c];
            x[c] = (x[c] - dot(column, x)) / self.diagonal[c];
        }
    }
}

/// `x -= 2 v (v' x)`
fn reflect(v: &[f64], x: &mut [f64]) {
    let f = 2.0 * dot(v, x);
    if f != 0.0 {
        x.iter_mut().zip(v).for_each(|(x, v)| *x -= f * v);
    }
}

/// Four partial sums: a single one would make every addition wait for the last.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0f64; 4];
    let (a4, b4) = (a.chunks_exact(4), b[..a.len()].chunks_exact(4));
    let rest: f64 = a4.remainder().iter().zip(b4.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a4.zip(b4) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Euclidean norm; scaled where squares would overflow or vanish.
fn norm(v: &[f64]) -> f64 {
    let squares = dot(v, v);
    if (1e-200..1e200).contains(&squares) {
        return squares.sqrt();
    }
    let largest = v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    if largest == 0.0 {
        return 0.0;
    }
    largest * v.iter().map(|x| (x / largest) * (x / largest)).sum::<f64>().sqrt()
}

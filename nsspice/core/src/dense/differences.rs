//! A matrix whose rows differ little from one another, as the cut voltages of neighbouring elements do.

use super::matrix::{add_scaled, norm, Matrix};

/// So many times as many terms make a product of tiles faster than one by terms.
const WORTH: usize = 4;

/// How one row follows from another.
struct Link {
    row: usize,
    /// an earlier row, and the sign with which it enters
    parent: Option<(usize, f64)>,
    /// what is added to it: column, factor
    terms: Vec<(usize, f64)>,
}

/// Rows as differences, or as they are where that is shorter.
enum Form {
    Links(Vec<Link>),
    Full,
}

/// The matrix.
pub struct Differences {
    form: Form,
    rows: Matrix,
}

impl Differences {
    /// Links each row to the shorter one (by norm, so that no rounding grows) next to it.
    pub fn new(rows: Matrix) -> Differences {
        let norms: Vec<f64> = (0..rows.rows).map(|r| norm(rows.row(r))).collect();
        let mut order: Vec<usize> = (0..rows.rows).collect();
        order.sort_by(|&i, &j| norms[i].total_cmp(&norms[j]).then(i.cmp(&j)));
        let mut links: Vec<Link> = Vec::with_capacity(rows.rows);
        for (at, &r) in order.iter().enumerate() {
            let row = rows.row(r);
            let mut least = row.iter().filter(|v| **v != 0.0).count();
            let mut parent = None;
            for &p in &order[..at] {
                for sign in [1.0, -1.0] {
                    let pairs = row.iter().zip(rows.row(p));
                    let unlike = pairs.filter(|(x, y)| **x != sign * **y).take(least).count();
                    if unlike < least {
                        (least, parent) = (unlike, Some((p, sign)));
                    }
                }
            }
            let old = |c: usize| parent.map_or(0.0, |(p, sign): (usize, f64)| sign * rows[(p, c)]);
            let terms = row.iter().enumerate().map(|(c, v)| (c, v - old(c)));
            links.push(Link { row: r, parent, terms: terms.filter(|t| t.1 != 0.0).collect() });
        }
        let count: usize = links.iter().map(|l| l.terms.len() + 1).sum();
        let form = if WORTH * count < rows.data.len() { Form::Links(links) } else { Form::Full };
        Differences { form, rows }
    }

    /// The product with a full matrix.
    pub fn product(&self, other: &Matrix) -> Matrix {
        let Form::Links(links) = &self.form else {
            return self.rows.product(other);
        };
        assert_eq!(self.rows.cols, other.rows, "matrices do not fit");
        let mut out = Matrix::zeros(self.rows.rows, other.cols);
        let mut sum = vec![0.0; other.cols];
        for link in links {
            match link.parent {
                Some((p, sign)) => {
                    sum.iter_mut().zip(out.row(p)).for_each(|(s, v)| *s = sign * v);
                }
                None => sum.fill(0.0),
            }
            for &(c, f) in &link.terms {
                add_scaled(&mut sum, f, other.row(c));
            }
            out.row_mut(link.row).copy_from_slice(&sum);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_by_differences_are_products() {
        // nested sums with changing signs, a full row, an empty one
        let nested = Matrix::from_fn(40, 60, |r, c| match r {
            38 => 0.0,
            39 => ((c * 7) % 5) as f64 + 0.5,
            _ if c > r => 0.0,
            _ => [1.0, -1.0][r % 2] / (1.0 + c as f64),
        });
        let full = Matrix::from_fn(40, 60, |r, c| ((r * 13 + c * 29) % 17) as f64 - 8.0);
        let other = Matrix::from_fn(60, 23, |r, c| ((r * 5 + c * 11) % 19) as f64 - 9.0);
        for (a, linked) in [(nested, true), (full, false)] {
            let truth = a.times(&other);
            let found = Differences::new(a);
            assert_eq!(matches!(found.form, Form::Links(_)), linked);
            let product = found.product(&other);
            for (x, y) in product.data.iter().zip(&truth.data) {
                assert!((x - y).abs() < 1e-13 * truth.max_abs());
            }
        }
    }
}

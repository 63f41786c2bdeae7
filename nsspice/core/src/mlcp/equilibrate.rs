//! Symmetric scaling: the same factor for row i and column i keeps a problem monotone.

use crate::sparse::Csc;

const SWEEPS: usize = 12;

/// Factors `d`, powers of two, such that the largest entry of each row and column of
/// `diag(d) matrix diag(d)` is near one (Ruiz' iteration).
///
/// Powers of two make scaling and unscaling exact.  Rows and columns without entries keep 1.
pub(crate) fn ruiz(matrix: &Csc) -> Vec<f64> {
    let n = matrix.nrows;
    let mut d = vec![1.0f64; n];
    let mut largest = vec![0.0f64; n];
    for _ in 0..SWEEPS {
        largest.fill(0.0);
        for (r, c, v) in matrix.iter() {
            let size = (d[r] * v * d[c]).abs();
            largest[r] = largest[r].max(size);
            largest[c] = largest[c].max(size);
        }
        for (f, &big) in d.iter_mut().zip(&largest) {
            if big > 0.0 && big.is_finite() {
                *f /= big.sqrt();
            }
        }
    }
    for f in &mut d {
        *f = f.log2().round().clamp(-250.0, 250.0).exp2();
    }
    d
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_ranges_come_close_to_one() {
        let m = Csc::from_triplets(
            3,
            3,
            &[(0, 0, 1e-12), (0, 1, 1.0), (1, 0, -1.0), (1, 1, 1e9), (2, 2, 3e-7)],
        );
        let d = ruiz(&m);
        let mut largest = [0.0f64; 3];
        for (r, c, v) in m.iter() {
            largest[r] = largest[r].max((d[r] * v * d[c]).abs());
        }
        assert!(largest.iter().all(|&x| x > 0.2 && x < 5.0), "{largest:?}");
    }

    #[test]
    fn factors_are_powers_of_two_and_empty_rows_keep_one() {
        let m = Csc::from_triplets(2, 2, &[(0, 0, 7.3)]);
        let d = ruiz(&m);
        assert_eq!(d[1], 1.0);
        assert_eq!(d[0].log2().fract(), 0.0);
    }
}

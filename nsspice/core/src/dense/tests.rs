use super::{DenseLu, LeastNorm};
use crate::sparse::examples::{circuit, floating_with_a_source, random, Rng, ORDERS};
use crate::sparse::{Csc, Ordering};
use nalgebra::{DMatrix, DVector};

fn dense(a: &Csc) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(a.nrows, a.ncols);
    a.iter().for_each(|(r, c, v)| out[(r, c)] = v);
    out
}

/// The operator that `correct` applies to the right-hand side from the origin.
fn pseudo_inverse(l: &LeastNorm, rows: usize, columns: usize) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(columns, rows);
    let mut work = vec![0.0; rows];
    for r in 0..rows {
        let mut rhs = vec![0.0; rows];
        rhs[r] = 1.0;
        l.correct(&rhs, out.column_mut(r).as_mut_slice(), &mut work);
    }
    out
}

/// The four conditions that define the Moore-Penrose inverse.
fn assert_penrose(a: &Csc, tolerance: f64) -> LeastNorm {
    let l = LeastNorm::new(a).unwrap();
    let (a, p) = (dense(a), pseudo_inverse(&l, a.nrows, a.ncols));
    let (ap, pa) = (&a * &p, &p * &a);
    let size = a.norm() * p.norm() + 1.0; // condition number: the relative error of P grows with it
    for (name, error, scale) in [
        ("A P A = A", (&ap * &a - &a).norm(), a.norm() * size),
        ("P A P = P", (&pa * &p - &p).norm(), p.norm() * size * size),
        ("A P symmetric", (&ap - ap.transpose()).norm(), size * size),
        ("P A symmetric", (&pa - pa.transpose()).norm(), size * size),
    ] {
        assert!(error <= tolerance * scale, "{name}: {error:e} of {scale:e}");
    }
    l
}

#[test]
fn elimination_agrees_with_nalgebra() {
    let mut rng = Rng(7);
    for trial in 0..300 {
        let n = 1 + rng.below(40);
        let a = random(&mut rng, n, 1 + trial % 4);
        let f = DenseLu::new(&a);
        if f.pivot_ratio() < 1e-8 {
            continue;
        }
        let b = rng.vector(n);
        let right = DVector::from_column_slice(&b);
        let mut x = b.clone();
        f.solve(&mut x).unwrap();
        let expected = dense(&a).lu().solve(&right).unwrap();
        let error = (DVector::from_vec(x) - &expected).norm();
        assert!(error < 1e-13 / f.pivot_ratio() * expected.norm(), "{trial}: {error:e}");
    }
}

#[test]
fn singular_and_degenerate_matrices() {
    assert_eq!(DenseLu::new(&Csc::zeros(0, 0)).pivot_ratio(), 1.0);
    let f = DenseLu::new(&Csc::from_triplets(2, 2, &[(0, 0, 1.0), (1, 0, 2.0)]));
    assert_eq!((f.singular().map(|s| s.column), f.pivot_ratio()), (Some(1), 0.0));
    let mut x = [1.0, 2.0];
    assert!(f.solve(&mut x).is_err());
    assert_eq!(x, [1.0, 2.0]);
    for bad in [0.0, f64::NAN, f64::NEG_INFINITY] {
        let f = DenseLu::new(&Csc::from_triplets(2, 2, &[(0, 0, 1.0), (1, 1, bad)]));
        assert_eq!(f.singular().map(|s| s.column), Some(1), "{bad}");
    }
    // 3 x 3 magic-square pattern 1..9: rank 2 up to rounding
    let entries: Vec<_> = (0..9).map(|i| (i / 3, i % 3, 1.0 + i as f64)).collect();
    assert!(DenseLu::new(&Csc::from_triplets(3, 3, &entries)).pivot_ratio() < 1e-15);
}

#[test]
fn corrections_satisfy_the_penrose_conditions() {
    let mut rng = Rng(13);
    for trial in 0..200 {
        let (rows, columns, rank) = (1 + rng.below(12), 1 + rng.below(12), 1 + rng.below(6));
        // integer factors keep the rank exact
        let mut factor = |r: usize, c: usize| {
            DMatrix::from_fn(r, c, |_, _| (rng.below(7) as f64 - 3.0) * 2f64.powi(trial % 5))
        };
        let product = factor(rows, rank) * factor(rank, columns);
        let entries: Vec<_> = (0..rows)
            .flat_map(|r| (0..columns).map(move |c| (r, c)))
            .map(|(r, c)| (r, c, product[(r, c)]))
            .collect();
        let l = assert_penrose(&Csc::from_triplets(rows, columns, &entries), 1e-14);
        assert!(l.rank() <= rank.min(rows).min(columns));
    }
}

#[test]
fn singular_modes_of_circuits() {
    let mut rng = Rng(29);
    let mut deficient = 0;
    for trial in 0..150 {
        let nodes = 4 + rng.below(30);
        let c = circuit(&mut rng, nodes, [0.0, 2.0, 4.0][trial % 3]);
        let ordering = Ordering::new(&c.full, c.pairs);
        let mut a = c.full.clone();
        for i in 0..c.pairs {
            let on = rng.below(2) == 0;
            c.set(&mut a, &ordering, i, on);
        }
        if trial % 2 == 0 {
            let floating = rng.below(nodes); // nothing holds this node
            for c in 0..a.ncols {
                for p in a.colptr[c]..a.colptr[c + 1] {
                    if c == floating || a.rowidx[p] == floating {
                        a.values[p] = 0.0;
                    }
                }
            }
        }
        let l = assert_penrose(&a, 1e-15);
        deficient += usize::from(l.rank() < a.nrows);
        // a consistent right-hand side is met, and the correction from a solution is none
        let n = a.nrows;
        let (known, mut b) = (rng.vector(n), vec![0.0; n]);
        a.mul_add(1.0, &known, &mut b);
        let (mut x, mut work) = (known.clone(), vec![0.0; n]);
        assert!(l.correct(&b, &mut x, &mut work) < 1e-14);
        assert!(x.iter().zip(&known).all(|(x, k)| (x - k).abs() < 1e-9));
        x.fill(0.0);
        assert!(l.correct(&b, &mut x, &mut work) < 1e-13);
        let norm = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        assert!(norm(&x) <= norm(&known) * (1.0 + 1e-9), "not the least norm");
    }
    assert!(deficient >= 75, "only {deficient} modes were singular");
}

#[test]
fn inconsistent_and_empty_systems() {
    // two ideal sources in parallel: 1 V and 3 V meet at 2 V
    let a = Csc::from_triplets(2, 1, &[(0, 0, 1.0), (1, 0, 1.0)]);
    let l = LeastNorm::new(&a).unwrap();
    let (mut x, mut work) = ([0.0], [0.0; 2]);
    let left = l.correct(&[1.0, 3.0], &mut x, &mut work);
    assert!((x[0] - 2.0).abs() < 1e-15 && (left - 0.2).abs() < 1e-15);
    assert_eq!(l.rank(), 1);
    let zero = LeastNorm::new(&Csc::zeros(2, 2)).unwrap();
    let mut x = [5.0, -1.0];
    assert_eq!(zero.correct(&[0.0, 0.0], &mut x, &mut work), 0.0);
    assert_eq!((x, zero.rank()), ([5.0, -1.0], 0));
    assert_eq!(LeastNorm::new(&Csc::zeros(0, 0)).unwrap().correct(&[], &mut [], &mut []), 0.0);
    assert!(LeastNorm::new(&Csc::from_triplets(1, 1, &[(0, 0, f64::NAN)])).is_none());
}

#[test]
fn small_pivots_are_held_only_where_something_has_cancelled() {
    let solved = |entries: &[(usize, usize, f64)], mut x: [f64; 2]| {
        let mut lu = DenseLu::default();
        lu.set_hold(1e10);
        lu.factor(&Csc::from_triplets(2, 2, entries));
        lu.solve(&mut x).unwrap();
        x
    };
    // a connection of 1 nS next to a capacitor of 1e14 S: both voltages are 2 V
    let tie = [(0, 0, 1e14), (0, 1, -1e14), (1, 1, 1e-9)];
    assert!(solved(&tie, [0.0, 2e-9]).iter().all(|v| (v - 2.0).abs() <= 4.0 * f64::EPSILON));
    // what is left of 1 - 1 is no pivot: the hold keeps the unknown where it is
    let open = [(0, 0, 1.0), (0, 1, 1.0), (1, 0, 1.0), (1, 1, 1.0 + f64::EPSILON)];
    let [x, y] = solved(&open, [1.0, 1.0 + 1e-9]);
    assert!(y.abs() < 1e-15 && (x - 1.0).abs() < 1e-12);
}

#[test]
fn rounding_of_what_was_summed_before_is_no_pivot() {
    for order in ORDERS {
        let moved = floating_with_a_source().map(|(i, j, v)| (i, order[j], v));
        let mut lu = DenseLu::default();
        lu.set_hold(1e-9);
        lu.factor(&Csc::from_triplets(3, 3, &moved));
        assert_eq!(lu.held().len(), 1, "{order:?}");
    }
}

use super::examples::{
    circuit, floating_with_a_source, half_bridges, random, stage_equations, Circuit, Rng, ORDERS,
};
use super::refactor::Extent;
use super::{Csc, Ordering, Packed, SparseLu};
use crate::dense::DenseLu;
use std::sync::Arc;

fn factor(a: &Csc, pairs: usize) -> SparseLu {
    SparseLu::new(a, &Arc::new(Ordering::new(a, pairs)))
}

fn largest(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |m, v| m.max(v.abs()))
}

/// The largest `|b - A x|` as a part of the largest `|A| |x|`.
fn defect(a: &Csc, x: &[f64], b: &[f64]) -> f64 {
    let (mut r, mut s) = (b.to_vec(), vec![0.0; b.len()]);
    a.mul_add(-1.0, x, &mut r);
    a.abs_mul_add(x, &mut s);
    largest(&r) / largest(&s).max(f64::MIN_POSITIVE)
}

/// Factors that hold what a matrix leaves open: sparse, the same refactored, dense.
fn holding(a: &Csc, pairs: usize) -> (SparseLu, SparseLu, DenseLu) {
    let mut sparse = factor(a, pairs);
    sparse.set_hold(1e-9);
    sparse.factor(a);
    let mut again = sparse.clone();
    again.refactor(a);
    let mut dense = DenseLu::new(a);
    dense.set_hold(1e-9);
    dense.factor(a);
    (sparse, again, dense)
}

/// Solutions by each of these factors.
fn solutions((sparse, again, dense): &(SparseLu, SparseLu, DenseLu), b: &[f64]) -> [Vec<f64>; 3] {
    let mut work = vec![0.0; b.len()];
    let [mut x, mut y, mut z] = [(); 3].map(|()| b.to_vec());
    sparse.solve(&mut x, &mut work).unwrap();
    again.solve(&mut y, &mut work).unwrap();
    dense.solve(&mut z).unwrap();
    [x, y, z]
}

/// Solves with one refinement; returns the defect.
fn check(a: &Csc, f: &SparseLu, rng: &mut Rng) -> f64 {
    let b = rng.vector(a.nrows);
    let mut work = vec![0.0; a.nrows];
    let mut x = b.clone();
    f.solve(&mut x, &mut work).unwrap();
    let mut r = b.clone();
    a.mul_add(-1.0, &x, &mut r);
    f.solve(&mut r, &mut work).unwrap();
    x.iter_mut().zip(&r).for_each(|(x, r)| *x += r);
    defect(a, &x, &b)
}

#[test]
fn random_matrices_agree_with_dense_elimination() {
    let mut rng = Rng(11);
    let mut regular = 0;
    for trial in 0..600 {
        let n = 1 + rng.below(60);
        let mut a = random(&mut rng, n, trial % 5);
        if trial % 3 == 0 {
            // badly scaled rows and columns
            let scale: Vec<f64> = (0..2 * n).map(|_| rng.magnitude(12.0)).collect();
            for c in 0..n {
                for p in a.colptr[c]..a.colptr[c + 1] {
                    a.values[p] *= scale[a.rowidx[p]] * scale[n + c];
                }
            }
        }
        let f = factor(&a, 0);
        let dense = DenseLu::new(&a);
        if dense.pivot_ratio() < 1e-10 && trial % 3 != 0 || f.pivot_ratio() < 1e-10 {
            continue;
        }
        regular += 1;
        let defect = check(&a, &f, &mut rng);
        assert!(defect < 1e-12, "trial {trial}: {defect:e}");
        if trial % 3 != 0 {
            let b = rng.vector(n);
            let (mut x, mut y) = (b.clone(), b);
            f.solve(&mut x, &mut vec![0.0; n]).unwrap();
            dense.solve(&mut y).unwrap();
            let tolerance = 1e-13 / dense.pivot_ratio().min(f.pivot_ratio()) * largest(&y);
            assert!(x.iter().zip(&y).all(|(x, y)| (x - y).abs() < tolerance), "trial {trial}");
        }
    }
    assert!(regular > 500, "only {regular} matrices were regular");
}

#[test]
fn the_empty_matrix_and_single_entries() {
    let f = factor(&Csc::zeros(0, 0), 0);
    assert_eq!((f.size(), f.pivot_ratio(), f.singular()), (0, 1.0, None));
    f.solve(&mut [], &mut []).unwrap();
    let f = factor(&Csc::from_triplets(1, 1, &[(0, 0, -4.0)]), 0);
    let mut x = [2.0];
    f.solve(&mut x, &mut [0.0]).unwrap();
    assert_eq!((x[0], f.pivot_ratio()), (-0.5, 1.0));
    for bad in [0.0, f64::NAN, f64::INFINITY, 1e-310] {
        let f = factor(&Csc::from_triplets(1, 1, &[(0, 0, bad)]), 0);
        assert_eq!(f.singular().map(|s| s.column), Some(0), "{bad}");
        assert_eq!(f.pivot_ratio(), 0.0);
        let mut x = [2.0];
        assert!(f.solve(&mut x, &mut [0.0]).is_err() && x[0] == 2.0);
    }
}

#[test]
fn singular_matrices_are_reported() {
    // structurally: an empty column; two columns with one row between them
    let f = factor(&Csc::from_triplets(2, 2, &[(0, 0, 1.0), (1, 0, 1.0)]), 0);
    assert_eq!(f.singular().map(|s| s.column), Some(1));
    let f = factor(&Csc::from_triplets(3, 3, &[(0, 0, 1.0), (0, 1, 1.0), (1, 2, 1.0)]), 0);
    assert!(f.singular().is_some());
    // numerically: a last row that is a combination of the others
    let mut rng = Rng(5);
    for _ in 0..200 {
        let n = 3 + rng.below(40);
        let a = random(&mut rng, n, 2);
        let weight = rng.vector(n);
        let mut entries: Vec<_> = a.iter().filter(|e| e.0 != n - 1).collect();
        for c in 0..n {
            let sum = a.iter().filter(|e| e.0 != n - 1 && e.1 == c);
            entries.push((n - 1, c, sum.map(|(r, _, v)| weight[r] * v).sum()));
        }
        let ratio = factor(&Csc::from_triplets(n, n, &entries), 0).pivot_ratio();
        assert!(ratio < 1e-11, "{ratio:e}");
    }
    // one that is not finite somewhere in the middle
    let mut a = random(&mut rng, 30, 2);
    a.values[40] = f64::NAN;
    assert!(factor(&a, 0).singular().is_some());
}

#[test]
fn a_factor_recovers_from_a_singular_matrix() {
    let mut rng = Rng(9);
    let good = random(&mut rng, 50, 3);
    let mut bad = good.clone();
    let (start, end) = (bad.colptr[20], bad.colptr[21]);
    bad.values[start..end].fill(0.0);
    let mut f = factor(&good, 0);
    assert_eq!(f.refactor(&bad), Extent::Full);
    assert_eq!(f.singular().map(|s| s.column), Some(20));
    assert_eq!(f.refactor(&good), Extent::Full);
    assert!(check(&good, &f, &mut rng) < 1e-12);
    assert_eq!(f.refactor(&good), Extent::Columns(50));
}

/// Toggles random pairs; every mode must be solved as by new factors.  Returns the columns
/// computed and the number of full factorisations between regular modes.
fn toggle(circuit: &Circuit, rng: &mut Rng, modes: usize, at_once: usize) -> (usize, usize) {
    let ordering = Arc::new(Ordering::new(&circuit.full, circuit.pairs));
    let mut a = circuit.full.clone();
    let mut on: Vec<bool> = (0..circuit.pairs).map(|_| rng.below(3) == 0).collect();
    for (i, &on) in on.iter().enumerate() {
        circuit.set(&mut a, &ordering, i, on);
    }
    let mut f = SparseLu::new(&a, &ordering);
    let (mut columns, mut full) = (0, 0);
    for mode in 0..modes {
        let mut rows = Vec::new();
        for _ in 0..1 + rng.below(at_once) {
            let i = rng.below(circuit.pairs);
            on[i] = !on[i];
            circuit.set(&mut a, &ordering, i, on[i]);
            rows.push(circuit.row(i));
        }
        let regular = f.singular().is_none();
        match f.refactor_rows(&a, &rows) {
            Extent::Columns(count) => columns += count,
            Extent::Full => full += usize::from(regular && f.singular().is_none()),
        }
        let anew = SparseLu::new(&a, &ordering);
        let (kept, best) = (f.pivot_ratio(), anew.pivot_ratio());
        assert_eq!(kept < 1e-12, best < 1e-12, "mode {mode}: {kept:e} {best:e}");
        if kept > 1e-9 {
            let defect = check(&a, &f, rng);
            assert!(defect < 1e-12, "mode {mode}: {defect:e}");
        }
    }
    (columns, full)
}

#[test]
fn mode_changes_agree_with_factors_made_anew() {
    let mut rng = Rng(3);
    let (mut modes, mut full) = (0, 0);
    for trial in 0..60 {
        let nodes = 8 + rng.below(150);
        let c = circuit(&mut rng, nodes, [0.0, 3.0, 6.0][trial % 3]);
        modes += 100;
        full += toggle(&c, &mut rng, 100, 4).1;
    }
    assert!(10 * full < modes, "{full} of {modes} mode changes moved a pivot");
}

#[test]
fn ladders_change_modes_without_moving_a_pivot() {
    let mut rng = Rng(17);
    for (capacitance, resistance) in [(1.0, 0.0), (1e-5, 0.0), (1.0, 1e-3), (30.0, 1.0)] {
        let (columns, full) =
            toggle(&stage_equations(300, capacitance, resistance), &mut rng, 300, 1);
        assert_eq!(full, 0);
        assert!(columns < 300 * 60, "{columns} columns in 300 mode changes");
    }
}

#[test]
fn rails_do_not_fill_the_factors() {
    let mut rng = Rng(41);
    let c = half_bridges(1500);
    let ordering = Arc::new(Ordering::new(&c.full, c.pairs));
    let mut a = c.full.clone();
    let mut high = vec![true; c.pairs / 2];
    for i in 0..c.pairs {
        c.set(&mut a, &ordering, i, i % 2 == 0);
    }
    let mut f = SparseLu::new(&a, &ordering);
    let entries = f.lower.entries.len() + f.upper.entries.len() + f.size();
    assert!(entries < 8 * f.size(), "{entries} entries in {} columns", f.size());
    for _ in 0..50 {
        let i = rng.below(high.len());
        high[i] = !high[i];
        c.set(&mut a, &ordering, 2 * i, high[i]);
        c.set(&mut a, &ordering, 2 * i + 1, !high[i]);
        let extent = f.refactor_rows(&a, &[c.row(2 * i), c.row(2 * i + 1)]);
        assert!(matches!(extent, Extent::Columns(1..=12)), "{extent:?}");
        assert!(check(&a, &f, &mut rng) < 1e-12);
    }
}

#[test]
fn orders_are_permutations_and_long_chains_do_not_overflow_the_stack() {
    let mut rng = Rng(23);
    for _ in 0..50 {
        let nodes = 1 + rng.below(300);
        let c = circuit(&mut rng, nodes, 1.0);
        let ordering = Ordering::new(&c.full, c.pairs);
        let mut seen = ordering.order.clone();
        seen.sort_unstable();
        assert!(seen.into_iter().eq(0..ordering.size() as u32));
    }
    // a bidiagonal matrix is one path in the search of its last column
    let n = 300_000;
    let mut entries: Vec<_> = (0..n).map(|i| (i, i, 2.0)).collect();
    entries.extend((1..n).map(|i| (i, i - 1, 1.0)));
    entries.push((0, n - 1, 1.0));
    let a = Csc::from_triplets(n, n, &entries);
    let f = factor(&a, 0);
    assert!(check(&a, &f, &mut rng) < 1e-14);
    let c = stage_equations(50_000, 1.0, 0.0);
    assert!(check(&c.full, &factor(&c.full, c.pairs), &mut rng) < 1e-10);
}

#[test]
fn packed_copies_solve_the_scaled_equations() {
    let mut rng = Rng(29);
    // the last one is too large for short indices
    for (n, steep) in [(1, 0.0), (7, 0.0), (60, 0.0), (60, 1e3), (400, 1e3), (70_000, 0.0)] {
        // diagonally dominant; every third row is one of the identity, with the right-hand side 0
        let mut entries: Vec<_> =
            (0..n).map(|i| (i, i, if i % 3 == 2 { 1.0 } else { 9.0 })).collect();
        // or too small relative to the rest of its column to be the pivot of it
        entries.extend((2..n).step_by(3).map(|i| (i - 1, i, steep)));
        for _ in 0..2 * n {
            let (r, c) = (rng.below(n), rng.below(n.min(200)));
            if r % 3 != 2 && r != c {
                entries.push((r, c, rng.signed() / n.min(200) as f64));
            }
        }
        let f = factor(&Csc::from_triplets(n, n, &entries), 0);
        let (rows, columns) = (rng.vector(n), rng.vector(n));
        let packed = Packed::new(&f, |i| (i % 3 != 2).then_some(rows[i]), |j| columns[j]);
        let b = rng.vector(n);
        let mut work = vec![0.0; Packed::work_len(n)];
        let mut expected: Vec<f64> =
            (0..n).map(|i| if i % 3 == 2 { 0.0 } else { rows[i] * b[i] }).collect();
        f.solve(&mut expected, &mut work).unwrap();
        expected.iter_mut().zip(&columns).for_each(|(x, c)| *x *= c);
        let mut x = b;
        packed.solve(&mut x, &mut work);
        let error = x.iter().zip(&expected).fold(0.0f64, |e, (x, y)| e.max((x - y).abs()));
        assert!(error <= 1e-12 * largest(&expected), "{n}, {steep}: {error}");
    }
}

/// A chain of elements with one conductance each and no way to ground from some of its parts, so
/// that their common voltages are open: as many as there are parts.
fn floating_parts(rng: &mut Rng, parts: usize) -> Csc {
    let mut list = Vec::new();
    let mut n = 0;
    for _ in 0..parts {
        let size = 2 + rng.below(5);
        for k in n..n + size - 1 {
            let g = rng.magnitude(2.0);
            list.extend([(k, k, g), (k + 1, k + 1, g), (k, k + 1, -g), (k + 1, k, -g)]);
        }
        n += size;
        // a source from the last node to ground, by its branch current: not open
        list.extend([(n, n + 1, 1.0), (n + 1, n, 1.0), (n, n, 1e-40)]);
        n += 2;
    }
    list.extend((0..n).map(|i| (i, i, 0.0)));
    Csc::from_triplets(n, n, &list)
}

#[test]
fn what_a_matrix_leaves_open_is_held_and_all_else_solved() {
    let mut rng = Rng(5);
    for trial in 0..200 {
        let a = floating_parts(&mut rng, 1 + trial % 7);
        let n = a.nrows;
        let mut truth = rng.vector(n);
        truth.iter_mut().for_each(|v| *v += 1.0);
        let mut b = vec![0.0; n];
        a.mul_add(1.0, &truth, &mut b);
        let [dense, sparse] = [DenseLu::new(&a).pivot_ratio(), factor(&a, 0).pivot_ratio()];
        assert!(dense < 1e-13 && sparse < 1e-13);
        let factors = holding(&a, 0);
        // one column of each floating part, whichever it is
        assert!(!factors.2.held().is_empty());
        assert_eq!(factors.0.held().len(), factors.2.held().len());
        for (which, x) in solutions(&factors, &b).iter().enumerate() {
            assert!(defect(&a, x, &b) < 1e-12, "{trial} {which}");
            // what is open moves by rounding over the pivot at most
            assert!(largest(x) < 1e3 * largest(&truth), "{trial} {which}");
        }
    }
}

#[test]
fn laws_of_leakage_alone_are_pivots_beside_anything_larger() {
    // two nodes in series with an inductor, connected to the rest by leakage: the law of the inductor, that of one node,
    // and the sum of both, in which no rounding of the current is
    let (inductor, leak) = (1e4, 1e-25);
    let entries = [
        (0, 0, 1.0),
        (0, 1, -1.0),
        (0, 2, -inductor),
        (1, 1, 64.0 * leak),
        (1, 2, -1e-4),
        (2, 0, leak),
        (2, 1, leak),
    ];
    let a = Csc::from_triplets(3, 3, &entries);
    let truth = [5.0 / 3.0, 1.0 / 3.0, 64e-21 / 3.0];
    let right = [truth[0] - truth[1], 0.0, 2.0 * leak];
    for (which, x) in solutions(&holding(&a, 0), &right).iter().enumerate() {
        for (v, truth) in x.iter().zip(&truth).take(2) {
            assert!((v - truth).abs() < 1e-14, "{which}: {x:?}");
        }
    }
}

#[test]
fn a_row_that_gives_an_unknown_is_its_pivot() {
    // a transformer between open switches and blocking junctions: the currents 8 and 9 of two switches vanish, in
    // the sum of the laws (0) they are next to the leakage of node 1, which is no pivot before theirs
    let leak = 1e-25;
    let mut entries = vec![(0, 1, leak), (0, 8, -0.125), (0, 9, 0.125), (8, 8, 1.0), (9, 9, 1.0)];
    entries.extend([(1, 1, 8.0 * leak), (1, 5, -0.0078), (1, 8, -1.0), (1, 9, 1.0)]);
    entries.extend([(2, 0, -0.354), (2, 2, 0.708), (2, 5, 0.002), (3, 6, 1.0)]);
    entries.extend([(4, 4, 0.561), (4, 7, -0.0156), (5, 1, 0.0078), (5, 2, -0.002)]);
    entries.extend([(5, 5, 0.153), (5, 6, 0.827), (5, 7, 0.827), (6, 1, -0.042)]);
    entries.extend([(6, 2, 0.0106), (6, 3, -1.0), (7, 1, -0.042), (7, 2, 0.0106), (7, 4, 0.0156)]);
    let n = 10;
    let truth = [3.0, 1.0, -2.0, 0.5, -1.0, 0.25, 0.75, -0.5, 0.0, 0.0];
    let mut rng = Rng(7);
    for trial in 0..20 {
        let mut order: Vec<usize> = (0..n).collect();
        let keys = rng.vector(n);
        order.sort_by(|&a, &b| keys[a].total_cmp(&keys[b]));
        let moved: Vec<_> = entries.iter().map(|&(r, c, v)| (order[r], order[c], v)).collect();
        let a = Csc::from_triplets(n, n, &moved);
        let mut b = vec![0.0; n];
        entries.iter().for_each(|&(r, c, v)| b[order[r]] += v * truth[c]);
        for (which, x) in solutions(&holding(&a, 0), &b).iter().enumerate() {
            let apart = (0..n).map(|c| (x[order[c]] - truth[c]).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-11, "{trial} {which}: {apart:e}");
        }
    }
}

#[test]
fn rounding_of_what_was_summed_before_is_no_pivot() {
    for order in ORDERS {
        let moved = floating_with_a_source().map(|(i, j, v)| (order[i], order[j], v));
        let a = Csc::from_triplets(3, 3, &moved);
        let (sparse, again, _) = holding(&a, 0);
        assert_eq!(sparse.held().len(), 1, "{order:?}");
        assert_eq!(again.held().len(), 1, "{order:?} again");
    }
}

/// The laws of closed switches between nodes of a random network of resistors; `doubled` of them have another
/// switch in parallel, and how both share their current is open.  The switches come last.
fn closed_switches(rng: &mut Rng, nodes: usize, doubled: usize) -> (Csc, usize) {
    let mut entries: Vec<(usize, usize, f64)> = (0..nodes).map(|k| (k, k, 0.1)).collect();
    for _ in 0..2 * nodes {
        let (a, b, g) = (rng.below(nodes), rng.below(nodes), rng.magnitude(3.0));
        entries.extend([(a, a, g), (b, b, g), (a, b, -g), (b, a, -g)].iter().filter(|_| a != b));
    }
    // a tree: the loops are those of the doubled ones
    let mut ends: Vec<(usize, usize)> = (1..nodes / 2).map(|k| (k, rng.below(k))).collect();
    for k in 0..doubled {
        ends.insert(rng.below(ends.len() + 1), ends[k]);
    }
    for (i, &(a, b)) in ends.iter().enumerate() {
        let i = nodes + i;
        entries.extend([(a, i, 1.0), (b, i, -1.0), (i, a, 1.0), (i, b, -1.0), (i, i, 0.0)]);
    }
    let n = nodes + ends.len();
    (Csc::from_triplets(n, n, &entries), ends.len())
}

#[test]
fn what_is_held_takes_no_row_that_another_column_needs() {
    let mut rng = Rng(11);
    for trial in 0..300 {
        let doubled = 1 + trial % 3;
        let nodes = 8 + rng.below(30);
        let (a, switches) = closed_switches(&mut rng, nodes, doubled);
        let mut b = vec![0.0; a.nrows];
        a.mul_add(1.0, &rng.vector(a.nrows), &mut b);
        for pairs in [0, switches] {
            let factors = holding(&a, pairs);
            for held in [factors.0.held(), factors.1.held(), factors.2.held()] {
                assert_eq!(held.len(), doubled, "{trial} {pairs}");
            }
            for (which, x) in solutions(&factors, &b).iter().enumerate() {
                assert!(defect(&a, x, &b) < 1e-10, "{trial} {pairs} {which}");
            }
        }
    }
}

//! What joins laws of currents to groups: conductances, currents that cancel, and what is stored.

use super::LOST;
use crate::sparse::Csc;
use crate::union_find::UnionFind;

/// The laws that groups of unknowns and some columns of a matrix join, and which of them are in no group
/// whose sum has anything of these columns left; such currents may `stay` in more than one law.  What is at
/// most a `weak` part of what stands beside it joins nothing; what sums to a `left` part of its size, at most,
/// is nothing left.
pub(super) fn joined(
    g: &Csc,
    floating: &[Vec<usize>],
    law: impl Fn(usize) -> bool,
    counts: impl Fn(usize) -> bool,
    (stay, weak, left): (bool, f64, f64),
) -> (Vec<Vec<usize>>, Vec<bool>) {
    let n = g.nrows;
    let (mut ties, mut free) = (UnionFind::new(n), vec![true; n]);
    let tie = |ties: &mut UnionFind, rows: &[usize]| {
        rows.windows(2).for_each(|pair| _ = ties.join(pair[0], pair[1]));
    };
    floating
        .iter()
        .filter(|group| group.iter().all(|&row| law(row)))
        .for_each(|group| tie(&mut ties, group));
    let ends = ends_of_branches(g, &law);
    let mut diagonal = vec![0.0f64; n];
    g.iter().filter(|e| e.0 == e.1).for_each(|(row, _, v)| diagonal[row] = v.abs());
    for c in (0..n).filter(|&c| counts(c)) {
        let mut own = entries_in_laws(g, c, &law);
        let all = own.len();
        if law(c) {
            // beside the conductances at one of its ends this one is a weak tie
            let beside = |row: usize| diagonal[row].max(diagonal[c]);
            own.retain(|&(row, v)| row == c || v.abs() > weak * beside(row));
        }
        // a current leaves one node and enters another, whatever it controls elsewhere, and whatever
        // controls it; what it controls may cancel with one end as well
        let (at_ends, controlled): (Vec<_>, Vec<_>) =
            own.into_iter().partition(|e| ends[c].is_empty() || ends[c].contains(&e.0));
        let [(mut pairs, mut own), (others, rest)] = [at_ends, controlled].map(cancelling);
        pairs.extend(others);
        own.extend(rest);
        pairs.iter().for_each(|pair| tie(&mut ties, pair));
        let rows: Vec<usize> = own.iter().map(|e| e.0).collect();
        let (sum, size) =
            own.iter().fold((0.0, 0.0), |(sum, size), e| (sum + e.1, size + e.1.abs()));
        let left = f64::abs(sum) > left * size;
        if left && stay && all > 1 && !law(c) {
            continue;
        }
        tie(&mut ties, &rows);
        if left {
            rows.iter().for_each(|&row| free[row] = false);
        }
    }
    (ties.groups((0..n).filter(|&row| law(row))), free)
}

/// The nodes in the law of each branch: the ends between which its voltage is.
fn ends_of_branches(g: &Csc, law: impl Fn(usize) -> bool) -> Vec<Vec<usize>> {
    let mut ends = vec![Vec::new(); g.nrows];
    for (row, node, v) in g.iter() {
        if v != 0.0 && !law(row) && law(node) {
            ends[row].push(node);
        }
    }
    ends
}

/// The entries of a column in laws of currents.
pub(super) fn entries_in_laws(
    matrix: &Csc,
    c: usize,
    law: impl Fn(usize) -> bool,
) -> Vec<(usize, f64)> {
    let (rows, values) = matrix.col(c);
    let own = rows.iter().zip(values).filter(|(&row, v)| law(row) && **v != 0.0);
    own.map(|(&row, &v)| (row, v)).collect()
}

/// Of each law of a current, what its node stores towards ground.  The rounding of this is in every sum that
/// contains the law: the sum in the place of another one, of a coil's end that nothing else leads to, would bring
/// it where there was none.
pub(super) fn to_ground(e: &Csc, law: impl Fn(usize) -> bool) -> Vec<f64> {
    let (mut sum, mut size) = (vec![0.0; e.nrows], vec![0.0f64; e.nrows]);
    for (row, _, v) in e.iter().filter(|e| law(e.0) && law(e.1)) {
        sum[row] += v;
        size[row] += v.abs();
    }
    let left = |(sum, size): (&f64, f64)| if sum.abs() > LOST * size { sum.abs() } else { 0.0 };
    sum.iter().zip(size).map(left).collect()
}

/// The rows of entries that cancel, two by two, and the other entries.
pub(super) fn cancelling(mut entries: Vec<(usize, f64)>) -> (Vec<[usize; 2]>, Vec<(usize, f64)>) {
    entries.sort_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let (mut pairs, mut others) = (Vec::new(), Vec::<(usize, f64)>::new());
    for entry in entries {
        match others.pop_if(|last| last.1 == -entry.1) {
            Some(other) => pairs.push([other.0, entry.0]),
            None => others.push(entry),
        }
    }
    (pairs, others)
}

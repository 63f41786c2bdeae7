//! Matrices for the tests: random ones, random circuits, diode ladders.

use super::{Csc, Ordering};

/// xorshift64
pub struct Rng(pub u64);

impl Rng {
    pub fn bits(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 >> 11
    }

    pub fn below(&mut self, n: usize) -> usize {
        self.bits() as usize % n
    }

    /// Uniform in [-1, 1).
    pub fn signed(&mut self) -> f64 {
        self.bits() as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Between `10^-decades` and 1, uniform in the logarithm.
    pub fn magnitude(&mut self, decades: f64) -> f64 {
        10f64.powf(decades * (self.signed() - 1.0) / 2.0)
    }

    pub fn vector(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.signed()).collect()
    }
}

/// Entries of the laws of three nodes that float, which leave one of their potentials open: 1/13 S, 1 uS and a
/// source of 5.6 nS that one of them controls, the last node and its law scaled; the sum of the laws is what the
/// sums on the diagonal have been rounded by, and cancels in small terms at last.
pub fn floating_with_a_source() -> [(usize, usize, f64); 9] {
    let (g, r, f, scale) = (1.0 / 13.0, 1e-6, 5.6234e-9, 1024.0);
    let laws = [[g, -g, 0.0], [f - g, g + r - f, -r], [-f, f - r, r]];
    let factor = |i: usize| if i == 2 { scale } else { 1.0 };
    let entry = |i: usize, j: usize| (i, j, laws[i][j] * factor(i) * factor(j));
    std::array::from_fn(|k| entry(k / 3, k % 3))
}

/// All orders of three.
pub const ORDERS: [[usize; 3]; 6] =
    [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// `n x n` with about `density` entries per column besides a random permutation matrix.
pub fn random(rng: &mut Rng, n: usize, density: usize) -> Csc {
    let mut target: Vec<usize> = (0..n).collect();
    for i in (1..n).rev() {
        target.swap(i, rng.below(i + 1));
    }
    let mut entries: Vec<_> = (0..n).map(|c| (target[c], c, 1.0 + rng.signed())).collect();
    for _ in 0..density * n {
        entries.push((rng.below(n), rng.below(n), rng.signed()));
    }
    Csc::from_triplets(n, n, &entries)
}

/// `[[K, A], [-B, D]]` with a full diagonal, and the number of pairs.
pub struct Circuit {
    pub full: Csc,
    pub pairs: usize,
}

impl Circuit {
    fn new(size: usize, pairs: usize, mut entries: Vec<(usize, usize, f64)>) -> Self {
        entries.extend((0..size).map(|i| (i, i, 0.0)));
        Circuit { full: Csc::from_triplets(size, size, &entries), pairs }
    }

    /// The row of pair `i`.
    pub fn row(&self, i: usize) -> usize {
        self.full.nrows - self.pairs + i
    }

    /// Writes the row of pair `i` for one mode.
    pub fn set(&self, a: &mut Csc, ordering: &Ordering, i: usize, on: bool) {
        let row = self.row(i);
        for &(c, p) in ordering.row(row) {
            let unit = if c as usize == row { 1.0 } else { 0.0 };
            a.values[p as usize] = if on { self.full.values[p as usize] } else { unit };
        }
    }
}

/// A branch between two nodes (`None` is ground): entries of its column and, skew, of its row.
fn branch(
    entries: &mut Vec<(usize, usize, f64)>,
    index: usize,
    ends: [Option<usize>; 2],
    diagonal: f64,
) {
    for (end, sign) in ends.into_iter().zip([1.0, -1.0]) {
        if let Some(v) = end {
            entries.push((v, index, sign));
            entries.push((index, v, -sign));
        }
    }
    entries.push((index, index, diagonal));
}

fn conductance(entries: &mut Vec<(usize, usize, f64)>, ends: [Option<usize>; 2], g: f64) {
    for (p, q) in [(0, 1), (1, 0)] {
        if let Some(a) = ends[p] {
            entries.push((a, a, g));
            if let Some(b) = ends[q] {
                entries.push((a, b, -g));
            }
        }
    }
}

/// A voltage multiplier: capacitors two nodes apart, a diode from each node to the next, driven by
/// a voltage source.
pub fn stage_equations(cells: usize, capacitance: f64, resistance: f64) -> Circuit {
    let (input, source, n) = (cells, cells + 1, cells + 2);
    let node = |i: usize| match i {
        0 => Some(input),
        1 => None,
        _ => Some(i - 2),
    };
    let mut entries = Vec::new();
    branch(&mut entries, source, [Some(input), None], 0.0);
    for i in 0..cells {
        conductance(&mut entries, [node(i), node(i + 2)], capacitance);
        branch(&mut entries, n + i, [node(i + 1), node(i + 2)], resistance);
    }
    Circuit::new(n + cells, cells, entries)
}

/// Half-bridges between a supply and ground, each with an inductor to a common output: the switched
/// nodes have no conductance, and two rails touch everything.
pub fn half_bridges(count: usize) -> Circuit {
    let (supply, output, first) = (0, 1, 2);
    let (source, n) = (2 + count, 3 + 2 * count);
    let mut entries = Vec::new();
    conductance(&mut entries, [Some(output), None], 5.0);
    branch(&mut entries, source, [Some(supply), None], 0.0);
    for i in 0..count {
        let switched = Some(first + i);
        branch(&mut entries, source + 1 + i, [switched, Some(output)], 0.5);
        branch(&mut entries, n + 2 * i, [Some(supply), switched], 0.0);
        branch(&mut entries, n + 2 * i + 1, [None, switched], 0.0);
    }
    Circuit::new(n + 2 * count, 2 * count, entries)
}

/// A random circuit: every node has a path of conductances to ground, except for some that are held
/// by inductors, voltage sources or diodes only.
pub fn circuit(rng: &mut Rng, nodes: usize, decades: f64) -> Circuit {
    let bare = |v: usize| v % 7 == 3;
    let end = |v: usize, rng: &mut Rng| match rng.below(v + 1) {
        u if u == v || rng.below(6) == 0 => None,
        u => Some(if rng.below(2) == 0 && v > 4 { v - 1 - rng.below(4) } else { u }),
    };
    let mut entries = Vec::new();
    let mut branches = Vec::new();
    let mut pairs = Vec::new();
    for v in 0..nodes {
        if bare(v) {
            let inductance = if rng.below(3) == 0 { 0.0 } else { rng.magnitude(decades) };
            branches.push(([Some(v), end(v, rng)], inductance));
        } else {
            let other = end(v, rng).filter(|&u| !bare(u));
            conductance(&mut entries, [Some(v), other], rng.magnitude(decades));
        }
        let other = end(v, rng);
        let resistance = if rng.below(2) == 0 { 0.0 } else { rng.magnitude(decades) };
        match rng.below(3) {
            0 => pairs.push(([Some(v), other], resistance)),
            1 => pairs.push(([other, Some(v)], resistance)),
            _ => {}
        }
    }
    let n = nodes + branches.len();
    for (k, (ends, diagonal)) in branches.iter().chain(&pairs).enumerate() {
        branch(&mut entries, nodes + k, *ends, *diagonal);
    }
    Circuit::new(n + pairs.len(), pairs.len(), entries)
}

//! Potentials of neutral points right after a jump.
//!
//! Coils alone lead to a neutral point, and what is tied to it by resistors. Their currents sum to zero there
//! at every instant, and so do their rates, which tells the potential. Short steps tell it by differences of
//! fluxes over next to no time: in 1e-22 s the rounding of 1 A in 1 mH is a kilovolt.

use super::stepper::Stepper;
use crate::dense::DenseLu;
use crate::descriptor::left_in_sums;
use crate::sparse::Csc;
use crate::union_find::UnionFind;

/// What sums of entries lose in their assembly, as a part of their sizes.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Nodes with one potential that is open but for coils, and these: the law of each, and its part in the sum of
/// the laws of the nodes over its inductance.
struct Neutral {
    nodes: Vec<usize>,
    coils: Vec<(usize, f64)>,
}

/// The neutral points of a system; laws are `taken` in which functions, pairs or sources stand.
fn neutrals(e: &Csc, g: &Csc, row_kind: &[u8], taken: &[bool]) -> Vec<Neutral> {
    let n = g.nrows;
    let node = |row: usize| row_kind[row] == 0;
    // coils that are coupled to no other: one law, and one entry in it
    let mut entries = vec![(0, 0, 0.0); n];
    let mut laws = vec![0; n];
    for (row, column, v) in e.iter().filter(|e| e.2 != 0.0) {
        entries[column] = (entries[column].0 + 1, row, v);
        laws[row] += 1;
    }
    let stored = |c: usize| entries[c].0 > 0;
    let coil = |c: usize| {
        let (count, row, v) = entries[c];
        (count == 1 && laws[row] == 1 && !node(row)).then_some((row, v))
    };
    let mut ties = UnionFind::new(n);
    for c in (0..n).filter(|&c| node(c) || !stored(c)) {
        let (rows, values) = g.col(c);
        let mut own = rows.iter().zip(values).filter(|(&r, v)| node(r) && **v != 0.0);
        let first = if node(c) { Some(c) } else { own.next().map(|e| *e.0) };
        if let Some(first) = first {
            own.for_each(|(&r, _)| _ = ties.join(first, r));
        }
    }
    let groups = ties.groups((0..n).filter(|&row| node(row)));
    let mut group_of = vec![None; n];
    for (k, group) in groups.iter().enumerate() {
        group.iter().for_each(|&row| group_of[row] = Some(k));
    }
    let mut free = vec![true; groups.len()];
    let mut coils = vec![Vec::new(); groups.len()];
    for (k, c, sum) in left_in_sums(g, &group_of, ROUNDING) {
        match coil(c) {
            Some((law, inductance)) => coils[k].push((law, sum / inductance)),
            None => free[k] = false,
        }
    }
    let all = groups.into_iter().zip(coils).zip(free);
    let open = all.filter(|((nodes, coils), free)| {
        *free && !coils.is_empty() && nodes.iter().all(|&row| laws[row] == 0 && !taken[row])
    });
    open.map(|((nodes, coils), _)| Neutral { nodes, coils }).collect()
}

impl Stepper {
    /// Moves the potentials of neutral points in the unknowns right after a jump to where the rates of the
    /// currents that meet there sum to zero.  No law in which nothing is stored feels that.
    pub(super) fn centre_neutrals(&mut self, z: &mut [f64], l: &[f64]) {
        let (Some(smooth), linear) = (&self.smooth, &self.sys.linear) else { return };
        let mut taken = vec![false; z.len()];
        smooth.newton.rows_of_functions().for_each(|row| taken[row] = true);
        for matrix in [&linear.a, &linear.s] {
            matrix.iter().filter(|e| e.2 != 0.0).for_each(|(row, ..)| taken[row] = true);
        }
        let found = neutrals(&linear.e, &linear.g, &linear.row_kind, &taken);
        if found.is_empty() {
            return;
        }
        let [acting, _] = self.acting_at(z, l);
        // how each neutral point acts on the laws of coils
        let mut matrix = Vec::new();
        for (column, neutral) in found.iter().enumerate() {
            let mut there = vec![0.0; z.len()];
            neutral.nodes.iter().for_each(|&node| there[node] = 1.0);
            let mut on_laws = vec![0.0; z.len()];
            self.sys.linear.g.mul_add(1.0, &there, &mut on_laws);
            for (row, other) in found.iter().enumerate() {
                let part = other.coils.iter().map(|&(law, part)| part * on_laws[law]).sum();
                matrix.push((row, column, part));
            }
        }
        let lu = DenseLu::new(&Csc::from_triplets(found.len(), found.len(), &matrix));
        let mut moves: Vec<f64> = found
            .iter()
            .map(|neutral| {
                -neutral.coils.iter().map(|&(law, part)| part * acting[law]).sum::<f64>()
            })
            .collect();
        // windings between two neutral points alone leave both of them open
        if lu.pivot_ratio() > f64::EPSILON.sqrt() && lu.solve(&mut moves).is_ok() {
            for (neutral, by) in found.iter().zip(moves) {
                neutral.nodes.iter().for_each(|&node| z[node] += by);
            }
        }
    }
}

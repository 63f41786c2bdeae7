//! Groups of nodes with weak connections to the rest: the sum of their current laws takes the place
//! of the first of these laws.
//!
//! In a group of nodes that only capacitors tie together, without a connection to ground, the terms
//! of `rate E z` are so large that the currents from outside are lost in their rounding: in a step
//! of 10 ps the terms of 1 mF at 500 V are 5e10 A. In the sum of the laws of the group these terms
//! cancel, and only the currents from outside are left. The current of a source to ground makes up
//! for whatever the laws of its group sum to; a current that cancels in the sum of the laws in
//! which it stands joins these to one group; a current that is amplified elsewhere (`F`) is
//! determined by the laws there.
//!
//! The same holds for groups of nodes that resistors tie together, with the currents of junctions
//! from outside: the current of 40 Ohm at 5 V has a rounding error of 3e-17 A, and a leakage of
//! 1e-16 A determines the potential of both ends. It also holds for an isolated part that 1 GOhm
//! ties to ground; and for nodes that windings alone connect to the rest, whose voltages are impulses
//! where the currents of the windings jump.
//!
//! Of windings without leakage see `windings.rs`.

mod search;

use crate::descriptor::{stored_columns, stored_groups};
use crate::sparse::Csc;
use crate::windings::{laws_without_storage, Multiples};
use search::{cancelling, entries_in_laws, joined, to_ground};

/// Conductances that sum to this part of their sizes sum to zero: less is lost in their assembly.
const ROUNDING: f64 = f64::EPSILON;
/// The same for charges and fluxes.
pub(crate) const LOST: f64 = 1e-12;
/// A tie of this part of the conductances beside it: what it carries is rounding of theirs.
const WEAK: f64 = 1e-6;
/// Ties to ground of this part leave the sum of a cut set worth while: rounding of the charges of junctions
/// over a short step is more than what they carry.
const LIGHT: f64 = 1e-2;

/// Groups of rows that have none in common.
#[derive(Clone, Debug)]
struct Family {
    groups: Vec<Vec<usize>>,
    /// the first row of the group of each row
    first: Vec<Option<usize>>,
}

impl Family {
    fn new(rows: usize) -> Family {
        Family { groups: Vec::new(), first: vec![None; rows] }
    }

    fn take(&mut self, group: Vec<usize>) {
        group.iter().for_each(|&row| self.first[row] = Some(group[0]));
        self.groups.push(group);
    }

    fn leave(&mut self, place: usize) -> Vec<usize> {
        let group = self.groups.swap_remove(place);
        group.iter().for_each(|&row| self.first[row] = None);
        group
    }
}

/// The groups, of current rows, and how rows turn into sums.
#[derive(Clone, Debug)]
pub struct Floating {
    /// groups that something ties; those that capacitors tie inside one of them; and cut sets of windings,
    /// which may lie there, too
    tied: Family,
    inner: Family,
    cuts: Family,
    /// sums in which nothing but a weak tie is left
    bare: Vec<bool>,
    /// in which columns something is stored
    stores: Vec<bool>,
    /// laws of windings without leakage, to which multiples of others are added
    windings: Vec<Multiples>,
}

impl Floating {
    /// Finds the groups that conductances and sources (`g`) tie, of which nothing but a weak tie is left in the
    /// sum, and those that capacitors (`e`) tie, across sources whose currents leave the sum: with resistors, as
    /// far as all of what these carry leaves it, too.
    pub fn new(e: &Csc, g: &Csc, row_kind: &[u8]) -> Floating {
        let n = e.nrows;
        let law = |row: usize| row_kind[row] == 0;
        let [floating, fixed] = stored_groups(e);
        let [tied, inner, cuts] = [0; 3].map(|_| Family::new(n));
        let mut out = Floating {
            tied,
            inner,
            cuts,
            bare: vec![false; n],
            stores: stored_columns(e),
            windings: Vec::new(),
        };
        let (mut groups, free) = joined(g, &floating, law, |_| true, (false, WEAK, WEAK));
        groups.retain(|group| group.len() > 1 && group.iter().all(|&row| free[row]));
        groups.into_iter().for_each(|group| out.take(group, true));
        let mut held = vec![false; n];
        floating.iter().filter(|group| group.len() > 1).flatten().for_each(|&j| held[j] = true);
        let leaving = |conducts: bool| {
            let counts = |c: usize| if law(c) { conducts } else { !out.stores[c] };
            let (mut groups, mut free) =
                joined(g, &floating, law, counts, (true, ROUNDING, ROUNDING));
            fixed.iter().flatten().for_each(|&row| free[row] = false);
            groups.retain(|group| {
                group.iter().any(|&row| held[row]) && group.iter().all(|&row| free[row])
            });
            groups
        };
        let (mut wide, mut groups) = (leaving(true), leaving(false));
        let apart = |group: &Vec<usize>| group.iter().all(|&row| out.tied.first[row].is_none());
        wide.retain(apart);
        groups.retain(|group| wide.iter().all(|other| !other.contains(&group[0])));
        let (inner, mut groups): (Vec<_>, Vec<_>) =
            groups.into_iter().partition(|group| out.tied.first[group[0]].is_some());
        groups.retain(apart);
        for group in wide.into_iter().chain(groups) {
            out.take_parts(&group, &floating);
            out.take(group, false);
        }
        out.take_inner(inner);
        out
    }

    /// Adds the parts of a group that capacitors tie and currents of branches join, but for that of its first
    /// row, which follows: else such a current is what rounding leaves of charges, in a short step.
    fn take_parts(&mut self, group: &[usize], floating: &[Vec<usize>]) {
        let inside = |part: &&Vec<usize>| part.len() > 1 && part.iter().all(|r| group.contains(r));
        let parts = floating.iter().filter(inside).filter(|part| !part.contains(&group[0]));
        parts.for_each(|part| self.inner.take(part.clone()));
    }

    /// Adds groups that lie inside others, whose sums take the place of laws outside them where they can: two
    /// sums in the place of laws that both contain would leave one law too few.
    fn take_inner(&mut self, groups: Vec<Vec<usize>>) {
        let mut inside = vec![false; self.bare.len()];
        groups.iter().flatten().for_each(|&row| inside[row] = true);
        self.keep_outside(&inside);
        for group in groups {
            let around = self.tied.first[group[0]];
            let within = group.iter().all(|&row| self.tied.first[row] == around);
            if within && around.is_some_and(|first| !group.contains(&first)) {
                self.inner.take(group);
            }
        }
    }

    /// Lets sums take the place of laws that are not `inside` something.
    fn keep_outside(&mut self, inside: &[bool]) {
        self.replace(|group| group.iter().position(|&row| !inside[row]).unwrap_or(0));
    }

    /// Lets the sum of a group that something is left of towards ground take the place of the law in which most
    /// is stored (`e`).
    pub fn take_contents(&mut self, e: &Csc, row_kind: &[u8]) {
        let content = to_ground(e, |row| row_kind[row] == 0);
        // sums inside take the place of their laws
        let inner: Vec<bool> = self.inner.first.iter().map(Option::is_some).collect();
        self.replace(|group| {
            let outside = (0..group.len()).filter(|&k| !inner[group[k]]);
            let fuller = |most: usize, k: usize| {
                if content[group[k]] > content[group[most]] {
                    k
                } else {
                    most
                }
            };
            outside.fold(0, fuller)
        });
    }

    /// Lets the sum of each group take the place of another of its laws.
    fn replace(&mut self, law: impl Fn(&[usize]) -> usize) {
        for mut group in std::mem::take(&mut self.tied.groups) {
            let bare = std::mem::take(&mut self.bare[group[0]]);
            let own = law(&group);
            group.swap(0, own);
            self.take(group, bare);
        }
    }

    /// Adds the cut sets of windings: groups of nodes that nothing but windings (branches in `e`) and weak ties
    /// connect to the rest, and in whose laws nothing else stands that their sum keeps: junctions, diodes and
    /// switches (columns of `inside`) and capacitors lie between two of them.  In the sum of these no voltages are
    /// left, whose gigavolts in an impulse hide that the currents of the windings vanish, and no charges, whose
    /// rounding over a short step hides it, too.
    pub fn take_cut_sets(&mut self, e: &Csc, g: &Csc, row_kind: &[u8], inside: [&Csc; 3]) {
        let law = |row: usize| row_kind[row] == 0;
        let n = e.nrows;
        let mut free = vec![true; n];
        let [mut tied, fixed] = stored_groups(e);
        fixed.iter().flatten().for_each(|&row| free[row] = false);
        for (m, c) in inside.iter().flat_map(|m| (0..m.ncols).map(move |c| (m, c))) {
            let (pairs, rest) = cancelling(entries_in_laws(m, c, law));
            tied.extend(pairs.into_iter().map(Vec::from));
            rest.iter().for_each(|e| free[e.0] = false);
        }
        let (mut cuts, linear) =
            joined(g, &tied, law, |c| law(c) || !self.stores[c], (false, WEAK, LIGHT));
        free.iter_mut().zip(linear).for_each(|(free, linear)| *free &= linear);
        cuts.retain(|cut| cut.len() > 1 && cut.iter().all(|&row| free[row]));
        let mut inside: Vec<bool> = self.inner.first.iter().map(Option::is_some).collect();
        cuts.iter().flatten().for_each(|&row| inside[row] = true);
        self.keep_outside(&inside);
        for mut cut in cuts {
            // the sum of a group inside follows from this one and the laws of the nodes around it
            let inside = |group: &Vec<usize>| group.iter().all(|row| cut.contains(row));
            let given_up = self.tied.groups.iter().position(inside);
            let group = given_up.map_or_else(Vec::new, |place| self.tied.leave(place));
            let sums =
                |row: usize| [self.tied.first[row], self.inner.first[row]].into_iter().flatten();
            let other = |row: usize| sums(row).all(|first| !cut.contains(&first));
            // charges hide the law of a capacitor more than that of a coil's end
            let own = (0..cut.len()).rev().filter(|&k| other(cut[k]));
            let Some(own) = own.max_by_key(|&k| group.contains(&cut[k])) else { continue };
            cut.swap(0, own);
            self.bare[cut[0]] = true;
            self.cuts.take(cut);
        }
    }

    /// Adds the windings without leakage, but for those in whose laws `others` stand.
    pub fn take_windings(&mut self, e: &Csc, row_kind: &[u8], others: &[bool]) {
        self.windings = laws_without_storage(e, row_kind);
        self.windings.retain(|law| !others[law.row]);
    }

    fn take(&mut self, group: Vec<usize>, bare: bool) {
        self.bare[group[0]] = bare;
        self.tied.take(group);
    }

    /// Whether there are cut sets of windings.
    pub fn has_cut_sets(&self) -> bool {
        self.cuts.groups.iter().any(|cut| cut.iter().all(|&row| !self.stores[row]))
    }

    /// Whether a sum stands in the place of this row.
    pub fn is_sum(&self, row: usize) -> bool {
        self.sums_with(row).any(|first| first == row)
    }

    /// The rows of the sums that contain a row.
    pub fn sums_with(&self, row: usize) -> impl Iterator<Item = usize> + '_ {
        [&self.tied, &self.inner, &self.cuts]
            .into_iter()
            .filter_map(move |family| family.first[row])
    }

    /// The rows of the sums to which another row is to be added.
    fn sums_of(&self, row: usize) -> impl Iterator<Item = usize> + '_ {
        self.sums_with(row).filter(move |&first| first != row)
    }

    /// The entries of a matrix, those of sums included.
    pub fn with_sums(&self, matrix: &Csc) -> Vec<(usize, usize, f64)> {
        let copies =
            matrix.iter().flat_map(|(r, c, v)| self.sums_of(r).map(move |sum| (sum, c, v)));
        let multiples = matrix.iter().flat_map(|(r, c, v)| {
            let own = move |law: &Multiples| Some((law.row, c, law.factor(r)? * v));
            self.windings.iter().filter_map(own)
        });
        matrix.iter().chain(copies).chain(multiples).collect()
    }

    /// The same for conductances: those that leave a sum leave no rounding of theirs there, but zeros.
    ///
    /// So a sum keeps its neighbours and is eliminated behind them: a weak tie is no pivot for what
    /// conducts inside.
    pub fn conductances(&self, matrix: &Csc) -> Vec<(usize, usize, f64)> {
        let [sums, sizes] = self.sums_and_sizes(matrix);
        let both = sums.iter().zip(sizes.iter());
        let left = both.map(|((r, c, sum), (_, _, size))| {
            let rounding = self.bare[r] && self.is_sum(r) && sum.abs() <= ROUNDING * size;
            (r, c, if rounding { 0.0 } else { sum })
        });
        left.collect()
    }

    /// The same for what is stored.
    pub fn stored(&self, matrix: &Csc) -> Vec<(usize, usize, f64)> {
        let [sums, sizes] = self.sums_and_sizes(matrix);
        let left = sums.iter().zip(sizes.iter());
        let left = left.filter(|(sum, size)| {
            let summed = self.is_sum(sum.0) || self.windings.iter().any(|law| law.row == sum.0);
            !summed || sum.2.abs() > LOST * size.2
        });
        left.map(|(sum, _)| sum).collect()
    }

    /// A matrix with sums, and the sums of the sizes of the same entries.
    fn sums_and_sizes(&self, matrix: &Csc) -> [Csc; 2] {
        let terms = self.with_sums(matrix);
        let sizes: Vec<_> = terms.iter().map(|&(r, c, v)| (r, c, v.abs())).collect();
        [terms, sizes].map(|all| Csc::from_triplets(matrix.nrows, matrix.ncols, &all))
    }

    /// Turns the right-hand side of laws into one with sums; room for as many sums as there are laws.
    pub fn sum_up(&self, rhs: &mut [f64], sums: &mut [f64]) {
        let groups = || [&self.tied, &self.inner, &self.cuts].into_iter().flat_map(|f| &f.groups);
        // all from the laws themselves: the sum of a group may stand in the place of a law inside another
        for (sum, group) in sums.iter_mut().zip(groups()) {
            *sum = group.iter().map(|&row| rhs[row]).sum();
        }
        sums.iter().zip(groups()).for_each(|(sum, group)| rhs[group[0]] = *sum);
        self.windings.iter().for_each(|law| law.add_to(rhs));
    }
}

#[cfg(test)]
mod tests;

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

use crate::descriptor::{stored_columns, stored_groups};
use crate::sparse::Csc;
use crate::union_find::UnionFind;
use crate::windings::{laws_without_storage, Multiples};

/// Conductances that sum to this part of their sizes sum to zero: less is lost in their assembly.
const ROUNDING: f64 = f64::EPSILON;
/// The same for charges and fluxes.
pub(crate) const LOST: f64 = 1e-12;
/// A tie of this part of the conductances beside it: what it carries is rounding of theirs.
const WEAK: f64 = 1e-6;
/// Ties to ground of this part leave the sum of a cut set worth while: rounding of the charges of junctions
/// over a short step is more than what they carry.
const LIGHT: f64 = 1e-2;

/// The laws that groups of unknowns and some columns of a matrix join, and which of them are in no group
/// whose sum has anything of these columns left; such currents may `stay` in more than one law.  What is at
/// most a `weak` part of what stands beside it joins nothing; what sums to a `left` part of its size, at most,
/// is nothing left.
fn joined(
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
fn entries_in_laws(matrix: &Csc, c: usize, law: impl Fn(usize) -> bool) -> Vec<(usize, f64)> {
    let (rows, values) = matrix.col(c);
    let own = rows.iter().zip(values).filter(|(&row, v)| law(row) && **v != 0.0);
    own.map(|(&row, &v)| (row, v)).collect()
}

/// Of each law of a current, what its node stores towards ground.  The rounding of this is in every sum that
/// contains the law: the sum in the place of another one, of a coil's end that nothing else leads to, would bring
/// it where there was none.
fn to_ground(e: &Csc, law: impl Fn(usize) -> bool) -> Vec<f64> {
    let (mut sum, mut size) = (vec![0.0; e.nrows], vec![0.0f64; e.nrows]);
    for (row, _, v) in e.iter().filter(|e| law(e.0) && law(e.1)) {
        sum[row] += v;
        size[row] += v.abs();
    }
    let left = |(sum, size): (&f64, f64)| if sum.abs() > LOST * size { sum.abs() } else { 0.0 };
    sum.iter().zip(size).map(left).collect()
}

/// The rows of entries that cancel, two by two, and the other entries.
fn cancelling(mut entries: Vec<(usize, f64)>) -> (Vec<[usize; 2]>, Vec<(usize, f64)>) {
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
        for mut group in std::mem::take(&mut self.tied.groups) {
            let bare = std::mem::take(&mut self.bare[group[0]]);
            let own = group.iter().position(|&row| !inside[row]);
            group.swap(0, own.unwrap_or(0));
            self.take(group, bare);
        }
    }

    /// Lets the sum of a group that something is left of towards ground take the place of the law in which most
    /// is stored (`e`).
    pub fn take_contents(&mut self, e: &Csc, row_kind: &[u8]) {
        let content = to_ground(e, |row| row_kind[row] == 0);
        for mut group in std::mem::take(&mut self.tied.groups) {
            let bare = std::mem::take(&mut self.bare[group[0]]);
            // sums inside take the place of their laws
            let free = |&k: &usize| self.inner.first[group[k]].is_none();
            let outside = (0..group.len()).filter(free);
            let fuller = |most: usize, k: usize| {
                if content[group[k]] > content[group[most]] {
                    k
                } else {
                    most
                }
            };
            let most = outside.fold(0, fuller);
            group.swap(0, most);
            self.take(group, bare);
        }
    }

    /// Adds the cut sets of windings: groups of nodes that nothing but windings (branches in `e`) and weak ties
    /// connect to the rest, and in whose laws nothing stands `beside` that their sum keeps: junctions (columns of
    /// `inside`) and capacitors lie between two of them.  In the sum of these no voltages are left, whose
    /// gigavolts in an impulse hide that the currents of the windings vanish, and no charges, whose rounding
    /// over a short step hides it, too.
    pub fn take_cut_sets(
        &mut self,
        e: &Csc,
        g: &Csc,
        row_kind: &[u8],
        inside: [&Csc; 2],
        beside: &[bool],
    ) {
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
        let alone = |row: usize| free[row] && !beside[row];
        cuts.retain(|cut| cut.len() > 1 && cut.iter().all(|&row| alone(row)));
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

    /// The rows of each group, of which the sum takes the place of the first.
    pub fn groups(&self) -> &[Vec<usize>] {
        &self.tied.groups
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

    /// Turns the right-hand side of laws into one with sums.
    pub fn sum_up(&self, rhs: &mut [f64]) {
        for group in [&self.tied, &self.inner, &self.cuts].into_iter().flat_map(|f| &f.groups) {
            rhs[group[0]] = group.iter().map(|&row| rhs[row]).sum();
        }
        self.windings.iter().for_each(|law| law.add_to(rhs));
    }
}

#[cfg(test)]
mod tests {
    use super::Floating;
    use crate::sparse::Csc;

    /// A capacitor between nodes 0 and 1; sources with the currents 4 and 5, from node 1 to node 2 and
    /// from there to `far` or to ground.
    fn example(far: Option<usize>) -> Floating {
        let e = [(0, 0, 1.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)];
        let mut g = vec![(1, 4, 1.0), (2, 4, -1.0), (2, 5, 1.0), (0, 0, 0.1), (0, 3, -0.1)];
        g.extend(far.map(|node| (node, 5, -1.0)));
        let matrix = |list: &[_]| Csc::from_triplets(6, 6, list);
        Floating::new(&matrix(&e), &matrix(&g), &[0, 0, 0, 0, 1, 1])
    }

    #[test]
    fn a_group_reaches_across_sources() {
        let floating = example(Some(3));
        let mut rhs = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
        floating.sum_up(&mut rhs);
        assert_eq!(rhs, [15.0, 2.0, 4.0, 8.0, 16.0, 32.0]);
        assert!(floating.is_sum(0) && !floating.is_sum(1));
        let sums = [(0, 4), (0, 5)].map(|place| {
            let g =
                Csc::from_triplets(6, 6, &[(1, 4, 1.0), (2, 4, -1.0), (2, 5, 1.0), (3, 5, -1.0)]);
            let at = |e: &&(usize, usize, f64)| (e.0, e.1) == place;
            floating.with_sums(&g).iter().filter(at).map(|e| e.2).sum::<f64>()
        });
        assert_eq!(sums, [0.0; 2]);
    }

    #[test]
    fn a_source_to_ground_makes_up_for_the_sum() {
        assert!(!example(None).is_sum(0));
    }

    #[test]
    fn a_star_of_windings_is_a_cut_set() {
        // windings 4, 5 and 6 from ground to nodes 0, 1 and 2; resistors from there to node 3
        let mut g = vec![(3, 3, 3.0)];
        for k in 0..3 {
            g.extend([(k, k, 1.0), (k, 3, -1.0), (3, k, -1.0)]);
            g.extend([(k, 4 + k, -1.0), (4 + k, k, 1.0)]);
        }
        let g = Csc::from_triplets(7, 7, &g);
        let e = Csc::from_triplets(7, 7, &[4, 5, 6].map(|k| (k, k, 1e-3)));
        let kinds = [0, 0, 0, 0, 1, 1, 1];
        let mut floating = Floating::new(&e, &g, &kinds);
        let none = Csc::from_triplets(7, 0, &[]);
        let junction =
            |from: usize, to: usize| Csc::from_triplets(7, 1, &[(from, 0, 1.0), (to, 0, -1.0)]);
        let pair = |row: usize| (0..7).map(|k| k == row).collect::<Vec<_>>();
        // to a winding; from inside to the rest
        floating.take_cut_sets(&e, &g, &kinds, [&none, &none], &pair(2));
        floating.take_cut_sets(&e, &g, &kinds, [&none, &junction(2, 4)], &pair(7));
        assert!(!floating.has_cut_sets());
        floating.take_cut_sets(&e, &g, &kinds, [&none, &junction(2, 1)], &pair(7));
        assert_eq!(floating.cuts.groups, [[0, 1, 2, 3]]);
        let law = floating.conductances(&g).into_iter().filter(|e| e.0 == 0 && e.2 != 0.0);
        assert_eq!(law.collect::<Vec<_>>(), [(0, 4, -1.0), (0, 5, -1.0), (0, 6, -1.0)]);
    }

    #[test]
    fn a_rectifier_behind_coils_is_a_cut_set() {
        // coils 3 and 4 end at nodes 0 and 1, junctions lead from there to node 2 and a capacitor on to 5,
        // which a resistor ties to ground
        let mut e = vec![(3, 3, 1e-3), (4, 4, 1e-3)];
        e.extend([(2, 2, 1e-6), (2, 5, -1e-6), (5, 2, -1e-6), (5, 5, 1e-6)]);
        let e = Csc::from_triplets(6, 6, &e);
        let kinds = [0, 0, 0, 1, 1, 0];
        let junctions = [(0, 0, 1.0), (2, 0, -1.0), (1, 1, 1.0), (2, 1, -1.0)];
        let [junctions, none] = [&junctions[..], &[]].map(|list| Csc::from_triplets(6, 2, list));
        for (tie, cut) in [(-40, true), (-10, true), (-1, false)] {
            let tie = 2f64.powi(tie);
            let mut g = vec![(0, 3, -1.0), (1, 4, -1.0), (3, 0, 1.0), (4, 1, 1.0)];
            g.extend([(2, 2, 1.0), (2, 5, -1.0), (5, 2, -1.0), (5, 5, 1.0 + tie)]);
            let g = Csc::from_triplets(6, 6, &g);
            let mut floating = Floating::new(&e, &g, &kinds);
            assert_eq!(floating.groups(), [[2, 5]]);
            floating.take_cut_sets(&e, &g, &kinds, [&junctions, &none], &[false; 6]);
            // its sum takes the place of that of the capacitor, not of the law of a coil's end
            assert_eq!(floating.groups().is_empty(), cut);
            assert_eq!(floating.cuts.groups.len(), usize::from(cut));
            if !cut {
                continue;
            }
            assert_eq!(floating.cuts.groups[0][0], 2);
            let left = floating.conductances(&g).into_iter().filter(|e| e.0 == 2 && e.2 != 0.0);
            assert_eq!(left.collect::<Vec<_>>(), [(2, 3, -1.0), (2, 4, -1.0), (2, 5, tie)]);
            let mut rhs = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
            floating.sum_up(&mut rhs);
            assert_eq!(rhs, [1.0, 2.0, 39.0, 8.0, 16.0, 32.0]);
        }
    }

    #[test]
    fn a_group_around_a_cut_set_keeps_a_law_outside_it() {
        // windings 3 and 4 from node 2 to nodes 0 and 1, which a resistor ties; nothing leads to ground
        let mut g = vec![(0, 0, 1.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)];
        g.extend((0..2).flat_map(|k| [(k, 3 + k, -1.0), (2, 3 + k, 1.0)]));
        let g = Csc::from_triplets(5, 5, &g);
        let e = Csc::from_triplets(5, 5, &[(3, 3, 1e-3), (4, 4, 1e-3)]);
        let mut floating = Floating::new(&e, &g, &[0, 0, 0, 1, 1]);
        let sum = |floating: &Floating| {
            let mut rhs = [1.0, 2.0, 4.0, 8.0, 16.0];
            floating.sum_up(&mut rhs);
            rhs
        };
        assert_eq!(sum(&floating), [7.0, 2.0, 4.0, 8.0, 16.0]);
        let none = Csc::from_triplets(5, 0, &[]);
        floating.take_cut_sets(&e, &g, &[0, 0, 0, 1, 1], [&none, &none], &[false; 5]);
        assert_eq!(sum(&floating), [3.0, 2.0, 7.0, 8.0, 16.0]);
    }

    #[test]
    fn a_capacitor_between_coils_has_a_sum_inside_that_of_all() {
        // coils 4 and 5 from node 0 to 1 and from 2 to 3, a capacitor between 1 and 2
        let g = [(0, 4, 1.0), (1, 4, -1.0), (2, 5, 1.0), (3, 5, -1.0)];
        let e = [(1, 1, 1.0), (1, 2, -1.0), (2, 1, -1.0), (2, 2, 1.0), (4, 4, 1.0), (5, 5, 1.0)];
        let [e, g] = [&e[..], &g[..]].map(|list| Csc::from_triplets(6, 6, list));
        let kinds = [0, 0, 0, 0, 1, 1];
        // a source joins all
        let joined: Vec<_> = g.iter().chain([(0, 3, 1.0), (3, 3, -1.0)]).collect();
        let floating = Floating::new(&e, &Csc::from_triplets(6, 6, &joined), &kinds);
        let mut rhs = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
        floating.sum_up(&mut rhs);
        assert_eq!(rhs, [15.0, 6.0, 4.0, 8.0, 16.0, 32.0]);
    }

    #[test]
    fn a_resistor_beside_a_capacitor_belongs_to_its_sum() {
        // a coil 3 from ground to node 0, a resistor on to node 1, a capacitor on to node 2, a coil 4 to ground
        let e = [(1, 1, 1.0), (1, 2, -1.0), (2, 1, -1.0), (2, 2, 1.0), (3, 3, 1.0), (4, 4, 1.0)];
        let e = Csc::from_triplets(5, 5, &e);
        for (ground, whole) in [(0.0, true), (0.5, false)] {
            let mut g = vec![(0, 3, -1.0), (2, 4, 1.0), (3, 0, 1.0), (4, 2, -1.0)];
            g.extend([(0, 0, 2.0 + ground), (0, 1, -2.0), (1, 0, -2.0), (1, 1, 2.0)]);
            let g = Csc::from_triplets(5, 5, &g);
            let floating = Floating::new(&e, &g, &[0, 0, 0, 1, 1]);
            // where another one ties it to ground, too, the sum would keep a voltage: without it, it has the
            // current of the first
            let sum = if whole { vec![0, 1, 2] } else { vec![1, 2] };
            assert_eq!(floating.groups(), std::slice::from_ref(&sum));
            let left =
                floating.conductances(&g).into_iter().filter(|e| e.0 == sum[0] && e.2 != 0.0);
            let left: Vec<_> = left.collect();
            let resistor: &[_] = if whole { &[] } else { &[(1, 0, -2.0), (1, 1, 2.0)] };
            let coils = [(sum[0], 3, -1.0), (sum[0], 4, 1.0)];
            let coils = &coils[usize::from(!whole)..];
            assert_eq!(left.len(), resistor.len() + coils.len(), "{left:?}");
            assert!(resistor.iter().chain(coils).all(|e| left.contains(e)), "{left:?}");
            // the capacitor's own sum goes on inside
            assert!(floating.is_sum(sum[0]) && floating.is_sum(1));
        }
    }

    #[test]
    fn resistors_leave_a_sum_that_they_do_not_tie_to_ground() {
        let e = Csc::from_triplets(3, 3, &[(1, 1, 1e-9)]);
        let tied = |ground: f64| {
            let g = [(0, 0, 0.1), (0, 1, -0.1), (1, 0, -0.1), (1, 1, 0.1 + ground), (2, 2, 1.0)];
            let g = Csc::from_triplets(3, 3, &g);
            let mut floating = Floating::new(&e, &g, &[0, 0, 0]);
            assert!(!floating.is_sum(1));
            floating.take_contents(&e, &[0, 0, 0]);
            (floating, g)
        };
        let (floating, g) = tied(0.0);
        // in the place of the law that has the charge: the other one has no rounding of it
        assert!(!floating.is_sum(0) && floating.is_sum(1) && !floating.is_sum(2));
        assert!(floating.conductances(&g).iter().filter(|e| e.0 == 1).all(|e| e.2 == 0.0));
        // what is stored there stays
        assert_eq!(floating.stored(&e), [(1, 1, 1e-9)]);
        // a weak tie stays, too, a strong one makes a sum useless
        let (floating, g) = tied(2f64.powi(-46));
        let left = floating.conductances(&g).into_iter().filter(|e| e.0 == 1);
        assert_eq!(left.collect::<Vec<_>>(), [(1, 0, 0.0), (1, 1, 2f64.powi(-46))]);
        assert!(!tied(1e-3).0.is_sum(1));
    }
}

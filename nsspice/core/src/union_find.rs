//! Disjoint sets (union-find).

/// Disjoint sets of the numbers below a count (Tarjan, J. ACM 22, 1975, with paths halved).
#[derive(Clone, Debug)]
pub struct UnionFind(Vec<usize>);

impl UnionFind {
    /// Each number alone.
    pub fn new(count: usize) -> UnionFind {
        UnionFind((0..count).collect())
    }

    /// The number that stands for the set of another.
    pub fn root(&mut self, mut i: usize) -> usize {
        while self.0[i] != i {
            self.0[i] = self.0[self.0[i]];
            i = self.0[i];
        }
        i
    }

    /// Joins the sets of two numbers, that of the second stands for both; false if they are one already.
    pub fn join(&mut self, i: usize, j: usize) -> bool {
        let (i, j) = (self.root(i), self.root(j));
        self.0[i] = j;
        i != j
    }

    /// The sets of some numbers, each as a list, in the order of their representatives.
    pub fn groups(&mut self, members: impl Iterator<Item = usize>) -> Vec<Vec<usize>> {
        let mut groups = vec![Vec::new(); self.0.len()];
        members.for_each(|k| groups[self.root(k)].push(k));
        groups.retain(|group| !group.is_empty());
        groups
    }
}

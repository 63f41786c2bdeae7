//! The undirected graph of a matrix, for the ordering heuristics.

use super::{Csc, Ordering};

/// An undirected graph in adjacency lists, without loops and without duplicates.
pub(super) struct Graph {
    start: Vec<u32>,
    adjacent: Vec<u32>,
}

impl Graph {
    /// The graph of `K`, in which a pair couples the unknowns that it touches.
    pub fn contracted(matrix: &Csc, ordering: &Ordering) -> Self {
        // a pair touches two nodes as a rule; far more come from dense control laws only, where a
        // star stands for the clique to keep the graph sparse
        const CLIQUE: usize = 8;
        let fixed = ordering.first_switching;
        let mut edges: Vec<(u32, u32)> = Vec::with_capacity(2 * matrix.rowidx.len());
        let mut join = |a: usize, b: usize| {
            if a != b {
                edges.push((a as u32, b as u32));
                edges.push((b as u32, a as u32));
            }
        };
        for (r, c, _) in matrix.iter().filter(|&(r, c, _)| r < fixed && c < fixed) {
            join(r, c);
        }
        let mut touched = Vec::new();
        for pair in fixed..matrix.nrows {
            touched.clear();
            touched.extend(ordering.neighbours(matrix, pair).filter(|&v| v < fixed));
            touched.sort_unstable();
            touched.dedup();
            let centres = if touched.len() <= CLIQUE { touched.len() } else { 1 };
            for i in 0..centres {
                for &w in &touched[i + 1..] {
                    join(touched[i], w);
                }
            }
        }
        edges.sort_unstable();
        edges.dedup();
        let mut start = vec![0u32; fixed + 1];
        for &(a, _) in &edges {
            start[a as usize + 1] += 1;
        }
        for v in 0..fixed {
            start[v + 1] += start[v];
        }
        Graph { start, adjacent: edges.iter().map(|e| e.1).collect() }
    }

    /// Number of vertices.
    pub fn size(&self) -> usize {
        self.start.len() - 1
    }

    /// Neighbours in ascending order.
    pub fn adjacent(&self, v: u32) -> &[u32] {
        let v = v as usize;
        &self.adjacent[self.start[v] as usize..self.start[v + 1] as usize]
    }

    /// Rank of each vertex in an approximate minimum degree order (Amestoy, Davis & Duff 1996).
    pub fn minimum_degree_rank(&self) -> Vec<u32> {
        let n = self.size();
        // with its diagonal: the crate subtracts the size from the number of entries
        let mut start = vec![0i64; n + 1];
        let mut index = Vec::with_capacity(self.adjacent.len() + n);
        for v in 0..n {
            let list = self.adjacent(v as u32);
            let split = list.partition_point(|&w| (w as usize) < v);
            index.extend(list[..split].iter().map(|&w| i64::from(w)));
            index.push(v as i64);
            index.extend(list[split..].iter().map(|&w| i64::from(w)));
            start[v + 1] = index.len() as i64;
        }
        let (_, rank, _) = amd::order(n as i64, &start, &index, &amd::Control::default())
            .expect("a graph with sorted lists is valid input");
        rank.into_iter().map(|r| r as u32).collect()
    }
}

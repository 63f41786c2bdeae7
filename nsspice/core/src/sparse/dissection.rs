//! Nested dissection of graphs with small separators.

use super::graph::Graph;

/// Parts up to this size are not divided further.
const LEAF: usize = 12;

/// An elimination order of the vertices.  Where a few vertices separate a part into two of similar
/// size (George 1973, by the levels of a breadth-first search), both halves come before their
/// separator, so that a change in one place reaches few later columns; minimum degree alone would
/// eliminate a ladder from end to end and make every column depend on all before it.  Parts without
/// a small separator keep the order of minimum degree, which fills less.
pub(super) fn dissect(graph: &Graph, divide: bool) -> Vec<u32> {
    let n = graph.size();
    let rank = graph.minimum_degree_rank();
    let mut all: Vec<u32> = (0..n as u32).collect();
    if !divide {
        all.sort_unstable_by_key(|&v| rank[v as usize]);
        return all;
    }
    // a rail that touches everything would hide every separator: it goes last
    let dense = (10.0 * (n as f64).sqrt()).max(16.0) as usize;
    let (mut rails, rest): (Vec<u32>, Vec<u32>) =
        all.into_iter().partition(|&v| graph.adjacent(v).len() > dense);
    let mut state =
        Dissection { graph, rank: &rank, part: vec![1; n], parts: 1, out: Vec::with_capacity(n) };
    rails.sort_unstable_by_key(|&v| rank[v as usize]);
    for &v in &rails {
        state.part[v as usize] = 0;
    }
    state.components(rest, 1);
    state.out.extend(rails);
    state.out
}

struct Dissection<'a> {
    graph: &'a Graph,
    rank: &'a [u32],
    /// the part in which each vertex lies; 0 once it is a separator
    part: Vec<u32>,
    parts: u32,
    out: Vec<u32>,
}

impl Dissection<'_> {
    /// Orders each connected component of a part.
    fn components(&mut self, vertices: Vec<u32>, part: u32) {
        if vertices.len() <= LEAF {
            return self.leaf(vertices);
        }
        for v in vertices {
            if self.part[v as usize] == part {
                let (component, _) = self.search(v);
                self.connected(component);
            }
        }
    }

    fn leaf(&mut self, mut vertices: Vec<u32>) {
        vertices.sort_unstable_by_key(|&v| self.rank[v as usize]);
        self.out.extend(vertices);
    }

    /// Divides a connected part; the depth of the recursion is logarithmic because neither half
    /// may exceed three quarters.
    fn connected(&mut self, vertices: Vec<u32>) {
        let size = vertices.len();
        if size <= LEAF {
            return self.leaf(vertices);
        }
        // the vertex found last lies at the rim: seen from there the levels are many and narrow
        let (found, levels) = self.search(vertices[size - 1]);
        let balanced = |l: &usize| levels[*l] >= size / 4 && size - levels[l + 1] >= size / 4;
        let width = |l: usize| levels[l + 1] - levels[l];
        let Some(level) = (0..levels.len() - 1)
            .filter(balanced)
            .min_by_key(|&l| (width(l), (levels[l] + levels[l + 1]).abs_diff(size)))
        else {
            return self.leaf(vertices);
        };
        // a wide separator costs more fill than the short paths are worth
        if 4 * width(level) * width(level) > size.max(4 * LEAF) {
            return self.leaf(vertices);
        }
        let (before, rest) = found.split_at(levels[level]);
        let (separator, after) = rest.split_at(width(level));
        for &v in separator {
            self.part[v as usize] = 0;
        }
        for half in [before, after] {
            self.parts += 1;
            for &v in half {
                self.part[v as usize] = self.parts;
            }
            self.components(half.to_vec(), self.parts);
        }
        self.leaf(separator.to_vec());
    }

    /// Breadth-first search of the component of `root` within its part, which becomes a part of its
    /// own: the vertices in the order of discovery, and the start of each level.
    fn search(&mut self, root: u32) -> (Vec<u32>, Vec<usize>) {
        let old = self.part[root as usize];
        self.parts += 1;
        self.part[root as usize] = self.parts;
        let (mut found, mut levels) = (vec![root], vec![0]);
        while *levels.last().expect("at least one level") < found.len() {
            let level = levels[levels.len() - 1]..found.len();
            levels.push(found.len());
            for i in level {
                for &w in self.graph.adjacent(found[i]) {
                    if self.part[w as usize] == old {
                        self.part[w as usize] = self.parts;
                        found.push(w);
                    }
                }
            }
        }
        (found, levels)
    }
}

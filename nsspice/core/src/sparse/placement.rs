//! Places rows without a diagonal entry where elimination has filled their diagonal.

use super::graph::Graph;
use super::{Csc, Ordering};

/// Merges pairs, and rows of `K` without a diagonal entry, into the order `first` of the unknowns of
/// `K`.
///
/// An eliminated unknown fills the diagonals of its neighbours, but good for one of them only: of
/// two ideal diodes at a node, both conducting, the first connects the node to its other end and leaves
/// nothing to the second.  So each eliminated unknown of `K` lets one waiting neighbour follow.  It
/// may pass its turn on if that neighbour can use another one's (an augmenting path, as in
/// bipartite matching).  A pair lets nothing follow, since it fills nothing while it blocks.  No row
/// waits longer than until all its neighbours, rails aside, are eliminated.
pub(super) fn place(matrix: &Csc, ordering: &Ordering, graph: &Graph, first: &[u32]) -> Vec<u32> {
    let (n, fixed) = (matrix.nrows, ordering.first_switching);
    let mut rank = vec![0u32; n];
    for (k, &v) in first.iter().enumerate() {
        rank[v as usize] = k as u32;
    }
    let mut filled = vec![false; n];
    for (r, c, v) in matrix.iter() {
        filled[c] |= r == c && c < fixed && v != 0.0;
    }
    let mut state = vec![State::Ahead; n];
    state[fixed..].fill(State::Waiting);
    let mut work = Placement {
        matrix,
        graph,
        ordering,
        rank,
        state,
        ahead: vec![0; n],
        owner: vec![NONE; n],
        spent: vec![false; n],
        out: Vec::with_capacity(n),
    };
    for w in 0..n {
        work.ahead[w] = work.unknowns(w).filter(|&v| work.awaited(v)).count() as u32;
    }
    for &v in first {
        let v = v as usize;
        if work.state[v] == State::Ahead {
            if filled[v] {
                work.emit(v);
            } else {
                work.wait(v);
            }
        }
    }
    let mut out = work.out;
    out.extend((0..n as u32).filter(|&v| work.state[v as usize] != State::Done));
    out
}

const NONE: u32 = u32::MAX;

#[derive(Clone, Copy, PartialEq)]
enum State {
    /// its turn has not come
    Ahead,
    /// to follow a neighbour
    Waiting,
    Done,
}

struct Placement<'a> {
    matrix: &'a Csc,
    graph: &'a Graph,
    ordering: &'a Ordering,
    rank: Vec<u32>,
    state: Vec<State>,
    /// number of neighbours to wait for that are not eliminated yet
    ahead: Vec<u32>,
    /// the eliminated unknown that each row follows
    owner: Vec<u32>,
    /// whether some row follows the unknown
    spent: Vec<bool>,
    out: Vec<u32>,
}

impl<'a> Placement<'a> {
    /// Neighbours in `K`; one may appear twice.
    fn unknowns(&self, v: usize) -> impl Iterator<Item = usize> + 'a {
        let fixed = self.ordering.first_switching;
        self.ordering.neighbours(self.matrix, v).filter(move |&w| w < fixed && w != v)
    }

    /// Whether rows may wait for `v`: the elimination of a rail would join all that did.
    fn awaited(&self, v: usize) -> bool {
        const RAIL: usize = 16;
        self.graph.adjacent(v as u32).len() <= RAIL
    }

    /// Eliminates `v`, and what may follow.
    fn emit(&mut self, v: usize) {
        let mut next = self.out.len();
        self.state[v] = State::Done;
        self.out.push(v as u32);
        while next < self.out.len() {
            let u = self.out[next] as usize;
            next += 1;
            if u >= self.ordering.first_switching {
                continue;
            }
            self.offer(u);
            for w in self.ordering.neighbours(self.matrix, u).filter(|&w| w != u) {
                self.ahead[w] -= u32::from(self.awaited(u));
                // nothing that could still come would fill its diagonal
                if self.ahead[w] == 0 && self.state[w] == State::Waiting {
                    self.state[w] = State::Done;
                    self.out.push(w as u32);
                }
            }
        }
    }

    /// Lets a row without a diagonal entry follow an eliminated neighbour now or later.
    fn wait(&mut self, v: usize) {
        self.state[v] = State::Waiting;
        let supplier = self.unknowns(v).find(|&u| self.state[u] == State::Done && !self.spent[u]);
        if let Some(u) = supplier {
            self.spent[u] = true;
            self.owner[v] = u as u32;
        }
        if supplier.is_some() || self.ahead[v] == 0 {
            self.emit(v);
        }
    }

    /// Lets one waiting row follow the newly eliminated `v`, or the owner of a row that can follow
    /// `v` instead.
    fn offer(&mut self, v: usize) {
        const REACH: usize = 16;
        // owners that would get their turn back, and the row that would change to the one before
        let mut owners = vec![(v, NONE, 0)];
        let mut i = 0;
        while i < owners.len() {
            let u = owners[i].0;
            if let Some(w) = self.candidate(u) {
                self.state[w] = State::Done;
                self.out.push(w as u32);
                self.owner[w] = u as u32;
                self.spent[v] = true;
                while owners[i].1 != NONE {
                    let (_, row, before) = owners[i];
                    self.owner[row as usize] = owners[before].0 as u32;
                    i = before;
                }
                return;
            }
            for r in self.ordering.neighbours(self.matrix, u) {
                let owner = self.owner[r];
                let known = owner == NONE || owners.iter().any(|o| o.0 == owner as usize);
                if !known && r != u && owners.len() < REACH {
                    owners.push((owner as usize, r as u32, i));
                }
            }
            i += 1;
        }
    }

    /// The waiting neighbour of `u` that would have to wait longest for another chance.
    fn candidate(&self, u: usize) -> Option<usize> {
        let waiting = |w: &usize| *w != u && self.state[*w] == State::Waiting;
        self.ordering.neighbours(self.matrix, u).filter(waiting).max_by_key(|&w| {
            let ahead = self.unknowns(w).filter(|&x| self.state[x] != State::Done);
            let ahead = ahead.filter(|&x| self.awaited(x));
            ahead.map(|x| self.rank[x]).min().unwrap_or(NONE)
        })
    }
}

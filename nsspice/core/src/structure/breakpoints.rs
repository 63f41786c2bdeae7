//! Sources whose slope decides about currents: at their breakpoints something may jump.
//!
//! Charges and fluxes are continuous where the slope of a source jumps, and so is all that follows from
//! them and from the sources themselves.  The exceptions are a loop of capacitors that the source closes
//! (its current is `C u'`) and a cut-set of inductors that it completes (its voltage is `L u'`): behind a
//! breakpoint pairs may have to change there.  Elsewhere a step that ends at the breakpoint goes on.
//!
//! The source is followed through branches of fixed voltage (sources, controlled sources, pairs without
//! resistance) to the nodes whose voltages it gives; a node with a capacitor closes a loop.  What is not
//! recognised counts as a loop.

use crate::descriptor::{Linear, Smooth};
use crate::sparse::Csc;

/// The entries of a matrix by row and by column.
struct Sides {
    rows: Vec<Vec<(usize, f64)>>,
    columns: Vec<Vec<(usize, f64)>>,
}

impl Sides {
    fn new(matrix: &Csc) -> Sides {
        let mut sides =
            Sides { rows: vec![Vec::new(); matrix.nrows], columns: vec![Vec::new(); matrix.ncols] };
        for (r, c, v) in matrix.iter().filter(|e| e.2 != 0.0) {
            sides.rows[r].push((c, v));
            sides.columns[c].push((r, v));
        }
        sides
    }

    fn has(&self, row: usize, column: usize) -> bool {
        self.rows[row].iter().any(|e| e.0 == column)
    }
}

/// One search.
struct Search<'a> {
    kind: &'a [u8],
    e: &'a Sides,
    g: &'a Sides,
    b: &'a Sides,
    d: &'a Sides,
    functions: Option<&'a Functions>,
    /// unknowns found so far
    reached: Vec<bool>,
    waiting: Vec<usize>,
}

/// What smooth functions read, and where they are.
struct Functions {
    /// variables of each function: unknowns, then sources
    reads: Vec<Vec<usize>>,
    /// functions that read each variable
    readers: Vec<Vec<usize>>,
    f: Sides,
    q: Sides,
}

impl Functions {
    fn new(smooth: &Smooth) -> Functions {
        let program = smooth.tape.program();
        let reads: Vec<Vec<usize>> =
            (0..program.len()).map(|k| program.derivatives(k).map(|e| e.0).collect()).collect();
        let mut readers = vec![Vec::new(); program.time_variable() + 1];
        for (k, list) in reads.iter().enumerate() {
            list.iter().for_each(|&j| readers[j].push(k));
        }
        Functions { reads, readers, f: Sides::new(&smooth.f), q: Sides::new(&smooth.q) }
    }
}

impl Search<'_> {
    fn reach(&mut self, unknown: usize) {
        if !std::mem::replace(&mut self.reached[unknown], true) {
            self.waiting.push(unknown);
        }
    }

    /// A row of voltages that contains what moves: true if something stored has to follow.
    fn row(&mut self, row: usize) -> bool {
        // the flux of an inductor takes up any voltage, a resistance the difference
        if !self.e.rows[row].is_empty() {
            return !self.e.has(row, row);
        }
        if !self.g.has(row, row) {
            let g = self.g;
            g.rows[row].iter().for_each(|&(c, _)| self.reach(c));
        }
        false
    }

    /// A function whose value moves.
    fn function(&mut self, k: usize, by: usize) -> bool {
        let Some(functions) = self.functions else { return false };
        if !functions.q.columns[k].is_empty() {
            return true;
        }
        functions.f.columns[k].iter().any(|&(row, _)| match self.kind[row] {
            // a current that follows the voltage across it is a conductance
            0 => row != by && !functions.reads[k].contains(&row),
            _ => self.row(row),
        })
    }

    /// An unknown that moves.
    fn unknown(&mut self, j: usize) -> bool {
        if !self.e.columns[j].is_empty() {
            return true;
        }
        if self.kind[j] == 1 {
            return false; // a current that is stored nowhere
        }
        let g = self.g;
        let driven = g.columns[j].iter().any(|&(row, _)| match self.kind[row] {
            0 => row != j && !g.has(j, row),
            _ => self.row(row),
        });
        let b = self.b;
        for &(pair, _) in &b.columns[j] {
            if !self.d.has(pair, pair) {
                b.rows[pair].iter().for_each(|&(c, _)| self.reach(c));
            }
        }
        let functions = self.functions;
        let read = |f: &Functions, s: &mut Self| f.readers[j].iter().any(|&k| s.function(k, j));
        driven || functions.is_some_and(|f| read(f, self))
    }

    fn finish(&mut self) -> bool {
        while let Some(j) = self.waiting.pop() {
            if self.unknown(j) {
                return true;
            }
        }
        false
    }
}

/// Of each source, whether a jump of its slope may change currents of capacitors or voltages of inductors.
pub fn kinks_that_reach_storage(linear: &Linear, smooth: Option<&Smooth>) -> Vec<bool> {
    let [e, g, b, d] = [&linear.e, &linear.g, &linear.b, &linear.d].map(Sides::new);
    let functions = smooth.map(Functions::new);
    let n = linear.g.nrows;
    let one = |source: usize| {
        let mut search = Search {
            kind: &linear.row_kind,
            e: &e,
            g: &g,
            b: &b,
            d: &d,
            functions: functions.as_ref(),
            reached: vec![false; n],
            waiting: Vec::new(),
        };
        let (rows, values) = linear.s.col(source);
        let driven = rows.iter().zip(values).filter(|e| *e.1 != 0.0);
        // a current may complete a cut-set of inductors, and a pair may see nothing but the source
        let direct = |search: &mut Search, row: usize| linear.row_kind[row] == 0 || search.row(row);
        let read = |f: &Functions, search: &mut Search| {
            f.readers[n + source].iter().any(|&k| search.function(k, usize::MAX))
        };
        driven.clone().any(|(&row, _)| direct(&mut search, row))
            || functions.as_ref().is_some_and(|f| read(f, &mut search))
            || search.finish()
    };
    (0..linear.s.ncols).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A source (current 2) at node 0, and 1 Ohm to node 1 with a capacitor; `more` entries of G and E.
    fn network(g: &[(usize, usize, f64)], e: &[(usize, usize, f64)]) -> Vec<bool> {
        let mut all = vec![(0, 2, 1.0), (2, 0, -1.0)];
        all.extend([(0, 0, 1.0), (1, 1, 1.0), (0, 1, -1.0), (1, 0, -1.0)]);
        all.extend(g);
        let mut stored = vec![(1, 1, 1e-6)];
        stored.extend(e);
        let linear = Linear {
            e: Csc::from_triplets(5, 5, &stored),
            g: Csc::from_triplets(5, 5, &all),
            a: Csc::from_triplets(5, 0, &[]),
            b: Csc::from_triplets(0, 5, &[]),
            d: Csc::from_triplets(0, 0, &[]),
            q: Vec::new(),
            s: Csc::from_triplets(5, 2, &[(2, 0, -1.0), (1, 1, 1.0)]),
            row_kind: vec![0, 0, 1, 0, 1],
        };
        kinks_that_reach_storage(&linear, None)
    }

    #[test]
    fn a_resistor_takes_up_what_the_source_moves() {
        assert_eq!(network(&[], &[]), [false, true]);
    }

    #[test]
    fn capacitors_at_the_source_close_a_loop() {
        assert_eq!(network(&[], &[(0, 0, 1e-9)]), [true, true]);
    }

    #[test]
    fn loops_are_found_through_controlled_sources() {
        // node 3 follows node 0 (row and current 4)
        let copy = [(3, 4, 1.0), (4, 3, 1.0), (4, 0, -2.0)];
        assert_eq!(network(&copy, &[]), [false, true]);
        assert_eq!(network(&copy, &[(3, 3, 1e-9)]), [true, true]);
        // a current into node 3 that node 0 controls
        assert_eq!(network(&[(3, 0, 1.0)], &[]), [true, true]);
    }

    #[test]
    fn an_inductor_takes_up_any_voltage() {
        let inductor = [(0, 4, 1.0), (4, 0, -1.0)];
        assert_eq!(network(&inductor, &[(4, 4, 1e-3)]), [false, true]);
    }
}

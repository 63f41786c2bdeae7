//! Unknowns that sources alone give, one after the other: what is left of a law in which the others are known.

use crate::descriptor::Linear;

/// An unknown that follows from the sources of a law, and from unknowns that are given before it.
#[derive(Clone, Debug)]
pub struct Given {
    /// which unknown
    pub unknown: usize,
    /// the law
    pub row: usize,
    /// its factor there
    pub factor: f64,
    /// the other unknowns of the law, and their factors
    pub others: Vec<(usize, f64)>,
}

/// Finds such unknowns by laws in which nothing is stored and no pair stands; `functions` are the laws in which
/// functions stand.
pub fn given_by_sources(
    linear: &Linear,
    functions: impl Iterator<Item = usize>,
    wanted: impl Fn(usize) -> bool,
) -> Vec<Given> {
    let n = linear.g.nrows;
    let mut laws: Vec<Vec<(usize, f64)>> = vec![Vec::new(); n];
    linear.g.iter().filter(|e| e.2 != 0.0).for_each(|(row, c, v)| laws[row].push((c, v)));
    let mut waiting: Vec<bool> = (0..n).map(wanted).collect();
    let more = linear.e.iter().chain(linear.a.iter()).filter(|e| e.2 != 0.0).map(|e| e.0);
    more.chain(functions).for_each(|row| waiting[row] = false);
    let mut rows: Vec<usize> = (0..n).filter(|&row| waiting[row]).collect();
    let (mut known, mut found) = (vec![false; n], Vec::new());
    loop {
        let before = rows.len();
        rows.retain(|&row| {
            let mut open = laws[row].iter().filter(|e| !known[e.0]);
            let (Some(&(unknown, factor)), None) = (open.next(), open.next()) else { return true };
            let others = laws[row].iter().copied().filter(|e| e.0 != unknown).collect();
            found.push(Given { unknown, row, factor, others });
            known[unknown] = true;
            false
        });
        if rows.len() == before {
            return found;
        }
    }
}

//! Outputs that the sources determine by voltage laws alone: they are no polynomials, and need none.

use super::super::record::Sum;
use super::super::stepper::Stepper;

/// The outputs that are sums of sources, or have such a part, each with its number.
pub struct Driven {
    sums: Vec<(usize, Sum)>,
}

impl Driven {
    pub fn new(s: &Stepper) -> Driven {
        if s.smooth.is_none() {
            return Driven { sums: Vec::new() };
        }
        let unknowns = driven_unknowns(s);
        let sums = s.outputs.of_sources(&unknowns).into_iter().enumerate();
        Driven { sums: sums.filter_map(|(k, sum)| Some((k, sum?))).collect() }
    }

    /// Parts of all outputs.
    pub fn parts(sums: Vec<Sum>) -> Driven {
        let sums = sums.into_iter().enumerate();
        Driven { sums: sums.filter(|(_, sum)| !sum.is_empty()).collect() }
    }

    fn sums<'a>(&'a self, u: &'a [f64]) -> impl Iterator<Item = (usize, f64)> + 'a {
        let sum = |terms: &Sum| terms.iter().map(|&(j, factor)| factor * u[j]).sum();
        self.sums.iter().map(move |(k, terms)| (*k, sum(terms)))
    }

    /// Writes those of a row for the sources `u`.
    pub fn write(&self, u: &[f64], row: &mut [f64]) {
        self.sums(u).for_each(|(k, sum)| row[k] = sum);
    }

    /// Adds those parts of a row.
    pub fn add(&self, u: &[f64], row: &mut [f64]) {
        self.sums(u).for_each(|(k, sum)| row[k] += sum);
    }

    /// There are none.
    pub fn is_empty(&self) -> bool {
        self.sums.is_empty()
    }
}

/// What the unknowns are that follow, one after the other, from laws with one unknown left.
fn driven_unknowns(s: &Stepper) -> Vec<Option<Sum>> {
    let linear = &s.sys.linear;
    let n = s.z.len();
    let mut known: Vec<Option<Sum>> = vec![None; n];
    let mut other = vec![false; n]; // more than unknowns and sources is in the law
    let stored = linear.e.iter().chain(linear.a.iter()).filter(|e| e.2 != 0.0);
    stored.for_each(|e| other[e.0] = true);
    for smooth in s.smooth.iter() {
        smooth.newton.rows_of_functions().for_each(|r| other[r] = true);
    }
    let mut laws: Vec<Sum> = vec![Vec::new(); n];
    let mut given: Vec<Sum> = vec![Vec::new(); n];
    linear.g.iter().filter(|e| e.2 != 0.0).for_each(|(r, c, v)| laws[r].push((c, v)));
    linear.s.iter().filter(|e| e.2 != 0.0).for_each(|(r, j, v)| given[r].push((j, v)));
    let mut found = true;
    while std::mem::take(&mut found) {
        for r in (0..n).filter(|&r| linear.row_kind[r] == 1 && !other[r]) {
            let mut open = laws[r].iter().filter(|e| known[e.0].is_none());
            let (Some(&(c, own)), None) = (open.next(), open.next()) else { continue };
            let mut sum: Sum = given[r].iter().map(|&(j, v)| (j, v / own)).collect();
            for &(k, v) in laws[r].iter().filter(|e| e.0 != c) {
                let parts = known[k].iter().flatten();
                sum.extend(parts.map(|&(j, f)| (j, -f * v / own)));
            }
            known[c] = Some(sum);
            found = true;
        }
    }
    known
}

//! Outputs that the sources determine by voltage laws alone: they are no polynomials, and need none.

use crate::integrate::implicit::outputs::Sum;
use crate::integrate::implicit::stepper::Stepper;
use crate::source_determined::given_by_sources;

/// The outputs that are sums of sources, or have such a part, each with its number.
pub struct Driven {
    sums: Vec<(usize, Sum)>,
}

impl Driven {
    pub fn new(s: &Stepper) -> Driven {
        if s.solver.smooth.is_none() {
            return Driven { sums: Vec::new() };
        }
        let unknowns = driven_unknowns(s);
        let sums = s.recorder.outputs.of_sources(&unknowns).into_iter().enumerate();
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

/// Unknowns that laws of voltages give, as sums of sources.
fn driven_unknowns(s: &Stepper) -> Vec<Option<Sum>> {
    let linear = &s.solver.sys.linear;
    let functions = s.solver.smooth.iter().flat_map(|smooth| smooth.newton.rows_of_functions());
    let mut by_law: Vec<Sum> = vec![Vec::new(); s.state.z.len()];
    linear.s.iter().filter(|e| e.2 != 0.0).for_each(|(row, j, v)| by_law[row].push((j, v)));
    let mut known: Vec<Option<Sum>> = vec![None; s.state.z.len()];
    for given in given_by_sources(linear, functions, |row| linear.row_kind[row] == 1) {
        let mut sum: Sum = by_law[given.row].iter().map(|&(j, v)| (j, v / given.factor)).collect();
        for &(k, v) in &given.others {
            let parts = known[k].iter().flatten();
            sum.extend(parts.map(|&(j, f)| (j, -f * v / given.factor)));
        }
        known[given.unknown] = Some(sum);
    }
    known
}

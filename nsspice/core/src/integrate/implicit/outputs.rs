//! Output rows: linear functionals of unknowns, multipliers, rates, sources and smooth functions.

/// Which quantity a coefficient multiplies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// unknown z
    Unknown,
    /// multiplier
    Multiplier,
    /// time derivative of an unknown
    Rate,
    /// source value
    Source,
    /// smooth function
    Function,
    /// time derivative of a smooth function
    FunctionRate,
}

impl Part {
    /// All of them, in order.
    pub const ALL: [Part; 6] = [
        Part::Unknown,
        Part::Multiplier,
        Part::Rate,
        Part::Source,
        Part::Function,
        Part::FunctionRate,
    ];
}

/// A sum of quantities: their numbers and factors.
pub type Sum = Vec<(usize, f64)>;

/// The quantities that outputs combine.
#[derive(Clone, Copy, Debug)]
pub struct Quantities<'a> {
    /// unknowns z
    pub z: &'a [f64],
    /// multipliers
    pub l: &'a [f64],
    /// time derivatives of the unknowns
    pub rates: &'a [f64],
    /// source values
    pub u: &'a [f64],
    /// smooth functions and their time derivatives
    pub f: [&'a [f64]; 2],
}

/// Neighbouring outputs that are computed alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Group {
    /// quantities as they are, from this index on: node voltages one after the other
    Copied(usize),
    /// sums of terms
    Summed,
}

/// All outputs of a run, compiled to indices into one array of all quantities.
#[derive(Clone, Debug)]
pub struct Outputs {
    /// end of each group of outputs, and what the group is made of
    groups: Vec<(usize, Group)>,
    start: Vec<usize>,
    index: Vec<u32>,
    factor: Vec<f64>,
    needs_rates: bool,
    needs_function_rates: bool,
    /// scratch: z, l, rates, u, f, rates of f one after the other
    all: Vec<f64>,
    sizes: [usize; 6],
    /// weighted sums of all quantities over rows
    summed: Vec<f64>,
}

impl Outputs {
    /// Collects the terms of each output; `sizes` are the lengths of z, l, rates, u, f and
    /// its rates.
    pub fn new(outputs: &[Vec<(Part, usize, f64)>], sizes: [usize; 6]) -> Self {
        let mut made = Outputs {
            groups: Vec::new(),
            start: vec![0],
            index: Vec::new(),
            factor: Vec::new(),
            needs_rates: false,
            needs_function_rates: false,
            all: vec![0.0; sizes.iter().sum()],
            sizes,
            summed: Vec::new(),
        };
        for output in outputs {
            for &(part, index, factor) in output {
                made.needs_rates |= part == Part::Rate;
                made.needs_function_rates |= part == Part::FunctionRate;
                let offset: usize = sizes[..part as usize].iter().sum();
                made.index.push((offset + index) as u32);
                made.factor.push(factor);
            }
            made.start.push(made.index.len());
        }
        made.group();
        made
    }

    fn group(&mut self) {
        for output in 0..self.len() {
            let terms = self.start[output]..self.start[output + 1];
            let copied = (terms.len() == 1 && self.factor[terms.start] == 1.0)
                .then(|| self.index[terms.start] as usize);
            let begin = self.groups.len().checked_sub(2).map_or(0, |k| self.groups[k].0);
            match (self.groups.last_mut(), copied) {
                (Some((end, Group::Copied(first))), Some(index))
                    if *first + output - begin == index =>
                {
                    *end += 1;
                }
                (Some((end, Group::Summed)), None) => *end += 1,
                (_, Some(index)) => self.groups.push((output + 1, Group::Copied(index))),
                (_, None) => self.groups.push((output + 1, Group::Summed)),
            }
        }
    }

    /// Number of outputs.
    pub fn len(&self) -> usize {
        self.start.len() - 1
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// True if some output asks for a time derivative.
    pub fn needs_rates(&self) -> bool {
        self.needs_rates
    }

    /// True if some output asks for a time derivative of a smooth function.
    pub fn needs_function_rates(&self) -> bool {
        self.needs_function_rates
    }

    /// The unknowns and the sources in each output with their factors; None if some output has more than
    /// those.
    pub fn of_unknowns(&self) -> Option<Vec<[Sum; 2]>> {
        let [n, m, r, p, ..] = self.sizes;
        let first = n + m + r;
        let terms = |ends: &[usize]| {
            let range = ends[0]..ends[1];
            let all = self.index[range.clone()].iter().zip(&self.factor[range]);
            let mut found = [Vec::new(), Vec::new()];
            for (&index, &factor) in all {
                match index as usize {
                    j if j < n => found[0].push((j, factor)),
                    j if (first..first + p).contains(&j) => found[1].push((j - first, factor)),
                    _ => return None,
                }
            }
            Some(found)
        };
        self.start.windows(2).map(terms).collect()
    }

    /// What each output is of sources alone, where the `known` unknowns are such sums themselves.
    pub fn of_sources(&self, known: &[Option<Sum>]) -> Vec<Option<Sum>> {
        let [n, m, r, p, ..] = self.sizes;
        let first = n + m + r;
        let sum = |ends: &[usize]| {
            let mut sum = Vec::new();
            for k in ends[0]..ends[1] {
                let (index, factor) = (self.index[k] as usize, self.factor[k]);
                if (first..first + p).contains(&index) {
                    sum.push((index - first, factor));
                } else {
                    let parts = known.get(index)?.as_ref()?;
                    sum.extend(parts.iter().map(|&(j, f)| (j, f * factor)));
                }
            }
            Some(sum)
        };
        self.start.windows(2).map(sum).collect()
    }

    /// Writes one row.
    pub fn write(&mut self, quantities: &Quantities, row: &mut [f64]) {
        let [n, m, r, p, f, _] = self.sizes;
        self.all[..n].copy_from_slice(quantities.z);
        self.all[n..n + m].copy_from_slice(quantities.l);
        if self.needs_rates {
            self.all[n + m..n + m + r].copy_from_slice(quantities.rates);
        }
        let sources = n + m + r;
        self.all[sources..sources + p].copy_from_slice(quantities.u);
        if f > 0 {
            let first = sources + p;
            self.all[first..first + f].copy_from_slice(quantities.f[0]);
            self.all[first + f..].copy_from_slice(quantities.f[1]);
        }
        self.combine(row);
    }

    /// Adds the quantities of the row written last to their sums.
    pub fn sum_last(&mut self, weight: f64) {
        self.summed.resize(self.all.len(), 0.0);
        crate::dense::add_scaled(&mut self.summed, weight, &self.all);
    }

    /// The outputs of the sums, which start afresh.
    pub fn write_sums(&mut self, row: &mut [f64]) {
        self.all.fill(0.0);
        let count = self.summed.len();
        self.all[..count].copy_from_slice(&self.summed);
        self.summed.clear();
        self.combine(row);
    }

    /// The outputs of all quantities.
    fn combine(&self, row: &mut [f64]) {
        let mut begin = 0;
        for &(end, group) in &self.groups {
            let row = &mut row[begin..end];
            match group {
                Group::Copied(first) => {
                    row.copy_from_slice(&self.all[first..first + end - begin]);
                }
                Group::Summed => self.sum(begin, row),
            }
            begin = end;
        }
    }

    /// Computes the outputs from number `begin` on.
    fn sum(&self, begin: usize, row: &mut [f64]) {
        for (value, ends) in row.iter_mut().zip(self.start[begin..].windows(2)) {
            let terms = self.index[ends[0]..ends[1]].iter().zip(&self.factor[ends[0]..ends[1]]);
            *value = terms.fold(0.0, |sum, (&index, &f)| sum + f * self.all[index as usize]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_quantities_are_copied_and_others_summed() {
        let one = |part, index| vec![(part, index, 1.0)];
        let list = [
            one(Part::Unknown, 1),
            one(Part::Unknown, 2),
            one(Part::Multiplier, 0), // follows the unknowns: the same run
            one(Part::Multiplier, 0),
            vec![(Part::Unknown, 0, 2.0), (Part::Source, 0, -1.0)],
            vec![],
            one(Part::Source, 0),
            one(Part::Unknown, 0),
        ];
        let mut outputs = Outputs::new(&list, [3, 1, 3, 1, 0, 0]);
        let mut row = [f64::NAN; 8];
        let z = &[10.0, 11.0, 12.0];
        let f = [&[][..]; 2];
        outputs.write(&Quantities { z, l: &[5.0], rates: &[0.0; 3], u: &[7.0], f }, &mut row);
        assert_eq!(row, [11.0, 12.0, 5.0, 5.0, 13.0, 0.0, 7.0, 10.0]);
        let kinds: Vec<_> = outputs.groups.iter().map(|g| g.0).collect();
        assert_eq!(kinds, [3, 4, 6, 7, 8]);
        assert!(outputs.of_unknowns().is_none());
        let known = Outputs::new(&[list[4].clone(), list[6].clone()], [3, 1, 3, 1, 0, 0]);
        let expected = [[vec![(0, 2.0)], vec![(0, -1.0)]], [vec![], vec![(0, 1.0)]]];
        assert_eq!(known.of_unknowns().unwrap(), expected);
    }
}

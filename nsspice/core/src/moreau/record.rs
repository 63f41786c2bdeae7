//! Output rows: linear functionals of the unknowns, multipliers, rates and sources.

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
}

/// All outputs of a run, compiled to indices into one array of all quantities.
#[derive(Clone, Debug)]
pub struct Outputs {
    start: Vec<usize>,
    index: Vec<u32>,
    factor: Vec<f64>,
    needs_rates: bool,
    /// scratch: z, l, rates, u one after the other
    all: Vec<f64>,
    sizes: [usize; 4],
}

impl Outputs {
    /// Collects the terms of each output; `sizes` are the lengths of z, l, rates and u.
    pub fn new(outputs: &[Vec<(Part, usize, f64)>], sizes: [usize; 4]) -> Self {
        let mut made = Outputs {
            start: vec![0],
            index: Vec::new(),
            factor: Vec::new(),
            needs_rates: false,
            all: vec![0.0; sizes.iter().sum()],
            sizes,
        };
        for output in outputs {
            for &(part, index, factor) in output {
                made.needs_rates |= part == Part::Rate;
                let offset: usize = sizes[..part as usize].iter().sum();
                made.index.push((offset + index) as u32);
                made.factor.push(factor);
            }
            made.start.push(made.index.len());
        }
        made
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

    /// Writes one row from z, l, rates and u.
    pub fn write(&mut self, z: &[f64], l: &[f64], rates: &[f64], u: &[f64], row: &mut [f64]) {
        let [n, m, r, _] = self.sizes;
        self.all[..n].copy_from_slice(z);
        self.all[n..n + m].copy_from_slice(l);
        if self.needs_rates {
            self.all[n + m..n + m + r].copy_from_slice(rates);
        }
        self.all[n + m + r..].copy_from_slice(u);
        let mut terms = self.index.iter().zip(&self.factor);
        for (value, ends) in row.iter_mut().zip(self.start.windows(2)) {
            let mut sum = 0.0;
            for (&index, &factor) in terms.by_ref().take(ends[1] - ends[0]) {
                sum += factor * self.all[index as usize];
            }
            *value = sum;
        }
    }
}

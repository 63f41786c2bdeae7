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

/// All outputs of a run, stored row by row.
#[derive(Clone, Debug, Default)]
pub struct Outputs {
    start: Vec<usize>,
    terms: Vec<(Part, usize, f64)>,
    needs_rates: bool,
}

/// The values outputs are computed from.
pub struct Values<'a> {
    /// unknowns
    pub z: &'a [f64],
    /// multipliers
    pub l: &'a [f64],
    /// rates of the unknowns; may be empty if no output needs them
    pub rates: &'a [f64],
    /// source values
    pub u: &'a [f64],
}

impl Outputs {
    /// Collects the terms of each output.
    pub fn new(outputs: &[Vec<(Part, usize, f64)>]) -> Self {
        let mut made = Outputs { start: vec![0], terms: Vec::new(), needs_rates: false };
        for output in outputs {
            made.needs_rates |= output.iter().any(|t| t.0 == Part::Rate);
            made.terms.extend_from_slice(output);
            made.start.push(made.terms.len());
        }
        made
    }

    /// Number of outputs.
    pub fn len(&self) -> usize {
        self.start.len().saturating_sub(1)
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// True if some output asks for a time derivative.
    pub fn needs_rates(&self) -> bool {
        self.needs_rates
    }

    /// Writes one row.
    pub fn write(&self, at: &Values, row: &mut [f64]) {
        for (k, value) in row.iter_mut().enumerate().take(self.len()) {
            let mut sum = 0.0;
            for &(part, index, factor) in &self.terms[self.start[k]..self.start[k + 1]] {
                let x = match part {
                    Part::Unknown => at.z[index],
                    Part::Multiplier => at.l[index],
                    Part::Rate => at.rates[index],
                    Part::Source => at.u[index],
                };
                sum += factor * x;
            }
            *value = sum;
        }
    }
}

//! Output rows: linear functionals of unknowns, multipliers, rates and sources, per mode.

use crate::dense::{add_scaled, larger, norm, Matrix};
use crate::modewise::functions::inputs::Inputs;
use crate::modewise::modes::mode::{Mode, Rows};
use crate::modewise::modes::network::Network;

/// One output: (index, factor) for z, multipliers, z' and sources.
pub type Spec = [Vec<(usize, f64)>; 4];

/// Outputs in one mode, over modal coordinates, inputs and their rates: column by column, since many
/// outputs of few quantities are added up faster so.
pub struct Columns {
    /// factors of the modal coordinates, one row each
    pub x: Matrix,
    /// factors of the inputs
    pub v: Matrix,
    /// factors of their rates
    pub d: Matrix,
}

impl Columns {
    fn new(rows: &Rows) -> Columns {
        let [x, v, d] = [&rows.x, &rows.v, &rows.d].map(Matrix::transpose);
        Columns { x, v, d }
    }

    /// Number of outputs.
    pub fn count(&self) -> usize {
        self.v.cols
    }
}

/// Value and rate parts of the outputs in one mode.
pub struct OutputRows {
    /// what multiplies values
    pub value: Columns,
    /// what multiplies derivatives, if any output has such a part
    pub rate: Option<Columns>,
    /// norms of the factors of the modal coordinates
    norms: Vec<f64>,
}

impl OutputRows {
    fn new(value: &Rows, rate: Option<&Rows>) -> OutputRows {
        let norms = (0..value.x.rows).map(|o| norm(value.x.row(o))).collect();
        OutputRows { value: Columns::new(value), rate: rate.map(Columns::new), norms }
    }

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        let size = |c: &Columns| c.x.data.len() + c.v.data.len() + c.d.data.len();
        8 * (self.norms.len() + size(&self.value) + self.rate.as_ref().map_or(0, size))
    }

    /// What values contribute to the outputs at a state, with inputs and their rates; raises sizes
    /// to those that each output could have at a state of this size, and of the inputs.
    pub fn apply(&self, [x, v, d]: [&[f64]; 3], out: &mut [f64], sizes: &mut [f64]) {
        let state = norm(x);
        for ((value, size), norm) in out.iter_mut().zip(sizes.iter_mut()).zip(&self.norms) {
            *value = 0.0;
            *size = larger(state * norm, *size);
        }
        for (k, &y) in x.iter().enumerate().filter(|(_, y)| **y != 0.0) {
            add_scaled(out, y, self.value.x.row(k));
        }
        for (list, factors) in [(v, &self.value.v), (d, &self.value.d)] {
            for (k, &y) in list.iter().enumerate().filter(|(_, y)| **y != 0.0) {
                for ((value, size), c) in out.iter_mut().zip(sizes.iter_mut()).zip(factors.row(k)) {
                    let term = c * y;
                    *value += term;
                    *size = larger(term.abs(), *size);
                }
            }
        }
    }

    /// Adds what derivatives contribute: those of the state, of the inputs, and of their rates.
    pub fn add_rates(&self, rates: [&[f64]; 3], out: &mut [f64]) {
        let Some(factors) = &self.rate else { return };
        for (list, factors) in rates.into_iter().zip([&factors.x, &factors.v, &factors.d]) {
            for (k, &y) in list.iter().enumerate() {
                add_scaled(out, y, factors.row(k));
            }
        }
    }
}

/// What all outputs are made of, either their values or what multiplies rates: energy coordinates and
/// what is algebraic, which every mode has.
pub(in crate::modewise) struct Part {
    /// outputs that energy coordinates contribute to
    pub stored: Vec<usize>,
    /// one row of factors for each of them
    pub energy: Matrix,
    /// norms of these rows
    pub norms: Vec<f64>,
    /// output, unknown of the kernel, factor
    pub kernel: Vec<(usize, usize, f64)>,
    /// output, pair, factor of its multiplier
    pub pairs: Vec<(usize, usize, f64)>,
}

impl Part {
    /// From factors of unknowns and of multipliers, both output by output.
    fn new<'a>(
        unknowns: impl Iterator<Item = &'a Vec<(usize, f64)>>,
        pairs: Vec<(usize, usize, f64)>,
        net: &Network,
    ) -> Part {
        let (mut stored, mut data, mut kernel) = (Vec::new(), Vec::new(), Vec::new());
        let (mut energy, mut rest) = (vec![0.0; net.states], vec![0.0; net.kernel.cols]);
        for (output, terms) in unknowns.enumerate() {
            energy.fill(0.0);
            rest.fill(0.0);
            for &(j, c) in terms {
                add_scaled(&mut energy, c, net.big_r.row(j));
                add_scaled(&mut rest, c, net.kernel.row(j));
            }
            if energy.iter().any(|c| *c != 0.0) {
                stored.push(output);
                data.extend_from_slice(&energy);
            }
            let found = rest.iter().enumerate().filter(|(_, c)| **c != 0.0);
            kernel.extend(found.map(|(i, &c)| (output, i, c)));
        }
        let energy = Matrix { rows: stored.len(), cols: net.states, data };
        let norms = (0..energy.rows).map(|k| norm(energy.row(k))).collect();
        Part { stored, energy, norms, kernel, pairs }
    }

    /// Outputs with the place and the factor of what is algebraic in them.
    pub fn algebraic<'a>(
        &'a self,
        mode: &'a Mode,
        kernel: usize,
    ) -> impl Iterator<Item = (usize, usize, f64)> + 'a {
        let active = move |&(output, pair, c): &(usize, usize, f64)| {
            mode.active.binary_search(&pair).ok().map(|at| (output, kernel + at, c))
        };
        self.kernel.iter().copied().chain(self.pairs.iter().filter_map(active))
    }

    /// The factors in the coordinates of a mode, for so many outputs.
    fn rows(&self, mode: &Mode, count: usize, kernel: usize) -> Rows {
        let [mut x, mut v, d] =
            [mode.n, mode.leave_v.cols, mode.leave_v.cols].map(|cols| Matrix::zeros(count, cols));
        for (to, from) in [(&mut x, &mode.leave_x), (&mut v, &mode.leave_v)] {
            let part = self.energy.times(from);
            for (k, &output) in self.stored.iter().enumerate() {
                to.row_mut(output).copy_from_slice(part.row(k));
            }
        }
        let mut rows = Rows { x, v, d };
        for (output, unknown, c) in self.algebraic(mode, kernel) {
            rows.add_algebraic(output, c, mode, unknown);
        }
        rows
    }
}

/// All outputs in the coordinates of the network.
pub struct Outputs {
    specs: Vec<Spec>,
    /// values
    pub(in crate::modewise) value: Part,
    /// what multiplies rates, if anything does
    pub(in crate::modewise) rate: Option<Part>,
    /// unknowns of the kernel
    pub(in crate::modewise) kernel: usize,
    /// source parts over `[1; inputs]`
    pub(in crate::modewise) sources: Vec<Vec<f64>>,
}

impl Outputs {
    /// Prepares the functionals.
    pub fn new(specs: Vec<Spec>, net: &Network, inputs: &Inputs) -> Outputs {
        let pairs = specs.iter().enumerate();
        let pairs = pairs.flat_map(|(o, spec)| spec[1].iter().map(move |&(pair, c)| (o, pair, c)));
        let value = Part::new(specs.iter().map(|s| &s[0]), pairs.collect(), net);
        let rated = specs.iter().any(|s| !s[2].is_empty());
        Outputs {
            value,
            rate: rated.then(|| Part::new(specs.iter().map(|s| &s[2]), Vec::new(), net)),
            kernel: net.kernel.cols,
            sources: specs.iter().map(|s| inputs.combine(&s[3])).collect(),
            specs,
        }
    }

    /// Number of outputs.
    pub fn len(&self) -> usize {
        self.specs.len()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.specs.is_empty()
    }

    /// The outputs in one mode.
    pub fn rows(&self, mode: &Mode) -> OutputRows {
        let build = |part: &Part| part.rows(mode, self.len(), self.kernel);
        let mut value = build(&self.value);
        for (o, factors) in self.sources.iter().enumerate() {
            add_scaled(value.v.row_mut(o), 1.0, factors);
        }
        OutputRows::new(&value, self.rate.as_ref().map(build).as_ref())
    }

    /// One row from unknowns, multipliers, rates and source values.
    pub fn write(&self, z: &[f64], l: &[f64], rates: &[f64], u: &[f64], row: &mut [f64]) {
        for (value, spec) in row.iter_mut().zip(&self.specs) {
            *value = [z, l, rates, u]
                .iter()
                .zip(spec)
                .map(|(x, terms)| terms.iter().map(|&(j, c)| c * x[j]).sum::<f64>())
                .sum();
        }
    }
}

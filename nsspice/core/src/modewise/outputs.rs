//! Output rows: linear functionals of unknowns, multipliers, rates and sources, per mode.

use super::inputs::Inputs;
use super::mode::{Mode, Rows};
use super::network::Network;
use crate::dense::{add_scaled, norm, Matrix};

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

    /// What values contribute to the outputs at a state, with inputs and their rates; raises sizes
    /// to those that each output could have at a state of this size, and of the inputs.
    pub fn apply(&self, [x, v, d]: [&[f64]; 3], out: &mut [f64], sizes: &mut [f64]) {
        let larger = |a: f64, b: f64| if a > b { a } else { b };
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

/// All outputs in the coordinates of the network.
pub struct Outputs {
    specs: Vec<Spec>,
    /// per output: factors of energy coordinates and of the kernel part, for z and z'
    value_r: Matrix,
    value_n: Matrix,
    rate_r: Matrix,
    rate_n: Matrix,
    /// source parts over `[1; inputs]`
    sources: Vec<Vec<f64>>,
    rated: bool,
}

impl Outputs {
    /// Prepares the functionals.
    pub fn new(specs: Vec<Spec>, net: &Network, inputs: &Inputs) -> Outputs {
        let combine = |part: usize, base: &Matrix| {
            let mut out = Matrix::zeros(specs.len(), base.cols);
            for (o, spec) in specs.iter().enumerate() {
                for &(j, c) in &spec[part] {
                    add_scaled(out.row_mut(o), c, base.row(j));
                }
            }
            out
        };
        Outputs {
            value_r: combine(0, &net.big_r),
            value_n: combine(0, &net.kernel),
            rate_r: combine(2, &net.big_r),
            rate_n: combine(2, &net.kernel),
            sources: specs.iter().map(|s| inputs.combine(&s[3])).collect(),
            rated: specs.iter().any(|s| !s[2].is_empty()),
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
        let k = self.value_n.cols;
        let build = |r: &Matrix, n: &Matrix| {
            let mut out = Rows {
                x: r.times(&mode.leave_x),
                v: r.times(&mode.leave_v),
                d: Matrix::zeros(r.rows, mode.leave_v.cols),
            };
            for o in 0..r.rows {
                for (i, &c) in n.row(o).iter().enumerate() {
                    if c != 0.0 {
                        out.add_algebraic(o, c, mode, i);
                    }
                }
            }
            out
        };
        let mut value = build(&self.value_r, &self.value_n);
        for (o, spec) in self.specs.iter().enumerate() {
            for &(pair, c) in &spec[1] {
                if let Ok(at) = mode.active.binary_search(&pair) {
                    value.add_algebraic(o, c, mode, k + at);
                }
            }
            add_scaled(value.v.row_mut(o), 1.0, &self.sources[o]);
        }
        let rate = self.rated.then(|| build(&self.rate_r, &self.rate_n));
        OutputRows::new(&value, rate.as_ref())
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

/// Instants of the output rows.
#[derive(Clone, Debug)]
pub struct RowClock {
    start: f64,
    step: f64,
    stop: f64,
    count: u64,
    next: u64,
}

impl RowClock {
    /// Rows at `start + k step` and at `stop`.
    pub fn new(start: f64, step: f64, stop: f64) -> RowClock {
        let whole = ((stop - start) / step * (1.0 + 1e-12)).floor();
        let rest = stop - (start + whole * step) > 1e-9 * step;
        RowClock { start, step, stop, count: whole as u64 + 1 + u64::from(rest), next: 0 }
    }

    /// Number of rows in all.
    pub fn rows(&self) -> u64 {
        self.count
    }

    /// Distance of the rows [s].
    pub fn step(&self) -> f64 {
        self.step
    }

    /// The times of the rows strictly between two instants.
    pub fn within(&self, begin: f64, end: f64) -> impl Iterator<Item = f64> + use<> {
        let RowClock { start, step, count, .. } = *self;
        let first = ((begin - start) / step).floor().max(-1.0) + 1.0;
        let times = (first as u64..count).map(move |k| start + k as f64 * step);
        times.skip_while(move |t| *t <= begin).take_while(move |t| *t < end)
    }

    /// The next row's time, `None` after the last.
    #[inline]
    pub fn peek(&self) -> Option<f64> {
        if self.next >= self.count {
            return None;
        }
        Some((self.start + self.next as f64 * self.step).min(self.stop))
    }

    /// Goes on to the next row.
    #[inline]
    pub fn advance(&mut self) {
        self.next += 1;
    }
}

//! Outputs at one point of a mode, through its energy coordinates and what is algebraic in it.
//!
//! A mode that is left soon and does not come back is not worth rows of its own, which are products
//! of matrices: every point costs the square of the number of states, rows cost its cube.

use crate::dense::{larger, norm};
use crate::modewise::functions::inputs::Segment;
use crate::modewise::functions::terms::Point;
use crate::modewise::modes::mode::Mode;
use crate::modewise::modes::outputs::{OutputRows, Outputs, Part};
use crate::modewise::segments::trajectory::Trajectory;

/// Work space.
#[derive(Default)]
pub struct Single {
    d: Vec<f64>,
    rates: [Vec<f64>; 2],
    found: Found,
}

/// Energy coordinates and what they contribute, and what is algebraic.
#[derive(Default)]
struct Found {
    a: Vec<f64>,
    outputs: Vec<f64>,
    b: Vec<f64>,
}

impl Single {
    /// The outputs in a mode at a point of a segment with its state and inputs, by rows made for the
    /// mode if there are any; raises sizes to those that each output could have at a state of this
    /// size, and of the inputs.
    #[inline(always)]
    pub fn write(
        &mut self,
        (outputs, mode, rows): (&Outputs, &Mode, Option<&OutputRows>),
        (path, segment): (&Trajectory, &Segment),
        (point, x, v): (&Point, &[f64], &[f64]),
        out: &mut [f64],
        sizes: &mut [f64],
    ) {
        let Single { d, rates: [dx, dd], found } = self;
        segment.rates(v, d);
        match rows {
            Some(rows) => rows.apply([x, v, d], out, sizes),
            None => outputs.apply(mode, [x, v, d], found, out, sizes),
        }
        let Some(part) = &outputs.rate else { return };
        dx.resize(mode.n, 0.0);
        path.state_rate(point, dx);
        segment.curvatures(d, dd);
        match rows {
            Some(rows) => rows.add_rates([dx, d, dd], out),
            None => outputs.add(part, mode, [dx, d, dd], found, out, None),
        }
    }
}

impl Part {
    /// Operations of one point in a mode, and those of rows made for it.
    fn costs(&self, mode: &Mode, unknowns: usize, outputs: usize) -> [usize; 2] {
        let Part { energy, kernel, pairs, .. } = self;
        let some = |count: usize, there: bool| if there { count } else { 0 };
        let terms = kernel.len() + pairs.len();
        let leave = some(energy.cols, energy.rows > 0) + some(unknowns, terms > 0);
        let rows = energy.rows * energy.cols + terms + outputs;
        [leave * mode.n + energy.rows * energy.cols, rows * mode.n]
    }
}

impl Outputs {
    /// Up to so many points of a mode are computed at less cost one by one than rows are made for it.
    pub fn singly(&self, mode: &Mode) -> f64 {
        let (mut point, mut rows) = (0, 0);
        for part in [Some(&self.value), self.rate.as_ref()].into_iter().flatten() {
            let [one, all] = part.costs(mode, self.kernel + mode.active.len(), self.len());
            (point, rows) = (point + one, rows + all);
        }
        rows as f64 / point.max(1) as f64
    }

    fn apply(
        &self,
        mode: &Mode,
        at: [&[f64]; 3],
        found: &mut Found,
        out: &mut [f64],
        sizes: &mut [f64],
    ) {
        out.fill(0.0);
        self.add(&self.value, mode, at, found, out, Some(&mut *sizes));
        for ((value, size), factors) in out.iter_mut().zip(sizes).zip(&self.sources) {
            for term in factors.iter().zip(at[1]).map(|(c, y)| c * y) {
                *value += term;
                *size = larger(term.abs(), *size);
            }
        }
    }

    /// Adds one part, with values or with derivatives.
    fn add(
        &self,
        part: &Part,
        mode: &Mode,
        [x, v, d]: [&[f64]; 3],
        Found { a, outputs, b }: &mut Found,
        out: &mut [f64],
        mut sizes: Option<&mut [f64]>,
    ) {
        if !part.stored.is_empty() {
            a.resize(part.energy.cols, 0.0);
            mode.leave(x, v, a);
            outputs.resize(part.stored.len(), 0.0);
            part.energy.apply(a, outputs);
            for (&output, value) in part.stored.iter().zip(&*outputs) {
                out[output] += value;
            }
            if let Some(sizes) = &mut sizes {
                let size = norm(a);
                for (&output, norm) in part.stored.iter().zip(&part.norms) {
                    sizes[output] = larger(size * norm, sizes[output]);
                }
            }
        }
        if part.kernel.is_empty() && part.pairs.is_empty() {
            return;
        }
        b.resize(self.kernel + mode.active.len(), 0.0);
        mode.algebra([x, v, d], b);
        for (output, unknown, c) in part.algebraic(mode, self.kernel) {
            out[output] += c * b[unknown];
        }
        let Some(sizes) = sizes else { return };
        let state = norm(x);
        for (i, size) in b.iter_mut().enumerate() {
            *size = mode.algebraic_size(i, state, [v, d]);
        }
        for (output, unknown, c) in part.algebraic(mode, self.kernel) {
            sizes[output] = larger(c.abs() * b[unknown], sizes[output]);
        }
    }
}

//! One mode as one affine map: the whole step is a product with a small dense matrix.
//!
//! While the mode does not change, the new unknowns and all guards (multipliers of active pairs,
//! slacks of the others) depend affinely on the stored part of the old state and on the sources.
//! For circuits of up to a few dozen unknowns this is several times cheaper than a triangular solve.

use super::matrices::StepMatrices;
use super::refine::refine;
use crate::mlcp::ModeFactor;

/// The affine map of one mode at one step length.
pub struct ModeMap {
    /// number of results: n unknowns, then m guards
    rows: usize,
    /// columns: carried unknowns, then sources at the end, then sources at the start
    columns: Vec<f64>,
    constant: Vec<f64>,
}

/// Largest number of matrix entries for which a map beats a sparse solve (measured).
pub const MAX_ENTRIES: usize = 20_000;

/// Which inputs a map has; the same for all modes of a system.
#[derive(Clone, Debug)]
pub struct MapInputs {
    /// unknowns whose old value enters the step
    pub carried: Vec<usize>,
    /// sources that vary, taken at the end of the step
    pub ends: Vec<usize>,
    /// sources that vary, taken at the start of the step
    pub starts: Vec<usize>,
    /// sources that do not vary
    pub constants: Vec<(usize, f64)>,
}

impl MapInputs {
    /// Number of columns of each map.
    pub fn len(&self) -> usize {
        self.carried.len() + self.ends.len() + self.starts.len()
    }
}

impl ModeMap {
    /// Solves the mode equations once per input.
    pub fn new(
        matrices: &StepMatrices,
        inputs: &MapInputs,
        factor: &ModeFactor,
        active: &[bool],
        work: &mut [f64],
    ) -> ModeMap {
        let (n, m) = (matrices.n, matrices.m);
        let rows = n + m;
        let (mut x, mut w, mut rhs) = (vec![0.0; rows], vec![0.0; m], vec![0.0; rows]);
        let mut columns = Vec::with_capacity(rows * inputs.len());
        let lists = [
            (&inputs.carried, &matrices.carry),
            (&inputs.ends, &matrices.source_end),
            (&inputs.starts, &matrices.source_start),
        ];
        for (list, matrix) in lists {
            for &j in list.iter() {
                x.fill(0.0);
                let (indices, values) = matrix.col(j);
                for (&i, &v) in indices.iter().zip(values) {
                    x[i] = v;
                }
                rhs.copy_from_slice(&x);
                factor.solve(&mut x, work);
                refine(matrices, factor, active, &rhs, &mut x, work);
                matrices.guards(&mut x, active, false, &mut w);
                columns.extend_from_slice(&x);
            }
        }
        x.fill(0.0);
        for &(j, value) in &inputs.constants {
            for matrix in [&matrices.source_end, &matrices.source_start] {
                let (indices, values) = matrix.col(j);
                for (&i, &v) in indices.iter().zip(values) {
                    x[i] += v * value;
                }
            }
        }
        for i in 0..m {
            x[n + i] = if active[i] { -matrices.q[i] } else { 0.0 };
        }
        rhs.copy_from_slice(&x);
        factor.solve(&mut x, work);
        refine(matrices, factor, active, &rhs, &mut x, work);
        matrices.guards(&mut x, active, true, &mut w);
        ModeMap { rows, columns, constant: x }
    }

    /// `out = constant + columns * input`
    pub fn apply(&self, input: &[f64], out: &mut [f64]) {
        let out = &mut out[..self.rows];
        out.copy_from_slice(&self.constant);
        let mut rest = &self.columns[..];
        for &x in input {
            let (column, others) = rest.split_at(self.rows);
            for (o, &c) in out.iter_mut().zip(column) {
                *o += c * x;
            }
            rest = others;
        }
    }
}

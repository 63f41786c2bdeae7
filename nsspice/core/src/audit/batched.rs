//! Steps of a small system side by side, so that their energies are computed together: for a single
//! step the overhead of the loops would be as large as the arithmetic.

use super::form::Form;
use crate::dense::widest;

/// Steps taken together.
pub const LANES: usize = 16;
/// Most numbers of a step: those of all lanes should stay in the fastest cache.
const MOST: usize = 96;

/// One number of each step.
pub type Lane = [f64; LANES];

/// The parts of a step: unknowns, multipliers, sources and their changes, smooth functions and their
/// rates, and the changes of the unknowns.
pub const PARTS: usize = 7;
/// see [`PARTS`]
pub const UNKNOWN: usize = 0;
/// see [`PARTS`]
pub const MULTIPLIER: usize = 1;
/// see [`PARTS`]
pub const SOURCE: usize = 2;
/// see [`PARTS`]
pub const SOURCE_CHANGE: usize = 3;
/// see [`PARTS`]
pub const FUNCTION: usize = 4;
/// see [`PARTS`]
pub const FUNCTION_RATE: usize = 5;
/// see [`PARTS`]
pub const CHANGE: usize = 6;

/// Steps that wait to be added up.
#[derive(Clone, Debug)]
pub struct Lanes {
    /// where each part begins
    start: [usize; PARTS + 1],
    /// all parts but the last of each step, as they came
    rows: Vec<f64>,
    /// the same side by side
    data: Vec<Lane>,
    /// unknowns before the first step
    before: Vec<f64>,
    /// lengths of the steps [s]
    pub length: Lane,
    /// steps that wait
    pub count: usize,
}

impl Lanes {
    /// Room for steps with parts of such sizes; none if they are too large.
    pub fn new(sizes: [usize; PARTS]) -> Option<Lanes> {
        let mut start = [0; PARTS + 1];
        for (k, size) in sizes.iter().enumerate() {
            start[k + 1] = start[k] + size;
        }
        let total = start[PARTS];
        (total <= MOST).then(|| Lanes {
            start,
            rows: vec![0.0; LANES * start[PARTS - 1]],
            data: vec![[0.0; LANES]; total],
            before: vec![0.0; sizes[0]],
            length: [0.0; LANES],
            count: 0,
        })
    }

    /// Takes a step that begins where the last one ended, with sources `u0`.
    #[inline]
    pub fn push(
        &mut self,
        length: f64,
        [z, l, u]: [&[f64]; 3],
        u0: &[f64],
        [f, f_rate]: [&[f64]; 2],
    ) {
        let (k, start) = (self.count % LANES, &self.start);
        let width = start[PARTS - 1];
        self.length[k] = length;
        self.count = k + 1;
        let row = &mut self.rows[k * width..(k + 1) * width];
        row[..start[1]].copy_from_slice(z);
        row[start[1]..start[2]].copy_from_slice(l);
        if width == start[2] {
            return;
        }
        row[start[2]..start[3]].copy_from_slice(u);
        for (change, (new, old)) in row[start[3]..start[4]].iter_mut().zip(u.iter().zip(u0)) {
            *change = new - old;
        }
        row[start[4]..start[5]].copy_from_slice(f);
        row[start[5]..start[6]].copy_from_slice(f_rate);
    }

    /// The state from which the next step begins.
    pub fn begin(&mut self, z: &[f64]) {
        self.before.copy_from_slice(z);
    }

    /// Puts the steps side by side; the next one begins where these end.
    pub fn close(&mut self) {
        let width = self.start[PARTS - 1];
        let (data, changes) = self.data.split_at_mut(width);
        turn(&self.rows[..self.count * width], data);
        let last = self.count.saturating_sub(1);
        for ((before, z), change) in self.before.iter_mut().zip(data).zip(changes) {
            change[0] = z[0] - *before;
            for k in 1..LANES {
                change[k] = z[k] - z[k - 1];
            }
            *before = z[last];
        }
    }

    /// Unknowns, multipliers and functions of the last step that waits.
    pub fn last(&self) -> [&[f64]; 3] {
        let (k, start) = (self.count.saturating_sub(1), &self.start);
        let row = &self.rows[k * start[PARTS - 1]..];
        [&row[..start[1]], &row[start[1]..start[2]], &row[start[4]..start[5]]]
    }

    /// One part of all steps.
    pub fn part(&self, part: usize) -> &[Lane] {
        &self.data[self.start[part]..self.start[part + 1]]
    }

    /// Adds `x' M x` of each step for a part of it.
    pub fn squares(&self, form: &Form, part: usize, out: &mut Lane) {
        add_squares(form, self.part(part), out);
    }

    /// Adds `z' M x` of each step for a part `x` of it.
    pub fn products(&self, entries: &[(u32, u32, f64)], part: usize, out: &mut Lane) {
        if !entries.is_empty() {
            add_products(entries, self.part(UNKNOWN), self.part(part), out);
        }
    }
}

/// Rows become columns.
fn turn(rows: &[f64], data: &mut [Lane]) {
    let width = data.len();
    for (k, row) in rows.chunks_exact(width.max(1)).enumerate() {
        for (lane, value) in data.iter_mut().zip(row) {
            lane[k] = *value;
        }
    }
}

#[inline(always)]
fn squares_any(form: &Form, x: &[Lane], out: &mut Lane) {
    let mut sum = *out;
    for &(i, j, sign, c) in &form.pairs {
        let (a, b) = (&x[i as usize], &x[j as usize]);
        for k in 0..LANES {
            let v = a[k] + sign * b[k];
            sum[k] += c * v * v;
        }
    }
    for &(i, c) in &form.single {
        let a = &x[i as usize];
        for k in 0..LANES {
            sum[k] += c * a[k] * a[k];
        }
    }
    for (l, c) in &form.combined {
        let mut all = [0.0; LANES];
        for &(i, factor) in l {
            for k in 0..LANES {
                all[k] += factor * x[i as usize][k];
            }
        }
        for k in 0..LANES {
            sum[k] += c * all[k] * all[k];
        }
    }
    for &(i, j, r) in &form.products {
        let (a, b) = (&x[i as usize], &x[j as usize]);
        for k in 0..LANES {
            sum[k] += r * a[k] * b[k];
        }
    }
    *out = sum;
}

#[inline(always)]
fn products_any(entries: &[(u32, u32, f64)], z: &[Lane], x: &[Lane], out: &mut Lane) {
    let mut sum = *out;
    for &(i, j, c) in entries {
        let (a, b) = (&z[i as usize], &x[j as usize]);
        for k in 0..LANES {
            sum[k] += c * a[k] * b[k];
        }
    }
    *out = sum;
}

widest! {
    fn add_squares(form: &Form, x: &[Lane], out: &mut Lane) = squares_any(form, x, out)
}

widest! {
    fn add_products(entries: &[(u32, u32, f64)], z: &[Lane], x: &[Lane], out: &mut Lane) =
        products_any(entries, z, x, out)
}

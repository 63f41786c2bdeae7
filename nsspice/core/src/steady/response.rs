//! The response of a periodic orbit to a small stimulus `e^(s t)`.
//!
//! Perturbations are written `e^(s t)` times something periodic. With the monodromy matrix `Phi` the
//! perturbation at the beginning solves `(1 - e^(-s T) Phi) x = F`, `F` the response from rest over one period.
//! An output has, at the stimulus' frequency shifted by a multiple of the orbit's own, the amplitude
//!
//! ```text
//! 1/T (integral of e^(-shift t) y over the period + sum of e^(-shift t_k) (y- - y+) dt_k),
//! ```
//!
//! the sum being over outputs that jump at an event whose instant `t_k` moves by `dt_k`.

use super::linear::{add_scaled, real_times, solve, CMatrix};
use super::modal::{course, rates_of_columns};
use super::orbit::{Event, Orbit};
use crate::dense::{complex, Complex, Matrix};
use crate::modewise::modes::mode::{self, Mode};
use crate::modewise::modes::outputs::Columns;
use crate::modewise::Passage;

/// One output per row over modal coordinates, stimuli, and their first and second rates.
pub(super) struct Rows {
    pub x: Matrix,
    pub stimuli: [Matrix; 3],
    /// nominal values at both ends of the segment
    pub ends: [Vec<f64>; 2],
}

fn part(columns: &Columns) -> [Matrix; 3] {
    [&columns.x, &columns.v, &columns.d].map(Matrix::transpose)
}

impl Orbit {
    /// Outputs in a mode over its modal coordinates, and over `[1; inputs]` and their first and second rates.
    pub(super) fn rows_of(&self, mode: &Mode) -> (Matrix, [Matrix; 3]) {
        let rows = self.outputs.rows(mode);
        let [mut x, v, d] = part(&rows.value);
        let mut inputs = [v, d, Matrix::zeros(x.rows, self.stimuli.rows)];
        if let Some(rate) = &rows.rate {
            let [of_x, of_v, of_d] = part(rate);
            x.add_scaled(1.0, &rates_of_columns(mode, &of_x));
            inputs[0].add_scaled(1.0, &of_x.times(&mode.drive));
            inputs[1].add_scaled(1.0, &of_v);
            inputs[2].add_scaled(1.0, &of_d);
        }
        (x, inputs)
    }

    pub(super) fn output_rows(&self, p: &Passage) -> Rows {
        let (x, stimuli) = self.rows_of(&p.mode);
        let nominal = self.nominal_rows(p);
        let values = |x: &[f64], v: &[f64]| {
            let (mut d, mut out) = (Vec::new(), vec![0.0; nominal.v.rows]);
            p.inputs.rates(v, &mut d);
            nominal.x.apply(x, &mut out);
            nominal.v.apply_add(v, &mut out);
            nominal.d.apply_add(&d, &mut out);
            out
        };
        let ends = [values(&p.first, &p.inputs.now), values(&p.last, &p.v)];
        Rows { x, stimuli: stimuli.map(|m| m.times(&self.stimuli)), ends }
    }

    /// Outputs on the orbit itself, over modal coordinates, inputs and their rates.
    pub(super) fn nominal_rows(&self, p: &Passage) -> mode::Rows {
        let rows = self.outputs.rows(&p.mode);
        let [mut x, mut v, mut d] = part(&rows.value);
        if let Some(rate) = &rows.rate {
            let [of_x, of_v, of_d] = part(rate);
            x.add_scaled(1.0, &rates_of_columns(&p.mode, &of_x));
            v.add_scaled(1.0, &of_x.times(&p.mode.drive));
            d.add_scaled(1.0, &of_v);
            // second rates of rotations and decays follow from the first ones
            for r in 0..d.rows {
                for tone in &p.inputs.tones {
                    let (s, c) = (tone.index, tone.index + 1);
                    d[(r, s)] += tone.rate.re * of_d[(r, s)] - tone.rate.im * of_d[(r, c)];
                    d[(r, c)] += tone.rate.im * of_d[(r, s)] + tone.rate.re * of_d[(r, c)];
                }
                for decay in &p.inputs.decays {
                    d[(r, decay.index)] += decay.rate * of_d[(r, decay.index)];
                }
            }
        }
        mode::Rows { x, v, d }
    }

    /// Responses of all outputs to all stimuli at each complex frequency and each multiple of the orbit's own
    /// frequency: by frequency, multiple, output, stimulus. `None` if there is a frequency at which the orbit
    /// responds without bound.
    pub fn responses(&self, frequencies: &[Complex], multiples: &[f64]) -> Option<Vec<Complex>> {
        let rows: Vec<Rows> = self.passages.iter().map(|p| self.output_rows(p)).collect();
        let phi = self.monodromy();
        let mut out = Vec::new();
        for &s in frequencies {
            out.extend(self.response(&rows, &phi, s, multiples)?);
        }
        Some(out)
    }

    /// What an event does to perturbations and stimuli.
    fn across(&self, parts: &[Matrix; 3], s: Complex, x: &CMatrix) -> CMatrix {
        let mut out = real_times(&parts[0], x);
        for r in 0..out.rows {
            for (c, to) in out.row_mut(r).iter_mut().enumerate() {
                *to = *to + complex(parts[1][(r, c)], 0.0) + s.scale(parts[2][(r, c)]);
            }
        }
        out
    }

    fn response(
        &self,
        rows: &[Rows],
        phi: &Matrix,
        s: Complex,
        multiples: &[f64],
    ) -> Option<Vec<Complex>> {
        let stimuli = self.stimuli.cols;
        let own = std::f64::consts::TAU / self.period;
        let shifts: Vec<Complex> = multiples.iter().map(|n| complex(0.0, n * own)).collect();
        let n = self.passages.first()?.mode.n;
        let mut x = CMatrix::zeros(n, stimuli);
        for (k, p) in self.passages.iter().enumerate() {
            if k > 0 {
                x = self.across(&self.events[k].after, s, &x);
            }
            x = course(&p.mode, p.end - p.start, s, &[], &x, &self.drive(p)).end;
        }
        let mut start = self.across(&self.events[0].after, s, &x);
        let turned = -(s.scale(-self.period).exp());
        let mut matrix = CMatrix::identity(n);
        for (to, from) in matrix.data.iter_mut().zip(&phi.data) {
            *to = *to + turned.scale(*from);
        }
        if !solve(matrix, &mut start) {
            return None;
        }
        let outputs = self.outputs.len();
        let mut sums = vec![CMatrix::zeros(outputs, stimuli); multiples.len()];
        let count = self.passages.len();
        let mut x = start;
        for (k, p) in self.passages.iter().enumerate() {
            let of = &rows[k];
            let length = p.end - p.start;
            let passed = course(&p.mode, length, s, &shifts, &x, &self.drive(p));
            for ((sum, &shift), integral) in sums.iter_mut().zip(&shifts).zip(&passed.integrals) {
                let phase = (-shift.scale(p.start)).exp();
                let z = -shift.scale(length);
                let weight = crate::dense::divided(&[z, Complex::default()]).scale(length);
                let by_state = real_times(&of.x, integral);
                for r in 0..outputs {
                    add_scaled(sum.row_mut(r), phase, by_state.row(r));
                    for c in 0..stimuli {
                        let [v, d, dd] = [0, 1, 2].map(|i| of.stimuli[i][(r, c)]);
                        let direct = complex(v, 0.0) + s * (complex(d, 0.0) + s.scale(dd));
                        sum.row_mut(r)[c] = sum.row(r)[c] + phase * weight * direct;
                    }
                }
            }
            let next = (k + 1) % count;
            let event = &self.events[next];
            self.impulses(event, [of, &rows[next]], s, &passed.end, p.end, &shifts, &mut sums);
            if next > 0 {
                x = self.across(&event.after, s, &passed.end);
            }
        }
        let mut out = Vec::with_capacity(sums.len() * outputs * stimuli);
        for sum in sums {
            out.extend(sum.data.iter().map(|v| v.scale(1.0 / self.period)));
        }
        Some(out)
    }

    fn drive(&self, p: &Passage) -> CMatrix {
        let by = p.mode.drive.times(&self.stimuli);
        CMatrix {
            rows: by.rows,
            cols: by.cols,
            data: by.data.iter().map(|v| complex(*v, 0.0)).collect(),
        }
    }

    /// Adds what jumps of outputs at a moved instant contribute.
    #[allow(clippy::too_many_arguments)] // one call
    fn impulses(
        &self,
        event: &Event,
        [before, after]: [&Rows; 2],
        s: Complex,
        end: &CMatrix,
        time: f64,
        shifts: &[Complex],
        sums: &mut [CMatrix],
    ) {
        let Some(shift) = &event.shift else { return };
        let moved = self.across(shift, s, end);
        for (sum, &shift) in sums.iter_mut().zip(shifts) {
            let phase = (-shift.scale(time)).exp();
            for (r, (old, new)) in before.ends[1].iter().zip(&after.ends[0]).enumerate() {
                // the impulse that a jump of the state makes of a rate is not followed
                let lost = self.rated[r] && event.jumps;
                let jump = if lost { f64::NAN } else { old - new };
                add_scaled(sum.row_mut(r), phase.scale(jump), moved.row(0));
            }
        }
    }
}

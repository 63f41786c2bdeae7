//! How averages on a periodic orbit depend on parameters.
//!
//! A change of an element is a source in its place that carries what the element itself sees: of a conductance
//! its own voltage, of a capacitance the rate of it. The perturbation `x' = J x + b y(t)` is driven by a signal
//! `y` of the orbit, a sum of terms `t^m E[z0 t, ..., zm t]`, and stays in closed form, resonance included:
//!
//! ```text
//! integral of e^(l (t - u)) u^m E[z0 u, ..., zm u] du over 0..t = t^(m+1) E[l t, z0 t, ..., zm t].
//! ```

use super::fourier::Piece;
use super::modal::carry;
use super::orbit::{entering, Orbit};
use super::response::Rows;
use crate::dense::{complex, divided, Complex, Lu, Matrix, NODES};
use crate::modewise::terms::{Point, Term};
use crate::modewise::Passage;

/// What drives one stimulus: an output of the orbit, or a constant 1.
pub type Driver = Option<usize>;

/// Drivers at one end of a passage: values and rates.
struct Ends {
    value: [Vec<f64>; 2],
    rate: [Vec<f64>; 2],
}

/// A run with what drives its stimuli.
struct Driven<'a> {
    pieces: Vec<Piece>,
    ends: Vec<Ends>,
    rows: Vec<Rows>,
    drivers: &'a [Driver],
}

/// Nodes of a term and how many there are.
fn nodes(term: &Term) -> Option<([Complex; 3], usize)> {
    let zero = Complex::default();
    Some(match *term {
        Term::One => ([zero; 3], 1),
        Term::Time => ([zero; 3], 2),
        Term::Exp { rate } => ([rate, zero, zero], 1),
        Term::Near { own, apart, .. } => ([own, own + apart, zero], 2),
        Term::Ramp { own } => ([own, zero, zero], 3),
        Term::Numerical { .. } => return None,
    })
}

/// `d^k E[extra d, nodes d]` of a term and of its conjugate.
fn divided_of(term: &Term, extra: &[Complex], d: f64) -> Option<[Complex; 2]> {
    let (own, count) = nodes(term)?;
    let of = |mirrored: bool| {
        let mut all = [Complex::default(); NODES];
        for (to, node) in all.iter_mut().zip(extra.iter().chain(&own[..count])) {
            *to = *node;
        }
        let total = extra.len() + count;
        for (k, z) in all[..total].iter_mut().enumerate() {
            let turned = if mirrored && k >= extra.len() { z.conj() } else { *z };
            *z = turned.scale(d);
        }
        divided(&all[..total]).scale(d.powi(total as i32 - 1))
    };
    Some([of(false), of(true)])
}

impl Orbit {
    /// What a driver contributes with a weight `d^k E[extra d, ...]` to each of its terms.
    fn weighted(&self, piece: &Piece, driver: Driver, extra: &[Complex]) -> Option<Complex> {
        let Some(output) = driver else {
            return divided_of(&Term::One, extra, piece.to).map(|found| found[0]);
        };
        let slots = piece.path.slots;
        let factors = &piece.bundle.factor[output * slots..(output + 1) * slots];
        let mut sum = Complex::default();
        for placed in &piece.path.terms {
            let re = factors[placed.slot];
            let im = if placed.width == 2 { factors[placed.slot + 1] } else { 0.0 };
            if re == 0.0 && im == 0.0 {
                continue;
            }
            let [own, mirrored] = divided_of(&placed.term, extra, piece.to)?;
            if placed.width == 1 {
                sum = sum + own.scale(re);
            } else {
                let f = complex(re, -im).scale(0.5);
                sum = sum + f * own + f.conj() * mirrored;
            }
        }
        Some(sum)
    }

    fn ends(&self, piece: &Piece, drivers: &[Driver]) -> Ends {
        let mut point = Point::default();
        let mut ends = Ends { value: Default::default(), rate: Default::default() };
        for (k, t) in [0.0, piece.to].into_iter().enumerate() {
            piece.path.at(t, &mut point);
            for driver in drivers {
                ends.value[k].push(driver.map_or(1.0, |o| piece.bundle.value(o, &point)));
                ends.rate[k].push(driver.map_or(0.0, |o| piece.bundle.slope(o, &point)));
            }
        }
        ends
    }

    /// Perturbations at the end of a passage, and their integrals over it, from those at its beginning; one
    /// column per stimulus.
    fn forced(
        &self,
        p: &Passage,
        piece: &Piece,
        drivers: &[Driver],
        x: &Matrix,
    ) -> Option<[Matrix; 2]> {
        let (d, zero) = (piece.to, Complex::default());
        let by = p.mode.drive.times(&self.stimuli);
        let mut end = x.clone();
        carry(&p.mode, d, &mut end);
        let mut integral = Matrix::zeros(x.rows, x.cols);
        for pole in &p.mode.poles {
            let (at, rate) = (pole.at, complex(pole.alpha, pole.omega));
            let pair = pole.omega != 0.0;
            let own = divided(&[rate.scale(d), zero]).scale(d);
            for (c, &driver) in drivers.iter().enumerate() {
                let coordinate =
                    |m: &Matrix| complex(m[(at, c)], if pair { m[(at + 1, c)] } else { 0.0 });
                let (start, b) = (coordinate(x), coordinate(&by));
                let mut sum = own * start;
                if b != zero {
                    let grown = b * self.weighted(piece, driver, &[rate])?;
                    sum = sum + b * self.weighted(piece, driver, &[rate, zero])?;
                    end[(at, c)] += grown.re;
                    if pair {
                        end[(at + 1, c)] += grown.im;
                    }
                }
                integral[(at, c)] = sum.re;
                if pair {
                    integral[(at + 1, c)] = sum.im;
                }
            }
        }
        Some([end, integral])
    }

    /// What an event does to perturbations, with drivers as they are before it.
    fn passed(&self, parts: &[Matrix; 3], x: &Matrix, value: &[f64], rate: &[f64]) -> Matrix {
        let mut out = parts[0].times(x);
        for r in 0..out.rows {
            for c in 0..out.cols {
                out[(r, c)] += parts[1][(r, c)] * value[c] + parts[2][(r, c)] * rate[c];
            }
        }
        out
    }

    /// The run with its drivers; `None` where a mode has no eigenvectors.
    fn driven<'a>(&self, drivers: &'a [Driver]) -> Option<Driven<'a>> {
        if self.passages.iter().any(|p| !p.mode.blocks.is_empty()) {
            return None;
        }
        let window = [0.0, self.period];
        let pieces = self.passages.iter().map(|p| self.piece(p, window)).collect::<Vec<Piece>>();
        let ends = pieces.iter().map(|piece| self.ends(piece, drivers)).collect();
        let rows = self.passages.iter().map(|p| self.output_rows(p)).collect();
        Some(Driven { pieces, ends, rows, drivers })
    }

    /// What an event before passage `k` makes of perturbations at the end of the one before it.
    fn beyond(&self, run: &Driven, k: usize, parts: &[Matrix; 3], x: &Matrix) -> Matrix {
        let before = &run.ends[(k + run.ends.len() - 1) % run.ends.len()];
        self.passed(parts, x, &before.value[1], &before.rate[1])
    }

    /// Perturbations at the end of the run from those at its beginning, and what the integrals of the outputs
    /// change by; the end of a `closed` run moves as the event before its beginning does.
    fn along(&self, run: &Driven, mut x: Matrix, closed: bool) -> Option<[Matrix; 2]> {
        let count = self.passages.len();
        let mut sums = Matrix::zeros(self.outputs.len(), run.drivers.len());
        for (k, p) in self.passages.iter().enumerate() {
            let [end, integral] = self.forced(p, &run.pieces[k], run.drivers, &x)?;
            sums.add_scaled(1.0, &run.rows[k].x.times(&integral));
            for (c, &driver) in run.drivers.iter().enumerate() {
                let whole = self.weighted(&run.pieces[k], driver, &[Complex::default()])?.re;
                let ([v0, v1], [d0, d1]) = (&run.ends[k].value, &run.ends[k].rate);
                let parts = [whole, v1[c] - v0[c], d1[c] - d0[c]];
                for (factors, part) in run.rows[k].stimuli.iter().zip(parts) {
                    for r in 0..sums.rows {
                        sums[(r, c)] += factors[(r, c)] * part;
                    }
                }
            }
            let next = (k + 1) % count;
            let event = &self.events[next];
            if let (Some(shift), true) = (&event.shift, closed || next > 0) {
                let moved = self.beyond(run, next, shift, &end);
                for r in 0..sums.rows {
                    let jump = run.rows[k].ends[1][r] - run.rows[next].ends[0][r];
                    let lost = self.rated[r] && event.jumps;
                    let jump = if lost { f64::NAN } else { jump };
                    for c in 0..sums.cols {
                        sums[(r, c)] += jump * moved[(0, c)];
                    }
                }
            }
            x = if next > 0 { self.beyond(run, next, &event.after, &end) } else { end };
        }
        Some([x, sums])
    }

    /// Derivatives of the averages of all outputs, one row each, by the parameters behind the stimuli. `None`
    /// where a mode has no eigenvectors, or nothing pulls the orbit back.
    pub fn sensitivities(&self, drivers: &[Driver]) -> Option<Matrix> {
        let run = self.driven(drivers)?;
        let n = self.passages.first()?.mode.n;
        let [x, _] = self.along(&run, Matrix::zeros(n, drivers.len()), true)?;
        let mut matrix = Matrix::identity(n);
        matrix.add_scaled(-1.0, &self.monodromy());
        let factor = Lu::new(&matrix);
        if n > 0 && factor.ratio <= 1e3 * f64::EPSILON {
            return None; // the rounding of the matrix is as large as what is left of it
        }
        let first = self.beyond(&run, 0, &self.events[0].after, &x);
        let [_, mut sums] = self.along(&run, factor.solve_refined(&matrix, &first), true)?;
        sums.data.iter_mut().for_each(|v| *v /= self.period);
        Some(sums)
    }

    /// Derivatives of the outputs (without rates) at the end of a run, left limits, and of their integrals over
    /// it, by the parameters behind the stimuli, where the beginning keeps its energy coordinates. `None` as well
    /// where a jump makes the rate that drives a stimulus an impulse.
    pub fn of_run(&self, drivers: &[Driver]) -> Option<[Matrix; 2]> {
        let run = self.driven(drivers)?;
        let first = self.passages.first()?;
        let jumps =
            !first.state_jumps.is_empty() || self.events[1..].iter().any(|event| event.jumps);
        if jumps && drivers.iter().flatten().any(|&output| self.rated[output]) {
            return None;
        }
        let mut a = Matrix::zeros(self.states(), drivers.len());
        for mode in &first.state_jumps {
            a = mode.leave_x.times(&entering(mode, &a));
            let mut by = mode.leave_v.times(&self.stimuli);
            for r in 0..by.rows {
                let values = run.ends[0].value[0].iter();
                by.row_mut(r).iter_mut().zip(values).for_each(|(to, value)| *to *= value);
            }
            a.add_scaled(1.0, &by);
        }
        let [x, sums] = self.along(&run, entering(&first.mode, &a), false)?;
        let (rows, ends) = (run.rows.last()?, run.ends.last()?);
        let mut out = rows.x.times(&x);
        for (factors, values) in rows.stimuli.iter().zip([&ends.value[1], &ends.rate[1]]) {
            for r in 0..out.rows {
                for c in 0..out.cols {
                    out[(r, c)] += factors[(r, c)] * values[c];
                }
            }
        }
        Some([out, sums])
    }
}

//! Sources as solutions of small linear equations: constants, ramps, rotations, decays.
//!
//! Every waveform is a constant plus a combination of *inputs*; within a segment each input is a
//! line, a damped rotation or a decay. They are evaluated from absolute time at the start of every
//! segment, so that nothing drifts.

use crate::dense::{complex, Complex, Matrix};
use crate::rounding::of_sum;
use crate::sparse::Csc;
use crate::waveform::{Side, Smooth, Waveform, INSTANT};
use std::f64::consts::TAU;

/// What an input does.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// a polygon: the waveform of this number
    Line(usize),
    /// `e^(-damping s) sin` and, in the next input, `cos` of `2 pi frequency s`, `s = t - delay`
    Tone { frequency: f64, damping: f64, delay: f64 },
    /// the second input of a tone
    Partner,
    /// `e^(-(t - delay)/tau)`, 1 before the delay
    Decay { delay: f64, tau: f64 },
}

/// A rotation within a segment: inputs `index` and `index + 1` are the imaginary and the real part
/// of `start e^(rate t)`.
#[derive(Clone, Copy, Debug)]
pub struct Tone {
    /// first input
    pub index: usize,
    /// `-damping + 2 pi i frequency` [1/s]
    pub rate: Complex,
    /// value at the start of the segment
    pub start: Complex,
}

/// A decay within a segment.
#[derive(Clone, Copy, Debug)]
pub struct Decay {
    /// input
    pub index: usize,
    /// [1/s]
    pub rate: f64,
    /// value at the start of the segment
    pub start: f64,
}

/// By how much an instant that is the sum of two may be rounded [s]: they are, and so is the sum, which both of its
/// limits have.
pub fn resolution(t: f64) -> f64 {
    of_sum(4) * t.abs()
}

/// All inputs during one segment, time counted from its start.
#[derive(Clone, Debug, Default)]
pub struct Segment {
    /// the time of the start is known up to this [s]: it is the rounded root of a guard, most often
    pub resolution: f64,
    /// constant part: 1, then one value per input
    pub level: Vec<f64>,
    /// slopes: 0, then one per input [1/s]
    pub slope: Vec<f64>,
    /// some slope is not zero
    pub sloped: bool,
    /// rotations going on
    pub tones: Vec<Tone>,
    /// decays going on
    pub decays: Vec<Decay>,
    /// values at the start: 1, then one per input
    pub now: Vec<f64>,
    /// rates at the start
    pub rate: Vec<f64>,
}

impl Segment {
    /// How large `[1; inputs]` and their rates become within a time.
    pub fn sizes(&self, time: f64, values: &mut Vec<f64>, rates: &mut Vec<f64>) {
        values.clear();
        rates.clear();
        let ends = self.level.iter().zip(&self.slope);
        values.extend(ends.map(|(level, slope)| level.abs().max((level + slope * time).abs())));
        rates.extend(self.slope.iter().map(|slope| slope.abs()));
        for tone in &self.tones {
            // a sine is small next to its zero
            let (start, change) = (tone.start, tone.rate * tone.start);
            let most =
                |part: f64, whole: f64| whole.min(part.abs() + tone.rate.abs() * whole * time);
            for (k, of) in
                [(tone.index, [start.im, change.im]), (tone.index + 1, [start.re, change.re])]
            {
                (values[k], rates[k]) = (most(of[0], start.abs()), most(of[1], change.abs()));
            }
        }
        for decay in &self.decays {
            values[decay.index] = decay.start.abs();
            rates[decay.index] = (decay.rate * decay.start).abs();
        }
    }

    /// Rates of `[1; inputs]` where their values are `v`.
    pub fn rates(&self, v: &[f64], out: &mut Vec<f64>) {
        out.clone_from(&self.slope);
        self.turn(v, out);
    }

    /// `[1; inputs]` at a time since the start.
    pub fn at(&self, time: f64, out: &mut [f64]) {
        for ((v, level), slope) in out.iter_mut().zip(&self.level).zip(&self.slope) {
            *v = level + slope * time;
        }
        for tone in &self.tones {
            let (size, angle) = ((tone.rate.re * time).exp(), tone.rate.im * time);
            let turned = complex(size * angle.cos(), size * angle.sin()) * tone.start;
            (out[tone.index], out[tone.index + 1]) = (turned.im, turned.re);
        }
        for decay in &self.decays {
            out[decay.index] = (decay.rate * time).exp() * decay.start;
        }
    }

    /// Second derivatives of `[1; inputs]` where their rates are `d`.
    pub fn curvatures(&self, d: &[f64], out: &mut Vec<f64>) {
        out.clear();
        out.resize(d.len(), 0.0);
        self.turn(d, out);
    }

    fn turn(&self, v: &[f64], out: &mut [f64]) {
        for tone in &self.tones {
            let change = tone.rate * complex(v[tone.index + 1], v[tone.index]);
            out[tone.index] = change.im;
            out[tone.index + 1] = change.re;
        }
        for decay in &self.decays {
            out[decay.index] = decay.rate * v[decay.index];
        }
    }
}

/// The inputs of a system.
#[derive(Clone)]
pub struct Inputs {
    waveforms: Vec<Waveform>,
    kinds: Vec<Kind>,
    /// per waveform: constant part and (input, factor)
    parts: Vec<(f64, Vec<(usize, f64)>)>,
    /// work space: the next breakpoint of each waveform that has one
    breakpoints: Vec<f64>,
}

impl Inputs {
    /// Finds the inputs; the error names a waveform without finite description.
    pub fn new(waveforms: Vec<Waveform>) -> Result<Inputs, String> {
        let mut kinds: Vec<Kind> = Vec::new();
        let mut parts = Vec::new();
        for (k, waveform) in waveforms.iter().enumerate() {
            let mut find = |kind: Kind| {
                let known = kinds.iter().position(|&other| other == kind);
                known.unwrap_or_else(|| {
                    kinds.push(kind);
                    if matches!(kind, Kind::Tone { .. }) {
                        kinds.push(Kind::Partner);
                    }
                    kinds.len() - if matches!(kind, Kind::Tone { .. }) { 2 } else { 1 }
                })
            };
            parts.push(match waveform {
                Waveform::Dc(v) => (*v, Vec::new()),
                Waveform::Piecewise(_) => (0.0, vec![(find(Kind::Line(k)), 1.0)]),
                Waveform::Smooth(Smooth::Sin {
                    offset,
                    amplitude,
                    frequency,
                    delay,
                    damping,
                    phase,
                }) => {
                    let (frequency, damping, delay) = (*frequency, *damping, *delay);
                    let first = find(Kind::Tone { frequency, damping, delay });
                    let (sin, cos) = phase.sin_cos();
                    (*offset, vec![(first, amplitude * cos), (first + 1, amplitude * sin)])
                }
                Waveform::Smooth(Smooth::Exp { v1, v2, td1, tau1, td2, tau2 }) => {
                    let rise = find(Kind::Decay { delay: *td1, tau: *tau1 });
                    let fall = find(Kind::Decay { delay: *td2, tau: *tau2 });
                    (*v1, vec![(rise, v1 - v2), (fall, v2 - v1)])
                }
                Waveform::Smooth(Smooth::Sffm { .. }) => {
                    return Err("an SFFM source is no solution of a linear equation".into());
                }
                Waveform::Smooth(Smooth::Am { .. }) => {
                    return Err("an AM source is not split into its lines".into());
                }
                Waveform::Polynomial(p) if p.is_held() => (0.0, vec![(find(Kind::Line(k)), 1.0)]),
                Waveform::Polynomial(_) => {
                    return Err(
                        "what another block computes is no solution of a linear equation".into()
                    );
                }
            });
        }
        Ok(Inputs { waveforms, kinds, parts, breakpoints: Vec::new() })
    }

    /// Number of inputs.
    pub fn len(&self) -> usize {
        self.kinds.len()
    }

    /// True if all sources are constant.
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }

    /// Source columns by constant and input: `S u = columns [1; inputs]`.
    pub fn columns(&self, s: &Csc) -> Matrix {
        let mut out = Matrix::zeros(s.nrows, 1 + self.len());
        for (r, c, v) in s.iter() {
            let (constant, terms) = &self.parts[c];
            out[(r, 0)] += v * constant;
            for &(i, f) in terms {
                out[(r, 1 + i)] += v * f;
            }
        }
        out
    }

    /// A combination of waveforms as factors of `[1; inputs]`.
    pub fn combine(&self, terms: &[(usize, f64)]) -> Vec<f64> {
        let mut out = vec![0.0; 1 + self.len()];
        for &(c, v) in terms {
            let (constant, parts) = &self.parts[c];
            out[0] += v * constant;
            for &(i, f) in parts {
                out[1 + i] += v * f;
            }
        }
        out
    }

    /// One waveform where `[1; inputs]`, or a multiple of them, are `v`.
    pub fn value_of(&self, waveform: usize, v: &[f64]) -> f64 {
        let (constant, parts) = &self.parts[waveform];
        parts.iter().fold(constant * v[0], |sum, &(i, f)| sum + f * v[1 + i])
    }

    /// Rate of one waveform where the rates of `[1; inputs]` are `d`.
    pub fn rate_of(&self, waveform: usize, d: &[f64]) -> f64 {
        self.parts[waveform].1.iter().fold(0.0, |sum, &(i, f)| sum + f * d[1 + i])
    }

    /// The waveforms.
    pub fn waveforms(&self) -> &[Waveform] {
        &self.waveforms
    }

    /// Evaluates all inputs on the interval that begins at `t`.
    pub fn begin(&self, t: f64, out: &mut Segment) {
        let count = 1 + self.len();
        for list in [&mut out.level, &mut out.slope, &mut out.now, &mut out.rate] {
            list.clear();
            list.resize(count, 0.0);
        }
        out.tones.clear();
        out.decays.clear();
        out.resolution = resolution(t);
        out.level[0] = 1.0;
        out.now[0] = 1.0;
        out.sloped = false;
        for (i, kind) in self.kinds.iter().enumerate() {
            let at = 1 + i;
            match *kind {
                Kind::Line(k) => {
                    let (value, slope) = match &self.waveforms[k] {
                        Waveform::Piecewise(p) => p.line(t),
                        Waveform::Polynomial(p) => p.line(t),
                        _ => continue,
                    };
                    #[cfg(feature = "faults")]
                    let slope = fault!("ramp_held", slope, 0.0);
                    out.level[at] = value;
                    out.slope[at] = slope;
                    out.now[at] = value;
                    out.rate[at] = slope;
                    out.sloped |= slope != 0.0;
                }
                Kind::Tone { frequency, damping, delay } => {
                    if t < delay {
                        out.level[at + 1] = 1.0;
                        out.now[at + 1] = 1.0;
                        continue;
                    }
                    let s = t - delay;
                    let turns = frequency * s;
                    let (sin, cos) = (TAU * (turns - turns.floor())).sin_cos();
                    let size = if damping == 0.0 { 1.0 } else { (-damping * s).exp() };
                    let start = complex(size * cos, size * sin);
                    let rate = complex(-damping, TAU * frequency);
                    out.tones.push(Tone { index: at, rate, start });
                    let change = rate * start;
                    (out.now[at], out.now[at + 1]) = (start.im, start.re);
                    (out.rate[at], out.rate[at + 1]) = (change.im, change.re);
                }
                Kind::Partner => {}
                Kind::Decay { delay, tau } => {
                    if t < delay || tau <= 0.0 {
                        let value = if t < delay { 1.0 } else { 0.0 };
                        out.level[at] = value;
                        out.now[at] = value;
                        continue;
                    }
                    let (start, rate) = ((-(t - delay) / tau).exp(), -1.0 / tau);
                    out.decays.push(Decay { index: at, rate, start });
                    out.now[at] = start;
                    out.rate[at] = rate * start;
                }
            }
        }
    }

    /// Up to where all waveforms are known [s].
    pub fn known(&self) -> f64 {
        self.waveforms.iter().map(Waveform::known).fold(f64::INFINITY, f64::min)
    }

    /// The earliest breakpoint after `t`; breakpoints within rounding of each other are one.
    pub fn next_breakpoint(&mut self, t: f64) -> f64 {
        self.breakpoints.clear();
        self.breakpoints.extend(self.waveforms.iter().filter_map(|w| w.next_breakpoint_time(t)));
        let first = self.breakpoints.iter().copied().fold(f64::INFINITY, f64::min);
        let same = first + INSTANT * first.abs();
        fault!("breakpoints_missed" => {
            let later = self.waveforms.iter().filter_map(|w| w.next_breakpoint_time(same));
            return later.fold(f64::INFINITY, f64::min);
        });
        self.breakpoints.iter().copied().filter(|&c| c <= same).fold(first, f64::max)
    }

    /// Values of all waveforms at `t`.
    pub fn values(&self, t: f64, side: Side, out: &mut [f64]) {
        for (v, w) in out.iter_mut().zip(&self.waveforms) {
            *v = w.value(t, side);
        }
    }
}

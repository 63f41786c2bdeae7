//! Set-valued elements: the voltage and the current lie on one of some lines, and there on its right side.

use super::block::{finite, largest, Block};
use super::{Size, Terms, Unit, Work, Worst};
use crate::audit::{ratio, worse, TOLERANCE};

/// Points that are kept until the size of the largest is known.
const MOST: usize = 1024;
/// The least part of the largest voltage or current of a run by which those of an element are measured: times the
/// tolerance a hundred roundings of a solution, which neighbours that differ by two decades make of one.
const LEAST: f64 = 1e-3;

/// `v`, `i`, `constant` of `v volts + i amperes - constant`, and its unit.
pub type Form = ([f64; 3], Unit);

/// A line `law = 0` on which `bounds >= 0`.
#[derive(Clone, Debug)]
pub struct Line {
    /// what vanishes on it
    pub law: Form,
    /// what is positive there
    pub bounds: Vec<Form>,
}

#[inline]
fn at(([volts, amperes, constant], unit): &Form, [v, i]: [f64; 2]) -> (f64, usize) {
    (volts * v + amperes * i - constant, *unit as usize)
}

/// One over what voltages and currents are measured by, and what of them is rounding.
struct Scales {
    shares: [f64; 2],
    rounding: [f64; 2],
}

impl Scales {
    fn of([scale, rounding]: [[f64; 2]; 2]) -> Scales {
        Scales { shares: scale.map(|s| if s > 0.0 { 1.0 / s } else { 0.0 }), rounding }
    }
}

impl Line {
    /// How far points are from it, relative to the largest; `out` is zero before.
    fn distances(&self, scales: &Scales, [volts, amperes]: [&[f64]; 2], out: &mut [f64]) {
        let forms = std::iter::once((&self.law, true));
        for (([v, i, constant], unit), both) in
            forms.chain(self.bounds.iter().map(|bound| (bound, false)))
        {
            let (rounding, share) =
                (scales.rounding[*unit as usize], scales.shares[*unit as usize]);
            for ((out, volts), amperes) in out.iter_mut().zip(volts).zip(amperes) {
                let value = v * volts + i * amperes - constant;
                let beyond = if both { value.abs() } else { -value };
                let off = (beyond - rounding) * share;
                *out = if off > *out { off } else { *out };
            }
        }
    }
}

/// One of them.
pub struct Valve {
    voltage: Terms,
    current: Terms,
    lines: Vec<Line>,
    /// resistance and conductance at its nodes by which rounding of currents is a voltage, and of voltages a current
    /// [Ohm, S]
    reach: [f64; 2],
    own: [f64; 2],
    potential: f64,
    /// points off their lines, and when
    suspects: Vec<([f64; 2], f64)>,
    /// of the last block: how far each row is from the nearest line, and from the first two
    nearest: Vec<f64>,
    pub(super) distances: [Vec<f64>; 2],
}

impl Valve {
    /// Nothing is known of it yet.
    pub fn new(voltage: Terms, current: Terms, lines: Vec<Line>, reach: [f64; 2]) -> Valve {
        Valve {
            voltage,
            current,
            lines,
            reach,
            own: [0.0; 2],
            potential: 0.0,
            suspects: Vec::new(),
            nearest: Vec::new(),
            distances: Default::default(),
        }
    }

    pub(super) fn take(&mut self, block: &Block, size: &Size, work: &mut Work) {
        let [volts, amperes, sizes] = work;
        self.potential = self.potential.max(block.combine(&self.voltage, volts, sizes));
        block.combine(&self.current, amperes, sizes);
        let most = [largest(volts), largest(amperes)];
        self.own = [0, 1].map(|k| self.own[k].max(most[k]));
        let scales = Scales::of(self.scales(size));
        self.nearest.clear();
        self.nearest.resize(block.count(), f64::INFINITY);
        for (number, line) in self.lines.iter().enumerate() {
            sizes.clear();
            sizes.resize(block.count(), 0.0);
            line.distances(&scales, [volts, amperes], sizes);
            for (nearest, distance) in self.nearest.iter_mut().zip(sizes.iter()) {
                *nearest = if distance < nearest { *distance } else { *nearest };
            }
            if let Some(kept) = self.distances.get_mut(number) {
                kept.clone_from(sizes);
            }
        }
        if largest(&self.nearest) <= TOLERANCE && finite(volts) && finite(amperes) {
            return;
        }
        let times = block.column(0);
        for k in 0..block.count() {
            let point = [volts[k], amperes[k]];
            if worse(self.off(point, size), TOLERANCE) {
                self.suspect(point, times[k], size);
            }
        }
    }

    /// Keeps a point off all lines until the size of the largest is known.
    fn suspect(&mut self, point: [f64; 2], time: f64, size: &Size) {
        if self.suspects.len() == MOST {
            let kept = std::mem::take(&mut self.suspects);
            self.suspects =
                kept.into_iter().filter(|s| worse(self.off(s.0, size), TOLERANCE)).collect();
        }
        if self.suspects.len() < MOST {
            self.suspects.push((point, time));
        }
    }

    /// Measures errors by the values of the same element in other rows, too.
    pub(super) fn see(&mut self, other: &Valve) {
        self.own = [0, 1].map(|k| self.own[k].max(other.own[k]));
        self.potential = self.potential.max(other.potential);
    }

    /// What voltages and currents are measured by, and what of them is rounding.
    fn scales(&self, size: &Size) -> [[f64; 2]; 2] {
        let largest = [Unit::Volts, Unit::Amperes].map(|unit| size.of(unit));
        let scale = [0, 1].map(|k| self.own[k].max(LEAST * largest[k]));
        let volts = self.potential.max(LEAST * largest[0]) + self.reach[0] * size.largest[1];
        let amperes = largest[1] + self.reach[1] * largest[0];
        [scale, [volts, amperes].map(|terms| size.known * terms)]
    }

    /// How far a point is from a line, relative to the largest.
    fn off_line(&self, line: &Line, point: [f64; 2], [scale, rounding]: [[f64; 2]; 2]) -> f64 {
        let (off, unit) = at(&line.law, point);
        let mut worst = ratio((off.abs() - rounding[unit]).max(0.0), scale[unit]);
        for bound in &line.bounds {
            let (inside, unit) = at(bound, point);
            let beyond = ratio((-inside - rounding[unit]).max(0.0), scale[unit]);
            worst = if worse(beyond, worst) { beyond } else { worst };
        }
        worst
    }

    /// How far a point is from all lines.
    fn off(&self, point: [f64; 2], size: &Size) -> f64 {
        if !(point[0] + point[1]).is_finite() {
            return f64::NAN;
        }
        let scales = self.scales(size);
        self.lines.iter().map(|l| self.off_line(l, point, scales)).fold(f64::INFINITY, f64::min)
    }

    pub(super) fn worst(&self, size: &Size) -> Worst {
        let mut worst = Worst::default();
        self.suspects.iter().for_each(|&(point, time)| worst.note(self.off(point, size), time));
        worst
    }
}

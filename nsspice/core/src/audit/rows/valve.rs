//! Set-valued elements: the voltage and the current lie on one of some lines, and there on its right side.

use super::{value, Size, Terms, Unit, Worst};
use crate::audit::{ratio, worse, TOLERANCE};

/// Points that are kept until the size of the largest is known.
const MOST: usize = 1024;
/// The least part of the largest voltage or current of a run by which those of an element are measured.
const LEAST: f64 = 1e-6;

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

/// One of them.
pub struct Valve {
    voltage: Terms,
    current: Terms,
    lines: Vec<Line>,
    /// resistance at its nodes by which rounding of currents is a voltage [Ohm]
    resists: f64,
    own: [f64; 2],
    potential: f64,
    /// points off their lines, and when
    suspects: Vec<([f64; 2], f64)>,
    present: [f64; 2],
}

impl Valve {
    /// Nothing is known of it yet.
    pub fn new(voltage: Terms, current: Terms, lines: Vec<Line>, resists: f64) -> Valve {
        Valve {
            voltage,
            current,
            lines,
            resists,
            own: [0.0; 2],
            potential: 0.0,
            suspects: Vec::new(),
            present: [0.0; 2],
        }
    }

    pub(super) fn take(&mut self, row: &[f64], size: &Size) {
        let point = [value(&self.voltage, row), value(&self.current, row)];
        self.present = point;
        self.own = [0, 1].map(|k| self.own[k].max(point[k].abs()));
        let potential = |terms: &Terms| terms.iter().map(|&(c, f)| (f * row[c]).abs()).sum::<f64>();
        self.potential = self.potential.max(potential(&self.voltage));
        if !worse(self.off(point, size), TOLERANCE) {
            return;
        }
        if self.suspects.len() == MOST {
            let kept = std::mem::take(&mut self.suspects);
            self.suspects =
                kept.into_iter().filter(|s| worse(self.off(s.0, size), TOLERANCE)).collect();
        }
        if self.suspects.len() < MOST {
            self.suspects.push((point, row[0]));
        }
    }

    /// What voltages and currents are measured by, and what of them is rounding.
    fn scales(&self, size: &Size) -> [[f64; 2]; 2] {
        let scale = [0, 1].map(|k| self.own[k].max(LEAST * size.largest[k]));
        let volts = self.potential.max(LEAST * size.largest[0]) + self.resists * size.largest[1];
        let (volts, amperes) = (size.known * volts, size.known * size.largest[1]);
        [scale, [volts, amperes]]
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

    /// How far the present row is from each of the first two lines, relative to the largest so far.
    pub(super) fn distances(&self, size: &Size) -> [f64; 2] {
        let scales = self.scales(size);
        [0, 1].map(|k| self.off_line(&self.lines[k], self.present, scales))
    }

    pub(super) fn worst(&self, size: &Size) -> Worst {
        let mut worst = Worst::default();
        self.suspects.iter().for_each(|&(point, time)| worst.note(self.off(point, size), time));
        worst
    }
}

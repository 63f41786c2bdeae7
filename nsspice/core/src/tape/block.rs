//! Four members of a group at a time.

use super::evaluate::{Linearisation, SAME};
use super::group::{Group, Kind, Shape, Step, WIDE};
use super::lanes::{growth, log_near_one, Lanes};
use super::limit;
use crate::dense::widest;

/// The numbers of a tape that groups read and write.
pub(super) struct Numbers<'a> {
    pub registers: &'a mut [f64],
    pub slopes: &'a mut [f64],
    pub points: &'a mut [f64],
}

widest! {
    fn evaluate_widest(
        group: &mut Group,
        numbers: &mut Numbers,
        how: Linearisation,
        reach: f64,
        wild: &mut Vec<usize>,
    ) -> bool =
        group.evaluate_any(numbers, how, reach, wild)
}

impl Group {
    /// Evaluates all members but those that are their tangents, within `reach` of their units, and
    /// move along them.  True if something was not linearised at its argument; `wild` takes the
    /// members with something that is not finite, whose linearisation points stay.
    pub fn evaluate(
        &mut self,
        numbers: &mut Numbers,
        how: Linearisation,
        reach: f64,
        wild: &mut Vec<usize>,
    ) -> bool {
        evaluate_widest(self, numbers, how, reach, wild)
    }

    #[inline(always)]
    fn evaluate_any(
        &mut self,
        numbers: &mut Numbers,
        how: Linearisation,
        reach: f64,
        wild: &mut Vec<usize>,
    ) -> bool {
        let Group { shape, registers, derivatives, before, .. } = self;
        let (v, c, p) = (shape.variables, shape.constants, shape.limits);
        let (o, s) = (shape.outputs.len(), shape.slopes.len());
        let (variables, results) = numbers.registers.split_at_mut(self.results);
        let results = results.as_chunks_mut::<WIDE>().0;
        let slopes = numbers.slopes[self.slopes..].as_chunks_mut::<WIDE>().0;
        let points = numbers.points[self.points..].as_chunks_mut::<WIDE>().0;
        derivatives[0] = [0.0; WIDE];
        derivatives[1..=v].fill([1.0; WIDE]);
        let mut any = false;
        for (b, known) in self.known.iter_mut().enumerate() {
            for (x, input) in registers.iter_mut().zip(&self.inputs[b * v..(b + 1) * v]) {
                *x = each(|i| variables[input[i] as usize]);
            }
            let results = &mut results[b * o..(b + 1) * o];
            let slopes = &mut slopes[b * s..(b + 1) * s];
            let at = &mut self.at[b * v..(b + 1) * v];
            let values = &mut self.values[b * o..(b + 1) * o];
            if *known && how == Linearisation::Careful {
                let far: Lanes<WIDE> = each(|i| reach * self.unit[b][i]);
                let mut near = true;
                for (x, at) in registers.iter().zip(at.iter()) {
                    for i in 0..WIDE {
                        near &= (x[i] - at[i]).abs() <= far[i];
                    }
                }
                if near {
                    results.copy_from_slice(values);
                    for (slope, &(_, out, k)) in slopes.iter().zip(&shape.slopes) {
                        let (x, at) = (&registers[k as usize], &at[k as usize]);
                        let out = &mut results[out as usize];
                        *out = each(|i| out[i] + slope[i] * (x[i] - at[i]));
                    }
                    continue;
                }
            }
            at.copy_from_slice(&registers[..v]);
            registers[v..v + c].copy_from_slice(&self.constants[b * c..(b + 1) * c]);
            let points = &mut points[b * p..(b + 1) * p];
            before.copy_from_slice(points);
            let mut limited = false;
            for step in &shape.steps {
                run(shape, step, registers, derivatives, points, how, &mut limited);
            }
            // nothing but zero if all is finite
            let mut lost: Lanes<WIDE> = [0.0; WIDE];
            for ((value, result), k) in values.iter_mut().zip(results).zip(&shape.outputs) {
                *value = registers[k.0 as usize];
                *result = *value;
                lost = each(|i| lost[i] + 0.0 * value[i]);
            }
            for (slope, k) in slopes.iter_mut().zip(&shape.slopes) {
                *slope = derivatives[k.0 as usize];
                lost = each(|i| lost[i] + 0.0 * slope[i]);
            }
            let calm = lost == [0.0; WIDE];
            if !calm {
                for (point, before) in points.iter_mut().zip(before.iter()) {
                    *point = each(|i| if lost[i] == 0.0 { point[i] } else { before[i] });
                }
                let last = self.parts.len() - WIDE * b;
                wild.extend((0..WIDE.min(last)).filter(|&i| lost[i] != 0.0).map(|i| WIDE * b + i));
            }
            any |= limited;
            let bends = self.unit[b].iter().all(|u| *u > 0.0);
            *known = calm && !limited && how != Linearisation::Held && bends;
        }
        any
    }
}

#[inline(always)]
fn each<const W: usize>(f: impl Fn(usize) -> f64) -> Lanes<W> {
    let mut out = [0.0; W];
    for (i, o) in out.iter_mut().enumerate() {
        *o = f(i);
    }
    out
}

/// Value and slots of one step.
#[inline(always)]
fn run<const W: usize>(
    shape: &Shape,
    step: &Step,
    registers: &mut [Lanes<W>],
    derivatives: &mut [Lanes<W>],
    points: &mut [Lanes<W>],
    how: Linearisation,
    limited: &mut bool,
) {
    let (a, b) = (registers[step.args[0] as usize], registers[step.args[1] as usize]);
    let range = step.slots.0 as usize..step.slots.1 as usize;
    // slots of arguments stand before those of the step
    let (fed, slots) = derivatives.split_at_mut(range.start);
    let slots = slots[..range.len()].iter_mut().zip(&shape.feeds[range]);
    let (value, slope) = match step.kind {
        Kind::Neg => {
            for (slot, f) in slots {
                let x = &fed[f[0] as usize];
                *slot = each(|i| -x[i]);
            }
            registers[step.out as usize] = each(|i| -a[i]);
            return;
        }
        Kind::Add | Kind::Sub => {
            let sign = if step.kind == Kind::Add { 1.0 } else { -1.0 };
            for (slot, f) in slots {
                let (x, y) = (&fed[f[0] as usize], &fed[f[1] as usize]);
                *slot = each(|i| x[i] + sign * y[i]);
            }
            registers[step.out as usize] = each(|i| a[i] + sign * b[i]);
            return;
        }
        Kind::Mul => {
            for (slot, f) in slots {
                let (x, y) = (&fed[f[0] as usize], &fed[f[1] as usize]);
                *slot = each(|i| b[i] * x[i] + a[i] * y[i]);
            }
            registers[step.out as usize] = each(|i| a[i] * b[i]);
            return;
        }
        Kind::Div => {
            let value: Lanes<W> = each(|i| a[i] / b[i]);
            let inverse: Lanes<W> = each(|i| 1.0 / b[i]);
            for (slot, f) in slots {
                let (x, y) = (&fed[f[0] as usize], &fed[f[1] as usize]);
                *slot = each(|i| (x[i] - value[i] * y[i]) * inverse[i]);
            }
            registers[step.out as usize] = value;
            return;
        }
        Kind::Square => (each(|i| a[i] * a[i]), each(|i| 2.0 * a[i])),
        Kind::Junction { at, limit } => {
            let constants = &registers[at as usize..];
            junction(&a, constants, &mut points[limit as usize], how, limited)
        }
        Kind::Depletion { at } => depletion(&a, &registers[at as usize..]),
    };
    for (slot, f) in slots {
        let x = &fed[f[0] as usize];
        *slot = each(|i| slope[i] * x[i]);
    }
    registers[step.out as usize] = value;
}

/// `Is expm1(v / nVt)` along its tangent at `point`, which moves with care.
#[inline(always)]
fn junction<const W: usize>(
    v: &Lanes<W>,
    constants: &[Lanes<W>],
    point: &mut Lanes<W>,
    how: Linearisation,
    limited: &mut bool,
) -> (Lanes<W>, Lanes<W>) {
    let [saturation, unit, inverse, steep, knee] = [0, 1, 2, 3, 4].map(|k| &constants[k]);
    let mut calm = true;
    if how == Linearisation::Careful {
        for i in 0..W {
            calm &= v[i] <= knee[i] || (v[i] - point[i]).abs() <= 2.0 * unit[i];
        }
    }
    if !calm {
        for i in 0..W {
            let new = limit::exponential(v[i], point[i], unit[i], knee[i]);
            point[i] = if v[i].is_nan() { v[i] } else { new };
        }
    } else if how != Linearisation::Held {
        *point = *v;
    }
    let (grown, power) = growth(&each::<W>(|i| point[i] * inverse[i]));
    let slope: Lanes<W> = each(|i| steep[i] * power[i]);
    let mut value: Lanes<W> = each(|i| saturation[i] * grown[i]);
    if !calm || how == Linearisation::Held {
        for i in 0..W {
            *limited |= (v[i] - point[i]).abs() > SAME * unit[i];
            value[i] += slope[i] * (v[i] - point[i]);
        }
    }
    (value, slope)
}

/// Charge and capacitance of a depletion layer, as in `curves::depletion`.
#[inline(always)]
fn depletion<const W: usize>(v: &Lanes<W>, constants: &[Lanes<W>]) -> (Lanes<W>, Lanes<W>) {
    let [vj, edge, rest, size, c0, bend] = [0, 1, 2, 3, 4, 5].map(|k| &constants[k]);
    let inside: Lanes<W> = each(|i| if v[i] >= edge[i] { edge[i] } else { v[i] });
    let x: Lanes<W> = each(|i| -inside[i] / vj[i]);
    let log = log_near_one(&x);
    let exponent: Lanes<W> = each(|i| rest[i] * log[i]);
    let (grown, power) = growth(&exponent);
    let (mut charge, mut capacitance) = ([0.0; W], [0.0; W]);
    for i in 0..W {
        let gathered = if exponent[i].abs() < 1e-300 { log[i] } else { grown[i] / rest[i] };
        let beyond = v[i] - inside[i];
        // t^-M = t^(1-M) / t
        let here = c0[i] * (power[i] / (1.0 + x[i]));
        let slope = here * bend[i];
        charge[i] = beyond * (here + 0.5 * slope * beyond) - size[i] * gathered;
        capacitance[i] = here + slope * beyond;
    }
    (charge, capacitance)
}

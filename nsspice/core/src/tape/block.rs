//! Evaluation of four members of a group at a time.

use super::curves;
use super::evaluate::{Linearisation, SAME};
use super::group::{Group, Kind, Shape, Step, DEPLETION, JUNCTION, LONE, SHAPED, WIDE};
use super::lanes::{growth, log_near_one, Lanes};
use super::limit;
use super::parts::bent;
use crate::dense::{each, widest};

/// The numbers of a tape that groups read and write.
pub(super) struct Numbers<'a> {
    pub registers: &'a mut [f64],
    pub slopes: &'a mut [f64],
    pub points: &'a mut [f64],
}

/// What one evaluation is about.
#[derive(Clone, Copy)]
pub(super) struct Wanted {
    pub how: Linearisation,
    /// part of the distance over which it is curved within which a member is its tangent
    pub reach: f64,
}

// a function of its own, since around a loop over blocks all that it needs would be kept ready
widest! {
    fn evaluate_block(
        group: &mut Group,
        block: usize,
        numbers: &mut Numbers,
        wanted: Wanted,
        wild: &mut Vec<usize>,
    ) -> bool =
        group.block(block, numbers, wanted, wild)
}

widest! {
    fn evaluate_junctions(
        group: &mut Group,
        block: usize,
        numbers: &mut Numbers,
        wanted: Wanted,
        wild: &mut Vec<usize>,
    ) -> bool =
        group.junctions(block, numbers, wanted, wild)
}

impl Group {
    /// Evaluates all members but those that are their tangents and move along them.  True if
    /// something was not linearised at its argument; `wild` takes the members with something that
    /// is not finite, whose linearisation points stay.
    pub fn evaluate(
        &mut self,
        numbers: &mut Numbers,
        wanted: Wanted,
        wild: &mut Vec<usize>,
    ) -> bool {
        let mut limited = false;
        for block in 0..self.known.len() {
            limited |= if self.shape.lone {
                evaluate_junctions(self, block, numbers, wanted, wild)
            } else {
                evaluate_block(self, block, numbers, wanted, wild)
            };
        }
        limited
    }

    /// As `block` for junctions alone, the commonest elements, in a third of the instructions.
    #[inline(always)]
    fn junctions(
        &mut self,
        b: usize,
        numbers: &mut Numbers,
        Wanted { how, reach }: Wanted,
        wild: &mut Vec<usize>,
    ) -> bool {
        let Some(frame) = self.frames[b * LONE..].first_chunk_mut::<LONE>() else { return false };
        let [unit, at, value, link, parameters @ ..] = frame;
        let [ends] = self.shape.inputs[..] else { return false };
        let registers = &mut numbers.registers[..];
        let x = total(&self.terms[b * ends[1] as usize..], [0, ends[0], ends[1]], registers);
        let moved: Lanes<WIDE> = each(|i| x[i] - at[i]);
        let result = &mut registers[self.results..].as_chunks_mut::<WIDE>().0[b];
        let known = &mut self.known[b];
        let still = || sum(&beyond(reach, &moved, unit, at)) == 0.0;
        if *known && how == Linearisation::Careful && still() {
            *result = each(|i| value[i] + link[i] * moved[i]);
            return false;
        }
        let point = &mut numbers.points[self.points..].as_chunks_mut::<WIDE>().0[b];
        let before = *point;
        let mut limited = false;
        let (new, slope) = junction(&x, parameters, point, how, &mut limited);
        (*at, *value, *link, *result) = (x, new, slope, new);
        let shares = &self.shape.shares[..];
        let slopes = numbers.slopes[self.slopes..].as_chunks_mut::<WIDE>().0;
        for (out, (_, sign)) in slopes[b * shares.len()..].iter_mut().zip(shares) {
            *out = each(|i| sign * slope[i]);
        }
        let lost: Lanes<WIDE> = each(|i| 0.0 * new[i] + 0.0 * slope[i]);
        let calm = sum(&lost) == 0.0;
        if !calm {
            *point = each(|i| if lost[i] == 0.0 { point[i] } else { before[i] });
            note_wild(&lost, b, self.parts.len(), wild);
        }
        *known = calm && !limited && how != Linearisation::Held;
        limited
    }

    #[inline(always)]
    fn block(
        &mut self,
        b: usize,
        numbers: &mut Numbers,
        Wanted { how, reach }: Wanted,
        wild: &mut Vec<usize>,
    ) -> bool {
        let Group { shape, registers, derivatives, before, frames, frame, .. } = self;
        let (v, o, links) = (shape.inputs.len(), shape.outputs.len(), shape.links.len());
        let mut frame = &mut frames[b * *frame..(b + 1) * *frame];
        let unit = first(&mut frame, 1)[0];
        let at = first(&mut frame, v);
        let (variables, results) = numbers.registers.split_at_mut(self.results);
        let results = &mut results.as_chunks_mut::<WIDE>().0[b * o..(b + 1) * o];
        let mut far: Lanes<WIDE> = [0.0; WIDE];
        let terms = shape.inputs.last().map_or(0, |ends| ends[1] as usize);
        let terms = &self.terms[b * terms..(b + 1) * terms];
        let mut begin = 0;
        for ((x, ends), at) in registers.iter_mut().zip(&shape.inputs).zip(at.iter()) {
            let now = total(terms, [begin, ends[0], ends[1]], variables);
            begin = ends[1];
            let moved: Lanes<WIDE> = each(|i| now[i] - at[i]);
            let excess = beyond(reach, &moved, &unit, at);
            far = each(|i| far[i] + excess[i]);
            *x = now;
        }
        let known = &mut self.known[b];
        if *known && how == Linearisation::Careful && sum(&far) == 0.0 {
            for (result, value) in results.iter_mut().zip(first(&mut frame, o).iter()) {
                *result = *value;
            }
            for (slope, &(_, out, k)) in first(&mut frame, links).iter().zip(&shape.links) {
                let (x, at) = (&registers[k as usize], &at[k as usize]);
                let out = &mut results[out as usize];
                *out = each(|i| out[i] + slope[i] * (x[i] - at[i]));
            }
            return false;
        }
        let (values, links) = (first(&mut frame, o), first(&mut frame, links));
        let (constants, parameters) = frame.split_at(shape.constants);
        let (p, s) = (shape.limits, shape.slopes.len());
        let points = numbers.points[self.points..].as_chunks_mut::<WIDE>().0;
        let points = &mut points[b * p..(b + 1) * p];
        let slopes = numbers.slopes[self.slopes..].as_chunks_mut::<WIDE>().0;
        let slopes = &mut slopes[b * s..(b + 1) * s];
        for (at, x) in at.iter_mut().zip(registers.iter()) {
            *at = *x;
        }
        for (x, constant) in registers[v..].iter_mut().zip(constants) {
            *x = *constant;
        }
        for (before, point) in before.iter_mut().zip(points.iter()) {
            *before = *point;
        }
        let mut limited = false;
        for step in &shape.steps {
            run(shape, step, parameters, registers, derivatives, points, how, &mut limited);
        }
        // nothing but zero if all is finite
        let mut lost: Lanes<WIDE> = [0.0; WIDE];
        for ((value, result), k) in values.iter_mut().zip(results).zip(&shape.outputs) {
            let new = registers[k.0 as usize];
            (*value, *result) = (new, new);
            lost = each(|i| lost[i] + 0.0 * new[i]);
        }
        for (link, k) in links.iter_mut().zip(&shape.links) {
            let new = derivatives[k.0 as usize];
            *link = new;
            lost = each(|i| lost[i] + 0.0 * new[i]);
        }
        let mut begin = 0;
        for (slope, &end) in slopes.iter_mut().zip(&shape.slopes) {
            let mut total: Lanes<WIDE> = [0.0; WIDE];
            for &(link, sign) in &shape.shares[begin..end as usize] {
                let link = &links[link as usize];
                total = each(|i| total[i] + sign * link[i]);
            }
            *slope = total;
            begin = end as usize;
        }
        let calm = sum(&lost) == 0.0;
        if !calm {
            for (point, before) in points.iter_mut().zip(before.iter()) {
                *point = each(|i| if lost[i] == 0.0 { point[i] } else { before[i] });
            }
            note_wild(&lost, b, self.parts.len(), wild);
        }
        *known = calm && !limited && how != Linearisation::Held;
        limited
    }
}

/// A sum of variables: what is added and what is subtracted is between these places of `terms`.
#[inline(always)]
fn total(terms: &[[u32; WIDE]], [begin, middle, end]: [u32; 3], variables: &[f64]) -> Lanes<WIDE> {
    let mut x: Lanes<WIDE> = [0.0; WIDE];
    for k in &terms[begin as usize..middle as usize] {
        x = each(|i| x[i] + variables[k[i] as usize]);
    }
    for k in &terms[middle as usize..end as usize] {
        x = each(|i| x[i] - variables[k[i] as usize]);
    }
    x
}

/// Notes the members of block `b` that have lost something, of so many in all.
#[cold]
fn note_wild(lost: &Lanes<WIDE>, b: usize, count: usize, wild: &mut Vec<usize>) {
    let last = WIDE.min(count - WIDE * b);
    wild.extend((0..last).filter(|&i| lost[i] != 0.0).map(|i| WIDE * b + i));
}

/// How far (in squares) members have moved beyond the `reach` of their tangents; zero: not at all.
#[inline(always)]
fn beyond<const W: usize>(
    reach: f64,
    moved: &Lanes<W>,
    unit: &Lanes<W>,
    at: &Lanes<W>,
) -> Lanes<W> {
    let part = reach * reach;
    let excess = each(|i| moved[i] * moved[i] - part * bent(unit[i], at[i]));
    positive(&excess, moved)
}

/// What is above zero; not zero either where `of` is no number.
#[inline(always)]
fn positive<const W: usize>(excess: &Lanes<W>, of: &Lanes<W>) -> Lanes<W> {
    each(|i| if excess[i] > 0.0 { excess[i] } else { 0.0 * of[i] })
}

/// Cuts the first numbers off.
#[inline(always)]
fn first<'a, T>(rest: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    let (own, others) = std::mem::take(rest).split_at_mut(count);
    *rest = others;
    own
}

#[inline(always)]
fn sum<const W: usize>(lanes: &Lanes<W>) -> f64 {
    lanes.iter().sum()
}

/// Value and slots of one step.
#[inline(always)]
#[allow(clippy::too_many_arguments)] // what a group has
fn run<const W: usize>(
    shape: &Shape,
    step: &Step,
    parameters: &[Lanes<W>],
    registers: &mut [Lanes<W>],
    derivatives: &mut [Lanes<W>],
    points: &mut [Lanes<W>],
    how: Linearisation,
    limited: &mut bool,
) {
    let (a, b) = (registers[step.args[0] as usize], registers[step.args[1] as usize]);
    let range = step.slots.0 as usize..step.slots.1 as usize;
    // slots of arguments come before those of the step
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
        Kind::Max | Kind::Min => {
            // where both are equal the first of max and the second of min, as in `functions::binary`
            let largest = step.kind == Kind::Max;
            let own: Lanes<W> =
                each(|i| f64::from(u8::from(if largest { a[i] >= b[i] } else { a[i] < b[i] })));
            for (slot, f) in slots {
                let (x, y) = (&fed[f[0] as usize], &fed[f[1] as usize]);
                *slot = each(|i| own[i] * x[i] + (1.0 - own[i]) * y[i]);
            }
            // a number that is none stays none
            registers[step.out as usize] =
                each(|i| if own[i] != 0.0 { a[i] + 0.0 * b[i] } else { b[i] + 0.0 * a[i] });
            return;
        }
        Kind::Abs => (each(|i| a[i].abs()), each(|i| if a[i] < 0.0 { -1.0 } else { 1.0 })),
        Kind::Uramp => (
            each(|i| if a[i] < 0.0 { 0.0 } else { a[i] }),
            each(|i| f64::from(u8::from(a[i] >= 0.0))),
        ),
        Kind::Shaped { op, at } => {
            let own: &[Lanes<W>; SHAPED] = some(parameters, at);
            let (mut value, mut slope) = ([0.0; W], [0.0; W]);
            for i in 0..W {
                (value[i], slope[i]) = curves::shaped(op, &own.map(|c| c[i]), a[i]);
            }
            (value, slope)
        }
        Kind::Square => (each(|i| a[i] * a[i]), each(|i| 2.0 * a[i])),
        Kind::Junction { at, limit } => {
            let own = some(parameters, at);
            junction(&a, own, &mut points[limit as usize], how, limited)
        }
        Kind::Depletion { at } => depletion(&a, some(parameters, at)),
    };
    for (slot, f) in slots {
        let x = &fed[f[0] as usize];
        *slot = each(|i| slope[i] * x[i]);
    }
    registers[step.out as usize] = value;
}

/// Parameters from a place on.
#[inline(always)]
fn some<const W: usize, const N: usize>(all: &[Lanes<W>], at: u32) -> &[Lanes<W>; N] {
    let found = all[at as usize..].first_chunk::<N>();
    found.unwrap_or_else(|| unreachable!("steps have their parameters"))
}

/// `Is expm1(v / nVt)` along its tangent at `point`, which moves with care.
#[inline(always)]
fn junction<const W: usize>(
    v: &Lanes<W>,
    constants: &[Lanes<W>; JUNCTION],
    point: &mut Lanes<W>,
    how: Linearisation,
    limited: &mut bool,
) -> (Lanes<W>, Lanes<W>) {
    let [saturation, unit, inverse, steep, knee] = constants;
    let mut calm = true;
    if how == Linearisation::Careful {
        let above: Lanes<W> = each(|i| v[i] - knee[i]);
        let jump: Lanes<W> = each(|i| (v[i] - point[i]).abs() - 2.0 * unit[i]);
        let least: Lanes<W> = each(|i| if above[i] < jump[i] { above[i] } else { jump[i] });
        calm = sum(&positive(&least, v)) == 0.0;
    }
    if !calm {
        go_with_care(v, point, unit, knee);
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

/// Moves the linearisation points of exponentials.
#[cold]
#[inline(never)]
fn go_with_care<const W: usize>(
    v: &Lanes<W>,
    point: &mut Lanes<W>,
    unit: &Lanes<W>,
    knee: &Lanes<W>,
) {
    for i in 0..W {
        let new = limit::junction(v[i], point[i], unit[i], knee[i]);
        point[i] = if v[i].is_nan() { v[i] } else { new };
    }
}

/// Charge and capacitance of a depletion layer, as in `curves::depletion`.
#[inline(always)]
fn depletion<const W: usize>(
    v: &Lanes<W>,
    constants: &[Lanes<W>; DEPLETION],
) -> (Lanes<W>, Lanes<W>) {
    let [vj, edge, rest, size, c0, bend] = constants;
    let inside: Lanes<W> = each(|i| if v[i] >= edge[i] { edge[i] } else { v[i] });
    let x: Lanes<W> = each(|i| -inside[i] / vj[i]);
    let log = log_near_one(&x);
    let exponent: Lanes<W> = each(|i| rest[i] * log[i]);
    let (grown, power) = growth(&exponent);
    let gathered: Lanes<W> = each(|i| {
        let quotient = grown[i] / rest[i];
        if exponent[i].abs() < 1e-300 {
            log[i]
        } else {
            quotient
        }
    });
    let beyond: Lanes<W> = each(|i| v[i] - inside[i]);
    // t^-M = t^(1-M) / t
    let here: Lanes<W> = each(|i| c0[i] * (power[i] / (1.0 + x[i])));
    let slope: Lanes<W> = each(|i| here[i] * bend[i]);
    let charge =
        each(|i| beyond[i] * (here[i] + 0.5 * slope[i] * beyond[i]) - size[i] * gathered[i]);
    (charge, each(|i| here[i] + slope[i] * beyond[i]))
}

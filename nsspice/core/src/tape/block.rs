//! Several members of a group at a time.

use super::evaluate::{Linearisation, SAME, STEEPEST};
use super::group::{Group, Kind, Shape, Step};
use super::lanes::{growth, log_near_one, Lanes};
use super::limit;

/// Members that are evaluated at once: many, or the last few.
pub(super) const WIDEST: usize = 8;
const NARROW: usize = 4;

/// The numbers of a tape that blocks read and write.
pub(super) struct Numbers<'a> {
    pub registers: &'a mut [f64],
    pub slopes: &'a mut [f64],
    pub points: &'a mut [f64],
}

impl Group {
    /// Evaluates the active members.  True if something was not linearised at its argument; `wild`
    /// takes the members with something that is not finite, of which nothing is written.
    pub fn evaluate(
        &mut self,
        numbers: &mut Numbers,
        how: Linearisation,
        wild: &mut Vec<usize>,
    ) -> bool {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has just been asked
            return unsafe { self.evaluate_avx2(numbers, how, wild) };
        }
        self.evaluate_any(numbers, how, wild)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn evaluate_avx2(
        &mut self,
        numbers: &mut Numbers,
        how: Linearisation,
        wild: &mut Vec<usize>,
    ) -> bool {
        self.evaluate_any(numbers, how, wild)
    }

    #[inline(always)]
    fn evaluate_any(
        &mut self,
        numbers: &mut Numbers,
        how: Linearisation,
        wild: &mut Vec<usize>,
    ) -> bool {
        let active = std::mem::take(&mut self.active);
        let mut rest = &active[..];
        let mut limited = false;
        while !rest.is_empty() {
            let count = rest.len().min(if rest.len() > NARROW { WIDEST } else { NARROW });
            let (now, later) = rest.split_at(count);
            limited |= if count > NARROW {
                self.block::<WIDEST>(now, numbers, how, wild)
            } else {
                self.block::<NARROW>(now, numbers, how, wild)
            };
            rest = later;
        }
        self.active = active;
        limited
    }

    #[inline(always)]
    fn block<const W: usize>(
        &mut self,
        active: &[u32],
        numbers: &mut Numbers,
        how: Linearisation,
        wild: &mut Vec<usize>,
    ) -> bool {
        // beyond the last one it is taken again
        let members: [usize; W] = std::array::from_fn(|i| active[i.min(active.len() - 1)] as usize);
        let shape = &self.shape;
        let registers = self.registers.as_chunks_mut::<W>().0;
        let derivatives = self.derivatives.as_chunks_mut::<W>().0;
        let moved = self.moved.as_chunks_mut::<W>().0;
        let (v, c, p) = (shape.variables, shape.constants, shape.limits);
        for (k, register) in registers[..v].iter_mut().enumerate() {
            *register = each(|i| numbers.registers[self.inputs[members[i] * v + k] as usize]);
        }
        for (k, register) in registers[v..v + c].iter_mut().enumerate() {
            *register = if self.alike {
                [self.constants[k]; W]
            } else {
                each(|i| self.constants[members[i] * c + k])
            };
        }
        for (k, old) in moved[..p].iter_mut().enumerate() {
            *old = each(|i| numbers.points[self.points[members[i] * p + k] as usize]);
        }
        derivatives[0] = [0.0; W];
        derivatives[1..=v].fill([1.0; W]);
        let mut limited = [false; W];
        for step in &shape.steps {
            run(shape, step, registers, derivatives, moved, how, &mut limited);
        }
        let mut lost = [false; W];
        let outputs = shape.outputs.iter().map(|k| &registers[k.0 as usize]);
        for lanes in outputs.chain(shape.slopes.iter().map(|k| &derivatives[k.0 as usize])) {
            for i in 0..W {
                lost[i] |= !(lanes[i].abs() < STEEPEST);
            }
        }
        let (o, s) = (shape.outputs.len(), shape.slopes.len());
        let mut any = false;
        for (i, &m) in members.iter().enumerate().take(active.len()) {
            if lost[i] {
                wild.push(m);
                continue;
            }
            let (code, unit) = &self.parts[m];
            any |= limited[i];
            self.known[m] = how != Linearisation::Held && !limited[i] && *unit > 0.0;
            for (at, v) in self.at[m * v..(m + 1) * v].iter_mut().zip(registers.iter()) {
                *at = v[i];
            }
            let results = &mut numbers.registers[code.clone()];
            let values = self.values[m * o..(m + 1) * o].iter_mut();
            for (value, &(k, behind)) in values.zip(&shape.outputs) {
                *value = registers[k as usize][i];
                results[behind as usize] = *value;
            }
            for (&at, k) in self.slopes[m * s..(m + 1) * s].iter().zip(&shape.slopes) {
                numbers.slopes[at as usize] = derivatives[k.0 as usize][i];
            }
            for (&at, new) in self.points[m * p..(m + 1) * p].iter().zip(moved.iter()) {
                numbers.points[at as usize] = new[i];
            }
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
    moved: &mut [Lanes<W>],
    how: Linearisation,
    limited: &mut [bool; W],
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
            junction(&a, constants, &mut moved[limit as usize], how, limited)
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
    limited: &mut [bool; W],
) -> (Lanes<W>, Lanes<W>) {
    let (saturation, unit, steep, knee) =
        (&constants[0], &constants[1], &constants[2], &constants[3]);
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
    let (grown, power) = growth(&each::<W>(|i| point[i] / unit[i]));
    let slope: Lanes<W> = each(|i| steep[i] * power[i]);
    let mut value: Lanes<W> = each(|i| saturation[i] * grown[i]);
    if !calm || how == Linearisation::Held {
        for i in 0..W {
            limited[i] |= (v[i] - point[i]).abs() > SAME * unit[i];
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

//! Values and derivatives of a program.

use super::block::{Numbers, Wanted};
use super::curves;
use super::functions::{binary, unary};
use super::group::Group;
use super::limit;
use super::ops::Op;
use super::parts::{bent, is_variable, Part};
use super::program::{Instruction, Program};
use std::ops::Range;
use std::sync::Arc;

/// Where the fast-growing instructions are linearised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Linearisation {
    /// at the point itself: exact values
    Exact,
    /// at points that move from those of the last evaluation with care
    Careful,
    /// at the points of the last evaluation, or those that have been set
    Held,
}

/// A program with its registers.
#[derive(Clone, Debug)]
pub struct Tape {
    program: Arc<Program>,
    machine: Machine,
    /// parts that are evaluated together
    groups: Vec<Group>,
    /// parts that are evaluated alone
    parts: Vec<Part>,
    /// members of a group that have to be this time
    wild: Vec<usize>,
    /// registers of unknowns and of sources, each with its index, and of the time
    leaves: [Vec<(u32, u32)>; 3],
    /// where the values of the functions are, and the derivatives of each slot
    values: Vec<u32>,
    places: Vec<u32>,
}

/// What changes from one evaluation to the next.
#[derive(Clone, Debug)]
struct Machine {
    registers: Vec<f64>,
    slopes: Vec<f64>,
    /// linearisation points
    points: Vec<f64>,
    knees: Vec<f64>,
    /// factor of the voltage unit of all junctions, one but on the way to a first solution
    blunt: f64,
    limited: bool,
    /// last value and slope of each costly instruction
    kept: Vec<Kept>,
    /// part of its unit within which a function is its tangent
    tangent: f64,
}

/// A costly function near an argument.
#[derive(Clone, Copy, Debug)]
struct Kept {
    at: f64,
    value: f64,
    slope: f64,
}

impl Kept {
    const NOTHING: Kept = Kept { at: f64::NAN, value: 0.0, slope: 0.0 };

    /// Value and slope at `x` of a function that is curved over a `unit`, from the tangent within the part
    /// `reach` of that.
    #[inline]
    fn get(
        &mut self,
        x: f64,
        reach: f64,
        unit: f64,
        compute: impl FnOnce(f64) -> (f64, f64),
    ) -> (f64, f64) {
        let step = x - self.at;
        if step * step <= reach * reach * bent(unit, self.at) {
            return (self.value + self.slope * step, self.slope);
        }
        let (value, slope) = compute(x);
        *self = Kept { at: x, value, slope };
        (value, slope)
    }
}

/// A linearisation point this close to the argument (in units of the exponential) is the argument.
pub(super) const SAME: f64 = 1e-9;
/// Within this part of its unit a function is its tangent, up to half the square of it.
const TANGENT: f64 = 1e-8;
/// Slopes are not let beyond this: products with zeros of the chain rule must stay zero.
const STEEPEST: f64 = 1e150;

impl Tape {
    /// Registers for a program, with the linearisation points where all arguments are zero.
    pub fn new(program: Arc<Program>) -> Tape {
        let mut slopes = vec![0.0; program.variables.len()];
        for i in program.code.iter().filter(|i| is_variable(i.op)) {
            slopes[i.slots.0 as usize] = 1.0;
        }
        let (mut groups, parts) = Group::all(&program, Part::all(&program));
        // groups have numbers of their own, behind those of the program
        let mut ends = [program.code.len(), slopes.len(), program.limited];
        let mut values = program.outputs.clone();
        let mut places: Vec<u32> = (0..slopes.len() as u32).collect();
        let mut registers: Vec<u32> = (0..program.code.len() as u32).collect();
        for group in &mut groups {
            [group.results, group.slopes, group.points] = ends;
            ends.iter_mut().zip(group.sizes()).for_each(|(end, size)| *end += size);
            group.places(
                |register, place| registers[register as usize] = place as u32,
                |slot, place| places[slot as usize] = place as u32,
            );
        }
        values.iter_mut().for_each(|v| *v = registers[*v as usize]);
        slopes.resize(ends[1], 0.0);
        let machine = Machine {
            registers: vec![0.0; ends[0]],
            slopes,
            points: vec![0.0; ends[2]],
            knees: vec![0.0; program.limited],
            blunt: 1.0,
            limited: false,
            kept: vec![Kept::NOTHING; program.kept],
            tangent: TANGENT,
        };
        let leaves = [Op::Unknown, Op::Source, Op::Time].map(|op| {
            let all = (0..).zip(&program.code).filter(|(_, i)| i.op == op);
            all.map(|(k, i)| (k, i.args[0])).collect()
        });
        let wild = Vec::new();
        let mut tape = Tape { machine, parts, groups, wild, leaves, values, places, program };
        tape.set_constants();
        tape.set_blunt(1.0);
        tape.set_linear_slopes();
        tape
    }

    /// Slots of the linear instructions, once for all.
    fn set_linear_slopes(&mut self) {
        let Tape { program, machine, .. } = self;
        for i in program.code.iter().filter(|i| i.linear) {
            let [a, b, _] = i.args.map(|a| a as usize);
            let constant = |r: usize| match program.code[r].op {
                Op::Constant => program.constants[program.code[r].args[0] as usize],
                _ => 0.0,
            };
            let partial = match i.op {
                Op::Neg => [-1.0, 0.0, 0.0],
                Op::Add => [1.0, 1.0, 0.0],
                Op::Sub => [1.0, -1.0, 0.0],
                Op::Mul => [constant(b), constant(a), 0.0],
                Op::Div => [1.0 / constant(b), 0.0, 0.0],
                _ => continue,
            };
            machine.chain(program, i, partial);
        }
    }

    /// Lets functions be their tangents where that errs by less than `accuracy` of their size.
    pub fn set_accuracy(&mut self, accuracy: f64) {
        self.machine.tangent = 0.5 * accuracy.sqrt();
    }

    /// The program.
    pub fn program(&self) -> &Program {
        &self.program
    }

    /// Multiplies the voltage unit `nVt` of every junction: with a large factor a sharp junction
    /// becomes a gentle one.
    pub fn set_blunt(&mut self, factor: f64) {
        self.machine.blunt = factor;
        self.machine.kept.fill(Kept::NOTHING);
        for part in &mut self.parts {
            part.measure(&self.program, factor);
        }
        for group in &mut self.groups {
            group.set_blunt(&self.program, factor);
        }
        for i in &self.program.code {
            if i.op == Op::Junction {
                let c = &self.program.constants[i.args[1] as usize..];
                self.machine.knees[i.limit as usize] = limit::knee(c[0], factor * c[1]);
            }
        }
    }

    /// Whether `set_blunt` has changed the functions.
    pub fn is_blunt(&self) -> bool {
        self.machine.blunt != 1.0
    }

    /// Whether there are junctions that `set_blunt` acts on.
    pub fn has_junctions(&self) -> bool {
        self.program.code.iter().any(|i| i.op == Op::Junction)
    }

    /// The linearisation points.
    pub fn points(&self) -> &[f64] {
        &self.machine.points
    }

    /// Goes back to other linearisation points.
    pub fn set_points(&mut self, points: &[f64]) {
        self.machine.points.copy_from_slice(points);
        self.forget();
    }

    /// Sets the linearisation point of every junction to its knee, where it begins to conduct.
    pub fn point_at_knees(&mut self) {
        for i in self.program.code.iter().filter(|i| i.op == Op::Junction) {
            self.machine.points[i.limit as usize] = self.machine.knees[i.limit as usize];
        }
        for group in &mut self.groups {
            group.point_at_knees(&mut self.machine.points);
        }
        self.forget();
    }

    /// True if some instruction was not linearised at its argument in the last evaluation.
    pub fn limited(&self) -> bool {
        self.machine.limited
    }

    /// Value of function `k`.
    #[inline]
    pub fn value(&self, k: usize) -> f64 {
        self.machine.registers[self.register(k)]
    }

    /// Where the value of function `k` is among the registers.
    #[inline]
    pub fn register(&self, k: usize) -> usize {
        self.values[k] as usize
    }

    /// Numbers of the last evaluation.
    pub fn registers(&self) -> &[f64] {
        &self.machine.registers
    }

    /// The variables that function `k` depends on, ascending, each with the place of its derivative
    /// in `slopes`.
    pub fn derivatives(&self, k: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let list = self.program.derivatives(k);
        list.map(|(variable, slot)| (variable, self.places[slot] as usize))
    }

    /// Derivatives, see `derivatives`.
    pub fn slopes(&self) -> &[f64] {
        &self.machine.slopes
    }

    /// Computes values and derivatives.
    pub fn evaluate(&mut self, z: &[f64], u: &[f64], t: f64, how: Linearisation) {
        let Tape { program, machine, parts, groups, wild, .. } = self;
        let registers = &mut machine.registers[..];
        for &(k, a) in &self.leaves[0] {
            registers[k as usize] = z[a as usize];
        }
        for &(k, a) in &self.leaves[1] {
            registers[k as usize] = u[a as usize];
        }
        for &(k, _) in &self.leaves[2] {
            registers[k as usize] = t;
        }
        let mut limited = false;
        for group in groups {
            let wanted = Wanted { how, reach: machine.tangent };
            limited |= group.evaluate(&mut machine.numbers(), wanted, wild);
            if wild.is_empty() {
                continue;
            }
            for m in wild.drain(..) {
                group.lend(m, &mut machine.numbers());
                limited |= !machine.part(program, group.parts[m].clone(), how);
                group.take_back(m, &mut machine.numbers());
            }
        }
        for part in parts {
            if how == Linearisation::Careful && part.rests(&machine.registers, machine.tangent) {
                part.follow(&mut machine.registers, &machine.slopes);
                continue;
            }
            let exact = machine.part(program, part.code.clone(), how);
            part.keep(&machine.registers, exact && how != Linearisation::Held);
            limited |= !exact;
        }
        machine.limited = limited;
    }

    /// What is known of the last evaluation does not count any more.
    fn forget(&mut self) {
        self.groups.iter_mut().for_each(Group::forget);
        self.parts.iter_mut().for_each(|p| p.known = false);
    }

    /// Registers of constants, once for all.
    fn set_constants(&mut self) {
        for (register, i) in self.machine.registers.iter_mut().zip(&self.program.code) {
            if i.op == Op::Constant {
                *register = self.program.constants[i.args[0] as usize];
            }
        }
    }

    /// Sets functions without a finite value or slope to zero until the next evaluation; true if
    /// there are any.
    pub fn silence(&mut self) -> bool {
        let mut any = false;
        for k in 0..self.values.len() {
            let places: Vec<usize> = self.derivatives(k).map(|(_, place)| place).collect();
            let Machine { registers, slopes, .. } = &mut self.machine;
            let value = &mut registers[self.values[k] as usize];
            if !(value.is_finite() && places.iter().all(|&p| slopes[p].abs() < STEEPEST)) {
                *value = 0.0;
                places.iter().for_each(|&p| slopes[p] = 0.0);
                any = true;
            }
        }
        self.forget();
        any
    }
}

impl Machine {
    fn numbers(&mut self) -> Numbers<'_> {
        let Machine { registers, slopes, points, .. } = self;
        Numbers { registers, slopes, points }
    }

    /// Evaluates some instructions; true if all were linearised at their arguments.
    fn part(&mut self, program: &Program, code: Range<usize>, how: Linearisation) -> bool {
        self.limited = false;
        for k in code {
            self.registers[k] = self.instruction(program, &program.code[k], how);
        }
        !self.limited
    }

    /// Value of one instruction, and its slots.
    #[inline]
    fn instruction(&mut self, program: &Program, i: &Instruction, how: Linearisation) -> f64 {
        let r = &self.registers;
        let [a, b, c] = i.args.map(|a| a as usize);
        if i.linear {
            return match i.op {
                Op::Neg => -r[a],
                Op::Add => r[a] + r[b],
                Op::Sub => r[a] - r[b],
                Op::Mul => r[a] * r[b],
                _ => r[a] / r[b],
            };
        }
        let (value, partial) = match i.op.arity() {
            1 if i.op.limited() => self.limited_step(program, i, r[a], how),
            1 if i.op == Op::Depletion => {
                let c = &program.constants[b..];
                let (x, reach, unit) = (r[a], self.reach(how), c[1] * (1.0 - c[3]));
                let kept = &mut self.kept[i.keep as usize];
                one_d(kept.get(x, reach, unit, |x| curves::depletion(c, x)))
            }
            1 => one_d(unary(program, i, r[a])),
            2 => two_d(binary(i.op, r[a], r[b])),
            _ if r[a] != 0.0 => (r[b], [0.0, 1.0, 0.0]),
            _ if r[a] == 0.0 => (r[c], [0.0, 0.0, 1.0]),
            _ => (f64::NAN, [0.0; 3]),
        };
        self.chain(program, i, partial);
        value
    }

    /// Part of its unit within which a function is its tangent; exact values are exact.
    fn reach(&self, how: Linearisation) -> f64 {
        if how == Linearisation::Careful {
            self.tangent
        } else {
            0.0
        }
    }

    /// Slots of one instruction by the chain rule.
    fn chain(&mut self, program: &Program, i: &Instruction, partial: [f64; 3]) {
        let range = i.slots.0 as usize..i.slots.1 as usize;
        if range.is_empty() {
            return;
        }
        let bounded = |p: f64| if p.is_infinite() { STEEPEST.copysign(p) } else { p };
        let arity = i.op.arity();
        if arity == 1 {
            let a = bounded(partial[0]);
            // slots of arguments come before those of the instruction
            let (fed, slots) = self.slopes.split_at_mut(range.start);
            for (slope, feed) in slots.iter_mut().zip(&program.feeds[range]) {
                *slope = times(a, fed[feed[0] as usize]);
            }
            return;
        }
        let [a, b, c] = partial.map(bounded);
        if arity == 2 {
            for slot in range {
                let [fa, fb, _] = program.feeds[slot].map(|f| self.slopes[f as usize]);
                self.slopes[slot] = times(a, fa) + times(b, fb);
            }
            return;
        }
        for slot in range {
            let [fa, fb, fc] = program.feeds[slot].map(|f| self.slopes[f as usize]);
            self.slopes[slot] = times(a, fa) + times(b, fb) + times(c, fc);
        }
    }

    fn limited_step(
        &mut self,
        program: &Program,
        i: &Instruction,
        x: f64,
        how: Linearisation,
    ) -> (f64, [f64; 3]) {
        let at = i.limit as usize;
        let (old, knee) = (self.points[at], self.knees[at]);
        let constants =
            &program.constants[if i.op == Op::Junction { i.args[1] as usize } else { 0 }..];
        let unit = if i.op == Op::Junction { self.blunt * constants[1] } else { 1.0 };
        // at the edge of its domain a function has no tangent that could be held
        let edge = match i.op {
            Op::Ln | Op::Log10 | Op::Sqrt => 0.0,
            Op::Log1p => -1.0,
            _ => f64::NEG_INFINITY,
        };
        let point = match how {
            Linearisation::Held if old > edge => old,
            Linearisation::Exact => x,
            _ if x.is_nan() => x,
            _ => match i.op {
                Op::Junction => limit::junction(x, old, unit, knee),
                Op::Exp | Op::Expm1 => limit::exponential(x, old, 1.0, 0.0),
                Op::Sinh | Op::Cosh => limit::two_sided(x, old),
                // from next to zero Newton's method is back in a few steps
                Op::Sqrt if x > 0.0 => x,
                _ => limit::domain(x, old, edge),
            },
        };
        self.points[at] = point;
        let (value, slope) = match i.op {
            Op::Junction => {
                let reach = self.reach(how);
                let kept = &mut self.kept[i.keep as usize];
                kept.get(point, reach, unit, |x| curves::junction(constants[0], unit, x))
            }
            Op::Exp => {
                let e = point.exp();
                (e, e)
            }
            Op::Expm1 => (point.exp_m1(), point.exp()),
            Op::Ln => (point.ln(), 1.0 / point),
            Op::Log1p => (point.ln_1p(), 1.0 / (1.0 + point)),
            Op::Log10 => (point.log10(), std::f64::consts::LOG10_E / point),
            Op::Sqrt => (point.sqrt(), 0.5 / point.sqrt()),
            Op::Sinh => (point.sinh(), point.cosh()),
            _ => (point.cosh(), point.sinh()),
        };
        if point == x || x.is_nan() {
            return (value, [slope, 0.0, 0.0]);
        }
        if i.op == Op::Sqrt && x == 0.0 && how != Linearisation::Held {
            // the value is there, and what is less steep than its tangent leads away if necessary
            return (0.0, [slope, 0.0, 0.0]);
        }
        if (x - point).abs() > SAME * unit {
            self.limited = true;
        }
        (value + slope * (x - point), [slope, 0.0, 0.0])
    }
}

/// A product in which zero wins: a branch that is not taken may have no slope at all.
#[inline]
fn times(a: f64, b: f64) -> f64 {
    if a == 0.0 {
        0.0
    } else {
        a * b
    }
}

fn one_d((value, slope): (f64, f64)) -> (f64, [f64; 3]) {
    (value, [slope, 0.0, 0.0])
}

fn two_d((value, a, b): (f64, f64, f64)) -> (f64, [f64; 3]) {
    (value, [a, b, 0.0])
}

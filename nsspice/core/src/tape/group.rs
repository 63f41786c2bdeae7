//! Parts with the same instructions, each with its own variables and parameters: the elements of one
//! kind.  They are evaluated together, four at a time.

use super::block::Numbers;
use super::lanes::Lanes;
use super::limit;
use super::ops::Op;
use super::parts::{is_leaf, Part};
use super::program::{Instruction, Program};
use std::collections::HashMap;
use std::ops::Range;

/// The instructions that are known for several numbers at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Neg,
    Add,
    Sub,
    Mul,
    Div,
    Square,
    /// constants from here on: `Is, nVt, 1/nVt, Is/nVt, knee`
    Junction {
        at: u32,
        limit: u32,
    },
    /// constants from here on, see `depletion_constants`
    Depletion {
        at: u32,
    },
}

/// One instruction: registers of its arguments, its own register, its slots.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub kind: Kind,
    pub args: [u32; 2],
    pub out: u32,
    pub slots: (u32, u32),
}

/// Constants of a junction, and of a depletion layer.
const JUNCTION: usize = 5;
const DEPLETION: usize = 6;

/// What the members of a group have in common.  Registers: variables, then constants, then the
/// results of the steps.
#[derive(Clone, Debug, Default)]
pub(super) struct Shape {
    pub steps: Vec<Step>,
    pub variables: usize,
    pub constants: usize,
    pub limits: usize,
    /// slots that feed each slot; slot 0 is zero, then come the variables
    pub feeds: Vec<[u32; 2]>,
    /// registers that others read, and how far behind the first instruction of a part they stand
    pub outputs: Vec<(u32, u32)>,
    /// slots of their derivatives: of which output, by which variable
    pub slopes: Vec<(u32, u32, u32)>,
}

/// Members that are evaluated at once.
pub(super) const WIDE: usize = 4;

/// Parts of one shape, in blocks of four; the last one is repeated to fill the last block.
#[derive(Clone, Debug)]
pub(super) struct Group {
    pub shape: Shape,
    /// the parts: where their instructions stand
    pub parts: Vec<Range<usize>>,
    /// for each part in turn: slots of its derivatives, and places of its linearisation points, if it
    /// is evaluated alone
    slots: Vec<u32>,
    limits: Vec<u32>,
    /// for each block in turn: registers of its variables, and its constants
    pub inputs: Vec<[u32; WIDE]>,
    pub constants: Vec<Lanes<WIDE>>,
    /// over which distance each bends; zero: unknown
    pub unit: Vec<Lanes<WIDE>>,
    /// variables and outputs of the last evaluation, if they and the derivatives belong together
    pub at: Vec<Lanes<WIDE>>,
    pub values: Vec<Lanes<WIDE>>,
    pub known: Vec<bool>,
    /// where its outputs, derivatives and linearisation points stand
    pub results: usize,
    pub slopes: usize,
    pub points: usize,
    /// scratch
    pub registers: Vec<Lanes<WIDE>>,
    pub derivatives: Vec<Lanes<WIDE>>,
    pub before: Vec<Lanes<WIDE>>,
}

/// A part taken to pieces.
#[derive(Default)]
struct Pieces {
    code: Range<usize>,
    shape: Shape,
    /// tells shapes apart
    key: Vec<u32>,
    /// program's variable and register of each variable
    inputs: Vec<(usize, u32)>,
    constants: Vec<f64>,
    points: Vec<u32>,
    slopes: Vec<u32>,
}

impl Group {
    /// Groups the parts that can be evaluated together; the others stay alone.
    pub fn all(program: &Program, parts: Vec<Part>) -> (Vec<Group>, Vec<Part>) {
        let mut kinds: Vec<(Shape, Vec<Pieces>)> = Vec::new();
        let mut known: HashMap<Vec<u32>, usize> = HashMap::new();
        let mut alone = Vec::new();
        for part in parts {
            let Some(mut pieces) = Pieces::of(program, &part) else {
                alone.push(part);
                continue;
            };
            let place = *known.entry(std::mem::take(&mut pieces.key)).or_insert(kinds.len());
            if place == kinds.len() {
                kinds.push((std::mem::take(&mut pieces.shape), Vec::new()));
            }
            kinds[place].1.push(pieces);
        }
        let groups = kinds.into_iter().map(|(shape, list)| Group::new(program, shape, list));
        (groups.collect(), alone)
    }

    fn new(program: &Program, shape: Shape, list: Vec<Pieces>) -> Group {
        let blocks = list.len().div_ceil(WIDE);
        let member = |b: usize, i: usize| &list[(b * WIDE + i).min(list.len() - 1)];
        let zeros = |each: usize| vec![[0.0; WIDE]; blocks * each];
        let mut group = Group {
            inputs: (0..blocks)
                .flat_map(|b| (0..shape.variables).map(move |k| (b, k)))
                .map(|(b, k)| std::array::from_fn(|i| member(b, i).inputs[k].1))
                .collect(),
            constants: (0..blocks)
                .flat_map(|b| (0..shape.constants).map(move |k| (b, k)))
                .map(|(b, k)| std::array::from_fn(|i| member(b, i).constants[k]))
                .collect(),
            unit: zeros(1),
            at: zeros(shape.variables),
            values: zeros(shape.outputs.len()),
            known: vec![false; blocks],
            slots: list.iter().flat_map(|p| p.slopes.iter().copied()).collect(),
            limits: list.iter().flat_map(|p| p.points.iter().copied()).collect(),
            parts: list.iter().map(|p| p.code.clone()).collect(),
            results: 0,
            slopes: 0,
            points: 0,
            registers: vec![[0.0; WIDE]; shape.variables + shape.constants + shape.steps.len()],
            derivatives: vec![[0.0; WIDE]; shape.feeds.len()],
            before: vec![[0.0; WIDE]; shape.limits],
            shape,
        };
        group.set_blunt(program, 1.0);
        group
    }

    /// Numbers of outputs, derivatives and linearisation points.
    pub fn sizes(&self) -> [usize; 3] {
        let Shape { outputs, slopes, limits, .. } = &self.shape;
        [outputs.len(), slopes.len(), *limits].map(|each| self.known.len() * each * WIDE)
    }

    /// Where item `k` of `each` of member `m` stands, from the first on.
    fn place(m: usize, each: usize, k: usize) -> usize {
        (m / WIDE * each + k) * WIDE + m % WIDE
    }

    /// Tells where outputs (by their registers) and derivatives (by their slots) stand.
    pub fn places(&self, mut output: impl FnMut(u32, usize), mut slot: impl FnMut(u32, usize)) {
        let Shape { outputs, slopes, .. } = &self.shape;
        for (m, code) in self.parts.iter().enumerate() {
            for (k, out) in outputs.iter().enumerate() {
                let place = self.results + Group::place(m, outputs.len(), k);
                output(code.start as u32 + out.1, place);
            }
            for k in 0..slopes.len() {
                let place = self.slopes + Group::place(m, slopes.len(), k);
                slot(self.slots[m * slopes.len() + k], place);
            }
        }
    }

    /// The voltage units of junctions, multiplied by `factor`.
    pub fn set_blunt(&mut self, program: &Program, factor: f64) {
        let count = self.shape.constants;
        for b in 0..self.known.len() {
            for i in 0..WIDE {
                let code = self.parts[(b * WIDE + i).min(self.parts.len() - 1)].clone();
                self.unit[b][i] = Part::unit(program, code.clone(), factor);
                for (instruction, step) in program.code[code].iter().zip(&self.shape.steps) {
                    if let Kind::Junction { at, .. } = step.kind {
                        let c = &program.constants[instruction.args[1] as usize..];
                        let at = b * count + at as usize - self.shape.variables;
                        for (k, v) in junction_constants(c[0], factor * c[1]).iter().enumerate() {
                            self.constants[at + k][i] = *v;
                        }
                    }
                }
            }
        }
        self.forget();
    }

    /// What is known of the last evaluation does not count any more.
    pub fn forget(&mut self) {
        self.known.fill(false);
    }

    /// Sets the linearisation points to the knees of the junctions.
    pub fn point_at_knees(&mut self, points: &mut [f64]) {
        let own = points[self.points..].as_chunks_mut::<WIDE>().0;
        for b in 0..self.known.len() {
            for step in &self.shape.steps {
                if let Kind::Junction { at, limit } = step.kind {
                    let at = b * self.shape.constants + at as usize - self.shape.variables;
                    own[b * self.shape.limits + limit as usize] = self.constants[at + JUNCTION - 1];
                }
            }
        }
        self.forget();
    }

    /// Copies the linearisation points of a member to where it finds them if it is evaluated alone.
    pub fn lend(&self, m: usize, numbers: &mut Numbers) {
        let each = self.shape.limits;
        for (k, &limit) in self.limits[m * each..(m + 1) * each].iter().enumerate() {
            numbers.points[limit as usize] = numbers.points[self.points + Group::place(m, each, k)];
        }
    }

    /// Copies what came out of a member that was evaluated alone.
    pub fn take_back(&self, m: usize, numbers: &mut Numbers) {
        let each = self.shape.limits;
        for (k, &limit) in self.limits[m * each..(m + 1) * each].iter().enumerate() {
            numbers.points[self.points + Group::place(m, each, k)] = numbers.points[limit as usize];
        }
        let each = self.shape.outputs.len();
        for (k, out) in self.shape.outputs.iter().enumerate() {
            numbers.registers[self.results + Group::place(m, each, k)] =
                numbers.registers[self.parts[m].start + out.1 as usize];
        }
        let each = self.shape.slopes.len();
        for (k, &slot) in self.slots[m * each..(m + 1) * each].iter().enumerate() {
            numbers.slopes[self.slopes + Group::place(m, each, k)] = numbers.slopes[slot as usize];
        }
    }
}

impl Pieces {
    /// None if some instruction is not known for several numbers at a time.
    fn of(program: &Program, part: &Part) -> Option<Pieces> {
        let code = &program.code;
        let mut own = Pieces { code: part.code.clone(), ..Pieces::default() };
        let costly = |i: &Instruction| matches!(i.op, Op::Junction | Op::Depletion);
        let own_code = &code[part.code.clone()];
        if !own_code.iter().any(costly) {
            return None;
        }
        // variables and constants first, since results stand behind them
        for i in own_code {
            for &a in &i.args[..i.op.arity()] {
                match code[a as usize].op {
                    Op::Constant => {}
                    op if is_leaf(op) => {
                        own.variable(program, a);
                    }
                    _ => {}
                }
            }
        }
        own.shape.variables = own.inputs.len();
        let counts = own_code.iter().map(|i| {
            let leaves = i.args[..i.op.arity()].iter();
            let plain = leaves.filter(|&&a| code[a as usize].op == Op::Constant).count();
            plain
                + match i.op {
                    Op::Junction => JUNCTION,
                    Op::Depletion => DEPLETION,
                    _ => 0,
                }
        });
        own.shape.constants = counts.sum();
        own.key.extend([own.shape.variables, own.shape.constants].map(|count| count as u32));
        let first = own.shape.variables + own.shape.constants;
        // slots of each local register, by variable
        let mut slots: Vec<Vec<(usize, u32)>> = vec![Vec::new(); first];
        own.shape.feeds = vec![[0; 2]; 1 + own.shape.variables];
        for (v, slots) in slots[..own.shape.variables].iter_mut().enumerate() {
            slots.push((v, 1 + v as u32));
        }
        let mut local: HashMap<u32, u32> = HashMap::new();
        for (register, i) in (part.code.start as u32..).zip(own_code) {
            own.key.push(i.op as u32);
            let mut args = [0u32; 2];
            for (arg, &a) in args.iter_mut().zip(&i.args[..i.op.arity()]) {
                *arg = match code[a as usize].op {
                    Op::Constant => {
                        own.constant(program.constants[code[a as usize].args[0] as usize])
                    }
                    op if is_leaf(op) => own.variable(program, a),
                    _ => local[&a],
                };
                own.key.push(*arg);
            }
            let c = &program.constants;
            let kind = match i.op {
                Op::Neg => Kind::Neg,
                Op::Add => Kind::Add,
                Op::Sub => Kind::Sub,
                Op::Mul => Kind::Mul,
                Op::Div => Kind::Div,
                Op::Square => Kind::Square,
                Op::Junction => {
                    let c = &c[i.args[1] as usize..];
                    let at = own.several(&junction_constants(c[0], c[1]));
                    own.points.push(i.limit);
                    own.shape.limits += 1;
                    Kind::Junction { at, limit: own.shape.limits as u32 - 1 }
                }
                Op::Depletion => {
                    let c = &c[i.args[1] as usize..];
                    if !(0.0..1.0).contains(&c[3]) {
                        return None; // its formula has no value somewhere
                    }
                    Kind::Depletion { at: own.several(&depletion_constants(c)) }
                }
                _ => return None,
            };
            let start = own.shape.feeds.len() as u32;
            let lists = args.map(|a| &slots[a as usize][..]);
            let used = if i.op.arity() == 1 { [lists[0], &[]] } else { lists };
            let mut found = Vec::new();
            for v in 0..own.shape.variables {
                let feeds = used.map(|list| list.iter().find(|s| s.0 == v).map_or(0, |s| s.1));
                if feeds != [0, 0] {
                    found.push((v, own.shape.feeds.len() as u32));
                    own.shape.feeds.push(feeds);
                }
            }
            let out = slots.len() as u32;
            slots.push(found);
            local.insert(register, out);
            let end = own.shape.feeds.len() as u32;
            own.shape.steps.push(Step { kind, args, out, slots: (start, end) });
            let is_output = part.outputs.contains(&register);
            own.key.push(u32::from(is_output));
            if is_output {
                let behind = register - part.code.start as u32;
                own.shape.outputs.push((out, behind));
                let (first, last) = i.slots;
                for slot in first..last {
                    let variable = program.variables[slot as usize] as usize;
                    let v = own.inputs.iter().position(|input| input.0 == variable)?;
                    let place = slots[out as usize].iter().find(|s| s.0 == v)?.1;
                    own.slopes.push(slot);
                    let output = own.shape.outputs.len() as u32 - 1;
                    own.shape.slopes.push((place, output, v as u32));
                }
            }
        }
        // in the order of the shape, not of the program's variables
        let mut order: Vec<usize> = (0..own.slopes.len()).collect();
        order.sort_by_key(|&k| own.shape.slopes[k].0);
        own.slopes = order.iter().map(|&k| own.slopes[k]).collect();
        own.shape.slopes.sort_unstable();
        Some(own)
    }

    /// Local register of a variable.
    fn variable(&mut self, program: &Program, register: u32) -> u32 {
        let variable = program.variable_of(register);
        let known = self.inputs.iter().position(|input| input.0 == variable);
        known.unwrap_or_else(|| {
            self.inputs.push((variable, register));
            self.inputs.len() - 1
        }) as u32
    }

    /// Local register of a constant of its own.
    fn constant(&mut self, value: f64) -> u32 {
        self.several(&[value])
    }

    fn several(&mut self, values: &[f64]) -> u32 {
        self.constants.extend_from_slice(values);
        (self.shape.variables + self.constants.len() - values.len()) as u32
    }
}

fn junction_constants(saturation: f64, unit: f64) -> [f64; JUNCTION] {
    [saturation, unit, 1.0 / unit, saturation / unit, limit::knee(saturation, unit)]
}

/// `VJ, FC VJ, 1 - M, CJ0 VJ, CJ0, M / (VJ (1 - FC))`
fn depletion_constants(c: &[f64]) -> [f64; DEPLETION] {
    let (c0, vj, m, fc) = (c[0], c[1], c[2], c[3]);
    [vj, fc * vj, 1.0 - m, c0 * vj, c0, m / (vj * (1.0 - fc))]
}

//! Parts with the same instructions, each with its own variables and parameters: the elements of one
//! kind.  They are evaluated together, four at a time.

use super::block::Numbers;
use super::lanes::Lanes;
use super::limit;
use super::ops::Op;
use super::parts::{is_leaf, is_variable, Part};
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
    Abs,
    Uramp,
    Max,
    Min,
    /// a curve whose constants start here
    Shaped {
        op: Op,
        at: u32,
    },
    /// parameters from here on: `Is, nVt, 1/nVt, Is/nVt, knee`
    Junction {
        at: u32,
        limit: u32,
    },
    /// parameters from here on, see `depletion_constants`
    Depletion {
        at: u32,
    },
}

/// One instruction: registers of its arguments, its own register, its slots, and how far behind the
/// first instruction of a part it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub kind: Kind,
    pub args: [u32; 2],
    pub out: u32,
    pub slots: (u32, u32),
    pub behind: u32,
}

/// Parameters of a junction, its knee among them, and of a depletion layer.
pub(super) const JUNCTION: usize = 5;
const KNEE: usize = 4;
pub(super) const DEPLETION: usize = 6;
/// Instructions of the longest sum of variables that is taken for a voltage.
const LONGEST: usize = 64;
/// Constants of a shaped curve.
pub(super) const SHAPED: usize = 3;

/// What the members of a group have in common.  Registers: inputs, then constants, then the results
/// of the steps.
#[derive(Clone, Debug, Default)]
pub(super) struct Shape {
    pub steps: Vec<Step>,
    /// sums of variables: voltages; where the added and the subtracted terms of each end
    pub inputs: Vec<[u32; 2]>,
    pub constants: usize,
    pub parameters: usize,
    pub limits: usize,
    /// slots that feed each slot; slot 0 is zero, then come the inputs
    pub feeds: Vec<[u32; 2]>,
    /// registers that others read, and how far behind the first instruction of a part they are
    pub outputs: Vec<(u32, u32)>,
    /// slots of their derivatives: of which output, by which input
    pub links: Vec<(u32, u32, u32)>,
    /// derivatives by the variables: sums of links, each with its sign; where the next one begins
    pub shares: Vec<(u32, f64)>,
    pub slopes: Vec<u32>,
    /// nothing but one junction
    pub lone: bool,
}

/// Length of the frame of a junction alone, see `Shape::frame`.
pub(super) const LONE: usize = 4 + JUNCTION;

impl Shape {
    /// Whether `lone` is true.
    fn is_lone(&self) -> bool {
        let junction = matches!(self.steps[..], [Step { kind: Kind::Junction { .. }, .. }]);
        let plain = self.shares.len() == self.slopes.len();
        junction && plain && self.frame() == [1, 1, 1, 1, 0, JUNCTION]
    }

    /// What a block keeps: distance over which each member is curved, inputs and outputs of the last
    /// evaluation with their links, constants, parameters.
    pub fn frame(&self) -> [usize; 6] {
        let (outputs, links) = (self.outputs.len(), self.links.len());
        [1, self.inputs.len(), outputs, links, self.constants, self.parameters]
    }
}

/// Members that are evaluated together.
pub(super) const WIDE: usize = 4;

/// Parts of one shape, in blocks of four; the last one is repeated to fill the last block.
#[derive(Clone, Debug)]
pub(super) struct Group {
    pub shape: Shape,
    /// the parts: where their instructions are
    pub parts: Vec<Range<usize>>,
    /// for each part in turn: slots of its derivatives, and places of its linearisation points, if it
    /// is evaluated alone
    slots: Vec<u32>,
    limits: Vec<u32>,
    /// for each block in turn: registers of the terms of its inputs
    pub terms: Vec<[u32; WIDE]>,
    /// for each block in turn, see `Shape::frame`, and how long one is
    pub frames: Vec<Lanes<WIDE>>,
    pub frame: usize,
    /// inputs and outputs of a frame belong together
    pub known: Vec<bool>,
    /// where its outputs, derivatives and linearisation points are
    pub results: usize,
    pub slopes: usize,
    pub points: usize,
    /// scratch
    pub registers: Vec<Lanes<WIDE>>,
    pub derivatives: Vec<Lanes<WIDE>>,
    pub before: Vec<Lanes<WIDE>>,
}

/// What is added, and what is subtracted.
type Terms = [Vec<u32>; 2];

/// A part taken to pieces.
#[derive(Default)]
struct Pieces {
    code: Range<usize>,
    shape: Shape,
    /// distinguishes shapes
    key: Vec<u32>,
    /// program's variables, and registers, of the terminals
    terminals: Vec<(usize, u32)>,
    /// terminals that each input adds and subtracts
    inputs: Vec<Terms>,
    constants: Vec<f64>,
    parameters: Vec<f64>,
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
        // slots of the inputs by themselves are one, slot 0 is zero
        let mut derivatives = vec![[0.0; WIDE]; shape.feeds.len()];
        derivatives[1..=shape.inputs.len()].fill([1.0; WIDE]);
        let [unit, inputs, outputs, links, constants, parameters] = shape.frame();
        let fixed = unit + inputs + outputs + links;
        let size = fixed + constants + parameters;
        let mut frames = vec![[0.0; WIDE]; blocks * size];
        for (b, frame) in frames.chunks_exact_mut(size).enumerate() {
            for i in 0..WIDE {
                let own = member(b, i).constants.iter().chain(&member(b, i).parameters);
                frame[fixed..].iter_mut().zip(own).for_each(|(lanes, v)| lanes[i] = *v);
            }
        }
        let registers = |p: &Pieces| -> Vec<u32> {
            let terminals = p.inputs.iter().flatten().flatten();
            terminals.map(|&t| p.terminals[t as usize].1).collect()
        };
        let mut terms = Vec::new();
        for b in 0..blocks {
            let all: [Vec<u32>; WIDE] = std::array::from_fn(|i| registers(member(b, i)));
            terms.extend((0..all[0].len()).map(|k| std::array::from_fn(|i| all[i][k])));
        }
        let mut group = Group {
            derivatives,
            frames,
            frame: size,
            terms,
            known: vec![false; blocks],
            slots: list.iter().flat_map(|p| p.slopes.iter().copied()).collect(),
            limits: list.iter().flat_map(|p| p.points.iter().copied()).collect(),
            parts: list.iter().map(|p| p.code.clone()).collect(),
            results: 0,
            slopes: 0,
            points: 0,
            registers: vec![[0.0; WIDE]; inputs + constants + shape.steps.len()],
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

    /// Where item `k` of `each` of member `m` is, from the first on.
    fn place(m: usize, each: usize, k: usize) -> usize {
        (m / WIDE * each + k) * WIDE + m % WIDE
    }

    /// Sets where outputs (by their registers) and derivatives (by their slots) are.
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
        let parameters = self.frame - self.shape.parameters;
        for (b, frame) in self.frames.chunks_exact_mut(self.frame).enumerate() {
            for i in 0..WIDE {
                let code = self.parts[(b * WIDE + i).min(self.parts.len() - 1)].clone();
                frame[0][i] = Part::unit(program, code.clone(), factor);
                for step in &self.shape.steps {
                    if let Kind::Junction { at, .. } = step.kind {
                        let instruction = &program.code[code.start + step.behind as usize];
                        let c = &program.constants[instruction.args[1] as usize..];
                        let own = frame[parameters + at as usize..].iter_mut();
                        for (lanes, v) in own.zip(junction_constants(c[0], factor * c[1])) {
                            lanes[i] = v;
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
        let parameters = self.frame - self.shape.parameters;
        for (b, frame) in self.frames.chunks_exact(self.frame).enumerate() {
            for step in &self.shape.steps {
                if let Kind::Junction { at, limit } = step.kind {
                    let knee = frame[parameters + at as usize + KNEE];
                    own[b * self.shape.limits + limit as usize] = knee;
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
        let costly =
            |i: &Instruction| i.op.shaped() || matches!(i.op, Op::Junction | Op::Depletion);
        let own_code = &code[part.code.clone()];
        if !own_code.iter().any(costly) {
            return None;
        }
        // inputs and constants first, since results come after them
        let sums: Vec<_> = part.code.clone().map(|k| terms(program, k as u32, LONGEST)).collect();
        let sum = |a: u32| sums.get((a as usize).wrapping_sub(part.code.start))?.as_ref();
        for (k, i) in (part.code.start as u32..).zip(own_code) {
            if let Some(terms) = sum(k) {
                if part.outputs.contains(&k) {
                    own.input(program, terms);
                }
                continue;
            }
            for &a in &i.args[..i.op.arity()] {
                if let Some(terms) = sum(a) {
                    own.input(program, terms);
                } else if is_variable(code[a as usize].op) {
                    own.input(program, &[vec![a], vec![]]);
                }
            }
        }
        let inputs = own.inputs.len();
        let mut end = 0;
        for terms in &own.inputs {
            own.shape.inputs.push([end + terms[0].len() as u32, 0]);
            end += terms.iter().map(Vec::len).sum::<usize>() as u32;
            own.shape.inputs.last_mut().into_iter().for_each(|ends| ends[1] = end);
            own.key.extend(own.shape.inputs.last().into_iter().flatten());
            own.key.extend(terms.iter().flatten());
        }
        let leaves = own_code.iter().flat_map(|i| &i.args[..i.op.arity()]);
        own.shape.constants = leaves.filter(|&&a| code[a as usize].op == Op::Constant).count();
        own.key.extend([inputs, own.shape.constants].map(|count| count as u32));
        let first = inputs + own.shape.constants;
        // slots of each local register, by input
        let mut slots: Vec<Vec<(usize, u32)>> = vec![Vec::new(); first];
        own.shape.feeds = vec![[0; 2]; 1 + inputs];
        for (v, slots) in slots[..inputs].iter_mut().enumerate() {
            slots.push((v, 1 + v as u32));
        }
        let mut local: HashMap<u32, u32> = HashMap::new();
        for (register, i) in (part.code.start as u32..).zip(own_code) {
            own.key.push(i.op as u32);
            let behind = register - part.code.start as u32;
            if let Some(terms) = sum(register) {
                let voltage = own.known(program, terms);
                own.key.push(voltage.map_or(u32::MAX, |v| v as u32));
                if let Some(voltage) = voltage {
                    local.insert(register, voltage as u32);
                    own.output(program, part, register, voltage as u32, &slots)?;
                }
                continue;
            }
            let mut args = [0u32; 2];
            for (arg, &a) in args.iter_mut().zip(&i.args[..i.op.arity()]) {
                *arg = match code[a as usize].op {
                    Op::Constant => {
                        own.constant(program.constants[code[a as usize].args[0] as usize])
                    }
                    op if is_leaf(op) => own.input(program, &[vec![a], vec![]]),
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
                Op::Abs => Kind::Abs,
                Op::Uramp => Kind::Uramp,
                Op::Max => Kind::Max,
                Op::Min => Kind::Min,
                op if op.shaped() => {
                    let c = &c[i.args[1] as usize..];
                    let own_c: [f64; SHAPED] = std::array::from_fn(|k| *c.get(k).unwrap_or(&0.0));
                    Kind::Shaped { op, at: own.some(&own_c) }
                }
                Op::Junction => {
                    let c = &c[i.args[1] as usize..];
                    let at = own.some(&junction_constants(c[0], c[1]));
                    own.points.push(i.limit);
                    own.shape.limits += 1;
                    Kind::Junction { at, limit: own.shape.limits as u32 - 1 }
                }
                Op::Depletion => {
                    let c = &c[i.args[1] as usize..];
                    if !(0.0..1.0).contains(&c[3]) {
                        return None; // its formula has no value somewhere
                    }
                    Kind::Depletion { at: own.some(&depletion_constants(c)) }
                }
                _ => return None,
            };
            let start = own.shape.feeds.len() as u32;
            let lists = args.map(|a| &slots[a as usize][..]);
            let used = if i.op.arity() == 1 { [lists[0], &[]] } else { lists };
            let mut found = Vec::new();
            for v in 0..inputs {
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
            own.shape.steps.push(Step { kind, args, out, slots: (start, end), behind });
            own.output(program, part, register, out, &slots)?;
        }
        own.shape.lone = own.shape.is_lone();
        Some(own)
    }

    /// Notes the local register `out` of an instruction as an output if it is one, with its
    /// derivatives.
    fn output(
        &mut self,
        program: &Program,
        part: &Part,
        register: u32,
        out: u32,
        slots: &[Vec<(usize, u32)>],
    ) -> Option<()> {
        let is_output = part.outputs.contains(&register);
        self.key.push(u32::from(is_output));
        if !is_output {
            return Some(());
        }
        let (output, first) = (self.shape.outputs.len() as u32, self.shape.links.len());
        self.shape.outputs.push((out, register - part.code.start as u32));
        let own = slots[out as usize].iter();
        self.shape.links.extend(own.map(|&(v, place)| (place, output, v as u32)));
        let (mut begin, end) = program.code[register as usize].slots;
        for (t, &(variable, _)) in (0..).zip(&self.terminals) {
            let before = self.shape.shares.len();
            for (k, link) in self.shape.links.iter().enumerate().skip(first) {
                let signs = self.inputs[link.2 as usize].iter().zip([1.0, -1.0]);
                let shares = signs.filter(|side| side.0.contains(&t));
                self.shape.shares.extend(shares.map(|side| (k as u32, side.1)));
            }
            if self.shape.shares.len() > before {
                let is = |slot: &u32| program.variables[*slot as usize] as usize == variable;
                self.slopes.push((program.code[register as usize].slots.0..end).find(is)?);
                self.shape.slopes.push(self.shape.shares.len() as u32);
                begin += 1;
            }
        }
        (begin == end).then_some(())
    }

    /// The input that a sum of variables, given by their registers, is already.
    fn known(&self, program: &Program, registers: &Terms) -> Option<usize> {
        let terminal = |&register: &u32| {
            let variable = program.variable_of(register);
            self.terminals.iter().position(|t| t.0 == variable).map(|t| t as u32)
        };
        let [plus, minus] = registers;
        let side = |list: &[u32]| list.iter().map(terminal).collect::<Option<Vec<u32>>>();
        let terms = [side(plus)?, side(minus)?];
        self.inputs.iter().position(|input| *input == terms)
    }

    /// Local register of a sum of variables.
    fn input(&mut self, program: &Program, registers: &Terms) -> u32 {
        if let Some(known) = self.known(program, registers) {
            return known as u32;
        }
        let mut terminal = |&register: &u32| {
            let variable = program.variable_of(register);
            let known = self.terminals.iter().position(|t| t.0 == variable);
            known.unwrap_or_else(|| {
                self.terminals.push((variable, register));
                self.terminals.len() - 1
            }) as u32
        };
        let [plus, minus] = registers;
        let mut side = |list: &[u32]| list.iter().map(&mut terminal).collect::<Vec<u32>>();
        self.inputs.push([side(plus), side(minus)]);
        self.inputs.len() as u32 - 1
    }

    /// Local register of a constant of its own.
    fn constant(&mut self, value: f64) -> u32 {
        self.constants.push(value);
        (self.inputs.len() + self.constants.len() - 1) as u32
    }

    /// Where some parameters of its own begin.
    fn some(&mut self, values: &[f64]) -> u32 {
        self.parameters.extend_from_slice(values);
        self.shape.parameters = self.parameters.len();
        (self.parameters.len() - values.len()) as u32
    }
}

/// The registers of the variables that an instruction adds and subtracts; None if it does anything else, or with
/// more than `left` others.
fn terms(program: &Program, register: u32, left: usize) -> Option<Terms> {
    let i = program.code.get(register as usize)?;
    let left = left.checked_sub(1)?;
    let of = |a: u32| match program.code[a as usize].op {
        op if is_variable(op) => Some([vec![a], vec![]]),
        _ => terms(program, a, left),
    };
    let ([mut plus, mut minus], [more, less]) = match i.op {
        Op::Neg => ([vec![], vec![]], of(i.args[0]).map(|[plus, minus]| [minus, plus])?),
        Op::Add => (of(i.args[0])?, of(i.args[1])?),
        Op::Sub => (of(i.args[0])?, of(i.args[1]).map(|[plus, minus]| [minus, plus])?),
        _ => return None,
    };
    plus.extend(more);
    minus.extend(less);
    let mut variables: Vec<usize> =
        plus.iter().chain(&minus).map(|&a| program.variable_of(a)).collect();
    variables.sort_unstable();
    let apart = variables.windows(2).all(|pair| pair[0] != pair[1]);
    apart.then_some([plus, minus])
}

fn junction_constants(saturation: f64, unit: f64) -> [f64; JUNCTION] {
    [saturation, unit, 1.0 / unit, saturation / unit, limit::knee(saturation, unit)]
}

/// `VJ, FC VJ, 1 - M, CJ0 VJ, CJ0, M / (VJ (1 - FC))`
fn depletion_constants(c: &[f64]) -> [f64; DEPLETION] {
    let (c0, vj, m, fc) = (c[0], c[1], c[2], c[3]);
    [vj, fc * vj, 1.0 - m, c0 * vj, c0, m / (vj * (1.0 - fc))]
}

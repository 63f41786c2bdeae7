//! Parts with the same instructions, each with its own variables and parameters: the elements of one
//! kind.  They are evaluated together, several at a time.

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
    /// constants from here on: `Is, nVt, Is/nVt, knee`
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
const JUNCTION: usize = 4;
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
    /// registers that others read, and how far behind the first result of a member they stand
    pub outputs: Vec<(u32, u32)>,
    /// slots of their derivatives: of which output, by which variable
    pub slopes: Vec<(u32, u32, u32)>,
}

/// Parts of one shape.
#[derive(Clone, Debug)]
pub(super) struct Group {
    pub shape: Shape,
    /// the parts: where their instructions stand, and over which distances they bend
    pub parts: Vec<(Range<usize>, f64)>,
    /// for each in turn: registers of its variables, its constants, places of its linearisation
    /// points, slots of its derivatives
    pub inputs: Vec<u32>,
    pub constants: Vec<f64>,
    pub points: Vec<u32>,
    pub slopes: Vec<u32>,
    /// all have the same constants
    pub alike: bool,
    /// for each in turn: variables and outputs of its last evaluation, if they and its slots belong
    /// together
    pub at: Vec<f64>,
    pub values: Vec<f64>,
    pub known: Vec<bool>,
    /// members to evaluate, and scratch
    pub active: Vec<u32>,
    pub registers: Vec<f64>,
    pub derivatives: Vec<f64>,
    pub moved: Vec<f64>,
}

/// A part taken to pieces.
#[derive(Default)]
struct Pieces {
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
        let mut groups: Vec<Group> = Vec::new();
        let mut known: HashMap<Vec<u32>, usize> = HashMap::new();
        let mut alone = Vec::new();
        for part in parts {
            let Some(mut pieces) = Pieces::of(program, &part) else {
                alone.push(part);
                continue;
            };
            let place = *known.entry(std::mem::take(&mut pieces.key)).or_insert(groups.len());
            if place == groups.len() {
                groups.push(Group::new(std::mem::take(&mut pieces.shape)));
            }
            let group = &mut groups[place];
            group.parts.push((part.code.clone(), part.unit));
            group.known.push(false);
            group.at.resize(group.at.len() + group.shape.variables, 0.0);
            group.values.resize(group.values.len() + group.shape.outputs.len(), 0.0);
            group.inputs.extend(pieces.inputs.iter().map(|i| i.1));
            group.constants.extend(pieces.constants);
            group.points.extend(pieces.points);
            group.slopes.extend(pieces.slopes);
        }
        for group in &mut groups {
            group.set_blunt(program, 1.0);
        }
        (groups, alone)
    }

    fn new(shape: Shape) -> Group {
        let results = shape.variables + shape.constants + shape.steps.len();
        let widest = super::block::WIDEST;
        Group {
            registers: vec![0.0; results * widest],
            derivatives: vec![0.0; shape.feeds.len() * widest],
            moved: vec![0.0; shape.variables.max(shape.limits * widest)],
            shape,
            parts: Vec::new(),
            inputs: Vec::new(),
            constants: Vec::new(),
            points: Vec::new(),
            slopes: Vec::new(),
            alike: false,
            at: Vec::new(),
            values: Vec::new(),
            known: Vec::new(),
            active: Vec::new(),
        }
    }

    /// The voltage units of junctions, multiplied by `factor`.
    pub fn set_blunt(&mut self, program: &Program, factor: f64) {
        let count = self.shape.constants;
        let members = self.parts.iter_mut().zip(self.constants.chunks_exact_mut(count));
        for ((code, unit), constants) in members {
            *unit = Part::unit(program, code.clone(), factor);
            for (instruction, step) in program.code[code.clone()].iter().zip(&self.shape.steps) {
                if let Kind::Junction { at, .. } = step.kind {
                    let c = &program.constants[instruction.args[1] as usize..];
                    let own = junction_constants(c[0], factor * c[1]);
                    let at = at as usize - self.shape.variables;
                    constants[at..at + JUNCTION].copy_from_slice(&own);
                }
            }
        }
        let first = &self.constants[..count];
        self.alike = self.constants.chunks_exact(count).all(|c| c == first);
        self.forget();
    }

    /// What is known of the last evaluation does not count any more.
    pub fn forget(&mut self) {
        self.known.fill(false);
    }

    /// Lists the members that are not their tangents, within `reach` of their units; the others move
    /// along them.
    pub fn rouse(&mut self, registers: &mut [f64], slopes: &[f64], reach: f64) {
        let Shape { variables: v, outputs, slopes: links, .. } = &self.shape;
        let (o, s) = (outputs.len(), links.len());
        self.active.clear();
        for (m, (code, unit)) in self.parts.iter().enumerate() {
            let far = reach * unit;
            let inputs = &self.inputs[m * v..(m + 1) * v];
            let at = &self.at[m * v..(m + 1) * v];
            let mut near = self.known[m];
            for ((&i, at), moved) in inputs.iter().zip(at).zip(&mut self.moved) {
                *moved = registers[i as usize] - at;
                near &= moved.abs() <= far;
            }
            if !near {
                self.active.push(m as u32);
                continue;
            }
            let results = &mut registers[code.clone()];
            for (value, out) in self.values[m * o..(m + 1) * o].iter().zip(outputs) {
                results[out.1 as usize] = *value;
            }
            for (&slot, &(_, out, k)) in self.slopes[m * s..(m + 1) * s].iter().zip(links) {
                results[out as usize] += slopes[slot as usize] * self.moved[k as usize];
            }
        }
    }

    /// Lists all members.
    pub fn rouse_all(&mut self) {
        self.active.clear();
        self.active.extend(0..self.parts.len() as u32);
    }

    /// Keeps the point of an evaluation of a member.
    pub fn keep(&mut self, m: usize, registers: &[f64], exact: bool) {
        let (v, o) = (self.shape.variables, self.shape.outputs.len());
        let (code, unit) = &self.parts[m];
        self.known[m] = exact && *unit > 0.0;
        let inputs = self.inputs[m * v..].iter();
        for (at, &i) in self.at[m * v..(m + 1) * v].iter_mut().zip(inputs) {
            *at = registers[i as usize];
        }
        let outputs = self.values[m * o..(m + 1) * o].iter_mut().zip(&self.shape.outputs);
        for (value, out) in outputs {
            *value = registers[code.start + out.1 as usize];
        }
    }
}

impl Pieces {
    /// None if some instruction is not known for several numbers at a time.
    fn of(program: &Program, part: &Part) -> Option<Pieces> {
        let code = &program.code;
        let mut own = Pieces::default();
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
                    own.shape.slopes.push((place, behind, v as u32));
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
    [saturation, unit, saturation / unit, limit::knee(saturation, unit)]
}

/// `VJ, FC VJ, 1 - M, CJ0 VJ, CJ0, M / (VJ (1 - FC))`
fn depletion_constants(c: &[f64]) -> [f64; DEPLETION] {
    let (c0, vj, m, fc) = (c[0], c[1], c[2], c[3]);
    [vj, fc * vj, 1.0 - m, c0 * vj, c0, m / (vj * (1.0 - fc))]
}

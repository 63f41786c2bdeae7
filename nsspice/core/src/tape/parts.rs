//! Parts of a program that share no instruction: the elements of a circuit.
//!
//! Most elements of a large circuit rest while some move.  A part whose variables are where they were
//! at its last evaluation, up to a small part of the distance over which it is curved, is its tangent.

use super::ops::Op;
use super::program::{Instruction, Program};
use crate::union_find::UnionFind;
use std::ops::Range;

/// A part and what it was at its last evaluation.
#[derive(Clone, Debug)]
pub(super) struct Part {
    /// its instructions, one after the other
    pub code: Range<usize>,
    /// registers of the variables it depends on, and where they were
    pub variables: Vec<u32>,
    at: Vec<f64>,
    /// registers that others read, and their values
    pub outputs: Vec<u32>,
    values: Vec<f64>,
    /// derivatives of the outputs: register, slot, and which of the variables
    links: Vec<(u32, u32, u32)>,
    /// registers of the arguments of what is curved, and over which distance each does; empty: unknown
    bends: Vec<(u32, f64)>,
    /// distance over which it is curved by the size of what was least at its last evaluation
    least: f64,
    /// `at`, `values` and the slots belong together
    pub known: bool,
}

/// Instructions that depend on nothing else.
pub(super) fn is_leaf(op: Op) -> bool {
    matches!(op, Op::Constant | Op::Unknown | Op::Source | Op::Time)
}

/// Leaves that change.
pub(super) fn is_variable(op: Op) -> bool {
    is_leaf(op) && op != Op::Constant
}

/// The first instruction of the part of each instruction; leaves belong to none.
fn roots(program: &Program) -> Vec<usize> {
    let code = &program.code;
    let mut parts = UnionFind::new(code.len());
    for (k, i) in code.iter().enumerate().filter(|(_, i)| !is_leaf(i.op)) {
        for &a in &i.args[..i.op.arity()] {
            if !is_leaf(code[a as usize].op) {
                let (a, b) = (parts.root(a as usize), parts.root(k));
                parts.join(a.max(b), a.min(b));
            }
        }
    }
    (0..code.len()).map(|k| parts.root(k)).collect()
}

/// An order of the instructions: leaves first, then one part after the other.
pub(super) fn order(program: &Program) -> Vec<usize> {
    let (code, roots) = (&program.code, roots(program));
    let mut order: Vec<usize> = (0..code.len()).collect();
    order.sort_by_key(|&k| if is_leaf(code[k].op) { (false, k) } else { (true, roots[k]) });
    order
}

impl Part {
    /// The parts of a program in which they come one after the other.
    pub fn all(program: &Program) -> Vec<Part> {
        let code = &program.code;
        let mut output = vec![false; code.len()];
        program.outputs.iter().for_each(|&k| output[k as usize] = true);
        let mut parts: Vec<Part> = Vec::new();
        for (k, root) in roots(program).into_iter().enumerate() {
            if is_leaf(code[k].op) {
                continue;
            }
            if k == root {
                parts.push(Part {
                    code: k..k,
                    variables: Vec::new(),
                    at: Vec::new(),
                    outputs: Vec::new(),
                    values: Vec::new(),
                    links: Vec::new(),
                    bends: Vec::new(),
                    least: 0.0,
                    known: false,
                });
            }
            let Some(part) = parts.last_mut() else { continue };
            part.code.end = k + 1;
            let leaves = code[k].args[..code[k].op.arity()].iter();
            part.variables.extend(leaves.filter(|&&a| is_variable(code[a as usize].op)));
            if output[k] {
                part.outputs.push(k as u32);
            }
        }
        for part in &mut parts {
            part.variables.sort_unstable();
            part.variables.dedup();
            part.at = vec![0.0; part.variables.len()];
            part.values = vec![0.0; part.outputs.len()];
            for &out in &part.outputs {
                let (start, end) = code[out as usize].slots;
                for slot in start..end {
                    let variable = program.variables[slot as usize] as usize;
                    let place = |&v: &u32| program.variable_of(v) == variable;
                    part.links.extend(
                        part.variables.iter().position(place).map(|k| (out, slot, k as u32)),
                    );
                }
            }
            part.measure(program, 1.0);
        }
        parts
    }

    /// Sets the distances over which the part is curved, the unit of junctions multiplied by `blunt`.
    pub fn measure(&mut self, program: &Program, blunt: f64) {
        self.known = false;
        let code = program.code[self.code.clone()].iter();
        let all = code.map(|i| (i.args[0], bends_over(program, i, blunt)));
        self.bends = all.filter(|(_, unit)| unit.is_finite()).collect();
        if self.bends.iter().any(|(_, unit)| *unit <= 0.0) {
            self.bends.clear();
        }
    }

    /// The distance over which some instructions are curved; zero: unknown.
    pub fn unit(program: &Program, code: Range<usize>, blunt: f64) -> f64 {
        let units = program.code[code].iter().map(|i| bends_over(program, i, blunt));
        let unit = units.fold(f64::INFINITY, f64::min);
        // linear parts cost less than the question
        if unit.is_finite() {
            unit
        } else {
            0.0
        }
    }

    /// Whether the part is its tangent: it has moved by less than `reach` of the distance over which it
    /// is curved by as much as it is large.
    pub fn rests(&self, registers: &[f64], reach: f64) -> bool {
        let far = reach * self.least;
        let near = |(&v, at): (&u32, &f64)| (registers[v as usize] - at).abs() <= far;
        self.known && self.variables.iter().zip(&self.at).all(near)
    }

    /// Writes the outputs by the tangent.
    pub fn follow(&self, registers: &mut [f64], slopes: &[f64]) {
        for (&out, &value) in self.outputs.iter().zip(&self.values) {
            registers[out as usize] = value;
        }
        for &(out, slot, k) in &self.links {
            let k = k as usize;
            let moved = registers[self.variables[k] as usize] - self.at[k];
            registers[out as usize] += slopes[slot as usize] * moved;
        }
    }

    /// Keeps the point of an evaluation.
    pub fn keep(&mut self, registers: &[f64], exact: bool) {
        self.known = exact && !self.bends.is_empty();
        if self.known {
            let bends = self.bends.iter().map(|&(a, unit)| bent(unit, registers[a as usize]));
            self.least = bends.fold(f64::INFINITY, f64::min).sqrt();
            for (at, &v) in self.at.iter_mut().zip(&self.variables) {
                *at = registers[v as usize];
            }
            for (value, &k) in self.values.iter_mut().zip(&self.outputs) {
                *value = registers[k as usize];
            }
        }
    }
}

/// Square of the change of an argument over which a function departs from its tangent by about its own
/// size: near zero, where charges and currents of junctions vanish, that is less than their unit.
#[inline]
pub(super) fn bent(unit: f64, argument: f64) -> f64 {
    let size = argument.abs();
    unit * if size < unit { size } else { unit }
}

/// The change of its argument over which an instruction departs from its tangent by about what it
/// is far from zero; infinite for linear ones, zero where nothing is known.
fn bends_over(program: &Program, i: &Instruction, blunt: f64) -> f64 {
    let constant = |k: usize| program.code[i.args[k] as usize].op == Op::Constant;
    match i.op {
        Op::Junction => blunt * program.constants[i.args[1] as usize + 1],
        Op::Depletion => {
            let c = &program.constants[i.args[1] as usize..];
            c[1] * (1.0 - c[3])
        }
        Op::Softplus | Op::Body => program.constants[i.args[1] as usize],
        Op::GateDrain => 1.0 / program.constants[i.args[1] as usize + 2],
        Op::Neg | Op::Add | Op::Sub => f64::INFINITY,
        Op::Mul if constant(0) || constant(1) => f64::INFINITY,
        Op::Div if constant(1) => f64::INFINITY,
        _ => 0.0,
    }
}

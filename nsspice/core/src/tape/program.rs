//! A checked tape with the sparsity of its derivatives.

use super::ops::Op;
use super::parts::{is_leaf, order};

/// One instruction: code, arguments, and where its derivatives are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instruction {
    pub op: Op,
    /// registers, or indices of constants, unknowns, sources
    pub args: [u32; 3],
    /// range of its slots
    pub slots: (u32, u32),
    /// which limited instruction it is
    pub limit: u32,
    /// where its last value is kept
    pub keep: u32,
    /// a linear function of the variables: its slots never change
    pub linear: bool,
}

/// The slot that always holds the derivative 0.
pub(super) const ZERO: u32 = 0;

/// A straight-line program of functions of the unknowns z, the sources u and the time.
///
/// Variables are counted through: unknowns, then sources, then the time.
#[derive(Clone, Debug)]
pub struct Program {
    pub(super) code: Vec<Instruction>,
    pub(super) constants: Vec<f64>,
    pub(super) outputs: Vec<u32>,
    /// variable of each slot
    pub(super) variables: Vec<u32>,
    /// slots of the arguments that feed each slot
    pub(super) feeds: Vec<[u32; 3]>,
    /// number of instructions with a linearisation point of their own
    pub(super) limited: usize,
    /// number of instructions whose last value is kept
    pub(super) kept: usize,
    /// variables
    pub(super) leaves: Vec<u32>,
    unknowns: usize,
    sources: usize,
}

impl Program {
    /// Checks a tape over `unknowns` and `sources`.
    pub fn new(
        ops: &[u8],
        args: &[[i32; 3]],
        constants: &[f64],
        outputs: &[i32],
        unknowns: usize,
        sources: usize,
    ) -> Result<Program, String> {
        if ops.len() != args.len() {
            return Err("a tape needs one row of arguments per instruction".into());
        }
        let mut program = Program::empty(constants, unknowns, sources);
        for (k, (&code, args)) in ops.iter().zip(args).enumerate() {
            let op = Op::from_code(code).ok_or(format!("instruction {k} has the code {code}"))?;
            program.add(k, op, args)?;
        }
        for &register in outputs {
            let register = usize::try_from(register).unwrap_or(usize::MAX);
            if register >= ops.len() {
                return Err(format!("an output is register {register} of {}", ops.len()));
            }
            program.outputs.push(register as u32);
        }
        program.arranged()
    }

    fn empty(constants: &[f64], unknowns: usize, sources: usize) -> Program {
        Program {
            code: Vec::new(),
            constants: constants.to_vec(),
            outputs: Vec::new(),
            variables: vec![u32::MAX],
            feeds: vec![[ZERO; 3]],
            limited: 0,
            kept: 0,
            leaves: Vec::new(),
            unknowns,
            sources,
        }
    }

    /// The same with the instructions of each part behind each other.
    fn arranged(self) -> Result<Program, String> {
        let order = order(&self);
        let mut place = vec![0u32; order.len()];
        let mut program = Program::empty(&self.constants, self.unknowns, self.sources);
        for (k, &old) in order.iter().enumerate() {
            place[old] = k as u32;
            let i = &self.code[old];
            let mut args = i.args;
            args[..i.op.arity()].iter_mut().for_each(|a| *a = place[*a as usize]);
            program.add(k, i.op, &args.map(|a| a as i32))?;
        }
        program.outputs = self.outputs.iter().map(|&k| place[k as usize]).collect();
        Ok(program)
    }

    fn add(&mut self, k: usize, op: Op, args: &[i32; 3]) -> Result<(), String> {
        let wrong = |what: &str| format!("instruction {k} of the tape refers to {what}");
        let mut own = [0u32; 3];
        for (own, &arg) in own.iter_mut().zip(args) {
            *own = u32::try_from(arg).map_err(|_| wrong("a negative index"))?;
        }
        let index = own[0] as usize;
        let arity = op.arity();
        if own[..arity].iter().any(|&a| a as usize >= k) {
            return Err(wrong("a later register"));
        }
        let start = self.variables.len() as u32;
        match op {
            Op::Constant if index >= self.constants.len() => {
                return Err(wrong("a missing constant"))
            }
            Op::Unknown if index >= self.unknowns => return Err(wrong("a missing unknown")),
            Op::Source if index >= self.sources => return Err(wrong("a missing source")),
            op if op.shaped()
                || matches!(op, Op::Junction | Op::Depletion | Op::Table | Op::Staircase) =>
            {
                self.check_constants(op, own[1] as usize)
                    .ok_or_else(|| wrong("wrong constants"))?;
            }
            _ => {}
        }
        match op {
            Op::Unknown => self.variable(index),
            Op::Source => self.variable(self.unknowns + index),
            Op::Time => self.variable(self.time_variable()),
            _ if op.flat() => {}
            // the condition chooses, it adds no slope
            Op::If => self.merge(&[None, Some(own[1]), Some(own[2])]),
            _ => {
                let mut list = [None; 3];
                for (item, &arg) in list.iter_mut().zip(&own[..arity]) {
                    *item = Some(arg);
                }
                self.merge(&list);
            }
        }
        let (limit, keep) = (self.limited as u32, self.kept as u32);
        self.limited += usize::from(op.limited());
        self.kept += usize::from(op.limited() || op == Op::Depletion);
        let linear = self.is_linear(op, &own);
        if is_leaf(op) && op != Op::Constant {
            self.leaves.push(k as u32);
        }
        let slots = (start, self.variables.len() as u32);
        self.code.push(Instruction { op, args: own, slots, limit, keep, linear });
        Ok(())
    }

    fn is_linear(&self, op: Op, args: &[u32; 3]) -> bool {
        let linear = |k: usize| self.code[args[k] as usize].linear;
        let constant = |k: usize| self.code[args[k] as usize].op == Op::Constant;
        match op {
            Op::Constant | Op::Unknown | Op::Source | Op::Time => true,
            Op::Neg => linear(0),
            Op::Add | Op::Sub => linear(0) && linear(1),
            Op::Mul => linear(0) && linear(1) && (constant(0) || constant(1)),
            Op::Div => linear(0) && constant(1),
            _ => false,
        }
    }

    /// The constants of an instruction that carries some are complete and make sense.
    fn check_constants(&self, op: Op, at: usize) -> Option<()> {
        let c = self.constants.get(at..)?;
        let fine = match op {
            Op::Junction => c.len() >= 2 && c[1] > 0.0,
            Op::Depletion => c.len() >= 4 && c[1] > 0.0,
            Op::Softplus | Op::Body => !c.is_empty() && c[0] > 0.0,
            Op::GateDrain => c.len() >= 3 && c[2] > 0.0,
            _ => {
                let count = *c.first()?;
                let whole = count >= 1.0 && count.fract() == 0.0 && c.len() as f64 > 2.0 * count;
                whole && {
                    let points = &c[1..=2 * count as usize];
                    points.chunks(2).zip(points.chunks(2).skip(1)).all(|(a, b)| a[0] <= b[0])
                }
            }
        };
        fine.then_some(())
    }

    fn variable(&mut self, index: usize) {
        self.variables.push(index as u32);
        self.feeds.push([ZERO; 3]);
    }

    /// Slots for the union of the variables of some registers.
    fn merge(&mut self, registers: &[Option<u32>; 3]) {
        let ranges = registers.map(|r| r.map_or((0, 0), |r| self.code[r as usize].slots));
        let mut next = ranges.map(|r| r.0);
        loop {
            let ahead =
                |k: usize| (next[k] < ranges[k].1).then(|| self.variables[next[k] as usize]);
            let Some(variable) = (0..3).filter_map(ahead).min() else { return };
            let mut feed = [ZERO; 3];
            for k in 0..3 {
                if next[k] < ranges[k].1 && self.variables[next[k] as usize] == variable {
                    feed[k] = next[k];
                    next[k] += 1;
                }
            }
            self.variables.push(variable);
            self.feeds.push(feed);
        }
    }

    /// Number of functions.
    pub fn len(&self) -> usize {
        self.outputs.len()
    }

    /// True if there are no functions.
    pub fn is_empty(&self) -> bool {
        self.outputs.is_empty()
    }

    /// Whether the slope of some function may be infinite where it has a value: of roots, and of powers below one.
    pub fn may_be_upright(&self) -> bool {
        let constant = |register: u32| {
            let i = &self.code[register as usize];
            (i.op == Op::Constant).then(|| self.constants[i.args[0] as usize])
        };
        self.code.iter().any(|i| match i.op {
            Op::Sqrt | Op::Asin | Op::Acos => true,
            Op::Pow | Op::Pwr => constant(i.args[1]).is_none_or(|power| power.abs() < 1.0),
            _ => false,
        })
    }

    /// Whether some instruction has a kink or a jump.
    pub fn has_kinks(&self) -> bool {
        self.code.iter().any(|i| i.op.kinked())
    }

    /// The least thermal voltage `nVt` of a junction [V]; infinite without any.
    pub fn sharpest(&self) -> f64 {
        let junctions = self.code.iter().filter(|i| i.op == Op::Junction);
        let units = junctions.map(|i| self.constants[i.args[1] as usize + 1]);
        units.fold(f64::INFINITY, f64::min)
    }

    /// Number of sources.
    pub fn sources(&self) -> usize {
        self.sources
    }

    /// The variable that is the time.
    pub fn time_variable(&self) -> usize {
        self.unknowns + self.sources
    }

    /// The variable in a register that holds one.
    pub(super) fn variable_of(&self, register: u32) -> usize {
        let i = &self.code[register as usize];
        match i.op {
            Op::Unknown => i.args[0] as usize,
            Op::Source => self.unknowns + i.args[0] as usize,
            _ => self.time_variable(),
        }
    }

    /// The variables that function `k` depends on, ascending, each with the slot of its derivative.
    pub fn derivatives(&self, k: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let (start, end) = self.code[self.outputs[k] as usize].slots;
        (start as usize..end as usize).map(|slot| (self.variables[slot] as usize, slot))
    }
}

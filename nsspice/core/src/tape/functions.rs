//! Instructions of one and two arguments: values and slopes.

use super::curves;
use super::ops::Op;
use super::program::{Instruction, Program};

fn truth(condition: bool) -> f64 {
    f64::from(u8::from(condition))
}

/// Rounding to the even neighbour of two, as in the front end.
fn nint(x: f64) -> f64 {
    x.round_ties_even()
}

/// Value and slope.
pub(super) fn unary(program: &Program, i: &Instruction, x: f64) -> (f64, f64) {
    use Op::*;
    let constants = |i: &Instruction| &program.constants[i.args[1] as usize..];
    match i.op {
        Neg => (-x, -1.0),
        Inv => (1.0 / x, -1.0 / (x * x)),
        Not => (truth(x == 0.0), 0.0),
        Abs => (x.abs(), if x < 0.0 { -1.0 } else { 1.0 }),
        Sin => (x.sin(), x.cos()),
        Cos => (x.cos(), -x.sin()),
        Tan => {
            let t = x.tan();
            (t, 1.0 + t * t)
        }
        // (1 - x)(1 + x) keeps the digits that 1 - x^2 loses near one
        Asin => (x.asin(), 1.0 / ((1.0 - x) * (1.0 + x)).sqrt()),
        Acos => (x.acos(), -1.0 / ((1.0 - x) * (1.0 + x)).sqrt()),
        Atan => (x.atan(), 1.0 / (1.0 + x * x)),
        Tanh => {
            let c = x.cosh();
            (x.tanh(), 1.0 / (c * c))
        }
        Asinh => (asinh(x), 1.0 / x.hypot(1.0)),
        Acosh => (acosh(x), 1.0 / ((x - 1.0) * (x + 1.0)).sqrt()),
        Atanh => (0.5 * (2.0 * x / (1.0 - x)).ln_1p(), 1.0 / ((1.0 - x) * (1.0 + x))),
        Floor => (x.floor(), 0.0),
        Ceil => (x.ceil(), 0.0),
        Nint => (nint(x), 0.0),
        Int => (x.trunc(), 0.0),
        Sgn => (if x == 0.0 { 0.0 } else { x.signum() }, 0.0),
        U => (if x == 0.0 { 0.5 } else { truth(x > 0.0) }, 0.0),
        U2 => (x.clamp(0.0, 1.0), truth((0.0..1.0).contains(&x))),
        Uramp => (if x < 0.0 { 0.0 } else { x }, truth(x >= 0.0)),
        Buf => (truth(x > 0.5), 0.0),
        Square => (x * x, 2.0 * x),
        Table => curves::table(constants(i), x),
        op if op.shaped() => curves::shaped(op, constants(i), x),
        Staircase => (curves::staircase(constants(i), x), 0.0),
        _ => unreachable!("{:?} has a linearisation point", i.op),
    }
}

/// `asinh` without cancellation for either sign.
fn asinh(x: f64) -> f64 {
    let a = x.abs();
    let value = if a > 1e8 {
        a.ln() + std::f64::consts::LN_2
    } else {
        let square = a * a;
        (a + square / (1.0 + (square + 1.0).sqrt())).ln_1p()
    };
    value.copysign(x)
}

/// `acosh` with all digits near one.
fn acosh(x: f64) -> f64 {
    if x > 1e8 {
        return x.ln() + std::f64::consts::LN_2;
    }
    let t = x - 1.0;
    (t + (t * (t + 2.0)).sqrt()).ln_1p()
}

/// Value and slopes.
pub(super) fn binary(op: Op, x: f64, y: f64) -> (f64, f64, f64) {
    use Op::*;
    let flat = |condition: bool| (truth(condition), 0.0, 0.0);
    match op {
        Add => (x + y, 1.0, 1.0),
        Sub => (x - y, 1.0, -1.0),
        Mul => (x * y, y, x),
        Div => {
            let value = x / y;
            (value, 1.0 / y, -value / y)
        }
        Pow => {
            let value = x.powf(y);
            (value, power_slope(x, y), log_part(value, x))
        }
        Pwr => {
            let size = x.abs();
            let value = if x == 0.0 { 0.0 } else { size.powf(y).copysign(x) };
            (value, y * size.powf(y - 1.0), log_part(value, size))
        }
        // where both are equal the slope of the second, which lies ahead for max(x, 0) and min(0, x)
        Min if x.is_nan() || y.is_nan() => (f64::NAN, 0.0, 0.0),
        Max if x.is_nan() || y.is_nan() => (f64::NAN, 0.0, 0.0),
        Min if x < y => (x, 1.0, 0.0),
        Min => (y, 0.0, 1.0),
        Max if x >= y => (x, 1.0, 0.0),
        Max => (y, 0.0, 1.0),
        Atan2 => {
            let square = x * x + y * y;
            (x.atan2(y), y / square, -x / square)
        }
        Hypot => {
            let value = x.hypot(y);
            if value == 0.0 {
                (0.0, 1.0, 0.0)
            } else {
                (value, x / value, y / value)
            }
        }
        Lt => flat(x < y),
        Le => flat(x <= y),
        Gt => flat(x > y),
        Ge => flat(x >= y),
        Eq => flat(x == y),
        Ne => flat(x != y),
        And => flat(x != 0.0 && y != 0.0),
        _ => flat(x != 0.0 || y != 0.0),
    }
}

/// `d(x^y)/dx`, zero for a constant power.
fn power_slope(x: f64, y: f64) -> f64 {
    if y == 0.0 {
        0.0
    } else {
        y * x.powf(y - 1.0)
    }
}

/// `x^y ln x`, the slope by the exponent; zero where the power vanishes.
fn log_part(value: f64, base: f64) -> f64 {
    if value == 0.0 || base <= 0.0 {
        0.0
    } else {
        value * base.ln()
    }
}

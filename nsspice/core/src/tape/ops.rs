//! The instructions.

macro_rules! instructions {
    ($($name:ident $text:literal $arity:literal)*) => {
        /// One instruction; see the table in `nsspice/problems/tape.py`, which has the same order.
        #[allow(missing_docs)] // the names say it
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum Op { $($name),* }

        /// Names of the instructions in the order of their codes.
        pub const NAMES: &[&str] = &[$($text),*];
        const ALL: &[Op] = &[$(Op::$name),*];
        const ARITY: &[u8] = &[$($arity),*];
    };
}

instructions! {
    Constant "constant" 0
    Unknown "unknown" 0
    Source "source" 0
    Time "time" 0
    Neg "neg" 1
    Inv "inv" 1
    Not "not" 1
    Abs "abs" 1
    Sqrt "sqrt" 1
    Exp "exp" 1
    Expm1 "expm1" 1
    Ln "ln" 1
    Log1p "log1p" 1
    Log10 "log10" 1
    Sin "sin" 1
    Cos "cos" 1
    Tan "tan" 1
    Asin "asin" 1
    Acos "acos" 1
    Atan "atan" 1
    Sinh "sinh" 1
    Cosh "cosh" 1
    Tanh "tanh" 1
    Asinh "asinh" 1
    Acosh "acosh" 1
    Atanh "atanh" 1
    Floor "floor" 1
    Ceil "ceil" 1
    Nint "nint" 1
    Int "int" 1
    Sgn "sgn" 1
    U "u" 1
    U2 "u2" 1
    Uramp "uramp" 1
    Buf "buf" 1
    Square "square" 1
    Add "add" 2
    Sub "sub" 2
    Mul "mul" 2
    Div "div" 2
    Pow "pow" 2
    Pwr "pwr" 2
    Min "min" 2
    Max "max" 2
    Atan2 "atan2" 2
    Hypot "hypot" 2
    Lt "lt" 2
    Le "le" 2
    Gt "gt" 2
    Ge "ge" 2
    Eq "eq" 2
    Ne "ne" 2
    And "and" 2
    Or "or" 2
    If "if" 3
    Junction "junction" 1
    Depletion "depletion" 1
    Table "table" 1
    Staircase "staircase" 1
    Softplus "softplus" 1
    GateDrain "gate_drain" 1
    Body "body" 1
}

impl Op {
    /// The instruction of a code.
    pub fn from_code(code: u8) -> Option<Op> {
        ALL.get(usize::from(code)).copied()
    }

    /// Number of registers it reads.
    pub fn arity(self) -> usize {
        usize::from(ARITY[self as usize])
    }

    /// Whether its value is constant between jumps, so that derivatives end here.
    pub fn flat(self) -> bool {
        use Op::*;
        matches!(
            self,
            Not | Floor
                | Ceil
                | Nint
                | Int
                | Sgn
                | U
                | Buf
                | Lt
                | Le
                | Gt
                | Ge
                | Eq
                | Ne
                | And
                | Or
                | Staircase
        )
    }

    /// Whether it is a smooth curve of one argument whose constants, at most three, shape it.
    pub fn shaped(self) -> bool {
        matches!(self, Op::Softplus | Op::GateDrain | Op::Body)
    }

    /// Whether it has a kink or a jump somewhere.
    pub fn kinked(self) -> bool {
        use Op::*;
        self.flat() || matches!(self, Abs | U2 | Uramp | Min | Max | If | Table | Pwr)
    }

    /// Whether it keeps a linearisation point of its own: it grows so fast, or ends so soon, that a
    /// tangent taken where a Newton step happens to land would mislead the next one.
    pub fn limited(self) -> bool {
        use Op::*;
        matches!(self, Exp | Expm1 | Ln | Log1p | Log10 | Sqrt | Sinh | Cosh | Junction)
    }
}

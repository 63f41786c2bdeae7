//! Steps that were not solved.

/// The best point of Newton's method where it finds no solution.
#[derive(Clone, Debug)]
pub struct Best {
    /// the row of z it violates most
    pub worst_row: usize,
    /// the unknowns z
    pub point: Vec<f64>,
}

/// A step that was not solved, with what a certificate needs.
#[derive(Clone, Debug, Default)]
pub struct Failure {
    /// end of the step [s]
    pub time: f64,
    /// step length [s]; infinite for a static problem
    pub length: f64,
    /// right-hand side of the rows of z
    pub rhs: Vec<f64>,
    /// roles of the pairs: 0 diode, 1 closed, 2 open
    pub roles: Vec<u8>,
    /// worst residual reached
    pub residual: f64,
    /// a solution was found, but it is so large that infeasibility has to be ruled out first
    pub suspect: bool,
    /// the best point of Newton's method
    pub best: Option<Box<Best>>,
    /// the pair of a switch that finds no state: closed it opens, open it closes
    pub restless: Option<usize>,
}

impl Failure {
    /// A switch has found no state: nothing is left to certify.
    pub fn restless(time: f64, pair: Option<usize>) -> Failure {
        let (length, residual, restless) = (f64::INFINITY, 1.0, pair);
        Failure { time, length, residual, restless, ..Failure::default() }
    }
}

pub(in crate::integrate) type Outcome = Result<(), Box<Failure>>;

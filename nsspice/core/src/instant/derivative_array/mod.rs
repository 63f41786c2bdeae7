//! The state right after an instant at which nothing jumps, for any network of index 1 or 2.
//!
//! Charges and fluxes `E z + Q f(z)` stay what they were, and all equations in which nothing is stored hold: that
//! gives the values.  Its derivative in time, together with the equations of what is stored, gives the rates:
//!
//! ```text
//! E z+ + Q f(z+) = E z- + Q f(z-)                       where something is stored
//! G z+ + F f(z+) + A l+ = S u                           elsewhere
//! (E + Q f') z' + G z+ + F f(z+) + A l+ = S u - Q df/dt where something is stored
//! (G + F f') z' + A l' = S u' - F df/dt                 elsewhere
//! ```
//!
//! with `l+ = 0` of blocking pairs and no slack of conducting ones.  That is the derivative array of index 1
//! (P. Kunkel, V. Mehrmann, Differential-Algebraic Equations, EMS 2006, chapter 3).  With index 2 (capacitors and
//! sources in a loop, inductors in a cut-set) the first two do not determine all: what is left of them is a condition
//! that the charges fulfil, and the values along the kernel `X` are found together with the rates, in whose equations
//! `K X a` takes the place of the rates that are not determined.  Values that fulfil no such condition have to jump:
//! then there is no answer here.
//!
//! The equations of perfectly coupled inductors, which store less than they have currents, are taken along eigenvectors.
//!
//! Read `search` (from mode to mode), then `newton` (values), `rates` and `signs`; `linearised` has the equations,
//! `charges` how they are combined; `idle` has the pairs about which no rate decides.

mod charges;
mod first_mode;
mod idle;
mod linearised;
mod newton;
mod rates;
mod signs;

use self::charges::Combination;
use self::signs::Signs;
use super::continuous::find_parallel;
use super::eigenbasis::Eigenbasis;
use super::successors::Successors;
use crate::dense::{Complete, Matrix};
use crate::descriptor::Linear;
use crate::mlcp::Role;
use crate::newton::Newton;
use crate::sparse::Csc;

/// Networks with more unknowns and pairs are left to sparse methods: elimination grows with the cube.
const MOST: usize = 150;

/// What is known at an instant.
pub struct Moment<'a> {
    /// sources after it, and their slopes
    pub sources: [&'a [f64]; 2],
    /// the time that functions see, and its rate
    pub time: [f64; 2],
    /// what pairs may do, and which have conducted
    pub roles: &'a [Role],
    /// see `roles`
    pub active: &'a [bool],
    /// pairs count as being at zero below these guards: blocking, conducting
    pub zero: &'a [[f64; 2]],
    /// laws in which what functions store counts
    pub keeps: &'a [bool],
    /// the largest current so far [A]
    pub largest: f64,
    /// what is stored, where it is not what the state before stores
    pub charges: Option<&'a [f64]>,
    /// there is no mode near which the next one is wanted
    pub anew: bool,
}

/// The equations of one network, and the state found last.
pub struct DerivativeArray {
    n: usize,
    m: usize,
    /// unknowns by the coordinates of the matrices, and those that are not the same in both
    basis: Option<Matrix>,
    moved: Vec<bool>,
    e: Matrix,
    g: Matrix,
    a: Matrix,
    b: Matrix,
    /// `a` before laws are combined, and how they are
    a_before: Matrix,
    combinations: Vec<Combination>,
    /// laws in which something is stored
    stores: Vec<bool>,
    stored: Vec<bool>,
    /// storage and conductance matrices at the present point
    storing: Matrix,
    conducting: Matrix,
    system: Complete,
    onward: Complete,
    matrix: Matrix,
    conductors: Vec<usize>,
    /// what flows into each law, the sizes of its terms, what is stored beyond what was
    flow: Vec<f64>,
    size: Vec<f64>,
    held: Vec<f64>,
    slack: Vec<f64>,
    /// functions before, and now
    before: Vec<f64>,
    now: Vec<f64>,
    x: Vec<f64>,
    scratch: Vec<f64>,
    /// ideal pairs across the same voltage as each
    beside: Vec<Vec<usize>>,
    successors: Successors,
    /// rates of multipliers, and of slacks with the sizes of their terms
    turning: Vec<f64>,
    opening: [Vec<f64>; 2],
    /// unknowns whose rates are not determined
    open: Vec<bool>,
    /// unknowns right after
    pub z: Vec<f64>,
    /// multipliers
    pub l: Vec<f64>,
    /// which pairs conduct
    pub active: Vec<bool>,
    /// rates of the unknowns, of which those count that are stored
    pub rates: Vec<f64>,
    /// rates of the functions
    pub function_rates: Vec<f64>,
}

fn dense(matrix: &Csc) -> Matrix {
    let mut out = Matrix::zeros(matrix.nrows, matrix.ncols);
    matrix.iter().for_each(|(r, c, v)| out[(r, c)] += v);
    out
}

impl DerivativeArray {
    /// Nothing for large networks.
    pub fn new(linear: &Linear, functions: usize) -> Option<DerivativeArray> {
        let (n, m, _) = linear.sizes();
        if n + m > MOST {
            return None;
        }
        let eigenbasis = Eigenbasis::new(linear);
        let laws = eigenbasis.as_ref().map_or(linear, |basis| &basis.laws);
        let [e, g, a, b] = [&laws.e, &laws.g, &laws.a, &laws.b].map(dense);
        let stores = (0..n).map(|r| e.row(r).iter().any(|v| *v != 0.0)).collect();
        let zeros = vec![0.0; n];
        Some(DerivativeArray {
            n,
            m,
            basis: eigenbasis.as_ref().map(|basis| dense(&basis.to)),
            moved: eigenbasis.map_or_else(|| vec![false; n], |basis| basis.moved),
            storing: e.clone(),
            conducting: g.clone(),
            e,
            g,
            a_before: a.clone(),
            combinations: Vec::new(),
            a,
            b,
            stores,
            stored: vec![false; n],
            system: Complete::default(),
            onward: Complete::default(),
            matrix: Matrix::default(),
            conductors: Vec::new(),
            flow: zeros.clone(),
            size: zeros.clone(),
            held: zeros.clone(),
            slack: vec![0.0; m],
            before: vec![0.0; functions],
            now: vec![0.0; functions],
            x: Vec::new(),
            scratch: vec![0.0; n],
            beside: find_parallel(linear),
            successors: Successors::default(),
            turning: vec![0.0; m],
            opening: [vec![0.0; m], vec![0.0; m]],
            open: vec![false; n],
            z: zeros.clone(),
            l: vec![0.0; m],
            active: vec![false; m],
            rates: zeros,
            function_rates: vec![0.0; functions],
        })
    }

    /// Finds the state right after an instant from that before it; false if charges or fluxes may jump, or signs and
    /// rates do not decide about all pairs.
    pub fn find(
        &mut self,
        linear: &Linear,
        mut newton: Option<&mut Newton>,
        [z, l]: [&[f64]; 2],
        at: &Moment,
    ) -> bool {
        if let Some(newton) = &mut newton {
            newton.evaluate(z, at.sources[0], at.time[0], &mut self.before);
            if newton.each_slope().any(|(r, c, _)| self.moved[r] || self.moved[c]) {
                return false;
            }
        }
        self.combine_laws(newton.as_deref(), at);
        self.successors.note_key(at.roles, at.active);
        // without functions the caller has solved for a mode
        let known = self.successors.last().filter(|_| newton.is_some());
        let last = known.unwrap_or(at.active).to_vec();
        for (k, role) in at.roles.iter().enumerate() {
            self.active[k] = match role {
                Role::Diode => last[k] && !self.is_shorted(k, at.roles),
                role => *role == Role::Closed,
            };
        }
        let before = [z, l];
        if at.anew {
            self.propose(linear, &mut newton, before, at);
        }
        let found = self.search(linear, &mut newton, before, at)
            || self.propose(linear, &mut newton, before, at)
                && self.search(linear, &mut newton, before, at);
        if found {
            self.successors.remember(&self.active);
        } else if let Some(newton) = newton {
            // junctions remember where they were linearised last, which may be beyond the range of numbers
            newton.evaluate(z, at.sources[0], at.time[0], &mut self.before);
        }
        found
    }

    /// Whether all unknowns have rates: with index 2 some values are those that the rates ask for.
    pub fn has_all_rates(&self) -> bool {
        !self.open.contains(&true)
    }

    /// Whether a closed switch lies across a pair, which carries nothing then, and has no voltage.
    fn is_shorted(&self, k: usize, roles: &[Role]) -> bool {
        self.beside[k].iter().any(|&j| roles[j] == Role::Closed)
    }

    /// Goes from mode to mode as signs and rates say, until they agree.
    fn search(
        &mut self,
        linear: &Linear,
        newton: &mut Option<&mut Newton>,
        [z, l]: [&[f64]; 2],
        at: &Moment,
    ) -> bool {
        for _ in 0..2 * self.m + 4 {
            self.z.copy_from_slice(z);
            for (k, l) in l.iter().enumerate() {
                self.l[k] = if self.active[k] { *l } else { 0.0 };
            }
            if !(self.find_values(linear, newton, z, at) && self.find_rates(linear, newton, z, at))
            {
                return false;
            }
            match self.signs(linear, newton.as_deref(), at) {
                Signs::Right => return true,
                Signs::Wrong(k) => self.active[k] = !self.active[k],
                Signs::Undecided => return false,
            }
        }
        false
    }
}

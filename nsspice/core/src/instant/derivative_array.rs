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

use super::continuous::find_parallel;
use super::successors::Successors;
use super::turned::Turned;
use crate::dense::{add_scaled, dot, Complete, Matrix};
use crate::descriptor::Linear;
use crate::mlcp::{Driver, Problem, Role, Start};
use crate::newton::Newton;
use crate::rounding::{of_elimination, OF_SOLUTION};
use crate::sparse::Csc;
use crate::tape::Linearisation;
use crate::tolerances::{ACCEPT, FLOOR, NO_JUMP, PROGRESS};

/// Networks with more unknowns and pairs are left to sparse methods: elimination grows with the cube.
const MOST: usize = 150;
/// Rounds of Newton's method.  Nothing that is stored moves, so that junctions with a charge stay where they are.
const ROUNDS: usize = 40;
/// Multipliers that only rates determine are known to engines no better than the rates are: what is less than this part
/// of the largest current may have ended for them.
const BY_RATES: f64 = 1e-3;

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
    /// gaps may close at speed: then the index is above 2
    pub impacts: bool,
}

/// The equations of one network, and the state found last.
pub struct DerivativeArray {
    n: usize,
    m: usize,
    /// unknowns by the coordinates of the matrices, and those that are not the same in both
    turn: Option<Matrix>,
    turned: Vec<bool>,
    e: Matrix,
    g: Matrix,
    a: Matrix,
    b: Matrix,
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

/// What the signs say of a mode.
enum Signs {
    Right,
    Wrong(usize),
    Undecided,
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
        let turned = Turned::new(linear);
        let laws = turned.as_ref().map_or(linear, |turned| &turned.laws);
        let [e, g, a, b] = [&laws.e, &laws.g, &laws.a, &laws.b].map(dense);
        let stores = (0..n).map(|r| e.row(r).iter().any(|v| *v != 0.0)).collect();
        let zeros = vec![0.0; n];
        Some(DerivativeArray {
            n,
            m,
            turn: turned.as_ref().map(|turned| dense(&turned.to)),
            turned: turned.map_or_else(|| vec![false; n], |turned| turned.moved),
            storing: e.clone(),
            conducting: g.clone(),
            e,
            g,
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
            if newton.each_slope().any(|(r, c, _)| self.turned[r] || self.turned[c]) {
                return false;
            }
        }
        self.stored.clone_from(&self.stores);
        if let Some(newton) = &newton {
            let kept = newton.each_function().filter(|f| f.2[1] != 0.0 && at.keeps[f.0]);
            kept.for_each(|f| self.stored[f.0] = true);
        }
        self.successors.note_key(at.roles, at.active);
        // without functions the caller has solved for a mode
        let known = self.successors.last().filter(|_| newton.is_some());
        let last = known.unwrap_or(at.active).to_vec();
        for k in 0..self.m {
            self.active[k] = match at.roles[k] {
                Role::Diode => last[k] && !self.is_shorted(k, at.roles),
                role => role == Role::Closed,
            };
        }
        let before = [z, l];
        let found = self.search(linear, &mut newton, before, at)
            || self.propose(linear, &mut newton, before, at)
                && self.search(linear, &mut newton, before, at);
        if found {
            self.successors.remember(&self.active);
        }
        found
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
            match self.signs(linear, at) {
                Signs::Right => return true,
                Signs::Wrong(k) => self.active[k] = !self.active[k],
                Signs::Undecided => return false,
            }
        }
        false
    }

    /// The mode of the complementarity problem of all laws in which nothing is stored, to first order.
    fn propose(
        &mut self,
        linear: &Linear,
        newton: &mut Option<&mut Newton>,
        [z, _]: [&[f64]; 2],
        at: &Moment,
    ) -> bool {
        if !at.roles.contains(&Role::Diode) {
            return false;
        }
        self.z.copy_from_slice(z);
        self.l.fill(0.0);
        self.linearise(linear, newton, z, at, Linearisation::Exact);
        let rest: Vec<usize> = (0..self.n).filter(|&j| !self.stored[j]).collect();
        let sparse = |matrix: &Matrix, rows: &[usize], columns: &[usize]| {
            let all = rows.iter().enumerate().flat_map(|(i, &r)| {
                columns.iter().enumerate().map(move |(j, &c)| (i, j, matrix[(r, c)]))
            });
            let entries: Vec<_> = all.filter(|e| e.2 != 0.0).collect();
            Csc::from_triplets(rows.len(), columns.len(), &entries)
        };
        let pairs: Vec<usize> = (0..self.m).collect();
        let mut driver = Driver::new(Problem {
            k: sparse(&self.conducting, &rest, &rest),
            a: sparse(&self.a, &rest, &pairs),
            b: sparse(&self.b, &pairs, &rest),
            d: linear.d.clone(),
            row_kind: rest.iter().map(|&j| linear.row_kind[j]).collect(),
        });
        let flow = self.turn_laws(self.flow.clone());
        let right: Vec<f64> = rest.iter().map(|&j| flow[j]).collect();
        let (mut y, mut l) = (vec![0.0; rest.len()], vec![0.0; self.m]);
        let found = driver.solve(&right, &self.slack, at.roles, &mut y, &mut l, Start::Cold);
        let differs = found.is_ok() && driver.active() != self.active;
        if differs {
            self.active.copy_from_slice(driver.active());
        }
        differs
    }

    /// Linearises everything at the present point.
    fn linearise(
        &mut self,
        linear: &Linear,
        newton: &mut Option<&mut Newton>,
        from: &[f64],
        at: &Moment,
        how: Linearisation,
    ) {
        let DerivativeArray { flow, size, held, z, l, now, before, scratch, .. } = self;
        let u = at.sources[0];
        [&mut *flow, size, held].into_iter().for_each(|list| list.fill(0.0));
        linear.s.mul_add(1.0, u, flow);
        linear.s.abs_mul_add(u, size);
        linear.g.mul_add(-1.0, z, flow);
        linear.g.abs_mul_add(z, size);
        linear.a.mul_add(-1.0, l, flow);
        linear.a.abs_mul_add(l, size);
        for ((change, z), from) in scratch.iter_mut().zip(z.iter()).zip(from) {
            *change = z - from;
        }
        linear.e.mul_add(1.0, scratch, held);
        linear.slacks(z, l, &mut self.slack);
        let Some(newton) = newton else { return };
        newton.linearise(z, u, at.time[0], how);
        newton.values(now);
        self.storing.clone_from(&self.e);
        self.conducting.clone_from(&self.g);
        for (row, k, [f, q]) in newton.each_function() {
            flow[row] -= f * now[k];
            size[row] += (f * now[k]).abs();
            held[row] += q * (now[k] - before[k]);
        }
        for (row, column, [f, q]) in newton.each_slope() {
            self.conducting[(row, column)] += f;
            self.storing[(row, column)] += if at.keeps[row] { q } else { 0.0 };
        }
    }

    /// A list of laws in the coordinates of the matrices.
    fn turn_laws(&mut self, mut list: Vec<f64>) -> Vec<f64> {
        if let Some(turn) = &self.turn {
            self.scratch.fill(0.0);
            turn.apply_transposed(&list, &mut self.scratch);
            list.copy_from_slice(&self.scratch);
        }
        list
    }

    /// Fills the matrix of values and rates.
    fn assemble(&mut self, linear: &Linear) {
        let n = self.n;
        self.conductors.clear();
        self.conductors.extend((0..self.m).filter(|&k| self.active[k]));
        let all = n + self.conductors.len();
        self.matrix.reshape(all, all);
        self.matrix.data.fill(0.0);
        for r in 0..n {
            let row = if self.stored[r] { self.storing.row(r) } else { self.conducting.row(r) };
            self.matrix.row_mut(r)[..n].copy_from_slice(row);
            if !self.stored[r] {
                for (c, &k) in self.conductors.iter().enumerate() {
                    self.matrix[(r, n + c)] = self.a[(r, k)];
                }
            }
        }
        for (r, &k) in self.conductors.iter().enumerate() {
            self.matrix.row_mut(n + r)[..n].copy_from_slice(self.b.row(k));
            for (c, &j) in self.conductors.iter().enumerate() {
                let (rows, values) = linear.d.col(j);
                let found = rows.iter().position(|&row| row == k);
                self.matrix[(n + r, n + c)] = found.map_or(0.0, |at| -values[at]);
            }
        }
    }

    /// The values by Newton's method, in one mode.
    fn find_values(
        &mut self,
        linear: &Linear,
        newton: &mut Option<&mut Newton>,
        from: &[f64],
        at: &Moment,
    ) -> bool {
        let (mut last, mut settled) = (f64::INFINITY, false);
        for _ in 0..ROUNDS {
            self.linearise(linear, newton, from, at, Linearisation::Careful);
            self.assemble(linear);
            self.system.factor(&self.matrix);
            self.right_of_values();
            self.system.solve(&mut self.x);
            if !self.x.iter().all(|x| x.is_finite()) {
                return false;
            }
            let moved = self.advance(linear, 0.0);
            // what rounding moves does not become less; next to hundreds of volts digits of small ones take one round more
            if settled || moved <= NO_JUMP && moved >= PROGRESS * last {
                return true;
            }
            settled = moved <= OF_SOLUTION;
            last = moved;
        }
        false
    }

    /// Adds the solution to the unknowns; its largest part of them, or of the current `felt` before.
    fn advance(&mut self, linear: &Linear, felt: f64) -> f64 {
        let n = self.n;
        let step = match &self.turn {
            Some(turn) => {
                self.scratch.fill(0.0);
                turn.apply(&self.x[..n], &mut self.scratch);
                &self.scratch
            }
            None => &self.x[..n],
        };
        let (mut moved, mut largest) =
            ([0.0f64; 2], [f64::MIN_POSITIVE, felt.max(f64::MIN_POSITIVE)]);
        for ((z, d), &kind) in self.z.iter_mut().zip(step).zip(&linear.row_kind) {
            let kind = usize::from(kind);
            *z += d;
            moved[kind] = moved[kind].max(d.abs());
            largest[kind] = largest[kind].max(z.abs());
        }
        for (&k, d) in self.conductors.iter().zip(&self.x[n..]) {
            self.l[k] += d;
        }
        (moved[0] / largest[0]).max(moved[1] / largest[1])
    }

    /// The rates, and the values that they determine; false if they do not, or the equations do not hold.
    fn find_rates(
        &mut self,
        linear: &Linear,
        newton: &mut Option<&mut Newton>,
        from: &[f64],
        at: &Moment,
    ) -> bool {
        let n = self.n;
        self.linearise(linear, newton, from, at, Linearisation::Exact);
        self.assemble(linear);
        self.system.factor(&self.matrix);
        let kernel = self.system.kernel();
        let free = self.system.free().to_vec();
        if !free.is_empty() {
            self.replace_columns(&kernel, &free);
            self.onward.factor(&self.matrix);
            if !self.determines(linear, &kernel, &free, at.impacts) {
                return false;
            }
            // the condition on what is stored, to its last digit
            self.right_of_values();
            self.onward.solve(&mut self.x);
            free.iter().for_each(|&column| self.x[column] = 0.0);
            if !(self.advance(linear, at.largest) <= NO_JUMP) {
                return false;
            }
            self.linearise(linear, newton, from, at, Linearisation::Exact);
        }
        if !self.holds(linear) {
            return false;
        }
        self.right_of_rates(linear, newton, at);
        let right = self.x.clone();
        let factor = if free.is_empty() { &mut self.system } else { &mut self.onward };
        factor.solve(&mut self.x);
        // equations of little else than a large term's rounding get digits of their own
        let mut rest = right.clone();
        for (r, rest) in rest.iter_mut().enumerate() {
            *rest -= dot(self.matrix.row(r), &self.x);
        }
        factor.solve(&mut rest);
        add_scaled(&mut self.x, 1.0, &rest);
        if !self.solved(&right) {
            return false;
        }
        let mut along = vec![0.0; self.x.len()];
        for (j, &column) in free.iter().enumerate() {
            let part = std::mem::take(&mut self.x[column]);
            (0..along.len()).for_each(|c| along[c] += part * kernel[(c, j)]);
        }
        self.take_rates(newton, &kernel, at);
        if free.is_empty() {
            return true;
        }
        // a pair whose multiplier the rates determine has no rate of it
        for (c, &k) in self.conductors.iter().enumerate() {
            self.turning[k] = if along[n + c] == 0.0 { self.turning[k] } else { f64::NAN };
        }
        self.x.copy_from_slice(&along);
        self.advance(linear, 0.0);
        self.linearise(linear, newton, from, at, Linearisation::Exact);
        self.holds(linear)
    }

    /// Puts `K X` into the columns of the free unknowns, where something is stored; what is left of rounding is zero.
    fn replace_columns(&mut self, kernel: &Matrix, free: &[usize]) {
        let (n, size) = (self.n, self.matrix.rows);
        let rounding = of_elimination(size);
        for (j, &column) in free.iter().enumerate() {
            let along = |c: usize| kernel[(c, j)];
            for r in 0..size {
                self.matrix[(r, column)] = 0.0;
                if r >= n || !self.stored[r] {
                    continue;
                }
                let unknowns = (0..n).map(|c| self.conducting[(r, c)] * along(c));
                let pairs = self.conductors.iter().enumerate();
                let pairs = pairs.map(|(c, &k)| self.a[(r, k)] * along(n + c));
                let terms = unknowns.chain(pairs);
                let (sum, most) = terms.fold((0.0, 0.0), |(s, m), v| (s + v, m + f64::abs(v)));
                if f64::abs(sum) > rounding * most {
                    self.matrix[(r, column)] = sum;
                }
            }
        }
    }

    /// Whether the rates determine all values, but for potentials that nothing determines: those stay, if no gap may
    /// close at speed.  Currents that nothing determines are shared otherwise than here.
    fn determines(&self, linear: &Linear, kernel: &Matrix, free: &[usize], impacts: bool) -> bool {
        self.onward.free().iter().all(|&column| {
            let stays = |at: usize| {
                (0..self.matrix.rows).all(|r| {
                    let voltage = linear.row_kind.get(r) == Some(&0);
                    self.matrix[(r, column)] == 0.0 && (voltage || kernel[(r, at)] == 0.0)
                })
            };
            !impacts && free.iter().position(|&free| free == column).is_some_and(stays)
        })
    }

    /// Takes the rates of unknowns, multipliers and functions from the solution.
    fn take_rates(&mut self, newton: &Option<&mut Newton>, kernel: &Matrix, at: &Moment) {
        let n = self.n;
        self.open.fill(false);
        for c in (0..n).filter(|&c| kernel.row(c).iter().any(|v| *v != 0.0)) {
            match &self.turn {
                Some(turn) => (0..n).for_each(|r| self.open[r] |= turn[(r, c)] != 0.0),
                None => self.open[c] = true,
            }
        }
        self.turning.fill(0.0);
        let rates = self.conductors.iter().zip(&self.x[n..]);
        rates.for_each(|(&k, rate)| self.turning[k] = *rate);
        match &self.turn {
            Some(turn) => turn.apply(&self.x[..n], &mut self.rates),
            None => self.rates.copy_from_slice(&self.x[..n]),
        }
        if let Some(newton) = newton {
            let (slopes, time) = (at.sources[1], at.time[1]);
            newton.rates_of_functions(Some(&self.rates), slopes, time, &mut self.function_rates);
        }
    }

    /// Right-hand sides of the values.
    fn right_of_values(&mut self) {
        let flow = self.turn_laws(self.flow.clone());
        let held = self.turn_laws(self.held.clone());
        self.x.clear();
        let laws = self.stored.iter().zip(flow.iter().zip(&held));
        self.x.extend(laws.map(|(&stored, (flow, held))| if stored { -held } else { *flow }));
        self.x.extend(self.conductors.iter().map(|&k| self.slack[k]));
    }

    /// Right-hand sides of the rates.
    fn right_of_rates(&mut self, linear: &Linear, newton: &mut Option<&mut Newton>, at: &Moment) {
        let slopes = at.sources[1];
        let mut rising = vec![0.0; self.n];
        linear.s.mul_add(1.0, slopes, &mut rising);
        let mut flow = self.flow.clone();
        if let Some(newton) = newton {
            newton.rates_of_functions(None, slopes, at.time[1], &mut self.function_rates);
            for (row, k, [f, q]) in newton.each_function() {
                rising[row] -= f * self.function_rates[k];
                flow[row] -= q * self.function_rates[k];
            }
        }
        let (flow, rising) = (self.turn_laws(flow), self.turn_laws(rising));
        self.x.clear();
        let laws = self.stored.iter().zip(flow.iter().zip(&rising));
        self.x.extend(laws.map(|(&stored, (flow, rising))| if stored { *flow } else { *rising }));
        self.x.resize(self.matrix.rows, 0.0);
    }

    /// Whether all laws hold in which nothing is stored, and conducting pairs have no slack.
    fn holds(&mut self, linear: &Linear) -> bool {
        let flow = self.turn_laws(self.flow.clone());
        let size = match &self.turn {
            Some(turn) => {
                let of = |c: usize| (0..self.n).map(|r| turn[(r, c)].abs() * self.size[r]).sum();
                (0..self.n).map(of).collect()
            }
            None => self.size.clone(),
        };
        let mut most = [0.0f64; 2];
        for (&kind, &size) in linear.row_kind.iter().zip(&size) {
            most[usize::from(kind)] = most[usize::from(kind)].max(size);
        }
        let laws = (0..self.n).filter(|&r| !self.stored[r]).all(|r| {
            let floor = FLOOR * most[usize::from(linear.row_kind[r])];
            flow[r].abs() <= ACCEPT * size[r].max(floor)
        });
        let largest = |list: &[f64]| list.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let volts = largest(&linear.q).max(largest(&self.z)).max(largest(&self.slack));
        laws && self.conductors.iter().all(|&k| self.slack[k].abs() <= ACCEPT * volts)
    }

    /// Whether the rates fulfil their equations.
    fn solved(&self, right: &[f64]) -> bool {
        let x = &self.x;
        x.iter().all(|x| x.is_finite())
            && right.iter().enumerate().all(|(r, &right)| {
                let terms = || self.matrix.row(r).iter().zip(x).map(|(a, x)| a * x);
                let size = terms().fold(right.abs(), |size, v| size + v.abs());
                (terms().sum::<f64>() - right).abs() <= ACCEPT * size
            })
    }

    /// What the signs of guards, and of their rates where guards are at zero, say of the mode.
    fn signs(&mut self, linear: &Linear, at: &Moment) -> Signs {
        let mut worst = (0.0, None);
        let counts = |k: &usize| at.roles[*k] == Role::Diode && !self.is_shorted(*k, at.roles);
        let diodes: Vec<usize> = (0..self.m).filter(counts).collect();
        let guard = |k: usize| if self.active[k] { self.l[k] } else { self.slack[k] };
        let zero = |k: usize| at.zero[k][usize::from(self.active[k])];
        for &k in diodes.iter().filter(|&&k| guard(k) < -zero(k)) {
            let part = -guard(k) / zero(k).max(f64::MIN_POSITIVE);
            if part > worst.0 {
                worst = (part, Some(k));
            }
        }
        if let Some(k) = worst.1 {
            return Signs::Wrong(k);
        }
        let small = |k: &usize| self.turning[*k].is_nan() && self.l[*k] <= BY_RATES * at.largest;
        if diodes.iter().any(small) {
            return Signs::Undecided;
        }
        let [rate, size] = &mut self.opening;
        [&mut *rate, &mut *size].into_iter().for_each(|list| list.fill(0.0));
        linear.b.mul_add(-1.0, &self.rates, rate);
        linear.b.abs_mul_add(&self.rates, size);
        linear.d.mul_add(1.0, &self.turning, rate);
        linear.d.abs_mul_add(&self.turning, size);
        linear.b.iter().filter(|e| self.open[e.1]).for_each(|e| rate[e.0] = f64::NAN);
        let largest = self.turning.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        for &k in diodes.iter().filter(|&&k| guard(k) <= zero(k)) {
            let (rate, size) = match self.active[k] {
                true => (self.turning[k], largest),
                false => (self.opening[0][k], self.opening[1][k]),
            };
            // NaN decides nothing
            if !(rate.abs() > ACCEPT * size) {
                return Signs::Undecided;
            }
            if rate < 0.0 {
                return Signs::Wrong(k);
            }
        }
        Signs::Right
    }
}

//! The state right after an instant at which nothing jumps.
//!
//! Where the equations in which nothing is stored determine all else from charges and fluxes (index 1), and one mode
//! of the pairs obeys all signs with these as they are, there is nothing for an impulse to do: charges and fluxes are
//! continuous.  Currents and voltages are then the solution of those equations alone, one complementarity problem
//! whose factors are kept by mode, and rates of charges and fluxes follow from the others,
//! `E z' = S u - G z - A l`.  Nothing has a length here, and it is all the same whether the network is reciprocal.
//!
//! Perfectly coupled inductors store less than they have currents: their equations are taken along eigenvectors.
//!
//! A voltage that a source alone gives across a capacitor is no charge that could be kept: it is given as long as it
//! agrees with what is stored, and the current of the source follows from the rates.
//!
//! A pair at zero, with neither current nor voltage, goes where the rates lead it: one more problem, of rates, in
//! which all others keep their states.  Where a mode leaves something open, or rates leave a pair undecided, this
//! gives no answer.

use super::eigenbasis::Eigenbasis;
use super::successors::Successors;
use crate::descriptor::Linear;
use crate::linear::{ordering, Factor};
use crate::mlcp::{work_len, Driver, Problem, Role};
use crate::sparse::Csc;
use crate::tolerances::{ACCEPT, NO_JUMP};
use std::sync::Arc;

/// A stored voltage that a source gives: its unknown, the unknown of the current of the source and its law, and what
/// the one is multiplied by there and the other in the law of the currents.
struct Given {
    voltage: usize,
    source: usize,
    of_voltage: f64,
    of_current: f64,
}

/// What is known at an instant.
pub struct At<'a> {
    /// sources after it, and their slopes
    pub sources: [&'a [f64]; 2],
    /// what pairs may do, and which have conducted
    pub roles: &'a [Role],
    /// see `roles`
    pub active: &'a [bool],
    /// largest voltage so far [V]
    pub voltage: f64,
}

/// The laws in which nothing is stored, of what follows from what is: one complementarity problem.
struct Rest {
    /// their unknowns
    unknowns: Vec<usize>,
    driver: Driver,
    of_stored: Csc,
    of_sources: Csc,
    slack_of_stored: Csc,
    offsets: Vec<f64>,
    /// scratch: right-hand sides of the laws and of pairs, and a solution
    right: Vec<f64>,
    offset: Vec<f64>,
    y: Vec<f64>,
}

/// Unknowns whose charges and fluxes are free, and their storage matrix.
struct Stored {
    unknowns: Vec<usize>,
    /// the matrix, scaled
    factor: Factor,
    scale: Vec<f64>,
    work: Vec<f64>,
}

/// Unknowns that sources give, and their columns of the storage matrix.
struct AllGiven {
    list: Vec<Given>,
    columns: Csc,
}

/// The equations of one network.
pub struct Continuous {
    stored: Stored,
    rest: Rest,
    given: AllGiven,
    /// ideal pairs across the same voltage as each
    beside: Vec<Vec<usize>>,
    successors: Successors,
    /// where inductors are perfectly coupled: the coordinates of all this
    eigenbasis: Option<Box<Eigenbasis>>,
    /// pairs count as being at zero below these guards: blocking, conducting
    pub zero: Vec<[f64; 2]>,
    /// values have been found in this mode
    consistent: bool,
    /// unknowns right after
    pub z: Vec<f64>,
    /// multipliers
    pub l: Vec<f64>,
    /// which pairs conduct
    pub active: Vec<bool>,
    /// rates of what is stored
    pub rates: Vec<f64>,
    /// scratch: slacks, rates of multipliers, states of pairs that are not at zero, all laws
    slack: Vec<f64>,
    turning: Vec<f64>,
    fixed: Vec<Role>,
    flow: Vec<f64>,
}

/// The entries of a matrix in some rows and columns, renumbered where `rows` or `columns` say so.
fn part(
    matrix: &Csc,
    rows: impl Fn(usize) -> Option<usize>,
    columns: impl Fn(usize) -> Option<usize>,
    size: [usize; 2],
) -> Csc {
    let entries = matrix.iter().filter(|e| e.2 != 0.0);
    let kept = entries.filter_map(|(r, c, v)| Some((rows(r)?, columns(c)?, v)));
    Csc::from_triplets(size[0], size[1], &kept.collect::<Vec<_>>())
}

/// Voltages across capacitors that sources alone give.
fn find_given(linear: &Linear, stores: &[bool]) -> Vec<Given> {
    let (g_rows, a_rows) = (linear.g.transpose(), linear.a.transpose());
    let one = |source: usize| {
        let [(voltage, of_voltage)] = g_rows.nonzeros(source)[..] else { return None };
        let [(law, of_current)] = linear.g.nonzeros(source)[..] else { return None };
        let alone = a_rows.nonzeros(source).is_empty() && linear.b.nonzeros(source).is_empty();
        let found = law == voltage && stores[voltage] && alone;
        found.then_some(Given { voltage, source, of_voltage, of_current })
    };
    let sources = (0..stores.len()).filter(|&k| !stores[k] && linear.row_kind[k] == 1);
    sources.filter_map(one).collect()
}

/// Of each pair those without resistance across the same voltage, whichever way round: both have no slack together.
pub(super) fn find_parallel(linear: &Linear) -> Vec<Vec<usize>> {
    let rows = linear.b.transpose();
    let m = rows.ncols;
    let mut resists = vec![false; m];
    linear.d.iter().filter(|e| e.2 != 0.0).for_each(|(r, c, _)| {
        (resists[r], resists[c]) = (true, true);
    });
    let alike = |i: usize, j: usize, sign: f64| {
        let ((a, x), (b, y)) = (rows.col(i), rows.col(j));
        a == b && x.iter().zip(y).all(|(x, y)| *x == sign * y) && linear.q[i] == sign * linear.q[j]
    };
    let beside = |i: usize, j: usize| {
        i != j && !resists[i] && !resists[j] && (alike(i, j, 1.0) || alike(i, j, -1.0))
    };
    (0..m).map(|i| (0..m).filter(|&j| beside(i, j)).collect()).collect()
}

impl Rest {
    /// Right-hand sides with sources and what is stored, the constant part of those of pairs being there already.
    fn take(&mut self, sources: &[f64], stored: &[f64]) {
        self.right.fill(0.0);
        self.of_sources.mul_add(1.0, sources, &mut self.right);
        self.of_stored.mul_add(-1.0, stored, &mut self.right);
        self.slack_of_stored.mul_add(-1.0, stored, &mut self.offset);
    }

    /// Solves them from a mode, with multipliers `l`; false if that is not possible.
    fn solve(&mut self, mode: &[bool], roles: &[Role], l: &mut [f64]) -> bool {
        self.driver.solve_from(mode, &self.right, &self.offset, roles, &mut self.y, l)
    }
}

impl Stored {
    /// Rates of what is free from the flows into all laws.
    fn find_rates(&mut self, flow: &[f64], rates: &mut [f64]) {
        let (right, work) = self.work.split_at_mut(self.unknowns.len());
        for ((x, &j), scale) in right.iter_mut().zip(&self.unknowns).zip(&self.scale) {
            *x = flow[j] * scale;
        }
        if !right.is_empty() && self.factor.solve(right, work).is_err() {
            right.fill(f64::NAN);
        }
        for ((x, &j), scale) in right.iter().zip(&self.unknowns).zip(&self.scale) {
            rates[j] = x * scale;
        }
    }
}

impl Continuous {
    /// Nothing if rates of what is stored do not follow from the currents and voltages, or nothing else is there.
    pub fn new(linear: &Linear) -> Option<Continuous> {
        match Eigenbasis::new(linear) {
            Some(eigenbasis) => {
                let found = Continuous::of(&eigenbasis.laws);
                found.map(|found| Continuous { eigenbasis: Some(Box::new(eigenbasis)), ..found })
            }
            None => Continuous::of(linear),
        }
    }

    /// The same in the coordinates of these equations.
    fn of(linear: &Linear) -> Option<Continuous> {
        let (n, m, p) = linear.sizes();
        let (mut stores, mut columns) = (vec![false; n], vec![false; n]);
        for (r, c, _) in linear.e.iter().filter(|e| e.2 != 0.0) {
            (stores[r], columns[c]) = (true, true);
        }
        if stores != columns {
            return None;
        }
        let given = find_given(linear, &stores);
        let (mut free, mut other) = (stores.clone(), stores.iter().map(|s| !s).collect::<Vec<_>>());
        for g in &given {
            (free[g.voltage], other[g.source]) = (false, false);
        }
        let list = |of: &[bool]| (0..n).filter(|&j| of[j]).collect::<Vec<usize>>();
        let (stored, rest) = (list(&free), list(&other));
        let place = |list: &[usize]| {
            let mut place = vec![None; n];
            list.iter().enumerate().for_each(|(k, &j)| place[j] = Some(k));
            place
        };
        let (of_stored, of_rest) = (place(&stored), place(&rest));
        let (f, r) = (stored.len(), rest.len());
        if f + given.len() == 0 || r == 0 {
            return None;
        }
        let in_rest = |j: usize| of_rest[j];
        let is_stored = |j: usize| stores[j].then_some(j);
        let problem = Problem {
            k: part(&linear.g, in_rest, in_rest, [r, r]),
            a: part(&linear.a, in_rest, Some, [r, m]),
            b: part(&linear.b, Some, in_rest, [m, r]),
            d: linear.d.clone(),
            row_kind: rest.iter().map(|&j| linear.row_kind[j]).collect(),
        };
        let mut scale = vec![0.0; f];
        for (row, _, v) in linear.e.iter().filter(|e| e.0 == e.1) {
            of_stored[row].iter().for_each(|&k| scale[k] = 1.0 / v.abs().sqrt());
        }
        let entries = linear.e.iter().filter_map(|(r, c, v)| {
            let (r, c) = (of_stored[r]?, of_stored[c]?);
            Some((r, c, scale[r] * v * scale[c]))
        });
        let matrix = Csc::from_triplets(f, f, &entries.collect::<Vec<_>>());
        let storage = Factor::new(&matrix, &Arc::new(ordering(&matrix, 0)));
        // rates are known to the unit roundoff by the part that survives: as well as equations are to be
        let regular =
            f == 0 || storage.singular().is_none() && storage.pivot_ratio() > f64::EPSILON / ACCEPT;
        let finite = scale.iter().all(|s| s.is_finite() && *s > 0.0);
        if !(regular && finite) {
            return None;
        }
        let is_given = |j: usize| (stores[j] && !free[j]).then_some(j);
        Some(Continuous {
            rest: Rest {
                driver: Driver::new(problem),
                of_stored: part(&linear.g, in_rest, is_stored, [r, n]),
                of_sources: part(&linear.s, in_rest, Some, [r, p]),
                slack_of_stored: part(&linear.b, Some, is_stored, [m, n]),
                offsets: linear.q.clone(),
                right: vec![0.0; r],
                offset: vec![0.0; m],
                y: vec![0.0; r],
                unknowns: rest,
            },
            given: AllGiven { columns: part(&linear.e, Some, is_given, [n, n]), list: given },
            stored: Stored {
                unknowns: stored,
                factor: storage,
                scale,
                work: vec![0.0; work_len(r + m).max(f)],
            },
            beside: find_parallel(linear),
            successors: Successors::default(),
            eigenbasis: None,
            consistent: false,
            zero: vec![[0.0; 2]; m],
            z: vec![0.0; n],
            l: vec![0.0; m],
            active: vec![false; m],
            rates: vec![0.0; n],
            slack: vec![0.0; m],
            turning: vec![0.0; m],
            fixed: vec![Role::Open; m],
            flow: vec![0.0; n],
        })
    }

    /// Finds the state right after an instant from that before it; false if charges or fluxes may jump, or the rates
    /// do not decide about all pairs.
    pub fn find(&mut self, linear: &Linear, [z, l]: [&[f64]; 2], at: At) -> bool {
        let Some(eigenbasis) = self.eigenbasis.take() else {
            return self.find_in(linear, [z, l], at);
        };
        let found = self.find_in(&eigenbasis.laws, [&eigenbasis.coordinates(z), l], at);
        eigenbasis.back(&mut self.z);
        eigenbasis.back(&mut self.rates);
        self.eigenbasis = Some(eigenbasis);
        found
    }

    fn find_in(&mut self, linear: &Linear, [z, l]: [&[f64]; 2], at: At) -> bool {
        self.consistent = false;
        self.z.copy_from_slice(z);
        self.l.copy_from_slice(l);
        let [u, slopes] = at.sources;
        if !self.take_given(linear, u, at.voltage) {
            return false;
        }
        self.successors.note_key(at.roles, at.active);
        match self.successors.last() {
            Some(mode) => self.active.copy_from_slice(mode),
            _ => self.begin_with(at.roles, at.active),
        }
        let found = self.find_values(linear, u, at.roles) && {
            self.find_rates(linear, u, slopes);
            let undecided = self.sort_out(at.roles);
            !undecided || self.decide(linear, [u, slopes])
        };
        if found {
            self.successors.remember(&self.active);
        }
        found
    }

    /// A mode to begin with: the one before, but that diodes in parallel with closed switches carry nothing.
    fn begin_with(&mut self, roles: &[Role], before: &[bool]) {
        for k in 0..roles.len() {
            let shut = |j: &usize| roles[*j] == Role::Closed;
            self.active[k] = match roles[k] {
                Role::Diode => before[k] && !self.beside[k].iter().any(shut),
                role => role == Role::Closed,
            };
        }
    }

    /// Separates the pairs at zero, which stay free, from all others; whether there are any.  One across a closed
    /// switch is at zero as long as that is closed.
    fn sort_out(&mut self, roles: &[Role]) -> bool {
        let mut any = false;
        for k in 0..self.l.len() {
            let active = self.active[k];
            let guard = if active { self.l[k] } else { self.slack[k] };
            let at_zero =
                roles[k] == Role::Diode && guard.abs() <= self.zero[k][usize::from(active)];
            let shut = |j: &usize| roles[*j] == Role::Closed;
            let stays = !active && self.beside[k].iter().any(shut);
            self.fixed[k] = match (at_zero && !stays, active) {
                (true, _) => Role::Diode,
                (false, true) => Role::Closed,
                (false, false) => Role::Open,
            };
            any |= self.fixed[k] == Role::Diode;
        }
        any
    }

    /// Voltages that sources give across capacitors: whether they are what is stored there.
    fn take_given(&mut self, linear: &Linear, u: &[f64], largest: f64) -> bool {
        if self.given.list.is_empty() {
            return true;
        }
        self.flow.fill(0.0);
        linear.s.mul_add(1.0, u, &mut self.flow);
        self.given.list.iter().all(|g| {
            let voltage = self.flow[g.source] / g.of_voltage;
            let stays = (voltage - self.z[g.voltage]).abs() <= NO_JUMP * largest;
            self.z[g.voltage] = voltage;
            stays
        })
    }

    /// What follows from charges and fluxes: unknowns, multipliers, slacks and the mode.
    fn find_values(&mut self, linear: &Linear, u: &[f64], roles: &[Role]) -> bool {
        let rest = &mut self.rest;
        rest.offset.copy_from_slice(&rest.offsets);
        rest.take(u, &self.z);
        for (y, &j) in rest.y.iter_mut().zip(&rest.unknowns) {
            *y = self.z[j];
        }
        if !rest.solve(&self.active, roles, &mut self.l) {
            return false;
        }
        self.active.copy_from_slice(rest.driver.active());
        for (y, &j) in rest.y.iter().zip(&rest.unknowns) {
            self.z[j] = *y;
        }
        for (l, &active) in self.l.iter_mut().zip(&self.active) {
            *l = if active { *l } else { 0.0 };
        }
        linear.slacks(&self.z, &self.l, &mut self.slack);
        self.consistent = true;
        self.rest.driver.mode_factor(&self.active).regular()
    }

    /// The mode that the signs of the values ask for, if these were found: rates may decide about more.
    pub fn proposal(&self) -> Option<&[bool]> {
        self.consistent.then_some(&self.active)
    }

    /// Rates of charges and fluxes, and the currents of the sources that give some of them.
    fn find_rates(&mut self, linear: &Linear, u: &[f64], slopes: &[f64]) {
        self.rates.fill(0.0);
        if !self.given.list.is_empty() {
            self.flow.fill(0.0);
            linear.s.mul_add(1.0, slopes, &mut self.flow);
            for g in &self.given.list {
                (self.rates[g.voltage], self.z[g.source]) =
                    (self.flow[g.source] / g.of_voltage, 0.0);
            }
        }
        self.flow.fill(0.0);
        linear.s.mul_add(1.0, u, &mut self.flow);
        linear.g.mul_add(-1.0, &self.z, &mut self.flow);
        linear.a.mul_add(-1.0, &self.l, &mut self.flow);
        self.given.columns.mul_add(-1.0, &self.rates, &mut self.flow);
        self.stored.find_rates(&self.flow, &mut self.rates);
        if !self.given.list.is_empty() {
            self.close_given(linear);
        }
    }

    /// The currents of sources from what is left of the laws of currents there.
    fn close_given(&mut self, linear: &Linear) {
        // the parts of what sources give have been taken out already
        for &j in &self.stored.unknowns {
            let (rows, values) = linear.e.col(j);
            for (&row, v) in rows.iter().zip(values) {
                self.flow[row] -= v * self.rates[j];
            }
        }
        for g in &self.given.list {
            self.z[g.source] = self.flow[g.voltage] / g.of_current;
        }
    }

    /// Lets the rates decide about pairs at zero; false if they do not.
    fn decide(&mut self, linear: &Linear, [u, slopes]: [&[f64]; 2]) -> bool {
        self.rest.offset.fill(0.0);
        self.rest.take(slopes, &self.rates);
        self.rest.y.fill(0.0);
        self.turning.fill(0.0);
        if !self.rest.solve(&self.active, &self.fixed, &mut self.turning) {
            return false;
        }
        let turned = self.active != self.rest.driver.active();
        self.active.copy_from_slice(self.rest.driver.active());
        if !self.rest.driver.mode_factor(&self.active).regular() || !self.leaves_zero(linear) {
            return false;
        }
        if turned {
            // the values of that mode, which differ by what counts as zero
            for (fixed, &active) in self.fixed.iter_mut().zip(&self.active) {
                *fixed = if active { Role::Closed } else { Role::Open };
            }
            let fixed = std::mem::take(&mut self.fixed);
            let found = self.find_values(linear, u, &fixed);
            self.fixed = fixed;
            self.find_rates(linear, u, slopes);
            return found;
        }
        true
    }

    /// Whether all pairs at zero leave it at a rate beyond its rounding.
    fn leaves_zero(&mut self, linear: &Linear) -> bool {
        let (rest, l) = (&mut self.rest, &self.turning);
        rest.driver.residual(&rest.right, &rest.offset, &self.fixed, &rest.y, l);
        rest.driver.sign_tolerances(&self.active, &mut self.slack);
        // slacks of the rates: `-B z' + D l'`
        let (across, moved) = (&mut rest.offset, &mut self.flow);
        moved.fill(0.0);
        rest.unknowns.iter().zip(&rest.y).for_each(|(&j, y)| moved[j] = *y);
        linear.b.mul_add(-1.0, moved, across);
        linear.d.mul_add(1.0, l, across);
        let rate = |k: usize| if self.active[k] { l[k] } else { across[k] };
        let undecided = |k: &usize| self.fixed[*k] == Role::Diode;
        (0..l.len()).filter(undecided).all(|k| rate(k) > self.slack[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Capacitors of node 0 (1 F) and of node 1 (`c` farads, maybe none), `pairs` from node to node (2: ground) as
    /// (from, to), and sources: of node 0 by a current, or, with a law of its own, by a voltage.
    fn network(c: f64, g: &[(usize, usize, f64)], pairs: &[(usize, usize)], fixed: bool) -> Linear {
        let n = if fixed { 3 } else { 2 };
        let m = pairs.len();
        let mut g = g.to_vec();
        let mut a = Vec::new();
        for (k, &(from, to)) in pairs.iter().enumerate() {
            a.extend([(from, k, 1.0), (to, k, -1.0)].into_iter().filter(|e| e.0 < 2));
        }
        if fixed {
            g.extend([(0, 2, 1.0), (2, 0, -1.0)]);
        }
        let a = Csc::from_triplets(n, m, &a);
        let source = if fixed { (2, 0, -1.0) } else { (0, 0, 1.0) };
        Linear {
            e: Csc::from_triplets(n, n, &[(0, 0, 1.0), (1, 1, c)]),
            g: Csc::from_triplets(n, n, &g),
            b: a.transpose(),
            a,
            d: Csc::zeros(m, m),
            q: vec![0.0; m],
            s: Csc::from_triplets(n, 1, &[source]),
            row_kind: [0, 0, 1][..n].to_vec(),
        }
    }

    /// The state after an instant with these unknowns before it, at zero below 1e-11.
    fn after(
        linear: &Linear,
        z: &[f64],
        sources: [f64; 2],
        roles: &[Role],
        active: &[bool],
    ) -> Option<Continuous> {
        let mut found = Continuous::new(linear)?;
        found.zero.fill([1e-11; 2]);
        let l = vec![0.0; roles.len()];
        let [u, slope] = sources;
        let at = At { sources: [&[u], &[slope]], roles, active, voltage: 10.0 };
        found.find(linear, [z, &l], at).then_some(found)
    }

    /// 2 Ohm from node 0 to node 1, which stores nothing.
    const RESISTOR: [(usize, usize, f64); 4] =
        [(0, 0, 0.5), (1, 1, 0.5), (0, 1, -0.5), (1, 0, -0.5)];

    #[test]
    fn what_a_switch_lets_flow_follows_from_the_charges() {
        let linear = network(0.0, &RESISTOR, &[(1, 2)], false);
        // 3 V through 2 Ohm and the closed switch, 1 A from the source
        let found = after(&linear, &[3.0, 3.0], [1.0, 0.0], &[Role::Closed], &[true]).unwrap();
        assert_eq!((found.z[0], found.z[1], found.l[0], found.rates[0]), (3.0, 0.0, 1.5, -0.5));
        let found = after(&linear, &[3.0, 0.0], [1.0, 0.0], &[Role::Open], &[false]).unwrap();
        assert_eq!((found.z[1], found.l[0], found.rates[0]), (3.0, 0.0, 1.0));
    }

    #[test]
    fn a_switch_between_charges_may_let_them_jump() {
        let linear = network(2.0, &[], &[(0, 1)], false);
        assert!(after(&linear, &[3.0, 0.0], [0.0, 0.0], &[Role::Closed], &[true]).is_none());
        assert!(after(&linear, &[3.0, 0.0], [0.0, 0.0], &[Role::Open], &[false]).is_none());
        // nothing else is there: all is stored
        assert!(Continuous::new(&linear).is_none());
    }

    #[test]
    fn rates_decide_about_a_diode_at_zero() {
        let linear = network(0.0, &RESISTOR, &[(1, 2)], false);
        for before in [false, true] {
            let at = |u: f64| after(&linear, &[0.0, 0.0], [u, 0.0], &[Role::Diode], &[before]);
            // charged from 0 V up it conducts, down it blocks; where nothing moves, it is undecided
            assert!(at(1.0).unwrap().active[0]);
            assert!(!at(-1.0).unwrap().active[0]);
            assert!(at(0.0).is_none());
        }
    }

    #[test]
    fn a_diode_beside_a_closed_switch_rests_at_zero() {
        let linear = network(0.0, &RESISTOR, &[(1, 2), (2, 1)], false);
        let roles = [Role::Closed, Role::Diode];
        let found = after(&linear, &[3.0, 0.0], [0.0, 0.0], &roles, &[true, true]).unwrap();
        assert_eq!((found.active, found.l[0]), (vec![true, false], 1.5));
    }

    #[test]
    fn a_source_across_a_capacitor_carries_what_charges_it() {
        let linear = network(0.0, &RESISTOR, &[(1, 2)], true);
        let found = after(&linear, &[3.0, 3.0, 0.0], [3.0, 7.0], &[Role::Closed], &[true]).unwrap();
        // 7 V/s on 1 F, and 1.5 A through the resistor
        assert_eq!((found.z[2], found.rates[0], found.l[0]), (-8.5, 7.0, 1.5));
        // 2 V within no time are a jump
        assert!(after(&linear, &[3.0, 3.0, 0.0], [5.0, 0.0], &[Role::Closed], &[true]).is_none());
    }
}

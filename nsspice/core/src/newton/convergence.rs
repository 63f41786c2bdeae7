//! How far a point is from solving the equations, free of units and of scale.

use super::equations::{Equations, FOUR};
use super::linear::Assembly;
use super::residuals::SMALL;
use crate::dense::{each, larger, widest};
use crate::mlcp::{Residual, Role};
use crate::rounding::{OF_EQUATION, UNIT};
use crate::tape::Tape;
use crate::tolerances::{CLEARLY, FLOOR};

widest! {
    /// See [`Balance::shares`].
    fn shares<const B: usize>(balance: &mut Balance, eq: &Equations, x: &[f64]) -> Shares =
        balance.shares::<B>(eq, x)
}

/// What the rows of the unknowns say.
struct Shares {
    /// the largest
    top: f64,
    /// largest node voltage and current of a branch
    node: f64,
    branch: f64,
}

/// Defects of a point, and against what they are judged.
pub(super) struct Balance {
    /// `rhs - K z - F f - A l`; minus its second part is the slack
    pub defect: Vec<f64>,
    /// sum of the sizes of the terms
    pub terms: Vec<f64>,
    /// the same, but no less than what rounds the unknowns
    sizes: Vec<f64>,
    /// defects as parts of these
    shares: Vec<f64>,
    /// currents relative to which those of a row are rounded, where it has pairs that conduct
    carried: Vec<f64>,
    /// least thermal voltage of a junction
    sharpest: f64,
    /// functions store charges
    charges: bool,
}

/// A verdict.
#[derive(Clone, Copy, Debug)]
pub(super) struct Judgement {
    pub residual: Residual,
    pub worst_row: usize,
    /// rounding leaves nothing known of the worst row
    pub unknown: bool,
}

impl Balance {
    /// Room for the rows of `eq`, a whole number of fours.
    pub fn new(eq: &Equations, tape: &Tape) -> Balance {
        let zeros = vec![0.0; eq.padded()];
        let [defect, terms, sizes, shares, carried] = [(); 5].map(|()| zeros.clone());
        let sharpest = tape.program().sharpest();
        let charges = eq.terms.iter().any(|term| term.q != 0.0);
        Balance { defect, terms, sizes, shares, carried, sharpest, charges }
    }

    /// Computes both at `x = [z; l]` from the last evaluation of the tape.
    pub fn compute(&mut self, assembly: &Assembly, tape: &Tape, right: &[f64], x: &[f64]) {
        let Balance { defect, terms, .. } = self;
        assembly.laws.balance(tape.registers(), right, x, defect, terms);
    }

    /// The largest defect of a law of currents as a part of the largest current, and where.
    pub fn missed(&self, eq: &Equations) -> (f64, usize) {
        let laws = || eq.places.nodes.iter().map(|&row| row as usize);
        let current = laws().fold(0.0f64, |most, row| most.max(self.terms[row]));
        let shares = laws().map(|row| (self.defect[row].abs() / current, row));
        shares.fold((0.0, 0), |worst, here| if here.0 > worst.0 { here } else { worst })
    }

    /// Takes the terms of each law at a solution into the largest.
    pub fn take_largest(&self, largest: &mut [f64]) {
        largest.iter_mut().zip(&self.terms).for_each(|(most, term)| *most = larger(*term, *most));
    }

    /// Whether all defects are rounding of the largest terms.
    pub fn is_nothing(&self, largest: &[f64]) -> bool {
        largest.iter().zip(&self.defect).all(|(most, defect)| defect.abs() <= UNIT * most)
    }

    /// Size of what the functions make of the unknowns in a row: in steep functions, how far its
    /// defect may be rounding.
    fn steepness(assembly: &Assembly, tape: &Tape, x: &[f64], row: usize) -> f64 {
        let slopes = tape.slopes();
        let entries = assembly.entries.row(row).iter();
        entries.map(|e| (e.factor * slopes[e.slot as usize] * x[e.column as usize]).abs()).sum()
    }

    /// The largest voltage at the junctions in a row that conducts there.
    fn farthest(assembly: &Assembly, tape: &Tape, x: &[f64], row: usize) -> f64 {
        let slopes = tape.slopes();
        let entries = assembly.entries.row(row).iter();
        let acting = entries.filter(|e| slopes[e.slot as usize] != 0.0);
        acting.fold(0.0f64, |most, e| most.max(x[e.column as usize].abs()))
    }

    /// Whether rounding of such a voltage leaves it known to a thermal voltage: else the currents of junctions
    /// are not known at all, and it would excuse everything they miss.
    fn resolved(&self, voltage: f64) -> bool {
        OF_EQUATION * voltage <= CLEARLY * self.sharpest
    }

    /// Relative violations of the rows of the unknowns, `B` blocks of four, or all there are if that is 0.
    #[inline(always)]
    fn shares<const B: usize>(&mut self, eq: &Equations, x: &[f64]) -> Shares {
        let blocks = if B > 0 { B } else { eq.fours.reach.len() };
        let terms = &self.terms.as_chunks::<FOUR>().0[..blocks];
        let defects = &self.defect.as_chunks::<FOUR>().0[..blocks];
        let of = |list: &[u32]| list.iter().fold(0.0f64, |v, &i| larger(x[i as usize].abs(), v));
        let (node, branch) = (of(&eq.places.potentials), of(&eq.places.branches));
        let mut current = branch;
        if eq.m > 0 {
            // one that conducts takes part in all currents of its network: so far its own is rounded
            let mut largest = [0.0; FOUR];
            for (term, counts) in terms.iter().zip(&eq.fours.currents) {
                largest = each(|i| larger(term[i] * counts[i], largest[i]));
            }
            current = largest.into_iter().fold(current, larger);
            self.carried.fill(0.0);
            for (c, _) in x[eq.n..].iter().enumerate().filter(|l| *l.1 != 0.0) {
                let (rows, values) = eq.a.col(c);
                rows.iter()
                    .zip(values)
                    .for_each(|(&row, v)| self.carried[row] += v.abs() * current);
            }
        }
        let carried = &self.carried.as_chunks::<FOUR>().0[..blocks];
        let (reach, laws) = (&eq.fours.reach[..blocks], &eq.fours.laws[..blocks]);
        let sizes = &mut self.sizes.as_chunks_mut::<FOUR>().0[..blocks];
        let shares = &mut self.shares.as_chunks_mut::<FOUR>().0[..blocks];
        let mut top = [0.0f64; FOUR];
        for b in 0..blocks {
            let floor: [f64; FOUR] = each(|i| {
                let [voltages, currents] = [reach[b][0][i] * node, reach[b][1][i] * branch];
                FLOOR * (voltages + currents + carried[b][i])
            });
            let size = each(|i| larger(larger(terms[b][i], floor[i]), f64::MIN_POSITIVE));
            // nothing is no part of nothing, and NaN no number
            let ratio: [f64; FOUR] = each(|i| laws[b][i] * defects[b][i].abs() / size[i]);
            let ratio = each(|i| if ratio[i] < f64::INFINITY { ratio[i] } else { f64::INFINITY });
            top = each(|i| larger(ratio[i], top[i]));
            (sizes[b], shares[b]) = (size, ratio);
        }
        Shares { top: larger(larger(top[0], top[1]), larger(top[2], top[3])), node, branch }
    }

    /// The largest violation without what rounding may do, where, and whether rounding leaves too little of
    /// that row; that with it is among the shares.
    fn worst(
        &self,
        eq: &Equations,
        assembly: &Assembly,
        tape: &Tape,
        x: &[f64],
        Shares { top, branch, .. }: &Shares,
    ) -> (f64, usize, bool) {
        let shares = &self.shares[..eq.n];
        let ratio = |i: usize| {
            let rounding = OF_EQUATION * Self::steepness(assembly, tape, x, i);
            // a law that is one function alone may vanish, which counts in steps only; so small a part of the largest
            // current is none next to it, as those of leakage are
            let slight = || eq.kind(i) == 0 && rounding <= FLOOR * branch;
            // nor is it an excuse where it leaves nothing of the terms: at teravolts, junctions carry anything
            let whole = rounding <= CLEARLY * self.sizes[i] || slight();
            // where nothing else flows, what rounding of the voltages drives through charges is no current either
            let rests = assembly.rate == 0.0 || self.charges;
            let known = whole || rests && self.resolved(Self::farthest(assembly, tape, x, i));
            let excess = self.defect[i].abs() - if known { rounding } else { 0.0 };
            let ratio = if excess <= 0.0 { 0.0 } else { excess / self.sizes[i] };
            (if ratio < f64::INFINITY { ratio } else { f64::INFINITY }, i, !known)
        };
        // the largest first: most others need no look then
        let first = shares.iter().position(|s| s == top).unwrap_or(0);
        let mut worst = ratio(first);
        for (i, &share) in shares.iter().enumerate() {
            if share > larger(worst.0, UNIT) && i != first {
                let here = ratio(i);
                if here.0 > worst.0 {
                    worst = here;
                }
            }
        }
        worst
    }

    /// Relative violations of rows and pairs.  Below `enough` those of rows may be too large by what rounding
    /// does to steep functions.
    pub fn judge(
        &mut self,
        eq: &Equations,
        assembly: &Assembly,
        tape: &Tape,
        roles: &[Role],
        x: &[f64],
        enough: f64,
    ) -> Judgement {
        let shares = match eq.fours.reach.len() {
            1 => shares::<1>(self, eq, x),
            2 => shares::<2>(self, eq, x),
            3 => shares::<3>(self, eq, x),
            SMALL => shares::<SMALL>(self, eq, x),
            _ => shares::<0>(self, eq, x),
        };
        let top = shares.top;
        let (rows, worst_row, unknown) = if top <= UNIT {
            (0.0, 0, false)
        } else if top <= enough {
            (top, 0, false)
        } else {
            self.worst(eq, assembly, tape, x, &shares)
        };
        let (n, terms, defect) = (eq.n, &self.terms, &self.defect);
        if roles.is_empty() {
            let residual = Residual { rows, complementarity: 0.0 };
            return Judgement { residual, worst_row, unknown };
        }
        let mut current = 0.0f64;
        let mut voltage = shares.node;
        for &r in &eq.places.touched {
            current = current.max(terms[r]);
        }
        for i in n..x.len() {
            current = current.max(x[i].abs());
            voltage = voltage.max(terms[i]);
        }
        let relative = |v: f64, scale: f64| if v == 0.0 { 0.0 } else { v / scale };
        let mut complementarity = 0.0f64;
        for (i, role) in roles.iter().enumerate() {
            let (l, w) = (relative(x[n + i], current), relative(-defect[n + i], voltage));
            let violation = match role {
                Role::Diode => l.min(w),
                Role::Closed => w,
                Role::Open => l,
            };
            let violation = if violation.is_nan() { f64::INFINITY } else { violation.abs() };
            complementarity = complementarity.max(violation);
        }
        let residual = Residual { rows, complementarity };
        Judgement { residual, worst_row, unknown }
    }
}

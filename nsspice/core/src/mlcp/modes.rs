//! One mode (which pairs are active) as a linear system, factored.

use super::contraction::{Contraction, MOST, STEP_WORK};
use super::model::Model;
use crate::dense::LeastNorm;
use crate::linear::{Factor, DENSE_LIMIT};
use crate::rounding::OF_SOLUTION;
use crate::sparse::{Csc, Extent, Packed};
use crate::tolerances::ACCEPT;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};
use std::sync::{Arc, OnceLock};

/// Up to this many unknowns other singular modes are solved by their pseudo-inverse, whose making costs their cube.
const DENSE: usize = 40;
const SWEEPS: usize = 8;
/// The first solves are checked, then every so many.
const SAMPLED: u32 = 4;
/// A mode that is solved so often gets a packed copy of its factors.
const USES_FOR_COPY: u32 = 8;
const SAMPLE: u32 = 16;
/// Largest defect of a row that needs no refinement, as a part of its terms or of this part of the
/// largest row of its kind.
const REFINED: (f64, f64) = (1e-12, 1e-6);
/// Larger defects mean that a mode has not been solved at all.
const SOLVED: (f64, f64) = (1e-10, 1e-3);

/// Weights added to the diagonal of the scaled equations: 0 is the problem itself, then those of
/// the proximal point method, at last that of `ModeFactor::correct`.
pub(crate) const LEVELS: [f64; 8] = [0.0, 1e-6, 1e-9, 1e-12, 1e-3, 1e-4, 1e-7, 1e-14];
/// The level at which singular equations can be factored where an iteration corrects what it changes.
pub(crate) const SHIFTED: usize = 2;
/// The level that finds the nearest solution of a singular mode.
pub(crate) const NEAREST: usize = 6;

/// Length of the work space for the mode equations of `size` unknowns: a right-hand side that is kept, what
/// corrections need (a defect, then two copies or a step of a contraction), and one solve.
pub fn work_len(size: usize) -> usize {
    let packed = if size <= DENSE_LIMIT { 0 } else { Packed::work_len(size) };
    3 * size + packed.max(STEP_WORK * size)
}

/// The factored equations of one mode, in physical units.
///
/// Rows: `K z + A l = r`; for an active pair `-B z + D l = r` (with `r = -q`: zero slack), for an
/// inactive one `l = r`.
pub struct ModeFactor {
    model: Arc<Model>,
    active: Box<[bool]>,
    mu: f64,
    factor: Factor,
    regular: bool,
    nearest: OnceLock<Nearest>,
    /// number of solves, for taking samples
    turns: AtomicU32,
    /// a sample was not accurate in every row: refine from now on
    rough: AtomicBool,
    /// number of solves since the mode last changed, and the copy that many of them earn
    uses: AtomicU32,
    packed: OnceLock<Option<Packed>>,
}

/// What finds the nearest solution of a singular mode.
enum Nearest {
    Contracted(Box<Contraction>),
    Dense(LeastNorm),
    /// factor of the Jacobian plus a multiple of the identity: for monotone problems the
    /// Jacobian and its transpose have the same kernel, so that the iteration
    /// `x += (J + mu I)^-1 (r - J x)` leaves the kernel's part of x alone
    Proximal(Box<Factor>),
}

impl ModeFactor {
    /// Factors the Jacobian of the mode.
    pub(crate) fn new(
        model: &Arc<Model>,
        level: usize,
        active: &[bool],
        jacobian: &Csc,
    ) -> ModeFactor {
        let factor = Factor::new(jacobian, &model.ordering);
        ModeFactor {
            model: model.clone(),
            active: active.into(),
            mu: LEVELS[level],
            // a mode is singular if no more than that survives cancellation in a pivot
            regular: factor.pivot_ratio() > OF_SOLUTION,
            factor,
            nearest: OnceLock::new(),
            turns: AtomicU32::new(0),
            rough: AtomicBool::new(false),
            uses: AtomicU32::new(0),
            packed: OnceLock::new(),
        }
    }

    /// Another mode of the same level, by a copy of these factors.
    pub(crate) fn changed(&self, active: &[bool], jacobian: &Csc, rows: &mut Vec<usize>) -> Self {
        let mut other = ModeFactor {
            model: self.model.clone(),
            active: self.active.clone(),
            mu: self.mu,
            factor: self.factor.clone(),
            regular: false,
            nearest: OnceLock::new(),
            turns: AtomicU32::new(self.turns.load(Relaxed)),
            rough: AtomicBool::new(self.rough.load(Relaxed)),
            uses: AtomicU32::new(0),
            packed: OnceLock::new(),
        };
        other.change(active, jacobian, rows);
        other
    }

    /// Turns these factors into those of another mode of the same level, computing only what
    /// depends on the rows that differ.
    pub(crate) fn change(&mut self, active: &[bool], jacobian: &Csc, rows: &mut Vec<usize>) {
        rows.clear();
        let differ = |i: &usize| self.active[*i] != active[*i];
        rows.extend((0..active.len()).filter(differ).map(|i| self.model.n + i));
        self.active.copy_from_slice(active);
        let extent = self.factor.refactor_rows(jacobian, rows);
        if self.factor.pivot_ratio() <= OF_SOLUTION && extent != Extent::Full {
            self.factor.factor(jacobian); // the old order of pivots may be to blame
        }
        self.regular = self.factor.pivot_ratio() > OF_SOLUTION;
        self.nearest = OnceLock::new();
        self.uses.store(0, Relaxed);
        self.packed = OnceLock::new();
    }

    /// Whether the mode has exactly one solution for every right-hand side.
    pub fn regular(&self) -> bool {
        self.regular
    }

    /// Whether `correct` needs the factors of level `NEAREST` (and makes them unless it is given
    /// them).
    pub(crate) fn needs_nearest(&self) -> bool {
        if self.regular {
            return false;
        }
        let made = || self.nearest.get_or_init(|| self.make_nearest());
        self.model.size() > MOST || matches!(made(), Nearest::Proximal(_))
    }

    /// Memory held [bytes], roughly.
    pub(crate) fn bytes(&self) -> usize {
        let extra = match self.nearest.get() {
            Some(Nearest::Dense(_) | Nearest::Contracted(_)) => 8 * self.model.size().pow(2),
            Some(Nearest::Proximal(_)) => self.model.factor_bytes,
            None => 0,
        };
        // the copy that the mode may get counts from the start
        2 * self.model.factor_bytes + self.active.len() + extra + 200
    }

    /// Solves the equations of a regular mode: right-hand side in, solution `[z; l]` out.  The
    /// right-hand sides of inactive pairs must be zero (see `respond`).
    ///
    /// The first solves and every 16th are checked row by row; once a row is not accurate against
    /// its own terms (small rows next to large ones), all solves are refined.
    pub fn solve(&self, x: &mut [f64], work: &mut [f64]) {
        let packed = self.packed();
        let solve = |x: &mut [f64], work: &mut [f64]| match packed {
            Some(packed) => packed.solve(x, work),
            None => self.solve_with(&self.factor, x, work),
        };
        self.solve_checked(solve, x, work);
    }

    /// `solve` for any right-hand side, in which inactive multipliers may be given other values.
    pub fn respond(&self, x: &mut [f64], work: &mut [f64]) {
        self.solve_checked(|x, work| self.solve_with(&self.factor, x, work), x, work);
    }

    fn solve_checked(
        &self,
        solve: impl Fn(&mut [f64], &mut [f64]),
        x: &mut [f64],
        work: &mut [f64],
    ) {
        let turn = self.turns.fetch_add(1, Relaxed);
        let rough = self.rough.load(Relaxed);
        if !rough && turn >= SAMPLED && !turn.is_multiple_of(SAMPLE) {
            return solve(x, work);
        }
        let size = self.model.size();
        let (rhs, work) = work.split_at_mut(size);
        let (defect, work) = work.split_at_mut(size);
        rhs.copy_from_slice(x);
        solve(x, work);
        if rough {
            self.defect(x, rhs, defect);
        } else {
            let (terms, _) = work.split_at_mut(size);
            if self.accurate(REFINED, x, rhs, defect, terms) {
                return;
            }
            self.rough.store(true, Relaxed);
        }
        solve(defect, work);
        for (v, d) in x.iter_mut().zip(defect.iter()) {
            *v += d;
        }
    }

    /// Computes `defect = rhs - J x` and returns whether each row of it is below `tolerance` times its
    /// terms, or times this part of the largest terms among rows of its kind (pairs: all of it).
    fn accurate(
        &self,
        (tolerance, floor): (f64, f64),
        x: &[f64],
        rhs: &[f64],
        defect: &mut [f64],
        terms: &mut [f64],
    ) -> bool {
        let model = &self.model;
        self.defect(x, rhs, defect);
        model.terms(rhs, x, terms);
        let kind = |i: usize| if i < model.n { model.kind(i) } else { 2 };
        let mut largest = [0.0f64; 3];
        for (i, &t) in terms.iter().enumerate() {
            largest[kind(i)] = largest[kind(i)].max(t);
        }
        // pairs are judged against the network, as the residual does: a multiplier of 1e-16 next to
        // amperes is a zero
        let floor = [floor, floor, 1.0];
        let size = |i: usize| terms[i].max(floor[kind(i)] * largest[kind(i)]);
        let fine = |i: usize| defect[i].abs() <= tolerance * size(i);
        (0..terms.len()).all(fine)
    }

    /// The packed copy of the factors, once the mode has lasted.
    fn packed(&self) -> Option<&Packed> {
        if self.uses.load(Relaxed) < USES_FOR_COPY {
            self.uses.fetch_add(1, Relaxed);
            return None;
        }
        let (n, scale) = (self.model.n, &self.model.scale);
        let idle = |i: usize| i >= n && !self.active[i - n];
        let row = |i: usize| (!idle(i)).then_some(scale[i]);
        self.packed.get_or_init(|| self.factor.packed(row, |j| scale[j])).as_ref()
    }

    fn solve_with(&self, factor: &Factor, x: &mut [f64], work: &mut [f64]) {
        self.scale_rows(x);
        if factor.solve(x, work).is_err() {
            x.fill(f64::NAN);
        }
        for (v, &s) in x.iter_mut().zip(&self.model.scale) {
            *v *= s;
        }
    }

    /// The solution nearest to `x` (in the scaled norm) for the given right-hand side: `x += J^+
    /// (rhs - J x)`, repeated against rounding.  Works for singular modes; if the equations
    /// contradict each other, the result does not satisfy them.
    pub fn correct(&self, x: &mut [f64], rhs: &[f64], work: &mut [f64]) {
        self.correct_with(None, 2, x, rhs, work);
    }

    /// `correct`, with the factors of level `NEAREST` at hand, and with a number of sweeps for
    /// regular modes (two: refined).  False if the result is doubtful:
    /// it solves the equations, but the mode is singular or so close to it that it cannot be decided.
    pub(crate) fn correct_with(
        &self,
        nearest: Option<&ModeFactor>,
        sweeps: usize,
        x: &mut [f64],
        rhs: &[f64],
        work: &mut [f64],
    ) -> bool {
        let size = self.model.size();
        let (defect, work) = work.split_at_mut(size);
        // exactly, so that what follows cannot trade it for other unknowns
        for (i, _) in self.active.iter().enumerate().filter(|(_, &a)| !a) {
            x[self.model.n + i] = rhs[self.model.n + i];
        }
        let mut last = f64::INFINITY;
        for sweep in 0..SWEEPS {
            let direct = if self.regular { sweeps } else { 2 };
            if !self.needs_nearest() && sweep == direct {
                break;
            }
            self.defect(x, rhs, defect);
            if self.needs_nearest() {
                // converges as mu / (smallest nonzero singular value): until rounding is reached
                let scaled = |(d, s): (&f64, &f64)| (d * s).abs();
                let left = defect.iter().zip(&self.model.scale).map(scaled).fold(0.0, f64::max);
                if sweep >= 2 && left > 0.5 * last {
                    break;
                }
                last = left;
            }
            self.step_to_nearest(nearest, defect, work);
            for (v, d) in x.iter_mut().zip(defect.iter()) {
                *v += d;
            }
        }
        self.regular || !self.try_factor(x, rhs, defect, work)
    }

    /// A badly scaled regular mode looks singular: where the nearest point does not satisfy the
    /// equations, tries the factors as they are.  True if that helped.
    fn try_factor(&self, x: &mut [f64], rhs: &[f64], defect: &mut [f64], work: &mut [f64]) -> bool {
        let (before, work) = work.split_at_mut(x.len());
        let (terms, work) = work.split_at_mut(x.len());
        if self.factor.singular().is_some() || self.accurate(SOLVED, x, rhs, defect, terms) {
            return false;
        }
        before.copy_from_slice(x);
        for _ in 0..3 {
            self.defect(x, rhs, defect);
            self.solve_with(&self.factor, defect, work);
            for (v, d) in x.iter_mut().zip(defect.iter()) {
                *v += d;
            }
        }
        let scale = &self.model.scale;
        let size = |v: &[f64]| v.iter().zip(scale).fold(0.0f64, |a, (v, s)| a.max((v / s).abs()));
        terms.copy_from_slice(rhs);
        self.scale_rows(terms);
        let data = terms.iter().fold(size(before), |a, v| a.max(v.abs()));
        // also false for NaN; what is accepted of a larger one is all of the data: it is the direction of the kernel
        let credible = ACCEPT * size(x) <= data;
        if credible && self.accurate(SOLVED, x, rhs, defect, terms) {
            return true;
        }
        x.copy_from_slice(before);
        false
    }

    /// `defect := J^+ defect`
    fn step_to_nearest(&self, nearest: Option<&ModeFactor>, defect: &mut [f64], work: &mut [f64]) {
        if self.regular {
            return self.solve_with(&self.factor, defect, work);
        }
        if let Some(nearest) = nearest {
            return self.solve_with(&nearest.factor, defect, work);
        }
        match self.nearest.get_or_init(|| self.make_nearest()) {
            Nearest::Contracted(mode) => mode.step(&self.model, defect, work),
            Nearest::Dense(pseudo) => {
                let (step, work) = work.split_at_mut(defect.len());
                self.scale_rows(defect);
                step.fill(0.0);
                pseudo.correct(defect, step, work);
                for ((v, d), s) in defect.iter_mut().zip(step).zip(&self.model.scale) {
                    *v = *d * s;
                }
            }
            Nearest::Proximal(factor) => self.solve_with(factor, defect, work),
        }
    }

    /// `out = rhs - J x`
    fn defect(&self, x: &[f64], rhs: &[f64], out: &mut [f64]) {
        let n = self.model.n;
        self.model.defect(rhs, x, out);
        if self.mu != 0.0 {
            for ((o, v), s) in out.iter_mut().zip(x).zip(&self.model.scale) {
                *o -= self.mu / (s * s) * v;
            }
        }
        for (i, _) in self.active.iter().enumerate().filter(|(_, &a)| !a) {
            out[n + i] = rhs[n + i] - x[n + i];
        }
    }

    /// Factor from the physical to the scaled right-hand side of a row.
    fn row_scale(&self, i: usize) -> f64 {
        let (n, s) = (self.model.n, self.model.scale[i]);
        if i < n || self.active[i - n] {
            s
        } else {
            1.0 / s // a power of two: exact
        }
    }

    /// Physical right-hand side to scaled one.
    fn scale_rows(&self, r: &mut [f64]) {
        for (i, v) in r.iter_mut().enumerate() {
            *v *= self.row_scale(i);
        }
    }

    fn make_nearest(&self) -> Nearest {
        if self.model.size() <= MOST && self.mu == 0.0 {
            if let Some(found) = Contraction::new(&self.model, &self.active) {
                return Nearest::Contracted(Box::new(found));
            }
        }
        if self.model.size() <= DENSE {
            let jacobian = self.model.mode_jacobian(&self.active, self.mu);
            if let Some(pseudo) = LeastNorm::new(&jacobian) {
                return Nearest::Dense(pseudo);
            }
        }
        let jacobian = self.model.mode_jacobian(&self.active, self.mu + LEVELS[NEAREST]);
        Nearest::Proximal(Box::new(Factor::new(&jacobian, &self.model.ordering)))
    }
}

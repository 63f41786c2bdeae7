//! One implicit step as a complementarity problem: finds modes where nothing else does, and carries
//! the run over instants that the exact engine cannot resolve.

use crate::mlcp::{Driver, Model, Problem, Residual, Role, Start, Unsolved};
use crate::modewise::functions::inputs::Segment;
use crate::modewise::modes::network::{Assembly, Network};
use crate::sparse::Csc;
use std::sync::{Arc, Mutex, PoisonError};

/// Step lengths whose matrices are kept.
const KEPT: usize = 24;

/// Lengths whose matrices are kept from run to run: runs begin alike.
const SHARED: usize = 4;

/// The matrices of the first implicit steps, for all runs of a system.
#[derive(Default)]
pub struct Models {
    known: Mutex<Vec<(f64, Arc<Model>)>>,
}

impl Models {
    /// The matrices of a step of the length `h`.
    fn of(&self, sys: &Assembly, h: f64) -> Arc<Model> {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, model)) = known.iter().find(|k| k.0 == h) {
            return model.clone();
        }
        let mut k: Vec<_> = sys.linear.g.iter().collect();
        if h.is_finite() {
            k.extend(sys.linear.e.iter().map(|(r, c, v)| (r, c, v / h)));
        }
        let n = sys.linear.g.nrows;
        let model = Arc::new(Model::new(Problem {
            k: Csc::from_triplets(n, n, &k),
            a: sys.linear.a.clone(),
            b: sys.linear.b.clone(),
            d: sys.linear.d.clone(),
            row_kind: sys.linear.row_kind.clone(),
        }));
        if known.len() < SHARED {
            known.push((h, model.clone()));
        }
        model
    }
}

/// Implicit steps of any length.
pub struct Implicit {
    drivers: Vec<(f64, Driver)>,
    models: Arc<Models>,
    /// unknowns of the last step
    pub z: Vec<f64>,
    /// multipliers of the last step
    pub l: Vec<f64>,
    /// right-hand side of the last step
    pub rhs: Vec<f64>,
    /// its charges
    pub charges: Vec<f64>,
    /// problems solved
    pub solved: u64,
    /// problems tried in vain
    pub unsolved: u64,
}

/// What a step came to.
pub struct Taken {
    /// how well it is solved
    pub residual: Residual,
    /// so large that it may be no solution at all
    pub suspect: bool,
}

impl Implicit {
    /// No step yet.
    pub fn new(n: usize, m: usize, models: Arc<Models>) -> Implicit {
        Implicit {
            drivers: Vec::new(),
            models,
            z: vec![0.0; n],
            l: vec![0.0; m],
            rhs: vec![0.0; n],
            charges: vec![0.0; n],
            solved: 0,
            unsolved: 0,
        }
    }

    fn driver(&mut self, sys: &Assembly, h: f64) -> &mut Driver {
        if let Some(k) = self.drivers.iter().position(|d| d.0 == h) {
            self.drivers[k..].rotate_left(1);
        } else {
            if self.drivers.len() >= KEPT {
                self.drivers.remove(0);
            }
            self.drivers.push((h, Driver::of(self.models.of(sys, h))));
        }
        let last = self.drivers.len() - 1;
        &mut self.drivers[last].1
    }

    /// Steps from energy coordinates `a` over a length `h` into the segment; `v` are the inputs at
    /// its end. The new unknowns are left in `z`, `l`.
    #[allow(clippy::too_many_arguments)] // the ingredients of a step
    pub fn step(
        &mut self,
        sys: &Assembly,
        net: &Network,
        a: &[f64],
        v: &[f64],
        roles: &[Role],
        h: f64,
    ) -> Result<Taken, Unsolved> {
        net.charges.apply(a, &mut self.charges);
        for (r, q) in self.rhs.iter_mut().zip(&self.charges) {
            *r = q / h;
        }
        net.s.apply_add(v, &mut self.rhs);
        let (rhs, mut z, mut l) = (
            std::mem::take(&mut self.rhs),
            std::mem::take(&mut self.z),
            std::mem::take(&mut self.l),
        );
        let driver = self.driver(sys, h);
        let result = driver.solve(&rhs, &sys.linear.q, roles, &mut z, &mut l, Start::Cold);
        (self.rhs, self.z, self.l) = (rhs, z, l);
        match result {
            Ok(found) => {
                self.solved += 1;
                Ok(Taken { residual: found.residual, suspect: found.needs_certificate })
            }
            Err(failed) => {
                self.unsolved += 1;
                Err(failed)
            }
        }
    }

    /// Active pairs of the last step.
    pub fn active(&self) -> &[bool] {
        self.drivers.last().map_or(&[], |d| d.1.active())
    }

    /// Residual of `(E/h + G) z + A l = rhs` and the laws of the pairs.
    pub fn residual(
        &mut self,
        sys: &Assembly,
        h: f64,
        rhs: &[f64],
        roles: &[Role],
        z: &[f64],
        l: &[f64],
    ) -> Residual {
        self.driver(sys, h).residual(rhs, &sys.linear.q, roles, z, l)
    }
}

/// Inputs later in the segment.
pub fn later(segment: &Segment, h: f64, out: &mut Vec<f64>) {
    out.clear();
    out.extend(segment.level.iter().zip(&segment.slope).map(|(v, r)| v + r * h));
    for tone in &segment.tones {
        let turned = tone.start * tone.rate.scale(h).exp();
        (out[tone.index], out[tone.index + 1]) = (turned.im, turned.re);
    }
    for decay in &segment.decays {
        out[decay.index] = decay.start * (decay.rate * h).exp();
    }
}

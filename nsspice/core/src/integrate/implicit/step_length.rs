//! Everything that belongs to one step length: matrices, complementarity driver, modes.

use super::affine_map::{MapInputs, ModeMap, MAX_ENTRIES};
use super::matrices::{Ends, StepMatrices};
use crate::descriptor::{sums_that_store_nothing, Linear, Smooth};
use crate::mlcp::{Driver, ModeFactor, Problem};
use crate::rounding::OF_SOLUTION;
use crate::sparse::Csc;
use crate::structure::Coordinates;
use std::collections::HashMap;
use std::sync::Arc;

/// The system as assembled from a circuit.
pub struct System {
    /// all that does not depend on the scheme
    pub linear: Linear,
    /// theta correction of the unknowns, zero for theta = 1
    pub h: Csc,
    /// theta correction of the sources
    pub hs: Csc,
    /// smooth nonlinear terms
    pub smooth: Option<Smooth>,
    /// conductances and diagonals show that the network is passive
    pub dominant: bool,
    /// the storage matrix by rows
    storage_rows: Csc,
    /// the tree along which unknown voltages are counted, if they are no potentials
    pub tree: Option<Coordinates>,
}

impl System {
    /// A system with these corrections.
    pub fn new(linear: Linear, h: Csc, hs: Csc, smooth: Option<Smooth>, dominant: bool) -> System {
        let storage_rows = linear.e.transpose();
        System { linear, h, hs, smooth, dominant, storage_rows, tree: None }
    }

    /// Groups of laws in whose sum nothing is stored, not by smooth functions either.
    pub fn laws_without_storage(&self) -> Vec<Vec<usize>> {
        let none = Csc::zeros(self.linear.g.nrows, 0);
        let functions = self.smooth.as_ref().map_or(&none, |smooth| &smooth.q);
        sums_that_store_nothing(&self.linear.e, functions)
    }

    /// The largest voltage and current in some lists of unknowns.
    pub fn largest(&self, lists: &[&[f64]]) -> [f64; 2] {
        let mut out = [0.0f64; 2];
        for (v, &kind) in lists.iter().flat_map(|list| list.iter().zip(&self.linear.row_kind)) {
            let kind = usize::from(kind);
            out[kind] = out[kind].max(v.abs());
        }
        out
    }

    /// The least and the largest conductance of a resistor [S], 0 without any.
    pub fn conductances(&self) -> [f64; 2] {
        let kinds = &self.linear.row_kind;
        let own = self.linear.g.iter().filter(|&(r, c, v)| kinds[r] + kinds[c] == 0 && v != 0.0);
        let sizes: Vec<f64> = own.map(|e| e.2.abs()).collect();
        let of = |pick: fn(f64, f64) -> f64| sizes.iter().copied().reduce(pick).unwrap_or(0.0);
        [of(f64::min), of(f64::max)]
    }

    /// The largest difference of two states, relative to the largest voltage and current in them and
    /// in the one they come from.
    pub fn apart(&self, a: &[f64], b: &[f64], from: &[f64]) -> f64 {
        let (mut sizes, mut gaps) = ([f64::MIN_POSITIVE; 2], [0.0f64; 2]);
        for (((a, b), from), &kind) in a.iter().zip(b).zip(from).zip(&self.linear.row_kind) {
            let kind = usize::from(kind);
            sizes[kind] = sizes[kind].max(a.abs()).max(b.abs()).max(from.abs());
            gaps[kind] = gaps[kind].max((a - b).abs());
        }
        (gaps[0] / sizes[0]).max(gaps[1] / sizes[1])
    }

    /// The largest difference of what two states store, as voltages (currents) relative to those of
    /// `from`.
    pub fn stored_apart(&self, a: &[f64], b: &[f64], from: &[f64]) -> f64 {
        let of = |(row, from): (usize, &f64)| {
            let (columns, values) = self.storage_rows.col(row);
            let (mut moved, mut size) = (0.0, 0.0);
            for (&j, &v) in columns.iter().zip(values) {
                moved += v * (a[j] - b[j]);
                size = if j == row { v.abs() * from.abs() } else { size };
            }
            (size > 0.0).then(|| moved.abs() / size)
        };
        from.iter().enumerate().filter_map(of).fold(0.0, f64::max)
    }
}

/// One visited mode.
pub struct Slot {
    /// factorisation of its equations; large systems keep only that of the present mode
    factor: Option<Arc<ModeFactor>>,
    /// the affine map, made when the mode has proved to last
    pub map: Option<ModeMap>,
    /// steps taken in it
    pub uses: u32,
    /// its quick steps have met the residual whenever that was checked
    pub trusted: bool,
    /// whether it is solved for increments, once that is known
    pub increments: Option<bool>,
}

/// The active set as a bit pattern.
pub type ModeKey = Box<[u64]>;

/// Packs an active set.
pub fn mode_key(active: &[bool]) -> ModeKey {
    let mut bits = vec![0u64; active.len().div_ceil(64)];
    for (i, _) in active.iter().enumerate().filter(|(_, &a)| a) {
        bits[i / 64] |= 1 << (i % 64);
    }
    bits.into()
}

/// All that depends on the step length.
pub struct Stage {
    /// step length [s]; infinite for static systems
    pub length: f64,
    /// an impulsive (theta = 1) step
    pub impulsive: bool,
    /// matrices of the step
    pub matrices: StepMatrices,
    /// solver of the complementarity problem
    pub driver: Driver,
    /// inputs of the maps
    pub inputs: MapInputs,
    modes: HashMap<ModeKey, usize>,
    slots: Vec<Slot>,
    budget: usize,
    present: Option<(u64, usize)>,
    /// last use, for eviction
    pub stamp: u64,
}

/// Memory for maps and factors of one stage [number of f64].
const MODE_BUDGET: usize = 16_000_000;

impl Stage {
    /// Assembles `K = E/h + G (+ H)` and its driver.
    pub fn new(sys: &System, length: f64, impulsive: bool, constants: &[Option<f64>]) -> Stage {
        let (n, m) = (sys.linear.g.nrows, sys.linear.a.ncols);
        let rate = 1.0 / length; // zero for static systems
        #[cfg(feature = "faults")]
        let rate = fault!("step_length_1e-3", rate, rate / (1.0 + 1e-3));
        let mut k: Vec<_> = sys.linear.g.iter().collect();
        let mut carry = Vec::new();
        if rate != 0.0 {
            k.extend(sys.linear.e.iter().map(|(r, c, v)| (r, c, v * rate)));
            carry.extend(sys.linear.e.iter().map(|(r, c, v)| (r, c, v * rate)));
        }
        let mut source_end: Vec<_> = sys.linear.s.iter().collect();
        let mut source_start = Vec::new();
        if !impulsive && rate != 0.0 {
            k.extend(sys.h.iter());
            carry.extend(sys.h.iter());
            source_end.extend(sys.hs.iter().map(|(r, c, v)| (r, c, -v)));
            source_start.extend(sys.hs.iter());
        }
        let p = sys.linear.s.ncols;
        #[cfg(feature = "faults")]
        if rate != 0.0 && !impulsive {
            fault!("carry_off_1e-4" => carry.iter_mut().for_each(|entry| entry.2 *= 1.0 + 1e-4));
            fault!("theta_9_tenths" => {
                carry.extend(sys.linear.g.iter().map(|(r, c, v)| (r, c, -0.1 * v)));
                k.extend(sys.linear.g.iter().map(|(r, c, v)| (r, c, -0.1 * v)));
            });
        }
        let carry = Csc::from_triplets(n, n, &carry);
        let matrices = StepMatrices {
            n,
            m,
            carry_rows: carry.transpose(),
            g_rows: sys.linear.g.transpose(),
            a_rows: sys.linear.a.transpose(),
            b_rows: sys.linear.b.transpose(),
            d_rows: sys.linear.d.transpose(),
            carry,
            source_end: Csc::from_triplets(n, p, &source_end),
            source_start: Csc::from_triplets(n, p, &source_start),
            q: sys.linear.q.clone(),
        };
        let used = |matrix: &Csc| -> Vec<usize> {
            (0..matrix.ncols).filter(|&j| !matrix.col(j).0.is_empty()).collect()
        };
        let varying = |list: Vec<usize>| -> Vec<usize> {
            list.into_iter().filter(|&j| constants[j].is_none()).collect()
        };
        let inputs = MapInputs {
            carried: used(&matrices.carry),
            ends: varying(used(&matrices.source_end)),
            starts: varying(used(&matrices.source_start)),
            constants: constants
                .iter()
                .enumerate()
                .filter_map(|(j, c)| c.map(|v| (j, v)))
                .collect(),
        };
        let driver = Driver::new(Problem {
            k: Csc::from_triplets(n, n, &k),
            a: sys.linear.a.clone(),
            b: sys.linear.b.clone(),
            d: sys.linear.d.clone(),
            row_kind: sys.linear.row_kind.clone(),
        });
        Stage {
            length,
            impulsive,
            matrices,
            driver,
            inputs,
            modes: HashMap::new(),
            slots: Vec::new(),
            budget: MODE_BUDGET,
            present: None,
            stamp: 0,
        }
    }

    /// The slot of a mode; `epoch` changes whenever the mode does, so that nothing is looked up
    /// while it lasts.
    pub fn slot(&mut self, active: &[bool], epoch: u64) -> &mut Slot {
        if let Some((known, index)) = self.present {
            if known == epoch {
                return &mut self.slots[index];
            }
        }
        let key = mode_key(active);
        let index = match self.modes.get(&key) {
            Some(&index) => index,
            None => {
                let cost = 8 * (self.matrices.n + self.matrices.m) + 64;
                if self.budget < cost {
                    self.forget_modes();
                }
                self.budget = self.budget.saturating_sub(cost);
                self.slots.push(Slot {
                    factor: None,
                    map: None,
                    uses: 0,
                    trusted: true,
                    increments: None,
                });
                self.modes.insert(key, self.slots.len() - 1);
                self.slots.len() - 1
            }
        };
        self.present = Some((epoch, index));
        &mut self.slots[index]
    }

    /// The factor of the present mode.
    pub fn factor(&mut self, active: &[bool], epoch: u64) -> Arc<ModeFactor> {
        if let Some(factor) = &self.slot(active, epoch).factor {
            return factor.clone();
        }
        let factor = self.driver.mode_factor(active);
        self.slot(active, epoch).factor = Some(factor.clone());
        factor
    }

    /// Solves the present mode, which is regular: `x = [z; l]`; `refined` once more against rounding.
    /// The first time decides whether increments have to be solved for; with short steps each one does.
    #[allow(clippy::too_many_arguments)] // the data of one step
    pub fn solve_mode(
        &mut self,
        sys: &System,
        active: &[bool],
        epoch: u64,
        ends: Ends,
        refined: bool,
        x: &mut [f64],
        work: &mut [f64],
    ) {
        let slot = self.slot(active, epoch);
        let known = slot.increments;
        let factor = self.factor(active, epoch);
        let matrices = &self.matrices;
        if known != Some(true) {
            matrices.solve(&factor, active, ends, refined, x, work);
        }
        if known == Some(false) {
            return;
        }
        let plain = known.is_none().then(|| x.to_vec());
        matrices.sharpen(&factor, active, ends, x, work);
        if let Some(plain) = plain {
            // the step equations have lost digits compared with those for increments
            let better = sys.apart(&plain, x, ends.z0) > OF_SOLUTION;
            if !better {
                x.copy_from_slice(&plain);
            }
            // the short steps of each jump have other charges, and rounding, than those of the last one
            self.slot(active, epoch).increments = (better || !self.impulsive).then_some(better);
        }
    }

    /// Lets go of the factor of the present mode if the driver wants to turn it into another one.
    pub fn release(&mut self) {
        if let (false, Some((_, index))) = (self.driver.keeps_modes(), self.present) {
            self.slots[index].factor = None;
        }
    }

    /// The inputs of the maps and the slot of the present mode.
    pub fn inputs_and_slot(&mut self, active: &[bool], epoch: u64) -> (&MapInputs, &mut Slot) {
        self.slot(active, epoch);
        let index = self.present.map_or(0, |p| p.1);
        (&self.inputs, &mut self.slots[index])
    }

    /// Makes the affine map of the present mode if it is worth its memory.
    pub fn make_map(&mut self, active: &[bool], epoch: u64, work: &mut [f64]) {
        let entries = (self.matrices.n + self.matrices.m) * (self.inputs.len() + 1);
        if entries > MAX_ENTRIES {
            return;
        }
        if self.budget < entries {
            self.forget_modes();
        }
        let factor = self.factor(active, epoch);
        let map = ModeMap::new(&self.matrices, &self.inputs, &factor, active, work);
        self.budget -= entries;
        self.slot(active, epoch).map = Some(map);
    }

    /// Number of modes held.
    pub fn mode_count(&self) -> usize {
        self.slots.len()
    }

    fn forget_modes(&mut self) {
        self.modes.clear();
        self.slots.clear();
        self.present = None;
        self.budget = MODE_BUDGET;
    }
}

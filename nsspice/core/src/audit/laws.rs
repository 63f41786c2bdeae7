//! Checks of the laws and of complementarity at recorded points.

use super::arrays::{Arrays, Places};
use super::branches::Branches;
use super::gates::Gates;
use super::inductor_cut_sets::CutSets;
use super::intervals::Boundaries;
use super::judge::Block;
use super::matrix::Entries;
use super::rounding::{share, Reach};
use super::sources::Sources;
use super::{ratio, worse};
use crate::descriptor::{Linear, Smooth};
use crate::sparse::Csc;
use crate::structure::{Coordinates, Edge, Parts};
use crate::tape::{Linearisation, Tape};

/// Part of its thermal voltage to which that of a junction has to be known.
const RESOLVED: f64 = 0.5;

pub(super) struct Functions {
    pub tape: Tape,
    pub f: Entries,
    pub q: Entries,
    /// of each function: how far it reaches along its slopes from the largest values
    pub reach: Vec<f64>,
    /// the voltages that they read, if they read no potentials
    pub tree: Option<Coordinates>,
    own: Vec<f64>,
}

impl Functions {
    /// Values at a point.
    pub fn values(&mut self, z: &[f64], u: &[f64], t: f64, out: &mut Vec<f64>) {
        match &self.tree {
            Some(tree) => {
                tree.voltages(z, &mut self.own);
                self.tape.evaluate(&self.own, u, t, Linearisation::Exact);
            }
            None => self.tape.evaluate(z, u, t, Linearisation::Exact),
        }
        out.clear();
        out.extend((0..self.tape.program().len()).map(|k| self.tape.value(k)));
    }

    /// Adds what rounding of the values at the last point, and of the largest voltage and current
    /// there, is measured by: in laws, and over the time that rates represent.  If that `part` of them is
    /// as much as the curvature of junctions explains, their slopes explain any current, and none is excused.
    pub fn add_sizes(
        &mut self,
        kinds: &[u8],
        largest: &[f64; 2],
        u: &[f64],
        rate: f64,
        part: f64,
        floor: &mut [f64],
    ) {
        let (program, slopes) = (self.tape.program(), self.tape.slopes());
        let resolved = part * largest[0] <= RESOLVED * program.sharpest();
        let size = |variable: usize| match kinds.get(variable) {
            Some(&kind) => largest[usize::from(kind)],
            None => u.get(variable - kinds.len()).map_or(0.0, |u| u.abs()),
        };
        self.reach.clear();
        self.reach.extend((0..program.len()).map(|k| {
            let steep = self.tape.derivatives(k).map(|(j, slot)| slopes[slot].abs() * size(j));
            self.tape.value(k).abs() + if resolved { steep.sum() } else { 0.0 }
        }));
        self.f.add_sizes(1.0, &self.reach, floor);
        self.q.add_sizes(2.0 * rate, &self.reach, floor);
    }
}

/// The largest of what has been seen so far.
pub(super) struct Seen {
    /// voltage and current of all points
    pub all: [f64; 2],
    /// voltage and current, of intervals and with smooth functions
    pub largest: [f64; 2],
    /// value of each source, and the largest threshold of a pair [V]
    pub given: Vec<f64>,
    pub threshold: f64,
    /// what nodes of fixed potential separate, and the largest current of each part
    pub parts: Parts,
    pub currents: Vec<f64>,
}

/// The worst errors, and what has been checked.
#[derive(Default)]
pub struct Found {
    /// worst relative error of a law
    pub laws: f64,
    /// worst relative error of a pair
    pub complementarity: f64,
    /// where
    pub worst_row: Option<usize>,
    /// where
    pub worst_pair: Option<usize>,
    /// points checked
    pub checks: u64,
    /// steps of the engine that were recorded
    pub steps: u64,
}

impl Found {
    pub(super) fn note_law(&mut self, found: f64, row: usize) {
        if worse(found, self.laws) {
            self.laws = found;
            self.worst_row = Some(row);
        }
    }
}

/// Checks the points of one island.
pub struct Auditor {
    pub(super) arrays: Arrays,
    pub(super) places: Places,
    pub(super) smooth: Option<Functions>,
    /// sums of the sizes of entries
    pub(super) reach: Reach,
    /// what branches are measured by
    pub(super) branches: Branches,
    /// rounding of elimination in units of the tolerance
    pub(super) share: f64,
    pub(super) seen: Seen,
    pub(super) block: Block,
    /// changes between one motion and the next
    pub boundaries: Boundaries,
    /// what came of it
    pub found: Found,
    /// source values; none where records have no instants
    pub sources: Option<Sources>,
    /// inductor cut-sets
    pub(super) cut_sets: Option<CutSets>,
    /// gates of switches; none without them
    pub gates: Option<Gates>,
}

impl Auditor {
    /// Takes gates that have turned, at instants that are known to a tolerance.
    pub fn take_turns(&mut self, turns: &[crate::switch::Turn], tolerance: f64) {
        let largest = self.seen.all[1].max(self.seen.largest[1]);
        if let Some(gates) = &mut self.gates {
            gates.take_turns(turns, largest, tolerance);
        }
    }

    /// Takes the arrays of a system in node voltages, and the capacitors and resistors in them; averaging terms of a theta scheme, if there are any, by unknowns
    /// and by sources; functions, if there are any.
    pub fn new(
        linear: &Linear,
        elements: [&[Edge]; 2],
        averaging: Option<&(Csc, Csc)>,
        smooth: Option<&Smooth>,
    ) -> Auditor {
        let (n, m, p) = linear.sizes();
        let parts = Parts::new(linear, smooth);
        // behind junctions a charge may still rush, and what it will have done there is known less well
        let cut_sets = if smooth.is_none() { CutSets::new(linear) } else { None };
        let smooth = smooth.map(|laws| Functions {
            tape: laws.tape.clone(),
            f: Entries::new(&laws.f),
            q: Entries::new(&laws.q),
            reach: Vec::new(),
            tree: None,
            own: Vec::new(),
        });
        let arrays = Arrays::new(linear, elements, averaging);
        let (e, g) = (Entries::new(&linear.e), &arrays.conductances);
        let mut functional = vec![false; n];
        let functions = smooth.iter().flat_map(|s| s.f.places().chain(s.q.places()));
        functions.for_each(|(row, _)| functional[row] = true);
        let h = arrays.averaging.as_ref().map(|h| &h.0);
        let mut reach = Reach::new(&linear.row_kind, m, &e, g, &arrays.a, h);
        reach.know_pairs([&arrays.a, &arrays.b, &arrays.d], &arrays.q);
        let volts = |pair: &usize| reach.kind(*pair) == 1;
        let thresholds = (0..m).filter(volts).map(|pair| linear.q[pair].abs());
        let seen = Seen {
            all: [0.0; 2],
            largest: [0.0; 2],
            given: vec![0.0; p],
            threshold: thresholds.fold(0.0, f64::max),
            currents: vec![0.0; parts.count()],
            parts,
        };
        Auditor {
            places: Places::new(linear, smooth.as_ref().map(|s| &s.q)),
            branches: Branches::new(&linear.row_kind, &e, g, functional),
            arrays,
            smooth,
            reach,
            share: share(n + m),
            seen,
            block: Block::default(),
            boundaries: Boundaries::default(),
            found: Found::default(),
            sources: None,
            cut_sets,
            gates: None,
        }
    }

    /// Says of what voltages the functions are, if not of potentials.
    pub fn know_tree(&mut self, tree: &Coordinates) {
        if let Some(smooth) = &mut self.smooth {
            smooth.tree = Some(tree.clone());
        }
    }

    /// Numbers of unknowns, pairs and sources.
    pub fn sizes(&self) -> (usize, usize, usize) {
        (self.arrays.n, self.arrays.m, self.arrays.p)
    }

    /// Number of smooth functions.
    pub fn functions(&self) -> usize {
        self.smooth.as_ref().map_or(0, |smooth| smooth.tape.program().len())
    }

    /// The relative error of the balance of charge and flux over a jump: what moved into each row,
    /// plus what impulses brought there, less what sources gave in the meantime, vanishes.
    ///
    /// `stored` is the size of what was there, `sides` are the unknowns before and after.  The jump is
    /// the limit of short steps of the given length together, or one short step of the length `span`.  In a
    /// passive network it counts what sources `gave`: no impulse passes an open pair.
    #[allow(clippy::too_many_arguments)] // all that is known of it
    pub fn jump_error(
        &mut self,
        moved: &[f64],
        stored: &[f64],
        sides: [&[f64]; 2],
        [time, length, span]: [f64; 3],
        sources: &[f64],
        [unknowns, multipliers, functions]: [&[f64]; 3],
        gave: Option<f64>,
    ) -> f64 {
        let mut error = moved.to_vec();
        let mut sizes: Vec<f64> = stored.iter().zip(moved).map(|(s, m)| s + m.abs()).collect();
        self.arrays.g.add(1.0, unknowns, &mut error);
        self.arrays.a.add(1.0, multipliers, &mut error);
        self.arrays.s.add_both(-span, sources, &mut error, &mut sizes);
        if let Some(smooth) = &self.smooth {
            smooth.f.add_both(1.0, functions, &mut error, &mut sizes);
        }
        let hidden =
            self.add_impulses(sides, length.max(span), [unknowns, multipliers], &mut sizes);
        // two short steps count twice and once, so that three times the rounding of one is left
        let mut largest = if self.smooth.is_some() { self.seen.largest } else { [0.0; 2] };
        let mut least = [0.0f64; 2];
        // after a jump potentials may be densities of impulses where nothing is stored, and measure no charge
        let rows = sides[1].iter().zip(&self.places.algebraic);
        let after: Vec<f64> =
            rows.map(|(z, algebraic)| if *algebraic { 0.0 } else { *z }).collect();
        for z in [sides[0], &after] {
            self.reach.see(&self.arrays.kinds, z, &[], &mut largest);
        }
        let mut stored = vec![0.0; self.arrays.n];
        if let Some(smooth) = &mut self.smooth {
            // the potential of a group that floats may be any, and functions at it beyond all numbers
            let mut values = Vec::new();
            let rate = 1.0 / length.max(f64::MIN_POSITIVE);
            for side in sides.into_iter().rev() {
                smooth.values(side, sources, time, &mut values);
                if values.iter().all(|f| f.is_finite()) {
                    // what they conduct counts for a short time only, and nothing is resolved at such a potential
                    smooth.add_sizes(&self.arrays.kinds, &largest, sources, rate, 0.0, &mut stored);
                    break;
                }
            }
            stored.iter_mut().for_each(|s| *s *= length);
        }
        for (row, (&size, &kind)) in sizes.iter().zip(&self.arrays.kinds).enumerate() {
            let usual = length * self.reach.acting(row, &largest);
            let size = size.max(2.0 * self.reach.content(row, &largest) + usual + stored[row]);
            least[usize::from(kind)] = least[usize::from(kind)].max(3.0 * self.share * size);
        }
        // states of equal energy are turned into one another: charge becomes flux by rounding
        let mut energy =
            sides.iter().fold(0.0f64, |a, z| a.max(0.5 * self.arrays.storage.at(|k| z[k])));
        // given charges are in no unknowns
        for (row, (&charge, &kind)) in sizes.iter().zip(&self.arrays.kinds).enumerate() {
            energy = energy.max(self.reach.energy(row, kind, charge));
        }
        for (row, (size, &kind)) in sizes.iter_mut().zip(&self.arrays.kinds).enumerate() {
            let turned = self.share * self.reach.holding(row, kind, energy);
            *size = size.max(least[usize::from(kind)]).max(turned);
        }
        let missing = error.iter().zip(&hidden).map(|(e, hidden)| e.abs() + hidden);
        let through_gaps = gave
            .map(|gave| self.jump_through_gaps(moved, gave, sides, multipliers, (&sizes, energy)));
        let found = missing.zip(&sizes).map(|(e, s)| ratio(e, *s)).chain(through_gaps);
        found.fold(0.0, |worst, new| if worse(new, worst) { new } else { worst })
    }
}

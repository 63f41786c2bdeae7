//! Errors of steps with a tolerance, by a method of their own: what flows at points of the continuous solution is
//! integrated and compared with what is stored.
//!
//! With the charges and fluxes `q(z) = E z` of a state and what flows, `r(z) = G z + A lambda - S u`, a solution of the
//! laws obeys at the nodes `c_i` of a quadrature
//!
//! ```text
//! q(t + c_i h) = q(t) - h sum_j a_ij r(t + c_j h) ,
//! ```
//!
//! up to the error of the quadrature.  By how much a step misses these equations is its error in charge and flux to
//! first order: of its end and of its inside, where rows are written.  A node that stores `C` and is held by a
//! conductance `g` follows its equation of a step `(C + h g) v = ...`: of a charge that is missing there `C / (C + h g)`
//! is left.  It is measured by what was asked of a step: the part `reltol` of the range of the charge (flux), or of the
//! range of the potential (current) times what stores there.  Networks with smooth functions are left out: edges of
//! junctions fall inside of steps, where no quadrature of a few points follows them.
//!
//! The nodes are those of Radau IIA with three stages, order five, one more than the steps (E. Hairer, G. Wanner,
//! *Solving Ordinary Differential Equations II* (1996), section IV.5); its last node is the end of the step.  Neither
//! an estimate of the engine nor a rate of its stages enters.

use super::matrix::Entries;
use super::rounding::{share, Reach};
use super::{ratio, worse, Between, TOLERANCE};
use crate::descriptor::Linear;
use crate::structure::Coordinates;

/// Points of the quadrature, the end of the step included.
pub const NODES: usize = 3;
const SQRT_6: f64 = 2.449_489_742_783_178;
/// Where they are, as parts of the step.
pub const PLACES: [f64; NODES] = [(4.0 - SQRT_6) / 10.0, (4.0 + SQRT_6) / 10.0, 1.0];
/// Weights in the integral up to each of them.
const WEIGHTS: [[f64; NODES]; NODES] = [
    [
        (88.0 - 7.0 * SQRT_6) / 360.0,
        (296.0 - 169.0 * SQRT_6) / 1800.0,
        (-2.0 + 3.0 * SQRT_6) / 225.0,
    ],
    [
        (296.0 + 169.0 * SQRT_6) / 1800.0,
        (88.0 + 7.0 * SQRT_6) / 360.0,
        (-2.0 - 3.0 * SQRT_6) / 225.0,
    ],
    [(16.0 - SQRT_6) / 36.0, (16.0 + SQRT_6) / 36.0, 1.0 / 9.0],
];

/// See `SMALL` of the controller of steps: less than this part of the largest voltage (current) is not resolved.
const SMALL: f64 = 1e-3;

/// What was asked of steps.
#[derive(Clone, Copy, Debug)]
pub struct Asked {
    /// error of a step relative to the range of what is stored
    pub relative: f64,
    /// errors that are always allowed [V], [A]
    pub least: [f64; 2],
}

/// A point of the continuous solution.
#[derive(Clone, Copy)]
pub struct Node<'a> {
    /// unknowns
    pub z: &'a [f64],
    /// multipliers
    pub l: &'a [f64],
    /// sources
    pub u: &'a [f64],
}

/// A step as it is handed over.
#[derive(Clone, Copy)]
pub struct ErringStep<'a> {
    /// what was asked
    pub asked: Asked,
    /// its length [s]
    pub length: f64,
    /// unknowns at its begin
    pub first: &'a [f64],
    /// the last node is its end
    pub nodes: [Node<'a>; NODES],
}

/// The charge (flux) of one law.
#[derive(Clone, Copy, Debug)]
struct Stored {
    /// largest error [C], [Vs]
    error: f64,
    /// least and largest charge, and the same of the potential (current)
    range: [f64; 2],
    potential: [f64; 2],
}

const NONE: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];
const NOTHING: Stored = Stored { error: 0.0, range: NONE, potential: NONE };

/// The laws in node voltages: a charge that is missing at a node is shared by all that store there.
#[derive(Clone, Debug)]
struct Laws {
    kinds: Vec<u8>,
    /// rows with a charge or flux
    storing: Vec<usize>,
    e: Entries,
    /// capacitance or inductance of each row, and the conductance or resistance next to it
    own: Vec<f64>,
    held: Vec<f64>,
    g: Entries,
    a: Entries,
    s: Entries,
    reach: Reach,
    /// the part of its terms that rounding leaves of a law
    rounding: f64,
}

impl Laws {
    fn new(linear: &Linear) -> Laws {
        let (n, m, _) = linear.sizes();
        let [e, g, a, s] = [&linear.e, &linear.g, &linear.a, &linear.s].map(Entries::new);
        let mut storing = vec![false; n];
        e.places().for_each(|(row, _)| storing[row] = true);
        let diagonal = |of: &Entries| {
            let mut out = vec![0.0; n];
            of.entries().filter(|e| e.0 == e.1).for_each(|(row, _, v)| out[row] = f64::abs(v));
            out
        };
        let [own, held] = [&e, &g].map(diagonal);
        Laws {
            reach: Reach::new(&linear.row_kind, m, &e, &g, &a, None),
            kinds: linear.row_kind.clone(),
            storing: (0..n).filter(|&row| storing[row]).collect(),
            e,
            own,
            held,
            g,
            a,
            s,
            rounding: TOLERANCE * share(n + m),
        }
    }

    /// Charges and fluxes of a state.
    fn stored(&self, z: &[f64], out: &mut Vec<f64>) {
        out.clear();
        out.resize(z.len(), 0.0);
        self.e.add(1.0, z, out);
    }

    /// What flows at a point.
    fn flow(&self, z: &[f64], node: &Node, out: &mut Vec<f64>) {
        out.clear();
        out.resize(z.len(), 0.0);
        self.g.add(1.0, z, out);
        self.a.add(1.0, node.l, out);
        self.s.add(-1.0, node.u, out);
    }
}

/// Finds the errors of the recorded steps of a run.
#[derive(Clone, Debug)]
pub struct StepErrors {
    laws: Laws,
    /// the voltages that are unknowns, if they are no potentials
    tree: Option<Coordinates>,
    /// of each law
    found: Vec<Stored>,
    /// largest potential and current
    largest: [f64; 2],
    asked: Option<Asked>,
    /// scratch: what is stored at the begin and the nodes, what flows at the nodes
    stored: [Vec<f64>; NODES + 1],
    flow: [Vec<f64>; NODES],
}

/// Widens a range.
fn widen([least, most]: &mut [f64; 2], value: f64) {
    (*least, *most) = (least.min(value), most.max(value));
}

impl StepErrors {
    pub(super) fn new(linear: &Linear, between: Between) -> StepErrors {
        let Between { capacitors, conductors, coordinates } = between;
        let tree = (!coordinates.are_potentials()).then(|| coordinates.clone());
        let laws = match &tree {
            Some(tree) => Laws::new(&tree.at_nodes_of(linear, capacitors, conductors)),
            None => Laws::new(linear),
        };
        StepErrors {
            laws,
            tree,
            found: vec![NOTHING; linear.e.nrows],
            largest: [0.0; 2],
            asked: None,
            stored: Default::default(),
            flow: Default::default(),
        }
    }

    /// Takes a recorded step.
    pub(super) fn take(&mut self, step: &ErringStep) {
        self.asked = Some(step.asked);
        let ends = std::iter::once(step.first).chain(step.nodes.iter().map(|node| node.z));
        for (k, z) in ends.enumerate() {
            let potentials = self.tree.as_ref().map(|tree| tree.potentials(z));
            let z = potentials.as_deref().unwrap_or(z);
            z.iter().zip(&mut self.found).for_each(|(z, law)| widen(&mut law.potential, *z));
            self.laws.reach.see(&self.laws.kinds, z, &[], &mut self.largest);
            self.laws.stored(z, &mut self.stored[k]);
            if k > 0 {
                self.laws.flow(z, &step.nodes[k - 1], &mut self.flow[k - 1]);
            }
        }
        for &row in &self.laws.storing {
            let missed = WEIGHTS.iter().zip(&self.stored[1..]).map(|(weights, stored)| {
                let came = weights.iter().zip(&self.flow).map(|(w, flow)| w * flow[row]);
                (stored[row] - self.stored[0][row] + step.length * came.sum::<f64>()).abs()
            });
            let missed = missed.fold(0.0, |most, new| if worse(new, most) { new } else { most });
            let law = &mut self.found[row];
            self.stored.iter().for_each(|stored| widen(&mut law.range, stored[row]));
            // what flows is known next to the largest current (voltage)
            let flows = self.laws.reach.acting(row, &self.largest);
            let missed =
                if missed <= self.laws.rounding * step.length * flows { 0.0 } else { missed };
            let stores = self.laws.own[row];
            let left = stores / (stores + step.length * self.laws.held[row]);
            let missed = if left.is_finite() { missed * left } else { missed };
            if worse(missed, law.error) {
                law.error = missed;
            }
        }
    }

    /// The largest error of a step in units of what was asked, next to what rounding of the largest voltage and current
    /// leaves.
    pub(super) fn result(&self) -> f64 {
        let mut found = 0.0;
        let Some(Asked { relative, least }) = self.asked else { return found };
        let Laws { storing, own, reach, rounding, .. } = &self.laws;
        // what hardly moves is asked for to a thousandth of the largest
        let small = self.largest.map(|v| SMALL * v);
        let extent = |[least, most]: [f64; 2]| most - least;
        for &row in storing {
            let law = &self.found[row];
            // steps are asked for errors of potentials, and of currents
            let moved = own[row] * extent(law.potential);
            let range = extent(law.range).max(moved).max(reach.content(row, &small));
            let rounding = rounding * reach.content(row, &self.largest);
            let allowed = relative * range + reach.content(row, &least) + rounding;
            let error = ratio(law.error, allowed.max(f64::MIN_POSITIVE));
            found = if worse(error, found) { error } else { found };
        }
        found
    }
}

//! Errors of steps with a tolerance, by a method of their own: what flows at points of the continuous solution is
//! integrated and compared with what is stored.
//!
//! With the charges and fluxes `q(z) = E z + Q f(z)` of a state and what flows, `r(z) = G z + A lambda + F f - S u`,
//! a solution of the laws obeys at the nodes `c_i` of a quadrature
//!
//! ```text
//! q(t + c_i h) = q(t) - h sum_j a_ij r(t + c_j h) ,
//! ```
//!
//! up to the error of the quadrature.  By how much a step misses these equations is its error in charge and flux to
//! first order: of its end and of its inside, where rows are written.  A node that stores `C` and is held by a
//! conductance `g` follows its equation of a step `(C + h g) v = ...`: of a charge that is missing there `C / (C + h g)`
//! is left.  It is measured by what was asked of a step: the part `reltol` of the range of the charge (flux), or of the
//! range of the potential (current) times what stores there.
//!
//! The nodes are those of Radau IIA with three stages, order five, one more than the steps (E. Hairer, G. Wanner,
//! *Solving Ordinary Differential Equations II* (1996), section IV.5); its last node is the end of the step.  Neither
//! an estimate of the engine nor a rate of its stages enters.

use super::matrix::Entries;
use super::rounding::{share, Reach};
use super::{ratio, worse, Between, TOLERANCE};
use crate::descriptor::{Linear, Smooth};
use crate::structure::Coordinates;
use crate::tape::{Linearisation, Tape};
use crate::tolerances::ACCEPT;

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
    /// values of the smooth functions
    pub f: &'a [f64],
}

/// A step as it is handed over.
#[derive(Clone, Copy)]
pub struct ErringStep<'a> {
    /// what was asked
    pub asked: Asked,
    /// its end and its length [s]
    pub end: f64,
    /// see `end`
    pub length: f64,
    /// unknowns and smooth functions at its begin
    pub first: [&'a [f64]; 2],
    /// the last node is its end
    pub nodes: [Node<'a>; NODES],
}

/// The charge (flux) of one law.
#[derive(Clone, Copy, Debug)]
struct Stored {
    /// largest error [C], [Vs]
    error: f64,
    /// the same over the slope of functions that store it, in units of their variable
    moved: f64,
    /// least and largest charge
    range: [f64; 2],
    /// the variable of the steepest function
    variable: Option<usize>,
}

const NOTHING: Stored =
    Stored { error: 0.0, moved: 0.0, range: [f64::INFINITY, f64::NEG_INFINITY], variable: None };

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
    /// where smooth functions act, and where they are stored
    smooth: Option<[Entries; 2]>,
    reach: Reach,
    /// the part of its terms that rounding leaves of a law
    rounding: f64,
}

impl Laws {
    fn new(linear: &Linear, smooth: Option<&Smooth>) -> Laws {
        let (n, m, _) = linear.sizes();
        let [e, g, a, s] = [&linear.e, &linear.g, &linear.a, &linear.s].map(Entries::new);
        let smooth = smooth.map(|laws| [&laws.f, &laws.q].map(Entries::new));
        let mut storing = vec![false; n];
        let functions = smooth.iter().flat_map(|[_, q]| q.places());
        e.places().chain(functions).for_each(|(row, _)| storing[row] = true);
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
            smooth,
            rounding: TOLERANCE * share(n + m),
        }
    }

    /// Charges and fluxes of a state.
    fn stored(&self, z: &[f64], f: &[f64], out: &mut Vec<f64>) {
        out.clear();
        out.resize(z.len(), 0.0);
        self.e.add(1.0, z, out);
        if let Some([_, q]) = &self.smooth {
            q.add(1.0, f, out);
        }
    }

    /// What flows at a point.
    fn flow(&self, z: &[f64], node: &Node, out: &mut Vec<f64>) {
        out.clear();
        out.resize(z.len(), 0.0);
        self.g.add(1.0, z, out);
        self.a.add(1.0, node.l, out);
        self.s.add(-1.0, node.u, out);
        if let Some([f, _]) = &self.smooth {
            f.add(1.0, node.f, out);
        }
    }
}

/// The steepest slopes of the functions in one law: of those that store and of those that carry.
#[derive(Clone, Copy, Debug, Default)]
struct Slope {
    /// the variable of the steepest that stores
    variable: Option<usize>,
    stores: f64,
    carries: f64,
}

/// Finds the errors of the recorded steps of a run.
#[derive(Clone, Debug)]
pub struct StepErrors {
    laws: Laws,
    /// the voltages that are unknowns, if they are no potentials
    tree: Option<Coordinates>,
    /// of each law
    found: Vec<Stored>,
    /// least and largest value of each unknown, and of each potential
    range: Vec<[f64; 2]>,
    potential: Vec<[f64; 2]>,
    /// largest potential and current
    largest: [f64; 2],
    asked: Option<Asked>,
    tape: Option<Tape>,
    /// scratch: what is stored at the begin and the nodes, what flows at the nodes
    stored: [Vec<f64>; NODES + 1],
    flow: [Vec<f64>; NODES],
    /// sizes of the terms inside functions at the end of the step
    inside: Vec<f64>,
}

/// Widens a range.
fn widen([least, most]: &mut [f64; 2], value: f64) {
    (*least, *most) = (least.min(value), most.max(value));
}

impl StepErrors {
    pub(super) fn new(linear: &Linear, between: Between, smooth: Option<&Smooth>) -> StepErrors {
        let Between { capacitors, conductors, coordinates } = between;
        let n = linear.e.nrows;
        let tree = (!coordinates.are_potentials()).then(|| coordinates.clone());
        let laws = match &tree {
            Some(tree) => Laws::new(
                &tree.at_nodes_of(linear, capacitors, conductors),
                smooth.map(|smooth| tree.smooth_at_nodes(smooth)).as_ref(),
            ),
            None => Laws::new(linear, smooth),
        };
        StepErrors {
            laws,
            tree,
            found: vec![NOTHING; n],
            range: vec![NOTHING.range; n],
            potential: vec![NOTHING.range; n],
            largest: [0.0; 2],
            asked: None,
            tape: smooth.map(|laws| laws.tape.clone()),
            stored: Default::default(),
            flow: Default::default(),
            inside: Vec::new(),
        }
    }

    /// Takes a recorded step.
    pub(super) fn take(&mut self, step: &ErringStep) {
        self.asked = Some(step.asked);
        let ends =
            std::iter::once(step.first).chain(step.nodes.iter().map(|node| [node.z, node.f]));
        for (k, [z, f]) in ends.enumerate() {
            z.iter().zip(&mut self.range).for_each(|(z, range)| widen(range, *z));
            let potentials = self.tree.as_ref().map(|tree| tree.potentials(z));
            let z = potentials.as_deref().unwrap_or(z);
            z.iter().zip(&mut self.potential).for_each(|(z, range)| widen(range, *z));
            self.laws.reach.see(&self.laws.kinds, z, &[], &mut self.largest);
            self.laws.stored(z, f, &mut self.stored[k]);
            if k > 0 {
                self.laws.flow(z, &step.nodes[k - 1], &mut self.flow[k - 1]);
            }
        }
        let slopes = self.slopes(step);
        for &row in &self.laws.storing {
            let missed = WEIGHTS.iter().zip(&self.stored[1..]).map(|(weights, stored)| {
                let came = weights.iter().zip(&self.flow).map(|(w, flow)| w * flow[row]);
                (stored[row] - self.stored[0][row] + step.length * came.sum::<f64>()).abs()
            });
            let missed = missed.fold(0.0, |most, new| if worse(new, most) { new } else { most });
            let law = &mut self.found[row];
            self.stored.iter().for_each(|stored| widen(&mut law.range, stored[row]));
            // what flows is known next to the largest current (voltage), and to the terms inside of functions, to which
            // Newton's method solves stages
            let flows = self.inside[row] + self.laws.reach.acting(row, &self.largest);
            let known = if self.tape.is_some() { ACCEPT } else { 0.0 };
            let rounded = self.laws.rounding.max(known) * step.length * flows;
            let missed = if missed <= rounded { 0.0 } else { missed };
            let Slope { variable, stores, carries } = slopes[row];
            let stores = stores + self.laws.own[row];
            let carried = step.length * (carries + self.laws.held[row]);
            let moved = if missed > 0.0 { missed / (stores + carried) } else { missed };
            let missed = if moved.is_finite() { moved * stores } else { missed };
            if worse(missed, law.error) {
                law.error = missed;
            }
            if variable.is_some() && worse(moved, law.moved) {
                (law.moved, law.variable) = (moved, variable);
            }
        }
    }

    /// Of each law the steepest slopes of functions at the end of a step.  Finds what cancels inside functions, too.
    fn slopes(&mut self, step: &ErringStep) -> Vec<Slope> {
        let n = self.found.len();
        let mut found = vec![Slope::default(); n];
        self.inside.clear();
        self.inside.resize(n, 0.0);
        let (Some(tape), Some([f, q])) = (&mut self.tape, &self.laws.smooth) else { return found };
        let [.., node] = &step.nodes;
        tape.evaluate(node.z, node.u, step.end, Linearisation::Exact);
        // where terms cancel their own values say nothing
        let (kinds, largest) = (&self.laws.kinds, self.largest);
        let value = |j: usize| match kinds.get(j) {
            Some(&kind) => largest[usize::from(kind)],
            None => node.u.get(j - n).map_or(0.0, |u| u.abs()),
        };
        for (row, k, factor) in f.entries() {
            let slopes = tape.derivatives(k).map(|(j, slot)| tape.slopes()[slot].abs() * value(j));
            self.inside[row] += factor.abs() * slopes.sum::<f64>();
            for (_, slot) in tape.derivatives(k).filter(|e| e.0 < n) {
                let slope = (factor * tape.slopes()[slot]).abs();
                found[row].carries = found[row].carries.max(slope);
            }
        }
        for (row, k, factor) in q.entries() {
            for (variable, slot) in tape.derivatives(k).filter(|e| e.0 < n) {
                let slope = (factor * tape.slopes()[slot]).abs();
                if slope > found[row].stores {
                    (found[row].variable, found[row].stores) = (Some(variable), slope);
                }
            }
        }
        found
    }

    /// The largest error of a step in units of what was asked, next to what rounding of the largest voltage and current
    /// leaves.
    pub(super) fn result(&self) -> f64 {
        let mut found = 0.0;
        let Some(Asked { relative, least }) = self.asked else { return found };
        let Laws { kinds, storing, own, reach, rounding, .. } = &self.laws;
        // what hardly moves is asked for to a thousandth of the largest
        let small = self.largest.map(|v| SMALL * v);
        let extent = |[least, most]: [f64; 2]| most - least;
        for &row in storing {
            let law = &self.found[row];
            // steps are asked for errors of potentials, and of currents
            let moved = own[row] * extent(self.potential[row]);
            let range = extent(law.range).max(moved).max(reach.content(row, &small));
            let rounding = rounding * reach.content(row, &self.largest);
            let allowed = relative * range + reach.content(row, &least) + rounding;
            let mut error = ratio(law.error, allowed.max(f64::MIN_POSITIVE));
            if let Some(variable) = law.variable {
                let kind = usize::from(kinds[variable]);
                let range = extent(self.range[variable]).max(small[kind]);
                let other = ratio(law.moved, relative * range + least[kind]);
                error = if worse(error, other) { other } else { error };
            }
            found = if worse(error, found) { error } else { found };
        }
        found
    }
}

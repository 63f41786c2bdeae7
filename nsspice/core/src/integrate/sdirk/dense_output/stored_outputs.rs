//! Outputs that are stored quantities: voltages across capacitors, currents of inductors.  The
//! continuous solution gives them without solving for the rest.

use super::polynomial::{Curve, Moments};
use super::rows::Inside;
use super::source_outputs::Driven;
use crate::integrate::implicit::outputs::Sum;
use crate::integrate::implicit::stepper::Stepper;
use crate::integrate::sdirk::step::Trial;
use crate::tolerances::CLEARLY;
use crate::union_find::UnionFind;

/// With fewer rows than this in a step it is not worth while to look.
const WORTH: f64 = 3.0;

/// Decides for each step whether its rows may come from the polynomial alone.  Of parts that are
/// stiffer than the step is short it is less reliable than the laws.
pub struct StoredRows {
    /// the outputs as sums of unknowns, if all are stored
    sums: Option<Vec<Sum>>,
    /// what they have of sources in addition
    driven: Driven,
    curve: Curve,
    /// largest outputs so far
    largest: Vec<f64>,
    exact: Vec<f64>,
    plain: Vec<f64>,
}

impl StoredRows {
    pub fn new(s: &Stepper) -> StoredRows {
        let zeros = vec![0.0; s.recorder.outputs.len()];
        let (sums, parts) = stored_outputs(s).unzip();
        StoredRows {
            sums,
            driven: Driven::parts(parts.unwrap_or_default()),
            curve: Curve::new(zeros.len()),
            largest: zeros.clone(),
            exact: zeros.clone(),
            plain: zeros,
        }
    }

    /// Whether the polynomial gives the rows of a step; at its middle it is compared with what the laws
    /// say.
    pub(in crate::integrate::sdirk) fn plain(&mut self, step: &mut Inside) -> bool {
        let Some(sums) = self.sums.as_ref().filter(|_| step.rows > WORTH) else { return false };
        let middle = 0.5 * step.end;
        step.by_laws(middle, &mut self.exact);
        self.curve.follow(sums, step.trial, step.tableau);
        let mut plain = std::mem::take(&mut self.plain);
        self.write(step.s, step.trial, middle, &mut plain);
        let mut near = true;
        for ((a, b), largest) in self.exact.iter().zip(&plain).zip(&mut self.largest) {
            *largest = largest.max(a.abs());
            near &= (a - b).abs() <= CLEARLY * step.tolerance * *largest;
        }
        self.plain = plain;
        near
    }

    /// The outputs at the part `theta` of the step.
    pub(in crate::integrate::sdirk) fn write(
        &self,
        s: &Stepper,
        trial: &mut Trial,
        theta: f64,
        row: &mut [f64],
    ) {
        self.curve.write(theta, row);
        if !self.driven.is_empty() {
            trial.look_up_sources(s, theta);
            self.driven.add(&trial.at.u, row);
        }
    }

    /// Sums of rows.
    pub(in crate::integrate::sdirk) fn write_sums(&self, moments: &Moments, row: &mut [f64]) {
        self.curve.write_sums(moments, row);
        self.driven.add(&moments.sources, row);
    }
}

/// The outputs of `s` as sums of unknowns, and of sources, if every one is a combination of quantities that
/// linear capacitors and inductors store, with sources, and no such quantity is determined by the laws alone.
fn stored_outputs(s: &Stepper) -> Option<(Vec<Sum>, Vec<Sum>)> {
    s.solver.smooth.as_ref()?;
    let linear = &s.solver.sys.linear;
    let (n, kind) = (s.state.z.len(), &linear.row_kind);
    // unknowns joined by capacitors, and ground: in each group all differences are stored
    let (mut groups, ground) = (UnionFind::new(n + 1), n);
    let mut rest = vec![0.0; n]; // what the capacitors of a node lead to ground
    let mut stores = vec![false; n];
    for (r, c, v) in linear.e.iter().filter(|e| e.2 != 0.0) {
        stores[r] = true;
        rest[r] += v;
        if kind[r] == 0 && kind[c] == 0 && r != c {
            groups.join(r, c);
        }
    }
    let size = |r: usize| linear.e.iter().filter(|e| e.0 == r).map(|e| e.2.abs()).sum::<f64>();
    for r in (0..n).filter(|&r| kind[r] == 0 && stores[r]) {
        if rest[r].abs() > 1e-9 * size(r) {
            groups.join(r, ground);
        }
    }
    let fit = |groups: &mut UnionFind, output: &[(usize, f64)]| {
        let mut sums = vec![(0.0f64, 0.0f64); n + 1];
        for &(j, factor) in output {
            if kind[j] == 1 {
                if !stores[j] {
                    return false;
                }
                continue;
            }
            let group = groups.root(j);
            if !stores[j] {
                return false;
            }
            sums[group].0 += factor;
            sums[group].1 += factor.abs();
        }
        let ground = groups.root(ground);
        sums.iter().enumerate().all(|(g, s)| g == ground || s.0.abs() <= 1e-12 * s.1)
    };
    let outputs = s.recorder.outputs.of_unknowns()?;
    if !outputs.iter().all(|[unknowns, _]| fit(&mut groups, unknowns)) {
        return None;
    }
    // a loop of capacitors and voltage laws connects what they store
    let mut tied = true;
    for r in (0..n).filter(|&r| kind[r] == 1 && !stores[r]) {
        let law = linear.g.iter().filter(|g| g.0 == r && g.2 != 0.0 && kind[g.1] == 0);
        let nodes: Vec<usize> = law.map(|g| g.1).collect();
        tied &= match nodes[..] {
            [] => true,
            [a] => groups.join(a, ground),
            [a, b] => groups.join(a, b),
            _ => false,
        };
    }
    tied.then(|| outputs.into_iter().map(|[unknowns, sources]| (unknowns, sources)).unzip())
}

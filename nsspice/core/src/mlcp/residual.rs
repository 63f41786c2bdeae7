//! How far a point is from solving the problem, free of units and of scale.

use super::model::Model;
use super::problem::Role;
use crate::tolerances::FLOOR;

/// Relative violations of a mixed complementarity problem; both are 0 at a solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residual {
    /// equations `K z + A l = b`, each relative to the size of its terms
    pub rows: f64,
    /// `min(l, w)` (or `w` of a closed, `l` of an open switch) relative to the currents and
    /// voltages of the network
    pub complementarity: f64,
}

impl Residual {
    /// The residual of a point that is not finite.
    pub const INFINITE: Residual = Residual { rows: f64::INFINITY, complementarity: f64::INFINITY };

    /// The larger of the two.
    pub fn worst(&self) -> f64 {
        self.rows.max(self.complementarity)
    }
}

/// Residual of `x = [z; l]` for the right-hand side `f = [b; -q]`.
///
/// With `unit`, no law is measured by less than that part of what the largest voltage drives through
/// its conductances (the largest current through its resistances).
///
/// `terms` receives `|H| |x| + |f|`, `defect` receives `f - H x` with `H = [[K, A], [-B, D]]`
/// (so that `w` is minus its second part).
pub(crate) fn residual(
    model: &Model,
    roles: &[Role],
    f: &[f64],
    x: &[f64],
    unit: f64,
    terms: &mut [f64],
    defect: &mut [f64],
) -> Residual {
    if !x.iter().all(|v| v.is_finite()) {
        return Residual::INFINITE;
    }
    let n = model.n;
    model.defect_and_terms(f, x, defect, terms);

    let mut largest = [0.0f64; 2]; // terms of KCL and KVL rows
    let mut unknown = [0.0f64; 2]; // largest node voltage and branch current
    for i in 0..n {
        let kind = model.kind(i);
        largest[kind] = largest[kind].max(terms[i]);
        unknown[kind] = unknown[kind].max(x[i].abs());
    }
    let node = unknown[0];
    let floor = [FLOOR * largest[0], FLOOR * largest[1].max(node)];
    let mut rows = 0.0f64;
    for i in 0..n {
        let kind = model.kind(i);
        let mut scale = terms[i].max(floor[kind]);
        if unit > 0.0 && defect[i].abs() > unit * scale {
            scale = scale.max(unit * unknown[kind] * model.own_kind(i));
        }
        rows = worse(rows, defect[i].abs(), scale);
    }

    let mut current = 0.0f64; // scale of the multipliers
    let mut voltage = largest[1].max(node); // scale of the slacks
    for &r in &model.touched {
        current = current.max(terms[r]);
    }
    for i in n..x.len() {
        current = current.max(x[i].abs());
        voltage = voltage.max(terms[i]);
    }
    let mut complementarity = 0.0f64;
    for (i, role) in roles.iter().enumerate() {
        let (l, w) = (x[n + i], -defect[n + i]);
        let relative = |v: f64, scale: f64| if v == 0.0 { 0.0 } else { v / scale };
        let (l, w) = (relative(l, current), relative(w, voltage));
        let violation = match role {
            Role::Diode => l.min(w),
            Role::Closed => w,
            Role::Open => l,
        };
        complementarity = worse(complementarity, violation.abs(), 1.0);
    }
    Residual { rows, complementarity }
}

/// The larger of `so_far` and `value / scale`; anything not finite counts as infinite.
fn worse(so_far: f64, value: f64, scale: f64) -> f64 {
    if value == 0.0 {
        return so_far;
    }
    let ratio = value / scale;
    if ratio.is_finite() {
        so_far.max(ratio)
    } else {
        f64::INFINITY
    }
}

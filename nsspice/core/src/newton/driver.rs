//! The linearised problem by the complementarity driver, where the mode is singular or not found.

use super::equations::Equations;
use super::linear::Assembly;
use crate::mlcp::{Driver, Problem, Role, Start};
use crate::sparse::Csc;

/// Moves `x` to a solution of the linearised problem near it; `defect` belongs to `x`.  Returns the
/// highest stage of the driver, or None if there is no solution.
pub(super) fn step(
    eq: &Equations,
    assembly: &Assembly,
    defect: &[f64],
    roles: &[Role],
    q: &[f64],
    x: &mut [f64],
    active: &mut [bool],
) -> Option<u8> {
    let n = eq.n;
    let full = &eq.pattern;
    let mut k = Vec::with_capacity(assembly.values.len());
    // K z+ + A l+ = defect + K z + A l
    let mut right = defect[..n].to_vec();
    for (c, &value) in x.iter().enumerate() {
        for at in full.colptr[c]..full.colptr[c + 1] {
            let (r, v) = (full.rowidx[at], assembly.values[at]);
            if r >= n {
                continue;
            }
            right[r] += v * value;
            if c < n {
                k.push((r, c, v));
            }
        }
    }
    if !right.iter().all(|v| v.is_finite()) {
        return None;
    }
    let mut driver = Driver::new(Problem {
        k: Csc::from_triplets(n, n, &k),
        a: eq.a.clone(),
        b: eq.b.clone(),
        d: eq.d.clone(),
        row_kind: eq.row_kind.clone(),
    });
    let (z, l) = x.split_at_mut(n);
    let solved = driver.solve(&right, q, roles, z, l, Start::Warm).ok()?;
    active.copy_from_slice(driver.active());
    Some(solved.stage)
}

//! From an approximate solution to one that is exact up to rounding.

use super::residual::Residual;
use super::scratch::{Scale, Scratch};

const IDENTIFICATIONS: usize = 3;

/// Takes the active set from the signs of the approximate solution `point`, moves to the nearest
/// solution of its equations, and lets signs correct the set up to three times.
pub(crate) fn polish(s: &mut Scratch, point: &[f64]) -> Option<Residual> {
    if !point.iter().all(|v| v.is_finite()) {
        return None;
    }
    s.x.copy_from_slice(point);
    s.activate_from_signs();
    for _ in 0..=IDENTIFICATIONS {
        s.x.copy_from_slice(point);
        s.solve_mode();
        if let Some(found) = s.judge_strictly() {
            return Some(found);
        }
        if s.identify(Scale::Own) == 0 {
            return None;
        }
        s.adopt();
    }
    None
}

//! What reinitialising steps have to be short against: the fastest times of a circuit.

use crate::integrate::implicit::instants::state_jumps::StateJumps;
use crate::sparse::Csc;

/// Times of junctions are estimates, and their charges small: compared with them 1e-5 is short.
const OF_FUNCTIONS: f64 = 1e3;
/// An estimate of the fastest time constant [s]: largest rate at which stored quantities act on each
/// other, directly or through one algebraic unknown, in coordinates with unit storage.
pub(in crate::integrate) fn fastest_time(e: &Csc, g: &Csc) -> f64 {
    let n = g.nrows;
    let mut storage = vec![0.0; n];
    let mut diagonal = vec![0.0; n];
    for (matrix, out) in [(e, &mut storage), (g, &mut diagonal)] {
        for (_, c, v) in matrix.iter().filter(|e| e.0 == e.1) {
            out[c] = v.abs().sqrt();
        }
    }
    // strongest coupling of each algebraic unknown to stored quantities, as row and as column
    let (mut into, mut from) = (vec![0.0f64; n], vec![0.0f64; n]);
    let mut rate = 0.0f64;
    for (r, c, v) in g.iter() {
        match (storage[r] > 0.0, storage[c] > 0.0) {
            (true, true) => rate = rate.max(v.abs() / (storage[r] * storage[c])),
            (false, true) if diagonal[r] > 0.0 => {
                into[r] = into[r].max(v.abs() / (diagonal[r] * storage[c]));
            }
            (true, false) if diagonal[c] > 0.0 => {
                from[c] = from[c].max(v.abs() / (storage[r] * diagonal[c]));
            }
            _ => {}
        }
    }
    rate = into.iter().zip(&from).map(|(a, b)| a * b).fold(rate, f64::max);
    1.0 / rate // infinite if nothing couples
}

impl StateJumps<'_> {
    /// What reinitialising steps have to be short against [s]: charges of junctions move in times that the
    /// present state gives.
    pub(in crate::integrate) fn shortest_time(&mut self) -> f64 {
        let known = self.step_length.min(self.facts.fastest);
        let instant = f64::EPSILON * self.step_length; // no time at all compared with the steps
                                                       // the charge of a blocking junction may be next to nothing, and as fast
        let (linear, u, time) = (&self.solver.sys.linear, &self.state.u0, self.state.time);
        let Some(smooth) = &mut self.solver.smooth else { return known };
        let Some(e) = smooth.stored(linear, &self.state.z, u, time, instant) else { return known };
        let g = smooth.conducting(linear);
        let time = fastest_time(&e, g);
        known.min(OF_FUNCTIONS * time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(n: usize, entries: &[(usize, usize, f64)]) -> Csc {
        Csc::from_triplets(n, n, entries)
    }

    fn near(found: f64, expected: f64) {
        assert!((found - expected).abs() <= 4.0 * f64::EPSILON * expected, "{found} {expected}");
    }

    #[test]
    fn the_fastest_time_of_simple_circuits() {
        // R C, sqrt(L C), and L/R through the node of a resistor
        near(fastest_time(&matrix(1, &[(0, 0, 3e-6)]), &matrix(1, &[(0, 0, 1e-3)])), 3e-3);
        let swing = [(0, 1, 1.0), (1, 0, -1.0)];
        let stored = [(0, 0, 4e-6), (1, 1, 1e-6)];
        near(fastest_time(&matrix(2, &stored), &matrix(2, &swing)), 2e-6);
        let node = [(0, 0, 0.5), (0, 1, 1.0), (1, 0, -1.0)];
        near(fastest_time(&matrix(2, &[(1, 1, 6e-3)]), &matrix(2, &node)), 3e-3);
    }

    #[test]
    fn what_nothing_couples_has_no_time() {
        let alone = fastest_time(&matrix(1, &[(0, 0, 1.0)]), &matrix(1, &[]));
        assert_eq!(alone, f64::INFINITY);
    }
}

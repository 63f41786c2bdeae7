//! What a jump may be judged against, and whether its impulses pass through gaps.

use super::laws::Auditor;
use super::ratio;

impl Auditor {
    /// Adds what impulses bring to each law over a jump to the sizes of the rest of it, but no more of
    /// currents and potentials than something calls for.
    ///
    /// A closed switch next to a conducting diode is a loop in which any current may go round, that of a
    /// jump as well, and of a part without ground any potential may jump.  A law would hold to the
    /// rounding of such a value, however much of the charge that the jump moves is lost in it.  What a
    /// branch has to carry leaves the network in stores, resistances, controlled sources or sources: the
    /// sum over all laws of what meets there besides branches is the most that a branch may count for,
    /// and a resistance counts for the voltage across it.  States pass the time of short steps as well,
    /// so that what they bring about in it is added.  Returns what the rounding of more than that may
    /// hide in each law.
    pub(super) fn add_impulses(
        &self,
        sides: [&[f64]; 2],
        time: f64,
        [unknowns, multipliers]: [&[f64]; 2],
        sizes: &mut [f64],
    ) -> Vec<f64> {
        let mut branches = vec![0.0; self.arrays.n];
        // called for, in laws of currents and of voltages
        let mut called = [0.0f64; 2];
        for &(a, b, value) in self.arrays.g.elements() {
            let [from, to] = [a, b].map(|k| if k < 0 { 0.0 } else { unknowns[k as usize] });
            let across = (from - to).abs();
            called[1] += across;
            let carried = value.abs() * across + self.rounded(value * from.abs().max(to.abs()));
            [a, b].iter().filter(|k| **k >= 0).for_each(|&k| sizes[k as usize] += carried);
        }
        for (row, column, value) in self.arrays.g.rest().entries() {
            let (own, impulse) = (self.arrays.kinds[row], unknowns[column].abs());
            let branch = value.abs() == 1.0 && own != self.arrays.kinds[column];
            let to = if branch { &mut branches[row] } else { &mut sizes[row] };
            *to += value.abs() * impulse;
            if own == self.arrays.kinds[column] {
                called[usize::from(1 - own)] += impulse;
            }
        }
        for (row, pair, value) in self.arrays.a.entries() {
            let branch = value.abs() == 1.0 && self.arrays.kinds[row] != self.reach.kind(pair);
            let to = if branch { &mut branches[row] } else { &mut sizes[row] };
            *to += (value * multipliers[pair]).abs();
        }
        for (_, pair, _) in self.arrays.d.entries().filter(|e| e.2 != 0.0) {
            called[usize::from(1 - self.reach.kind(pair))] += multipliers[pair].abs();
        }
        for (row, &kind) in self.arrays.kinds.iter().enumerate() {
            called[usize::from(kind)] += sizes[row];
            if !self.places.algebraic[row] {
                let state = sides.iter().fold(0.0f64, |most, z| most.max(z[row].abs()));
                called[usize::from(1 - kind)] += time * state;
            }
        }
        for ((size, branch), &kind) in sizes.iter_mut().zip(&mut branches).zip(&self.arrays.kinds) {
            let most = called[usize::from(kind)];
            if *branch > most {
                *size += most;
                *branch *= f64::EPSILON;
            } else {
                // NaN stays NaN
                *size += *branch;
                *branch = 0.0;
            }
        }
        branches
    }

    /// What the rounding of a product may be, in units of the tolerance.
    fn rounded(&self, product: f64) -> f64 {
        3.0 * self.share * product.abs()
    }

    /// The energy with which impulses of a passive network pass through open pairs, relative to what
    /// charges of these `sizes` in its laws, or the stored `energy`, are worth: `Lambda' w` of the
    /// multipliers and the slacks after the jump.
    ///
    /// By the laws that is what the moved charges bring to the potentials after the jump, less what
    /// sources `gave`, and what charges lose at the thresholds of diodes.  It vanishes in the one jump that the
    /// pairs allow, and less energy is lost in all that have more (Moreau's law of impacts).
    pub(super) fn jump_through_gaps(
        &self,
        moved: &[f64],
        gave: f64,
        sides: [&[f64]; 2],
        multipliers: &[f64],
        (sizes, energy): (&[f64], f64),
    ) -> f64 {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let open = dot(sides[1], moved) - gave + dot(&self.arrays.q, multipliers);
        if open <= 0.0 {
            return 0.0; // short steps dissipate a little
        }
        // after a jump potentials may be densities of impulses where nothing is stored, and are worth nothing
        let rows = sizes.iter().zip(sides[0]).zip(sides[1]).zip(&self.places.algebraic);
        let worth = rows.map(|(((s, before), after), algebraic)| {
            s * if *algebraic { before.abs() } else { before.abs() + after.abs() }
        });
        // charges that are given are in no unknowns
        ratio(open, worth.sum::<f64>().max(energy))
    }
}

#[cfg(test)]
mod tests {
    use super::super::TOLERANCE;
    use super::*;
    use crate::descriptor::Linear;
    use crate::sparse::Csc;

    /// Two capacitors of 1 F, each to ground, and between them two elements side by side.
    fn auditor() -> Auditor {
        let linear = Linear {
            e: Csc::from_triplets(2, 2, &[(0, 0, 1.0), (1, 1, 1.0)]),
            g: Csc::zeros(2, 2),
            a: Csc::from_triplets(2, 2, &[(0, 0, 1.0), (1, 0, -1.0), (0, 1, -1.0), (1, 1, 1.0)]),
            b: Csc::from_triplets(2, 2, &[(0, 0, 1.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)]),
            d: Csc::zeros(2, 2),
            q: vec![0.0, 0.5],
            s: Csc::zeros(2, 0),
            row_kind: vec![0; 2],
        };
        Auditor::new(&linear, [&[]; 2], None, None)
    }

    /// The error of a jump, with the energy that sources gave if it counts.
    fn error(before: [f64; 2], after: [f64; 2], multipliers: [f64; 2], gave: Option<f64>) -> f64 {
        let moved = [after[0] - before[0], after[1] - before[1]];
        let stored = before.map(f64::abs);
        let none = &[][..];
        auditor().jump_error(
            &moved,
            &stored,
            [&before, &after],
            [0.0; 3],
            none,
            [&[0.0; 2], &multipliers, none],
            gave,
        )
    }

    #[test]
    fn what_goes_round_in_a_loop_excuses_nothing() {
        for round in [0.0, 1.0, 1e4] {
            let found = error([2.0, 0.0], [1.0, 1.0], [1.0 + round, round], None);
            assert!(found < 1e-3 * TOLERANCE);
        }
        // one charge lost, by itself and in the rounding of what goes round
        for round in [0.0, 1.0, 1e16] {
            assert!(error([2.0, 0.0], [1.0, 0.0], [round, round], None) > TOLERANCE);
        }
    }

    #[test]
    fn no_impulse_passes_a_gap() {
        // the second element has a threshold of 0.5 V, and the first none
        let found = |after: f64, through: [f64; 2], gave: f64| {
            let charges = [2.0 - after + through[1], through[1]];
            error([2.0, 0.0], [after, 2.0 - after], charges, Some(gave))
        };
        assert!(found(1.0, [0.0; 2], 0.0) < TOLERANCE);
        // both capacitors at 1 V, or the first discharged beyond that: 4 V s A of reverse voltage
        assert!(found(0.0, [0.0; 2], 0.0) > 1e-3);
        assert!(found(0.9, [0.0; 2], 0.0) > 1e-3);
        // a charge that stops halfway leaves a forward voltage, which complementarity shows
        assert!(found(1.5, [0.0; 2], 0.0) < TOLERANCE);
        // of what goes round through both, the threshold takes its part
        assert!(found(1.0, [0.0, 0.1], 0.0) > TOLERANCE);
        assert!(found(1.0, [0.0, 0.1], 0.06) < TOLERANCE);
        // what a source gave has gone somewhere
        assert!(found(0.9, [0.0; 2], 0.3) < TOLERANCE);
        assert!(found(f64::NAN, [0.0; 2], 0.0).is_nan());
    }

    #[test]
    fn charges_that_are_given_are_worth_something() {
        // all is lost at the start, where unknowns are zero on both sides but for rounding
        let (moved, stored, none) = ([-2.0, 2.0], [2.0, 2.0], &[][..]);
        let impulses = [&[0.0; 2][..], &[2.0, 0.0][..], none];
        let sides = [&[0.0; 2][..], &[-1e-30, 0.0][..]];
        let mut auditor = auditor();
        let found = auditor.jump_error(&moved, &stored, sides, [0.0; 3], none, impulses, Some(0.0));
        assert!(found < TOLERANCE, "{found}");
    }
}

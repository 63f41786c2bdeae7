//! Unknowns that sources alone give, one after the other: what is left of a law in which the others are known.

use crate::descriptor::Linear;
use crate::waveform::Waveform;

/// An unknown that follows from the sources of a law, and from unknowns that are given before it.
#[derive(Clone, Debug)]
pub struct Given {
    /// which unknown
    pub unknown: usize,
    /// the law
    pub row: usize,
    /// its factor there
    pub factor: f64,
    /// the other unknowns of the law, and their factors
    pub others: Vec<(usize, f64)>,
}

/// Finds such unknowns by laws in which nothing is stored and no pair appears; `functions` are the laws in which
/// functions appear.
pub fn given_by_sources(
    linear: &Linear,
    functions: impl Iterator<Item = usize>,
    wanted: impl Fn(usize) -> bool,
) -> Vec<Given> {
    let n = linear.g.nrows;
    let mut laws: Vec<Vec<(usize, f64)>> = vec![Vec::new(); n];
    linear.g.iter().filter(|e| e.2 != 0.0).for_each(|(row, c, v)| laws[row].push((c, v)));
    let mut waiting: Vec<bool> = (0..n).map(wanted).collect();
    let more = linear.e.iter().chain(linear.a.iter()).filter(|e| e.2 != 0.0).map(|e| e.0);
    more.chain(functions).for_each(|row| waiting[row] = false);
    let mut rows: Vec<usize> = (0..n).filter(|&row| waiting[row]).collect();
    let (mut known, mut found) = (vec![false; n], Vec::new());
    loop {
        let before = rows.len();
        rows.retain(|&row| {
            let mut open = laws[row].iter().filter(|e| !known[e.0]);
            let (Some(&(unknown, factor)), None) = (open.next(), open.next()) else { return true };
            let others = laws[row].iter().copied().filter(|e| e.0 != unknown).collect();
            found.push(Given { unknown, row, factor, others });
            known[unknown] = true;
            false
        });
        if rows.len() == before {
            return found;
        }
    }
}

/// The unknowns that constant and piecewise linear sources alone determine.  Their rates are exact, too; those of
/// a sine are as good as the step, and are what flows into a capacitor across it.
pub fn fixed_by_lines(linear: &Linear, functions: &[usize], waveforms: &[Waveform]) -> Vec<bool> {
    let mut curved = vec![false; linear.g.nrows];
    let smooth = |w: &Waveform| matches!(w, Waveform::Smooth(_));
    linear.s.iter().filter(|e| smooth(&waveforms[e.1])).for_each(|(row, ..)| curved[row] = true);
    let mut fixed = vec![false; linear.g.nrows];
    for known in given_by_sources(linear, functions.iter().copied(), |_| true) {
        let lines = |others: &[(usize, f64)], fixed: &[bool]| others.iter().all(|e| fixed[e.0]);
        fixed[known.unknown] = !curved[known.row] && lines(&known.others, &fixed);
    }
    fixed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::Csc;

    /// Sources at nodes 0 and 1 (currents 2 and 3), the second of them a sine above the first.
    #[test]
    fn what_a_sine_moves_is_not_fixed() {
        let g = [(0, 2, 1.0), (2, 0, -1.0), (1, 3, 1.0), (3, 1, -1.0), (3, 0, 1.0), (0, 3, -1.0)];
        let linear = Linear {
            e: Csc::zeros(4, 4),
            g: Csc::from_triplets(4, 4, &g),
            a: Csc::zeros(4, 0),
            b: Csc::zeros(0, 4),
            d: Csc::zeros(0, 0),
            q: Vec::new(),
            s: Csc::from_triplets(4, 2, &[(2, 0, -1.0), (3, 1, -1.0)]),
            row_kind: vec![0, 0, 1, 1],
        };
        let sine = [0.0, 1.0, 50.0, 0.0, 0.0, 0.0];
        let wave = |kind, values: &[f64]| Waveform::new(kind, values, f64::NAN, 1.0).unwrap();
        let both = [wave("dc", &[3.0]), wave("sin", &sine)];
        assert_eq!(fixed_by_lines(&linear, &[], &both)[..2], [true, false]);
        let both = [wave("dc", &[3.0]), wave("dc", &[1.0])];
        assert_eq!(fixed_by_lines(&linear, &[], &both)[..2], [true, true]);
        assert_eq!(fixed_by_lines(&linear, &[3], &both)[..2], [true, false]);
    }
}

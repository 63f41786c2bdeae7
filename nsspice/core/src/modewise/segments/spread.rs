//! Many functionals along a trajectory as factors of its terms, term by term: rows of a table are then
//! products of matrices.

use crate::dense::widest;

/// Functionals side by side in registers.
const SIDE: usize = 4;

/// Factors of each slot, one row of `width` numbers each: those of all functionals, then zeros.
#[derive(Default)]
pub struct Spread {
    width: usize,
    factor: Vec<f64>,
}

impl Spread {
    /// Makes room for so many functionals of so many slots, all zero.
    pub fn clear(&mut self, count: usize, slots: usize) {
        self.width = count.next_multiple_of(SIDE);
        self.factor.clear();
        self.factor.resize(slots * self.width, 0.0);
    }

    /// Adds a multiple of one number for each functional to the factors of a slot.
    #[inline]
    pub fn add(&mut self, slot: usize, by: f64, numbers: &[f64]) {
        if by != 0.0 {
            let row = &mut self.factor[slot * self.width..(slot + 1) * self.width];
            crate::dense::add_scaled(row, by, numbers);
        }
    }

    /// Takes some functionals of others.
    pub fn choose(&mut self, of: &Spread, functionals: &[usize]) {
        let slots = of.factor.len() / of.width.max(1);
        self.clear(functionals.len(), slots);
        let rows = self.factor.chunks_exact_mut(self.width.max(1));
        for (row, all) in rows.zip(of.factor.chunks_exact(of.width.max(1))) {
            row.iter_mut().zip(functionals).for_each(|(own, &k)| *own = all[k]);
        }
    }

    /// The functionals at points (one row of slots each) into a table, behind its first column.
    pub fn write(&self, points: &[f64], slots: usize, table: &mut [f64], columns: usize) {
        rows::<false>(&self.factor, self.width, points, slots, table, columns);
    }

    /// Adds them to what is there.
    pub fn write_add(&self, points: &[f64], slots: usize, table: &mut [f64], columns: usize) {
        rows::<true>(&self.factor, self.width, points, slots, table, columns);
    }
}

#[inline(always)]
fn rows_any<const ADD: bool>(
    factor: &[f64],
    width: usize,
    points: &[f64],
    slots: usize,
    table: &mut [f64],
    columns: usize,
) {
    let rows = table.chunks_exact_mut(columns).zip(points.chunks_exact(slots));
    if width == SIDE {
        let factor = factor.as_chunks::<SIDE>().0;
        for (row, point) in rows {
            let mut sums = [0.0; SIDE];
            for (p, f) in point.iter().zip(factor) {
                for j in 0..SIDE {
                    sums[j] += p * f[j];
                }
            }
            for (o, sum) in row[1..].iter_mut().zip(sums) {
                *o = if ADD { *o + sum } else { sum };
            }
        }
        return;
    }
    for (row, point) in rows {
        for (k, out) in row[1..].chunks_mut(SIDE).enumerate() {
            let mut sums = [0.0; SIDE];
            for (p, f) in point.iter().zip(factor.chunks_exact(width)) {
                let f = &f[k * SIDE..(k + 1) * SIDE];
                for j in 0..SIDE {
                    sums[j] += p * f[j];
                }
            }
            for (o, sum) in out.iter_mut().zip(sums) {
                *o = if ADD { *o + sum } else { sum };
            }
        }
    }
}

widest! {
    fn rows<const ADD: bool>(
        factor: &[f64],
        width: usize,
        points: &[f64],
        slots: usize,
        table: &mut [f64],
        columns: usize,
    ) = rows_any::<ADD>(factor, width, points, slots, table, columns),
        rows_any::<ADD>(factor, width, points, slots, table, columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_products() {
        for (count, slots, points) in [(1, 1, 1), (3, 2, 5), (4, 6, 3), (9, 5, 2)] {
            let factor = |s: usize, j: usize| ((s * 5 + j * 3) % 7) as f64 - 3.0;
            let value = |k: usize, s: usize| ((k * 11 + s * 2) % 5) as f64 - 2.0;
            let mut spread = Spread::default();
            spread.clear(count, slots);
            for s in 0..slots {
                let numbers: Vec<f64> = (0..count).map(|j| factor(s, j)).collect();
                spread.add(s, 0.5, &numbers);
            }
            let at: Vec<f64> = (0..points * slots).map(|i| value(i / slots, i % slots)).collect();
            let columns = 1 + count;
            let mut table = vec![7.0; points * columns];
            spread.write(&at, slots, &mut table, columns);
            spread.write_add(&at, slots, &mut table, columns);
            let (mut last, mut alone) = (Spread::default(), vec![7.0; 2 * points]);
            last.choose(&spread, &[count - 1]);
            last.write(&at, slots, &mut alone, 2);
            let twice = alone.chunks_exact(2).map(|row| 2.0 * row[1]);
            assert!(twice.eq(table.chunks_exact(columns).map(|row| row[count])));
            for (k, row) in table.chunks_exact(columns).enumerate() {
                assert_eq!(row[0], 7.0);
                for (j, found) in row[1..].iter().enumerate() {
                    let sum: f64 = (0..slots).map(|s| factor(s, j) * value(k, s)).sum();
                    assert_eq!(*found, sum);
                }
            }
        }
    }
}

//! Jacobians of small systems, written where they are factorised.
//!
//! A law with one unknown (a source gives a voltage to ground) gives that before all others, and an unknown
//! in one law (the current of that source) follows after all others.  With these at both ends a Jacobian is
//! triangular but for a block between them, and only that has to be factorised.

use super::equations::Equations;
use super::linear::{Derivative, Rows};
use crate::dense::DenseLu;
use crate::rounding::OF_SOLUTION;

/// Numbers as functions of the derivatives.
#[derive(Default)]
struct Entries {
    /// what does not depend on them
    linear: Vec<f64>,
    /// where they are added: place, slot, factor
    slopes: Vec<(u32, u32, f64)>,
}

impl Entries {
    fn write(&self, slopes: &[f64], out: &mut [f64]) {
        out.copy_from_slice(&self.linear);
        for &(at, slot, f) in &self.slopes {
            out[at as usize] += f * slopes[slot as usize];
        }
    }
}

/// The scaled Jacobian as a function of the derivatives, its rows and columns in an order in which it is
/// triangular outside of a block, and its factors.
pub(super) struct Direct {
    /// rows and columns of each place with their scales
    rows: Vec<(u32, f64)>,
    columns: Vec<(u32, f64)>,
    /// places of the rows of pairs
    pairs: Vec<usize>,
    /// where the block begins and ends
    block: [usize; 2],
    inside: Entries,
    /// of each column before the block what comes below the diagonal down to its end, then of each row
    /// after the block what comes before the diagonal
    outside: Entries,
    /// rows of the former, columns of the latter
    before: Rows<u32>,
    after: Rows<u32>,
    /// the entries outside in the mode factorised last
    values: Vec<f64>,
    /// reciprocals of the diagonal outside of the block; the least and the largest entry there
    inverse: Vec<f64>,
    sizes: [f64; 2],
    lu: DenseLu,
}

/// What comes in an entry of the Jacobian.
#[derive(Clone, Copy, PartialEq)]
enum Entry {
    Nothing,
    Constant,
    Changing,
}

/// An order of rows and columns, and how many of them come before and after the block.
fn order(eq: &Equations, entry: impl Fn(usize, usize) -> Entry) -> ([Vec<usize>; 2], [usize; 2]) {
    let size = eq.size();
    let mut left = [(); 2].map(|()| (0..size).collect::<Vec<usize>>());
    let (mut before, mut after) = (Vec::new(), Vec::new());
    // the one entry of a line, if it is that of an unknown in a law and constant
    let only = |line: &[usize], entry: &dyn Fn(usize) -> Entry| {
        let mut all = line.iter().copied().filter(|&k| entry(k) != Entry::Nothing);
        let found = all.next().filter(|&k| k < eq.n && entry(k) == Entry::Constant);
        found.filter(|_| all.next().is_none())
    };
    loop {
        let [rows, columns] = &left;
        let mut laws = rows.iter().copied().filter(|&r| r < eq.n);
        let early = laws.find_map(|r| Some((r, only(columns, &|c| entry(r, c))?)));
        let mut unknowns = columns.iter().copied().filter(|&c| c < eq.n);
        let found = match early {
            Some(pivot) => {
                before.push(pivot);
                pivot
            }
            None => {
                let late = unknowns.find_map(|c| Some((only(rows, &|r| entry(r, c))?, c)));
                let Some(pivot) = late else { break };
                after.push(pivot);
                pivot
            }
        };
        left[0].retain(|&r| r != found.0);
        left[1].retain(|&c| c != found.1);
    }
    let ends = [before.len(), size - after.len()];
    let [rows, columns] = left;
    let block = rows.into_iter().zip(columns);
    let all = before.into_iter().chain(block).chain(after.into_iter().rev());
    let (rows, columns) = all.unzip();
    ([rows, columns], ends)
}

/// The parts of a Jacobian and how it is scaled.
pub(super) struct Parts<'a> {
    /// what is linear, and the weights of all entries, in the pattern of all Jacobians
    pub linear: &'a [f64],
    pub weight: &'a [f64],
    pub derivatives: &'a [Derivative],
    /// scales of rows and columns
    pub scales: [&'a [f64]; 2],
}

impl Direct {
    /// From the parts of the Jacobian.
    pub fn new(eq: &Equations, parts: &Parts) -> Direct {
        let Parts { linear, weight, derivatives, scales } = parts;
        let (size, pattern) = (eq.size(), &eq.pattern);
        let place: Vec<(usize, usize)> = pattern.iter().map(|(r, c, _)| (r, c)).collect();
        let mut kinds = vec![Entry::Nothing; size * size];
        let at = |k: usize| place[k].1 * size + place[k].0;
        for (k, _) in linear.iter().enumerate().filter(|e| *e.1 != 0.0) {
            kinds[at(k)] = Entry::Constant;
        }
        derivatives.iter().for_each(|e| kinds[at(e.at as usize)] = Entry::Changing);
        let (order, [begin, end]) = order(eq, |r, c| kinds[c * size + r]);
        let places = order.each_ref().map(|order| {
            let mut places = vec![0; size];
            order.iter().enumerate().for_each(|(k, &i)| places[i] = k);
            places
        });
        // each entry with its place, by the part that it belongs to
        let inner = end - begin;
        let mut inside = Entries { linear: vec![0.0; inner * inner], ..Entries::default() };
        let (mut inverse, mut sizes) = (vec![0.0; size], [f64::INFINITY, 0.0f64]);
        let (mut before, mut after) = (Vec::new(), Vec::new());
        let mut index = vec![(false, 0); linear.len()];
        for (k, &(r, c)) in place.iter().enumerate() {
            let (r, c) = (places[0][r], places[1][c]);
            let value = linear[k] * weight[k];
            if kinds[at(k)] == Entry::Nothing {
            } else if r >= end && c < r {
                after.push((r - end, (c as u32, k)));
            } else if c < begin && r > c {
                before.push((c, (r as u32, k)));
            } else if r == c && !(begin..end).contains(&c) {
                inverse[c] = 1.0 / value;
                sizes = [sizes[0].min(value.abs()), sizes[1].max(value.abs())];
            } else {
                index[k] = (true, (c - begin) * inner + r - begin);
                inside.linear[index[k].1] = value;
            }
        }
        let before = Rows::new(begin, before.into_iter());
        let after = Rows::new(size - end, after.into_iter());
        let mut outside = Entries::default();
        for &(_, k) in before.list.iter().chain(&after.list) {
            index[k].1 = outside.linear.len();
            outside.linear.push(linear[k] * weight[k]);
        }
        for e in *derivatives {
            let k = e.at as usize;
            let (is_inside, index) = index[k];
            let part = if is_inside { &mut inside } else { &mut outside };
            part.slopes.push((index as u32, e.slot, e.factor * weight[k]));
        }
        let scaled = |k: usize| order[k].iter().map(|&i| (i as u32, scales[k][i])).collect();
        Direct {
            rows: scaled(0),
            columns: scaled(1),
            pairs: places[0][eq.n..].to_vec(),
            block: [begin, end],
            values: outside.linear.clone(),
            before: before.map(|e| e.0),
            after: after.map(|e| e.0),
            lu: DenseLu::default(),
            inside,
            outside,
            inverse,
            sizes,
        }
    }

    /// Factorises the Jacobian in a mode; false if it is singular.
    pub fn factorise(&mut self, slopes: &[f64], active: &[bool]) -> bool {
        let Direct { pairs, block: [begin, end], inside, outside, values, lu, .. } = self;
        outside.write(slopes, values);
        let inner = *end - *begin;
        for (&row, _) in pairs.iter().zip(active).filter(|(_, &a)| !a) {
            let own = self.before.list.iter().zip(&mut *values).filter(|e| *e.0 as usize == row);
            own.for_each(|(_, v)| *v = 0.0);
        }
        lu.factor_by(inner, |lu| {
            inside.write(slopes, lu);
            // rows and columns of pairs are at the end of the block, in the same order
            for (row, _) in pairs.iter().zip(active).filter(|(_, &a)| !a) {
                let row = row - *begin;
                lu[row..].iter_mut().step_by(inner).for_each(|v| *v = 0.0);
                lu[row * inner + row] = 1.0;
            }
        });
        let [least, greatest] = lu.extremes();
        lu.singular().is_none()
            && least.min(self.sizes[0]) > OF_SOLUTION * greatest.max(self.sizes[1])
    }

    /// `x := J^-1 x` in physical units in the mode factorised last.
    pub fn solve(&self, active: &[bool], x: &mut [f64], work: &mut [f64]) {
        let (size, [begin, end]) = (x.len(), self.block);
        let work = &mut work[..size];
        for (w, &(r, scale)) in work.iter_mut().zip(&self.rows) {
            *w = x[r as usize] * scale;
        }
        for (&k, _) in self.pairs.iter().zip(active).filter(|(_, &a)| !a) {
            let (r, scale) = self.rows[k];
            work[k] = x[r as usize] / scale;
        }
        let mut values = &self.values[..];
        for k in 0..begin {
            let f = work[k] * self.inverse[k];
            work[k] = f;
            let rows = self.before.row(k);
            let (own, others) = values.split_at(rows.len());
            values = others;
            // mostly the law holds already
            if f != 0.0 {
                rows.iter().zip(own).for_each(|(&r, v)| work[r as usize] -= v * f);
            }
        }
        // singular factors are not solved with
        let _ = self.lu.solve(&mut work[begin..end]);
        for k in end..size {
            let columns = self.after.row(k - end);
            let (own, others) = values.split_at(columns.len());
            values = others;
            let terms = columns.iter().zip(own);
            let rest = terms.fold(work[k], |rest, (&c, v)| rest - v * work[c as usize]);
            work[k] = rest * self.inverse[k];
        }
        for (w, &(c, scale)) in work.iter().zip(&self.columns) {
            x[c as usize] = w * scale;
        }
    }
}

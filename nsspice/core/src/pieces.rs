//! Outputs as polynomials between two instants, for measures: values at the points of Chebyshev and Lobatto.
//!
//! Through them goes one polynomial that errs about as little as any of its degree (L. N. Trefethen,
//! *Approximation Theory and Approximation Practice* (2013), chapters 2 and 8).  How fast its coefficients
//! fall shows how well it follows what the points were taken from.

use std::f64::consts::PI;

/// Numbers kept at most in a run: what rings for ever has no end of pieces.
const MOST: usize = 1 << 25;
/// Coefficients that show whether a polynomial follows a function: the last ones.
const LAST: usize = 3;

/// Pieces of some outputs within some instants.
#[derive(Clone, Debug, Default)]
pub struct Pieces {
    /// which outputs
    pub outputs: Vec<usize>,
    /// between which instants [s]
    pub window: [f64; 2],
    /// beginning, length, and the values of one output after the other, of each piece
    kept: Vec<f64>,
    /// numbers kept in the run
    written: usize,
    /// places of the points, as parts of a piece
    pub places: Vec<f64>,
    /// factors of the values in the last coefficients
    last: Vec<Vec<f64>>,
    /// where the last piece ended, and the outputs there
    end: f64,
    right: Vec<f64>,
    /// largest value of each output so far
    largest: Vec<f64>,
}

/// The angle of a point, from the end of the piece to its beginning.
fn angle(point: usize, points: usize) -> f64 {
    PI * point as f64 / (points - 1) as f64
}

/// Factors of the values at the points in the coefficients of the Chebyshev polynomials: one row for each of
/// these, whose argument runs from 1 at the beginning of a piece to -1 at its end.
pub fn transform(points: usize) -> Vec<Vec<f64>> {
    let n = points - 1;
    // the first and the last point count by half in the discrete cosine transform
    let half = |j: usize| if j == 0 || j == n { 0.5 } else { 1.0 };
    let factor =
        |j: usize, k: usize| 2.0 / n as f64 * half(j) * half(k) * angle(j * k, points).cos();
    (0..points).map(|k| (0..points).map(|j| factor(j, k)).collect()).collect()
}

impl Pieces {
    /// Pieces with so many points, at least four.
    pub fn new(outputs: Vec<usize>, window: [f64; 2], points: usize) -> Pieces {
        let last = transform(points).split_off(points - LAST);
        Pieces {
            // sines of half the angle keep their digits at the beginning
            places: (0..points).map(|j| (0.5 * angle(j, points)).sin().powi(2)).collect(),
            last,
            right: vec![0.0; outputs.len()],
            largest: vec![0.0; outputs.len()],
            end: f64::NAN,
            outputs,
            window,
            ..Pieces::default()
        }
    }

    /// The part of the time from `begin` to `end` that is wanted, if any.
    pub fn wanted(&self, begin: f64, end: f64) -> Option<[f64; 2]> {
        let [from, to] = [begin.max(self.window[0]), end.min(self.window[1])];
        (!self.outputs.is_empty() && from < to && self.written < MOST).then_some([from, to])
    }

    /// Begins a piece; the values at its points follow.
    pub fn begin(&mut self, time: f64, length: f64) {
        self.kept.extend([time, length]);
        self.kept.resize(self.kept.len() + self.outputs.len() * self.places.len(), 0.0);
    }

    /// Puts all outputs at a point of the piece that has been begun last.
    pub fn put(&mut self, point: usize, outputs: &[f64]) {
        for k in 0..self.outputs.len() {
            self.put_one(point, k, outputs[self.outputs[k]]);
        }
    }

    /// Puts the values of the outputs that are kept at a point of the piece that has been begun last.
    pub fn put_own(&mut self, point: usize, values: &[f64]) {
        for (k, &value) in values.iter().take(self.outputs.len()).enumerate() {
            self.put_one(point, k, value);
        }
    }

    fn put_one(&mut self, point: usize, k: usize, value: f64) {
        let (points, from) = (self.places.len(), self.kept.len() - self.size() + 2);
        self.kept[from + k * points + point] = value;
        self.largest[k] = self.largest[k].max(value.abs());
        self.right[k] = value;
    }

    /// Numbers of one piece.
    pub fn size(&self) -> usize {
        2 + self.outputs.len() * self.places.len()
    }

    /// Whether the polynomials of the piece begun last follow the outputs: their last coefficients are below
    /// `tolerance` relative to the values in the piece, or `floor` relative to the largest so far.
    pub fn follows(&self, tolerance: f64, floor: f64) -> bool {
        let values = &self.kept[self.kept.len() - self.size() + 2..];
        let all = values.chunks_exact(self.places.len()).zip(&self.largest);
        all.into_iter()
            .all(|(values, largest)| follows(&self.last, values, tolerance, floor * largest))
    }

    /// Makes lines of the outputs that the polynomials of the piece begun last do not follow: the piece is so
    /// short that what jumps in it does so there, and a polynomial through a jump swings beyond both sides.
    pub fn straighten(&mut self, tolerance: f64, floor: f64) {
        let from = self.kept.len() - self.size() + 2;
        let Pieces { kept, places, largest, last, .. } = self;
        for (values, largest) in kept[from..].chunks_exact_mut(places.len()).zip(largest) {
            if !follows(last, values, tolerance, floor * *largest) {
                let [a, b] = [values[0], values[places.len() - 1]];
                values.iter_mut().zip(&*places).for_each(|(v, place)| *v = a + place * (b - a));
            }
        }
    }

    /// Drops the piece that has been begun last.
    pub fn drop_last(&mut self) {
        self.kept.truncate(self.kept.len() - self.size());
    }

    /// The piece that has been begun last stays.
    pub fn keep(&mut self) {
        let at = self.kept.len() - self.size();
        self.end = self.kept[at] + self.kept[at + 1];
        self.written += self.size();
    }

    /// A step between whose ends nothing is known: lines from the outputs at its begin, or at the end of the
    /// last piece if that is where it begins.
    pub fn line(&mut self, [begin, end]: [f64; 2], left: Option<&[f64]>, right: &[f64]) {
        let near = (begin - self.end).abs() <= 1e-9 * (end - begin);
        let pick = |row: &[f64]| self.outputs.iter().map(|&k| row[k]).collect::<Vec<_>>();
        let picked = pick(right);
        let left = match left {
            Some(left) => pick(left),
            None if near => self.right.clone(),
            None => picked.clone(),
        };
        self.begin(begin, end - begin);
        let from = self.kept.len() - self.size() + 2;
        let table = self.kept[from..].chunks_exact_mut(self.places.len());
        for (values, (a, b)) in table.zip(left.iter().zip(&picked)) {
            values.iter_mut().zip(&self.places).for_each(|(v, place)| *v = a + place * (b - a));
        }
        self.right = picked;
        self.keep();
    }

    /// Numbers that wait to be taken.
    pub fn waiting(&self) -> usize {
        self.kept.len()
    }

    /// The pieces since the last call, each of `size` numbers.
    pub fn take(&mut self) -> Vec<f64> {
        std::mem::take(&mut self.kept)
    }

    /// Hands the pieces since the last call to a function, one by one: begin, length, and values.  They do not
    /// count as kept.
    pub fn hand_on(&mut self, mut take: impl FnMut(f64, f64, &[f64])) {
        let size = self.size();
        for piece in self.kept.chunks_exact(size) {
            take(piece[0], piece[1], &piece[2..]);
        }
        self.kept.clear();
        self.written = 0;
    }
}

/// Whether the last coefficients of the polynomial through `values` are below `tolerance` relative to these, or a
/// `floor`.
fn follows(last: &[Vec<f64>], values: &[f64], tolerance: f64, floor: f64) -> bool {
    let size = values.iter().fold(0.0f64, |size, v| size.max(v.abs()));
    let allowed = tolerance * size + floor;
    last.iter().all(|factors| {
        let sum: f64 = factors.iter().zip(values).map(|(c, v)| c * v).sum();
        sum.abs() <= allowed
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(points: usize, law: impl Fn(f64) -> f64) -> Pieces {
        let mut pieces = Pieces::new(vec![1], [0.0, 1.0], points);
        pieces.begin(0.0, 1.0);
        for (point, place) in pieces.places.clone().into_iter().enumerate() {
            pieces.put(point, &[f64::NAN, law(place)]);
        }
        pieces
    }

    #[test]
    fn a_polynomial_follows_what_bends_no_more_than_its_degree() {
        // the coefficients of e^(x s) fall by (s / 4) / k each
        assert!(piece(12, |x| (0.8 * x).exp()).follows(1e-11, 0.0));
        assert!(!piece(12, |x| (8.0 * x).exp()).follows(1e-11, 0.0));
        assert!(piece(8, |x| x.powi(4) - x).follows(1e-15, 0.0));
        assert!(!piece(8, |x| (x - 0.4).abs()).follows(1e-3, 0.0));
    }

    #[test]
    fn a_jump_in_the_shortest_piece_is_a_line() {
        let mut jump = piece(8, |x| if x > 0.0 { 24.0 } else { 19.0 });
        jump.straighten(0.0, 1e-3);
        let values = &jump.kept[2..];
        assert!(values.windows(2).all(|v| v[0] < v[1]) && values[0] == 19.0 && values[7] == 24.0);
        let mut smooth = piece(8, |x| x.powi(4) - x);
        let before = smooth.kept.clone();
        smooth.straighten(0.0, 1e-15);
        assert_eq!(smooth.kept, before);
    }

    #[test]
    fn lines_begin_where_the_last_piece_ended() {
        let mut pieces = piece(4, |x| 3.0 * x);
        pieces.keep();
        pieces.line([1.0, 3.0], None, &[f64::NAN, 5.0]);
        pieces.line([4.0, 5.0], None, &[f64::NAN, 7.0]);
        let table = pieces.take();
        assert_eq!(table[6..12], [1.0, 2.0, 3.0, 3.5, 4.5, 5.0]);
        assert_eq!(table[12..], [4.0, 1.0, 7.0, 7.0, 7.0, 7.0]);
        assert_eq!(pieces.wanted(-1.0, 0.5), Some([0.0, 0.5]));
        assert_eq!(pieces.wanted(1.0, 2.0), None);
    }
}

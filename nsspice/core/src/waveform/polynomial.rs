//! What one block of a circuit hands to another: a voltage or current as a piecewise polynomial that grows
//! while the block that computes it goes on.
//!
//! Polynomials are kept by their Chebyshev coefficients, which Clenshaw's recurrence sums without loss of
//! digits (L. N. Trefethen, *Approximation Theory and Approximation Practice* (2013), chapters 3 and 19).

use super::{Breakpoint, Side, INSTANT};
use crate::rounding::OF_SOLUTION;
use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard};

/// A piecewise polynomial that the block that computes it and those that read it share.
#[derive(Clone, Debug, Default)]
pub struct Polynomial(Arc<RwLock<Pieces>>);

#[derive(Debug, Default)]
struct Pieces {
    /// constant between the instants at which somebody sets it
    held: bool,
    /// it will be set to another value, for all that is known
    restless: bool,
    /// the value before the first piece
    before: f64,
    list: Vec<Piece>,
    /// coefficients of all pieces, those of one after the other
    coefficients: Vec<f64>,
    /// end of the last piece [s]
    end: f64,
    /// largest coefficient so far
    largest: f64,
    /// largest difference from what the polynomials stand for, where it was looked at
    error: f64,
}

/// A piece lasts until the next one begins.
#[derive(Clone, Copy, Debug)]
struct Piece {
    begin: f64,
    /// where its polynomial is taken from -1 to 1
    length: f64,
    /// derivatives may jump at its begin
    kink: bool,
    /// the value does
    jump: bool,
    /// its first coefficient
    first: usize,
}

/// Value and derivative of the sum of Chebyshev polynomials at `x`, which may lie outside of [-1, 1].
fn chebyshev(coefficients: &[f64], x: f64) -> (f64, f64) {
    let (mut b, mut before) = (0.0, 0.0);
    let (mut d, mut d_before) = (0.0, 0.0);
    for &c in coefficients.iter().skip(1).rev() {
        (d, d_before) = (2.0 * b + 2.0 * x * d - d_before, d);
        (b, before) = (c + 2.0 * x * b - before, b);
    }
    let first = coefficients.first().copied().unwrap_or(0.0);
    (first + x * b - before, b + x * d - d_before)
}

impl Pieces {
    fn coefficients_of(&self, k: usize) -> &[f64] {
        let end = self.list.get(k + 1).map_or(self.coefficients.len(), |next| next.first);
        &self.coefficients[self.list[k].first..end]
    }

    /// Value and slope of the polynomial of a piece at `t`.
    fn at(&self, k: usize, t: f64) -> (f64, f64) {
        let Piece { begin, length, .. } = self.list[k];
        let (value, slope) = chebyshev(self.coefficients_of(k), 2.0 * (t - begin) / length - 1.0);
        (value, slope * 2.0 / length)
    }

    /// The piece at an instant, None before the first.
    fn find(&self, t: f64, side: Side) -> Option<usize> {
        let known = INSTANT * t.abs();
        let count = match side {
            Side::Left => self.list.partition_point(|p| p.begin < t - known),
            Side::Right => self.list.partition_point(|p| p.begin <= t + known),
        };
        count.checked_sub(1)
    }
}

impl Polynomial {
    fn read(&self) -> RwLockReadGuard<'_, Pieces> {
        self.0.read().unwrap_or_else(PoisonError::into_inner)
    }

    /// Says what the value is before the first piece.
    pub fn begin_with(&self, value: f64) {
        self.0.write().unwrap_or_else(PoisonError::into_inner).before = value;
    }

    /// A value that is set at some instants, and held in between; a `steady` one is never changed.
    pub fn held(value: f64, steady: bool) -> Polynomial {
        let pieces = Pieces { held: true, restless: !steady, before: value, ..Pieces::default() };
        Polynomial(Arc::new(RwLock::new(pieces)))
    }

    /// Whether it is constant between instants.
    pub fn is_held(&self) -> bool {
        self.read().held
    }

    /// Holds a value from where it is known so far to an instant.
    pub fn hold(&self, value: f64, to: f64) {
        let (begin, count) = (self.end(), self.count());
        if count > 0 && self.value(begin, Side::Left) == value {
            self.extend(to); // nothing changes: no breakpoint
        } else {
            self.push(begin, to - begin, &[value], true);
        }
    }

    /// Whether another value may be set at an instant, for all that is known before.
    pub fn is_set_at(&self, t: f64) -> bool {
        let pieces = self.read();
        pieces.restless && (pieces.end - t).abs() <= INSTANT * t.abs()
    }

    fn extend(&self, to: f64) {
        let mut pieces = self.0.write().unwrap_or_else(PoisonError::into_inner);
        pieces.end = to;
        if let Some(last) = pieces.list.last_mut() {
            last.length = to - last.begin;
        }
    }

    /// Value and slope of the piece that begins at `t` or goes on there.
    pub fn line(&self, t: f64) -> (f64, f64) {
        let pieces = self.read();
        pieces.find(t, Side::Right).map_or((pieces.before, 0.0), |k| pieces.at(k, t))
    }

    /// Adds a piece at the end; with a `kink` derivatives, and the value, may jump at its begin.
    pub fn push(&self, begin: f64, length: f64, coefficients: &[f64], kink: bool) {
        let mut pieces = self.0.write().unwrap_or_else(PoisonError::into_inner);
        let first = pieces.coefficients.len();
        pieces.largest = coefficients.iter().fold(pieces.largest, |m, c| m.max(c.abs()));
        let left = match pieces.list.len() {
            0 => pieces.before,
            count => pieces.at(count - 1, begin).0,
        };
        let right = chebyshev(coefficients, -1.0).0;
        // polynomials follow values to that part of the largest (see `modewise::output::pieces`): less is no jump
        let jump = kink && (right - left).abs() > OF_SOLUTION * pieces.largest.max(left.abs());
        pieces.coefficients.extend_from_slice(coefficients);
        pieces.list.push(Piece { begin, length, kink, jump, first });
        pieces.end = begin + length;
    }

    /// Compares the last polynomial with what it stands for, at an instant.
    pub fn compare(&self, t: f64, value: f64) {
        let mut pieces = self.0.write().unwrap_or_else(PoisonError::into_inner);
        if let Some(last) = pieces.list.len().checked_sub(1) {
            pieces.error = pieces.error.max((pieces.at(last, t).0 - value).abs());
        }
    }

    /// The largest difference found, as a part of the largest value.
    pub fn error(&self) -> f64 {
        let pieces = self.read();
        if pieces.error > 0.0 {
            pieces.error / pieces.largest
        } else {
            0.0
        }
    }

    /// The largest coefficient so far: values are known to its rounding.
    pub fn size(&self) -> f64 {
        self.read().largest
    }

    /// Up to where it is known [s].
    pub fn end(&self) -> f64 {
        self.read().end
    }

    /// Number of pieces.
    pub fn count(&self) -> usize {
        self.read().list.len()
    }

    /// Value at `t`; behind the end the last polynomial is continued.
    pub fn value(&self, t: f64, side: Side) -> f64 {
        let pieces = self.read();
        pieces.find(t, side).map_or(pieces.before, |k| pieces.at(k, t).0)
    }

    /// Slope to the right of `t`.
    pub fn slope(&self, t: f64) -> f64 {
        let pieces = self.read();
        pieces.find(t, Side::Right).map_or(0.0, |k| pieces.at(k, t).1)
    }

    /// Value at `t` of what begins at `from`, without the kinks between: pieces follow one another up to the
    /// first kink, and the last of them is continued.
    pub fn continued(&self, t: f64, from: f64) -> f64 {
        let pieces = self.read();
        let Some(mut k) = pieces.find(from, Side::Right) else { return pieces.before };
        while pieces.list.get(k + 1).is_some_and(|next| !next.kink && next.begin <= t) {
            k += 1;
        }
        pieces.at(k, t).0
    }

    /// The first end of a piece later than `t`: no step overlooks what a whole piece does.
    pub fn next_breakpoint(&self, t: f64) -> Option<Breakpoint> {
        let pieces = self.read();
        let next = pieces.find(t, Side::Right).map_or(0, |k| k + 1);
        match pieces.list.get(next) {
            Some(piece) => Some(Breakpoint { time: piece.begin, jump: piece.jump }),
            None if pieces.end > t + INSTANT * t.abs() => {
                Some(Breakpoint { time: pieces.end, jump: false })
            }
            None => None,
        }
    }

    /// Whether derivatives may jump at the first end of a piece later than `t`.
    pub fn bends(&self, t: f64) -> bool {
        let pieces = self.read();
        let next = pieces.find(t, Side::Right).map_or(0, |k| k + 1);
        pieces.list.get(next).is_some_and(|piece| piece.kink)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `t^2` up to 1, its tangent in two pieces up to 3, and a jump to 0 there.
    fn example() -> Polynomial {
        let p = Polynomial::default();
        p.begin_with(0.0);
        p.push(0.0, 1.0, &[0.375, 0.5, 0.125], true);
        p.push(1.0, 0.5, &[1.5, 0.5], true);
        p.push(1.5, 1.5, &[3.5, 1.5], false);
        p.push(3.0, 1.0, &[0.0], true);
        p
    }

    #[test]
    fn values_and_slopes_are_those_of_the_polynomials() {
        let p = example();
        for (t, value, slope) in
            [(0.0, 0.0, 0.0), (0.5, 0.25, 1.0), (1.25, 1.5, 2.0), (2.0, 3.0, 2.0)]
        {
            assert!((p.value(t, Side::Right) - value).abs() < 1e-15, "{t}");
            assert!((p.slope(t) - slope).abs() < 1e-14, "{t}");
        }
        assert!((p.value(3.0, Side::Left) - 5.0).abs() < 1e-14);
        assert_eq!((p.value(3.0, Side::Right), p.value(-1.0, Side::Right)), (0.0, 0.0));
    }

    #[test]
    fn held_values_change_where_they_are_set() {
        let p = Polynomial::held(1.0, false);
        assert_eq!((p.value(0.0, Side::Right), p.end()), (1.0, 0.0));
        p.hold(2.0, 0.5);
        p.hold(2.0, 1.0);
        p.hold(-3.0, 1.5);
        assert_eq!(p.count(), 2);
        assert_eq!((p.value(0.75, Side::Right), p.value(1.0, Side::Left)), (2.0, 2.0));
        assert_eq!((p.line(1.0), p.end()), ((-3.0, 0.0), 1.5));
        let next = p.next_breakpoint(0.25).map(|c| (c.time, c.jump));
        assert_eq!(next, Some((1.0, true)));
        assert!(p.is_set_at(1.5) && !p.is_set_at(1.0));
    }

    #[test]
    fn breakpoints_tell_jumps_and_kinks() {
        let p = example();
        let breakpoints: Vec<_> = [0.0, 1.0, 1.5, 3.0]
            .map(|t| (p.next_breakpoint(t).map(|c| (c.time, c.jump)), p.bends(t)))
            .into();
        assert_eq!(
            breakpoints,
            [
                (Some((1.0, false)), true),
                (Some((1.5, false)), false),
                (Some((3.0, true)), true),
                (Some((4.0, false)), false)
            ]
        );
        assert_eq!(p.next_breakpoint(4.0), None);
    }

    #[test]
    fn what_begins_goes_on_to_the_next_kink_and_beyond() {
        let p = example();
        assert!((p.continued(2.0, 0.25) - 4.0).abs() < 1e-14);
        assert!((p.continued(2.0, 1.25) - 3.0).abs() < 1e-14);
        assert!((p.continued(5.0, 1.25) - 9.0).abs() < 1e-14);
    }
}

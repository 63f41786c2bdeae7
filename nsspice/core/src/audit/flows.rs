//! Currents of elements: what flows into the nodes of a network and lies along its branches.

use super::matrix::Entries;
use super::{ITERATED, TOLERANCE};
use crate::sparse::Csc;
use crate::structure::{Coordinates, Edge};

/// A matrix as the two-terminal elements between nodes that it is a sum of, and the entries of all others.
#[derive(Clone, Debug)]
pub struct Flows {
    elements: Vec<Edge>,
    rest: Entries,
}

/// The value of an unknown, 0 at ground.
fn at(x: &[f64], node: isize) -> f64 {
    if node < 0 {
        0.0
    } else {
        x[node as usize]
    }
}

impl Flows {
    /// Takes a matrix in node voltages.
    pub fn new(matrix: &Csc, elements: &[Edge]) -> Flows {
        // a static form of the system has left its capacitors out
        let elements = if matrix.values.is_empty() { &[][..] } else { elements };
        let rest = Coordinates::of_nodes(matrix.nrows).remainder(matrix, elements);
        Flows { elements: elements.to_vec(), rest: Entries::new(&rest) }
    }

    /// Elements between nodes, -1 for ground.
    pub fn elements(&self) -> &[Edge] {
        &self.elements
    }

    /// Entries of all others.
    pub fn rest(&self) -> &Entries {
        &self.rest
    }

    /// Adds the product with `x` times a factor: the current of each element to both of its nodes.
    pub fn add(&self, factor: f64, x: &[f64], out: &mut [f64]) {
        self.rest.add(factor, x, out);
        for &(a, b, value) in &self.elements {
            let current = factor * value * (at(x, a) - at(x, b));
            for (node, sign) in [(a, 1.0), (b, -1.0)] {
                if node >= 0 {
                    out[node as usize] += sign * current;
                }
            }
        }
    }

    /// The same, and the sizes of the currents, at least the part to which they are known at high potentials.
    pub fn add_both(&self, factor: f64, x: &[f64], out: &mut [f64], sizes: &mut [f64]) {
        self.add(factor, x, out);
        self.rest.add_sizes(factor, x, sizes);
        for &(a, b, value) in &self.elements {
            let (from, to) = (at(x, a), at(x, b));
            // steps are solved to this part of what the potentials alone would carry
            let solved = ITERATED / TOLERANCE * from.abs().max(to.abs());
            let voltage = (from - to).abs().max(solved);
            for node in [a, b] {
                if node >= 0 {
                    sizes[node as usize] += (factor * value).abs() * voltage;
                }
            }
        }
    }
}

//! The hybrid equations of a network: voltages of the forest and currents of the links.
//!
//! Every branch is fixed in its voltage or weighted, `i = w (v - e)`; a node may take an injected current.
//! With `X = sqrt(w) (v - e)` of the forest, `Y = i / sqrt(w)` of the links and `G_lt = sqrt(w_l / w_t) F_lt`,
//! where `F` counts the forest branches in the loop of each link,
//!
//! ```text
//!   X + G' Y = c,    c_t = J_t / sqrt(w_t)                  KCL of the cut-sets
//! - G X + Y  = m,    m_l = sqrt(w_l) (F e + F v_fixed - e_l)  KVL of the loops
//! ```
//!
//! The matrix is the sum of one and a skew part with entries of at most one.  Voltages alone as unknowns would
//! lose the currents in `w v - j`.

use super::basis::Basis;
use crate::linear::{ordering, Factor};
use crate::sparse::Csc;
use std::sync::Arc;

/// What a branch does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// its voltage is this
    Fixed(f64),
    /// `i = weight (v - offset)`
    Weighted {
        /// above zero
        weight: f64,
        /// voltage without current
        offset: f64,
    },
    /// infinitely light: its voltage is this where nothing else decides, and it carries nothing
    Loose(f64),
}

/// Weight of a loose branch beside the least one.  Roots of weights span less than half the range of numbers, and the
/// condition of the equations does not depend on it.
const LIGHT: f64 = 1e-60;
/// Rounding of a sum beside its terms: there are as many as branches, of which networks treated here have some
/// thousand.
pub const SUMS: f64 = 4096.0 * f64::EPSILON;

impl Law {
    /// For the order of the forest: fixed branches first.
    fn heaviness(self) -> f64 {
        match self {
            Law::Fixed(_) => f64::INFINITY,
            Law::Weighted { weight, .. } => weight,
            Law::Loose(_) => 0.0,
        }
    }

    /// Weight and offset of a branch that is not fixed.
    fn weighted(self, light: f64) -> Option<(f64, f64)> {
        match self {
            Law::Fixed(_) => None,
            Law::Weighted { weight, offset } => Some((weight, offset)),
            Law::Loose(offset) => Some((light, offset)),
        }
    }
}

/// Branches between nodes, the last of which is ground, and what is injected into each node.
#[derive(Clone)]
pub struct Network {
    /// number of nodes
    pub nodes: usize,
    /// the two ends of each branch, its current flows from the first to the second
    pub ends: Vec<[usize; 2]>,
    /// what each branch does
    pub laws: Vec<Law>,
    /// what is injected into each node
    pub injected: Vec<f64>,
    /// the sum of the magnitudes that this has been added up from
    pub terms: Vec<f64>,
}

/// Voltage and current of each branch.
pub struct Flow {
    /// by branch
    pub voltage: Vec<f64>,
    /// by branch
    pub current: Vec<f64>,
}

/// A forest branch that is weighted: its place in the forest, and the root of its weight.
struct Twig {
    place: usize,
    root: f64,
}

/// A link that is weighted.
struct Link {
    edge: usize,
    root: f64,
    path: Vec<(usize, f64)>,
}

/// The hybrid equations.
pub struct Hybrid {
    /// the forest
    pub basis: Basis,
    twigs: Vec<Twig>,
    links: Vec<Link>,
    /// the unknown of each forest branch, with the root of its weight
    twig_of: Vec<Option<(usize, f64)>>,
    /// voltage of each forest branch while no weighted one of them carries anything
    base: Vec<f64>,
    /// entries of `G`
    g: Vec<(usize, usize, f64)>,
    /// `c`, then `m`
    right: Vec<f64>,
    /// injected currents through the cut-sets
    cuts: Vec<f64>,
    /// currents are injected into a part of the network that have no way out of it
    pub cut_off: bool,
}

impl Network {
    /// Nodes without branches, the last of which is ground.
    pub fn new(nodes: usize) -> Network {
        let (ends, laws) = (Vec::new(), Vec::new());
        Network { nodes, ends, laws, injected: vec![0.0; nodes], terms: vec![0.0; nodes] }
    }

    /// Injects a current into a node.
    pub fn inject(&mut self, node: usize, current: f64) {
        self.injected[node] += current;
        self.terms[node] += current.abs();
    }

    /// Joins parts that no branch joins to ground, and those that only `ways` join, loosely to it, at the given
    /// potentials.
    pub fn hold(&mut self, potentials: &[f64]) {
        let ground = self.nodes - 1;
        let parts = Basis::new(self.nodes, &self.ends, 0..self.ends.len());
        for root in parts.roots().filter(|&root| root != ground).collect::<Vec<_>>() {
            self.ends.push([root, ground]);
            self.laws.push(Law::Loose(potentials[root] - potentials[ground]));
        }
    }

    /// The weight of loose branches.
    fn light(&self) -> f64 {
        let weights = self.laws.iter().filter_map(|law| match law {
            Law::Weighted { weight, .. } => Some(*weight),
            _ => None,
        });
        LIGHT * weights.fold(1.0, f64::min)
    }

    /// The forest of the heaviest branches; those beyond `laws` come last, in their order.
    fn basis(&self) -> Basis {
        let mut order: Vec<usize> = (0..self.laws.len()).collect();
        order.sort_by(|&a, &b| self.laws[b].heaviness().total_cmp(&self.laws[a].heaviness()));
        Basis::new(
            self.nodes,
            &self.ends,
            order.into_iter().chain(self.laws.len()..self.ends.len()),
        )
    }

    /// Writes down the equations; branches without a law are in the forest where nothing else joins their ends,
    /// and take part in no equation.
    pub fn hybrid(&self) -> Hybrid {
        let basis = self.basis();
        let (light, count) = (self.light(), basis.tree.len());
        let (mut base, mut twig_of, mut twigs) = (vec![0.0; count], vec![None; count], Vec::new());
        let mut place_of = vec![false; self.ends.len()];
        for (place, &edge) in basis.tree.iter().enumerate() {
            place_of[edge] = true;
            base[place] = match self.laws[edge] {
                Law::Fixed(voltage) | Law::Loose(voltage) => voltage,
                Law::Weighted { offset, .. } => offset,
            };
            if let Some((weight, _)) = self.laws[edge].weighted(light) {
                let root = weight.sqrt();
                twig_of[place] = Some((twigs.len(), root));
                twigs.push(Twig { place, root });
            }
        }
        let mut cuts = basis.through_cuts(&self.injected);
        let cut_off = self.cancel(&basis, &mut cuts);
        let mut right: Vec<f64> = twigs.iter().map(|t| cuts[t.place] / t.root).collect();
        let (mut links, mut g) = (Vec::new(), Vec::new());
        for (edge, law) in self.laws.iter().enumerate().filter(|e| !place_of[e.0]) {
            let Some((weight, offset)) = law.weighted(light) else { continue };
            let [plus, minus] = self.ends[edge];
            let path = basis.path(plus, minus).unwrap_or_default();
            let root = weight.sqrt();
            let mut mismatch = -offset;
            for &(place, sign) in &path {
                mismatch += sign * base[place];
                if let Some((twig, own)) = twig_of[place] {
                    g.push((links.len(), twig, sign * (root / own)));
                }
            }
            right.push(root * mismatch);
            links.push(Link { edge, root, path });
        }
        Hybrid { basis, twigs, links, twig_of, base, g, right, cuts, cut_off }
    }

    /// Takes what is injected into loosely joined parts for nothing where it cancels; true if it does not.
    fn cancel(&self, basis: &Basis, cuts: &mut [f64]) -> bool {
        let is_loose = |edge: usize| matches!(self.laws[edge], Law::Loose(_));
        if !basis.tree.iter().any(|&edge| is_loose(edge)) {
            return false;
        }
        let sizes = basis.through_cuts(&self.terms);
        let mut cut_off = false;
        for ((cut, size), &edge) in cuts.iter_mut().zip(sizes).zip(&basis.tree) {
            if is_loose(edge) {
                let nothing = cut.abs() <= SUMS * size.abs();
                *cut = if nothing { 0.0 } else { *cut };
                cut_off |= !nothing;
            }
        }
        cut_off
    }

    /// Voltages and currents.  Fixed branches that close loops of fixed ones carry nothing; nothing if the
    /// equations could not be solved.
    pub fn solve(&self) -> Option<Flow> {
        let hybrid = self.hybrid();
        let x = hybrid.solve()?;
        Some(hybrid.flow(self, &x))
    }
}

impl Hybrid {
    /// Unknowns: weighted forest branches, weighted links.
    fn size(&self) -> usize {
        self.right.len()
    }

    /// Entries of the matrix.
    fn entries(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        let (t, n) = (self.twigs.len(), self.size());
        let coupling = self.g.iter().flat_map(move |&(l, c, v)| [(c, t + l, v), (t + l, c, -v)]);
        (0..n).map(|k| (k, k, 1.0)).chain(coupling)
    }

    /// `G`, links by weighted forest branches.
    #[cfg(test)]
    pub fn coupling(&self) -> nalgebra::DMatrix<f64> {
        let mut g = nalgebra::DMatrix::zeros(self.links.len().max(1), self.twigs.len().max(1));
        self.g.iter().for_each(|&(l, c, v)| g[(l, c)] += v);
        g
    }

    /// Solves the equations with one step of refinement.
    pub fn solve(&self) -> Option<Vec<f64>> {
        let n = self.size();
        let entries: Vec<_> = self.entries().collect();
        let matrix = Csc::from_triplets(n, n, &entries);
        let factor = Factor::new(&matrix, &Arc::new(ordering(&matrix, 0)));
        let (mut x, mut work) = (self.right.clone(), vec![0.0; n]);
        factor.solve(&mut x, &mut work).ok()?;
        let mut rest = self.right.clone();
        matrix.mul_add(-1.0, &x, &mut rest);
        factor.solve(&mut rest, &mut work).ok()?;
        x.iter_mut().zip(&rest).for_each(|(x, d)| *x += d);
        x.iter().all(|v| v.is_finite()).then_some(x)
    }

    /// Voltages of the forest at a point.
    pub fn tree_voltages(&self, x: &[f64]) -> Vec<f64> {
        let mut out = self.base.clone();
        for (twig, x) in self.twigs.iter().zip(x) {
            out[twig.place] += x / twig.root;
        }
        out
    }

    /// The voltage between two nodes; nothing if the forest does not join them.
    pub fn voltage(&self, tree: &[f64], [plus, minus]: [usize; 2]) -> Option<f64> {
        let path = self.basis.path(plus, minus)?;
        Some(path.iter().map(|&(place, sign)| sign * tree[place]).sum())
    }

    /// Whether the voltage between two nodes is no sum of fixed ones.
    pub fn moves(&self, [plus, minus]: [usize; 2]) -> bool {
        let path = self.basis.path(plus, minus);
        path.is_none_or(|path| path.iter().any(|e| self.twig_of[e.0].is_some()))
    }

    /// The root of the least weight between two nodes: of what it takes to move them against each other.
    pub fn stiffness(&self, [plus, minus]: [usize; 2]) -> f64 {
        let path = self.basis.path(plus, minus).unwrap_or_default();
        path.iter().filter_map(|e| self.twig_of[e.0]).map(|t| t.1).fold(f64::INFINITY, f64::min)
    }

    /// Voltages and currents at a point.
    pub fn flow(&self, network: &Network, x: &[f64]) -> Flow {
        let tree = self.tree_voltages(x);
        let count = network.ends.len();
        let (mut voltage, mut current) = (vec![0.0; count], vec![0.0; count]);
        let mut carried = self.cuts.clone();
        for (link, y) in self.links.iter().zip(&x[self.twigs.len()..]) {
            let through = y * link.root;
            current[link.edge] = through;
            link.path.iter().for_each(|&(place, sign)| carried[place] -= sign * through);
        }
        for (place, &edge) in self.basis.tree.iter().enumerate() {
            current[edge] = match self.twig_of[place] {
                Some((twig, root)) => x[twig] * root,
                None => carried[place],
            };
        }
        for (voltage, &ends) in voltage.iter_mut().zip(&network.ends) {
            *voltage = self.voltage(&tree, ends).unwrap_or(0.0);
        }
        Flow { voltage, current }
    }
}

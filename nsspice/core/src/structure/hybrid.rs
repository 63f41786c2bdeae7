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
//! Windings of ideal transformers are fixed branches whose voltages are unknown: `v - N u = 0`, and their currents
//! times `N` go into the cores.  But for these the matrix is the sum of one and a skew part with entries of at most one.
//! Voltages alone as unknowns would lose the currents in `w v - j`.

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
    /// a winding: its voltage is that of the cores by its [`Turns`]
    Led,
    /// infinitely light: its voltage is this where nothing else decides, and it carries nothing
    Loose(f64),
}

/// Weight of a loose branch relative to the least one.  Roots of weights span less than half the range of numbers,
/// and the condition of the equations does not depend on it.
const LIGHT: f64 = 1e-60;
/// Sweeps of equilibration (D. Ruiz 2001): each takes the root of what is left.
const SWEEPS: usize = 8;
/// Rounding of a sum relative to its terms: there are as many as branches, of which networks treated here have some
/// thousand.
pub const SUMS: f64 = 4096.0 * f64::EPSILON;

impl Law {
    /// For the order of the forest: fixed branches first.
    fn heaviness(self) -> f64 {
        match self {
            Law::Fixed(_) => f64::INFINITY,
            Law::Led => f64::MAX,
            Law::Weighted { weight, .. } => weight,
            Law::Loose(_) => 0.0,
        }
    }

    /// Weight and offset of a branch that is not fixed.
    fn weighted(self, light: f64) -> Option<(f64, f64)> {
        match self {
            Law::Fixed(_) | Law::Led => None,
            Law::Weighted { weight, offset } => Some((weight, offset)),
            Law::Loose(offset) => Some((light, offset)),
        }
    }
}

/// A winding on a core, `v = turns v_core`; the core gets `turns i` of its current.
#[derive(Clone, Copy, Debug)]
pub struct Turns {
    /// a branch that is [`Law::Led`]
    pub winding: usize,
    /// a node that one branch, or none, joins to ground
    pub core: usize,
    /// how often it goes round it
    pub turns: f64,
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
    /// ideal transformers
    pub turns: Vec<Turns>,
}

/// Voltage and current of each branch.
pub struct Flow {
    /// by branch
    pub voltage: Vec<f64>,
    /// by branch
    pub current: Vec<f64>,
}

/// A forest branch whose voltage is an unknown: its place in the forest, and the root of its weight; 1 for windings,
/// `led`.
struct Twig {
    place: usize,
    root: f64,
    led: bool,
}

/// A link whose current is an unknown.
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
    /// entries of the matrix
    entries: Vec<(usize, usize, f64)>,
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
        let (injected, terms, turns) = (vec![0.0; nodes], vec![0.0; nodes], Vec::new());
        Network { nodes, ends, laws, injected, terms, turns }
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
        let mut place_of = vec![None; self.ends.len()];
        for (place, &edge) in basis.tree.iter().enumerate() {
            place_of[edge] = Some(place);
            base[place] = match self.laws[edge] {
                Law::Fixed(voltage) | Law::Loose(voltage) => voltage,
                Law::Weighted { offset, .. } => offset,
                Law::Led => 0.0,
            };
            let led = self.laws[edge] == Law::Led;
            let weight = self.laws[edge].weighted(light).map(|law| law.0);
            if let Some(weight) = weight.or(led.then_some(1.0)) {
                let root = weight.sqrt();
                twig_of[place] = Some((twigs.len(), root));
                twigs.push(Twig { place, root, led });
            }
        }
        let mut cuts = basis.through_cuts(&self.injected);
        let cut_off = self.cancel(&basis, &mut cuts);
        let right = |t: &Twig| if t.led { 0.0 } else { cuts[t.place] / t.root };
        let mut right: Vec<f64> = twigs.iter().map(right).collect();
        let (mut links, mut entries) = (Vec::new(), Vec::new());
        entries.extend((0..twigs.len()).map(|k| (k, k, 1.0)));
        for (edge, law) in self.laws.iter().enumerate().filter(|e| place_of[e.0].is_none()) {
            let (root, offset, own) = match law.weighted(light) {
                Some((weight, offset)) => (weight.sqrt(), offset, 1.0),
                None if *law == Law::Led => (1.0, 0.0, 0.0),
                None => continue,
            };
            let [plus, minus] = self.ends[edge];
            let path = basis.path(plus, minus).unwrap_or_default();
            let link = twigs.len() + links.len();
            let mut mismatch = -offset;
            for &(place, sign) in &path {
                mismatch += sign * base[place];
                if let Some((twig, other)) = twig_of[place] {
                    let part = sign * (root / other);
                    entries.push((link, twig, -part));
                    if !twigs[twig].led {
                        entries.push((twig, link, part));
                    }
                }
            }
            entries.push((link, link, own));
            right.push(root * mismatch);
            links.push(Link { edge, root, path });
        }
        let mut hybrid =
            Hybrid { basis, twigs, links, twig_of, base, entries, right, cuts, cut_off };
        hybrid.wind(self, &place_of);
        hybrid
    }

    /// Takes what is injected into loosely joined parts for nothing where it cancels; true if it does not.
    fn cancel(&self, basis: &Basis, cuts: &mut [f64]) -> bool {
        let is_core = |node: usize| self.turns.iter().any(|t| t.core == node);
        let is_loose = |edge: usize| {
            matches!(self.laws[edge], Law::Loose(_)) && !self.ends[edge].iter().any(|&n| is_core(n))
        };
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

    /// Adds the turns of windings: to the law of each winding, and to that of the branch of the core.  What is
    /// injected into windings is nothing to a core that stores nothing where it cancels.
    fn wind(&mut self, network: &Network, place_of: &[Option<usize>]) {
        let (ground, t) = (network.nodes - 1, self.twigs.len());
        let sizes = self.basis.through_cuts(&network.terms);
        let mut injected = vec![[0.0; 2]; t];
        for &Turns { winding, core, turns } in &network.turns {
            // the only branch of the core is in the forest
            let Some(&[(place, sign)]) = self.basis.path(core, ground).as_deref() else { continue };
            let Some((twig, root)) = self.twig_of[place] else { continue };
            // from the core to ground, as the sign of its branch shows
            let (row, through) = match place_of[winding] {
                Some(own) => match self.twig_of[own] {
                    Some((led, _)) => (led, self.through(own)),
                    None => continue,
                },
                None => {
                    let Some(link) = self.links.iter().position(|l| l.edge == winding) else {
                        continue;
                    };
                    (t + link, vec![(t + link, self.links[link].root)])
                }
            };
            let law = if place_of[winding].is_some() { -1.0 } else { 1.0 };
            self.entries.push((row, twig, law * turns * sign / root));
            self.right[row] -= law * turns * sign * self.base[place];
            for (unknown, part) in through {
                self.entries.push((twig, unknown, -sign * turns * part / root));
            }
            if let Some(own) = place_of[winding] {
                injected[twig][0] += sign * turns * self.cuts[own] / root;
                injected[twig][1] += (turns * sizes[own] / root).abs();
            }
        }
        for (k, [sum, size]) in injected.into_iter().enumerate() {
            let edge = self.basis.tree[self.twigs[k].place];
            let loose = matches!(network.laws[edge], Law::Loose(_));
            if !(loose && sum.abs() <= SUMS * size) {
                self.right[k] += sum;
            }
        }
    }

    /// The current of a winding in the forest by the unknowns of links, without what is injected.
    fn through(&self, place: usize) -> Vec<(usize, f64)> {
        let t = self.twigs.len();
        let all = self.links.iter().enumerate();
        let part = |(k, link): (usize, &Link)| {
            let (_, sign) = *link.path.iter().find(|e| e.0 == place)?;
            Some((t + k, -sign * link.root))
        };
        all.filter_map(part).collect()
    }

    /// `G`, links by weighted forest branches.
    #[cfg(test)]
    pub fn coupling(&self) -> nalgebra::DMatrix<f64> {
        let t = self.twigs.len();
        let mut g = nalgebra::DMatrix::zeros(self.links.len().max(1), t.max(1));
        let coupling = self.entries.iter().filter(|e| e.0 >= t && e.1 < t);
        coupling.for_each(|&(l, c, v)| g[(l - t, c)] -= v);
        g
    }

    /// Solves the equations with one step of refinement.
    pub fn solve(&self) -> Option<Vec<f64>> {
        let n = self.size();
        let scale = if self.is_wound() { self.equilibrate() } else { [vec![1.0; n], vec![1.0; n]] };
        let scaled = |&(r, c, v): &(usize, usize, f64)| (r, c, scale[0][r] * v * scale[1][c]);
        let entries: Vec<_> = self.entries.iter().map(scaled).collect();
        let matrix = Csc::from_triplets(n, n, &entries);
        let mut factor = Factor::new(&matrix, &Arc::new(ordering(&matrix, 0)));
        if self.is_wound() && factor.singular().is_some() {
            // a loop of fixed voltages through a transformer: it carries nothing
            factor.set_hold(1.0);
            factor.factor(&matrix);
        }
        let right: Vec<f64> = self.right.iter().zip(&scale[0]).map(|(b, s)| b * s).collect();
        let (mut x, mut work) = (right.clone(), vec![0.0; n]);
        factor.solve(&mut x, &mut work).ok()?;
        let mut rest = right;
        matrix.mul_add(-1.0, &x, &mut rest);
        factor.solve(&mut rest, &mut work).ok()?;
        x.iter_mut().zip(&rest).zip(&scale[1]).for_each(|((x, d), s)| *x = (*x + d) * s);
        x.iter().all(|v| v.is_finite()).then_some(x)
    }

    fn is_wound(&self) -> bool {
        self.twigs.iter().any(|t| t.led) || self.entries.iter().any(|e| e.0 == e.1 && e.2 == 0.0)
    }

    /// Powers of two for rows and columns that make the largest entries alike: windings are constraints, and measured
    /// by the turns of their cores.
    fn equilibrate(&self) -> [Vec<f64>; 2] {
        let n = self.size();
        let mut scale = [vec![1.0; n], vec![1.0; n]];
        for _ in 0..SWEEPS {
            let mut largest = [vec![0.0f64; n], vec![0.0f64; n]];
            for &(r, c, v) in &self.entries {
                let size = (scale[0][r] * v * scale[1][c]).abs();
                largest[0][r] = largest[0][r].max(size);
                largest[1][c] = largest[1][c].max(size);
            }
            for (scale, largest) in scale.iter_mut().zip(&largest) {
                for (scale, &largest) in scale.iter_mut().zip(largest).filter(|e| *e.1 > 0.0) {
                    *scale *= (-0.5 * largest.log2()).round().exp2();
                }
            }
        }
        scale
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
                Some((twig, root)) if !self.twigs[twig].led => x[twig] * root,
                _ => carried[place],
            };
        }
        for (voltage, &ends) in voltage.iter_mut().zip(&network.ends) {
            *voltage = self.voltage(&tree, ends).unwrap_or(0.0);
        }
        Flow { voltage, current }
    }
}

//! How a network is laid out for [`super::nodal`]: clusters, joints, loops of capacitors and parts behind inductors.

use super::nodal::{carry, Joint, Nodal, Reached, Unknown};
use super::normal_tree;
use super::stars::Stars;
use crate::dense::{Lu, Matrix};
use crate::structure::{Basis, Elements};
use crate::union_find::UnionFind;
use std::collections::HashMap;

/// Capacitors at most that close loops: their currents are found by a dense matrix.
const LOOPS: usize = 64;

/// A place, and the direction there.
type Placed = Vec<(usize, f64)>;

impl Nodal {
    /// Of a network without coupled inductors whose pairs all have resistances; `offsets` are their constant slacks.
    pub fn new(elements: Elements, offsets: &[f64]) -> Option<Nodal> {
        let nodes = elements.nodes;
        if !elements.groups.is_empty() || elements.pairs.iter().any(|pair| pair.value <= 0.0) {
            return None;
        }
        let (sources, count) = (elements.voltages.len(), elements.capacitors.len());
        let all: Vec<[usize; 2]> =
            elements.voltages.iter().chain(&elements.capacitors).map(|b| b.ends).collect();
        let mut order: Vec<usize> = (0..count).collect();
        let list = &elements.capacitors;
        order.sort_by(|&i, &j| list[j].value.total_cmp(&list[i].value));
        let basis =
            Basis::new(nodes, &all, (0..sources).chain(order.into_iter().map(|k| sources + k)));
        if (0..sources).any(|k| !basis.tree.contains(&k)) {
            return None;
        }
        let forest: Vec<Reached> = basis
            .reached()
            .map(|(node, before, place, sign)| Reached {
                node,
                before,
                branch: basis.tree[place],
                sign,
            })
            .collect();
        let mut root: Vec<usize> = (0..nodes).collect();
        forest.iter().for_each(|step| root[step.node] = root[step.before]);
        let roots: Vec<usize> = (0..nodes).filter(|&node| root[node] == node).collect();
        let number: HashMap<usize, usize> =
            roots.iter().enumerate().map(|(k, &r)| (r, k)).collect();
        let cluster: Vec<usize> = root.iter().map(|root| number[root]).collect();
        let (joints, of_pair, of_resistor) = joints(&elements, &cluster);
        let mut fixed = vec![0.0; joints.len()];
        for (r, &(joint, _)) in elements.resistors.iter().zip(&of_resistor) {
            fixed[joint] += r.value;
        }
        let ends: Vec<[usize; 2]> = joints.iter().map(|joint| joint.clusters).collect();
        let clusters = roots.len() - 1;
        let stars = Stars::new(clusters, &ends);
        let mut sets = UnionFind::new(clusters + 1);
        ends.iter().for_each(|&[a, b]| {
            sets.join(a, b);
        });
        let joining = elements.resistors.iter().chain(&elements.pairs).map(|b| b.ends);
        let mut dependent = normal_tree::capacitors(&elements, &[]);
        let closing = dependent.len();
        dependent.extend(normal_tree::inductors(&elements, joining));
        if closing > LOOPS {
            return None;
        }
        let mut out = Nodal {
            offsets: offsets.to_vec(),
            conductance: fixed.clone(),
            fixed,
            steepest: 0.0,
            conduct: vec![0; joints.len()],
            guards: Vec::new(),
            driven: vec![0.0; joints.len()],
            on: vec![false; elements.pairs.len()],
            work: [nodes, clusters + 1, clusters + 1, clusters + 1].map(|len| vec![0.0; len]),
            known: vec![0.0; sources + count],
            forest,
            cluster,
            joints,
            of_pair,
            of_resistor,
            dependent,
            unknowns: unknowns(&elements),
            loops: Matrix::zeros(0, 0),
            part: Vec::new(),
            between: Vec::new(),
            shifts: Vec::new(),
            floating: None,
            stars,
            elements,
        };
        out.find_parts(&mut sets)?;
        out.find_loops(closing)?;
        Some(out)
    }

    /// Parts of the network that inductors alone join to ground.
    fn find_parts(&mut self, sets: &mut UnionFind) -> Option<()> {
        let clusters = self.work[1].len() - 1;
        if self.stars.free.is_empty() {
            return Some(());
        }
        let ground = sets.root(clusters);
        let mut number = HashMap::new();
        for cluster in 0..clusters {
            let root = sets.root(cluster);
            if root != ground {
                let next = number.len();
                number.entry(root).or_insert(next);
            }
        }
        let mut of = |cluster| number.get(&sets.root(cluster)).copied().unwrap_or(number.len());
        let parts: Vec<usize> = self.cluster.iter().map(|&cluster| of(cluster)).collect();
        let inductors = &self.elements.inductors;
        self.between = inductors.iter().map(|l| l.ends.map(|end| parts[end])).collect();
        let mut floating = Stars::new(number.len(), &self.between);
        let inverse: Vec<f64> = inductors.iter().map(|l| 1.0 / l.value).collect();
        if !floating.free.is_empty() || !floating.set(&inverse) {
            return None;
        }
        self.part = parts.into_iter().enumerate().filter(|e| e.1 < number.len()).collect();
        self.shifts = vec![0.0; number.len() + 1];
        self.floating = Some(floating);
        Some(())
    }

    /// The currents of capacitors in loops.
    fn find_loops(&mut self, closing: usize) -> Option<()> {
        let mut matrix = Matrix::zeros(closing, closing);
        let capacitors = &self.elements.capacitors;
        let mut flows = vec![0.0; self.known.len()];
        for (column, one) in self.dependent[..closing].iter().enumerate() {
            let [plus, minus] = capacitors[one.state].ends;
            let mut sums = vec![0.0; self.elements.nodes];
            (sums[plus], sums[minus]) = (-1.0, 1.0);
            carry(&self.forest, &mut sums, &mut flows);
            for (row, other) in self.dependent[..closing].iter().enumerate() {
                matrix[(row, column)] = self.moved(other, &flows);
            }
            matrix[(column, column)] += 1.0 / capacitors[one.state].value;
        }
        self.loops = Lu::new(&matrix).solve(&Matrix::identity(closing));
        self.loops.finite().then_some(())
    }
}

fn joints(elements: &Elements, cluster: &[usize]) -> (Vec<Joint>, Placed, Placed) {
    let mut joints: Vec<Joint> = Vec::new();
    let mut known = HashMap::new();
    let mut place = |ends: [usize; 2]| {
        let sorted = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        let k = *known.entry(sorted).or_insert_with(|| {
            let clusters = [cluster[sorted[0]], cluster[sorted[1]]];
            joints.push(Joint { ends: sorted, clusters });
            joints.len() - 1
        });
        (k, if sorted == ends { 1.0 } else { -1.0 })
    };
    let of_pair: Placed = elements.pairs.iter().map(|pair| place(pair.ends)).collect();
    let of_resistor: Placed = elements.resistors.iter().map(|r| place(r.ends)).collect();
    (joints, of_pair, of_resistor)
}

fn unknowns(elements: &Elements) -> Vec<Unknown> {
    let ground = elements.nodes - 1;
    let mut stored = HashMap::new();
    for (state, c) in elements.capacitors.iter().enumerate().rev() {
        let [plus, minus] = c.ends;
        stored.insert([plus, minus], (state, 1.0));
        stored.insert([minus, plus], (state, -1.0));
    }
    let mut out = HashMap::new();
    let node_of: HashMap<usize, usize> =
        elements.unknowns.iter().enumerate().map(|(node, &j)| (j, node)).collect();
    for (node, &j) in elements.unknowns.iter().enumerate() {
        let before = usize::try_from(elements.coordinates.before(j)).ok();
        let other = before.map_or(ground, |before| node_of[&before]);
        out.insert(
            j,
            match stored.get(&[node, other]) {
                Some(&(state, sign)) => Unknown::Stored(state, sign),
                None => Unknown::Between(node, other),
            },
        );
    }
    let count = elements.capacitors.len();
    for (list, kind) in [
        (&elements.voltages, &(|k| Unknown::Source(k)) as &dyn Fn(usize) -> Unknown),
        (&elements.inductors, &|k| Unknown::Inductor(count + k)),
        (&elements.resistors, &Unknown::Resistor),
    ] {
        for (k, branch) in list.iter().enumerate() {
            branch.index.map(|j| out.insert(j, kind(k)));
        }
    }
    (0..out.len()).map(|j| out[&j]).collect()
}

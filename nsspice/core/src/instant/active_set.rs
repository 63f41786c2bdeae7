//! A network with one-way branches, solved by the active-set method of Lawson and Hanson with the hybrid equations
//! of one mode after the other.
//!
//! A one-way branch carries `i >= 0` and has `v <= offset + series i`, one of them as an equality.  The currents
//! of the closed ones are the multipliers of a convex problem; each round closes the branch that is violated
//! most and opens those whose currents would turn round (*Solving Least Squares Problems*, 1974, chapter 23).
//! A branch that closed ones join already is violated by nothing, so that the closed ones never form a loop.
//! Each mode has a forest of its own in which its closed branches are fixed ones.
//!
//! Where each of them has a resistance the solution is the only one, and block pivoting, which closes and opens all
//! branches of the wrong sign together, finds it in a few modes instead of one for each branch (J. J. Judice, F. M. Pires,
//! *A block principal pivoting algorithm for large-scale strictly monotone linear complementarity problems*, Comput. Oper.
//! Res. 21 (1994) 587).

use crate::structure::{Flow, Hybrid, Law, Network, SUMS};

/// Rounds of block pivoting in which no fewer branches are of the wrong sign, before it is given up.
const PATIENCE: usize = 3;

/// A one-way branch.
#[derive(Clone, Copy, Debug)]
pub struct OneWay {
    /// its current flows from the first to the second
    pub ends: [usize; 2],
    /// the largest voltage without current
    pub offset: f64,
    /// resistance in series
    pub series: f64,
}

/// The flow of a network, and which of its one-way branches are closed.
pub struct Mixed {
    /// voltages and currents of the other branches
    pub flow: Flow,
    /// which one-way branches are closed
    pub closed: Vec<bool>,
    /// current of each one-way branch
    pub carried: Vec<f64>,
    /// how far each is from closing
    pub slack: Vec<f64>,
    /// potentials of the nodes
    pub potentials: Vec<f64>,
    /// of voltages
    pub rounding: f64,
    /// of currents
    pub current_rounding: f64,
    /// what loose branches may drive through others: no current
    pub loose: f64,
}

/// What one mode leads to.
struct Trial {
    flow: Flow,
    carried: Vec<f64>,
    slack: Vec<f64>,
    potentials: Vec<f64>,
    /// rounding of currents and voltages
    rounding: [f64; 2],
    hybrid: Hybrid,
    /// currents have no way
    cut_off: bool,
}

impl Trial {
    /// The closed one-way branches on the way between two nodes, and whether it leads through them forward.
    fn ways_between(
        &self,
        [plus, minus]: [usize; 2],
        laws: usize,
        closed: &[bool],
    ) -> Vec<(usize, f64)> {
        let shut: Vec<usize> = (0..closed.len()).filter(|&k| closed[k]).collect();
        let basis = &self.hybrid.basis;
        let path = basis.path(plus, minus).unwrap_or_default().into_iter();
        let way = |(place, sign): (usize, f64)| {
            let at = basis.tree[place].checked_sub(laws)?;
            Some((shut[at], sign))
        };
        path.filter_map(way).collect()
    }
}

/// Solves a network whose branches, loose ones included, join all nodes; nothing if no solution was found that obeys
/// all signs.
pub fn solve(network: &Network, ways: &[OneWay]) -> Option<Mixed> {
    let (closed, trial) = by_blocks(network, ways).or_else(|| one_by_one(network, ways))?;
    if trial.cut_off {
        return None;
    }
    let Trial { flow, carried, slack, potentials, rounding, .. } = trial;
    let [current_rounding, rounding] = rounding;
    let is_loose = |at: &usize| matches!(network.laws[*at], Law::Loose(_));
    let all = (0..network.laws.len()).filter(is_loose);
    let loose = all.map(|at| flow.current[at].abs()).sum();
    Some(Mixed { flow, closed, carried, slack, potentials, rounding, current_rounding, loose })
}

/// The mode by block pivoting; nothing where it goes to and fro, or branches without resistance might form loops.
fn by_blocks(network: &Network, ways: &[OneWay]) -> Option<(Vec<bool>, Trial)> {
    if ways.iter().any(|way| way.series == 0.0) {
        return None;
    }
    let mut closed = vec![false; ways.len()];
    let (mut fewest, mut patience) = (usize::MAX, PATIENCE);
    loop {
        let trial = attempt(network, ways, &closed)?;
        let reversed = (0..ways.len()).filter(|&k| closed[k] && trial.carried[k] < 0.0);
        let reversed: Vec<usize> = reversed.collect();
        let violated = violated(ways, &trial, &closed, &[]);
        let wrong = reversed.len() + violated.len();
        if wrong == 0 {
            return Some((closed, trial));
        }
        if wrong < fewest {
            (fewest, patience) = (wrong, PATIENCE);
        } else {
            patience = patience.checked_sub(1)?;
        }
        reversed.into_iter().for_each(|k| closed[k] = false);
        violated.into_iter().for_each(|(k, _)| closed[k] = true);
    }
}

/// The mode by closing one branch after the other.
fn one_by_one(network: &Network, ways: &[OneWay]) -> Option<(Vec<bool>, Trial)> {
    let m = ways.len();
    let (mut closed, mut present) = (vec![false; m], vec![0.0; m]);
    // branches that were violated by rounding alone
    let mut passed = vec![false; m];
    let mut trial = attempt(network, ways, &closed)?;
    // each round ends nearer to the solution than the one before; rounding may undo that
    for _ in 0..3 * m + 1 {
        let Some(&(next, _)) = violated(ways, &trial, &closed, &passed).first() else {
            return Some((closed, trial));
        };
        if trial.hybrid.moves(ways[next].ends) || ways[next].series > 0.0 {
            closed[next] = true;
            trial = attempt(network, ways, &closed)?;
            if trial.carried[next] <= 0.0 {
                (closed[next], passed[next]) = (false, true);
                trial = attempt(network, ways, &closed)?;
                continue;
            }
        } else {
            // fixed branches contradict each other unless a closed one opens for it
            let path = trial.ways_between(ways[next].ends, network.laws.len(), &closed);
            exchange(next, &path, &mut present, &mut closed)?;
            trial = attempt(network, ways, &closed)?;
        }
        while let Some((first, part)) = turning(&present, &trial.carried, &closed) {
            for k in 0..m {
                if !closed[k] {
                    continue;
                }
                let step = trial.carried[k] - present[k];
                let there = present[k] + part * step;
                let ends = k == first || trial.carried[k] < 0.0 && there <= 0.0;
                present[k] = if ends { 0.0 } else { there.max(0.0) };
                closed[k] = !ends;
            }
            trial = attempt(network, ways, &closed)?;
        }
        present.copy_from_slice(&trial.carried);
        passed.fill(false);
    }
    None
}

/// The open branches that are violated, most first, and by how much.
fn violated(ways: &[OneWay], trial: &Trial, closed: &[bool], passed: &[bool]) -> Vec<(usize, f64)> {
    let passed = |k: usize| passed.get(k).is_some_and(|passed| *passed);
    let open = (0..ways.len()).filter(|&k| !closed[k] && !passed(k));
    let violated = open.filter(|&k| trial.slack[k] < -trial.rounding[1]);
    let weighted = |k: usize| (k, trial.slack[k] * trial.hybrid.stiffness(ways[k].ends));
    let mut out: Vec<_> = violated.map(weighted).collect();
    out.sort_by(|a, b| a.1.total_cmp(&b.1));
    out
}

/// Lets a branch take over the current of the closed ones between its ends, until the first of these carries
/// nothing more and opens; nothing if none of them would.
fn exchange(
    next: usize,
    path: &[(usize, f64)],
    present: &mut [f64],
    closed: &mut [bool],
) -> Option<()> {
    let along = path.iter().filter(|e| e.1 > 0.0);
    let (first, _) = *along.min_by(|a, b| present[a.0].total_cmp(&present[b.0]))?;
    let taken = present[first];
    for &(way, sign) in path {
        present[way] = (present[way] - sign * taken).max(0.0);
    }
    (present[first], present[next]) = (0.0, taken);
    (closed[first], closed[next]) = (false, true);
    Some(())
}

/// The first closed branch whose current would turn round on the way from the present currents to others, and
/// after which part of it.
fn turning(present: &[f64], next: &[f64], closed: &[bool]) -> Option<(usize, f64)> {
    let falling = (0..next.len()).filter(|&k| closed[k] && next[k] < 0.0);
    let parts = falling.map(|k| (k, present[k] / (present[k] - next[k])));
    parts.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// The network with some branches closed; nothing if its fixed branches contradict each other.
fn attempt(network: &Network, ways: &[OneWay], closed: &[bool]) -> Option<Trial> {
    let first = network.laws.len();
    let mut mode = network.clone();
    let shut: Vec<usize> = (0..ways.len()).filter(|&k| closed[k]).collect();
    for way in shut.iter().map(|&k| ways[k]) {
        mode.ends.push(way.ends);
        mode.laws.push(if way.series > 0.0 {
            Law::Weighted { weight: 1.0 / way.series, offset: way.offset }
        } else {
            Law::Fixed(way.offset)
        });
    }
    let hybrid = mode.hybrid();
    let x = hybrid.solve()?;
    let tree = hybrid.tree_voltages(&x);
    let potentials = hybrid.basis.potentials(&tree, &vec![0.0; network.nodes]);
    let mut flow = hybrid.flow(&mode, &x);
    let (mut carried, mut slack) = (vec![0.0; ways.len()], vec![0.0; ways.len()]);
    for (at, &k) in shut.iter().enumerate() {
        carried[k] = flow.current[first + at];
    }
    for (k, way) in ways.iter().enumerate().filter(|e| !closed[e.0]) {
        slack[k] = way.offset - hybrid.voltage(&tree, way.ends)?;
    }
    let largest = |list: &[f64]| list.iter().fold(0.0f64, |a, v| a.max(v.abs()));
    let offsets = ways.iter().fold(0.0f64, |a, w| a.max(w.offset.abs()));
    let injected = largest(&network.injected);
    let sizes = [largest(&flow.current).max(injected), largest(&flow.voltage).max(offsets)];
    let rounding = sizes.map(|size| SUMS * size);
    let contradicts = |(law, voltage): (&Law, &f64)| match law {
        Law::Fixed(fixed) => f64::abs(voltage - fixed) > rounding[1],
        Law::Weighted { .. } | Law::Loose(_) | Law::Led => false,
    };
    // what windings bring to a core that stores nothing cancels: else it would have no way but the loose branch, whose
    // voltage would be beyond all numbers; where nothing flows at all the voltage alone decides
    let is_loose = |&at: &usize| matches!(mode.laws[at], Law::Loose(_));
    let cores = if mode.turns.is_empty() { 0 } else { first };
    let firm = |at: &usize| matches!(mode.laws[*at], Law::Fixed(_) | Law::Weighted { .. });
    let firm = (0..first).filter(firm).fold(offsets, |most, at| most.max(flow.voltage[at].abs()));
    let idle =
        |at: usize| flow.current[at].abs() <= rounding[0] || SUMS * flow.voltage[at].abs() <= firm;
    let cut_off = hybrid.cut_off || !(0..cores).filter(is_loose).all(idle);
    if !is_wound(&mode, &flow, &potentials, sizes[1]) {
        return None;
    }
    if !sizes.iter().all(|s| s.is_finite()) || mode.laws.iter().zip(&flow.voltage).any(contradicts)
    {
        return None;
    }
    // rounding of a current that has none
    for current in carried.iter_mut().filter(|i| **i < 0.0 && **i >= -rounding[0]) {
        *current = 0.0;
    }
    flow.voltage.truncate(first);
    flow.current.truncate(first);
    Some(Trial { flow, carried, slack, potentials, rounding, hybrid, cut_off })
}

/// Whether windings have the voltages of their cores, to the rounding of the fluxes that these are differences of.
fn is_wound(mode: &Network, flow: &Flow, potentials: &[f64], largest: f64) -> bool {
    let ground = potentials[mode.nodes - 1];
    let stored = mode.laws.iter().map(|law| match law {
        Law::Weighted { offset, .. } => offset.abs(),
        _ => 0.0,
    });
    let stored = stored.fold(0.0, f64::max);
    let mut sums = vec![[0.0; 2]; if mode.turns.is_empty() { 0 } else { mode.laws.len() }];
    for t in &mode.turns {
        sums[t.winding][0] += t.turns * (potentials[t.core] - ground);
        sums[t.winding][1] += t.turns.abs() * stored;
    }
    let holds = |(at, [v, flux]): (usize, &[f64; 2])| {
        mode.laws[at] != Law::Led || (flow.voltage[at] - v).abs() <= SUMS * (largest + flux)
    };
    sums.iter().enumerate().all(holds)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn capacitors(values: &[(f64, f64)]) -> Network {
        let ground = values.len();
        Network {
            ends: (0..ground).map(|k| [k, ground]).collect(),
            laws: values.iter().map(|v| Law::Weighted { weight: v.0, offset: v.1 }).collect(),
            ..Network::new(ground + 1)
        }
    }

    fn diode(plus: usize, minus: usize) -> OneWay {
        OneWay { ends: [plus, minus], offset: 0.0, series: 0.0 }
    }

    #[test]
    fn two_capacitors_share_their_charge_one_way() {
        let found = solve(&capacitors(&[(1e-6, 3.0), (2e-6, 0.0)]), &[diode(0, 1)]).unwrap();
        assert!(found.closed[0] && (found.carried[0] - 2e-6).abs() < 1e-21);
        assert!((found.potentials[0] - 1.0).abs() < 1e-15, "{:?}", found.potentials);
        let found = solve(&capacitors(&[(1e-6, 3.0), (2e-6, 0.0)]), &[diode(1, 0)]).unwrap();
        assert!(!found.closed[0] && (found.slack[0] - 3.0).abs() < 1e-15);
    }

    #[test]
    fn parallel_branches_carry_the_sum() {
        let found = solve(&capacitors(&[(1e-6, 3.0), (2e-6, 0.0)]), &[diode(0, 1); 3]).unwrap();
        assert!((found.carried.iter().sum::<f64>() - 2e-6).abs() < 1e-20);
        assert!((found.potentials[1] - 1.0).abs() < 1e-14);
    }

    #[test]
    fn a_series_resistance_limits_the_current() {
        // 1 S to ground, 2 A injected, a diode of 0.5 V and 1 Ohm in parallel
        let mut network = Network {
            ends: vec![[0, 1]],
            laws: vec![Law::Weighted { weight: 1.0, offset: 0.0 }],
            ..Network::new(2)
        };
        network.inject(0, 2.0);
        let way = OneWay { ends: [0, 1], offset: 0.5, series: 1.0 };
        let found = solve(&network, &[way]).unwrap();
        assert!((found.carried[0] - 0.75).abs() < 1e-15);
        assert!((found.potentials[0] - 1.25).abs() < 1e-15);
    }

    #[test]
    fn what_cannot_be_is_told() {
        let mut network = capacitors(&[(1.0, 0.0)]);
        network.laws[0] = Law::Fixed(1.0);
        assert!(solve(&network, &[diode(0, 1)]).is_none());
        assert!(solve(&network, &[diode(1, 0)]).is_some());
    }

    /// Random capacitors and diodes compared with the projection by another method: that of Hildreth, coordinate by
    /// coordinate.
    #[test]
    fn charges_are_projected() {
        let mut rng = crate::sparse::examples::Rng(5);
        for _ in 0..40 {
            let n = 3 + rng.below(6);
            let values: Vec<_> =
                (0..n).map(|_| (1.0 + rng.below(9) as f64, 5.0 * rng.signed())).collect();
            let ways: Vec<_> = (0..2 * n)
                .map(|_| (rng.below(n), rng.below(n)))
                .filter(|(a, b)| a != b)
                .map(|(a, b)| diode(a, b))
                .collect();
            let found = solve(&capacitors(&values), &ways).unwrap();
            let mut v: Vec<f64> = values.iter().map(|v| v.1).collect();
            let mut charge = vec![0.0; ways.len()];
            for _ in 0..20_000 {
                for (charge, way) in charge.iter_mut().zip(&ways) {
                    let [a, b] = way.ends;
                    let [one, other] = [1.0 / values[a].0, 1.0 / values[b].0];
                    let more = ((v[a] - v[b]) / (one + other)).max(-*charge);
                    *charge += more;
                    v[a] -= more * one;
                    v[b] += more * other;
                }
            }
            for (found, expected) in found.potentials.iter().zip(&v) {
                assert!((found - expected).abs() < 1e-9, "{found} {expected}");
            }
        }
    }
}

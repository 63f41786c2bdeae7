//! A network under construction.

use super::active_set::{solve, Mixed, OneWay};
use crate::structure::{Branch, Coupled, Law, Network, Turns};
use std::ops::Range;

/// Branches by their laws.
pub struct Draft {
    network: Network,
}

impl Draft {
    /// No branches between so many nodes, the last of which is ground.
    pub fn new(nodes: usize) -> Draft {
        Draft { network: Network::new(nodes) }
    }

    /// Adds branches and returns the range that they take.
    pub fn add(
        &mut self,
        branches: &[Branch],
        law: impl Fn(usize, &Branch) -> Law,
    ) -> Range<usize> {
        let first = self.network.laws.len();
        for (k, branch) in branches.iter().enumerate() {
            self.network.ends.push(branch.ends);
            self.network.laws.push(law(k, branch));
        }
        first..self.network.laws.len()
    }

    /// Adds coupled inductors: windings, and cores that store what the law gives, or else take the currents of their
    /// fluxes; returns the ranges of both.
    pub fn wind(&mut self, group: &Coupled, fluxes: &[f64], stores: bool) -> [Range<usize>; 2] {
        let windings = self.add(&group.windings, |_, _| Law::Led);
        let ground = self.network.nodes - 1;
        let first = self.network.laws.len();
        for (k, flux) in fluxes.iter().enumerate() {
            let core = group.first + k;
            if stores {
                self.network.ends.push([core, ground]);
                self.network.laws.push(Law::Weighted { weight: 1.0, offset: -flux });
            } else {
                self.network.inject(core, -flux);
            }
            let turns = |winding: usize| group.turns(winding - windings.start, k);
            let all =
                windings.clone().map(|winding| Turns { winding, core, turns: turns(winding) });
            self.network.turns.extend(all.filter(|t| t.turns != 0.0));
        }
        [windings, first..self.network.laws.len()]
    }

    /// Lets a current leave the positive end of a branch and enter the negative one.
    pub fn carry(&mut self, branch: &Branch, current: f64) {
        self.network.inject(branch.ends[0], -current);
        self.network.inject(branch.ends[1], current);
    }

    /// Injects the values of a list of all unknowns into the nodes.
    pub fn inject(&mut self, entering: &[f64]) {
        for (node, &current) in entering.iter().enumerate() {
            self.network.inject(node, current);
        }
    }

    /// Solves it with one-way branches; parts without a connection stay at these potentials where nothing moves
    /// them.  Nothing if there is no solution.
    pub fn solve(mut self, ways: &[OneWay], potentials: &[f64]) -> Option<Mixed> {
        self.network.hold(potentials);
        solve(&self.network, ways)
    }
}

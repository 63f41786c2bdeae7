//! Switches that the sources alone decide about: their states need no solution.

use std::iter::empty;

use crate::descriptor::Linear;
use crate::rounding::OF_EQUATION;
use crate::source_determined::{given_by_sources, Given};
use crate::sparse::Csc;
use crate::switch::{Slack, Switch};

/// How the controls of switches follow from the sources.
#[derive(Clone, Debug, Default)]
pub struct Controls {
    known: Vec<Given>,
    decided: Vec<bool>,
}

impl Controls {
    /// Looks for switches whose controls are given; `functions` are the laws that contain functions.
    pub fn new(
        linear: &Linear,
        functions: impl Iterator<Item = usize>,
        switches: &[Switch],
    ) -> Controls {
        if switches.is_empty() {
            return Controls::default();
        }
        let mut known = given_by_sources(linear, functions, |_| true);
        let mut found = vec![false; linear.g.nrows];
        known.iter().for_each(|k| found[k.unknown] = true);
        let decided: Vec<bool> =
            switches.iter().map(|s| s.control.iter().all(|&(j, _)| found[j])).collect();
        // only what the controls need
        let mut needed = vec![false; found.len()];
        for (switch, _) in switches.iter().zip(&decided).filter(|e| *e.1) {
            switch.control.iter().for_each(|&(j, _)| needed[j] = true);
        }
        for step in known.iter().rev() {
            if needed[step.unknown] {
                step.others.iter().for_each(|&(j, _)| needed[j] = true);
            }
        }
        known.retain(|k| needed[k.unknown]);
        Controls { known, decided }
    }

    /// Whether the sources decide about a switch.
    pub fn decide(&self, switch: usize) -> bool {
        self.decided[switch]
    }

    /// Whether they decide about any.
    pub fn any(&self) -> bool {
        self.decided.contains(&true)
    }

    /// Fills in the unknowns that matter to decided switches; `s` are the source columns, `u` the
    /// sources.
    pub fn fill(&self, s: &Csc, u: &[f64], z: &mut [f64]) {
        let mut right = vec![0.0; s.nrows];
        s.mul_add(1.0, u, &mut right);
        for k in &self.known {
            let others: f64 = k.others.iter().map(|&(j, f)| f * z[j]).sum();
            z[k.unknown] = (right[k.row] - others) / k.factor;
        }
    }
}

/// The state of each switch's gate in a network without functions where the sources are `u`, from the states
/// `before`; None if that depends on more than sources.
pub fn by_sources(
    linear: &Linear,
    switches: &[Switch],
    before: &[bool],
    u: &[f64],
) -> Option<Vec<bool>> {
    let controls = Controls::new(linear, empty(), switches);
    let mut z = vec![f64::NAN; linear.g.nrows];
    controls.fill(&linear.s, u, &mut z);
    let states = switches.iter().zip(before).enumerate().map(|(k, (switch, &gate))| {
        controls
            .decide(k)
            .then(|| gate != switch.turns(gate, &z, Slack::of_terms(OF_EQUATION), false))
    });
    states.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::descriptor::Linear;
    use crate::sparse::Csc;
    use crate::switch::AtThreshold;

    /// Each unknown from the one before: 2 V in front, and a control behind two more laws.
    #[test]
    fn all_that_a_control_needs_is_known() {
        let g = [(0, 0, 1.0), (1, 0, -0.5), (1, 1, 1.0), (2, 1, -2.0), (2, 2, 1.0)];
        let linear = Linear {
            e: Csc::zeros(3, 3),
            g: Csc::from_triplets(3, 3, &g),
            a: Csc::zeros(3, 0),
            b: Csc::zeros(0, 3),
            d: Csc::zeros(0, 0),
            q: Vec::new(),
            s: Csc::from_triplets(3, 1, &[(0, 0, 1.0)]),
            row_kind: vec![0; 3],
        };
        let switch = Switch {
            pair: 0,
            control: vec![(2, 1.0)],
            on_above: 1.0,
            off_below: 1.0,
            inverted: false,
            latching: false,
            at_threshold: AtThreshold::Reached,
        };
        assert_eq!(by_sources(&linear, &[switch], &[false], &[2.0]), Some(vec![true]));
    }

    /// Nodes 0 and 1 in series from ground, sources of 2 V and 3 V (currents 2 and 3), 1 Ohm from
    /// node 1 to node 4, which has a capacitor.
    #[test]
    fn chains_of_sources_are_followed() {
        let g = [
            (0, 2, 1.0),
            (0, 3, -1.0),
            (1, 3, 1.0),
            (1, 1, 1.0),
            (1, 4, -1.0),
            (2, 0, -1.0),
            (3, 0, 1.0),
            (3, 1, -1.0),
            (4, 1, -1.0),
            (4, 4, 1.0),
        ];
        let linear = Linear {
            e: Csc::from_triplets(5, 5, &[(4, 4, 1e-6)]),
            g: Csc::from_triplets(5, 5, &g),
            a: Csc::from_triplets(5, 0, &[]),
            b: Csc::from_triplets(0, 5, &[]),
            d: Csc::from_triplets(0, 0, &[]),
            q: Vec::new(),
            s: Csc::from_triplets(5, 2, &[(2, 0, -1.0), (3, 1, -1.0)]),
            row_kind: vec![0, 0, 1, 1, 0],
        };
        let switch = |control: Vec<(usize, f64)>| Switch {
            pair: 0,
            control,
            on_above: 4.5,
            off_below: 1.0,
            inverted: false,
            latching: false,
            at_threshold: AtThreshold::Reached,
        };
        let high = switch(vec![(1, 1.0)]); // 5 V
        let kept = switch(vec![(1, 1.0), (0, -1.0)]); // 3 V: between the thresholds
        let low = switch(vec![(0, -1.0)]);
        let u = [2.0, 3.0];
        let found = by_sources(&linear, &[high.clone(), kept, low], &[false, true, true], &u);
        assert_eq!(found, Some(vec![true, true, false]));
        let stored = [high, switch(vec![(4, 1.0)])];
        assert_eq!(by_sources(&linear, &stored, &[false, false], &u), None);
        assert_eq!(by_sources(&linear, &[], &[], &u), Some(vec![]));
    }
}

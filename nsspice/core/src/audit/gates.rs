//! Gates of switches against their controls: a switch that has missed its threshold obeys all laws of the mode
//! in which it should no longer be.

use super::recorded::Taken;
use super::{ratio, worse, TOLERANCE};
use crate::mlcp::Role;
use crate::switch::{Switch, Turn};
use crate::waveform::INSTANT;
use std::sync::Arc;

/// Part of its terms to which a control is known where it reaches a threshold: what locates it is the tolerance
/// of a run, and the rounding of instants on steep edges.
const KNOWN: f64 = 1e-6;

/// The worst control that lies beyond the threshold at which its gate should have turned.
pub struct Gates {
    switches: Arc<[Switch]>,
    /// how far the control of each has been from its thresholds
    swings: Vec<f64>,
    /// by how much, as a part of its terms, in units in which [`TOLERANCE`] is allowed
    pub error: f64,
    /// the pair of that switch
    pub worst: Option<usize>,
}

impl Gates {
    /// Nothing is known yet of these switches.
    pub fn new(switches: Arc<[Switch]>) -> Gates {
        let swings = vec![0.0; switches.len()];
        Gates { switches, swings, error: 0.0, worst: None }
    }

    /// Takes both ends of recorded intervals of `n` unknowns and `m` pairs; where switches are sampled their
    /// controls may be anywhere.
    pub(super) fn take(&mut self, all: &Taken, kinds: &[u8], m: usize) {
        if all.roles.is_empty() {
            return;
        }
        let n = kinds.len();
        let ends =
            |k: usize| [&all.first[k * n..][..n], &all.z[((k + 1) * all.nodes - 1) * n..][..n]];
        // a control that begins to move is measured by where it goes
        let seen: Vec<(bool, [f64; 2])> = (0..all.begin.len())
            .flat_map(|k| self.switches.iter().map(move |switch| (k, switch)))
            .map(|(k, switch)| {
                let open = all.roles[k * m..][switch.pair] == Role::Open as u8;
                let gate = open == switch.inverted;
                (gate, ends(k).map(|z| switch.distance(gate, z)))
            })
            .collect();
        let count = self.switches.len();
        for (i, (_, distances)) in seen.iter().enumerate() {
            let swing = &mut self.swings[i % count];
            *swing = distances.iter().fold(*swing, |most, d| most.max(d.abs()));
        }
        for (i, &(gate, distances)) in seen.iter().enumerate() {
            let (k, switch, swing) = (i / count, &self.switches[i % count], self.swings[i % count]);
            let length = all.end[k] - all.begin[k];
            let blurred = (INSTANT * all.end[k].abs() / length).min(1.0);
            let doubt = all.doubt[k] + blurred * (distances[1] - distances[0]).abs();
            if switch.latching && all.roles[k * m..][switch.pair] != Role::Open as u8 {
                // a thyristor that conducts needs no gate, and one that has stopped does
                let place = |i: usize| (k * all.nodes + i) * m + switch.pair;
                let carries = |i: usize| all.l.get(place(i)).is_none_or(|l| *l != 0.0);
                if (0..all.nodes).any(carries) {
                    continue;
                }
            }
            for (z, distance) in ends(k).into_iter().zip(distances) {
                let found = excess(switch, gate, z, -distance - doubt, swing);
                if worse(found, self.error) {
                    (self.error, self.worst) = (found, Some(switch.pair));
                }
            }
        }
    }
}

impl Gates {
    /// Takes gates that have turned: their controls had reached the threshold, and gone beyond it only where it was
    /// not searched for; a thyristor opens when it carries nothing of the `largest` current.  Steps find the instants to
    /// their `tolerance`.
    pub fn take_turns(&mut self, turns: &[Turn], largest: f64, tolerance: f64) {
        let known = tolerance.max(KNOWN);
        for turn in turns {
            let Some(switch) = self.switches.get(turn.switch) else { continue };
            let swing = &mut self.swings[turn.switch];
            *swing = swing.max(switch.edge(turn.gate).0.abs()).max(turn.control.abs());
        }
        for turn in turns {
            let Some(switch) = self.switches.get(turn.switch) else { continue };
            let (threshold, sign) = switch.edge(turn.gate);
            let short = sign * (turn.control - threshold);
            let missing = if turn.located { short.abs() } else { short };
            let mut found = if missing.is_nan() {
                f64::NAN
            } else {
                ratio(missing.max(0.0), self.swings[turn.switch]) * TOLERANCE / known
            };
            if switch.latching && turn.gate {
                let carried = ratio(turn.carried.max(0.0), largest) * TOLERANCE / known;
                found = if worse(carried, found) { carried } else { found };
            }
            if worse(found, self.error) {
                (self.error, self.worst) = (found, Some(switch.pair));
            }
        }
    }
}

/// How far a control lies beyond its threshold, in units in which [`TOLERANCE`] is allowed.
pub(super) fn excess(switch: &Switch, gate: bool, z: &[f64], beyond: f64, swing: f64) -> f64 {
    if beyond <= 0.0 {
        return 0.0;
    }
    let terms = switch.control.iter().map(|&(j, c)| (c * z[j]).abs());
    let size = switch.edge(gate).0.abs() + terms.sum::<f64>();
    // an unknown with a law of its own does not show the terms that cancel in it
    ratio(beyond, size.max(swing)) * TOLERANCE / KNOWN
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::switch::AtThreshold;

    fn error(inverted: bool, latching: bool, role: u8, ends: [f64; 2], doubt: f64) -> f64 {
        let (on_above, off_below) = (3.0, 2.0);
        let (control, at_threshold) = (vec![(0, 1.0)], AtThreshold::Reached);
        error_of(
            Switch { pair: 0, control, on_above, off_below, inverted, latching, at_threshold },
            role,
            ends,
            doubt,
        )
    }

    fn error_of(switch: Switch, role: u8, ends: [f64; 2], doubt: f64) -> f64 {
        let mut gates = Gates::new(vec![switch].into());
        let all = Taken {
            nodes: 2,
            begin: vec![1.0],
            end: vec![2.0],
            doubt: vec![doubt],
            first: ends[..1].to_vec(),
            z: ends.to_vec(),
            roles: vec![role],
            ..Taken::default()
        };
        gates.take(&all, &[0], 1);
        gates.error
    }

    #[test]
    fn a_switch_stays_between_its_thresholds() {
        // closed (1) from 3 V down to 2 V, open (2) from 2 V up to 3 V
        assert_eq!(error(false, false, 1, [3.5, 2.0], 0.0), 0.0);
        assert_eq!(error(false, false, 2, [1.0, 3.0], 0.0), 0.0);
        assert_eq!(error(true, false, 2, [3.5, 2.0], 0.0), 0.0);
        // located to 1e-9
        assert!(error(false, false, 1, [3.5, 2.0 - 1e-9], 0.0) < TOLERANCE);
    }

    #[test]
    fn a_missed_threshold_is_told() {
        assert!(error(false, false, 1, [3.5, 1.9], 0.0) > 1e3 * TOLERANCE);
        assert!(error(false, false, 2, [1.0, 3.1], 0.0) > 1e3 * TOLERANCE);
        assert!(error(true, false, 1, [1.0, 3.1], 0.0) > 1e3 * TOLERANCE);
        assert!(error(false, true, 2, [1.0, 3.1], 0.0) > 1e3 * TOLERANCE);
        assert!(error(false, false, 1, [3.5, f64::NAN], 0.0).is_nan());
    }

    #[test]
    fn a_control_that_ends_at_zero_is_measured_by_where_it_has_been() {
        let (control, at_threshold) = (vec![(0, 1.0)], AtThreshold::Reached);
        let (on_above, off_below, inverted, latching) = (0.0, 0.0, false, false);
        let switch =
            Switch { pair: 0, control, on_above, off_below, inverted, latching, at_threshold };
        assert!(error_of(switch.clone(), 1, [2.0, -1e-9], 0.0) < TOLERANCE);
        assert!(error_of(switch.clone(), 1, [2.0, -1e-4], 0.0) > 10.0 * TOLERANCE);
        assert!(error_of(switch, 1, [-1e-9, -1e-9], 0.0) > 1e3 * TOLERANCE);
    }

    #[test]
    fn what_is_sampled_or_conducts_may_wait() {
        assert_eq!(error(false, false, 1, [3.5, 1.9], f64::INFINITY), 0.0);
        // a thyristor (0) without a gate
        assert_eq!(error(false, true, 0, [3.5, 0.0], 0.0), 0.0);
    }

    #[test]
    fn gates_turn_where_their_controls_have_arrived() {
        // closed from 3 V down to 2 V
        let error = |latching: bool, gate: bool, control: f64, carried: f64, located: bool| {
            let at_threshold = AtThreshold::Reached;
            let (on_above, off_below, inverted) = (3.0, 2.0, false);
            let control_of = vec![(0, 1.0)];
            let switch = Switch {
                pair: 0,
                control: control_of,
                on_above,
                off_below,
                inverted,
                latching,
                at_threshold,
            };
            let mut gates = Gates::new(vec![switch].into());
            let turn = Turn { time: 0.0, switch: 0, gate, control, carried, located };
            gates.take_turns(&[turn], 1.0, 0.0);
            gates.error
        };
        for located in [false, true] {
            assert_eq!(error(false, false, 3.0, 0.0, located), 0.0);
            assert_eq!(error(false, true, 2.0, 1.0, located), 0.0);
            // short of it
            assert!(error(false, false, 2.9, 0.0, located) > TOLERANCE);
            assert!(error(false, true, 2.1, 1.0, located) > TOLERANCE);
        }
        // beyond it after a jump alone
        assert_eq!(error(false, false, 5.0, 0.0, false), 0.0);
        assert!(error(false, false, 5.0, 0.0, true) > TOLERANCE);
        // a thyristor opens without a current
        assert_eq!(error(true, true, 0.0, 0.0, false), 0.0);
        assert!(error(true, true, 0.0, 0.1, false) > TOLERANCE);
    }
}

//! Gates of switches against their controls: a switch that has missed its threshold obeys all laws of the mode
//! in which it should no longer be.

use super::sources::INSTANT;
use super::stretches::Stretches;
use super::{ratio, worse, TOLERANCE};
use crate::mlcp::Role;
use crate::switch::Switch;
use std::sync::Arc;

/// Part of its terms to which a control is known where it reaches a threshold: what locates it is the tolerance
/// of a run, and the rounding of instants on steep edges.
const KNOWN: f64 = 1e-6;

/// The worst control that lies beyond the threshold at which its gate should have turned.
pub struct Gates {
    switches: Arc<[Switch]>,
    /// by how much, as a part of its terms, in units in which [`TOLERANCE`] is allowed
    pub error: f64,
    /// the pair of that switch
    pub worst: Option<usize>,
}

impl Gates {
    /// Nothing is known yet of these switches.
    pub fn new(switches: Arc<[Switch]>) -> Gates {
        Gates { switches, error: 0.0, worst: None }
    }

    /// Takes both ends of recorded stretches of `n` unknowns and `m` pairs; where switches are sampled their
    /// controls may be anywhere.
    pub(super) fn take(&mut self, all: &Stretches, n: usize, m: usize) {
        if all.roles.is_empty() {
            return;
        }
        for k in 0..all.begin.len() {
            let roles = &all.roles[k * m..][..m];
            let ends = [&all.first[k * n..][..n], &all.z[((k + 1) * all.nodes - 1) * n..][..n]];
            let length = all.end[k] - all.begin[k];
            let blurred = (INSTANT * all.end[k].abs() / length).min(1.0);
            for switch in self.switches.iter() {
                let controls = ends.map(|z| switch.value(z));
                let doubt = all.doubt[k] + blurred * (controls[1] - controls[0]).abs();
                for (z, control) in ends.iter().zip(controls) {
                    let found = excess(switch, roles[switch.pair], z, control, doubt);
                    if worse(found, self.error) {
                        (self.error, self.worst) = (found, Some(switch.pair));
                    }
                }
            }
        }
    }
}

/// How far the control of a switch in a role lies beyond its threshold.
fn excess(switch: &Switch, role: u8, z: &[f64], control: f64, doubt: f64) -> f64 {
    let open = role == Role::Open as u8;
    if switch.latching && !open {
        return 0.0; // a thyristor that conducts needs no gate
    }
    let (threshold, sign) = switch.edge(open == switch.inverted);
    let beyond = sign * (threshold - control) - doubt;
    if beyond <= 0.0 {
        return 0.0;
    }
    let terms = switch.control.iter().map(|&(j, c)| (c * z[j]).abs());
    ratio(beyond, threshold.abs() + terms.sum::<f64>()) * TOLERANCE / KNOWN
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(inverted: bool, latching: bool, role: u8, ends: [f64; 2], doubt: f64) -> f64 {
        let switch = Switch {
            pair: 0,
            control: vec![(0, 1.0)],
            on_above: 3.0,
            off_below: 2.0,
            inverted,
            latching,
        };
        let mut gates = Gates::new(vec![switch].into());
        let none = &[][..];
        gates.take(
            &Stretches {
                nodes: 2,
                known: 0.0,
                begin: &[1.0],
                end: &[2.0],
                grain: &[1.0],
                swing: &[0.0],
                steps: &[1],
                signed: &[1],
                doubt: &[doubt],
                first: &ends[..1],
                first_u: none,
                time: &[1.0, 2.0],
                weight: &[0.5, 0.5],
                inner: none,
                z: &ends,
                rate: &[0.0; 2],
                l: &[0.0; 2],
                u: none,
                function_rate: none,
                roles: &[role],
                seam_end: none,
                seam_begin: none,
            },
            1,
            1,
        );
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
    fn what_is_sampled_or_conducts_may_wait() {
        assert_eq!(error(false, false, 1, [3.5, 1.9], f64::INFINITY), 0.0);
        // a thyristor (0) without a gate
        assert_eq!(error(false, true, 0, [3.5, 0.0], 0.0), 0.0);
    }
}

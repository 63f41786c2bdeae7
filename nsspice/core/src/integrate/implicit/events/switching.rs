//! The switches of a network, and what a run knows of their controls.

use super::source_controlled::Controls;
use crate::at_threshold::Resting;
use crate::mlcp::Role;
use crate::switch::{Switch, Turns};
use std::sync::Arc;

/// The switches and what decides about them.
pub struct Switching {
    /// all of them
    pub(in crate::integrate) switches: Arc<[Switch]>,
    /// those that chatter, see [`crate::sampling`]
    pub(in crate::integrate) sampled: Vec<bool>,
    /// how far the control of each has been from its threshold
    pub(in crate::integrate) swings: Vec<f64>,
    /// those that rest at thresholds
    pub(in crate::integrate) resting: Resting,
    /// whether a control that is at its threshold is taken to stay there
    pub(in crate::integrate) still: Vec<bool>,
    /// the points of a sweep: each is at rest, and no time passes between them
    pub(in crate::integrate) frozen: bool,
    /// state of each switch's gate
    pub(in crate::integrate) gates: Vec<bool>,
    /// switches that sources decide about
    pub(in crate::integrate) controls: Controls,
    /// the switch that has changed last
    pub(in crate::integrate) last_thrown: Option<usize>,
    /// where controls were when gates turned
    pub turns: Turns,
}

impl Switching {
    /// All of them with the state of each gate; none has been looked at.
    pub fn new(switches: Arc<[Switch]>, gates: Vec<bool>, controls: Controls) -> Switching {
        let count = switches.len();
        Switching {
            switches,
            sampled: vec![false; count],
            swings: vec![0.0; count],
            resting: Resting::new(count),
            still: vec![false; count],
            frozen: false,
            gates,
            controls,
            last_thrown: None,
            turns: Turns::default(),
        }
    }

    /// Whether a switch is a thyristor that has been fired.
    pub fn latched(&self, k: usize) -> bool {
        self.switches[k].role(self.gates[k]) == Role::Diode
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.switches.len()
    }
}

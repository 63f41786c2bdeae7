//! Switches as the engines see them: a gate that follows a control, and what it makes of a pair.
//!
//! The gate is up above one threshold, down below the other, and unchanged in between.  It opens and
//! closes a pair, or lets one be a diode that it cannot open while a current flows: a thyristor.  What a
//! switch is is defined here; the states of the gates are those of the engine that runs it.

use crate::mlcp::Role;

/// How far a control may lie beyond a threshold that it has not crossed.
#[derive(Clone, Copy, Debug)]
pub struct Slack {
    /// to which part of its terms it is known
    pub part: f64,
    /// how far from its threshold it has been: an unknown with a law of its own does not show the terms
    /// that cancel in it
    pub swing: f64,
}

impl Slack {
    /// Of a control that is known to this part of its terms, none of them with a law of its own.
    pub fn of_terms(part: f64) -> Slack {
        Slack { part, swing: 0.0 }
    }
}

/// What the gate of a switch is while its control stays at a threshold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AtThreshold {
    /// it turns when the control has come there: a switch
    Reached,
    /// up or down, wherever the control has come from: a comparison
    Is(bool),
}

/// Leaves of the switches that turn now the comparisons alone, if there are any: a switch with a band keeps its state
/// through what they show while they come to rest one by one.
pub fn comparisons_first(switches: &[Switch], turning: &mut Vec<usize>) {
    if turning.iter().any(|&k| switches[k].compares()) {
        turning.retain(|&k| switches[k].compares());
    }
}

/// A gate that has turned: where its control was, and what its pair carried.
#[derive(Clone, Copy, Debug)]
pub struct Turn {
    /// when [s]
    pub time: f64,
    /// the number of the switch
    pub switch: usize,
    /// the gate before
    pub gate: bool,
    /// the control
    pub control: f64,
    /// the multiplier of the pair
    pub carried: f64,
    /// the instant was searched for: the control is at the threshold, neither short of it nor beyond
    pub located: bool,
}

/// Turns of gates in the order in which they came, the first few thousand in full.
#[derive(Clone, Debug, Default)]
pub struct Turns {
    /// those that are kept
    pub kept: Vec<Turn>,
    /// somebody judges them
    pub wanted: bool,
}

impl Turns {
    /// Turns kept in full.
    const MOST: usize = 4096;

    /// Whether another one is to be kept.
    pub fn open(&self) -> bool {
        self.wanted && self.kept.len() < Turns::MOST
    }

    /// Keeps a turn of the gate of switch `k` at a time, where the unknowns are `z` and the multipliers `l`.
    pub fn note(
        &mut self,
        (time, located): (f64, bool),
        k: usize,
        of: (&Switch, bool),
        at: [&[f64]; 2],
    ) {
        if self.open() {
            let ((switch, gate), [z, l]) = (of, at);
            let (control, carried) = (switch.value(z), l[switch.pair]);
            self.kept.push(Turn { time, switch: k, gate, control, carried, located });
        }
    }
}

/// A switch.
#[derive(Clone, Debug)]
pub struct Switch {
    /// the pair that it opens and closes
    pub pair: usize,
    /// control value as a combination of unknowns
    pub control: Vec<(usize, f64)>,
    /// the gate goes up above this
    pub on_above: f64,
    /// the gate goes down below this
    pub off_below: f64,
    /// the pair conducts while the gate is down
    pub inverted: bool,
    /// closed it is a diode, and it does not open while that conducts
    pub latching: bool,
    /// the gate where the control stays at a threshold
    pub at_threshold: AtThreshold,
}

impl Switch {
    /// Role of the pair with the gate in a state.
    #[inline]
    pub fn role(&self, gate: bool) -> Role {
        match (gate != self.inverted, self.latching) {
            (true, false) => Role::Closed,
            (true, true) => Role::Diode,
            (false, _) => Role::Open,
        }
    }

    /// Whether the gate stays as it is regardless of the control, if the pair `conducts`.
    #[inline]
    pub fn held(&self, gate: bool, conducts: bool) -> bool {
        fault!("thyristor_opens_at_once" => return false);
        conducts && self.role(gate) == Role::Diode
    }

    /// Whether it is a comparison, whose gate follows from its control alone.
    #[inline]
    pub fn compares(&self) -> bool {
        matches!(self.at_threshold, AtThreshold::Is(_))
    }

    /// Whether the gate turns where the control stays at the threshold that turns it; `settled` says that it has
    /// done so since the control came there.
    pub fn turns_at_rest(&self, gate: bool, settled: bool) -> bool {
        match self.at_threshold {
            AtThreshold::Reached => !settled,
            AtThreshold::Is(up) => gate != up,
        }
    }

    /// The threshold that turns the gate, and the sign of the control's distance to it.
    #[inline]
    pub fn edge(&self, gate: bool) -> (f64, f64) {
        if gate {
            (self.off_below, 1.0)
        } else {
            (self.on_above, -1.0)
        }
    }

    /// The control where the unknowns are `z`.
    #[inline]
    pub fn value(&self, z: &[f64]) -> f64 {
        self.control.iter().map(|&(j, c)| c * z[j]).sum()
    }

    /// The size of the terms of the control and of its threshold where the unknowns are `z`.
    pub fn size(&self, z: &[f64]) -> f64 {
        let terms: f64 = self.control.iter().map(|&(j, c)| (c * z[j]).abs()).sum();
        terms.max(self.on_above.abs())
    }

    /// How far the control is from the threshold that turns the gate; negative beyond it.
    #[inline]
    pub fn distance(&self, gate: bool, z: &[f64]) -> f64 {
        let (threshold, sign) = self.edge(gate);
        sign * (self.value(z) - threshold)
    }

    /// Whether the gate turns where the unknowns are `z`, if the pair `conducts` or not.
    pub fn turns(&self, gate: bool, z: &[f64], slack: Slack, conducts: bool) -> bool {
        // a control that sits on its threshold up to what it errs by has not crossed it
        !self.held(gate, conducts) && self.distance(gate, z) < -self.known(z, slack)
    }

    /// To what the control is known where the unknowns are `z`.
    pub fn known(&self, z: &[f64], slack: Slack) -> f64 {
        let size: f64 = self.control.iter().map(|&(j, c)| (c * z[j]).abs()).sum();
        slack.part * size.max(slack.swing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rounding::OF_EQUATION;

    #[test]
    fn a_thyristor_stays_on_while_it_conducts() {
        let mut switch = Switch {
            pair: 0,
            control: vec![(0, 1.0)],
            on_above: 2.0,
            off_below: 2.0,
            inverted: false,
            latching: true,
            at_threshold: AtThreshold::Reached,
        };
        assert_eq!([false, true].map(|gate| switch.role(gate)), [Role::Open, Role::Diode]);
        assert!(!switch.turns(false, &[2.0], Slack::of_terms(OF_EQUATION), false));
        assert!(switch.turns(false, &[2.1], Slack::of_terms(OF_EQUATION), false));
        assert!(!switch.turns(true, &[0.0], Slack::of_terms(OF_EQUATION), true));
        assert!(switch.turns(true, &[0.0], Slack::of_terms(OF_EQUATION), false));
        switch.latching = false;
        assert_eq!(switch.role(true), Role::Closed);
        assert!(switch.turns(true, &[0.0], Slack::of_terms(OF_EQUATION), true));
    }

    #[test]
    fn rounding_crosses_no_threshold() {
        let switch = Switch {
            pair: 0,
            control: vec![(0, 1.0), (1, -1.0)],
            on_above: 0.1,
            off_below: 0.1,
            inverted: true,
            latching: false,
            at_threshold: AtThreshold::Reached,
        };
        assert_eq!([false, true].map(|gate| switch.role(gate)), [Role::Closed, Role::Open]);
        for value in [1.1 - 4e-16, 1.1, 1.1 + 4e-16] {
            let turns =
                |gate| switch.turns(gate, &[value, 1.0], Slack::of_terms(OF_EQUATION), false);
            assert!(![false, true].into_iter().any(turns));
        }
        assert!(switch.turns(false, &[1.2, 1.0], Slack::of_terms(OF_EQUATION), false));
        assert!(switch.turns(true, &[1.0, 1.0], Slack::of_terms(OF_EQUATION), false));
        // unknowns that are known less well cross it later
        assert!(switch.turns(false, &[1.1 + 1e-11, 1.0], Slack::of_terms(OF_EQUATION), false));
        assert!(!switch.turns(false, &[1.1 + 1e-11, 1.0], Slack::of_terms(1e-10), false));
    }

    #[test]
    fn a_control_is_known_to_rounding_of_where_it_has_been() {
        let switch = Switch {
            pair: 0,
            control: vec![(0, 1.0)],
            on_above: 0.0,
            off_below: 0.0,
            inverted: false,
            latching: false,
            at_threshold: AtThreshold::Reached,
        };
        assert_eq!(switch.distance(true, &[-3.0]), -3.0);
        let turns = |swing| switch.turns(true, &[-1e-13], Slack { part: 1e-10, swing }, false);
        assert_eq!([0.0, 1.0].map(turns), [true, false]);
    }
}

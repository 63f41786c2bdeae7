//! The switch law: closed above one threshold, open below the other, unchanged in between.

use crate::mlcp::Role;

/// A switch and its control.
#[derive(Clone, Debug)]
pub struct Switch {
    /// the complementarity pair that carries it
    pub pair: usize,
    /// control value as a combination of unknowns
    pub control: Vec<(usize, f64)>,
    /// closes above this
    pub on_above: f64,
    /// opens below this
    pub off_below: f64,
    /// present state of the control: above the thresholds
    pub closed: bool,
    /// the pair conducts while the control is below
    pub inverted: bool,
}

impl Switch {
    /// Role of the pair in the present state.
    pub fn role(&self) -> Role {
        if self.closed != self.inverted {
            Role::Closed
        } else {
            Role::Open
        }
    }

    /// Applies the law to the unknowns `z`; true if the state changed.
    pub fn update(&mut self, z: &[f64]) -> bool {
        let value: f64 = self.control.iter().map(|&(j, c)| c * z[j]).sum();
        let size: f64 = self.control.iter().map(|&(j, c)| (c * z[j]).abs()).sum();
        // a control that sits on its threshold up to rounding has not crossed it
        let slack = 8.0 * f64::EPSILON * size;
        let closed = if self.closed {
            value >= self.off_below - slack
        } else {
            value > self.on_above + slack
        };
        std::mem::replace(&mut self.closed, closed) != closed
    }
}

//! The switch law: closed above one threshold, open below the other, unchanged in between; and that of a
//! thyristor, which lets current pass one way and stays closed until there is none.

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
    /// closed it is a diode, and it does not open while that conducts: a thyristor
    pub latching: bool,
}

impl Switch {
    /// Role of the pair in the present state.
    pub fn role(&self) -> Role {
        match (self.closed != self.inverted, self.latching) {
            (true, false) => Role::Closed,
            (true, true) => Role::Diode,
            (false, _) => Role::Open,
        }
    }

    /// Whether it stays closed whatever its control does, if its pair `conducts`.
    pub fn held(&self, conducts: bool) -> bool {
        self.latching && self.closed && conducts
    }

    /// Applies the law to the unknowns `z`; true if the state changed.
    pub fn update(&mut self, z: &[f64], conducts: bool) -> bool {
        if self.held(conducts) {
            return false;
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thyristor_stays_on_while_it_conducts() {
        let mut thyristor = Switch {
            pair: 0,
            control: vec![(0, 1.0)],
            on_above: 2.0,
            off_below: 2.0,
            closed: false,
            inverted: false,
            latching: true,
        };
        assert_eq!(thyristor.role(), Role::Open);
        assert!(!thyristor.update(&[2.0], false));
        assert!(thyristor.update(&[2.1], false));
        assert_eq!(thyristor.role(), Role::Diode);
        assert!(!thyristor.update(&[0.0], true));
        assert!(thyristor.update(&[0.0], false));
        assert_eq!(thyristor.role(), Role::Open);
        let mut switch = Switch { latching: false, closed: true, ..thyristor };
        assert_eq!(switch.role(), Role::Closed);
        assert!(switch.update(&[0.0], true));
    }
}

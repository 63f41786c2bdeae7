//! The state of a network at an instant, and the mode in which it is: plain data.

use crate::mlcp::Role;

/// Where a run is.
#[derive(Clone)]
pub struct State {
    /// present time [s]
    pub time: f64,
    /// unknowns, shape `(n,)`
    pub z: Vec<f64>,
    /// multipliers of the pairs, shape `(m,)`
    pub l: Vec<f64>,
    /// sources at the begin of a step, shape `(p,)`
    pub u0: Vec<f64>,
    /// sources at its end, shape `(p,)`
    pub u1: Vec<f64>,
    /// what each pair is: a diode, a closed or an open switch
    pub roles: Vec<Role>,
    /// pairs that open and close by themselves
    pub diodes: Vec<usize>,
    /// the mode: which pairs conduct
    pub active: Vec<bool>,
    /// changes whenever the mode does, or what a switch is
    pub epoch: u64,
}

impl State {
    /// All at zero, with the closed switches alone conducting, for `n` unknowns and `p` sources.
    pub fn at_rest(roles: Vec<Role>, [n, p]: [usize; 2]) -> State {
        State {
            time: 0.0,
            z: vec![0.0; n],
            l: vec![0.0; roles.len()],
            u0: vec![0.0; p],
            u1: vec![0.0; p],
            diodes: (0..roles.len()).filter(|&i| roles[i] == Role::Diode).collect(),
            active: roles.iter().map(|&r| r == Role::Closed).collect(),
            roles,
            epoch: 1,
        }
    }

    /// Takes a mode for the present one.
    pub fn turn_to(&mut self, mode: &[bool]) {
        if self.active != mode {
            self.active.copy_from_slice(mode);
            self.epoch += 1;
        }
    }
}

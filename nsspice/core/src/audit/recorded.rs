//! Intervals of a continuous solution as an engine hands them to the checks.

/// Recorded intervals of `nodes` points each, flat, one array per quantity.
#[derive(Clone, Debug, Default)]
pub struct Taken {
    /// points in each
    pub nodes: usize,
    /// relative residual to which an iteration has solved the points; 0 for a closed form
    pub known: f64,
    /// beginning and end [s]
    pub begin: Vec<f64>,
    /// see `begin`
    pub end: Vec<f64>,
    /// shortest time that rates stand for [s]
    pub shortest: Vec<f64>,
    /// energy of the terms of a closed form if none of them cancelled [J]; 0 where there are none
    pub swing: Vec<f64>,
    /// steps of the engine that end with it
    pub steps: Vec<u8>,
    /// signs of the pairs hold at all nodes (1), or at the last one alone (0)
    pub signed: Vec<u8>,
    /// how far controls of switches may lie beyond their thresholds; infinite where some are sampled
    pub doubt: Vec<f64>,
    /// unknowns at the beginning, (k, n)
    pub first: Vec<f64>,
    /// sources at the beginning, (k, p)
    pub first_u: Vec<f64>,
    /// instants, (k, nodes)
    pub time: Vec<f64>,
    /// weights of the nodes [s], (k, nodes)
    pub weight: Vec<f64>,
    /// weights of the rates at the nodes [s], (k, nodes, nodes); empty for a closed form
    pub inner: Vec<f64>,
    /// unknowns, (k, nodes, n); the last node is the end
    pub z: Vec<f64>,
    /// rates of those that are stored, (k, nodes, n)
    pub rate: Vec<f64>,
    /// multipliers, (k, nodes, m)
    pub l: Vec<f64>,
    /// sources, (k, nodes, p)
    pub u: Vec<f64>,
    /// rates of the smooth functions, (k, nodes, functions); empty without any
    pub function_rate: Vec<f64>,
    /// roles of the pairs, (k, m); empty without switches
    pub roles: Vec<u8>,
    /// unknowns that store something where one motion ends, or a reported jump, and where the next
    /// begins, (some, n): where these differ most, and where most is stored
    pub boundary_end: Vec<f64>,
    /// see `boundary_end`
    pub boundary_begin: Vec<f64>,
    /// how many were compared
    pub boundaries: usize,
}

impl Taken {
    /// Numbers that wait.
    pub fn size(&self) -> usize {
        2 * self.z.len()
            + self.l.len()
            + self.u.len()
            + self.function_rate.len()
            + 2 * self.boundary_end.len()
    }
}

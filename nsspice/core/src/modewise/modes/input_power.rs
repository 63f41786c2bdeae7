//! What the inputs deliver in a mode.

use crate::dense::add_scaled;
use crate::modewise::modes::mode::Mode;
use crate::modewise::modes::network::Network;

/// The power of an input: its value times a row over states, inputs and their rates.
pub struct Supply {
    /// its number
    pub input: usize,
    /// factors of modal coordinates
    pub x: Vec<f64>,
    /// factors of `[1; inputs]`
    pub v: Vec<f64>,
    /// factors of their rates
    pub d: Vec<f64>,
}

impl Supply {
    /// Those that are not nothing.
    pub fn all(net: &Network, mode: &Mode) -> Vec<Supply> {
        (0..net.s.cols).map(|input| Supply::new(net, mode, input)).filter(Supply::acts).collect()
    }

    fn new(net: &Network, mode: &Mode, input: usize) -> Supply {
        let nv = net.s.cols;
        let (mut x, mut v, mut d) = (vec![0.0; mode.n], vec![0.0; nv], vec![0.0; nv]);
        for (r, f) in net.rs.col(input).into_iter().enumerate().filter(|(_, f)| *f != 0.0) {
            add_scaled(&mut x, f, mode.leave_x.row(r));
            add_scaled(&mut v, f, mode.leave_v.row(r));
        }
        for (i, f) in net.ns.col(input).into_iter().enumerate().filter(|(_, f)| *f != 0.0) {
            let (rows, r) = mode.algebraic_row(i);
            add_scaled(&mut x, f, rows.x.row(r));
            add_scaled(&mut v, f, rows.v.row(r));
            add_scaled(&mut d, f, rows.d.row(r));
        }
        Supply { input, x, v, d }
    }

    fn acts(&self) -> bool {
        [&self.x, &self.v, &self.d].into_iter().flatten().any(|f| *f != 0.0)
    }

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        8 * (self.x.len() + self.v.len() + self.d.len() + 10)
    }
}

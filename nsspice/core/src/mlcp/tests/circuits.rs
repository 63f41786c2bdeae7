//! A small circuit builder: enough modified nodal analysis to state tests as circuits.

use crate::mlcp::{Driver, Problem, Role, Solved, Start, Unsolved};
use crate::sparse::Csc;

/// One implicit step of a circuit with ideal diodes; node 0 is ground.
#[derive(Default)]
pub struct Net {
    nodes: usize,
    k: Vec<(usize, usize, f64)>,
    a: Vec<(usize, usize, f64)>,
    d: Vec<(usize, usize, f64)>,
    pub b: Vec<f64>,
    pub q: Vec<f64>,
    pub roles: Vec<Role>,
}

pub struct Answer {
    pub z: Vec<f64>,
    pub l: Vec<f64>,
    pub solved: Solved,
}

impl Net {
    pub fn new(nodes: usize) -> Net {
        Net { nodes, b: vec![0.0; nodes], ..Net::default() }
    }

    pub fn conductance(&mut self, a: usize, c: usize, g: f64) -> &mut Self {
        for (r, s) in [(a, 1.0), (c, -1.0)] {
            for (j, t) in [(a, 1.0), (c, -1.0)] {
                if r > 0 && j > 0 {
                    self.k.push((r - 1, j - 1, s * t * g));
                }
            }
        }
        self
    }

    pub fn resistor(&mut self, a: usize, c: usize, ohms: f64) -> &mut Self {
        self.conductance(a, c, 1.0 / ohms)
    }

    /// Implicit step of a capacitor: conductance C/h and the stored charge as a source.
    pub fn capacitor(&mut self, a: usize, c: usize, c_over_h: f64, before: f64) -> &mut Self {
        self.conductance(a, c, c_over_h).current(c, a, c_over_h * before)
    }

    /// Current source that drives `amps` through itself from `a` to `c`.
    pub fn current(&mut self, a: usize, c: usize, amps: f64) -> &mut Self {
        for (node, s) in [(a, -1.0), (c, 1.0)] {
            if node > 0 {
                self.b[node - 1] += s * amps;
            }
        }
        self
    }

    /// Branch with its own current as unknown: `x i - (va - vc) = value`.
    fn branch(&mut self, a: usize, c: usize, x: f64, value: f64) -> &mut Self {
        let row = self.b.len();
        for (node, s) in [(a, 1.0), (c, -1.0)] {
            if node > 0 {
                self.k.push((node - 1, row, s));
                self.k.push((row, node - 1, -s));
            }
        }
        self.k.push((row, row, x));
        self.b.push(value);
        self
    }

    pub fn voltage(&mut self, a: usize, c: usize, volts: f64) -> &mut Self {
        self.branch(a, c, 0.0, -volts)
    }

    /// Implicit step of an inductor.
    pub fn inductor(&mut self, a: usize, c: usize, l_over_h: f64, before: f64) -> &mut Self {
        self.branch(a, c, l_over_h, l_over_h * before)
    }

    fn pair(&mut self, a: usize, c: usize, drop: f64, ohms: f64, role: Role) -> &mut Self {
        let column = self.q.len();
        for (node, s) in [(a, 1.0), (c, -1.0)] {
            if node > 0 {
                self.a.push((node - 1, column, s));
            }
        }
        self.d.push((column, column, ohms));
        self.q.push(drop);
        self.roles.push(role);
        self
    }

    pub fn diode(&mut self, a: usize, c: usize) -> &mut Self {
        self.pair(a, c, 0.0, 0.0, Role::Diode)
    }

    pub fn real_diode(&mut self, a: usize, c: usize, drop: f64, ohms: f64) -> &mut Self {
        self.pair(a, c, drop, ohms, Role::Diode)
    }

    pub fn switch(&mut self, a: usize, c: usize, closed: bool) -> &mut Self {
        self.pair(a, c, 0.0, 0.0, if closed { Role::Closed } else { Role::Open })
    }

    pub fn problem(&self) -> Problem {
        let (n, m) = (self.b.len(), self.q.len());
        let a = Csc::from_triplets(n, m, &self.a);
        let row_kind = (0..n).map(|i| u8::from(i >= self.nodes)).collect();
        Problem {
            k: Csc::from_triplets(n, n, &self.k),
            b: a.transpose(),
            a,
            d: Csc::from_triplets(m, m, &self.d),
            row_kind,
        }
    }

    pub fn solve_from(&self, z0: &[f64], l0: &[f64], start: Start) -> Result<Answer, Unsolved> {
        let mut driver = Driver::new(self.problem());
        let (mut z, mut l) = (z0.to_vec(), l0.to_vec());
        match driver.solve(&self.b, &self.q, &self.roles, &mut z, &mut l, start) {
            Ok(solved) => Ok(Answer { z, l, solved }),
            Err(unsolved) => {
                assert_eq!((z.as_slice(), l.as_slice()), (z0, l0), "a failure must not move");
                Err(unsolved)
            }
        }
    }

    pub fn solve(&self) -> Result<Answer, Unsolved> {
        let (n, m) = (self.b.len(), self.q.len());
        self.solve_from(&vec![0.0; n], &vec![0.0; m], Start::Cold)
    }
}

/// Asserts equality up to `tolerance`.
pub fn close(found: f64, wanted: f64, tolerance: f64) {
    assert!((found - wanted).abs() <= tolerance, "{found} instead of {wanted}");
}

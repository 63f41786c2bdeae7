//! Where rounding goes: what the rounding of equations and of a state makes of one pair or control.
//!
//! Every equation is solved to its backward error, `24 N u` of the sizes of its terms ([`super::rounding`]), and the
//! charges and fluxes at the beginning of a segment are known to that part of themselves, or of what all the energy
//! would be in one element, and to what the rounding of the instant at which the segment before has ended makes of them.
//! What is left of a node's potential then depends on the resistances that meet there: 1e-15 A through 2 kOhm are
//! 2e-12 V, however small the potential is.  The mode's equations over a step of the length `h`,
//!
//! ```text
//! [E / h + G   A] [z]   [S u + E z0 / h]
//! [   -B       D] [l] = [      -q      ]     (l = 0 of a pair that does not conduct),
//! ```
//!
//! say how: a quantity `t' [z; l]` changes by `y' e` with their errors `e`, where `K' y = t`.  The step is taken twice,
//! ten times shorter than the fastest time constant: after the first, what is stored fits the mode, and nothing jumps
//! any more.  A step of the length of the segment says what equations that are missed all the time make of it at last.

use super::judge::EXCUSED;
use super::matrix::Entries;
use super::probe::Probe;
use crate::dense::largest_of_kinds;
use crate::descriptor::Linear;
use crate::rounding::of_elimination;
use crate::tolerances::CLEARLY;

/// The largest sizes of a segment.
#[derive(Clone, Debug, Default)]
pub(super) struct Sizes {
    /// of the terms of each law and of each pair
    equations: Vec<f64>,
    /// of charges and fluxes
    stored: Vec<f64>,
    /// by how much they may be off because an instant is rounded
    late: Vec<f64>,
    energy: f64,
    /// of currents and of voltages
    largest: [f64; 2],
}

/// Carries rounding to pairs and controls.
pub(super) struct Forward {
    e: Entries,
    g: Entries,
    a: Entries,
    b: Entries,
    d: Entries,
    s: Entries,
    q: Vec<f64>,
    kinds: Vec<u8>,
    /// factors of the energy in each unknown
    diagonal: Vec<f64>,
    /// laws of currents that each pair feeds, and whether there are any (1): its multiplier is a current
    feeds: Vec<Vec<usize>>,
    currents: Vec<u8>,
    /// sizes of the terms of laws and pairs, the largest of the run: of currents and of voltages
    most: [f64; 2],
    conducts: Vec<bool>,
    rates: [f64; 2],
    /// a short step and a long one, once they are asked for, and whether they are those of the present mode
    probes: Option<[Probe; 2]>,
    probed: bool,
    /// terms of each slack, by unknowns and multipliers
    slacks: Vec<Vec<(usize, f64)>>,
    /// sensitivities in this segment: of unknowns and multipliers, slacks, then controls
    known: Vec<(usize, [Vec<f64>; 2])>,
    /// mode equations that had to be factorised
    pub factorised: u64,
}

impl Forward {
    pub fn new(linear: &Linear) -> Forward {
        let (n, m, _) = linear.sizes();
        let mut diagonal = vec![0.0; n];
        linear.e.iter().filter(|e| e.0 == e.1).for_each(|(r, _, v)| diagonal[r] = f64::abs(v));
        let mut feeds = vec![Vec::new(); m];
        let currents = linear.a.iter().filter(|e| linear.row_kind[e.0] == 0);
        currents.for_each(|(row, pair, _)| feeds[pair].push(row));
        let [e, g, a, b, d, s] =
            [&linear.e, &linear.g, &linear.a, &linear.b, &linear.d, &linear.s].map(Entries::new);
        let mut slacks = vec![Vec::new(); m];
        b.entries().for_each(|(pair, column, v)| slacks[pair].push((column, -v)));
        d.entries().for_each(|(pair, other, v)| slacks[pair].push((n + other, v)));
        Forward {
            e,
            g,
            a,
            b,
            d,
            s,
            q: linear.q.clone(),
            kinds: linear.row_kind.clone(),
            diagonal,
            currents: feeds.iter().map(|rows| u8::from(!rows.is_empty())).collect(),
            feeds,
            most: [0.0; 2],
            conducts: vec![false; m],
            rates: [0.0; 2],
            probes: None,
            probed: false,
            slacks,
            known: Vec::new(),
            factorised: 0,
        }
    }

    /// The number of unknowns.
    pub fn size(&self) -> usize {
        self.kinds.len()
    }

    pub fn sizes(&self) -> Sizes {
        let (n, m) = (self.kinds.len(), self.q.len());
        Sizes {
            equations: vec![0.0; n + m],
            stored: vec![0.0; n],
            late: vec![0.0; n],
            ..Sizes::default()
        }
    }

    /// Takes a point of the segment, or the end of the one before.
    pub fn see(&mut self, [z, l]: [&[f64]; 2], sizes: &mut Sizes) {
        let n = self.kinds.len();
        let mut terms = vec![0.0; n];
        let raise = |of: &[f64], to: &mut [f64]| {
            to.iter_mut().zip(of).for_each(|(most, size)| *most = most.max(*size));
        };
        self.g.add_sizes(1.0, z, &mut terms);
        self.a.add_sizes(1.0, l, &mut terms);
        let (laws, pairs) = sizes.equations.split_at_mut(n);
        raise(&terms, laws);
        terms.fill(0.0);
        self.e.add_sizes(1.0, z, &mut terms);
        raise(&terms, &mut sizes.stored);
        let energy: f64 = terms.iter().zip(z).map(|(content, z)| (content * z).abs()).sum();
        sizes.energy = sizes.energy.max(0.5 * energy);
        let mut volts: Vec<f64> = self.q.iter().map(|q| q.abs()).collect();
        self.b.add_sizes(1.0, z, &mut volts);
        self.d.add_sizes(1.0, l, &mut volts);
        raise(&volts, pairs);
        let largest = self.largest([z, l], &volts);
        sizes.largest = [0, 1].map(|k| sizes.largest[k].max(largest[k]));
        let laws = sizes.equations.iter().zip(&self.kinds).filter(|e| *e.1 == 0);
        self.most[0] = laws.fold(self.most[0], |most, (size, _)| most.max(*size));
        self.most[1] = self.most[1].max(sizes.largest[1]);
    }

    /// The largest current and voltage at a point, where the sizes of the terms of slacks are these.
    fn largest(&self, [z, l]: [&[f64]; 2], across: &[f64]) -> [f64; 2] {
        let [voltage, current] = largest_of_kinds(z, &self.kinds);
        let [l_voltage, l_current] = largest_of_kinds(l, &self.currents);
        let [w_current, w_voltage] = largest_of_kinds(across, &self.currents);
        [current.max(l_current).max(w_current), voltage.max(l_voltage).max(w_voltage)]
    }

    /// What is left of the largest current and voltage at a point where others cancel.
    pub fn rest(&self, at: [&[f64]; 2], across: &[f64]) -> [f64; 2] {
        let part = of_elimination(self.kinds.len() + self.q.len());
        self.largest(at, across).map(|most| part * most + f64::MIN_POSITIVE)
    }

    /// Whether the multiplier of a pair feeds no node: it is a voltage.
    pub fn swapped(&self, i: usize) -> bool {
        self.currents[i] == 0
    }

    /// Takes what happens to charges and fluxes while the segment before may have lasted too long.
    pub fn see_late(&self, known: f64, [z, l, u]: [&[f64]; 3], sizes: &mut Sizes) {
        let late = &mut sizes.late;
        self.s.add(known, u, late);
        self.g.add(-known, z, late);
        self.a.add(-known, l, late);
        late.iter_mut().zip(&self.diagonal).for_each(|(late, stores)| {
            *late = if *stores > 0.0 { late.abs() } else { 0.0 };
        });
    }

    /// The currents that meet at each pair, the fewer of those at both ends, and the sizes of the terms of its slack.
    pub fn meet(&self, [z, l]: [&[f64]; 2], met: &mut Vec<f64>, across: &mut Vec<f64>) {
        let mut meets = vec![0.0; self.kinds.len()];
        self.a.add_sizes(1.0, l, &mut meets);
        // what potentials would bring one by one is no current
        let branches = self.g.entries().filter(|e| self.kinds[e.0] != 0 || self.kinds[e.1] != 0);
        branches.for_each(|(row, column, v)| meets[row] += (v * z[column]).abs());
        let least = |rows: &Vec<usize>| rows.iter().map(|&r| meets[r]).reduce(f64::min);
        met.clear();
        met.extend(self.feeds.iter().map(|rows| least(rows).unwrap_or(0.0)));
        across.clear();
        across.extend(self.q.iter().map(|q| q.abs()));
        self.b.add_sizes(1.0, z, across);
        self.d.add_sizes(1.0, l, across);
    }

    /// From now on these pairs conduct; rates are that of the fastest term, and that of the whole segment [1/s].
    pub fn enter(&mut self, active: &[usize], [fastest, slowest]: [f64; 2]) {
        let mut conducts = vec![false; self.q.len()];
        active.iter().for_each(|&pair| conducts[pair] = true);
        let slowest = if slowest.is_finite() { slowest } else { fastest };
        self.rates = [(fastest / CLEARLY).max(slowest), slowest];
        self.conducts = conducts;
        self.probed = false;
        self.known.clear();
    }

    /// What rounding may make of the multiplier and of the slack of a pair.
    ///
    /// Either is what is left of the largest of its kind in the segment; and of what comes from elsewhere.  The slack of a
    /// pair that does not conduct is a combination of potentials that are known as a whole; where a pair conducts, what is
    /// left of it is the rounding of each of its terms.
    pub fn of_pair(&mut self, i: usize, sizes: &Sizes) -> [f64; 2] {
        let (n, m) = (self.kinds.len(), self.q.len());
        let terms = self.slacks[i].clone();
        let rest = sizes.largest.map(|most| of_elimination(n + m) * most + f64::MIN_POSITIVE);
        let carried = if self.conducts[i] {
            let current = self.carried(n + i, &[(n + i, 1.0)], sizes);
            let each = terms.iter().map(|&(k, v)| v.abs() * self.carried(k, &[(k, 1.0)], sizes));
            [current, each.sum::<f64>()]
        } else {
            [0.0, self.carried(n + m + i, &terms, sizes)]
        };
        // a multiplier that feeds no node is a voltage; what exceeds a part of the largest leaves nothing to be judged
        let swapped = usize::from(self.swapped(i));
        [0, 1].map(|k| rest[k ^ swapped] + carried[k].min(EXCUSED * self.most[k ^ swapped]))
    }

    /// What rounding may make of the control of a switch.
    pub fn of_control(&mut self, switch: usize, control: &[(usize, f64)], sizes: &Sizes) -> f64 {
        let number = self.kinds.len() + 2 * self.q.len() + switch;
        self.carried(number, control, sizes)
    }

    /// What rounding makes of a combination of unknowns, which has a number.
    fn carried(&mut self, number: usize, target: &[(usize, f64)], sizes: &Sizes) -> f64 {
        let n = self.kinds.len();
        let place = match self.known.iter().position(|e| e.0 == number) {
            Some(place) => place,
            None => {
                let rows = self.sensitivities(target);
                self.known.push((number, rows));
                self.known.len() - 1
            }
        };
        let [equations, stored] = &self.known[place].1;
        let part = of_elimination(n + self.q.len());
        // what underflows is off by the rounding of the smallest number
        let least = f64::MIN_POSITIVE;
        let laws =
            equations.iter().zip(&sizes.equations).map(|(y, size)| y * (part * size + least));
        let charges = stored.iter().enumerate().map(|(r, y)| {
            let alone = (2.0 * sizes.energy * self.diagonal[r]).sqrt();
            y * (part * sizes.stored[r].max(alone) + sizes.late[r])
        });
        let total = laws.sum::<f64>() + charges.sum::<f64>();
        if total.is_finite() {
            total
        } else {
            0.0
        }
    }

    /// By how much a combination of unknowns changes with the equations, and with what is stored.
    fn sensitivities(&mut self, target: &[(usize, f64)]) -> [Vec<f64>; 2] {
        let n = self.kinds.len();
        let size = n + self.q.len();
        let matrices = [&self.e, &self.g, &self.a, &self.b, &self.d];
        let probes =
            self.probes.get_or_insert_with(|| [(); 2].map(|()| Probe::new(n, size - n, matrices)));
        if !self.probed {
            for (probe, rate) in probes.iter_mut().zip(self.rates) {
                probe.set(rate, &self.conducts);
            }
            self.factorised += 2;
            self.probed = true;
        }
        let [short, long] = &*probes;
        let mut once = vec![0.0; size];
        target.iter().for_each(|&(k, factor)| once[k] += factor);
        let mut last = once.clone();
        short.solve(&mut once);
        let mut twice = vec![0.0; size];
        self.e.entries().for_each(|(r, c, v)| twice[c] += short.rate * v * once[r]);
        short.solve(&mut twice);
        long.solve(&mut last);
        let steps = once.iter().zip(&twice).zip(&last);
        let equations = steps.map(|((once, twice), last)| (once + twice).abs() + last.abs());
        let equations = equations.collect();
        let charges = twice.iter().zip(&last).take(n);
        let charges = charges.map(|(a, b)| short.rate * a.abs() + long.rate * b.abs()).collect();
        [equations, charges]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::Csc;

    /// A node with a conductance to ground, a capacitor, a source of current and a diode to ground.
    fn node(siemens: f64, farads: f64) -> Linear {
        let one = |value: f64| Csc::from_triplets(1, 1, &[(0, 0, value)]);
        Linear {
            e: one(farads),
            g: one(siemens),
            a: one(1.0),
            b: one(-1.0),
            d: Csc::zeros(1, 1),
            q: vec![0.0],
            s: one(1.0),
            row_kind: vec![0],
        }
    }

    /// What is not known of the current and the voltage of the diode while 5 A cancel, in a run that has seen 10 kV.
    fn known(linear: &Linear, active: &[usize], rates: [f64; 2]) -> [f64; 2] {
        let mut forward = Forward::new(linear);
        let mut sizes = forward.sizes();
        forward.see([&[1e4], &[0.0]], &mut sizes);
        sizes = forward.sizes();
        forward.see([&[0.0], &[5.0]], &mut sizes);
        forward.enter(active, rates);
        forward.of_pair(0, &sizes)
    }

    const UNIT: f64 = 24.0 * 2.0 * 0.5 * f64::EPSILON;

    #[test]
    fn currents_that_cancel_leave_a_voltage_at_a_resistance() {
        // 5 A at 2 kOhm, in the short step and in the long one
        let [current, voltage] = known(&node(1.0 / 2e3, 0.0), &[], [1e9, 1.0]);
        assert!(current <= 1.1 * UNIT * 5.0);
        let expected = UNIT * 5.0 * 2e3;
        assert!(voltage >= expected && voltage < 2.1 * expected, "{voltage:e}");
        // a capacitor holds the voltage for as long as the segment lasts
        let [_, voltage] = known(&node(1.0 / 2e3, 1e-6), &[], [1e3, 1e9]);
        let expected = UNIT * 5.0 * 1e-9 / 1e-6;
        assert!(voltage > 0.5 * expected && voltage < 10.0 * expected, "{voltage:e}");
    }

    #[test]
    fn a_diode_that_conducts_has_the_rounding_of_the_currents_that_meet() {
        let [current, voltage] = known(&node(1.0 / 2e3, 0.0), &[0], [1e9, 1.0]);
        assert!((UNIT * 5.0..3.1 * UNIT * 5.0).contains(&current), "{current:e}");
        assert!(voltage < 1e-300, "{voltage:e}");
        // the charge that a capacitor brings along is none of it: the diode holds its voltage
        let [with, _] = known(&node(1.0 / 2e3, 1e-6), &[0], [1e12, 1.0]);
        assert!(with < 3.1 * UNIT * 5.0, "{with:e}");
    }

    #[test]
    fn an_instant_that_is_rounded_leaves_charge_behind() {
        let linear = node(1.0 / 2e3, 1e-6);
        let mut forward = Forward::new(&linear);
        let mut sizes = forward.sizes();
        forward.see([&[1.0], &[0.0]], &mut sizes);
        sizes = forward.sizes();
        // 3 A into the capacitor when it ended, known to 1e-18 s
        forward.see_late(1e-18, [&[0.0], &[2.0], &[5.0]], &mut sizes);
        forward.enter(&[], [500.0, 1e3]);
        let [_, voltage] = forward.of_pair(0, &sizes);
        let expected = 1e-18 * 3.0 / 1e-6;
        assert!(voltage > 0.9 * expected && voltage < 2.1 * expected, "{voltage:e}");
    }

    #[test]
    fn what_no_equation_determines_excuses_nothing() {
        let [_, voltage] = known(&node(0.0, 0.0), &[], [1.0, 1.0]);
        assert!(voltage < 1e-3 * 5.0, "{voltage:e}");
    }
}

//! What shows that a mode has ended: signs of the pairs, thresholds of the switches.  Currents are measured by those of
//! their part of the network ([`Parts`]).

use crate::integrate::implicit::stepper::Stepper;
use crate::rounding::{OF_EQUATION, OF_SOLUTION};
use crate::structure::Parts;

/// A guard counts as negative beyond this part of its scale.
pub const VIOLATED: f64 = 1e-11;
/// What a current of an earlier mode counts for in the next one: rounding of it is all that may be left there, and that
/// is no violation.  A spike is no measure of what flows after it.
const REMEMBERED: f64 = OF_SOLUTION / VIOLATED;
/// A parabola errs by less than this part of its height.
const CLOSE: f64 = 0.05;

/// Scales of the guards: the largest voltage and current so far.
pub struct Scales {
    /// largest voltage [V] and current [A]
    pub largest: [f64; 2],
    /// largest current of each part in this mode, and what is remembered of earlier ones [A]
    currents: Vec<f64>,
    parts: Parts,
    /// 0 if the multiplier (slack) of a pair is a voltage, 1 if it is a current
    multiplier: Vec<u8>,
    slack: Vec<u8>,
    control: Vec<u8>,
    /// unknowns that are stored
    stored: Vec<bool>,
    /// largest magnitude of each unknown so far
    unknown: Vec<f64>,
    /// the least and the largest value of each unknown so far; infinitely apart where the charge of a
    /// junction goes with the voltage itself
    range: Vec<[f64; 2]>,
    /// the same of voltages against ground, where voltages along a tree are the unknowns
    potentials: Vec<[f64; 2]>,
    /// scratch: potentials, sums of currents
    sums: Vec<f64>,
}

/// Not `f64::min`, which would overlook NaN.
fn least(a: f64, b: f64) -> f64 {
    if b >= a {
        a
    } else {
        b
    }
}

impl Scales {
    pub fn new(s: &Stepper) -> Scales {
        let (n, m) = (s.state.z.len(), s.state.l.len());
        let kinds = &s.solver.sys.linear.row_kind;
        let multiplier = (0..m).map(|i| {
            let (rows, _) = s.solver.sys.linear.a.col(i);
            u8::from(rows.is_empty() || rows.iter().any(|&r| kinds[r] == 0))
        });
        let mut slack = vec![0u8; m];
        for (r, c, v) in s.solver.sys.linear.b.iter() {
            if v != 0.0 && kinds[c] == 1 {
                slack[r] = 1; // its unknown is a branch current
            }
        }
        let mut range = vec![[f64::INFINITY, f64::NEG_INFINITY]; n];
        for j in s.solver.smooth.iter().flat_map(|smooth| smooth.newton.stored_unknowns()) {
            range[j] = [f64::NEG_INFINITY, f64::INFINITY];
        }
        let control = |c: &[(usize, f64)]| u8::from(c.iter().any(|e| kinds[e.0] == 1));
        let parts = Parts::new(&s.solver.sys.linear, s.solver.sys.smooth.as_ref());
        let mut stored = vec![false; n];
        s.solver.sys.linear.e.iter().for_each(|(_, column, _)| stored[column] = true);
        Scales {
            largest: [0.0; 2],
            currents: vec![0.0; parts.count()],
            parts,
            multiplier: multiplier.collect(),
            slack,
            control: s.switching.switches.iter().map(|w| control(&w.control)).collect(),
            stored,
            unknown: vec![0.0; n],
            range,
            potentials: vec![[f64::INFINITY, f64::NEG_INFINITY]; n],
            sums: vec![0.0; n],
        }
    }

    /// Takes notice of a state.  Right after an instant currents that nothing stores are no measure: where a switch
    /// shorts a charge they are those of the shortest step.
    pub fn note(&mut self, s: &Stepper, z: &[f64], l: &[f64], right_after: bool) {
        for (&z, [least, most]) in z.iter().zip(&mut self.range) {
            (*least, *most) = (least.min(z), most.max(z));
        }
        if let Some(coordinates) = &s.facts.coordinates {
            self.sums.copy_from_slice(z);
            coordinates.add_up(&mut self.sums);
            for (&v, [least, most]) in self.sums.iter().zip(&mut self.potentials) {
                (*least, *most) = (least.min(v), most.max(v));
            }
        }
        let kinds = &s.solver.sys.linear.row_kind;
        let counts = |j: usize| !right_after || kinds[j] == 0 || self.stored[j];
        for (j, (z, size)) in z.iter().zip(&mut self.unknown).enumerate().filter(|e| counts(e.0)) {
            let kind = kinds[j];
            *size = size.max(z.abs());
            let largest = &mut self.largest[usize::from(kind)];
            *largest = largest.max(z.abs());
        }
        for (j, z) in z.iter().enumerate().filter(|e| kinds[e.0] == 1) {
            if !right_after || self.stored[j] {
                self.note_current(self.parts.of(j), z.abs());
            }
        }
        for (i, l) in l.iter().enumerate().filter(|_| !right_after) {
            let kind = usize::from(self.multiplier[i]);
            self.largest[kind] = self.largest[kind].max(l.abs());
            if kind == 1 {
                self.note_current(Some(self.parts.of_pair(i)), l.abs());
            }
        }
        // what flows in a resistor is no unknown, but what its node takes from a capacitor is a current
        self.sums.fill(0.0);
        s.solver.sys.linear.g.mul_add(1.0, z, &mut self.sums);
        if right_after {
            // what flows in resistors and windings is what it will be
            for (row, column, factor) in s.solver.sys.linear.g.iter() {
                if kinds[column] == 1 && !self.stored[column] {
                    self.sums[row] -= factor * z[column];
                }
            }
        }
        for row in (0..self.sums.len()).filter(|&row| s.solver.sys.linear.row_kind[row] == 0) {
            let sum = self.sums[row].abs();
            self.largest[1] = self.largest[1].max(sum);
            self.note_current(self.parts.of(row), sum);
        }
        // what another block hands on has the rounding of its largest value from the beginning
        let handed = s.waveforms.iter().map(|w| w.rounded());
        self.largest[0] = handed.fold(self.largest[0], f64::max);
        // where nothing flows, rounding of the voltages makes currents: they are none
        let rounded = f64::EPSILON * s.facts.conductances[0] * self.largest[0];
        self.largest[1] = self.largest[1].max(rounded);
        self.currents.iter_mut().for_each(|current| *current = current.max(rounded));
    }

    /// A mode ends.
    pub fn forget(&mut self) {
        self.currents.iter_mut().for_each(|current| *current *= REMEMBERED);
    }

    fn note_current(&mut self, part: Option<usize>, current: f64) {
        if let Some(part) = part {
            self.currents[part] = self.currents[part].max(current);
        }
    }

    /// The largest current near a pair so far [A].
    pub fn current_beside(&self, pair: usize) -> f64 {
        self.currents[self.parts.of_pair(pair)]
    }

    /// What errors of an unknown are measured by, with a value that it may take next: its range so far
    /// and how far it may go beyond, or its magnitude where that is less.
    pub fn size(&self, j: usize, value: f64, beyond: f64) -> f64 {
        let [least, most] = self.range[j];
        self.unknown[j].max(value.abs()).min(most.max(value) - least.min(value) + beyond)
    }

    /// The same of the voltage against ground of its node.
    pub fn size_of_potential(&self, j: usize, value: f64, beyond: f64) -> f64 {
        let [least, most] = self.potentials[j];
        let largest = if most >= least { most.abs().max(least.abs()) } else { 0.0 };
        largest.max(value.abs()).min(most.max(value) - least.min(value) + beyond)
    }

    /// The largest voltage or current so far.
    pub fn biggest(&self) -> f64 {
        self.largest[0].max(self.largest[1])
    }

    /// Scale of the guard of a pair.
    pub fn of_pair(&self, i: usize, active: bool) -> f64 {
        let kind = if active { self.multiplier[i] } else { self.slack[i] };
        let largest = if kind == 1 { self.current_beside(i) } else { self.largest[0] };
        largest.max(f64::MIN_POSITIVE)
    }

    /// Whether the guard of a pair is zero up to rounding.
    pub fn at_zero(&self, i: usize, active: bool, guard: f64) -> bool {
        guard.abs() <= VIOLATED * self.of_pair(i, active)
    }

    /// The smallest guard relative to its scale at a point `[z; guards; functions]`.
    pub fn margin(&self, s: &Stepper, x: &[f64]) -> f64 {
        self.margins(s, x).fold(f64::INFINITY, least)
    }

    /// The smallest among the guards that are followed; others count once they are violated: one that
    /// rests at zero would hide where these become negative.
    pub fn margin_of(&self, s: &Stepper, x: &[f64], followed: &[bool]) -> f64 {
        let margins = self.margins(s, x).zip(followed);
        let heard = margins.filter(|&(margin, &followed)| followed || margin < -VIOLATED);
        heard.map(|e| e.0).fold(f64::INFINITY, least)
    }

    /// Which guards are violated at a point.
    pub fn violated(&self, s: &Stepper, x: &[f64], out: &mut Vec<bool>) {
        out.clear();
        out.extend(self.margins(s, x).map(|margin| margin < -VIOLATED || margin.is_nan()));
    }

    /// All guards relative to their scales: pairs, then switches.
    fn margins<'a>(&'a self, s: &'a Stepper, x: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        let (z, guards) = x.split_at(s.state.z.len());
        let diodes = s.state.diodes.iter();
        #[cfg(feature = "faults")]
        let diodes = diodes.filter(|&&i| match s.state.active[i] {
            true => fault!("steps_currents_ignored", true, false),
            false => fault!("steps_voltages_ignored", true, false),
        });
        let pairs = diodes.map(|&i| guards[i] / self.of_pair(i, s.state.active[i]));
        pairs.chain((0..s.switching.count()).map(|k| self.switch_margin(s, k, z)))
    }

    /// Whether a switch changes at `z`.
    pub fn switches_turn(&self, s: &Stepper, z: &[f64]) -> bool {
        let margin = |k| self.switch_margin(s, k, z);
        (0..s.switching.count()).any(|k| margin(k) < -VIOLATED || margin(k).is_nan())
    }

    /// How many switches have reached the thresholds that change them at a point.
    pub fn turned(&self, s: &Stepper, x: &[f64]) -> usize {
        let z = &x[..s.state.z.len()];
        (0..s.switching.count()).filter(|&k| self.switch_margin(s, k, z) < 0.0).count()
    }

    /// Distance of a switch that is watched to the threshold that would change it, relative to its scale.
    fn switch_margin(&self, s: &Stepper, k: usize, z: &[f64]) -> f64 {
        if s.switching.sampled[k] {
            f64::INFINITY
        } else {
            self.control_margin(s, k, z)
        }
    }

    /// The same of any switch; infinite where it does not matter.
    pub fn control_margin(&self, s: &Stepper, k: usize, z: &[f64]) -> f64 {
        let (switch, gate) = (&s.switching.switches[k], s.switching.gates[k]);
        if switch.held(gate, s.state.active[switch.pair]) {
            return f64::INFINITY;
        }
        switch.distance(gate, z) / self.of_control(s, k)
    }

    /// Scale of the control of a switch.
    pub fn of_control(&self, s: &Stepper, k: usize) -> f64 {
        let (switch, threshold) =
            (&s.switching.switches[k], s.switching.switches[k].edge(s.switching.gates[k]).0);
        // its own size: the voltage of an instant elsewhere is no measure of a gate
        let rounded = OF_EQUATION / VIOLATED * self.largest[usize::from(self.control[k])];
        let own = switch.control.iter().map(|&(j, c)| c.abs() * self.unknown[j]).sum::<f64>();
        own.max(threshold.abs()).max(rounded).max(f64::MIN_POSITIVE)
    }

    /// The switches that are watched whose thresholds have been reached at `z`.
    pub fn reached(&self, s: &Stepper, z: &[f64]) -> Vec<usize> {
        (0..s.switching.count()).filter(|&k| self.switch_margin(s, k, z) <= VIOLATED).collect()
    }

    /// The switches whose controls are within a part of their scales of their thresholds at `z`.
    pub fn near(&self, s: &Stepper, z: &[f64], part: f64) -> Vec<usize> {
        let near = |&k: &usize| {
            !s.switching.switches[k].latching && self.control_margin(s, k, z).abs() <= part
        };
        (0..s.switching.count()).filter(near).collect()
    }

    /// How far the control of a switch was from its threshold in the part `theta` of a step, about, relative
    /// to its scale.
    pub fn excursion(&self, s: &Stepper, k: usize, stages: &[Vec<f64>], theta: f64) -> f64 {
        let margins = stages.iter().map(|x| self.control_margin(s, k, &x[..s.state.z.len()]).abs());
        theta * margins.fold(0.0, f64::max)
    }

    /// The sampled switches, and how far their controls are from their thresholds at `z`, as a part of their
    /// scales: negative beyond.
    pub fn sampled<'a>(
        &'a self,
        s: &'a Stepper,
        z: &'a [f64],
    ) -> impl Iterator<Item = (usize, f64)> + 'a {
        let sampled = (0..s.switching.count()).filter(|&k| s.switching.sampled[k]);
        sampled.map(|k| (k, self.control_margin(s, k, z)))
    }

    /// Where, between three samples at the places `at`, some guard may dip below zero although it is
    /// positive at the samples: the place of the deepest dip of the parabolas, of those that come near.
    pub fn dip(&self, s: &Stepper, at: [f64; 3], x: [&[f64]; 3]) -> Option<f64> {
        let n = s.state.z.len();
        fault!("steps_dips_missed" => return None);
        let mut deepest: Option<(f64, f64)> = None;
        let mut look = |g: [f64; 3]| {
            // Newton's form on the three samples
            let first = (g[1] - g[0]) / (at[1] - at[0]);
            let second = ((g[2] - g[1]) / (at[2] - at[1]) - first) / (at[2] - at[0]);
            if second <= 0.0 {
                return;
            }
            let place = 0.5 * (at[0] + at[1] - first / second);
            if place <= at[0] || place >= at[2] {
                return;
            }
            let value = g[0] + (place - at[0]) * (first + (place - at[1]) * second);
            let near = CLOSE * (g[0].max(g[2]) - value) - VIOLATED;
            if value < near && deepest.is_none_or(|d| value < d.1) {
                deepest = Some((place, value));
            }
        };
        for &i in &s.state.diodes {
            let scale = self.of_pair(i, s.state.active[i]);
            look(x.map(|x| x[n + i] / scale));
        }
        for k in 0..s.switching.count() {
            look(x.map(|x| self.switch_margin(s, k, &x[..n])));
        }
        deepest.map(|d| d.0)
    }
}

//! Every segment of a closed form, at both of its ends and inside: pairs, controls of switches and sources.
//!
//! Kirchhoff's laws and rates are checked on some intervals ([`super::intervals`]); an event that is missed breaks none
//! of them.  Signs are therefore looked at in all segments, and measured by what meets at the pair at that instant: by
//! the largest values of a run any current would be none after the spike of an interrupted winding.  What is then wrong
//! may be rounding, which [`super::forward`] carries to that pair.

use super::forward::{Forward, Sizes};
use super::gates::excess;
use super::matrix::Entries;
use super::sources::{Described, Sources};
use super::{ratio, worse, TOLERANCE};
use crate::descriptor::Linear;
use crate::mlcp::Role;
use crate::switch::Switch;
use crate::tolerances::CLEARLY;
use crate::waveform::INSTANT;
use std::sync::Arc;

/// What an engine says of a segment.
#[derive(Clone, Copy, Default)]
pub struct Segment<'a> {
    /// roles of the pairs, none without switches
    pub roles: &'a [Role],
    /// switches that look at their controls at instants of their own
    pub sampled: &'a [bool],
    /// pairs that conduct
    pub active: &'a [usize],
    /// the largest rate of its closed form [1/s]
    pub fastest: f64,
    /// how far controls may be beyond their thresholds
    pub doubt: f64,
}

/// The points of one segment.
#[derive(Default)]
struct Points {
    time: Vec<f64>,
    z: Vec<f64>,
    l: Vec<f64>,
    /// slacks
    w: Vec<f64>,
}

impl Points {
    fn clear(&mut self) {
        self.time.clear();
        [&mut self.z, &mut self.l, &mut self.w].into_iter().for_each(Vec::clear);
    }

    /// By how much the rounding of instants may change a value at a point.
    fn blur(&self, k: usize, value: impl Fn(usize) -> f64) -> f64 {
        let known = INSTANT * self.time.last().map_or(0.0, |t| t.abs());
        let neighbours = [k.checked_sub(1), Some(k + 1).filter(|&next| next < self.time.len())];
        let changes = neighbours.into_iter().flatten().map(|other| {
            let step = (self.time[k] - self.time[other]).abs().max(known);
            if step > 0.0 {
                known * (value(k) - value(other)).abs() / step
            } else {
                0.0
            }
        });
        changes.fold(0.0, f64::max)
    }
}

/// Where the last segment ended.
struct End {
    time: f64,
    z: Vec<f64>,
    l: Vec<f64>,
    u: Vec<f64>,
}

/// Checks the segments of a run one by one.
pub struct SegmentPoints {
    q: Vec<f64>,
    b: Entries,
    d: Entries,
    forward: Forward,
    switches: Arc<[Switch]>,
    /// how far the control of each has been from its thresholds
    swings: Vec<f64>,
    points: Points,
    before: Option<End>,
    w: Vec<f64>,
    volts: Vec<f64>,
    /// sources at these points
    pub sources: Sources,
    /// worst relative error of a pair, and which
    pub complementarity: f64,
    /// see `complementarity`
    pub worst_pair: Option<usize>,
    /// worst control beyond its threshold, and the pair of its switch
    pub gates: f64,
    /// see `gates`
    pub worst_gate: Option<usize>,
    /// points looked at
    pub count: u64,
    /// segments that were not right at first sight
    pub judged: u64,
}

impl SegmentPoints {
    /// Takes the arrays of a system in the coordinates of its engine.
    pub fn new(linear: &Linear, switches: Arc<[Switch]>, waveforms: &[Described]) -> SegmentPoints {
        SegmentPoints {
            q: linear.q.clone(),
            b: Entries::new(&linear.b),
            d: Entries::new(&linear.d),
            forward: Forward::new(linear),
            swings: vec![0.0; switches.len()],
            switches,
            points: Points::default(),
            before: None,
            w: Vec::new(),
            volts: Vec::new(),
            sources: Sources::new(waveforms),
            complementarity: 0.0,
            worst_pair: None,
            gates: 0.0,
            worst_gate: None,
            count: 0,
            judged: 0,
        }
    }

    /// Compares the sources at an instant with their waveforms.
    pub fn compare(&mut self, time: f64, u: &[f64]) {
        self.sources.take_all(std::iter::once((time, 0)), u);
    }

    /// Mode equations that had to be factorised.
    pub fn factorised(&self) -> u64 {
        self.forward.factorised
    }

    /// Whether a point is right at first sight: no pair has a member beyond zero by more than what is left of the largest
    /// of its kind, and no control is beyond its threshold.  All others are for [`SegmentPoints::judge`], which asks what
    /// else rounding explains.
    pub fn glance(&mut self, [z, l]: [&[f64]; 2], segment: Segment) -> bool {
        self.count += 1;
        self.w.clone_from(&self.q);
        self.volts.clear();
        self.volts.extend(self.q.iter().map(|q| q.abs()));
        self.b.add_both(-1.0, z, &mut self.w, &mut self.volts);
        self.d.add_both(1.0, l, &mut self.w, &mut self.volts);
        let rest = self.forward.rest([z, l], &self.volts);
        let mut right = true;
        for (i, ((&l, &w), &volts)) in l.iter().zip(&self.w).zip(&self.volts).enumerate() {
            let swapped = usize::from(self.forward.swapped(i));
            let [current, voltage] = [rest[swapped], rest[1 - swapped]];
            let closed = w.abs() <= voltage.max(CLEARLY * TOLERANCE * volts);
            right &= match segment.roles.get(i) {
                Some(Role::Closed) => closed,
                Some(Role::Open) => l == 0.0,
                _ => (l == 0.0 && w >= -voltage) || (l >= -current && closed),
            };
        }
        for (s, (switch, swing)) in self.switches.iter().zip(&mut self.swings).enumerate() {
            let Some(gate) = watched(switch, s, segment.roles, segment.sampled) else { continue };
            let distance = switch.distance(gate, z);
            *swing = swing.max(distance.abs());
            right &= distance >= -segment.doubt;
        }
        right
    }

    /// Keeps the end of a segment for the next one.
    pub fn leave(&mut self, time: f64, [z, l, u]: [&[f64]; 3]) {
        let [none_z, none_l, none_u] = [(); 3].map(|()| Vec::new());
        let end = self.before.get_or_insert(End { time, z: none_z, l: none_l, u: none_u });
        end.time = time;
        for (kept, list) in [(&mut end.z, z), (&mut end.l, l), (&mut end.u, u)] {
            kept.clear();
            kept.extend_from_slice(list);
        }
    }

    /// Takes a point of the present segment to be judged; the first is its beginning.
    pub fn take(&mut self, time: f64, [z, l]: [&[f64]; 2]) {
        self.points.time.push(time);
        self.points.z.extend_from_slice(z);
        self.points.l.extend_from_slice(l);
    }

    /// Judges the points of the segment.
    pub fn judge(&mut self, segment: Segment) {
        self.judged += 1;
        let mut points = std::mem::take(&mut self.points);
        let (n, m, count) = (self.forward.size(), self.q.len(), points.time.len());
        points.w.clear();
        for (z, l) in points.z.chunks_exact(n.max(1)).zip(points.l.chunks_exact(m.max(1))) {
            let from = points.w.len();
            points.w.extend_from_slice(&self.q);
            self.b.add(-1.0, z, &mut points.w[from..]);
            self.d.add(1.0, l, &mut points.w[from..]);
        }
        let mut sizes = self.forward.sizes();
        if let Some(End { time, z, l, u }) = &self.before {
            self.forward.see([z, l], &mut sizes);
            self.forward.see_late(INSTANT * time.abs(), [z, l, u], &mut sizes);
        }
        for k in 0..count {
            self.forward.see([&points.z[k * n..][..n], &points.l[k * m..][..m]], &mut sizes);
        }
        let length = points.time.last().map_or(0.0, |t| t - points.time[0]);
        self.forward.enter(segment.active, [segment.fastest, 1.0 / length]);
        let (mut met, mut across) = (Vec::new(), Vec::new());
        for k in 0..count {
            let (z, l) = (&points.z[k * n..][..n], &points.l[k * m..][..m]);
            self.forward.meet([z, l], &mut met, &mut across);
            for i in 0..m {
                let role = segment.roles.get(i).copied().unwrap_or(Role::Diode);
                let value = [l[i], points.w[k * m + i]];
                let at = |list: &[f64], k: usize| list[k * m + i];
                let slack = [&points.l, &points.w].map(|list| points.blur(k, |k| at(list, k)));
                let scale = [value[0].abs().max(met[i]), across[i]];
                let mut found = error(value, role, scale, slack);
                if found > TOLERANCE {
                    let rounding = self.forward.of_pair(i, &sizes);
                    let both = [slack[0] + rounding[0], slack[1] + rounding[1]];
                    found = error(value, role, scale, both);
                }
                if worse(found, self.complementarity) {
                    (self.complementarity, self.worst_pair) = (found, Some(i));
                }
            }
        }
        self.judge_gates(&points, segment, &sizes);
        points.clear();
        self.points = points;
    }

    fn judge_gates(&mut self, points: &Points, segment: Segment, sizes: &Sizes) {
        let n = self.forward.size();
        let count = points.time.len();
        for (s, switch) in self.switches.iter().enumerate() {
            let Some(gate) = watched(switch, s, segment.roles, segment.sampled) else { continue };
            let distance = |k: usize| switch.distance(gate, &points.z[k * n..][..n]);
            let swing = (0..count).fold(self.swings[s], |most, k| most.max(distance(k).abs()));
            self.swings[s] = swing;
            for k in (0..count).filter(|&k| distance(k) < 0.0) {
                let mut beyond = -distance(k) - points.blur(k, distance) - segment.doubt;
                if beyond > 0.0 {
                    beyond -= self.forward.of_control(s, &switch.control, sizes);
                }
                let found = excess(switch, gate, &points.z[k * n..][..n], beyond, swing);
                if worse(found, self.gates) {
                    (self.gates, self.worst_gate) = (found, Some(switch.pair));
                }
            }
        }
    }
}

/// The relative error of a pair: of its current by the smaller of those that meet at its ends, of its voltage by the
/// potentials there, both but for what is not known.
fn error(value: [f64; 2], role: Role, scale: [f64; 2], slack: [f64; 2]) -> f64 {
    let [current, voltage] = [0, 1].map(|k| {
        let beyond =
            if value[k].abs() <= slack[k] { 0.0 } else { value[k] - slack[k].copysign(value[k]) };
        ratio(beyond, scale[k])
    });
    match role {
        Role::Closed => voltage.abs(),
        Role::Open => current.abs(),
        Role::Diode if current.is_nan() || voltage.is_nan() => f64::NAN,
        Role::Diode => current.min(voltage).abs(),
    }
}

/// The gate of a switch that must turn when its control says so: not one that is sampled, nor a thyristor that conducts.
fn watched(switch: &Switch, s: usize, roles: &[Role], sampled: &[bool]) -> Option<bool> {
    let role = roles.get(switch.pair).copied().unwrap_or(Role::Open);
    let waits = switch.latching && role != Role::Open || sampled.get(s) == Some(&true);
    (!waits).then_some((role == Role::Open) == switch.inverted)
}

#[cfg(test)]
mod tests {
    use super::super::TOLERANCE;
    use super::*;
    use crate::sparse::Csc;
    use crate::switch::AtThreshold;

    /// A source of current into 1 S, and a diode to ground.
    fn clamp(switches: Vec<Switch>) -> SegmentPoints {
        let one = || Csc::from_triplets(1, 1, &[(0, 0, 1.0)]);
        let linear = Linear {
            e: Csc::zeros(1, 1),
            g: one(),
            a: one(),
            b: one(),
            d: Csc::zeros(1, 1),
            q: vec![0.0],
            s: one(),
            row_kind: vec![0],
        };
        let ramp = [0.0, 0.0, 1.0, 1.0, 2.0, -1.0];
        let source = Described::new("pwl", &ramp, f64::NAN, 1.0).unwrap();
        SegmentPoints::new(&linear, switches.into(), &[source])
    }

    /// Takes one segment of points: time, voltage, current of the diode.
    fn segment(judge: &mut SegmentPoints, points: &[[f64; 3]]) {
        for &[time, v, i] in points {
            judge.take(time, [&[v], &[i]]);
        }
        let right = points.iter().all(|[_, v, i]| judge.glance([&[*v], &[*i]], Segment::default()));
        judge.judge(conducts(points));
        // what is right at first sight is so
        assert!(!right || judge.complementarity == 0.0);
        let last = points[points.len() - 1];
        judge.leave(last[0], [&[last[1]], &[last[2]], &[last[1] + last[2]]]);
    }

    /// Which state the diode is in.
    fn conducts(points: &[[f64; 3]]) -> Segment<'static> {
        let active: &[usize] = if points.iter().any(|p| p[2] != 0.0) { &[0] } else { &[] };
        Segment { active, fastest: 1.0, ..Segment::default() }
    }

    fn found(segments: &[&[[f64; 3]]]) -> f64 {
        let mut judge = clamp(Vec::new());
        segments.iter().for_each(|points| segment(&mut judge, points));
        judge.complementarity
    }

    const RIGHT: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [0.5, 0.0, 0.5], [1.0, 0.0, 1.0]];

    #[test]
    fn a_diode_that_conducts_and_then_blocks_is_right() {
        let blocks = [[1.5, 0.0, 0.0], [1.75, -0.5, 0.0], [2.0, -1.0, 0.0]];
        assert!(found(&[&RIGHT, &blocks]) < 1e-3 * TOLERANCE);
    }

    #[test]
    fn a_diode_that_blocks_forward_or_conducts_backward_is_not() {
        assert!(found(&[&[[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [1.0, 1.0, 0.0]]]) > 0.1);
        assert!(found(&[&[[1.5, 0.0, 0.0], [1.75, 0.0, -0.5], [2.0, 0.0, -1.0]]]) > 0.1);
        // from the instant on at which its current should have ended
        assert!(found(&[&[[1.4, 0.0, 0.2], [1.45, 0.0, 0.1], [1.6, 0.0, -0.2]]]) > 0.1);
        assert!(found(&[&[[0.0, 0.0, 0.0], [0.5, f64::NAN, 0.5]]]).is_nan());
    }

    #[test]
    fn what_was_large_before_excuses_nothing() {
        let spike = [[0.0, 0.0, 0.0], [1e-3, 0.0, 1e6], [2e-3, 0.0, 1.0]];
        assert!(found(&[&spike, &[[1.5, 0.0, -1e-6], [1.51, 0.0, -9e-6]]]) > 0.1);
        assert!(found(&[&spike, &[[1.5, 1e-6, 0.0], [1.51, 9e-6, 0.0]]]) > 0.1);
    }

    #[test]
    fn what_is_wrong_between_the_ends_is_told() {
        let dip = [[0.0, 0.0, 0.5], [0.25, 0.0, -0.25], [0.5, 0.0, 0.5]];
        assert!(found(&[&dip]) > 0.1);
    }

    #[test]
    fn sources_and_controls_are_looked_at() {
        let switch = Switch {
            pair: 0,
            control: vec![(0, 1.0)],
            on_above: 0.5,
            off_below: 0.5,
            inverted: false,
            latching: false,
            at_threshold: AtThreshold::Reached,
        };
        let error = |v: f64, u: f64| {
            let mut judge = clamp(vec![switch.clone()]);
            for time in [0.0, 0.4] {
                judge.take(time, [&[v * time], &[0.0]]);
                judge.compare(time, &[u * time]);
            }
            let segment = Segment { roles: &[Role::Open], sampled: &[false], ..Segment::default() };
            judge.judge(segment);
            let right = judge.glance([&[0.4 * v], &[0.0]], segment);
            assert_eq!(right, judge.gates == 0.0);
            [judge.gates, judge.sources.error]
        };
        assert_eq!(error(1.0, 1.0), [0.0; 2]);
        assert!(error(1.5, 1.0)[0] > TOLERANCE && error(1.5, 1.0)[1] == 0.0);
        assert!(error(1.0, 1.001)[1] > TOLERANCE && error(1.0, 1.001)[0] == 0.0);
    }
}

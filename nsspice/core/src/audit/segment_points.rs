//! Every segment of a closed form, at both of its ends and inside: pairs, controls of switches and sources.
//!
//! Kirchhoff's laws and rates are checked on some intervals ([`super::intervals`]); an event that is missed breaks none
//! of them.  Signs are therefore looked at in all segments, and measured by what meets at the pair at that instant: by
//! the largest values of a run any current would be none after the spike of an interrupted winding.

use super::gates::excess;
use super::judge::EXCUSED;
use super::matrix::Entries;
use super::rounding::share;
use super::sources::{Described, Sources};
use super::{ratio, worse, TOLERANCE};
use crate::descriptor::Linear;
use crate::mlcp::Role;
use crate::structure::Parts;
use crate::switch::Switch;
use crate::tolerances::{CLEARLY, FLOOR};
use crate::waveform::INSTANT;
use std::sync::Arc;

/// Where a pair is in the equations.
#[derive(Clone, Debug, Default)]
struct Place {
    /// laws of currents that it feeds
    rows: Vec<usize>,
    /// its series resistance [Ohm], 0 without
    resistance: f64,
    /// its multiplier is a current
    current: bool,
}

/// What rounding is measured by in a segment, and in the one before, which has left the state: a closed form is a sum of
/// terms that are as large as at its beginning.
#[derive(Default)]
struct Measures {
    /// of each point and law: the terms that meet in it, and what potentials would bring to it one by one
    met: Vec<f64>,
    single: Vec<f64>,
    /// of each point and pair: the sum of the sizes of the terms of its slack
    volts: Vec<f64>,
    /// the largest values in this segment and at the end of the one before
    most: Most,
}

/// The largest voltage of a segment, and of each part the largest current, and sum of the terms of a law of currents.
#[derive(Default)]
struct Most {
    volts: f64,
    amperes: Vec<f64>,
    sums: Vec<f64>,
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

impl Measures {
    fn clear(&mut self, parts: usize) {
        [&mut self.met, &mut self.single, &mut self.volts].into_iter().for_each(Vec::clear);
        self.most = Most { volts: 0.0, amperes: vec![0.0; parts], sums: vec![0.0; parts] };
    }

    /// What has been measured belongs to the segment before.
    fn begin(&mut self) {
        [&mut self.met, &mut self.single, &mut self.volts].into_iter().for_each(Vec::clear);
    }
}

/// Checks the segments of a run one by one.
pub struct SegmentPoints {
    q: Vec<f64>,
    b: Entries,
    d: Entries,
    g: Entries,
    a: Entries,
    kinds: Vec<u8>,
    /// conductance of each law of currents to all potentials that act on it [S]
    slopes: Vec<f64>,
    /// least and largest of them in each part, those of pairs among the latter
    extremes: Vec<[f64; 2]>,
    places: Vec<Place>,
    parts: Parts,
    share: f64,
    switches: Arc<[Switch]>,
    /// how far the control of each has been from its thresholds
    swings: Vec<f64>,
    points: Points,
    measures: Measures,
    /// unknowns and multipliers where the last segment ended
    before: [Vec<f64>; 2],
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
}

impl SegmentPoints {
    /// Takes the arrays of a system in the coordinates of its engine.
    pub fn new(linear: &Linear, switches: Arc<[Switch]>, waveforms: &[Described]) -> SegmentPoints {
        let (n, m, _) = linear.sizes();
        let mut places = vec![Place::default(); m];
        for (row, pair, _) in linear.a.iter().filter(|e| linear.row_kind[e.0] == 0) {
            places[pair].rows.push(row);
            places[pair].current = true;
        }
        for (row, pair, value) in linear.d.iter().filter(|e| e.0 == e.1) {
            places[pair].resistance = if row == pair { value } else { 0.0 };
        }
        let mut slopes = vec![0.0; n];
        let volts = |e: &(usize, usize, f64)| [e.0, e.1].iter().all(|&k| linear.row_kind[k] == 0);
        linear.g.iter().filter(volts).for_each(|(row, _, value)| slopes[row] += value.abs());
        let parts = Parts::new(linear, None);
        let mut extremes = vec![[f64::INFINITY, 0.0]; parts.count()];
        for (row, &slope) in slopes.iter().enumerate().filter(|e| *e.1 > 0.0) {
            if let Some(part) = parts.of(row) {
                let [least, most] = &mut extremes[part];
                (*least, *most) = (least.min(slope), most.max(slope));
            }
        }
        for (i, place) in places.iter().enumerate().filter(|e| e.1.resistance > 0.0) {
            let most = &mut extremes[parts.of_pair(i)][1];
            *most = most.max(1.0 / place.resistance);
        }
        SegmentPoints {
            q: linear.q.clone(),
            b: Entries::new(&linear.b),
            d: Entries::new(&linear.d),
            g: Entries::new(&linear.g),
            a: Entries::new(&linear.a),
            kinds: linear.row_kind.clone(),
            slopes,
            places,
            parts,
            extremes,
            // three computations of the size of an elimination in each of the two segments that meet at an event: the
            // reduction to states, their decomposition, and the way back to the unknowns
            share: share(2 * 3 * (n + m)),
            swings: vec![0.0; switches.len()],
            switches,
            points: Points::default(),
            measures: Measures::default(),
            before: [vec![0.0; n], vec![0.0; m]],
            w: Vec::new(),
            volts: Vec::new(),
            sources: Sources::new(waveforms),
            complementarity: 0.0,
            worst_pair: None,
            gates: 0.0,
            worst_gate: None,
            count: 0,
        }
    }

    /// Compares the sources at an instant with their waveforms.
    pub fn compare(&mut self, time: f64, u: &[f64]) {
        self.sources.take_all(std::iter::once((time, 0)), u);
    }

    /// Whether a point is right at first sight: no pair has a member beyond zero, and no control is beyond its
    /// threshold.  All others are for [`SegmentPoints::judge`], which asks what rounding explains.
    pub fn glance(&mut self, [z, l]: [&[f64]; 2], roles: &[Role], sampled: &[bool]) -> bool {
        self.count += 1;
        self.w.clone_from(&self.q);
        self.volts.clear();
        self.volts.extend(self.q.iter().map(|q| q.abs()));
        self.b.add_both(-1.0, z, &mut self.w, &mut self.volts);
        self.d.add_both(1.0, l, &mut self.w, &mut self.volts);
        let members = l.iter().zip(&self.w).zip(&self.volts).enumerate();
        let mut right = members.fold(true, |right, (i, ((&l, &w), &volts))| {
            let closed = w.abs() <= CLEARLY * TOLERANCE * volts;
            right
                & match roles.get(i) {
                    Some(Role::Closed) => closed,
                    Some(Role::Open) => l == 0.0,
                    _ => (l == 0.0 && w >= 0.0) || (l >= 0.0 && closed),
                }
        });
        for (s, (switch, swing)) in self.switches.iter().zip(&mut self.swings).enumerate() {
            let Some(gate) = watched(switch, s, roles, sampled) else { continue };
            let distance = switch.distance(gate, z);
            *swing = swing.max(distance.abs());
            right &= distance >= 0.0;
        }
        right
    }

    /// Keeps the end of a segment for the next one.
    pub fn leave(&mut self, [z, l]: [&[f64]; 2]) {
        self.before[0].copy_from_slice(z);
        self.before[1].copy_from_slice(l);
    }

    /// Takes a point of the present segment to be judged; the first is its beginning.
    pub fn take(&mut self, time: f64, [z, l]: [&[f64]; 2]) {
        self.points.time.push(time);
        self.points.z.extend_from_slice(z);
        self.points.l.extend_from_slice(l);
    }

    /// Judges the points of the segment, with the roles of the pairs there, none without switches; `sampled` switches
    /// are those that look at their controls at instants of their own.  The rounding of the instant at which the
    /// segment before ended may have changed both members of each pair by what is `late`; controls may be beyond their
    /// thresholds by a `doubt`.
    pub fn judge(&mut self, roles: &[Role], sampled: &[bool], (late, doubt): (&[[f64; 2]], f64)) {
        let mut points = std::mem::take(&mut self.points);
        let (n, m, count) = (self.kinds.len(), self.q.len(), points.time.len());
        points.w.clear();
        for z in points.z.chunks_exact(n.max(1)) {
            points.w.extend_from_slice(&self.q);
            let from = points.w.len() - m;
            self.b.add(-1.0, z, &mut points.w[from..]);
        }
        for (l, w) in points.l.chunks_exact(m.max(1)).zip(points.w.chunks_exact_mut(m.max(1))) {
            self.d.add(1.0, l, w);
        }
        let rows = points.z.chunks_exact(n.max(1));
        let parts = self.parts.count();
        self.measures.clear(parts);
        let before = std::mem::take(&mut self.before);
        self.measure(&before[0], &before[1]);
        self.before = before;
        self.measures.begin();
        for (k, z) in rows.enumerate() {
            self.measure(z, &points.l[k * m..][..m]);
        }
        for k in 0..count {
            let l = &points.l[k * m..][..m];
            for i in 0..m {
                let role = roles.get(i).copied().unwrap_or(Role::Diode);
                let at = |list: &[f64], k: usize| list[k * m + i];
                let slack = [&points.l, &points.w].map(|list| points.blur(k, |k| at(list, k)));
                // right after an event that is as late as instants are known
                let late = late.get(i).copied().filter(|_| k < 2).unwrap_or_default();
                let found = self.pair([k, i], [l[i], at(&points.w, k)], role, slack, late);
                if worse(found, self.complementarity) {
                    (self.complementarity, self.worst_pair) = (found, Some(i));
                }
            }
        }
        self.judge_gates(&points, roles, sampled, doubt);
        points.clear();
        self.points = points;
    }

    /// Finds what meets where at a point.
    fn measure(&mut self, z: &[f64], l: &[f64]) {
        let Measures { met, single, volts, most } = &mut self.measures;
        let (n, m) = (self.kinds.len(), self.q.len());
        for list in [&mut *met, &mut *single] {
            list.resize(list.len() + n, 0.0);
        }
        let (from, pairs) = (met.len() - n, volts.len());
        let (met, single) = (&mut met[from..], &mut single[from..]);
        volts.extend(self.q.iter().map(|q| q.abs()));
        let volts = &mut volts[pairs..pairs + m];
        self.b.add_sizes(1.0, z, volts);
        self.d.add_sizes(1.0, l, volts);
        for (row, column, value) in self.g.entries() {
            let term = (value * z[column]).abs();
            if self.kinds[row] == 0 && self.kinds[column] == 0 {
                single[row] += term;
            } else {
                met[row] += term;
            }
        }
        self.a.add_sizes(1.0, l, met);
        for (row, sum) in met.iter().zip(&*single).map(|(met, single)| met + single).enumerate() {
            if let Some(part) = self.parts.of(row).filter(|_| self.kinds[row] == 0) {
                most.sums[part] = most.sums[part].max(sum);
            }
        }
        for (j, v) in z.iter().enumerate() {
            match self.parts.of(j) {
                _ if self.kinds[j] == 0 => most.volts = most.volts.max(v.abs()),
                Some(part) => most.amperes[part] = most.amperes[part].max(v.abs()),
                None => {}
            }
        }
        for (i, place) in self.places.iter().enumerate() {
            most.volts = most.volts.max(volts[i]);
            let amperes = &mut most.amperes[self.parts.of_pair(i)];
            let most = if place.current { amperes } else { &mut most.volts };
            *most = most.max(l[i].abs());
        }
    }

    /// The relative error of a pair at the point that has been measured.
    ///
    /// Its current is measured by the smaller one of those that meet at its ends, and its voltage by the potentials of
    /// these; rounding excuses what it makes of both there, and of the largest values in this segment.
    fn pair(
        &self,
        [k, i]: [usize; 2],
        [l, w]: [f64; 2],
        role: Role,
        [slack_l, slack_w]: [f64; 2],
        [late_l, late_w]: [f64; 2],
    ) -> f64 {
        let (place, measures) = (&self.places[i], &self.measures);
        let (part, most) = (self.parts.of_pair(i), &measures.most);
        let (volts, amperes, sum) = (most.volts, most.amperes[part], most.sums[part]);
        let across = measures.volts[k * self.q.len() + i];
        let (least_w, least_l, met) = if place.current {
            let n = self.kinds.len();
            let meets =
                place.rows.iter().map(|&r| measures.met[k * n + r]).fold(f64::INFINITY, f64::min);
            let rounded = self.share * sum.max(amperes);
            let mut least_l = rounded;
            if place.resistance > 0.0 {
                let known = (self.share * across).max(late_w / TOLERANCE);
                least_l = least_l.max(known / place.resistance);
            }
            // what currents that meet there, or are cut off too late, leave of a node's potential
            let known = rounded.max(late_l / TOLERANCE);
            let slopes = place.rows.iter().map(|&r| self.slopes[r]).filter(|slope| *slope > 0.0);
            let hidden = slopes.fold(0.0, |most: f64, slope| most.max(known / slope));
            let mut least_w = (self.share * volts).max(hidden.min(EXCUSED / TOLERANCE * volts));
            if k < 2 {
                // right after an event what was left of the one member is the other one, by the conductances between
                let [least, most] = self.extremes[part];
                let largest = |of: f64| FLOOR / TOLERANCE * of;
                least_w = least_w.max((known / least).min(largest(volts)));
                let left = (self.share * volts).max(late_w / TOLERANCE) * most;
                least_l = least_l.max(left.min(largest(amperes)));
            }
            (least_w, least_l, if meets.is_finite() { meets } else { 0.0 })
        } else {
            (self.share * amperes, self.share * volts, 0.0)
        };
        let beyond = |value: f64, slack: f64| {
            if value.abs() <= slack {
                0.0
            } else {
                value - slack.copysign(value)
            }
        };
        let current = ratio(beyond(l, slack_l), l.abs().max(met).max(least_l));
        let voltage = ratio(beyond(w, slack_w), across.max(least_w));
        match role {
            Role::Closed => voltage.abs(),
            Role::Open => current.abs(),
            Role::Diode if current.is_nan() || voltage.is_nan() => f64::NAN,
            Role::Diode => current.min(voltage).abs(),
        }
    }

    fn judge_gates(&mut self, points: &Points, roles: &[Role], sampled: &[bool], doubt: f64) {
        let n = self.kinds.len();
        let count = points.time.len();
        for (s, switch) in self.switches.iter().enumerate() {
            let Some(gate) = watched(switch, s, roles, sampled) else { continue };
            // a control is what is left of the largest values
            let amperes = self.measures.most.amperes.iter().fold(0.0f64, |most, i| most.max(*i));
            let most = [self.measures.most.volts, amperes];
            let terms =
                switch.control.iter().map(|&(j, c)| c.abs() * most[usize::from(self.kinds[j])]);
            let known = self.share * TOLERANCE * terms.sum::<f64>();
            let distance = |k: usize| switch.distance(gate, &points.z[k * n..][..n]);
            let swing = (0..count).fold(self.swings[s], |most, k| most.max(distance(k).abs()));
            self.swings[s] = swing;
            for k in (0..count).filter(|&k| distance(k) < 0.0) {
                let beyond = -distance(k) - points.blur(k, distance) - doubt.max(known);
                let found = excess(switch, gate, &points.z[k * n..][..n], beyond, swing);
                if worse(found, self.gates) {
                    (self.gates, self.worst_gate) = (found, Some(switch.pair));
                }
            }
        }
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
        let right = points.iter().all(|[_, v, i]| judge.glance([&[*v], &[*i]], &[], &[]));
        judge.judge(&[], &[], (&[], 0.0));
        // what is right at first sight is so
        assert!(!right || judge.complementarity == 0.0);
        let last = points[points.len() - 1];
        judge.leave([&[last[1]], &[last[2]]]);
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
            judge.judge(&[Role::Open], &[false], (&[], 0.0));
            let right = judge.glance([&[0.4 * v], &[0.0]], &[Role::Open], &[false]);
            assert_eq!(right, judge.gates == 0.0);
            [judge.gates, judge.sources.error]
        };
        assert_eq!(error(1.0, 1.0), [0.0; 2]);
        assert!(error(1.5, 1.0)[0] > TOLERANCE && error(1.5, 1.0)[1] == 0.0);
        assert!(error(1.0, 1.001)[1] > TOLERANCE && error(1.0, 1.001)[0] == 0.0);
    }
}

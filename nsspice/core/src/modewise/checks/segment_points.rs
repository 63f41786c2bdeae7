//! Points of every segment for those who check signs: both ends, where a guard came nearest to a change, and one that
//! lies elsewhere each time.

use crate::audit::{Segment, SegmentPoints};
use crate::dense::Matrix;
use crate::modewise::events::successor::roles;
use crate::modewise::functions::terms::Point;
use crate::modewise::modes::mode::Mode;
use crate::modewise::run::Engine;
use crate::sparse::Csc;
use crate::waveform::INSTANT;

/// Parts of segments at which points lie, one after the other, are the multiples of the golden section without their
/// whole parts: no others fill the interval as evenly at all times.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// One such point for so many intervals of the search for events: what oscillates is looked at more often.
const EVERY: u64 = 8;

/// What looks at every segment, if anything does.
#[derive(Default)]
pub(in crate::modewise) struct Along {
    pub judge: Option<Box<SegmentPoints>>,
    /// unknowns from energy coordinates, and from what stores nothing
    maps: Vec<Csc>,
    turned: f64,
    /// when the points inside are [s]
    times: Vec<f64>,
    found: Found,
}

/// Unknowns, multipliers and sources at a point, with work space.
#[derive(Default)]
struct Found {
    point: Point,
    x: Vec<f64>,
    v: Vec<f64>,
    d: Vec<f64>,
    a: Vec<f64>,
    b: Vec<f64>,
    z: Vec<f64>,
    l: Vec<f64>,
    u: Vec<f64>,
}

impl Along {
    /// Lists so many points inside, and the nearest one.
    fn list(&mut self, length: f64, count: u64, nearest: Option<f64>) {
        self.times.clear();
        for k in 0..count {
            self.turned = (self.turned + GOLDEN).fract();
            self.times.push(length * (k as f64 + self.turned) / count as f64);
        }
        self.times.extend(nearest);
    }
}

impl Engine {
    /// Lets every segment be looked at; call it before the start.
    pub fn look_at_all(&mut self, judge: Option<SegmentPoints>) {
        let sparse = |m: &Matrix| {
            let places = (0..m.rows).flat_map(|r| (0..m.cols).map(move |c| (r, c)));
            let entries = places.map(|(r, c)| (r, c, m[(r, c)])).filter(|e| e.2 != 0.0);
            Csc::from_triplets(m.rows, m.cols, &entries.collect::<Vec<_>>())
        };
        let net = &self.prepared.net;
        self.along.maps = [&net.big_r, &net.kernel].into_iter().map(sparse).collect();
        self.along.judge = judge.map(Box::new);
    }

    /// What has been looked at so far.
    pub fn looked_at(&self) -> Option<&SegmentPoints> {
        self.along.judge.as_deref()
    }

    /// Looks at the segment that has been begun, of this length and found in so many intervals.
    pub(in crate::modewise) fn look_along(&mut self, mode: &Mode, length: f64, intervals: u64) {
        let (fastest, doubt) = (mode.fastest, self.doubt(mode));
        let nearest = self.event_search.nearest();
        self.look_at(Some(mode), (&mode.active, fastest, doubt), length, intervals, nearest);
    }

    /// Looks at the segment that has been begun, in a mode or by a series.
    pub(in crate::modewise) fn look_at(
        &mut self,
        mode: Option<&Mode>,
        (active, fastest, doubt): (&[usize], f64, f64),
        length: f64,
        intervals: u64,
        nearest: Option<f64>,
    ) {
        if length <= 0.0 || self.span.time >= self.plan.stop {
            return;
        }
        let Some(mut judge) = self.along.judge.take() else { return };
        let mut along = std::mem::take(&mut self.along);
        let roles = match self.prepared.switches.is_empty() {
            true => Vec::new(),
            false => roles(self.prepared.net.m, &self.prepared.switches, &self.control.gates),
        };
        along.list(length, 1 + intervals / EVERY, nearest);
        let sampled = self.control.sampling.on.clone();
        let segment = Segment { roles: &roles, sampled: &sampled, active, fastest, doubt };
        // the beginning has the sources of the end before it, but for their edges
        self.find(&mut along, mode, 0.0);
        let mut right = judge.glance([&along.found.z, &along.found.l], segment);
        for k in 0..=along.times.len() {
            let inside = along.times.get(k).copied();
            self.find(&mut along, mode, inside.unwrap_or(length));
            let found = &along.found;
            if let Some(t) = inside {
                judge.compare(self.span.time + t, &found.u);
            }
            right &= judge.glance([&found.z, &found.l], segment);
        }
        if !right {
            let known = INSTANT * self.span.end.abs();
            along.times.extend([0.0, known, length - known, length]);
            along.times.retain(|t| (0.0..=length).contains(t));
            along.times.sort_unstable_by(f64::total_cmp);
            for k in 0..along.times.len() {
                let t = along.times[k];
                self.find(&mut along, mode, t);
                judge.take(self.span.time + t, [&along.found.z, &along.found.l]);
            }
            judge.judge(segment);
        }
        judge.leave(self.span.end, [&along.found.z, &along.found.l, &along.found.u]);
        self.along = along;
        self.along.judge = Some(judge);
    }

    /// Finds what the closed form, or the series, says at a time since the start of the segment.
    fn find(&mut self, along: &mut Along, mode: Option<&Mode>, t: f64) {
        let Along { maps, found, .. } = along;
        let Some(mode) = mode else {
            let Found { z, l, u, .. } = found;
            return self.expanded_into(t, [z, l, u]);
        };
        let Found { point, x, v, d, a, b, z, l, u } = found;
        let (path, segment, net) = (&self.motion.path, &self.motion.segment, &self.prepared.net);
        x.resize(mode.n, 0.0);
        v.resize(self.state.v.len(), 0.0);
        if t == 0.0 {
            x.copy_from_slice(path.start());
            v.copy_from_slice(&segment.now);
        } else {
            // at its end the search for events has been
            let point = if self.motion.point.t == t {
                &self.motion.point
            } else {
                path.at(t, point);
                point
            };
            path.state(point, x);
            path.inputs(segment, point, v);
        }
        segment.rates(v, d);
        a.resize(net.states, 0.0);
        mode.leave(x, v, a);
        b.clear();
        b.resize(net.kernel.cols + mode.active.len(), 0.0);
        mode.algebra([x, v, d], b);
        let (own, multipliers) = b.split_at(net.kernel.cols);
        z.clear();
        z.resize(net.n, 0.0);
        maps.iter().zip([&a[..], own]).for_each(|(map, x)| map.mul_add(1.0, x, z));
        l.clear();
        l.resize(net.m, 0.0);
        mode.active.iter().zip(multipliers).for_each(|(&i, value)| l[i] = *value);
        let inputs = &self.prepared.inputs;
        u.clear();
        u.extend((0..inputs.waveforms().len()).map(|k| inputs.value_of(k, v)));
    }
}

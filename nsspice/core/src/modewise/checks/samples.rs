//! What a run leaves for those who check it: points of sampled segments, as they are.
//!
//! A segment is cut into intervals so short that a quadrature at the nodes of Gauss and Lobatto
//! integrates what moves in it up to rounding; terms that have decayed no longer shorten them.
//! Nothing is judged here.

use crate::audit::{worse, Taken};
use crate::dense::complex;
use crate::integrate::Records;
use crate::mlcp::Role;
use crate::modewise::events::successor::roles;
use crate::modewise::functions::terms::{Point, Term};
use crate::modewise::modes::mode::{Mode, Watch};
use crate::modewise::run::Engine;
use crate::rounding::UNIT;
use crate::tolerances::FLOOR;
use crate::waveform::{Side, INSTANT};

/// Nodes on [-1, 1] and their weights: six, exact for polynomials up to degree nine.
const NODES: [f64; 6] = [
    -1.0,
    -0.765_055_323_929_464_7,
    -0.285_231_516_480_645_1,
    0.285_231_516_480_645_1,
    0.765_055_323_929_464_7,
    1.0,
];
const WEIGHTS: [f64; 6] = [
    1.0 / 15.0,
    0.378_474_956_297_846_9,
    0.554_858_377_035_486_4,
    0.554_858_377_035_486_4,
    0.378_474_956_297_846_9,
    1.0 / 15.0,
];
/// Longest interval in units of the time constant of a term: products of two such terms, as in
/// powers, are then integrated with an error of 5e-13 (2 x 0.8)^10 = 5e-11 of their size.
const REACH: f64 = 0.8;
/// Price of an interval in segments, so that records cost some hundredths of a run, and how many can be
/// kept between two calls; what is left of a segment is left out.
const PRICE: u64 = 256;
const STOCK: u64 = 16 * PRICE;
/// Part of it that one segment may take.
const PART: u64 = 4;
/// Modes whose first segment begins with an interval that is recorded at any cost. More of them see no more: what any
/// segment misses the laws by is in the sums of the whole run, and the signs at its ends are judged.
const FIRST_MODES: usize = 16;
/// Segments up to which the beginning of each is compared with the end of the last motion; later one
/// of so many, the balance of energy sees the others.
const FEW: u64 = 64;
const BOUNDARIES: u64 = 8;
/// Records are handed over when they hold this many numbers.
const FULL: usize = 1 << 18;

/// The end of a motion and the beginning of the next, in energy coordinates.
#[derive(Default)]
struct Boundary {
    /// what it was kept for
    value: f64,
    ends: [Vec<f64>; 2],
}

/// Chooses the segments to record and keeps their points.
pub(in crate::modewise) struct Samples {
    pub watches: bool,
    tokens: u64,
    modes: usize,
    /// segments without length since the last record
    empty: u8,
    pub taken: Taken,
    /// implicit steps
    pub records: Records,
    /// energy coordinates where the last motion ended, or the last reported jump
    left: Vec<f64>,
    /// the largest terms of the control of each switch
    pub controls: Vec<f64>,
    /// those that differ most, and those at which most is stored
    boundaries: [Boundary; 2],
    point: Point,
    x: Vec<f64>,
    v: Vec<f64>,
    d: Vec<f64>,
    a: Vec<f64>,
    b: Vec<f64>,
}

impl Default for Samples {
    fn default() -> Samples {
        Samples {
            watches: false,
            tokens: STOCK,
            modes: 0,
            empty: 0,
            taken: Taken { nodes: NODES.len(), ..Taken::default() },
            records: Records::default(),
            left: Vec::new(),
            controls: Vec::new(),
            boundaries: Default::default(),
            point: Point::default(),
            x: Vec::new(),
            v: Vec::new(),
            d: Vec::new(),
            a: Vec::new(),
            b: Vec::new(),
        }
    }
}

/// The rule by which intervals are recorded.
pub(in crate::modewise) fn rule() -> ([f64; 6], [f64; 6]) {
    (NODES, WEIGHTS)
}

impl Samples {
    /// Whether one interval of a segment of this length is to be recorded, `fresh` if its mode has not been met before;
    /// of so many modes at any cost.
    pub fn takes(&mut self, length: f64, fresh: bool, modes: usize) -> bool {
        let taken = self.watches && length > 0.0 && self.affords(fresh, modes).is_some();
        if taken {
            self.tokens = self.tokens.saturating_sub(PRICE);
        }
        taken
    }

    /// Counts a segment, and the mode that it meets first if it is `fresh`. Some if an interval can be recorded of it:
    /// whether that is so at any cost, as of so many modes.
    fn affords(&mut self, fresh: bool, modes: usize) -> Option<bool> {
        self.tokens = (self.tokens + 1).min(STOCK);
        let first = fresh && self.modes < modes;
        self.modes += usize::from(fresh);
        (first || self.tokens >= PRICE).then_some(first)
    }

    /// Nothing is known of where the last motion ended.
    pub fn forget_end(&mut self) {
        self.left.clear();
    }
}

impl Engine {
    /// Whether points are left for those who check the run.
    pub fn watch(&mut self, watches: bool) {
        self.samples.watches = watches;
    }

    /// Numbers that wait to be taken.
    pub fn waiting(&self) -> usize {
        self.samples.taken.size()
            + self.samples.records.size()
            + self.table.ends.kept.as_ref().map_or(0, Vec::len)
            + self.table.pieces.waiting()
            + self.table.references()
    }

    /// True when they should be taken.
    pub(in crate::modewise) fn brimful(&self) -> bool {
        self.waiting() >= FULL
    }

    /// The points recorded since the last call.
    pub fn take_intervals(&mut self) -> Taken {
        let (nodes, w) = (NODES.len(), &mut self.samples);
        for boundary in w.boundaries.iter_mut().filter(|boundary| !boundary.ends[0].is_empty()) {
            let lists = [&mut w.taken.boundary_end, &mut w.taken.boundary_begin];
            for (list, a) in lists.into_iter().zip(&mut boundary.ends) {
                let from = list.len();
                list.resize(from + self.prepared.net.n, 0.0);
                self.prepared.net.big_r.apply(a, &mut list[from..]);
                a.clear();
            }
        }
        std::mem::replace(&mut self.samples.taken, Taken { nodes, ..Taken::default() })
    }

    /// The implicit steps recorded since the last call.
    pub fn take_records(&mut self) -> Records {
        std::mem::take(&mut self.samples.records)
    }

    /// An implicit step of a length has been accepted, with `[1; inputs]` at its end; the energy
    /// coordinates are still those of its beginning.
    pub(in crate::modewise) fn sample_implicit(
        &mut self,
        time: f64,
        length: f64,
        v: &[f64],
        roles: &[Role],
    ) {
        if !self.samples.watches {
            return;
        }
        let sources = self.prepared.inputs.waveforms().len();
        let u: Vec<f64> = (0..sources).map(|k| self.prepared.inputs.value_of(k, v)).collect();
        self.balance_step(length, &u);
        let mut from = vec![0.0; self.prepared.net.n];
        self.prepared.net.big_r.apply(&self.state.a, &mut from);
        let roles = if self.prepared.switches.is_empty() { &[] } else { roles };
        let (z, l) = (&self.implicit.z, &self.implicit.l);
        let roles = roles.iter().map(|&r| r as u8);
        self.samples.records.push(time, length, &from, z, l, &u, &u, roles);
    }

    /// A motion has come to its end, or a jump that is reported.
    pub(in crate::modewise) fn sample_end(&mut self) {
        if self.samples.watches {
            self.samples.left.clone_from(&self.state.a);
        }
    }

    /// A motion begins: keeps its beginning and the end of the last one if they differ most so far,
    /// or if more is stored there than anywhere else.
    pub(in crate::modewise) fn sample_begin(&mut self, mode: &Mode) {
        let often = self.stats.segments < FEW || self.stats.segments.is_multiple_of(BOUNDARIES);
        let w = &mut self.samples;
        if !w.watches || !often || w.left.len() != self.prepared.net.states {
            return;
        }
        w.x.resize(mode.n, 0.0);
        w.a.resize(self.prepared.net.states, 0.0);
        self.motion.path.state(&self.picker.verifier.start, &mut w.x);
        mode.leave(&w.x, &self.motion.segment.now, &mut w.a);
        w.taken.boundaries += 1;
        let (mut gap, mut size) = (0.0f64, 0.0f64);
        for (left, a) in w.left.iter().zip(&w.a) {
            let found = (left - a).abs();
            gap = if worse(found, gap) { found } else { gap };
            size = size.max(left.abs());
        }
        for (boundary, value) in w.boundaries.iter_mut().zip([gap, size]) {
            if boundary.ends[0].is_empty() || worse(value, boundary.value) {
                boundary.value = value;
                boundary.ends[0].clone_from(&w.left);
                boundary.ends[1].clone_from(&w.a);
            }
        }
    }

    /// Half the square of the energy coordinates if no two terms of the closed form cancelled.
    fn swing(&mut self, mode: &Mode, length: f64) -> f64 {
        let w = &mut self.samples;
        w.x.resize(mode.n, 0.0);
        self.motion.path.sizes(length, &mut w.b, &mut w.x);
        let mut square = 0.0;
        for r in 0..mode.leave_x.rows {
            let sum =
                |row: &[f64], x: &[f64]| row.iter().zip(x).map(|(c, x)| (c * x).abs()).sum::<f64>();
            let of_v = sum(mode.leave_v.row(r), &self.scale.v);
            square += (sum(mode.leave_x.row(r), &w.x) + of_v).powi(2);
        }
        0.5 * square
    }

    /// A segment of this length has begun; `fresh` if its mode has not been met before.
    pub(in crate::modewise) fn sample_segment(&mut self, mode: &Mode, length: f64, fresh: bool) {
        let w = &mut self.samples;
        if !w.watches {
            return;
        }
        if length <= 0.0 {
            w.empty = w.empty.saturating_add(1);
            return;
        }
        let Some(first) = w.affords(fresh, FIRST_MODES) else { return };
        let swing = self.swing(mode, length);
        let w = &mut self.samples;
        let quota = w.tokens.div_ceil(PART * PRICE).min(w.tokens / PRICE) as usize;
        let most = usize::from(first).max(quota);
        let (mut begin, mut count) = (0.0, 0);
        self.make_room(if length <= self.reach(0.0, length) { 1 } else { most });
        while count < most {
            let width = self.reach(begin, length);
            let end = if begin + 1.01 * width >= length { length } else { begin + width };
            count += 1;
            self.samples.taken.swing.push(swing);
            self.record_interval(mode, begin, end, length);
            begin = end;
            if begin >= length {
                break;
            }
        }
        let w = &mut self.samples;
        w.tokens = w.tokens.saturating_sub(count as u64 * PRICE);
    }

    /// Makes room for so many intervals.
    fn make_room(&mut self, intervals: usize) {
        let (n, points) = (self.prepared.net.n, intervals * NODES.len());
        let taken = &mut self.samples.taken;
        for list in [&mut taken.z, &mut taken.rate] {
            list.reserve(points * n);
        }
        taken.l.reserve(points * self.prepared.net.m);
        taken.u.reserve(points * self.prepared.inputs.waveforms().len());
        taken.first.reserve(intervals * n);
        for list in [&mut taken.time, &mut taken.weight] {
            list.reserve(points);
        }
    }

    /// How long the interval that begins at `t` may be.
    fn reach(&self, t: f64, length: f64) -> f64 {
        let mut width = length - t;
        for placed in &self.motion.path.terms {
            let (rate, forced) = match placed.term {
                Term::One | Term::Time => continue,
                Term::Exp { rate } | Term::Ramp { own: rate } => (rate, rate),
                Term::Near { own, apart, .. } => (own, own + apart),
                // its decay is not known
                Term::Numerical { rate } => (complex(0.0, rate), complex(0.0, rate)),
            };
            for rate in [rate, forced] {
                let left = (rate.re * t).exp();
                let size = rate.abs();
                // a quadrature over many time constants takes the rate for that of a part of them
                if size > 0.0 && left > UNIT / (size * (length - t)).max(1.0) {
                    // what has decayed that far is measured by larger things; the error grows with the tenth power of
                    // the length
                    let room = (FLOOR / left).max(1.0).powf(0.1);
                    width = width.min(REACH / size * room);
                }
            }
        }
        width
    }

    /// How far the controls of switches may lie beyond their thresholds.
    pub(in crate::modewise) fn doubt(&self, mode: &Mode) -> f64 {
        if self.control.sampling.on.contains(&true) {
            return f64::INFINITY;
        }
        let noise = mode.guards.watch.iter().zip(&self.picker.verifier.noise);
        let switches = noise.filter(|(watch, _)| matches!(watch, Watch::Switch(_)));
        switches.fold(0.0, |most, (_, noise)| f64::max(most, *noise))
    }

    fn record_interval(&mut self, mode: &Mode, begin: f64, end: f64, length: f64) {
        let (n, m) = (self.prepared.net.n, self.prepared.net.m);
        let mut w = std::mem::take(&mut self.samples);
        let (half, middle) = (0.5 * (end - begin), 0.5 * (end + begin));
        w.x.resize(mode.n, 0.0);
        w.v.resize(self.state.v.len(), 0.0);
        w.a.resize(self.prepared.net.states, 0.0);
        let sources = self.prepared.inputs.waveforms().len();
        for (k, (node, weight)) in NODES.iter().zip(WEIGHTS).enumerate() {
            let t = match k {
                0 => begin,
                5 => end,
                _ => middle + half * node,
            };
            self.motion.path.at(t, &mut w.point);
            self.motion.path.state(&w.point, &mut w.x);
            self.motion.path.inputs(&self.motion.segment, &w.point, &mut w.v);
            self.motion.segment.rates(&w.v, &mut w.d);
            let taken = &mut w.taken;
            let (z, l, u) = (taken.z.len(), taken.l.len(), taken.u.len());
            taken.z.resize(z + n, 0.0);
            taken.l.resize(l + m, 0.0);
            taken.u.resize(u + sources, 0.0);
            let values = [&w.x[..], &w.v, &w.d];
            let work = [&mut w.a, &mut w.b];
            self.unknowns_in(mode, values, &mut taken.z[z..], &mut taken.l[l..], work);
            for (switch, size) in self.prepared.switches.iter().zip(&mut w.controls) {
                *size = size.max(switch.size(&taken.z[z..]));
            }
            // the segment after the end of the run is cut
            let at_end = k == 5 && end == length && self.span.time < self.plan.stop;
            let instant = if at_end { self.span.end } else { self.span.time + t };
            self.sources_inside(instant, k == 0, &w.v, &w.d, &mut taken.u[u..]);
            if k == 0 {
                taken.first.extend_from_slice(&taken.z[z..]);
                taken.first_u.extend_from_slice(&taken.u[u..]);
            }
            self.motion.path.state_rate(&w.point, &mut w.x);
            mode.leave(&w.x, &w.d, &mut w.a);
            let rate = taken.rate.len();
            taken.rate.resize(rate + n, 0.0);
            self.prepared.net.big_r.apply(&w.a, &mut taken.rate[rate..]);
            taken.time.push(self.span.time + t);
            taken.weight.push(half * weight);
        }
        let taken = &mut w.taken;
        taken.begin.push(self.span.time + begin);
        taken.end.push(self.span.time + end);
        taken.shortest.push((end - begin).min(1.0 / mode.fastest));
        taken.steps.push(if end == length {
            1u8.saturating_add(std::mem::take(&mut w.empty))
        } else {
            0
        });
        taken.signed.push(1);
        taken.doubt.push(self.doubt(mode));
        if !self.prepared.switches.is_empty() {
            taken.roles.extend(
                roles(m, &self.prepared.switches, &self.control.gates).iter().map(|&r| r as u8),
            );
        }
        self.samples = w;
    }

    /// Sources inside a segment: those that the segment is driven by, unless a waveform itself says
    /// something else than the rounding of the time explains.
    fn sources_inside(&self, time: f64, start: bool, v: &[f64], d: &[f64], out: &mut [f64]) {
        let side = if start { Side::Right } else { Side::Left };
        self.prepared.inputs.values(time, side, out);
        let indistinct = self.span.end - self.span.time <= INSTANT * self.span.end
            || !start && time - self.span.time <= INSTANT * time;
        for (k, u) in out.iter_mut().enumerate() {
            let (driven, rate) =
                (self.prepared.inputs.value_of(k, v), self.prepared.inputs.rate_of(k, d));
            let rounding = INSTANT * (time * rate).abs();
            if indistinct || (*u - driven).abs() <= rounding + 1e-12 * u.abs().max(driven.abs()) {
                *u = driven;
            }
        }
    }
}

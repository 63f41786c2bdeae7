//! Rows inside segments: evaluated at their instants, those of a run in one product of matrices, and
//! few of a mode that is hardly met through its unknowns.

use crate::modewise::functions::inputs::Segment;
use crate::modewise::functions::terms::Point;
use crate::modewise::modes::mode::Mode;
use crate::modewise::modes::outputs::Outputs;
use crate::modewise::output::block_outputs::Handed;
use crate::modewise::output::expected_rows::ExpectedRows;
use crate::modewise::output::limits::Ends;
use crate::modewise::run::Engine;
use crate::modewise::run_state::Motion;
use crate::modewise::segments::single::Single;
use crate::modewise::segments::spread::Spread;
use crate::modewise::segments::stride::{Strides, RUN};
use crate::modewise::segments::trajectory::Trajectory;
use crate::pieces::Pieces;
use crate::waveform::INSTANT;

/// Of so many rows one is computed once more.
const REFERENCES: u64 = 256;

/// The outputs along the present segment.
#[derive(Default)]
pub(in crate::modewise) struct Inside {
    /// what is below belongs to the present segment
    pub ready: bool,
    /// the mode has no rows of its own
    singly: bool,
    single: Single,
    x: Vec<f64>,
    v: Vec<f64>,
    sizes: Vec<f64>,
    values: Spread,
    rates: Spread,
    /// those that are followed, and a row of them
    chosen: Option<Spread>,
    row: Vec<f64>,
    rated: bool,
    strides: Strides,
    anchor: Point,
    /// instants of a run of rows since the start of the segment, and the terms there
    times: Vec<f64>,
    terms: [Vec<f64>; 2],
}

impl Inside {
    /// Chooses some outputs of the present segment, if they follow from its terms alone.
    pub(super) fn choose(&mut self, outputs: &[usize]) {
        if !self.ready || self.singly || self.rated {
            self.chosen = None;
            return;
        }
        self.chosen.get_or_insert_default().choose(&self.values, outputs);
        self.row.clear();
        self.row.resize(1 + outputs.len(), 0.0);
    }

    /// The outputs at the instants of the run: the first from all terms again, the others from it.
    fn write(
        &mut self,
        outputs: (&Outputs, &Mode),
        (path, segment): (&Trajectory, &Segment),
        (table, columns): (&mut [f64], usize),
        expected: Option<&mut ExpectedRows>,
    ) {
        if self.singly {
            return self.write_singly(outputs, (path, segment), (table, columns), expected);
        }
        let Inside { values, rates, strides, anchor, times, terms: [value, slope], .. } = self;
        path.at(times[0], anchor);
        let (mut points, mut slopes) = (&anchor.value, &anchor.slope);
        if times.len() > 1 {
            strides.anchor(path, anchor);
            strides.run(path, anchor, times, value, self.rated.then_some(&mut *slope));
            (points, slopes) = (value, slope);
        }
        values.write(points, path.slots, table, columns);
        if self.rated {
            rates.write_add(slopes, path.slots, table, columns);
        }
        if let Some(expected) = expected {
            expected.see(times, points, self.rated.then_some(slopes), path.slots);
        }
    }

    /// The outputs at the instants of the run, one after the other.
    fn write_singly(
        &mut self,
        (outputs, mode): (&Outputs, &Mode),
        (path, segment): (&Trajectory, &Segment),
        (table, columns): (&mut [f64], usize),
        mut expected: Option<&mut ExpectedRows>,
    ) {
        let Inside { anchor, single, times, x, v, sizes, .. } = self;
        x.resize(mode.n, 0.0);
        v.resize(segment.now.len(), 0.0);
        sizes.resize(columns - 1, 0.0);
        for (t, row) in times.iter().zip(table.chunks_exact_mut(columns)) {
            path.at(*t, anchor);
            path.state(anchor, x);
            path.inputs(segment, anchor, v);
            let at = (&*anchor, &x[..], &v[..]);
            single.write((outputs, mode, None), (path, segment), at, &mut row[1..], sizes);
            if let Some(expected) = &mut expected {
                expected.see(&[*t], &anchor.value, Some(&anchor.slope), path.slots);
            }
        }
    }
}

/// The outputs, and what is made of them.
pub struct Table {
    pub(in crate::modewise) outputs: Outputs,
    pub(in crate::modewise) inside: Inside,
    pub(in crate::modewise) ends: Ends,
    /// outputs that measures follow
    pub pieces: Pieces,
    /// outputs that drive other blocks
    pub(in crate::modewise) handed: Handed,
    /// rows written inside segments, and some of them computed once more
    written: u64,
    references: Vec<f64>,
    /// somebody compares them
    refers: bool,
    /// what all rows must add up to
    pub(in crate::modewise) expected: ExpectedRows,
    /// modes of which a row has been computed once more
    referred: Vec<bool>,
    /// the row at the end of an implicit step at which the run waits
    pub(in crate::modewise) stepped: Vec<f64>,
}

impl Table {
    /// Numbers of rows that wait to be compared.
    pub(in crate::modewise) fn references(&self) -> usize {
        self.references.len()
    }

    /// Rows of some outputs alone.
    pub(in crate::modewise) fn new(outputs: Outputs) -> Table {
        Table {
            outputs,
            inside: Inside::default(),
            ends: Ends::default(),
            pieces: Pieces::default(),
            handed: Handed::default(),
            written: 0,
            references: Vec::new(),
            refers: false,
            expected: ExpectedRows::default(),
            referred: Vec::new(),
            stepped: Vec::new(),
        }
    }
}

impl Engine {
    /// Writes the next rows as far as they lie inside the segment and there is room for them;
    /// returns their number.
    pub(in crate::modewise) fn write_rows(&mut self, out: &mut [f64]) -> usize {
        if self.expanded.active {
            return self.expanded_rows(out);
        }
        let count = self.write_next_rows(out);
        if self.table.refers {
            self.refer(&out[..count * self.columns()]);
        }
        count
    }

    /// Keeps also what only checks of rows and of turning gates need.
    pub fn watch_closely(&mut self) {
        self.table.refers = true;
        self.table.expected.rows.wanted = true;
        self.log.turns.wanted = true;
    }

    /// Computes some of the rows just written once more, from the unknowns of the mode: the first of each mode, and one
    /// of many.
    fn refer(&mut self, table: &[f64]) {
        let columns = self.columns();
        let (every, offset) = (REFERENCES, self.table.written % REFERENCES);
        self.table.written += (table.len() / columns) as u64;
        let fresh = self.motion.present.as_ref().is_some_and(|&(id, _)| {
            let known = &mut self.table.referred;
            known.resize(known.len().max(id + 1), false);
            !table.is_empty() && !std::mem::replace(&mut known[id], true)
        });
        let first = if fresh { 0 } else { ((every - offset) % every) as usize };
        for row in table.chunks_exact(columns).skip(first).step_by(every as usize) {
            self.refer_to(row[0]);
        }
    }

    /// Keeps the row at a time inside the segment, computed from the unknowns.
    fn refer_to(&mut self, label: f64) {
        let Some((_, mode)) = self.motion.present.clone() else { return };
        let (mut x, mut v, mut d) = (vec![0.0; mode.n], vec![0.0; self.state.v.len()], Vec::new());
        let (mut rate, mut row) = (vec![0.0; mode.n], vec![0.0; self.table.outputs.len()]);
        let mut point = Point::default();
        self.motion.path.at((label - self.span.time).max(0.0), &mut point);
        self.motion.path.state(&point, &mut x);
        self.motion.path.inputs(&self.motion.segment, &point, &mut v);
        self.motion.segment.rates(&v, &mut d);
        self.motion.path.state_rate(&point, &mut rate);
        self.outputs_of(&mode, [&x, &v, &d, &rate], &mut row);
        self.table.references.push(label);
        self.table.references.append(&mut row);
    }

    /// The outputs by the equations of a mode, of modal coordinates, inputs, and the rates of inputs and coordinates.
    pub(in crate::modewise) fn outputs_of(
        &self,
        mode: &Mode,
        [x, v, d, rate]: [&[f64]; 4],
        row: &mut [f64],
    ) {
        let net = &self.prepared.net;
        let (mut z, mut l) = (vec![0.0; net.n], vec![0.0; net.m]);
        let (mut a, mut rates) = (vec![0.0; net.states], vec![0.0; net.n]);
        self.unknowns(mode, x, v, d, &mut z, &mut l);
        mode.leave(rate, d, &mut a);
        net.big_r.apply(&a, &mut rates);
        let inputs = &self.prepared.inputs;
        let sources = inputs.waveforms().len();
        let u: Vec<f64> = (0..sources).map(|k| inputs.value_of(k, v)).collect();
        self.table.outputs.write(&z, &l, &rates, &u, row);
    }

    /// Some rows, computed once more, since the last call.
    pub fn take_references(&mut self) -> Vec<f64> {
        std::mem::take(&mut self.table.references)
    }

    fn write_next_rows(&mut self, out: &mut [f64]) -> usize {
        let last = self.span.end >= self.plan.stop && self.span.end < self.span.breakpoint;
        let before = self.span.end - INSTANT * self.span.end;
        let (time, end) = (self.span.time, self.span.end);
        let within = move |target: &f64| *target < before || (last && *target <= end);
        let Some(first) = self.plan.rows.peek().filter(within) else { return 0 };
        let (step, columns) = (self.plan.rows.step(), self.columns());
        self.prepare_rows(((end - first) / step).max(0.0) + 1.0);
        let evenly = self.motion.path.closed() && end - first >= RUN as f64 * step;
        if evenly && !self.table.inside.singly {
            self.table.inside.strides.begin(&self.motion.path, step);
        }
        let (mut rest, mut count) = (out, 0);
        let Motion { present, path, segment, .. } = &self.motion;
        let (clock, Table { inside, outputs, expected, .. }) =
            (&mut self.plan.rows, &mut self.table);
        let Some((_, mode)) = present else { return 0 };
        while let Some(first) = clock.peek().filter(within) {
            let most = if evenly { RUN } else { 1 };
            inside.times.clear();
            let mut target = first;
            for (k, row) in rest.chunks_exact_mut(columns).take(most).enumerate() {
                // the last row need not be where the others would have it
                if (first + k as f64 * step - target).abs() > INSTANT * target {
                    break;
                }
                row[0] = target;
                inside.times.push((target - time).max(0.0));
                clock.advance();
                let Some(next) = clock.peek().filter(within) else { break };
                target = next;
            }
            if inside.times.is_empty() {
                break;
            }
            let table;
            (table, rest) = rest.split_at_mut(inside.times.len() * columns);
            inside.write((outputs, mode), (path, segment), (table, columns), Some(&mut *expected));
            count += inside.times.len();
        }
        self.close_expected();
        count
    }

    /// Writes the outputs at one time since the start of the segment, behind the first column.
    pub(in crate::modewise) fn write_inside(&mut self, time: f64, row: &mut [f64]) {
        if self.expanded.active {
            return self.write_expanded(time, &mut row[1..]);
        }
        self.table.inside.times.clear();
        self.table.inside.times.push(time);
        let Motion { present, path, segment, .. } = &self.motion;
        let Table { inside, outputs, .. } = &mut self.table;
        if let Some((_, mode)) = present {
            let columns = row.len();
            inside.write((outputs, mode), (path, segment), (row, columns), None);
        }
    }

    /// The outputs that have been chosen, at one time since the start of the segment.
    pub(super) fn chosen_at(&mut self, time: f64) -> Option<&[f64]> {
        let Inside { chosen, anchor, row, .. } = &mut self.table.inside;
        let chosen = chosen.as_ref().filter(|_| !self.expanded.active)?;
        self.motion.path.at(time, anchor);
        let columns = row.len();
        chosen.write(&anchor.value, self.motion.path.slots, row, columns);
        Some(&row[1..])
    }

    /// Brings the outputs of the mode into the terms of the segment, if so many points are worth it.
    pub(in crate::modewise) fn prepare_rows(&mut self, points: f64) {
        let Some((id, mode)) = &self.motion.present else { return };
        let inside = &mut self.table.inside;
        if inside.ready {
            return;
        }
        inside.ready = true;
        let rows = self.registry.outputs(*id, mode, &self.table.outputs, points);
        inside.singly = rows.is_none();
        let Some(rows) = rows else { return };
        self.motion.path.spread(&rows.value, &self.motion.segment, &mut inside.values);
        inside.rated = rows.rate.is_some();
        if let Some(rate) = &rows.rate {
            self.motion.path.spread(rate, &self.motion.segment, &mut inside.rates);
        }
    }
}

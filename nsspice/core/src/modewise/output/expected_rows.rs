//! What the rows of the exact engine must add up to: terms of the closed forms are summed over the rows of a segment,
//! states over the segments of a mode, and unknowns follow from the equations of the mode, not from the maps that rows
//! are written by.

use crate::dense::add_scaled;
use crate::modewise::functions::inputs::Segment;
use crate::modewise::functions::terms::Point;
use crate::modewise::modes::mode::Mode;
use crate::modewise::modes::registry::Id;
use crate::modewise::run::Engine;
use crate::modewise::segments::trajectory::Trajectory;
use crate::row_sums::RowSums;
use std::collections::HashMap;
use std::sync::Arc;

/// Modes whose sums are kept apart: each is held in memory for as long.
const MODES: usize = 64;

/// Weighted sums over the rows of one mode: modal coordinates, inputs, and the rates of both.
struct OfMode {
    mode: Arc<Mode>,
    x: Vec<f64>,
    v: Vec<f64>,
    d: Vec<f64>,
    rate: Vec<f64>,
}

/// Weighted sums over rows.
#[derive(Default)]
pub(in crate::modewise) struct ExpectedRows {
    /// those of rows that are known in no other way, and all that have been brought into outputs
    pub rows: RowSums,
    /// over the rows of the present segment
    point: Point,
    weight: f64,
    modes: HashMap<Id, OfMode>,
    /// over rows by series: unknowns, multipliers, rates and sources
    series: [Vec<f64>; 4],
    x: Vec<f64>,
    v: Vec<f64>,
    d: Vec<f64>,
}

/// Adds a multiple of a list to sums of the same length or none yet.
fn add(sums: &mut Vec<f64>, factor: f64, list: &[f64]) {
    sums.resize(list.len(), 0.0);
    add_scaled(sums, factor, list);
}

impl ExpectedRows {
    /// Takes the terms of some rows of the present segment: their times, values, and derivatives if outputs need them.
    pub fn see(&mut self, times: &[f64], values: &[f64], slopes: Option<&[f64]>, slots: usize) {
        if !self.rows.wanted {
            return;
        }
        for (k, t) in times.iter().enumerate() {
            let weight = self.rows.next();
            let part = k * slots..(k + 1) * slots;
            self.weight += weight;
            self.point.t += weight * t;
            add(&mut self.point.value, weight, &values[part.clone()]);
            if let Some(slopes) = slopes {
                add(&mut self.point.slope, weight, &slopes[part]);
            }
        }
    }

    /// Brings what has been taken of the present segment into coordinates: these are affine in the terms, so that
    /// their mean belongs to the mean of the terms.
    fn close(&mut self, (id, mode): (Id, &Arc<Mode>), path: &Trajectory, segment: &Segment) {
        let weight = std::mem::take(&mut self.weight);
        if weight == 0.0 {
            return;
        }
        let mean = &mut self.point;
        mean.t /= weight;
        mean.value.iter_mut().chain(&mut mean.slope).for_each(|sum| *sum /= weight);
        let (n, inputs) = (mode.n, segment.now.len());
        let of = self.modes.entry(id).or_insert_with(|| OfMode {
            mode: mode.clone(),
            x: vec![0.0; n],
            v: vec![0.0; inputs],
            d: vec![0.0; inputs],
            rate: vec![0.0; n],
        });
        self.x.resize(n, 0.0);
        self.v.resize(inputs, 0.0);
        path.state(mean, &mut self.x);
        add_scaled(&mut of.x, weight, &self.x);
        path.inputs(segment, mean, &mut self.v);
        add_scaled(&mut of.v, weight, &self.v);
        segment.rates(&self.v, &mut self.d);
        add_scaled(&mut of.d, weight, &self.d);
        if !mean.slope.is_empty() {
            path.state_rate(mean, &mut self.x);
            add_scaled(&mut of.rate, weight, &self.x);
        }
        mean.t = 0.0;
        mean.value.clear();
        mean.slope.clear();
    }

    /// Takes the unknowns, multipliers, rates and sources of a row by series.
    pub fn see_series(&mut self, quantities: [&[f64]; 4]) {
        if self.rows.wanted {
            let weight = self.rows.next();
            for (sums, list) in self.series.iter_mut().zip(quantities) {
                add(sums, weight, list);
            }
        }
    }
}

impl Engine {
    /// Brings what has been taken of the present segment into coordinates.
    pub(in crate::modewise) fn close_expected(&mut self) {
        let Some((id, mode)) = &self.motion.present else { return };
        self.table.expected.close((*id, mode), &self.motion.path, &self.motion.segment);
        if self.table.expected.modes.len() > MODES {
            self.expect();
        }
    }

    /// Brings all sums into outputs.
    fn expect(&mut self) {
        let mut row = vec![0.0; self.table.outputs.len()];
        let modes = std::mem::take(&mut self.table.expected.modes);
        // in the order of their numbers: sums must not depend on how they are kept
        let mut modes: Vec<(Id, OfMode)> = modes.into_iter().collect();
        modes.sort_by_key(|(id, _)| *id);
        for (_, of) in &modes {
            self.outputs_of(&of.mode, [&of.x, &of.v, &of.d, &of.rate], &mut row);
            self.table.expected.rows.add(1.0, &row);
        }
        let series = std::mem::take(&mut self.table.expected.series);
        if !series[0].is_empty() {
            let [z, l, rates, u] = &series;
            self.table.outputs.write(z, l, rates, u, &mut row);
            self.table.expected.rows.add(1.0, &row);
        }
    }

    /// What the columns of all rows so far must add up to, weighted.
    pub fn expected_sums(&mut self) -> Vec<f64> {
        self.expect();
        self.table.expected.rows.sums().to_vec()
    }
}

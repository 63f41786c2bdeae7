//! What several engines share: switches, sources, initial values and written rows, damaged by the chosen fault.

use crate::switch::Switch;
use std::sync::Arc;

/// The switches as engines see them.
pub fn switches(switches: &Arc<[Switch]>) -> Arc<[Switch]> {
    let mut out = switches.to_vec();
    for s in &mut out {
        let (up, down) = (s.on_above, s.off_below);
        let (middle, band) = (0.5 * (up + down), up - down);
        let size = up.abs().max(down.abs()).max(1e-3);
        if s.latching {
            fault!("thyristor_fires_alone" => s.on_above = f64::NEG_INFINITY);
            fault!("thyristor_never_fires" => s.on_above = f64::INFINITY);
            fault!("thyristor_fires_late" => s.on_above = up + 0.5 * size);
            fault!("thyristor_both_ways" => s.latching = false);
            fault!("thyristor_never_opens" => s.off_below = f64::NEG_INFINITY);
            continue;
        }
        fault!("threshold_upper_alone" => s.off_below = up);
        fault!("thresholds_between" => (s.on_above, s.off_below) = (middle, middle));
        fault!("threshold_shifted_1e-2" => s.on_above = up + 1e-2 * size);
        fault!("threshold_shifted_1e-4" => s.on_above = up + 1e-4 * size);
        fault!("thresholds_apart" => {
            (s.on_above, s.off_below) = (up + 0.1 * band.max(0.1 * size), down - 0.1 * band.max(0.1 * size))
        });
    }
    out.into()
}

/// The states of gates before the start.
pub fn gates(gates: &[bool]) -> Vec<bool> {
    fault!("gates_begin_turned", gates.to_vec(), gates.iter().map(|gate| !gate).collect())
}

/// Values of a waveform and their scale.
pub fn waveform(kind: &str, values: &[f64], scale: f64) -> (Vec<f64>, f64) {
    let mut p = values.to_vec();
    let mut scale = scale;
    fault!("source_scaled_1e-3" => scale *= 1.0 + 1e-3);
    fault!("source_scaled_1e-5" => scale *= 1.0 + 1e-5);
    match kind {
        "dc" => fault!("dc_off_1e-4" => p[0] *= 1.0 + 1e-4),
        "pulse" => {
            let part = if p[6].is_finite() { p[6] } else { p[5].min(1.0) };
            fault!("source_delayed_1e-3" => p[2] += 1e-3 * part);
            fault!("source_edges_slow" => (p[3], p[4]) = (1.5 * p[3], 1.5 * p[4]));
            fault!("source_width_1e-3" => p[5] *= 1.0 + 1e-3);
        }
        "sin" => {
            fault!("source_delayed_1e-3" => p[3] += 1e-3 / p[2]);
            fault!("sine_phase_1e-3" => p[5] += 1e-3_f64.to_degrees());
            fault!("sine_frequency_1e-5" => p[2] *= 1.0 + 1e-5);
            fault!("sine_damping_missing" => p[4] = 0.0);
        }
        "pwl" => {
            let k = 2 * (p.len() / 4);
            let next = p.get(k + 2).copied().unwrap_or(f64::INFINITY);
            fault!("polygon_vertex_moved" => p[k] = (1.01 * p[k]).min(next));
        }
        _ => {}
    }
    (p, scale)
}

/// The places of the two largest numbers.
fn largest(list: &[f64]) -> [Option<usize>; 2] {
    let mut order: Vec<usize> = (0..list.len()).filter(|&k| list[k] != 0.0).collect();
    order.sort_by(|&i, &j| list[j].abs().total_cmp(&list[i].abs()));
    [order.first().copied(), order.get(1).copied()]
}

/// Charges and fluxes, or the unknowns that show them, with which a run begins.
pub fn start(stored: &mut [f64]) {
    fault!("start_scaled_1e-3" => stored.iter_mut().for_each(|q| *q *= 1.0 + 1e-3));
    fault!("start_scaled_1e-5" => stored.iter_mut().for_each(|q| *q *= 1.0 + 1e-5));
    let [first, second] = largest(stored);
    let Some(first) = first else { return };
    fault!("start_largest_missing" => stored[first] = 0.0);
    fault!("start_sign" => stored[first] *= -1.0);
    fault!("start_swapped" => stored.swap(first, second.unwrap_or((first + 1) % stored.len())));
    let last = (0..stored.len()).rev().find(|&k| stored[k] != 0.0).unwrap_or(first);
    fault!("start_last_missing" => stored[last] = 0.0);
}

/// What is stored after a jump, given by unknowns `before` and after it.
pub fn jump(before: &[f64], after: &mut [f64], stored: impl Iterator<Item = usize>) {
    let stored: Vec<usize> = stored.collect();
    let mut keep = |part: f64| {
        stored.iter().for_each(|&j| after[j] += part * (before[j] - after[j]));
    };
    fault!("steps_jump_short" => keep(0.1));
    fault!("steps_jump_off_1e-4" => keep(1e-4));
    fault!("steps_jump_missing" => keep(1.0));
    let moved = |&&j: &&usize| (after[j] - before[j]).abs();
    let most = stored.iter().max_by(|i, j| moved(i).total_cmp(&moved(j))).copied();
    if let Some(j) = most.filter(|&j| (after[j] - before[j]).abs() > 1e-6 * before[j].abs()) {
        fault!("steps_jump_zeroes" => after[j] = 0.0);
    }
}

/// The place of a row in a table.
fn place(k: usize, columns: usize) -> std::ops::Range<usize> {
    k * columns..(k + 1) * columns
}

/// Gives rows the values, but not the times, of those before them.
fn repeat(table: &mut [f64], columns: usize, rows: impl Iterator<Item = usize>) {
    for k in rows {
        let from = place(k - 1, columns);
        table.copy_within(from.start + 1..from.end, place(k, columns).start + 1);
    }
}

/// Rows as an engine writes them: the time, then the values.
pub fn written(table: &mut [f64], columns: usize) {
    let (count, middle) = (table.len() / columns, columns / 2);
    if columns < 2 || count == 0 {
        return;
    }
    for (k, row) in table.chunks_exact_mut(columns).enumerate() {
        fault!("row_scaled_1e-4" => row[middle] *= 1.0 + 1e-4);
        fault!("row_zeroed" => row[middle] = 0.0);
        if k % 2 == 1 {
            fault!("row_off_1e-5" => row[1..].iter_mut().for_each(|v| *v *= 1.0 + 1e-5));
        }
        if k == count / 2 {
            fault!("row_one_alone" => row[middle] *= 1.1);
        }
    }
    fault!("rows_late" => repeat(table, columns, (1..count).rev()));
}

/// Rows as they are handed on.
pub fn handed(table: &mut [f64], columns: usize) {
    let (count, middle) = (table.len() / columns, columns / 2);
    if columns < 2 || count == 0 {
        return;
    }
    for row in table.chunks_exact_mut(columns) {
        fault!("row_scaled_1e-2" => row[middle] *= 1.0 + 1e-2);
        fault!("rows_swapped" => row.swap(middle, 1 + middle % (columns - 1)));
        fault!("row_sign" => row[columns - 1] *= -1.0);
    }
    fault!("rows_stale" => repeat(table, columns, (37..count).step_by(37)));
    for k in 1..count.saturating_sub(1) {
        let third = (table[k * columns] - table[(k - 1) * columns]) / 3.0;
        fault!("rows_early" => table[k * columns] += third.max(0.0));
    }
}

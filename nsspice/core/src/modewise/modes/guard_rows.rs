//! Guards as rows over the columns of a mode: multipliers, slacks, distances from thresholds.

use crate::dense::Matrix;
use crate::modewise::modes::error_carrying::Tracked;
use crate::modewise::modes::network::Network;
use crate::switch::Switch;

/// Multipliers of active pairs and slacks of the others, over `[x | v | v']`.
pub(in crate::modewise) fn guard_rows(
    net: &Network,
    on: &[bool],
    active: &[usize],
    states: &Tracked,
    algebraic: &Tracked,
    n: usize,
) -> Tracked {
    let mut out = impulse_rows(net, on, active, states, algebraic);
    for i in (0..net.m).filter(|&i| !on[i]) {
        for (c, &q) in net.q.row(i).iter().enumerate() {
            out.value[(i, n + c)] += q;
            out.bound[(i, n + c)] += q.abs();
        }
    }
    out
}

/// The same without the constant slack.
pub(in crate::modewise) fn impulse_rows(
    net: &Network,
    on: &[bool],
    active: &[usize],
    states: &Tracked,
    algebraic: &Tracked,
) -> Tracked {
    let k = net.kernel.cols;
    let off: Vec<usize> = (0..net.m).filter(|&i| !on[i]).collect();
    let mut data = Vec::with_capacity(off.len() * (k + active.len()));
    for &i in &off {
        data.extend(net.split.bn.row(i).iter().map(|v| -v));
        data.extend(active.iter().map(|&p| net.d[(i, p)]));
    }
    let factor = Matrix { rows: off.len(), cols: k + active.len(), data };
    let mut slack = algebraic.under(&factor);
    slack.add(-1.0, &states.under(&net.split.br.select_rows(&off)));
    let mut out = Tracked::zeros(net.m, algebraic.value.cols);
    let mut put = |to: usize, from: &Tracked, row: usize| {
        out.value.row_mut(to).copy_from_slice(from.value.row(row));
        out.bound.row_mut(to).copy_from_slice(from.bound.row(row));
    };
    for (i, &p) in off.iter().enumerate() {
        put(p, &slack, i);
    }
    for (i, &p) in active.iter().enumerate() {
        put(p, algebraic, k + i);
    }
    out
}

/// Distances of the controls from the thresholds that would change them.
pub(in crate::modewise) fn control_rows(
    net: &Network,
    switches: &[Switch],
    gates: &[bool],
    states: &Tracked,
    algebraic: &Tracked,
    n: usize,
    width: usize,
) -> Tracked {
    let mut out = Tracked::zeros(switches.len(), width);
    for (s, switch) in switches.iter().enumerate() {
        let combine = |m: &Matrix, width: usize| {
            let of = |c: usize| switch.control.iter().map(|&(u, f)| f * m[(u, c)]).sum();
            Matrix::from_fn(1, width, |_, c| if c < m.cols { of(c) } else { 0.0 })
        };
        let mut row = states.under(&combine(&net.big_r, net.states));
        row.add(1.0, &algebraic.under(&combine(&net.kernel, algebraic.value.rows)));
        row.clean(net.n + net.m);
        let (threshold, sign) = switch.edge(gates[s]);
        for c in 0..width {
            out.value[(s, c)] = sign * row.value[(0, c)];
            out.bound[(s, c)] = row.bound[(0, c)];
        }
        out.value[(s, n)] -= sign * threshold;
        out.bound[(s, n)] += threshold.abs();
        for &(_, _, c, f) in net.controls.iter().filter(|o| o.0 == s && o.1 == gates[s]) {
            out.value[(s, n + c)] += sign * f;
            out.bound[(s, n + c)] += f.abs();
        }
    }
    out
}

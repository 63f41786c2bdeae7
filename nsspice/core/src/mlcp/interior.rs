//! Stage 3: Mehrotra's predictor-corrector interior point method, then polishing.

use super::modes::{LEVELS, SHIFTED};
use super::polish;
use super::problem::Role;
use super::residual::Residual;
use super::scratch::Scratch;
use crate::linear::Factor;

const ITERATIONS: usize = 100;
/// Part of the way to the boundary taken in one step.
const STEP: f64 = 0.995;
/// Polishing is tried whenever the gap has fallen below one of these.
const GAPS: [f64; 5] = [1e-4, 1e-7, 1e-10, 1e-13, 1e-16];

/// The iterate in the scaled system: `x = [z; l]` and the slacks `w`.
struct Point {
    x: Vec<f64>,
    w: Vec<f64>,
}

/// True if `s.x` solves the problem.
pub(crate) fn solve(s: &mut Scratch) -> Option<Residual> {
    let model = s.model.clone();
    let (n, size) = (model.n, model.size());
    let f: Vec<f64> = s.f.iter().zip(&model.scale).map(|(f, s)| f * s).collect();
    let diodes: Vec<usize> = (0..model.m).filter(|&i| s.roles[i] == Role::Diode).collect();
    let mut p = starting_point(s, &f, &diodes);
    let mut jacobian = model.scaled.clone();
    let mut factor: Option<Factor> = None;
    let mut weight: Vec<f64> =
        s.roles.iter().map(|r| if *r == Role::Closed { 1.0 } else { 0.0 }).collect();
    let (mut residual, mut affine, mut step) = (vec![0.0; size], vec![0.0; size], vec![0.0; size]);
    let mut next_gap = 0;
    for _ in 0..ITERATIONS {
        s.iterations += 1;
        let gap = mean_product(&p, &diodes, n);
        let size_of_x = p.x.iter().chain(&p.w).fold(1e-300f64, |a, v| a.max(v.abs()));
        if !size_of_x.is_finite() || size_of_x > 1e18 {
            return None;
        }
        if next_gap < GAPS.len() && gap <= GAPS[next_gap] * size_of_x * size_of_x {
            while next_gap < GAPS.len() && gap <= GAPS[next_gap] * size_of_x * size_of_x {
                next_gap += 1;
            }
            let point: Vec<f64> = p.x.iter().zip(&model.scale).map(|(x, s)| x * s).collect();
            if let Some(found) = polish::polish(s, &point) {
                return Some(found);
            }
        }
        if next_gap == GAPS.len() || diodes.is_empty() {
            break;
        }
        for &i in &diodes {
            let (l, w) = (p.x[n + i], p.w[i]);
            weight[i] = l / (l + w);
        }
        model.jacobian(|i| weight[i], LEVELS[SHIFTED], &mut jacobian.values);
        match &mut factor {
            Some(f) => f.factor(&jacobian),
            None => factor = Some(Factor::new(&jacobian, &model.ordering)),
        }
        let factor = factor.as_ref().expect("just made");
        residual.copy_from_slice(&f);
        model.scaled.mul_add(-1.0, &p.x, &mut residual);
        for i in 0..model.m {
            match s.roles[i] {
                Role::Diode => residual[n + i] += p.w[i],
                Role::Closed => {}
                Role::Open => residual[n + i] = -p.x[n + i],
            }
        }
        // predictor
        let work = &mut s.work;
        let target = |_: usize| 0.0;
        if !direction(&p, &diodes, n, &residual, factor, &target, &mut affine, work) {
            return None;
        }
        let slopes = slack_step(&p, &diodes, n, &affine, &target);
        let t = longest_step(&p, &diodes, n, &affine, &slopes);
        let mut ahead = 0.0;
        for (&i, dw) in diodes.iter().zip(&slopes) {
            ahead += (p.x[n + i] + t * affine[n + i]) * (p.w[i] + t * dw);
        }
        ahead /= diodes.len() as f64;
        let sigma = (ahead / gap).clamp(0.0, 1.0).powi(3);
        // corrector
        let second: Vec<f64> =
            diodes.iter().zip(&slopes).map(|(&i, dw)| affine[n + i] * dw).collect();
        let target = |k: usize| sigma * gap - second[k];
        if !direction(&p, &diodes, n, &residual, factor, &target, &mut step, work) {
            return None;
        }
        let slopes = slack_step(&p, &diodes, n, &step, &target);
        let t = (STEP * longest_step(&p, &diodes, n, &step, &slopes)).min(1.0);
        for (x, d) in p.x.iter_mut().zip(&step) {
            *x += t * d;
        }
        for (&i, dw) in diodes.iter().zip(&slopes) {
            p.w[i] += t * dw;
        }
    }
    None
}

/// Previous solution pushed into the interior (Mehrotra's shift).
fn starting_point(s: &Scratch, f: &[f64], diodes: &[usize]) -> Point {
    let model = &s.model;
    let n = model.n;
    let mut x: Vec<f64> = s.start.iter().zip(&model.scale).map(|(x, s)| x / s).collect();
    let mut defect = f.to_vec();
    model.scaled.mul_add(-1.0, &x, &mut defect);
    let mut w: Vec<f64> = defect[n..].iter().map(|d| -d).collect();
    let size = diodes.iter().fold(0.0f64, |a, &i| a.max(x[n + i].abs()).max(w[i].abs()));
    let data = f.iter().fold(0.0f64, |a, v| a.max(v.abs()));
    let floor = 0.1 * size.max(data).max(1e-30);
    for &i in diodes {
        x[n + i] = x[n + i].max(floor);
        w[i] = w[i].max(floor);
    }
    Point { x, w }
}

fn mean_product(p: &Point, diodes: &[usize], n: usize) -> f64 {
    let sum: f64 = diodes.iter().map(|&i| p.x[n + i] * p.w[i]).sum();
    sum / diodes.len().max(1) as f64
}

/// Newton step towards `l w = target`; the row of a pair is weighted by `l / (l + w)`, which keeps
/// the Jacobian bounded while l or w goes to zero.
#[allow(clippy::too_many_arguments)]
fn direction(
    p: &Point,
    diodes: &[usize],
    n: usize,
    residual: &[f64],
    factor: &Factor,
    target: &dyn Fn(usize) -> f64,
    out: &mut [f64],
    work: &mut [f64],
) -> bool {
    out.copy_from_slice(residual);
    for (k, &i) in diodes.iter().enumerate() {
        let (l, w) = (p.x[n + i], p.w[i]);
        out[n + i] = (l * (residual[n + i] - w) + target(k)) / (l + w);
    }
    factor.solve(out, work).is_ok() && out.iter().all(|v| v.is_finite())
}

/// Step of the slacks that belongs to a step of x.
fn slack_step(
    p: &Point,
    diodes: &[usize],
    n: usize,
    step: &[f64],
    target: &dyn Fn(usize) -> f64,
) -> Vec<f64> {
    let slope = |(k, &i): (usize, &usize)| {
        let (l, w) = (p.x[n + i], p.w[i]);
        (target(k) - l * w - w * step[n + i]) / l
    };
    diodes.iter().enumerate().map(slope).collect()
}

/// Largest step (at most 1) that keeps multipliers and slacks nonnegative.
fn longest_step(p: &Point, diodes: &[usize], n: usize, step: &[f64], slopes: &[f64]) -> f64 {
    let mut t = 1.0f64;
    for (&i, &dw) in diodes.iter().zip(slopes) {
        let dl = step[n + i];
        if dl < 0.0 {
            t = t.min(-p.x[n + i] / dl);
        }
        if dw < 0.0 {
            t = t.min(-p.w[i] / dw);
        }
    }
    t
}

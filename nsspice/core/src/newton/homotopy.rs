//! Ways to a solution where Newton's method alone does not find one.
//!
//! None of them changes the problem that is solved in the end: junctions are made gentle and sharp
//! again, unknowns are held back and let go.

use super::convergence::Judgement;
use super::solve::{Newton, Pull};
use crate::tape::Linearisation;

/// Iterations for a first solution: so many, and more for large networks, in which one stage after
/// the other finds its state.
const FIRST: (usize, usize) = (100, 2);
const MOST: usize = 1000;
/// Iterations for one point of a path.
const POINT: usize = 25;
/// Points that are tried where functions have no value.
const POLES: usize = 3;
/// Factors by which all junctions are made gentle at first.
const BLUNT: [f64; 4] = [4.0, 30.0, 300.0, 3000.0];
/// Smallest relative progress along the path of sharpness.  No test distinguishes a decade more or less.
const LEAST_STEP: f64 = 1e-3;
/// Rates of the steps of relaxation, relative to that of the step: first, last, largest, and the
/// factors after a step that was found and one that was not.
const RELAX: [f64; 5] = [1e3, 1e-2, 1e9, 0.5, 10.0];
const RELAX_STEPS: usize = 300;
/// Weights of the proximal term: first, last, and the largest it may grow to.
const PULL: [f64; 3] = [1.0, 1e-13, 1e6];
const PROXIMAL_STEPS: usize = 400;

/// Progress along the path on which a point is freed of its residual: first, least, and the factors
/// after a point that was found and one that was not.
const UNLOAD: [f64; 4] = [0.1, 1e-10, 2.0, 0.25];
const UNLOAD_STEPS: usize = 400;
/// Weights from which the pull to the begin is taken away: the least leaves paths of other branches than the
/// others do.  Then the factors of a step (first, least, largest), and the weight below which nothing pulls.
const LET_GO: [f64; 4] = [1e-3, 1e-1, 1e1, 1e3];
const LOOSER: [f64; 4] = [0.1, 1e-3, 0.999, 1e-15];
const LET_GO_STEPS: usize = 400;
/// The last pull is next to nothing: without it no unknown becomes so many times as large.
/// No test distinguishes a decade more or less.
const FARTHEST: f64 = 100.0;

/// A first solution, from nothing.
pub(super) fn first(newton: &mut Newton) -> Option<Judgement> {
    begin_at_zero(newton);
    // a circuit at rest has no scale against which rounding could be distinguished from a solution
    newton.evaluate_at_x(Linearisation::Exact, None);
    let rest = newton.judge();
    if rest.residual.worst() == 0.0 {
        return Some(rest);
    }
    from_knees(newton).or_else(|| follow(newton, &vec![0.0; newton.eq.size()]))
}

/// All unknowns at zero, in the mode that follows from that.
pub(super) fn begin_at_zero(newton: &mut Newton) {
    newton.state.x.fill(0.0);
    newton.activate_from_signs();
}

/// Newton's method with all junctions at their knees.
pub(super) fn from_knees(newton: &mut Newton) -> Option<Judgement> {
    newton.tape.set_points(&vec![0.0; newton.tape.points().len()]);
    newton.tape.point_at_knees();
    let limit = patience(newton);
    newton.iterate(limit, None, Linearisation::Held)
}

/// Iterations where the solution may be far away.
fn patience(newton: &Newton) -> usize {
    (FIRST.0 + FIRST.1 * newton.eq.size()).min(MOST)
}

/// A solution from a point near which Newton's method failed.
pub(super) fn follow(newton: &mut Newton, begin: &[f64]) -> Option<Judgement> {
    if let Some(found) = beside_poles(newton, begin) {
        return Some(found);
    }
    newton.state.stage = 3;
    relax(newton, begin)
        .or_else(|| hold_back(newton, begin))
        .or_else(|| sharpen(newton, begin))
        .or_else(|| unload(newton, begin))
        .or_else(|| let_go(newton, begin))
}

/// From a point at which some functions have no value (a pole, the edge of a domain): where the
/// circuit would be without them.
fn beside_poles(newton: &mut Newton, begin: &[f64]) -> Option<Judgement> {
    newton.state.x.copy_from_slice(begin);
    newton.activate_from_signs();
    let limit = patience(newton);
    for _ in 0..POLES {
        newton.evaluate_at_x(Linearisation::Held, None);
        if !newton.tape.silence() {
            return None;
        }
        newton.balance();
        newton.assemblies[newton.present].forget_scale();
        newton.state.limits.bounded = false;
        if !newton.advance(None) {
            return None;
        }
        newton.state.limits.begin.copy_from_slice(&newton.state.x);
        if let Some(found) = newton.iterate(limit, None, Linearisation::Held) {
            return Some(found);
        }
        let moved = newton.state.limits.begin.clone();
        newton.state.x.copy_from_slice(&moved);
    }
    None
}

/// The way on which the circuit itself would go: charges and fluxes move in short steps of an
/// artificial time towards the solution of the step.  Where a state ends (a trigger at its
/// threshold) this leads to the next stable one, which no path along the solutions reaches.
fn relax(newton: &mut Newton, begin: &[f64]) -> Option<Judgement> {
    let rate = newton.assemblies[newton.present].rate;
    if rate <= 0.0 {
        return None;
    }
    let right = newton.state.problem.right.clone();
    let nearest = newton.state.nearest.clone();
    let found = relax_from(newton, begin, rate, &right);
    newton.set_rate(rate);
    newton.state.problem.right.copy_from_slice(&right);
    if found.is_none() {
        newton.state.nearest = nearest;
    }
    found
}

fn relax_from(newton: &mut Newton, begin: &[f64], rate: f64, right: &[f64]) -> Option<Judgement> {
    let mut centre = begin.to_vec();
    let mut points = newton.tape.points().to_vec();
    let mut more = RELAX[0] * rate;
    for _ in 0..RELAX_STEPS {
        newton.set_rate(rate + more);
        newton.hold_stored(right, &centre, more);
        newton.state.x.copy_from_slice(&centre);
        newton.tape.set_points(&points);
        if newton.run(POINT, None).is_none() {
            more *= RELAX[4];
            if more > RELAX[2] * rate {
                return None;
            }
            continue;
        }
        centre.copy_from_slice(&newton.state.x);
        points.copy_from_slice(newton.tape.points());
        more *= RELAX[3];
        if more <= rate {
            newton.set_rate(rate);
            newton.state.problem.right.copy_from_slice(right);
            if let Some(found) = newton.run(POINT, None) {
                return Some(found);
            }
            if more < RELAX[1] * rate {
                return None;
            }
        }
    }
    None
}

/// Sharpness: from gentle junctions to those of the problem.
fn sharpen(newton: &mut Newton, begin: &[f64]) -> Option<Judgement> {
    if !newton.tape.has_junctions() {
        return None;
    }
    for blunt in BLUNT {
        let found = sharpen_from(newton, begin, blunt);
        newton.tape.set_blunt(1.0);
        if let Some(found) = found {
            return Some(found);
        }
    }
    None
}

fn sharpen_from(newton: &mut Newton, begin: &[f64], blunt: f64) -> Option<Judgement> {
    newton.tape.set_blunt(blunt);
    newton.state.x.copy_from_slice(begin);
    newton.tape.point_at_knees();
    newton.activate_from_signs();
    newton.iterate(2 * POINT, None, Linearisation::Held)?;
    let mut here = blunt;
    let mut step = 0.5f64; // in the logarithm, of what is left
    let mut x = newton.state.x.clone();
    let mut points = newton.tape.points().to_vec();
    while here > 1.0 {
        let next = if here < 1.05 || step >= 1.0 { 1.0 } else { here.powf(1.0 - step) };
        newton.tape.set_blunt(next);
        // voltages of conducting junctions shrink with the unit
        let found = newton.run(POINT, None);
        if let Some(found) = found {
            here = next;
            x.copy_from_slice(&newton.state.x);
            points.copy_from_slice(newton.tape.points());
            step *= 2.0;
            if here == 1.0 {
                return Some(found);
            }
        } else {
            step *= 0.25;
            if step < LEAST_STEP {
                return None;
            }
            newton.state.x.copy_from_slice(&x);
            newton.tape.set_points(&points);
        }
    }
    None
}

/// Proximal point method, which for monotone problems always arrives; with growing freedom it is
/// implicit Euler in an artificial time (pseudo-transient continuation) for the others.
fn hold_back(newton: &mut Newton, begin: &[f64]) -> Option<Judgement> {
    let mut centre = begin.to_vec();
    newton.state.x.copy_from_slice(begin);
    newton.tape.point_at_knees();
    let mut points = newton.tape.points().to_vec();
    let mut mu = PULL[0];
    let mut trials = 0;
    for _ in 0..PROXIMAL_STEPS {
        let found = newton.run(POINT, Some(&Pull { mu, centre: &centre }));
        if found.is_none() {
            mu *= 10.0;
            if mu > PULL[2] {
                return None;
            }
            newton.state.x.copy_from_slice(&centre);
            newton.tape.set_points(&points);
            continue;
        }
        let moved = newton
            .state
            .x
            .iter()
            .zip(&centre)
            .zip(&newton.assemblies[newton.present].scaling.columns);
        let (moved, size) = moved.fold((0.0f64, 0.0f64), |(m, a), ((x, c), s)| {
            (m.max(((x - c) / s).abs()), a.max((x / s).abs()))
        });
        centre.copy_from_slice(&newton.state.x);
        points.copy_from_slice(newton.tape.points());
        // near the end of the path the problem itself is tried
        if moved <= 1e-2 * size * (1.0 + mu) || mu <= 1e-4 {
            trials += 1;
            if let Some(found) = newton.run(POINT, None) {
                return Some(found);
            }
            if trials > 60 {
                return None;
            }
            newton.state.x.copy_from_slice(&centre);
            newton.tape.set_points(&points);
        }
        mu = (mu * 0.3).max(PULL[1]);
    }
    None
}

/// Newton's homotopy: the point solves the equations with its own residual as a load, which is taken off
/// step by step (E. L. Allgower, K. Georg, Introduction to Numerical Continuation Methods, SIAM 2003,
/// section 11.4).  Amplifiers of high gain in a loop of feedback without storage leave no other way: each
/// linearisation in saturation is blind to the volt or two in which they amplify, and in the artificial
/// time of the other ways they oscillate.
fn unload(newton: &mut Newton, begin: &[f64]) -> Option<Judgement> {
    let (right, nearest) = (newton.state.problem.right.clone(), newton.state.nearest.clone());
    newton.state.x.copy_from_slice(begin);
    newton.evaluate_at_x(Linearisation::Exact, None);
    let load = newton.state.balance.defect[..newton.eq.n].to_vec();
    if !load.iter().all(|v| v.is_finite()) {
        return None;
    }
    let (mut x, mut points) = (begin.to_vec(), newton.tape.points().to_vec());
    let [mut step, least, more, less] = UNLOAD;
    let mut off = 0.0;
    let mut found = None;
    for _ in 0..UNLOAD_STEPS {
        let next = f64::min(1.0, off + step);
        for ((r, full), load) in newton.state.problem.right.iter_mut().zip(&right).zip(&load) {
            *r = full - (1.0 - next) * load;
        }
        match newton.run(POINT, None) {
            Some(end) if next == 1.0 => {
                found = Some(end);
                break;
            }
            Some(_) => {
                (off, step) = (next, more * step);
                x.copy_from_slice(&newton.state.x);
                points.copy_from_slice(newton.tape.points());
            }
            None if less * step < least => break,
            None => {
                step *= less;
                newton.state.x.copy_from_slice(&x);
                newton.tape.set_points(&points);
            }
        }
    }
    newton.state.problem.right.copy_from_slice(&right);
    newton.state.nearest = nearest;
    found
}

/// Conductances from all nodes to where they begin, and resistances in series with all branches, which are
/// taken away step by step.  The centre stays where it is, so that amplifiers in a loop do not oscillate as
/// they do where it moves; a path that ends is begun again at another weight.
fn let_go(newton: &mut Newton, begin: &[f64]) -> Option<Judgement> {
    if newton.assemblies[newton.present].rate > 0.0 {
        return None; // a step may be shorter, which costs less
    }
    LET_GO.iter().find_map(|&weight| let_go_from(newton, begin, weight))
}

/// Whether the present unknowns are about as large as those of `before`: voltages, and all others.
fn stays(newton: &Newton, before: &[f64]) -> bool {
    let eq = &newton.eq;
    [true, false].into_iter().all(|nodes| {
        let largest = |x: &[f64]| {
            let kind =
                x.iter().enumerate().filter(|(i, _)| nodes == (*i < eq.n && eq.kind(*i) == 0));
            kind.fold(0.0f64, |most, (_, v)| most.max(v.abs()))
        };
        largest(&newton.state.x) <= FARTHEST * largest(before)
    })
}

fn let_go_from(newton: &mut Newton, begin: &[f64], first: f64) -> Option<Judgement> {
    newton.state.x.copy_from_slice(begin);
    newton.tape.point_at_knees();
    newton.run(POINT, Some(&Pull { mu: first, centre: begin }))?;
    let [mut factor, least, largest, last] = LOOSER;
    let mut here = first;
    let mut x = newton.state.x.clone();
    let mut points = newton.tape.points().to_vec();
    for _ in 0..LET_GO_STEPS {
        let mu = factor * here;
        let pull = (mu >= last).then_some(Pull { mu, centre: begin });
        match newton.run(POINT, pull.as_ref()) {
            // without a solution the path leads to where rounding hides that
            Some(found) if pull.is_none() => return stays(newton, &x).then_some(found),
            Some(_) => {
                here = mu;
                factor = (factor * factor).max(least);
                x.copy_from_slice(&newton.state.x);
                points.copy_from_slice(newton.tape.points());
            }
            None => {
                factor = factor.powf(0.25);
                if factor > largest {
                    return None;
                }
                newton.state.x.copy_from_slice(&x);
                newton.tape.set_points(&points);
            }
        }
    }
    None
}

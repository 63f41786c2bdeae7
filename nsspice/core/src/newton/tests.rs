use super::{Newton, Smooth};
use crate::mlcp::{Role, Start};
use crate::sparse::Csc;
use crate::tape::{Program, Tape, NAMES};
use std::sync::Arc;

fn code(name: &str) -> u8 {
    NAMES.iter().position(|n| *n == name).unwrap() as u8
}

/// `10 V -- R -- a`, a junction from a to ground, an ideal diode in parallel with drop `vf`.
fn clamp(unit: f64, vf: f64) -> Newton {
    let ops = [code("unknown"), code("junction")];
    let program = Program::new(&ops, &[[0, 0, 0], [0, 0, 0]], &[1e-14, unit], &[1], 1, 0).unwrap();
    let one = |v: f64| Csc::from_triplets(1, 1, &[(0, 0, v)]);
    let smooth = Smooth { tape: Tape::new(Arc::new(program)), f: one(1.0), q: one(0.0) };
    let _ = vf;
    Newton::new(&one(0.0), &one(1e-3), &one(1.0), &one(1.0), &one(0.0), &[0], smooth)
}

#[test]
fn smooth_and_set_valued_diodes_share_a_node() {
    for unit in [2.59e-2, 2.59e-3, 2.59e-5] {
        for (vf, ideal) in [(10.0, false), (3e-4, true)] {
            let mut newton = clamp(unit, vf);
            let (mut z, mut l) = ([0.0], [0.0]);
            newton.set_rate(0.0);
            let found = newton
                .solve(&[10e-3], &[], 0.0, &[vf], &[Role::Diode], &mut z, &mut l, Start::Cold)
                .unwrap();
            assert!(found.residual.worst() < 1e-10 && found.stage == 1, "{found:?}");
            let current = 1e-14 * (z[0] / unit).exp_m1();
            assert!((current + l[0] + 1e-3 * z[0] - 10e-3).abs() < 1e-12);
            let conducts = ideal && vf < unit * (10e-3f64 / 1e-14).ln();
            assert_eq!(l[0] > 0.0, conducts, "{unit} {vf}");
            assert!(z[0] <= vf + 1e-15);
        }
    }
}

/// `source -- 1 kOhm -- z`, a junction from z to ground.
fn rectifier() -> Newton {
    let ops = [code("unknown"), code("junction")];
    let constants = [1e-14, 0.0259];
    let program = Program::new(&ops, &[[0, 0, 0], [0, 0, 0]], &constants, &[1], 1, 0).unwrap();
    let one = |v: f64| Csc::from_triplets(1, 1, &[(0, 0, v)]);
    let none = |r, c| Csc::from_triplets(r, c, &[]);
    let smooth = Smooth { tape: Tape::new(Arc::new(program)), f: one(1.0), q: one(0.0) };
    let (a, b) = (none(1, 0), none(0, 1));
    Newton::new(&one(0.0), &one(1e-3), &a, &b, &none(0, 0), &[0], smooth)
}

/// Guesses are not all judged while the source moves; solutions are the same, and at rest guesses are
/// judged again and stand as they are.
#[test]
fn guesses_that_are_not_judged_change_no_solution() {
    let mut newton = rectifier();
    let mut z = [0.0];
    let solve = |newton: &mut Newton, volts: f64, z: &mut [f64], start| {
        newton.solve(&[1e-3 * volts], &[], 0.0, &[], &[], z, &mut [], start).unwrap()
    };
    solve(&mut newton, 0.0, &mut z, Start::Cold);
    let law = |v: f64| 1e-3 * v + 1e-14 * (v / 0.0259).exp_m1();
    for k in 1..=4000 {
        let volts = 5.0 * (1e-3 * f64::from(k)).sin();
        let found = solve(&mut newton, volts, &mut z, Start::Warm);
        // rounding of z moves its current by up to 16 units times z / nVt
        let sure = 1e-14 + 16.0 * f64::EPSILON * (1.0 + z[0].abs() / 0.0259);
        let size = 2e-3 * volts.abs().max(z[0].abs());
        assert!((law(z[0]) - 1e-3 * volts).abs() <= sure * size, "{k} {found:?}");
    }
    let volts = 5.0 * 4.0f64.sin();
    let rest: Vec<u32> =
        (0..9).map(|_| solve(&mut newton, volts, &mut z, Start::Warm).iterations).collect();
    assert_eq!(rest[8], 0, "{rest:?}");
}

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

use super::Newton;
use crate::descriptor::Smooth;
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
    Newton::new(&one(0.0), &one(1e-3), &one(1.0), &one(1.0), &one(0.0), &[0], smooth, None)
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
    Newton::new(&one(0.0), &one(1e-3), &a, &b, &none(0, 0), &[0], smooth, None)
}

/// Guesses are not all judged while the source moves; solutions are the same, and at rest guesses are
/// judged again and stay as they are.
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

/// A chain of `count` nodes, 1 mS from each to the next and 0.1 mS to ground, a source of 1 mA at its
/// begin, a junction at each second node, a pair from its last node to ground.
fn chain(count: usize) -> (Newton, Csc) {
    let junctions: Vec<usize> = (0..count).step_by(2).collect();
    let (mut ops, mut args, mut outputs) = (Vec::new(), Vec::new(), Vec::new());
    for &node in &junctions {
        outputs.push(ops.len() as i32 + 1);
        args.extend([[node as i32, 0, 0], [ops.len() as i32, 0, 0]]);
        ops.extend([code("unknown"), code("junction")]);
    }
    let constants = [1e-14, 0.0259];
    let program = Program::new(&ops, &args, &constants, &outputs, count, 0).unwrap();
    let mut g: Vec<_> = (0..count).map(|i| (i, i, 1e-4)).collect();
    for i in 1..count {
        g.extend([(i - 1, i - 1, 1e-3), (i, i, 1e-3), (i - 1, i, -1e-3), (i, i - 1, -1e-3)]);
    }
    let g = Csc::from_triplets(count, count, &g);
    let f: Vec<_> = junctions.iter().enumerate().map(|(k, &node)| (node, k, 1.0)).collect();
    let f = Csc::from_triplets(count, junctions.len(), &f);
    let q = Csc::from_triplets(count, junctions.len(), &[]);
    let smooth = Smooth { tape: Tape::new(Arc::new(program)), f, q };
    let none = Csc::from_triplets(count, count, &[]);
    let a = Csc::from_triplets(count, 1, &[(count - 1, 0, 1.0)]);
    let d = Csc::from_triplets(1, 1, &[]);
    let newton = Newton::new(&none, &g, &a, &a.transpose(), &d, &vec![0; count], smooth, None);
    (newton, g)
}

/// Small systems of each width and one that is not small, in both modes of a pair by turns: equations hold
/// by their own sums.
#[test]
fn laws_hold_in_systems_of_all_widths() {
    for count in [1, 2, 3, 4, 7, 8, 11, 12, 15, 16, 31] {
        let (mut newton, g) = chain(count);
        let (mut z, mut l) = (vec![0.0; count], [0.0]);
        for step in 0..60 {
            let mut rhs = vec![0.0; count];
            rhs[0] = 1e-3 * (0.2 * f64::from(step)).sin();
            let role = if step % 7 < 4 { Role::Open } else { Role::Closed };
            let start = if step == 0 { Start::Cold } else { Start::Warm };
            let q = [0.01];
            newton.solve(&rhs, &[], 0.0, &q, &[role], &mut z, &mut l, start).unwrap();
            let mut defect = rhs.clone();
            g.mul_add(-1.0, &z, &mut defect);
            defect[count - 1] -= l[0];
            for node in (0..count).step_by(2) {
                defect[node] -= 1e-14 * (z[node] / 0.0259).exp_m1();
            }
            // the iteration ends at 1e-14 of the terms, which are less than 2 mA and 1 V, and at what
            // rounding of the voltages does to junctions
            let sure = 2e-3 * (1e-14 + 16.0 * f64::EPSILON / 0.0259);
            assert!(defect.iter().all(|d| d.abs() < sure), "{count} {step}: {defect:?}");
            match role {
                Role::Closed => assert!((z[count - 1] - 0.01).abs() < 1e-14),
                _ => assert_eq!(l[0], 0.0),
            }
        }
    }
}

/// `V -- s -- 1 kOhm -- o`, a junction from o to ground: the law of the source comes first and its current
/// last, and what is left between them gives the same solution as all laws together.
#[test]
fn triangular_ends_of_a_jacobian_are_not_factorised() {
    let ops = [code("unknown"), code("junction")];
    let constants = [1e-14, 0.0259];
    let program = Program::new(&ops, &[[1, 0, 0], [0, 0, 0]], &constants, &[1], 3, 0).unwrap();
    let g = [(0, 0, 1e-3), (0, 1, -1e-3), (0, 2, 1.0), (1, 0, -1e-3), (1, 1, 1e-3), (2, 0, -1.0)];
    let none = |r, c| Csc::from_triplets(r, c, &[]);
    let f = Csc::from_triplets(3, 1, &[(1, 0, 1.0)]);
    let smooth = Smooth { tape: Tape::new(Arc::new(program)), f, q: none(3, 1) };
    let g = Csc::from_triplets(3, 3, &g);
    let ends = (none(3, 0), none(0, 3));
    let mut newton =
        Newton::new(&none(3, 3), &g, &ends.0, &ends.1, &none(0, 0), &[0, 0, 1], smooth, None);
    let mut z = [0.0; 3];
    newton.solve(&[0.0, 0.0, -5.0], &[], 0.0, &[], &[], &mut z, &mut [], Start::Cold).unwrap();
    assert!(z[0] == 5.0 && (1e-3 * (z[0] - z[1]) + z[2]).abs() < 1e-15, "{z:?}");
    let Newton { eq, tape, assemblies, present, .. } = &mut newton;
    let (assembly, mut work) = (&mut assemblies[*present], [0.0; 12]);
    let right = [[1.0, -2.0, 0.5], [0.0, 1e-3, 0.0], [3.0, 0.0, 0.0]];
    assembly.linearise(tape.slopes());
    assert!(assembly.factorise(eq, &[], 0.0));
    let mut whole = right;
    whole.iter_mut().for_each(|x| assembly.solve(3, &[], x, &mut work));
    assert!(assembly.is_direct() && assembly.factorise_directly(eq, tape.slopes(), &[]));
    let mut parts = right;
    parts.iter_mut().for_each(|x| assembly.solve(3, &[], x, &mut work));
    assert_eq!(parts.map(|x| x[0]), [-0.5, 0.0, 0.0]); // without rounding
    for (parts, whole) in parts.iter().zip(&whole) {
        let size = whole.iter().fold(0.0f64, |size, v| size.max(v.abs()));
        let near = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-14 * size;
        assert!(parts.iter().zip(whole).all(near), "{parts:?} {whole:?}");
    }
}

use super::{Linearisation, Program, Tape, NAMES};
use std::sync::Arc;

fn code(name: &str) -> u8 {
    NAMES.iter().position(|n| *n == name).unwrap() as u8
}

/// A tape from (name, arguments) over 3 unknowns and 1 source; the last register is the output.
fn tape(list: &[(&str, [i32; 3])], constants: &[f64]) -> Tape {
    let ops: Vec<u8> = list.iter().map(|i| code(i.0)).collect();
    let args: Vec<[i32; 3]> = list.iter().map(|i| i.1).collect();
    let output = [list.len() as i32 - 1];
    Tape::new(Arc::new(Program::new(&ops, &args, constants, &output, 3, 1).unwrap()))
}

fn gradient(t: &Tape) -> Vec<(usize, f64)> {
    t.derivatives(0).map(|(v, s)| (v, t.slopes()[s])).collect()
}

#[test]
fn derivatives_reach_unknowns_sources_and_time_once_each() {
    // (z0 z2 + u0) t + z0
    let mut t = tape(
        &[
            ("unknown", [0, 0, 0]),
            ("unknown", [2, 0, 0]),
            ("source", [0, 0, 0]),
            ("time", [0, 0, 0]),
            ("mul", [0, 1, 0]),
            ("add", [4, 2, 0]),
            ("mul", [5, 3, 0]),
            ("add", [6, 0, 0]),
        ],
        &[],
    );
    t.evaluate(&[2.0, 9.0, 5.0], &[7.0], 3.0, Linearisation::Exact);
    assert_eq!(t.value(0), 53.0);
    assert_eq!(gradient(&t), vec![(0, 16.0), (2, 6.0), (3, 3.0), (4, 17.0)]);
}

#[test]
fn a_branch_not_taken_has_no_influence() {
    // if (z0 > 1) asin(z0) else 2 z0
    let mut t = tape(
        &[
            ("unknown", [0, 0, 0]),
            ("constant", [0, 0, 0]),
            ("lt", [0, 1, 0]),
            ("asin", [0, 0, 0]),
            ("add", [0, 0, 0]),
            ("if", [2, 3, 4]),
        ],
        &[1.0],
    );
    t.evaluate(&[4.0, 0.0, 0.0], &[0.0], 0.0, Linearisation::Exact);
    assert_eq!((t.value(0), gradient(&t)), (8.0, vec![(0, 2.0)]));
}

#[test]
fn careful_values_lie_on_a_tangent_and_arrive() {
    let list = [("unknown", [0, 0, 0]), ("junction", [0, 0, 0])];
    let mut t = tape(&list, &[1e-14, 0.025]);
    t.evaluate(&[5.0, 0.0, 0.0], &[0.0], 0.0, Linearisation::Careful);
    assert!(t.limited() && t.value(0).is_finite());
    // behind the point of the junction by itself that of its group
    let (point, slope) = (t.points()[1], gradient(&t)[0].1);
    assert!((slope - 1e-14 / 0.025 * (point / 0.025).exp()).abs() < 1e-12 * slope);
    let mut rounds = 0;
    while t.limited() {
        t.evaluate(&[0.8, 0.0, 0.0], &[0.0], 0.0, Linearisation::Careful);
        rounds += 1;
        assert!(rounds < 12);
    }
    let exact = 1e-14 * (0.8f64 / 0.025).exp_m1();
    assert!((t.value(0) - exact).abs() < 1e-14 * exact);
}

#[test]
fn diodes_from_ground_and_to_ground_are_mirrored() {
    // junctions at z0 and at -z1, one each, and at z0 - z1
    let list =
        [("unknown", [0; 3]), ("unknown", [1, 0, 0]), ("neg", [1, 0, 0]), ("sub", [0, 1, 0])];
    let junctions = [0, 2, 3].map(|at| ("junction", [at, 0, 0]));
    let all: Vec<_> = list.iter().chain(&junctions).collect();
    let ops: Vec<u8> = all.iter().map(|i| code(i.0)).collect();
    let args: Vec<[i32; 3]> = all.iter().map(|i| i.1).collect();
    let program = Program::new(&ops, &args, &[1e-14, 0.025], &[4, 5, 6], 2, 0).unwrap();
    let mut t = Tape::new(Arc::new(program));
    for v in [[0.6, -0.62], [0.6 + 1e-12, -0.62], [-3.0, 4.0], [0.3, 0.0]] {
        t.evaluate(&v, &[], 0.0, Linearisation::Exact);
        let law = |v: f64| [1e-14 * (v / 0.025).exp_m1(), 1e-14 / 0.025 * (v / 0.025).exp()];
        let [to, from, between] = [v[0], -v[1], v[0] - v[1]].map(law);
        let expected: [(f64, &[(usize, f64)]); 3] = [
            (to[0], &[(0, to[1])]),
            (from[0], &[(1, -from[1])]),
            (between[0], &[(0, between[1]), (1, -between[1])]),
        ];
        for (k, (value, slopes)) in expected.into_iter().enumerate() {
            // 1 unit in the last place of an argument of up to 160 units
            let near = |a: f64, b: f64| (a - b).abs() <= 160.0 * f64::EPSILON * b.abs();
            assert!(near(t.value(k), value), "{k} {v:?}");
            let found: Vec<_> = t.derivatives(k).collect();
            assert_eq!(found.len(), slopes.len());
            for ((variable, slot), &(expected, slope)) in found.into_iter().zip(slopes) {
                assert!(variable == expected && near(t.slopes()[slot], slope), "{k} {v:?}");
            }
        }
    }
}

#[test]
fn a_newton_iteration_in_series_with_a_resistor_converges_however_sharp() {
    for unit in [0.0259, 2.59e-3, 2.59e-4, 2.59e-5, 2.59e-6] {
        let list = [("unknown", [0, 0, 0]), ("junction", [0, 0, 0])];
        let mut t = tape(&list, &[1e-14, unit]);
        let (source, conductance) = (10.0, 1e-3);
        let mut v = 0.0;
        let mut rounds = 0;
        loop {
            t.evaluate(&[v, 0.0, 0.0], &[0.0], 0.0, Linearisation::Careful);
            let defect = conductance * (source - v) - t.value(0);
            if !t.limited() && defect.abs() < 1e-14 {
                break;
            }
            v += defect / (conductance + gradient(&t)[0].1);
            rounds += 1;
            assert!(rounds < 25, "unit {unit}");
        }
    }
}

#[test]
fn wrong_tapes_are_refused() {
    let wrong = |name: &str, args: [i32; 3], constants: &[f64]| {
        Program::new(&[code(name)], &[args], constants, &[0], 1, 1).is_err()
    };
    assert!(wrong("neg", [0, 0, 0], &[]));
    assert!(wrong("unknown", [1, 0, 0], &[]));
    assert!(wrong("constant", [0, 0, 0], &[]));
    assert!(wrong("source", [-1, 0, 0], &[]));
    assert!(Program::new(&[200], &[[0; 3]], &[], &[], 1, 1).is_err());
    assert!(Program::new(&[0], &[[0; 3]], &[1.0], &[1], 1, 1).is_err());
}

#[test]
fn parts_at_rest_follow_their_tangent_and_the_others_are_computed() {
    // junctions at z0 - z1 and at z2, each with a factor: two parts
    let list: Vec<(&str, [i32; 3])> = vec![
        ("unknown", [0, 0, 0]),
        ("unknown", [1, 0, 0]),
        ("sub", [0, 1, 0]),
        ("junction", [2, 1, 0]),
        ("constant", [0, 0, 0]),
        ("mul", [3, 4, 0]),
        ("unknown", [2, 0, 0]),
        ("junction", [6, 1, 0]),
        ("div", [7, 4, 0]),
    ];
    let ops: Vec<u8> = list.iter().map(|i| code(i.0)).collect();
    let args: Vec<[i32; 3]> = list.iter().map(|i| i.1).collect();
    let constants = [3.0, 1e-14, 0.025];
    let program = Program::new(&ops, &args, &constants, &[5, 8], 3, 1).unwrap();
    let law = |v: f64| 1e-14 * (v / 0.025).exp_m1();
    for accuracy in [1e-14, 1e-11] {
        let mut t = Tape::new(Arc::new(program.clone()));
        t.set_accuracy(accuracy);
        let (mut z, steps) = ([0.7, 0.1, 0.5], [1e-12, 1e-9, 1e-7, 1e-5, 1e-3]);
        t.evaluate(&z, &[0.0], 0.0, Linearisation::Exact);
        for step in steps {
            z[0] += step;
            t.evaluate(&z, &[0.0], 0.0, Linearisation::Careful);
            let exact = [3.0 * law(z[0] - z[1]), law(z[2]) / 3.0];
            for (k, value) in exact.into_iter().enumerate() {
                let bound = (accuracy + 1e-14) * value;
                assert!((t.value(k) - value).abs() <= bound, "{step} {k}");
            }
            let slope = 3.0 * (law(z[0] - z[1]) + 1e-14) / 0.025;
            assert!((gradient(&t)[0].1 - slope).abs() <= 2.0 * accuracy.sqrt() * slope);
        }
    }
}

#[test]
fn tangents_know_what_vanishes() {
    // near zero a charge and a current are as small as the voltage: so is what they may err by
    let accuracy = 1e-11;
    for count in [1, 4] {
        let (program, own) = diodes(count);
        let mut t = Tape::new(Arc::new(program));
        t.set_accuracy(accuracy);
        for decade in 0..9 {
            let v = 0.5 * 10.0f64.powi(-decade);
            for moved in [1.0, 1.0 + 1e-8, 1.0 + 1e-6, 1.0 + 1e-3] {
                t.evaluate(&[v * moved, 0.0, 0.0], &[0.0], 0.0, Linearisation::Careful);
                if t.limited() {
                    continue;
                }
                let [i, _, q, _] = diode(&own[0], v * moved);
                for (found, wanted) in [(t.value(0), i), (t.value(1), q)] {
                    let error = (found / wanted - 1.0).abs();
                    assert!(error <= accuracy, "{v} {moved}: {error}");
                }
            }
        }
    }
}

/// Diodes with charges between two unknowns, each with parameters of its own, and their formulas.
fn diodes(count: usize) -> (Program, Vec<[f64; 7]>) {
    let (mut list, mut constants, mut outputs) = (Vec::new(), Vec::new(), Vec::new());
    let mut own = Vec::new();
    for k in 0..count as i32 {
        let s = f64::from(k);
        // Is, nVt, CJ0, VJ, M, FC, transit time
        let c =
            [1e-14 * (1.0 + s), 0.02 + 1e-3 * s, 1e-12, 0.6 + 0.05 * s, 0.2 + 0.09 * s, 0.5, 1e-9];
        let (at, first) = (constants.len() as i32, list.len() as i32);
        constants.extend(c);
        constants.push(0.1);
        // every other one the other way round, some from a node that is always at 0.1 V
        let ends = [("unknown", 0), if k % 3 == 2 { ("constant", at + 7) } else { ("unknown", 1) }];
        let [a, b] = if k % 2 == 0 { ends } else { [ends[1], ends[0]] };
        let args = [
            (code(a.0), [a.1, 0, 0]),
            (code(b.0), [b.1, 0, 0]),
            (code("sub"), [first, first + 1, 0]),
            (code("junction"), [first + 2, at, 0]),
            (code("depletion"), [first + 2, at + 2, 0]),
            (code("constant"), [at + 6, 0, 0]),
            (code("mul"), [first + 5, first + 3, 0]),
            (code("add"), [first + 4, first + 6, 0]),
        ];
        list.extend(args);
        outputs.extend([first + 3, first + 7]);
        own.push(c);
    }
    let (ops, args): (Vec<u8>, Vec<[i32; 3]>) = list.into_iter().unzip();
    (Program::new(&ops, &args, &constants, &outputs, 3, 1).unwrap(), own)
}

/// Current, conductance, charge and capacitance.
fn diode(c: &[f64; 7], v: f64) -> [f64; 4] {
    let [saturation, unit, c0, vj, m, fc, transit] = *c;
    let (i, g) = (saturation * (v / unit).exp_m1(), saturation / unit * (v / unit).exp());
    let inside = v.min(fc * vj);
    let log = (-inside / vj).ln_1p();
    let here = c0 * (-m * log).exp();
    let (beyond, slope) = (v - inside, here * m / (vj * (1.0 - fc)));
    let gathered = -((1.0 - m) * log).exp_m1() / (1.0 - m);
    let q = c0 * vj * gathered + beyond * (here + 0.5 * slope * beyond);
    [i, g, q + transit * i, here + slope * beyond + transit * g]
}

#[test]
fn elements_of_one_kind_are_evaluated_together_each_with_its_own_parameters() {
    let close = |a: f64, b: f64| a == b || (a - b).abs() <= 2e-13 * b.abs();
    for count in [1, 2, 4, 7] {
        let (program, own) = diodes(count);
        let mut t = Tape::new(Arc::new(program));
        for v in [0.0, 1e-3, -1e-3, 0.25, 0.31, 0.7, -0.1, -0.4, -5.0, -1e4] {
            let (z, zero) = ([0.1 + v, 0.1, 0.0], [0.0]);
            t.evaluate(&z, &zero, 0.0, Linearisation::Exact);
            for (k, c) in own.iter().enumerate() {
                let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                let [i, g, q, capacitance] = diode(c, sign * (z[0] - z[1]));
                assert!(close(t.value(2 * k), i), "{v} {k}: {} {i}", t.value(2 * k));
                assert!(close(t.value(2 * k + 1), q), "{v} {k}: {} {q}", t.value(2 * k + 1));
                for (output, slope) in [(2 * k, g), (2 * k + 1, capacitance)] {
                    let found: Vec<_> =
                        t.derivatives(output).map(|(v, s)| (v, sign * t.slopes()[s])).collect();
                    assert!(found[0].0 == 0 && close(found[0].1, slope), "{v} {k}");
                    if k % 3 == 2 {
                        assert_eq!(found.len(), 1);
                    } else {
                        assert_eq!(found[1..], [(1, -found[0].1)]);
                    }
                }
            }
        }
    }
}

#[test]
fn an_element_without_a_finite_value_leaves_the_others_of_its_kind_alone() {
    let (program, own) = diodes(6);
    let mut t = Tape::new(Arc::new(program));
    // 20 V: infinite for the sharp ones, those that look the other way block
    t.evaluate(&[20.1, 0.1, 0.0], &[0.0], 0.0, Linearisation::Exact);
    for (k, c) in own.iter().enumerate() {
        let expected = diode(c, if k % 2 == 0 { 20.0 } else { -20.0 })[0];
        assert!(expected == t.value(2 * k) || (t.value(2 * k) / expected - 1.0).abs() < 1e-12);
        assert_eq!(t.value(2 * k).is_infinite(), k % 2 == 0 && 20.0 / c[1] > 710.0);
    }
    assert!(t.silence());
    // with care all stay finite, and all arrive
    t.set_points(&vec![0.0; t.points().len()]);
    t.point_at_knees();
    for _ in 0..20 {
        t.evaluate(&[1.0, 0.1, 0.0], &[0.0], 0.0, Linearisation::Careful);
    }
    assert!(!t.limited());
    for (k, c) in own.iter().enumerate() {
        let expected = diode(c, if k % 2 == 0 { 0.9 } else { -0.9 })[0];
        assert!((t.value(2 * k) / expected - 1.0).abs() < 1e-12);
    }
}

/// A transistor's functions on a tape: curves that constants shape, and what has kinks.
fn transistors(count: usize) -> Program {
    let (mut ops, mut args, mut outputs) = (Vec::new(), Vec::new(), Vec::new());
    let mut constants = Vec::new();
    for k in 0..count {
        let (first, at) = (ops.len() as i32, constants.len() as i32);
        let s = 1.0 + 0.1 * k as f64;
        constants.extend([0.1 * s, 2e-11, 2e-9 * s, 1.3, 0.6 * s]);
        let code = [
            ("unknown", [0, 0, 0]),
            ("unknown", [1, 0, 0]),
            ("sub", [first, first + 1, 0]),
            ("softplus", [first + 2, at, 0]),
            ("gate_drain", [first + 2, at + 1, 0]),
            ("body", [first + 2, at + 4, 0]),
            ("uramp", [first + 5, 0, 0]),
            ("max", [first + 3, first + 6, 0]),
            ("min", [first + 2, first + 7, 0]),
            ("abs", [first + 8, 0, 0]),
            ("mul", [first + 9, first + 3, 0]),
        ];
        for (name, own) in code {
            ops.push(self::code(name));
            args.push(own);
        }
        outputs.extend([first + 3, first + 4, first + 5, first + 10]);
    }
    Program::new(&ops, &args, &constants, &outputs, 2, 0).unwrap()
}

#[test]
fn shaped_curves_have_the_slopes_of_their_values() {
    let mut t = Tape::new(Arc::new(transistors(5)));
    let h = 1e-6;
    for v in [-30.0, -2.0, -0.3, -1e-3, 1e-3, 0.2, 0.4, 1.0, 1.7, 25.0] {
        let at = |t: &mut Tape, v: f64| {
            t.evaluate(&[v, 0.0], &[], 0.0, Linearisation::Exact);
            (0..20).map(|k| t.value(k)).collect::<Vec<_>>()
        };
        let (low, high, here) = (at(&mut t, v - h), at(&mut t, v + h), at(&mut t, v));
        for k in 0..20 {
            let (_, slot) = t.derivatives(k).next().unwrap();
            let (slope, size) = (t.slopes()[slot], here[k].abs().max(1e-12));
            let wanted = (high[k] - low[k]) / (2.0 * h);
            assert!((slope - wanted).abs() <= 1e-6 * (wanted.abs() + size), "{v} {k}");
        }
    }
}

use super::*;
use crate::audit::{Asked, Node, PLACES};
use crate::structure::Coordinates;

/// The sums of a system in node voltages, whose elements are not known.
fn sums_of(linear: &Linear) -> Sums {
    let coordinates = &Coordinates::of_nodes(linear.g.nrows);
    let between = Between { capacitors: &[], conductors: &[], coordinates };
    Sums::new(linear, between, None, None).unwrap_or_else(|| unreachable!())
}

/// So many capacitors of 1 F with 1 Ohm each, with current sources at the first of them.
fn capacitors(count: usize, sources: usize) -> Sums {
    let diagonal = |columns: usize| {
        let entries: Vec<_> = (0..columns).map(|k| (k, k, 1.0)).collect();
        Csc::from_triplets(count, columns, &entries)
    };
    let linear = Linear {
        e: diagonal(count),
        g: diagonal(count),
        a: Csc::zeros(count, 0),
        b: Csc::zeros(0, count),
        d: Csc::zeros(0, 0),
        q: Vec::new(),
        s: diagonal(sources),
        row_kind: vec![0; count],
    };
    sums_of(&linear)
}

/// Implicit steps of 10 ms; the first capacitor gains energy of nowhere before the step `wrong`.
fn drift(count: usize, wrong: Option<usize>, conductance: f64) -> Balance {
    let mut sums = capacitors(count, 0);
    let none = &[][..];
    let mut z = vec![1.0; count];
    for step in 0..100 {
        if wrong == Some(step) {
            z[0] *= 1.0 + 1e-6;
        }
        let next: Vec<f64> = z.iter().map(|z| z / (1.0 + 0.01 * conductance)).collect();
        sums.step(0.01, [&z, &next], none, [none, none], [none, none], false);
        z = next;
    }
    sums.balance(&z)
}

#[test]
fn energy_from_nowhere_is_noticed_in_any_step() {
    for count in [1, 200] {
        let right = drift(count, None, 1.0);
        assert!(right.drift < 1e-14, "{right:?}");
        // 1 J / 2 per capacitor, of which (1 + h)^-200 is left
        let stored = 0.5 * count as f64 * (1.01f64.powi(-200) - 1.0);
        assert!((right.stored - stored).abs() < 1e-12 * count as f64);
        assert!((right.dissipated + right.scheme + stored).abs() < 1e-12 * count as f64);
        assert_eq!(right.steps, 100);
        // of all that one capacitor of 200 held
        for step in [1, 17, 60] {
            assert!(drift(count, Some(step), 1.0).drift > 1e-7 / (count as f64 * 3.0));
        }
        assert!(drift(count, None, 1.0 + 1e-6).drift > TOLERANCE);
    }
}

/// A discharge in motions of which the heat is known, with a jump in the middle.
fn by_motions(wrong: Option<usize>, reported: bool) -> Balance {
    let mut sums = capacitors(1, 0);
    let mut z = 1.0f64;
    sums.start(&[z]);
    for k in 0..100 {
        if wrong == Some(k) {
            z *= 1.0 + 1e-6;
        }
        if k == 50 {
            if reported {
                sums.jump(&[z], &[0.5 * z], Some(&[0.5 * z]));
            }
            z *= 0.5;
        }
        let next = z * (-0.01f64).exp();
        sums.motion(0.01, [0.5 * (z * z - next * next), 0.0]);
        z = next;
    }
    sums.balance(&[z])
}

#[test]
fn states_that_change_between_motions_are_noticed() {
    let right = by_motions(None, true);
    assert!(right.drift < 1e-14, "{right:?}");
    assert_eq!(right.steps, 100);
    for k in [1, 17, 60] {
        assert!(by_motions(Some(k), true).drift > TOLERANCE);
    }
    assert!(by_motions(None, false).drift > 0.1);
}

#[test]
fn states_that_change_between_steps_are_jumps_or_wrong() {
    // 200 capacitors are discharged; one of them loses a part of its voltage after a step
    let unreported = |part: f64, told: Option<f64>| {
        let mut sums = capacitors(200, 0);
        let (mut z, none) = (vec![1.0; 200], &[][..]);
        for step in 0..20 {
            let next: Vec<f64> = z.iter().map(|z| z / 1.01).collect();
            sums.step(0.01, [&z, &next], none, [none, none], [none, none], false);
            z = next;
            if step == 10 {
                let before = z.clone();
                z[7] *= 1.0 - part;
                if let Some(share) = told {
                    let mut after = before.clone();
                    after[7] *= 1.0 - share * part;
                    sums.jump(&before, &z, Some(&after));
                }
            }
        }
        sums.balance(&z).unreported
    };
    assert_eq!(unreported(0.0, None), 0.0);
    // next to the energy of all
    let missing = |part: f64| part * 1.01f64.powi(-11) / 200.0f64.sqrt();
    for part in [1.0, 0.5, 1e-6] {
        assert!((unreported(part, None) / missing(part) - 1.0).abs() < 1e-6);
        assert_eq!(unreported(part, Some(1.0)), 0.0);
        // what is reported leads elsewhere
        assert!((unreported(part, Some(0.5)) / missing(0.5 * part) - 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_step_beyond_all_bounds_is_no_measure() {
    // 1 F with 1 Ohm next to a source; in one step the source drives a voltage through the resistor,
    // and a thousandth of the state is lost right after it
    let drift = |beyond: f64, lost: f64| {
        let mut sums = capacitors(1, 1);
        let mut z = 1.0;
        for step in 0..50 {
            let (next, state_jump) = (z / 1.01, if step == 25 { beyond } else { 0.0 });
            let all = Points {
                length: 0.01,
                weight: &[1e-3, 1.0],
                taken: &[0.0, 0.0, 0.0, 1.0],
                z: &[&[state_jump], &[next]],
                rate: &[&[0.0], &[(next - z) / 0.01]],
                l: &[],
                u: &[&[state_jump], &[0.0]],
                f: &[],
                f_rate: &[],
            };
            sums.points(&[z], &all);
            z = if step == 25 { next * (1.0 - lost) } else { next };
        }
        sums.balance(&[z]).drift
    };
    for beyond in [0.0, 1.0, 1e3, 1e6, 1e12, 1e60] {
        assert!(drift(beyond, 1e-3) > 10.0 * TOLERANCE, "{beyond}");
    }
    // what it turned over is rounded: 1e-16 of 2e7 J
    for beyond in [0.0, 1.0, 1e3, 1e6] {
        assert!(drift(beyond, 0.0) < TOLERANCE, "{beyond}");
    }
}

/// Error of a step of 0.1 s of a discharge, of which a thousandth of the range was asked, and whose end is `wrong`.
fn error_of_a_step(wrong: f64) -> f64 {
    let mut sums = capacitors(1, 0);
    sums.start(&[1.0]);
    let mut z = PLACES.map(|place| [(-0.1 * place).exp()]);
    z[2][0] *= 1.0 + wrong;
    let nodes = [0, 1, 2].map(|k| Node { z: &z[k], l: &[], u: &[] });
    let asked = Asked { relative: 1e-3, least: [0.0; 2] };
    sums.recorded(&ErringStep { asked, length: 0.1, first: &[1.0], nodes });
    sums.balance(&z[2]).step_error
}

#[test]
fn the_error_of_a_step_is_what_its_currents_do_not_bring() {
    // next to the error of the quadrature up to its inner nodes, which goes with h^4
    assert!(error_of_a_step(0.0) < 2e-3);
    // the charge itself, and the ninth of the step that its current has in the quadrature, of the range of the charge:
    // of what is missing 1 F / (1 F + 0.1 s / 1 Ohm) is left
    let end = f64::exp(-0.1);
    for wrong in [1e-4, 1e-2, -1e-2] {
        let missed = f64::abs(wrong) * end * (1.0 + 0.1 / 9.0);
        let last = end * (1.0 + wrong);
        let expected = missed / 1.1 / (1e-3 * (1.0 - last));
        let found = error_of_a_step(wrong);
        assert!((found - expected).abs() < 1e-4 * expected, "{found} {expected}");
    }
    assert!(error_of_a_step(f64::NAN).is_nan());
}

//! Rows by hand: 5 V across a diode or a switch and 10 Ohm, columns `v(in)`, `v(out)`, `i(in)`, `i(d)`.

use super::*;
use crate::audit::{worse, Described, TOLERANCE};

const UNITS: [Unit; 4] = [Unit::Volts, Unit::Volts, Unit::Amperes, Unit::Amperes];

/// The worst errors of sums, valves, gates and sources of some rows.
fn errors(table: &[[f64; 5]], fill: impl Fn(&mut Rows)) -> [f64; 4] {
    let mut rows = Rows::new(UNITS.to_vec(), 1e-13, 0.0);
    fill(&mut rows);
    rows.take(table.as_flattened());
    let worst =
        |most: f64, found: &Worst| if worse(found.error, most) { found.error } else { most };
    rows.worst().map(|list| list.iter().fold(0.0, worst))
}

/// `v(in) - v(out) - 10 i(d)` and Kirchhoff's current law.
fn sums(rows: &mut Rows) {
    rows.sums.push(Sum::new(vec![(1, 1.0), (2, -1.0), (4, -10.0)], 0.0, Unit::Volts));
    rows.sums.push(Sum::new(vec![(3, 1.0), (4, 1.0)], 0.0, Unit::Amperes));
}

/// An ideal diode from `out` to ground: no voltage, or no current.
fn diode(rows: &mut Rows) {
    let on = Line {
        law: ([1.0, 0.0, 0.0], Unit::Volts),
        bounds: vec![([0.0, 1.0, 0.0], Unit::Amperes)],
    };
    let off = Line {
        law: ([0.0, 1.0, 0.0], Unit::Amperes),
        bounds: vec![([-1.0, 0.0, 0.0], Unit::Volts)],
    };
    rows.valves.push(Valve::new(vec![(2, 1.0)], vec![(4, 1.0)], vec![on, off], [0.0; 2]));
}

const ON: [f64; 5] = [0.0, 5.0, 0.0, -0.5, 0.5];
const OFF: [f64; 5] = [1.0, -5.0, -5.0, 0.0, 0.0];

#[test]
fn sums_vanish_to_rounding() {
    let [right, ..] = errors(&[ON, OFF], sums);
    assert_eq!(right, 0.0);
    let rounded = [0.0, 5.0, 0.0, -0.5, 0.5 * (1.0 + 1e-15)];
    assert_eq!(errors(&[rounded, OFF], sums)[0], 0.0);
    for off in [1e-6, -1e-3] {
        let wrong = [0.0, 5.0, 0.0, -0.5, 0.5 + off];
        assert!(errors(&[ON, wrong, OFF], sums)[0] > TOLERANCE);
    }
    assert!(errors(&[[0.0, f64::NAN, 0.0, -0.5, 0.5]], sums)[0].is_nan());
}

#[test]
fn a_diode_conducts_forward_and_blocks_backward() {
    assert_eq!(errors(&[ON, OFF], diode)[1], 0.0);
    for wrong in [[2.0, 5.0, 5.0, 0.0, 0.0], [2.0, -5.0, 0.0, 0.5, -0.5], [2.0, 5.0, 1.0, 0.0, 0.4]]
    {
        assert!(errors(&[ON, wrong, OFF], diode)[1] > 0.1);
    }
    // 9 uA backward next to half an ampere; a row that is small is judged by the largest
    assert!(errors(&[ON, [2.0, -5.0, 0.0, 9e-6, -9e-6]], diode)[1] > 1e-5);
    assert_eq!(errors(&[[0.0, 5.0, 1e-14, 0.0, 1e-15], ON, OFF], diode)[1], 0.0);
}

#[test]
fn a_switch_obeys_its_control() {
    // closed above 3 V, open below 1 V of `v(in)`
    let switch = |inverted: bool| {
        move |rows: &mut Rows| {
            let closed = Line { law: ([1.0, 0.0, 0.0], Unit::Volts), bounds: vec![] };
            let open = Line { law: ([0.0, 1.0, 0.0], Unit::Amperes), bounds: vec![] };
            rows.valves.push(Valve::new(
                vec![(2, 1.0)],
                vec![(4, 1.0)],
                vec![closed, open],
                [0.0; 2],
            ));
            rows.gates.push(Gate::new(0, (vec![(1, 1.0)], Unit::Volts), [3.0, 1.0], inverted));
        }
    };
    let between = [2.0, 2.0, 2.0, 0.0, 0.0];
    assert_eq!(errors(&[ON, between, OFF], switch(false))[2], 0.0);
    let late = [2.0, 3.5, 3.5, 0.0, 0.0];
    assert!(errors(&[ON, late, OFF], switch(false))[2] > TOLERANCE);
    assert!(errors(&[ON, OFF], switch(true))[2] > TOLERANCE);
    // at one instant either state is right
    let same = [0.0, 5.0, 5.0, 0.0, 0.0];
    assert_eq!(errors(&[ON, same, OFF], switch(false))[2], 0.0);
}

#[test]
fn sources_follow_their_waveforms() {
    let sine = |rows: &mut Rows| {
        let values = [0.0, 5.0, 0.25, 0.0, 0.0, 0.0];
        let waveform = Described::new("sin", &values, f64::NAN, 1.0).unwrap();
        rows.sources.push(Source::new(vec![(1, 1.0)], vec![waveform], Unit::Volts));
    };
    let at = |time: f64, volts: f64| [time, volts, 0.0, 0.0, 0.0];
    let half = 5.0 * std::f64::consts::FRAC_1_SQRT_2;
    assert!(errors(&[at(0.0, 0.0), at(0.5, half), at(1.0, 5.0)], sine)[3] < 1e-15);
    // of rows that are close together one of many is looked at
    let late: Vec<_> = (0..40).map(|k| at(0.6 + 1e-4 * f64::from(k), half)).collect();
    assert!(errors(&late, sine)[3] > 1e-2);
}

//! What the inner parts of a run cost: steps, the equations of a network in its structure, an instant.

use _core::descriptor::Linear;
use _core::descriptor::Smooth;
use _core::instant::{Before, Reinitialiser};
use _core::integrate::{Accuracy, Outputs, Part, Progress, Sdirk, Stepper, System, Tableau};
use _core::mlcp::Role;
use _core::sparse::Csc;
use _core::structure::{Coordinates, Law, Network};
use _core::tape::{Program, Tape, NAMES};
use _core::waveform::Waveform;
use criterion::{criterion_group, criterion_main, Criterion};
use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Sections of the stage_equations: with the node of the source and its current 15 unknowns.
const SECTIONS: usize = 6;

/// A capacitor or resistor between two nodes, -1 for ground.
type Between = (isize, isize, f64);

/// A source, then sections of 1 Ohm, 1 uH and 1 uF, of the last node 10 Ohm to ground; a diode from the first
/// capacitor to ground if asked for.
fn stage_equations(diode: bool) -> (Linear, Vec<Between>, Vec<Between>) {
    let (nodes, n) = (1 + SECTIONS, 2 + 2 * SECTIONS);
    let branch = |k: usize| nodes + k; // of the source, then of the sections
    let (mut e, mut g) = (Vec::new(), Vec::new());
    g.extend([(0, branch(0), 1.0), (branch(0), 0, -1.0)]);
    for k in 1..=SECTIONS {
        let row = branch(k);
        e.extend([(row, row, 1e-6), (k, k, 1e-6)]);
        g.extend([(k - 1, row, 1.0), (row, k - 1, -1.0), (k, row, -1.0), (row, k, 1.0)]);
    }
    g.push((SECTIONS, SECTIONS, 0.1));
    let pairs = usize::from(diode);
    let a = Csc::from_triplets(n, pairs, &[(1, 0, -1.0)][..pairs]);
    let linear = Linear {
        e: Csc::from_triplets(n, n, &e),
        g: Csc::from_triplets(n, n, &g),
        b: a.transpose(),
        a,
        d: Csc::from_triplets(pairs, pairs, &[]),
        q: vec![0.0; pairs],
        s: Csc::from_triplets(n, 1, &[(branch(0), 0, -1.0)]),
        row_kind: (0..n).map(|j| u8::from(j >= nodes)).collect(),
    };
    let capacitors = (1..=SECTIONS).map(|k| (k as isize, -1, 1e-6)).collect();
    (linear, capacitors, vec![(SECTIONS as isize, -1, 0.1)])
}

/// Junctions from the first and the third capacitor to ground.
fn junctions(n: usize) -> Smooth {
    let code = |name: &str| NAMES.iter().position(|known| *known == name).unwrap_or(0) as u8;
    let (unknown, junction) = (code("unknown"), code("junction"));
    let ops = [unknown, unknown, junction, junction];
    let words = [[1, 0, 0], [3, 0, 0], [0, 0, 0], [1, 0, 0]];
    let program = Program::new(&ops, &words, &[1e-12, 0.026], &[2, 3], n, 1);
    let tape = Tape::new(Arc::new(program.expect("a right program")));
    Smooth {
        tape,
        f: Csc::from_triplets(n, 2, &[(1, 0, 1.0), (3, 1, 1.0)]),
        q: Csc::from_triplets(n, 2, &[]),
    }
}

/// A run of the stage_equations behind a sine of 20 kHz: how long it took, and its steps.
fn run(smooth: bool) -> (Duration, u64) {
    let (linear, ..) = stage_equations(false);
    let (n, m, p) = linear.sizes();
    let smooth = smooth.then(|| junctions(n));
    let functions = smooth.as_ref().map_or(0, |_| 2);
    let none = |columns| Csc::from_triplets(n, columns, &[]);
    let sine = Waveform::new("sin", &[0.0, 1.0, 2e4, 0.0, 0.0, 0.0], f64::NAN, 1.0);
    let outputs = vec![vec![(Part::Unknown, SECTIONS, 1.0)]];
    let outputs = Outputs::new(&outputs, [n, m, n, p, functions, functions]);
    let system = System::new(linear, none(n), none(p), smooth, false);
    let sine = vec![sine.expect("a right waveform")];
    let mut stepper = Stepper::new(system, sine, Arc::new([]), Vec::new(), outputs);
    stepper.start_dc(0.0, None).unwrap_or_else(|_| panic!("no operating point"));
    let accuracy = Accuracy { relative: 1e-5, voltage: 0.0, current: 0.0, energy: false };
    let tableau = Tableau::of_order(4).expect("order 4");
    let mut sdirk = Sdirk::new(&mut stepper, tableau, accuracy, 1e-3, 1e-4, (0.0, 1e-3));
    let mut rows = vec![0.0; 16 * stepper.recorder.columns()];
    let begin = Instant::now();
    while matches!(sdirk.advance(&mut stepper, &mut rows, Duration::MAX).1, Progress::More) {}
    (begin.elapsed(), stepper.statistics().steps)
}

/// The time of so many units of a run, of which a run has `count`.
fn per_unit(times: u64, run: impl Fn() -> (Duration, u64)) -> Duration {
    let (mut spent, mut units) = (0.0, 0);
    while units < times {
        let (time, count) = run();
        spent += time.as_secs_f64();
        units += count;
    }
    Duration::from_secs_f64(spent * times as f64 / units as f64)
}

fn steps(c: &mut Criterion) {
    for (name, smooth) in [("sdirk step, linear", false), ("sdirk step, two junctions", true)] {
        c.bench_function(name, |b| b.iter_custom(|times| per_unit(times, || run(smooth))));
    }
}

fn structure(c: &mut Criterion) {
    let mut network = Network::new(1 + SECTIONS);
    for k in 0..SECTIONS {
        let (next, ground) = ((k + 1) % SECTIONS, SECTIONS);
        for (ends, weight) in [([k, next], 1e3), ([k, ground], 1e-6)] {
            network.ends.push(ends);
            network.laws.push(Law::Weighted { weight, offset: 1.0 });
        }
    }
    c.bench_function("structural basis and hybrid solve", |b| {
        b.iter(|| black_box(network.hybrid().solve()))
    });
    let (linear, capacitors, resistors) = stage_equations(true);
    let nodes = Coordinates::of_nodes(linear.g.nrows);
    let known = Reinitialiser::new(&linear, &capacitors, &resistors, &nodes);
    let known = known.expect("a plain network");
    let before = vec![0.1; linear.g.nrows];
    c.bench_function("mixed LCP of an instant", |b| {
        b.iter(|| {
            black_box(known.after(Before::State(&before), [&[1.0], &[0.0]], &[Role::Diode], 0.0))
        })
    });
}

criterion_group!(hot_paths, steps, structure);
criterion_main!(hot_paths);

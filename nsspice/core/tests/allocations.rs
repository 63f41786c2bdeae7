//! Steps allocate nothing: a run of twice the length asks for no more memory.

use _core::descriptor::Linear;
use _core::integrate::{Accuracy, Outputs, Part, Progress, Sdirk, Stepper, System, Tableau};
use _core::sparse::Csc;
use _core::structure::Coordinates;
use _core::waveform::Waveform;
use std::alloc::{GlobalAlloc, Layout, System as Heap};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::Arc;
use std::time::Duration;

struct Counting;

static ASKED: AtomicU64 = AtomicU64::new(0);

// SAFETY: all is handed over to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ASKED.fetch_add(1, Relaxed);
        Heap.alloc(layout)
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        Heap.dealloc(at, layout);
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

const NODES: usize = 6;

/// An element between two nodes, -1 for ground.
type Edge = (isize, isize, f64);

/// A chain of nodes, 1 uF from each to ground and 1 Ohm between neighbours, behind a current source, in the voltages
/// between neighbours; if asked for, a diode floats next to it: 1 pF from its one end to that of the chain, and
/// nothing else.
fn chain(floating: bool) -> (Linear, Vec<Edge>, Vec<Edge>, Coordinates) {
    let n = NODES + usize::from(floating);
    let capacitors: Vec<Edge> = (0..NODES).map(|k| (k as isize, -1, 1e-6)).collect();
    let resistors: Vec<Edge> = (1..NODES).map(|k| (k as isize, k as isize - 1, 1.0)).collect();
    let before: Vec<isize> = (0..n).map(|k| k as isize - 1).collect();
    let tree = Coordinates::new(before).expect("a tree");
    let sum = |edges: &[Edge]| {
        let mut entries = Vec::new();
        for (edge, row) in edges.iter().zip(tree.rows(edges)) {
            for &(r, one) in &row {
                entries.extend(row.iter().map(|&(c, two)| (r, c, one * two * edge.2)));
            }
        }
        Csc::from_triplets(n, n, &entries)
    };
    // from the last node of the chain to one that nothing else joins: it carries nothing, and its voltage is open
    let pairs = usize::from(floating);
    let across: Vec<_> = (0..pairs).map(|k| (NODES, k, -1.0)).collect();
    let a = Csc::from_triplets(n, pairs, &across);
    let linear = Linear {
        e: sum(&capacitors),
        g: sum(&resistors),
        b: a.transpose(),
        a,
        d: Csc::zeros(pairs, pairs),
        q: vec![0.0; pairs],
        s: Csc::from_triplets(n, 1, &[(0, 0, 1.0)]),
        row_kind: vec![0; n],
    };
    (linear, capacitors, resistors, tree)
}

/// Requests for memory, and steps, of a run of this length [s].
fn run(floating: bool, stop: f64) -> (u64, u64) {
    let (linear, capacitors, resistors, tree) = chain(floating);
    let (n, m, p) = linear.sizes();
    let none = |columns| Csc::from_triplets(n, columns, &[]);
    let sine = Waveform::new("sin", &[0.0, 1.0, 2e4, 0.0, 0.0, 0.0], f64::NAN, 1.0);
    let outputs = Outputs::new(&[vec![(Part::Unknown, 0, 1.0)]], [n, m, n, p, 0, 0]);
    let system = System::new(linear, none(n), none(p), None, false);
    let sine = vec![sine.expect("a right waveform")];
    let mut stepper = Stepper::new(system, sine, Arc::new([]), Vec::new(), outputs);
    stepper.know_elements(&capacitors, &resistors, &tree);
    stepper.start_dc(0.0, None).unwrap_or_else(|_| panic!("no operating point"));
    let accuracy = Accuracy { relative: 1e-5, voltage: 0.0, current: 0.0, energy: false };
    let tableau = Tableau::of_order(4).expect("order 4");
    let mut sdirk = Sdirk::new(&mut stepper, tableau, accuracy, stop, 1e-4, (0.0, stop));
    let mut rows = vec![0.0; 16 * stepper.recorder.columns()];
    let before = ASKED.load(Relaxed);
    while matches!(sdirk.advance(&mut stepper, &mut rows, Duration::MAX).1, Progress::More) {}
    (ASKED.load(Relaxed) - before, stepper.statistics().steps)
}

#[test]
fn steps_in_voltages_of_a_tree_allocate_nothing() {
    for floating in [false, true] {
        let [(asked, steps), (more, twice)] = [2e-3, 4e-3].map(|stop| run(floating, stop));
        assert!(twice > steps + 50, "{steps} {twice}");
        // the end of a run falls on levels of its own
        assert!(more < asked + 16, "{} more in {} steps", more - asked, twice - steps);
    }
}

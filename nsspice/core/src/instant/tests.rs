//! Instants of small networks compared with results by hand.

use super::{Before, Consistent, Reinitialiser};
use crate::descriptor::Linear;
use crate::mlcp::Role;
use crate::sparse::Csc;

/// A network in the making: nodes first, then branches; ends of `None` are ground.
#[derive(Default)]
struct Build {
    kinds: Vec<u8>,
    e: Vec<(usize, usize, f64)>,
    g: Vec<(usize, usize, f64)>,
    a: Vec<(usize, usize, f64)>,
    s: Vec<(usize, usize, f64)>,
    offsets: Vec<f64>,
    capacitors: Vec<(isize, isize, f64)>,
    resistors: Vec<(isize, isize, f64)>,
    u: Vec<f64>,
}

type End = Option<usize>;

impl Build {
    fn new(nodes: usize) -> Build {
        Build { kinds: vec![0; nodes], ..Build::default() }
    }

    fn between(
        entries: &mut Vec<(usize, usize, f64)>,
        ends: [End; 2],
        value: f64,
    ) -> (isize, isize, f64) {
        for (k, a) in ends.iter().enumerate() {
            for (l, b) in ends.iter().enumerate() {
                if let (Some(a), Some(b)) = (a, b) {
                    entries.push((*a, *b, if k == l { value } else { -value }));
                }
            }
        }
        let [a, b] = ends.map(|end| end.map_or(-1, |node| node as isize));
        (a, b, value)
    }

    fn capacitor(mut self, a: End, b: End, value: f64) -> Build {
        let one = Build::between(&mut self.e, [a, b], value);
        self.capacitors.push(one);
        self
    }

    fn resistor(mut self, a: End, b: End, ohms: f64) -> Build {
        let one = Build::between(&mut self.g, [a, b], 1.0 / ohms);
        self.resistors.push(one);
        self
    }

    fn branch(&mut self, ends: [End; 2]) -> usize {
        let row = self.kinds.len();
        self.kinds.push(1);
        for (end, sign) in ends.into_iter().zip([1.0, -1.0]) {
            if let Some(node) = end {
                self.g.extend([(node, row, sign), (row, node, -sign)]);
            }
        }
        row
    }

    fn inductor(mut self, a: End, b: End, value: f64) -> Build {
        let row = self.branch([a, b]);
        self.e.push((row, row, value));
        self
    }

    fn voltage(mut self, a: End, b: End, volts: f64) -> Build {
        let row = self.branch([a, b]);
        self.s.push((row, self.u.len(), -1.0));
        self.u.push(volts);
        self
    }

    /// A current into a node.
    fn current(mut self, node: usize, amperes: f64) -> Build {
        self.s.push((node, self.u.len(), 1.0));
        self.u.push(amperes);
        self
    }

    fn diode(mut self, a: End, b: End) -> Build {
        let pair = self.offsets.len();
        for (end, sign) in [a, b].into_iter().zip([1.0, -1.0]) {
            self.a.extend(end.map(|node| (node, pair, sign)));
        }
        self.offsets.push(0.0);
        self
    }

    /// What is known of the network.
    fn prepared(&self) -> Reinitialiser {
        let (n, m) = (self.kinds.len(), self.offsets.len());
        let a = Csc::from_triplets(n, m, &self.a);
        let linear = Linear {
            e: Csc::from_triplets(n, n, &self.e),
            g: Csc::from_triplets(n, n, &self.g),
            b: a.transpose(),
            a,
            d: Csc::from_triplets(m, m, &[]),
            q: self.offsets.clone(),
            s: Csc::from_triplets(n, self.u.len(), &self.s),
            row_kind: self.kinds.clone(),
        };
        let coordinates = crate::structure::Coordinates::of_nodes(n);
        Reinitialiser::new(&linear, &self.capacitors, &self.resistors, &coordinates).unwrap()
    }

    /// The state right after an instant with these unknowns before it.
    fn after(self, before: &[f64]) -> Option<Consistent> {
        assert_eq!(before.len(), self.kinds.len());
        let (slopes, roles) = (vec![0.0; self.u.len()], vec![Role::Diode; self.offsets.len()]);
        self.prepared().after(Before::State(before), [&self.u, &slopes], &roles, 0.0)
    }
}

fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-13 * expected.abs().max(1e-3), "{found} {expected}");
}

#[test]
fn inductors_in_series_share_their_flux() {
    // 2 H with 3 A and 1 H without current: (6 + 0) / 3 H
    let build = Build::new(1).inductor(None, Some(0), 2.0).inductor(Some(0), None, 1.0);
    let found = build.after(&[0.0, 3.0, 0.0]).unwrap();
    near(found.z[1], 2.0);
    near(found.z[2], 2.0);
    // 2 H (2 - 3) A = -(impulse)
    near(found.impulses[0][0], 2.0);
}

#[test]
fn a_diode_ends_the_current_against_it() {
    let build = || Build::new(2).voltage(Some(0), None, 5.0).inductor(Some(0), Some(1), 1e-3);
    // node, node, source, inductor
    let found = build().diode(None, Some(1)).after(&[5.0, 0.0, 0.0, 2.0]).unwrap();
    near(found.z[3], 0.0);
    // 5 V would drive a current against it: it blocks, and the inductor has no voltage
    near(found.z[1], 5.0);
    assert!(!found.active[0] && !found.through[0]);
    near(found.impulses[0][1], 2e-3);
    let found = build().diode(Some(1), None).after(&[5.0, 0.0, 0.0, 2.0]).unwrap();
    near(found.z[3], 2.0);
    near(found.l[0], 2.0);
    near(found.z[2], -2.0);
    near(found.rates[3], 5e3);
    assert!(found.active[0]);
}

#[test]
fn a_current_from_rest_begins_by_its_rate() {
    // a diode that carries nothing yet: 5 V across 1 mH opens its way
    let build = Build::new(2).voltage(Some(0), None, 5.0).inductor(Some(0), Some(1), 1e-3);
    let found = build.diode(Some(1), None).after(&[5.0, 5.0, 0.0, 0.0]).unwrap();
    near(found.z[1], 0.0);
    near(found.rates[3], 5e3);
    assert!(found.active[0]);
}

#[test]
fn charges_pass_nodes_that_store_nothing() {
    // 3 V on 1 F, two diodes in a row, 2 F
    let build = Build::new(3).capacitor(Some(0), None, 1.0).capacitor(Some(2), None, 2.0);
    let found = build.diode(Some(0), Some(1)).diode(Some(1), Some(2)).after(&[3.0, 0.0, 0.0]);
    let found = found.unwrap();
    (0..3).for_each(|node| near(found.z[node], 1.0));
    near(found.impulses[1][0], 2.0);
    near(found.impulses[1][1], 2.0);
    assert_eq!(found.through, [true, true]);
}

#[test]
fn a_node_that_stores_nothing_closes_no_diode_in_the_jump() {
    // 1 F at -1 V that a resistor discharges further; its diode comes from a node that another holds at -5 V
    let build = Build::new(3).capacitor(Some(1), None, 1.0).voltage(Some(2), None, -5.0);
    let build = build.resistor(Some(0), Some(2), 1.0).resistor(Some(1), Some(2), 1.0);
    let found = build.diode(Some(0), Some(1)).after(&[0.0, -1.0, -5.0, 0.0]).unwrap();
    near(found.z[0], -5.0);
    near(found.rates[1], -4.0);
    assert_eq!((found.impulses[1][0], found.active[0], found.through[0]), (0.0, false, false));
}

#[test]
fn currents_pass_islands_of_diodes() {
    // 1 A into a node that only diodes leave: through the one towards the lower potential
    let build = Build::new(3).capacitor(Some(1), None, 1.0).capacitor(Some(2), None, 1.0);
    let build = build.current(0, 1.0).diode(Some(0), Some(1)).diode(Some(0), Some(2));
    let found = build.after(&[0.0, 4.0, -1.0]).unwrap();
    near(found.z[0], -1.0);
    assert_eq!(found.active, [false, true]);
    near(found.rates[2], 1.0);
    near(found.rates[1], 0.0);
}

#[test]
fn ideal_pairs_side_by_side_share_their_current() {
    // 1 A through two diodes, in parallel with one with 1 Ohm in series
    let build = Build::new(2).current(0, 1.0).diode(Some(0), None).diode(Some(0), Some(1));
    let found = build.diode(Some(0), None).resistor(Some(1), None, 1.0).after(&[0.0, 0.0]);
    let found = found.unwrap();
    [0.5, 0.0, 0.5].iter().zip(&found.l).for_each(|(e, f)| near(*f, *e));
    assert!(found.active[0] && found.active[2]);
}

#[test]
fn a_current_without_a_way_is_refused() {
    let build = Build::new(2).resistor(Some(1), None, 1.0).current(0, -1.0);
    assert!(build.diode(Some(0), Some(1)).after(&[0.0, 0.0]).is_none());
}

/// A transformer between nodes 0 and 1, each with a capacitor of 1 F to ground, of `turns` and coupling `k`.
fn transformer(turns: f64, k: f64) -> Build {
    let mut build = Build::new(2).capacitor(Some(0), None, 1.0).capacitor(Some(1), None, 1.0);
    let [a, b] = [0, 1].map(|node| build.branch([Some(node), None]));
    let mutual = k * turns;
    build.e.extend([(a, a, 1.0), (b, b, turns * turns), (a, b, mutual), (b, a, mutual)]);
    build
}

#[test]
fn a_closed_switch_makes_a_loop_through_windings_without_leakage() {
    // a capacitor at each winding: the ratio of their voltages is fixed twice
    assert!(transformer(2.0, 1.0).prepared().loops_through_windings(&[]));
    assert!(!transformer(2.0, 0.5).prepared().loops_through_windings(&[]));
    // the second capacitor is behind a switch
    let looped = |k: f64, closed: bool| {
        let mut build = Build::new(3).capacitor(Some(0), None, 1.0).capacitor(Some(2), None, 1.0);
        let [a, b] = [0, 1].map(|node| build.branch([Some(node), None]));
        build.e.extend([(a, a, 1.0), (b, b, 4.0), (a, b, 2.0 * k), (b, a, 2.0 * k)]);
        build.diode(Some(1), Some(2)).prepared().loops_through_windings(&[closed])
    };
    assert!(looped(1.0, true));
    assert!(!looped(1.0, false) && !looped(0.5, true));
    // a resistor in its place takes up the difference
    let mut build = Build::new(3).capacitor(Some(0), None, 1.0).capacitor(Some(2), None, 1.0);
    let [a, b] = [0, 1].map(|node| build.branch([Some(node), None]));
    build.e.extend([(a, a, 1.0), (b, b, 4.0), (a, b, 2.0), (b, a, 2.0)]);
    let build = build.resistor(Some(1), Some(2), 1.0);
    assert!(!build.prepared().loops_through_windings(&[]));
}

#[test]
fn windings_without_leakage_let_charges_pass() {
    // 3 V and 0 V become 0.6 V and 1.2 V: (3 + 2 * 0) / (1 + 2^2)
    let found = transformer(2.0, 1.0).after(&[3.0, 0.0, 0.5, 0.25]).unwrap();
    near(found.z[0], 0.6);
    near(found.z[1], 1.2);
    // 0.5 A and 0.25 A magnetise as 1 A: both charges discharge through the one core
    near(found.z[2] + 2.0 * found.z[3], 1.0);
    near(found.rates[1], 2.0 * found.rates[0]);
    near(found.rates[0] + 2.0 * found.rates[1], -1.0);
}

#[test]
fn windings_with_leakage_keep_their_currents() {
    let found = transformer(2.0, 0.5).after(&[3.0, 0.0, 0.5, 0.25]).unwrap();
    [3.0, 0.0, 0.5, 0.25].iter().zip(&found.z).for_each(|(e, f)| near(*f, *e));
    // L = [[1, 1], [1, 4]]: its inverse times (3 V, 0 V)
    near(found.rates[2], 4.0);
    near(found.rates[3], -1.0);
}

#[test]
fn fluxes_of_windings_jump_as_those_of_inductors() {
    // the primary (1 H, 2 A) ends at a node of nothing: its current must end, and drives the secondary (4 H, k = 1)
    let mut build = Build::new(1).resistor(Some(0), None, 1.0);
    let [a, b] = [None, Some(0)].map(|node| build.branch([node, None]));
    build.e.extend([(a, a, 1.0), (b, b, 4.0), (a, b, 2.0), (b, a, 2.0)]);
    build.kinds.push(0);
    let open = build.kinds.len() - 1;
    build.g.extend([(open, a, 1.0), (a, open, -1.0)]);
    let found = build.after(&[0.0, 2.0, 0.0, 0.0]).unwrap();
    near(found.z[1], 0.0);
    // 2 A turns / 2
    near(found.z[2], 1.0);
    near(found.z[0], -1.0);
    near(found.z[open], -0.5);
}

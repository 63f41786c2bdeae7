use super::Floating;
use crate::sparse::Csc;

/// A capacitor between nodes 0 and 1; sources with the currents 4 and 5, from node 1 to node 2 and
/// from there to `far` or to ground.
fn example(far: Option<usize>) -> Floating {
    let e = [(0, 0, 1.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)];
    let mut g = vec![(1, 4, 1.0), (2, 4, -1.0), (2, 5, 1.0), (0, 0, 0.1), (0, 3, -0.1)];
    g.extend(far.map(|node| (node, 5, -1.0)));
    let matrix = |list: &[_]| Csc::from_triplets(6, 6, list);
    Floating::new(&matrix(&e), &matrix(&g), &[0, 0, 0, 0, 1, 1])
}

#[test]
fn a_group_reaches_across_sources() {
    let floating = example(Some(3));
    let mut rhs = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
    floating.sum_up(&mut rhs, &mut [0.0; 8]);
    assert_eq!(rhs, [15.0, 2.0, 4.0, 8.0, 16.0, 32.0]);
    assert!(floating.is_sum(0) && !floating.is_sum(1));
    let sums = [(0, 4), (0, 5)].map(|place| {
        let g = Csc::from_triplets(6, 6, &[(1, 4, 1.0), (2, 4, -1.0), (2, 5, 1.0), (3, 5, -1.0)]);
        let at = |e: &&(usize, usize, f64)| (e.0, e.1) == place;
        floating.with_sums(&g).iter().filter(at).map(|e| e.2).sum::<f64>()
    });
    assert_eq!(sums, [0.0; 2]);
}

#[test]
fn a_source_to_ground_makes_up_for_the_sum() {
    assert!(!example(None).is_sum(0));
}

#[test]
fn a_star_of_windings_is_a_cut_set() {
    // windings 4, 5 and 6 from ground to nodes 0, 1 and 2; resistors from there to node 3
    let mut g = vec![(3, 3, 3.0)];
    for k in 0..3 {
        g.extend([(k, k, 1.0), (k, 3, -1.0), (3, k, -1.0)]);
        g.extend([(k, 4 + k, -1.0), (4 + k, k, 1.0)]);
    }
    let g = Csc::from_triplets(7, 7, &g);
    let e = Csc::from_triplets(7, 7, &[4, 5, 6].map(|k| (k, k, 1e-3)));
    let kinds = [0, 0, 0, 0, 1, 1, 1];
    let mut floating = Floating::new(&e, &g, &kinds);
    let none = Csc::from_triplets(7, 0, &[]);
    let junction =
        |from: usize, to: usize| Csc::from_triplets(7, 1, &[(from, 0, 1.0), (to, 0, -1.0)]);
    // to a winding; from inside to the rest
    let pair = Csc::from_triplets(7, 1, &[(2, 0, 1.0)]);
    floating.take_cut_sets(&e, &g, &kinds, [&none, &none, &pair]);
    floating.take_cut_sets(&e, &g, &kinds, [&none, &junction(2, 4), &none]);
    assert!(!floating.has_cut_sets());
    // between two inside
    floating.take_cut_sets(&e, &g, &kinds, [&none, &junction(2, 1), &junction(0, 3)]);
    assert_eq!(floating.cuts.groups, [[0, 1, 2, 3]]);
    let law = floating.conductances(&g).into_iter().filter(|e| e.0 == 0 && e.2 != 0.0);
    assert_eq!(law.collect::<Vec<_>>(), [(0, 4, -1.0), (0, 5, -1.0), (0, 6, -1.0)]);
}

#[test]
fn a_rectifier_behind_coils_is_a_cut_set() {
    // coils 3 and 4 end at nodes 0 and 1, junctions lead from there to node 2 and a capacitor on to 5,
    // which a resistor ties to ground
    let mut e = vec![(3, 3, 1e-3), (4, 4, 1e-3)];
    e.extend([(2, 2, 1e-6), (2, 5, -1e-6), (5, 2, -1e-6), (5, 5, 1e-6)]);
    let e = Csc::from_triplets(6, 6, &e);
    let kinds = [0, 0, 0, 1, 1, 0];
    let junctions = [(0, 0, 1.0), (2, 0, -1.0), (1, 1, 1.0), (2, 1, -1.0)];
    let [junctions, none] = [&junctions[..], &[]].map(|list| Csc::from_triplets(6, 2, list));
    for (tie, cut) in [(-40, true), (-10, true), (-1, false)] {
        let tie = 2f64.powi(tie);
        let mut g = vec![(0, 3, -1.0), (1, 4, -1.0), (3, 0, 1.0), (4, 1, 1.0)];
        g.extend([(2, 2, 1.0), (2, 5, -1.0), (5, 2, -1.0), (5, 5, 1.0 + tie)]);
        let g = Csc::from_triplets(6, 6, &g);
        let mut floating = Floating::new(&e, &g, &kinds);
        assert_eq!(floating.tied.groups, [[2, 5]]);
        floating.take_cut_sets(&e, &g, &kinds, [&junctions, &none, &none]);
        // its sum takes the place of that of the capacitor, not of the law of a coil's end
        assert_eq!(floating.tied.groups.is_empty(), cut);
        assert_eq!(floating.cuts.groups.len(), usize::from(cut));
        if !cut {
            continue;
        }
        assert_eq!(floating.cuts.groups[0][0], 2);
        let left = floating.conductances(&g).into_iter().filter(|e| e.0 == 2 && e.2 != 0.0);
        assert_eq!(left.collect::<Vec<_>>(), [(2, 3, -1.0), (2, 4, -1.0), (2, 5, tie)]);
        let mut rhs = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
        floating.sum_up(&mut rhs, &mut [0.0; 8]);
        assert_eq!(rhs, [1.0, 2.0, 39.0, 8.0, 16.0, 32.0]);
    }
}

#[test]
fn a_group_around_a_cut_set_keeps_a_law_outside_it() {
    // windings 3 and 4 from node 2 to nodes 0 and 1, which a resistor ties; nothing leads to ground
    let mut g = vec![(0, 0, 1.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)];
    g.extend((0..2).flat_map(|k| [(k, 3 + k, -1.0), (2, 3 + k, 1.0)]));
    let g = Csc::from_triplets(5, 5, &g);
    let e = Csc::from_triplets(5, 5, &[(3, 3, 1e-3), (4, 4, 1e-3)]);
    let mut floating = Floating::new(&e, &g, &[0, 0, 0, 1, 1]);
    let sum = |floating: &Floating| {
        let mut rhs = [1.0, 2.0, 4.0, 8.0, 16.0];
        floating.sum_up(&mut rhs, &mut [0.0; 8]);
        rhs
    };
    assert_eq!(sum(&floating), [7.0, 2.0, 4.0, 8.0, 16.0]);
    let none = Csc::from_triplets(5, 0, &[]);
    floating.take_cut_sets(&e, &g, &[0, 0, 0, 1, 1], [&none, &none, &none]);
    assert_eq!(sum(&floating), [3.0, 2.0, 7.0, 8.0, 16.0]);
}

#[test]
fn a_capacitor_between_coils_has_a_sum_inside_that_of_all() {
    // coils 4 and 5 from node 0 to 1 and from 2 to 3, a capacitor between 1 and 2
    let g = [(0, 4, 1.0), (1, 4, -1.0), (2, 5, 1.0), (3, 5, -1.0)];
    let e = [(1, 1, 1.0), (1, 2, -1.0), (2, 1, -1.0), (2, 2, 1.0), (4, 4, 1.0), (5, 5, 1.0)];
    let [e, g] = [&e[..], &g[..]].map(|list| Csc::from_triplets(6, 6, list));
    let kinds = [0, 0, 0, 0, 1, 1];
    // a source joins all
    let joined: Vec<_> = g.iter().chain([(0, 3, 1.0), (3, 3, -1.0)]).collect();
    let floating = Floating::new(&e, &Csc::from_triplets(6, 6, &joined), &kinds);
    let mut rhs = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
    floating.sum_up(&mut rhs, &mut [0.0; 8]);
    assert_eq!(rhs, [15.0, 6.0, 4.0, 8.0, 16.0, 32.0]);
}

#[test]
fn a_sum_inside_another_leaves_it_the_laws_themselves() {
    // a coil 4 to node 0, a resistor to node 1, a capacitor to node 2, a junction to node 3, a coil 5
    let e = [(1, 1, 1.0), (1, 2, -1.0), (2, 1, -1.0), (2, 2, 1.0), (4, 4, 1.0), (5, 5, 1.0)];
    let g = [(0, 4, -1.0), (3, 5, -1.0), (0, 0, 1.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)];
    let [e, g] = [&e[..], &g[..]].map(|list| Csc::from_triplets(6, 6, list));
    let junction = Csc::from_triplets(6, 1, &[(2, 0, 1.0), (3, 0, -1.0)]);
    let kinds = [0, 0, 0, 0, 1, 1];
    let mut floating = Floating::new(&e, &g, &kinds);
    floating.take_cut_sets(&e, &g, &kinds, [&junction; 3]);
    let mut rhs = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
    floating.sum_up(&mut rhs, &mut [0.0; 8]);
    // that of the capacitor, and that of all nodes, not of all nodes and of the capacitor once more
    assert_eq!(rhs[1], 6.0);
    assert_eq!(rhs.iter().filter(|v| **v == 15.0).count(), 1, "{rhs:?}");
}

#[test]
fn a_resistor_beside_a_capacitor_belongs_to_its_sum() {
    // a coil 3 from ground to node 0, a resistor on to node 1, a capacitor on to node 2, a coil 4 to ground
    let e = [(1, 1, 1.0), (1, 2, -1.0), (2, 1, -1.0), (2, 2, 1.0), (3, 3, 1.0), (4, 4, 1.0)];
    let e = Csc::from_triplets(5, 5, &e);
    for (ground, whole) in [(0.0, true), (0.5, false)] {
        let mut g = vec![(0, 3, -1.0), (2, 4, 1.0), (3, 0, 1.0), (4, 2, -1.0)];
        g.extend([(0, 0, 2.0 + ground), (0, 1, -2.0), (1, 0, -2.0), (1, 1, 2.0)]);
        let g = Csc::from_triplets(5, 5, &g);
        let floating = Floating::new(&e, &g, &[0, 0, 0, 1, 1]);
        // where another one ties it to ground, too, the sum would keep a voltage: without it, it has the
        // current of the first
        let sum = if whole { vec![0, 1, 2] } else { vec![1, 2] };
        assert_eq!(floating.tied.groups, std::slice::from_ref(&sum));
        let left = floating.conductances(&g).into_iter().filter(|e| e.0 == sum[0] && e.2 != 0.0);
        let left: Vec<_> = left.collect();
        let resistor: &[_] = if whole { &[] } else { &[(1, 0, -2.0), (1, 1, 2.0)] };
        let coils = [(sum[0], 3, -1.0), (sum[0], 4, 1.0)];
        let coils = &coils[usize::from(!whole)..];
        assert_eq!(left.len(), resistor.len() + coils.len(), "{left:?}");
        assert!(resistor.iter().chain(coils).all(|e| left.contains(e)), "{left:?}");
        // the capacitor's own sum goes on inside
        assert!(floating.is_sum(sum[0]) && floating.is_sum(1));
    }
}

#[test]
fn resistors_leave_a_sum_that_they_do_not_tie_to_ground() {
    let e = Csc::from_triplets(3, 3, &[(1, 1, 1e-9)]);
    let tied = |ground: f64| {
        let g = [(0, 0, 0.1), (0, 1, -0.1), (1, 0, -0.1), (1, 1, 0.1 + ground), (2, 2, 1.0)];
        let g = Csc::from_triplets(3, 3, &g);
        let mut floating = Floating::new(&e, &g, &[0, 0, 0]);
        assert!(!floating.is_sum(1));
        floating.take_contents(&e, &[0, 0, 0]);
        (floating, g)
    };
    let (floating, g) = tied(0.0);
    // in the place of the law that has the charge: the other one has no rounding of it
    assert!(!floating.is_sum(0) && floating.is_sum(1) && !floating.is_sum(2));
    assert!(floating.conductances(&g).iter().filter(|e| e.0 == 1).all(|e| e.2 == 0.0));
    // what is stored there stays
    assert_eq!(floating.stored(&e), [(1, 1, 1e-9)]);
    // a weak tie stays, too, a strong one makes a sum useless
    let (floating, g) = tied(2f64.powi(-46));
    let left = floating.conductances(&g).into_iter().filter(|e| e.0 == 1);
    assert_eq!(left.collect::<Vec<_>>(), [(1, 0, 0.0), (1, 1, 2f64.powi(-46))]);
    assert!(!tied(1e-3).0.is_sum(1));
}

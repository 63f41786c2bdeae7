//! The degenerate networks that ideal elements make legal, and those without a solution.

use super::circuits::{close, Net};
use crate::mlcp::Start;

#[test]
fn half_wave_conducts_and_blocks() {
    let on = Net::new(2).voltage(1, 0, 5.0).diode(1, 2).resistor(2, 0, 10.0).solve().unwrap();
    close(on.l[0], 0.5, 1e-15);
    close(on.z[1], 5.0, 1e-14);
    let off = Net::new(2).voltage(1, 0, -5.0).diode(1, 2).resistor(2, 0, 10.0).solve().unwrap();
    close(off.l[0], 0.0, 0.0);
    close(off.z[1], 0.0, 1e-15);
}

#[test]
fn source_across_forward_diodes_has_no_solution() {
    for count in 1..=3 {
        let mut net = Net::new(count);
        net.voltage(1, 0, 5.0);
        for k in 0..count {
            net.diode(k + 1, if k + 1 == count { 0 } else { k + 2 });
        }
        assert!(net.solve().is_err(), "{count} diodes");
    }
}

#[test]
fn source_across_reverse_diode_is_fine() {
    let a = Net::new(1).voltage(1, 0, -5.0).diode(1, 0).solve().unwrap();
    close(a.l[0], 0.0, 0.0);
    close(a.z[0], -5.0, 0.0);
}

#[test]
fn parallel_diodes_share_equally() {
    let mut net = Net::new(1);
    net.current(0, 1, 3.0).diode(1, 0).diode(1, 0).diode(1, 0).resistor(1, 0, 1.0);
    let a = net.solve().unwrap();
    for l in &a.l {
        close(*l, 1.0, 1e-12);
    }
}

#[test]
fn parallel_diodes_stay_near_the_previous_sharing() {
    let mut net = Net::new(1);
    net.current(0, 1, 3.3).diode(1, 0).diode(1, 0).diode(1, 0);
    let a = net.solve_from(&[0.0], &[0.5, 1.0, 1.5], Start::Warm).unwrap();
    for (l, wanted) in a.l.iter().zip([0.6, 1.1, 1.6]) {
        close(*l, wanted, 1e-12);
    }
}

#[test]
fn series_diodes_leave_the_middle_floating() {
    // both block; the middle node keeps its voltage where that is possible
    let mut net = Net::new(2);
    net.voltage(1, 0, -2.0).diode(1, 2).diode(2, 0);
    let cold = net.solve().unwrap();
    assert!(cold.z[1] >= -2.0 && cold.z[1] <= 0.0, "{}", cold.z[1]);
    close(cold.l[0].abs() + cold.l[1].abs(), 0.0, 0.0);
    let warm = net.solve_from(&[-2.0, -0.7, 0.0], &[0.0, 0.0], Start::Warm).unwrap();
    close(warm.z[1], -0.7, 1e-12);
}

#[test]
fn antiparallel_diodes_across_a_current_source() {
    let a = Net::new(1).current(0, 1, 2.0).diode(1, 0).diode(0, 1).solve().unwrap();
    close(a.l[0] - a.l[1], 2.0, 1e-12);
    close(a.z[0], 0.0, 1e-12);
}

#[test]
fn current_against_a_diode_has_no_solution() {
    assert!(Net::new(1).current(1, 0, 1.0).diode(1, 0).solve().is_err());
}

#[test]
fn equal_parallel_sources_are_redundant_and_unequal_ones_conflict() {
    let mut equal = Net::new(1);
    equal.voltage(1, 0, 5.0).voltage(1, 0, 5.0).resistor(1, 0, 5.0);
    let a = equal.solve().unwrap();
    close(a.z[0], 5.0, 1e-12);
    close(a.z[1], -0.5, 1e-12); // both carry half
    close(a.z[2], -0.5, 1e-12);
    assert!(Net::new(1).voltage(1, 0, 5.0).voltage(1, 0, 4.0).resistor(1, 0, 5.0).solve().is_err());
}

#[test]
fn floating_island_keeps_its_voltage() {
    let mut net = Net::new(3);
    net.voltage(1, 0, 1.0).diode(2, 3).resistor(2, 3, 10.0).resistor(1, 0, 1.0);
    let a = net.solve_from(&[1.0, 4.0, 4.0, -1.0], &[0.0], Start::Warm).unwrap();
    close(a.z[1], 4.0, 1e-12);
    close(a.z[2], 4.0, 1e-12);
}

#[test]
fn directed_loop_of_diodes_may_carry_nothing() {
    let mut net = Net::new(3);
    net.diode(1, 2).diode(2, 3).diode(3, 1).current(0, 1, 1.0).resistor(3, 0, 2.0);
    let a = net.solve().unwrap();
    for v in &a.z[..3] {
        close(*v, 2.0, 1e-10);
    }
    // least norm: 2/3, 2/3 forward and -1/3 back is forbidden, so the way back blocks
    close(a.l[0], 1.0, 1e-6);
    close(a.l[1], 1.0, 1e-6);
}

#[test]
fn bridge_from_cold() {
    let mut net = Net::new(4);
    net.voltage(1, 2, 10.0).diode(1, 3).diode(2, 3).diode(4, 1).diode(4, 2);
    net.resistor(3, 4, 1e3).resistor(4, 0, 1.0);
    let a = net.solve().unwrap();
    close(a.z[2] - a.z[3], 10.0, 1e-12);
    close(a.l[0], 0.01, 1e-14);
    close(a.l[1], 0.0, 1e-14);
}

#[test]
fn capacitor_jump_lands_in_one_step() {
    // 10 V source, diode, capacitor at 0 V, no resistance: the charge C 10 flows immediately
    let mut net = Net::new(2);
    net.voltage(1, 0, 10.0).diode(1, 2).capacitor(2, 0, 1e9, 0.0);
    let a = net.solve().unwrap();
    close(a.z[1], 10.0, 1e-12);
    close(a.l[0], 1e10, 1e-2);
}

#[test]
fn inductor_cut_by_a_reverse_diode() {
    let mut net = Net::new(1);
    net.inductor(1, 0, 1e6, -1.0).diode(1, 0);
    let a = net.solve().unwrap();
    close(a.z[1], -a.l[0], 1e-12);
}

#[test]
fn switches_are_fixed_in_every_stage() {
    let mut net = Net::new(3);
    net.voltage(1, 0, -3.0).switch(1, 2, true).switch(2, 3, false);
    net.resistor(2, 0, 1.0).resistor(3, 0, 1.0).diode(2, 0).diode(0, 2);
    // the closed switch puts -3 V on a diode that conducts: no solution
    assert!(net.solve().is_err());
    let mut net = Net::new(3);
    net.voltage(1, 0, -3.0).switch(1, 2, true).switch(2, 3, false);
    net.resistor(2, 0, 1.0).resistor(3, 0, 1.0).diode(2, 0);
    let a = net.solve().unwrap();
    close(a.l[0], -3.0, 1e-12);
    close(a.l[1], 0.0, 0.0);
    close(a.z[2], 0.0, 1e-12);
}

#[test]
fn drop_and_resistance() {
    let mut net = Net::new(1);
    net.current(0, 1, 2.0).real_diode(1, 0, 0.7, 0.1);
    let a = net.solve().unwrap();
    close(a.z[0], 0.9, 1e-13);
    close(a.l[0], 2.0, 1e-13);
}

#[test]
fn floating_island_charged_by_a_current_source_is_suspect_or_unsolved() {
    let mut net = Net::new(2);
    net.current(0, 1, 1.0).diode(2, 1).capacitor(1, 2, 1.0, 0.0);
    match net.solve() {
        Ok(a) => assert!(a.solved.needs_certificate),
        Err(u) => assert!(u.residual.worst() > 1e-10),
    }
}

#[test]
fn values_of_extreme_size() {
    let mut net = Net::new(3);
    net.voltage(1, 0, 1e7).resistor(1, 2, 1e9).diode(2, 3).resistor(3, 0, 1e-9);
    let a = net.solve().unwrap();
    close(a.l[0], 1e-2, 1e-14);
    close(a.z[2], 1e-11, 1e-22);
}

#[test]
fn data_that_are_not_finite_are_refused() {
    let mut net = Net::new(1);
    net.current(0, 1, f64::NAN).diode(1, 0).resistor(1, 0, 1.0);
    assert!(net.solve().is_err());
}

#[test]
fn currents_that_vanish_are_no_failure() {
    // nothing flows anywhere: rounding must not be compared with rounding
    let mut net = Net::new(5);
    net.voltage(4, 1, 2.0).voltage(4, 5, -1.0).resistor(1, 0, 7.824433565469).diode(5, 1);
    let a = net.solve();
    // 5 is 3 V above 1: the diode conducts in a loop of sources
    assert!(a.is_err());
    let mut net = Net::new(5);
    net.voltage(4, 1, 2.0).voltage(4, 5, -1.0).resistor(1, 0, 7.824433565469).diode(1, 5);
    let a = net.solve().unwrap();
    close(a.z[3], 2.0, 1e-12);
    close(a.z[4], 3.0, 1e-12);
}

#[test]
fn a_switch_that_closes_beside_a_conducting_diode_takes_over() {
    // a step of 1e-18 s in which the diode's 0.7 V cannot stay across the switch, however large the
    // voltage is that would change the current of the inductor
    let (short, charge, current) = (1e18, 1e-9 * 0.7, 1.0);
    let mut net = Net::new(1);
    net.capacitor(1, 0, 1e-9 * short, 0.7).inductor(0, 1, 1e-4 * short, current);
    net.switch(1, 0, true).real_diode(1, 0, 0.7, 0.0);
    let a = net.solve_from(&[0.7, current], &[0.0, current], Start::Warm).unwrap();
    close(a.z[0], 0.0, 1e-15);
    close(a.l[0] / (charge * short + current), 1.0, 1e-12);
    close(a.l[1], 0.0, 0.0);
}

#[test]
fn of_two_conducting_diodes_the_one_of_the_lower_drop_takes_over() {
    let (short, charge, current) = (1e18, 1e-9 * 0.4, 1.0);
    let mut net = Net::new(1);
    net.capacitor(1, 0, 1e-9 * short, 0.7).inductor(0, 1, 1e-4 * short, current);
    net.real_diode(1, 0, 0.3, 0.0).real_diode(1, 0, 0.7, 0.0);
    let a = net.solve_from(&[0.7, current], &[current, current], Start::Warm).unwrap();
    close(a.z[0], 0.3, 1e-15);
    close(a.l[0] / (charge * short + current), 1.0, 1e-12);
    close(a.l[1], 0.0, 0.0);
}

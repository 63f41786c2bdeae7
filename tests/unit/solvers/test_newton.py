"""Newton's method for systems with smooth and set-valued laws, on arrays written by hand."""

import itertools
import math

import numpy as np
import pytest
from decks.smooth_networks import VT, Network, dc
from scipy.optimize import brentq
from scipy.special import lambertw

from nsspice.problems import Functional, Waveform
from nsspice.solvers.moreau import MoreauStepper
from nsspice.solvers.stepper import UnsolvedStep

SHARP = [1.0, 0.1, 0.01, 0.001]


def operating_point(network: Network):
    stepper = MoreauStepper(network.system(), [])
    stepper.start_dc(0.0)
    assert stepper.statistics["residual_rows"] < 1e-10
    return stepper.state[0], stepper


@pytest.mark.parametrize("emission", SHARP)
@pytest.mark.parametrize("source", [10.0, 0.5, -3.0])
def test_junction_behind_a_resistor(emission, source):
    """Closed form by Lambert's W; in the voltage, where the exponential is no issue."""
    network = Network(2)
    network.voltage(1, 0, dc(source))
    network.resistor(1, 2, 1e3)
    network.junction(2, 0, 1e-14, emission)
    z, _ = operating_point(network)
    unit, drive = emission * VT, source + 1e3 * 1e-14
    # v = drive - unit W(Is R / unit exp(drive / unit)), in logarithms where that overflows
    logarithm = math.log(1e3 * 1e-14 / unit) + drive / unit
    if logarithm > 700:
        w = brentq(lambda x: x + math.log(x) - logarithm, 1e-3, logarithm, xtol=1e-13, rtol=1e-15)
    else:
        w = lambertw(math.exp(logarithm)).real
    # rounding of 10 V in w unit: w is known to some units in its last place
    assert z[1] == pytest.approx(drive - unit * w, abs=1e-13)


@pytest.mark.parametrize("emission", SHARP)
def test_bridge_and_logic_converge_however_sharp(emission):
    """The bridge against its scalar equation; the inverters against saturation and cut-off."""
    bridge = Network(3)
    bridge.voltage(1, 2, dc(10.0))
    bridge.resistor(3, 0, 1e3)
    for a, b in ((1, 3), (2, 3), (0, 1), (0, 2)):
        bridge.junction(a, b, 1e-14, emission)
    z, _ = operating_point(bridge)
    unit = emission * VT
    drop = brentq(
        lambda v: 1e-14 * math.expm1(v / unit) - (10.0 - 2.0 * v) / 1e3, 0.0, 1.5 * 40 * unit
    )
    assert z[2] == pytest.approx(10.0 - 2.0 * drop, abs=1e-9)

    chain = Network(14)
    chain.voltage(1, 0, dc(5.0))
    chain.voltage(2, 0, dc(5.0))
    chain_nodes = [2, *range(3, 9)]
    for k, (a, c) in enumerate(itertools.pairwise(chain_nodes)):
        chain.resistor(a, 9 + k, 1e4)
        chain.resistor(1, c, 1e3)
        chain.transistor(c, 9 + k, 0, emission=emission)
    z, _ = operating_point(chain)
    levels = z[2:8]
    assert all(levels[0::2] < 0.3)
    assert all(levels[1::2] > 4.0)


def test_hard_circuits_are_found_without_help():
    """An operational amplifier as a follower: its output is its input up to the offset."""
    for emission in SHARP:
        n = Network(10)
        plus, minus, inp, tail, bias, mirror, first, drive, out = 1, 2, 3, 4, 5, 6, 7, 8, 9
        for node, value in ((plus, 15.0), (minus, -15.0), (inp, 0.1)):
            n.voltage(node, 0, dc(value))

        def pnp(c, b, e, n=n, emission=emission):
            n.transistor(c, b, e, emission=emission, sign=-1.0)

        def npn(c, b, e, n=n, emission=emission):
            n.transistor(c, b, e, emission=emission)

        pnp(tail, bias, plus)
        pnp(bias, bias, plus)
        n.resistor(bias, minus, 3e4)
        pnp(mirror, out, tail)
        pnp(first, inp, tail)
        npn(mirror, mirror, minus)
        npn(first, mirror, minus)
        npn(drive, first, minus)
        pnp(drive, bias, plus)
        npn(plus, drive, out)
        pnp(minus, drive, out)
        n.resistor(out, 0, 2e3)
        n.resistor(10, 0, 1.0)
        z, _ = operating_point(n)
        # negative feedback: the second stage inverts, the pair does so for its own input
        assert z[out - 1] == pytest.approx(0.1, abs=0.02)


def test_set_valued_and_smooth_diodes_in_one_network():
    """An ideal diode takes what the junction beside it would carry above its drop."""
    network = Network(2)
    network.voltage(1, 0, dc(10.0))
    network.resistor(1, 2, 1e3)
    network.junction(2, 0, 1e-14, 1.0)
    network.ideal_diode(2, 0, 0.6)
    stepper = MoreauStepper(network.system(), [])
    stepper.start_dc(0.0)
    z, lam = stepper.state
    assert z[1] == pytest.approx(0.6, abs=1e-15)
    assert lam[0] == pytest.approx(9.4e-3 - 1e-14 * math.expm1(0.6 / VT), rel=1e-13)


def test_a_floating_node_between_blocking_junctions_is_solved():
    """Saturation currents of both are equal to the last digit over many volts: any value holds."""
    network = Network(2)
    network.voltage(1, 0, dc(-10.0))
    network.junction(1, 2, 1e-14, 1.0)
    network.junction(2, 0, 1e-14, 1.0)
    z, _ = operating_point(network)
    assert -10.0 <= z[1] <= 0.0


def test_resistor_and_capacitor_with_a_junction_follow_the_exact_discharge():
    """C v' = -Is expm1(v/nVt) has expm1(-v/nVt) = expm1(-v0/nVt) exp(-Is t/(C nVt)): order 1."""
    v0, saturation, farad = 0.2, 1e-9, 1e-9
    errors = []
    for step in (2e-6, 1e-6):
        network = Network(1)
        network.capacitor(1, 0, farad)
        network.junction(1, 0, saturation, 1.0)
        stepper = MoreauStepper(network.system(), network.voltages())
        stepper.start_charges(0.0, np.array([farad * v0]), step)
        stepper.plan(0.0, 1e-3, step, 0.0, 1e-5)
        rows, _ = stepper.advance(1000, 10.0)
        exact = -VT * np.log1p(
            math.expm1(-v0 / VT) * np.exp(-saturation * rows[:, 0] / (farad * VT))
        )
        errors.append(np.abs(rows[:, 1] - exact)[1:].max())
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.3)
    assert errors[1] < 1e-3


def test_charge_functions_are_conserved():
    """A nonlinear capacitor q = C v + K v^3 between two steps of a voltage divider of charge."""
    network = Network(2)
    network.capacitor(1, 0, 1e-6)
    network.resistor(1, 2, 1.0)
    v = network.difference(2, 0)
    cube = network.tape.op("mul", network.tape.op("square", v), v)
    c, k = network.tape.constant(1e-6), network.tape.constant(1e-6)
    q = network.output(
        network.tape.op("add", network.tape.op("mul", c, v), network.tape.op("mul", k, cube))
    )
    network.flow(q, (2, 1.0), charge=True)
    rate = Functional(df=((q, 1.0),))
    stepper = MoreauStepper(
        network.system(), [*network.voltages(), Functional(f=((q, 1.0),)), rate]
    )
    stepper.start_charges(0.0, np.array([1e-6 * 2.0, 0.0]), 1e-8)
    stepper.plan(0.0, 1e-4, 1e-8, 0.0, 1e-6)
    rows, _ = stepper.advance(1000, 10.0)
    total = 1e-6 * rows[:, 1] + rows[:, 3]
    assert np.abs(total - 2e-6).max() < 1e-15  # 1e4 steps, each exact to 1e-22
    # the current through the resistor is the rate of the charge
    assert np.abs(rows[1:, 4] - (rows[1:, 1] - rows[1:, 2])).max() < 1e-9
    level = brentq(lambda x: 2 * x + x**3 - 2.0, 0.0, 2.0, xtol=1e-15)
    assert rows[-1, 1] == pytest.approx(level, abs=1e-9)


def test_points_of_a_static_network_follow_time():
    network = Network(2)
    network.voltage(1, 0, Waveform("sin", (0.0, 5.0, 50.0, 0.0, 0.0, 0.0)))
    network.resistor(1, 2, 1e3)
    network.junction(2, 0, 1e-14, 1.0)
    stepper = MoreauStepper(network.system(), network.voltages())
    stepper.start_dc(0.0)
    stepper.plan_points(np.linspace(0.0, 0.04, 401))
    rows, done = stepper.advance(500, 10.0)
    assert done
    v1, v2 = rows[:, 1], rows[:, 2]
    assert np.abs((v1 - v2) / 1e3 - 1e-14 * np.expm1(v2 / VT)).max() < 1e-13
    # a secant predicts well: two or three linearisations a point, some more at the knee
    assert stepper.statistics["linearised"] < 4 * 401


def test_failures_name_the_row_or_prove_the_contradiction():
    network = Network(1)
    network.voltage(1, 0, dc(1.0))
    network.voltage(1, 0, dc(2.0))
    network.junction(1, 0, 1e-14, 1.0)
    with pytest.raises(UnsolvedStep) as found:
        MoreauStepper(network.system(), []).start_dc(0.0)
    assert found.value.certificate is not None
    assert sorted(found.value.certificate.rows.tolist()) == [1, 2]

    # x^2 + 1 = 0 has no real solution
    hopeless = Network(1)
    hopeless.resistor(1, 0, 1e30)
    square = hopeless.tape.op("square", hopeless.tape.unknown(0))
    one = hopeless.tape.op("add", square, hopeless.tape.constant(1.0))
    hopeless.flow(hopeless.output(one), (1, 1.0))
    with pytest.raises(UnsolvedStep) as found:
        MoreauStepper(hopeless.system(), []).start_dc(0.0)
    assert found.value.certificate is None
    assert found.value.worst_row == 0

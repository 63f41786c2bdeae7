"""What sdirk makes of its tolerance where parts are ideal: errors of its order, steps that grow."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from regression.converters.test_multipliers import deck as multiplier

import nsspice
from nsspice.analyses.studies.refinement import stored_quantities

NETLISTS = Path(__file__).resolve().parents[2] / "netlists"
LADDER = tuple(10.0**-k for k in range(2, 9))

#: steps of a run may err by reltol each; in what is lossless between switchings they add up over a
#: few switchings, until the next charge from the source sets things right
ADDED = 3.0


def ladder(circuit, tolerances, **span):
    """Return errors of what is stored, as shares of its range, and numbers of steps."""
    runs = [nsspice.tran(circuit, method="modewise", **span)]
    runs += [nsspice.tran(circuit, method="sdirk", reltol=reltol, **span) for reltol in tolerances]
    assert all(run.certificate.passed for run in runs)
    exact, *others = [np.column_stack([run[name] for name in span["signals"]]) for run in runs]
    errors = [(np.abs(table - exact) / np.ptp(exact, axis=0)).max() for table in others]
    return np.array(errors), [run.stats["steps"] for run in runs[1:]]


@pytest.mark.parametrize(
    ("deck", "signals"),
    [
        ("rectifiers/voltage_doubler", ["v(a)", "v(out)"]),
        ("rectifiers/clamp", ["v(out)"]),
        ("rectifiers/half_wave_capacitor", ["v(out)"]),
        ("rectifiers/full_bridge_capacitor", ["v(p,n)"]),
        ("rectifiers/half_wave_inductive", ["i(l1)"]),
        ("rectifiers/cockcroft_walton_4", ["v(in,a1)", "v(a3,a4)", "v(s3,s4)"]),
        ("thesis/ex423_zener_rlc", ["i(l1)", "v(n3)"]),
        ("thesis/ex424_bridge_oscillator", ["i(l1)", "v(n1)"]),
    ],
)
def test_errors_are_of_the_order_of_the_tolerance_and_steps_grow(deck, signals):
    circuit = nsspice.read(NETLISTS / f"{deck}.net")
    card = circuit.deck.analyses[0]
    step = (card.tstop - card.tstart) / 50
    errors, steps = ladder(circuit, LADDER, step=step, signals=signals)
    assert np.all(errors <= ADDED * np.array(LADDER)), errors
    # the longest step alone makes fifty, and an event at the end of a step takes one less; a bridge
    # floats while all of its diodes block, and its pairs turn in one step or in two
    spare = 3 if "full_bridge" in deck else 50
    assert all(finer >= coarser - max(5, coarser // spare) for coarser, finer in pairwise(steps)), (
        steps
    )


@pytest.mark.parametrize(
    ("deck", "signals"),
    [
        ("boost", ["i(l1)", "v(out)"]),
        ("buck", ["i(l1)", "v(out)"]),
        ("flyback", ["v(out)"]),
    ],
)
def test_errors_of_five_hundred_periods_stay_of_the_order_of_the_tolerance(deck, signals):
    circuit = nsspice.read(NETLISTS / "converters" / f"{deck}.net")
    tolerances = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
    errors, _ = ladder(circuit, tolerances, step=1e-4, signals=signals)
    assert np.all(errors <= ADDED * np.array(tolerances)), errors


@pytest.mark.parametrize("deck", ["bridge", "buck", "clamp", "half_wave_capacitor", "multiplier"])
def test_rows_in_steps_in_which_junctions_begin_to_conduct_err_by_the_tolerance(deck):
    """Shockley diodes: knees inside of steps; the buck converter has a ripple on 4.5 V."""
    circuit = nsspice.read(NETLISTS / "smooth" / f"{deck}.net")
    signals = stored_quantities(circuit)
    card = circuit.deck.analyses[0]
    span = {"step": (card.tstop - card.tstart) / 50, "method": "sdirk", "signals": signals}

    def table(reltol):
        run = nsspice.tran(circuit, reltol=reltol, **span)
        assert run.certificate.passed
        return np.column_stack([run[name] for name in signals])

    fine = table(1e-9)
    tolerances = np.array([1e-3, 1e-4, 1e-5, 1e-6])
    errors = [(np.abs(table(t) - fine) / np.ptp(fine, axis=0)).max() for t in tolerances]
    assert np.all(errors <= ADDED * tolerances), errors


def test_a_ripple_on_a_large_voltage_has_the_accuracy_of_its_range():
    """0.4 V on a capacitor at 1000 V."""
    circuit = nsspice.read(
        """ripple
V1 in 0 DC 1k
I1 0 out SIN(0 1 1k)
R1 in out 1
C1 out 0 1m IC=1k
"""
    )
    span = {"stop": 5e-3, "row_step": 5e-6, "step": 1e-3, "uic": True, "signals": ["v(out)"]}
    tolerances = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
    errors, steps = ladder(circuit, tolerances, **span)
    assert np.all(errors <= ADDED * np.array(tolerances)), errors
    assert steps == sorted(steps)


def test_multipliers_take_more_steps_for_more_digits():
    """Of a multiplier that is being charged errors add up over twenty-five periods.

    Which of its 16 diodes turns first, rounding may decide: the errors of single runs at
    neighbouring tolerances scatter between 1.3 and 4.3 of the tolerance; their median is asked.
    """
    signals = ["v(b8)", "v(b4)", "v(b1)"]
    circuit = nsspice.read(multiplier(8))
    span = {"stop": 25e-3, "row_step": 20e-6, "step": 1e-3, "uic": True, "signals": signals}
    neighbours = np.array([0.8, 0.9, 1.0, 1.1, 1.2])
    tolerances = np.concatenate([1e-3 * neighbours, 1e-4 * neighbours])
    errors, steps = ladder(circuit, tuple(tolerances), **span)
    parts = np.median((errors / tolerances).reshape(2, -1), axis=1)
    assert np.median(steps[:5]) < np.median(steps[5:])
    assert np.all(parts <= ADDED), parts


def test_rows_right_behind_a_change_of_mode_have_the_accuracy_of_others():
    """The first step behind a change does not know the rates with which it begins, and rows in it
    may err by three times the tolerance."""
    signals = [f"v({node}{k})" for node in "ab" for k in range(1, 5)]
    span = {"stop": 4e-3, "row_step": 4e-7, "step": 1e-3, "uic": True, "signals": signals}
    (error,), _ = ladder(nsspice.read(multiplier(4)), [1e-4], **span)
    assert error <= 3e-4


def test_a_row_inside_a_single_implicit_step_is_not_that_of_its_end():
    """At 0.5 ms the diode of the clamp begins to conduct: that mode is found by a step of 12 ns."""
    circuit = nsspice.read(NETLISTS / "rectifiers" / "clamp.net")
    run = nsspice.tran(circuit, method="sdirk", reltol=1e-7, signals=["v(out)", "v(in)"])
    (row,) = np.flatnonzero(np.abs(run.time - 0.5e-3) < 1e-9)
    across = run["v(out)"] - run["v(in)"]
    assert abs(across[row]) <= 1e-7 * 5.0  # empty until then


@pytest.mark.parametrize(
    "text",
    [
        """an inductor behind 1 MOhm, the other open
V1 n0 0 DC 5
Rs n0 n1 7.94
C2 n2 0 5.76u
L3 n3 n1 6.68m
L5 n5 n1 30.1m
D1 n2 n3 DR
.model DR D(Ron=10m Roff=1meg)
""",
        """no current anywhere
V1 n0 0 PWL(0 0 0.2667m 5 0.5334m 5)
Rs n0 n1 5.22
L2 n2 n1 18.1m
R4 n4 n1 260
L10 n2 n1 65.7m
S1 n2 n4 n0 0 SW2
.model SW2 SW(VT=10 RON=1m ROFF=10meg)
""",
    ],
    ids=["reverse", "open"],
)
def test_currents_made_of_the_rounding_of_voltages_ask_for_no_steps(text):
    """Volts are known to femtovolts: less current than these drive in an inductor has no digits."""
    circuit = nsspice.read(text)
    span = {"stop": 0.5e-3, "row_step": 1e-5, "uic": True, "method": "sdirk", "reltol": 1e-3}
    run = nsspice.tran(circuit, **span)
    assert run.stats["steps"] + run.stats["rejected"] <= 1000
    assert run.certificate.passed

"""Random networks whose runs were right and failed their certificate, or passed it and were wrong.

They come from soaks; what was wrong is told with each group.
"""

from __future__ import annotations

import numpy as np
import pytest
from decks.random_circuits import STEPS, generate

import nsspice

#: all voltages (or currents) vanish: what is left is the rounding of what is stored, C v / h
AT_REST = [
    ("degenerate", 40000), ("floating", 40023), ("floating", 40152), ("stiff", 40162),
    ("floating", 40275), ("floating", 40562), ("regular", 40580), ("impulsive", 40615),
]  # fmt: skip
#: currents meet in nodes without storage, with the rounding of capacitors or conductances elsewhere
CANCELLING = [
    ("multiplier", 40076), ("multiplier", 40230), ("multiplier", 40298), ("multiplier", 40501),
    ("bridge", 40236), ("bridge", 40385), ("impulsive", 40293), ("large", 40283),
]  # fmt: skip
#: energies of 1e-110 J beside sources of 18 V
TINY = [("degenerate", 40513)]
#: impulses of a single short step, with what the sources gave meanwhile
SINGLE = [("bridge", 40533), ("stiff", 40600), ("bridge", 20185), ("bridge", 20545),
          ("degenerate", 20209)]  # fmt: skip
#: potentials of gigavolts in the impulse: their rounding was put into a capacitor
LIFTED = [("bridge", 1027), ("multiplier", 1034)]
#: the state right after the jump still carried an impulse: 1e8 A, and diodes with volts across them
LEFT_OVER = [("large", 40101), ("large", 40343), ("large", 40463)]
BENT = [("large", 40528), ("large", 167507)]
#: diodes at nodes without capacitors seemed to pass charge in a jump: closed after it, at 1 V
CLOSED_BY_NOTHING = [
    ("large", 40443, "modewise"), ("large", 40443, "moreau"), ("large", 300008, "sdirk"),
    ("large", 610002, "modewise"), ("large", 610002, "sdirk"),
]  # fmt: skip
#: a diode changed within the short steps that show the state after a jump: it blocked -1 mA, -46 mA
PASSED_OVER = [("bridge", 71203), ("bridge", 71253)]
#: 7e-18 and 3e-14 V across diodes: the rounding of 0.36 A in 750 Ohm, all other voltages being zero
CONDUCTING = [("floating", 71245)]
#: 3e-10 V across a diode of 6e-9 A beside 62 mA: the limit of short steps is no better known
LIMITS = [("regular", 80013)]
#: 4e-22 A right after a start at which all currents vanish: an inductor across a source
VANISHING = [("degenerate", 90023), ("floating", 90455)]
#: 8e-13 V across a diode: a part that hangs on 1 kOhm beside nodes of 4 A; right after a jump
#: 3e-6 V, where capacitors made short steps of 1e7 A
UNSEEN = [("floating", 90035), ("floating", 90385)]
#: an impulsive step and two longer ones from where it led: the first lifted nodes to 31 GV
CHAINED = [("bridge", 90530)]
#: energies of 1e-35 J in runs so short that no step had been looked at for rounding
SHORT = [("degenerate", 90063)]

#: a current goes round in ideal diodes: 1e-50 V across them, the rounding of what it drops in the
#: resistance of another diode; 1e-45 V beside the threshold of a Zener diode without current
GOING_ROUND = [("floating", 230573), ("floating", 230066)]
#: an inductor only begins to move, in two impulsive steps after each other
BEGINNING = [("floating", 230055)]
#: 0.4 uV forward across a diode without current, between others that block, beside 5 kV elsewhere
FORWARD = [("floating", 230366)]

#: mode by mode: eigenvectors from an inverse without a digit (laws off by up to 3e-3 of their
#: currents and voltages), and nearly parallel ones of ten rates that vanish
EIGENVECTORS = [("large", 60008), ("large", 60017), ("stiff", 60015), ("large", 50002)]
#: mode by mode: rows of a matrix that were zero but for rounding were scaled up to their columns
BALANCED = [("large", 310004)]
#: mode by mode: 1 pF beside 1 H; what slow motions leave on it was known to rounding of the
#: large store
SCALES = [("stiff", 510015)]
#: mode by mode: what sources force in milliseconds, 5.6 kA, cancels within nanoseconds but for 1 pA
CANCELLED = [("stiff", 300006)]
#: implicit steps: charges on both sides of ideal diodes missed their law by 1e-5 after an impulsive
#: step, in which 70 uV hid behind kiloamperes
HIDDEN = [("large", 110128)]
#: implicit steps: a map gave two voltages of 3 V to their own digits, and a capacitor between them
#: had lost 1e-8 of its current
BETWEEN = [("bridge", 110607)]
#: right after the start a capacitor between two nodes made amperes of the last digit of 8 V: the
#: 0.8 A that pass it were missing in a resistor and a source
TIED = [("stiff", 300006)]
#: mode by mode: a jump of charges brought fluxes of 1e-19 V s by rounding, where none had been
TURNED = [("impulsive", 60012)]
#: mode by mode: the right mode after the first jump misses a guard by a little more than its noise
NEARLY = [("multiplier", 300026)]


def solved(kind, seed):
    random = generate(kind, seed)
    circuit = nsspice.read(random.text)
    return nsspice.tran(circuit, STEPS * random.step, random.step, step=random.step, uic=True)


@pytest.mark.parametrize(
    ("kind", "seed"),
    [
        *AT_REST,
        *CANCELLING,
        *TINY,
        *SINGLE,
        *LIFTED,
        *LEFT_OVER,
        *BENT,
        *PASSED_OVER,
        *CONDUCTING,
        *LIMITS,
        *VANISHING,
        *UNSEEN,
        *CHAINED,
        *SHORT,
        *GOING_ROUND,
        *BEGINNING,
        *FORWARD,
    ],
)
def test_a_right_run_is_certified(kind, seed):
    assert solved(kind, seed).certificate.passed


@pytest.mark.parametrize(("kind", "seed"), LEFT_OVER)
def test_currents_right_after_a_jump_are_no_impulses(kind, seed):
    """Capacitors and inductors start a curve there: the first step is not 1e7 times less."""
    run = solved(kind, seed)
    currents = np.array([y[:2] for name, y in run.signals.items() if name.startswith("i(")])
    assert currents.shape[0] > 0
    assert np.abs(currents[:, 0]).max() < 100.0 * np.abs(currents[:, 1]).max()


@pytest.mark.parametrize(("kind", "seed"), [*EIGENVECTORS, *TURNED, *NEARLY])
def test_a_right_run_mode_by_mode_is_certified(kind, seed):
    random = generate(kind, seed)
    circuit = nsspice.read(random.text)
    run = nsspice.tran(circuit, STEPS * random.step, method="modewise", uic=True)
    assert [island.method for island in run.islands] == ["modewise"] * len(run.islands)
    assert run.certificate.passed
    assert run.certificate.laws < 1e-11


@pytest.mark.parametrize(("kind", "seed", "method"), [
    *((*seed, "modewise") for seed in BALANCED + CANCELLED + SCALES),
    *((*seed, "moreau") for seed in HIDDEN + BETWEEN),
    *((*seed, "sdirk") for seed in UNSEEN + CHAINED),
    *CLOSED_BY_NOTHING,
])  # fmt: skip
def test_what_a_certificate_found_wrong_is_right(kind, seed, method):
    random = generate(kind, seed)
    circuit = nsspice.read(random.text)
    stop, step = STEPS * random.step, random.step
    run = nsspice.tran(circuit, stop, step, step=step, method=method, uic=True)
    assert run.certificate.passed


@pytest.mark.parametrize("method", ["moreau", "sdirk"])
@pytest.mark.parametrize(("kind", "seed"), TIED)
def test_what_passes_a_floating_capacitor_is_there_at_once(kind, seed, method):
    """The first row is the same with steps as mode by mode: charges are given there."""
    random = generate(kind, seed)
    circuit = nsspice.read(random.text)
    stop, step = STEPS * random.step, random.step
    first, exact = (
        nsspice.tran(circuit, stop, step, step=step, method=m, uic=True)
        for m in (method, "modewise")
    )
    for kind_of_signal in "v", "i":
        names = [name for name in exact.signals if name[0] == kind_of_signal]
        size = max(abs(exact[name][0]) for name in names)
        assert all(abs(first[name][0] - exact[name][0]) < 1e-8 * size for name in names)

"""Errors measured as energies: means and powers stay right, faint ringing is not followed."""

from __future__ import annotations

import pytest
from click.testing import CliRunner

import nsspice
from nsspice.analyses import Solution
from nsspice.cli.app import app

BUCK = """buck whose diode rings with a stray inductance
Vin in 0 24
Vg g 0 PULSE(0 1 0 10n 10n 5u 10u)
S1 in sw g 0 mos
Coss in sw 150p IC=24
Lst d sw 20n IC=2.4
D1 0 d sch
Cj 0 d 300p IC=0
L1 sw out 100u IC=2.4
C1 out 0 20u IC=12
R1 out 0 5
.model mos SW(VT=0.5 Ron=10m Roff=1meg)
.model sch D(Ron=20m Vfwd=0.4 Roff=100k)
.tran 1u 100u uic
.meas tran vo avg v(out) from=50u to=100u
.meas tran pin avg -v(in)*i(vin) from=50u to=100u
.meas tran psw avg v(sw)*i(l1) from=50u to=100u
"""
RING = """50 MHz, 2 V and 1 nJ beside 100 W
Vg g 0 PULSE(0 48 0 10n 10n 5u 10u)
L1 g out 100u
C1 out 0 20u IC=24
R1 out 0 5
Lr out r 20n
Rr r s 0.05
Cr s 0 500p IC=22
Vk k 0 1
Rk k q 1
S1 q 0 s out comp
.model comp SW(VT=1 VH=0.1 Ron=10m Roff=1meg)
.tran 10n 2u uic
"""


def _run(deck: str, **choices: object) -> Solution:
    return nsspice.read(deck).run(**choices)[0]  # type: ignore[arg-type]


def _steps(run: Solution) -> int:
    return int(run.islands[0].stats["steps"])


def test_means_and_powers_are_right_though_ringing_is_not_followed() -> None:
    """The closed forms are the reference.

    Each step may move a mean over a period by ``reltol`` times the range of the unknown (30 V at
    ``sw``, 3 A); errors of single steps have no sign in common, and those of N steps in a period
    add up like sqrt(N).
    """
    exact = _run(BUCK)
    assert exact.islands[0].method == "modewise"
    run = _run(BUCK, method="sdirk", accuracy="energy")
    assert "small ringing is damped" in run.islands[0].note
    assert run.certificate is not None
    assert run.certificate.passed
    each = 1e-4 * (_steps(run) / 10.0) ** 0.5
    assert run.measures["vo"] == pytest.approx(exact.measures["vo"], rel=each)
    for name in ("pin", "psw"):  # about 30 W, whose range in a period is 24 V times 3 A
        assert run.measures[name] == pytest.approx(exact.measures[name], abs=each * 72.0)
    # the diode's 66 MHz in one half of all periods, the switch's 92 MHz in the other: followed to
    # 1e-5 they take 174,000 steps, 22 a cycle
    assert _steps(run) < 0.1 * 79e6 * 100e-6 * 22


def test_signals_are_followed_however_little_energy_they_have() -> None:
    """A comparator that reads the ringing turns as often as with the usual measure."""
    usual = _run(RING, method="sdirk")
    run = _run(RING, method="sdirk", accuracy="energy")
    turns = [sum(e.element == "s1" for e in r.events) for r in (usual, run)]
    assert turns[0] > 5
    assert turns[0] == turns[1]
    # nothing reads it: it is damped
    alone = "\n".join(line for line in RING.splitlines() if not line.startswith("S1"))
    assert _steps(_run(alone, method="sdirk", accuracy="energy")) < 0.5 * _steps(run)


@pytest.mark.parametrize(
    ("deck", "method", "why"),
    [
        ("a\nV1 a 0 SIN(0 1 1k)\nR1 a b 1\nD1 b 0 d\n.model d D(Is=1e-12)\n.tran 1u 1m\n", "sdirk",
         "no element stores energy"),
        (BUCK, "auto", "modewise has no error control"),
        (BUCK.replace(".tran 1u 100u", ".tran 1u 1u"), "moreau",
         "moreau has no error control"),
    ],
)  # fmt: skip
def test_it_is_told_where_there_is_nothing_to_measure(deck: str, method: str, why: str) -> None:
    """The option has no effect there, and the summary says so."""
    note = _run(deck, method=method, accuracy="energy", on_failure="ignore").islands[0].note
    assert f"accuracy=energy has no effect: {why}" in note


def test_the_deck_may_ask_for_it() -> None:
    """As ``.options accuracy=energy``; ``reltol`` is then 1e-4 unless it is given."""
    deck = BUCK.replace(".tran 1u 100u", ".options accuracy=energy method=sdirk\n.tran 1u 1u")
    assert _run(deck).islands[0].reltol == 1e-4
    assert _run(deck, reltol=1e-3).islands[0].reltol == 1e-3
    assert _run(deck, accuracy="waveforms").islands[0].reltol == 1e-5


def test_other_words_are_refused() -> None:
    """With the place in the deck, and by the command line."""
    with pytest.raises(nsspice.UsageError, match=r"accuracy cannot be 'energies'"):
        _run(BUCK + ".options accuracy=energies\n")
    refused = CliRunner().invoke(app, ["run", "a.net", "--accuracy", "power"])
    assert refused.exit_code == 2
    assert "waveforms" in refused.output

"""Which of several solutions a run starts with: ``.nodeset``, ``.ic``, and when neither can choose.

The law |u + x| - |u - x| - u = 0 has the solutions 2 x, 0 and -2 x for x > 0.
"""

from __future__ import annotations

import pytest

import nsspice
from nsspice.analyses.static.initial import guess_of

LAW = "B1 u 0 I=abs(v(u)+v(x))-abs(v(u)-v(x))-v(u)\nR1 u 0 1e12\n"
STATIC = f"several solutions\nV1 x 0 PWL(0 1 1 2)\n{LAW}"
STORED = f"several solutions beside a capacitor\nC1 x 0 1 IC=1\nR2 x 0 1\n{LAW}"


def told(text: str) -> list[str]:
    """Return what the warnings NS3054 of a run say."""
    return [w.message for w in nsspice.read(text).run()[0].warnings if w.code == "NS3054"]


@pytest.mark.parametrize("card", [".nodeset", ".ic"])
@pytest.mark.parametrize("uic", ["", "uic"])
@pytest.mark.parametrize("factor", [2.0, -2.0])
def test_a_circuit_without_storage(card: str, uic: str, factor: float) -> None:
    """``.ic`` was dropped there, and the run began at zero."""
    text = f"{STATIC}{card} v(u)={0.9 * factor}\n.tran 0.1 1 {uic}\n"
    run = nsspice.read(text).run()[0]
    # 1 TOhm takes 2e-12 A of a slope of 1 S
    assert run["v(u)"] == pytest.approx(factor * (1.0 + run.time), rel=1e-9)
    assert not told(text)


@pytest.mark.parametrize("factor", [2.0, -2.0])
def test_a_sweep(factor: float) -> None:
    text = f"{STATIC}.nodeset v(u)={0.9 * factor}\n.dc V1 1 2 0.1\n"
    run = nsspice.read(text).run()[0]
    assert run["v(u)"] == pytest.approx(factor * run.axis, rel=1e-9)


@pytest.mark.parametrize("factor", [2.0, -2.0])
def test_nodeset_beside_held_nodes(factor: float) -> None:
    """While ``.ic`` held x, ``.nodeset`` of all other nodes was forgotten: y began at 0 V."""
    charged = f"{STORED}R3 u y 1k\nC2 y 0 1\n.ic v(x)=1\n"
    text = f"{charged}.nodeset v(u)={factor} v(y)={factor}\n.tran 0.1m 1m\n"
    run = nsspice.read(text).run()[0]
    # the voltage of 1 F, of which 1 kOhm takes nothing in no time
    assert float(run["v(y)"][0]) == pytest.approx(factor, rel=1e-6)


def test_what_nothing_stores_is_not_kept_and_said_so() -> None:
    """Rates say nothing about u, and its start is none of the solutions that were asked for."""
    (told_of,) = told(f"{STORED}.ic v(u)=2\n.tran 0.1 1 uic\n")
    assert ".ic v(u)=2 is not kept" in told_of
    # a circuit leaves 0 V at once, where abs() has a gain of two, and rests at -2 V or 2 V
    (told_of,) = told(f"{STORED}.ic v(u)=0\n.tran 0.1 1 uic\n")
    assert ".ic v(u)=0 is not kept" in told_of
    (told_of,) = told(f"{STORED}.nodeset v(u)=2 v(x)=1\n.tran 0.1 1 uic\n")
    assert ".nodeset of v(u), v(x) has no effect" in told_of


@pytest.mark.parametrize(
    "cards",
    [
        ".ic v(x)=1\n.tran 0.1 1 uic",
        ".ic v(x)=1\n.tran 0.1 1",
        ".nodeset v(x)=1\n.tran 0.1 1",
    ],
)
def test_nothing_is_said_of_what_is_kept(cards: str) -> None:
    assert not told(f"{STORED}{cards}\n")


@pytest.mark.parametrize("method", ["modewise", "sdirk"])
def test_the_voltage_named_is_that_of_the_first_instant(method: str) -> None:
    """The exact engine named that of the end of its first interval, 1 V."""
    text = "no storage at b\nV1 a 0 PWL(0 1 1 3)\nR1 a b 2k\nR2 b 0 1k\nC1 a 0 1u\n.ic v(b)={}\n"
    run = nsspice.read(text.format(7) + ".tran 0.1 1 uic\n").run(method=method)[0]
    (said,) = [w.message for w in run.warnings if w.code == "NS3054"]
    assert "starts with 0.333333 V" in said
    assert not told(text.format(1 / 3) + ".tran 0.1 1 uic\n")


@pytest.mark.parametrize("scale", [0.01, 1.0, 100.0])
def test_a_diode_that_nodeset_puts_near_its_threshold_begins_with_current(scale: float) -> None:
    """A thousandth of the largest voltage counts as near, whatever that voltage is."""
    model = f".model DM D(VFWD={scale})\n"
    circuit = nsspice.read(
        f"near\nR1 a 0 1\nD1 a b DM\nR2 b 0 1\n.nodeset v(a)={100 * scale}\n{model}"
    )
    mna = circuit.islands[0].assemble(27.0)
    for short, conducts in ((-1.0, True), (0.05, True), (0.15, False), (2.0, False)):
        guess = guess_of(circuit, mna, {"b": (99.0 + short) * scale})
        assert guess is not None
        assert (guess[1] > 0.0).tolist() == [conducts]

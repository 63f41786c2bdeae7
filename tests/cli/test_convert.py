"""``nsspice convert``: the clean deck is the same circuit, and converting it again changes nothing.

The independent source of the waveforms is the original deck.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result

import nsspice
from nsspice.errors import NsspiceError
from nsspice.output.deck.conversion import convert

Call = Callable[..., Result]

NETLISTS = Path(__file__).parents[2] / "netlists"
FILES = sorted(NETLISTS.rglob("*.net"))
#: short runs of all kinds: switches, curves, junctions, control, sampled control, steady states
RUN = [
    "basics/controlled_sources",
    "bipolar/schmitt_trigger",
    "control/second_order_filter",
    "converters/buck",
    "rectifiers/full_bridge",
    "smooth/clamp",
    "steady/half_wave",
]
CHOSEN = [path for path in FILES if path.relative_to(NETLISTS).with_suffix("").as_posix() in RUN]

#: what other programs write, and most lines of nsspice's own
FOREIGN = """R1 a 0 5
* LTspice and PSpice forms
.param f=50 w={2*pi*f} half = 'w/2'
.func sq(x) {x*x}
.include models.lib
V1 in 0 SINE(0 10 {f}
+ ) Rser=1m
V2 n2 0 PWL REPEAT FOR 2 (0 0 1m 1 2m 0) ENDREPEAT +1m 3
V3 n3 0 PWL(0 0 +1m 2 +1m 0) r=0
I1 n3 0 TBL(0 0 1 1m)
R1 in a 2k2 noiseless tol=5 mfg=ACME
R2 a 0 {1k + sq(f)}
R3 b 0 rmod 1k
C1 a 0 10u IC=1
C2 b 0 Q={1u*x + 1n*x**3}
L1 a b 1m Rser=1
L2 c 0 1m
K1 L1 L2 0.5
Rc c 0 1
D1 a b 1N4148
D2 b 0 ideal
Q1 b b 0 npn1 2
M1 b in 0 0 nm W=10u L=1u
S1 b d in 0 sw1 off
Rd d 0 1k
E1 e 0 LAPLACE {v(a)} = {1/(1 + 1m*s)}
E2 e2 0 TABLE {v(a)} = (0,0) (1,2)
E3 e3 0 POLY(2) a 0 b 0 1 2 3
F1 f1 0 POLY(1) V1 0 1 2
G1 g1 0 VALUE={v(a)*v(b)}
E4 e4 0 ZTRANS {v(a)} = {0.5/(z - 0.5)} period=1m
B1 h 0 V=if(v(a)>1, idt(v(b)), 2)
Rg g1 0 1
Rf f1 0 1
T1 a 0 t2 0 Z0=50 TD=1m
Rt t2 0 50
Agate a b 0 0 0 0 o 0 AND Vhigh=5
A2 [a ~b] q gate
.model gate d_nand(rise_delay=200u fall_delay=200u)
Xdiv a b div m=2 r=3k
.subckt div p q r=1k
R1 p q {r}
.if (r > 2k)
R2 p q 1k
.else
R2 p q 2k
.endif
.ends
.subckt unused a b
R1 a b 1
.ends
.model rmod R(tc1=1m)
.model ideal D
.model sw1 SW(Ron=1m Roff=1meg Vt=1 Vh=0)
.model npn1 NPN(BF=100 IS=1e-15 KF=1e-16)
.options gmin=1e-12 reltol=1e-4 itl4=100
.backanno
.fft v(a)
.tran 10u 4m steady
.measure tran peak MAX v(a)
.print tran v(a) v(nowhere)
.end
"""
MODELS = """.model nm NMOS(VTO=1 KP=1m)
.model other NMOS(VTO=1)
"""


@pytest.fixture
def foreign(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the deck with its library, in the current folder."""
    monkeypatch.chdir(tmp_path)
    Path("models.lib").write_text(MODELS, "utf-8")
    path = Path("foreign.cir")
    path.write_text(FOREIGN, "utf-8")
    return path


def same_waveforms(one: nsspice.Circuit, other: nsspice.Circuit) -> None:
    """Compare all signals of all analyses: the same numbers go into the same arithmetic."""
    for a, b in zip(one.run(), other.run(), strict=True):
        assert list(a.signals) == list(b.signals)
        np.testing.assert_array_equal(a.axis, b.axis)
        for name in a.signals:
            scale = np.max(np.abs(a[name]), initial=1e-300)
            np.testing.assert_allclose(b[name], a[name], rtol=0, atol=1e-12 * scale, err_msg=name)


def test_every_netlist_converts_to_the_same_circuit() -> None:
    """Each result has been compared with its deck, element by element; again is the same text."""
    converted = 0
    for path in FILES:
        try:
            nsspice.read(path)
        except NsspiceError:
            continue  # a file for others to include, or one that is to be refused
        clean = convert(path)
        again = convert(clean.text)
        assert (again.text, again.notes) == (clean.text, ()), path
        converted += 1
    assert converted > 150


@pytest.mark.parametrize("path", CHOSEN, ids=lambda p: p.stem)
def test_waveforms_are_the_same(path: Path) -> None:
    same_waveforms(nsspice.read(path), nsspice.read(convert(path).text))


@pytest.mark.soak
@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_all_waveforms_are_the_same(path: Path) -> None:
    try:
        circuit = nsspice.read(path)
        circuit.run()
    except NsspiceError:
        return
    same_waveforms(circuit, nsspice.read(convert(path).text))


def test_a_foreign_deck_runs_as_before(foreign: Path) -> None:
    clean = convert(foreign)
    assert convert(clean.text) == (type(clean))(clean.text, ())
    # lines and gates with delays make runs long
    slow = re.compile("^(?:E4|T1|Rt|Agate|A2) .*\n", re.MULTILINE)
    foreign.write_text(slow.sub("", FOREIGN), "utf-8")
    clean = convert(foreign)
    Path("models.lib").unlink()
    again = nsspice.read(clean.text)
    Path("models.lib").write_text(MODELS, "utf-8")
    same_waveforms(nsspice.read(foreign), again)


def test_each_difference_is_noted(foreign: Path) -> None:
    notes = convert(foreign).notes
    for part in (
        "the first line is treated as the title",
        "2k2 is read as 2000",
        "option gmin is ignored",
        "option itl4 controls other programs",
        ".fft is ignored",
        "steady does not end the run early",
        "kf of model npn1 cannot change the results",
        "model 1n4148 is not in the deck",
        "nowhere",
        "models.lib is no longer needed",
        "model other is not used",
        "subcircuit unused is not used",
    ):
        assert any(part in note for note in notes), part
    assert len(notes) == 12, notes


def test_structure_is_kept(foreign: Path) -> None:
    text = convert(foreign).text
    for line in (
        "* R1 a 0 5",
        ".param w={2*pi*f}",
        "R1 in a 2k noisy=0",
        "Xdiv a b div m=2 r=3k",
        ".subckt div p q r=1k",
        ".if r > 2000",
        "S1 b d in 0 sw1 off",
        "E1 e 0 LAPLACE {v(a)} = {1/(1 + 0.001*s)}",
        ".tran 10u 4m",
        ".save v(a)",
    ):
        assert f"\n{line}\n" in f"\n{text}", line


def test_a_branch_that_cannot_be_read_is_left_out() -> None:
    deck = (
        "choice\n.param p=1\nV1 a 0 1\n.if (p == 1)\nR1 a 0 1k\n.else\nR1 a 0 1 2 3\n.endif\n.op\n"
    )
    clean = convert(deck)
    assert clean.notes == ("branch of .if on line 7 is not used, and left out",)
    assert ".if p == 1\nR1 a 0 1k\n.else\n.endif\n" in clean.text
    assert convert(clean.text) == type(clean)(clean.text, ())


def test_on_the_command_line(call: Call) -> None:
    Path("a.cir").write_text("lamp\nV1 a 0 1\nR1 a 0 2k2\n.op\n", "utf-8")
    told = call("convert", "a.cir")
    assert told.stdout == "lamp\nV1 a 0 1\nR1 a 0 2k\n.op\n.end\n"
    assert "note: line 3: 2k2 is read as 2000" in told.stderr
    told = call("convert", "a.cir", "-o", "b.net", "--notes", "b.txt")
    assert "note" not in told.stderr.replace("b.txt", "")
    assert Path("b.net").read_text("utf-8").startswith("lamp\n")
    assert Path("b.txt").read_text("utf-8").startswith("line 3: 2k2")
    assert call("convert", "a.cir", "-o", "a.cir").exit_code == 2
    assert call("convert", "a.cir", "-o", "b.net").exit_code == 2  # no file is replaced unasked
    assert call("convert", "a.cir", "-o", "b.net", "--force", "--json").exit_code == 0

"""Dot lines: analyses, outputs, measurements, options."""

from __future__ import annotations

import pytest

import nsspice
from nsspice.netlist import Deck, NetlistError, parse_text
from nsspice.netlist.deck import TranCard

CIRCUIT = "title\nV1 in 0 5\nR1 in out 1k\nL1 out 0 1m\n.param r=1k f=50\n"


def deck(*lines: str) -> Deck:
    return parse_text(CIRCUIT + "\n".join(lines))


def codes(*lines: str) -> list[str]:
    with pytest.raises(NetlistError) as caught:
        deck(*lines)
    return [d.code for d in caught.value.diagnostics]


@pytest.mark.parametrize(
    ("line", "wanted"),
    [
        (".tran 1u 1m", (1e-6, 1e-3, 0.0, None, False)),
        (".TRAN 1u 1m 0.1m 2u UIC", (1e-6, 1e-3, 1e-4, 2e-6, True)),
        (".tran 1m", (None, 1e-3, 0.0, None, False)),
        (".tran 0 1m", (None, 1e-3, 0.0, None, False)),
        (".tran 1u {1/f} uic", (1e-6, 0.02, 0.0, None, True)),
    ],
)
def test_tran(line: str, wanted: tuple[object, ...]) -> None:
    (card,) = deck(line).analyses
    assert (card.tstep, card.tstop, card.tstart, card.tmax, card.uic) == wanted


def test_dc() -> None:
    (card,) = deck(".dc V1 0 1 0.1 r1 1k 3k 1k").analyses
    first, second = card.sweeps
    assert (first.name, first.kind) == ("v1", "element")
    assert first.values[-1] == 1.0
    assert len(first.values) == 11
    assert second.values == (1e3, 2e3, 3e3)
    (card,) = deck(".dc temp -10 10 10").analyses
    assert (card.sweeps[0].kind, card.sweeps[0].values) == ("temp", (-10.0, 0.0, 10.0))
    (card,) = deck(".dc v1 5 0 -2.5").analyses
    assert card.sweeps[0].values == (5.0, 2.5, 0.0)
    (card,) = deck(".dc v1 0 1 0.3").analyses
    assert len(card.sweeps[0].values) == 4
    assert card.sweeps[0].values[-1] < 1.0
    (card,) = deck(".dc v1 list 1 5 2").analyses
    assert card.sweeps[0].values == (1.0, 5.0, 2.0)
    (card,) = deck(".dc dec v1 1 100 1").analyses
    assert card.sweeps[0].values == (1.0, 10.0, 100.0)


@pytest.mark.parametrize(
    ("given", "wanted"),
    [
        ("dec 1 1 1k", (1.0, 10.0, 100.0, 1000.0)),
        ("dec 2 1 10", (1.0, 10.0**0.5, 10.0)),
        ("dec 1 1 50", (1.0, 10.0)),  # beyond the last whole point there is none
        ("oct 1 3 24", (3.0, 6.0, 12.0, 24.0)),
        ("lin 3 0 10", (0.0, 5.0, 10.0)),
        ("lin 1 7 9", (7.0,)),
        ("list 5 1", (5.0, 1.0)),
    ],
)
def test_frequencies(given: str, wanted: tuple[float, ...]) -> None:
    (card,) = deck(".ac " + given).analyses
    assert card.frequencies == pytest.approx(wanted, rel=1e-15)
    assert card.frequencies[-1] == wanted[-1]


def test_step() -> None:
    found = deck(".step param r list 1 2 3", ".step temp 0 100 50", ".step dec param f 1 10 2")
    first, second, third = found.steps
    assert (first.name, first.kind, first.values) == ("r", "param", (1.0, 2.0, 3.0))
    assert (second.kind, second.values) == ("temp", (0.0, 50.0, 100.0))
    assert third.values == pytest.approx((1.0, 10**0.5, 10.0))
    assert deck(".step v1 0 1 1").steps[0].kind == "element"
    assert deck(".step r 1 2 1").steps[0].kind == "param"


def test_a_stepped_parameter_needs_no_definition() -> None:
    text = "t\nR1 a 0 {x}\n.step param x 5 6 1"
    assert parse_text(text).elements[0].value == 5.0
    assert parse_text(text, params={"x": 6.0}).elements[0].value == 6.0


@pytest.mark.parametrize("word", ["uic", "UIC", "skipbp"])
def test_initial_values_of_elements_may_be_asked_for(word: str) -> None:
    (card,) = deck(f".tran 1u 1m {word}").analyses
    assert isinstance(card, TranCard)
    assert card.uic


@pytest.mark.parametrize(
    ("line", "code"),
    [
        (".tran", "NS1080"),
        (".tran 1u 1m 2m", "NS1080"),
        (".tran 1m 1u", "NS1080"),
        (".tran 1u -1m", "NS1080"),
        (".tran 1 2 3 4 5", "NS1080"),
        (".tran 1u 1m uix", "NS1080"),
        (".tran step=1u", "NS1080"),
        (".dc", "NS1080"),
        (".dc v1 0 1", "NS1080"),
        (".dc v1 0 1 0", "NS1080"),
        (".dc v1 0 1 -1", "NS1080"),
        (".dc v1 0 1 1e-12", "NS1080"),
        (".dc v2 0 1 1", "NS1070"),
        (".step param", "NS1080"),
        (".step nothing 1 2 1", "NS1070"),
        (".op 1", "NS1080"),
        (".temp", "NS1080"),
        (".ic v(zz)=1", "NS1071"),
        (".ic v(0)=1", "NS1080"),
        (".nodeset v(ot)=1", "NS1071"),
        (".meas tran x", "NS1080"),
        (".meas trann x max v(in)", "NS1080"),
        (".meas tran x maxx v(in)", "NS1080"),
        (".meas tran x max", "NS1080"),
        (".meas tran x max v(zz)", "NS1071"),
        (".meas tran x find v(in)", "NS1080"),
        (".meas tran x when v(in)", "NS1080"),
        (".meas tran x trig v(in) val=1", "NS1080"),
        (".meas tran x when v(in)=1 rise=0", "NS1080"),
        (".meas tran x avg v(in) when v(in)=1", "NS1080"),
        (".meas tran x avg v(in) trig at=1 trig at=2", "NS1080"),
        (".meas tran x param='y*2'", "NS1021"),
        (".noise i(v1) v1 dec 10 1 1k", "NS1080"),
        (".noise v(out) v9 dec 1 1 1", "NS1070"),
        (".noise v(out) v1", "NS1080"),
        (".tf v(out)", "NS1080"),
        (".tf i(r1) v1", "NS1080"),
        (".tf v(out) v9", "NS1070"),
        (".sens", "NS1080"),
        (".hb 1 1", "NS1080"),
        (".trann 1 2", "NS1001"),
        (".", "NS1001"),
        (".endl", "NS1044"),
        (".control", "NS1044"),
    ],
)
def test_refused(line: str, code: str) -> None:
    assert codes(line) == [code]


@pytest.mark.parametrize(
    ("line", "code"),
    [
        (".fft v(out)", "NS1003"),
        (".options rshunt=1e12", "NS1003"),
        (".options foo=1", "NS1081"),
        (".save v(zz)", "NS1071"),
        (".save i(zz)", "NS1070"),
        (".save @r1[foo]", "NS1071"),
        (".print noise v(out)", "NS1003"),
        (".meas noise x max v(out)", "NS1003"),
        (".control\nrun\nplot v(out)\n.endc", "NS1090"),
        (".tran 1m nodiscard", "NS1003"),
    ],
)
def test_warnings(line: str, code: str) -> None:
    assert [w.code for w in deck(line).warnings] == [code]


@pytest.mark.parametrize(
    "line", [".backanno", ".width out=80", ".options plotwinsize=0", ".opt list node"]
)
def test_silent_cards(line: str) -> None:
    assert not deck(line).warnings


def test_outputs() -> None:
    found = deck(".save V(out) i(R1) all @l1[i] v1#branch in", ".print tran v(in,out) V(out)",
                 ".probe p(r1) alli", ".plot tran v(in) (0,5)")  # fmt: skip
    assert [s.name for s in found.saves] == [
        "v(out)", "i(r1)", "all", "i(l1)", "i(v1)", "v(in)", "v(in,out)", "p(r1)", "alli",
    ]  # fmt: skip


def test_an_instance_is_no_output() -> None:
    """KiCad probes the power of every symbol, of subcircuits too."""
    found = parse_text("t\nX1 a s\n.subckt s p\nR1 p 0 1\n.ends\n.probe p(X1) i(x1.r1)\n.op")
    assert [s.name for s in found.saves] == ["i(x1.r1)"]
    assert [(w.code, w.hint) for w in found.warnings] == [
        ("NS1070", "name an element inside it: i(x1.r1)")
    ]


def test_initial_values() -> None:
    found = deck(".ic V(out)=2 v(in) = {r} i(L1)=3", ".nodeset v(out)=1")
    assert {k: p.value for k, p in found.initial.items()} == {"out": 2.0, "in": 1000.0}
    assert {k: p.value for k, p in found.nodesets.items()} == {"out": 1.0}
    assert found.elements[2].params["ic"].value == 3.0


def test_initial_values_in_a_subcircuit() -> None:
    found = parse_text("t\nX1 a s\n.subckt s p\nR1 p q 1\nR2 q 0 1\n.ic v(q)=3\n.tran 1 2\n.ends")
    assert found.initial["x1.q"].value == 3.0
    assert [w.code for w in found.warnings] == ["NS1003"]


def test_options() -> None:
    found = deck(".options reltol=1e-4 method=gear noinit", ".options theta={r/2k}")
    values = {k: p.value for k, p in found.options.items()}
    assert values == {"reltol": 1e-4, "method": "gear", "noinit": 1.0, "theta": 0.5}
    assert deck(".options temp=40").temperature == 40.0


@pytest.mark.parametrize(
    ("text", "operation"),
    [
        ("max v(out)", "max"),
        ("MIN v(in,out) from=0 to={1/f}", "min"),
        ("pp i(r1)", "pp"),
        ("avg v(out)*i(r1) from=1u", "avg"),
        ("rms par('v(out)')", "rms"),
        ("integ {v(out)}", "integ"),
        ("integral v(out)", "integ"),
        ("max_at v(out)", "max_at"),
        ("find v(out) at=1m", "find_at"),
        ("find v(out)-v(in) when v(in)=2 rise=1", "find_when"),
        ("when v(in)=v(out) cross=last td=1u", "when"),
        ("deriv v(out) at=1m", "deriv"),
        ("trig v(in) val=1 td=1u rise=1 targ v(out) val=2 fall=2", "trig_targ"),
        ("trig at=1u targ v(out) val=2", "trig_targ"),
        ("avg v(out) trig v(in) val=1 rise=1 targ v(in) val=1 rise=2", "avg"),
        ("pp v(out) targ at=1m", "pp"),
        ("param='2*r'", "param"),
    ],
)
def test_measures(text: str, operation: str) -> None:
    (found,) = deck(f".meas tran x {text}").measures
    assert (found.name, found.analysis, found.operation) == ("x", "tran", operation)


def test_the_parts_of_a_measure() -> None:
    (found,) = deck(
        ".measure tran t trig v(in) val=1 td=1u rise=3 targ v(out) val={r} fall=last"
    ).measures
    first, second = found.first, found.second
    assert (first.signal.text, first.value, first.edge, first.index, first.delay) == (
        "v(in)", 1.0, "rise", 3, 1e-6,
    )  # fmt: skip
    assert (second.value, second.edge, second.index) == (1000.0, "fall", 0)
    (found,) = deck(".meas tran w find v(out)*2 when v(in)=v(out) cross=2").measures
    assert found.expression.text == "v(out)*2"
    assert found.first.signal.text == "v(in)"
    assert found.first.other.text == "v(out)"
    (found,) = deck(".meas tran a avg v(out) from=1m to=2m").measures
    assert (found.start, found.stop) == (1e-3, 2e-3)


@pytest.mark.parametrize(
    ("loose", "strict"),
    [
        (".meas tran a avg v(out) from 1m to 2m", ".meas tran a avg v(out) from=1m to=2m"),
        (".meas a avg v(out) from 1m to {2*r}", ".meas tran a avg v(out) from=1m to={2*r}"),
        (".meas a find v(out) at 3m", ".meas tran a find v(out) at=3m"),
        (
            ".meas a trig v(in) val 1 td 1u rise 3 targ v(out) val 2 fall last",
            ".meas tran a trig v(in) val=1 td=1u rise=3 targ v(out) val=2 fall=last",
        ),
        (
            ".meas a avg v(out) trig v(in)=1 rise=3 targ v(in)=2 fall=last",
            ".meas tran a avg v(out) trig v(in) val=1 rise=3 targ v(in) val=2 fall=last",
        ),
        (".meas a param 2*r", ".meas tran a param='2*r'"),
    ],
)
def test_measures_as_ltspice_writes_them(loose: str, strict: str) -> None:
    found, wanted = (deck(line).measures[0] for line in (loose, strict))
    for part in ("analysis", "name", "operation", "start", "stop", "at"):
        assert getattr(found, part) == getattr(wanted, part)
    for one, other in ((found.first, wanted.first), (found.second, wanted.second)):
        if other is None:
            assert one is None
            continue
        assert (one.value, one.edge, one.index, one.delay) == (
            other.value, other.edge, other.index, other.delay,
        )  # fmt: skip


def test_a_measure_of_measures() -> None:
    _, found = deck(".meas tran top max v(out)", ".meas tran twice param='top*2+r'").measures
    assert found.expression.variables() == {"top"}
    assert found.expression.evaluate({"top": 2.0}) == 1004.0


def test_an_empty_deck() -> None:
    for text in ("", "title", "title\n.tran 1u 1m\n"):
        with pytest.raises(NetlistError) as caught:
            parse_text(text)
        assert caught.value.code == "NS1091"


def test_measurements_of_one_name_are_all_made() -> None:
    """ngspice prints both; the second one gets a name of its own."""
    found = deck(".tran 1u 1m", *[f".meas tran x max v(out) to={k}m" for k in (1, 2, 3)])
    assert [(m.name, m.stop) for m in found.measures] == [("x", 1e-3), ("x#2", 2e-3), ("x#3", 3e-3)]
    assert [w.code for w in found.warnings] == ["NS1006", "NS1006"]


def test_harmonic_balance_is_the_periodic_steady_state() -> None:
    for text in (".hb 1meg", ".hb tones=1meg nharms=20"):
        one, other = (
            nsspice.run(nsspice.read(f"x\nV1 a 0 SIN(1 2 1meg)\nR1 a b 1k\nC1 b 0 1n\n{card}\n"))[0]
            for card in (text, ".pss fund=1meg")
        )
        assert one["v(b)"].tolist() == other["v(b)"].tolist()
    for wrong in (".hb", ".hb 1meg 1.1meg", ".hb 0", ".hb 1meg order=3", ".hb 1meg nharms=0.5"):
        with pytest.raises(NetlistError, match=r"\.hb"):
            nsspice.read(f"x\nV1 a 0 SIN(1 2 1meg)\nR1 a 0 1k\n{wrong}\n")

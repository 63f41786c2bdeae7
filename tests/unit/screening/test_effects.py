"""Which effect matters: decks whose answer is known beforehand."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import pytest

import nsspice
from nsspice.netlist.deck import Deck
from nsspice.screening import effects
from nsspice.screening.candidates import candidates
from nsspice.screening.edits import without
from nsspice.screening.line_fit import straight
from nsspice.screening.result import EffectRow, EffectsReport

#: the drop of the diode costs 0.35 V of 12 V; the stray elements are worth microvolts, and the
#: second diode, a junction that never conducts, is what forces steps with error control
BUCK = """buck with effects
Vin in 0 24
Vg g 0 PULSE(0 1 0 10n 10n 5u 10u)
S1 in sw g 0 mos
D1 0 sw dsch
D2 0 sw body
L1 sw out 100u IC=0.5 Rser=50m Cpar=10p
C1 out 0 10u IC=11
R1 out 0 5
Rleak out 0 1meg
.model mos SW(VT=0.5)
.model dsch D(Vfwd=0.4)
.model body D(IS=1e-14 N=1.5 CJO=50p)
.tran 1u 300u uic
.measure tran vavg AVG v(out) FROM=100u TO=300u
.end
"""


@pytest.fixture(scope="module")
def report() -> nsspice.screening.EffectsReport:
    return effects(nsspice.read(BUCK), 1e-3, workers=1)


def test_what_matters_stays_and_what_costs_goes(report) -> None:
    verdicts = {row.edit.name: row.verdict for row in report.rows}
    assert verdicts["d2: parallel diode"] == "drop"
    for name in ("model dsch: forward drop", "l1.rser: series resistance"):
        row = next(r for r in report.rows if r.edit.name == name)
        assert row.change > 1e-3
        assert verdicts[name] in ("keep", "no cost")
    # 0.4 V for the half of the period in which the diode conducts, of 12 V
    drop = next(r for r in report.rows if r.edit.effect == "forward drop")
    assert drop.change == pytest.approx(0.2 / 11.7, rel=0.2)
    assert next(r for r in report.rows if r.edit.owner == "rleak").change < 1e-4


def test_the_recommendation_has_been_run(report) -> None:
    assert report.change <= 1e-3
    assert report.methods[0] == ("sdirk",)
    assert report.methods[1] == ("modewise",)
    assert report.values["vavg"] == pytest.approx(report.reference["vavg"], rel=1e-3)
    assert report.seconds[1] < report.seconds[0]


def test_the_recommended_deck_says_what_was_left_out_and_gives_the_same(report) -> None:
    circuit = nsspice.read(BUCK)
    text = report.deck(BUCK, circuit.deck)
    assert "* removed: d2: parallel diode" in text
    found = nsspice.read(text).run()[0].measures["vavg"]
    assert found == pytest.approx(report.values["vavg"], rel=1e-12)


def test_a_set_valued_card_without_its_last_parameter_stays_set_valued() -> None:
    circuit = nsspice.read(BUCK)
    edit = next(e for e in candidates(circuit) if e.effect == "forward drop")
    model = next(e.model for e in without(circuit.deck, [edit]).elements if e.name == "d1")
    assert set(model.params) == {"ideal"}


def test_series_parasitics_become_wires_and_parallel_ones_vanish() -> None:
    circuit = nsspice.read(BUCK)
    edits = [e for e in candidates(circuit) if e.owner.startswith("l1.")]
    deck = without(circuit.deck, edits)
    assert not [e.name for e in deck.elements if e.name.startswith("l1.")]
    (inductor,) = [e for e in deck.elements if e.name == "l1"]
    assert inductor.nodes == ("sw", "out")


def test_a_deck_without_measures_is_judged_by_averages_and_extremes() -> None:
    deck = BUCK.replace(".measure", "*.measure").replace(".end\n", ".save v(out)\n.end\n")
    report = effects(nsspice.read(deck), 1e-3, workers=1)
    assert {name.partition(" ")[0] for name in report.reference} == {"avg", "max", "min"}
    assert "model dsch: forward drop" in [r.edit.name for r in report.rows if r.change > 1e-3]


def test_what_cannot_be_compared_is_refused() -> None:
    for text in ("t\nV1 a 0 1\nR1 a 0 1\n.op\n", BUCK.replace(".end\n", ".step param x 1 2 1\n")):
        with pytest.raises(nsspice.NsspiceError) as caught:
            effects(nsspice.read(text), workers=1)
        assert caught.value.diagnostics[0].code in ("NS4040", "NS1083", "NS1021", "NS1086")


def test_the_command_writes_deck_picture_and_json(tmp_path: Path, monkeypatch) -> None:
    from click.testing import CliRunner

    from nsspice.cli.app import app

    monkeypatch.chdir(tmp_path)
    Path("buck.net").write_text(BUCK)
    result = CliRunner().invoke(app, ["effects", "buck.net", "-j", "1", "--plot", "--json"])
    assert result.exit_code == 0, result.output
    data = json.loads(result.stdout)
    assert data["files"] == ["buck.cheap.net", "buck.effects.png"]
    assert "d2: parallel diode" in data["recommended"]["dropped"]
    assert Path("buck.effects.png").stat().st_size > 5000
    assert nsspice.read("buck.cheap.net").run()


#: a drop of a volt of 20 matters, and its curvature does: no straight line is good enough
CURVED = """rectifier behind an inductor
V1 in 0 SIN(0 20 10k)
L1 in a 10u
D1 a out DM
D2 0 a DM
C1 out 0 10u IC=15
R1 out 0 50
.model DM D(IS=1n N=1.7 RS=0.05 CJO=60p TT=20n)
.tran 1u 200u uic
.measure tran mean avg v(out) from=100u to=200u
"""


def test_junctions_as_broken_lines_are_recommended_and_run() -> None:
    report = effects(nsspice.read(CURVED), 4e-3, workers=1)
    (edit,) = (e for e in report.dropped if e.kind == "lines")
    assert edit.key == "lines:0.02"  # five times what measures may change by
    assert report.methods == (("sdirk",), ("modewise",))
    assert report.change <= 4e-3
    text = report.deck(CURVED, nsspice.read(CURVED).deck)
    assert "* removed: junctions:" in text
    found = nsspice.read(text).run()[0].measures["mean"]
    assert found == pytest.approx(report.values["mean"], rel=1e-12)


def test_a_deck_with_several_effects_less_is_the_circuit_that_was_run() -> None:
    split = CURVED.replace(" CJO=60p", "\n+ CJO=60p")
    for text in (CURVED, split):
        circuit = nsspice.read(text)
        edits = [*candidates(circuit, tol=4e-3), *straight(circuit, {"d1": 1.0, "d2": 0.0})]
        assert len(edits) == 6
        for count in (1, 2, 6):
            for chosen in itertools.combinations(edits, count):
                report = EffectsReport("", 1.0, [EffectRow(e, 0, "", 1, 1, "drop") for e in chosen])
                written = nsspice.read(report.deck(text, circuit.deck)).deck
                asked = without(circuit.deck, chosen)
                assert laws(written) == laws(asked), [e.name for e in chosen]


def laws(deck: Deck) -> list[tuple[object, ...]]:
    """Return elements and the values of their cards without where they stand."""
    found = []
    for e in deck.elements:
        card = {k: p.value for k, p in e.model.params.items()} if e.model else {}
        found.append((e.name, e.nodes, e.value, sorted(card.items(), key=str)))
    return found


def test_broken_lines_are_no_candidate_beside_smooth_transistors() -> None:
    text = CURVED.replace(".tran", "Q1 a a 0 QN\n.model QN NPN\n.tran")
    assert not [e for e in candidates(nsspice.read(text)) if e.kind == "lines"]
    again = nsspice.read(CURVED, junctions="lines")
    assert not [e for e in candidates(again) if e.kind == "lines"]

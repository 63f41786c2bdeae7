"""``.control`` blocks, lines after ``.end``, and analyses beside those that are computed."""

from __future__ import annotations

import math

import pytest

from nsspice import read
from nsspice.analyses.studies.batch import jobs_of
from nsspice.errors import UsageError
from nsspice.netlist import Deck, parse_text
from nsspice.netlist.deck import DcCard, OpCard, TranCard

CIRCUIT = "title\nV1 in 0 5\nR1 in out 1k\nC1 out 0 1u\n"


def deck(*lines: str) -> Deck:
    return parse_text(CIRCUIT + "\n".join(lines))


def program(*lines: str) -> Deck:
    return deck(".control", *lines, ".endc")


def values(found: Deck) -> list[dict[str, float]]:
    """What is altered before each run."""
    return [{a.label: a.values[0] for a in run.alterations} for run in found.runs]


def test_analyses_of_a_script_that_only_looks() -> None:
    found = deck(
        ".control",
        "  set color0=white",
        "  op",
        "  TRAN 1u 1m uic",
        "  dc v1 0 5 1",
        "  plot v(out)",
        ".endc",
    )
    point, transient, sweep = found.analyses
    assert isinstance(point, OpCard)
    assert isinstance(sweep, DcCard)
    assert isinstance(transient, TranCard)
    assert (transient.tstep, transient.tstop, transient.uic) == (1e-6, 1e-3, True)
    assert (transient.span.line, transient.span.column) == (8, 3)
    (warning,) = found.warnings
    assert warning.message == "of the .control block 'plot v(out)' is left out"


def test_numbers_of_the_deck_count_a_loop() -> None:
    """``.csparam`` hands numbers to the program; names of plots stand for nothing here."""
    found = deck(
        ".param step=0.5k",
        ".csparam first = 1k",
        ".csparam last={4*step} by='step'",
        ".control",
        "setplot new",
        "set plot_out = $curplot",
        "let r = first",
        "let count = floor((last - first)/by) + 1",
        "let k = 0",
        "dowhile k < count",
        "alter r1 $&r",
        "op",
        "setplot $plot_out",
        "let r = r + by",
        "let k = k + 1",
        "end",
        ".endc",
    )
    assert values(found) == [{"r1": 1e3}, {"r1": 1.5e3}, {"r1": 2e3}]


def test_the_script_runs_as_the_card_does() -> None:
    script = read(CIRCUIT + ".control\ntran 10u 1m uic\nplot v(out)\n.endc\n").run()[0]
    card = read(CIRCUIT + ".tran 10u 1m uic\n").run()[0]
    assert (script["v(out)"] == card["v(out)"]).all()


def test_alter_in_a_loop_with_measures_of_each_run() -> None:
    """Charging through R: closed form 5 V (1 - exp(-t / RC))."""
    runs = read(
        CIRCUIT + ".control\nforeach r 1k 2k\nalter r1 = $r\ntran 1u 1m uic\nlet twice = out*2\n"
        "meas tran late_$r find twice at=1m\nmeas tran half when v(out)=1\nend\n.endc\n"
    ).run()
    assert [run.parameters for run in runs] == [{"r1": 1e3}, {"r1": 2e3}]
    for run, tau, name in zip(runs, (1e-3, 2e-3), ("late_1k", "late_2k"), strict=True):
        assert set(run.measures) == {name, "half"}  # each belongs to its own run
        # both are interpolated on segments of the exact engine: rounding
        assert run.measures[name] == pytest.approx(10.0 * -math.expm1(-1e-3 / tau), rel=1e-12)
        assert run.measures["half"] == pytest.approx(-tau * math.log(0.8), rel=1e-12)


@pytest.mark.parametrize(
    ("lines", "altered"),
    [
        (["alter r1 2k", "op"], [{"r1": 2e3}]),
        (["alter @r1[resistance] = 2k", "op"], [{"@r1[resistance]": 2e3}]),
        (["let k = 1", "while k < 3", "alter r1 = k*1k", "op", "let k = k + 1", "end"],
         [{"r1": 1e3}, {"r1": 2e3}]),
        (["let k = 0", "dowhile k lt 2", "alter v1 dc = $&k", "op", "let k = k + 1", "end"],
         [{"@v1[dc]": 0.0}, {"@v1[dc]": 1.0}]),
        (["repeat 3", "op", "end"], [{}]),
        (["let r = 1k", "repeat 2", "let r = 3*r", "alter r1 = r", "op", "end"],
         [{"r1": 3e3}, {"r1": 9e3}]),
        (["if 2 > 1", "alter r1 = 5", "else", "alter r1 = 6", "end", "op"], [{"r1": 5.0}]),
        (["foreach t -40 25 125", "set temp = $t", "op", "end"],
         [{"temp": -40.0}, {"temp": 25.0}, {"temp": 125.0}]),
        (["option temp=50", "op"], [{"temp": 50.0}]),
        (["alter r1 = 7", "op", "reset", "op"], [{"r1": 7.0}, {}]),
        (["define f(x) x*x+1", "alter r1 = f(3)", "op"], [{"r1": 10.0}]),
        (["foreach k 1 2 3", "if $k eq 2", "continue", "end", "alter r1 = $k", "op", "end"],
         [{"r1": 1.0}, {"r1": 3.0}]),
        (["let big = log(1000)", "alter r1 = {$&big}", "op"], [{"r1": 3.0}]),
    ],
)  # fmt: skip
def test_programs(lines: list[str], altered: list[dict[str, float]]) -> None:
    found = program(*lines)
    assert values(found) == [pytest.approx(v, rel=1e-15) for v in altered]
    assert not found.warnings


def test_altered_values_act() -> None:
    """A divider of altered resistors, sources and models against Ohm's law."""
    circuit = (
        "divider\n.param top=1k\nV1 a 0 5\nR1 a b {top}\nR2 b 0 rm 1k\n.model rm r(tc1=0)\n"
        ".control\nop\nalter r2 = 3k\nop\nalter v1 = 8\nop\naltermod rm tc1 = 0.01\noption temp=127"
        "\nop\nalterparam top=2k\nreset\nop\n.endc\n"
    )
    volts = [run["v(b)"][0] for run in read(circuit).run()]
    # at 127 degrees, 100 above the nominal temperature, R2 is twice as large
    assert volts == pytest.approx([2.5, 3.75, 6.0, 8.0 * 6 / 7, 5.0 / 3], rel=1e-14)


def test_printed_scalars_are_results() -> None:
    (run,) = read(
        CIRCUIT + ".control\ntran 1u 1m uic\nmeas tran a find v(out) at=0.5m\n"
        "let ratio = a/5\nprint ratio\n.endc\n"
    ).run()
    assert run.measures["ratio"] == pytest.approx(-math.expm1(-0.5), rel=1e-12)


def test_random_numbers_repeat_and_follow_the_seed() -> None:
    lines = CIRCUIT + ".control\nrepeat 3\nalter r1 = 1k*(1+sunif(0)/10)\nop\nend\n.endc\n"
    first, again, other = (values(parse_text(lines, seed=seed)) for seed in (1, 1, 2))
    assert first == again
    assert first != other
    drawn = {v["r1"] for v in first}
    assert len(drawn) == 3
    assert all(900.0 <= r <= 1100.0 for r in drawn)
    assert "--seed" in program("alter r1 = 1k + sgauss(0)", "op").warnings[0].hint


@pytest.mark.parametrize("command", ["shell rm -rf x", "source other.cir", "system ls", "cd .."])
def test_no_program_is_started(command: str) -> None:
    found = program(command, "op")
    assert [w.code for w in found.warnings] == ["NS1095"]
    assert len(found.analyses) == 1


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        (["if mean(v(out)) > 1"], "if has no end"),
        (["op", "if mean(v(out)) > 1", "op", "end"], "mean() is known only after a run"),
        (["op", "meas tran late find v(out) at=1m", "alter r1 = late", "op"], "late is known only"),
        (["op", "frobnicate"], "line 7: the command frobnicate is unknown"),
        (["op", "alter r7 = 1"], "line 7: alter: there is no element r7"),
        (["op", "break"], "break and continue belong inside loops"),
        (["op", "while 1", "let k = 1", "end"], "it takes more than 200000 steps"),
        (["op", "echo $nothing", "alter r1 = $nothing"], "line 8: variable nothing is not set"),
    ],
)
def test_where_a_program_ends(lines: list[str], reason: str) -> None:
    found = program(*lines)
    assert len(found.analyses) == (lines[0] == "op")
    assert reason in found.warnings[0].message
    assert found.warnings[0].code == "NS1090"


def test_cards_of_the_deck_run_as_well() -> None:
    found = deck(".tran 1u 1m", ".control", "tran 1u 9m", ".endc")
    assert [job.card.tstop for job in jobs_of(found)] == [9e-3, 1e-3]  # type: ignore[union-attr]
    found = deck(".tran 1u 1m", ".control", "run", "alter r1 = 2k", "run", ".endc")
    assert values(found) == [{}, {"r1": 2e3}]


def test_signals_of_a_table_are_written() -> None:
    found = program("op", "wrdata /etc/passwd i(r1) v(out)")
    assert [s.name for s in found.saves] == ["all", "i(r1)", "v(out)"]


@pytest.mark.parametrize("line", [".acmodel", ".disto dec 1 1 1"])
@pytest.mark.parametrize("computed", [".op", ".tran 1u 1m", ".control\nop\n.endc"])
def test_analyses_beside_computed_ones_are_skipped(line: str, computed: str) -> None:
    found = deck(line, computed)
    assert len(found.analyses) == 1
    warning = next(w for w in found.warnings if w.code == "NS1003")
    assert warning.message == f"{line.split()[0]} is skipped"


def test_lines_after_the_end_are_told() -> None:
    found = deck(".op", ".end", "* a remark", "R2 out 0 1k", ".temp 50")
    (warning,) = found.warnings
    assert warning.code == "NS1093"
    assert warning.message == "lines after .end are not read: 'R2 out 0 1k', '.temp 50'"
    assert warning.span is not None
    assert warning.span.line == 8
    assert len(found.elements) == 3


def test_a_script_after_the_end_explains_the_missing_analysis() -> None:
    with pytest.raises(UsageError) as caught:
        jobs_of(deck(".end", ".control", "tran 1u 1m", ".endc"))
    assert "lines after .end are not read; move .end after them" in str(caught.value)


def test_a_title_card_in_the_first_line_is_no_missing_analysis() -> None:
    with pytest.raises(UsageError) as caught:
        jobs_of(parse_text(".title divider\nV1 a 0 1\nR1 a 0 1\n"))
    assert ".title" not in str(caught.value)


def test_sensitivities_of_a_program() -> None:
    """42 mA into 1 kOhm: ngspice's regression test sens-dc-1 has the same derivatives."""
    circuit = read("t\ni1 0 1 dc=42mA\nr1 1 0 1k\n.control\nsens v(1) dc\nprint all\n.endc\n")
    (solution,) = circuit.run()
    found = {row.element: row.derivative for row in solution.sensitivities}
    assert found["r1"] == pytest.approx(42e-3, rel=1e-14)
    assert found["i1"] == pytest.approx(1e3, rel=1e-14)

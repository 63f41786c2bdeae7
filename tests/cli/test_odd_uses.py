"""What a hurried user writes: every mistake is told, none changes the results in silence."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

import nsspice
from nsspice.cli.app import app

RC = "an RC circuit\nV1 a 0 SIN(0 1 1k)\nR1 a b 1k\nC1 b 0 1u\n.tran 10u 1m\n"
DIODE = "a junction\nV1 a 0 1\nR1 a b 1\nD1 b 0 m {own}\n.model m D(IS=1e-14 {card})\n{line}\n.op\n"


def refused(call, text: str, *options: str, command: str = "run") -> str:
    """Return what is said of a deck that cannot be run."""
    Path("odd.net").write_text(text)
    result = call(command, "odd.net", *options)
    assert result.exit_code in (2, 3)
    return result.stderr


@pytest.mark.parametrize(
    ("line", "place"),
    [
        (".temp -300", "6:7"),
        (".temp -273.15", "6:7"),
        (".options temp=-400", "6:10"),
        (".options tnom=-300", "6:10"),
        (".step temp list 27 -300", "6:7"),
        (".dc temp -300 0 100", "6:5"),
    ],
)
def test_a_card_below_absolute_zero(call, line, place):
    """A logarithm of a negative number was a traceback."""
    told = refused(call, DIODE.format(own="", card="", line=line))
    assert f"odd.net:{place}: error NS2005" in told
    assert "absolute zero" in told


@pytest.mark.parametrize(
    ("own", "card", "word"),
    [("temp=-400", "", "d1"), ("dtemp=-400", "", "-373"), ("", "tnom=-400", "model m")],
)
def test_an_element_below_absolute_zero(call, own, card, word):
    told = refused(call, DIODE.format(own=own, card=card, line=""))
    assert "NS2005" in told
    assert word in told


def test_python_takes_no_temperature_below_absolute_zero():
    circuit = nsspice.read(DIODE.format(own="", card="", line=""))
    for run in (
        lambda: nsspice.op(circuit, temperature=-300.0),
        lambda: nsspice.dc(circuit, "temp", [-300.0]),
    ):
        with pytest.raises(nsspice.UsageError, match="NS4005"):
            run()


def test_a_parameter_of_an_instance_given_twice(call):
    """The last one counted, in silence."""
    text = "t\nV1 a 0 1\nX1 a s r=5 r=6\n.subckt s a r=1\nR1 a 0 {r}\n.ends\n.op\n"
    assert "odd.net:3:12: error NS1014" in refused(call, text)


def test_the_value_of_a_step_that_fails_is_named(call):
    text = "t\nV1 a 0 {v}\n.param v=1\nD1 a b\nV2 b 0 5\n.op\n.step param v list 1 6\n"
    assert "(.step: v = 6)" in refused(call, text)
    assert Path("odd.step1.csv").exists()
    text = RC.replace("1u\n", "{c}\n.param c=1u\n.step param c list 1u -2u\n", 1)
    assert "(.step: c = -2e-06)" in refused(call, text)


def test_a_card_in_the_first_line_is_remembered(call):
    told = refused(call, ".op\nV1 a 0 1\nR1 a 0 1\n")
    assert ".op is on the first line" in told


def test_a_deck_that_includes_itself_has_one_error(call):
    told = refused(call, "t\nV1 a 0 1\nR1 a 0 1\n.include odd.net\n.op\n")
    assert told.count(" error ") == 1


@pytest.mark.parametrize(
    ("line", "hint"),
    [
        ("R1 a", "write Rname n+ n- value"),
        ("Q1 a b", "write Qname collector base emitter model"),
        ("R1 a b {1+}", "a value is missing"),
        ("R1 a b {1+*2}", "a value is missing"),
        ("R1 a b {1 2}", "an operator"),
        ("D1 a b m\n.model m D(Ronn=1)", "did you mean ron?"),
    ],
)
def test_hints(call, line, hint):
    assert hint in refused(call, f"t\nV1 a 0 1\n{line}\n.op\n")


@pytest.mark.parametrize(
    ("command", "option", "value"),
    [("cost", "--target", "-1"), ("cost", "--target", "0"), ("compare", "--tolerance", "-1")],
)
def test_negative_tolerances(call, command, option, value):
    """A negative target was a traceback behind all runs, a negative tolerance failed each row."""
    assert "NS4005" in refused(call, RC, option, value, command=command)


CHECK = """source = "closed form"
[[check]]
signal = "v(b)"
at = 1e-3
value = -0.1
tolerance = 1e-2
why = "two digits"
"""


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (CHECK.replace("1e-2", "inf"), "tolerance must be a finite number"),
        (CHECK.replace("-0.1", "nan"), "value must be a finite number"),
        (CHECK + "number = 1.5\n", "number must be a whole number"),
        (
            "check = [1]\n" + CHECK.partition("\n")[0] + "\n",
            "[[check]] number 1: it must be a table",
        ),
        (CHECK + "[run]\nmethod = 5\n", "method must be a string"),
        (CHECK + "[run]\nparams = 5\n", "params must be a table"),
        (CHECK + '[run.params]\nr = "a"\n', "r must be a number"),
        ('source = "x"\n[refused]\ncode = "NS3001"\nmentions = 5\n', "mentions must be a list"),
    ],
)
def test_mistakes_in_expectations(call, text, words):
    """A tolerance without bound passed; wrong types were tracebacks."""
    Path("odd.net").write_text(RC)
    Path("odd.expect.toml").write_text(text)
    result = call("test", "odd.net")
    assert result.exit_code == 2
    assert words in result.stdout
    assert "odd.expect.toml" in result.stdout


def test_expectations_of_nothing_do_not_pass(call):
    """An element that does not exist had the impulse zero."""
    Path("odd.net").write_text(RC)
    text = CHECK.replace('signal = "v(b)"\nat = 1e-3', 'impulse = "c9"').replace("-0.1", "0")
    Path("odd.expect.toml").write_text(text)
    result = call("test", "odd.net")
    assert result.exit_code == 1
    assert "there is no element c9" in result.stdout
    Path("odd.expect.toml").write_text(CHECK.replace("1e-3", "5", 1))
    assert "5 is outside the rows" in call("test", "odd.net").stdout


def test_python_tells_wrong_arguments():
    circuit = nsspice.read(RC)
    with pytest.raises(TypeError, match="make one with nsspice"):
        nsspice.tran(RC)  # type: ignore[arg-type]
    for wrong in (None, 5, circuit):
        with pytest.raises(TypeError, match=type(wrong).__name__):
            nsspice.read(wrong)  # type: ignore[arg-type]
    with pytest.raises(nsspice.NetlistError, match="NS1091"):
        nsspice.read("")
    for points in ([], [float("nan")], [0.0, float("inf")]):
        with pytest.raises(nsspice.UsageError, match="NS4005"):
            nsspice.dc(circuit, "v1", points)
    with pytest.raises(nsspice.NetlistError, match="there is no element v9"):
        nsspice.dc(circuit, "v9", [1.0])


def test_a_run_shorter_than_the_distance_of_its_rows():
    """In SPICE the step comes first, here the stop: a single row was returned, at t = 0."""
    with pytest.raises(nsspice.UsageError, match="stop is the first argument"):
        nsspice.tran(nsspice.read(RC), 1e-5, 1e-3)


def test_signals_of_a_solution():
    solution = nsspice.tran(nsspice.read(RC), 1e-3, 1e-5, signals="v(a)")  # type: ignore[arg-type]
    assert solution.columns == ["v(a)"]
    with pytest.raises(TypeError, match="by a string"):
        solution[0]  # type: ignore[index]
    assert solution["p(r1)"].size == solution.axis.size  # another run computes it
    with pytest.raises(KeyError, match="extra="):
        nsspice.Solution("tran", "t", "time", solution.time, {"v(a)": solution["v(a)"]})["p(r1)"]


@pytest.mark.parametrize(("name", "meant"), [("b", "v(b)"), ("R1", "i(r1)")])
def test_a_bare_name_is_no_signal_of_the_command_line(call, name, meant):
    assert f"did you mean {meant}?" in refused(call, RC, "--signals", name)


def test_other_commands_read_standard_input_too() -> None:
    """They looked for a file called -."""
    result = CliRunner().invoke(app, ["explain", "-"], input=RC)
    assert result.exit_code == 0, result.output
    assert "LINEAR_DAE" in result.output


@pytest.mark.parametrize("method", ["moreau", "sdirk"])
def test_steps_that_do_not_move_the_time_are_refused(call, method: str) -> None:
    """1e27 steps were begun."""
    text = refused(call, RC, "--method", method, "--step", "1e-30")
    assert "NS4005" in text
    assert "use steps of 1e-09 s or more" in text


@pytest.mark.parametrize("line", ["R1 a 0 1e-308\n.op\n", "R1 a 0 1\nC1 a 0 1\n.tran 1 3 uic\n"])
def test_the_end_of_the_range_of_numbers_is_no_traceback(call, line: str) -> None:
    """1e308 V on 1e-308 Ohm, or on 1 F, ended in one of the linear program."""
    assert "error NS" in refused(call, f"x\nV1 a 0 1e308\n{line}")

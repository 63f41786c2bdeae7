"""nsspice test: verdicts, table, exit codes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import nsspice

GOOD = """source = "closed form"
[[check]]
signal = "v(b)"
analysis = "op"
value = 1.0
tolerance = 1e-12
why = "a voltage divider"
"""


@pytest.fixture
def expect(decks):
    def writer(text: str, name: str = "divider") -> Path:
        path = Path(f"{name}.expect.toml")
        path.write_text(text)
        return path

    return writer


def test_passed(call, expect):
    expect(GOOD)
    result = call("test", "divider.net")
    assert result.exit_code == 0, result.stdout + result.stderr
    assert "ok    divider" in result.stdout
    assert "1 netlists, 1 checks" in result.stdout
    assert "all passed" in result.stdout


def test_failed(call, expect):
    expect(GOOD.replace("1.0", "1.5"))
    result = call("test", ".")
    assert result.exit_code == 1
    assert "FAIL  divider" in result.stdout
    assert "1, expected 1.5, off by 5.00e-01, allowed 1e-12 (a voltage divider)" in result.stdout


def test_json(call, expect):
    expect(GOOD)
    data = json.loads(call("test", "--json").stdout)
    assert data["passed"] is True
    (check,) = data["netlists"][0]["checks"]
    assert check["passed"] is True
    assert check["error"] < 1e-12


def test_verbose_lists_all_checks(call, expect):
    expect(GOOD)
    assert "ok   value of v(b): 1, expected 1" in call("test", "-v", "divider.net").stdout


@pytest.mark.parametrize(
    ("text", "passed"),
    [
        ('signal = "v(out)"\nat = 5e-4\nvalue = 0.393\ntolerance = 0.01', True),
        ('signal = "v(in)-v(out)"\nstatistic = "min"\nvalue = 0.368\ntolerance = 0.01', True),
        (
            'signal = "i(c1)*1k"\nstatistic = "mean"\nfrom = 0\nto = 1e-3\n'
            "value = 0.632\ntolerance = 0.02",
            True,
        ),
        ('signal = "v(out)"\nvalue = 0.632\ntolerance = 0.01', True),
        ('measure = "vend"\nvalue = 0.632\ntolerance = 0.01', True),
        ('measure = "vend"\nvalue = 0.7\ntolerance = 0.01', False),
        ('measure = "never"\nvalue = 0.0\ntolerance = 1.0', False),
        ('measure = "vennd"\nvalue = 0.0\ntolerance = 1.0', False),
        ('signal = "v(out)"\nat = 1.0\nvalue = 0\ntolerance = 10.0', False),
        (
            'reference = "r.csv"\ntime = "t"\ncolumn = "v"\nsignal = "v(out)"\ntolerance = 0.01',
            True,
        ),
        (
            'reference = "r.csv"\ntime = "t"\ncolumn = "v"\nsignal = "v(out)"\n'
            "scale = 2.0\ntolerance = 0.01",
            False,
        ),
        (
            'reference = "r.csv"\ntime = "t"\ncolumn = "v"\nsignal = "v(out)"\n'
            'norm = "l1"\ntolerance = 0.005',
            True,
        ),
        (
            'reference = "r.csv"\ntime = "t"\ncolumn = "w"\nsignal = "v(out)"\ntolerance = 1.0',
            False,
        ),
        (
            'reference = "no.csv"\ntime = "t"\ncolumn = "w"\nsignal = "v(out)"\ntolerance = 1.0',
            False,
        ),
    ],
)
def test_kinds_of_checks(call, expect, text, passed):
    rows = "\n".join(f"{k * 1e-5!r},{1 - 2.718281828459045 ** (-k / 100)!r}" for k in range(101))
    Path("r.csv").write_text("t,v\n" + rows + "\n")
    expect(f'source = "closed form"\n[[check]]\n{text}\n', "rc")
    result = call("test", "rc.net")
    assert result.exit_code == (0 if passed else 1), result.stdout


def test_overrides(call, expect):
    text = GOOD.replace("[[check]]", "[run]\nparams = { r = 3e3 }\n[[check]]")
    expect(text.replace("1.0", "0.5"))
    assert call("test", "divider.net").exit_code == 0


def test_a_stepped_run_is_chosen_by_its_number(call, expect):
    expect(
        'source = "divider"\n'
        '[[check]]\nsignal = "v(b)"\nvalue = 1.0\ntolerance = 1e-12\n'
        '[[check]]\nsignal = "v(b)"\nnumber = 2\nvalue = 0.5\ntolerance = 1e-12\n',
        "stepped",
    )
    assert call("test", "stepped.net").exit_code == 0


REFUSED = (
    'source = "two mistakes"\n[refused]\ncode = "{code}"\nexit = {exit}\nmentions = ["{word}"]\n'
)


@pytest.mark.parametrize(
    ("code", "exit_code", "word", "passed"),
    [
        ("NS1001", 2, "trann", True),
        ("NS1001", 3, "trann", False),
        ("NS1001", 2, "elephant", False),
        ("NS3001", 2, "trann", False),
    ],
)
def test_refused_decks(call, expect, code, exit_code, word, passed):
    expect(REFUSED.format(code=code, exit=exit_code, word=word), "wrong")
    assert call("test", "wrong.net").exit_code == (0 if passed else 1)


def test_a_deck_that_should_be_refused_but_runs(call, expect):
    expect(REFUSED.format(code="NS1001", exit=2, word="x"), "rc")
    result = call("test", "rc.net")
    assert result.exit_code == 1
    assert "simulated instead" in result.stdout


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("source = 3", "needs source"),
        ('source = "x"', "[[check]] items or one [refused]"),
        ('source = "x"\n[[check]]\nsignal = "v(b)"\nvalue = 1', "number 1: it needs tolerance"),
        (GOOD.replace("tolerance", "tolerence"), "did you mean tolerance?"),
        (GOOD + "at = 1\nstatistic = 'max'", "cannot be used together"),
        (GOOD.replace('"v(b)"', '"v(b)+"'), "number 1"),
        (GOOD + "[rnu]", "unknown key 'rnu'; "),
        ("source = ", "not TOML"),
    ],
)
def test_wrong_expectation_files(call, expect, text, words):
    expect(text)
    result = call("test", "divider.net")
    assert result.exit_code == 2
    assert "NS4012" in result.stdout
    assert words.removesuffix("; ") in result.stdout


def test_nothing_to_test(call):
    result = call("test")
    assert result.exit_code == 2
    assert "no .expect.toml file" in result.stderr


def test_from_python(expect):
    expect(GOOD)
    report = nsspice.check("divider.net")
    assert report.passed, str(report)
    expect(GOOD.replace("1.0", "1.5"))
    report = nsspice.check("divider.net")
    assert not report.passed
    assert "expected 1.5" in str(report)

"""What a notebook shows: a few lines and a picture, and a bar while a longer run lasts."""

from __future__ import annotations

import math
import re
import sys
from types import SimpleNamespace

import pytest

import nsspice
from nsspice.analyses.request import notebook_progress

DECK = """RC <b>& more</b>
.param r=1k
V1 a 0 1
R1 a b {r}
C1 b 0 1u IC=0
.tran 1u 1m uic
.measure tran vend FIND v(b) AT=1m
"""


def _text(html: str) -> str:
    return re.sub(r'src="data:[^"]*"', "", html)


def test_a_solution_is_a_few_lines_and_a_picture() -> None:
    solution = nsspice.run(DECK)[0]
    html = solution._repr_html_()
    assert len(_text(html)) < 600
    assert "RC &lt;b&gt;&amp; more" in html
    assert "certificate holds" in html
    assert "<td>vend</td><td>0.632" in html
    assert 'src="data:image/png;base64,iVBOR' in html
    assert len(repr(solution)) < 200


def test_an_operating_point_is_a_table_of_its_values() -> None:
    (point,) = nsspice.run("divider\nV1 a 0 2\nR1 a b 1\nR2 b 0 1\n.op\n")
    html = point._repr_html_()
    assert "<td>v(b)</td><td>1 V</td>" in html
    assert "<img" not in html


def test_a_circuit_is_its_size_and_the_effects_of_its_elements() -> None:
    circuit = nsspice.read(DECK)
    assert "3 elements, 2 nodes, 1 island<" in circuit._repr_html_()
    assert "<td>r1</td>" in circuit._repr_html_()
    assert repr(circuit) == "<Circuit 'RC <b>& more</b>': 3 elements, 2 nodes, 1 island>"
    many = "\n".join(["ladder", "V1 n0 0 1", *(f"R{k} n{k} n{k + 1} 1" for k in range(99))])
    html = nsspice.read(many + "\nR0x n99 0 1\n")._repr_html_()
    assert "... and 89 more" in html
    assert len(html) < 2000


def test_a_misspelt_netlist_is_one_error() -> None:
    with pytest.raises(nsspice.NetlistError) as raised:
        nsspice.read(DECK.replace("1k", "{s}"))
    shown = raised.value._render_traceback_()
    assert shown == [f"NetlistError: {raised.value}"]
    assert shown[0].count("error NS") == 1
    # without a notebook the way through the reader is not printed a second time, either
    assert raised.value.__suppress_context__


def test_sensitivities_are_a_table() -> None:
    pandas = pytest.importorskip("pandas")
    circuit = nsspice.read("""chopped
V1 a 0 PULSE(0 1 0 0 0 5u 10u)
R1 a b 1k
R2 b 0 3k
C1 b 0 10n
.pss
""")
    found = nsspice.sens(circuit, ["v(b)"], ["r1", "r2"])
    heading, *rows = str(found).splitlines()
    assert heading.split() == ["signal", "element", "value", "average", "derivative"]
    # 0.5 R2 / (R1 + R2), by both
    wanted = {"r1": -0.5 * 3e3 / 16e6, "r2": 0.5 * 1e3 / 16e6}
    assert {row.split()[1]: float(row.split()[4]) for row in rows} == pytest.approx(wanted)
    assert found._repr_html_().count("<tr>") == 3
    frame = found.to_pandas()
    assert isinstance(frame, pandas.DataFrame)
    assert list(frame["element"]) == [row.split()[1] for row in rows]


def test_losses_of_a_transient() -> None:
    (solution,) = nsspice.run(DECK)
    table = solution.losses()
    # of the energy that charging takes: C V^2 (1 - e^-2) / 2 in R, T = RC = 1 ms
    lost = {row.element: row.power for row in table.rows}["r1"]
    assert lost == pytest.approx(0.5e-6 * -math.expm1(-2.0) / 1e-3, rel=1e-9)


def test_a_picture_shows_itself() -> None:
    assert nsspice.run(DECK)[0].plot()._repr_png_().startswith(b"\x89PNG")


class _Screen:
    """Stands for IPython.display."""

    def __init__(self) -> None:
        self.shown: list[str] = []

    def HTML(self, text: str) -> str:
        return text

    def display(self, text: str, display_id: bool) -> SimpleNamespace:
        assert display_id
        self.shown.append(text)
        return SimpleNamespace(update=self.shown.append)


def test_a_notebook_shows_a_bar_while_a_run_lasts(monkeypatch: pytest.MonkeyPatch) -> None:
    shell = type("ZMQInteractiveShell", (), {})()
    screen = _Screen()
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))
    monkeypatch.setitem(sys.modules, "IPython.display", screen)
    nsspice.run(DECK)
    assert screen.shown == []  # over before anybody could have looked
    monkeypatch.setattr(notebook_progress, "_PATIENCE", 0.0)
    nsspice.run(DECK)
    assert "<progress" in screen.shown[0]
    assert "&lt;b&gt;" in screen.shown[0]
    assert screen.shown[-1] == ""


def test_elsewhere_nothing_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "IPython", raising=False)
    monkeypatch.setattr(notebook_progress, "_PATIENCE", 0.0)
    nsspice.run(DECK)
    assert "IPython" not in sys.modules

"""What a notebook shows: a few lines and a picture, and a bar while a longer run lasts."""

from __future__ import annotations

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

"""Figures of ideas: a diode's two rays, modes, a jump of charge, a Zeno point, the certificate."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

import nsspice
import steady
from nsspice.analyses.solution.plot_points import drawn

_BLUE, _RED, _GREEN, _GREY = "#0072B2", "#D55E00", "#009E73", "0.45"


def pictures(root: Path) -> dict[str, str | bytes]:
    """Return the pictures by the name of their file in the site."""
    return {
        "explanation/two-rays.svg": two_rays(),
        "explanation/modes.svg": modes((root / "netlists/converters/buck.net").read_text("utf-8")),
        "explanation/zeno.svg": zeno(root / "netlists/pathological/slide_filippov_spiral.net"),
        "explanation/residuals.svg": residuals(root / "netlists/converters/buck.net"),
        "how-to/jump.svg": jump(steady.deck_of(root, "jumps-and-impulses", "jump.net")),
    }


def _figure(width: float, height: float) -> Any:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _svg(figure: Any) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format="svg")
    return stream.getvalue()


def two_rays() -> bytes:
    """Return the characteristic of an ideal diode, met by the line of the rest of a circuit."""
    figure = _figure(8.0, 3.2)
    for panel, source, heading in zip(
        figure.subplots(1, 2, sharey=True), (1.5, -1.5), ("it conducts", "it blocks"), strict=True
    ):
        panel.plot([0.0, 0.0], [0.0, 2.4], color=_BLUE, linewidth=2.5)
        panel.plot([-2.4, 0.0], [0.0, 0.0], color=_BLUE, linewidth=2.5)
        v = np.array([-2.4, 1.2])
        panel.plot(v, source - v, color=_GREY, linewidth=1.3, linestyle="--")
        current = max(source, 0.0)
        panel.plot([min(source, 0.0)], [current], "o", color=_RED, markersize=8)
        panel.set_xlim(-2.4, 1.2)
        panel.set_ylim(-0.6, 2.4)
        panel.set_xlabel("voltage of the diode")
        panel.set_title(f"{heading}: source {source:g} V behind 1 Ω", fontsize=10)
        panel.grid(visible=True, color="0.92")
    figure.axes[0].set_ylabel("current of the diode")
    return _svg(figure)


def modes(text: str) -> bytes:
    """Return a current whose segments belong to three modes, with the instants of change."""
    circuit = nsspice.read(text.replace("Rload out 0 5", "Rload out 0 60"))
    solution = nsspice.tran(circuit, stop=4e-3, uic=True)
    fine = drawn(solution, ["i(l1)"])
    begin, end = 3.97e-3, 4e-3
    inside = (fine.time >= begin) & (fine.time <= end)
    t, i = 1e6 * (fine.time[inside] - begin), fine["i(l1)"][inside]
    figure = _figure(8.0, 3.0)
    panel = figure.subplots()
    panel.plot(t, i, color="black", linewidth=1.6)
    instants = [e.time for e in solution.events if begin < e.time < end]
    edges = sorted({begin, *instants, end})
    colours = {"s1": _GREEN, "d1": _BLUE, "": "0.75"}
    named: set[str] = set()
    for a, b in zip(edges, edges[1:], strict=False):
        on = _on(solution, 0.5 * (a + b))
        label = f"{on} conducts" if on else "nothing conducts"
        panel.axvspan(
            1e6 * (a - begin), 1e6 * (b - begin), color=colours[on], alpha=0.25, linewidth=0.0,
            label=label if on not in named else "_",
        )  # fmt: skip
        named.add(on)
    for instant in instants:
        panel.axvline(1e6 * (instant - begin), color=_RED, linewidth=0.9, linestyle=":")
    panel.set_xlabel("time [µs]")
    panel.set_ylabel("inductor current [A]")
    panel.margins(x=0.0)
    panel.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize="small")
    return _svg(figure)


def _on(solution: nsspice.Solution, time: float) -> str:
    """Return which of the two elements conducts, empty if neither does."""
    from nsspice.output.schematic.conduction import conducting_at

    return next((name for name, on in conducting_at(solution, time).items() if on), "")


def jump(text: str) -> bytes:
    """Return two capacitors that a switch joins: voltages jump, charge is kept, energy is lost."""
    solution = nsspice.run(text)[0]
    rows = drawn(solution, ["v(a)", "v(b)"])
    (found,) = solution.jumps
    figure = _figure(8.0, 3.0)
    panel = figure.subplots()
    for name, colour in (("v(a)", _BLUE), ("v(b)", _RED)):
        panel.plot(1e3 * rows.axis, rows[name], color=colour, linewidth=1.8, label=name)
    panel.annotate(
        f"{1e6 * found.before:.1f} µJ before\n{1e6 * found.after:.1f} µJ after",
        (1.0, 7.0), xytext=(8, 0), textcoords="offset points", fontsize="small",
    )  # fmt: skip
    panel.set_xlabel("time [ms]")
    panel.set_ylabel("voltage [V]")
    panel.grid(visible=True, color="0.92")
    panel.legend(frameon=False, fontsize="small")
    return _svg(figure)


def zeno(deck: Path) -> bytes:
    """Return currents whose signs change ever faster, and how the instants approach their limit."""
    (solution,) = nsspice.read(deck).run()
    fine = drawn(solution, ["i(l1)", "i(l2)"])
    end = 0.9  # (|x0| + |y0|) / 2, as the deck derives
    instants = sorted({e.time for e in solution.events if e.time < end - 1e-9})
    figure = _figure(8.0, 3.0)
    curves, distances = figure.subplots(1, 2)
    for name, colour in (("i(l1)", _BLUE), ("i(l2)", _GREEN)):
        curves.plot(fine.time, fine[name], color=colour, linewidth=1.6, label=name)
    for instant in instants:
        curves.axvline(instant, color=_RED, linewidth=0.9, linestyle=":")
    curves.set_xlim(0.0, 1.1)
    curves.set_xlabel("time [s]")
    curves.set_ylabel("current [A]")
    curves.legend(frameon=False, fontsize="small")
    left = [end - t for t in instants]
    distances.semilogy(range(1, len(left) + 1), left, "o", color=_RED, markersize=4)
    distances.set_xlabel("change of sign")
    distances.set_ylabel("time left to the limit [s]")
    distances.grid(visible=True, color="0.92")
    return _svg(figure)


def residuals(deck: Path) -> bytes:
    """Return the current law of a node at every row, as it was run and with one wrong current."""
    rows = nsspice.tran(nsspice.read(deck), stop=2e-4, uic=True, signals=["all", "alli"])
    inward, outward = rows["i(l1)"], rows["i(c1)"] + rows["i(rload)"]
    wrong = outward.copy()
    wrong[400] *= 1.0 + 1e-6
    figure = _figure(8.0, 3.0)
    panel = figure.subplots()
    largest = float(np.max(np.abs(outward)))
    shown = ((wrong, _RED, "one current off by a millionth"), (outward, _BLUE, "as it was run"))
    for current, colour, label in shown:
        error = np.maximum(np.abs(inward - current) / largest, 1e-17)
        panel.semilogy(1e6 * rows.axis, error, ".", color=colour, markersize=4, label=label)
    panel.axhline(1e-8, color="black", linewidth=1.2)
    panel.text(2.0, 1.6e-8, "bound", fontsize="small")
    panel.set_ylim(3e-18, 1e-5)
    panel.set_xlabel("time [µs]")
    panel.set_ylabel("residual of KCL at out")
    panel.legend(loc="center right", frameon=False, fontsize="small")
    return _svg(figure)

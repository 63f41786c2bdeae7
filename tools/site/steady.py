"""Pictures of the how-to pages on steady states: drawn from the netlists that the pages show.

Bode plot with margins, spectrum, losses with their sum, and Floquet multipliers beside the unit
circle.
"""

from __future__ import annotations

import io
import math
import re
from pathlib import Path
from typing import Any

import numpy as np

import nsspice
from nsspice.analyses import Request, jobs_of, run_job
from nsspice.output.bode import draw_bode

_DECK = '```spice title="{}"\n(.*?)^```'
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")


def pictures(root: Path) -> dict[str, str | bytes]:
    """Return the pictures by the name of their file in the site."""

    def deck(page: str, name: str) -> str:
        return deck_of(root, page, name)

    peak = (root / "netlists" / "steady" / "peak_current.net").read_text("utf-8")
    return {
        "how-to/loop-gain.svg": bode(deck("small-signals", "loop.net")),
        "how-to/spectrum.svg": spectrum(deck("spectra-and-losses", "class-d.net"), "v(a)"),
        "how-to/losses.svg": losses(deck("spectra-and-losses", "switching.net")),
        "how-to/multipliers.svg": multipliers(peak),
    }


def deck_of(root: Path, page: str, name: str) -> str:
    """Return a netlist that a how-to page shows."""
    text = (root / "docs" / "how-to" / f"{page}.md").read_text("utf-8")
    found = re.search(_DECK.format(re.escape(name)), text, re.MULTILINE | re.DOTALL)
    if found is None:
        raise LookupError(f"{page}.md shows no netlist {name}")
    return found[1]


def _canvas(width: float, height: float) -> tuple[Any, Any]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    panel = figure.subplots()
    panel.spines[["top", "right"]].set_visible(False)
    panel.set_axisbelow(True)
    return figure, panel


def _svg(figure: Any) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format="svg")
    return stream.getvalue()


def bode(text: str) -> bytes:
    """Return the loop gain of a deck with its margins."""
    circuit = nsspice.read(text)
    job = next(job for job in jobs_of(circuit.deck) if job.kind == "loop")
    return _svg(draw_bode(run_job(circuit, job, Request())))


def spectrum(text: str, signal: str, orders: int = 100) -> bytes:
    """Return the amplitudes of the harmonics of a signal."""
    solution = nsspice.pss(nsspice.read(text))
    integrals = solution.integrals
    found = integrals.coefficients([signal], list(range(1, orders + 1)))[signal]
    sizes = 2.0 * np.abs(found)
    figure, panel = _canvas(9.0, 3.2)
    frequencies = integrals.frequency * np.arange(1, orders + 1) / 1e3
    shown = sizes > 1e-6 * sizes.max()
    lines = panel.vlines(frequencies[shown], 1e-6, sizes[shown], color=_COLOURS[0], linewidth=2.0)
    lines.set_label(signal)
    panel.set_yscale("log")
    panel.set_ylim(1e-6, 2.0)
    panel.set_xlim(0.0, frequencies[-1])
    panel.set_xlabel("Frequency [kHz]")
    panel.set_ylabel("Amplitude [V]")
    panel.grid(visible=True, axis="y", color="0.9", linewidth=0.7)
    panel.legend(frameon=False, fontsize="small")
    return _svg(figure)


def losses(text: str, load: str = "r1") -> bytes:
    """Return the losses of a deck's elements, conduction and switching side by side."""
    circuit = nsspice.read(text)
    request = Request(power=True, loads=(load,))
    powers = run_job(circuit, jobs_of(circuit.deck)[-1], request).powers
    rows = [r for r in powers.rows if r.kind == "loss" and r.element != load]
    rows = [r for r in rows if abs(r.power) + r.switching > 1e-9 * powers.delivered][::-1]
    figure, panel = _canvas(9.0, 0.9 + 0.5 * len(rows))
    names = [r.element for r in rows]
    parts = (("conduction", [r.power for r in rows]), ("switching", [r.switching for r in rows]))
    left = np.zeros(len(rows))
    for colour, (label, values) in zip(_COLOURS, parts, strict=False):
        panel.barh(names, values, left=left, color=colour, label=label, height=0.6)
        left += values
    for k, row in enumerate(rows):
        hot = "" if math.isnan(row.junction) else f", {row.junction:.1f} °C"
        panel.annotate(f" {left[k]:.2f} W{hot}", (left[k], k), va="center", fontsize="small")
    panel.set_xlim(0.0, 1.25 * left.max())
    panel.set_xlabel("Average loss [W]")
    panel.set_title(
        f"delivered {powers.delivered:.1f} W, lost {powers.lost + powers.switching:.2f} W, "
        f"efficiency {100.0 * powers.efficiency:.2f} %",
        fontsize=10,
    )
    panel.legend(frameon=False, fontsize="small", loc="upper right")
    return _svg(figure)


def multipliers(text: str) -> bytes:
    """Return the Floquet multipliers of the peak-current control for several outputs."""
    figure, panel = _canvas(7.6, 4.2)
    turn = np.linspace(0.0, 2.0 * np.pi, 400)
    panel.plot(np.cos(turn), np.sin(turn), color="0.4", linewidth=1.0)
    panel.axhline(0.0, color="0.85", linewidth=0.7, zorder=0)
    panel.axvline(0.0, color="0.85", linewidth=0.7, zorder=0)
    for k, vo in enumerate((2.0, 3.0, 4.0, 5.5, 6.0)):
        found = nsspice.pss(nsspice.read(text, params={"vo": vo})).periodic
        first = found.multipliers[0]
        panel.plot(
            first.real, first.imag, "o" if abs(first) < 1.0 else "x", color=_COLOURS[k],
            label=f"vo = {vo:g} V: {found.verdict}",
        )  # fmt: skip
    panel.set_aspect("equal")
    panel.set_xlim(-1.7, 1.25)
    panel.set_xlabel("real part")
    panel.set_ylabel("imaginary part")
    figure.legend(frameon=False, fontsize="small", loc="outside right center")
    return _svg(figure)

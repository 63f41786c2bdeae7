"""nsspice plot: CSV files above one axis."""

from __future__ import annotations

import json
from pathlib import Path


def test_two_runs_in_one_picture(call):
    call("run", "rc.net", "-o", "a.csv", "-q")
    call("run", "rc.net", "-o", "b.csv", "-q", "--method", "moreau")
    result = call("plot", "a.csv", "b.csv", "--signals", "v(out)", "-o", "both.svg", "--json")
    assert result.exit_code == 0
    assert json.loads(result.stdout) == {"files": ["both.svg"], "signals": ["v(out)"]}
    assert Path("both.svg").read_text().startswith("<?xml")


def test_the_first_shared_signals_are_drawn(call):
    Path("x.csv").write_text("time,V(OUT),other\n0,1,2\n1,2,3\n")
    Path("y.csv").write_text("time,v(out)\n0,1\n2,2\n")
    assert json.loads(call("plot", "x.csv", "y.csv", "--json").stdout)["signals"] == ["v(out)"]
    assert Path("x.png").stat().st_size > 1000


def test_what_cannot_be_drawn_is_said(call):
    Path("x.csv").write_text("time,v(out)\n0,1\n1,2\n")
    for arguments in (("none.csv",), ("x.csv", "--signals", "v(b)"), ("x.csv", "--from", "3")):
        result = call("plot", *arguments)
        assert result.exit_code == 2, arguments
        assert "NS40" in result.stderr


def test_a_parameter_colours_a_family():
    import numpy as np

    from nsspice.output.overlay import Series, overlay

    t = np.linspace(0.0, 1.0, 20)
    family = [Series(f"r = {r}", "time", t, {"v(a)": r * t}, float(r)) for r in range(12)]
    figure = overlay(family, ["v(a)"])
    lines = figure.axes[0].get_lines()
    assert len({line.get_color() for line in lines}) == 12
    assert figure.axes[-1].get_ylabel() == "r"  # the colour bar

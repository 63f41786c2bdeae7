"""Sweeps against closed forms: what is swept, what is measured, what fails."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import nsspice
from nsspice.errors import NetlistError, UsageError
from nsspice.sweeps import Tolerance, Uniform, paired

DIVIDER = """divider with a diode
.param r=1k
V1 a 0 10
R1 a b {r}
R2 b c 1k tc1=0.01
D1 c 0 dmod
.model dmod D(Vfwd=1 Ron=0)
.op
.measure op out find v(b) at=0
"""


def closed_form(r: float, r2: float = 1e3, drop: float = 1.0) -> float:
    return drop + (10.0 - drop) * r2 / (r + r2)


def test_parameters_elements_temperature_and_model_parameters() -> None:
    over = {"r": [1e3, 2e3], "r2": [1e3, 4e3], "dmod(vfwd)": [1.0, 2.0], "temp": [27.0, 37.0]}
    table = nsspice.sweep(DIVIDER, over)
    wanted = [
        closed_form(r, r2 * (1.0 + 0.01 * (t - 27.0)), drop)
        for r, r2, drop, t in table.points.values
    ]
    assert len(table) == 16
    assert table["out"] == pytest.approx(wanted, rel=1e-13)
    assert table.grid("out").shape == (2, 2, 2, 2)
    assert table.units == {"r2": "Ohm", "temp": "°C", "out": "V"}


def test_each_point_is_what_its_deck_says() -> None:
    """Lines are read once; branches, subcircuits and errors are those of each point."""
    deck = """branches
.param r=1
V1 a 0 1
.subckt load p rl=1k
Rin p 0 {rl}
.ends
.subckt other p
Rin p 0
.ends
.if (r > 2)
X1 a other
.else
X1 a load rl={r*1k}
.endif
.op
.measure op current find i(v1) at=0
"""
    table = nsspice.sweep(deck, {"r": [1.0, 3.0, 2.0, 3.0]}, workers=1)
    assert table["current"][[0, 2]] == pytest.approx([-1e-3, -0.5e-3], rel=1e-13)
    assert table.status == ["ok", "NS1008", "ok", "NS1008"]


def test_measures_are_those_of_a_run_with_all_its_rows() -> None:
    """Nobody reads rows of sweeps: values at their instants, edges as long as a step, crossings."""
    deck = """buck from rest
.param rl=5
Vin in 0 24
Vg g 0 PULSE(0 1 0 EDGES 5u 10u)
S1 sw in g 0 ideal
D1 0 sw
L1 sw out 47u IC=0
C1 out 0 22u IC=0
Rload out 0 {rl}
.model ideal SW(VT=0.5)
.tran 0.7u 300u uic
.measure tran mean AVG v(out) FROM=200u TO=300u
.measure tran peak MAX i(l1)
.measure tran half WHEN v(out)=6
.measure tran at_row FIND v(out) AT=210u
.measure tran late FIND i(l1) WHEN v(out)=6
"""
    for edges in ("0 0", ""):
        text = deck.replace("EDGES 5u", edges + " 5u" if edges else "1n 1n 5u")
        text = text if edges else text.replace("1n 1n 5u 10u)", ")")
        table = nsspice.sweep(text, {"rl": [4.0, 6.0]}, workers=1)
        for k, rl in enumerate((4.0, 6.0)):
            (solution,) = nsspice.run(text, params={"rl": rl})
            found = {name: float(table[name][k]) for name in solution.measures}
            # a root of rounding, and polynomials of the same run
            assert found == pytest.approx(solution.measures, rel=1e-11)


def test_a_list_of_points_and_a_data_frame() -> None:
    pandas = pytest.importorskip("pandas")
    columns = {"r": [1e3, 3e3], "r2": [2e3, 1e3]}
    for over in (paired(columns), pandas.DataFrame(columns)):
        table = nsspice.sweep(DIVIDER, over)
        assert table["out"] == pytest.approx([closed_form(1e3, 2e3), closed_form(3e3)], rel=1e-13)


def test_distributions_about_the_own_value() -> None:
    table = nsspice.sweep(
        DIVIDER, {"r": Tolerance(0.1), "r2": Uniform(1e3, 2e3), "temp": [27.0]}, samples=16
    )
    assert abs(table["r"] / 1e3 - 1.0).max() <= 0.1
    wanted = [closed_form(r, r2) for r, r2 in zip(table["r"], table["r2"], strict=True)]
    assert table["out"] == pytest.approx(wanted, rel=1e-13)


def test_the_step_cards_of_a_deck_are_a_sweep() -> None:
    deck = DIVIDER + ".step param r list 1k 3k\n.step temp list 27 37\n"
    table = nsspice.sweep(deck)
    runs = nsspice.read(deck).run()
    # the first card runs fastest, here as in run()
    assert table["out"].tolist() == [run.measures["out"] for run in runs]


def test_measures_besides_those_of_the_deck() -> None:
    deck = "RC\n.param r=1k\nV1 a 0 1\nR1 a b {r}\nC1 b 0 1u IC=0\n.tran 1u 1m uic\n"
    cards = {"end": "FIND v(b) AT=1m", "half": "WHEN v(b)=0.5", "current": "MAX i(r1)"}
    table = nsspice.sweep(deck, {"r": [1e3, 500.0]}, measures=cards)
    tau = table["r"] * 1e-6
    assert table["end"] == pytest.approx(1.0 - np.exp(-1e-3 / tau), rel=1e-12)
    assert table["half"] == pytest.approx(tau * math.log(2.0), rel=1e-10)
    assert table["current"] == pytest.approx(1.0 / table["r"], rel=1e-12)
    assert table.units["half"] == "s"


def test_powers_and_efficiency() -> None:
    deck = """chopped RC
.param r=1
V1 a 0 PULSE(0 10 0 0 0 5u 10u)
R1 a b {r}
R2 b 0 9
C1 b 0 1u
.pss
"""
    table = nsspice.sweep(deck, {"r": [1.0, 3.0]}, loads=["R2"])
    assert table["p(r2)"] + table["losses"] == pytest.approx(-table["p(v1)"], rel=1e-11)
    assert table["efficiency"] == pytest.approx(table["p(r2)"] / -table["p(v1)"], rel=1e-11)


def test_margins_of_a_loop() -> None:
    # an integrator k/s: the magnitude is 1 at k/(2 pi), the phase -90 degrees
    deck = """integrator in a loop
.param k=1k
E1 e 0 0 f 1
G1 0 x e 0 1
C1 x 0 {1/k}
E2 o 0 x 0 1
Vloop o f 0
R1 f 0 1k
.loop vloop dec 50 1 1meg
"""
    table = nsspice.sweep(deck, {"k": [1e3, 2e3]})
    assert table["crossover"] == pytest.approx(table["k"] / (2.0 * math.pi), rel=1e-9)
    assert table["phase_margin"] == pytest.approx([90.0, 90.0], abs=1e-9)


def test_a_point_without_solution_stays_in_the_table() -> None:
    # a source across an ideal diode: no solution while it is forward
    deck = "clash\n.param v=1\nV1 a 0 {v}\nD1 a 0\n.op\n.measure op out find v(a) at=0\n"
    table = nsspice.sweep(deck, {"v": [-1.0, 2.0, -3.0]})
    assert table.status[0] == table.status[2] == "ok"
    assert table.status[1].startswith("NS")
    assert np.isnan(table["out"][1])
    assert table["out"][[0, 2]].tolist() == [-1.0, -3.0]
    (failure,) = table.failures
    assert (failure.point, failure.values) == (1, {"v": 2.0})
    assert failure.message


def test_an_impossible_value_is_a_failed_point() -> None:
    deck = "RC\nV1 a 0 1\nR1 a b 1k\nC1 b 0 1u\n.op\n"
    assert nsspice.sweep(deck, {"c1": [1e-6, -1e-6]}).status == ["ok", "NS4005"]


@pytest.mark.parametrize(
    ("over", "error"),
    [
        ({"nobody": [1.0]}, NetlistError),
        ({"d1": [1.0]}, UsageError),
        ({"nomodel(ron)": [1.0]}, UsageError),
        ({"r": Tolerance(0.1)}, UsageError),
        (None, UsageError),
        (7, UsageError),
    ],
)
def test_refused_at_once(over, error) -> None:
    with pytest.raises(error):
        nsspice.sweep(DIVIDER, over)


def test_a_wrong_measure_is_refused_at_once() -> None:
    with pytest.raises(NetlistError, match="there is no"):
        nsspice.sweep(DIVIDER, {"r": [1.0]}, measures={"x": "find v(nowhere) at=0"})


def test_included_files_belong_to_the_deck(tmp_path: Path) -> None:
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "d.lib").write_text(".model dmod D(Vfwd=1 Ron=0)\n")
    text = DIVIDER.replace(".model dmod D(Vfwd=1 Ron=0)", '.include "models/d.lib"')
    (tmp_path / "a.net").write_text(text)
    table = nsspice.sweep(tmp_path / "a.net", {"r": [1e3, 2e3], "dmod(vfwd)": [2.0]})
    assert table["out"] == pytest.approx([closed_form(r, drop=2.0) for r in (1e3, 2e3)], rel=1e-13)


def test_tables_for_other_programs(tmp_path: Path) -> None:
    pytest.importorskip("xarray")
    parquet = pytest.importorskip("pyarrow.parquet")
    table = nsspice.sweep(DIVIDER, {"r": [1e3, 2e3, 3e3], "r2": [1e3, 2e3]})
    data = table.to_xarray()
    assert float(data["out"].sel(r=2e3, r2=1e3)) == pytest.approx(closed_form(2e3), rel=1e-13)
    assert data["out"].attrs["units"] == "V"
    assert data["r2"].attrs["units"] == "Ohm"
    table.save(tmp_path / "a.csv")
    rows = (tmp_path / "a.csv").read_bytes().decode().split("\r\n")
    assert rows[0] == "r,r2,out,status,seconds"
    assert [float(row.split(",")[2]) for row in rows[1:-1]] == table["out"].tolist()
    table.save(tmp_path / "a.parquet")
    read = parquet.read_table(tmp_path / "a.parquet")
    assert read.column("out").to_pylist() == table["out"].tolist()
    assert table.to_pandas()["out"].tolist() == table["out"].tolist()


def test_pictures(tmp_path: Path) -> None:
    table = nsspice.sweep(DIVIDER, {"r": [1e3, 2e3, 4e4], "r2": [1e3, 2e3]})
    table.plot(path=tmp_path / "family.png")
    table.map("out", tmp_path / "map.svg")
    table.histogram("out", tmp_path / "spread.pdf")
    assert all(path.stat().st_size > 2000 for path in tmp_path.iterdir())
    assert len(list(tmp_path.iterdir())) == 3
    with pytest.raises(UsageError, match="grid"):
        nsspice.sweep(DIVIDER, paired({"r": [1.0, 2.0]})).map("out")

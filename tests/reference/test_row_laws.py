"""The judge of written rows is silent on closed forms, and sees each equation broken by hand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from oracle.rows.examples import (
    BROKEN_LINE,
    CAPACITORS,
    CHARGING,
    CONTROLLED,
    FREEWHEELING,
    JOINED,
    PHASE_CONTROL,
    RECTIFIER,
    SWITCHED,
    TRANSFORMER,
    Columns,
    broken_line,
    changed,
    charging,
    controlled,
    freewheeling,
    implicit_euler,
    joined,
    joined_by_switch,
    phase_control,
    rectifier,
    switched,
    transformer,
)
from oracle.rows.judge import violations
from oracle.rows.written import Rows, read_csv

#: what quadrature leaves of an exponential at these rows is below it, each fault above
SIZE = 1e-6
CONTROL = "controlled source"


def worst(text: str, columns: Columns, stepped: bool = False) -> tuple[str, str, float]:
    found = violations(text, Rows(dict(columns)), stepped=stepped)
    return found[0].law, found[0].element, found[0].size


SILENT: dict[str, tuple[str, Callable[[], Columns]]] = {
    "charging": (CHARGING, charging),
    "rectifier": (RECTIFIER, rectifier),
    "broken line": (BROKEN_LINE, broken_line),
    "switch": (SWITCHED, switched),
    "thyristor": (PHASE_CONTROL, phase_control),
    "controlled": (CONTROLLED, controlled),
    "transformer": (TRANSFORMER, transformer),
    "capacitors joined": (JOINED, joined_by_switch),
    "inductor handed over": (FREEWHEELING, freewheeling),
}


@pytest.mark.parametrize("name", SILENT)
def test_silent_on_closed_forms(name):
    text, rows = SILENT[name]
    law, element, size = worst(text, rows())
    assert size < SIZE, (law, element)


def backward() -> Columns:
    """The rectifier with a diode that stays on for a row of 5 V backward."""
    c = rectifier()
    k = int(np.argmin(np.abs(c["v(a)"] + 5)))
    i = c["v(a)"][k] / 1e3
    return changed(c, k, v_b=1e3 * i, i_d1=i, i_r1=i, i_v1=-i)


def blocked() -> Columns:
    """The rectifier with a diode that misses a row of a forward voltage."""
    c = rectifier()
    k = int(np.argmax(c["i(d1)"]))
    i = c["i(d1)"][k]
    return changed(c, k, v_b=-1e3 * i, i_d1=-i, i_r1=-i, i_v1=i)


BROKEN: dict[str, tuple[str, Columns, str, str]] = {
    "resistor": (
        CHARGING,
        changed(charging(), 9, i_r1=1e-6, i_v1=-1e-6, i_c1=1e-6),
        "resistor",
        "r1",
    ),
    "current law": (CHARGING, changed(charging(), 9, i_c1=1e-7), "KCL", "b"),
    "source": (
        CHARGING,
        changed(charging(), 9, v_a=1e-4, i_r1=1e-7, i_v1=-1e-7, i_c1=1e-7),
        "source",
        "v1",
    ),
    "time constant": (CHARGING, charging(2.0, 1.01e-3), "charge", "c1"),
    "start": (CHARGING, charging(1.9), "initial charge", "b"),
    "rest": (CHARGING.replace("uic", ""), charging(4.9), "rest", "c1"),
    "conducts backward": (RECTIFIER, backward(), "diode", "d1"),
    "blocks forward": (RECTIFIER, blocked(), "diode", "d1"),
    "slope in breakdown": (BROKEN_LINE.replace("Rrev=20", "Rrev=21"), broken_line(), "diode", "d1"),
    "slope conducting": (BROKEN_LINE.replace("Ron=10", "Ron=10.1"), broken_line(), "diode", "d1"),
    "breakdown": (BROKEN_LINE.replace("Vrev=8", "Vrev=9"), broken_line(), "diode", "d1"),
    "resistance of a switch": (SWITCHED.replace("Ron=1", "Ron=1.1"), switched(), "switch", "s1"),
    "closes early": (SWITCHED, switched(closes=0.7), "hysteresis", "s1"),
    "opens late": (SWITCHED, switched(opens=1.8), "gate", "s1"),
    "fires early": (PHASE_CONTROL, phase_control(fires=0.05), "firing", "d1"),
    "cut off": (PHASE_CONTROL, phase_control(opens=0.4), "extinction", "d1"),
    "stays on": (PHASE_CONTROL, phase_control(opens=0.55), "thyristor", "d1"),
    "fires late": (PHASE_CONTROL, phase_control(fires=0.12), "gate", "d1"),
    "E": (
        CONTROLLED,
        changed(controlled(), 20, v_e=1e-3, i_re=1e-3, i_e1=-1e-3),
        CONTROL,
        "e1",
    ),
    "G": (
        CONTROLLED,
        changed(controlled(), 20, v_g=1e-3, i_rg=1e-3, i_g1=-1e-3),
        CONTROL,
        "g1",
    ),
    "F": (
        CONTROLLED,
        changed(controlled(), 20, v_f=1e-3, i_rf=1e-3, i_f1=-1e-3),
        CONTROL,
        "f1",
    ),
    "H": (
        CONTROLLED,
        changed(controlled(), 20, v_h=1e-3, i_rh=1e-3, i_h1=-1e-3),
        CONTROL,
        "h1",
    ),
    "B": (
        CONTROLLED,
        changed(controlled(), 150, v_b=2, i_rb=2, i_b1=-2),
        CONTROL,
        "b1",
    ),
    "coupling": (TRANSFORMER.replace("0.5", "0.501"), transformer(), "flux", "l2"),
    "charge lost": (JOINED, joined_by_switch(0.3), "jump of charge", "a"),
    "impulse against a diode": (
        CAPACITORS + "D1 b a\n.tran .25 2 uic\n",
        {**joined(0.25), "i(d1)": np.zeros(10)},
        "jump of charge",
        "b",
    ),
    "flux given up": (FREEWHEELING, freewheeling(0.0), "jump of flux", "l1"),
    "wrong initial flux": (
        FREEWHEELING.replace("IC=1", "IC=2"),
        freewheeling(),
        "initial flux",
        "l1",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_sees_what_is_broken(name):
    text, columns, law, element = BROKEN[name]
    found = worst(text, columns)
    assert found[:2] == (law, element)
    assert found[2] > 10 * SIZE


def test_a_flux_may_vanish_where_nothing_can_carry_it():
    """The inductor of an opening switch, without a diode beside it."""
    columns = freewheeling(0.0)
    del columns["i(d1)"]
    text = FREEWHEELING.replace("D1 0 a\n", "")
    assert worst(text, columns)[2] < SIZE


def test_steps_have_sums_of_their_own():
    columns = implicit_euler()
    assert worst(CHARGING, columns, stepped=True)[2] < SIZE
    off = changed(columns, 5, v_b=1e-3, i_r1=-1e-6, i_c1=-1e-6, i_v1=1e-6)
    assert worst(CHARGING, off, stepped=True)[:2] == ("charge", "c1")


def test_rows_out_of_order_are_told():
    columns = charging()
    columns["time"][[7, 8]] = columns["time"][[8, 7]]
    assert worst(CHARGING, columns)[0] == "order of rows"


def test_what_is_not_finite_is_a_violation():
    assert np.isinf(worst(CHARGING, changed(charging(), 4, v_b=np.nan))[2])


def test_reads_what_is_written(tmp_path):
    (tmp_path / "a.csv").write_text("time,v(A)\r\n0,1\r\n1e-3,2.5\r\n")
    rows = read_csv(tmp_path / "a.csv")
    assert rows.voltage("a").tolist() == [1.0, 2.5]
    assert rows.time.tolist() == [0.0, 1e-3]

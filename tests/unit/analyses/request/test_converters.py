"""Converters and counters of controllers, against a counter that is simulated tick by tick."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

import nsspice
from nsspice import Adc, Controller, Pwm
from nsspice.errors import UsageError

TICK, TICKS, PERIODS = 1e-6, 16, 12
#: 1 A into 1 F: the voltages are the times for which the outputs were on
TIMERS = """how long the outputs of a counter are on
Ihigh 0 a 0
Ca a 0 1 IC=0
Ilow 0 b 0
Cb b 0 1 IC=0
"""


def hardware(pwm: Pwm, writes: dict[int, float], ticks: int) -> np.ndarray:
    """On-times of both outputs [ticks], (ticks + 1, 2), of a counter that is clocked every tick."""
    length = TICKS * (2 if pwm.counter == "updown" else 1)
    phase, dead = round(pwm.phase / TICK), round(pwm.dead_time / TICK)
    shadow = compare = math.floor(pwm.duty * TICKS + 0.5)
    total, since, raw = np.zeros((ticks + 1, 2)), 0, None
    for n in range(ticks):
        if n in writes:
            shadow = math.floor(writes[n] * TICKS + 0.5)
        place = (n - phase) % length
        if (
            pwm.load == "now"
            or (place == 0 and pwm.load in ("zero", "both"))
            or (2 * place == length and pwm.load in ("top", "both"))
        ):
            compare = shadow
        if pwm.counter == "up":
            count = place
        elif pwm.counter == "down":
            count = TICKS - 1 - place
        else:  # what the counter is at least, from this tick to the next
            count = min(place, length - 1 - place)
        on = count < compare
        if on != raw:
            raw, since = on, n
        ready = n - since >= dead
        total[n + 1] = total[n] + [on and ready, not on and ready]
    return total * TICK


KINDS = [
    (counter, load, dead, phase)
    for counter in ("up", "down", "updown")
    for load in (("zero", "now", "top", "both") if counter == "updown" else ("zero", "now"))
    for dead, phase in itertools.product((0, 3), (0, 5))
]


@pytest.mark.parametrize(("counter", "load", "dead", "phase"), KINDS)
def test_on_times_are_those_of_a_clocked_counter(counter, load, dead, phase):
    period = TICKS * TICK * (2 if counter == "updown" else 1)
    pwm = Pwm(
        "ihigh",
        period,
        counter,
        complement="ilow",
        dead_time=dead * TICK,
        load=load,
        ticks=TICKS,
        phase=phase * TICK,
        duty=0.4,
    )
    rng = np.random.default_rng(7)
    ticks = PERIODS * TICKS
    # what is written between 0 and 1 and beyond, at instants of its own and late by two ticks
    duties = rng.uniform(-0.2, 1.2, ticks // 7 + 1)
    writes = {7 * k + 2: float(duty) for k, duty in enumerate(duties)}
    values = iter(duties.tolist())
    controller = Controller(7 * TICK, [], [pwm], lambda t, v: next(values), delay=2 * TICK)
    solution = nsspice.tran(
        nsspice.read(TIMERS), ticks * TICK, TICK, uic=True, controllers=[controller]
    )
    wanted = hardware(pwm, writes, ticks)
    # the times themselves are known to n u of the last one
    error = 4.0 * ticks * np.finfo(float).eps * ticks * TICK
    assert np.abs(solution["v(a)"] - wanted[:, 0]).max() <= error
    assert np.abs(solution["v(b)"] - wanted[:, 1]).max() <= error
    assert solution.certificate.passed


def test_edges_are_no_multiples_of_anything_without_ticks():
    pwm = Pwm("ihigh", 1e-5, duty=1.0 / 3.0)
    controller = Controller(1.0, [], [pwm], lambda t, v: None)
    solution = nsspice.tran(nsspice.read(TIMERS), 1e-3, 1e-5, uic=True, controllers=[controller])
    assert solution["v(a)"] == pytest.approx(np.arange(101) / 3.0 * 1e-5, rel=1e-12)


def test_a_converter_rounds_and_limits():
    adc = Adc("v(x)", bits=3, low=-1.0, high=1.0)
    codes = (np.array([adc.convert(v) for v in np.linspace(-2.0, 2.0, 4001)]) + 1.0) / 0.25
    assert sorted(set(codes.tolist())) == list(range(8))
    # next to the middle between two codes
    assert adc.convert(0.125 - 1e-12) == 0.0
    assert adc.convert(0.125 + 1e-12) == 0.25


@pytest.mark.parametrize("delay", [0.0, 0.3e-3, 2.2e-3])
def test_a_late_converter_shows_what_was_there_before(delay):
    deck = "sine\nV1 a 0 SIN(0 1 130)\nR1 a 0 1\nVset s 0 0\nR2 s 0 1\n"
    seen = []
    adc = Adc("v(a)", bits=8, low=-1.0, high=1.0, delay=delay)
    controller = Controller(
        1e-3, ["v(a)", adc], ["vset"], lambda t, v: seen.append((t, *v)) or 0.0, offset=1e-3
    )
    nsspice.tran(nsspice.read(deck), 20e-3, controllers=[controller])
    assert len(seen) == 19
    for time, now, converted in seen:
        assert now == pytest.approx(math.sin(260.0 * math.pi * time), abs=1e-12)
        exact = math.sin(260.0 * math.pi * max(0.0, time - delay))
        exact = min(exact, 127.0 / 128.0)  # the last code
        assert abs(converted - exact) <= 1.0 / 256.0 + 1e-12
        assert (converted * 128.0).is_integer()


@pytest.mark.parametrize(
    "wrong",
    [
        {"reads": [Adc("v(a)", bits=0)]},
        {"reads": [Adc("v(a)", low=1.0)]},
        {"reads": [Adc("v(a)", delay=-1.0)]},
        {"writes": [Pwm("ihigh", 0.0)]},
        {"writes": [Pwm("ihigh", 1.0, "sideways")]},
        {"writes": [Pwm("ihigh", 1.0, load="top")]},
        {"writes": [Pwm("ihigh", 1.0, dead_time=0.5)]},
        {"writes": [Pwm("ihigh", 1.0, ticks=0)]},
        {"writes": [Pwm("ihigh", 1.0, phase=1.0)]},
        {"writes": [Pwm("ihigh", 1.0, duty=2.0)]},
        {"writes": [Pwm("ihigh", 1.0, levels=(0.0, math.inf))]},
        {"writes": [Pwm("ca", 1.0)]},
        {"writes": [Pwm("ihigh", 1.0, complement="ihigh")]},
        {"writes": ["ihigh", Pwm("ilow", 1.0, complement="ihigh")]},
    ],
)
def test_refused(wrong):
    given = {"reads": [], "writes": [], **wrong}
    controller = Controller(1e-3, step=lambda t, v: None, **given)
    with pytest.raises(UsageError) as error:
        nsspice.tran(nsspice.read(TIMERS), 1e-3, uic=True, controllers=[controller])
    assert error.value.code == "NS4005"

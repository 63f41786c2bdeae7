"""Small signals about orbits of smooth elements: against the exact engine, runs, and loop parts."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.analyses.request.request import Request
from nsspice.analyses.steady.orbit_response import responder
from nsspice.analyses.steady.steady_state import Pss, find_orbits
from nsspice.analyses.steady.stepped_response import CLOSE, SteppedResponse

RELTOL = 1e-5  # of a run by default
FREQUENCIES = [100.0, 1e3, 5e3, 12e3, 31e3, 81e3, 133e3]

#: a law that is smooth and no current: its circuit goes by steps
NOTHING = "Bnil out 0 I={1e-30*V(out)**3}\n"

BUCK = """Naturally sampled buck converter
Vin in 0 24{input}
S1 in sw c saw SW1
D1 0 sw
Vc c 0 0.4{control}
Vsaw saw 0 PULSE(0 1 0 10u 0 0 10u)
L1 sw out 100u
C1 out 0 47u
R1 out 0 3
.model SW1 SW(VT=0)
.pss
"""
BOOST = """Boost converter whose current ends
Vin in 0 12
L1 in sw 50u
S1 sw 0 c saw SW1
D1 sw out
C1 out 0 20u
R1 out 0 200
Vc c 0 0.2 AC 1
Vsaw saw 0 PULSE(0 1 0 10u 0 0 10u)
.model SW1 SW(VT=0)
.pss
"""
JUMPING = """An ideal switch tears a capacitor's charge in each period
Vin in 0 10 AC 1
R1 in a 10
C1 a 0 1u
S1 a b g 0 SW1
C2 b 0 1u
R2 b out 5
C3 out 0 1u
R3 out 0 20
Vg g 0 PULSE(0 1 0 1u 1u 4u 10u)
.model SW1 SW(VT=0.5)
.pss
"""


@pytest.mark.parametrize(
    "deck",
    [
        BUCK.format(input="", control=" AC 1"),
        BUCK.format(input=" AC 1", control=""),
        BOOST,
        JUMPING,
    ],
    ids=["control", "input", "discontinuous", "jumps"],
)
def test_steps_agree_with_closed_forms(deck: str) -> None:
    exact = nsspice.ac(nsspice.read(deck), FREQUENCIES)
    steps = nsspice.ac(nsspice.read(deck + NOTHING), FREQUENCIES)
    assert not steps.warnings
    for name in ("v(out)", "i(vin)"):
        size = np.abs(exact[name]).max()
        # halved steps changed them by less than CLOSE, of order four: a fifteenth of it is left
        assert np.abs(steps[name] - exact[name]).max() < CLOSE / 15.0 * size, name
    assert np.abs(steps["v(out)"] / exact["v(out)"] - 1.0).max() < CLOSE / 15.0


def test_a_jump_shares_the_charge_of_the_changed_capacitor() -> None:
    """The current of a capacitor whose voltage jumps has an impulse; central differences."""

    def average(value: float) -> float:
        text = JUMPING.replace("C2 b 0 1u", f"C2 b 0 {value!r}") + ".measure pss m avg v(out)\n"
        return float(nsspice.read(text).run()[0].measures["m"])

    h = 1e-4
    difference = (average(1e-6 * (1.0 + h)) - average(1e-6 * (1.0 - h))) / (2.0 * h)
    for text in (JUMPING, JUMPING + NOTHING):
        (found,) = nsspice.sens(nsspice.read(text), ["v(out)"], ["c2"])
        # the square of h, and what the steps leave
        assert abs(found.relative - difference) < 1e-6 * abs(difference)


def test_sidebands_and_sensitivities_agree_with_closed_forms() -> None:
    deck = BUCK.format(input=" AC 1", control="")
    exact, steps = (
        nsspice.read(text).run()[1]
        for text in (
            deck + ".ac list 1k 7k sidebands=2\n.save v(sw)\n",
            deck + NOTHING + ".ac list 1k 7k sidebands=2\n.save v(sw)\n",
        )
    )
    for n in (-2, -1, 1, 2):
        name = f"v(sw)@{n}"
        assert np.abs(steps[name] / exact[name] - 1.0).max() < CLOSE / 15.0, name
    for text in (BOOST, JUMPING):
        known, found = (
            {
                (s.signal, s.element): (s.average, s.relative)
                for s in nsspice.sens(nsspice.read(t), ["v(out)", "i(r1)"])
            }
            for t in (text, text + NOTHING)
        )
        assert known.keys() == found.keys()
        for key, (average, slope) in known.items():
            # the orbit is that of steps: as near as a run's tolerance
            assert abs(found[key][0] - average) < RELTOL * abs(average), key
            largest = max(abs(value) for (name, _), (_, value) in known.items() if name == key[0])
            assert abs(found[key][1] - slope) < RELTOL * largest, key


JUNCTION = """Buck converter with a junction diode
Vin in 0 24
S1 in sw c saw SH
D1 0 sw DJ
Vc c 0 {control}
Vsaw saw 0 PULSE(0 1 0 9.9u 0.1u 0 10u)
L1 sw out 100u
C1 out 0 2u
R1 out 0 5
.model DJ D(IS=1e-9 N=1.1 RS=20m CJO=200p)
.model SH SW(VT=0 RON=10m ROFF=1e6)
"""


@pytest.mark.parametrize(
    "f",
    [10e3, pytest.param(30e3, marks=pytest.mark.soak), pytest.param(130e3, marks=pytest.mark.soak)],
)
def test_a_junction_buck_against_a_run(f: float) -> None:
    """A sine of 1 mV at the control, both signs: the third order of it is 1e-6."""
    deck = nsspice.read(JUNCTION.format(control="0.4 AC 1") + ".pss")
    (expected,) = nsspice.ac(deck, [f])["v(out)"]
    # multipliers are 0.61: 40 periods leave 1e-9; ten periods are a multiple of that of the sine
    period, eps, found = 10e-6, 1e-3, []
    for sign in (1.0, -1.0):
        text = JUNCTION.format(control=f"SIN(0.4 {sign * eps} {f} 0 0 90)")
        run = nsspice.tran(
            nsspice.read(text), 50 * period, period / 500, start=40 * period, uic=True,
            reltol=1e-8, signals=["v(out)"],
        )  # fmt: skip
        found.append(np.mean(run["v(out)"][:-1] * np.exp(-2j * np.pi * f * run.time[:-1])))
    assert abs((found[0] - found[1]) / eps - expected) < 1e-4 * abs(expected)


@pytest.mark.soak
def test_sensitivities_of_a_junction_buck_against_differences() -> None:
    def average(text: str) -> float:
        (sol,) = nsspice.read(text + ".pss\n.measure pss m avg v(out)\n.options reltol=1e-7").run()
        return float(sol.measures["m"])

    text = JUNCTION.format(control="0.4")
    found = {s.element: s.relative for s in nsspice.sens(nsspice.read(text + ".pss"), ["v(out)"])}
    h = 1e-3
    for element, (line, value) in {"r1": ("R1 out 0 ", 5.0)}.items():
        sides = [
            average(text.replace(f"{line}{value:g}", f"{line}{value * (1.0 + side * h)!r}"))
            for side in (1.0, -1.0)
        ]
        # the square of h, and the orbits' own errors over h
        assert abs((sides[0] - sides[1]) / (2.0 * h) - found[element]) < 1e-5 * average(text)


CLOSED = """Buck converter with a junction diode and an integrating controller
Vin in 0 24
S1 in sw cm saw SH
D1 0 sw DJ
Vsaw saw 0 PULSE(0 1 0 9.9u 0.1u 0 10u)
L1 sw out 100u
C1 out 0 100u
R1 out 0 1
Vt fb out 0
{feedback}
Vcm cm c 0 AC 1
.model DJ D(IS=1e-9 N=1.1 RS=20m CJO=200p)
.model SH SW(VT=0 RON=10m ROFF=1e6)
.pss
"""
FEEDBACK = """Rf fb n 10k
Vref ref 0 12
Rz n z 100
Cz z c 1u
E1 c 0 ref n 1e4"""


def test_a_loop_gain_is_that_of_the_open_loop() -> None:
    """The controller's ripple is kept as a source: what it hears is opened, not what it says."""
    grid = [100.0, 300.0, 1e3, 3e3, 10e3]
    closed = nsspice.read(CLOSED.format(feedback=FEEDBACK))
    orbit = nsspice.pss(closed, row_step=2e-8, signals=["v(c)", "v(out)"])
    # from rest the integrator winds up; its capacitor stores next to nothing, and decides
    assert orbit.periodic.steps <= 20
    mean = 12.0 - orbit["v(c)"][:-1].mean() / 1e4
    assert abs(orbit["v(out)"][:-1].mean() - mean) < RELTOL * mean
    sol = nsspice.loop(closed, "vt", grid)
    points = " ".join(f"{t:.17g} {v:.17g}" for t, v in zip(orbit.time, orbit["v(c)"], strict=True))
    feedback = f"Vc c 0 PWL({points}) r=0\nRf fb n 10k\nVref n 0 12"
    plant = nsspice.ac(nsspice.read(CLOSED.format(feedback=feedback)), grid)["v(out)"]
    s = 2j * np.pi * np.array(grid)
    zf, zc = 10e3, 100.0 + 1.0 / (s * 1e-6)
    controller = 1e4 / (1.0 + 1e4 * zf / (zf + zc)) * zc / (zf + zc)
    # sidebands that come back through the closed loop: T at 100 kHz is 24 V 0.01/(w^2 LC) = 6.1e-5,
    # both sides and multiples of it add up to 2 pi^2/6 times as much, 2.0e-4
    assert np.abs(sol["t"] / (controller * plant) - 1.0).max() < 2.2e-4
    (crossover,) = sol.loop.crossovers
    assert 100.0 < crossover.frequency < 1e3


def test_rates_over_the_shortest_steps_are_not_differences() -> None:
    """A junction's charge moves within picoseconds: halved steps change the loop's response less.

    With differences over 1e-15 s as rates it wandered by 1e-4.
    """
    closed = nsspice.read(CLOSED.format(feedback=FEEDBACK))
    _, orbits = find_orbits(closed, Pss(), Request())
    orbit = next(o for o in orbits if o is not None)
    respond = responder(orbit, ["v(fb)", "v(c)"], ["vt"], Pss())
    grid = np.array([413.0])
    assert respond(grid, np.zeros(1)).shape == (1, 1, 2, 1)
    response = respond.table
    assert isinstance(response, SteppedResponse)
    coarse, fine = (response.at(k).responses(2j * np.pi * grid) for k in (1, 2))
    assert np.abs(fine / coarse - 1.0).max() < 1e-7

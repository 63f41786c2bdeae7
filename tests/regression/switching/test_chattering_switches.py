"""Switches without hysteresis that hold their own control at its threshold: sampled, not skipped.

Implicit steps of a row let the current of a converter swing between 1 and 20 A where its comparator
asks for 4 A, certified; with error control the run did not end.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from decks.chattering import late_but_sound
from decks.output_points import told

import nsspice

#: v(o) is held by a large capacitor: the current rises with 100 kA/s and falls with 230 kA/s
BOOST = """boost converter that compares its current with {limit}
V1 p 0 100
L1 p x 1m IC=0
S1 x 0 g 0 gate
D1 x o {diode}
C1 o 0 1 IC=330
R1 o 0 300
Bg g 0 V=if(i(L1) < {limit}, 1, 0)
.model gate SW(VT=0.5 RON=1u)
.model lossless D(ideal)
.model smooth D(IS=1e-9)
.tran 100u {stop} uic
"""
#: the share of the run between two looks of a switch
INTERVALS = {"modewise": 5e-6, "sdirk": 2e-5}


@pytest.mark.parametrize(
    ("method", "diode"), [("modewise", "lossless"), ("sdirk", "lossless"), ("sdirk", "smooth")]
)
@pytest.mark.parametrize("stop", [2e-3, 20e-3])
def test_a_current_stays_at_its_limit(method: str, diode: str, stop: float) -> None:
    text = BOOST.format(limit="4", diode=diode, stop=stop)
    circuit = nsspice.read(text)
    run = nsspice.tran(circuit, method=method)
    current = run["i(l1)"][run.time > 0.1e-3]
    # a look may come one interval late, and the comparator and the switch react together
    slack = INTERVALS[method] * stop * np.array([232e3, 100e3])
    assert current.min() >= 4.0 - 1.01 * slack[0]
    assert current.max() <= 4.0 + 1.01 * slack[1]
    assert late_but_sound(run.certificate)
    assert abs(run.certificate.energy.scheme) < 1e-4 * run.certificate.energy.delivered
    show = partial(nsspice.tran, circuit, method=method, all_points=True, on_failure="warn")
    assert told(run, show) == ["NS3052"]


def test_a_limit_that_moves_is_followed_beside_a_smooth_law() -> None:
    """A rectified sine as the limit: the current follows it where 100 V can."""
    limit = "2*abs(sin(2*pi*50*time))+1"
    text = BOOST.format(limit=limit, diode="smooth", stop=10e-3)
    run = nsspice.tran(nsspice.read(text))
    late = run.time > 0.1e-3
    wanted = 2.0 * np.abs(np.sin(100.0 * np.pi * run.time[late])) + 1.0
    slack = 2e-5 * 10e-3 * 233e3
    assert np.abs(run["i(l1)"][late] - wanted).max() <= 1.01 * slack


def test_a_smaller_longest_step_lets_the_switch_react_earlier() -> None:
    text = BOOST.format(limit="4", diode="lossless", stop="0.2m 0 0.2n")
    run = nsspice.tran(nsspice.read(text))
    current = run["i(l1)"][run.time > 0.05e-3]
    assert np.abs(current - 4.0).max() <= 1.01 * 0.2e-9 * 232e3


def test_relays_of_one_leg_change_together() -> None:
    """Both at once or not at all: else they join two sources, or cut a current off."""
    text = """leg of relays that holds a current
Vp p 0 100
Vn n 0 -100
S1 p a r i relay
S2 a n i r relay
L1 a m 10m IC=0
Vs m 0 0
H1 i 0 Vs 1
Vr r 0 SIN(0 1 50)
.model relay SW(VT=0)
.tran 20u 20m uic
"""
    for method, interval in INTERVALS.items():
        run = nsspice.tran(nsspice.read(text), method=method)
        slack = 1.05 * interval * 20e-3 * 100.0 / 10e-3
        assert np.abs(run["i(l1)"] - run["v(r)"]).max() <= slack
        assert np.abs(run["i(vp)"]).max() <= 1.1
        assert late_but_sound(run.certificate)


def test_the_rounding_of_an_instant_is_no_chatter() -> None:
    """A gate that its own ripple turns twice at one crossing is not sampled."""
    text = """comparator on a slow sine
V1 a 0 SIN(0 1 50)
B1 g 0 V=if(v(a) > 0.5, 1, 0)
S1 x 0 g 0 gate
R1 v x 1k
V2 v 0 5
C1 x 0 1n
.model gate SW(VT=0.5 RON=1)
.tran 10u 60m
"""
    for method in INTERVALS:
        circuit = nsspice.read(text)
        run = nsspice.tran(circuit, method=method)
        assert not told(run, partial(nsspice.tran, circuit, method=method, all_points=True))
        on = [e.time for e in run.events if e.element.startswith("s1") and e.change == "on"]
        assert on == pytest.approx([(k + 1.0 / 12.0) / 50.0 for k in range(3)], rel=1e-9)


#: with the ripple of its current in it, the error voltage slides along the saw while it rises
SAW = """buck converter whose error voltage slides along its saw
Vin in 0 24
S1 in sw g 0 gate
D1 0 sw ideal
L1 sw o 47u IC=0
C1 o 0 100u IC=0
R1 o 0 3
Vsaw saw 0 PULSE(0 1 0 9.9u 0.1u 0 10u)
Be e 0 V=20*(5-v(o))-i(L1){product}
Bg g 0 V=if(v(e)>v(saw),1,0)
.model gate SW(VT=0.5 RON=10m)
.model ideal D(ideal)
.tran 1u 0.4m uic
"""


@pytest.mark.parametrize("product", ["", "*v(in)/24"])
@pytest.mark.parametrize("reltol", [1e-3, 1e-5])
def test_what_slides_stays_in_no_mode_for_the_error_of_a_step(product: str, reltol: float) -> None:
    """The continuous solution of a first step began off the threshold by its tolerance.

    Back it came nanoseconds later, with every event: the switch was open for most of the slide,
    4.921 V at all tolerances (14 s).
    """
    circuit = nsspice.read(SAW.format(product=product))
    run = nsspice.tran(circuit, method="sdirk", reltol=reltol)
    # fixed steps of 2 ns: 24 V for 2 ns in 10 us are 5 mV; of 10 ns 4.9025 V
    fixed = nsspice.tran(circuit, method="moreau", step=2e-9)
    assert run.certificate.passed or late_but_sound(run.certificate)
    assert run["v(o)"][-1] == pytest.approx(fixed["v(o)"][-1], abs=5e-3)
    assert run.stats["steps"] < 3000


#: the comparator, without hysteresis and without blanking, sees the charge of the switch run off:
#: the latch slides along the threshold of the gate
CURRENT_MODE = """flyback whose latch is reset by the first nanosecond of its own current
Vin in 0 100
L1 in sw 500u
L2 0 s 5u
K1 L1 L2 0.985
S1 sw cs q 0 mos
Coss sw cs 80p
Rs cs 0 0.3
Dc sw cl dfast
Ccl cl in 10n
Rcl cl in 22k
D2 s out dout
Cout out 0 470u ic=10
Rout out 0 4
Vclk clk 0 PULSE(0 1 0 50n 50n 300n 15u)
Bq qi 0 V=if(v(cs)>0.7,0,if(v(clk)>0.5,1,if(v(q)>0.5,1,0)))
Rq qi q 100
Cq q 0 50p
.model mos sw(vt=0.5 ron=0.5 roff=100meg)
.model dfast d(is=1e-12 n=1.7 rs=0.1 cjo=20p tt=50n bv=600)
.model dout d(is=1e-7 n=1.1 rs=10m cjo=300p tt=80n)
.tran 1u {stop}u uic
"""


@pytest.mark.parametrize("stop", [18.7, 28])
def test_implicit_steps_that_pass_over_a_look(stop: float) -> None:
    """The next step ended at that look, before its begin: 1e9 of its lengths back, 1e33 J."""
    run = nsspice.tran(nsspice.read(CURRENT_MODE.format(stop=stop)))
    assert late_but_sound(run.certificate)
    assert run.certificate.taken < 1e-3
    # steps of picoseconds: their charges are known to rounding (5e-9 as well as stages are)
    assert run.certificate.laws < 2e-9
    # 100 V for some 7 us fill 500 uH less what returns at each pulse
    assert np.abs(run["i(l1)"]).max() < 100.0 * stop * 1e-6 / 500e-6
    assert run["v(cl)"].max() < 600.0

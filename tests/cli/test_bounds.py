"""``nsspice bounds`` on the command line."""

import json

import pytest

DECK = """Chopper with an RL load
V1 in 0 10
S1 in a g 0 SW
D1 0 a
L1 a b 1m
R1 b 0 2
Vg g 0 PULSE(0 1 0 0 0 50u 100u)
.model SW SW(VT=0.5)
.pss
.measure pss mean AVG i(l1)
"""


@pytest.fixture
def deck(tmp_path):
    path = tmp_path / "chopper.net"
    path.write_text(DECK)
    return str(path)


def test_bounds_are_printed_and_hold_the_closed_form(deck, call):
    found = call("bounds", deck, "--param", "v1=5%", "--param", "r1=1.8:2.2", "--json")
    assert found.exit_code == 0
    mean = json.loads(found.stdout)["measures"]["mean"]
    # the diode is ideal: the mean voltage is that of the source times the duty
    assert mean["low"] <= 0.5 * 9.5 / 2.2
    assert mean["high"] >= 0.5 * 10.5 / 1.8
    found = call("bounds", deck, "--param", "v1=5%")
    assert found.exit_code == 0
    assert "proved for the whole box" in found.stdout + found.stderr


def test_what_is_not_decided_ends_with_1(deck, call):
    # a load of 200 Ohm lets the current end in each period
    found = call("bounds", deck, "--param", "r1=2:200", "--seconds", "0")
    assert found.exit_code == 1
    assert "not decided" in found.stdout + found.stderr


@pytest.mark.parametrize("given", ["r1", "r1=a:b", "r1=-5%", "=1:2"])
def test_a_tolerance_that_cannot_be_read_is_refused(deck, call, given):
    found = call("bounds", deck, "--param", given)
    assert found.exit_code == 2
    assert "NS4005" in found.stdout + found.stderr

"""What a program asks for and cannot get is refused by name, not computed as something else."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import nsspice
from nsspice.analyses.request import method
from nsspice.problems import Csc, DescriptorSystem, Functional, Switch
from nsspice.solvers.modewise import ModewiseStepper
from nsspice.solvers.moreau import MoreauStepper
from nsspice.solvers.sdirk import SdirkStepper

TEXT = """a rectifier
.param r=10
V1 a 0 SIN(0 1 50)
R1 a b 1
D1 b c
C1 c 0 1m
L1 c d 1m
R2 d 0 {r}
.tran 1m 20m
"""


@pytest.mark.parametrize(
    ("given", "code", "said"),
    [
        ({"values": {"zz": 1.0}}, "NS2012", "no element zz"),
        ({"values": {"d1": 1.0}}, "NS4007", "d1 cannot"),
        ({"values": {"c1": -1.0}}, "NS4005", "c1 cannot have the capacitance -1"),
        ({"values": {"l1": -1.0}}, "NS4005", "l1 cannot have the inductance -1"),
        ({"values": {"r1": math.nan}}, "NS4005", "r1 cannot be nan"),
        ({"values": {"r1": "1k"}}, "NS4005", "r1 cannot be '1k'"),
        ({"values": {3: 1.0}}, "NS4005", "an element cannot be 3"),
        ({"row_step": 0}, "NS4005", "must be positive, not 0"),
        ({"row_step": "1m"}, "NS4005", "finite numbers, not '1m'"),
        ({"start": 1.0}, "NS4005", "not 1 and 0.02"),
        ({"step": "1u"}, "NS4005", "step cannot be '1u'"),
        ({"reltol": math.nan}, "NS4005", "reltol cannot be nan"),
        ({"method": 3}, "NS4005", "method cannot be 3"),
        ({"signals": [3]}, "NS4005", "a signal cannot be 3"),
    ],
)
def test_transients_that_cannot_be(given: dict[str, Any], code: str, said: str) -> None:
    with pytest.raises(nsspice.NsspiceError, match=said) as found:
        nsspice.tran(nsspice.read(TEXT), stop=20e-3, **given)
    assert found.value.code == code
    assert found.value.diagnostics[0].hint


@pytest.mark.parametrize(
    ("call", "code", "said"),
    [
        (lambda c: nsspice.op(c, values={"zz": 1.0}), "NS2012", "no element zz"),
        (lambda c: nsspice.dc(c, "v1", [1.0], overrides={"d1": 1.0}), "NS4007", "d1 cannot"),
        (lambda c: nsspice.dc(c, "c1", [1.0, -1.0]), "NS4005", "the capacitance -1"),
        (lambda c: nsspice.dc(c, 3, [1.0]), "NS4005", "cannot be 3"),
        (lambda c: nsspice.dc(c, "v1", ["a"]), "NS4005", "holds a"),
        (lambda c: nsspice.read(TEXT, {"rr": 1.0}), "NS1083", "no parameter rr"),
        (lambda c: nsspice.read(TEXT, {"r": "1k"}), "NS4005", "r cannot be '1k'"),
        (
            lambda c: nsspice.read(f"{TEXT}.step C1 list 1u -2u\n").run(),
            "NS4005",
            "the capacitance -2e-06",
        ),
    ],
)
def test_other_requests(call: Callable[[Any], object], code: str, said: str) -> None:
    with pytest.raises(nsspice.NsspiceError, match=said) as found:
        call(nsspice.read(TEXT))
    assert found.value.code == code


def test_names_of_values_may_be_in_upper_case() -> None:
    """They were looked up as they stand, and had no effect.  1 V over 2 + 2 Ohm."""
    circuit = nsspice.read("divider\nV1 a 0 1\nR1 a b 1\nR2 b 0 2\n.op\n")
    assert nsspice.op(circuit, values={"R1": np.float64(2.0)})["v(b)"][0] == pytest.approx(0.5)


def system(**parts: Any) -> DescriptorSystem:
    """Return 1 F beside 1 Ohm."""
    one, none = Csc.from_triplets((1, 1), [0], [0], [1.0]), Csc.zeros
    given: dict[str, Any] = {
        "E": one, "G": one, "A": none((1, 0)), "B": none((0, 1)), "D": none((0, 0)),
        "q": np.zeros(0), "S": none((1, 0)), **parts,
    }  # fmt: skip
    return DescriptorSystem(**given)


def test_rows_are_those_of_currents_unless_they_are_told() -> None:
    """The default was no row at all, and an IndexError."""
    stepper = MoreauStepper(system(), [Functional(z=((0, 1.0),))])
    stepper.start_charges(0.0, np.array([1.0]), 1.0)
    stepper.plan(0.0, 1.0, 1.0, 0.0, 1.0)
    rows, _ = stepper.advance(10)
    assert rows[-1].tolist() == pytest.approx([1.0, 0.5])  # one implicit step: 1/(1 + h)


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({"row_kind": np.zeros(2, np.uint8)}, "row_kind has the shape .2,., not .1,."),
        ({"E": Csc.zeros((2, 2))}, "E has the shape"),
        ({"q": np.zeros(3)}, "q has the shape"),
        ({"B": Csc.zeros((1, 1))}, "B has the shape"),
    ],
)
def test_arrays_that_do_not_fit(parts: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        system(**parts)


@pytest.mark.parametrize("off_below", [0.9, math.nan])
def test_a_switch_that_opens_above_its_closing(off_below: float) -> None:
    with pytest.raises(ValueError, match="off_below <= on_above"):
        Switch(0, ((0, 1.0),), 0.5, off_below)


@pytest.mark.parametrize("engine", [MoreauStepper, SdirkStepper, ModewiseStepper])
@pytest.mark.parametrize(
    ("plan", "said"),
    [
        ((0.0, 1.0, -0.1, 0.0, 0.1), "step is -0.1"),
        ((0.0, 1.0, math.nan, 0.0, 0.1), "step is nan"),
        ((0.0, 1.0, 0.0, 0.0, 0.1), "step is 0"),
        ((0.0, 1.0, 0.1, 0.0, -0.1), "out_step is -0.1"),
        ((0.0, math.nan, 0.1, 0.0, 0.1), "stop is nan"),
        ((0.0, -1.0, 0.1, 0.0, 0.1), "stop is -1"),
        ((0.0, 1.0, 0.1, math.inf, 0.1), "out_start is inf"),
    ],
)
def test_plans_that_lead_nowhere(engine: Any, plan: tuple[float, ...], said: str) -> None:
    stepper = engine(system(), [Functional(z=((0, 1.0),))])
    with pytest.raises(ValueError, match=said):
        stepper.plan(*plan)


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda c: nsspice.tran(c, values=[1.0]), r"the values of elements cannot be \[1.0\]"),
        (lambda c: nsspice.tran(c, temperature="hot"), "a temperature of hot is not a number"),
        (lambda c: nsspice.tran(c, temperature=-300), "not above absolute zero"),
        (lambda c: nsspice.dc(c, "v1", 1.0), "the values of v1 cannot be 1.0"),
        (lambda c: nsspice.tran(c, signals=3), "the signals cannot be 3"),
    ],
)
def test_arguments_of_the_wrong_kind(ask: Callable[[nsspice.Circuit], Any], said: str) -> None:
    """They ended in errors of Python that name no argument."""
    with pytest.raises(nsspice.UsageError, match=said) as caught:
        ask(nsspice.read(TEXT))
    assert caught.value.code == "NS4005"


def test_solutions_are_compared_as_objects() -> None:
    """Compared field by field, their arrays had no truth."""
    first, second = (nsspice.tran(nsspice.read(TEXT)) for _ in range(2))
    assert first == first
    assert first != second


def test_one_method_may_be_a_text() -> None:
    report = nsspice.cost(nsspice.read(TEXT), methods="moreau", limit=1e-3)
    assert {row.method for row in report.rows} == {"moreau"}


def test_first_order_steps_are_not_taken_without_a_word(monkeypatch: pytest.MonkeyPatch) -> None:
    text = "half wave\nV1 a 0 SIN(0 1 1k)\nD1 a b dm\nR1 b 0 1k\nC1 b 0 1u\n.model dm D(ideal)\n"
    circuit = nsspice.read(text + ".tran 10u 1m\n.end")
    assert "NS3069" not in [w.code for w in nsspice.tran(circuit).warnings]
    monkeypatch.setattr(method, "AUTO_LIMIT", 1)
    monkeypatch.setattr(method, "CONTROL_LIMIT", 1)
    run = nsspice.tran(circuit)
    (warning,) = (w for w in run.warnings if w.code == "NS3069")
    assert run.islands[0].method == "moreau"
    assert "first order" in warning.message
    assert "method=sdirk" in warning.hint
    # who asks for fixed steps knows
    for asked in ({"method": "moreau"}, {"step": 1e-6}):
        assert "NS3069" not in [w.code for w in nsspice.tran(circuit, **asked).warnings]

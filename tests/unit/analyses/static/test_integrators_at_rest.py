"""An integrator whose input does not vanish has no DC solution, whatever stands beside it.

Beside a product the search went on to 1e16 V, where the rounding of the voltages is as large as
the ampere that was missed; the run in time that began there was certified.
"""

import pytest

import nsspice

DECK = """an integrator
V1 a 0 {source}
R1 a 0 1k
G1 0 x a 0 {gain}
C1 x 0 1u
B1 o 0 V=v(x)*v(a)+v(x)*v(o)
R2 o 0 1k
{analysis}
"""


@pytest.mark.parametrize("source", ["1", "1m", "1k"])
@pytest.mark.parametrize("gain", ["1", "1u"])
@pytest.mark.parametrize(
    ("analysis", "advice"), [(".op", "DC path to ground"), (".tran 1u 1m", "uic")]
)
def test_it_is_told(source: str, gain: str, analysis: str, advice: str) -> None:
    with pytest.raises(nsspice.NsspiceError) as error:
        nsspice.read(DECK.format(source=source, gain=gain, analysis=analysis)).run()
    assert error.value.code in ("NS3001", "NS3004")
    assert advice in str(error.value)


def test_it_starts_from_given_values() -> None:
    deck = DECK.format(source="1", gain="1u", analysis=".tran 1u 1m uic")
    run = nsspice.read(deck).run()[0]
    assert run.certificate is not None
    assert run.certificate.passed
    # 1 uA into 1 uF for 1 ms
    assert run["v(x)"][-1] == pytest.approx(1e-3, rel=1e-6)

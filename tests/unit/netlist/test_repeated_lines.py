"""PWL with repeated parts, as PSpice and LTspice write them."""

from __future__ import annotations

import pytest

from nsspice import NetlistError, read
from nsspice.netlist.parsing import parse_text


def points(written: str) -> tuple[tuple[float, ...], float | None]:
    """Return times and values in turn, and where the source begins again."""
    text = f"title\n.param n=2 tau=1u\nV1 a 0 {written}\nR1 a 0 1\n.tran 1u 10u\n"
    source = parse_text(text).elements[0].source
    assert source is not None
    return tuple(v or 0.0 for v in source.values), source.options.get("r")


@pytest.mark.parametrize(
    ("written", "expected", "repeat"),
    [
        ("PWL REPEAT FOREVER (0 0 1 5 2 0) ENDREPEAT", (0, 0, 1, 5, 2, 0), 0.0),
        ("PWL (REPEAT FOREVER 0 0 +1 5 +1 0 ENDREPEAT)", (0, 0, 1, 5, 2, 0), 0.0),
        ("PWL repeat for 2 (0,0)(1,5)(2,0) endrepeat", (0, 0, 1, 5, 2, 0, 2, 0, 3, 5, 4, 0), None),
        ("PWL REPEAT FOR {n} (0 0 1 5) ENDREPEAT", (0, 0, 1, 5, 1, 0, 2, 5), None),
        ("PWL REPEAT FOR n (+1 2 +1 5) ENDREPEAT +3 4", (1, 2, 2, 5, 3, 2, 4, 5, 7, 4), None),
        # each part counts from where it begins, as in the example of PSpice's reference guide
        ("PWL REPEAT FOR 2 (.5 0 .75 1 1 0) ENDREPEAT REPEAT FOR 1 (.25 0 .5 1 1 0) ENDREPEAT",
         (0.5, 0, 0.75, 1, 1, 0, 1.5, 0, 1.75, 1, 2, 0, 2.25, 0, 2.5, 1, 3, 0), None),
        # a part that does not begin at once is entered from its last value from the second turn on
        ("PWL REPEAT FOREVER (1 3 2 5) ENDREPEAT", (1, 3, 2, 5, 3, 3, 4, 5), 2.0),
        ("PWL 0 7 1 8 REPEAT FOREVER (0 3 2 5) ENDREPEAT",
         (0, 7, 1, 8, 1, 3, 3, 5, 3, 3, 5, 5), 3.0),
    ],
)  # fmt: skip
def test_points(written: str, expected: tuple[float, ...], repeat: float | None) -> None:
    assert points(written) == (expected, repeat)


@pytest.mark.parametrize(
    "source",
    [
        "PWL 0 0 1u 3 REPEAT FOREVER (1u 1 2u 5 2.5u 0) ENDREPEAT",
        "PWL REPEAT FOR 3 (0 1 2u 2) ENDREPEAT",
    ],
)
def test_waveforms(source: str) -> None:
    """Against lines between the points, written down turn by turn."""
    forever = "FOREVER" in source
    rows = read(f"title\nV1 a 0 {source}\nR1 a 0 1\n.tran 0.1u 8.55u\n").run()[0]
    times = [0, 1, 2, 3, 3.5, 4.5, 5.5, 6, 7, 8, 8.5, 9.5] if forever else [0, 2, 2, 4, 4, 6]
    levels = [0, 3, 1, 5, 0, 1, 5, 0, 1, 5, 0, 1] if forever else [1, 2, 1, 2, 1, 2]

    for t, v in zip(rows.time, rows["v(a)"], strict=True):
        x = 1e6 * float(t)
        if not forever and any(abs(x - jump) < 1e-6 for jump in (2.0, 4.0)):
            continue  # either side
        k = max((j for j, at in enumerate(times) if at <= x + 1e-9), default=0)
        if k + 1 == len(times):
            expected = float(levels[k])
        else:
            share = (x - times[k]) / (times[k + 1] - times[k])
            expected = levels[k] + share * (levels[k + 1] - levels[k])
        assert float(v) == pytest.approx(expected, abs=1e-8), x  # rounding of times: 5e6 V/s


@pytest.mark.parametrize(
    ("written", "code", "said"),
    [
        ("PWL REPEAT (0 0 1 1) ENDREPEAT", "NS1008", "followed by FOREVER"),
        ("PWL REPEAT FOREVER (0 0 1 1)", "NS1044", "not closed"),
        ("PWL 0 0 1 1 ENDREPEAT", "NS1044", "without a preceding repeat"),
        ("PWL REPEAT FOR 2 (0 0 REPEAT FOR 3 (1 1) ENDREPEAT) ENDREPEAT", "NS1044", "another one"),
        ("PWL REPEAT FOREVER (0 0 1) ENDREPEAT", "NS1008", "3 numbers given"),
        ("PWL REPEAT FOREVER () ENDREPEAT", "NS1008", "nothing is repeated"),
        ("PWL REPEAT FOREVER (0 0 1 1) ENDREPEAT 3 4", "NS1009", "forever"),
        ("PWL REPEAT FOR 2 (0 0 1 1) ENDREPEAT 3 4", "NS1009", "ambiguous"),
        ("PWL REPEAT FOR 1.5 (0 0 1 1) ENDREPEAT", "NS1009", "1.5 times"),
        ("PWL REPEAT FOR 0 (0 0 1 1) ENDREPEAT", "NS1009", "0 times"),
        ("PWL REPEAT FOR 2 (0 1) ENDREPEAT", "NS1009", "zero length"),
        ("PWL REPEAT FOR 1e9 (0 0 1 1) ENDREPEAT", "NS1043", "1000000 points"),
        ("PWL REPEAT FOREVER (0 0 1 1) ENDREPEAT r=0", "NS1009", "r="),
    ],
)
def test_mistakes(written: str, code: str, said: str) -> None:
    with pytest.raises(NetlistError, match=said) as found:
        points(written)
    (diagnostic,) = found.value.diagnostics
    assert diagnostic.code == code
    assert diagnostic.span is not None
    assert diagnostic.span.line == 3
    assert diagnostic.hint

import pytest

from nsspice.devices.diodes.characteristic import Characteristic, diode_curve


def current(curve: Characteristic, v: float) -> float:
    """Current of a curve with positive on-resistances at a voltage, from its decomposition."""
    parts = curve.decompose()
    total = parts.conductance * v
    for pair in parts.pairs:
        sign = 1.0 if pair.forward else -1.0
        total += sign * max(sign * v - pair.offset, 0.0) / pair.resistance
    return total


def test_slopes_are_exactly_the_given_ones():
    curve = diode_curve(vfwd=0.7, ron=0.3, roff=50.0, vrev=5.0, rrev=2.0)
    slope = (current(curve, 1.7) - current(curve, 0.7)) / 1.0
    assert slope == pytest.approx(1 / 0.3, rel=1e-14)
    assert (current(curve, -6.0) - current(curve, -5.0)) == pytest.approx(-1 / 2.0, rel=1e-14)
    assert current(curve, 0.5) == pytest.approx(0.5 / 50.0)


@pytest.mark.parametrize("v", [-9.0, -5.0, -1.0, 0.0, 0.6, 0.7, 3.0])
def test_decomposition_lies_on_the_curve(v):
    curve = diode_curve(vfwd=0.7, ron=0.3, roff=50.0, vrev=5.0, rrev=2.0)
    assert curve.contains(current(curve, v), v, 1e-12)
    assert not curve.contains(current(curve, v) + 0.1, v, 1e-3)


def test_ideal_diode_is_one_pair_without_anything():
    parts = diode_curve().decompose()
    assert parts.conductance == 0.0
    assert [(p.forward, p.offset, p.resistance) for p in parts.pairs] == [(True, 0.0, 0.0)]


def test_sign_element_has_two_coinciding_vertices():
    parts = diode_curve(vfwd=0.0, vrev=0.0).decompose()
    assert [(p.forward, p.offset) for p in parts.pairs] == [(True, 0.0), (False, 0.0)]


def test_on_resistance_without_leakage_keeps_its_bits():
    for ron in (0.1, 1e-3, 0.3, 7e-12):
        assert diode_curve(ron=ron).decompose().pairs[0].resistance == ron


def test_three_pieces_on_one_side_give_two_pairs():
    curve = Characteristic(((0.0, 0.0), (1.0, 1.0)), ((0.0, 1.0), (1.0, 1.0), (1.0, 0.0)))
    pairs = curve.decompose().pairs
    assert [(p.offset, p.resistance) for p in pairs] == [(0.0, 1.0), (1.0, 0.0)]


def test_wrong_curves_are_refused():
    with pytest.raises(ValueError, match="upwards"):
        Characteristic(((0.0, 0.0),), ((0.0, 1.0), (1.0, -1.0)))
    with pytest.raises(ValueError, match="k \\+ 1"):
        Characteristic((), ())
    tapering = Characteristic(((0.0, 0.0), (1.0, 1.0)), ((0.0, 1.0), (1.0, 1.0), (1.0, 9.0)))
    with pytest.raises(ValueError, match="grow"):
        tapering.decompose()
    shifted = Characteristic(((1.0, 0.0),), ((0.0, 1.0), (1.0, 0.0)))
    with pytest.raises(ValueError, match="origin"):
        shifted.decompose()

"""Model cards as libraries of several programs have them."""

from __future__ import annotations

import pytest

import nsspice
from nsspice.compare import ngspice

STAGE = "t\nV1 c 0 {0}5\nR1 c b 100k\nQ1 c b 0 qm\nQ2 c b 0 qm\n.op\n.save all alli\n"


def current(card: str, sign: str = "") -> float:
    circuit = nsspice.read(STAGE.format(sign) + f".model qm {card}\n")
    return float(circuit.run()[0]["i(q1)"][0])


def warnings(card: str) -> list[tuple[str, str]]:
    circuit = nsspice.read(STAGE.format("") + f".model qm {card}\n")
    return [(w.code, w.message) for w in circuit.warnings]


def test_lateral_transistors() -> None:
    assert current("LPNP(BF=20)", "-") == current("PNP(BF=20)", "-")


@pytest.mark.parametrize(
    ("card", "same"),
    [
        ("NPN(IS=1f C2=1000)", "NPN(IS=1f ISE=1p)"),
        ("NPN(C2=1e4 C4=1e5)", "NPN(ISE=1p ISC=10p)"),
        ("NPN(IS=1f C2=10 ISE=1p)", "NPN(IS=1f ISE=1p)"),
    ],
)
def test_leakage_as_a_multiple(card: str, same: str) -> None:
    assert current(card) == pytest.approx(current(same), rel=1e-12)
    assert current(card) != pytest.approx(current("NPN(IS=1f)"), rel=1e-2)
    text = STAGE.format("") + f".model qm {card}\n"
    assert ngspice.cross_check(nsspice.read(text), tolerance=1e-3).passed


@pytest.mark.parametrize("key", ["mje", "mjc", "mjs", "me"])
def test_steep_junctions_of_transistors(key: str) -> None:
    main = {"me": "mje"}.get(key, key)
    expected = ("NS2058", f"{main}=1 of model qm is limited to 0.999")
    assert warnings(f"npn(cje=1p cjc=1p cjs=1p {key}=1)").count(expected) == 1


def test_steep_diodes() -> None:
    text = "t\nV1 a 0 SIN(0 5 1k)\nR1 a b 1k\nD1 b 0 dm\n.tran 10u 2m\n.model dm d(cjo=1u m={})\n"
    steep, limit = (nsspice.read(text.format(m)) for m in ("1", "0.9"))
    assert [w.code for w in steep.warnings] == ["NS2058"]
    assert not limit.warnings
    assert (steep.run()[0]["v(b)"] == limit.run()[0]["v(b)"]).all()


def test_breakdown_of_transistors_is_told_once() -> None:
    ((code, message),) = warnings("npn(BVcbo=60 BVbe=5)")
    assert code == "NS2052"
    assert message == "bvcbo, bvbe of model qm are ignored: its transistors do not break down"


def test_ratings() -> None:
    ((code, message),) = warnings("npn(Vceo=45 Icrating=100m mfg=NXP ic_max=1 pd_max=1)")
    assert code == "NS2052"
    assert message.startswith("vceo, icrating, mfg, ic_max, pd_max of model qm cannot change")


def test_another_place_of_the_substrate_is_one_error_with_advice() -> None:
    with pytest.raises(nsspice.NsspiceError) as caught:
        warnings("npn(subs=2)")
    (finding,) = caught.value.diagnostics
    assert finding.hint == "remove it: the default is 1 for NPN and -1 for PNP transistors"


@pytest.mark.parametrize(("count", "who"), [(1, "q1 needs"), (2, "q1 and 1 more element need")])
def test_a_wrong_type_is_one_error_for_all_of_its_elements(count: int, who: str) -> None:
    lines = "".join(f"Q{k} a a 0 qq\n" for k in range(1, count + 1))
    with pytest.raises(nsspice.NsspiceError) as caught:
        nsspice.read(f"t\nV1 a 0 1\n{lines}.model qq NJF\n")
    (finding,) = caught.value.diagnostics
    assert finding.code == "NS2002"
    assert finding.message == f"{who} a .model of type npn or pnp, but qq is of type njf"

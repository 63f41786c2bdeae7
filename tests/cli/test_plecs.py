"""Thermal descriptions of vendors as model cards: each number is where it was in the file."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

import nsspice
from nsspice.cli.commands.plecs import card
from nsspice.errors import UsageError

Call = Callable[..., Result]

IGBT = """<?xml version="1.0" encoding="UTF-8"?>
<SemiconductorLibrary xmlns="http://www.plexim.com/xml/semiconductors/" version="1.1">
  <Package class="IGBT with Diode" vendor="Acme" partnumber="AB-40 T60">
    <Variables/>
    <SemiconductorData type="IGBT with Diode">
      <TurnOnLoss>
        <ComputationMethod>Table only</ComputationMethod>
        <CurrentAxis>0 20 40</CurrentAxis><VoltageAxis>0 300</VoltageAxis>
        <TemperatureAxis>25 125</TemperatureAxis>
        <Energy scale="0.001">
          <Temperature><Voltage>0 0 0</Voltage><Voltage>0 0.5 1.25</Voltage></Temperature>
          <Temperature><Voltage>0 0 0</Voltage><Voltage>0 0.75 2</Voltage></Temperature>
        </Energy>
      </TurnOnLoss>
      <TurnOffLoss>
        <ComputationMethod>Table only</ComputationMethod>
        <CurrentAxis>-40 0 40</CurrentAxis><VoltageAxis>0 300</VoltageAxis>
        <TemperatureAxis>25</TemperatureAxis>
        <Energy scale="0.001">
          <Temperature><Voltage>0 0 0</Voltage><Voltage>0.9 0 1.5</Voltage></Temperature>
        </Energy>
      </TurnOffLoss>
      <ConductionLoss>
        <ComputationMethod>Table only</ComputationMethod>
        <CurrentAxis>-40 -20 0 20 40</CurrentAxis><TemperatureAxis>25 125</TemperatureAxis>
        <VoltageDrop scale="1">
          <Temperature>-1.5 -1.2 0 1.4 1.8</Temperature>
          <Temperature>-1.6 -1.2 0 1.5 2.1</Temperature>
        </VoltageDrop>
      </ConductionLoss>
    </SemiconductorData>
    <ThermalModel><Branch type="Foster">
      <RTauElement R="0.1" Tau="0.001"/><RTauElement R="0.2" Tau="0.02"/>
    </Branch></ThermalModel>
  </Package>
</SemiconductorLibrary>
"""
DIODE = """<Package class="Diode" vendor="Acme" partnumber="D1">
<SemiconductorData type="Diode">
<TurnOffLoss><ComputationMethod>Table only</ComputationMethod><CurrentAxis>0 30</CurrentAxis>
<VoltageAxis>-600 0</VoltageAxis><TemperatureAxis>25</TemperatureAxis>
<Energy scale="1e-6"><Temperature><Voltage>0 600</Voltage><Voltage>0 0</Voltage></Temperature>
</Energy></TurnOffLoss>
<ConductionLoss><CurrentAxis>0 10 30</CurrentAxis><TemperatureAxis>25</TemperatureAxis>
<VoltageDrop scale="1"><Temperature>0 1.1 1.5</Temperature></VoltageDrop></ConductionLoss>
</SemiconductorData>
<ThermalModel><Branch type="Cauer"><RCElement R="0.3" C="0.005"/><RCElement R="0.6" C="0.1"/>
</Branch></ThermalModel></Package>
"""  # fmt: skip


def models(text: str) -> dict[str, nsspice.Circuit]:
    """Return a circuit with each card of a text in use."""
    joined = re.sub(r"\n\+", "", text)
    found = dict(re.findall(r"\.model (\w+) (\w+)\(", joined))
    line = {"NIGBT": "Z1 a 0 a", "SW": "S1 a 0 a 0", "D": "D1 0 a"}
    heat = ".options temp=60\n"
    return {
        name: nsspice.read(f"title\nV1 a 0 1\n{line[kind]} {name}\n{heat}{text}\n.op\n")
        for name, kind in found.items()
    }


def test_energies_and_chains_are_those_of_the_file() -> None:
    text = card(IGBT)
    assert max(map(len, text.splitlines())) <= 100
    circuits = models(text)
    assert sorted(circuits) == ["AB_40_T60", "AB_40_T60_D"]
    joined = re.sub(r"\n\+", "", text)
    energies = "0 0 0 0 0.0005 0.00125 0 0 0 0 0.00075 0.002"
    assert f"Eon=table(i=0 20 40 v=0 300 t=25 125 e={energies})" in joined
    assert "Eoff=table(i=0 40 v=0 300 e=0 0 0 0.0015)" in joined
    assert "Err=table(i=0 40 v=0 300 e=0 0 0 0.0009)" in joined
    assert "Foster=table(r=0.1 0.2 tau=0.001 0.02)" in joined
    # lines through (20 A, 1.5 V), (40 A, 2.1 V) and (20 A, 1.2 V), (40 A, 1.6 V)
    assert "Vce0=0.9 Ron=0.03 " in joined
    assert "D(Vfwd=0.8 Ron=0.02 " in joined


def test_a_diode_loses_energy_at_negative_voltages() -> None:
    text = re.sub(r"\n\+", "", card(DIODE))
    assert "D(Vfwd=0.9 Ron=0.02 Err=table(i=0 30 v=0 600 e=0 0 0 0.0006)" in text
    assert "Cauer=table(r=0.3 0.6 c=0.005 0.1)" in text
    assert list(models(card(DIODE))) == ["D1"]


def test_the_command_prints_a_card(call: Call) -> None:
    Path("d.xml").write_text(DIODE, "utf-8")
    assert ".model D1 D(" in call("plecs", "d.xml").stdout
    assert call("plecs", "nothing.xml").exit_code == 2


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("not xml", "not a thermal description"),
        ("<Package class='Diode'/>", "no Package with SemiconductorData"),
        (DIODE.replace('class="Diode"', 'class="Thyristor"'), "neither switch nor diode"),
        (DIODE.replace("<Voltage>0 600</Voltage>", "<Voltage>0</Voltage>"), "for each current"),
    ],
)
def test_what_is_no_description_is_refused(text: str, words: str) -> None:
    with pytest.raises(UsageError, match=words):
        card(text)

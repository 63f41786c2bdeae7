"""FMU export: a deck as a unit for co-simulation in other tools (FMI 3.0).

The unit has the deck, and a slave (:mod:`nsspice.output.fmu_slave`) that advances it in the Python
of the tool: sources are inputs, signals outputs, ``.param`` values parameters.  The wrapper
in C and the description come from pythonfmu3.
"""

from __future__ import annotations

import json
import re
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..analyses.request.recorder import select
from ..analyses.request.sampled import refuse_sampled
from ..analyses.transient.held import HeldSources
from ..analyses.transient.stepwise import checked_inputs
from ..circuit import Circuit
from ..errors import Diagnostic, UsageError
from ..lazy import need_library
from ..netlist.deck import TranCard
from .atomic_write import whole
from .files import output_error
from .stored_deck import store_deck

#: the end of a simulation whose importer does not say one [s]
_STOP = 1e3


def write_fmu(
    circuit: Circuit,
    path: str | Path,
    inputs: Sequence[str] = (),
    signals: Sequence[str] | None = None,
    *,
    uic: bool | None = None,
    method: str | None = None,
) -> None:
    """Write a circuit as an FMU for co-simulation (FMI 3.0).

    Between two communication points inputs are held, and the circuit is solved as in any other run;
    switching instants are hit inside the steps.

    Parameters
    ----------
    circuit : Circuit
    path : str or Path
        ``NAME.fmu``.
    inputs : sequence of str
        Independent sources whose values the importer sets [V or A].
    signals : sequence of str, optional
        Outputs; by default all node voltages and the currents that a run shows.
    uic : bool, optional
        Start from the initial values of the elements; by default as the ``.tran`` card says.
    method : str, optional
        As for :func:`nsspice.tran`.

    Raises
    ------
    UsageError
        NS4005 for an input that is not an independent source, NS4008 for a name without ``.fmu``,
        NS4010 if pythonfmu3 is not installed.
    OutputError
        NS4001 if the file cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() != ".fmu":
        hint = f"write {path.with_suffix('.fmu')}"
        raise UsageError(Diagnostic("NS4008", f"an FMU is a .fmu file, not {path}", hint=hint))
    builder = need_library("pythonfmu3", "nsspice[fmu]").FmuBuilder
    refuse_sampled(circuit.deck, "an FMU")
    held = HeldSources.of(circuit, checked_inputs(circuit, inputs)).values
    deck = circuit.deck
    card = next((c for c in deck.analyses if isinstance(c, TranCard)), None)
    options: dict[str, Any] = {"uic": bool(card and card.uic) if uic is None else uic}
    if method is not None:
        options["method"] = method
    spec: dict[str, Any] = {
        "name": re.sub(r"\W", "_", path.stem),
        "title": deck.title,
        "inputs": {fmi_name(name): (name, value) for name, value in held.items()},
        "parameters": {fmi_name(name): (name, v) for name, v in deck.parameters.items()},
        "signals": {fmi_name(name): name for name in select(circuit, signals)},
        "options": options,
        "stop": card.tstop if card else _STOP,
        "step": card.tstep if card else None,
    }
    try:
        with tempfile.TemporaryDirectory() as folder:
            _build(Path(folder), spec, deck, builder, path)
    except OSError as error:
        raise output_error(error, str(path)) from error


def fmi_name(name: str) -> str:
    """Return the name of a signal or element by FMI's structured convention.

    Examples
    --------
    >>> fmi_name("v(out)"), fmi_name("i(x1.l1)"), fmi_name("v(n+)"), fmi_name("vref")
    ('v.out', 'i.x1.l1', "v.'n+'", 'vref')
    """
    call = re.fullmatch(r"(\w+)\((.*)\)", name)
    parts = [call[1], *call[2].split(".")] if call else name.split(".")
    # quoted names may hold anything but a quote and a backslash
    plain = [re.sub(r"['\\]", "_", part) for part in parts]
    return ".".join(p if re.fullmatch(r"[^\W\d]\w*", p) else f"'{p}'" for p in plain)


def _build(folder: Path, spec: dict[str, Any], deck: Any, builder: Any, path: Path) -> None:
    """Put the parts together in a folder, and the unit where it belongs."""
    spec["deck"] = f"deck/{store_deck(folder / 'deck', deck)[0]}"
    (folder / "model.json").write_text(json.dumps(spec), "utf-8")
    script = folder / "nsspice_slave.py"
    shutil.copy(Path(__file__).with_name("fmu_slave.py"), script)
    parts = [folder / "deck", folder / "model.json"]
    made = builder.build_FMU(script, dest=folder / "made", project_files=parts)
    with whole(path) as part:
        shutil.copy(made or folder / "made" / f"{spec['name']}.fmu", part)

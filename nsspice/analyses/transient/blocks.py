"""Blocks that are solved one after the other, each by its own engine and with its own steps."""

from __future__ import annotations

from collections.abc import Sequence

from ...circuit import Circuit, MnaSystem
from ...circuit.blocks import Blocks, Link, blocks
from ...circuit.impulses import Impulses
from ...devices.sources.waveform import initial_value
from ...solvers.modewise import ModewiseStepper
from ...solvers.polynomial import Polynomial
from ..request.cards import Tran
from ..request.method import choose
from ..request.request import Request
from ..request.settings import Settings
from ..signals.curve import Floats

_NAMED = 4  # signals of one block that are listed by name


def split(
    circuit: Circuit,
    settings: Settings,
    analysis: Tran | None = None,
    request: Request | None = None,
) -> Blocks:
    """Return a circuit with the blocks that the exact engine can solve by themselves.

    A method or a step that is asked for is that of whole islands.

    Parameters
    ----------
    circuit : Circuit
    settings : Settings
    analysis : Tran, optional
    request : Request, optional
        For temperature and values.
    """
    if settings.method != "auto" or settings.stepped:
        return Blocks(circuit)
    found, request = blocks(circuit, Polynomial), request or Request()
    tstep = None if analysis is None else analysis.row_distance
    tstop = None if analysis is None else analysis.stop
    for number in {link.source for link in found.links}:
        island = found.circuit.islands[number]
        mna = island.assemble(request.temperature, request.values, tstep=tstep, tstop=tstop)
        if choose(island.problem_class, mna.system, settings).name != "modewise":
            return Blocks(circuit)
        # an impulse is not a function of time that could be handed on
        impulses = Impulses(mna)
        if any(impulses.may(link.signal) for link in found.links if link.source == number):
            return Blocks(circuit)
    return found


def begin(link: Link, mna: MnaSystem, stepper: ModewiseStepper) -> None:
    """Say what a signal is before the first instant of a run, as its block begins.

    Parameters
    ----------
    link : Link
    mna : MnaSystem
        Of the block that drives.
    stepper : ModewiseStepper
        After its start.
    """
    handed = link.handed
    if stepper.dc_point is not None:
        sources = [initial_value(waveform) for waveform in mna.system.waveforms]
        handed.begin_with(_value(mna, link.signal, *stepper.dc_point, sources))
    elif handed.count():
        handed.begin_with(handed.value(0.0))
    else:
        handed.begin_with(_value(mna, link.signal, *stepper.beginning, []))


def driven_by(links: Sequence[Link]) -> str:
    """Return which blocks drive one, and how far what they hand on may be off, a clause.

    Parameters
    ----------
    links : sequence of Link
        All inputs of the block.
    """
    numbers = sorted({link.source + 1 for link in links})
    signals = ", ".join(link.signal for link in links[:_NAMED])
    more = f" and {len(links) - _NAMED} more" if len(links) > _NAMED else ""
    error = max((link.handed.error() for link in links), default=0.0)
    accurate = f", to {error:.0e}" if error > 0.0 else ""
    which = "s" if len(numbers) > 1 else ""
    return (
        f"driven by island{which} {', '.join(map(str, numbers))} through {signals}{more}{accurate}"
    )


def _value(mna: MnaSystem, signal: str, z: Floats, lam: Floats, u: list[float]) -> float:
    """Return a signal where nothing moves."""
    functional = mna.functional(signal)
    result = sum(c * z[j] for j, c in functional.z) + sum(c * lam[j] for j, c in functional.lam)
    return float(result + sum(c * u[j] for j, c in functional.u if u))

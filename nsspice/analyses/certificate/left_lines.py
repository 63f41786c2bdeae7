"""Junctions that a run has driven beyond the range in which their broken lines are bounded."""

from __future__ import annotations

from collections.abc import Sequence

from ...errors import Diagnostic
from ..signals.events import Event, Events


def left_lines(events: Sequence[Event]) -> Diagnostic | None:
    """Return a warning if some junction has left the range of its lines.

    Parameters
    ----------
    events : sequence of Event
        Of a run.
    """
    if not isinstance(events, Events) or not events.numbers.size:
        return None
    from ...devices.diodes.broken_junction import BEYOND

    ends = {k for k, name in enumerate(events.names) if name.endswith(f".{BEYOND}")}
    found = [k for k, number in enumerate(events.numbers) if int(number) in ends]
    if not found:
        return None
    first = found[0]
    names = dict.fromkeys(events.names[int(events.numbers[k])] for k in found)
    listed = ", ".join(name.removesuffix(f".{BEYOND}") for name in names)
    return Diagnostic(
        "NS5007",
        f"{listed}: beyond the range of the broken lines, at {events.times[first]:.6g} s first: "
        "there the difference from the junction is not bounded",
        None,
        "give the model card its ohmic resistance RS and its breakdown voltage BV",
        severity="warning",
    )

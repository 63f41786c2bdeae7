"""Sources as functions of time: SPICE's argument lists completed into waveforms.

Every default that SPICE leaves to the analysis is filled in here, so that the solvers see complete
parameters only.  A rise or fall time written as 0 is an ideal edge; one left out is ``tstep``.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, cast

from ...netlist.elements.waveforms import ARGUMENTS, form
from ...netlist.findings import Findings
from ...problems.descriptor import Handed, Waveform
from ..stamper import Conditions

if TYPE_CHECKING:
    from ...netlist.deck import Source


def check_source(source: Source, owner: str, findings: Findings) -> bool:
    """Return whether a source is complete and possible; report what is not."""
    before = len(findings.errors)

    def wrong(message: str, hint: str = "", code: str = "NS2011") -> None:
        findings.error(code, f"{owner}: {message}", source.span, hint)

    kind, values = source.kind, source.values
    if any(v is not None and not math.isfinite(v) for v in values) or not math.isfinite(
        source.dc or 0.0
    ):
        wrong("a value is not finite", code="NS2005")
    elif kind == "pwl":
        _check_pwl(source, wrong)
    elif kind:
        names, required = ARGUMENTS[kind]
        given = dict(zip(names, values, strict=False))
        for name in names[:required]:
            if given.get(name) is None:
                wrong(f"{kind} needs {name}", form(kind), "NS2004")
        if len(values) > len(names):
            wrong(
                f"{kind} takes at most {len(names)} arguments, not {len(values)}",
                form(kind),
            )
        if given.get("phasec") or given.get("phases"):
            hint = "write it as a B source: V={(1 + sin(6283*time + 0.5))*sin(1e5*time)}"
            wrong(f"{kind} with a phase is not simulated", hint, "NS2008")
        negative = {
            "pulse": ("tr", "tf", "pw", "np"),
            "exp": ("tau1", "tau2"),
            "sin": ("cycles",),
        }
        for name in negative.get(kind, ()):
            value = given.get(name)
            if value is not None and value < 0.0:
                wrong(f"{name} of {kind} is negative ({value:g})", "give a value >= 0")
        if kind == "pulse":
            _check_period(given, owner, source, findings)
    return len(findings.errors) == before


def _check_period(
    given: dict[str, float | None], owner: str, source: Source, findings: Findings
) -> None:
    """Warn if a pulse does not fit into its period."""
    period = given.get("per") or 0.0
    length = sum(given.get(n) or 0.0 for n in ("tr", "pw", "tf"))
    if 0.0 < period < length * (1 - 1e-12):
        findings.warning(
            "NS2056",
            f"{owner}: rise, width and fall ({length:g} s) are longer than the period "
            f"({period:g} s), each pulse is truncated",
            source.span,
        )


def _check_pwl(source: Source, wrong: Callable[..., None]) -> None:
    """Check the points of a PWL source."""
    values = source.values
    if not values or len(values) % 2:
        wrong("pwl needs pairs of time and value", "pwl(t1 v1 t2 v2 ...)")
        return
    times = [t if t is not None else math.nan for t in values[::2]]
    if any(math.isnan(t) for t in times) or any(v is None for v in values[1::2]):
        wrong("pwl has an empty argument", "pwl(t1 v1 t2 v2 ...)")
        return
    for before, after in itertools.pairwise(times):
        if after < before:
            wrong(
                f"the times of pwl must not decrease ({after:g} s after {before:g} s)",
                "sort the points; two equal times are a jump",
            )
            return
    repeat = source.options.get("r")
    if repeat is not None and repeat >= 0.0 and not repeat < times[-1]:
        wrong(f"r={repeat:g} is not before the last time {times[-1]:g}", "give an earlier time")


def _given(source: Source, index: int, default: float) -> float:
    """Return an argument, or its default if it was left out."""
    if index < len(source.values):
        value = source.values[index]
        if value is not None:
            return value
    return default


def transient(source: Source, conditions: Conditions) -> Waveform:
    """Return the transient function of a source with all defaults filled in.

    Parameters
    ----------
    source : Source
        With a ``kind``; checked by :func:`check_source`.
    conditions : Conditions
        Gives ``tstep`` and ``tstop``.  Without a ``tstep`` a thousandth of ``tstop`` stands for it;
        without either, edges are ideal.
    """
    stop = conditions.tstop or 0.0
    step = conditions.tstep or stop / 1000.0
    per_stop = 1.0 / stop if stop else 0.0
    kind = source.kind

    def arg(index: int, default: float) -> float:
        return _given(source, index, default)

    if kind == "sin":
        amplitude, frequency, phase = arg(1, 0.0), arg(2, per_stop), arg(5, 0.0)
        if frequency < 0.0:  # sin(-x) = -sin(x)
            amplitude, frequency, phase = -amplitude, -frequency, -phase
        if phase % 180.0 == 0.0:  # a zero at the start is one, not the rounding of pi
            amplitude, phase = (amplitude if phase % 360.0 == 0.0 else -amplitude), 0.0
        return Waveform("sin", (arg(0, 0.0), amplitude, frequency, arg(3, 0.0), arg(4, 0.0), phase))
    if kind == "pulse":
        rise, fall = arg(3, step), arg(4, step)
        # a width left out lasts to the end of the run; twice tstop keeps its end out of the window
        width = arg(5, 2.0 * stop if stop else math.inf)
        period = arg(6, 0.0)
        count = arg(7, 0.0)
        return Waveform(
            "pulse",
            (
                arg(0, 0.0),
                arg(1, 0.0),
                arg(2, 0.0),
                rise,
                fall,
                width,
                period if period > 0.0 else math.inf,
                count if count > 0.0 else math.inf,
            ),
        )
    if kind == "exp":
        td1 = arg(2, 0.0)
        return Waveform(
            "exp",
            (arg(0, 0.0), arg(1, 0.0), td1, arg(3, step), arg(4, td1 + step), arg(5, step)),
        )
    if kind == "sffm":
        return Waveform(
            "sffm",
            (arg(0, 0.0), arg(1, 0.0), arg(2, per_stop), arg(3, 0.0), arg(4, per_stop)),
        )
    if kind == "am":
        return Waveform(
            "am", (arg(0, 0.0), arg(1, 0.0), arg(2, per_stop), arg(3, per_stop), arg(4, 0.0))
        )
    delay = source.options.get("td", 0.0)
    points = [v or 0.0 for v in source.values]
    points[::2] = [t + delay for t in points[::2]]
    repeat = source.options.get("r", -1.0)
    return Waveform("pwl", tuple(points), repeat + delay if repeat >= 0.0 else math.nan)


def depends_on_run(source: Source) -> bool:
    """Return whether defaults of a source are times of the run.

    Examples
    --------
    >>> from nsspice.errors import Span
    >>> from nsspice.netlist.deck import Source
    >>> pulses = [Source(None, None, "pulse", (0.0, 1.0, 0.0, *edges), {}, Span("", 2, 1))
    ...           for edges in ((), (1e-9, 1e-9, 1e-6, 2e-6))]
    >>> [depends_on_run(pulse) for pulse in pulses]
    [True, False]
    """
    runs = (Conditions(tstep=1.0, tstop=3.0), Conditions(tstep=2.0, tstop=5.0))
    return bool(source.kind) and transient(source, runs[0]) != transient(source, runs[1])


def _ending(source: Source, conditions: Conditions) -> Waveform | None:
    """Return what is added to a sine so that it stays where it ends, None if it has no end.

    It is the same sine with the other sign, from there on.

    Examples
    --------
    >>> from nsspice.errors import Span
    >>> from nsspice.netlist.deck import Source
    >>> ten = Source(None, None, "sin", (1.0, 2.0, 50.0, 0.0, 0.0, 0.0, 10.0), {}, Span("", 2, 1))
    >>> _ending(ten, Conditions(tstop=1.0)).values
    (0.0, -2.0, 50.0, 0.2, 0.0, 0.0)
    """
    cycles = _given(source, 6, 0.0)
    _, amplitude, frequency, delay, damping, phase = transient(source, conditions).values
    if not (cycles > 0.0 and frequency > 0.0):
        return None
    duration = cycles / frequency
    amplitude *= -math.exp(-damping * duration)
    phase = (phase + 360.0 * cycles) % 360.0
    if phase % 180.0 == 0.0:
        amplitude, phase = (amplitude if phase == 0.0 else -amplitude), 0.0
    level = -amplitude * math.sin(math.radians(phase)) if phase else 0.0
    return Waveform("sin", (level, amplitude, frequency, delay + duration, damping, phase))


def source_waveforms(source: Source, conditions: Conditions, owner: str) -> tuple[Waveform, ...]:
    """Return what a source does under the given conditions, as a sum of waveforms."""
    first = source_waveform(source, conditions, owner)
    if first.kind != "sin":
        return (first,)
    rest = _ending(source, conditions)
    return (first,) if rest is None else (first, rest)


def source_waveform(source: Source, conditions: Conditions, owner: str) -> Waveform:
    """Return what a source does under the given conditions (a sweep value, DC, or in time).

    A sine of a limited number of cycles is given without its end.

    Examples
    --------
    >>> from nsspice.errors import Span
    >>> from nsspice.netlist.deck import Source
    >>> five = Source(5.0, None, "", (), {}, Span("a.net", 2, 1))
    >>> source_waveform(five, Conditions(), "v1").values
    (5.0,)
    """
    swept = conditions.values.get(owner)
    held: object = swept
    if held is not None and not isinstance(held, int | float):
        return _held(cast("Handed", held), conditions)
    if swept is not None:
        return Waveform("dc", (swept,))
    if not source.kind:
        return Waveform("dc", (source.dc or 0.0,))
    if conditions.analysis == "tran":
        return transient(source, conditions)
    if source.dc is not None:
        return Waveform("dc", (source.dc,))
    return Waveform("dc", (initial_value(transient(source, conditions)),))


def _held(value: Handed, conditions: Conditions) -> Waveform:
    """Return a source that a controller sets during the run."""
    if conditions.analysis == "dc":
        return Waveform("dc", (value.value(0.0, -1),))
    return Waveform("held", (), handed=value)


def initial_value(waveform: Waveform) -> float:
    """Return the value of a waveform at t = 0, that before an ideal edge there.

    The operating point is the state before the run: an edge at 0 is the first thing that happens.

    Examples
    --------
    >>> initial_value(Waveform("sin", (1.0, 2.0, 50.0, 0.0, 0.0, 90.0)))
    3.0
    """
    v = waveform.values
    if waveform.handed is not None:
        return waveform.handed.value(0.0, -1)
    if waveform.kind == "dc":
        result = v[0]
    elif waveform.kind == "sin":
        offset, amplitude, frequency, delay, damping, phase = v
        s = max(-delay, 0.0)
        angle = 2.0 * math.pi * frequency * s + math.radians(phase)
        result = offset + amplitude * math.sin(angle) * math.exp(-damping * s)
    elif waveform.kind == "pulse":
        result = _initial_pulse(v)
    elif waveform.kind == "pwl":
        result = _initial_pwl(v, waveform.repeat)
    elif waveform.kind == "exp":
        v1, v2, td1, tau1, td2, tau2 = v
        result = v1
        if td1 < 0.0:
            result += (v2 - v1) * (1.0 - (math.exp(td1 / tau1) if tau1 else 0.0))
        if td2 < 0.0:
            result += (v1 - v2) * (1.0 - (math.exp(td2 / tau2) if tau2 else 0.0))
    elif waveform.kind == "sffm":
        result = v[0]
    else:  # am: the product of two sines that start at the delay
        amplitude, offset, modulation, carrier, delay = v
        s = max(-delay, 0.0)
        swing = offset + math.sin(2.0 * math.pi * modulation * s)
        result = amplitude * swing * math.sin(2.0 * math.pi * carrier * s)
    return result * waveform.scale


def _initial_pulse(v: tuple[float, ...]) -> float:
    """Return the value of a pulse before t = 0; it has started only if its delay is negative."""
    v1, v2, delay, rise, fall, width, period, count = v
    s = -delay
    if s <= 0.0:
        return v1
    if math.isfinite(period):
        turns = math.ceil(s / period) - 1
        if turns >= count:
            return v1
        s -= turns * period
    if s <= rise:
        return v1 + (v2 - v1) * s / rise
    if s <= rise + width:
        return v2
    if s <= rise + width + fall:
        return v2 + (v1 - v2) * (s - rise - width) / fall
    return v1


def _initial_pwl(v: tuple[float, ...], repeat: float) -> float:
    """Return the value of a piecewise-linear curve before t = 0."""
    times, levels = v[::2], v[1::2]
    s = 0.0
    if s > times[-1] and not math.isnan(repeat) and times[-1] > repeat:
        lap = math.fmod(s - repeat, times[-1] - repeat)
        s = repeat + lap if lap > 0.0 else times[-1]
    if s <= times[0]:
        return levels[0]
    k = max(j for j, t in enumerate(times) if t < s)
    if k == len(times) - 1:
        return levels[-1]
    fraction = (s - times[k]) / (times[k + 1] - times[k])
    return levels[k] + (levels[k + 1] - levels[k]) * fraction

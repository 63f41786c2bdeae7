"""The first state of a transient: DC solution, ``.ic`` voltages, or given initial values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from ...circuit import Circuit, MnaSystem
from ...devices.passive.inductor import Inductor
from ...devices.sources.waveform import initial_value
from ...errors import Span
from ...problems.descriptor import DescriptorSystem
from ...solvers.moreau import MoreauStepper
from ...solvers.stepper import Stepper
from ..request.cards import Tran
from ..request.pinned import hold
from ..signals.curve import Floats
from .dc_start import start_dc, without_storage

#: a current that says which pairs of a guess conduct [A]
_TRACE = 1e-6


def start(
    circuit: Circuit,
    mna: MnaSystem,
    stepper: Stepper,
    analysis: Tran,
    step: float | None,
) -> tuple[Floats, float] | None:
    """Put a stepper into its first state.

    With ``uic`` the charges and fluxes of ``IC=`` and ``.ic`` are taken and an impulsive step
    resolves what is inconsistent.  Without it the DC solution is found, near ``.nodeset`` and with
    the nodes of ``.ic`` held by voltage sources that are removed at t = 0; inductors across these
    begin without a current.  Where nothing is stored, ``.ic`` says which solution is meant, too.

    Returns
    -------
    (ndarray, float) or None
        Charges and fluxes (n,) from which the run starts, and their energy [J]; None for a DC
        solution that no ideal edge of a source changes at once.

    Raises
    ------
    UnsolvedStep
        If there is no such state.
    """
    held = initial_voltages(circuit, mna)
    near = None
    if step is not None and analysis.uic:
        charges, energy = mna.initial_state(held)
        near = _at_rest(mna, charges, step)
    elif step is not None and held:
        wanted = {**_voltages(circuit.deck.nodesets, mna), **held}
        stepper.dc_point = _held_point(mna, held, wanted)
        charges, energy = stored_at(mna.system, stepper.dc_point[0])
    else:
        guess = guess_of(circuit, mna, held)
        if guess is None:
            guess = _at_rest(mna, None, step)
        point = start_dc(stepper, partial(without_storage, mna.system), guess)
        stepper.leave_dc()
        return stored_at(mna.system, point) if step is not None and stepper.jumps else None
    stepper.start_charges(0.0, charges, step, near)
    return charges, energy


def _at_rest(
    mna: MnaSystem, charges: Floats | None, step: float | None
) -> tuple[Floats, Floats] | None:
    """Return a first point near which the limiters of an island rest, None without any."""
    if not mna.layout.inner:
        return None
    from .stable_branch import at_rest

    return at_rest(mna, charges, step)


def initial_voltages(circuit: Circuit, mna: MnaSystem) -> dict[str, float]:
    """Return the voltages of ``.ic`` by node [V]."""
    return _voltages(circuit.deck.initial, mna)


def with_integrators(
    circuit: Circuit, mna: MnaSystem, system: DescriptorSystem
) -> DescriptorSystem:
    """Return the static system of an island with what integrates held where it starts."""
    starts = {node: circuit.deck.initial[node] for node in circuit.deck.integrators}
    held = _voltages(starts, mna)
    if not held:
        return system
    return hold(system, [(mna.layout.voltage(node, "0"), v) for node, v in held.items()])


def guess_of(
    circuit: Circuit, mna: MnaSystem, more: Mapping[str, float] | None = None
) -> tuple[Floats, Floats] | None:
    """Return a point to stay close to: ``.nodeset`` voltages, diodes that are ``on``.

    None without any of them.

    Parameters
    ----------
    circuit : Circuit
    mna : MnaSystem
        Of the island.
    more : mapping of str to float, optional
        Voltages [V] by node that go before those of ``.nodeset``.
    """
    near = {**_voltages(circuit.deck.nodesets, mna), **(more or {})}
    guess = _point_near(near, mna, mna.system)
    on = {e.name for e in circuit.deck.elements if e.letter == "d" and "on" in e.flags}
    pairs = [k for k, name in enumerate(mna.pair_elements) if name in on]
    if pairs:
        z, multipliers = guess or (np.zeros(mna.system.n), np.zeros(mna.system.m))
        multipliers[pairs] = _TRACE
        guess = z, multipliers
    return guess


def _point_near(
    near: Mapping[str, float], mna: MnaSystem, system: DescriptorSystem
) -> tuple[Floats, Floats] | None:
    """Return a guess of unknowns (n,) and multipliers (m,) at node voltages, None without any."""
    if not near:
        return None
    z = np.zeros(system.n)
    layout = mna.layout
    for node, index in layout.nodes.items():
        if index >= 0:
            z[index] = near.get(node, 0.0) - near.get(layout.before(node), 0.0)
    if layout.inner:
        from ...devices.expressions.expression_nodes import complete

        complete(layout, z)
    return z, _conducting(system, z)


def _conducting(system: DescriptorSystem, z: Floats) -> Floats:
    """Return a trace of current for the pairs that conduct at given node voltages, shape (m,).

    A voltage at which a diode conducts is where its slack ends: without a current it would count as
    blocking there.
    """
    slack = system.q - system.B.dot(z)
    touched = system.B.abs().dot(np.abs(z)) > 0.0
    near = slack <= 1e-3 * np.abs(z).max(initial=0.0)
    return np.where(touched & near, _TRACE, 0.0)


def as_controlled(system: DescriptorSystem, z: Floats) -> DescriptorSystem:
    """Return a system whose switches begin as a point (n,) requires: ``.nodeset`` picks states.

    A switch whose control is not given, or lies between its thresholds, begins as it is.
    """
    switches = []
    for switch in system.switches:
        control = sum(factor * float(z[j]) for j, factor in switch.control)
        outside = control > switch.on_above or control < switch.off_below
        if outside and any(z[j] != 0.0 for j, _ in switch.control):
            above = control > switch.on_above
            switch = replace(switch, closed=above is not switch.inverted)
        switches.append(switch)
    return replace(system, switches=tuple(switches))


def given_voltages(
    cards: Mapping[str, object], mna: MnaSystem
) -> dict[str, tuple[float, Span | None]]:
    """Return the voltages [V] given for nodes of this island, and where they are given."""
    found: dict[str, tuple[float, Span | None]] = {}
    if not cards:
        return found
    # what another block hands on is given there
    from ...devices.expressions.block_input import BlockInput

    others = {device.ends[0] for device in mna.devices if isinstance(device, BlockInput)}
    for node, param in cards.items():
        value = getattr(param, "value", param)
        own = node not in others and mna.layout.nodes.get(node, -1) >= 0
        if own and isinstance(value, int | float):
            found[node] = float(value), getattr(param, "span", None)
    return found


def _voltages(cards: Mapping[str, object], mna: MnaSystem) -> dict[str, float]:
    """Return the voltages [V] given for nodes of this island."""
    return {node: value for node, (value, _) in given_voltages(cards, mna).items()}


def _held_point(
    mna: MnaSystem, held: Mapping[str, float], near: Mapping[str, float]
) -> tuple[Floats, Floats]:
    """Return the DC solution near some voltages with some nodes held, shapes (n,) and (m,).

    An inductor across held nodes would be a short circuit there: the sources carry what flows.
    """
    layout, fixed = mna.layout, {*held, "0"}
    inductors = [d for d in mna.devices if isinstance(d, Inductor)]
    loose = [layout.branches[d.name] for d in inductors if fixed.issuperset(d.nodes)]
    system = hold(mna.system, [(layout.voltage(k, "0"), v) for k, v in held.items()], loose)
    guess = _point_near(near, mna, system)
    stepper = MoreauStepper(system, ())
    point = start_dc(stepper, partial(without_storage, system), guess)
    return point[: mna.system.n], stepper.state[1]


def stored_at(system: DescriptorSystem, point: Floats) -> tuple[Floats, float]:
    """Return charges and fluxes (n,) and energy [J] at a static point (n,)."""
    charges = system.E.dot(point) + _smooth_charges(system, point)
    return charges, system.stored_energy(point)


def _smooth_charges(system: DescriptorSystem, point: Floats) -> Floats:
    """Return the charges and fluxes of the smooth laws at a point (n,) at t = 0, shape (n,)."""
    if system.smooth is None or not system.smooth.Q.data.size:
        return np.zeros(system.n)
    from ...solvers.moreau import function_values

    sources = np.array([[initial_value(waveform) for waveform in system.waveforms]])
    functions = function_values(system.smooth.tape, point[np.newaxis], sources, np.zeros(1))
    return system.smooth.Q.dot(functions[0])

"""A deck as the peers take it: Pulsim a list of elements, Siconos a complementarity system."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from nsspice.circuit import Circuit
from nsspice.devices.diodes.diode import Diode
from nsspice.devices.passive.capacitor import Capacitor
from nsspice.devices.passive.coupling import Coupling
from nsspice.devices.passive.inductor import Inductor
from nsspice.devices.passive.resistor import Resistor
from nsspice.devices.sources.vsource import VoltageSource
from nsspice.devices.stamper import Conditions
from nsspice.devices.switches.switch import VoltageSwitch
from nsspice.problems.descriptor import DescriptorSystem, Waveform


class CannotError(Exception):
    """A peer has nothing that could stand for the deck; the text says what."""


def elements(circuit: Circuit) -> list[dict[str, Any]]:
    """Return the elements of a deck for Pulsim's circuit builder.

    Raises
    ------
    CannotError
        Naming the first element that has no counterpart.
    """
    conditions = circuit.islands[0].defaults
    gates = {
        device.nodes: _only_waveform(device, conditions)
        for device in circuit.devices
        if isinstance(device, VoltageSource)
    }
    controls = {d.controls for d in circuit.devices if isinstance(d, VoltageSwitch)}
    found: list[dict[str, Any]] = []
    for device in circuit.devices:
        entry: dict[str, Any] = {"name": device.name, "nodes": device.nodes[:2]}
        if isinstance(device, Resistor | Capacitor | Inductor):
            entry |= {"kind": device.letter, "value": device.at(conditions), "ic": device.ic}
        elif isinstance(device, VoltageSource):
            if device.nodes in controls:
                continue  # the law of a switch, not a part of the circuit
            entry |= {"kind": "v", **_sine(_only_waveform(device, conditions), device.name)}
        elif isinstance(device, Coupling):
            raise CannotError(f"{device.name}: coupled inductors are not tried")
        elif isinstance(device, Diode) and device.law.vrev is None:
            law = device.law
            entry |= {"kind": "d", "ron": law.ron, "roff": law.roff, "vfwd": law.vfwd}
        elif isinstance(device, VoltageSwitch) and device.controls in gates:
            gate = gates[device.controls]
            v1, v2, delay, rise, fall, width, period, _ = gate.values
            if gate.kind != "pulse" or v2 < v1 or delay or rise or fall:
                raise CannotError(f"the gate of {device.name} is not a plain pulse train")
            entry |= {"kind": "s", "period": period, "duty": width / period}
        else:
            raise CannotError(f"{device.name} has no counterpart")
        found.append(entry)
    return found


def _only_waveform(source: VoltageSource, conditions: Conditions) -> Waveform:
    """Return what a source does if that is one waveform; a sine of so many cycles is two."""
    first, *rest = source.waveforms(conditions)
    if rest:
        raise CannotError(f"{source.name} ends after some cycles")
    return first


def _sine(waveform: Waveform, name: str) -> dict[str, float]:
    """Return a source as ``dc + amplitude sin(2 pi frequency t + phase)``."""
    scale = waveform.scale
    if waveform.kind == "dc":
        return {"dc": scale * waveform.values[0], "amplitude": 0.0, "frequency": 0.0, "phase": 0.0}
    if waveform.kind == "sin":
        offset, amplitude, frequency, delay, damping, phase = waveform.values
        if delay == 0.0 and damping == 0.0:
            return {
                "dc": scale * offset,
                "amplitude": scale * amplitude,
                "frequency": frequency,
                "phase": float(np.radians(phase)),
            }
    raise CannotError(f"{name} is neither constant nor a plain sine")


def complementarity_system(circuit: Circuit, signals: list[str]) -> dict[str, Any]:
    """Return a deck as ``x' = A x + B l + F u``, ``y = C x + D l + G u``, ``0 <= y perp l >= 0``.

    What a user of Siconos derives by hand: the unknowns that store nothing are eliminated.  Where
    the circuit does not determine them alone (nodes behind blocked diodes), some pairs are turned
    over, so that y is their current and l their voltage; the choice with the best condition is
    taken.  Signals are combinations of x.

    Raises
    ------
    CannotError
        If the deck has switches, several islands, or no choice of pairs determines the rest.
    """
    if len(circuit.islands) != 1:
        raise CannotError("it has several islands")
    mna = circuit.islands[0].assemble()
    system = mna.system
    if system.switches:
        raise CannotError("its switches change the system with time")
    inputs = [_sine(w, "a source") for w in system.waveforms]
    P, Q = _split(system)
    # the descriptor system in coordinates: the states x, the rest y, and 1 beside the inputs
    E, G, A, B, D, S = (
        m.dense() for m in (system.E, system.G, system.A, system.B, system.D, system.S)
    )
    best = None
    for count in range(system.m + 1):
        for turned in itertools.combinations(range(system.m), count):
            matrix = _algebraic(G, A, B, D, Q, turned)
            condition = np.linalg.cond(matrix) if matrix.size else 1.0
            if np.isfinite(condition) and (best is None or condition < 0.1 * best[0]):
                best = (condition, turned, matrix)
    if best is None or best[0] > 1e13:
        raise CannotError("no choice of pairs determines what stores nothing")
    _, turned, matrix = best
    m, states = system.m, P.shape[1]
    kept = [k for k in range(m) if k not in turned]
    # right-hand sides of the algebraic rows and of the turned pairs, in terms of [x, l, u, 1]
    lam = np.zeros((m, m))  # the multipliers that are l: those of the kept pairs
    lam[kept, kept] = 1.0
    slack = np.eye(m)[list(turned)]  # the slacks that are l: those of the turned pairs
    inputs_count = S.shape[1]
    top = np.hstack([-Q.T @ G @ P, -Q.T @ A @ lam, Q.T @ S, np.zeros((Q.shape[1], 1))])
    rows = list(turned)
    # w = q - B z + D lam, hence B Q y - D lam_turned = q - B P x + D lam_kept - w
    low = np.hstack(
        [
            -B[rows] @ P,
            D[rows] @ lam - slack,
            np.zeros((len(rows), inputs_count)),
            np.asarray(system.q)[rows, None],
        ]
    )
    solved = (
        np.linalg.solve(matrix, np.vstack([top, low])) if matrix.size else np.vstack([top, low])
    )
    width = states + m + inputs_count + 1
    z = np.zeros((system.n, width))
    z[:, :states] = P
    z += Q @ solved[: Q.shape[1]]
    multipliers = np.zeros((m, width))
    multipliers[:, states : states + m] = lam
    multipliers[rows] += solved[Q.shape[1] :]
    rate = P.T @ (-G @ z - A @ multipliers)
    rate[:, states + m : states + m + inputs_count] += P.T @ S
    rate = np.linalg.solve(P.T @ E @ P, rate)
    partner = -B @ z + D @ multipliers
    partner[:, -1] += system.q
    partner[rows] = multipliers[rows]
    pick = {"x": slice(0, states), "l": slice(states, states + m)}
    outputs = np.zeros((len(signals), system.n))
    for k, name in enumerate(signals):
        for j, factor in mna.functional(name).z:
            outputs[k, j] += factor
    return {
        "A": rate[:, pick["x"]].tolist(),
        "B": rate[:, pick["l"]].tolist(),
        "F": rate[:, states + m :].tolist(),
        "C": partner[:, pick["x"]].tolist(),
        "D": partner[:, pick["l"]].tolist(),
        "G": partner[:, states + m :].tolist(),
        "x0": _start(mna, P).tolist(),
        "inputs": inputs,
        "outputs": (outputs @ P).tolist(),
    }


def _split(system: DescriptorSystem) -> tuple[Any, Any]:
    """Return bases of what stores energy and of the rest; currents and voltages apart."""
    E = system.E.dense()
    kinds = np.asarray(system.row_kind)
    inside, outside = [], []
    for kind in (0, 1):
        index = np.flatnonzero(kinds == kind)
        values, vectors = np.linalg.eigh(E[np.ix_(index, index)])
        top = float(np.abs(values).max(initial=0.0))
        for value, vector in zip(values, vectors.T, strict=True):
            full = np.zeros(system.n)
            full[index] = vector
            (inside if top and value > 1e-12 * top else outside).append(full)
    stack = [np.array(v).reshape(-1, system.n).T for v in (inside, outside)]
    return stack[0], stack[1]


def _algebraic(G: Any, A: Any, B: Any, D: Any, Q: Any, turned: tuple[int, ...]) -> Any:
    """Return the matrix that the rest and the turned multipliers have to be solved from."""
    rows = list(turned)
    top = np.hstack([Q.T @ G @ Q, Q.T @ A[:, rows]])
    low = np.hstack([B[rows] @ Q, -D[np.ix_(rows, rows)]])
    return np.vstack([top, low])


def _start(mna: Any, P: Any) -> Any:
    """Return the states at the initial values of the stores."""
    stores = [*mna.capacitors, *mna.inductors]
    rows = np.zeros((len(stores), P.shape[0]))
    for k, store in enumerate(stores):
        for j, factor in store.functional.z:
            rows[k, j] += factor
    wanted = np.array([store.ic or 0.0 for store in stores])
    return np.linalg.lstsq(rows @ P, wanted, rcond=None)[0]

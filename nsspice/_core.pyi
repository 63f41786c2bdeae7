from typing import Any

import numpy as np
import numpy.typing as npt

_Floats = npt.NDArray[np.float64]
_Bytes = npt.NDArray[np.uint8]
_Matrix = tuple[Any, ...]
_Waveform = tuple[str, list[float], float, float]
_Switch = tuple[int, list[tuple[int, float]], float, float, bool, bool]
_Terms = list[tuple[int, float]]
_Tape = tuple[_Bytes, npt.NDArray[np.int32], _Floats, npt.NDArray[np.int32]]

class Stepper:
    def __init__(
        self,
        e: _Matrix,
        g: _Matrix,
        h: _Matrix,
        hs: _Matrix,
        a: _Matrix,
        b: _Matrix,
        d: _Matrix,
        q: _Floats,
        s: _Matrix,
        row_kind: _Bytes,
        waveforms: list[_Waveform],
        switches: list[_Switch],
        outputs: list[tuple[_Terms, _Terms, _Terms, _Terms, _Terms, _Terms]],
        smooth: tuple[_Tape, _Matrix, _Matrix] | None,
    ) -> None: ...
    def start_dc(
        self, time: float, guess: tuple[_Floats, _Floats] | None = None
    ) -> dict[str, Any] | None: ...
    def start_charges(
        self, time: float, charges: _Floats, step: float
    ) -> dict[str, Any] | None: ...
    def plan_grid(
        self, start: float, stop: float, step: float, out_start: float, out_step: float
    ) -> int: ...
    def watch(self, every: int, window: int, sides: bool) -> None: ...
    def show_all_points(self, from_time: float) -> None: ...
    def waiting(self) -> int: ...
    def take_records(self) -> dict[str, Any]: ...
    def take_sides(self) -> _Floats: ...
    def plan_sdirk(
        self,
        order: int,
        stop: float,
        longest: float,
        out_start: float,
        out_step: float,
        reltol: float,
        vntol: float,
        abstol: float,
    ) -> int: ...
    def plan_points(self, times: _Floats) -> int: ...
    def advance(self, out: _Floats, budget: float) -> tuple[int, int]: ...
    def failure(self) -> dict[str, Any] | None: ...
    def accept_large(self) -> None: ...
    def state(self) -> tuple[_Floats, _Floats]: ...
    def freeze_time(self, time: float) -> None: ...
    def follow_path(self, by_rate: bool, correctors: int | None = None) -> None: ...
    def time(self) -> float: ...
    def gates(self) -> list[bool]: ...
    def jumps(self) -> list[dict[str, Any]]: ...
    def events(self) -> list[tuple[float, int, bool]]: ...
    def statistics(self) -> dict[str, Any]: ...

class Modewise:
    def __init__(
        self,
        e: _Matrix,
        g: _Matrix,
        a: _Matrix,
        b: _Matrix,
        d: _Matrix,
        q: _Floats,
        s: _Matrix,
        row_kind: _Bytes,
        waveforms: list[_Waveform],
        switches: list[_Switch],
        outputs: list[tuple[_Terms, _Terms, _Terms, _Terms]],
        capacitors: list[tuple[int, int, float]],
        conductors: list[tuple[int, int, float]],
    ) -> None: ...
    def plan(self, stop: float, out_start: float, out_step: float, fixed_step: float) -> int: ...
    def start(self, charges: _Floats, gates: list[bool]) -> dict[str, Any] | None: ...
    def advance(self, out: _Floats, budget: float) -> tuple[int, int]: ...
    def failure(self) -> dict[str, Any] | None: ...
    def state(self) -> tuple[_Floats, _Floats]: ...
    def time(self) -> float: ...
    def trouble(self) -> str | None: ...
    def jumps(self) -> list[dict[str, Any]]: ...
    def events(self) -> list[tuple[float, int, bool]]: ...
    def statistics(self) -> dict[str, Any]: ...

def solve_mlcp(
    k: _Matrix,
    a: _Matrix,
    b: _Matrix,
    d: _Matrix,
    rhs: _Floats,
    q: _Floats,
    roles: _Bytes,
    row_kind: _Bytes,
    start: tuple[_Floats, _Floats] | None,
) -> dict[str, Any]: ...
def tape_instructions() -> list[str]: ...
def tape_values(
    spec: _Tape, z: _Floats, u: _Floats, t: _Floats
) -> tuple[_Floats, list[tuple[int, int]], _Floats]: ...
def solve_path(
    g: _Matrix,
    a: _Matrix,
    b: _Matrix,
    d: _Matrix,
    q: _Floats,
    row_kind: _Bytes,
    smooth: tuple[Any, ...] | None,
    times: _Floats,
    right: _Floats,
    rates: _Floats | None,
    errors: _Floats | None,
    follow: bool,
    by_rate: bool,
    correctors: int | None,
    start: tuple[_Floats, _Floats] | None,
) -> dict[str, Any]: ...
def format_rows(rows: _Floats) -> bytes: ...
def waveform_values(spec: _Waveform, times: _Floats, side: int) -> _Floats: ...

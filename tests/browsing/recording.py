"""Records of what a run asks of the compiled core: its calls, their arrays, and their results."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from nsspice import _core

#: what the core hands on to itself, and Python only passes
_CLASSES = {name for name, found in vars(_core).items() if inspect.isclass(found)}


class Recorder:
    """Notes calls of the core from when it is put in its place."""

    def __init__(self) -> None:
        self.calls: list[dict[str, Any]] = []
        self.count = 0

    def put(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Put itself between the package and all names of the core."""
        for name, found in vars(_core).copy().items():
            if not name.startswith("_") and callable(found):
                monkeypatch.setattr(_core, name, self.noted(None, name, found))

    def noted(self, owner: int | None, name: str, found: Any) -> Callable[..., Any]:
        """Return a function that is called as another, and notes it."""

        def call(*arguments: Any, **named: Any) -> Any:
            if (
                name == "advance"
            ):  # without a limit of time, which another machine reaches elsewhere
                arguments = (arguments[0], math.inf)
            before = [self.kept(a) for a in arguments]
            given = {k: self.kept(v) for k, v in named.items()}
            result = found(*map(bare, arguments), **{k: bare(v) for k, v in named.items()})
            wrapped = self.wrapped(result)
            after = [
                then if isinstance(a, np.ndarray) and (then := self.kept(a)) != was else None
                for a, was in zip(arguments, before, strict=True)
            ]
            self.note(owner, name, True, before, given, after, self.kept(wrapped))
            return wrapped

        return call

    def note(
        self, of: int | None, name: str, called: bool, arguments: list[Any],
        named: dict[str, Any], after: list[Any], result: Any,
    ) -> None:  # fmt: skip
        """Add a call to the record."""
        self.calls.append(
            {"of": of, "name": name, "called": called, "arguments": arguments, "named": named,
             "after": after, "result": result}
        )  # fmt: skip

    def wrapped(self, value: Any) -> Any:
        """Return a result with recorders around the core's objects."""
        if type(value).__name__ in _CLASSES and type(value).__module__ == "nsspice._core":
            self.count += 1
            return Proxy(self, self.count, value)
        if isinstance(value, tuple | list):
            return type(value)(self.wrapped(v) for v in value)
        return value

    def kept(self, value: Any) -> Any:
        """Return a value as JSON can hold it."""
        if isinstance(value, Proxy):
            return {"object": value._number}
        if isinstance(value, np.ndarray):
            kind = f"{value.dtype.kind}{value.dtype.itemsize}"
            return {"array": [kind, list(value.shape), value.ravel().tolist()]}
        if isinstance(value, tuple):
            return {"tuple": [self.kept(v) for v in value]}
        if isinstance(value, list):
            return [self.kept(v) for v in value]
        if isinstance(value, dict):
            return {"dict": {k: self.kept(v) for k, v in value.items()}}
        if isinstance(value, np.generic):
            return value.item()
        assert value is None or isinstance(value, int | float | str), type(value)
        return value


class Proxy:
    """An object of the core, whose methods are noted."""

    def __init__(self, recorder: Recorder, number: int, found: Any) -> None:
        self._recorder, self._number, self._found = recorder, number, found

    def __getattr__(self, name: str) -> Any:
        member = getattr(self._found, name)
        if callable(member):
            return self._recorder.noted(self._number, name, member)
        wrapped = self._recorder.wrapped(member)
        kept = self._recorder.kept(wrapped)
        self._recorder.note(self._number, name, False, [], {}, [], kept)
        return wrapped

    def __len__(self) -> int:
        return int(self._recorder.noted(self._number, "__len__", self._found.__len__)())

    def __bool__(self) -> bool:
        return True

    def __setattr__(self, name: str, value: Any) -> None:
        assert name in ("_recorder", "_number", "_found"), name
        object.__setattr__(self, name, value)


def bare(value: Any) -> Any:
    """Return an argument as the core itself takes it."""
    if isinstance(value, Proxy):
        return value._found
    if isinstance(value, tuple | list):
        inner = [bare(v) for v in value]
        # a named tuple is one for the core, too
        return tuple(inner) if isinstance(value, tuple) else inner
    return value

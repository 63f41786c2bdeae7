"""The decorator `dataclass` of the standard library, in a third of its time.

Before Python 3.13 it compiles each method of each class from text, six for a frozen one: for the
classes that a small deck loads that was a quarter of the whole process.  Here only ``__init__``
is compiled; the other methods are closures over the names of the fields.  Classes behave as those
of the standard library do, and `replace`, `fields` and `asdict` know them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from operator import attrgetter
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any

__all__ = ["dataclass"]

if TYPE_CHECKING:
    from dataclasses import dataclass
else:

    def dataclass(cls=None, /, **options: bool):
        """Return the class as a dataclass, or the decorator that has these options.

        Parameters
        ----------
        cls : type
        **options : bool
            ``frozen``, ``slots``, ``eq`` and ``repr`` as in the standard library.
        """
        if cls is None:
            return lambda cls: _made(cls, **options)
        return _made(cls, **options)


def _made(
    cls: Any, frozen: bool = False, slots: bool = False, eq: bool = True, repr: bool = True
) -> Any:
    own = vars(cls)
    methods: dict[str, Any] = {}
    hashed = own.get("__hash__") is not None or ("__hash__" in own and "__eq__" not in own)
    under_frozen = any(
        p.frozen for b in cls.__mro__[1:] if (p := getattr(b, "__dataclass_params__", None))
    )
    made: Any = dataclasses.dataclass(
        init=False, repr=False, eq=False, slots=slots, frozen=under_frozen
    )(cls)
    params = made.__dataclass_params__
    params.init, params.frozen, params.eq, params.repr = True, frozen, eq, repr
    fields = dataclasses.fields(made)
    methods["__init__"] = _initialiser(made, fields, frozen)
    if repr:
        methods["__repr__"] = _representation([f.name for f in fields if f.repr])
    if eq:
        compared = _values([f.name for f in fields if f.compare])
        methods["__eq__"] = _equality(compared)
        if not hashed:
            kept = [f.name for f in fields if (f.compare if f.hash is None else f.hash)]
            made.__hash__ = _hash(_values(kept)) if frozen else None
    if frozen:
        methods["__setattr__"], methods["__delattr__"] = _guards(made, {f.name for f in fields})
        if slots:  # the default of pickle sets attributes
            methods["__getstate__"], methods["__setstate__"] = _state, _set_state
    for name, method in methods.items():
        if name not in own:
            setattr(made, name, method)
    return made


def _initialiser(cls: Any, fields: tuple[Any, ...], frozen: bool) -> Any:
    """Compile ``__init__``, whose parameters are the fields."""
    missing = dataclasses.MISSING
    names: dict[str, Any] = {"_set": object.__setattr__, "_missing": missing}
    parameters, body = ["self"], []
    for f in fields:
        value = f.name
        if f.default_factory is not missing:
            names[f"_make_{f.name}"] = f.default_factory
            value = f"_make_{f.name}()"
            if f.init:
                parameters.append(f"{f.name}=_missing")
                value = f"{value} if {f.name} is _missing else {f.name}"
        elif f.default is not missing:
            names[f"_default_{f.name}"] = f.default
            if f.init:
                parameters.append(f"{f.name}=_default_{f.name}")
            else:
                value = f"_default_{f.name}"
        elif f.init:
            parameters.append(f.name)
        else:
            continue
        body.append(f"_set(self, {f.name!r}, {value})" if frozen else f"self.{f.name} = {value}")
    if hasattr(cls, "__post_init__"):
        body.append("self.__post_init__()")
    text = f"def __init__({', '.join(parameters)}):\n " + "\n ".join(body or ["pass"])
    exec(text, names)
    return names["__init__"]


def _values(names: list[str]) -> Callable[[Any], tuple[Any, ...]]:
    """Return what reads these attributes as a tuple."""
    if len(names) > 1:
        return attrgetter(*names)
    return lambda self: tuple(getattr(self, name) for name in names)


def _representation(names: list[str]) -> Any:
    @recursive_repr("...")
    def __repr__(self: Any) -> str:
        shown = ", ".join(f"{name}={getattr(self, name)!r}" for name in names)
        return f"{self.__class__.__qualname__}({shown})"

    return __repr__


def _equality(values: Callable[[Any], Any]) -> Any:
    def __eq__(self: Any, other: object) -> Any:
        if other.__class__ is self.__class__:
            return values(self) == values(other)
        return NotImplemented

    return __eq__


def _hash(values: Callable[[Any], Any]) -> Any:
    def __hash__(self: Any) -> int:
        return hash(values(self))

    return __hash__


def _guards(cls: Any, names: set[str]) -> tuple[Any, Any]:
    def __setattr__(self: Any, name: str, value: object) -> None:
        if type(self) is cls or name in names:
            raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")
        super(cls, self).__setattr__(name, value)

    def __delattr__(self: Any, name: str) -> None:
        if type(self) is cls or name in names:
            raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
        super(cls, self).__delattr__(name)

    return __setattr__, __delattr__


def _state(self: Any) -> list[Any]:
    return [getattr(self, f.name) for f in dataclasses.fields(self)]


def _set_state(self: Any, state: list[Any]) -> None:
    for f, value in zip(dataclasses.fields(self), state, strict=True):
        object.__setattr__(self, f.name, value)

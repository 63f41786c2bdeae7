"""The package's decorator `dataclass` makes what the standard library's makes."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
from typing import Any, ClassVar

import numpy as np
import pytest

from nsspice.dataclass import dataclass as ours


class Fields:
    """What a class of both decorators declares."""

    a: int
    b: tuple[float, ...] = ()
    c: list[int] = dataclasses.field(default_factory=list)
    d: float = dataclasses.field(default=2.0, compare=False, repr=False)
    e: int = dataclasses.field(init=False, default=7)
    KIND: ClassVar[str] = "kind"

    def twice(self) -> int:
        return 2 * self.a


def made(decorator: Any, **options: bool) -> Any:
    body = {k: v for k, v in vars(Fields).items() if k not in ("__dict__", "__weakref__")}
    return decorator(**options)(type("Sample", (), body))


OPTIONS = [
    {"frozen": frozen, "slots": slots, "eq": eq, "repr": shown}
    for frozen in (True, False)
    for slots in (True, False)
    for eq in (True, False)
    for shown in (True, False)
]


@pytest.mark.parametrize("options", OPTIONS, ids=lambda o: "-".join(k for k in o if o[k]) or "none")
def test_as_the_standard_library(options: dict[str, bool]) -> None:
    mine, theirs = made(ours, **options), made(dataclasses.dataclass, **options)
    assert [f.name for f in dataclasses.fields(mine)] == [
        f.name for f in dataclasses.fields(theirs)
    ]
    assert mine.__match_args__ == theirs.__match_args__
    assert list(inspect.signature(mine).parameters) == list(inspect.signature(theirs).parameters)
    assert ("__slots__" in vars(mine)) == ("__slots__" in vars(theirs)) == options["slots"]
    for name in ("__repr__", "__eq__", "__hash__", "__setattr__", "__delattr__"):
        assert (name in vars(mine)) == (name in vars(theirs)), name
    assert (mine.__hash__ is None) == (theirs.__hash__ is None)
    made_of: dict[Any, list[Any]] = {}
    for cls in (mine, theirs):
        one, same, other = cls(1, (2.0,)), cls(1, b=(2.0,), d=5.0), cls(1, (2.0,), [3])
        made_of[cls] = [
            one == same,
            one == other,
            one == (1, (2.0,)),
            dataclasses.asdict(other),
            dataclasses.asdict(dataclasses.replace(other, a=4)),
            dataclasses.asdict(copy.deepcopy(other)),
            one.c is not same.c,
            one.twice(),
            repr(other) if options["repr"] else None,
        ]
        for act in (lambda: setattr(one, "a", 3), lambda: delattr(one, "b")):  # noqa: B023
            try:
                act()
                made_of[cls].append(getattr(one, "a", None))
            except dataclasses.FrozenInstanceError as error:
                made_of[cls].append(str(error))
        with pytest.raises(TypeError, match="missing 1 required positional argument: 'a'"):
            cls()
    assert made_of[mine] == made_of[theirs]


@ours(frozen=True, slots=True)
class Point:
    """A frozen class with slots."""

    x: float
    y: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "x", float(self.x))


@ours(frozen=True, slots=True)
class Named(Point):
    """One that inherits."""

    name: str = "origin"

    def __repr__(self) -> str:
        return self.name


@dataclasses.dataclass(frozen=True)
class Foreign(Point):
    """A class of the standard library on top of one of the package, as a user may write it."""

    z: float = 1.0


def test_copies_and_hashes() -> None:
    for value in (Point(1), Named(1, 2, "p"), Foreign(1, 2, 3)):
        assert pickle.loads(pickle.dumps(value)) == value
        assert copy.copy(value) == value
        assert hash(copy.copy(value)) == hash(value)
    assert Point(1) != Named(1)
    assert isinstance(Point(1).x, float)
    assert repr(Named(0)) == "origin"
    assert repr(Point(1)) == "Point(x=1.0, y=0.0)"
    for value, name in ((Named(0), "x"), (Named(0), "name"), (Foreign(0), "z")):
        with pytest.raises(dataclasses.FrozenInstanceError, match=f"'{name}'"):
            setattr(value, name, 1)


def test_a_single_array_is_compared_as_a_field() -> None:
    """Fields are compared as a tuple, which asks for identity first."""

    @ours(slots=True)
    class Held:
        values: Any

    array = np.arange(3.0)
    assert Held(array) == Held(array)
    with pytest.raises(ValueError, match="truth value"):
        bool(Held(array) == Held(array.copy()))

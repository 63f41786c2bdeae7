"""The points of a sweep: grids, lists of points, corners of tolerances and samples."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from ..errors import Diagnostic, UsageError

Floats = npt.NDArray[np.float64]
#: nominal value of a swept name
Nominal = Callable[[str], float]
How = Literal["latin", "sobol", "random"]

#: points of one sweep; each is a row of the table
MAX_POINTS = 10_000_000


@dataclass(frozen=True, slots=True)
class Uniform:
    """Evenly distributed between two values.

    Parameters
    ----------
    low, high : float
    """

    low: float
    high: float

    def quantile(self, share: Floats, nominal: float) -> Floats:
        """Return the values below which shares of all lie."""
        return self.low + share * (self.high - self.low)


@dataclass(frozen=True, slots=True)
class LogUniform:
    """Evenly distributed on a logarithmic scale between two positive values.

    Parameters
    ----------
    low, high : float
    """

    low: float
    high: float

    def quantile(self, share: Floats, nominal: float) -> Floats:
        """Return the values below which shares of all lie."""
        low, high = math.log(self.low), math.log(self.high)
        return np.exp(low + share * (high - low))


@dataclass(frozen=True, slots=True)
class Normal:
    """Normally distributed.

    Parameters
    ----------
    mean, deviation : float
        Mean and standard deviation.
    """

    mean: float
    deviation: float

    def quantile(self, share: Floats, nominal: float) -> Floats:
        """Return the values below which shares of all lie."""
        from scipy.special import ndtri

        values: Floats = self.mean + self.deviation * ndtri(share)
        return values


@dataclass(frozen=True, slots=True)
class Tolerance:
    """Evenly distributed about the deck's own value.

    Parameters
    ----------
    share : float
        0.05 for 5 %.
    """

    share: float

    def quantile(self, share: Floats, nominal: float) -> Floats:
        """Return the values below which shares of all lie."""
        return nominal * (1.0 + self.share * (2.0 * share - 1.0))


Distribution = Uniform | LogUniform | Normal | Tolerance


@dataclass(frozen=True, slots=True)
class Points:
    """The points of a sweep.

    Parameters
    ----------
    names : tuple of str
        What is swept: a ``.param``, the value of an element, ``temp``, or ``model(parameter)``.
    values : ndarray, shape (k, n)
        One row for each point, one column for each name.
    axes : tuple of ndarray, optional
        Values along each name if the points are a grid, the last one running fastest.
    """

    names: tuple[str, ...]
    values: Floats
    axes: tuple[Floats, ...] | None = field(default=None, compare=False)

    def __len__(self) -> int:
        return int(self.values.shape[0])


def grid(over: Mapping[str, Sequence[float] | float]) -> Points:
    """Return all combinations of values, the last name running fastest.

    Parameters
    ----------
    over : mapping of str to sequence of float

    Raises
    ------
    UsageError
        NS4005 for a value that is not a finite number, NS4017 for too many points.

    Examples
    --------
    >>> points = grid({"vin": [10, 20], "rload": [1, 2, 5]})
    >>> len(points), points.values[1].tolist()
    (6, [10.0, 2.0])
    """
    axes = tuple(_column(name, values) for name, values in over.items())
    count = math.prod(axis.size for axis in axes)
    if count > MAX_POINTS:
        raise _too_many(count)
    rows = np.array(list(itertools.product(*axes)), float).reshape(count, len(axes))
    return Points(_names(over), rows, axes)


def paired(table: Mapping[str, Sequence[float]] | Any) -> Points:
    """Return the points of a table: a column for each name, a row for each point.

    Parameters
    ----------
    table : mapping of str to sequence of float, or DataFrame

    Raises
    ------
    UsageError
        NS4005 if the columns differ in length.

    Examples
    --------
    >>> paired({"vin": [10, 20], "rload": [1, 2]}).values.tolist()
    [[10.0, 1.0], [20.0, 2.0]]
    """
    columns = {str(name): _column(str(name), table[name]) for name in table}
    if len({column.size for column in columns.values()}) > 1:
        sizes = ", ".join(f"{n} {c.size}" for n, c in columns.items())
        raise _wrong(f"the columns of the points differ in length: {sizes}", "one value a point")
    return Points(_names(columns), np.column_stack([*columns.values()]))


def samples(
    over: Mapping[str, Distribution | tuple[float, float]],
    count: int,
    *,
    how: How = "latin",
    seed: int = 0,
    nominal: Nominal | None = None,
) -> Points:
    """Return random points, the same for the same seed on every machine.

    Parameters
    ----------
    over : mapping of str to distribution
        ``Uniform``, ``LogUniform``, ``Normal``, ``Tolerance``; two numbers are the ends of a
        uniform one.
    count : int
    how : str
        ``latin`` (each of ``count`` slices of each name is met once), ``sobol`` (a sequence of low
        discrepancy, scrambled; best for a power of two) or ``random``.
    seed : int
    nominal : callable, optional
        Returns the deck's value of a name, for ``Tolerance``.

    Raises
    ------
    UsageError
        NS4005

    Notes
    -----
    Latin hypercube: M. D. McKay, R. J. Beckman, W. J. Conover, Technometrics 21 (1979) 239,
    doi:10.1080/00401706.1979.10489755.  Sobol: I. M. Sobol', USSR Comput. Math. Math. Phys. 7
    (1967) 86, doi:10.1016/0041-5553(67)90144-9.  Both by ``scipy.stats.qmc``.

    Examples
    --------
    >>> points = samples({"r": Uniform(0.0, 4.0)}, 4)
    >>> sorted(int(x) for x in points.values[:, 0])  # one in each quarter
    [0, 1, 2, 3]
    """
    laws = {name: _distribution(name, law) for name, law in over.items()}
    if not 0 < count <= MAX_POINTS:
        raise _wrong(f"{count} samples cannot be drawn", "give a positive number of samples")
    shares = _shares(len(laws), count, how, seed)
    columns = []
    for column, (name, law) in zip(shares.T, laws.items(), strict=True):
        own = nominal(name) if nominal is not None and isinstance(law, Tolerance) else math.nan
        if isinstance(law, Tolerance) and math.isnan(own):
            raise _wrong(f"the deck's value of {name} is not known here", "give Uniform(low, high)")
        columns.append(law.quantile(column, own))
    return Points(_names(laws), np.column_stack(columns))


def corners(over: Mapping[str, Tolerance | tuple[float, float]], nominal: Nominal) -> Points:
    """Return the corners of tolerances: all up to eight names, else one name at its end at a time.

    Parameters
    ----------
    over : mapping of str to Tolerance or (float, float)
    nominal : callable
        Returns the deck's value of a name.

    Examples
    --------
    >>> corners({"r": Tolerance(0.1)}, lambda name: 100.0).values[:, 0].round(9).tolist()
    [90.0, 110.0]
    """
    laws = {name: _distribution(name, law) for name, law in over.items()}
    count = len(laws)
    if count <= _CORNERS:
        signs = np.array(list(itertools.product((0.0, 1.0), repeat=count)))
    else:
        signs = 0.5 + 0.5 * np.vstack([np.eye(count), -np.eye(count)])
    columns = [
        law.quantile(column, nominal(name))
        for column, (name, law) in zip(signs.T, laws.items(), strict=True)
    ]
    return Points(_names(laws), np.column_stack(columns))


def combined(
    over: Mapping[str, Any], count: int | None, how: How, seed: int, nominal: Nominal
) -> Points:
    """Return the points that a mapping of lists and distributions asks for.

    Lists make a grid; distributions are sampled, at every point of the grid the same samples.
    """
    drawn = {n: v for n, v in over.items() if isinstance(v, Distribution)}
    lists = {n: v for n, v in over.items() if n not in drawn}
    if not drawn:
        if count is not None:
            raise _wrong("nothing is to be sampled", "give Uniform, Normal or Tolerance for a name")
        return grid(lists)
    if count is None:
        raise _wrong(f"{', '.join(drawn)} are distributions", "say how many samples: samples=200")
    random = samples(drawn, count, how=how, seed=seed, nominal=nominal)
    if not lists:
        return random
    outer = grid(lists)
    if len(outer) * count > MAX_POINTS:
        raise _too_many(len(outer) * count)
    repeated = np.repeat(outer.values, count, axis=0)
    rows = np.hstack([repeated, np.tile(random.values, (len(outer), 1))])
    return Points((*outer.names, *random.names), rows)


#: corners are all taken up to so many names: 2**8 runs
_CORNERS = 8


def _shares(dimension: int, count: int, how: How, seed: int) -> Floats:
    """Return points of the unit cube, shape (count, dimension)."""
    if how == "random":
        return np.random.default_rng(seed).uniform(size=(count, dimension))
    from scipy.stats import qmc

    if how == "latin":
        drawn: Floats = qmc.LatinHypercube(dimension, rng=seed).random(count)
        return drawn
    if how == "sobol":
        size = max(1, math.ceil(math.log2(count)))
        # a whole power of two keeps the balance of the sequence; the first of them are taken
        drawn = qmc.Sobol(dimension, rng=seed).random_base2(size)[:count]
        return drawn
    raise _wrong(f"samples are not drawn {how!r}", "choose latin, sobol or random")


def _distribution(name: str, law: Distribution | tuple[float, float]) -> Distribution:
    if isinstance(law, tuple) and len(law) == 2:
        law = Uniform(*law)
    if not isinstance(law, Distribution):
        raise _wrong(f"{name} cannot be {law!r}", "give Uniform(low, high), Normal or Tolerance")
    if isinstance(law, LogUniform) and not 0.0 < law.low <= law.high:
        raise _wrong(f"{name} cannot be {law}", "a logarithmic scale has positive ends")
    return law


def _column(name: str, values: object) -> Floats:
    """Return the values of a name, shape (k,)."""
    if isinstance(values, str):
        raise _wrong(f"{name} cannot be {values!r}", "give numbers")
    try:
        column: Floats = np.atleast_1d(np.asarray(values, float))
    except (TypeError, ValueError):
        raise _wrong(f"{name} cannot be {values!r}", "give numbers") from None
    if column.ndim != 1 or not column.size or not np.isfinite(column).all():
        raise _wrong(f"{name} cannot be {values!r}", "give one or more finite numbers")
    return column


def _names(over: Mapping[str, Any]) -> tuple[str, ...]:
    names = tuple(str(name).lower().replace(" ", "") for name in over)
    if not names:
        raise _wrong("nothing is swept", "name a parameter, an element, temp or model(parameter)")
    if len(set(names)) < len(names):
        raise _wrong(f"a name is swept twice: {', '.join(names)}", "names are case-insensitive")
    return names


def _wrong(message: str, hint: str) -> UsageError:
    return UsageError(Diagnostic("NS4005", message, hint=hint))


def _too_many(count: int) -> UsageError:
    message = f"the sweep asks for {count} points, more than {MAX_POINTS}"
    return UsageError(Diagnostic("NS4017", message, hint="take fewer values, or samples"))

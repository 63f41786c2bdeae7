"""The result of a sweep: one table of points and measures."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import Diagnostic, UsageError, suggest
from ..lazy import need_library
from ..output.atomic_write import whole
from ..output.files import check_table_format, output_error
from .points import Floats, Points

if TYPE_CHECKING:
    from .worker import Outcome

#: points that are printed: the first and the last of a long table
_SHOWN = 40


@dataclass(frozen=True, slots=True)
class Failure:
    """A point that has no measures.

    Parameters
    ----------
    point : int
    values : dict of str to float
        What was swept.
    code, message : str
    """

    point: int
    values: dict[str, float]
    code: str
    message: str


@dataclass(slots=True, eq=False, repr=False)
class SweepTable:
    """Points of a sweep and what was measured there.

    Parameters
    ----------
    title : str
        Of the deck.
    points : Points
    outcomes : list of Outcome or None
        One for each point; None where the sweep was interrupted before.
    units : dict of str to str
        Of columns, where they are known.
    interrupted : bool

    Examples
    --------
    >>> import nsspice
    >>> table = nsspice.sweep('''divider
    ... .param r=1k
    ... V1 a 0 10
    ... R1 a b {r}
    ... R2 b 0 1k
    ... .op
    ... .measure op out find v(b) at=0
    ... ''', {"r": [1e3, 3e3, 4e3]})
    >>> table["out"].tolist()
    [5.0, 2.5, 2.0]
    """

    title: str
    points: Points
    outcomes: list[Outcome | None]
    units: dict[str, str] = field(default_factory=dict)
    interrupted: bool = False

    def __len__(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        names = ", ".join(self.points.names)
        failed = f", {len(self.failures)} failed" if self.failures else ""
        return f"<SweepTable {self.title!r}: {len(self)} points over {names}{failed}>"

    @property
    def swept(self) -> tuple[str, ...]:
        """Names of what was swept."""
        return self.points.names

    @property
    def measures(self) -> list[str]:
        """Names of what was measured, in the order of the deck."""
        found: dict[str, None] = {}
        for outcome in self.outcomes:
            if outcome is not None and outcome.values.keys() - found.keys():
                found.update(dict.fromkeys(outcome.values))
        return list(found)

    @property
    def failures(self) -> list[Failure]:
        """The points that have no measures, with the reason."""
        return [
            Failure(k, self.values_at(k), o.code, o.message)
            for k, o in enumerate(self.outcomes)
            if o is not None and o.code
        ]

    @property
    def seconds(self) -> Floats:
        """Processor time of each point [s], shape (k,); nan where it was not run."""
        return np.array([math.nan if o is None else o.seconds for o in self.outcomes])

    @property
    def status(self) -> list[str]:
        """``ok``, the code of an error, or ``not run``, for each point."""
        return ["not run" if o is None else o.code or "ok" for o in self.outcomes]

    def values_at(self, point: int) -> dict[str, float]:
        """Return the swept values of a point."""
        return dict(zip(self.swept, self.points.values[point].tolist(), strict=True))

    def __getitem__(self, name: str) -> Floats:
        """Return a column by name, shape (k,); nan where a point failed.

        Raises
        ------
        KeyError
        """
        key = name.lower().replace(" ", "")
        if key in self.swept:
            return self.points.values[:, self.swept.index(key)]
        measures = self.measures
        if key not in measures:
            known = [*self.swept, *measures]
            hint = suggest(key, known) or f"columns are {', '.join(known)}"
            raise KeyError(f"no column {name!r} in this sweep; {hint}")
        return np.array(
            [math.nan if o is None else o.values.get(key, math.nan) for o in self.outcomes]
        )

    def grid(self, name: str) -> Floats:
        """Return a column of a grid as an array with one dimension for each swept name.

        Raises
        ------
        UsageError
            NS4005 if the points are not a grid.
        """
        axes = self.points.axes
        if axes is None:
            message = "the points of this sweep do not form a grid"
            raise UsageError(
                Diagnostic("NS4005", message, hint="give a list of values for each name")
            )
        return self[name].reshape([axis.size for axis in axes])

    def columns(self) -> dict[str, Any]:
        """Return all columns by name: swept values, measures, ``status`` and ``seconds``."""
        found: dict[str, Any] = {name: self[name] for name in (*self.swept, *self.measures)}
        return found | {"status": self.status, "seconds": self.seconds}

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-ready mapping: columns by name, null where a point has no value."""
        columns = self.columns()
        listed = {
            name: [None if x != x else x for x in (c.tolist() if isinstance(c, np.ndarray) else c)]
            for name, c in columns.items()
        }
        return {
            "title": self.title,
            "swept": list(self.swept),
            "measures": self.measures,
            "units": self.units,
            "columns": listed,
            "failures": [
                {"point": f.point, "values": f.values, "code": f.code, "message": f.message}
                for f in self.failures
            ],
            "interrupted": self.interrupted,
        }

    # ------------------------------------------------------------------ for other libraries

    def to_pandas(self) -> Any:
        """Return a ``pandas.DataFrame``, a row for each point.

        Raises
        ------
        UsageError
            NS4010 without the package.
        """
        frame = need_library("pandas").DataFrame(self.columns())
        frame.attrs.update(title=self.title, units=dict(self.units))
        return frame

    def to_xarray(self) -> Any:
        """Return an ``xarray.Dataset``: a dimension for each swept name of a grid, with units.

        Points that are not a grid have the one dimension ``point``.
        """
        xarray = need_library("xarray")
        axes = self.points.axes
        if axes is None:
            rows = {n: ("point", self[n], self._units(n)) for n in (*self.swept, *self.measures)}
            return xarray.Dataset(rows, attrs={"title": self.title})
        data: dict[str, Any] = {
            n: (self.swept, self.grid(n), self._units(n)) for n in self.measures
        }
        status = np.array(self.status).reshape([axis.size for axis in axes])
        data["status"] = (self.swept, status, {})
        over = {n: (n, axis, self._units(n)) for n, axis in zip(self.swept, axes, strict=True)}
        return xarray.Dataset(data, over, {"title": self.title})

    def _units(self, name: str) -> dict[str, str]:
        unit = self.units.get(name, "")
        return {"units": unit} if unit else {}

    def save(self, path: str | Path) -> None:
        """Write the table as ``.csv`` or ``.parquet``, by the ending of the name.

        Raises
        ------
        UsageError
            NS4008 for another ending, NS4010 without pyarrow.
        OutputError
            NS4001 if it cannot be written.
        """
        path = Path(path)
        check_table_format(path)
        try:
            with whole(path) as part:
                if path.suffix.lower() == ".parquet":
                    self._write_parquet(part)
                else:
                    part.write_text(self._csv(), encoding="utf-8", newline="")
        except OSError as error:
            raise output_error(error, str(path)) from error

    def to_csv(self, path: str | Path) -> None:
        """Write the table as CSV (RFC 4180); numbers read back to the same doubles."""
        self.save(path)

    def _csv(self) -> str:
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\r\n")
        columns = self.columns()
        writer.writerow(columns)
        arrays = [c.tolist() if isinstance(c, np.ndarray) else c for c in columns.values()]
        for row in zip(*arrays, strict=True):
            writer.writerow(["" if x != x else repr(x) if isinstance(x, float) else x for x in row])
        return text.getvalue()

    def _write_parquet(self, path: Path) -> None:
        arrow, parquet = need_library("pyarrow"), need_library("pyarrow.parquet")
        columns = self.columns()
        fields, arrays = [], []
        for name, column in columns.items():
            kind = arrow.string() if name == "status" else arrow.float64()
            fields.append(arrow.field(name, kind, metadata=self._units(name) or None))
            arrays.append(arrow.array(column, kind))
        about = {"title": self.title, "generator": "nsspice"}
        schema = arrow.schema(fields, metadata=about)
        parquet.write_table(arrow.Table.from_arrays(arrays, schema=schema), path)

    # ------------------------------------------------------------------ for people

    def shown(self) -> tuple[list[str], list[list[str]]]:
        """Return heading and rows as text: all of a short table, both ends of a long one."""
        failed = bool(self.failures) or self.interrupted
        names = [*self.swept, *self.measures, *(["status"] if failed else [])]
        columns = {name: self.status if name == "status" else self[name].tolist() for name in names}
        count = len(self)
        chosen: Sequence[int] = range(count)
        if count > _SHOWN:
            half = _SHOWN // 2
            chosen = [*range(half), -1, *range(count - half, count)]
        rows = [
            ["..."] * len(names) if k < 0 else [_text(columns[n][k]) for n in names] for k in chosen
        ]
        heading = [f"{n} [{self.units[n]}]" if self.units.get(n) else n for n in names]
        return heading, rows

    def __str__(self) -> str:
        heading, rows = self.shown()
        widths = [max(len(row[j]) for row in [heading, *rows]) for j in range(len(heading))]
        lines = [
            "  ".join(x.rjust(w) for x, w in zip(r, widths, strict=True)) for r in [heading, *rows]
        ]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        from html import escape

        heading, rows = self.shown()
        head = "".join(f"<th>{escape(x)}</th>" for x in heading)
        body = "".join("<tr>" + "".join(f"<td>{escape(x)}</td>" for x in r) + "</tr>" for r in rows)
        return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"

    # ------------------------------------------------------------------ pictures

    def plot(
        self, measures: Sequence[str] | str | None = None, path: str | Path | None = None
    ) -> Any:
        """Draw measures over the last swept name, a curve for each value of the others.

        Parameters
        ----------
        measures : sequence of str, optional
            A panel each; all by default.
        path : str or Path, optional
            ``.png``, ``.svg`` or ``.pdf``.

        Returns
        -------
        matplotlib.figure.Figure
        """
        from .pictures import family

        names = [measures] if isinstance(measures, str) else measures
        return family(self, names, path)

    def map(self, measure: str, path: str | Path | None = None) -> Any:
        """Draw a measure over two swept names of a grid, as filled contours."""
        from .pictures import contours

        return contours(self, measure, path)

    def histogram(self, measure: str, path: str | Path | None = None) -> Any:
        """Draw how often values of a measure occur, with mean, deviation and quantiles."""
        from .pictures import histogram

        return histogram(self, measure, path)


def _text(value: float | str) -> str:
    if isinstance(value, str):
        return value
    return "-" if math.isnan(value) else f"{value:.7g}"

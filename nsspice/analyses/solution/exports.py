"""What a solution hands over to writers: files, pictures, tables of other libraries, text."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...lazy import need_library


class HandedOver:
    """The methods of a solution that write, draw and describe it."""

    __slots__ = ()

    @property
    def _run(self) -> Any:
        """The solution itself."""
        return self

    def to_csv(self, path: str | Path, columns: Sequence[str] | None = None) -> None:
        """Write the columns to a CSV file; doubles read back bit for bit.

        Parameters
        ----------
        path : str or Path
        columns : sequence of str, optional
            Signals to write; all ``columns`` of the solution if left out.

        Raises
        ------
        OutputError
            If the file cannot be written.
        """
        from ...output.csv import write_csv

        write_csv(self._run, path, columns)

    def save(self, path: str | Path, columns: Sequence[str] | None = None) -> None:
        """Write the columns into a file whose extension gives the format.

        Parameters
        ----------
        path : str or Path
            ``.csv``, ``.raw`` (SPICE), ``.npz`` (numpy), ``.parquet`` (needs pyarrow), ``.h5`` or
            ``.hdf5`` (need h5py).
        columns : sequence of str, optional
            Signals to write; all ``columns`` of the solution if left out.

        Raises
        ------
        UsageError
            NS4008 for another ending, NS4010 for a package that is not installed.
        OutputError
            NS4001 if the file cannot be written.
        """
        from ...output.exports import save

        save(self._run, path, columns)

    def to_xarray(self, columns: Sequence[str] | None = None) -> Any:
        """Return an ``xarray.Dataset``: signals over the axis, with their units as attributes.

        Parameters
        ----------
        columns : sequence of str, optional
            Signals to hand on; all ``columns`` of the solution if left out.

        Raises
        ------
        UsageError
            NS4010 if xarray is not installed.
        """
        from ...output.exports import to_xarray

        return to_xarray(self._run, columns)

    def to_pandas(self) -> Any:
        """Return a ``pandas.DataFrame`` of all ``columns``, indexed by the axis.

        Raises
        ------
        UsageError
            NS4010 if pandas is not installed.
        """
        pandas = need_library("pandas", instead="use sol.table() for plain arrays")
        frame = pandas.DataFrame({name: self._run[name] for name in self._run.columns})
        if self._run.axis_name:
            frame.index = pandas.Index(self._run.axis, name=self._run.axis_name)
        return frame

    def plot(
        self,
        path: str | Path | None = None,
        columns: Sequence[str | Sequence[str]] | None = None,
        *,
        dark: bool = False,
    ) -> Any:
        """Draw the waveforms, in a panel for each unit and scale.

        Parameters
        ----------
        path : str or Path, optional
            Where to save the picture: .png, .svg or .pdf.
        columns : sequence of str, or of sequences of str, optional
            Signals or expressions of signals to draw; each group is a panel of its own.  If left
            out, what a deck or a call has asked for, else outputs, inductor currents, gates, and
            which element conducts when.
        dark : bool
            For a dark page.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        UsageError
            If there is nothing to draw, or matplotlib is missing.
        OutputError
            If the file cannot be written.
        """
        from ...output.plot import draw

        return draw(self._run, path, columns, dark=dark)

    def summary(self, details: bool = True) -> str:
        """Return the text that the command line prints after a run, with details as for ``-v``."""
        from ...output.summary import describe

        return describe(self._run, details)

    def to_dict(self) -> dict[str, Any]:
        """Return everything but the waveforms as a JSON-ready mapping."""
        from ...output.summary import to_dict

        return to_dict(self._run)

    def _repr_html_(self) -> str:
        """Return what a notebook shows: verdict, measures and a picture."""
        from ...output.notebook import solution_html

        return solution_html(self._run)

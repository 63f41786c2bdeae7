"""A file in which a sweep notes each finished point, to go on where it was stopped."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..errors import Diagnostic, UsageError
from ..output.files import output_error
from .executors import Chunk
from .plan import Plan
from .points import Points
from .worker import Outcome

_KIND = "nsspice sweep"


class Journal:
    """Finished points, a JSON line each after a line that says whose they are.

    Parameters
    ----------
    path : Path
    plan : Plan
    points : Points
    resume : bool
        Take over what an earlier run of the same sweep has noted.

    Raises
    ------
    UsageError
        NS4018 if the file is there and nothing is to be resumed, or if it is another sweep's.
    OutputError
        NS4001 if it cannot be written.
    """

    def __init__(self, path: Path, plan: Plan, points: Points, resume: bool) -> None:
        self.path = path
        head = {"kind": _KIND, "plan": plan.key, "points": _digest(points)}
        self.known: dict[int, Outcome] = {}
        try:
            whole = 0
            if path.exists() and path.stat().st_size:
                if not resume:
                    message = f"{path} is there already"
                    hint = "continue it with --resume (resume=True), or choose another name"
                    raise UsageError(Diagnostic("NS4018", message, hint=hint))
                whole = self._read(head)
            self._file = path.open("r+b" if whole else "wb")
            self._file.truncate(whole)  # a line that was torn when the run was killed
            self._file.seek(whole)
            if not whole:
                self._line(head)
        except OSError as error:
            raise output_error(error, str(path)) from error

    def _read(self, head: dict[str, str]) -> int:
        """Take over the points of a file; return the length of its whole lines."""
        data = self.path.read_bytes()
        whole = data.rfind(b"\n") + 1
        lines = data[:whole].splitlines()
        found = _parsed(lines[0]) if lines else {}
        if found != head:
            message = f"{self.path} belongs to another sweep: deck, points or version differ"
            if found.get("kind") != _KIND:
                message = f"{self.path} is not the journal of a sweep"
            raise UsageError(Diagnostic("NS4018", message, hint="choose another name"))
        for line in lines[1:]:
            item = _parsed(line)
            values = {k: math.nan if v is None else v for k, v in item["values"].items()}
            self.known[item["point"]] = Outcome(
                values, item["code"], item["message"], item["seconds"]
            )
        return whole

    def note(self, chunk: Chunk, outcomes: Sequence[Outcome]) -> None:
        """Write down the points of a chunk."""
        for k, outcome in enumerate(outcomes):
            values = {n: None if math.isnan(v) else v for n, v in outcome.values.items()}
            self._line({"point": chunk.first + k, **outcome._asdict(), "values": values})
        self._file.flush()

    def _line(self, item: dict[str, Any]) -> None:
        self._file.write(json.dumps(item).encode() + b"\n")

    def close(self) -> None:
        """End."""
        self._file.close()


def _parsed(line: bytes) -> dict[str, Any]:
    try:
        found = json.loads(line)
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def _digest(points: Points) -> str:
    import hashlib

    return hashlib.sha256(repr(points.names).encode() + points.values.tobytes()).hexdigest()

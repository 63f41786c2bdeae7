"""Files that appear under their name when they are whole.

Rows are written into ``NAME.part`` next to the file and the part is renamed at the end: a run that
is killed leaves a part, and any older file under the name.  A symbolic link stays one: the
file behind it is replaced.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

SUFFIX = ".part"


def aside(path: Path) -> Path:
    """Return where a file is written until it is whole; itself if that is not an ordinary file.

    Examples
    --------
    >>> aside(Path("folder/a.csv")).name
    'a.csv.part'
    >>> aside(Path("/dev/null"))
    PosixPath('/dev/null')
    """
    real = Path(os.path.realpath(path))
    if real.exists() and not real.is_file():
        return path  # a device or a pipe
    part = real.with_name(real.name + SUFFIX)
    if real.exists() and not os.access(real.parent, os.W_OK):
        return path  # a file that may be written in a folder that may not
    return part


def publish(part: Path, path: Path) -> None:
    """Give a whole file its name.

    Raises
    ------
    OSError
    """
    if part == path:
        return
    real = Path(os.path.realpath(path))
    with contextlib.suppress(OSError):  # a file that is replaced keeps its permissions
        os.chmod(part, os.stat(real).st_mode & 0o7777)
    os.replace(part, real)


@contextlib.contextmanager
def whole(path: str | Path) -> Iterator[Path]:
    """Write a file aside and name it at the end; nothing is left of one that fails.

    Parameters
    ----------
    path : str or Path

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with whole(f"{folder}/a.txt") as part:
    ...         _ = part.write_text("all of it")
    ...     [p.name for p in Path(folder).iterdir()]
    ['a.txt']
    """
    path = Path(path)
    part = aside(path)
    try:
        yield part
        publish(part, path)
    except BaseException:
        if part != path:
            with contextlib.suppress(OSError):
                part.unlink()
        raise

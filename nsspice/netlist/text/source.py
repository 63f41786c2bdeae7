"""Reading netlist files: encodings, and which file an ``.include`` means."""

from __future__ import annotations

import stat
from pathlib import Path

#: nobody writes a larger netlist by hand or by program; it would not fit into memory expanded
MAX_BYTES = 512 * 1024 * 1024


def decode(data: bytes) -> str:
    """Return the text of a netlist file, written by any program.

    UTF-8 is tried first, then Latin-1; LTspice writes UTF-16 with or without a byte-order mark.

    Parameters
    ----------
    data : bytes
        The file's content.

    Examples
    --------
    >>> decode("C1 a 0 1\u00b5".encode("latin-1"))
    'C1 a 0 1\u00b5'
    >>> decode("* title".encode("utf-16-le"))
    '* title'
    """
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", errors="replace")
    head = data[:400]
    if len(head) >= 4 and head.count(0) * 3 > len(head):
        little = head[1::2].count(0) >= head[0::2].count(0)
        return data.decode("utf-16-le" if little else "utf-16-be", errors="replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def read_text(path: Path) -> str:
    """Read one netlist file.

    Parameters
    ----------
    path : Path
        Must be a regular file: a pipe or a device could keep the reader waiting for ever.

    Raises
    ------
    OSError
        With a sentence that says what is wrong with the file.
    """
    status = path.stat()
    if stat.S_ISDIR(status.st_mode):
        raise OSError(f"{path} is a folder")
    if not stat.S_ISREG(status.st_mode):
        raise OSError(f"{path} is not a regular file")
    if status.st_size > MAX_BYTES:
        raise OSError(f"{path} is larger than {MAX_BYTES // 1024**2} MB")
    return decode(path.read_bytes())

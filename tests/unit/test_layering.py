"""Imports point one way between the rooms of the package, as architecture.md states."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path
from typing import NamedTuple

import pytest

PACKAGE = Path(__file__).parents[2] / "nsspice"

#: open to all
OPEN = {"element_kinds", "errors", "lazy", "__version__"}

#: folder -> the folders that it may import
FOLDERS = {
    "problems": "",
    "solvers": "problems _core",
    "netlist": "",
    "devices": "netlist problems",
    "circuit": "netlist devices problems",
    "analyses": "netlist devices circuit problems solvers",
    "output": "netlist problems circuit analyses _core",
    "compare": "netlist devices circuit problems solvers analyses output",
    "screening": "netlist devices circuit problems solvers analyses output",
    "sweeps": "netlist devices circuit problems solvers analyses output",
    "pytest_plugin": "compare",
    "dvi": "netlist devices circuit problems solvers analyses _core",
    "cli": "netlist devices circuit problems solvers analyses output compare screening sweeps",
}

#: the rooms of a folder: each imports those before it.  A file beside the rooms is one by its own
#: name, or belongs to the base, "."
ROOMS = {
    "netlist": "findings text expressions deck alteration elements code_models expansion cards "
    "script parsing",
    "devices": ". heat diodes expressions passive sources switches mosfets transistors",
    "analyses": "signals results request certificate solution static averages transient steady "
    "gradients studies bounds",
    "dvi": "terms equations runs models",
}

#: file -> what it may import besides, where a name is looked up when a method is called: writers of
#: a solution, analyses of a circuit, the kind of element that a line turns out to be
HANDS_OVER = {
    "analyses/solution/exports.py": {"output"},
    "analyses/solution/solution.py": {"analyses.averages"},
    "circuit/circuit.py": {"analyses", "output"},
    "devices/diodes/diode.py": {"devices.switches"},
    "devices/expressions/stored.py": {"devices"},
}

#: file -> rooms after its own of which it only names a type
NAMES_A_TYPE = {
    "netlist/deck.py": {"netlist.parsing"},
    "analyses/solution/solution.py": {"analyses.averages"},
    "devices/device.py": {"devices.diodes"},
    "devices/stamper.py": {"devices.expressions"},
}

#: imported when they are needed, so that small runs start fast
LATE = {"scipy", "matplotlib", "rich", "pandas", "PySpice", "spicelib", "mpmath"}
LATE |= {"pyarrow", "h5py", "xarray", "IPython"}

FILES = sorted(p for p in PACKAGE.rglob("*.py") if "core" not in p.relative_to(PACKAGE).parts)


class Import(NamedTuple):
    """A module of the package that a file imports."""

    module: tuple[str, ...]
    line: int
    type_only: bool


def parts_of(path: Path) -> tuple[str, ...]:
    return path.relative_to(PACKAGE).with_suffix("").parts


def is_module(module: tuple[str, ...]) -> bool:
    path = PACKAGE.joinpath(*module)
    return path.is_dir() or path.with_suffix(".py").is_file()


def imports_of(path: Path) -> Iterator[Import]:
    """Yield what a file imports of the package, anywhere in it."""
    package = parts_of(path)[:-1]
    tree = ast.parse(path.read_text(encoding="utf-8"))
    guarded = [
        n for n in ast.walk(tree) if isinstance(n, ast.If) and "TYPE_CHECKING" in ast.dump(n.test)
    ]
    types = {id(inner) for n in guarded for inner in ast.walk(n)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            modules = [tuple(a.name.split(".")) for a in node.names]
            modules = [m[1:] for m in modules if m[0] == "nsspice"]
        elif isinstance(node, ast.ImportFrom):
            named = tuple((node.module or "").split(".")) if node.module else ()
            if node.level:
                home = (*package[: len(package) - node.level + 1], *named)
            elif named[0] == "nsspice":
                home = named[1:]
            else:
                continue
            names = [(*home, a.name) for a in node.names]
            modules = [name if is_module(name) else home for name in names]
        else:
            continue
        for module in modules:
            yield Import(module, node.lineno, id(node) in types)


def room_of(module: tuple[str, ...]) -> str:
    """Return the room of a module by its full name, the folder where it has no rooms."""
    rooms = ROOMS.get(module[0], "").split()
    if not rooms or len(module) == 1:
        return module[0]
    room = module[1] if module[1] in rooms else "."
    return f"{module[0]}.{room}"


def allowed_for(room: str) -> set[str]:
    """Return the rooms that a room may import."""
    folder, _, name = room.partition(".")
    allowed = {room, *OPEN, "()"}
    for other in FOLDERS[folder].split():
        allowed |= {other, *(f"{other}.{r}" for r in ROOMS.get(other, "").split())}
    if name:
        order = ROOMS[folder].split()
        allowed |= {f"{folder}.{r}" for r in order[: order.index(name)]}
    return allowed


#: every room with its files; what the `__init__` of a folder with rooms hands on is no import
INSIDE: dict[str, list[Path]] = {}
for one in FILES:
    if parts_of(one) not in {(folder, "__init__") for folder in ROOMS}:
        INSIDE.setdefault(room_of(parts_of(one)), []).append(one)


@pytest.mark.parametrize("room", sorted(set(INSIDE) - {*OPEN, "__init__", "__main__"}))
def test_imports_point_one_way(room: str) -> None:
    allowed = allowed_for(room)
    wrong = []
    for path in INSIDE[room]:
        name = path.relative_to(PACKAGE).as_posix()
        besides = HANDS_OVER.get(name, set())
        for found in imports_of(path):
            other = room_of(found.module) if found.module else "()"
            if found.type_only and other in NAMES_A_TYPE.get(name, set()):
                continue
            if other not in allowed | besides:
                wrong.append(f"{name}, line {found.line}: {'.'.join(found.module)}")
    assert not wrong, f"{room} may import {sorted(allowed)} only"


def test_every_exception_is_needed() -> None:
    for name, others in {**HANDS_OVER, **NAMES_A_TYPE}.items():
        found = {room_of(i.module) for i in imports_of(PACKAGE / name) if i.module}
        folders = {room.partition(".")[0] for room in found}
        assert others <= found | folders, name


def test_every_room_is_in_the_table() -> None:
    tops = {parts_of(p)[0] for p in FILES}
    assert tops <= {*FOLDERS, *OPEN, "__init__", "__main__"}
    for folder, rooms in ROOMS.items():
        folders = {p.name for p in (PACKAGE / folder).iterdir() if (p / "__init__.py").is_file()}
        assert folders <= set(rooms.split())


def test_every_folder_says_what_it_is_and_what_it_imports() -> None:
    """The first lines of a folder are its map: what happens here, and what it stands on."""
    homes = [p for p in FILES if p.name == "__init__.py" and p.parent != PACKAGE]
    maps = {p: ast.get_docstring(ast.parse(p.read_text("utf-8"))) or "" for p in homes}
    vague = [str(p) for p, text in maps.items() if not re.search(r"\bImports\s|each\s+uses", text)]
    assert not vague


def test_no_folder_is_crowded() -> None:
    """A stranger finds a file by reading the names of its folder; `circuit` has a few more."""
    counts: dict[Path, int] = {}
    for path in FILES:
        counts[path.parent] = counts.get(path.parent, 0) + 1
    assert {p.name: n for p, n in counts.items() if n > 31} == {}


def test_slow_libraries_are_imported_late() -> None:
    early = []
    for path in FILES:
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and not node.level:
                names = [node.module or ""]
            early += [f"{path.name}: {n}" for n in names if n.split(".")[0] in LATE]
    assert not early


def test_a_small_run_imports_only_what_it_uses() -> None:
    """An RC circuit needs no orbits, diodes, expressions, proofs or programs."""
    code = (
        "import sys, nsspice\n"
        "nsspice.run('RC\\nV1 a 0 1\\nR1 a b 1k\\nC1 b 0 1u\\n.tran 1u 1m\\n')\n"
        "print(*(m for m in sys.modules if m.startswith('nsspice.')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(done.stdout.split())
    rooms = ("analyses.steady.", "analyses.gradients.", "analyses.bounds.", "devices.diodes.")
    rooms += ("devices.expressions.", "problems.theorems.", "netlist.script.", "compare.")
    assert not {m for m in loaded if m.startswith(tuple(f"nsspice.{room}" for room in rooms))}
    assert len(loaded) < 210  # 191 of 560; each takes about a millisecond


def test_modules_of_the_core_import_one_way() -> None:
    core = PACKAGE / "core" / "src"
    imported: dict[str, set[str]] = {}
    for path in core.rglob("*.rs"):
        module = path.relative_to(core).with_suffix("").parts[0]
        code = re.sub("//.*", "", path.read_text("utf-8").split("#[cfg(test)]")[0])
        if path.stem not in ("tests", "examples") and "tests" not in path.parts:
            imported.setdefault(module, set()).update(re.findall(r"\bcrate::(\w+)", code))
    order = TopologicalSorter({m: others - {m} for m, others in imported.items()})
    assert "integrate" in order.static_order()  # raises CycleError with the circle


def test_no_file_is_too_long() -> None:
    sources = [*FILES, *(PACKAGE / "core" / "src").rglob("*.rs")]
    long = {p.name: n for p in sources if (n := len(p.read_text("utf-8").splitlines())) > 600}
    assert not long, "one idea per file: split it"

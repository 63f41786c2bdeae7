"""The folders of the package import only those that docs/development/architecture.md allows."""

from __future__ import annotations

import ast
import re
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "nsspice"

#: what each folder may import, besides itself; `errors`, `lazy` and the version are open to all
ALLOWED = {
    "errors": set(),
    "lazy": set(),
    "problems": set(),
    "solvers": {"problems", "_core"},
    "netlist": set(),
    "devices": {"netlist", "problems"},
    "circuit": {"netlist", "devices", "problems"},
    "analyses": {"netlist", "devices", "circuit", "problems", "solvers"},
    "output": {"netlist", "problems", "circuit", "analyses", "_core"},
    "compare": {"netlist", "devices", "circuit", "problems", "solvers", "analyses", "output"},
    "screening": {"netlist", "devices", "circuit", "problems", "solvers", "analyses", "output"},
    "pytest_plugin": {"compare"},
    "dvi": {"netlist", "devices", "circuit", "problems", "solvers", "analyses", "_core"},
    "cli": {"netlist", "devices", "circuit", "problems", "solvers", "analyses", "output"}
    | {"compare", "screening"},
}

#: the methods ``to_csv``, ``plot`` ... of a solution hand over to the writers when they are called,
#: ``run`` of a circuit to the analyses
HANDS_OVER = {
    "analyses/solution/exports.py": {"output"},
    "circuit/circuit.py": {"analyses", "output"},
}

#: imported when they are needed, so that small runs start fast
LATE = {"scipy", "matplotlib", "rich", "pandas", "PySpice", "spicelib", "mpmath"}
LATE |= {"pyarrow", "h5py", "xarray", "IPython"}

FILES = sorted(p for p in PACKAGE.rglob("*.py") if "core" not in p.relative_to(PACKAGE).parts)


def folder_of(path: Path) -> str:
    return path.relative_to(PACKAGE).with_suffix("").parts[0]


def imports_of(path: Path) -> list[tuple[str, int]]:
    """Return the folders of nsspice that a file imports from, anywhere in it, with line numbers."""
    package = ("nsspice", *path.relative_to(PACKAGE).parts[:-1])
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else ()
            module = ".".join((*base, node.module) if node.module else base)
            names = [module] if module != "nsspice" else [f"nsspice.{a.name}" for a in node.names]
        else:
            continue
        parts = (name.split(".") for name in names)
        found += [(p[1], node.lineno) for p in parts if p[0] == "nsspice" and len(p) > 1]
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.relative_to(PACKAGE).as_posix())
def test_imports_point_one_way(path: Path) -> None:
    folder = folder_of(path)
    if folder in ("__init__", "__main__"):  # they may import everything
        return
    allowed = ALLOWED[folder] | {folder, "errors", "lazy", "__version__"}
    allowed |= HANDS_OVER.get(path.relative_to(PACKAGE).as_posix(), set())
    wrong = [f"line {line}: {name}" for name, line in imports_of(path) if name not in allowed]
    assert not wrong, f"nsspice/{folder} may import {sorted(allowed)} only"


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.relative_to(PACKAGE).as_posix())
def test_slow_libraries_are_imported_late(path: Path) -> None:
    body = ast.parse(path.read_text(encoding="utf-8")).body
    at_start = [n for n in body if isinstance(n, ast.Import | ast.ImportFrom)]
    names = {a.name for n in at_start if isinstance(n, ast.Import) for a in n.names}
    names |= {n.module or "" for n in at_start if isinstance(n, ast.ImportFrom) and not n.level}
    assert not {name.split(".")[0] for name in names} & LATE


def test_every_folder_has_a_rule() -> None:
    assert {folder_of(p) for p in FILES} <= {*ALLOWED, "__init__", "__main__"}


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

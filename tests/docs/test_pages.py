"""The examples in the README and the documents run as they stand."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from nsspice.cli.app import app

ROOT = Path(__file__).parents[2]
#: the pages of equations have a test of their own
PAGES = [
    ROOT / "README.md",
    *sorted(p for p in (ROOT / "docs").rglob("*.md") if p.parent.name != "dvi"),
]
#: pages that exist in the built site only; `mkdocs build --strict` checks links to them
GENERATED = (
    "reference/devices.md",
    "reference/command-line.md",
    "gallery/*.md",
    "how-to/*.svg",
    "explanation/*.svg",
)
#: `tests/test_netlists.py` runs the whole collection; here a folder shows that the command works
PART = {"netlists": "netlists/basics", "converters": "converters/boost.net"}
#: a block of code: its language, the name of its file if it has a title, its text
BLOCK = re.compile(
    r'^```(python|console|spice|toml)(?: title="([^"]+)")?\n(.*?)^```',
    flags=re.MULTILINE | re.DOTALL,
)


class Page:
    """The blocks of one page, run in their order in one folder and one namespace."""

    def __init__(self, path: Path, folder: Path) -> None:
        self.path, self.folder = path, folder
        self.names: dict[str, object] = {"__name__": "__main__"}

    def run(self, kind: str, title: str, text: str, capsys: pytest.CaptureFixture[str]) -> None:
        if title:
            (self.folder / title).write_text(text, "utf-8")
        if kind == "python":
            self.python(text, capsys)
        elif kind == "console":
            for line in text.splitlines():
                if line.startswith("$ nsspice "):
                    self.command(line)
        elif kind == "spice":
            self.netlist(text)

    def python(self, text: str, capsys: pytest.CaptureFixture[str]) -> None:
        """A block runs; a line ``# prints: ...`` at its end tells what it prints."""
        capsys.readouterr()
        exec(compile(text, f"<{self.path.name}>", "exec"), self.names)
        expected = re.findall(r"^# prints: (.*)$", text, flags=re.MULTILINE)
        assert capsys.readouterr().out.splitlines() == expected, text

    def command(self, line: str) -> None:
        """A command exits with 0, or as its comment ``# exits with N`` says."""
        wanted = re.search(r"# exits with (\d+)", line)
        arguments = shlex.split(line.removeprefix("$ nsspice "), comments=True)
        if arguments[0] == "test":
            arguments = [PART.get(word, word) for word in arguments]
        # in this process: a process for each line would import everything again
        done = CliRunner().invoke(app, arguments)
        assert done.exit_code == int(wanted[1] if wanted else 0), f"{line}\n{done.output}"

    def netlist(self, text: str) -> None:
        """A deck of several lines simulates (single lines are examples of a card)."""
        import nsspice

        circuit = nsspice.read(text)
        if "* refused" not in text:
            assert circuit.run()


@pytest.mark.parametrize("path", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_what_a_page_shows_runs(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Python, commands and netlists of a page run in the order in which they stand."""
    (tmp_path / "netlists").symlink_to(ROOT / "netlists")
    monkeypatch.chdir(tmp_path)
    page = Page(path, tmp_path)
    for kind, title, text in BLOCK.findall(path.read_text("utf-8")):
        page.run(kind, title, text, capsys)


def test_the_readme_has_an_example_and_a_picture() -> None:
    readme = (ROOT / "README.md").read_text("utf-8")
    assert "```python" in readme
    for picture in re.findall(r"!\[[^]]*\]\(([^)]+)\)", readme):
        assert (ROOT / picture).stat().st_size < 200_000


def test_versions_agree() -> None:
    import nsspice

    version = nsspice.__version__
    core = ROOT / "nsspice" / "core"
    assert f'version = "{version}"' in (core / "Cargo.toml").read_text("utf-8")
    lock = (core / "Cargo.lock").read_text("utf-8")
    assert f'name = "nsspice-core"\nversion = "{version}"' in lock
    assert f"version: {version}\n" in (ROOT / "CITATION.cff").read_text("utf-8")
    assert f"({version})" in (ROOT / "CHANGELOG.md").read_text("utf-8").split("\n## ")[1]


def test_nothing_points_out_of_the_repository() -> None:
    pages = [*PAGES, ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", ROOT / "Makefile"]
    for page in pages:
        text = page.read_text("utf-8")
        assert not re.search(r"(?<![\w.])/(home|root|work|Users)/", text), page
        for target in re.findall(r"\]\((?!https?:|#)([^)#]+)", text):
            there = (page.parent / target).resolve()
            made = any(there.match(f"docs/{pattern}") for pattern in GENERATED)
            assert made or there.exists(), f"{page.name} links to {target}"
        for path in re.findall(r"`((?:docs|netlists|nsspice|tests|tools)/[^`\s]+)`", text):
            assert (ROOT / path).exists(), f"{page.name} names {path}"

"""The examples in the README and the documents run as they stand."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"^```(python|console|spice)\n(.*?)^```", flags=re.MULTILINE | re.DOTALL)


def blocks(language: str) -> list[object]:
    """Return the code blocks of a language, named by their page."""
    found = []
    for page in PAGES:
        texts = [t for kind, t in BLOCK.findall(page.read_text("utf-8")) if kind == language]
        found += [
            pytest.param(t, id=f"{page.relative_to(ROOT)}-{k}") for k, t in enumerate(texts, 1)
        ]
    return found


@pytest.mark.parametrize("text", blocks("python"))
def test_python_examples_run(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A block runs; a line ``# prints: ...`` at its end tells what it prints."""
    (tmp_path / "netlists").symlink_to(ROOT / "netlists")
    monkeypatch.chdir(tmp_path)
    exec(compile(text, "<example>", "exec"), {"__name__": "__main__"})
    expected = re.findall(r"^# prints: (.*)$", text, flags=re.MULTILINE)
    assert capsys.readouterr().out.splitlines() == expected


@pytest.mark.parametrize("text", blocks("console"))
def test_commands_run(text: str, tmp_path: Path) -> None:
    """Every ``$ nsspice ...`` line of a console block exits with 0 (make lines are CI's job)."""
    (tmp_path / "netlists").symlink_to(ROOT / "netlists")
    for line in text.splitlines():
        if line.startswith("$ nsspice "):
            arguments = line.partition("#")[0].split()[2:]
            done = subprocess.run(
                [sys.executable, "-m", "nsspice", *arguments],
                cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False,
            )  # fmt: skip
            assert done.returncode == 0, f"{line}\n{done.stderr}"


@pytest.mark.parametrize("text", blocks("spice"))
def test_netlists_run(text: str) -> None:
    import nsspice

    assert nsspice.read(text).run()


def test_the_readme_has_an_example_and_a_picture() -> None:
    readme = (ROOT / "README.md").read_text("utf-8")
    assert "```python" in readme
    for picture in re.findall(r"!\[[^]]*\]\(([^)]+)\)", readme):
        assert (ROOT / picture).stat().st_size < 200_000


def test_versions_agree() -> None:
    import nsspice

    manifest = (ROOT / "nsspice" / "core" / "Cargo.toml").read_text("utf-8")
    assert f'version = "{nsspice.__version__}"' in manifest


def test_nothing_points_out_of_the_repository() -> None:
    pages = [*PAGES, ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", ROOT / "Makefile"]
    for page in pages:
        text = page.read_text("utf-8")
        assert not re.search(r"(?<![\w.])/(home|root|work|Users)/", text), page
        for target in re.findall(r"\]\((?!https?:|#)([^)#]+)", text):
            assert (page.parent / target).exists(), f"{page.name} links to {target}"
        for path in re.findall(r"`((?:docs|netlists|nsspice|tests|tools)/[^`\s]+)`", text):
            assert (ROOT / path).exists(), f"{page.name} names {path}"

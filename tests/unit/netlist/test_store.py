"""Parsed shapes on disk: used when sound, harmless when not."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from nsspice.netlist.text import store

DECK = "t\nR1 a 0 {2*x}\n.param x=3 y=(1)"
RUN = f"from nsspice.netlist import parse_text; print(parse_text({DECK!r}).elements[0].value)"


def run(cache: str, more: str = "") -> str:
    environment = {**os.environ, "NSSPICE_CACHE": cache}
    environment["PYTHONPATH"] = str(Path(store.__file__).parents[2])
    done = subprocess.run(
        [sys.executable, "-c", RUN + more],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert not done.stderr
    return done.stdout.strip()


def test_without_with_and_with_a_damaged_store(tmp_path: Path) -> None:
    assert run("") == "6.0"
    assert run(str(tmp_path / "new")) == "6.0"
    files = sorted((tmp_path / "new").iterdir())
    assert [p.name for p in files] == ["expression.json", "grammar.json"]
    assert run(str(tmp_path / "new")) == "6.0"
    sound = files[0].read_text()
    for damage in ("", "{", "[]", "\x00", sound[: len(sound) // 2], '{"for": []}',
                   sound.replace('"programs":', '"program":')):  # fmt: skip
        for path in files:
            path.write_text(damage)
        assert run(str(tmp_path / "new")) == "6.0"


def test_lark_is_not_needed_for_known_shapes(tmp_path: Path) -> None:
    assert run(str(tmp_path)) == "6.0"
    assert run(str(tmp_path), "; import sys; print('lark' in sys.modules)") == "6.0\nFalse"


def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    assert run(str(tmp_path / "file")) == "6.0"


def test_shapes_of_another_grammar_are_left_alone(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("NSSPICE_CACHE", str(tmp_path))
    store.save("x", "a: B", {"programs": {}})
    assert store.load("x", "a: B") == {"for": [1, "a: B"], "programs": {}}
    assert store.load("x", "a: C") is None


def test_files_that_others_may_write_are_not_trusted(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("NSSPICE_CACHE", str(tmp_path))
    store.save("x", "a: B", {})
    (tmp_path / "x.json").chmod(0o666)
    trusted = store.load("x", "a: B") is not None
    assert trusted == (os.name == "nt")  # Windows keeps no such permissions

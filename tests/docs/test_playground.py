"""The page of the playground: what its worker runs, and the page in a browser.

No test uses a network: numpy for browsers comes from a server, so that the page is tested up to
the place where it is loaded, and what runs then by the installed program.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from browsing.pages import found_browser, used

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "playground"
BUILT = ROOT / "build" / "playground"
needs_build = pytest.mark.skipif(
    not (BUILT / "runtime.json").exists(),
    reason="the core for browsers has not been built here: make playground",
)

#: Python without the packages that the page does not load
WORKER = """
import json, sys
class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {"click", "rich", "matplotlib", "scipy"}:
            raise ModuleNotFoundError(name, name=name)
sys.meta_path.insert(0, Refuse())
names = {}
exec(open(sys.argv[1], encoding="utf-8").read(), names)
home = names["Path"](sys.argv[2])
names["nsspice"].__file__ = str(home / "__init__.py")
for name, text in json.loads(sys.argv[3]):
    print(names["run"](text, name))
"""


def answers(home: Path, *decks: tuple[str, str]) -> list[dict[str, str]]:
    """Return what the worker's Python answers; its files are in ``home``."""
    done = subprocess.run(
        [sys.executable, "-c", WORKER, str(PAGE / "run.py"), str(home), json.dumps(decks)],
        capture_output=True, text=True, check=True, cwd=ROOT,
    )  # fmt: skip
    return [json.loads(line) for line in done.stdout.splitlines()]


def test_the_worker_needs_numpy_and_the_parser_alone(tmp_path: Path) -> None:
    buck = (ROOT / "netlists" / "converters" / "buck.net").read_text("utf-8")
    # a step without solution: its proof is a linear program, for which scipy is loaded
    proof = "no solution\nV1 a 0 5\nD1 a 0\n.tran 1u 1m uic\n"
    wrong = "typing error\nR1 a 0 1x\nV1 a 0 1q\n.op\n.tram 1\n"
    page, missing, refused = answers(
        tmp_path, ("converters/buck", buck), ("deck", proof), ("deck", wrong)
    )
    assert '"state": "holds"' in page["page"]
    assert missing == {"missing": "scipy"}
    assert refused.keys() == {"messages"}
    assert "error NS" in refused["messages"]
    assert "tram" in refused["messages"]


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with the page as it is without a build of the core."""
    monkeypatch.setattr(sys, "path", [str(ROOT / "tools" / "site"), *sys.path])
    import playground

    folder = tmp_path / "site"
    shutil.copytree(PAGE, folder)
    decks = json.dumps(playground.decks(ROOT / "netlists"))
    (folder / "decks.json").write_text(decks, "utf-8")
    body = re.search(r"(?s)<div.*?</script>", (PAGE / "index.md").read_text("utf-8"))
    assert body
    (folder / "index.html").write_text(f'<!doctype html><meta charset="utf-8">{body[0]}', "utf-8")
    return folder


def test_every_deck_of_the_gallery_that_runs_can_be_chosen(site: Path) -> None:
    decks = json.loads((site / "decks.json").read_text("utf-8"))
    names = {deck["name"] for deck in decks}
    import gallery

    paths = [p for f in gallery.HEADINGS for p in (ROOT / "netlists" / f).glob("*.net")]
    for path in paths:
        refused = "[refused]" in path.with_suffix(".expect.toml").read_text("utf-8")
        assert (f"{path.parent.name}/{path.stem}" in names) is not refused, path


def test_a_site_without_the_core_says_so(site: Path, tmp_path: Path) -> None:
    script = "await until(status); await say(status());"
    said = used(found_browser(), site, "", script, tmp_path / "profile")
    assert "built without the compiled core: make playground" in said


def test_an_address_holds_a_deck(site: Path, tmp_path: Path) -> None:
    script = """
        import { addressOf, deckOf } from "./address.js";
        const decks = await (await fetch("decks.json")).json();
        const own = "own µ deck\\nR1 a 0 1\\n".repeat(40);
        const address = await addressOf(own, decks);
        const buck = decks.find(deck => deck.name === "converters/buck");
        await say({ address, text: (await deckOf(address, decks)).text === own,
          name: await addressOf(buck.text, decks),
          buck: (await deckOf("#deck=converters/buck", decks)).text === buck.text,
          cut: [await deckOf(address.slice(0, 20), decks), await deckOf("#deck=x", decks),
            await deckOf("", decks)] });
    """
    said = used(found_browser(), site, "", script, tmp_path / "profile")
    assert said["text"]
    assert said["buck"]
    assert said["name"] == "#deck=converters/buck"
    assert re.fullmatch(r"#text=[\w-]{20,100}", said["address"])
    assert said["cut"] == [None, None, None]


@needs_build
def test_the_page_loads_python_and_asks_for_numpy(site: Path, tmp_path: Path) -> None:
    """The editor has the deck of the address; a worker starts Python, and says what is missing."""
    shutil.copytree(BUILT, site, dirs_exist_ok=True)
    runtime = json.loads((site / "runtime.json").read_text("utf-8"))
    # a server without numpy, on this machine
    (site / "runtime.json").write_text(json.dumps({**runtime, "packages": "/none/"}), "utf-8")
    script = """
        await until(() => $(".cm-content"));
        const lines = document.querySelectorAll(".cm-line").length;
        $("#simulator button").click();
        const stages = [];
        await until(() => { const now = status(); if (now !== stages.at(-1)) stages.push(now);
          return now.includes("could not"); });
        await say({ lines, stages, coloured: !!$(".cm-line span"), address: location.hash,
          choice: $("select").value, button: $("#simulator button").textContent });
    """
    said = used(
        found_browser(), site, "#deck=basics/capacitor_sharing", script, tmp_path / "profile"
    )
    assert said["lines"] > 5
    assert said["coloured"]
    assert said["choice"] == "basics/capacitor_sharing"
    assert said["address"] == "#deck=basics/capacitor_sharing"
    assert [s for s in said["stages"] if s.startswith("Loading")] == [
        "Loading Python …",
        "Loading numpy from Pyodide's server …",
    ]
    assert said["stages"][-1].startswith("numpy could not be loaded.")
    assert said["button"] == "Run"


def test_a_machine_that_cannot_build_the_core_is_told_what_it_lacks(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(ROOT / "tools" / "playground" / "build.py")],
        capture_output=True, text=True, check=False, env={**os.environ, "PATH": str(tmp_path)},
    )  # fmt: skip
    assert done.returncode == 1
    assert "the playground cannot be built here" in done.stderr
    assert all(f"{name} is missing" in done.stderr for name in ("apt-get", "cargo", "npm"))

"""The report: opened in a browser, used by mouse, keyboard and address, and read."""

from __future__ import annotations

import base64
import html
import json
import math
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from browsing.pages import found_browser
from browsing.pages import used as page_used

import nsspice
from nsspice.output.report import waveforms, write_report
from nsspice.output.report.waveforms import thinned

NETLISTS = Path(__file__).parents[3] / "netlists"

# what a reader does, and what the page says then: a script in a copy of the page
READER = """<script>
const say = (name, value) => { const o = document.createElement("output"); o.className = "said";
  o.dataset.name = name; o.textContent = JSON.stringify(value); document.body.append(o); };
addEventListener("error", e => say("error", e.message));
const $ = (selector, from = document) => from.querySelector(selector);
const all = (selector, from = document) => [...from.querySelectorAll(selector)];
const type = (selector, text, event = "change") => { const i = $(selector); i.value = text;
  i.dispatchEvent(new Event(event, { bubbles: true })); };
const press = key => { $(".area").focus(); $(".area").dispatchEvent(
  new KeyboardEvent("keydown", { key, bubbles: true })); };
const mouse = (over, type, x, y, more = {}) => { const r = over.getBoundingClientRect();
  over.dispatchEvent(new MouseEvent(type, { clientX: r.left + x * r.width,
    clientY: r.top + y * r.height, button: 0, movementX: 1, bubbles: true, ...more })); };
const drag = (over, x0, y0, x1, y1) => { mouse(over, "mousemove", x0, y0);
  mouse(over, "mousedown", x0, y0); mouse(over, "mousemove", x1, y1);
  mouse(over, "mouseup", x1, y1); };
const click = (over, x, y) => { mouse(over, "mousemove", x, y); mouse(over, "mousedown", x, y);
  mouse(over, "mouseup", x, y); };
const cells = table => all("tr", table).map(r => all("th, td", r).map(c => c.textContent));
const drawn = () => JSON.parse($("output[hidden]").textContent);
addEventListener("load", () => { %s });
</script></body>"""


def opened(page: Path, window: str = "", *options: str) -> str:
    """Return what the page has become after its script has run."""
    done = subprocess.run(
        [found_browser(), "--headless", "--no-sandbox", "--disable-gpu",
         "--virtual-time-budget=5000", "--window-size=1200,900", *options,
         "--dump-dom", page.as_uri() + window],
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    return done.stdout


def used(page: Path, script: str) -> dict[str, object]:
    """Return what the page says while a reader uses it."""
    copy = page.with_suffix(".used.html")
    copy.write_text(page.read_text("utf-8").replace("</body>", READER % script), "utf-8")
    found = re.findall(r'<output class="said" data-name="(\w+)">(.*?)</output>', opened(copy))
    said = {name: json.loads(html.unescape(text)) for name, text in found}
    assert "error" not in said, said["error"]
    return said


def report(deck: str, path: Path, **options: object) -> Path:
    circuit = nsspice.read(deck)
    write_report(circuit, circuit.run(**options), path)
    return path


@pytest.fixture(scope="module")
def buck(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "buck.html"
    circuit = nsspice.read(NETLISTS / "converters" / "buck.net")
    write_report(circuit, circuit.run(), path)
    return path


def test_a_report_is_opened_zoomed_and_read(buck: Path) -> None:
    dom = opened(buck, "#4.9e-3,4.95e-3")
    assert "Certificate holds" in dom
    assert re.search(r'role="status"[^>]*>4.9 ms to 4.95 ms<', dom)
    (drawn,) = re.findall(r"<output hidden[^>]*>(.*?)</output>", dom)
    voltage, current = json.loads(drawn)
    # five periods of 10 us are seen, with one point more at each side
    assert voltage[0][0] == pytest.approx(4.9e-3, abs=1e-6)
    assert voltage[0][1] == pytest.approx(4.95e-3, abs=1e-6)
    # ripple of the current: (Vin - V) D T / L = 0.6 A at V = 12 V; the swing has nearly decayed
    assert current[1][1] - current[1][0] == pytest.approx(0.6, rel=0.15)
    # its axis follows what is seen: the peak of 13 A at the start does not press it flat
    assert current[-1][1] - current[-1][0] < 4.0
    assert "v_avg" in dom
    assert dom.count("<canvas") >= 4  # two panels, and a strip for the switch and for the diode


def test_a_report_stands_alone(buck: Path) -> None:
    text = buck.read_text("utf-8")
    assert not re.search(r"""(?:src|href)\s*=\s*["']?(?:https?:)?//""", text)
    data = text.partition('id="data"')[2].partition("</script>")[0]
    assert len(text) - len(data) < 500_000
    assert json.loads(data.partition(">")[2])["groups"][0]["runs"][0]["verdict"]["state"] == "holds"


def test_a_reader_zooms_by_mouse_and_keyboard(buck: Path) -> None:
    said = used(buck, """
        const over = all(".u-over");
        press("+"); say("plus", $("[role=status]").textContent);
        press("0"); say("zero", $("[role=status]").textContent);
        drag(over[0], 0.2, 0.5, 0.4, 0.5); say("along", $("[role=status]").textContent);
        press("0");
        drag(over[1], 0.3, 0.1, 0.3, 0.6); say("up", drawn()[1].at(-1));
        say("still", $("[role=status]").textContent);
        mouse(over[1], "dblclick", 0.5, 0.5); say("back", drawn()[1].at(-1));
        press("ArrowUp"); say("closer", drawn()[1].at(-1));
        type("[type=search]", "VIN", "input");
        say("found", all(".signals label").filter(l => !l.hidden).map(l => l.textContent.trim()));
        $('[data-name="i(vin)"] input').click(); say("panels", drawn().length);
        press("/"); say("focus", document.activeElement.type);
    """)  # fmt: skip
    assert said["plus"] == "1.25 ms to 3.75 ms"
    assert said["zero"] == said["still"] == "0 s to 5 ms"
    ends = re.findall(r"([\d.]+) (m|µ)s", str(said["along"]))
    low, high = (float(x) * {"m": 1.0, "µ": 1e-3}[letter] for x, letter in ends)
    assert (low, high) == pytest.approx((1.0, 2.0), abs=0.02)  # a pixel is 5 us
    whole = np.ptp(said["back"])
    assert np.ptp(said["up"]) == pytest.approx(0.5 * whole, rel=0.03)
    assert np.ptp(said["closer"]) == pytest.approx(0.7 * whole, rel=1e-9)
    assert said["found"] == ["i(vin)"]
    assert said["panels"] == 2  # a current of the same scale joins the panel of the inductor's
    assert said["focus"] == "search"


RAMP = "ramp\nV1 a 0 1\nL1 a 0 1 IC=0\n.tran 0.01 1 uic\n"


def test_cursors_know_differences_slopes_means_and_rms(tmp_path: Path) -> None:
    """The current is t: its mean and RMS from 0.2 to 0.6 are 0.4 and sqrt(0.208 / 1.2)."""
    page = report(RAMP, tmp_path / "ramp.html")
    said = used(page, """
        type("[aria-label='cursor A']", "200m"); type("[aria-label='cursor B']", "0.6");
        say("typed", cells($("[aria-live] table")));
        press("Escape"); say("gone", all("[aria-live] table").length);
        click($(".u-over"), 0.25, 0.5); click($(".u-over"), 0.75, 0.5);
        say("clicked", cells($("[aria-live] table"))); say("distance", $(".distance").textContent);
        press("]"); say("moved", $("[aria-label='cursor A']").value);
    """)  # fmt: skip
    head, *rows = said["typed"]  # type: ignore[misc]
    row = dict(zip(head, next(r for r in rows if r[0] == "i(l1)"), strict=True))
    assert (row["at A"], row["at B"], row["B − A"]) == ("200 mA", "600 mA", "400 mA")
    assert row["slope"] == "1 A/s"
    assert row["mean"] == "400 mA"
    assert row["RMS"] == f"{1e3 * math.sqrt(0.208 / 1.2):.5g} mA"
    assert said["gone"] == 0
    head, *rows = said["clicked"]  # type: ignore[misc]
    row = dict(zip(head, next(r for r in rows if r[0] == "i(l1)"), strict=True))
    assert float(row["mean"].split()[0]) == pytest.approx(500.0, abs=2.0)  # a pixel is 1 ms
    assert "1/|B − A| = " in str(said["distance"])
    assert float(str(said["moved"]).split()[0]) == pytest.approx(260.0, abs=2.0)


def test_averages_of_a_thinned_curve_are_those_of_all_its_points(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ten periods of sin: mean 0 and RMS 1/sqrt(2), however few extremes are left."""
    monkeypatch.setattr(waveforms, "POINTS", 300)
    deck = "sine\nV1 a 0 SIN(0 1 1k)\nR1 a 0 1\n.tran 1u 20m\n"
    said = used(report(deck, tmp_path / "sine.html"), """
        type("[aria-label='cursor A']", "5m"); type("[aria-label='cursor B']", "15m");
        say("read", cells($("[aria-live] table")));
        say("thin", document.body.textContent.includes("thinned"));
    """)  # fmt: skip
    assert said["thin"]
    head, *rows = said["read"]  # type: ignore[misc]
    row = dict(zip(head, rows[0], strict=True))
    assert row["RMS"].split()[1] == "mV"
    # a cell is 0.13 ms, of which the window may cut one at each end
    assert float(row["RMS"].split()[0]) == pytest.approx(1e3 / math.sqrt(2.0), rel=0.01)
    assert row["highest"] == "1 V"


def test_what_a_deck_says_cannot_become_part_of_the_page(tmp_path: Path) -> None:
    page = report("</script><b>x</b>\nV1 a 0 1\nR1 a 0 1\n.op\n", tmp_path / "x.html")
    assert "<b>x</b>" not in page.read_text("utf-8")
    dom = opened(page)
    assert "Operating point" in dom
    assert "&lt;b&gt;x" in dom


def test_steps_are_drawn_together_with_measures_over_the_parameter(tmp_path: Path) -> None:
    deck = (
        "steps\n.param r=1k\nV1 a 0 1\nR1 a b {r}\nC1 b 0 1u IC=0\n.step param r 1k 11k 1k\n"
        ".tran 0.1m 1m uic\n.measure tran v FIND v(b) AT=1m\n"
    )
    page = report(deck, tmp_path / "x.html")
    said = used(page, """
        say("runs", all(".legend .run").length); say("curves", drawn().map(p => p.length - 2));
        say("colours", new Set(all(".legend i").map(i => i.style.background)).size);
        say("table", cells(all("section > .scroll table").at(-1)));
        say("charts", all(".small canvas").length);
        type("[aria-label='filter runs']", "11", "input");
        say("one", drawn().map(p => p.length - 2));
        all(".legend .run")[1].click(); say("two", drawn().map(p => p.length - 2));
        say("details", $("select").value);
    """)  # fmt: skip
    assert said["runs"] == said["colours"] == 11
    assert set(said["curves"]) == {11}  # type: ignore[call-overload]
    assert (set(said["one"]), set(said["two"])) == ({1}, {2})  # type: ignore[call-overload]
    assert said["details"] == "1"
    assert said["charts"] == 1
    head, first, *_ = said["table"]  # type: ignore[misc]
    assert head == ["run", "v"]
    assert first == ["r = 1000", f"{1 - math.exp(-1.0):.7g}"]


def test_eleven_runs_of_a_converter_are_small(tmp_path: Path) -> None:
    deck = (NETLISTS / "converters" / "buck.net").read_text("utf-8")
    deck = deck.replace("Rload out 0 5", ".param rl=5\nRload out 0 {rl}\n.step param rl 2 12 1")
    assert report(deck, tmp_path / "x.html").stat().st_size < 1_500_000


LOOP = """Loop
Vr ref 0 AC 0
Vt fb y 0
E1 a 0 ref fb 20
R1 a b 1k
C1 b 0 1u
E2 c 0 b 0 1
R2 c d 1k
C2 d 0 1u
E3 e 0 d 0 1
R3 e y 1k
C3 y 0 1u
.op
.loop Vt dec 20 1 10k
"""


def test_margins_of_a_loop_are_drawn_and_listed(tmp_path: Path) -> None:
    """20 / (1 + s)^3: magnitude 1 at tan(phi) = sqrt(20^(2/3) - 1); phase -180 at tan = sqrt(3)."""
    said = used(report(LOOP, tmp_path / "loop.html"), """
        say("first", $("[aria-selected=true]").textContent);
        say("verdict", $(".verdict b").textContent);
        say("margins", cells(all("table").find(t => t.textContent.includes("phase margin"))));
        say("labels", all(".plot").map(p => p.getAttribute("aria-label")));
    """)  # fmt: skip
    assert said["first"] == "loop"
    assert said["verdict"] == "Response"
    assert said["labels"] == ["magnitude: t", "phase: t"]
    phase, gain = (row for row in said["margins"] if "margin, at" in row[0])  # type: ignore[attr-defined]
    expected = 180.0 - 3.0 * math.degrees(math.atan(math.sqrt(20.0 ** (2.0 / 3.0) - 1.0)))
    assert phase[2] == f"{expected:.4g}°".replace("-", "-")
    assert float(gain[2].split()[0]) == pytest.approx(20.0 * math.log10(8.0 / 20.0), abs=1e-3)
    assert float(gain[1].split()[0]) == pytest.approx(1e3 * math.sqrt(3.0) / (2 * math.pi), abs=0.1)


def test_curves_of_a_response_have_no_corners() -> None:
    """Fewer points than pixels are joined smoothly, through the points, without new extremes."""
    solution = nsspice.read(LOOP).run()[-1]
    found = waveforms.curves(solution, [])
    axis = np.frombuffer(base64.b64decode(found["axis"]), "<f8")
    gain = np.frombuffer(base64.b64decode(found["signals"][0]["values"]), "<f4")
    at = np.searchsorted(axis, solution.axis)
    name = found["signals"][0]["name"]
    decibels = 20.0 * np.log10(np.abs(np.asarray(solution[name])))
    assert gain[at] == pytest.approx(decibels, abs=1e-4)  # seven digits
    slopes = np.diff(gain.astype(float)) / np.diff(np.log(axis))
    own = np.diff(decibels) / np.diff(np.log(solution.axis))
    assert np.abs(np.diff(slopes)).max() < 0.3 * np.abs(np.diff(own)).max()


def test_spectra_losses_and_steady_states_have_their_pictures(tmp_path: Path) -> None:
    deck = "square\nV1 a 0 PULSE(-1 1 0 0 0 0.5m 1m)\nR1 a 0 1\nL1 a b 1m\nR2 b 0 1\n.pss\n"
    circuit = nsspice.read(deck + ".four v(a) harms=9\n")
    from nsspice.analyses.request.request import Request
    from nsspice.analyses.studies.batch import jobs_of, run_job

    request = Request(power=True, loads=("r2",), keep=True)
    runs = [run_job(circuit, job, request) for job in jobs_of(circuit.deck)]
    write_report(circuit, runs, tmp_path / "x.html")
    said = used(tmp_path / "x.html", """
        say("heads", all("h2").map(h => h.textContent)); say("stems", all(".stem").length);
        say("lines", cells(all("table").find(t => t.textContent.includes("amplitude"))));
        say("losses", cells(all("table").find(t => t.textContent.includes("average power"))));
    """)  # fmt: skip
    assert {"Harmonics of v(a)", "Losses", "Periodic steady state"} <= set(said["heads"])  # type: ignore[call-overload]
    # a square wave: 4 / (pi k) for odd orders, the largest first, and nothing at even ones
    assert said["stems"] == 5
    _, *lines = said["lines"]  # type: ignore[misc]
    assert [line[0] for line in lines] == ["1", "3", "5", "7", "9"]
    assert lines[0][2] == f"{4.0 / math.pi:.6g} V"
    assert "efficiency" in (tmp_path / "x.html").read_text("utf-8")
    assert {"v1", "r1", "r2"} <= {row[0] for row in said["losses"]}  # type: ignore[attr-defined]


def test_noise_and_a_sweep_in_a_sweep_have_their_curves(tmp_path: Path) -> None:
    deck = "noise\nV1 a 0 AC 1\nR1 a b 1k\nC1 b 0 1n\n.noise v(b) V1 dec 10 10 10meg\n"
    said = used(report(deck, tmp_path / "n.html"), 'say("drawn", drawn());')
    ((_, onoise, *_),) = said["drawn"]  # type: ignore[misc]
    # 4 k T R at 27 C
    assert onoise[1] == pytest.approx(math.sqrt(4 * 1.380649e-23 * 300.15 * 1e3), rel=1e-3)
    deck = "nested\nV1 a 0 0\nV2 b 0 0\nR1 a b 1\n.dc V1 0 5 1 V2 0 4 2\n"
    said = used(report(deck, tmp_path / "d.html"), """
        say("runs", all(".legend .run").map(b => b.textContent));
        say("drawn", drawn().map(p => p.length - 2));
    """)  # fmt: skip
    assert said["runs"] == ["v2 = 0", "v2 = 2", "v2 = 4"]
    assert set(said["drawn"]) == {3}  # type: ignore[call-overload]


def test_operating_points_of_a_step_are_curves_over_the_parameter(tmp_path: Path) -> None:
    deck = "divider\n.param r=1\nV1 a 0 10\nR1 a b 1k\nR2 b 0 {r}\n.op\n.step r 100 10k 3300\n"
    said = used(report(deck, tmp_path / "x.html"), """
        type("[aria-label='cursor A']", "6.7k"); say("read", cells($("[aria-live] table")));
        say("head", $("h2").textContent); say("pick", all("select option").length);
    """)  # fmt: skip
    assert said["head"] == "Over r"
    assert said["pick"] == 4
    assert ["v(b)", f"{10.0 * 6.7 / 7.7:.6g} V"] in said["read"]  # type: ignore[operator]


def test_a_report_is_dark_on_dark_systems_and_light_on_paper(tmp_path: Path, buck: Path) -> None:
    dark = buck.read_text("utf-8").replace(
        "<head>",
        "<head><script>matchMedia = q => ({ matches: q.includes('dark'), addEventListener() {} });"
        "</script>",
    )
    (tmp_path / "dark.html").write_text(dark, "utf-8")
    said = used(tmp_path / "dark.html", """
        const colours = () => all(".u-marker").map(m => m.style.borderColor || m.style.border);
        say("screen", colours().join()); dispatchEvent(new Event("beforeprint"));
        say("paper", colours().join()); dispatchEvent(new Event("afterprint"));
        say("again", colours().join());
        say("wide", document.documentElement.scrollWidth <= innerWidth);
        const place = e => { const r = e.getBoundingClientRect(); return [r.left, r.right]; };
        say("curves", place($(".u-over"))); say("strips", all(".strip canvas").map(place));
    """)  # fmt: skip
    assert said["screen"] == said["again"] != said["paper"]
    assert said["wide"]
    # who conducts is shown below the instants of the curves, within a strip's border
    assert len(said["strips"]) == 2
    for strip in said["strips"]:
        assert strip == pytest.approx(said["curves"], abs=1.01)


PHONE = """<body style="margin:0">
<iframe src="%s" style="border:0;width:390px;height:800px"></iframe>
"""


@pytest.mark.parametrize("deck", ["buck", "loop", "steps"])
def test_a_report_fits_a_phone(deck: str, tmp_path: Path, buck: Path) -> None:
    """390 pixels, in a frame, since windows of Chromium are wider: tables scroll in themselves."""
    folder = tmp_path / "phone"
    folder.mkdir()
    if deck == "buck":
        shutil.copy(buck, folder / "x.html")
    elif deck == "loop":
        report(LOOP, folder / "x.html")
    else:
        text = (NETLISTS / "converters" / "buck.net").read_text("utf-8")
        text = text.replace("Rload out 0 5", ".param rl=5\nRload out 0 {rl}\n.step param rl 2 12 1")
        report(text, folder / "x.html")
    (folder / "index.html").write_text(PHONE % "x.html", "utf-8")
    script = """
        const inside = () => $("iframe").contentDocument;
        await until(() => inside()?.querySelector("[role=tab], .verdict"));
        const pen = $("iframe").contentWindow.CanvasRenderingContext2D.prototype;
        const draw = pen.fillText;
        const labels = [], cut = [];
        pen.fillText = function (text, x, y) {
          if (text.includes("margin ")) {
            labels.push(text);
            if (x < 0 || x + this.measureText(text).width > this.canvas.width) cut.push(text);
          }
          draw.call(this, text, x, y);
        };
        [...inside().querySelectorAll("[role=tab]")].at(-1)?.click();
        await until(() => inside().querySelector(".verdict") && inside().readyState == "complete");
        await say({ width: inside().documentElement.scrollWidth,
          plots: inside().querySelectorAll("canvas").length, labels, cut,
          lefts: [".u-over", ".strip canvas"].map(s => inside().querySelector(s)
            ?.getBoundingClientRect().left) });
    """
    said = page_used(found_browser(), folder, "", script, tmp_path / "profile")
    assert 300 < said["width"] <= 390
    assert said["plots"] >= 2
    assert said["cut"] == []
    if deck == "buck":
        curves, strip = said["lefts"]
        assert strip == pytest.approx(curves, abs=1.01)
    assert (len(said["labels"]) >= 2) is (deck == "loop")


def test_thinning_keeps_every_extreme_and_the_averages() -> None:
    rng = np.random.default_rng(1)
    y = rng.standard_normal((3, 100_003))
    x = np.arange(100_003.0)
    u, v, averages = thinned(x, y, 4000)
    assert u.size <= 4000
    assert np.all(np.diff(u) >= 0)
    assert np.array_equal(v.max(axis=1), y.max(axis=1))
    assert np.array_equal(v.min(axis=1), y.min(axis=1))
    size = -(-2 * 100_003 // 4000)
    for k in (0, 7, u.size // 2 - 1):  # extremes of each cell
        cell = y[:, k * size : (k + 1) * size]
        assert np.array_equal(v[:, 2 * k : 2 * k + 2].max(axis=1), cell.max(axis=1))
    assert averages is not None
    # the integral of the lines between the points; sums of 1e5 terms round to 1e5 u at most
    widths = np.append(np.diff(u[::2]), u[-1] - u[-2])
    assert averages[0] @ widths == pytest.approx(np.trapezoid(y, x, axis=1), abs=1e-8)

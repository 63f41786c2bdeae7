"""Does the certificate see faults of the engines?  The mutation suite of the certificate.

    python tools/mutations.py                   # builds the damaged core, runs all, prints a table
    python tools/mutations.py --classes jumps rows --stride 4 --store jumps.jsonl
    python tools/mutations.py --report --store mutations.jsonl

The core is compiled with the feature ``faults`` into a folder of its own.  Every deck runs by every
method without a fault, then with each fault of ``nsspice/core/src/faults/list.rs``, which was
written before any result was seen.  A damaged run is *wrong* if a value of a row differs from that
of the sound run of the same method by more than a share of the range of its signal; it is
*refused* if its certificate fails.  Runs that end in an error are told apart, and count on neither
side.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import warnings
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from queue import Empty, Queue
from threading import Thread
from typing import Any

ROOT = Path(__file__).parents[1]
#: seconds without an answer after which a run is given up
PATIENCE = 120.0
METHODS = ("modewise", "sdirk", "moreau")
#: shares of a range from which a run counts as wrong, and what the suite aims at
AIMS = {1e-4: 0.99, 1e-6: 0.97}
#: decks of the collection
COLLECTION = [
    "basics/capacitor_jump",
    "basics/capacitor_sharing",
    "basics/coupled_inductors",
    "basics/inductor_cut",
    "basics/inductor_freewheel",
    "basics/perfect_transformer",
    "basics/relaxation_oscillator",
    "basics/rlc_step",
    "basics/source_waveforms",
    "basics/switch_sequence",
    "converters/boost",
    "converters/buck_boost",
    "converters/charge_pump",
    "converters/flyback",
    "converters/lc_bridge_charger",
    "converters/npc_leg",
    "rectifiers/clamp",
    "rectifiers/full_bridge_capacitor",
    "rectifiers/half_wave_capacitor",
    "rectifiers/half_wave_inductive",
    "rectifiers/limiter",
    "rectifiers/three_phase_bridge",
    "rectifiers/thyristor_bridge",
    "rectifiers/thyristor_half_wave",
    "rectifiers/voltage_doubler",
    "rectifiers/zener_regulator",
    "smooth/half_wave_capacitor",
    "smooth/buck",
    "pathological/jump_capacitor_ring",
    "pathological/jump_charge_through_diode_chain",
    "pathological/jump_switch_cuts_inductor",
    "pathological/jump_flyback_leakage_is_lost",
    "pathological/jump_capacitors_through_transformer",
    "thesis/ex423_zener_rlc",
]
#: seeds of random converters, and of decks with hysteresis, jumps and Zener diodes
CONVERTERS = range(31_000, 31_014)
EVENTS = range(31_000, 31_004)
JUMPS = (31_000, *range(31_002, 31_008))


def decks() -> Iterator[tuple[str, str]]:
    """Return the names and texts of all decks, thyristors and hysteresis included."""
    sys.path.insert(0, str(ROOT / "tests"))
    from random import Random

    from decks import random_events
    from decks.fired_at_rest import FIRED_AT_REST
    from decks.random_circuits import generate
    from decks.random_converters import converter

    for name in COLLECTION:
        yield name, (ROOT / "netlists" / f"{name}.net").read_text()
    yield "fired at rest", FIRED_AT_REST
    for seed in CONVERTERS:
        yield f"converter {seed}", converter(seed)
    for seed in EVENTS:
        yield f"gated load {seed}", random_events.gated_load(Random(seed))
        yield f"zener chain {seed}", random_events.zener_chain(Random(seed))
    for seed in JUMPS:
        yield f"impulsive {seed}", generate("impulsive", seed).text


# ------------------------------------------------------------------ the damaged core


def build() -> Path:
    """Compile the damaged core; return a folder with a package that has it."""
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target-faults"))
    manifest = ROOT / "nsspice" / "core" / "Cargo.toml"
    command = ["cargo", "build", "--release", "--locked", "--manifest-path", str(manifest)]
    command += ["--features", "extension-module faults", "--target-dir", str(target)]
    subprocess.run(command, check=True)
    package = target / "package" / "nsspice"
    shutil.rmtree(package.parent, ignore_errors=True)
    package.mkdir(parents=True)
    for item in (ROOT / "nsspice").iterdir():
        if item.suffix not in (".so", ".pyd"):
            (package / item.name).symlink_to(item)
    built = next(p for p in (target / "release").glob("*_core.*") if p.suffix in (".so", ".dylib"))
    shutil.copy(built, package / "_core.abi3.so")
    return package.parent


# ------------------------------------------------------------------ a process: all faults of a deck


def work(deck: str, text: str, method: str, classes: list[str], done: list[str]) -> None:
    """Print what each fault makes of a deck, one line of JSON each."""
    warnings.simplefilter("ignore")
    from nsspice import _core

    core: Any = _core
    sound = run(text, method)
    if "values" not in sound:
        return tell(deck, method, "", "sound", sound)
    if "" not in done:
        tell(deck, method, "", "sound", {k: v for k, v in sound.items() if k != "values"})
    for name, kind, methods, _ in core.faults():
        if (
            name in done
            or (classes and kind not in classes)
            or not (methods == "all" or method in methods)
        ):
            continue
        print(json.dumps({"begins": name}), flush=True)
        core.choose_fault(name)
        damaged = run(text, method)
        core.choose_fault(None)
        found = {k: v for k, v in damaged.items() if k != "values"}
        if "values" in damaged:
            found["error"] = difference(sound, damaged)
        tell(deck, method, name, kind, found)


def tell(deck: str, method: str, fault: str, kind: str, found: dict[str, Any]) -> None:
    """Print one result."""
    line = {"deck": deck, "method": method, "fault": fault, "class": kind, **found}
    print(json.dumps(line), flush=True)


def run(text: str, method: str) -> dict[str, Any]:
    """Return the rows of a run and whether its certificate refuses them, or its error."""
    import nsspice

    try:
        solution = nsspice.tran(nsspice.read(text), method=method, on_failure="ignore")
    except nsspice.NsspiceError as error:
        return {"failed": error.code}
    except Exception as error:
        return {"failed": f"{type(error).__name__}: {error}"[:200]}
    names = ["time", *solution.columns]
    certificate = solution.certificate
    assert certificate is not None
    shown = {k: v for k, v in certificate.to_dict().items() if isinstance(v, float | bool)}
    shown["undetermined"] = certificate.undetermined
    shown["drift"] = certificate.energy.drift if certificate.energy else 0.0
    values = {name: solution[name] for name in solution.columns}
    values["time"] = solution.axis
    refused = not certificate.passed
    return {"refused": refused, "worst": certificate.worst, "shown": shown, "values": values,
            "columns": len(names)}  # fmt: skip


def difference(one: dict[str, Any], other: dict[str, Any]) -> float:
    """Return the largest difference of a value as a share of the range of its signal.

    Signals that stay below 1e-6 of the largest of their kind are the rounding of others, and so are
    currents (voltages) of 1e-15 of the largest number of the table, where all are zero.  Where
    the laws leave potentials open (a bridge that floats while it blocks) every choice is right:
    only currents are compared.
    """
    import numpy as np

    sound, damaged = one["values"], other["values"]
    worst = 0.0
    largest = max(float(np.max(np.abs(sound[name]), initial=0.0)) for name in sound)
    for letter in "it" if one["shown"]["undetermined"] else "vit":
        names = [name for name in sound if name[0] == letter]
        sizes = {name: float(np.max(np.abs(sound[name]), initial=0.0)) for name in names}
        floor = max(1e-6 * max(sizes.values(), default=0.0), 1e-15 * largest)
        for name in names:
            a, b = np.asarray(sound[name]), np.asarray(damaged[name])
            if a.shape != b.shape:
                return float("inf")
            extent = max(float(np.ptp(a)), floor, 1e-12 * sizes[name])
            if extent > 0.0:
                off = np.abs(a - b)
                worst = max(
                    worst, float(np.max(off)) / extent if np.isfinite(off).all() else np.inf
                )
    return worst


# ------------------------------------------------------------------ the parent


def measure(args: argparse.Namespace) -> None:
    """Run what the store does not have yet."""
    package = build() if args.package is None else args.package
    environment = {**os.environ, "PYTHONPATH": str(package), "OMP_NUM_THREADS": "1"}
    chosen = list(decks())[:: args.stride]
    for name, text in chosen:
        for method in args.methods:
            done = {
                r["fault"] for r in rows(args.store) if (r["deck"], r["method"]) == (name, method)
            }
            while True:
                job = json.dumps([name, text, method, args.classes, sorted(done)])
                stuck = child(job, environment, args.store)
                if stuck is None:
                    break
                done |= {stuck}
                write(args.store, {"deck": name, "method": method, "fault": stuck, "class": "",
                                   "failed": "no end"})  # fmt: skip
                done |= faults_done(args.store, name, method)


def faults_done(store: Path, deck: str, method: str) -> set[str]:
    """Return the faults that the store has of a deck and a method."""
    return {r["fault"] for r in rows(store) if (r["deck"], r["method"]) == (deck, method)}


def child(job: str, environment: dict[str, str], store: Path) -> str | None:
    """Let a process work; return the fault at which it came to no end, if so."""
    process = subprocess.Popen(
        [sys.executable, __file__, "--work"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
        cwd=Path(environment["PYTHONPATH"]),
    )
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write(job)
    process.stdin.close()
    lines: Queue[str | None] = Queue()
    out = process.stdout

    def read() -> None:
        for line in out:
            lines.put(line)
        lines.put(None)

    Thread(target=read, daemon=True).start()
    present = ""
    while True:
        try:
            line = lines.get(timeout=PATIENCE)
        except Empty:
            process.kill()
            return present
        if line is None:
            return present if process.wait() else None
        found = json.loads(line)
        if "begins" in found:
            present = found["begins"]
        else:
            write(store, found)


def rows(store: Path) -> list[dict[str, Any]]:
    """Return what the store has."""
    return [json.loads(line) for line in store.read_text().splitlines()] if store.exists() else []


def write(store: Path, row: dict[str, Any]) -> None:
    """Add to the store."""
    with store.open("a") as out:
        out.write(json.dumps(row) + "\n")


def report(found: list[dict[str, Any]], worst: int) -> int:
    """Print the table by class; return 1 if an aim is missed."""
    sound = [r for r in found if r["fault"] == "" and "failed" not in r]
    refused = [r for r in sound if r["refused"]]
    ended = [r for r in found if r["fault"] and "failed" in r]
    judged = [r for r in found if r["fault"] and "error" in r]
    print(f"{len(sound)} runs without a fault, {len(refused)} refused; {len(judged)} with one, "
          f"and {len(ended)} that ended in an error")  # fmt: skip
    heads = "".join(f"| wrong by {level:g} | refused | share " for level in AIMS)
    print(f"| class {heads}|\n|---{'|--:|--:|--:' * len(AIMS)}|")
    kinds: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for r in judged:
        kinds[r["class"]].append(r)
    missed = bool(refused)
    for kind, runs in [*kinds.items(), ("all", judged)]:
        cells = [kind]
        for level, aim in AIMS.items():
            wrong = [r for r in runs if not r["error"] <= level]
            seen = sum(r["refused"] for r in wrong)
            share = seen / len(wrong) if wrong else 1.0
            cells += [str(len(wrong)), str(seen), f"{share:.3f}"]
            missed |= kind == "all" and share < aim
        print("| " + " | ".join(cells) + " |")
    unseen = [r for r in judged if not r["refused"] and not r["error"] <= min(AIMS)]
    for r in sorted(unseen, key=lambda r: -r["error"])[:worst]:
        print(f"passed: {r['class']}, {r['fault']}, {r['method']}, {r['deck']}: {r['error']:.2g}")
    for r in refused:
        print(f"refused though sound: {r['method']}, {r['deck']}: {r['worst']} {r['shown']}")
    return int(missed)


def main() -> int:
    """Do what the command line asks for."""
    if sys.argv[1:] == ["--work"]:
        work(*json.loads(sys.stdin.read()))
        return 0
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--store", type=Path, default=Path("mutations.jsonl"))
    parser.add_argument("--classes", nargs="*", default=[], help="classes of faults; all")
    parser.add_argument("--methods", nargs="*", default=list(METHODS), choices=METHODS)
    parser.add_argument("--stride", type=int, default=1, help="every so manieth deck")
    parser.add_argument("--package", type=Path, help="folder of a package with a damaged core")
    parser.add_argument("--report", action="store_true", help="print the table of the store alone")
    parser.add_argument("--worst", type=int, default=20, help="runs to name that pass wrongly")
    args = parser.parse_args()
    if not args.report:
        measure(args)
    return report(rows(args.store), args.worst)


if __name__ == "__main__":
    sys.exit(main())

"""Siconos on one complementarity system from the input; prints a line of JSON per run.

Run by the Python that has it (Debian: python3-siconos): ``python3 siconos_runs.py < system.json``.
"""

from __future__ import annotations

import json
import math
import sys
import time
from typing import Any

import numpy as np
import siconos.kernel as sk

MOST_POINTS = 20_000
PER_STEP = 20e-6  # [s] what a step takes at least


def march(job: dict[str, Any], h: float, theta: float) -> dict[str, Any]:
    """March with steps of h; return times, signals and the time it took."""
    A, B, C, D, F, G = (np.array(job[k], dtype=float) for k in "ABCDFG")
    offset = np.array([u["dc"] for u in job["inputs"]])
    height = np.array([u["amplitude"] for u in job["inputs"]])
    omega = 2.0 * np.pi * np.array([u["frequency"] for u in job["inputs"]])
    phase = np.array([u["phase"] for u in job["inputs"]])

    def sources(t: float) -> Any:
        return np.append(offset + height * np.sin(omega * t + phase), 1.0)

    ds = sk.FirstOrderLinearDS(np.array(job["x0"], dtype=float), A)
    ds.setbPtr(F @ sources(0.0))
    relation = sk.FirstOrderLinearTIR(C, B)
    relation.setDPtr(D)
    relation.setePtr(G @ sources(0.0))
    model = sk.NonSmoothDynamicalSystem(0.0, job["stop"])
    model.insertDynamicalSystem(ds)
    model.link(sk.Interaction(sk.ComplementarityConditionNSL(len(C)), relation), ds)
    stepping = sk.TimeStepping(
        model, sk.TimeDiscretisation(0.0, h), sk.EulerMoreauOSI(theta), sk.LCP()
    )
    count = round(job["stop"] / h)
    thin = max(1, math.ceil(count / MOST_POINTS))
    t, x = [0.0], [np.array(job["x0"], dtype=float)]
    constant = not height.any()
    e, b = relation.e(), ds.b()
    begin = time.perf_counter()
    for k in range(1, count + 1):
        if not constant:
            u = sources(k * h)
            e[:] = G @ u
            # the rates of a step are those of its begin and its end, weighted by theta
            b[:] = F @ u if theta == 1.0 else F @ (theta * u + (1.0 - theta) * sources(k * h - h))
        stepping.computeOneStep()
        stepping.nextStep()
        if k % thin == 0:
            t.append(k * h)
            x.append(ds.x().copy())
    spent = time.perf_counter() - begin
    table = np.array(x) @ np.array(job["outputs"]).T
    if not np.isfinite(table).all():
        raise ArithmeticError("not finite")
    values = {name: table[:, j].tolist() for j, name in enumerate(job["signals"])}
    return {"seconds": spent, "steps": count, "t": t, "values": values}


def main() -> None:
    """Run two ladders of steps; each ends before a run that would take longer than the limit."""
    job = json.load(sys.stdin)
    for name, theta in (("siconos", 1.0), ("siconos-half", 0.5)):
        per_step = PER_STEP
        for k in range(12):
            h = job["row"] / 4**k
            if per_step * job["stop"] / h > job["limit"]:
                break
            line: dict[str, Any] = {"method": name, "parameter": "h", "value": h}
            try:
                line |= march(job, h, theta)
                per_step = line["seconds"] / line["steps"]
            except Exception as error:  # what a peer refuses is part of the result
                line["note"] = f"fails: {str(error).strip().splitlines()[0][:120]}"
            print("\n" + json.dumps(line), flush=True)
            if "note" in line:
                break


if __name__ == "__main__":
    main()

"""Large circuits as netlist text, of any size: rectifier bridges apart or on a grid, meshes."""

from __future__ import annotations

MODEL = ".model did D(ideal)"


def bridge(k: int, a: str, b: str) -> list[str]:
    """Return rectifier k between the nodes a and b, with a capacitor and a load across it."""
    return [
        f"DA{k} {a} p{k} did",
        f"DB{k} m{k} {a} did",
        f"DC{k} {b} p{k} did",
        f"DD{k} m{k} {b} did",
        f"C{k} p{k} m{k} 100u IC=0",
        f"R{k} p{k} m{k} 100",
    ]


def separate_bridges(count: int) -> str:
    """Return ``count`` equal rectifiers that share nothing but ground: as many islands."""
    lines = [f"* {count} separate bridges"]
    for k in range(count):
        lines += [f"V{k} s{k} 0 SIN(0 10 50)", f"RS{k} s{k} a{k} 0.5", *bridge(k, f"a{k}", "0")]
    return "\n".join([*lines, MODEL, ".end", ""])


def bridges_on_a_grid(side: int) -> str:
    """Return ``side`` x ``side`` rectifiers on the nodes of a resistive grid with one source."""
    lines = [f"* {side * side} bridges on a grid", "V1 s 0 SIN(0 10 50)", "RS s g0_0 0.01"]
    for i in range(side):
        for j in range(side):
            node = f"g{i}_{j}"
            if j + 1 < side:
                lines.append(f"RX{i}_{j} {node} g{i}_{j + 1} 0.01")
            if i + 1 < side:
                lines.append(f"RY{i}_{j} {node} g{i + 1}_{j} 0.01")
            lines += bridge(side * i + j, node, "0")
    return "\n".join([*lines, MODEL, ".end", ""])


def mesh(side: int) -> str:
    """Return a square mesh: diodes along rows, R down columns, C from each node to ground."""
    lines = [f"* mesh of {side} x {side}", "V1 s 0 SIN(0 10 1k)"]
    for i in range(side):
        lines.append(f"RS{i} s n{i}_0 10")
        for j in range(side):
            node = f"n{i}_{j}"
            lines.append(f"C{i}_{j} {node} 0 1n IC=0")
            if j + 1 < side:
                lines.append(f"D{i}_{j} {node} n{i}_{j + 1} did")
            if i + 1 < side:
                lines.append(f"R{i}_{j} {node} n{i + 1}_{j} 100")
    return "\n".join([*lines, MODEL, ".end", ""])

"""The waveforms of V and I sources: the order of their arguments, and how many there may be."""

from __future__ import annotations

#: waveform -> names of its arguments in order, how many are required; pwl takes pairs instead
ARGUMENTS: dict[str, tuple[tuple[str, ...], int]] = {
    "sin": (("offset", "amplitude", "frequency", "delay", "damping", "phase", "cycles"), 2),
    "pulse": (("v1", "v2", "td", "tr", "tf", "pw", "per", "np"), 2),
    "exp": (("v1", "v2", "td1", "tau1", "td2", "tau2"), 2),
    "sffm": (("offset", "amplitude", "fc", "mdi", "fs", "phasec", "phases"), 2),
    "trnoise": (("na", "nt", "nalpha", "namp", "rtsam", "rtscapt", "rtsemt"), 2),
    "trrandom": (("type", "ts", "td", "param1", "param2"), 2),
    "am": (("amplitude", "offset", "mf", "fc", "td", "phasec", "phases"), 2),
}
KINDS = (*ARGUMENTS, "pwl")


def form(kind: str) -> str:
    """Return how a waveform is written.

    Examples
    --------
    >>> form("sin")
    'sin(offset amplitude frequency delay damping phase cycles)'
    """
    return f"{kind}({' '.join(ARGUMENTS[kind][0])})"


def count_problem(kind: str, count: int) -> tuple[str, str]:
    """Return what is wrong with a number of arguments and what to do, or two empty texts.

    Examples
    --------
    >>> count_problem("exp", 1)
    ('exp takes 2 to 6 arguments, not 1', 'write exp(v1 v2 td1 tau1 td2 tau2)')
    >>> count_problem("exp", 6)
    ('', '')
    """
    if kind == "pwl":
        if count >= 2 and count % 2 == 0:
            return "", ""
        hint = "write PWL(t1 v1 t2 v2 ...), followed by r=0 to repeat all of it"
        return f"pwl needs pairs of time and value, {count} numbers given", hint
    names, least = ARGUMENTS[kind]
    if least <= count <= len(names):
        return "", ""
    hint = f"write {form(kind)}"
    if kind == "am" and count == 8:  # its order in newer versions of ngspice
        hint = "am(vo vmo vma fm fc td 0 0) without vo is am(vma {vmo/vma} fm fc td)"
    return f"{kind} takes {least} to {len(names)} arguments, not {count}", hint

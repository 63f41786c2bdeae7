"""Examples that the help pages end with."""

from __future__ import annotations

_EXAMPLES = {
    "run": (
        ("nsspice run buck.net --plot", "waveforms in buck.csv, picture in buck.png"),
        ('nsspice run buck.net --signals "v(out) i(l1)" -o out.csv', "two signals"),
        ("nsspice run buck.net --param rload=200 --report", "another load, a page to explore"),
        ("nsspice run buck.net --load rload", "losses and efficiency"),
    ),
    "explain": (("nsspice explain buck.net", "which method, which effects, what it costs"),),
    "effects": (("nsspice effects buck.net --tol 1e-3", "what does not change measures by 0.1 %"),),
    "cost": (("nsspice cost buck.net --target 1e-4", "the cheapest method for an error of 1e-4"),),
    "test": (("nsspice test netlists", "every X.net against its X.expect.toml"),),
    "sweep": (
        ("nsspice sweep buck.net --over rload=2,5,20", "three loads"),
        (
            "nsspice sweep buck.net --over rload=2:100:8:log --plot load.png",
            "as a picture",
        ),
    ),
    "tune": (("nsspice tune buck.net --param don=0.2:0.8 --goal v_avg=9", "the duty for 9 V"),),
    "tolerance": (("nsspice tolerance buck.net --param don=5%", "how measures spread"),),
    "bounds": (
        ("nsspice bounds buck.net --param vin=5% --param l1=10%", "what no such buck leaves"),
    ),
    "compare": (
        ("nsspice compare buck.net", "the same deck in ngspice"),
        ("nsspice compare buck.net scope.csv", "a recorded waveform"),
    ),
    "plot": (('nsspice plot a.csv b.csv --signals "v(out)" -o both.png', "two runs overlaid"),),
    "draw": (
        ("nsspice draw buck.net", "the schematic, buck.svg"),
        ("nsspice draw buck.net --at 12u", "who conducts after 12 us is green"),
    ),
    "plecs": (("nsspice plecs device.xml", "a card with Eon, Eoff, Err and Foster tables"),),
    "magnetics": (
        ("nsspice magnetics flyback.net --winding lp --winding ls", "one period of both windings"),
    ),
    "fmu": (('nsspice fmu buck.net --input vg --signals "v(out)"', "buck.fmu: vg in, v(out) out"),),
    "serve-mcp": (("nsspice serve-mcp --folder .", "for an agent that starts it as a server"),),
    "convert": (
        ("nsspice convert X.cir -o X.net", "a deck that needs no other file; notes on stderr"),
    ),
    "verify": (("nsspice verify result", "what nsspice run buck.net --archive result has kept"),),
    "examples": (("nsspice examples copy buck", "a deck to start from"),),
}


def examples_of(command: str) -> str | None:
    """Return the end of a help page, None for a command that needs no example.

    Examples
    --------
    >>> print(examples_of("explain"))
    \b
    Examples:
      nsspice explain buck.net
          which method, which effects, what it costs
    """
    rows = _EXAMPLES.get(command)
    if rows is None:
        return None
    return "\b\nExamples:\n" + "\n".join(f"  {line}\n      {what}" for line, what in rows)

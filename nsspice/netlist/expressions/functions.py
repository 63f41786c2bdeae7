"""The functions and constants of expressions: names, spellings, numbers of arguments."""

from __future__ import annotations

import math

#: ngspice's comparisons with zero, which are read as conditions
WITH_ZERO = ("eq0", "ne0", "gt0", "ge0", "lt0", "le0")
#: name -> (least, most) number of arguments; most None means any number
ARITY: dict[str, tuple[int, int | None]] = {
    **dict.fromkeys(
        [
            "abs",
            "acos",
            "acosh",
            "asin",
            "asinh",
            "atan",
            "atanh",
            "ceil",
            "cos",
            "cosh",
            "exp",
            "floor",
            "int",
            "ln",
            "log",
            "log10",
            "nint",
            "sgn",
            "sin",
            "sinh",
            "sqrt",
            "tan",
            "tanh",
            "u",
            "u2",
            "uramp",
            "buf",
            "inv",
            "square",
        ],
        (1, 1),
    ),
    "round": (1, 1),
    "arcsin": (1, 1),
    "arccos": (1, 1),
    "arctan": (1, 1),
    "stp": (1, 1),
    "sqr": (1, 1),
    "atan2": (2, 2),
    "hypot": (2, 2),
    "pow": (2, 2),
    "pwr": (2, 2),
    "pwrs": (2, 2),
    "min": (1, None),
    "max": (1, None),
    "limit": (3, 3),
    "if": (3, 3),
    "ternary_fcn": (3, 3),
    **dict.fromkeys(WITH_ZERO, (1, 1)),
    "pwl": (3, None),
    "table": (3, None),
    "steps": (4, None),
}

#: operators and functions whose values jump
JUMPING_OPERATORS = frozenset(["lt", "le", "gt", "ge", "eq", "ne", "and", "or", "not", "if"])
JUMPING_FUNCTIONS = frozenset(["sgn", "u", "buf", "inv", "floor", "ceil", "nint", "int", "steps"])

#: other spellings of the same function
ALIASES = {
    "arcsin": "asin",
    "arccos": "acos",
    "arctan": "atan",
    "stp": "u",
    "sqr": "square",
    "log": "ln",
    "pwrs": "pwr",
    "round": "nint",
    "table": "pwl",
}

#: known to other simulators, not simulated here, with what to do instead
UNSUPPORTED = {
    **dict.fromkeys(
        ["rand", "random", "white"],
        "noise in time is not supported: draw a value with mc, flat, gauss, agauss, unif or aunif",
    ),
    **dict.fromkeys(
        ["ddt", "idt", "sdt", "idtmod", "delay", "absdelay", "laplace"],
        "only E, F, G, H and B know ddt, idt, sdt and delay; build others with a C or an L",
    ),
    **dict.fromkeys(["vdb", "vm", "vp", "vr", "db", "mag", "ph"], "it belongs to .ac"),
    "p": "a power is a product, as in v(a,b)*i(r1)",
    **dict.fromkeys(["ib", "ic", "ie", "id"], "write i(q1.b), i(q1), i(q1.e), i(d1)"),
}

#: [degrees Celsius]
ABSOLUTE_ZERO = -273.15
#: no element is solid above it [degrees Celsius]: a number without its unit, or a slip
HOTTEST = 1e4


def no_temperature(value: float) -> str:
    """Return why an element cannot have a temperature [degrees Celsius], nothing if it can.

    Examples
    --------
    >>> no_temperature(-300.0), no_temperature(27.0)
    ('not above absolute zero', '')
    """
    if not value > ABSOLUTE_ZERO:
        return "not above absolute zero"
    return "" if value <= HOTTEST else f"above {HOTTEST:g}, where no element is solid"


#: constants that a parameter of the same name hides
CONSTANTS = {
    "pi": math.pi,
    "e": math.e,
    "boltz": 1.380649e-23,
    "echarge": 1.602176634e-19,
    "planck": 6.62607015e-34,
    "kelvin": ABSOLUTE_ZERO,
    "true": 1.0,
    "false": 0.0,
}


def arity_problem(function: str, count: int) -> str:
    """Return what is wrong with a number of arguments, or ``""``.

    Examples
    --------
    >>> arity_problem("pow", 1)
    'pow needs 2 arguments, not 1'
    """
    least, most = ARITY[function]
    if function in ("pwl", "table") and count >= 3 and count % 2 == 0:
        return f"{function} needs a value and then pairs x, y"
    if count < least or (most is not None and count > most):
        wanted = str(least) if least == most else f"at least {least}"
        return f"{function} needs {wanted} argument{'s' * (wanted != '1')}, not {count}"
    return ""

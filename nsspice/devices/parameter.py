"""Parameter tables of the laws: what each parameter is called, means and defaults to.

A table drives three things: reading the parameters of a deck, the "did you mean" hints, and the
documentation.  A parameter that is not simulated stays in the table with the reason, so that
nothing is ever dropped silently.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from ..errors import suggest
from ..netlist.expressions.functions import no_temperature
from ..netlist.findings import Findings
from ..netlist.text.numbers import as_float

if TYPE_CHECKING:
    from ..netlist.deck import Model, Param


#: a word with one was meant as an expression
_OPERATOR = re.compile(r"\w[-+*/^]\w")


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of an element line or of a model card.

    Parameters
    ----------
    name : str
        Lower case.
    meaning : str
        A few words for the documentation.
    unit : str
        SI unit, ``""`` for a pure number.
    default : float or None
        Value if not given; None means "absent: the effect does not exist".
    aliases : tuple of str
        Other spellings.
    status : str
        ``used``; ``inert`` (cannot change a result of this program: a listed warning); ``refused``
        (would change results and is not simulated: an error unless it has the value ``neutral``);
        ``omitted`` (would change results little: a warning unless it is 0);
        ``table`` (read by others).
    neutral : tuple of float
        Values of a refused parameter that mean "no such effect".
    hint : str
        What to do instead of a refused parameter.
    check : callable, optional
        Reports what is wrong with a ``table``, which is not a number.
    """

    name: str
    meaning: str
    unit: str = ""
    default: float | None = None
    aliases: tuple[str, ...] = ()
    status: Literal["used", "inert", "omitted", "refused", "table"] = "used"
    neutral: tuple[float, ...] = (0.0,)
    hint: str = ""
    check: Callable[[Param, str, Findings], None] | None = None


def refused(
    name: str, meaning: str, hint: str, unit: str = "", neutral: tuple[float, ...] = (0.0,)
) -> Parameter:
    """Return a parameter that would change results: an error unless it has a neutral value."""
    return Parameter(name, meaning, unit, status="refused", neutral=neutral, hint=hint)


def omitted(name: str, meaning: str, unit: str = "") -> Parameter:
    """Return a parameter of a small effect that is left out, with a warning unless it is 0."""
    return Parameter(name, meaning, unit, status="omitted")


def inert(name: str, meaning: str, unit: str = "") -> Parameter:
    """Return a parameter that cannot change a result: a listed warning."""
    return Parameter(name, meaning, unit, status="inert")


class Table:
    """The parameters that one kind of element line or model card may have.

    Examples
    --------
    >>> table = Table(Parameter("ron", "on-resistance", "Ohm", 0.0))
    >>> table.names()
    ['ron']
    """

    def __init__(self, *parameters: Parameter) -> None:
        self.parameters = parameters
        self._by_name = {n: p for p in parameters for n in (p.name, *p.aliases)}

    def names(self) -> list[str]:
        """Return all accepted spellings."""
        return list(self._by_name)

    def read(
        self,
        params: Mapping[str, Param],
        owner: str,
        findings: Findings,
        others: Sequence[str] = (),
    ) -> dict[str, float]:
        """Return the given values under their main names; report everything else.

        Parameters
        ----------
        params : mapping of str to Param
            As the deck gives them.
        owner : str
            ``d1`` or ``model dm``, for messages.
        findings : Findings
        others : sequence of str
            Names of another kind of the same card, which may have been meant.
        """
        values: dict[str, float] = {}
        ignored: list[str] = []
        for key, param in params.items():
            entry = self._by_name.get(key)
            if entry is None:
                hint = (
                    suggest(key, [*self._by_name, *others]) or f"known: {', '.join(self.names())}"
                )
                findings.error("NS2003", f"{owner} has no parameter {key}", param.span, hint)
                continue
            value = param.value
            if entry.status in ("inert", "omitted", "refused"):
                findings.idle.add(param.span)
            if entry.status == "inert":
                ignored.append(key)
                continue
            if entry.check is not None:
                entry.check(param, owner, findings)
                continue
            if not isinstance(value, int | float) or math.isnan(value):
                text = getattr(value, "text", value)
                hint = "give a constant or an expression of parameters"
                if isinstance(value, str) and _OPERATOR.search(value):
                    hint = f"put an expression in braces: {key}={{{value}}}"
                message = f"{key} of {owner} must be a number, not {text}"
                findings.error("NS2005", message, param.span, hint)
                continue
            if entry.status == "omitted":
                if value != 0.0:
                    message = f"{key} of {owner} ({entry.meaning}) is left out"
                    hint = "remove it if its effect does not matter"
                    findings.warning("NS2064", message, param.span, hint)
                continue
            if entry.status == "refused":
                if value not in entry.neutral:
                    findings.error(
                        "NS2008",
                        f"{key} of {owner} ({entry.meaning}) is not simulated",
                        param.span,
                        entry.hint,
                    )
                continue
            if entry.unit == "C" and (why := no_temperature(value)):
                message = f"{key} of {owner} is {value:g} degrees Celsius, {why}"
                findings.error("NS2005", message, param.span, "give degrees Celsius")
                continue
            values[entry.name] = as_float(value)
        if ignored:
            are = "is" if len(ignored) == 1 else "are"
            findings.warning(
                "NS2052",
                f"{', '.join(ignored)} of {owner} cannot change the results and {are} ignored",
                params[ignored[0]].span,
            )
        return values


def limited(
    given: dict[str, float], key: str, bound: float, model: Model, findings: Findings
) -> None:
    """Take a parameter of a model card as its upper bound if it lies above, with a warning.

    Parameters
    ----------
    given : dict of str to float
        What the card gives, by main names; changed in place.
    key : str
    bound : float
    model : Model
    findings : Findings
    """
    if given.get(key, bound) > bound:
        message = f"{key}={given[key]:g} of model {model.name} is limited to {bound:g}"
        span = model.params[key].span if key in model.params else model.span
        findings.warning(
            "NS2058", message, span, "a junction this steep has no charge when it conducts"
        )
        given[key] = bound


def check_bounds(
    given: Mapping[str, float],
    model: Model,
    findings: Findings,
    *,
    positive: Collection[str],
    free: Collection[str],
) -> None:
    """Report parameters of a model card that are negative, zero, or an ``fc`` of 1 and more.

    Parameters
    ----------
    given : mapping of str to float
        What the card gives, by main names.
    model : Model
    findings : Findings
    positive : collection of str
        Must not be zero either.
    free : collection of str
        May have any value.
    """
    for key, value in given.items():
        bound = ""
        if key in free:
            continue
        if value < 0.0 or (key in positive and value == 0.0):
            bound = "positive" if key in positive else "at least 0"
        elif key == "fc" and value >= 1.0:
            bound = "below 1"
        if bound:
            span = model.params[key].span if key in model.params else model.span
            message = f"model {model.name}: {key}={value:g} must be {bound}"
            findings.error("NS2005", message, span)

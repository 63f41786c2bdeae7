"""The walk over a ``.control`` program that finds out what it runs, before anything has run.

Loops and branches are unrolled: in nearly all programs they depend on numbers and not on results.
The walk ends, with a warning, at the first command that can be decided only with results, or that
no netlist may give (``shell``); what comes before it is run.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from ...errors import Span
from ..alteration import check, parts, temperature
from ..cards.control import PROGRAM, CardReader
from ..deck import Alteration, Analysis, Deck, Measure, Run, Signal, kind_of
from ..expressions.expression import Expression
from ..expressions.node import Node, num, var
from ..findings import Findings, Unreadable
from ..text.script import Command, Script, as_command
from .commands import Branch, Loop, Statement, statements, word_of
from .variables import Opaque, Variables

#: commands that show results, or how the program writes and draws: nothing is lost without them
LOOKING = frozenset([
    "alias", "asciiplot", "cross", "cutout", "deftype", "delete", "destroy", "diff",
    "display", "disto", "echo", "eprint", "eprvcd", "esave", "exit", "fft", "gnuplot",
    "hardcopy", "history", "iplot", "linearize", "listing", "option", "options", "plot",
    "psd", "quit", "rehash", "remzerovec", "reshape", "rusage", "save", "setcs",
    "setplot", "setscale", "settype", "show", "showmod", "spec", "status", "step",
    "stop", "strcmp", "trace", "transpose", "unalias", "unlet", "unset", "version", "where",
    "write", "wrnodev", "wrs2p", "xgraph",
])  # fmt: skip
#: commands that start other programs or read other files: never done
REFUSED = frozenset([
    "aspice", "bug", "cd", "circbyline", "codemodel", "edit", "inventory", "jobs", "load",
    "loadsnap", "mc_source", "osdi", "pre_codemodel", "pre_osdi", "remcirc", "rspice",
    "setcirc", "shell", "snload", "snsave", "source", "system", "use",
])  # fmt: skip
#: statements that one program may execute
MAX_STATEMENTS = 200_000
_RUNS = frozenset(["op", "dc", "tran", "ac", "noise", "tf", "pz", "sp"])


class _End(Exception):
    """The walk cannot go on; the text is why."""


class _Leave(Exception):
    """``break`` (True) or ``continue`` (False)."""


class Planner:
    """Walks over the programs of one deck.

    Parameters
    ----------
    deck : Deck
        Its own cards are read; receives the runs.
    cards : CardReader
        For the lines that are cards but for their dot.
    findings : Findings
    seed : int
        Of the random numbers.
    """

    def __init__(self, deck: Deck, cards: CardReader, findings: Findings, seed: int) -> None:
        self._deck, self._cards, self._findings = deck, cards, findings
        self._own = list(deck.analyses)
        self._variables = Variables(cards.context.reader, cards.context.is_node, seed)
        known = cards.context.for_programs
        self._variables.vectors.update({name: num(value) for name, value in known.items()})
        self._changes: dict[tuple[str, str, str], Alteration] = {}
        self._waiting: dict[tuple[str, str, str], Alteration] = {}
        self._runs: list[Run] = []
        self._known: dict[tuple[str, int], Analysis] = {}
        self._measured: dict[str, int] = {}
        self._current = 0
        self._ran_own = False
        self._count = 0
        self._left: dict[str, Command] = {}

    def walk(self, scripts: list[Script]) -> None:
        """Walk over all programs; the deck then holds what they run."""
        for script in scripts:
            self._left = {}
            reason, hint = "", ""
            try:
                for statement in statements([as_command(line) for line in script.commands]):
                    self._statement(statement)
            except _End as end:
                reason = str(end)
            except _Leave:
                reason = "break and continue belong inside loops"
            except Unreadable as found:
                where = found.span.line if found.span else script.where.line
                reason, hint = f"line {where}: {found.message}", found.hint
            except Opaque as found:
                reason = f"{found} is known only after a run"
            self._report(script, reason, hint)
        if self._variables.drawn:
            message = "the random numbers of the .control block are the same in every run"
            self._findings.warning("NS1096", message, scripts[0].where, "change them with --seed")
        if self._runs and not self._ran_own:  # what the deck asks for besides
            self._runs += [Run(card) for card in self._own if Run(card) not in self._runs]
        self._deck.runs = self._runs

    def _report(self, script: Script, reason: str, hint: str) -> None:
        """Say in one warning what of a program is left out."""
        if reason:
            message = f".control block is not executed to its end: {reason}"
            self._findings.warning("NS1090", message, script.where, hint)
        shown = ", ".join(f"'{text}'" for text in list(self._left)[:12])
        shown += ", ..." if len(self._left) > 12 else ""
        if shown:
            message = f"of the .control block {shown} is left out"
            self._findings.warning("NS1090", message, script.where)

    # -- statements --------------------------------------------------------------------------

    def _statement(self, statement: Statement) -> None:
        """Execute one statement."""
        self._count += 1
        if self._count > MAX_STATEMENTS:
            raise _End(f"it takes more than {MAX_STATEMENTS} steps")
        if isinstance(statement, Loop):
            self._loop(statement)
        elif isinstance(statement, Branch):
            line = self._variables.expand(statement.line)
            taken = self._truth(line, line.raw.split(None, 1)[1:])
            for inner in statement.body if taken else statement.other:
                self._statement(inner)
        else:
            self._command(statement)

    def _truth(self, line: Command, rest: list[str]) -> bool:
        """Return whether a condition holds."""
        if not rest:
            raise Unreadable("NS1080", "a condition is missing", line.whole())
        return self._variables.number(line, rest[0]) != 0.0

    def _loop(self, loop: Loop) -> None:
        """Execute a loop."""
        kind = word_of(loop.line)
        rest = self._variables.expand(loop.line).raw.split()[1:]
        if kind == "foreach":
            for value in rest[1:]:
                self._variables.words[rest[0].lower()] = [value]
                if not self._body(loop):
                    break
            return
        rounds = None
        if kind == "repeat" and rest:
            rounds = int(self._variables.number(loop.line, " ".join(rest)))
        done = 0
        while rounds is None or done < rounds:
            if kind == "while" or (kind == "dowhile" and done):
                line = self._variables.expand(loop.line)
                if not self._truth(line, line.raw.split(None, 1)[1:]):
                    break
            if not self._body(loop):
                break
            done += 1

    def _body(self, loop: Loop) -> bool:
        """Execute the body of a loop once; return whether it continues."""
        self._count += 1
        if self._count > MAX_STATEMENTS:
            raise _End(f"it takes more than {MAX_STATEMENTS} steps")
        try:
            for inner in loop.body:
                self._statement(inner)
        except _Leave as leave:
            return not leave.args[0]
        return True

    def _command(self, given: Command) -> None:
        """Execute one command."""
        word = word_of(given)
        if not word or word in ("label",):
            return
        if word in REFUSED or word.startswith("!"):
            message = f"{word} in a .control block is refused: a netlist starts no other program"
            if word not in ("shell", "system", "!"):
                message = f"{word} in a .control block is refused"
            self._findings.warning("NS1095", message, given.whole(), "remove it")
            return
        if word in ("break", "continue"):
            raise _Leave(word == "break")
        action: Callable[[Command], None] | None = getattr(self, f"_do_{word}", None)
        if action is not None:
            action(given)
        elif word in _RUNS:
            self._run(self._variables.expand(given))
        elif word in LOOKING:
            self._look(given, word)
        elif re.fullmatch(r"[\w.]+\s*=.*", given.raw):
            self._do_let(Command(f"let {given.raw}", given.file, given.number, given.source))
        else:
            raise _End(f"line {given.number}: the command {word[:40]} is unknown")

    def _look(self, line: Command, word: str) -> None:
        """Note a command without effect on what runs; options may have one."""
        if word in ("option", "options"):
            self._temperature(self._variables.expand(line))
        else:
            self._left.setdefault(line.shown(), line)

    # -- variables ---------------------------------------------------------------------------

    def _do_set(self, line: Command) -> None:
        """``set name = value``, ``set name = ( words )``."""
        line = self._variables.expand(line)
        found = re.fullmatch(r"\w+\s+(\w+)\s*(?:=\s*)?(.*)", line.raw.strip())
        if found is None:
            return
        words = re.findall(r'"[^"]*"|[^\s()]+', found.group(2))
        self._variables.words[found.group(1).lower()] = [word.strip('"') for word in words]
        self._temperature(line)

    def _temperature(self, line: Command) -> None:
        """Take ``temp=`` of set and option."""
        found = re.search(r"\btemp\s*=\s*(\S+)", line.text)
        if found:
            value = self._variables.number(line, found.group(1))
            self._changes["temp", "temp", ""] = temperature(value, line.whole())

    def _do_let(self, line: Command) -> None:
        """``let name = expression``; elements of vectors are kept as names of their own."""
        found = re.fullmatch(r"\w+\s+([\w.]+(?:\[[^\]]*\])?)\s*=(?!=)\s*(.*)", line.text.strip())
        if found is None:
            return
        name = found.group(1)
        if "[" in name:  # an element of a vector of results: nothing here needs it
            self._variables.vectors[name.partition("[")[0]] = None
            return
        try:
            expanded = self._variables.expand(line)
            text = expanded.raw.partition("=")[2]
            self._variables.vectors[name] = self._variables.tree(expanded, text)
        except (Opaque, Unreadable):  # of results that no signal stands for
            self._variables.vectors[name] = None
            self._left.setdefault(line.shown(), line)

    def _do_compose(self, line: Command) -> None:
        """``compose name values ...``: a vector, of which only the name is known."""
        words = line.text.split()
        self._variables.vectors.update(dict.fromkeys(words[1:2]))

    def _do_define(self, line: Command) -> None:
        """``define f(x, y) expression``."""
        found = re.fullmatch(r"\w+\s+(\w+)\s*\(([^()]*)\)\s*(.*)", line.text.strip())
        if found:
            formals = [word for word in re.split(r"[\s,]+", found.group(2)) if word]
            self._variables.define(found.group(1), formals, found.group(3))

    def _do_undefine(self, line: Command) -> None:
        """``undefine f`` has nothing to take back before a later ``define``."""

    def _do_setseed(self, line: Command) -> None:
        """``setseed n``."""
        words = self._variables.expand(line).raw.split()
        if len(words) > 1:
            self._variables.random.seed(int(self._variables.number(line, words[1])))

    # -- changes -----------------------------------------------------------------------------

    def _do_alter(self, given: Command) -> None:
        """``alter`` of an element."""
        self._change(given, "element", self._changes)

    def _do_altermod(self, given: Command) -> None:
        """``altermod`` of a model."""
        self._change(given, "model", self._changes)

    def _do_alterparam(self, given: Command) -> None:
        """``alterparam name = value`` counts from the next ``reset`` on."""
        self._change(given, "param", self._waiting)

    def _change(
        self, given: Command, kind: str, target: dict[tuple[str, str, str], Alteration]
    ) -> None:
        line = self._variables.expand(given)
        name, key, text = parts(line)
        texts = re.sub(r"[\[\]]", " ", text).split() if "[" in text else [text]
        values = tuple(self._variables.number(line, value) for value in texts)
        if kind == "model" and not key:
            raise Unreadable("NS1080", "altermod needs a parameter", line.whole())
        change = Alteration(kind, name, key, values, given.whole())
        check(self._deck, change)
        if kind == "param" and name not in self._deck.parameters:
            message = f"alterparam: there is no parameter {name[:60]}"
            raise Unreadable("NS1070", message, line.whole())
        target[kind, name, key] = change

    def _do_reset(self, line: Command) -> None:
        """``reset`` reads the deck again, with the parameters altered so far."""
        self._changes = {k: c for k, c in self._changes.items() if c.kind == "param"}
        self._changes.update(self._waiting)

    # -- runs --------------------------------------------------------------------------------

    def _do_run(self, line: Command) -> None:
        """``run``: the deck's own analyses."""
        self._ran_own = True
        for card in self._own:
            self._add(card)

    def _run(self, line: Command) -> None:
        """Run an analysis that is written as a card without its dot."""
        key = line.text, len(self._deck.steps)
        card = self._known.get(key)
        if card is None:
            before = len(self._deck.analyses)
            self._cards.command(line)
            if len(self._deck.analyses) == before:
                raise _End(f"line {line.number}: {line.shown()} cannot be read")
            card = self._deck.analyses[-1]
            same = next((c for c in self._deck.analyses[:-1] if _same(c, card)), None)
            if same is not None:
                self._deck.analyses.pop()
                card = same
            self._known[key] = card
        self._add(card)

    def _add(self, card: Analysis) -> None:
        """Run a card with the circuit as it is, unless that has been done."""
        run = Run(card, tuple(self._changes.values()))
        if run not in self._runs:
            self._runs.append(run)
        self._current = self._runs.index(run)

    def _do_sens(self, given: Command) -> None:
        """``sens``: with the operating point, which is run unless there is one."""
        before = len(self._deck.analyses)
        self._cards.command(self._variables.expand(given))
        for card in self._deck.analyses[before:]:
            self._add(card)

    def _do_fourier(self, line: Command) -> None:
        """``fourier f signal ...`` is ``.four``."""
        self._card(self._variables.expand(line))

    def _do_meas(self, line: Command) -> None:
        """``meas`` is ``.measure``; vectors may be part of what it measures."""
        try:
            expanded = self._variables.expand(line)
        except Opaque:
            self._left.setdefault(line.shown(), line)
            return
        words = expanded.text.split()
        if len(words) > 2:
            self._variables.measures.add(words[2])
        self._card(expanded)

    _do_measure = _do_meas

    def _card(self, line: Command) -> None:
        """Read a line that is a card without its dot, once; what cannot be read is left out."""
        measures = self._deck.measures
        number = self._measured.get(line.text)
        if number is None:
            before = self._measured[line.text] = len(measures)
            vectors = {n: t for n, t in self._variables.vectors.items() if t is not None}
            try:
                self._cards.command(line, vectors)
            except Unreadable as found:
                message = f"{found.message}; the command is left out"
                self._findings.warning("NS1090", message, line.whole(), found.hint)
            if len(measures) > before:
                measures[before] = measures[before]._replace(runs=(self._current,))
        elif number < len(measures) and self._current not in (runs := measures[number].runs or ()):
            measures[number] = measures[number]._replace(runs=(*runs, self._current))

    def _do_print(self, line: Command) -> None:
        """``print``: what measures and numbers give is a result; waveforms are written anyway."""
        words = line.text.split()[1:]
        for word in words:
            tree = self._variables.vectors.get(word)
            if tree is None or not self._runs or not self._is_scalar(tree):
                self._left.setdefault(line.shown(), line)
                continue
            card = self._runs[self._current].card
            found = Measure(
                word, kind_of(card), "param", line.whole(), Expression(tree), runs=(self._current,)
            )
            if found not in self._deck.measures:
                self._deck.measures.append(found)

    def _is_scalar(self, tree: Node) -> bool:
        """Return whether an expression is made of numbers and measures only."""
        return Expression(tree).variables() <= self._variables.measures

    def _do_wrdata(self, line: Command) -> None:
        """``wrdata file signal ...``: the signals are in the table of the run.

        A netlist does not choose which files are written.
        """
        try:
            expanded = self._variables.expand(line)
            for word in re.findall(r"(?:\([^()]*\)|[^\s(])+", expanded.raw)[2:]:
                names = Expression(self._variables.tree(expanded, word)).variables()
                self._save([name for name in names if name[:2] in ("v(", "i(")], line)
        except (Opaque, Unreadable):
            pass
        self._left.setdefault(line.shown(), line)

    def _save(self, names: list[str], line: Command) -> None:
        """Let signals be among those that are written."""
        saves = self._deck.saves
        if not saves:
            saves.append(Signal("all", line.whole()))
        for name in names:
            self._cards.context.check_signals(Expression(var(name), line.whole(), name))
            if all(known.name != name for known in saves):
                saves.append(Signal(name, line.whole()))


def _same(card: Analysis, other: Analysis) -> bool:
    """Return whether two cards ask for the same analysis."""
    place: Span = card.span
    return type(card) is type(other) and card == other._replace(span=place)


def plan(
    deck: Deck, cards: CardReader, scripts: list[Script], findings: Findings, seed: int
) -> None:
    """Let the programs of a deck say what runs."""
    Planner(deck, cards, findings, seed).walk(scripts)


def computes(scripts: list[Script]) -> bool:
    """Return whether a program names an analysis that is computed."""
    words = {word_of(as_command(line)) for script in scripts for line in script.commands}
    return bool(words & {*PROGRAM, "sens"})

"""``nsspice verify``: certify the stored results of a run folder again, without running them."""

from __future__ import annotations

from pathlib import Path

import click

from ..options import confined_option, json_option
from ..report import print_json, say


@click.command("verify", short_help="certify a stored result again, without running it")
@click.argument("folder", type=click.Path(file_okay=False, path_type=Path))
@confined_option
@json_option
def command(folder: Path, as_json: bool) -> None:
    """Judge the tables in FOLDER by the laws of the deck that is stored with them.

    FOLDER was written by nsspice run X.net --archive FOLDER.  Every file is compared with its
    hash; rows of transients must obey Kirchhoff's laws, sources, resistors, set-valued elements
    and switches.  Exit code 1 if anything is wrong.
    """
    from ...compare.archive import verify

    changed, verdicts = verify(folder)
    if as_json:
        print_json({"changed": changed, "runs": [verdict.to_dict() for verdict in verdicts]})
    else:
        for text in changed:
            say(f"changed: {text}")
        for verdict in verdicts:
            say(f"{verdict.table}: {verdict.rows} rows")
            for finding in verdict.findings:
                say(f"  wrong: {finding}")
            if verdict.law is not None and verdict.pair is not None and verdict.passed:
                errors = f"laws {verdict.law.error:.1e}, complementarity {verdict.pair.error:.1e}"
                say(f"  certificate holds: {errors} (relative, every row)")
            judged = [f"{kind} {count}" for kind, count in verdict.judged.items() if count]
            if verdict.law is None and verdict.passed:
                say("  only its hash, rows and columns are checked: it is not a transient")
            elif judged:
                say(f"  judged: {', '.join(judged)}")
            if verdict.left_out:
                names = ", ".join(verdict.left_out)
                say(f"  not judged: {names} (charges, or more than two terminals)")
    if changed or not all(verdict.passed for verdict in verdicts):
        raise SystemExit(1)

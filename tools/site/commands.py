"""The reference page of the command line, from the commands themselves."""

from __future__ import annotations

import click

from nsspice.cli.app import app

INTRO = """# Command line

`nsspice COMMAND --help` shows the same text. All but `serve-mcp` and `completion` have `--json`.

| exit code | meaning |
|---|---|
| 0 | done |
| 1 | a check or a comparison failed |
| 2 | usage or netlist error |
| 3 | no numerical solution, or the certificate failed |
| 130 | interrupted; what was computed is kept |
"""


def page() -> str:
    """Return the page, a section for each command with its options."""
    parts = [INTRO]
    context = click.Context(app, info_name="nsspice")
    for name in app.list_commands(context):
        command = app.get_command(context, name)
        assert command is not None
        inner = click.Context(command, info_name=name, parent=context)
        usage = " ".join(["nsspice", name, *command.collect_usage_pieces(inner)])
        parts.append(f"## nsspice {name}\n\n```text\n{usage}\n```\n")
        parts.append(_paragraphs(command.help or command.short_help or ""))
        if command.epilog:
            lines = [line.strip() for line in command.epilog.splitlines()[2:]]
            pairs = zip(lines[::2], lines[1::2], strict=True)
            parts.append("\n".join(f"- `{line}`: {what}" for line, what in pairs) + "\n")
        rows = [
            (record[0].replace("|", "\\|"), record[1].replace("|", "\\|"))
            for option in command.get_params(inner)
            if (record := option.get_help_record(inner)) is not None and record[1]
        ]
        table = "\n".join(f"| `{names}` | {text} |" for names, text in rows)
        parts.append(f"| option | meaning |\n|---|---|\n{table}\n")
    return "\n".join(parts)


def _paragraphs(text: str) -> str:
    """Return a docstring's text as markdown; a paragraph marked \\b keeps its line ends."""
    shown = []
    for paragraph in text.split("\n\n"):
        if paragraph.startswith("\b"):
            shown.append("```text\n" + paragraph.removeprefix("\b").strip("\n") + "\n```")
        else:
            shown.append(" ".join(paragraph.split()))
    return "\n\n".join(shown) + "\n"

"""Hooks of the documentation's build: pages made from the code and the collection of netlists.

`mkdocs build` calls the functions below by their names.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

sys.path.insert(0, str(Path(__file__).parent))

import commands
import concepts
import equations
import gallery
import parameters
import playground
import spice_lexer
import steady
import tutorial

spice_lexer.register()

#: what the extension for formulas leaves: \( inline \) and \[ in a block \]
_FORMULA = re.compile(
    r'<(span|div) class="arithmatex">\s*\\[(\[](.*?)\\[)\]]\s*</\1>', flags=re.DOTALL
)


#: links to files of the repository, which the site does not contain
_SOURCE = re.compile(r"\[(`[^`]+`)\]\((?:\.\./)+(?:nsspice|tests|tools|netlists)/[^)]*\)")
#: references of docstrings, which other tools turn into links
_ROLE = re.compile(r":(?:func|meth|class|mod):(?=<code)")


def on_files(files: Files, config: Any) -> Files:
    """Add the pages that are made from the code and from the netlists."""
    pages: dict[str, str | bytes] = {
        "reference/command-line.md": commands.page(),
        "reference/devices.md": parameters.page(),
        **gallery.pages(Path(config.config_file_path).parent / "netlists"),
        **equations.pictures(Path(config.config_file_path).parent),
        **steady.pictures(Path(config.config_file_path).parent),
        **concepts.pictures(Path(config.config_file_path).parent),
        **playground.files(Path(config.config_file_path).parent),
        **tutorial.shown(Path(config.config_file_path).parent)[1],
    }
    for name, content in pages.items():
        files.append(File.generated(config, name, content=content))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, **_: Any) -> str:
    """Put in netlists that pages name, results and thumbnails; links to sources become names."""
    root = Path(config.config_file_path).parent
    if page.file.src_uri == tutorial.PAGE:
        markdown = tutorial.shown(root)[0]
    if page.file.src_uri == "gallery/index.md":
        markdown = markdown.replace(gallery.THUMBNAILS, gallery.thumbnails(root / "netlists"))
    markdown = _SOURCE.sub(r"\1", markdown)
    return equations.with_decks(markdown, root)


def on_page_content(html: str, **_: Any) -> str:
    """Write formulas as MathML, which browsers show without any script, and roles as plain code."""
    from html import unescape

    from latex2mathml.converter import convert

    def mathml(match: re.Match[str]) -> str:
        display = "block" if match[1] == "div" else "inline"
        return str(convert(unescape(match[2]), display=display))

    return _ROLE.sub("", _FORMULA.sub(mathml, html))

"""What readers come for is at most three links from the start page, without menu or search."""

from __future__ import annotations

import re
from collections import deque
from pathlib import Path

import pytest
from markdown.extensions.toc import slugify

DOCS = Path(__file__).parents[2] / "docs"
#: a link to a page of our own, which is not a picture
LINK = re.compile(r"(?<!!)\[[^\]]*\]\((?P<page>[^)#:]*\.md)?(?:#(?P<part>[^)]+))?\)")
#: what a page must show where a reader lands: the card or command, and what it answers
TASKS = {
    "find a phase margin": (".loop", "$ nsspice run", "phase margin 89.04", ".svg)"),
    "understand a refusal": ("NS3001", "$ nsspice run", "hint:", "Read it in this order"),
    "sweep and plot": ("$ nsspice sweep", "--over", "--plot"),
    "a table of losses": ("$ nsspice run", "--load", "lost 913.22 mW", "efficiency"),
}


def landing(page: Path, part: str | None) -> str:
    """Return what is below a heading, or the whole page; nothing where tools write the heading."""
    text = page.read_text("utf-8")
    if part is None:
        return text
    # what looks like a heading in a listing is a comment
    prose = re.sub(r"(?ms)^```.*?^```", lambda m: re.sub(r"[^\n]", " ", m[0]), text)
    heads = list(re.finditer(r"(?m)^(#+) (.+)$", prose))
    for k, head in enumerate(heads):
        if slugify(head[2], "-") == part:
            after = (h.start() for h in heads[k + 1 :] if len(h[1]) <= len(head[1]))
            return text[head.start() : next(after, len(text))]
    return ""


def clicks(words: tuple[str, ...]) -> int | None:
    """Return the least number of links from the start page to a text with all words."""
    start = (DOCS / "index.md", None)
    queue: deque[tuple[tuple[Path, str | None], int]] = deque([(start, 0)])
    seen = {start}
    while queue:
        (page, part), count = queue.popleft()
        text = landing(page, part)
        if all(word in text for word in words):
            return count
        for link in LINK.finditer(text):
            target = (page.parent / link["page"]).resolve() if link["page"] else page
            if target.exists() and (target, link["part"]) not in seen and count < 3:
                seen.add((target, link["part"]))
                queue.append(((target, link["part"]), count + 1))
    return None


@pytest.mark.parametrize("words", TASKS.values(), ids=TASKS)
def test_a_reader_arrives(words: tuple[str, ...]) -> None:
    assert clicks(words) in (1, 2, 3)


def test_what_no_page_shows_is_not_reached() -> None:
    assert clicks(("$ nsspice run", "phase margin 12.34")) is None

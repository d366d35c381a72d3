"""Every link of the documents leads to a file of the repository, and to a heading of it."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted(
    page for folder in (ROOT, ROOT / "docs", ROOT / "sample_data") for page in folder.glob("*.md")
)
_FENCED = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
_HEADING = re.compile(r"^#{1,6} (.+)$", re.MULTILINE)
_LINK = re.compile(r"\]\(([^)\s]+)\)")


def text_of(page):
    """The text of a page without its code."""
    return _FENCED.sub("", page.read_text(encoding="utf-8"))


def anchors(page):
    """The names that GitHub gives the headings of a page."""
    bare = (re.sub(r"[^\w\- ]", "", each.lower()) for each in _HEADING.findall(text_of(page)))
    return {each.strip().replace(" ", "-") for each in bare}


def dead_ends(page):
    """The links of a page that lead nowhere."""
    for link in _LINK.findall(text_of(page)):
        name, _, heading = link.partition("#")
        target = page.parent / name if name else page
        if link.startswith(("https://", "http://")):
            continue
        if not target.exists() or (heading and heading not in anchors(target)):
            yield link


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_no_link_of_a_page_leads_nowhere(page):
    assert list(dead_ends(page)) == []


def test_a_link_to_nowhere_is_noticed(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "# One `word`\n[a](page.md#one-word) [b](#other) [c](gone.md)\n```\n[d](code.md)\n```\n",
        encoding="utf-8",
    )
    assert list(dead_ends(page)) == ["#other", "gone.md"]

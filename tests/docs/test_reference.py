"""Pages about the command line agree with the command line."""

import re
import runpy
from importlib import import_module
from pathlib import Path

import pytest

from handeye_cli.cli.app import COMMANDS
from handeye_cli.cli.flags import Argument
from handeye_cli.cli.grouping import command_of, flags_of, groups_of

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def _flags(name):
    """Return every spelling of a command's flags."""
    groups = groups_of(command_of(import_module(COMMANDS[name]), name)).values()
    flags = [(field, flag) for group in groups for field, (_, flag) in flags_of(group).items()]
    return {
        word
        for field, flag in flags
        if not isinstance(flag, Argument)
        for word in flag.names or (f"--{field.replace('_', '-')}",)
    }


def _command_lines(text):
    """Yield every `handeye ...` of the code blocks of a page, up to what ends a command."""
    for block in re.findall(r"```(?:console|sh|python|bash)\n(.*?)```", text, re.DOTALL):
        joined = re.sub(r"\\\n\s*|\"\n\s*\"", " ", block)
        yield from re.findall(r"\bhandeye ((?:[a-z]+ )[^\n|;>\"]*)", joined)


def test_the_reference_is_what_the_command_line_says():
    script = runpy.run_path(str(ROOT / "docs" / "make_reference.py"))
    assert script["PAGE"].read_text("utf-8") == script["page"](), "run docs/make_reference.py"


@pytest.mark.parametrize("name", COMMANDS)
def test_the_reference_names_every_flag(name):
    page = (ROOT / "docs" / "reference.md").read_text("utf-8")
    section = page.split(f"\n## handeye {name}\n")[1].split("\n## ")[0]
    assert sorted(flag for flag in _flags(name) if f"`{flag}`" not in section) == []


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_commands_on_a_page_exist_with_their_flags(path):
    for line in _command_lines(path.read_text("utf-8")):
        words = line.split()
        name = next(n for n in (" ".join(words[:2]), words[0]) if n in COMMANDS)
        flags = {word.split("=")[0] for word in words if re.match(r"--?[a-zA-Z]", word)}
        assert flags <= _flags(name) | {"--help", "--debug"}, line


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_links_between_pages_lead_somewhere(path):
    text = path.read_text("utf-8")
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if "://" in target:
            continue
        file, _, anchor = target.partition("#")
        place = (path.parent / file) if file else path
        assert place.exists(), target
        if anchor:
            headings = re.findall(r"^#+ (.*)$", place.read_text("utf-8"), re.MULTILINE)
            assert anchor in {_anchor(heading) for heading in headings}, target


def test_the_index_lists_every_page():
    index = (ROOT / "docs" / "README.md").read_text("utf-8")
    pages = {path.name for path in (ROOT / "docs").glob("*.md")} - {"README.md"}
    assert sorted(page for page in pages if f"]({page})" not in index) == []


def test_the_picture_of_the_readme_is_small():
    (picture,) = re.findall(r"!\[[^]]+\]\(([^)]+)\)", PAGES[0].read_text("utf-8"))
    assert (ROOT / picture).stat().st_size < 200_000


def _anchor(heading):
    """Return the name that a heading has in links: small letters, digits, hyphens."""
    kept = re.sub(r"[^\w\- ]", "", heading.lower())
    return kept.replace(" ", "-")

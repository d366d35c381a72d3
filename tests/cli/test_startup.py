"""Help: written without Typer, and saying all that Typer knows."""

import inspect
import re
import shlex
import subprocess
import sys
from importlib import import_module

import pytest
from typer.main import get_command

from handeye_cli.cli import help as texts
from handeye_cli.cli.commands import COMMANDS, SUMMARIES
from handeye_cli.cli.grouping import command_of
from handeye_cli.cli.typer_front import application


@pytest.fixture(autouse=True)
def eighty_columns(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")


def module_of(name):
    return import_module(COMMANDS[name])


def help_of(name):
    return texts.of_command(name, module_of(name))


def flags_in(text):
    """Spellings in the left column of the tables of a help."""
    rows = re.findall(r"^  (-.*?)(?:  .*)?$", text, re.MULTILINE)
    return set(re.findall(r"(?<!\S)--?[a-zA-Z][\w-]*", " ".join(rows)))


def spellings(command):
    names = {name for each in command.params for name in [*each.opts, *each.secondary_opts]}
    return {name for name in names if name.startswith("-")} | {"--help", "-h"}


def loaded_by(*words):
    """Names of all modules that a process has loaded when its command is done."""
    program = (
        "import atexit, sys\n"
        "atexit.register(lambda: print(*sys.modules, file=sys.stderr))\n"
        "from handeye_cli.cli.app import main\n"
        "main()\n"
    )
    command = [sys.executable, "-c", program, *words]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return set(done.stderr.split())


def test_the_list_says_of_each_command_what_the_command_says_of_itself():
    assert SUMMARIES.keys() == COMMANDS.keys()
    for name, summary in SUMMARIES.items():
        text = inspect.cleandoc(command_of(module_of(name), name).__doc__)
        assert summary == text.split("\n\n")[0].replace("\n", " ")


def test_the_list_has_every_command_and_every_general_flag():
    listed = texts.of_all()
    whole = get_command(application({name: module_of(name) for name in COMMANDS}))
    assert flags_in(listed) == spellings(whole)
    assert re.findall(r"^  ([a-z]+(?: [a-z]+)?)  ", listed, re.MULTILINE) == list(COMMANDS)


@pytest.mark.parametrize("name", COMMANDS)
def test_help_has_every_flag_that_typer_reads(name):
    whole = get_command(application({name: module_of(name)}))
    assert flags_in(help_of(name)) == spellings(whole.commands[name])


@pytest.mark.parametrize("name", COMMANDS)
def test_examples_stay_the_commands_that_they_were(name):
    text = help_of(name).partition("Examples:\n")[2].partition("\n\n")[0]
    shown = re.sub(r"\s*\\\n\s*", " ", text).splitlines()
    expected = [each.replace("\\\n", " ") for each in module_of(name).EXAMPLES]
    assert [shlex.split(line)[1:] for line in shown] == [shlex.split(each) for each in expected]


@pytest.mark.parametrize("columns", [72, 80, 100])
def test_help_fits_the_terminal(monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    for text in [texts.of_all(), *map(help_of, COMMANDS)]:
        assert max(map(len, text.splitlines())) <= columns


def test_what_a_value_may_be_is_said():
    plan = " ".join(help_of("plan").split())
    assert "--stations N Stations to calibrate on, 3 or more; or to add." in plan
    assert "[at most 10000, required]" in plan
    assert "[default: 170mm]" in plan
    assert "--seed N Of all chance. [default: 0]" in " ".join(help_of("simulate").split())
    assert "--pairs star|all" in help_of("solve")
    assert "Usage: handeye solve [OPTIONS] INPUT [FILE]...\n" in help_of("solve")


@pytest.mark.parametrize("words", [["solve", "in.yaml", "--help"], ["solve", "-q", "-h"]])
def test_help_is_the_same_however_it_is_asked_for(handeye, words):
    done = handeye(*words)
    assert done.code == 0
    assert done.out.rstrip() == help_of("solve").rstrip()


def test_the_list_is_the_same_however_it_is_asked_for(handeye):
    plain, by_typer, nothing = handeye("--help"), handeye("--version=", "-h"), handeye()
    assert (plain.code, plain.out) == (0, texts.of_all())
    assert by_typer.code == 2
    assert (nothing.code, nothing.out) == (2, texts.of_all())


def test_only_a_terminal_gets_colours(monkeypatch):
    assert "\033" not in help_of("solve")
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(texts, "_on_terminal", lambda: True)
    assert "\033[1mOutput:\033[0m" in help_of("solve")
    assert "\033[1;36m--output, -o FILE\033[0m" in help_of("solve")
    monkeypatch.setenv("NO_COLOR", "1")
    assert "\033" not in help_of("solve")


def test_help_into_a_full_disk_is_no_bug(shell):
    done = shell("handeye solve --help > /dev/full")
    assert done.code == 3
    assert "standard output: cannot be written: No space left" in done.err


@pytest.mark.parametrize("words", [["--help"], ["--version"], ["solve", "-h"], ["plan", "--help"]])
def test_help_waits_neither_for_typer_nor_for_numpy(words):
    loaded = {name.partition(".")[0] for name in loaded_by(*words)}
    assert "handeye_cli" in loaded
    assert not loaded & {"typer", "click", "rich", "numpy", "yaml"}


def test_ten_poses_are_solved_without_what_only_others_need(stations_file):
    """Each of these takes as long to load as a step of the solution, or longer."""
    loaded = loaded_by("solve", str(stations_file))
    assert {"numpy", "handeye_cli.solve"} <= loaded
    assert not loaded & {"numpy.random", "random", "secrets", "traceback", "typer", "rich.console"}

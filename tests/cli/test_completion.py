"""Completion in shells: the scripts, and what a shell is told when it asks."""

import os
import subprocess
import sys

import pytest

from handeye_cli.cli.app import COMMANDS

_OPENINGS = {"bash": "_handeye_completion() {", "zsh": "#compdef handeye", "fish": "complete "}


def _handeye(*words, **environment):
    run = "from handeye_cli.cli.app import main; main()"
    return subprocess.run(
        [sys.executable, "-c", run, *words],
        env={**os.environ, "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1", **environment},
        capture_output=True,
        text=True,
        check=False,
    )


def _completed(line):
    """Return what bash is told for a line whose last word is not finished."""
    done = _handeye(
        COMP_WORDS=f"handeye {line}",
        COMP_CWORD=str(len(line.split(" "))),
        _HANDEYE_COMPLETE="complete_bash",
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.split("\n")


@pytest.mark.parametrize("shell", _OPENINGS)
def test_a_script_for_each_shell(shell):
    done = _handeye("--show-completion", shell)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith(_OPENINGS[shell])
    assert f"_HANDEYE_COMPLETE=complete_{shell}" in done.stdout


def test_commands_are_completed_word_by_word():
    assert _completed("ex")[:3] == [name for name in COMMANDS if name.startswith("ex")]
    assert _completed("simul") == ["simulate", ""]


def test_flags_and_their_choices_are_completed():
    assert "--camera-info-topic" in _completed("solve data.mcap --cam")
    assert _completed("solve --setup eye-to") == ["eye-to-hand", ""]


def test_flags_of_a_command_of_two_words():
    found = _completed("simulate recording --f")
    assert "--fault" in found
    assert "--figure" not in found  # a flag of `simulate`

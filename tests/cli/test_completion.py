"""Completion in shells: the scripts, and what a shell is told when it asks."""

import pytest

from handeye_cli.cli.app import COMMANDS

_OPENINGS = {"bash": "_handeye_completion() {", "zsh": "#compdef handeye", "fish": "complete "}


@pytest.fixture
def completed(handeye, monkeypatch):
    """Return what bash is told for a line whose last word is not finished."""

    def complete(line):
        monkeypatch.setenv("COMP_WORDS", f"handeye {line}")
        monkeypatch.setenv("COMP_CWORD", str(len(line.split(" "))))
        monkeypatch.setenv("_HANDEYE_COMPLETE", "complete_bash")
        done = handeye()
        assert (done.code, done.err) == (0, "")
        return done.out.split("\n")

    return complete


@pytest.mark.parametrize("shell", _OPENINGS)
def test_a_script_for_each_shell(handeye, monkeypatch, shell):
    monkeypatch.setenv("_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION", "1")
    done = handeye("--show-completion", shell)
    assert (done.code, done.err) == (0, "")
    assert done.out.startswith(_OPENINGS[shell])
    assert f"_HANDEYE_COMPLETE=complete_{shell}" in done.out


def test_commands_are_completed_word_by_word(completed):
    assert completed("ex")[:3] == [name for name in COMMANDS if name.startswith("ex")]
    assert completed("simul") == ["simulate", ""]


def test_flags_and_their_choices_are_completed(completed):
    assert "--camera-info-topic" in completed("solve data.mcap --cam")
    assert completed("solve --setup eye-to") == ["eye-to-hand", ""]


def test_flags_of_a_command_of_two_words(completed):
    found = completed("simulate recording --f")
    assert "--fault" in found
    assert "--figure" not in found  # a flag of `simulate`

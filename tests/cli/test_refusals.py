"""Contract of every command: what Typer refuses is said like any other error, with the value."""

import shlex
from dataclasses import MISSING, fields
from enum import Enum
from importlib import import_module

import pytest

from handeye_cli.cli.commands import COMMANDS
from handeye_cli.cli.flags import Argument
from handeye_cli.cli.grouping import command_of, flags_of, groups_of, single_type, spellings


def flags_of_command(name):
    """Yield the field, the type and the flag of all that a command takes."""
    for group in groups_of(command_of(import_module(COMMANDS[name]), name)).values():
        flags = flags_of(group)
        for field in fields(group):
            kind, flag = flags[field.name]
            yield field, single_type(kind), flag


def required(name, without=None):
    """Words for all that a command cannot do without."""
    for field, kind, flag in flags_of_command(name):
        if field.default is MISSING and field.name != without:
            value = "3" if kind in (int, float) else "none.yaml"
            yield from (
                [value] if isinstance(flag, Argument) else [f"{flag_name(field, flag)}={value}"]
            )


def flag_name(field, flag):
    return spellings(field.name, flag)[0]


def is_choice(kind):
    return isinstance(kind, type) and issubclass(kind, Enum)


OPTIONS = [
    (name, field, kind, flag)
    for name in COMMANDS
    for field, kind, flag in flags_of_command(name)
    if not isinstance(flag, Argument)
]
TYPED = [each for each in OPTIONS if each[2] in (int, float) or is_choice(each[2])]
LIMITED = [each for each in TYPED if {"min", "max"} & each[3].settings.keys()]
MUST = [
    (name, field, flag)
    for name in COMMANDS
    for field, _, flag in flags_of_command(name)
    if field.default is MISSING
]


def ids(rows):
    return [f"{row[0]} {row[1].name}" for row in rows]


def complaint(done, name):
    """Return the message and the hint of a refused line, which must be all that was said."""
    assert (done.code, done.out) == (2, "")
    message, hint = done.err.splitlines()
    prefix = f"error: handeye {name}: expected "
    assert message.startswith(prefix)
    assert hint.startswith("hint: ")
    return message.removeprefix(prefix), hint


def refused(handeye, name, field, flag, value, *, attached):
    option = flag_name(field, flag)
    words = [f"{option}={value}"] if attached else [option, value]
    done = handeye(*name.split(), *required(name, without=field.name), *words)
    return complaint(done, name)[0]


@pytest.mark.parametrize(("name", "field", "kind", "flag"), TYPED, ids=ids(TYPED))
def test_a_value_of_the_wrong_kind_is_told(handeye, name, field, kind, flag):
    told = refused(handeye, name, field, flag, "abc", attached=False)
    assert told == refused(handeye, name, field, flag, "abc", attached=True)
    assert told.startswith(f"{flag_name(field, flag)} to be ")
    assert told.endswith(", found 'abc'")
    wanted = [each.value for each in kind] if is_choice(kind) else ["number"]
    assert all(word in told for word in wanted)


@pytest.mark.parametrize(("name", "field", "kind", "flag"), LIMITED, ids=ids(LIMITED))
def test_a_number_beyond_its_limit_is_told(handeye, name, field, kind, flag):
    low, high = flag.settings.get("min"), flag.settings.get("max")
    value = kind(low - 1 if high is None else high + 1)
    told = refused(handeye, name, field, flag, f"{value}", attached=True)
    assert f"found '{value}'" in told
    assert low is None or f"at least {low:g}" in told
    assert high is None or f"at most {high:g}" in told


@pytest.mark.parametrize(("name", "field", "flag"), MUST, ids=ids(MUST))
def test_what_is_missing_is_named(handeye, name, field, flag):
    told, hint = complaint(handeye(*name.split(), *required(name, without=field.name)), name)
    assert flag.settings["metavar"] in told
    assert told.endswith(", found none")
    assert hint == f"hint: handeye {name} --help shows what there is"


@pytest.mark.parametrize("name", COMMANDS)
def test_an_unknown_flag_is_told_with_the_one_that_was_meant(handeye, name):
    told, hint = complaint(handeye(*name.split(), *required(name), "--quite"), name)
    assert told == "one of its flags, found '--quite'"
    assert hint == "hint: did you mean --quiet?"


@pytest.mark.parametrize(
    ("line", "message", "hint"),
    [
        ("slove", "expected a command, found 'slove'", "did you mean handeye solve?"),
        ("xyz", "expected a command, found 'xyz'", "handeye --help lists them"),
        ("--foo", "handeye: expected one of its flags, found '--foo'", "handeye --help shows"),
        ("solve in --target", "expected a value after --target, found none", "handeye solve"),
        ("solve in --quiet=3", "expected --quiet without a value, found '3'", "handeye solve"),
        ("simulate recroding", "(recroding)", "handeye simulate --help"),
    ],
)
def test_other_faults_of_a_line(handeye, line, message, hint):
    done = handeye(*shlex.split(line))
    assert (done.code, done.out) == (2, "")
    assert message in done.err.splitlines()[0]
    assert hint in done.err.splitlines()[1]

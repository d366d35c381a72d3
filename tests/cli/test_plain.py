"""A plain command line means the same to the quick reader as to Typer."""

from types import SimpleNamespace

import pytest
from typer.main import get_command

from handeye_cli.cli.options import Output, Pairs, Solver, Source, Work
from handeye_cli.cli.plain import plain_groups
from handeye_cli.cli.plan_options import Layout
from handeye_cli.cli.typer_front import application
from handeye_cli.conventions import Setup

SEEN = []


def probe(*, source: Source, solver: Solver, work: Work, output: Output) -> None:
    """Take note of what was read."""
    SEEN.append({"source": source, "solver": solver, "work": work, "output": output})


def by_typer(words):
    SEEN.clear()
    command = get_command(application({"probe": SimpleNamespace(probe=probe, EXAMPLES=())}))
    with pytest.raises(SystemExit) as end:
        command(["probe", *words], prog_name="handeye")
    return SEEN[0] if end.value.code == 0 else None


@pytest.mark.parametrize(
    "words",
    [
        "in.yaml",
        "-",
        "in.yaml -o out.yaml",
        "-o - in.yaml --force -q --json",
        "--method=tsai-lenz in.yaml --pairs all",
        "in.yaml --setup eye-to-hand --output=a=b --pose-units mm",
        "in.yaml --target=t --method=-x",
        "in.yaml --allow-outside --quaternion-order=wxyz --robot-poses base-in-gripper",
    ],
)
def test_plain_lines_are_read_as_typer_reads_them(words):
    found = plain_groups(probe, words.split())
    assert found is not None
    assert found == by_typer(words.split())


def test_values_have_the_types_of_their_fields():
    groups = plain_groups(probe, ["in.yaml", "--pairs", "all", "--setup", "eye-to-hand"])
    assert groups["solver"].pairs is Pairs.ALL
    assert groups["source"].setup is Setup.EYE_TO_HAND


@pytest.mark.parametrize(
    "words",
    [
        "",
        "a.mcap b.mcap",
        "a.mcap --setup eye-in-hand b.mcap c.mcap",
        "in.yaml --help",
        "in.yaml -h",
        "in.yaml --metod tsai-lenz",
        "in.yaml --method",
        "in.yaml --method --force",
        "in.yaml --pairs some",
        "in.yaml --setup=",
        "in.yaml --force=yes",
        "in.yaml --workers 2",
        "in.yaml -qo out.yaml",
        "in.yaml -oout.yaml",
        "-- in.yaml",
        "in.yaml --method a --method b",
    ],
)
def test_all_other_lines_are_left_to_typer(words):
    assert plain_groups(probe, words.split()) is None


def test_further_inputs_may_stand_anywhere():
    read = by_typer(["a.mcap", "--setup", "eye-in-hand", "b.mcap", "-q", "c.mcap"])["source"]
    assert read.paths == ("a.mcap", "b.mcap", "c.mcap")
    assert by_typer(["a.mcap"])["source"].paths == ("a.mcap",)


def test_a_flag_that_is_required_makes_a_line_without_it_one_for_typer():
    def plan(*, layout: Layout) -> None:
        """Do nothing."""

    assert plain_groups(plan, ["--distance", "170mm"]) is None

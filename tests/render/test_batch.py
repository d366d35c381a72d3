"""The table of a batch, as people see it."""

import io

from documents.test_batch import BATCH

from handeye_cli.records.batch import Batch, BatchRow
from handeye_cli.render.batch import show_batch, show_complaints, summary
from handeye_cli.render.console import make_console


def shown(show, batch):
    stream = io.StringIO()
    console = make_console(stream)
    console.width = 80
    show(batch, console)
    return stream.getvalue().splitlines()


def test_the_worst_stand_on_top_and_their_reasons_below():
    lines = shown(show_batch, BATCH)
    assert lines[0] == "4 recordings: 1 failed, 1 missed a limit, 1 cancelled, 1 ok"
    table = [line.split() for line in lines if line.startswith("  ")]
    assert [cells[:3] for cells in table[2:6]] == [
        ["no", "failed", "4"],
        ["cells/00.mcap", "gate", "6"],
        ["late", "cancelled", "130"],
        ["007", "ok", "0"],
    ]
    assert table[2][3:] == ["-/0", "-", "-", "-", "-", "-"]
    assert table[3][3:] == ["11/12", "0.810", "0.190", "0.910", "0.290", "1.2"]
    assert max(map(len, lines[: lines.index("")])) <= 80


def test_complaints_are_whole_lines_with_the_advice_below():
    assert shown(show_complaints, BATCH) == [
        "failed: no: nothing there",
        "gate: cells/00.mcap: calibrated on 6 stations: the errors contradict the prediction",
        "gate: cells/00.mcap: few-stations, time-offset",
        "gate: cells/00.mcap: the errors seen contradict the prediction, beyond chance",
        "  look at it",
    ]


def test_nothing_wrong_is_nothing_to_say():
    batch = Batch((BatchRow("a"),))
    assert shown(show_complaints, batch) == []
    assert summary(batch) == "1 recording: 1 ok"


def test_a_name_cannot_command_the_terminal():
    batch = Batch((BatchRow("a\x1b[31m", message="m\x07"),))
    assert "\x1b" not in "".join(shown(show_batch, batch))
    assert "\x07" not in "".join(shown(show_batch, batch))

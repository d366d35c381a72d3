"""The report of a robot's recording: its topics, frames and pauses, and what would be used."""

from __future__ import annotations

from collections.abc import Iterator

from rich.console import Console

from handeye_cli.records import Camera
from handeye_cli.records.recording_summary import (
    LinkSummary,
    MissingFlag,
    PauseSummary,
    RecordingSummary,
    TopicSummary,
    UsedParts,
)
from handeye_cli.render.console import show_table
from handeye_cli.render.text import NOTHING, count, printable

_SPECS = "such as chessboard:9x6:23.6mm or disc-grid:6x6:5mm:4mm"
_MOST_PAUSES = 40
"""Pauses that are listed."""


def show_recording_summary(summary: RecordingSummary, console: Console) -> None:
    """Print what a recording holds, and the command that calibrates from it."""
    cut = ", its end is missing" if summary.cut else ""
    console.print(f"Topics of the recording ({summary.duration:.1f} s{cut})")
    _show_topics(summary, console)
    if summary.links:
        console.print("Frames")
        for line in _tree(summary.links):
            console.print(f"  {line}", soft_wrap=True)
        console.print()
    if summary.pauses:
        _show_pauses(summary.pauses, console)
    console.print("What is used")
    show_table(console, ["", ""], _used(summary.used), left=[0, 1])
    console.print("To calibrate from it, fill in and run" if summary.missing else "Run")
    console.print(f"  {printable(summary.command)}", soft_wrap=True)
    for each in summary.missing:
        console.print(f"  {each.flag}: {printable(_choices(each))}", soft_wrap=True)
    console.print()


def _show_topics(summary: RecordingSummary, console: Console) -> None:
    # The name stands above its messages: beside them the two would be wider than a terminal.
    rows = [row for topic in summary.topics for row in _topic(topic)]
    show_table(console, ["topic", "count", "rate\nHz", "use"], rows, left=[0, 3])


def _topic(topic: TopicSummary) -> list[list[str]]:
    messages = f"  {topic.schema or NOTHING} ({topic.encoding})"
    rate = NOTHING if topic.rate is None else f"{topic.rate:.1f}"
    return [[topic.name, "", "", ""], [messages, str(topic.count), rate, topic.role]]


def _tree(links: tuple[LinkSummary, ...]) -> Iterator[str]:
    """Yield a line for every frame, indented below the one it hangs from."""
    below: dict[str, list[LinkSummary]] = {}
    for link in links:
        below.setdefault(link.parent, []).append(link)
    children = {link.child for link in links}
    # frames in a loop hang from no root, but are to be seen all the same
    roots = [parent for parent in below if parent not in children] or list(below)[:1]
    seen = set(roots)
    for root in roots:
        yield printable(root)
        open_links = [(1, link) for link in reversed(below[root])]
        while open_links:
            depth, link = open_links.pop()
            yield f"{'  ' * depth}{printable(link.child)} ({link.motion}, {link.count})"
            if link.child not in seen:
                seen.add(link.child)
                inner = reversed(below.get(link.child, []))
                open_links += [(depth + 1, each) for each in inner]


def _show_pauses(pauses: tuple[PauseSummary, ...], console: Console) -> None:
    used = sum(pause.images > 0 for pause in pauses)
    console.print(f"{count(len(pauses), 'pause')} of the robot, {used} with images")
    rows = [
        [f"{pause.start:.1f}", f"{pause.duration:.2f}", str(pause.images)]
        for pause in pauses[:_MOST_PAUSES]
    ]
    show_table(console, ["start\ns", "length\ns", "images"], rows, left=[])
    if len(pauses) > _MOST_PAUSES:
        console.print(f"  and {len(pauses) - _MOST_PAUSES} more\n")


def _used(used: UsedParts) -> list[list[str]]:
    way = " -> ".join(used.frames)
    robot = f"{used.pose_topic}: {way}" if used.pose_topic else way
    return [
        ["images", used.image_topic or NOTHING],
        ["intrinsics", _intrinsics(used)],
        ["robot", robot or NOTHING],
        ["clock", used.clock or NOTHING],
    ]


def _intrinsics(used: UsedParts) -> str:
    if used.camera is None:
        return used.camera_file or NOTHING
    return f"{used.camera_info_topic or NOTHING}: {_pinhole(used.camera)}"


def _pinhole(camera: Camera) -> str:
    return (
        f"{camera.width}x{camera.height}, focal {camera.fx:.1f} {camera.fy:.1f} px, "
        f"centre {camera.cx:.1f} {camera.cy:.1f}, {camera.model}"
    )


def _choices(missing: MissingFlag) -> str:
    if missing.choices:
        return " or ".join(missing.choices)
    return _SPECS if missing.flag == "--target" else "what it is"

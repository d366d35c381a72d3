"""Messages written as in ROS 1, which `mcap convert` takes over from bags."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from handeye_cli.recording.in_order import Cursor, Form, reader
from handeye_cli.recording.layout import Field, Kind, Layout, Values

_FORM = Form("<", widest=1, seconds="I", zero_ended=False)
_HEADER = "std_msgs/Header"


def decoder(layout: Layout) -> Callable[[bytes], Values]:
    """Return the function that decodes payloads of some layout.

    It raises struct.error or ValueError for a payload that is none.
    """
    read = reader(_counted(layout), _FORM)

    def decode(data: bytes, cursor: Callable[[bytes, int], Cursor] = Cursor) -> Values:
        return read(cursor(data, 0))

    return decode


def _counted(layout: Layout) -> Layout:
    """Return a layout with the one field that ROS 2 dropped: every header begins with a count."""
    fields = tuple(
        replace(field, kind=_counted(field.kind)) if isinstance(field.kind, Layout) else field
        for field in layout.fields
    )
    count = (Field("seq", Kind.UINT32),) if layout.name == _HEADER else ()
    return Layout(layout.name, (*count, *fields))

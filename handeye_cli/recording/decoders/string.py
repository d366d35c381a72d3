"""`std_msgs/String`."""

from __future__ import annotations

from handeye_cli.recording.layout import Values
from handeye_cli.recording.messages import TextMessage

DEFINITION = "string data\n"
"""Its only field, the same in every release of ROS."""


def decode(message: Values) -> TextMessage:
    """Return a decoded message as ours."""
    return TextMessage(message["data"])

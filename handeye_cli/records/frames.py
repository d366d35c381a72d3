"""What a robot calls the frames that a calibration is about."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RobotFrames:
    """Names of frames, and when a recording of them begins.

    Attributes:
        base: The robot's base; empty when unknown, as are the others.
        gripper: What the robot's controller moves.
        camera: The camera, in which z points along the line of sight.
        start_ns: Nanoseconds since the epoch of the recorder's clock; 0 when unknown.
    """

    base: str = ""
    gripper: str = ""
    camera: str = ""
    start_ns: int = 0

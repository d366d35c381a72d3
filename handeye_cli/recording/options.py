"""What a reader of recordings can be told."""

from __future__ import annotations

from dataclasses import dataclass, field

from handeye_cli.conventions import Setup
from handeye_cli.records import TargetSpec


@dataclass(frozen=True)
class PauseThresholds:
    """When a robot counts as standing still.

    The speeds are floors: a recording with faster motion raises them to `relative` times its
    typical speed. With poses that scatter by 0.1 mm and 0.1 mrad per axis, the speed seen over the
    shortest window stays below these floors.

    Attributes:
        speed: Metres per second.
        turn_rate: Radians per second.
        relative: Fraction of the typical speed while moving.
        drift: Metres between the two halves of a pause beyond which it is slow motion instead.
        turn: Radians between the two halves of a pause, likewise.
        min_duration_ns: A shorter standstill is no pause.
        max_gap_ns: A silence of the pose source longer than this ends a pause.
    """

    speed: float = 3e-3
    turn_rate: float = 3e-3
    relative: float = 0.02
    drift: float = 0.5e-3
    turn: float = 0.5e-3
    min_duration_ns: int = 300_000_000
    max_gap_ns: int = 500_000_000


@dataclass(frozen=True)
class McapOptions:
    """Choices for reading an MCAP recording; None means: find it in the file.

    Attributes:
        setup: Where the camera is fixed. No recording says it, so it is required for reading.
        target: The calibration target, handed on as it is.
        image_topic: Topic of the images.
        camera_info_topic: Topic of the intrinsics.
        pose_topic: Topic of stamped poses of the gripper, in place of TF.
        base_frame: TF frame of the robot's base.
        gripper_frame: TF frame the robot's controller moves.
        time_offset_ns: Added to the images' times: `t_robot = t_image + time_offset`. Positive when
            an image is stamped earlier than the robot's pose of the same instant.
        pauses: When the robot counts as standing still.
        moving: Whether frames in motion are the stations, whatever pauses there are.
        own_intrinsics: Whether the intrinsics come from elsewhere, so that none are looked for.
    """

    setup: Setup | None = None
    target: TargetSpec | None = None
    image_topic: str | None = None
    camera_info_topic: str | None = None
    pose_topic: str | None = None
    base_frame: str | None = None
    gripper_frame: str | None = None
    time_offset_ns: int = 0
    pauses: PauseThresholds = field(default_factory=PauseThresholds)
    moving: bool = False
    own_intrinsics: bool = False

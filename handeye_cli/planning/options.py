"""What a user may say of the cell, the noise and the kind of plan that is wanted."""

from __future__ import annotations

from dataclasses import dataclass

from handeye_cli.planning.prediction import PAPERS_LEVER
from handeye_cli.records import Camera, FloatArray, Noise


@dataclass(frozen=True)
class Limits:
    """What every station has to keep; None where there is no such limit.

    Attributes:
        margin: Pixels that the target's points keep from the image's border; a fiftieth of the
            width when None.
        depth: Smallest and largest z of the target's points in the camera frame, metres.
        max_tilt: Between the line of sight to the aim point and the target's normal, radians.
        max_roll: Turn of the camera about its own axis, to either side, radians.
        box: (2, 3) smallest and largest coordinates of the gripper in the base, metres.
        reach: Largest distance of the gripper from the base's origin, metres.
        cone: (4,) a direction in the base, and how far the gripper's z axis may turn away from it,
            radians.
        avoid_axis: Number of a base axis, 0 to 2, and the largest component along it, radians, of
            the rotation vector between the gripper at any two stations.
        min_rotation: Smallest rotation of the gripper between any two stations, radians.
    """

    margin: float | None = None
    depth: tuple[float, float] | None = None
    max_tilt: float | None = None
    max_roll: float | None = None
    box: FloatArray | None = None
    reach: float | None = None
    cone: FloatArray | None = None
    avoid_axis: tuple[int, float] | None = None
    min_rotation: float | None = None


NO_LIMITS = Limits()
"""Nothing but the view of the target, where that is known."""


NO_NOISE = Noise()
"""No level is stated."""


@dataclass(frozen=True)
class PlanOptions:
    """How a plan goes past the paper's circle.

    Attributes:
        points: (n, 3) points of the target, metres, or None when it is not known.
        camera: The intrinsics, or None.
        given: Noise levels the user states; what is None in it comes from `known`, or the paper.
        known: Noise levels of an earlier calibration, or None.
        lever: From the gripper to the camera, or for eye-to-hand to the target, metres; used where
            no guess says more.
        limits: What every station has to keep.
        optimize: Whether stations are chosen for the smallest error, not laid on the circle.
        shortest_way: Whether the order of the shortest way through the stations is added.
    """

    points: FloatArray | None = None
    camera: Camera | None = None
    given: Noise = NO_NOISE
    known: Noise | None = None
    lever: float = PAPERS_LEVER
    limits: Limits = NO_LIMITS
    optimize: bool = False
    shortest_way: bool = False

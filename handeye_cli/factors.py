"""The critical factors of the paper's section III-B, measured on the stations of a recording."""

from __future__ import annotations

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.conventions import Setup
from handeye_cli.geometry import rotations, se3, statistics
from handeye_cli.geometry.error_formulas import successive_axes_angles
from handeye_cli.records import CriticalFactors, FloatArray, IntArray, Spread
from handeye_cli.solvers.motions import interstation_motions
from handeye_cli.what_if import distances


def measured_factors(
    chain: Chain,
    pairs: IntArray,
    setup: Setup,
    *,
    centre: FloatArray,
    robot_share: FloatArray | None = None,
) -> CriticalFactors:
    """Measure what the accuracy of a recording depends on.

    Args:
        chain: The stations that are used.
        pairs: (m, 2) their interstation pairs.
        setup: Where the camera is fixed.
        centre: (3,) point of the target that its distance is measured to, metres.
        robot_share: (2,) part of the robot's noise in the predicted mean squares of rotation and
            translation, or None where the camera's noise is unknown.
    """
    _, motion_c = interstation_motions(chain.A, chain.B, pairs)
    robot = chain.A if setup is Setup.EYE_IN_HAND else se3.inverse(chain.A)
    ways = robot[pairs[:, 0], :3, 3] - robot[pairs[:, 1], :3, 3]
    share = (None, None) if robot_share is None else robot_share.tolist()
    return CriticalFactors(
        stations=len(chain.A),
        axes_angle=_spread(successive_axes_angles(motion_c, pairs)),
        interstation_angle=_spread(rotations.angle(motion_c[:, :3, :3])),
        camera_distance=_spread(distances(chain.B, centre)),
        gripper_distance=_spread(np.linalg.norm(ways, axis=1)),
        robot_share_rotation=share[0],
        robot_share_translation=share[1],
    )


def _spread(values: FloatArray) -> Spread:
    return Spread(statistics.median(values), float(np.min(values)), float(np.max(values)))

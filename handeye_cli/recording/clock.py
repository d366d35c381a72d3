"""Which time of a message counts: the one in its header or the one of its recording."""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from handeye_cli.recording import findings
from handeye_cli.records import Finding, IntArray

AGREEMENT_NS = 200_000_000
"""Largest difference between the delays (recorded minus stamped) of images and of poses."""


class Clock(StrEnum):
    """A source of times."""

    STAMP = "header.stamp"
    LOG = "log_time"


def choose(
    image_stamps_ns: IntArray,
    image_log_times_ns: IntArray,
    pose_stamps_ns: IntArray,
    pose_log_times_ns: IntArray,
) -> tuple[Clock, Finding | None]:
    """Choose one clock for images and poses.

    The stamps tell when an image or a pose was taken and are used whenever they can be: every
    message has one, and both kinds are recorded about equally long after they were stamped. That
    holds for two real clocks as well as for the clock of a simulation.

    Args:
        image_stamps_ns: (n,) stamps of the images, n > 0.
        image_log_times_ns: (n,) times of recording.
        pose_stamps_ns: (m,) stamps of the poses, m > 0.
        pose_log_times_ns: (m,) times of recording.

    Returns:
        The clock, and a finding when it is the time of recording.
    """
    for kind, stamps in (("images", image_stamps_ns), ("poses", pose_stamps_ns)):
        unset = int(np.count_nonzero(stamps == 0))
        if unset:
            return Clock.LOG, findings.clock_log_time(
                f"{unset} of {len(stamps)} {kind} carry no stamp"
            )
    image_delay = float(np.median(image_log_times_ns - image_stamps_ns))
    pose_delay = float(np.median(pose_log_times_ns - pose_stamps_ns))
    if abs(image_delay - pose_delay) > AGREEMENT_NS:
        difference = (image_delay - pose_delay) / 1e9
        return Clock.LOG, findings.clock_log_time(
            f"the stamps of images and poses come from clocks {difference:.3f} s apart"
        )
    return Clock.STAMP, None

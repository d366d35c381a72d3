"""Which time of a message counts: the one in its header or the one of its recording."""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from handeye_cli.recording import findings
from handeye_cli.records import Finding, FloatArray, IntArray

AGREEMENT_NS = 200_000_000
"""Largest difference between the delays (recorded minus stamped) of images and of poses."""

_PARTS = 10
_FEWEST_PARTS = 4
_IMAGES_IN_PART = 10
"""A clock that is set while recording shows between parts of it with so many images."""


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
    step = _step(image_stamps_ns, image_log_times_ns, pose_stamps_ns, pose_log_times_ns)
    if step > AGREEMENT_NS:
        return Clock.LOG, findings.clock_log_time(
            f"the clock of the images or that of the poses was set by {step / 1e9:.3f} s or more"
            " while they were recorded"
        )
    return Clock.STAMP, None


def _step(
    image_stamps_ns: IntArray,
    image_log_times_ns: IntArray,
    pose_stamps_ns: IntArray,
    pose_log_times_ns: IntArray,
) -> float:
    """Return how much the clocks of images and poses went apart while recording, nanoseconds.

    Of each part of the recording the least delays count, which no congestion makes longer. One part
    alone tells nothing: both clocks may have been set in it, between an image and a pose.
    """
    parts = min(_PARTS, len(image_stamps_ns) // _IMAGES_IN_PART)
    if parts < _FEWEST_PARTS:
        return 0.0
    edges = np.linspace(image_log_times_ns.min(), image_log_times_ns.max() + 1, parts + 1)[1:-1]
    of_images, of_poses = (
        _least_delays(stamps, times, np.searchsorted(edges, times, side="right"), parts)
        for stamps, times in (
            (image_stamps_ns, image_log_times_ns),
            (pose_stamps_ns, pose_log_times_ns),
        )
    )
    both = np.isfinite(of_images) & np.isfinite(of_poses)
    apart = np.sort(of_images[both] - of_poses[both])
    if len(apart) < _FEWEST_PARTS:
        return 0.0
    return float(min(np.ptp(apart[1:]), np.ptp(apart[:-1])))


def _least_delays(
    stamps_ns: IntArray, log_times_ns: IntArray, part: IntArray, parts: int
) -> FloatArray:
    """Return the (parts,) least times from stamp to recording; infinite where there is none."""
    least = np.full(parts, np.inf)
    np.minimum.at(least, part, log_times_ns - stamps_ns)
    return least

"""Refuses data that do not determine the answer, and names what stays open.

Everything is judged against the noise that the data themselves show: the difference between the
robot's and the camera's rotation angles needs no solution.
"""

from __future__ import annotations

import numpy as np

from handeye_cli.chain import MIN_STATIONS, Chain
from handeye_cli.conventions import Setup
from handeye_cli.errors import UndeterminedError
from handeye_cli.geometry import rotations, statistics
from handeye_cli.geometry.loop import loop_jacobians
from handeye_cli.geometry.observability import (
    MotionSpread,
    ScrewScale,
    half_turns,
    motion_spread,
    screw_scale,
)
from handeye_cli.records import FloatArray, IntArray, Noise, PredictedError
from handeye_cli.solvers.motions import interstation_motions
from handeye_cli.solvers.problem import Solution

_SIGNIFICANCE = 4.0
"""A rotation has to exceed the noise by this factor to count."""
_CONTRADICTION = 0.1
"""Rotations of robot and camera that differ by more than this (radians) are not the same motion."""
_HIDDEN = 3.0
"""Axes spread by less than this factor times the noise of a rotation are not told apart."""
_LARGEST_SCALE = 0.15
"""Natural logarithm of a ratio of lengths that wrong intrinsics still explain."""
_MOVED = 0.3
"""Share of the camera's distance by which no noise moves a target."""
_FARTHEST = 50.0
"""Metres between the frames of a robot cell, at most."""
_SCALE_SIGNIFICANCE = 8.0
"""Factor by which a ratio of lengths must exceed its scatter: pairs share stations and noise."""
_LARGEST_SIGMA = 0.35
"""A rotation less certain than this (radians) is not determined."""
_WAY_OUT = "'handeye solve --partial' gives what is determined"


def check_count(chain: Chain, setup: Setup, recorded: int) -> None:
    """Check that there are stations enough, the minimum of the paper's lemmas VII and IX.

    Args:
        chain: One usable station or more.
        setup: Names the frame of the mount.
        recorded: How many stations there are, usable or not.

    Raises:
        UndeterminedError: There are one or two; it names what they leave open.
    """
    if len(chain.A) < MIN_STATIONS:
        raise UndeterminedError(
            f"expected at least {MIN_STATIONS} stations with a target pose, found {len(chain.A)} "
            f"of {recorded}: {_left_open(chain, setup)}",
            hint="record more stations; 'handeye extract' lists why images were not used. "
            f"{_WAY_OUT}",
        )


def _left_open(chain: Chain, setup: Setup, least: tuple[int, int] = (0, 0)) -> str:
    """Return what stations leave open in words; what finds it is loaded with the error only."""
    from handeye_cli.diagnosis.undetermined import explain, free_directions

    return explain(free_directions(chain, least=least), setup)


def check_freedom(chain: Chain, given: Noise | None, setup: Setup) -> None:
    """Check that nothing of the answer is free, for stations on which an estimation has failed.

    Args:
        chain: The stations.
        given: Noise levels that are taken as given.
        setup: Names the frame of the mount.

    Raises:
        UndeterminedError: Something is free; it is named.
    """
    from handeye_cli.diagnosis.undetermined import explain, free_directions

    free = free_directions(chain, given)
    if any(free.counts):
        raise UndeterminedError(
            f"expected motions that exceed their noise, found too little: {explain(free, setup)}",
            hint=f"add stations turned about two different axes, by 20 deg or more; {_WAY_OUT}",
        )


def check_motions(chain: Chain, pairs: IntArray, setup: Setup) -> MotionSpread:
    """Check that the motions determine a rotation and a translation.

    Args:
        chain: The stations.
        pairs: (m, 2) interstation pairs.
        setup: Names the frame of the mount.

    Raises:
        UndeterminedError: The robot does not turn, turns about one axis only, or does not make the
            motions that the camera sees.
    """
    motions = interstation_motions(chain.A, chain.B, pairs)
    spread = motion_spread(*motions)
    noise = _SIGNIFICANCE * spread.mismatch
    if spread.median_mismatch > _CONTRADICTION:
        raise UndeterminedError(
            "expected the camera to turn by the same angles as the robot, found a median "
            f"difference of {np.degrees(spread.median_mismatch):.1f} deg between stations",
            hint="check that images and poses belong together, the Euler order and the "
            "quaternion order (--quaternion-order)",
        )
    if spread.largest_angle <= noise:
        raise UndeterminedError(
            "expected stations that differ in rotation, found a largest interstation angle of "
            f"{np.degrees(spread.largest_angle):.2g} deg at a noise of "
            f"{np.degrees(spread.mismatch):.2g} deg: {_left_open(chain, setup, (0, 3))}",
            hint=f"add stations turned about two different axes, by 20 deg or more; {_WAY_OUT}",
        )
    if spread.second_axis <= noise:
        raise UndeterminedError(
            "expected rotations about two different axes, found only one: "
            f"{_left_open(chain, setup, (0, 1))}",
            hint=f"add stations turned about another axis, by 20 deg or more; {_WAY_OUT}",
        )
    scale = screw_scale(*motions)
    # Of motions without a translation along their axes, as on a circle, noise is all there is.
    if scale.signal > _SIGNIFICANCE * spread.mismatch:
        _check_scale(scale)
    return spread


def _check_scale(scale: ScrewScale) -> None:
    """Refuse lengths that contradict each other clearly: units, or the size of the target."""
    apart = abs(float(np.log(scale.ratio)))
    if apart <= _LARGEST_SCALE or min(apart, 1.0) <= _SCALE_SIGNIFICANCE * scale.sigma:
        return
    found = f"found them {scale.ratio:.4g} times as long (+- {100 * scale.sigma:.1f} %)"
    thousand = abs(apart - np.log(1000.0)) < np.log(2.0)
    hint = (
        "one side is in millimetres: check --pose-units and the lengths of the target"
        if thousand
        else f"the target's lengths would have to be {scale.ratio:.3f} times as large: measure it, "
        "and check --target and --pose-units"
    )
    raise UndeterminedError(
        f"expected the robot's motions to be as long as the camera's along their axes, {found}",
        hint=hint,
    )


def check_agreement(chain: Chain, solution: Solution) -> None:
    """Check that the stations agree on a rough solution, and on no other one.

    Raises:
        UndeterminedError: They see the target turned or moved against each other by more than any
            noise, or fit another answer as well.
    """
    residuals = loop_jacobians(chain.A, chain.B, solution.X, solution.Z).residuals
    turned = statistics.median(np.linalg.norm(residuals[:, 3:], axis=1))
    moved = statistics.median(np.linalg.norm(residuals[:, :3], axis=1))
    away = statistics.median(np.linalg.norm(chain.B[:, :3, 3], axis=1))
    if turned <= _CONTRADICTION and moved <= _MOVED * away:
        _check_single(chain, solution)
        return
    if turned > _CONTRADICTION:
        found = f"turned by {np.degrees(turned):.1f} deg"
    else:
        found = f"moved by {1e3 * moved:.0f} mm at a distance of {1e3 * away:.0f} mm"
    raise UndeterminedError(
        f"expected all stations to see the target in one place, found it {found} in the median",
        hint="check --robot-poses (gripper-in-base or base-in-gripper), --quaternion-order, "
        "--pose-units and --setup",
    )


def _check_single(chain: Chain, solution: Solution) -> None:
    """Refuse half turns that leave two answers; what looks for the other is loaded for them."""
    if not half_turns(chain.A[0, :3, :3], chain.A[1:, :3, :3]).any():
        return
    from handeye_cli.diagnosis.second_answer import second_answer

    other = second_answer(chain, solution)
    if other is None:
        return
    places = [f"({_numbers(1e3 * each.X[:3, 3])}) mm" for each in (solution, other)]
    turn = np.degrees(float(rotations.angle(solution.X[:3, :3].T @ other.X[:3, :3])))
    raise UndeterminedError(
        "expected stations that fit one answer, found two or more, as half turns allow: the camera "
        f"is at {places[0]}, or turned by {turn:.0f} deg against that and at {places[1]}",
        hint="add stations that are turned from the others by 20 to 150 deg, about different axes",
    )


def _numbers(values: FloatArray) -> str:
    return ", ".join(f"{value:.1f}" for value in np.round(values, 1) + 0.0)


def check_distances(solution: Solution, setup: Setup) -> None:
    """Check that the answer is of the size of a robot cell.

    A circle of stations has no translation along its axes, so nothing contradicts robot poses in
    millimetres that are read as metres, but a camera hundreds of metres from its mount.

    Raises:
        UndeterminedError: The camera or the target is farther away than any robot reaches.
    """
    for name, pose in ((setup.answer, solution.X), (setup.constant, solution.Z)):
        distance = float(np.linalg.norm(pose[:3, 3]))
        if distance > _FARTHEST:
            raise UndeterminedError(
                f"expected a translation of {name} within {_FARTHEST:g} m, found {distance:.0f} m",
                hint="the robot's poses may be in millimetres: --pose-units mm",
            )


def check_certainty(
    error: PredictedError,
    covariance: FloatArray,
    spread: MotionSpread,
    setup: Setup,
    *,
    chain: Chain | None = None,
    given: Noise | None = None,
) -> None:
    """Check that the predicted error leaves something of the answer.

    A spread of axes that is mere noise is fitted as if it were motion, and then makes the predicted
    error too small; so the spread has to exceed the noise of an interstation rotation as well.

    Args:
        error: The predicted error of the answer.
        covariance: (N, 12, 12) of the stations' poses.
        spread: What `check_motions` measured.
        setup: Names the frame of the mount.
        chain: The stations, which tell whether translations across the main axis settle the
            rotation about it; without them it counts as open.
        given: Noise levels that are taken as given.

    Raises:
        UndeterminedError: The noise hides an axis.
    """
    variance = np.einsum("nii->ni", covariance)[:, [3, 4, 5, 9, 10, 11]]
    motion_noise = float(np.sqrt(2.0 * np.mean(np.sum(variance, axis=1)) / 3.0))
    hidden = spread.second_axis <= _HIDDEN * motion_noise
    if not hidden and error.rotation <= _LARGEST_SIGMA:
        return
    from handeye_cli.diagnosis.undetermined import explain, free_directions
    from handeye_cli.geometry.free_directions import Freedom

    free = Freedom(spread.main_axis[None], spread.main_axis[None])
    if chain is not None:
        free = free_directions(chain, given, least=(0, 1))
    raise UndeterminedError(
        "expected rotations about two different axes, found that across the main one the stations "
        f"turn by {np.degrees(spread.second_axis):.2g} deg only, at a noise of "
        f"{np.degrees(motion_noise):.2g} deg: {explain(free, setup)}",
        hint=f"add stations turned about another axis, by 20 deg or more; {_WAY_OUT}",
    )

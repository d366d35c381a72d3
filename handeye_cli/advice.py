"""What limits the accuracy of a recording, and what each of the paper's steps would gain.

The steps of section III-C are tried on the recording itself, each on its own, and its error is
predicted anew from the covariances. Nearer grippers (step 4) are no step of their own: the robot's
noise is the same at every pose here, and the grippers come nearer when the camera does.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from enum import Enum, auto
from typing import NamedTuple

import numpy as np

from handeye_cli import what_if
from handeye_cli.chain import Chain, has_pixels
from handeye_cli.conventions import MM, MRAD
from handeye_cli.factors import measured_factors
from handeye_cli.geometry import rotations, statistics
from handeye_cli.geometry.loop import isotropic_covariance
from handeye_cli.lasting_causes import LASTING
from handeye_cli.noise_levels import NoiseModel
from handeye_cli.records import (
    CriticalFactors,
    FloatArray,
    Improvement,
    IntArray,
    Noise,
    PredictedError,
    Stations,
)
from handeye_cli.sight import Sight, sight_of
from handeye_cli.solvers import Solution
from handeye_cli.solvers.motions import interstation_motions
from handeye_cli.what_if import Givens, Layout

_DOMINATES = 0.5
"""Part of a mean square error from which on what no step changes is told as well."""
_MOST = 4
_WORTH_IT = 0.1
"""Smallest part of an error that an improvement takes away, of rotation or translation."""
_NO_WORSE = 1.01
_PAPERS_TILT = np.radians(30.0)


class _Intrinsics(Enum):
    """Where the intrinsics come from, and with them their error."""

    EXACT = auto()
    GIVEN = auto()
    FROM_THESE_IMAGES = auto()


class _Case(NamedTuple):
    """A recording whose error can be predicted under changes.

    Attributes:
        layout: Its stations.
        givens: What stays.
        noise: Levels of the noise.
        camera_known: Whether the camera's share of the noise is known.
        sight: What the camera sees, or None when that is unknown.
        resees: Whether the camera's noise follows from what it sees.
        intrinsics: What is known of the error of the intrinsics, which all stations share.
        centre: (3,) point of the target that it is looked at.
        target: Shorthand of the target, or None where that point is its origin.
    """

    layout: Layout
    givens: Givens
    noise: Noise
    camera_known: bool
    sight: Sight | None
    resees: bool
    intrinsics: _Intrinsics
    centre: FloatArray
    target: str | None

    def at(self, B: FloatArray, sight: Sight | None = None) -> FloatArray:
        """Return the (2,) expected error with the stations at other (N, 4, 4) poses B."""
        sight = sight or self.sight
        if sight is None or not self.resees:
            return _total(self.givens.mean_squares(replace(self.layout, B=B)))
        changed = replace(self.layout, B=B, camera_covariance=sight.covariance(B))
        return _total(self.givens.mean_squares(changed))


class _Step(NamedTuple):
    """A change, and what it would lead to.

    Attributes:
        change: Its code.
        action: What would be done, in words.
        error: (2,) rotation and translation error from the noise of the stations.
        shared: What the error that all stations share is multiplied by.
        command: The whole command line that does it, where there is one.
    """

    change: str
    action: str
    error: FloatArray
    shared: float = 1.0
    command: str = ""


def advise(
    stations: Stations,
    chain: Chain,
    pairs: IntArray,
    *,
    method: str,
    solution: Solution,
    model: NoiseModel,
    error: PredictedError,
    lasting: FloatArray,
) -> tuple[CriticalFactors, tuple[Improvement, ...]]:
    """Measure a recording's critical factors and compute what would improve its answer.

    An improvement takes at least a tenth away from the error of rotation or translation and adds to
    neither. What neither the noise of the stations nor `lasting` explains of the error is that of
    the intrinsics; where the cameras stand is taken to leave it as it is.

    Args:
        stations: The document, for its setup, target, camera and pixels.
        chain: The stations that were used.
        pairs: (m, 2) their interstation pairs.
        method: The row of the table of solvers that gave the answer.
        solution: The answer.
        model: The noise of the stations' poses.
        error: The predicted error of the answer.
        lasting: (2,) parts of its squares, rotation and translation, that none of this changes:
            those of a bent target, of the robot's geometry and of an error of all robot poses.

    Returns:
        The factors, and at most four improvements, the best first; before them, where what lasts is
        most of an error, what would be left without it.
    """
    noise = model.noise
    robot = isotropic_covariance(noise.robot_rotation or 0.0, noise.robot_translation or 0.0)
    givens = Givens(stations.setup, method, solution, robot)
    case = _case(stations, chain, pairs, givens, model)
    squares = case.givens.mean_squares(case.layout)
    now = _total(squares)
    reported = np.array([error.rotation, error.translation])
    share = np.clip(squares[0] / np.maximum(now, reported) ** 2, 0.0, 1.0)
    factors = measured_factors(
        chain,
        pairs,
        stations.setup,
        centre=case.centre,
        robot_share=share if case.camera_known else None,
    )
    return factors, _improvements(case, factors, now, reported, lasting)


def _case(
    stations: Stations, chain: Chain, pairs: IntArray, givens: Givens, model: NoiseModel
) -> _Case:
    sight = sight_of(stations, chain)
    resees = has_pixels(stations, chain)
    camera = model.covariance[:, 6:, 6:]
    return _Case(
        layout=Layout(chain.B, sight.covariance(chain.B) if sight and resees else camera, pairs),
        givens=givens,
        noise=model.noise,
        camera_known=bool(np.any(camera)),
        sight=sight,
        resees=sight is not None and resees,
        intrinsics=_intrinsics(stations),
        centre=np.zeros(3) if sight is None else sight.centre,
        target=None if sight is None else _shorthand(stations),
    )


def _shorthand(stations: Stations) -> str | None:
    if stations.target is None:
        return None
    from handeye_cli import targets

    return targets.shorthand(stations.target)


def _intrinsics(stations: Stations) -> _Intrinsics:
    if stations.camera is None or stations.camera.covariance is None:
        return _Intrinsics.EXACT
    from handeye_cli.pixel_data import CALIBRATED

    here = any(finding.code == CALIBRATED for finding in stations.findings)
    return _Intrinsics.FROM_THESE_IMAGES if here else _Intrinsics.GIVEN


def _improvements(
    case: _Case,
    factors: CriticalFactors,
    now: FloatArray,
    reported: FloatArray,
    lasting: FloatArray,
) -> tuple[Improvement, ...]:
    random = np.maximum(reported**2 - lasting, 0.0)
    explained = np.minimum(np.sqrt(random), now)
    shared = np.sqrt(np.maximum(random - explained**2, 0.0))
    found = []
    for step in _steps(case, factors, now):
        after = np.sqrt((explained * step.error / now) ** 2 + (shared * step.shared) ** 2 + lasting)
        gain = 1.0 - np.min(after / reported)
        if gain >= _WORTH_IT and np.all(after <= _NO_WORSE * reported):
            found.append((gain, _improvement(step, reported, after)))
    found.sort(key=lambda each: -each[0])
    steps = tuple(improvement for _, improvement in found[:_MOST])
    return (*_without_lasting(reported, lasting), *steps)


def _without_lasting(reported: FloatArray, lasting: FloatArray) -> tuple[Improvement, ...]:
    """Return what would be left without an error that is no noise, where that dominates."""
    share = lasting / np.maximum(reported, np.finfo(float).tiny) ** 2
    if np.max(share) <= _DOMINATES:
        return ()
    left = np.sqrt(np.maximum(reported**2 - lasting, 0.0))
    rotation, translation = (100.0 * np.minimum(share, 1.0)).tolist()
    action = "taking away what is no noise"
    message = (
        f"{rotation:.0f} % of the mean square error in rotation and {translation:.0f} % in "
        "translation are no noise, and no other step changes them; "
        f"{_promise('taking that away', reported, left)}"
    )
    return (Improvement(LASTING, action, float(left[0]), float(left[1]), message),)


def _improvement(step: _Step, before: FloatArray, after: FloatArray) -> Improvement:
    message = _promise(step.command or step.action, before, after)
    return Improvement(step.change, step.action, float(after[0]), float(after[1]), message)


def _promise(who: str, before: FloatArray, after: FloatArray) -> str:
    rotation, translation = (
        f"from {_short(old)} to {_short(new)}"
        for old, new in zip(before / [MRAD, MM], after / [MRAD, MM], strict=True)
    )
    return f"{who} would take the rotation {rotation} mrad and the translation {translation} mm"


def _steps(case: _Case, factors: CriticalFactors, now: FloatArray) -> Iterator[_Step]:
    yield from _circle(case, factors)
    yield _more_tilted(case, factors)
    yield _nearer(case, factors)
    yield _more_stations(case, factors, now)
    if case.intrinsics is not _Intrinsics.EXACT:
        yield _Step("intrinsics", "halving the error of the intrinsics", now, 0.5)
    if case.camera_known:
        yield _less_camera_noise(case)
    yield _less_robot_noise(case)


def _circle(case: _Case, factors: CriticalFactors) -> Iterator[_Step]:
    """Step 1: the paper's station generator, which 'handeye plan' follows."""
    aside = statistics.median(what_if.tilts(case.layout.B, case.centre))
    tilt = round(np.degrees(np.clip(aside, _PAPERS_TILT, what_if.MAX_ADVISED_TILT)))
    distance = max(round(factors.camera_distance.median / MM), 1)
    whole = None if case.sight is None else case.sight.of_whole_target()
    B = what_if.circle(case.layout.B, case.centre, distance * MM, float(np.radians(tilt)), whole)
    if B is not None:
        action = f"{factors.stations} stations by 'handeye plan': {distance} mm, tilt {tilt} deg"
        command = f"handeye plan --stations {factors.stations} --distance {distance}mm"
        flags = f"--tilt {tilt}deg --setup {case.givens.setup.value}"
        aim = "" if case.target is None else f" --target {case.target}"
        command = f"'{command} {flags}{aim}'"
        yield _Step("circle", action, case.at(B, whole), command=command)


def _more_tilted(case: _Case, factors: CriticalFactors) -> _Step:
    """Step 2: larger interstation rotations."""
    B = what_if.more_tilted(case.layout.B, case.centre, case.sight)
    _, motion = interstation_motions(case.layout.B, B, case.layout.pairs)
    angle = statistics.median(rotations.angle(motion[:, :3, :3]))
    action = (
        f"tilting farther ({np.degrees(factors.interstation_angle.median):.0f} to "
        f"{np.degrees(angle):.0f} deg between stations)"
    )
    return _Step("tilt", action, case.at(B))


def _nearer(case: _Case, factors: CriticalFactors) -> _Step:
    """Step 3: the camera nearer to the target."""
    B = what_if.nearer(case.layout.B, case.centre, case.sight)
    before = factors.camera_distance.median
    after = what_if.distances(B, case.centre)
    half = np.allclose(after, what_if.distances(case.layout.B, case.centre) / 2.0)
    what = "halving the camera distance" if half else "going as near as the view allows"
    action = f"{what} ({before / MM:.0f} to {statistics.median(after) / MM:.0f} mm)"
    return _Step("camera-distance", action, case.at(B))


def _more_stations(case: _Case, factors: CriticalFactors, now: FloatArray) -> _Step:
    """Step 5: errors go with the root of the number of stations."""
    root = float(np.sqrt(0.5))
    shared = root if case.intrinsics is _Intrinsics.FROM_THESE_IMAGES else 1.0
    action = f"{factors.stations} more stations like these {factors.stations}"
    return _Step("more-stations", action, root * now, shared)


def _less_camera_noise(case: _Case) -> _Step:
    """Step 6: better target poses."""
    quiet = replace(case.layout, camera_covariance=case.layout.camera_covariance / 4.0)
    error = _total(case.givens.mean_squares(quiet))
    shared = 0.5 if case.intrinsics is _Intrinsics.FROM_THESE_IMAGES else 1.0
    return _Step("camera-noise", f"halving the {_camera_noise(case)}", error, shared)


def _less_robot_noise(case: _Case) -> _Step:
    """Step 7: a better calibrated robot."""
    still = replace(case.givens, robot_covariance=case.givens.robot_covariance / 4.0)
    error = _total(still.mean_squares(case.layout))
    return _Step("robot-noise", f"halving the {_robot_noise(case)}", error)


def _camera_noise(case: _Case) -> str:
    if case.sight is not None and case.resees:
        return f"pixel noise ({_short(statistics.median(case.sight.sigma))} px)"
    return f"camera's noise ({_levels(case.noise.camera_rotation, case.noise.camera_translation)})"


def _robot_noise(case: _Case) -> str:
    who = "robot's noise" if case.camera_known else "noise of robot and camera"
    return f"{who} ({_levels(case.noise.robot_rotation, case.noise.robot_translation)})"


def _levels(rotation: float | None, translation: float | None) -> str:
    return f"{_short((rotation or 0.0) / MRAD)} mrad, {_short((translation or 0.0) / MM)} mm"


def _short(value: float) -> str:
    """Return three figures, and all of them before the point."""
    return f"{value:.3g}" if value < 1000.0 else f"{value:.0f}"


def _total(mean_squares: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(mean_squares.sum(axis=0)))

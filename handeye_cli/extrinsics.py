"""Stage: the target's pose at every station, from its points' pixels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from handeye_cli import intrinsics, robot_readings, targets
from handeye_cli.conventions import Setup
from handeye_cli.errors import UndeterminedError
from handeye_cli.geometry import pnp
from handeye_cli.records import (
    Camera,
    Features,
    Finding,
    FloatArray,
    Noise,
    Station,
    Stations,
    UncertainPose,
)
from handeye_cli.views import Views, pose_candidates, views_of

_CLEAR_MARGIN = 12.0
"""Chi-square by which the second answer to the planar ambiguity should be worse."""
_GROSS_FACTOR = 20.0
_GROSS_PIXELS = 1.0
"""A view whose residual is above both, the factor times the median and the pixels, went wrong."""


@dataclass(frozen=True)
class _Fit:
    """Chosen pose and quality of each view: (N, 4, 4), (N,) px, (N,) bool, pooled px.

    `margin` is the chi-square by which the next best answer to the planar ambiguity fits worse.
    """

    poses: FloatArray
    rms: FloatArray
    good: NDArray[np.bool_]
    sigma: float
    margin: float


def extrinsics(features: Features, *, calibrate_intrinsics: bool = False) -> Stations:
    """Compute camera_T_target of every station with its covariance from the pixel noise.

    Weak perspective leaves a plane with two poses that explain an image about as well; which one
    is right is decided over all stations together, by the robot's rotations. The pixel noise is
    pooled over the stations, unless the features' `noise` gives it.

    Args:
        features: Target points of all stations.
        calibrate_intrinsics: Estimate the intrinsics from the same images even if they are given.

    Returns:
        All stations; one whose pose could not be computed has the reason.

    Raises:
        UndeterminedError: No station saw the target, or intrinsics cannot be determined.
        InputError: The intrinsics are missing.
        ConvergenceError: The intrinsics did not converge.
    """
    board = targets.build(features.target)
    views = views_of(features.stations, board.points())
    if len(views.index) == 0:
        raise _nothing_seen(features.stations)
    findings = list(features.findings)
    camera = features.camera
    if calibrate_intrinsics or camera is None:
        features, camera, finding = _calibrated(features, board, views)
        views = views_of(features.stations, board.points())
        findings.append(finding)
    fit = _fit(views, camera, features.setup)
    if not fit.good.any():
        raise UndeterminedError(
            f"no pose of the target in front of the camera explains the points of any of "
            f"{len(fit.good)} images, with a focal length of {camera.fx:g} px",
            hint="check the camera's intrinsics, or solve with --calibrate-intrinsics",
        )
    if camera is features.camera:
        doubt = intrinsics.better_intrinsics(_only(views, fit.good), camera, fit.sigma)
        findings += [doubt] if doubt else []
    if fit.margin < _CLEAR_MARGIN:
        findings.append(_ambiguity(fit.margin))
    noise = features.noise or Noise()
    sigma = fit.sigma if noise.pixel is None else noise.pixel
    stations = _stations(features.stations, views, camera, fit, sigma)
    return Stations(
        setup=features.setup,
        stations=stations,
        target=features.target,
        camera=camera,
        noise=features.noise,
        findings=tuple(findings),
        provenance=features.provenance,
    )


def _calibrated(
    features: Features, board: targets.Board, views: Views
) -> tuple[Features, Camera, Finding]:
    """Return intrinsics from the images, and the features as these intrinsics see them."""
    camera, finding = intrinsics.calibrate_intrinsics(features, views)
    moved = recentred(features, board, camera)
    if moved is not features:
        views = views_of(moved.stations, board.points())
        camera, finding = intrinsics.calibrate_intrinsics(moved, views)
        moved = recentred(features, board, camera)
    return moved, camera, finding


def recentred(features: Features, board: targets.Board, camera: Camera) -> Features:
    """Return the features with the points where another camera has them.

    Args:
        features: Points as the features' own camera, if there is one, saw them.
        board: Their target.
        camera: The other camera.
    """
    stations = tuple(
        _with_points(station, board, features.camera, camera) for station in features.stations
    )
    same = all(new is old for new, old in zip(stations, features.stations, strict=True))
    return features if same else replace(features, stations=stations)


def _with_points(
    station: Station, board: targets.Board, before: Camera | None, after: Camera
) -> Station:
    seen = station.observation
    if seen is None or len(seen.ids) < pnp.MIN_POINTS:
        return station
    found = targets.Detection(seen.ids, seen.pixels, seen.sigma_px)
    moved = board.recentred(found, before, after)
    if moved is found:
        return station
    return replace(station, observation=replace(seen, pixels=moved.pixels))


def _nothing_seen(stations: Sequence[Station]) -> UndeterminedError:
    first = next((f"; {each.name}: {each.reason}" for each in stations if each.reason), "")
    return UndeterminedError(
        f"expected the target in at least one image, found it in none of {len(stations)}{first}",
        hint="look at all reasons with 'handeye extract', and check --target",
    )


def _fit(views: Views, camera: Camera, setup: Setup) -> _Fit:
    candidates = pose_candidates(views, camera)
    robot = views.reference_R_mount(setup)
    choice = robot_readings.choose(robot, candidates.poses[..., :3, :3], candidates.penalties)
    poses = candidates.poses[np.arange(len(robot)), choice.index]
    squares = pnp.squared_residuals(poses, views.seen, camera.lens)
    count = 2 * views.seen.mask.sum(axis=1)
    rms = np.sqrt(squares / count)
    possible = np.isfinite(rms)
    typical = float(np.median(rms[possible])) if possible.any() else 0.0
    good = possible & (rms <= max(_GROSS_PIXELS, _GROSS_FACTOR * typical))
    freedom = max(int(np.sum(count[good] - 6)), 1)
    return _Fit(poses, rms, good, float(np.sqrt(np.sum(squares[good]) / freedom)), choice.margin)


def _ambiguity(margin: float) -> Finding:
    return Finding(
        "planar-ambiguity",
        "warning",
        "a plane seen with little perspective has two poses, and mirroring all stations fits "
        f"nearly as well: chi-square {margin:.1f} worse",
        "go nearer to the target or tilt it more, or use a larger target",
    )


def _only(views: Views, rows: NDArray[np.bool_]) -> Views:
    return Views(views.index[rows], views.base_T_gripper[rows], views.seen.part(rows))


def _stations(
    stations: tuple[Station, ...], views: Views, camera: Camera, fit: _Fit, sigma: float
) -> tuple[Station, ...]:
    information = pnp.pose_information(fit.poses, views.seen, camera.lens)
    out = [_without_pose(station) for station in stations]
    for row, index in enumerate(views.index):
        if not fit.good[row]:
            out[index] = replace(out[index], camera_T_target=None, reason=_complaint(fit, row))
            continue
        covariance = sigma**2 * np.linalg.inv(information[row])
        covariance = (covariance + covariance.T) / 2
        seen = out[index].observation
        out[index] = replace(
            out[index],
            observation=seen and replace(seen, sigma_px=sigma),
            camera_T_target=UncertainPose(fit.poses[row], covariance),
            reason=None,
        )
    return tuple(out)


def _complaint(fit: _Fit, row: int) -> str:
    if not np.isfinite(fit.rms[row]):
        return "no pose in front of the camera explains the points that were found"
    return (
        f"reprojection error {fit.rms[row]:.2f} px where the stations' median is "
        f"{np.median(fit.rms[np.isfinite(fit.rms)]):.2f} px"
    )


def _without_pose(station: Station) -> Station:
    seen = station.observation
    if station.reason or seen is None:
        return replace(station, camera_T_target=None, reason=station.reason or "no target points")
    if len(seen.ids) < pnp.MIN_POINTS:
        reason = f"{len(seen.ids)} points were seen, at least {pnp.MIN_POINTS} are needed"
        return replace(station, camera_T_target=None, reason=reason)
    return replace(station, camera_T_target=None)

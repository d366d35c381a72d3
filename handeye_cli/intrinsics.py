"""Intrinsics from the same images, with as many distortion coefficients as the data support."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from handeye_cli.errors import ConvergenceError, InputError, UndeterminedError
from handeye_cli.finding_codes import INTRINSICS_DOUBTFUL
from handeye_cli.geometry import bundle, pnp
from handeye_cli.geometry.camera import Lens
from handeye_cli.records import Camera, Features, Finding
from handeye_cli.views import Views
from handeye_cli.wording import CALIBRATE_AGAIN

_MIN_VIEWS = 3
_MIN_VIEWS_TO_DOUBT = 6
_DOUBT = 0.8
"""Given intrinsics are doubted when calibrated ones leave less than this share of the residual."""
_ROUGHLY = 1e-4
"""Part of the squares by which a step lessens them at least while the doubt is examined."""
_LARGEST_RELATIVE_SIGMA = 0.05
"""A focal length less certain than this is not determined by the images."""
_COEFFICIENTS = {
    "plumb_bob": (0, 1, 2, 4, 5),
    "rational_polynomial": (0, 1, 2, 4, 5, 8),
    "equidistant": (0, 1, 2, 4),
}
"""Sizes of the distortion models that are compared."""


def camera_or_calibrated(features: Features, views: Views) -> Camera:
    """Return the given intrinsics, or calibrate them from the images where none are given.

    Raises:
        InputError: Neither intrinsics nor the size of the images are known.
        UndeterminedError: The images do not determine the intrinsics.
    """
    return features.camera or calibrate_intrinsics(features, views)[0]


def calibrate_intrinsics(features: Features, views: Views) -> tuple[Camera, Finding]:
    """Estimate intrinsics from the views, with as many coefficients as the evidence supports.

    The models are nested; the one with the smallest Bayesian information criterion is taken. A
    given camera only lends its size, its model and a first guess.

    Args:
        features: The recording's features, for the camera or the size of its images.
        views: The views of its stations.

    Returns:
        The camera with the covariance of its parameters, and a finding that tells what was chosen.

    Raises:
        InputError: Neither intrinsics nor the size of the images are known.
        UndeterminedError: Too few or too similar views.
        ConvergenceError: The refinement did not converge.
    """
    guess = _first_guess(features, views)
    return _camera(guess, _best_model(guess, views), views)


def better_intrinsics(views: Views, camera: Camera, sigma: float) -> Finding | None:
    """Return a warning where the views contradict the given intrinsics, else None.

    Args:
        views: The views of the stations.
        camera: The given intrinsics.
        sigma: Pixel noise that they leave, pixels.
    """
    if len(views.index) < _MIN_VIEWS_TO_DOUBT:
        return None
    guess = replace(camera, distortion=(), covariance=None)
    result = _best_model(guess, views, tolerance=_ROUGHLY)
    freedom = views.degrees_of_freedom(result.parameters.size)
    left = float(np.sqrt(result.squares / freedom))
    if not result.converged or left > _DOUBT * sigma:
        return None
    return Finding(
        INTRINSICS_DOUBTFUL,
        "warning",
        f"the given intrinsics leave a residual of {sigma:.2f} px, intrinsics calibrated from the "
        f"same images {left:.2f} px",
        CALIBRATE_AGAIN,
    )


def _best_model(
    guess: Camera, views: Views, tolerance: float = bundle.GAIN_TOLERANCE
) -> bundle.BundleResult:
    poses = pnp.planar_poses(views.seen, guess.lens).poses[:, 0]
    residuals = 2 * int(views.seen.mask.sum())
    parameters = guess.parameters[:4]
    results: list[tuple[float, bundle.BundleResult]] = []
    for count in _COEFFICIENTS[guess.model]:
        if views.degrees_of_freedom(4 + count) < residuals // 10:
            break
        start = np.concatenate([parameters, np.zeros(4 + count - parameters.size)])
        result = bundle.calibrate(views.seen, Lens(start, guess.model), poses, tolerance)
        parameters, poses = result.parameters, result.poses
        evidence = residuals * np.log(max(result.squares, 1e-300) / residuals)
        results.append((float(evidence + (4 + count) * np.log(residuals)), result))
    if not results:
        raise UndeterminedError(
            f"expected more points for the intrinsics, found {residuals // 2} "
            f"in {len(views.index)} views",
            hint="record more views, or give the camera's intrinsics",
        )
    return min(results, key=lambda item: item[0])[1]


def _first_guess(features: Features, views: Views) -> Camera:
    if len(views.index) < _MIN_VIEWS:
        raise UndeterminedError(
            f"expected at least {_MIN_VIEWS} views to calibrate the intrinsics, "
            f"found {len(views.index)}",
            hint="record more views, or give the camera's intrinsics under 'camera'",
        )
    if features.camera:
        return replace(features.camera, distortion=(), covariance=None)
    if features.image_size is None:
        raise InputError(
            "expected the camera's intrinsics or the size of its images, found neither",
            where="camera",
            hint="add 'camera' or 'image_size' to the document",
        )
    width, height = features.image_size
    seen = views.seen
    homographies = pnp.homography(seen.points[:, :2], seen.pixels, seen.mask)
    focal = bundle.focal_length(homographies, width, height)
    if focal is None:
        raise UndeterminedError(
            "the images do not determine a focal length: the target is never clearly tilted",
            hint="record views tilted by 20 to 45 degrees, or give the intrinsics",
        )
    return Camera(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2)


def _camera(guess: Camera, result: bundle.BundleResult, views: Views) -> tuple[Camera, Finding]:
    freedom = views.degrees_of_freedom(result.parameters.size)
    variance = result.squares / freedom
    values, vectors = np.linalg.eigh(result.information)
    floor = np.max(values) * 1e-15
    covariance = variance * (vectors / np.maximum(values, floor)) @ vectors.T
    relative = float(np.sqrt(covariance[0, 0])) / float(result.parameters[0])
    if relative > _LARGEST_RELATIVE_SIGMA:
        raise UndeterminedError(
            f"the images do not determine the focal length: {result.parameters[0]:.0f} px "
            f"+- {100 * relative:.0f} %",
            hint="record views tilted by 20 to 45 degrees, or give the intrinsics",
        )
    if not result.converged:
        raise ConvergenceError(
            f"the calibration of the intrinsics did not converge from a focal length of "
            f"{guess.fx:.0f} px",
            hint="give better intrinsics under 'camera', or leave out views that went wrong",
        )
    fx, fy, cx, cy, *distortion = (float(value) for value in result.parameters)
    camera = replace(
        guess, fx=fx, fy=fy, cx=cx, cy=cy, distortion=tuple(distortion), covariance=covariance
    )
    message = (
        f"intrinsics calibrated from {len(views.index)} views: focal length {fx:.1f} px, "
        f"{len(distortion)} distortion coefficients, residual {np.sqrt(variance):.3f} px"
    )
    return camera, Finding("intrinsics-calibrated", "info", message)

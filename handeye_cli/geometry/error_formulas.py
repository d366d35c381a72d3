"""The paper's error formulas, eq. (25)-(33), in the repaired form that follows from its lemmas.

Sigmas are RMS magnitudes; Err is a largest magnitude. Three stations are the basis; N stations are
that times sqrt(3 / N), as in the paper's own experiment. Where the paper writes two motions (1-2
and 2-3), the mean over all interstation pairs stands here; with equal motions both are the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import rotations
from handeye_cli.geometry.error_radius import MAX_OVER_RMS

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class StationNoise:
    """The four sigmas of the paper, of each station's poses.

    Attributes:
        robot_rotation: sigma_Rg, radians.
        robot_translation: sigma_Tg, metres.
        camera_rotation: sigma_Rc, radians.
        camera_translation: sigma_Tc, metres.
    """

    robot_rotation: float
    robot_translation: float
    camera_rotation: float
    camera_translation: float


@dataclass(frozen=True)
class FormulaFactors:
    """What the formulas of the error depend on, section III-B of the paper.

    Attributes:
        stations: N.
        angle: RMS interstation rotation angle, radians.
        sine: RMS sine of the angle between interstation axes.
        axes: (3,) singular values of the stacked axes P of eq. (9).
        camera_distance: RMS |T_c|, metres.
        robot_distance: RMS |T_gi - T_gj| over the pairs, metres.
        condition: Condition number of the A of eq. (31): two motions of one angle, stacked.
    """

    stations: int
    angle: float
    sine: float
    axes: FloatArray
    camera_distance: float
    robot_distance: float
    condition: float


def critical_factors(
    A: FloatArray, B: FloatArray, motion_c: FloatArray, pairs: IntArray
) -> FormulaFactors:
    """Measure the critical factors of a set of stations.

    Args:
        A: (N, 4, 4) robot poses H_gi.
        B: (N, 4, 4) camera extrinsics H_ci.
        motion_c: (m, 4, 4) H_cij of the pairs.
        pairs: (m, 2) the interstation pairs.
    """
    P = rotations.principal_axis(motion_c[:, :3, :3])
    sine = _mean_sine(P)
    separation = A[pairs[:, 0], :3, 3] - A[pairs[:, 1], :3, 3]
    return FormulaFactors(
        stations=len(A),
        angle=_rms(rotations.angle(motion_c[:, :3, :3])),
        sine=sine,
        axes=np.asarray(np.linalg.svd(P, compute_uv=False)),
        camera_distance=_rms(np.linalg.norm(B[:, :3, 3], axis=1)),
        robot_distance=_rms(np.linalg.norm(separation, axis=1)),
        condition=_condition(sine),
    )


def _mean_sine(P: FloatArray) -> float:
    """Return the RMS sine of the angles between (m, 3) axes; those without length are none."""
    length = np.linalg.norm(P, axis=1)
    unit = P[length > 0.0] / length[length > 0.0, None]
    count = len(unit)
    if count < 2:
        return 0.0
    # the sum of cos^2 over all pairs of axes, each with itself among them, is that of the scatter
    sines = count**2 - np.sum((unit.T @ unit) ** 2)
    return float(np.sqrt(max(sines / (count * (count - 1)), 0.0)))


def successive_axes_angles(motion: FloatArray, pairs: IntArray) -> FloatArray:
    """Return the angles between the rotation axes of motions that follow each other at a station.

    They are the paper's angles between P_12 and P_23, taken of lines without a sense: the order in
    which a pair is written does not matter. A motion without rotation has no axis and counts as 0.

    Args:
        motion: (m, 4, 4) H_gij or H_cij of the pairs; both enclose the same angles.
        pairs: (m, 2) the interstation pairs.

    Returns:
        (2 m - stations,) angles in [0, pi / 2], radians: as many as pairs for a closed star.
    """
    order = np.argsort(pairs.ravel(), kind="stable")
    station, taken = pairs.ravel()[order], order // 2
    same = station[1:] == station[:-1]
    P = rotations.principal_axis(motion[:, :3, :3])
    first, second = P[taken[:-1][same]], P[taken[1:][same]]
    sine = np.linalg.norm(np.cross(first, second), axis=-1)
    return np.asarray(np.arctan2(sine, np.abs(np.sum(first * second, axis=-1))))


def _condition(sine: float) -> float:
    """Return it from the axes: the singular values go with sqrt(2) and sqrt(1 +- |cos|)."""
    cosine = np.sqrt(max(1.0 - sine**2, 0.0))
    return float(np.sqrt(2.0 / max(1.0 - cosine, np.finfo(float).tiny)))


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def rotation_sigma(factors: FormulaFactors, noise: StationNoise) -> float:
    """Return sigma_Rcg in radians, eq. (29) with (25a)."""
    pair = 2.0 * (noise.robot_rotation**2 + noise.camera_rotation**2)
    return float(np.sqrt(pair) * _axes_gain(factors.axes))


def rotation_max(factors: FormulaFactors, noise: StationNoise) -> float:
    """Return Err(R_cg) in radians, eq. (30) with (25b)."""
    pair = 2.0 * MAX_OVER_RMS * (noise.robot_rotation + noise.camera_rotation)
    return float(pair * _axes_gain(factors.axes))


def _axes_gain(axes: FloatArray) -> float:
    squares = axes**2
    return float(np.sqrt(np.sum(1.0 / (squares + np.roll(squares, 1)))))


def translation_sigma(factors: FormulaFactors, noise: StationNoise) -> float:
    """Return the upper bound on sigma_Tcg in metres, eq. (31)."""
    pair = 2.0 * (noise.robot_rotation**2 + noise.camera_rotation**2)
    from_rotation = 16.0 / 9.0 * pair / factors.sine**2 * factors.camera_distance**2
    from_stations = factors.condition * (
        8.0 / 3.0 * noise.camera_rotation**2 * factors.camera_distance**2
        + 4.0 * noise.camera_translation**2
        + 4.0 / 3.0 * noise.robot_rotation**2 * factors.robot_distance**2
        + 4.0 * noise.robot_translation**2
    )
    return float(_turn_gain(factors) * np.sqrt(from_rotation + from_stations))


def translation_max(factors: FormulaFactors, noise: StationNoise) -> float:
    """Return the upper bound on Err(T_cg) in metres, eq. (33) with (25b) and without its root."""
    pair = 2.0 * MAX_OVER_RMS * (noise.robot_rotation + noise.camera_rotation)
    from_rotation = 4.0 / factors.sine * pair * factors.camera_distance
    from_stations = (
        factors.condition
        * MAX_OVER_RMS
        * (
            4.0 * noise.camera_rotation * factors.camera_distance
            + 4.0 * noise.camera_translation
            + 2.0 * noise.robot_rotation * factors.robot_distance
            + 4.0 * noise.robot_translation
        )
    )
    return float(_turn_gain(factors) * (from_rotation + from_stations))


def _turn_gain(factors: FormulaFactors) -> float:
    more = np.sqrt(3.0 / factors.stations)
    return float(more / (2.0 * np.sin(min(factors.angle, np.pi) / 2.0)))

"""Whether the stations' residuals are noise, or errors of the robot that follow its pose.

Noise is independent from station to station, and an answer gets better with every one. An error of
the kinematics is the same whenever the robot is where it was: it moves the answer, more stations
beside the old ones do not help, and the residuals show only what the answer has not taken up. A
prediction that takes it for noise promises too much.

Two tests look for it. Residuals that grow along one coordinate of the robot's pose are an error of
low order (a scale, a joint, a link); residuals that are alike at neighbouring poses are an error of
any smooth form. Where one of them finds something, the prediction is widened by what a smooth field
of the size that the residuals show would do to the answer.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.conventions import MM, MRAD, Setup
from handeye_cli.diagnosis.answered_stations import PARTS, AnsweredStations
from handeye_cli.estimates import Estimate
from handeye_cli.geometry import smooth_fields
from handeye_cli.geometry.smooth_fields import Trend, WhiteResiduals
from handeye_cli.geometry.tail_probabilities import chi_square_head, chi_square_tail
from handeye_cli.noise_levels import NoiseModel, noise_model
from handeye_cli.records import Finding, FloatArray, Noise

CODE = "robot-systematic"
"""Code of the finding that the residuals follow the robot's pose."""
_SIGNIFICANCE = 0.01
"""Chance that independent residuals are called systematic."""
_NOISE_SIGNIFICANCE = 1e-3
"""Chance that given noise is called too small, or too large, though it is right."""
_EXACT = 1e-2
"""RMS of whitened residuals that are mere rounding: less than any level that is considered."""
_ROUNDING = 1e-6
"""Part by which covariances differ that are the same."""
_FEWEST = 8
"""Stations below which nothing is said of systematic errors."""
_TESTED = (0.5, 1.0)
"""Lengths of fields that are tested, in units of the spread of the poses."""
_STANDS_OUT = 4.0
"""Its inverse is by how many standard deviations noise of the coordinate moves a trend."""
_ROUND_NUMBERS = {"position": (100.0 * MM, "100 mm"), "orientation": (math.radians(10.0), "10 deg")}


@dataclass(frozen=True)
class Systematic:
    """What the residuals say of the robot's systematic errors.

    Attributes:
        findings: The verdicts.
        widening: Factor, at least 1, by which the predicted error should be widened: the larger of
            the two that follow.
        rotation: The same for the rotation of the answer alone.
        translation: The same for its translation.
    """

    findings: tuple[Finding, ...] = ()
    rotation: float = 1.0
    translation: float = 1.0

    @property
    def widening(self) -> float:
        """The larger one of both factors."""
        return max(self.rotation, self.translation)

    def widened(self, covariance: FloatArray) -> FloatArray:
        """Return the (12, 12) covariance of X and Z with both factors put in."""
        factors = np.tile(np.repeat([self.translation, self.rotation], 3), 2)
        return np.asarray(factors[:, None] * covariance * factors)


def systematic_errors(
    estimate: Estimate, chain: Chain, given: Noise | None, setup: Setup
) -> Systematic:
    """Judge whether the residuals of an answer are noise.

    Args:
        estimate: The answer.
        chain: Its N stations. What `by_intrinsics` says of their target poses is not put down to
            the robot; columns of the plate's shape may stand beside those of the intrinsics, and
            the target poses may be less uncertain than the estimate has them.
        given: The noise of the document, or None.
        setup: Where the camera is fixed.
    """
    estimate = replace(estimate, model=_noise_beside(estimate, chain, given))
    stations = AnsweredStations.of(estimate, chain, setup)
    noise = _noise_of(stations, given)
    if len(chain.A) < _FEWEST:
        return noise
    found = _follows_pose(stations)
    if found is None:
        return noise
    from handeye_cli.diagnosis.robot_field import widening

    rotation, translation = widening(stations, found.form, found.moves)
    return Systematic(
        findings=(*noise.findings, found.finding),
        rotation=max(noise.rotation, rotation),
        translation=max(noise.translation, translation),
    )


def _noise_beside(estimate: Estimate, chain: Chain, given: Noise | None) -> NoiseModel:
    """Return the noise of an answer, anew where its chain knows more of the target poses' noise."""
    model = estimate.model
    known = model.covariance - np.tensordot(model.variances, model.shapes, axes=1)
    if np.allclose(known[:, 6:, 6:], chain.camera_covariance, rtol=_ROUNDING, atol=0.0):
        return model
    return noise_model(chain, given, estimate.solution)


def _noise_of(stations: AnsweredStations, given: Noise | None) -> Systematic:
    """Judge given levels by the size of the residuals; nothing is said of estimated ones."""
    if given is None or len(stations.estimate.model.shapes):
        return Systematic()
    white = stations.white()
    squares, freedom = float(white.left @ white.left), white.freedom
    if freedom < 1:
        return Systematic()
    factor = math.sqrt(squares / freedom)
    larger, smaller = chi_square_tail(squares, freedom), chi_square_head(squares, freedom)
    if min(larger, smaller) > _NOISE_SIGNIFICANCE:
        return Systematic()
    rotation, translation = _sizes(stations, white)
    seen = (
        f"{factor:.2g} times what the given noise explains (chi-square {squares:.0f} where "
        f"{freedom} is expected): rotations {rotation:.2g} times, translations "
        f"{translation:.2g} times"
    )
    if smaller < larger:
        advice = "the predicted error is too large; leave the noise out to have it estimated"
        finding = Finding("noise-overstated", "info", f"the residuals are {seen}", advice)
        return Systematic((finding,))
    advice = "leave the noise out to have it estimated, or look for what else is wrong"
    finding = Finding("noise-understated", "warning", f"the residuals are {seen}", advice)
    return Systematic((finding,), factor, factor)


def _sizes(stations: AnsweredStations, white: WhiteResiduals) -> tuple[float, float]:
    """Return RMS rotation and translation of the residuals over what the noise explains."""
    root = np.linalg.cholesky(stations.spread)
    left = (root @ white.left.reshape(-1, 6, 1))[..., 0]
    taken = root @ white.basis.reshape(*root.shape[:2], -1)
    expected = np.sum(root**2, axis=-1) - np.sum(taken**2, axis=-1)
    ratios = [np.sum(left[:, part] ** 2) / np.sum(expected[:, part]) for part in PARTS.values()]
    translation, rotation = np.sqrt(ratios).tolist()
    return rotation, translation


class _Followed(NamedTuple):
    """How the residuals follow the robot's pose.

    Attributes:
        finding: The verdict.
        form: (N, 6, k) perturbations of the robot poses whose form is known; k may be 0.
        moves: (12,) how far they moved X and Z.
    """

    finding: Finding
    form: FloatArray
    moves: FloatArray


def _follows_pose(stations: AnsweredStations) -> _Followed | None:
    """Return in which way the residuals follow the robot's pose, or None where they do not."""
    white = stations.white()
    if float(white.left @ white.left) < _EXACT**2 * white.freedom:
        return None
    hypotheses = list(_hypotheses(stations))
    trends = [smooth_fields.trend(white, each.columns) for each in hypotheses]
    best = min(range(len(trends)), key=lambda k: trends[k].chance)
    by_trend = min(1.0, 2.0 * len(trends) * trends[best].chance)
    by_likeness = min(1.0, 2.0 * _likeness(stations.few()))
    chance = min(by_trend, by_likeness)
    if chance > _SIGNIFICANCE:
        return None
    form, found = hypotheses[best], trends[best]
    if by_trend < _SIGNIFICANCE and form.follows == "scale":
        moves = _moved_by_scale(stations, float(found.values[0]))
        return _Followed(_scaled(found, chance), form.columns, moves)
    grows = by_trend < _SIGNIFICANCE
    seen = form.words(found) if grows else "stations near each other have alike residuals"
    finding = _along_way(seen, chance) if stations.in_motion else _kinematic(seen, chance)
    return _Followed(finding, np.zeros((len(stations.robot), 6, 0)), np.zeros(12))


def _moved_by_scale(stations: AnsweredStations, scale: float) -> FloatArray:
    """Return the (12,) moves of X and Z that ways of a wrong length lead to.

    The robot's ways may be too long, or the target's lengths too short: the residuals are the same,
    the answers are not. The larger move is taken.
    """
    influence = stations.estimate.influence[..., 6:9]
    ways = stations.robot[:, :3, 3]
    by_robot = scale * np.einsum("nij,nj->i", stations.influence[..., :3], ways)
    by_target = -scale * np.einsum("nij,nj->i", influence, stations.target)
    return max(by_robot, by_target, key=lambda moves: float(np.linalg.norm(moves[:3])))


def _kinematic(seen: str, chance: float) -> Finding:
    return Finding(
        CODE,
        "warning",
        f"residuals follow the robot's pose: {seen} (p = {chance:.1g}): a kinematic error, of a "
        "joint or a link, and not noise",
        "calibrate the robot, or keep to the part of the workspace where the camera will be used; "
        "more stations of the same kind do not help",
    )


def _along_way(seen: str, chance: float) -> Finding:
    return Finding(
        CODE,
        "warning",
        f"residuals follow the robot's pose: {seen} (p = {chance:.1g}): an error that changes "
        "little along the robot's way, of its kinematics or its control, and not noise of single "
        "frames",
        "more frames of the same way do not help: let the robot stand still at more stations; "
        "where the verdict remains then, calibrate the robot",
    )


def _scaled(found: Trend, chance: float) -> Finding:
    percent, sigma = 100 * float(found.values[0]), 100 * math.sqrt(float(found.covariance[0, 0]))
    return Finding(
        CODE,
        "warning",
        f"residuals follow the robot's position: its ways are {abs(percent):.2f} % (+- "
        f"{sigma:.2f}) {'longer' if percent > 0.0 else 'shorter'} than the target's lengths make "
        f"them (p = {chance:.1g}): a target {'larger' if percent > 0.0 else 'smaller'} than "
        "declared, or a scale error of the robot, and not noise",
        "measure the target over its whole length, and correct its lengths; else calibrate the "
        "robot",
    )


class _Hypothesis(NamedTuple):
    """A form that an error of the robot may have.

    Attributes:
        columns: (N, 6, k) perturbations of the robot poses for unit coefficients.
        error: `translation` or `rotation`, what is wrong.
        follows: `position` or `orientation`, what it follows; the whole `scale`.
        axis: Of the base, along or about which.
        frame: In whose axes the error is constant, `base` or `gripper`.
    """

    columns: FloatArray
    error: str
    follows: str
    axis: str = ""
    frame: str = ""

    def words(self, found: Trend) -> str:
        """Return what was found, for people."""
        size = float(np.linalg.norm(found.values))
        sigma = math.sqrt(float(np.trace(found.covariance)))
        step, per = _ROUND_NUMBERS[self.follows]
        unit, name = (MM, "mm") if self.error == "translation" else (MRAD, "mrad")
        way = "along" if self.follows == "position" else "of turning about"
        return (
            f"{size * step / unit:.2g} {name} (+- {sigma * step / unit:.1g}) per {per} {way} base "
            f"{self.axis}, in the axes of the {self.frame}"
        )


def _hypotheses(stations: AnsweredStations) -> Iterator[_Hypothesis]:
    """Yield a scale, and errors that grow along each coordinate of the robot's pose."""
    position, turned = smooth_fields.spreads(stations.robot)
    ways = np.zeros((len(position), 6, 1))
    ways[:, :3, 0] = position
    yield _Hypothesis(ways, "translation", "scale")
    frames = {"base": np.eye(3), "gripper": stations.robot[:, :3, :3]}
    noise = stations.estimate.model.noise
    for follows, coordinates, level in (
        ("position", position, noise.robot_translation),
        ("orientation", turned, noise.robot_rotation),
    ):
        for k, axis in enumerate("xyz"):
            if not _stands_out(coordinates[:, k], level or 0.0):
                continue
            for frame, axes in frames.items():
                for error, part in PARTS.items():
                    columns = np.zeros((len(position), 6, 3))
                    columns[:, part] = coordinates[:, k, None, None] * axes
                    yield _Hypothesis(columns, error, follows, axis, frame)


def _stands_out(coordinate: FloatArray, level: float) -> bool:
    """Return whether (N,) coordinates of the poses differ by far more than the poses' own noise.

    Those that do not are the noise, and so are the residuals: the one would explain the other.
    """
    noise = level * math.sqrt(len(coordinate) / 3.0)
    return float(np.std(coordinate)) > _STANDS_OUT * noise


def _likeness(stations: AnsweredStations) -> float:
    """Return the chance that independent residuals are as alike as those of neighbours are.

    The stations' own squares are left out, so that it does not depend on how the noise is divided.
    """
    white = stations.white()
    alone = np.eye(len(stations.robot))
    chances = [
        white.likeness(smooth_fields.field_covariance(white.by_robot, between - alone, part))
        for between in (smooth_fields.correlation(stations.robot, each) for each in _TESTED)
        for part in PARTS.values()
    ]
    return min(1.0, len(chances) * min(chances))

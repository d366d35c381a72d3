"""What the stations' residuals are due to: robot, pixel noise, intrinsics, plate, or timing.

The camera's poses bring covariances from their pixels, and the shape of the plate and of the lens
show in the images by themselves, whatever the robot does. What the times of images add to poses
that were read in motion is in the stations. What is left of the residuals once all this is in the
poses is the robot's. Where nothing is known of the camera the two cannot be told apart.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from handeye_cli.chain import Chain, has_pixels
from handeye_cli.conventions import MM, MRAD
from handeye_cli.diagnosis.answered_stations import carried
from handeye_cli.diagnosis.late_poses import LatePoses, late_poses
from handeye_cli.diagnosis.plate_shape import LENS, UNCLEAR, PlateShape
from handeye_cli.estimates import Estimate
from handeye_cli.geometry import se3
from handeye_cli.geometry.loop import LoopJacobians, loop_jacobians
from handeye_cli.geometry.scaled_inverse import scaled_inverse
from handeye_cli.noise_levels import NoiseModel, noise_model
from handeye_cli.records import FloatArray, Stations
from handeye_cli.records.blame import BlameShares
from handeye_cli.solvers.problem import Solution

_CLEARLY = 1.5
"""Factor by which the share of the limiting cause, mean of both kinds, exceeds the next one's."""
_NOTHING = 1e-3
"""Millimetres or milliradians that are written as none."""
_NAMES = {
    "robot": "robot",
    "camera": "camera's pixel noise",
    "intrinsics": "intrinsics",
    "plate": "plate's shape",
    "timing": "time between pose and image",
}
_KINDS = ("rotation", "translation")


def blame(
    estimate: Estimate, stations: Stations, chain: Chain, plate: PlateShape | None = None
) -> BlameShares:
    """Divide the residuals of an answer among their causes.

    Args:
        estimate: The answer.
        stations: The document.
        chain: Its N stations that were used.
        plate: What `plate_shape` says of the document, or None.
    """
    case = _case(estimate, stations, chain, plate)
    if not np.any(case.model.covariance[:, 6:, 6:]):
        return _unclear(case)
    squares = _squares(case)
    total = np.maximum(np.sum(list(squares.values()), axis=0), np.finfo(float).tiny)
    shares = {name: each / total for name, each in squares.items()}
    limit = _limit(shares, case)
    parts: dict[str, Any] = {
        f"{name}_{kind}": float(value)
        for name, share in shares.items()
        for kind, value in zip(_KINDS, share, strict=True)
    }
    return BlameShares(
        rotation=float(np.sqrt(total[0])),
        translation=float(np.sqrt(total[1])),
        limit=limit,
        words=_words(squares, limit, case),
        **parts,
    )


@dataclass(frozen=True)
class _Case:
    """A recording whose residuals are divided.

    Attributes:
        chain: Its stations, with the plate's and the lens' shape in their target poses.
        loop: Their loops.
        model: The noise that these leave.
        before: The noise as it was estimated without them.
        solution: The answer.
        by_plate: (N, 6) perturbations of the target poses by the plate's shape.
        by_image: (N, 6) the same by what the intrinsics do not model.
        lens_unknown: Whether intrinsics that are taken as exact were found to be wrong, or plate or
            lens without telling which.
        late: What times that are off make of the robot's poses.
    """

    chain: Chain
    loop: LoopJacobians
    model: NoiseModel
    before: NoiseModel
    solution: Solution
    by_plate: FloatArray
    by_image: FloatArray
    lens_unknown: bool
    late: LatePoses

    @property
    def robot(self) -> FloatArray:
        """(N, 6, 6) covariance of the A_i that is the robot's noise alone."""
        return np.asarray(self.model.covariance[:, :6, :6] - self.late.scatter)


def _case(estimate: Estimate, stations: Stations, chain: Chain, plate: PlateShape | None) -> _Case:
    if has_pixels(stations, chain):
        from handeye_cli.pixel_data import with_intrinsics

        chain = with_intrinsics(stations, chain)
    solution, given = estimate.solution, stations.noise
    before = noise_model(chain, given, solution)
    nothing = np.zeros((len(chain.A), 6))
    by_plate, by_image = (nothing, nothing) if plate is None else plate.moves(chain)
    model = before
    if np.any(by_plate) or np.any(by_image):
        chain = _corrected(chain, plate, by_plate + by_image)
        model = noise_model(chain, given, solution)
    exact = stations.camera is None or stations.camera.covariance is None
    codes = {finding.code for finding in plate.findings} if plate else set()
    return _Case(
        chain=chain,
        loop=loop_jacobians(chain.A, chain.B, solution.X, solution.Z),
        model=model,
        before=before,
        solution=solution,
        by_plate=by_plate,
        by_image=by_image,
        lens_unknown=UNCLEAR in codes or (exact and LENS in codes),
        late=late_poses(chain),
    )


def _corrected(chain: Chain, plate: PlateShape | None, moves: FloatArray) -> Chain:
    """Return the chain as a straight plate and a right lens would have shown it."""
    share = plate.noise_share if plate else 1.0
    return replace(
        chain, B=se3.perturb(chain.B, moves), camera_covariance=chain.camera_covariance * share
    )


def _squares(case: _Case) -> dict[str, FloatArray]:
    """Return the (2,) mean squares of rotation and translation that each cause leads to expect.

    The answer has taken up a part of every cause; what is counted is what it has left.
    """
    loop = case.loop
    robot = carried(loop.by_robot, case.robot)
    camera = carried(loop.by_camera, case.model.covariance[:, 6:, 6:])
    late = carried(loop.by_robot, case.late.scatter)
    fit = _Fit.of(loop.by_unknowns, robot + camera + late)
    lens = np.concatenate([case.chain.by_intrinsics, case.by_image[..., None]], axis=-1)
    squares = {
        "robot": fit.of_noise(robot),
        "camera": fit.of_noise(camera),
        "intrinsics": fit.of_columns(loop.by_camera @ lens),
        "plate": fit.of_columns(loop.by_camera @ case.by_plate[..., None]),
        "timing": fit.of_noise(late) + fit.of_columns(loop.by_robot @ case.late.together),
    }
    return {name: each for name, each in squares.items() if np.any(each)}


@dataclass(frozen=True)
class _Fit:
    """The fit of X and Z to N loops: (N, 6, 12) derivatives, and (12, N, 6) how they follow."""

    design: FloatArray
    moves: FloatArray

    @classmethod
    def of(cls, design: FloatArray, covariance: FloatArray) -> _Fit:
        weighted = np.linalg.solve(covariance, design)
        information = np.einsum("nij,nik->jk", design, weighted)
        return cls(design, np.einsum("jk,nik->jni", scaled_inverse(information), weighted))

    def of_noise(self, covariance: FloatArray) -> FloatArray:
        """Return the (2,) mean squares that independent errors leave, by (N, 6, 6)."""
        moved = np.einsum("jni,nik->jnk", self.moves, covariance)
        inner = np.einsum("jnk,lnk->jl", moved, self.moves)
        left = np.einsum("nii->ni", covariance)
        left = left - 2.0 * np.einsum("nij,jni->ni", self.design, moved)
        left = left + np.einsum("nij,jl,nil->ni", self.design, inner, self.design)
        return _by_kind(np.maximum(left, 0.0))

    def of_columns(self, columns: FloatArray) -> FloatArray:
        """Return the (2,) mean squares that (N, 6, m) common errors of unit size leave."""
        taken = np.einsum("jni,nik->jk", self.moves, columns)
        return _by_kind(np.sum((columns - self.design @ taken) ** 2, axis=-1))


def _by_kind(squares: FloatArray) -> FloatArray:
    """Return the (2,) rotation and translation of (N, 6) squares, as means over the stations."""
    return se3.by_kind(squares.mean(axis=0))[::-1]


def _limit(shares: dict[str, FloatArray], case: _Case) -> str:
    sizes = {name: float(np.mean(share)) for name, share in shares.items()}
    first, *others = sorted(sizes, key=lambda name: -sizes[name])
    close = bool(others) and sizes[first] < _CLEARLY * sizes[others[0]]
    return "unclear" if close or (first == "robot" and case.lens_unknown) else first


def _words(squares: dict[str, FloatArray], limit: str, case: _Case) -> str:
    parts = "; ".join(
        f"{_NAMES[name]} {_amount(*np.sqrt(each).tolist())}" for name, each in squares.items()
    )
    return f"{parts}: {_conclusion(limit, case)}{_evidence(case)}"


def _conclusion(limit: str, case: _Case) -> str:
    if limit != "unclear":
        name = _NAMES[limit] if limit == "timing" else limit
        return f"the {name} {'are' if limit == 'intrinsics' else 'is'} the limit"
    if case.lens_unknown:
        return "the robot's part cannot be told from what else is wrong with lens or plate"
    return "no single one is the limit"


def _evidence(case: _Case) -> str:
    if case.model is case.before:
        return ""
    before, after = (
        _amount(model.noise.robot_rotation or 0.0, model.noise.robot_translation or 0.0)
        for model in (case.before, case.model)
    )
    return (
        "; with plate and lens as the images show them, what is put down to the robot goes from "
        f"{before} to {after}"
    )


def _amount(rotation: float, translation: float) -> str:
    return f"{_short(rotation / MRAD)} mrad and {_short(translation / MM)} mm"


def _short(value: float) -> str:
    return f"{value:.2g}" if value >= _NOTHING else "0"


def _unclear(case: _Case) -> BlameShares:
    """Return the verdict where nothing is known of the camera."""
    loop = case.loop
    noise = carried(loop.by_robot, case.model.covariance[:, :6, :6])
    fit = _Fit.of(loop.by_unknowns, noise)
    squares = fit.of_noise(noise) + fit.of_columns(loop.by_robot @ case.late.together)
    rotation, translation = np.sqrt(squares).tolist()
    words = (
        f"residuals of {_amount(rotation, translation)}: robot and camera cannot be told apart "
        "without covariances of the target's poses, their pixels, or the noise of one of them"
    )
    return BlameShares(rotation, translation, words=words)

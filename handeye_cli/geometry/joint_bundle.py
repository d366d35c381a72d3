"""Pixels, uncertain robot poses and shared intrinsics in one maximum-likelihood estimate.

Every station has a robot pose that is off by an unknown perturbation and a view whose pose closes
the loop, `B_i = X^-1 A_i^-1 Z`. Minimised is

    sum |pixel residuals|^2 / sigma^2 + sum a_i' S_robot,i^-1 a_i + prior of the intrinsics

over X, Z, all a_i and the intrinsics. To first order a view is a measurement of its pose that moves
with the intrinsics, and what is left of it speaks of the intrinsics alone. So a Gauss-Newton step
takes one 6x6 block per station and one system of X, Z and the intrinsics: O(N). That step is exact,
and also sound where the robot's noise vanishes.

The intrinsics are `parameters + directions @ shared`: directions that are not uncertain are left
out, and with the square root of a covariance as directions all shared unknowns are of size one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import pnp, se3
from handeye_cli.geometry.camera import Lens
from handeye_cli.geometry.loop import loop_jacobians
from handeye_cli.geometry.pnp import Sightings
from handeye_cli.geometry.scaled_inverse import scaled_inverse

FloatArray = NDArray[np.float64]

_CHUNK = 256
"""Views whose derivatives are held at a time: memory does not grow with them."""
_MAX_STEPS = 50
_HALVINGS = 20
_TOLERANCE = 1e-6
"""Largest step, in standard deviations, at which the iteration has settled."""
_GOOD_ENOUGH = 1e-3
"""The same where rounding lets no step decrease the squares any more."""
_ROUNDING = 1e-10
"""Relative growth of the squares that rounding explains."""
_VANISHING = 1e-12
"""Variance of a direction, relative to its parameters', that is taken as none."""


@dataclass(frozen=True)
class Prior:
    """What is known of the shared unknowns beforehand: squares `2 g' s + s' P s`.

    Attributes:
        information: (m, m) P.
        gradient: (m,) g at s = 0.
    """

    information: FloatArray
    gradient: FloatArray


@dataclass(frozen=True)
class JointProblem:
    """Stations with a robot pose and a view each.

    Attributes:
        A: (N, 4, 4) measured reference_T_mount.
        seen: The N views.
        sigma: (N,) standard deviation of each view's pixel coordinates.
        lens: Intrinsics at which the shared unknowns are zero.
        directions: (4 + k, m) how the intrinsics move with the shared unknowns; m is 0 where they
            are exact.
        prior: Of the shared unknowns.
    """

    A: FloatArray
    seen: Sightings
    sigma: FloatArray
    lens: Lens
    directions: FloatArray
    prior: Prior

    def lens_at(self, shared: FloatArray) -> Lens:
        """Return the intrinsics of (m,) shared unknowns."""
        return replace(self.lens, parameters=self.lens.parameters + self.directions @ shared)


@dataclass(frozen=True)
class JointState:
    """A value of all unknowns.

    Attributes:
        X: (4, 4) mount_T_camera.
        Z: (4, 4) reference_T_target.
        robot: (N, 6) perturbations that take the measured A_i to the true ones.
        shared: (m,) of the intrinsics.
    """

    X: FloatArray
    Z: FloatArray
    robot: FloatArray
    shared: FloatArray


@dataclass(frozen=True)
class ViewInformation:
    """What the pixels of N views say, to first order around given poses and intrinsics.

    Attributes:
        offsets: (N, 6) perturbation to the pose that fits the view best with these intrinsics.
        covariance: (N, 6, 6) of that pose.
        by_shared: (N, 6, m) how that pose moves with the shared unknowns.
        information: (N, m, m) on the shared unknowns, the view's own pose eliminated.
        gradient: (N, m) of half the squares by them, likewise.
    """

    offsets: FloatArray
    covariance: FloatArray
    by_shared: FloatArray
    information: FloatArray
    gradient: FloatArray


@dataclass(frozen=True)
class LinearLoops:
    """All loops as linear equations in the perturbations of X, Z and the shared unknowns.

    Attributes:
        poses: (N, 4, 4) camera_T_target that fits each view best with the state's intrinsics.
        residuals: (N, 6) of the loops between the measured robot poses and these.
        design: (N, 6, 12 + m) derivative by the unknowns.
        by_poses: (N, 6, 12) derivative by the perturbations of A_i and B_i.
        camera_covariance: (N, 6, 6) of B_i.
        information: (m, m) of views and prior on the shared unknowns, all poses eliminated.
        gradient: (m,) of half their squares.
    """

    poses: FloatArray
    residuals: FloatArray
    design: FloatArray
    by_poses: FloatArray
    camera_covariance: FloatArray
    information: FloatArray
    gradient: FloatArray


@dataclass(frozen=True)
class JointResult:
    """The optimum.

    Attributes:
        state: All unknowns.
        linear: The loops around it.
        converged: Whether the iteration settled.
    """

    state: JointState
    linear: LinearLoops
    converged: bool


@dataclass(frozen=True)
class JointInfluence:
    """How the estimate moves with the data, to first order.

    Attributes:
        by_poses: (N, 12 + m, 12) rows are X, Z and the shared unknowns, columns the perturbations
            of A_i and, at given intrinsics, B_i.
        shared: (12 + m, 12 + m) covariance that the error of the intrinsics from views and prior
            alone causes, which is independent of these perturbations.
        covariance: (12 + m, 12 + m) of all unknowns from all causes.
    """

    by_poses: FloatArray
    shared: FloatArray
    covariance: FloatArray


def uncertain_directions(covariance: FloatArray) -> FloatArray:
    """Return a (p, m) root of a (p, p) covariance without the directions that are exact."""
    sigma = np.sqrt(np.diag(covariance))
    scale = np.where(sigma > 0.0, sigma, 1.0)
    values, vectors = np.linalg.eigh(covariance / scale[:, None] / scale)
    kept = values > _VANISHING
    return np.asarray(scale[:, None] * vectors[:, kept] * np.sqrt(values[kept]))


def view_information(
    poses: FloatArray, seen: Sightings, sigma: FloatArray, lens: Lens, directions: FloatArray
) -> ViewInformation:
    """Return what the pixels say of each view's pose and of the shared unknowns.

    Args:
        poses: (N, 4, 4) camera_T_target.
        seen: The views.
        sigma: (N,) pixel noise.
        lens: Intrinsics.
        directions: (4 + k, m) how they move with the shared unknowns.
    """
    chunks = [slice(i, i + _CHUNK) for i in range(0, max(len(poses), 1), _CHUNK)]
    parts = [
        _information_of_chunk(poses[part], seen.part(part), sigma[part], lens, directions)
        for part in chunks
    ]
    return ViewInformation(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def _information_of_chunk(
    poses: FloatArray, seen: Sightings, sigma: FloatArray, lens: Lens, directions: FloatArray
) -> tuple[FloatArray, ...]:
    r, J, K = pnp.residuals(poses, seen, lens)
    K = K @ directions
    rows = len(poses), 2 * seen.points.shape[0]
    r, J, K = (
        each.reshape(*rows, each.shape[-1]) / sigma[:, None, None] for each in (r[..., None], J, K)
    )
    Jt = np.swapaxes(J, -1, -2)
    own = Jt @ J
    covariance = np.linalg.inv(own)
    by_shared = -np.asarray(np.linalg.solve(own, Jt @ K))
    offsets = -np.asarray(np.linalg.solve(own, Jt @ r))
    # What the pose does not take up, as residuals: no difference of large numbers.
    K = K + J @ by_shared
    Kt = np.swapaxes(K, -1, -2)
    return (
        offsets[..., 0],
        np.asarray((covariance + np.swapaxes(covariance, -1, -2)) / 2),
        by_shared,
        Kt @ K,
        (Kt @ r)[..., 0],
    )


def linearise(problem: JointProblem, state: JointState) -> LinearLoops:
    """Return the loops around a state, as the measured data see them."""
    A = se3.perturb(problem.A, state.robot)
    B = _view_poses(A, state)
    lens = problem.lens_at(state.shared)
    view = view_information(B, problem.seen, problem.sigma, lens, problem.directions)
    loop = loop_jacobians(A, B, state.X, state.Z)
    from_views = (loop.by_camera @ view.offsets[..., None])[..., 0]
    from_robot = (loop.by_robot @ state.robot[..., None])[..., 0]
    prior = problem.prior
    return LinearLoops(
        poses=se3.perturb(B, view.offsets),
        residuals=loop.residuals + from_views - from_robot,
        design=np.concatenate([loop.by_unknowns, loop.by_camera @ view.by_shared], axis=-1),
        by_poses=loop.by_poses,
        camera_covariance=view.covariance,
        information=view.information.sum(axis=0) + prior.information,
        gradient=view.gradient.sum(axis=0) + prior.gradient + prior.information @ state.shared,
    )


def refine(problem: JointProblem, covariance: FloatArray, start: JointState) -> JointResult:
    """Minimise the squares of pixels, robot poses and prior by Gauss-Newton steps.

    A step that does not decrease them is halved.

    Args:
        problem: The stations.
        covariance: (N, 6, 6) of the perturbations of A_i, positive definite.
        start: First guess; all targets in front of the camera.
    """
    state, squares = start, _squares(problem, covariance, start)
    linear = linearise(problem, state)
    for _ in range(_MAX_STEPS):
        step = _step(linear, covariance, state)
        if step.length <= _TOLERANCE:
            return JointResult(state, linear, converged=True)
        for share in 0.5 ** np.arange(_HALVINGS):
            tried = _moved(state, step, share)
            tried_squares = _squares(problem, covariance, tried)
            if tried_squares <= squares * (1.0 + _ROUNDING):
                break
        else:
            return JointResult(state, linear, converged=step.length <= _GOOD_ENOUGH)
        state, squares = tried, tried_squares
        linear = linearise(problem, state)
    return JointResult(state, linear, converged=False)


def influence(linear: LinearLoops, covariance: FloatArray) -> JointInfluence:
    """Return how the optimum moves with the data.

    Args:
        linear: The loops around it.
        covariance: (N, 6, 6) of the perturbations of A_i.
    """
    normal = _normal_equations(linear, covariance)
    inverse = scaled_inverse(normal.information)
    inverse = (inverse + inverse.T) / 2
    return JointInfluence(
        by_poses=-inverse @ normal.weighted @ linear.by_poses,
        shared=inverse[:, 12:] @ linear.information @ inverse[12:],
        covariance=inverse,
    )


def _view_poses(A: FloatArray, state: JointState) -> FloatArray:
    return se3.inverse(A @ state.X) @ state.Z


def _squares(problem: JointProblem, covariance: FloatArray, state: JointState) -> float:
    lens = problem.lens_at(state.shared)
    if not np.all(lens.parameters[:2] > 0.0):
        return np.inf
    poses = _view_poses(se3.perturb(problem.A, state.robot), state)
    pixels = pnp.squared_residuals(poses, problem.seen, lens) / problem.sigma**2
    known = 2.0 * problem.prior.gradient + problem.prior.information @ state.shared
    return float(np.sum(pixels) + _weighed(covariance, state.robot) + state.shared @ known)


def _weighed(covariance: FloatArray, robot: FloatArray) -> float:
    return float(np.sum(robot * np.linalg.solve(covariance, robot[..., None])[..., 0]))


@dataclass(frozen=True)
class _Step:
    """A step of the (12 + m,) common unknowns and the (N, 6) robot poses; its size in sigmas."""

    common: FloatArray
    robot: FloatArray
    length: float


def _moved(state: JointState, step: _Step, share: float) -> JointState:
    common = share * step.common
    return JointState(
        X=se3.perturb(state.X, common[:6]),
        Z=se3.perturb(state.Z, common[6:12]),
        robot=state.robot + share * step.robot,
        shared=state.shared + common[12:],
    )


@dataclass(frozen=True)
class _NormalEquations:
    """Of the common unknowns, the robot's poses eliminated.

    Attributes:
        information: (12 + m, 12 + m).
        weighted: (N, 12 + m, 6) derivatives of the loops, weighted.
        weight: (N, 6, 6) inverse covariances of the loops' residuals.
    """

    information: FloatArray
    weighted: FloatArray
    weight: FloatArray


def _normal_equations(linear: LinearLoops, covariance: FloatArray) -> _NormalEquations:
    G, C = linear.by_poses[..., :6], linear.by_poses[..., 6:]
    spread = G @ covariance @ np.swapaxes(G, -1, -2)
    spread = spread + C @ linear.camera_covariance @ np.swapaxes(C, -1, -2)
    weight = np.asarray(np.linalg.inv(spread))
    weighted = np.swapaxes(linear.design, -1, -2) @ weight
    information = np.einsum("nij,njk->ik", weighted, linear.design)
    information[12:, 12:] += linear.information
    return _NormalEquations(information, weighted, weight)


def _step(linear: LinearLoops, covariance: FloatArray, state: JointState) -> _Step:
    normal = _normal_equations(linear, covariance)
    gradient = np.einsum("nij,nj->i", normal.weighted, linear.residuals)
    gradient[12:] += linear.gradient
    common = -scaled_inverse(normal.information) @ gradient
    left = linear.residuals + linear.design @ common
    to_robot = covariance @ np.swapaxes(linear.by_poses[..., :6], -1, -2) @ normal.weight
    robot = -(to_robot @ left[..., None])[..., 0] - state.robot
    squares = common @ normal.information @ common + _weighed(covariance, robot)
    return _Step(common, robot, float(np.sqrt(squares)))

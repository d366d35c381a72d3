"""The answer from pixels, uncertain robot poses and uncertain intrinsics together.

The poses of the target rest on intrinsics, whose error is common to all of them. Intrinsics with a
covariance are therefore unknowns of their own: calibrated from the same images, the pixels alone
speak for them; given with a covariance, that is their prior. So the robot's poses help them, and
what remains of their error is part of the answer's.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.errors import ConvergenceError
from handeye_cli.estimates import Estimate
from handeye_cli.geometry import joint_bundle, pnp
from handeye_cli.geometry.joint_bundle import JointProblem, JointResult, JointState, Prior
from handeye_cli.geometry.loop import loop_jacobians
from handeye_cli.intrinsics_check import check_intrinsics
from handeye_cli.noise_levels import Loops, NoiseModel, noise_of_loops
from handeye_cli.pixel_data import LEAST_SIGMA, PixelData, pixel_data
from handeye_cli.predict import scale_freedom
from handeye_cli.records import Camera, FloatArray, IntArray, Noise, Stations
from handeye_cli.solvers.problem import Solution

_ROUNDS = 30
_SETTLED = 1e-3
"""Change of the noise, in its own standard deviations, at which noise and answer agree."""


def refine(stations: Stations, chain: Chain, start: Solution, model: NoiseModel) -> Estimate:
    """Estimate X, Z, the robot's poses and uncertain intrinsics from pixels and robot poses.

    Args:
        stations: The document; with intrinsics calibrated from its images, the pixels of stations
            outside the chain still speak for these.
        chain: The stations whose robot poses are used; `has_pixels` is true of them.
        start: A solution by the poses alone.
        model: The noise it was found with.

    Raises:
        InputError: Pixels have no place on the target, or are not those of the station's pose.
        ConvergenceError: The refinement, or the noise, did not settle.
    """
    data = pixel_data(stations)
    state = _start(data, start, len(chain.A))
    for _ in range(_ROUNDS):
        problem = _problem(data, chain)
        result = joint_bundle.refine(problem, model.covariance[:, :6, :6], state)
        if not result.converged:
            raise ConvergenceError(
                f"the joint refinement of pixels and robot poses did not converge on "
                f"{len(chain.A)} stations",
                hint="try --method tsai-lenz, and look at the residuals of the stations",
            )
        state, previous = result.state, model
        model = _noise(stations, chain, result, previous)
        change = model.variances - previous.variances
        used, data = data, _with_seen_noise(stations, data, problem, result)
        settled = change @ model.information @ change <= _SETTLED**2
        if settled and np.allclose(data.sigma, used.sigma, rtol=_SETTLED, atol=0.0):
            return _estimate(used, chain, result, previous, model)
    raise ConvergenceError(
        f"the noise levels did not settle in {_ROUNDS} rounds on {len(chain.A)} stations",
        hint="give them under 'noise' in the document",
    )


def _problem(data: PixelData, chain: Chain) -> JointProblem:
    rows = data.rows(chain)
    return JointProblem(
        A=chain.A,
        seen=data.seen(rows),
        sigma=data.sigma[rows],
        lens=data.camera.lens,
        directions=data.directions,
        prior=_prior(data, rows),
    )


def _prior(data: PixelData, rows: IntArray) -> Prior:
    """Return what is known of the intrinsics besides the pixels of the given views."""
    size = data.directions.shape[1]
    if not data.calibrated:
        return Prior(np.eye(size), np.zeros(size))
    others = data.information(np.setdiff1d(np.arange(len(data.poses)), rows))
    return Prior(others.information.sum(axis=0), others.gradient.sum(axis=0))


def _start(data: PixelData, start: Solution, count: int) -> JointState:
    return JointState(start.X, start.Z, np.zeros((count, 6)), np.zeros(data.directions.shape[1]))


def _noise(stations: Stations, chain: Chain, result: JointResult, before: NoiseModel) -> NoiseModel:
    linear = result.linear
    residuals, of_intrinsics = _whitened(linear.information, linear.gradient)
    by_robot = linear.by_poses[..., :6] @ chain.by_shared_error
    design = np.concatenate([linear.design, by_robot], axis=-1)
    beside = np.eye(design.shape[-1])[12:]
    beside[: len(residuals), 12 : 12 + len(residuals)] = of_intrinsics
    residuals = np.concatenate([residuals, np.zeros(by_robot.shape[-1])])
    loops = Loops(linear.residuals, design, linear.by_poses, residuals, beside)
    seen = replace(chain, camera_covariance=linear.camera_covariance, has_covariance=True)
    return noise_of_loops(seen, stations.noise, loops, before.noise)


def _with_seen_noise(
    stations: Stations, data: PixelData, problem: JointProblem, result: JointResult
) -> PixelData:
    """Return the data with the pixel noise that the refined intrinsics leave.

    The document's is that of intrinsics that were not refined yet. It is kept where these are
    exact, where it was given, and where as many pixels as unknowns leave nothing.
    """
    unknowns = problem.directions.shape[1]
    freedom = 2 * int(problem.seen.mask.sum()) - 6 * len(problem.A) - unknowns
    given = stations.noise is not None and stations.noise.pixel is not None
    if given or unknowns == 0 or freedom < 1:
        return data
    lens = problem.lens_at(result.state.shared)
    squares = pnp.squared_residuals(result.linear.poses, problem.seen, lens) / problem.sigma**2
    factor = float(np.sqrt(np.sum(squares) / freedom))
    return replace(data, sigma=np.maximum(factor * data.sigma, LEAST_SIGMA))


def _whitened(information: FloatArray, gradient: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return equations of unit variance with this information and gradient."""
    values, vectors = np.linalg.eigh(information)
    root = np.sqrt(np.maximum(values, np.finfo(float).tiny))
    return (vectors.T @ gradient) / root, root[:, None] * vectors.T


def _estimate(
    data: PixelData, chain: Chain, result: JointResult, used: NoiseModel, model: NoiseModel
) -> Estimate:
    """Return the estimate; `used` is the noise it was found with, `model` what it leaves."""
    state, linear = result.state, result.linear
    moves = joint_bundle.influence(linear, used.covariance[:, :6, :6])
    by_robot_error = np.einsum("nij,njk->ik", moves.by_poses[..., :6], chain.by_shared_error)
    of_robot_error = by_robot_error @ by_robot_error.T
    common = moves.shared + of_robot_error
    spread = moves.covariance[12:, 12:] + of_robot_error[12:, 12:]
    camera = _refined(data, state.shared, spread)
    influence, of_intrinsics = moves.by_poses[:, :12], moves.by_poses[:, 12:]
    freedom = scale_freedom(influence, model, moves.shared[:12, :12])
    doubt = check_intrinsics(linear, spread, freedom, data.camera, camera)
    return Estimate(
        solution=Solution(state.X, state.Z),
        residuals=loop_jacobians(chain.A, linear.poses, state.X, state.Z).residuals,
        model=replace(model, noise=_with_pixel_noise(model.noise, data, chain)),
        influence=influence,
        shared=common[:12, :12],
        with_causes=np.concatenate([common[:12, 12:], by_robot_error[:12]], axis=1),
        causes=_causes(common[12:, 12:], by_robot_error[12:]),
        causes_influence=np.pad(of_intrinsics, ((0, 0), (0, by_robot_error.shape[1]), (0, 0))),
        camera=camera,
        findings=(doubt,) if doubt else (),
    )


def _causes(intrinsics: FloatArray, by_robot_error: FloatArray) -> FloatArray:
    """Return the (q, q) covariance of the shared errors, of the intrinsics and the robot poses.

    Args:
        intrinsics: (m, m) covariance of the former.
        by_robot_error: (m, q - m) how they move with the latter, which is of unit variance.
    """
    robot = np.eye(by_robot_error.shape[1])
    return np.block([[intrinsics, by_robot_error], [by_robot_error.T, robot]])


def _with_pixel_noise(noise: Noise, data: PixelData, chain: Chain) -> Noise:
    if noise.pixel is not None:
        return noise
    return replace(noise, pixel=float(np.sqrt(np.mean(data.sigma[data.rows(chain)] ** 2))))


def _refined(data: PixelData, shared: FloatArray, covariance: FloatArray) -> Camera:
    """Return the camera moved by the shared unknowns; the given one where it was exact."""
    if not shared.size:
        return data.camera
    values = data.camera.parameters + data.directions @ shared
    fx, fy, cx, cy, *distortion = values.tolist()
    spread = data.directions @ covariance @ data.directions.T
    return replace(
        data.camera,
        fx=fx,
        fy=fy,
        cx=cx,
        cy=cy,
        distortion=tuple(distortion),
        covariance=(spread + spread.T) / 2,
    )

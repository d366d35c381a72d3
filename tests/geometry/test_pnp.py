"""Planar poses against exact views, OpenCV's solvers, brute force and sampled noise."""

import cv2
import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from handeye_cli.geometry import pnp, se3
from handeye_cli.geometry.camera import Lens, project
from handeye_cli.geometry.pnp import Sightings

MATRIX = np.array([[550.0, 0, 320.0], [0, 540.0, 240.0], [0, 0, 1]])
LENS = Lens(np.array([550.0, 540.0, 320.0, 240.0, -0.2, 0.05, 1e-3, -5e-4, 0.01]))
FISHEYE = Lens(np.array([300.0, 300.0, 320.0, 240.0, -0.02, 0.004]), "equidistant")
PLATE = 0.005 * np.array([[x, y, 0.0] for y in range(6) for x in range(6)])
TAG = 0.024 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
SIGMA = 0.2


def tilted_views(count: int, seed: int, tilt=(0.15, 1.0), distance=(0.1, 0.3)) -> np.ndarray:
    """Poses camera_T_target, spun freely and tilted away from facing the camera."""
    rng = np.random.default_rng(seed)
    about = rng.uniform(-np.pi, np.pi, count)
    axis = np.stack([np.cos(about), np.sin(about), np.zeros(count)], axis=-1)
    tilts = Rotation.from_rotvec(rng.uniform(*tilt, (count, 1)) * axis)
    spins = Rotation.from_rotvec(rng.uniform(-np.pi, np.pi, (count, 1)) * [0.0, 0.0, 1.0])
    away = rng.uniform(*distance, count)
    sideways = rng.uniform(-0.15, 0.15, (2, count)) * away
    return se3.from_parts((tilts * spins).as_matrix(), np.stack([*sideways, away], axis=-1))


def sightings(poses, points=PLATE, lens=LENS, sigma=0.0, seed=0) -> Sightings:
    pixels = project(se3.transform_points(poses, points), lens.parameters, lens.model)
    noise = sigma * np.random.default_rng(seed).normal(size=pixels.shape)
    return Sightings(points, pixels + noise, np.ones(pixels.shape[:-1], dtype=bool))


def one_view(seen: Sightings, index: int) -> Sightings:
    return Sightings(seen.points, seen.pixels[index], seen.mask[index])


def opencv_poses(seen: Sightings, flag: int) -> np.ndarray:
    _, turns, moves, _ = cv2.solvePnPGeneric(
        seen.points, seen.pixels, MATRIX, LENS.parameters[4:], flags=flag
    )
    return np.array(
        [se3.from_parts(cv2.Rodrigues(r)[0], t[:, 0]) for r, t in zip(turns, moves, strict=True)]
    )


def local_minimum(start: np.ndarray, seen: Sightings) -> tuple[float, np.ndarray]:
    """Sum of squares and pose that SciPy finds from one start, with its own derivatives."""

    def error(d):
        here = se3.transform_points(se3.perturb(start, d), seen.points)
        return (project(here, LENS.parameters) - seen.pixels).ravel()

    found = least_squares(error, np.zeros(6), x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14)
    return 2.0 * found.cost, se3.perturb(start, found.x)


@pytest.mark.parametrize("lens", [LENS, FISHEYE], ids=lambda lens: lens.model)
@pytest.mark.parametrize("points", [PLATE, TAG], ids=["plate", "tag"])
def test_exact_pixels_give_the_exact_pose(points, lens):
    poses = tilted_views(100, 1)
    found = pnp.planar_poses(sightings(poses, points, lens), lens)
    assert found.poses[:, 0] == pytest.approx(poses, abs=1e-10)
    assert np.all(found.squares[:, 0] < 1e-20)


def test_points_that_were_not_seen_are_ignored():
    rng = np.random.default_rng(2)
    poses = tilted_views(60, 2)
    seen = sightings(poses)
    mask = rng.random(seen.mask.shape) < 0.4
    mask[:, [0, 5, 17, 33]] = True
    pixels = np.where(mask[..., None], seen.pixels, np.nan)
    found = pnp.planar_poses(Sightings(PLATE, pixels, mask), LENS)
    assert found.poses[:, 0] == pytest.approx(poses, abs=1e-9)


def test_homography_maps_the_plane_onto_the_directions():
    poses = tilted_views(20, 3)
    here = se3.transform_points(poses, PLATE)
    directions = here[..., :2] / here[..., 2:]
    found = pnp.homography(PLATE[:, :2], directions, np.ones((20, 36), dtype=bool))
    expected = np.concatenate([poses[:, :3, :2], poses[:, :3, 3:]], axis=-1)
    expected /= np.linalg.norm(expected, axis=(1, 2), keepdims=True)
    assert found == pytest.approx(expected, abs=1e-10)
    assert pnp.pose_from_homography(7.0 * found) == pytest.approx(poses, abs=1e-9)


def test_best_pose_is_no_worse_than_opencvs():
    poses = tilted_views(40, 4)
    seen = sightings(poses, sigma=SIGMA, seed=4)
    found = pnp.planar_poses(seen, LENS)
    for index in range(len(poses)):
        view = one_view(seen, index)
        theirs = opencv_poses(view, cv2.SOLVEPNP_ITERATIVE)[0]
        squares = pnp.squared_residuals(theirs, view, LENS)
        assert found.squares[index, 0] <= squares * (1 + 1e-6)
        assert np.min(np.abs(found.squares[index] / squares - 1)) < 1e-6


def test_both_optima_are_those_of_ippe():
    poses = tilted_views(12, 5, tilt=(0.4, 1.0))
    seen = sightings(poses, sigma=SIGMA, seed=5)
    found = pnp.planar_poses(seen, LENS)
    assert np.all(found.distinct)
    for index in range(len(poses)):
        view = one_view(seen, index)
        starts = opencv_poses(view, cv2.SOLVEPNP_IPPE)
        expected = sorted(local_minimum(start, view)[0] for start in starts)
        assert found.squares[index] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("distance", [0.1, 0.3, 0.6])
def test_both_optima_against_local_searches_from_many_starts(distance):
    poses = tilted_views(1, 6, tilt=(0.6, 0.7), distance=(distance, distance))
    view = one_view(sightings(poses, sigma=SIGMA, seed=6), 0)
    found = pnp.planar_poses(view, LENS)
    R = poses[0, :3, :3]
    spin = Rotation.from_euler("z", np.arctan2(R[1, 0] - R[0, 1], R[0, 0] + R[1, 1]))
    ends = []
    for about in np.arange(0.0, 2 * np.pi, np.pi / 4):
        tilt = Rotation.from_rotvec(0.9 * np.array([np.cos(about), np.sin(about), 0.0]))
        start = se3.from_parts((tilt * spin).as_matrix(), poses[0, :3, 3])
        squares, end = local_minimum(start, view)
        if np.all(se3.transform_points(end, PLATE)[:, 2] > 0):
            ends.append(squares)
    least = min(ends)
    others = [squares for squares in ends if squares > least * (1 + 1e-6)]
    assert found.squares[0] == pytest.approx(least, rel=1e-6)
    assert found.squares[1] == pytest.approx(min(others), rel=1e-6)


@pytest.mark.parametrize(
    ("tilt", "distance", "distinct"),
    [(0.0, 0.2, False), (0.02, 0.4, False), (0.3, 0.05, False), (0.3, 0.2, True), (0.6, 1.0, True)],
)
def test_the_second_pose_merges_into_the_first(tilt, distance, distinct):
    """Seen from the front, or from so near that perspective tells, there is one optimum only."""
    turn = Rotation.from_rotvec([tilt, 0.0, 0.0]).as_matrix()
    pose = se3.from_parts(turn, np.array([0.0, 0.0, distance]))
    centred = PLATE - PLATE.mean(axis=0)
    found = pnp.planar_poses(sightings(pose, centred), LENS)
    assert bool(found.distinct) is distinct
    assert bool(np.isfinite(found.squares[1])) is distinct
    apart = np.linalg.norm(se3.difference(found.poses[0], found.poses[1]))
    assert apart > 0.3 if distinct else apart < 1e-6


def test_a_small_tag_reaches_its_optimum():
    pixels = np.array(
        [[278.238, 205.258], [280.764, 221.387], [263.103, 223.244], [260.794, 207.832]]
    )
    lens = Lens(np.array([550, 550, 320, 240, -0.2, 0.05, 0.001, -0.0005, 0.0]))
    seen = Sightings(TAG, pixels, np.ones(4, dtype=bool))
    found = pnp.planar_poses(seen, lens)
    assert found.squares[0] == pytest.approx(0.15900757, rel=1e-6)


@pytest.mark.parametrize("points", [PLATE[::5], TAG], ids=["plate", "tag"])
def test_information_predicts_the_sampled_covariance(points):
    trials, sigma = 2000, 0.05
    pose = tilted_views(1, 7, tilt=(0.5, 0.6), distance=(0.15, 0.16))[0]
    seen = sightings(np.broadcast_to(pose, (trials, 4, 4)), points, sigma=sigma, seed=7)
    found, _ = pnp.refine(np.broadcast_to(pose, (trials, 4, 4)), seen, LENS)
    information = pnp.pose_information(pose, one_view(seen, 0), LENS)
    root = np.linalg.cholesky(information) / sigma
    white = se3.difference(found, pose) @ root
    low, high = chi2.ppf([1e-4, 1 - 1e-4], 6 * trials)
    assert low < np.sum(white**2) < high
    # The eigenvalues of a sample covariance of white noise spread by 1 +- 2 sqrt(6 / trials).
    eigenvalues = np.linalg.eigvalsh(white.T @ white / trials)
    assert eigenvalues == pytest.approx(np.ones(6), abs=0.15)


def test_the_residual_at_the_optimum_has_the_right_freedom():
    poses = tilted_views(300, 8)
    seen = sightings(poses, sigma=SIGMA, seed=8)
    _, squares = pnp.refine(poses, seen, LENS)
    low, high = chi2.ppf([1e-4, 1 - 1e-4], 300 * (72 - 6))
    assert low < np.sum(squares) / SIGMA**2 < high


@pytest.mark.parametrize("lens", [LENS, FISHEYE], ids=lambda lens: lens.model)
def test_residual_derivatives_against_central_differences(lens):
    pose = tilted_views(1, 9)[0]
    seen = sightings(pose, lens=lens, sigma=SIGMA, seed=9)
    r, by_pose, by_parameters = pnp.residuals(pose, seen, lens)
    expected = project(se3.transform_points(pose, PLATE), lens.parameters, lens.model)
    assert r == pytest.approx(expected - seen.pixels, abs=1e-10)
    h = 1e-6
    for k in range(6):
        d = h * np.eye(6)[k]
        ahead, _, _ = pnp.residuals(se3.perturb(pose, d), seen, lens)
        behind, _, _ = pnp.residuals(se3.perturb(pose, -d), seen, lens)
        numeric = (ahead - behind) / (2 * h)
        assert by_pose[..., k] == pytest.approx(numeric, rel=1e-6, abs=1e-5)
    for k, p in enumerate(lens.parameters):
        d = 1e-6 * max(abs(p), 1.0) * np.eye(lens.parameters.size)[k]
        ahead, _, _ = pnp.residuals(pose, seen, Lens(lens.parameters + d, lens.model))
        behind, _, _ = pnp.residuals(pose, seen, Lens(lens.parameters - d, lens.model))
        numeric = (ahead - behind) / (2 * d[k])
        assert by_parameters[..., k] == pytest.approx(numeric, rel=1e-6, abs=1e-5)


def test_a_batch_is_a_loop():
    poses = tilted_views(6, 10, tilt=(0.3, 0.8)).reshape(2, 3, 4, 4)
    seen = sightings(poses, sigma=SIGMA, seed=10)
    found = pnp.planar_poses(seen, LENS)
    start = se3.perturb(poses, np.array([0.003, -0.002, 0.004, 0.1, -0.05, 0.02]))
    refined, squares = pnp.refine(start, seen, LENS)
    information = pnp.pose_information(poses, seen, LENS)
    assert found.poses.shape == (2, 3, 2, 4, 4)
    assert found.distinct.shape == squares.shape == (2, 3)
    for index in np.ndindex(2, 3):
        view = Sightings(PLATE, seen.pixels[index], seen.mask[index])
        single = pnp.planar_poses(view, LENS)
        # Both stop when a step gains 1e-13 of the squares (66 sigma^2), hence within 3e-6 of the
        # standard deviations, which are below 3e-3.
        assert single.poses == pytest.approx(found.poses[index], abs=2e-8)
        assert single.squares == pytest.approx(found.squares[index], rel=1e-11)
        assert pnp.refine(start[index], view, LENS)[0] == pytest.approx(refined[index], abs=2e-8)
        one = pnp.pose_information(poses[index], view, LENS)
        assert one == pytest.approx(information[index], rel=1e-12)


def test_a_target_behind_the_camera_has_infinite_squares():
    pose = tilted_views(1, 11)[0]
    seen = sightings(pose)
    behind = pose.copy()
    behind[2, 3] *= -1.0
    both = Sightings(PLATE, np.stack([seen.pixels] * 2), np.stack([seen.mask] * 2))
    squares = pnp.squared_residuals(np.stack([pose, behind]), both, LENS)
    assert squares[0] < 1e-20
    assert squares[1] == np.inf


def test_only_a_seen_point_behind_the_camera_counts():
    points = PLATE - PLATE.mean(axis=0)
    turn = Rotation.from_rotvec([1.5, 0.0, 0.0]).as_matrix()
    edge_on = se3.from_parts(turn, np.array([0.0, 0.0, 0.01]))
    depth = se3.transform_points(edge_on, points)[:, 2]
    assert depth.min() < 0 < depth.max()
    pixels = np.zeros((36, 2))
    everywhere = Sightings(points, pixels, np.ones(36, dtype=bool))
    in_front = Sightings(points, pixels, depth > 0)
    assert pnp.squared_residuals(edge_on, everywhere, LENS) == np.inf
    assert np.isfinite(pnp.squared_residuals(edge_on, in_front, LENS))

"""Planar calibration against OpenCV's and against the dense normal equations of all unknowns."""

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from handeye_cli.geometry import bundle, se3
from handeye_cli.geometry.camera import Lens, project
from handeye_cli.geometry.pnp import Sightings

SIZE = (640, 480)
PLATE = 0.02 * np.array([[x - 4.0, y - 2.5, 0.0] for y in range(6) for x in range(9)])
SIGMA = 0.1
TRUTH = {
    0: [],
    2: [-0.25, 0.08],
    4: [-0.25, 0.08, 1e-3, -5e-4],
    5: [-0.25, 0.08, 1e-3, -5e-4, -0.02],
}
FLAGS = {
    0: cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
    2: cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
    4: cv2.CALIB_FIX_K3,
    5: 0,
}


def true_lens(count: int) -> Lens:
    return Lens(np.array([552.0, 548.0, 322.5, 237.5, *TRUTH[count]]))


def true_poses(count: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    turns = rng.uniform([-0.6, -0.6, -1.0], [0.6, 0.6, 1.0], (count, 3))
    places = rng.uniform([-0.05, -0.03, 0.25], [0.05, 0.03, 0.4], (count, 3))
    return se3.from_parts(Rotation.from_rotvec(turns).as_matrix(), places)


def views(lens: Lens, poses: np.ndarray, sigma: float, seed: int) -> Sightings:
    pixels = project(se3.transform_points(poses, PLATE), lens.parameters, lens.model)
    noise = sigma * np.random.default_rng(seed).normal(size=pixels.shape)
    return Sightings(PLATE, pixels + noise, np.ones(pixels.shape[:-1], dtype=bool))


def first_guess(lens: Lens, poses: np.ndarray) -> tuple[Lens, np.ndarray]:
    """Plain pinhole in the middle, and poses some millimetres and degrees off."""
    start = np.array([500.0, 500.0, 319.5, 239.5, *np.zeros(lens.parameters.size - 4)])
    off = 0.01 * np.random.default_rng(9).normal(size=(len(poses), 6))
    return Lens(start, lens.model), se3.perturb(poses, off)


def homographies(lens: Lens, poses: np.ndarray) -> np.ndarray:
    fx, fy, cx, cy = lens.parameters[:4]
    matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    return matrix @ np.concatenate([poses[:, :3, :2], poses[:, :3, 3:]], axis=-1)


@pytest.mark.parametrize("focal", [200.0, 552.0, 3000.0])
@pytest.mark.parametrize("count", [1, 6])
def test_focal_length_of_exact_homographies(focal, count):
    lens = Lens(np.array([focal, focal, 319.5, 239.5]))
    H = homographies(lens, true_poses(count, 1))
    scales = np.random.default_rng(2).uniform(-3, 3, (count, 1, 1))
    assert bundle.focal_length(scales * H, *SIZE) == pytest.approx(focal, rel=1e-9)


def test_focal_length_near_the_truth_for_a_real_principal_point():
    lens = true_lens(0)
    found = bundle.focal_length(homographies(lens, true_poses(10, 3)), *SIZE)
    assert found == pytest.approx(550.0, rel=0.05)


def test_frontal_views_do_not_tell_the_focal_length():
    spins = Rotation.from_rotvec(np.linspace(0, 3, 5)[:, None] * [0.0, 0.0, 1.0]).as_matrix()
    poses = se3.from_parts(spins, np.array([0.01, 0.0, 0.3]))
    lens = Lens(np.array([550.0, 550.0, 319.5, 239.5]))
    assert bundle.focal_length(homographies(lens, poses), *SIZE) is None


@pytest.mark.parametrize("count", TRUTH)
def test_exact_pixels_give_the_exact_lens(count):
    lens, poses = true_lens(count), true_poses(6, 4)
    found = bundle.calibrate(views(lens, poses, 0.0, 0), *first_guess(lens, poses))
    assert found.converged
    assert found.parameters == pytest.approx(lens.parameters, rel=1e-7, abs=1e-7)
    assert found.poses == pytest.approx(poses, abs=1e-8)
    assert found.squares < 1e-14


def opencv_calibration(seen: Sightings, count: int) -> tuple[float, np.ndarray]:
    """Sum of squares and parameters of OpenCV with as many coefficients."""
    boards = [PLATE.astype(np.float32)] * len(seen.pixels)
    pixels = [one.astype(np.float32)[:, None] for one in seen.pixels]
    start = np.array([[500.0, 0, 319.5], [0, 500.0, 239.5], [0, 0, 1]])
    flags = FLAGS[count] | cv2.CALIB_USE_INTRINSIC_GUESS
    stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 500, 1e-15)
    rms, K, d, _, _ = cv2.calibrateCamera(
        boards, pixels, SIZE, start, np.zeros(5), flags=flags, criteria=stop
    )
    parameters = np.array([K[0, 0], K[1, 1], K[0, 2], K[1, 2], *d.ravel()[:count]])
    return rms**2 * seen.mask.sum(), parameters


@pytest.mark.parametrize("count", TRUTH)
def test_calibration_is_opencvs(count):
    lens, poses = true_lens(count), true_poses(8, 5)
    seen = views(lens, poses, SIGMA, 5)
    # OpenCV takes points and pixels in single precision: both get the same rounded ones.
    single = Sightings(
        PLATE.astype(np.float32).astype(float),
        seen.pixels.astype(np.float32).astype(float),
        seen.mask,
    )
    squares, parameters = opencv_calibration(single, count)
    found = bundle.calibrate(single, *first_guess(lens, poses))
    deviations = SIGMA * np.sqrt(np.diag(np.linalg.inv(found.information)))
    assert found.converged
    assert found.squares <= squares * (1 + 1e-6)
    assert np.max(np.abs(found.parameters - parameters) / deviations) < 1e-2


def dense_jacobian(seen: Sightings, lens: Lens, poses: np.ndarray) -> np.ndarray:
    """Central differences of all residuals by the intrinsics and then every pose."""

    def residuals(moved: np.ndarray) -> np.ndarray:
        parameters = lens.parameters + moved[: lens.parameters.size]
        turned = se3.perturb(poses, moved[lens.parameters.size :].reshape(-1, 6))
        pixels = project(se3.transform_points(turned, PLATE), parameters, lens.model)
        return np.where(seen.mask[..., None], pixels - seen.pixels, 0.0).ravel()

    size = lens.parameters.size + 6 * len(poses)
    steps = np.full(size, 1e-6)
    steps[:4] = 1e-3
    columns = [(residuals(d) - residuals(-d)) / (2 * d.sum()) for d in np.diag(steps)]
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("model", ["plumb_bob", "equidistant"])
def test_information_is_the_schur_complement_of_the_dense_one(model):
    lens = Lens(true_lens(4).parameters, model)
    poses = true_poses(4, 6)
    seen = views(lens, poses, SIGMA, 6)
    found = bundle.calibrate(seen, *first_guess(lens, poses))
    best = Lens(found.parameters, model)
    J = dense_jacobian(seen, best, found.poses)
    normal = J.T @ J
    eliminated = normal[:8, :8] - normal[:8, 8:] @ np.linalg.solve(normal[8:, 8:], normal[8:, :8])
    scale = 1.0 / np.sqrt(np.diag(eliminated))
    expected = eliminated * scale[:, None] * scale
    # Differences are good to 1e-7; the elimination leaves about 1e-3 of a diagonal element.
    assert found.information * scale[:, None] * scale == pytest.approx(expected, abs=1e-4)
    assert J.T @ _residuals(seen, best, found.poses) == pytest.approx(
        np.zeros(len(normal)), abs=1e-3 * np.sqrt(np.max(np.diag(normal))) * SIGMA
    )


def _residuals(seen: Sightings, lens: Lens, poses: np.ndarray) -> np.ndarray:
    pixels = project(se3.transform_points(poses, PLATE), lens.parameters, lens.model)
    return (pixels - seen.pixels).ravel()


def test_information_predicts_the_sampled_intrinsics():
    lens, poses = true_lens(2), true_poses(5, 7)
    trials = 100
    found = [
        bundle.calibrate(views(lens, poses, SIGMA, 100 + k), lens, poses) for k in range(trials)
    ]
    root = np.linalg.cholesky(found[0].information) / SIGMA
    white = np.array([(one.parameters - lens.parameters) @ root for one in found])
    low, high = chi2.ppf([1e-4, 1 - 1e-4], 6 * trials)
    assert low < np.sum(white**2) < high
    squares = sum(one.squares for one in found) / SIGMA**2
    low, high = chi2.ppf([1e-4, 1 - 1e-4], trials * (5 * 54 * 2 - 6 - 30))
    assert low < squares < high


def test_points_that_were_not_seen_are_ignored():
    lens, poses = true_lens(5), true_poses(6, 8)
    seen = views(lens, poses, 0.0, 8)
    mask = np.random.default_rng(8).random(seen.mask.shape) < 0.6
    holes = Sightings(PLATE, np.where(mask[..., None], seen.pixels, np.nan), mask)
    found = bundle.calibrate(holes, *first_guess(lens, poses))
    assert found.parameters == pytest.approx(lens.parameters, rel=1e-6, abs=1e-6)

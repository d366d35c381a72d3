"""The camera model against OpenCV's, central differences and its own inverse."""

import cv2
import numpy as np
import pytest

from handeye_cli.geometry import camera

PINHOLE = [612.0, 598.0, 321.4, 238.7]
LENSES = {
    "pinhole": ("plumb_bob", []),
    "two": ("plumb_bob", [-0.28, 0.09]),
    "plumb_bob": ("plumb_bob", [-0.28, 0.09, 1.2e-3, -8e-4, -0.01]),
    "rational": ("rational_polynomial", [0.4, -0.2, 1e-3, 5e-4, 0.03, 0.7, -0.1, 0.02]),
    "prism": (
        "rational_polynomial",
        [0.4, -0.2, 1e-3, 5e-4, 0.03, 0.7, -0.1, 0.02, 2e-3, -1e-3, 1.5e-3, 4e-4],
    ),
    "equidistant": ("equidistant", [0.05, -0.012, 0.004, -0.0007]),
    "equidistant two": ("equidistant", [0.05, -0.012]),
    "equidistant pinhole": ("equidistant", []),
}
STRONG = np.array([*PINHOLE, -0.35, 0.0, 0.0, 0.0, 0.0])
FOLD = 1.0 / np.sqrt(3.0 * 0.35)
"""Where r - 0.35 r^3 is largest: the image of STRONG ends there, and farther rays fold back."""


def lens(name: str) -> tuple[np.ndarray, str]:
    model, coefficients = LENSES[name]
    return np.array(PINHOLE + coefficients), model


def random_points(shape: tuple[int, ...], seed: int, slope: float = 0.6) -> np.ndarray:
    rng = np.random.default_rng(seed)
    z = rng.uniform(0.1, 2.0, shape)
    return np.stack([*(z * rng.uniform(-slope, slope, (2, *shape))), z], axis=-1)


def opencv_pixels(points: np.ndarray, parameters: np.ndarray, model: str) -> np.ndarray:
    matrix = np.array(
        [[parameters[0], 0, parameters[2]], [0, parameters[1], parameters[3]], [0, 0, 1]]
    )
    still = np.zeros(3)
    if model == "equidistant":
        full = np.concatenate([parameters[4:], np.zeros(8 - parameters.size)])
        return cv2.fisheye.projectPoints(points[:, None], still, still, matrix, full)[0][:, 0]
    coefficients = parameters[4:] if parameters.size > 6 else np.append(parameters[4:], [0, 0, 0])
    padded = np.zeros(4) if parameters.size == 4 else coefficients
    return cv2.projectPoints(points, still, still, matrix, padded)[0][:, 0]


@pytest.mark.parametrize("name", LENSES)
def test_projection_is_opencvs(name):
    parameters, model = lens(name)
    points = random_points((200,), 1)
    expected = opencv_pixels(points, parameters, model)
    assert camera.project(points, parameters, model) == pytest.approx(expected, abs=1e-9)


def test_wide_rays_of_an_equidistant_lens_are_opencvs():
    parameters, model = lens("equidistant")
    points = random_points((200,), 2, slope=8.0)
    expected = opencv_pixels(points, parameters, model)
    assert camera.project(points, parameters, model) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("name", LENSES)
def test_derivative_by_the_point_against_central_differences(name):
    parameters, model = lens(name)
    points = random_points((30,), 3)
    pixels, by_point, _ = camera.project_jacobians(points, parameters, model)
    h = 1e-6 * points[:, 2:, None]
    ahead = camera.project(points[:, None] + h * np.eye(3), parameters, model)
    behind = camera.project(points[:, None] - h * np.eye(3), parameters, model)
    numeric = np.swapaxes((ahead - behind) / (2 * h), -1, -2)
    # Pixels are rounded to 1e-13, which a step of 1e-6 of the depth makes 1e-7 of the slope.
    size = PINHOLE[0] / points[:, 2]
    assert by_point / size[:, None, None] == pytest.approx(numeric / size[:, None, None], abs=1e-8)
    assert pixels == pytest.approx(camera.project(points, parameters, model), abs=1e-12)


@pytest.mark.parametrize("name", LENSES)
def test_derivative_by_the_intrinsics_against_central_differences(name):
    parameters, model = lens(name)
    points = random_points((30,), 4)
    _, _, by_parameters = camera.project_jacobians(points, parameters, model)
    assert by_parameters.shape == (30, 2, parameters.size)
    for k in range(parameters.size):
        h = 1e-3 if k < 4 else 1e-5
        step = h * np.eye(parameters.size)[k]
        ahead = camera.project(points, parameters + step, model)
        behind = camera.project(points, parameters - step, model)
        numeric = (ahead - behind) / (2 * h)
        assert by_parameters[..., k] == pytest.approx(numeric, abs=1e-12 / h)


@pytest.mark.parametrize("name", LENSES)
def test_normalise_is_the_inverse(name):
    parameters, model = lens(name)
    points = random_points((40, 50), 5)
    found = camera.normalise(camera.project(points, parameters, model), parameters, model)
    # Newton stops at 1e-14 of the distorted plane; the slope of these lenses is above 0.3.
    assert found == pytest.approx(points[..., :2] / points[..., 2:], abs=1e-12)


FISHEYE_ANGLES = [0.0, 1e-9, 1e-6, 0.5, 1.0, 1.395, 1.405, 1.5, 1.55]


@pytest.mark.parametrize("angle", FISHEYE_ANGLES)
def test_normalise_goes_up_to_the_edge_of_an_equidistant_lens(angle):
    parameters, model = lens("equidistant")
    ray = np.tan(angle) * np.array([0.6, -0.8])
    pixel = camera.project(np.array([*ray, 1.0]), parameters, model)
    found = camera.normalise(pixel, parameters, model)
    # A pixel of 300 is rounded at 6e-14, so the angle at 1e-16; Newton stops at 1e-14.
    assert np.arctan(np.linalg.norm(found)) == pytest.approx(angle, abs=1e-14)
    assert found == pytest.approx(ray, rel=1e-11, abs=1e-14)


def test_normalise_inverts_a_strong_barrel_up_to_its_fold():
    radius = np.linspace(0.0, 0.999 * FOLD, 40)
    turn = np.linspace(0.0, 2 * np.pi, 13)
    rays = radius[:, None, None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    points = np.concatenate([rays, np.ones((*rays.shape[:-1], 1))], axis=-1)
    found = camera.normalise(camera.project(points, STRONG), STRONG)
    # The slope falls to 2e-3 at 0.999 of the fold: rounding of 1e-16 comes back as 1e-13.
    assert found == pytest.approx(rays, abs=1e-11)


@pytest.mark.parametrize("angle", [1.58, 2.0, 3.0])
def test_no_direction_in_front_beyond_a_right_angle(angle):
    parameters, model = lens("equidistant pinhole")
    pixel = parameters[2:4] + parameters[:2] * angle * np.array([0.6, 0.8])
    assert np.all(np.isnan(camera.normalise(pixel, parameters, model)))


def test_no_direction_just_beyond_the_fold():
    edge = FOLD * (1 - 0.35 * FOLD**2)
    pixels = STRONG[2:4] + STRONG[:2] * np.array([[edge * 1.0005, 0.0], [0.3, 0.1]])
    found = camera.normalise(pixels, STRONG)
    assert np.all(np.isnan(found[0]))
    assert np.all(np.isfinite(found[1]))


@pytest.mark.parametrize("radius", [0.66, 0.8, 1.0])
def test_no_direction_far_beyond_the_fold(radius):
    pixel = STRONG[2:4] + STRONG[:2] * np.array([radius, 0.0])
    assert np.all(np.isnan(camera.normalise(pixel, STRONG)))


@pytest.mark.parametrize("coefficients", [[], [0.0] * 5, [0.0] * 8])
def test_without_distortion_the_inverse_is_plain(coefficients):
    parameters = np.array(PINHOLE + coefficients)
    pixels = np.random.default_rng(7).uniform(-500, 1500, (3, 4, 2))
    expected = (pixels - parameters[2:4]) / parameters[:2]
    assert np.array_equal(camera.normalise(pixels, parameters), expected)


def test_an_equidistant_lens_without_coefficients_is_no_pinhole():
    parameters, model = lens("equidistant pinhole")
    pixel = parameters[2:4] + parameters[:2] * np.array([1.0, 0.0])
    found = camera.normalise(pixel, parameters, model)
    assert found == pytest.approx(np.array([np.tan(1.0), 0.0]), abs=1e-12)


@pytest.mark.parametrize("radius", [0.0, 1e-12, 1e-7, 0.99e-6, 1.01e-6, 1e-4, 1e-3])
def test_an_equidistant_lens_is_smooth_at_the_principal_point(radius):
    parameters, model = lens("equidistant")
    ray = radius * np.array([0.6, 0.8])
    pixels, by_point, by_parameters = camera.project_jacobians(
        np.array([*ray, 1.0]), parameters, model
    )
    # theta (1 + k1 theta^2) = r + (k1 - 1/3) r^3 + O(r^5), and the same for its slope.
    bend = 0.05 - 1.0 / 3.0
    gain, across = 1.0 + bend * radius**2, 2.0 * bend * np.outer(ray, ray)
    slope = gain * np.eye(2) + across
    left = 4.0 * radius**4 + 1e-10 * (radius > 0)
    assert (pixels - parameters[2:4]) / parameters[:2] == pytest.approx(ray * gain, abs=1e-12)
    assert by_point[:, :2] / parameters[:2, None] == pytest.approx(slope, abs=left)
    assert by_parameters[:, 4] == pytest.approx(parameters[:2] * ray * radius**2, abs=1e-7)


@pytest.mark.parametrize("name", ["prism", "equidistant"])
def test_a_batch_is_a_loop(name):
    parameters, model = lens(name)
    points = random_points((2, 3), 8)
    batched = camera.project_jacobians(points, parameters, model)
    undone = camera.normalise(batched[0], parameters, model)
    for i in range(2):
        for j in range(3):
            single = camera.project_jacobians(points[i, j], parameters, model)
            for one, all_ in zip(single, batched, strict=True):
                assert one == pytest.approx(all_[i, j], rel=1e-13, abs=1e-13)
            back = camera.normalise(batched[0][i, j], parameters, model)
            assert back == pytest.approx(undone[i, j], abs=1e-13)


@pytest.mark.parametrize("model", ["plumb_bob", "rational_polynomial", "equidistant"])
def test_missing_coefficients_are_zero(model):
    coefficients = [0.05, -0.012, 1e-3, 2e-3]
    short = np.array(PINHOLE + coefficients[:2])
    long = np.array([*PINHOLE, *coefficients[:2], 0.0, 0.0])
    points = random_points((10,), 9)
    assert np.array_equal(camera.project(points, short, model), camera.project(points, long, model))

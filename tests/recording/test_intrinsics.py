"""CameraInfo into a camera, checked by where points fall."""

import dataclasses
import math

import numpy as np
import pytest

from handeye_cli.errors import InputError
from handeye_cli.recording.intrinsics import camera_of
from handeye_cli.recording.messages import CameraInfoMessage, Header

WHERE = "a.mcap, /cam/camera_info"
K = (600.0, 0.0, 319.5, 0.0, 610.0, 239.5, 0.0, 0.0, 1.0)
P = (550.0, 0.0, 310.0, 0.0, 0.0, 555.0, 230.0, 0.0, 0.0, 0.0, 1.0, 0.0)


def info(model="plumb_bob", d=(0.1, 0.2, 0.3, 0.4, 0.5), *, k=K, p=P, binning=(0, 0), roi=(0,) * 4):
    return CameraInfoMessage(Header(0, "c"), 640, 480, model, d, k, p, *binning, roi)


@pytest.mark.parametrize(
    ("model", "count"),
    [("plumb_bob", 0), ("plumb_bob", 4), ("plumb_bob", 5), ("rational_polynomial", 8),
     ("rational_polynomial", 12), ("equidistant", 4)],
)  # fmt: skip
def test_plain_camera(model, count):
    d = tuple(0.01 * n for n in range(1, count + 1))
    camera = camera_of(info(model, d), "/cam/image_raw", WHERE)
    assert (camera.width, camera.height, camera.model) == (640, 480, model)
    np.testing.assert_array_equal(camera.parameters, [600.0, 610.0, 319.5, 239.5, *d])


@pytest.mark.parametrize("topic", ["/cam/image_rect", "/cam/image_rect_color/compressed"])
def test_rectified_images_have_no_distortion(topic):
    camera = camera_of(info("equidistant", (1, 2, 3, 4)), topic, WHERE)
    assert camera.distortion == ()
    assert camera.model == "plumb_bob"
    np.testing.assert_array_equal(camera.parameters, [550.0, 555.0, 310.0, 230.0])


@pytest.mark.parametrize("topic", ["/cam/image_raw", "/cam/image_rect"])
def test_uncalibrated_camera_is_none(topic):
    assert camera_of(info(model="", k=(0.0,) * 9, p=(0.0,) * 12, d=()), topic, WHERE) is None


def test_binning_and_region_move_a_pixel_with_the_camera():
    camera = camera_of(info(binning=(2, 4), roi=(100, 40, 320, 240)), "/cam/image_raw", WHERE)
    assert (camera.width, camera.height) == (160, 60)
    x, y = 0.05, -0.07
    u, v = 600.0 * x + 319.5, 610.0 * y + 239.5  # in the full image
    full_columns = 100 + 2 * (camera.fx * x + camera.cx) + np.array([0, 1])
    full_rows = 40 + 4 * (camera.fy * y + camera.cy) + np.arange(4)
    assert np.mean(full_columns) == pytest.approx(u)
    assert np.mean(full_rows) == pytest.approx(v)


@pytest.mark.parametrize(
    ("model", "d", "found"),
    [
        ("fisheye62", (1.0,) * 6, "'fisheye62'"),
        ("", (0.1,), "''"),
        ("plumb_bob", (0.1,) * 8, "4 or 5 coefficients of plumb_bob, found 8"),
        ("equidistant", (), "4 coefficients of equidistant, found 0"),
    ],
)
def test_unknown_distortion_is_refused(model, d, found):
    with pytest.raises(InputError, match=found):
        camera_of(info(model, d), "/cam/image_raw", WHERE)


def test_foxglove_calls_equidistant_kannala_brandt():
    d = (0.1, 0.2, 0.3, 0.4)
    camera = camera_of(info("kannala_brandt", d), "/cam/image_raw", WHERE)
    assert camera == camera_of(info("equidistant", d), "/cam/image_raw", WHERE)
    assert camera.model == "equidistant"


@pytest.mark.parametrize(
    ("changed", "found"),
    [
        ({"k": (math.nan, *K[1:])}, "nan, 610, 319.5, 239.5"),
        ({"k": (-600.0, *K[1:])}, "-600, 610, 319.5"),
        ({"k": (*K[:4], 0.0, *K[5:])}, "600, 0, 319.5"),
        ({"k": (*K[:5], math.inf, *K[6:])}, "319.5, inf"),
        ({"d": (0.1, math.nan, 0.0, 0.0)}, "0.1, nan, 0, 0"),
    ],
)
def test_numbers_of_no_camera_are_refused(changed, found):
    with pytest.raises(InputError, match=found) as caught:
        camera_of(info(**changed), "/cam/image_raw", WHERE)
    assert "positive focal lengths" in caught.value.message


def test_camera_without_a_size_is_refused():
    with pytest.raises(InputError, match="found 0 x 480"):
        camera_of(dataclasses.replace(info(), width=0), "/cam/image_raw", WHERE)


def test_no_model_and_no_distortion_is_a_pinhole():
    assert camera_of(info("", (0.0,) * 0), "/cam/image_raw", WHERE).distortion == ()

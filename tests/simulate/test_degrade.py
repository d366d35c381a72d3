"""Faults of a camera against what they are defined to be, computed directly."""

import numpy as np
import pytest

from handeye_cli.errors import UsageError
from handeye_cli.simulate.degrade import (
    compressed,
    curved,
    defocused,
    disc_kernel,
    line_kernel,
    moved,
    salted,
    saturated,
)
from handeye_cli.simulate.render import expose


def moments(kernel):
    """Sum, mean (x, y) and second moments (2, 2) of a kernel about its middle pixel."""
    m = len(kernel) // 2
    y, x = np.mgrid[-m : m + 1, -m : m + 1]
    places = np.stack([x.ravel(), y.ravel()], axis=1)
    weights = kernel.ravel()
    return weights.sum(), weights @ places, places.T @ (weights[:, None] * places)


@pytest.mark.parametrize("radius", [1.0, 2.0, 3.7])
def test_a_disc_spreads_light_as_far_as_an_even_disc(radius):
    total, mean, spread = moments(disc_kernel(radius))
    assert total == pytest.approx(1.0, abs=1e-12)
    assert mean == pytest.approx(np.zeros(2), abs=1e-12)
    # sharing by nearness adds f (1 - f), f evenly between 0 and 1: a sixth
    assert spread == pytest.approx((radius**2 / 4 + 1 / 6) * np.eye(2), abs=0.03)


@pytest.mark.parametrize("direction", [0.0, 0.4, np.pi / 2, 2.3])
@pytest.mark.parametrize("length", [2.0, 4.0, 7.0])
def test_a_line_spreads_light_along_itself_alone(length, direction):
    total, mean, spread = moments(line_kernel(length, direction))
    along = np.array([np.cos(direction), np.sin(direction)])
    assert total == pytest.approx(1.0, abs=1e-12)
    assert mean == pytest.approx(np.zeros(2), abs=1e-12)
    added = spread - length**2 / 12 * np.outer(along, along)
    # sharing adds to x and y alone, a sixth each where the line crosses whole pixels
    assert added == pytest.approx(np.diag(np.diag(added)), abs=1e-3)
    assert np.all(np.diag(added) > -1e-3)
    assert np.all(np.diag(added) < 0.25)
    if direction == 0.0:
        assert np.diag(added) == pytest.approx([1 / 6, 0.0], abs=1e-3)


@pytest.mark.parametrize("blurred", [lambda p: defocused(p, 2.3), lambda p: moved(p, 5.0, 0.7)])
def test_blur_is_the_sum_of_shifted_pictures(blurred):
    rng = np.random.default_rng(2)
    picture = rng.uniform(0.0, 255.0, (30, 40))
    point = np.zeros((30, 40))
    point[15, 20] = 1.0
    kernel = blurred(point)
    direct = sum(
        kernel[15 + dv, 20 + du] * np.roll(picture, (dv, du), axis=(0, 1))
        for dv in range(-4, 5)
        for du in range(-4, 5)
    )
    inside = np.s_[5:-5, 5:-5]
    np.testing.assert_allclose(blurred(picture)[inside], direct[inside], atol=1e-9)


@pytest.mark.parametrize("blurred", [lambda p: defocused(p, 0.0), lambda p: moved(p, 0.0, 1.0)])
def test_no_blur_is_the_picture(blurred):
    picture = np.random.default_rng(3).uniform(0.0, 255.0, (20, 30))
    np.testing.assert_allclose(blurred(picture), picture, atol=1e-9)


def test_blur_leaves_even_light_alone_up_to_the_edge():
    even = np.full((20, 30), 130.0)
    np.testing.assert_allclose(defocused(moved(even, 4.0, 0.3), 2.0), even, atol=1e-9)


@pytest.mark.parametrize("exponent", [1 / 2.2, 1.0, 2.2])
def test_a_curve_keeps_black_and_white_and_has_its_slope(exponent):
    light = np.array([[-5.0, 0.0, 255.0, 300.0]])
    np.testing.assert_allclose(curved(light, exponent), [[0.0, 0.0, 255.0, 255.0]])
    near = curved(np.array([[127.0, 128.0]]), exponent)[0]
    assert np.diff(np.log(near)) == pytest.approx(exponent * np.log(128 / 127))
    levels = np.linspace(1.0, 254.0, 50)[None]
    np.testing.assert_allclose(curved(curved(levels, exponent), 1 / exponent), levels)


def test_saturation_clips_white_and_scales_the_rest():
    light = np.array([[-10.0, 50.0, 170.0, 171.0]])
    np.testing.assert_allclose(saturated(light, 1.5), [[-15.0, 75.0, 255.0, 255.0]])


def test_compression_keeps_the_size_and_nearly_the_picture():
    v, u = np.mgrid[0:45, 0:67]
    picture = expose(120.0 + 60.0 * np.sin(u / 6.0) * np.cos(v / 5.0), 0.0, None)
    off = [
        np.abs(compressed(picture, quality).astype(float) - picture) for quality in (100, 70, 10)
    ]
    assert compressed(picture, 70).shape == picture.shape
    assert compressed(picture, 70).dtype == np.uint8
    assert off[0].max() <= 2.0
    assert 0.0 < off[1].mean() < 3.0
    assert off[0].mean() < off[1].mean() < off[2].mean()


def test_salt_breaks_as_many_pixels_as_are_asked_for():
    picture = np.full((40, 50), 100, dtype=np.uint8)
    broken = salted(picture, 30, np.random.default_rng(4))
    assert np.sum(broken != picture) == 30
    assert set(np.unique(broken)) == {0, 100, 255}
    assert np.all(picture == 100)
    assert np.array_equal(broken, salted(picture, 30, np.random.default_rng(4)))


def test_a_sensor_rounds_and_clips():
    light = np.array([[-3.0, 0.4, 100.6, 256.0]])
    assert expose(light, 5.0, None).tolist() == [[0, 0, 101, 255]]


GREY = np.zeros((4, 5), dtype=np.uint8)


@pytest.mark.parametrize(
    ("fault", "found"),
    [
        (lambda: defocused(GREY.astype(float), -1.0), "found -1 px"),
        (lambda: defocused(GREY.astype(float), np.nan), "found nan px"),
        (lambda: moved(GREY.astype(float), -2.0, 0.0), "found -2 px"),
        (lambda: curved(GREY.astype(float), 0.0), "found 0"),
        (lambda: saturated(GREY.astype(float), -0.5), "found -0.5"),
        (lambda: compressed(GREY, 0), "found 0"),
        (lambda: compressed(GREY, 101), "found 101"),
        (lambda: salted(GREY, 21, np.random.default_rng(0)), "0 to 20 broken pixels, found 21"),
    ],
)
def test_impossible_faults_are_refused(fault, found):
    with pytest.raises(UsageError, match=found):
        fault()

"""What is seen of light near black and white, against integrals and brute force."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from handeye_cli.geometry.sensor_limits import (
    at_limits,
    clip_model,
    clipped,
    fainter,
    held_within,
    near_limits,
)

LIGHT = np.array([-40.0, -3.0, -0.5, 0.0, 2.0, 7.0, 248.0, 253.5, 255.0, 256.0, 260.0, 400.0])


def seen(light, noise):
    return clipped(np.asarray(light, dtype=np.float32), noise)


def moment(light, noise, power):
    """Of the grey level that normal noise and clipping leave, by quadrature."""
    inside, _ = quad(
        lambda y: (y - 127.5) ** power * norm.pdf(y, light, noise), 0.0, 255.0, points=[light]
    )
    ends = norm.cdf(0.0, light, noise) * (-127.5) ** power
    return inside + ends + norm.sf(255.0, light, noise) * 127.5**power


@pytest.mark.parametrize("noise", [0.5, 2.0, 6.0])
def test_mean_and_variance_are_those_of_clipped_noise(noise):
    """Single precision leaves 3e-5 of a grey level at 255."""
    found = seen(LIGHT, noise)
    for k, light in enumerate(LIGHT):
        mean, square = moment(light, noise, 1), moment(light, noise, 2)
        assert found.mean[k] == pytest.approx(mean + 127.5, abs=1e-4)
        assert found.variance[k] == pytest.approx((square - mean**2) / noise**2, abs=1e-3)


def test_the_slope_is_the_means():
    step = 0.25
    numeric = (seen(LIGHT + step, 2.0).mean - seen(LIGHT - step, 2.0).mean) / (2 * step)
    np.testing.assert_allclose(seen(LIGHT, 2.0).slope, numeric, atol=2e-3)


@pytest.mark.parametrize("noise", [0.0, 1.0, 5.0])
def test_light_that_is_not_near_a_limit_is_seen_as_it_is(noise):
    light = np.linspace(-20.0, 275.0, 1181).astype(np.float32)
    near = near_limits(light, noise)
    assert np.all(near[(light <= 0.0) | (light >= 255.0)])
    found = seen(light[~near], noise)
    np.testing.assert_allclose(found.mean, light[~near], atol=1e-4)
    np.testing.assert_allclose(found.slope, 1.0, atol=1e-4)
    np.testing.assert_allclose(found.variance, 1.0, atol=2e-3)


def test_a_model_is_clipped_where_pixels_have_weight():
    light = np.stack([LIGHT, LIGHT]).astype(np.float32)
    weight = np.ones(light.shape, dtype=np.float32)
    weight[1, ::2] = 0.0
    slopes = np.ones((2, 3, len(LIGHT)), dtype=np.float32)
    model = light.copy()
    lost = clip_model(model, slopes, weight, 2.0)
    expected = seen(LIGHT, 2.0)
    np.testing.assert_allclose(model[0], expected.mean, atol=1e-4)
    np.testing.assert_allclose(slopes[0], np.tile(expected.slope, (3, 1)), atol=1e-6)
    assert np.array_equal(model[1, ::2], light[1, ::2])
    assert np.all(slopes[1, :, ::2] == 1.0)
    assert lost[0] == pytest.approx(np.sum(1.0 - expected.variance), abs=1e-4)
    assert lost[1] == pytest.approx(np.sum(1.0 - expected.variance[1::2]), abs=1e-4)


def test_pixels_at_the_limits_are_found():
    levels = np.random.default_rng(1).integers(0, 256, (40, 50)).astype(np.uint8)
    expected = np.flatnonzero((levels == 0) | (levels == 255))
    assert len(expected) > 5
    np.testing.assert_array_equal(at_limits(levels), expected)
    weight = fainter(np.ones(levels.shape, np.float32), expected)
    assert np.all(weight.ravel()[expected] < 0.1)
    assert weight.sum() > levels.size - len(expected)


def penalty(state, noise):
    """Minus twice the logarithm of how likely light is beyond the limits by 50 levels or so."""
    levels = np.array([state[3], state[3] * state[1]])
    return np.sum(((levels - np.clip(levels, 0.0, 255.0)) / 50.0) ** 2) * noise**2


@pytest.mark.parametrize("light_and_ink", [(300.0, -0.1), (300.0, 0.2), (40.0, 8.0)])
def test_light_is_held_by_the_slopes_of_its_penalty(light_and_ink):
    noise = 3.0
    state = np.array([[0.1, light_and_ink[1], 0.5, light_and_ink[0]]])
    normal, wanted = held_within(np.zeros((1, 4, 4)), np.zeros((1, 4)), state, (3, 1), noise)
    for k in range(4):
        step = 1e-4 * np.eye(4)[k]
        ahead, behind = penalty(state[0] + step, noise), penalty(state[0] - step, noise)
        assert wanted[0, k] == pytest.approx(-(ahead - behind) / 4e-4, abs=1e-6, rel=1e-5)
    np.testing.assert_allclose(normal[0], normal[0].T)
    assert np.min(np.linalg.eigvalsh(normal[0])) > -1e-9


def test_light_within_the_limits_is_left_alone():
    rng = np.random.default_rng(2)
    equations, wanted = rng.normal(size=(2, 4, 4)), rng.normal(size=(2, 4))
    state = np.array([[0.0, 0.2, 0.0, 250.0], [0.0, 0.0, 0.0, 90.0]])
    normal, right = held_within(equations, wanted, state, (3, 1), 2.0)
    np.testing.assert_array_equal(normal, equations)
    np.testing.assert_array_equal(right, wanted)

"""Images at other sizes."""

import numpy as np
import pytest

from handeye_cli.targets.resampling import enlarged, reduced


def test_an_enlarged_image_shows_the_same_at_half_the_distance():
    y, x = np.indices((20, 30))
    image = (3 * x + 2 * y + 7).astype(np.uint8)
    twice = enlarged(image)
    assert twice.shape == (40, 60)
    rows, columns = np.indices(twice.shape)
    expected = 3 * (columns / 2 - 0.25) + 2 * (rows / 2 - 0.25) + 7
    np.testing.assert_allclose(twice[6:-6, 6:-6], expected[6:-6, 6:-6], atol=0.51)


@pytest.mark.parametrize("factor", [1, 2, 3, 4, 6])
def test_a_reduced_image_has_the_means_of_blocks(factor):
    image = np.random.default_rng(factor).integers(0, 256, (50, 67), dtype=np.uint8)
    rows, columns = 50 // factor, 67 // factor
    part = image[: rows * factor, : columns * factor].astype(float)
    means = part.reshape(rows, factor, columns, factor).mean(axis=(1, 3))
    # each halving rounds to whole levels
    np.testing.assert_allclose(reduced(image, factor), means, atol=1.01)

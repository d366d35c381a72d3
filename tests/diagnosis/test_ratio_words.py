"""What is said of a ratio of lengths beside its number."""

import math

import pytest

from handeye_cli.diagnosis.lengths import ratio_words
from handeye_cli.records.hypotheses import LengthRatio


@pytest.mark.parametrize(
    ("ratio", "sigma", "words"),
    [
        (1.005, 2e-3, "1.0050 times as long as the camera's (+- 0.20 %): as long, within"),
        (0.9807, 3.4e-3, "0.9807 times as long as the camera's (+- 0.34 %): the target's size"),
        (0.5, 1e-3, "0.5000 times as long as the camera's (+- 0.10 %)"),
    ],
)
def test_a_ratio_that_is_no_fault_has_a_verdict(ratio, sigma, words):
    said = ratio_words(LengthRatio(ratio, sigma))
    assert said.startswith(f"the robot's motions are {words}")
    assert (":" in said) == (abs(math.log(ratio)) < 0.15)

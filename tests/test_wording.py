"""Wordings that more than one room needs."""

import pytest

from handeye_cli.wording import first_few


@pytest.mark.parametrize(
    ("names", "most", "words"),
    [
        (["a"], 1, "a"),
        (["a", "b"], 1, "a and 1 more"),
        (["a", "b", "c"], 3, "a, b, c"),
        (["a", "b", "c", "d", "e"], 2, "a, b and 3 more"),
    ],
)
def test_a_long_list_is_cut_and_counted(names, most, words):
    assert first_few(names, most) == words

"""What the tests of the engines share."""

import pytest
from engines.clusters import small_cluster


@pytest.fixture
def cluster():
    """The address of a scheduler."""
    with small_cluster() as address:
        yield address

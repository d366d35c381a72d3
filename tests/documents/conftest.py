"""What tests of foreign data share."""

from functools import partial

import pytest
from documents import foreign_files


@pytest.fixture
def write(tmp_path):
    return partial(foreign_files.written, tmp_path)


@pytest.fixture
def changed(tmp_path):
    return partial(foreign_files.import_changed, tmp_path)

"""What is said of a file that another tool has saved, where a document is expected."""

import io

import numpy as np
import pytest

from handeye_cli.documents import schema, text
from handeye_cli.errors import InputError


def test_arrays_lead_to_the_import():
    file = io.BytesIO()
    np.savez(file, poses=np.eye(4) / 3.0)
    with pytest.raises(InputError, match=r"expected UTF-8 text, found the byte 0x") as caught:
        text.parse(file.getvalue(), "poses.npz")
    assert caught.value.hint == "arrays of another tool are read by 'handeye import'"


def test_a_document_without_a_schema_leads_to_the_import():
    with pytest.raises(InputError, match="found the keys parameters") as caught:
        schema.kind_of({"parameters": {"qw": 1.0}}, "easy_handeye.yaml")
    assert "what another tool has saved: 'handeye import'" in caught.value.hint

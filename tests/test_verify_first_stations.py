"""What verify says where the first stations of a recording only moved along straight lines."""

import numpy as np
import pytest
from scenes import general_scene, stations

from handeye_cli.errors import UndeterminedError
from handeye_cli.geometry import se3
from handeye_cli.leave_one_out import leave_one_out
from handeye_cli.records import Noise
from handeye_cli.verify import verify


def test_first_stations_that_determine_nothing_lead_to_leaving_one_out():
    rng = np.random.default_rng(1)
    perfect = general_scene(rng, 12)
    perfect.A[:6, :3, :3] = perfect.A[0, :3, :3]
    perfect.B[:6] = se3.inverse(perfect.X) @ se3.inverse(perfect.A[:6]) @ perfect.Z
    document = stations(rng, perfect, Noise(3e-4, 1e-4, 3e-4, 1e-4))
    with pytest.raises(UndeterminedError, match="found a largest interstation angle") as refused:
        verify(document)
    assert refused.value.where == "calibrating on the first 6 of 12 stations"
    assert "--leave-one-out" in refused.value.hint
    assert leave_one_out(document).rows[0].stations == 11

"""Which noise a plan is predicted with."""

import numpy as np
import pytest
from planning.rigs import CAMERA, PLATE, X, Z

from handeye_cli.conventions import MIL, Setup
from handeye_cli.errors import UsageError
from handeye_cli.planning.cell import Frames
from handeye_cli.planning.levels import PAPERS_NOISE, suppose
from handeye_cli.planning.options import PlanOptions
from handeye_cli.records import Noise
from handeye_cli.sight import Sight

HAND = Frames(Setup.EYE_IN_HAND)
KNOWN = Noise(1e-4, 2e-5, 3e-4, 4e-5, 0.07)
SEES = {"points": PLATE, "camera": CAMERA}


@pytest.mark.parametrize(
    ("options", "noise", "robot", "camera"),
    [
        ({}, PAPERS_NOISE, "paper", "paper"),
        ({"known": Noise()}, PAPERS_NOISE, "paper", "paper"),
        ({"known": KNOWN}, Noise(1e-4, 2e-5, 3e-4, 4e-5), "calibration", "calibration"),
        ({"known": KNOWN, **SEES}, Noise(1e-4, 2e-5, pixel=0.07), "calibration", "pixels"),
        ({"known": Noise(1e-4, 2e-5)}, Noise(1e-4, 2e-5, 0.0, 0.0), "calibration", "calibration"),
        (SEES, PAPERS_NOISE, "paper", "paper"),
        (
            {"given": Noise(pixel=0.1), **SEES},
            Noise(1.5e-3, 5 * MIL, pixel=0.1),
            "paper",
            "pixels",
        ),
        (
            {"given": Noise(9e-4, 8e-5, 7e-4, 6e-5), "known": KNOWN, **SEES},
            Noise(9e-4, 8e-5, 7e-4, 6e-5),
            "given",
            "given",
        ),
        (
            {"given": Noise(robot_rotation=9e-4), "known": KNOWN},
            Noise(9e-4, 2e-5, 3e-4, 4e-5),
            "calibration",
            "calibration",
        ),
    ],
)
def test_what_is_stated_wins_over_what_is_known_over_the_paper(options, noise, robot, camera):
    found = suppose(HAND, PlanOptions(**options))
    assert found.noise == noise
    assert (found.basis.robot, found.basis.camera) == (robot, camera)
    assert isinstance(found.rig.camera_covariance, Sight) == (camera == "pixels")


def test_pixels_need_a_target_and_a_camera():
    with pytest.raises(UsageError, match=r"pixels, 0\.3 px, needs"):
        suppose(HAND, PlanOptions(given=Noise(pixel=0.3), points=PLATE))


@pytest.mark.parametrize(
    ("frames", "versions", "lever"),
    [
        (HAND, 12, 0.2),
        (Frames(Setup.EYE_TO_HAND), 12, 0.2),
        (Frames(Setup.EYE_IN_HAND, X, Z), 1, None),
        (Frames(Setup.EYE_TO_HAND, X, Z), 1, None),
    ],
)
def test_without_a_guess_the_lever_counts(frames, versions, lever):
    found = suppose(frames, PlanOptions(lever=0.2))
    assert len(found.rig.X) == len(found.rig.Z) == versions
    assert found.basis.lever == lever
    assert found.basis.mount == ("calibration" if lever is None else "lever")
    carried = found.rig.X if frames.setup is Setup.EYE_IN_HAND else found.rig.Z
    if lever:
        assert np.linalg.norm(carried[:, :3, 3], axis=1) == pytest.approx(lever)
        assert carried[:, :3, 3].mean(axis=0) == pytest.approx(0.0, abs=1e-15)

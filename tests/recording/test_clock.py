"""Which of the two times counts."""

import numpy as np
import pytest

from handeye_cli.recording.clock import Clock, choose

MS = 1_000_000
STAMPS = 1_700_000_000_000 * MS + np.arange(50) * 50 * MS


@pytest.mark.parametrize(
    ("image_delay", "pose_delay"), [(30 * MS, 2 * MS), (-190 * MS, 0), (10**18, 10**18 + 5 * MS)]
)
def test_stamps_of_agreeing_clocks_are_used(image_delay, pose_delay):
    clock, finding = choose(STAMPS, STAMPS + image_delay, STAMPS, STAMPS + pose_delay)
    assert clock is Clock.STAMP
    assert finding is None


def test_some_late_messages_do_not_matter():
    late = np.where(np.arange(50) % 3 == 0, 900 * MS, 20 * MS)
    assert choose(STAMPS, STAMPS + late, STAMPS, STAMPS)[0] is Clock.STAMP


def test_clocks_that_disagree_are_not_mixed():
    clock, finding = choose(STAMPS, STAMPS + 2 * MS, STAMPS, STAMPS + 752 * MS)
    assert clock is Clock.LOG
    assert finding.code == "clock-log-time"
    assert finding.severity == "warning"
    assert "-0.750 s apart" in finding.message


@pytest.mark.parametrize("kind", ["images", "poses"])
def test_stamps_that_were_not_set_are_counted(kind):
    unset = np.where(np.arange(50) < 3, 0, STAMPS)
    image, pose = (unset, STAMPS) if kind == "images" else (STAMPS, unset)
    clock, finding = choose(image, STAMPS, pose, STAMPS)
    assert clock is Clock.LOG
    assert f"3 of 50 {kind} carry no stamp" in finding.message

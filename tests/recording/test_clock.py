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


IMAGES = 1_700_000_000_000 * MS + np.arange(200) * 200 * MS
POSES = 1_700_000_000_000 * MS + np.arange(4000) * 10 * MS


@pytest.mark.parametrize("step", [-2000 * MS, 2000 * MS, 300 * MS])
@pytest.mark.parametrize("share", [0.3, 0.6])
def test_a_clock_that_is_set_while_recording_is_not_used(step, share):
    """Most delays may still agree."""
    set_poses = np.where(np.arange(len(POSES)) < share * len(POSES), POSES, POSES + step)
    set_images = np.where(np.arange(len(IMAGES)) < share * len(IMAGES), IMAGES, IMAGES + step)
    for images, poses in ((IMAGES, set_poses), (set_images, POSES)):
        clock, finding = choose(images, IMAGES + 30 * MS, poses, POSES + 2 * MS)
        assert clock is Clock.LOG
        assert finding.code == "clock-log-time"
    # one clock for both may be set, as that of a computer that records what it measures
    assert choose(set_images, IMAGES + 30 * MS, set_poses, POSES + 2 * MS)[0] is Clock.STAMP


def test_a_step_is_told_in_seconds():
    poses = np.where(np.arange(len(POSES)) < 3000, POSES, POSES + 1500 * MS)
    _, finding = choose(IMAGES, IMAGES + 30 * MS, poses, POSES + 2 * MS)
    assert "set by 1.500 s or more while they were recorded" in finding.message


def test_congestion_and_simulated_time_are_no_steps():
    rng = np.random.default_rng(5)
    late = (rng.exponential(0.3, len(IMAGES)) * 1000 * MS).astype(np.int64)
    assert choose(IMAGES, IMAGES + late // 4, POSES, POSES)[0] is Clock.STAMP
    # a simulation that runs at a tenth to twice the speed of its world, 0.7 s to and fro
    wobble = lambda t: (0.7e9 * np.sin((t - t[0]) / 3e9)).astype(np.int64)  # noqa: E731
    pair = (IMAGES, IMAGES + wobble(IMAGES)), (POSES, POSES + wobble(POSES))
    assert choose(*pair[0], *pair[1])[0] is Clock.STAMP


def test_poses_that_end_early_tell_nothing_of_the_rest():
    poses = POSES[: len(POSES) // 3]
    assert choose(IMAGES, IMAGES + 30 * MS, poses, poses + 2 * MS)[0] is Clock.STAMP
    assert choose(IMAGES[:5], IMAGES[:5] + 30 * MS, poses, poses + 2 * MS)[0] is Clock.STAMP


@pytest.mark.parametrize("kind", ["images", "poses"])
def test_stamps_that_were_not_set_are_counted(kind):
    unset = np.where(np.arange(50) < 3, 0, STAMPS)
    image, pose = (unset, STAMPS) if kind == "images" else (STAMPS, unset)
    clock, finding = choose(image, STAMPS, pose, STAMPS)
    assert clock is Clock.LOG
    assert f"3 of 50 {kind} carry no stamp" in finding.message

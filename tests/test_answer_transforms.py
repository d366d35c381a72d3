"""The answer in the frames of its robot."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handeye_cli.answer_transforms import answer_transforms, notes_of
from handeye_cli.conventions import Setup
from handeye_cli.errors import UsageError
from handeye_cli.geometry import se3
from handeye_cli.records import Calibration, Noise, PredictedError, UncertainPose
from handeye_cli.records.frames import RobotFrames

FRAMES = RobotFrames("base_link", "tool0", "eye", 12_000_000_345)


def random_pose(rng):
    return se3.from_parts(Rotation.random(random_state=rng).as_matrix(), rng.normal(size=3))


def calibration(setup=Setup.EYE_IN_HAND, seed=3):
    rng = np.random.default_rng(seed)
    return Calibration(
        setup=setup,
        method="park-martin",
        mount_T_camera=UncertainPose(random_pose(rng)),
        reference_T_target=UncertainPose(random_pose(rng)),
        predicted_error=PredictedError(0.00123456, 0.000234, 0.002, 0.0004),
        noise=Noise(),
        noise_estimated=False,
        stations=(),
    )


def named(transforms):
    return [(each.header.frame_id, each.child_frame_id) for each in transforms]


def matrix(transform):
    return se3.from_parts(
        Rotation.from_quat(transform.rotation).as_matrix(), np.array(transform.translation)
    )


@pytest.mark.parametrize("setup", Setup)
def test_transforms_are_the_poses_of_the_answer(setup):
    answer = calibration(setup)
    camera, target = answer_transforms(answer, FRAMES)
    np.testing.assert_allclose(matrix(camera), answer.mount_T_camera.matrix, atol=1e-14)
    np.testing.assert_allclose(matrix(target), answer.reference_T_target.matrix, atol=1e-14)
    assert camera.header.stamp_ns == target.header.stamp_ns == FRAMES.start_ns


NAMES = {
    "in-hand": (Setup.EYE_IN_HAND, FRAMES, {}, ["tool0", "eye", "base_link", "target"]),
    "to-hand": (Setup.EYE_TO_HAND, FRAMES, {}, ["base_link", "eye", "tool0", "target"]),
    "unknown": (
        Setup.EYE_IN_HAND, None, {}, ["gripper", "camera_optical", "base", "target"],
    ),
    "half-known": (
        Setup.EYE_TO_HAND, RobotFrames(base="b"), {}, ["b", "camera_optical", "gripper", "target"],
    ),
    "flags": (
        Setup.EYE_TO_HAND, FRAMES, {"parent": "/wall", "child": "/left_eye"},
        ["wall", "left_eye", "tool0", "target"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("row", NAMES)
def test_frames_have_the_names_of_the_robot(row):
    setup, frames, flags, (mount, camera, reference, target) = NAMES[row]
    found = named(answer_transforms(calibration(setup), frames, **flags))
    assert found == [(mount, camera), (reference, target)]


@pytest.mark.parametrize(
    ("frames", "flags", "found"),
    [
        (RobotFrames("a", "tool0", "tool0"), {}, "found 'tool0', 'a', 'tool0', 'target'"),
        (RobotFrames("target", "b", "c"), {}, "found 'b', 'target', 'c', 'target'"),
        (FRAMES, {"parent": "base_link"}, "found 'base_link', 'base_link', 'eye', 'target'"),
        (FRAMES, {"child": ""}, "found 'tool0', 'base_link', '', 'target'"),
    ],
)
def test_frames_need_names_of_their_own(frames, flags, found):
    with pytest.raises(UsageError, match=found) as caught:
        answer_transforms(calibration(), frames, **flags)
    assert "--parent-frame and --child-frame" in caught.value.hint


def test_notes_say_how_sure_the_answer_is():
    assert notes_of(calibration()) == {
        "setup": "eye-in-hand",
        "method": "park-martin",
        "predicted_rotation_mrad": "1.235",
        "predicted_translation_mm": "0.234",
    }

"""The project from Python: arrays in, the same answers as from documents, and what is refused."""

import re
from pathlib import Path

import numpy as np
import pytest
from scenes import disturbed, general_scene, joint_covariance, scene, stations

import handeye_cli
from handeye_cli import solvers
from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError, UndeterminedError, UsageError
from handeye_cli.geometry import se3
from handeye_cli.records import Noise
from handeye_cli.solve import solve
from handeye_cli.verify import verify

NOISE = Noise(1e-3, 2e-4, 1e-3, 1e-4)
GUIDE = Path(__file__).resolve().parents[1] / "docs" / "python.md"


def arrays(document):
    """Return a document's poses and covariances."""
    rows = document.stations
    seen = [row.camera_T_target for row in rows]
    return (
        np.array([row.base_T_gripper for row in rows]),
        np.array([each.matrix for each in seen]),
        np.array([each.covariance for each in seen]),
    )


def trials(rng, count, shape, setup):
    """Return a scene with noisy poses of it, (*shape, count, 4, 4)."""
    perfect, joint = general_scene(rng, count), joint_covariance(count, NOISE)
    robot = perfect.A if setup is Setup.EYE_IN_HAND else se3.inverse(perfect.A)
    total = int(np.prod(shape))
    noisy = (
        disturbed(rng, robot, joint[:, :6, :6], total),
        disturbed(rng, perfect.B, joint[:, 6:, 6:], total),
    )
    return perfect, *(poses.reshape(*shape, count, 4, 4) for poses in noisy)


@pytest.mark.parametrize("name", handeye_cli.__all__)
def test_every_name_is_there_and_listed(name):
    assert getattr(handeye_cli, name) is not None
    assert name in dir(handeye_cli)


def test_a_name_that_is_not_there():
    with pytest.raises(AttributeError, match="no attribute 'calibrate'"):
        _ = handeye_cli.calibrate


@pytest.mark.parametrize("setup", Setup)
@pytest.mark.parametrize("method", ["maximum-likelihood", "park-martin"])
def test_arrays_give_what_a_document_gives(setup, method):
    rng = np.random.default_rng(3)
    document = stations(rng, scene(rng, 7), NOISE, setup=setup)
    robot, target, covariance = arrays(document)
    found = handeye_cli.solve_poses(
        robot, target, setup=setup.value, method=method, camera_covariance=covariance
    )
    expected = solve(document, method=method)
    np.testing.assert_allclose(
        found.mount_T_camera.matrix, expected.mount_T_camera.matrix, rtol=0, atol=1e-12
    )
    assert found.predicted_error.rotation == pytest.approx(expected.predicted_error.rotation)
    assert found.setup is setup


def test_lists_names_and_known_noise():
    rng = np.random.default_rng(5)
    robot, target, _ = arrays(stations(rng, scene(rng, 5), NOISE))
    found = handeye_cli.solve_poses(robot.tolist(), target.tolist(), noise=NOISE, names="abcde")
    assert found.noise == NOISE
    assert not found.noise_estimated
    assert [row.name for row in found.stations] == list("abcde")


def test_a_covariance_may_be_flat_and_rounded():
    rng = np.random.default_rng(23)
    robot, target, covariance = arrays(stations(rng, scene(rng, 5), NOISE))
    covariance[1, :, 5] = covariance[1, 5, :] = 0.0
    covariance[2, 0, 1] += 1e-9 * covariance[2, 0, 0]
    found = handeye_cli.solve_poses(robot, target, camera_covariance=covariance)
    assert found.predicted_error.rotation > 0


def test_verification_of_arrays():
    rng = np.random.default_rng(7)
    document = stations(rng, scene(rng, 12), NOISE)
    robot, target, covariance = arrays(document)
    split = handeye_cli.verify_poses(robot, target, counts=[4, 6], camera_covariance=covariance)
    expected = verify(document, counts=[4, 6])
    assert [row.translation for row in split.rows] == pytest.approx(
        [row.translation for row in expected.rows], rel=1e-6
    )
    each = handeye_cli.verify_poses(robot, target, leave_one_out=True, method="shah")
    assert len(each.rows[0].errors) == 12
    answer = handeye_cli.solve_poses(robot[:6], target[:6])
    checked = handeye_cli.verify_poses(robot[6:], target[6:], calibration=answer)
    assert len(checked.rows[0].errors) == 6
    with pytest.raises(UsageError, match="only one of calibration, counts and leave_one_out"):
        handeye_cli.verify_poses(robot, target, counts=[4], leave_one_out=True)


def test_verification_after_the_target_was_moved():
    rng = np.random.default_rng(8)
    robot, target, _ = arrays(stations(rng, scene(rng, 12), NOISE))
    answer = handeye_cli.solve_poses(robot[:6], target[:6])
    moved_target = target[6:] @ se3.from_parts(np.eye(3), np.array([0.1, 0.0, 0.0]))
    left = handeye_cli.verify_poses(robot[6:], moved_target, calibration=answer)
    assert left.rows[0].translation == pytest.approx(0.1, rel=0.1)
    again = handeye_cli.verify_poses(robot[6:], moved_target, calibration=answer, target_moved=True)
    assert again.rows[0].translation < 0.01
    with pytest.raises(UsageError, match="expected a calibration with target_moved, found none"):
        handeye_cli.verify_poses(robot, target, target_moved=True)


@pytest.mark.parametrize(
    ("method", "setup"), [(name, list(Setup)[k % 2]) for k, name in enumerate(solvers.names())]
)
def test_a_batch_is_a_loop(setup, method):
    _, robot, target = trials(np.random.default_rng(11), 6, (2, 2), setup)
    found = handeye_cli.solve_batch(robot, target, setup=setup, method=method, noise=NOISE)
    assert found.mount_T_camera.shape == found.reference_T_target.shape == (2, 2, 4, 4)
    assert found.converged
    for i in np.ndindex(2, 2):
        one = handeye_cli.solve_poses(robot[i], target[i], setup=setup, method=method, noise=NOISE)
        np.testing.assert_allclose(found.mount_T_camera[i], one.mount_T_camera.matrix, atol=1e-9)
        np.testing.assert_allclose(
            found.reference_T_target[i], one.reference_T_target.matrix, atol=1e-9
        )


def test_monte_carlo_reaches_the_predicted_error():
    perfect, robot, target = trials(np.random.default_rng(13), 8, (400,), Setup.EYE_IN_HAND)
    found = handeye_cli.solve_batch(robot, target, noise=NOISE)
    errors = se3.difference(found.mount_T_camera, perfect.X)
    translation, rotation = np.sqrt(np.mean(errors**2, axis=0).reshape(2, 3).sum(axis=1))
    expected = handeye_cli.solve_poses(perfect.A, perfect.B, noise=NOISE).predicted_error
    # the RMS of 400 draws of three components scatters by 2 to 4 %
    assert rotation == pytest.approx(expected.rotation, rel=0.12)
    assert translation == pytest.approx(expected.translation, rel=0.12)


def test_leading_axes_are_broadcast():
    perfect, robot, _ = trials(np.random.default_rng(17), 5, (3,), Setup.EYE_IN_HAND)
    found = handeye_cli.solve_batch(robot, perfect.B, method="tsai-lenz")
    assert found.mount_T_camera.shape == (3, 4, 4)


def bad(**changes):
    """Return the arguments of `solve_poses` with something changed."""
    perfect = scene(np.random.default_rng(19), 5)
    return {"base_T_gripper": perfect.A.copy(), "camera_T_target": perfect.B.copy()} | changes


def with_item(name, index, value):
    arguments = bad()
    arguments[name][index] = value
    return arguments


BAD = {
    "no array": (bad(base_T_gripper="x"), InputError, "base_T_gripper: .*array of numbers"),
    "ragged": (bad(base_T_gripper=[[1], [1, 2]]), InputError, "base_T_gripper: .*array of numbers"),
    "vectors": (bad(camera_T_target=np.ones((5, 6))), InputError, r"\(N, 4, 4\).*found \(5, 6\)"),
    "two": (bad(camera_T_target=np.ones((2, 4, 4))), InputError, r"at least 3, found \(2, 4, 4\)"),
    "unequal": (bad(camera_T_target=bad()["camera_T_target"][:4]), InputError, r"\(4, 4, 4\)"),
    "nan": (
        with_item("base_T_gripper", (3, 0, 3), np.nan),
        InputError,
        r"base_T_gripper\[3, 0, 3\]: expected finite numbers, found nan",
    ),
    "no rotation": (
        with_item("camera_T_target", (2, slice(3), slice(3)), 2 * np.eye(3)),
        InputError,
        r"camera_T_target\[2\]: .*by 3",
    ),
    "a reflection": (
        with_item("camera_T_target", (1, slice(3), slice(3)), -np.eye(3)),
        InputError,
        r"camera_T_target\[1\]: .*determinant -1",
    ),
    "transposed": (
        bad(base_T_gripper=np.swapaxes(bad()["base_T_gripper"], -1, -2)),
        InputError,
        r"base_T_gripper\[0\]: .*last row",
    ),
    "a batch": (
        bad(base_T_gripper=np.tile(bad()["base_T_gripper"], (2, 1, 1, 1))),
        InputError,
        r"\(2, 5, 4, 4\).*solve_batch",
    ),
    "setup": (bad(setup="eye-on-hand"), UsageError, "'eye-on-hand'.*did you mean eye-"),
    "method": (bad(method="tsai"), UsageError, "'tsai'"),
    "names": (bad(names=["a", "b", "c", "d", "d"]), InputError, "5 different names"),
    "covariances": (
        bad(camera_covariance=np.eye(6)),
        InputError,
        r"camera_covariance: .*\(5, 6, 6\), found \(6, 6\)",
    ),
    "a negative covariance": (
        bad(camera_covariance=np.tile(-np.eye(6), (5, 1, 1))),
        InputError,
        r"camera_covariance\[0\]: .*eigenvalue",
    ),
    "a crooked covariance": (
        bad(camera_covariance=np.tile(np.eye(6) + 0.1 * np.eye(6, k=1), (5, 1, 1))),
        InputError,
        r"camera_covariance\[0\]: expected a symmetric covariance, found 0.1",
    ),
    "no turn": (
        bad(
            base_T_gripper=np.tile(np.eye(4), (5, 1, 1)),
            camera_T_target=np.tile(np.eye(4), (5, 1, 1)),
        ),
        UndeterminedError,
        "differ in rotation",
    ),
}


@pytest.mark.parametrize("fault", BAD)
def test_faults_are_named(fault):
    arguments, error, message = BAD[fault]
    with pytest.raises(error) as caught:
        handeye_cli.solve_poses(**arguments)
    assert re.search(message, str(caught.value))


@pytest.mark.parametrize("noise", [None, Noise(1e-3, 1e-4), Noise(1e-3, 0.0, 1e-3, 1e-4)])
def test_maximum_likelihood_of_a_batch_needs_the_noise(noise):
    with pytest.raises(UsageError, match="noise levels for maximum-likelihood, found rotation"):
        handeye_cli.solve_batch(**bad(noise=noise))


def test_what_does_not_fit_together_in_a_batch():
    arguments = bad()
    robot = np.tile(arguments["base_T_gripper"], (2, 1, 1, 1))
    target = np.tile(arguments["camera_T_target"], (3, 1, 1, 1))
    with pytest.raises(InputError, match=r"\(2, 5, 4, 4\) and \(3, 5, 4, 4\)"):
        handeye_cli.solve_batch(robot, target, method="shah")


def test_the_examples_of_the_guide_run(tmp_path, monkeypatch):
    """In one namespace, in their order, from an empty folder."""
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) >= 5
    namespace = {}
    for block in blocks:
        exec(compile(block, str(GUIDE), "exec"), namespace)


def test_every_public_name_is_in_the_guide():
    text = (Path(__file__).resolve().parents[1] / "docs" / "python.md").read_text(encoding="utf-8")
    assert set(handeye_cli.__all__) <= set(re.findall(r"\w+", text))

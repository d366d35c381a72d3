"""Half turns that leave two answers, and those that do not."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from diagnosis.mistakes import QUIET, of_cameras, recording, with_half_turns
from scenes import general_scene, problem, scene

from handeye_cli.chain import chain_of
from handeye_cli.conventions import Setup
from handeye_cli.diagnosis.second_answer import second_answer
from handeye_cli.errors import UndeterminedError
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.observability import half_turns
from handeye_cli.records import Noise
from handeye_cli.solve import solve
from handeye_cli.solvers import Solution, names, tsai_lenz

EXACT = Noise(1e-12, 1e-12, 1e-12, 1e-12)
LOW = Noise(2e-4, 5e-5, 2e-4, 5e-5)


def turn(axis, degrees):
    return se3.from_parts(rotations.exp(np.radians(degrees) * np.asarray(axis)), np.zeros(3))


def axis_of_first(cameras):
    """The unit axis of the first camera's motion to the second."""
    axis = rotations.log(cameras[1, :3, :3] @ cameras[0, :3, :3].T)
    return axis / np.linalg.norm(axis)


def turned_about_the_target(rng, kind):
    """A scene whose camera turns about the target: by 180, 180 and 60 degrees, and more of it."""
    frame = rotations.exp(rng.normal(size=3))
    x, y, z = frame.T
    between = np.cos(np.radians(30.0)) * y + np.sin(np.radians(30.0)) * z
    motions = {
        "three": [turn(y, 180), turn(between, 180)],
        "four": [turn(y, 180), turn(between, 180), turn(x, 40)],
        "all half turns": [turn(x, 180), turn(y, 180), turn(z, 180)],
        "unique": [turn(y, 180), turn(between, 180), turn((x + y) / np.sqrt(2.0), 40)],
        "no half turn": [turn(y, 150), turn(between, 150)],
    }[kind]
    first = se3.from_parts(np.eye(3), np.array([0.0, 0.0, -0.17]))
    return of_cameras(rng, np.array([first, *(motion @ first for motion in motions)]))


def all_solutions(perfect, misses=1e-4):
    """By brute force: starts all over SO(3), each refined on the rotations of all loops."""
    rng = np.random.default_rng(1)
    starts = rotations.exp(2.0 * rng.normal(size=(200, 3)))
    A, B = perfect.A[:, :3, :3], perfect.B[:, :3, :3]
    motion_g, motion_c = A[0].T @ A[1:], B[0] @ np.swapaxes(B[1:], -1, -2)
    R = starts
    for _ in range(400):
        # the nearest rotation to what the motions carry R to has the same fixed points
        R = rotations.project_to_so3(R + np.sum(motion_g @ R[:, None] @ motion_c.mT, axis=1))
    missed = np.abs(motion_g @ R[:, None] - R[:, None] @ motion_c).max(axis=(1, 2, 3))
    found = []
    for each in R[missed < misses]:
        if all(rotations.angle(each @ other.T) > 0.1 for other in found):
            found.append(each)
    return found


@pytest.mark.parametrize(("kind", "count"), [("three", 2), ("four", 2), ("unique", 1)])
def test_brute_force_finds_as_many_answers(kind, count):
    rng = np.random.default_rng(81)
    perfect = turned_about_the_target(rng, kind)
    chain = chain_of(recording(rng, perfect, EXACT))
    other = second_answer(chain, Solution(perfect.X, perfect.Z))
    exact = all_solutions(perfect)
    assert len(exact) == count
    assert (other is not None) == (count == 2)
    if other is not None:
        assert min(rotations.angle(other.X[:3, :3] @ each.T) for each in exact) < 1e-3
        assert rotations.angle(other.X[:3, :3] @ perfect.X[:3, :3].T) == pytest.approx(np.pi)
        closed = chain.A @ other.X @ chain.B
        assert np.allclose(closed, other.Z, atol=1e-9)


@pytest.mark.parametrize("method", names())
@pytest.mark.parametrize("kind", ["three", "four", "all half turns"])
def test_two_answers_are_refused_by_every_method(kind, method):
    rng = np.random.default_rng(83)
    perfect = turned_about_the_target(rng, kind)
    with pytest.raises(UndeterminedError, match="found two") as caught:
        solve(recording(rng, perfect, LOW), method=method)
    assert caught.value.exit_code == 4
    assert "turned by 180 deg against that" in caught.value.message
    places = caught.value.message.split("at (")[1:]
    told = [[float(value) for value in each.split(")")[0].split(",")] for each in places]
    nearest = min(np.linalg.norm(np.array(each) - 1e3 * perfect.X[:3, 3]) for each in told)
    if kind != "all half turns":  # these allow four answers, of which two are told
        # noise of 0.2 mrad at a lever of 0.4 m, and 0.05 mm: far less than the way between the two
        assert nearest < 1.0
    assert "150 deg" in caught.value.hint


@pytest.mark.parametrize("kind", ["unique", "no half turn"])
@pytest.mark.parametrize("noise", [EXACT, LOW], ids=["exact", "low"])
def test_one_more_turn_or_no_half_turn_is_solved(kind, noise):
    rng = np.random.default_rng(85)
    perfect = turned_about_the_target(rng, kind)
    answer = solve(recording(rng, perfect, noise))
    error = se3.difference(answer.mount_T_camera.matrix, perfect.X)
    assert np.linalg.norm(error[3:]) < 1e-2
    assert np.linalg.norm(error[:3]) < 2e-3


def test_noise_decides_what_is_a_half_turn():
    """A turn of 178 degrees has one answer at 0.2 mrad, and two at 20 mrad."""
    rng = np.random.default_rng(87)
    perfect = turned_about_the_target(rng, "three")
    cameras = se3.inverse(perfect.B)
    cameras[1] = turn(axis_of_first(cameras), -2.0) @ cameras[1]
    perfect = of_cameras(rng, cameras)
    for noise, two in ((LOW, False), (Noise(2e-2, 2e-3, 2e-2, 2e-3), True)):
        chain = chain_of(recording(rng, perfect, noise))
        start = Solution(perfect.X, perfect.Z)
        assert (second_answer(chain, start) is not None) == two


def test_a_shift_along_the_axis_of_a_half_turn_tells_which():
    rng = np.random.default_rng(89)
    perfect = turned_about_the_target(rng, "three")
    cameras = se3.inverse(perfect.B)
    cameras[1, :3, 3] += 0.05 * axis_of_first(cameras)
    shifted = of_cameras(rng, cameras)
    chain = chain_of(recording(rng, shifted, LOW))
    assert second_answer(chain, Solution(shifted.X, shifted.Z)) is None


SHIFT = 0.04
"""Along the axis of a motion, metres; the noise is a thousandth of it."""


def around_with_shifts(rng):
    """A camera that goes around the target by half turns and others, at random with shifts."""
    x, y, z = rotations.exp(rng.normal(size=3)).T
    angle = rng.uniform(0.3, 2.8)
    between = np.cos(angle) * y + np.sin(angle) * z
    halves = [turn(y, 180), turn(between, 180)]
    others = [turn(x, sign * rng.uniform(20, 150)) for sign in (1, 1, -1)]
    kinds = (halves, [*halves, others[0]], [turn(axis, 180) for axis in (x, y, z)])
    motions = (*kinds, [*halves, *others])[rng.integers(4)]
    first = se3.from_parts(np.eye(3), np.array([0.0, 0.0, -0.17]))
    cameras = np.array([first, *(motion @ first for motion in motions)])
    axes = rotations.log(np.array([motion[:3, :3] for motion in motions]))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    shifted = rng.random(len(motions)) < 1 / 3
    cameras[1:, :3, 3] += SHIFT * shifted[:, None] * axes
    return of_cameras(rng, cameras)


def fitting(chain):
    """By brute force: how many rotations fit, and how many of these fit the translations too."""
    near = chain.A[0], chain.B[0]
    motion_g = se3.inverse(near[0]) @ chain.A[1:]
    motion_c = near[1] @ se3.inverse(chain.B[1:])
    rows = (motion_g[:, :3, :3] - np.eye(3)).reshape(-1, 3)
    left = []
    for R in all_solutions(chain, misses=2e-3):
        right = (motion_c[:, :3, 3] @ R.T - motion_g[:, :3, 3]).ravel()
        closest = rows @ np.linalg.lstsq(rows, right, rcond=None)[0]
        left.append(np.sqrt(np.mean((closest - right) ** 2)))
    return len(left), sum(each < SHIFT / 20 for each in left)


@pytest.mark.parametrize("seed", [*range(16), 230])
def test_half_turns_are_solved_where_brute_force_finds_one_answer(seed):
    rng = np.random.default_rng(seed)
    perfect = around_with_shifts(rng)
    document = recording(rng, perfect, LOW, list(Setup)[seed % 2])
    rotations_that_fit, answers = fitting(chain_of(document))
    assert rotations_that_fit > 1
    if answers > 1:
        with pytest.raises(UndeterminedError, match="found two or more, as half turns allow"):
            solve(document)
        return
    error = se3.difference(solve(document).mount_T_camera.matrix, perfect.X)
    # noise of 0.2 mrad at a lever of 0.4 m, and 0.05 mm; another answer is 50 mm and 3 rad away
    assert np.linalg.norm(error[3:]) < 2e-3
    assert np.linalg.norm(error[:3]) < 1e-3


@pytest.mark.parametrize("method", names())
def test_every_method_solves_half_turns_with_shifts(method):
    rng = np.random.default_rng(89)
    perfect = turned_about_the_target(rng, "all half turns")
    cameras = se3.inverse(perfect.B)
    cameras[1, :3, 3] += SHIFT * axis_of_first(cameras)
    cameras[2, :3, 3] += SHIFT * axis_of_first(cameras[[0, 2]])
    perfect = of_cameras(rng, cameras)
    answer = solve(recording(rng, perfect, LOW), method=method)
    assert not [each for each in answer.diagnosis if each.severity != "info"]
    error = se3.difference(answer.mount_T_camera.matrix, perfect.X)
    assert np.linalg.norm(error[3:]) < 2e-3
    assert np.linalg.norm(error[:3]) < 1e-3


@pytest.mark.parametrize("setup", Setup)
@pytest.mark.parametrize("count", [4, 5, 8, 16])
def test_ordinary_stations_with_half_turns_have_one_answer(count, setup):
    rng = np.random.default_rng([91, count])
    for level in (0.1, 1.0, 5.0):
        noise = replace(QUIET, robot_rotation=level * 1e-3, robot_translation=level * 2e-4)
        perfect = with_half_turns(rng, count)
        chain = chain_of(recording(rng, perfect, noise, setup))
        assert half_turns(chain.A[0, :3, :3], chain.A[:, :3, :3]).any()
        assert second_answer(chain, tsai_lenz.solve(problem(perfect, noise))) is None


@pytest.mark.parametrize("layout", [scene, general_scene])
def test_stations_without_half_turns_are_not_looked_at(layout):
    rng = np.random.default_rng(93)
    chain = chain_of(recording(rng, layout(rng, 10)))
    assert not half_turns(chain.A[0, :3, :3], chain.A[:, :3, :3]).any()


def test_half_turns_are_counted_from_the_first():
    R = rotations.exp(np.array([[0.1, 0, 0], [0.1 + 3.1, 0, 0], [1.0, 0, 0], [0.1 - 2.5, 0, 0]]))
    assert half_turns(R[0], R[1:]).tolist() == [True, False, False]


def test_memory_grows_with_the_stations_and_not_with_their_pairs():
    rng = np.random.default_rng(91)
    perfect = general_scene(rng, 3000)
    half = perfect.A[0] @ turn(np.array([0.0, 0.0, 1.0]), 180)
    chain = chain_of(recording(rng, perfect, LOW))
    chain = replace(chain, A=np.concatenate([chain.A[:1], half[None], chain.A[2:]]))
    tracemalloc.start()
    second_answer(chain, Solution(perfect.X, perfect.Z))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < len(chain.A) ** 2

"""The determined part of an answer: its error against its covariance; where the rest is held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from degenerate_scenes import (
    COUNTS,
    HIGH,
    LOW,
    NO_NOISE,
    chain_of_any,
    degenerate,
    free_twists,
    noisy,
)
from scenes import general_scene, scene, stations
from scipy.stats import chi2

from handeye_cli.chain import chain_of
from handeye_cli.conventions import Setup
from handeye_cli.diagnosis.partial import solve_partial
from handeye_cli.errors import UndeterminedError
from handeye_cli.geometry import rotations, se3
from handeye_cli.records import Noise, PosePart
from handeye_cli.solve import solve

TRIALS = 40
KINDS = [kind for kind in COUNTS if kind != "second axis in the noise"]


def parts(answer):
    """Return which part of the answer each free direction is of."""
    return [each.part for each in answer.free]


def held_rows(answer):
    """(k, 6) rows of the perturbation of X that the answer holds."""
    rows = np.zeros((len(answer.free), 6))
    for row, each in zip(rows, answer.free, strict=True):
        row[slice(3, 6) if each.part is PosePart.ROTATION else slice(0, 3)] = each.direction
    return rows


def moved(X, twist, amount):
    """X after moving by a twist (v, w) of the mount's frame: a shift, or a turn about a line."""
    v, w = twist[:3], twist[3:]
    size = np.linalg.norm(w)
    if size < 1e-9:
        return se3.from_parts(np.eye(3), amount * v) @ X
    point, along = np.cross(w, v) / size**2, w * (w @ v) / size**2
    R = rotations.exp(amount * w)
    return se3.from_parts(R, point - R @ point + amount * along) @ X


def truths_twin(perfect, answer):
    """The truth moved along its own free directions to where the answer holds them."""
    held = held_rows(answer)
    if len(held) == 6:
        return answer.mount_T_camera.matrix
    twists = free_twists(perfect)
    turn = np.linalg.svd(twists[:, 3:])[0]
    twists = turn.T @ twists  # the first turns, the others only shift
    assert len(twists) == len(held)
    found, X = answer.mount_T_camera.matrix, perfect.X
    if PosePart.ROTATION in parts(answer):
        amounts = np.linspace(-np.pi, np.pi, 25) / np.linalg.norm(twists[0, 3:])
        starts = np.array([moved(X, twists[0], amount) for amount in amounts])
        apart = rotations.angle(starts[:, :3, :3] @ found[:3, :3].T)
        X = starts[np.argmin(apart)]

    def left(amounts):
        place = X
        for twist, amount in zip(twists, amounts, strict=True):
            place = moved(place, twist, amount)
        return place, held @ se3.difference(found, place)

    amounts = np.zeros(len(twists))
    for _ in range(4):
        slopes = [
            (left(amounts + 1e-6 * e)[1] - left(amounts - 1e-6 * e)[1]) for e in np.eye(len(twists))
        ]
        amounts = (
            amounts - np.linalg.lstsq(np.array(slopes).T / 2e-6, left(amounts)[1], rcond=None)[0]
        )
    place, rest = left(amounts)
    assert np.max(np.abs(rest), initial=0.0) < 1e-9
    return place


def error_of(perfect, answer):
    X = truths_twin(perfect, answer)
    Z = perfect.A[0] @ X @ perfect.B[0]
    return np.concatenate(
        [
            se3.difference(answer.mount_T_camera.matrix, X),
            se3.difference(answer.reference_T_target.matrix, Z),
        ]
    )


def squared_distance(error, covariance):
    scale = 1.0 / np.sqrt(np.where(np.diag(covariance) > 0.0, np.diag(covariance), 1.0))
    scaled = scale[:, None] * covariance * scale
    whitened = np.linalg.pinv(scaled, hermitian=True, rcond=1e-10)
    return (scale * error) @ whitened @ (scale * error)


@pytest.mark.many_runs
@pytest.mark.parametrize("kind", KINDS)
def test_the_error_of_the_determined_part_is_as_predicted(kind):
    """Over all trials, half of them of ten times the noise: chi-square, two-sided."""
    total, squares, predicted = 0.0, [], []
    for seed in range(TRIALS):
        setup = list(Setup)[seed // 2 % 2]
        perfect, document, chain = noisy(kind, seed, (LOW, HIGH)[seed % 2], setup=setup, given=True)
        answer = solve_partial(document, chain)
        error = error_of(perfect, answer)
        total += squared_distance(error, answer.covariance)
        scale = (1.0, 0.1)[seed % 2]
        squares.append(np.sum((scale * error[:6]).reshape(2, 3) ** 2, axis=1)[::-1])
        told = answer.predicted_error
        predicted.append(np.square([scale * told.rotation, scale * told.translation]))
    freedom = TRIALS * (12 - sum(COUNTS[kind]))
    low, high = chi2.ppf([0.005, 0.995], freedom)
    assert low < total < high
    rotations_free, translations_free = COUNTS[kind]
    determined = np.array([rotations_free < 3, translations_free < 3])
    ratio = np.mean(squares, axis=0)[determined] / np.mean(predicted, axis=0)[determined]
    # two directions a trial, or more that differ in size
    assert np.all(np.abs(ratio - 1.0) < 3.5 * np.sqrt(1.5 / TRIALS))
    np.testing.assert_array_equal(np.mean(predicted, axis=0)[~determined], 0.0)


@pytest.mark.parametrize("kind", ["one axis", "scara"])
def test_estimated_noise_predicts_as_well(kind):
    """In the determined part about 95 % are within their radius, and the noise is the true one."""
    inside, rotation = [], []
    for seed in range(25):
        perfect, document, chain = noisy(kind, seed, LOW)
        answer = solve_partial(document, chain)
        error, told = error_of(perfect, answer), answer.predicted_error
        off = np.linalg.norm(error[3:6]), np.linalg.norm(error[:3])
        inside.append([off[0] < told.rotation_95, off[1] < told.translation_95 or off[1] < 1e-9])
        rotation.append(answer.noise.robot_rotation**2)
        assert answer.noise_estimated
        assert answer.noise_freedom > 3.0
    share = np.mean(inside, axis=0)
    assert np.all(share >= 0.8)
    assert np.sqrt(np.mean(rotation)) == pytest.approx(LOW.robot_rotation, rel=0.15)


@pytest.mark.parametrize("noise", [NO_NOISE, LOW, HIGH], ids=["none", "low", "high"])
@pytest.mark.parametrize("kind", COUNTS)
def test_free_directions_are_held_and_have_no_covariance(kind, noise):
    near = se3.from_parts(rotations.exp(np.array([0.3, -0.2, 0.5])), np.array([0.1, -0.05, 0.2]))
    _, document, chain = noisy(kind, 3, noise, with_covariance=noise is not NO_NOISE)
    for guess in (None, near):
        answer = solve_partial(document, chain, near=guess)
        expected = np.eye(4) if guess is None else guess
        rotations_free, translations_free = COUNTS[kind]
        assert parts(answer).count(PosePart.ROTATION) == rotations_free
        assert parts(answer).count(PosePart.TRANSLATION) == translations_free
        held = held_rows(answer)
        within = np.abs(held @ answer.mount_T_camera.covariance)
        assert np.max(within) < 1e-12 * np.max(np.abs(answer.covariance))
        np.testing.assert_allclose(held @ held.T, np.eye(len(held)), atol=1e-12)
        X = answer.mount_T_camera.matrix
        for each in answer.free:
            if each.part is PosePart.TRANSLATION:
                assert each.direction @ (X[:3, 3] - expected[:3, 3]) == pytest.approx(
                    0.0, abs=1e-10
                )
            else:
                # of all turns about the axis that leaves the least: no vector part along it
                apart = rotations.quaternion_from_matrix(X[:3, :3] @ expected[:3, :3].T)
                assert each.direction @ apart[:3] == pytest.approx(0.0, abs=1e-10)
                assert apart[3] >= 0.0


def test_another_choice_is_the_same_answer_moved():
    """The loops close as well wherever the free directions are held."""
    _, document, chain = noisy("one axis", 5, LOW)
    near = se3.from_parts(rotations.exp(np.array([1.0, -2.0, 0.5])), np.array([0.4, 0.3, -0.6]))
    here, there = solve_partial(document, chain), solve_partial(document, chain, near=near)
    assert (
        np.linalg.norm(se3.difference(here.mount_T_camera.matrix, there.mount_T_camera.matrix))
        > 0.3
    )
    size = [np.sqrt(np.mean(each.residuals**2)) for each in (here, there)]
    assert size[0] == pytest.approx(size[1], rel=0.3)
    told = [each.predicted_error.rotation for each in (here, there)]
    assert told[0] == pytest.approx(told[1], rel=0.2)


@pytest.mark.parametrize("given", [True, False])
@pytest.mark.parametrize("setup", Setup)
@pytest.mark.parametrize("layout", [scene, general_scene])
def test_where_all_is_determined_it_is_maximum_likelihood(layout, setup, given):
    rng = np.random.default_rng(11)
    document = stations(rng, layout(rng, 9), LOW, setup=setup, given=given)
    usual, answer = solve(document), solve_partial(document, chain_of(document))
    assert answer.free == ()
    for found, expected in (
        (answer.mount_T_camera, usual.mount_T_camera),
        (answer.reference_T_target, usual.reference_T_target),
    ):
        apart = se3.difference(found.matrix, expected.matrix)
        # noise and answer agree to a thousandth of the noise's own uncertainty, not better
        sigma = np.sqrt(np.diag(expected.covariance))
        assert np.all(np.abs(apart) < (1e-6 if given else 1e-3) * sigma)
        np.testing.assert_allclose(
            found.covariance,
            expected.covariance,
            atol=(1e-6 if given else 2e-3) * np.max(np.abs(expected.covariance)),
        )
    told, expected = answer.predicted_error, usual.predicted_error
    rel = 1e-6 if given else 2e-3
    assert told.rotation == pytest.approx(expected.rotation, rel=rel)
    assert told.translation_95 == pytest.approx(expected.translation_95, rel=rel)


def test_a_scara_answer_lacks_its_height_only():
    """With the height from a drawing the whole pose is right within its noise."""
    rng = np.random.default_rng(13)
    perfect = degenerate("scara", rng, axis=[0.0, 0.0, 1.0])
    document = stations(rng, perfect, LOW, given=True)
    drawing = se3.from_parts(np.eye(3), np.array([0.0, 0.0, perfect.X[2, 3]]))
    answer = solve_partial(document, chain_of(document), near=drawing)
    assert [each.words for each in answer.free] == [
        "translation along the gripper's z axis (0.00, 0.00, 1.00)"
    ]
    off = se3.difference(answer.mount_T_camera.matrix, perfect.X)
    told = answer.predicted_error
    assert np.linalg.norm(off[3:]) < 2.0 * told.rotation_95
    assert np.linalg.norm(off[:3]) < 2.0 * told.translation_95


def test_one_station_gives_only_the_relation_of_the_two_poses():
    _, document, chain = noisy("one axis", 17, LOW, given=True)
    single = chain.part(slice(1))
    answer = solve_partial(document, single)
    assert len(answer.free) == 6
    np.testing.assert_allclose(answer.mount_T_camera.matrix, np.eye(4), atol=1e-12)
    np.testing.assert_allclose(
        answer.reference_T_target.matrix, single.A[0] @ single.B[0], atol=1e-12
    )
    assert answer.predicted_error.rotation == 0.0
    assert np.all(np.linalg.eigvalsh(answer.reference_T_target.covariance) > 0.0)


def test_one_station_shows_no_noise():
    _, document, chain = noisy("one axis", 17, LOW)
    with pytest.raises(UndeterminedError, match="6 equations for 6 unknowns") as caught:
        solve_partial(document, chain.part(slice(1)))
    assert "'noise'" in caught.value.hint


def test_two_stations_show_one_level_of_noise():
    """Two residuals: the level is right in the mean, and hardly certain."""
    levels = []
    for seed in range(24):
        _, document, chain = noisy("two stations", seed, LOW, with_covariance=seed % 2 == 0)
        answer = solve_partial(document, chain)
        levels.append(answer.noise.robot_rotation)
        assert answer.noise_freedom < 2.5
        away = np.median(np.linalg.norm(chain.B[:, :3, 3], axis=1))
        assert answer.noise.robot_translation == pytest.approx(levels[-1] * away, rel=1e-9)
    assert 0.3 * LOW.robot_rotation < np.sqrt(np.mean(np.square(levels))) < 3.0 * LOW.robot_rotation


def test_the_noise_of_intrinsics_is_counted():
    _, document, chain = noisy("scara", 19, LOW, given=True)
    shared = 1e-3 * np.random.default_rng(1).normal(size=(1, 6, 2)) * np.ones((8, 1, 1))
    with_intrinsics = solve_partial(document, replace(chain, by_intrinsics=shared))
    without = solve_partial(document, chain)
    more = with_intrinsics.covariance - without.covariance
    assert np.trace(more) > 0.0
    assert np.min(np.linalg.eigvalsh(more)) > -1e-9 * np.trace(more)
    assert np.linalg.matrix_rank(more, tol=1e-6 * np.trace(more), hermitian=True) <= 2


def test_unused_levels_stay_as_given():
    given = Noise(1e-3, 2e-4, 5e-4, 1e-4)
    rng = np.random.default_rng(23)
    document = replace(stations(rng, degenerate("scara", rng), LOW), noise=given)
    answer = solve_partial(document, chain_of_any(document))
    assert answer.noise == given
    assert not answer.noise_estimated
    assert answer.noise_freedom is None

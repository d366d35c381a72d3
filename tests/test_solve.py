"""The calibration stage: its answer, its predicted error, and what it refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scenes import calibrated, estimated, general_scene, scene, stations

from handeye_cli import solvers
from handeye_cli.chain import chain_of
from handeye_cli.conventions import Setup
from handeye_cli.errors import UndeterminedError, UsageError
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.star import star_pairs
from handeye_cli.predict import paper_prediction, predicted_error
from handeye_cli.records import Noise, Station, UncertainPose
from handeye_cli.solve import solve

NOISE = Noise(1e-3, 2e-4, 1e-3, 1e-4)


def magnitudes(found, truth):
    d = se3.difference(found, truth)
    return np.array([np.linalg.norm(d[3:]), np.linalg.norm(d[:3])])


CLOSED_FORMS = [name for name in solvers.names() if name != solvers.DEFAULT]
SETTINGS = [(setup, given) for given in (True, False) for setup in Setup]
# What is in the noise, and where the camera is, is settled before a method comes to its turn.
JUDGED = [(solvers.DEFAULT, *SETTINGS[0]), (solvers.DEFAULT, *SETTINGS[3])] + [
    (method, *SETTINGS[turn % len(SETTINGS)]) for turn, method in enumerate(CLOSED_FORMS)
]


@pytest.mark.many_runs
@pytest.mark.parametrize(("method", "setup", "given"), JUDGED)
def test_the_predicted_error_holds(method, setup, given):
    """RMS of 100 answers within 20 % of the predicted, 88 - 99 % inside the 95 % radius."""
    rng = np.random.default_rng(31)
    actual, predicted, radius = [], [], []
    for _ in range(100):
        perfect = scene(rng, 12)
        found = estimated(stations(rng, perfect, NOISE, setup=setup, given=given), method)
        told = predicted_error(found.influence, found.model, None)
        actual.append(magnitudes(found.solution.X, perfect.X))
        predicted.append([told.rotation, told.translation])
        radius.append([told.rotation_95, told.translation_95])
    ratio = np.sqrt(np.mean(np.square(actual), axis=0) / np.mean(np.square(predicted), axis=0))
    assert np.all((ratio > 0.8) & (ratio < 1.2))
    share = np.mean(np.array(actual) < radius, axis=0)
    assert np.all((share >= 0.88) & (share <= 0.99))


@pytest.mark.parametrize("given", [True, False])
@pytest.mark.parametrize("setup", Setup)
@pytest.mark.parametrize("method", [solvers.DEFAULT, "tsai-lenz"])
def test_an_answer_is_the_estimate_and_what_is_predicted_of_it(method, setup, given):
    """So what holds of estimates over many runs holds of answers."""
    rng = np.random.default_rng(33)
    document = stations(rng, scene(rng, 12), NOISE, setup=setup, given=given)
    answer, found = solve(document, method=method), calibrated(document, method)
    assert replace(answer.predicted_error, paper=None) == found.predicted_error
    assert (answer.setup, answer.method, answer.noise) == (found.setup, found.method, found.noise)
    assert (answer.noise_estimated, answer.noise_freedom) == (not given, found.noise_freedom)
    for one, other in (
        (answer.mount_T_camera, found.mount_T_camera),
        (answer.reference_T_target, found.reference_T_target),
    ):
        np.testing.assert_array_equal(one.matrix, other.matrix)
        np.testing.assert_array_equal(one.covariance, other.covariance)
    np.testing.assert_array_equal(answer.covariance_between, found.covariance_between)


def test_estimated_noise_widens_the_radius():
    rng = np.random.default_rng(37)
    perfect = scene(rng, 3)
    known = solve(stations(np.random.default_rng(1), perfect, NOISE, given=True))
    estimated = solve(stations(np.random.default_rng(1), perfect, NOISE, given=False))
    wide = estimated.predicted_error
    narrow = known.predicted_error
    assert wide.rotation_95 / wide.rotation > 1.1 * narrow.rotation_95 / narrow.rotation
    assert estimated.noise_estimated
    assert not known.noise_estimated


def test_answers_and_constants_are_named_by_the_setup():
    rng = np.random.default_rng(41)
    perfect = general_scene(rng, 6)
    for setup in Setup:
        answer = solve(stations(rng, perfect, Noise(1e-6, 1e-6, 1e-6, 1e-6), setup=setup))
        np.testing.assert_allclose(answer.mount_T_camera.matrix, perfect.X, atol=2e-5)
        np.testing.assert_allclose(answer.reference_T_target.matrix, perfect.Z, atol=2e-5)
        assert answer.setup is setup


@pytest.mark.parametrize("method", solvers.names())
def test_perfect_stations_without_covariances(method):
    rng = np.random.default_rng(43)
    perfect = scene(rng, 7)
    tiny = Noise(1e-12, 1e-12, 1e-12, 1e-12)
    answer = solve(stations(rng, perfect, tiny, with_covariance=False), method=method)
    np.testing.assert_allclose(answer.mount_T_camera.matrix, perfect.X, atol=1e-9)
    assert answer.predicted_error.rotation < 1e-7


def test_residuals_name_every_station_and_the_reason_of_the_unused():
    rng = np.random.default_rng(47)
    document = stations(rng, scene(rng, 6), NOISE)
    lost = Station("lost", document.stations[0].base_T_gripper, reason="no disc was found")
    document = replace(document, stations=(document.stations[0], lost, *document.stations[1:]))
    answer = solve(document, method="tsai-lenz")
    assert [row.name for row in answer.stations] == ["00", "lost", "01", "02", "03", "04", "05"]
    assert [row.used for row in answer.stations] == [True, False] + 5 * [True]
    assert answer.stations[1].reason == "no disc was found"
    assert answer.stations[1].rotation is None
    used = [row for row in answer.stations if row.used]
    assert all(row.rotation < 8e-3 and row.translation < 2e-3 for row in used)
    joined = {index for pair in answer.pairs for index in pair}
    assert joined == {0, 2, 3, 4, 5, 6}


def test_the_residual_is_the_distance_of_the_target():
    rng = np.random.default_rng(53)
    document = stations(rng, scene(rng, 5), NOISE)
    answer = solve(document)
    station = document.stations[2]
    seen = station.base_T_gripper @ answer.mount_T_camera.matrix @ station.camera_T_target.matrix
    apart = magnitudes(seen, answer.reference_T_target.matrix)
    assert answer.stations[2].rotation == pytest.approx(apart[0], rel=1e-9)
    assert answer.stations[2].translation == pytest.approx(apart[1], rel=1e-9)


def test_given_noise_is_reported_as_given():
    rng = np.random.default_rng(59)
    answer = solve(stations(rng, scene(rng, 6), NOISE, given=True))
    assert answer.noise == NOISE


@pytest.mark.parametrize("count", [0, 1, 2])
def test_fewer_than_three_stations_are_refused(count):
    rng = np.random.default_rng(61)
    document = stations(rng, scene(rng, 3), NOISE)
    with pytest.raises(UndeterminedError, match=f"at least 3 stations.*found {count} of {count}"):
        solve(replace(document, stations=document.stations[:count]))


def along_one_axis(rng, noise, axis=(0.0, 0.0, 1.0)):
    perfect = scene(rng, 6)
    turns = rotations.exp(np.linspace(0, 1.5, 6)[:, None] * np.array(axis))
    gripper = se3.from_parts(turns, rng.normal(size=(6, 3)) * 0.1)
    B = se3.inverse(perfect.X) @ se3.inverse(gripper) @ perfect.Z
    covariance = np.tile(np.eye(6) * max(noise, 1e-16) ** 2, (6, 1, 1))
    noisy = [
        se3.perturb(T, rng.multivariate_normal(np.zeros(6), C))
        for T, C in zip([*gripper, *B], [*covariance, *covariance], strict=True)
    ]
    return noisy[:6], noisy[6:]


@pytest.mark.parametrize(
    ("method", "noise"),
    [(solvers.DEFAULT, noise) for noise in (0.0, 1e-6, 1e-4, 1e-3, 5e-3)]
    + [(method, 1e-4) for method in CLOSED_FORMS],
)
def test_one_axis_is_refused_at_any_noise_and_named(method, noise):
    rng = np.random.default_rng(67)
    document = stations(rng, scene(rng, 6), NOISE)
    A, B = along_one_axis(rng, noise)
    rows = [
        replace(row, base_T_gripper=a, camera_T_target=UncertainPose(b))
        for row, a, b in zip(document.stations, A, B, strict=True)
    ]
    with pytest.raises(UndeterminedError, match=r"gripper's z axis"):
        solve(replace(document, stations=tuple(rows)), method=method)


@pytest.mark.parametrize("noise", [1e-9, 1e-3])
def test_pure_translation_is_refused(noise):
    rng = np.random.default_rng(71)
    perfect = scene(rng, 6)
    A = se3.from_parts(np.eye(3), rng.normal(size=(6, 3)) * 0.1)
    B = se3.inverse(perfect.X) @ se3.inverse(A) @ perfect.Z
    small = Noise(noise, noise, noise, noise)
    document = stations(rng, replace(perfect, A=A, B=B), small)
    with pytest.raises(UndeterminedError, match="stations that differ in rotation"):
        solve(document)


def test_axes_hidden_in_the_noise_are_refused():
    """Tilts of 0.1 deg about two axes at 1.5 mrad of noise determine nothing."""
    rng = np.random.default_rng(73)
    for _ in range(8):
        document = stations(rng, scene(rng, 7, tilt_deg=0.1), NOISE, given=True)
        with pytest.raises(UndeterminedError):
            solve(document)


def test_shifted_lists_are_refused():
    rng = np.random.default_rng(79)
    document = stations(rng, general_scene(rng, 10), NOISE)
    poses = [row.base_T_gripper for row in document.stations]
    rows = [
        replace(row, base_T_gripper=pose)
        for row, pose in zip(document.stations, poses[1:] + poses[:1], strict=True)
    ]
    with pytest.raises(UndeterminedError, match="one place earlier in the list"):
        solve(replace(document, stations=tuple(rows)))


def test_inverted_poses_are_refused_with_the_flag():
    rng = np.random.default_rng(83)
    document = stations(rng, general_scene(rng, 10), NOISE)
    rows = [replace(s, base_T_gripper=se3.inverse(s.base_T_gripper)) for s in document.stations]
    with pytest.raises(UndeterminedError) as caught:
        solve(replace(document, stations=tuple(rows)))
    assert "--robot-poses" in (caught.value.hint or "")


def test_unknown_pairs_are_refused():
    rng = np.random.default_rng(89)
    with pytest.raises(UsageError, match="star or all, found 'ring'"):
        solve(stations(rng, scene(rng, 4), NOISE), pairs="ring")


@pytest.mark.many_runs
def test_the_papers_prediction_stands_above_the_truth():
    """Eq. (29) is 1.2 - 1.4 and (31) 2 - 3.5 times the sampled error at N = 3."""
    rng = np.random.default_rng(97)
    paper_noise = Noise(1.5e-3, 5 * 25.4e-6, 1.5e-3, 3 * 25.4e-6)
    errors, paper = [], []
    for _ in range(150):
        perfect = scene(rng, 3)
        document = stations(rng, perfect, paper_noise, given=True)
        found = estimated(document, "tsai-lenz")
        chain = chain_of(document)
        paper.append(paper_prediction(chain, star_pairs(3), found.model.covariance))
        errors.append(magnitudes(found.solution.X, perfect.X))
    assert solve(document, method="tsai-lenz").predicted_error.paper == paper[-1]
    rms = np.sqrt(np.mean(np.square(errors), axis=0))
    rotation = np.mean([p.rotation for p in paper]) / rms[0]
    translation = np.mean([p.translation for p in paper]) / rms[1]
    assert 1.1 < rotation < 1.5
    assert 1.8 < translation < 3.8
    assert all(p.rotation_max > p.rotation for p in paper)
    assert all(p.translation_max > p.translation for p in paper)

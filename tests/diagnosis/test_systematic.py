"""Robots whose errors follow their poses, and robots whose errors are mere noise."""

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np
import pytest
from bent_plates import bent, photographed, stations_of
from scenes import Scene, general_scene, scene, stations

from handeye_cli.chain import chain_of
from handeye_cli.conventions import Setup
from handeye_cli.diagnosis.systematic import systematic_errors
from handeye_cli.estimation import best_estimate, choose_pairs
from handeye_cli.geometry import se3, smooth_fields
from handeye_cli.geometry.station_generator import generate_stations
from handeye_cli.records import FloatArray, Noise, Station, Stations, UncertainPose
from handeye_cli.solve import solve

NOISE = Noise(5e-4, 1e-4, 3e-4, 1e-4)
SCALE = 3e-3


def nothing(_, robot):
    return np.zeros((len(robot), 6))


def scaled(_, robot):
    return np.pad(SCALE * robot[:, :3, 3], ((0, 0), (0, 3)))


def joint(rng, robot):
    """A first joint whose encoder is off by a wave over its turn, about the base's z."""
    x, y, z = robot[:, :3, 3].T
    turn = 4e-3 * np.sin(2.0 * np.arctan2(y, x) + rng.uniform(0, 2 * np.pi))
    turn -= turn.mean()
    return turn[:, None] * np.stack([-y, x, 0 * z, 0 * z, 0 * z, np.ones_like(z)], axis=1)


def smooth(length):
    def field(rng, robot):
        correlations = smooth_fields.correlation(robot, length)
        root = np.linalg.cholesky(correlations + 1e-9 * np.eye(len(robot)))
        sizes = np.repeat([5e-4, 2.5e-3], 3)
        return (root @ rng.normal(size=(len(robot), 6))) * sizes

    return field


@dataclass(frozen=True)
class Trial:
    found: object
    error: FloatArray
    promised: FloatArray


def trial(rng, count, error_of, *, layout=general_scene, setup=Setup.EYE_IN_HAND, given=None):
    perfect = layout(rng, count)
    robot = perfect.A if setup is Setup.EYE_IN_HAND else se3.inverse(perfect.A)
    robot = se3.perturb(robot, error_of(rng, robot))
    A = robot if setup is Setup.EYE_IN_HAND else se3.inverse(robot)
    document = stations(rng, replace(perfect, A=A), NOISE, setup=setup)
    document = replace(document, noise=given)
    chain = chain_of(document)
    found = best_estimate(chain, choose_pairs("star", count), document, "maximum-likelihood")
    error = se3.difference(found.solution.X, perfect.X)
    verdict = systematic_errors(found, chain, given, setup)
    return Trial(verdict, error, np.diag(found.covariance)[:6])


def trials(seed, runs, *args, **how):
    rng = np.random.default_rng(seed)
    return [trial(rng, *args, **how) for _ in range(runs)]


def codes(runs):
    return Counter(finding.code for each in runs for finding in each.found.findings)


def ratios(runs):
    """Actual over promised RMS of translation and rotation, before and after widening."""
    error = np.array([each.error for each in runs]).reshape(-1, 2, 3)
    promised = np.array([each.promised for each in runs]).reshape(-1, 2, 3).sum(axis=-1)
    factors = np.array([[each.found.translation, each.found.rotation] for each in runs])
    actual = np.sum(error**2, axis=-1).mean(axis=0)
    return tuple(
        np.sqrt(actual / np.mean(each, axis=0)) for each in (promised, promised * factors**2)
    )


@pytest.mark.many_runs
@pytest.mark.parametrize(
    ("layout", "setup"), [(general_scene, Setup.EYE_IN_HAND), (scene, Setup.EYE_TO_HAND)]
)
def test_noise_is_not_called_systematic(layout, setup):
    runs = trials(1, 25, 12, nothing, layout=layout, setup=setup)
    assert codes(runs)["robot-systematic"] <= 2
    assert all(each.found.widening == 1.0 for each in runs if not each.found.findings)


def level_circle(_, count):
    """Stations of `plan` above a level plate: the gripper neither rises nor turns about base z."""
    X, Z = se3.from_parts(np.eye(3), np.array([0.11, -0.12, 0.18])), np.diag([1.0, -1, -1, 1])
    B = se3.inverse(generate_stations(count, 0.09, np.radians(30.0)))
    return Scene(Z @ se3.inverse(X @ B), B, X, Z)


@pytest.mark.many_runs
@pytest.mark.parametrize("count", [12, 18])
def test_noise_of_a_coordinate_that_hardly_varies_does_not_explain_itself(count):
    runs = trials(8, 40, count, nothing, layout=level_circle)
    assert codes(runs)["robot-systematic"] <= 2


def test_right_levels_that_are_given_are_left_alone():
    given = Noise(NOISE.robot_rotation, NOISE.robot_translation)
    found = codes(trials(2, 40, 10, nothing, given=given))
    assert max(found.values(), default=0) <= 2


@pytest.mark.parametrize("setup", Setup)
def test_a_scale_is_named_measured_and_widens_the_prediction(setup):
    runs = trials(3, 6, 14, scaled, setup=setup)
    assert codes(runs)["robot-systematic"] == 6
    message = runs[0].found.findings[0].message
    percent = float(message.split(" its ways are ")[1].split(" %")[0])
    sigma = float(message.split("(+- ")[1].split(")")[0])
    assert abs(percent - 100 * SCALE) < 4 * sigma
    assert "longer than the target's lengths" in message
    before, after = ratios(runs)
    assert before[0] > 3.0
    assert 0.75 < after[0] < 1.3


def test_a_target_of_another_size_is_promised_for_as_well():
    """The same residuals as those of a robot with a scale error, and another answer."""
    rng, runs = np.random.default_rng(4), []
    for _ in range(6):
        perfect = general_scene(rng, 14)
        B = perfect.B.copy()
        B[:, :3, 3] *= 1.0 - SCALE
        document = stations(rng, Scene(perfect.A, B, perfect.X, perfect.Z), NOISE)
        chain = chain_of(document)
        found = best_estimate(chain, choose_pairs("star", 14), document, "maximum-likelihood")
        verdict = systematic_errors(found, chain, None, Setup.EYE_IN_HAND)
        error = se3.difference(found.solution.X, perfect.X)
        runs.append(Trial(verdict, error, np.diag(found.covariance)[:6]))
    assert codes(runs)["robot-systematic"] >= 5
    before, after = ratios(runs)
    assert before[0] > 1.5
    assert after[0] < 1.3


@pytest.mark.many_runs
@pytest.mark.parametrize(
    ("count", "length", "layout"), [(16, 0.7, scene), (14, 1.5, general_scene), (40, 1.0, scene)]
)
def test_smooth_fields_widen_the_prediction_honestly(count, length, layout):
    runs = trials(5, 10, count, smooth(length), layout=layout)
    assert codes(runs)["robot-systematic"] >= 9
    before, after = ratios(runs)
    assert np.all(before > 1.5)
    # Ten answers of three axes each know their RMS to a seventh or so.
    assert np.all((after > 0.7) & (after < 1.35))


def test_a_joint_is_found():
    runs = trials(6, 5, 15, joint)
    assert codes(runs)["robot-systematic"] >= 4
    before, after = ratios(runs)
    assert np.max(before) > 1.5
    assert np.all(after < 1.35)


def test_perfect_poses_are_not_judged():
    rng = np.random.default_rng(12)
    for count in (8, 15):
        perfect = general_scene(rng, count)
        rows = [
            Station(str(i), perfect.A[i], camera_T_target=UncertainPose(perfect.B[i]))
            for i in range(count)
        ]
        document = Stations(Setup.EYE_IN_HAND, tuple(rows))
        chain = chain_of(document)
        found = best_estimate(chain, choose_pairs("star", count), document, "maximum-likelihood")
        assert not systematic_errors(found, chain, None, Setup.EYE_IN_HAND).findings


def test_few_stations_are_not_judged():
    runs = trials(7, 5, 7, smooth(1.5))
    assert not codes(runs)
    assert all(each.found.widening == 1.0 for each in runs)


def test_given_noise_is_not_judged_where_everything_is_fitted():
    """Three stations and six shared errors leave no residual to judge by."""
    rng = np.random.default_rng(13)
    document = stations(rng, general_scene(rng, 3), NOISE, given=True)
    chain = chain_of(document)
    found = best_estimate(chain, choose_pairs("star", 3), document, "maximum-likelihood")
    beside = replace(chain, by_intrinsics=1e-3 * rng.normal(size=(3, 6, 6)))
    verdict = systematic_errors(found, beside, document.noise, Setup.EYE_IN_HAND)
    assert verdict.findings == ()
    assert verdict.widening == 1.0


def test_a_circle_does_not_show_a_scale():
    """There is no motion along an axis: the answer takes all of it up."""
    assert codes(trials(8, 12, 16, scaled, layout=scene))["robot-systematic"] <= 1


@pytest.mark.parametrize(
    ("factor", "code"), [(0.4, "noise-understated"), (3.0, "noise-overstated")]
)
def test_levels_that_are_wrong(factor, code):
    given = Noise(factor * NOISE.robot_rotation, factor * NOISE.robot_translation)
    runs = trials(9, 10, 12, nothing, given=given)
    assert codes(runs)[code] == 10
    for each in runs:
        told = next(finding for finding in each.found.findings if finding.code == code)
        seen = float(told.message.split("residuals are ")[1].split(" times")[0])
        if code == "noise-understated":
            assert each.found.widening >= 1.0
            assert each.found.widening == pytest.approx(seen, rel=0.06)
        else:
            assert seen < 1.0
            assert each.found.rotation == 1.0
    before, after = ratios(runs)
    if code == "noise-understated":
        assert np.all(before > 1.3)
        assert np.all((after > 0.6) & (after < 1.4))


def test_shared_errors_of_the_camera_are_not_put_down_to_the_robot():
    """Poses that are off as a wrong camera makes them, known by direction but not by size."""
    rng = np.random.default_rng(10)
    perfect = general_scene(rng, 20)
    pattern = smooth(1.5)(rng, perfect.A)
    bad = replace(perfect, B=se3.perturb(perfect.B, pattern))
    document = stations(rng, bad, NOISE)
    chain = chain_of(document)
    found = best_estimate(chain, choose_pairs("star", 20), document, "maximum-likelihood")
    setup = Setup.EYE_IN_HAND
    assert systematic_errors(found, chain, None, setup).findings
    beside = replace(chain, by_intrinsics=pattern[..., None])
    assert not systematic_errors(found, beside, None, setup).findings


def test_widened_covariances():
    found = trial(np.random.default_rng(11), 16, smooth(1.5)).found
    wider = found.widened(np.eye(12))
    expected = np.tile(np.repeat([found.translation**2, found.rotation**2], 3), 2)
    np.testing.assert_allclose(wider, np.diag(expected))
    assert found.widening == max(found.translation, found.rotation) > 1.0


@pytest.mark.parametrize("seed", [2, 3, 9, 11])
def test_a_bow_that_was_found_is_not_put_down_to_the_robot(seed):
    """Nor to the noise of the pixels, beside which the robot's own errors would not be random."""
    noise = (2e-4, 5e-5)
    rng = np.random.default_rng(seed)
    shot = photographed(rng, bent(2e-3), count=9, sigma_px=0.02, robot=noise)
    diagnosis = solve(stations_of(shot)).diagnosis
    assert [each.code for each in diagnosis if each.severity != "info"] == ["plate-bowed"]


def test_an_error_of_a_joint_is_found_beside_a_bow():
    rng = np.random.default_rng(5)
    document = stations_of(photographed(rng, bent(2e-3), sigma_px=0.02, robot=(2e-4, 5e-5)))
    poses = np.array([each.base_T_gripper for each in document.stations])
    poses = se3.perturb(poses, joint(rng, poses))
    rows = zip(document.stations, poses, strict=True)
    wrong = tuple(replace(row, base_T_gripper=pose) for row, pose in rows)
    diagnosis = solve(replace(document, stations=wrong)).diagnosis
    assert {"plate-bowed", "robot-systematic"} <= {each.code for each in diagnosis}


def test_an_error_along_the_way_is_not_called_one_of_a_joint():
    rng = np.random.default_rng(3)
    perfect = general_scene(rng, 40)
    off = replace(perfect, A=se3.perturb(perfect.A, joint(rng, perfect.A)))
    document = stations(rng, off, NOISE)
    chain = chain_of(document)
    moving = replace(chain, shared_error=np.tile(1e-7 * np.ones(6), (len(chain.A), 1)))
    for each, words in ((chain, "of a joint or a link"), (moving, "along the robot's way")):
        found = best_estimate(each, choose_pairs("star", 40), document, "maximum-likelihood")
        (finding,) = systematic_errors(found, each, None, Setup.EYE_IN_HAND).findings
        assert finding.code == "robot-systematic"
        assert words in finding.message

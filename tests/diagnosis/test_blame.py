"""Who is to blame for the residuals, where the test knows."""

from dataclasses import replace

import numpy as np
import pytest
from bent_plates import bent, photographed, stations_of
from pictures import WIDE
from scenes import general_scene, stations

from handeye_cli import documents
from handeye_cli.chain import chain_of
from handeye_cli.conventions import Setup
from handeye_cli.diagnosis.blame import blame
from handeye_cli.diagnosis.plate_shape import plate_shape
from handeye_cli.geometry import se3
from handeye_cli.records import Noise, UncertainPose
from handeye_cli.solve import best_estimate, choose_pairs

CAUSES = ("robot", "camera", "intrinsics", "plate", "timing")
GOOD_ROBOT = (1e-4, 2e-5)
BAD_ROBOT = (2e-3, 8e-4)
QUIET_SCENE = general_scene(np.random.default_rng(10), 14)


def judged(document, *, with_plate=True):
    chain = chain_of(document)
    pairs = choose_pairs("star", len(chain.A))
    found = best_estimate(chain, pairs, document, "maximum-likelihood")
    shape = plate_shape(document) if with_plate else None
    return blame(found, document, chain, shape), found, shape


def shares(verdict, kind):
    return {
        cause: getattr(verdict, f"{cause}_{kind}")
        for cause in CAUSES
        if getattr(verdict, f"{cause}_{kind}") is not None
    }


@pytest.mark.parametrize("setup", Setup)
@pytest.mark.parametrize(
    ("robot", "sigma_px", "height", "limit"),
    [
        (BAD_ROBOT, 0.1, 0.0, "robot"),
        (GOOD_ROBOT, 0.4, 0.0, "camera"),
        (GOOD_ROBOT, 0.05, 1e-3, "plate"),
    ],
)
def test_the_limit_is_what_was_made_bad(robot, sigma_px, height, limit, setup):
    rng = np.random.default_rng(1)
    shot = photographed(rng, bent(height), robot=robot, sigma_px=sigma_px, setup=setup)
    verdict, *_ = judged(stations_of(shot))
    assert verdict.limit == limit
    assert f"the {limit} is the limit" in verdict.words
    for kind in ("rotation", "translation"):
        assert sum(shares(verdict, kind).values()) == pytest.approx(1.0)


def test_uncertain_intrinsics_are_the_limit_when_everything_else_is_good():
    rng = np.random.default_rng(2)
    document = stations_of(photographed(rng, robot=GOOD_ROBOT, sigma_px=0.05))
    size = WIDE.parameters.size
    doubt = np.diag([4.0, 4.0, 4.0, 4.0, *[1e-12] * (size - 4)]) ** 2
    verdict, *_ = judged(replace(document, camera=replace(WIDE, covariance=doubt)))
    assert verdict.limit == "intrinsics"


def test_squares_add_up_to_those_that_are_seen():
    """Over many recordings the causes explain the residuals, neither more nor less."""
    rng, seen, told = np.random.default_rng(3), [], []
    for _ in range(25):
        shot = photographed(rng, robot=(8e-4, 3e-4), sigma_px=0.3)
        document = replace(stations_of(shot), noise=Noise(8e-4, 3e-4))
        verdict, found, _ = judged(document, with_plate=False)
        seen.append(np.mean(found.residuals**2, axis=0).reshape(2, 3).sum(axis=1))
        told.append([verdict.translation**2, verdict.rotation**2])
    ratio = np.mean(seen, axis=0) / np.mean(told, axis=0)
    # Some thirty squares in each of twenty-five recordings.
    assert np.all(np.abs(ratio - 1.0) < 0.2)


def test_a_bow_is_not_put_down_to_the_robot():
    rng = np.random.default_rng(4)
    shot = photographed(rng, bent(1.5e-3), robot=GOOD_ROBOT, sigma_px=0.05, count=16)
    document = stations_of(shot)
    knowing, _, _ = judged(document)
    ignorant, _, _ = judged(document, with_plate=False)
    assert ignorant.plate_rotation is None
    assert ignorant.limit in {"robot", "camera"}
    assert knowing.limit == "plate"
    assert knowing.plate_translation > 0.5
    assert "what is put down to the robot goes from" in knowing.words


def test_a_robot_beside_a_wrong_lens_is_not_accused():
    """What the images do not show of wrong intrinsics would count as the robot's."""
    off = replace(WIDE, distortion=(-0.2, 0.06, 0.0, 0.0, 0.0))
    rng = np.random.default_rng(5)
    document = stations_of(photographed(rng, robot=BAD_ROBOT), off)
    verdict, _, shape = judged(document)
    assert [finding.code for finding in shape.findings] == ["residuals-over-image"]
    assert verdict.limit == "unclear"
    assert "cannot be told from what else is wrong with lens or plate" in verdict.words


def test_what_was_found_belongs_into_the_predicted_error():
    """Bowed plates and intrinsics from their images: the answer is far off, and it is told."""
    rng, error, promised, told = np.random.default_rng(6), [], [], []
    for _ in range(8):
        shot = photographed(rng, bent(1e-3), robot=(3e-4, 1e-4))
        document = stations_of(shot, calibrate=True)
        _, found, shape = judged(document)
        off = se3.difference(found.solution.X, shot.mount_T_camera)
        wider = found.covariance + shape.answer_covariance(chain_of(document), found.influence)
        error.append(np.sum(off.reshape(2, 3) ** 2, axis=1))
        promised.append(np.diag(found.covariance)[:6].reshape(2, 3).sum(axis=1))
        told.append(np.diag(wider)[:6].reshape(2, 3).sum(axis=1))
    assert np.all(np.sqrt(np.mean(error, axis=0) / np.mean(promised, axis=0)) > 3.0)
    after = np.sqrt(np.mean(error, axis=0) / np.mean(told, axis=0))
    assert np.all((after > 0.75) & (after < 1.3))


@pytest.mark.parametrize("given", [False, True])
def test_poses_alone_do_not_tell_robot_from_camera(given):
    rng, noise = np.random.default_rng(7), Noise(1e-3, 4e-4, 2e-4, 1e-4)
    document = stations(rng, general_scene(rng, 12), noise, given=given, with_covariance=False)
    verdict, *_ = judged(document)
    if given:
        assert verdict.limit == "robot"
        assert verdict.robot_translation > 0.5
    else:
        assert verdict.limit == "unclear"
        assert "cannot be told apart" in verdict.words
        assert verdict.robot_rotation is None
        assert verdict.translation > 0.0


JITTER = 10e-3
"""Seconds; at the speeds here that is 0.5 mm and 2 mrad, and ten times the noise of the robot."""
MOVING_NOISE = Noise(2e-4, 5e-5, 3e-4, 1e-4)


def in_motion(rng, *, jitter=JITTER, together=0.0, setup=Setup.EYE_IN_HAND, count=14):
    """Stations passed at 0.05 m/s and 0.2 rad/s, read at wrong times, which they know of."""
    document = stations(rng, general_scene(rng, count), MOVING_NOISE, setup=setup)
    way = rng.normal(size=(count, 6)) * np.repeat([0.05, 0.2], 3) / np.sqrt(3.0)
    late = jitter * rng.standard_normal(count) + together * rng.standard_normal()
    read = [
        replace(
            station,
            base_T_gripper=se3.perturb(station.base_T_gripper, seconds * velocity),
            robot_covariance=jitter**2 * np.outer(velocity, velocity),
            shared_error=max(together, 1e-6) * velocity,
        )
        for station, velocity, seconds in zip(document.stations, way, late, strict=True)
    ]
    return replace(document, stations=tuple(read))


def written_down(document, tmp_path):
    """The document as another program reads it."""
    documents.write(document, str(tmp_path / "stations.yaml"))
    return documents.read(str(tmp_path / "stations.yaml"))


@pytest.mark.parametrize("setup", Setup)
def test_times_that_scatter_are_the_limit(setup, tmp_path):
    document = written_down(in_motion(np.random.default_rng(8), setup=setup), tmp_path)
    verdict, *_ = judged(document)
    assert verdict.limit == "timing"
    assert verdict.words.endswith(": the time between pose and image is the limit")
    assert verdict.timing_rotation > 0.8
    for kind in ("rotation", "translation"):
        assert sum(shares(verdict, kind).values()) == pytest.approx(1.0)


def test_a_time_that_all_stations_share_is_the_limit():
    verdict, *_ = judged(in_motion(np.random.default_rng(9), jitter=0.0, together=JITTER))
    assert verdict.limit == "timing"


def test_good_times_and_pauses_are_not_blamed():
    verdict, *_ = judged(in_motion(np.random.default_rng(10), jitter=1e-4))
    assert verdict.timing_rotation < 0.05
    assert verdict.limit != "timing"
    still, *_ = judged(stations(np.random.default_rng(10), QUIET_SCENE, MOVING_NOISE))
    assert still.timing_rotation is None


@pytest.mark.parametrize(("jitter", "together"), [(JITTER, 0.0), (0.0, JITTER)])
def test_squares_add_up_with_times_that_are_off(jitter, together):
    rng, seen, told = np.random.default_rng(11), [], []
    for _ in range(40):
        verdict, found, _ = judged(in_motion(rng, jitter=jitter, together=together))
        seen.append(np.mean(found.residuals**2, axis=0).reshape(2, 3).sum(axis=1))
        told.append([verdict.translation**2, verdict.rotation**2])
    ratio = np.mean(seen, axis=0) / np.mean(told, axis=0)
    # One time for a recording has one degree of freedom, forty of them scatter by a fifth.
    assert np.all(np.abs(ratio - 1.0) < (0.2 if jitter else 0.7))


def test_a_covariance_of_another_cause_stays_the_robots():
    document = in_motion(np.random.default_rng(12))
    as_given = tuple(
        replace(each, robot_covariance=each.robot_covariance + 1e-9 * np.eye(6))
        for each in document.stations
    )
    for changed in (
        replace(document, stations=as_given),
        replace(
            document,
            stations=tuple(replace(each, shared_error=None) for each in document.stations),
        ),
    ):
        verdict, *_ = judged(changed)
        assert verdict.limit == "robot"
        assert (verdict.timing_rotation or 0.0) < 1e-3


def test_times_are_part_of_what_is_seen_where_the_camera_is_unknown():
    rng, seen, told = np.random.default_rng(13), [], []
    for _ in range(12):
        document = in_motion(rng)
        unknown = tuple(
            replace(each, camera_T_target=UncertainPose(each.camera_T_target.matrix))
            for each in document.stations
        )
        verdict, found, _ = judged(replace(document, stations=unknown))
        assert verdict.limit == "unclear"
        seen.append(np.mean(found.residuals**2, axis=0).reshape(2, 3).sum(axis=1))
        told.append([verdict.translation**2, verdict.rotation**2])
    # 168 times in all; their squares scatter by 11 %, and the more by how fast each station was
    assert np.all(np.abs(np.mean(seen, axis=0) / np.mean(told, axis=0) - 1.0) < 0.4)

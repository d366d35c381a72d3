"""Who is to blame for the residuals, where the test knows."""

from dataclasses import replace

import numpy as np
import pytest
from bent_plates import bent, photographed, stations_of
from pictures import WIDE
from scenes import general_scene, stations

from handeye_cli.chain import chain_of
from handeye_cli.conventions import Setup
from handeye_cli.diagnosis.blame import blame
from handeye_cli.diagnosis.plate_shape import plate_shape
from handeye_cli.geometry import se3
from handeye_cli.records import Noise
from handeye_cli.solve import best_estimate, choose_pairs

CAUSES = ("robot", "camera", "intrinsics", "plate", "timing")
GOOD_ROBOT = (1e-4, 2e-5)
BAD_ROBOT = (2e-3, 8e-4)


def judged(document, *, with_plate=True, speeds=None):
    chain = chain_of(document)
    pairs = choose_pairs("star", len(chain.A))
    found = best_estimate(chain, pairs, document, "maximum-likelihood")
    shape = plate_shape(document) if with_plate else None
    return blame(found, document, chain, shape, speeds), found, shape


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


def late(rng, seconds, count=24):
    """Stations that were passed, at speeds up to 0.2 m/s and 0.5 rad/s in any direction."""
    perfect = general_scene(rng, count)
    noise = Noise(5e-4, 1e-4, 3e-4, 1e-4)
    velocity = rng.normal(size=(count, 2, 3))
    velocity /= np.linalg.norm(velocity, axis=-1, keepdims=True)
    speeds = rng.uniform(0.0, 1.0, (count, 1)) * np.array([0.2, 0.5])
    twist = (velocity * speeds[..., None]).reshape(count, 6)
    bad = replace(perfect, A=se3.perturb(perfect.A, seconds * twist))
    return stations(rng, bad, noise), speeds


def test_a_time_offset_is_found_and_measured():
    rng, off = np.random.default_rng(8), []
    for _ in range(10):
        document, speeds = late(rng, 15e-3)
        verdict, *_ = judged(document, speeds=speeds)
        (finding,) = verdict.findings
        assert finding.code == "time-offset"
        assert verdict.limit == "timing"
        time, doubt = finding.message.split("about ")[1].split(" ms (+- ")
        off.append((float(time) - 15.0) / float(doubt.split(")")[0]))
    # The answer has taken up a part of the time, one direction of many.
    assert np.sqrt(np.mean(np.square(off))) < 2.0
    assert abs(np.mean(off)) < 1.5


def test_no_time_offset_is_seen_in_noise():
    rng, found = np.random.default_rng(9), 0
    for _ in range(30):
        document, speeds = late(rng, 0.0, count=12)
        verdict, *_ = judged(document, speeds=speeds)
        found += len(verdict.findings)
    assert found <= 1


def test_speeds_of_few_or_resting_stations_say_nothing():
    rng = np.random.default_rng(10)
    document, speeds = late(rng, 50e-3, count=7)
    assert not judged(document, speeds=speeds)[0].findings
    document, speeds = late(rng, 0.0)
    assert not judged(document, speeds=np.zeros_like(speeds))[0].findings

"""What is known of a robot's pose beside its noise, through documents and into the weights."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from handeye_cli.chain import chain_of
from handeye_cli.conventions import RobotPoses, Setup
from handeye_cli.documents.place import Place
from handeye_cli.documents.poses import (
    PoseConventions,
    PoseUnits,
    data_from_pose,
    uncertain_robot_pose_from_data,
)
from handeye_cli.documents.station_parts import shared_error_from_data
from handeye_cli.geometry import rotations, se3
from handeye_cli.noise_levels import noise_model
from handeye_cli.records import (
    Noise,
    Station,
    Stations,
    TargetSpec,
    UncertainPose,
)
from handeye_cli.solvers import Solution

PLATE = TargetSpec("disc-grid", {"rows": 2, "columns": 3, "spacing_mm": 5, "diameter_mm": 4})


def pose(rng):
    return se3.from_parts(rotations.exp(rng.normal(0.0, 1.0, 3)), rng.normal(0.0, 0.3, 3))


def covariance(rng):
    root = 1e-3 * rng.normal(size=(6, 6))
    return root @ root.T


@pytest.fixture
def stations():
    rng = np.random.default_rng(3)
    rows = [
        Station(f"{i:02d}", pose(rng), camera_T_target=UncertainPose(pose(rng))) for i in range(4)
    ]
    rows[1] = replace(rows[1], robot_covariance=covariance(rng))
    rows[3] = replace(rows[3], robot_covariance=covariance(rng))
    return Stations(Setup.EYE_IN_HAND, tuple(rows), noise=Noise(1e-3, 1e-4, 1e-3, 1e-4))


def test_it_is_turned_with_the_pose_of_a_document_the_other_way_round():
    """Against sampling: 20000 inverted poses tell a variance to 1 %."""
    rng = np.random.default_rng(4)
    written = UncertainPose(pose(rng), covariance(rng) * 1e-2)
    conventions = PoseConventions(PoseUnits.M, robot_poses=RobotPoses.BASE_IN_GRIPPER)
    found = uncertain_robot_pose_from_data(data_from_pose(written), conventions, Place("x"))
    samples = rng.multivariate_normal(np.zeros(6), written.covariance, 20000)
    seen = se3.difference(se3.inverse(se3.perturb(written.matrix, samples)), found.matrix)
    scatter = np.cov(seen.T)
    scale = np.sqrt(np.outer(np.diag(scatter), np.diag(scatter)))
    np.testing.assert_allclose(found.covariance / scale, scatter / scale, atol=0.05)


@pytest.mark.parametrize("setup", list(Setup))
def test_it_is_added_to_the_robots_noise(stations, setup):
    solution = Solution(np.eye(4), np.eye(4))
    told = replace(stations, setup=setup)
    silent = replace(
        told, stations=tuple(replace(each, robot_covariance=None) for each in told.stations)
    )
    with_it, without = (
        noise_model(chain_of(each), each.noise, solution).covariance for each in (told, silent)
    )
    chain = chain_of(told)
    added = [
        np.zeros((6, 6)) if each.robot_covariance is None else turn @ each.robot_covariance @ turn.T
        for each, turn in zip(told.stations, chain.by_robot, strict=True)
    ]
    difference = with_it - without
    np.testing.assert_allclose(difference[:, :6, :6], added, atol=1e-18)
    assert not difference[:, 6:].any()
    assert chain.part(np.array([3])).robot_covariance.tolist() == [
        told.stations[3].robot_covariance.tolist()
    ]
    assert chain_of(silent).robot_covariance is None


@pytest.mark.parametrize("units", list(PoseUnits))
@pytest.mark.parametrize("direction", list(RobotPoses))
def test_an_error_that_all_stations_share_is_that_of_the_pose_as_it_is_written(units, direction):
    rng = np.random.default_rng(5)
    written, error = pose(rng), 1e-6 * rng.normal(size=6)
    conventions = PoseConventions(units, robot_poses=direction)
    moved = se3.perturb(written, error)
    if direction is RobotPoses.BASE_IN_GRIPPER:
        robot, moved = se3.inverse(written), se3.inverse(moved)
    else:
        robot = written
    context = SimpleNamespace(poses=conventions)
    entry = {"shared_error": [*(error[:3] / units.metres), *error[3:]]}
    found = shared_error_from_data(entry, robot, context)
    np.testing.assert_allclose(found, se3.difference(moved, robot), atol=1e-10)
    assert shared_error_from_data({}, robot, context) is None

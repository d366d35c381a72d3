"""A document whose every quaternion is read in the other order, target poses included."""

from __future__ import annotations

import io

import numpy as np
import pytest
from diagnosis.mistakes import driven_circle, inverted, recording, robot_wxyz
from pictures import shoot

from handeye_cli import documents
from handeye_cli.chain import chain_of
from handeye_cli.conventions import QuaternionOrder, Setup
from handeye_cli.diagnosis.conventions import judge_conventions
from handeye_cli.documents import ReadOptions
from handeye_cli.errors import UndeterminedError
from handeye_cli.extrinsics import extrinsics
from handeye_cli.solve import solve


def read_as(order, setup):
    """Stations with pixels that were written as x y z w, read in an order."""
    found = extrinsics(shoot(np.random.default_rng(7), 9, setup=setup).features)
    text = documents.dump(found, "yaml")
    options = ReadOptions(quaternion_order=order)
    return documents.read("-", options, io.BytesIO(text.encode()))


@pytest.mark.parametrize("setup", Setup)
def test_the_order_is_named_where_pixels_stand_behind_the_poses(setup):
    document = read_as(QuaternionOrder.WXYZ, setup)
    assert all(station.observation for station in document.stations)
    with pytest.raises(UndeterminedError) as caught:
        solve(document)
    assert "if the quaternions are xyzw" in caught.value.message
    assert caught.value.hint == "say --quaternion-order xyzw"


@pytest.mark.parametrize("setup", Setup)
def test_the_right_order_is_not_blamed(setup):
    document = read_as(QuaternionOrder.XYZW, setup)
    assert not judge_conventions(document, chain_of(document)).contradiction


@pytest.mark.parametrize("turned_round", [False, True])
def test_robot_quaternions_in_another_order_and_direction_are_both_told(turned_round):
    rng = np.random.default_rng(11)
    document = recording(rng, driven_circle(rng, 10))
    document = robot_wxyz(inverted(document) if turned_round else document)
    (error,) = judge_conventions(document, chain_of(document)).findings
    advice = "write all quaternions of a document in one order"
    if turned_round:
        assert error.code == "quaternion-order-and-direction"
        advice += ", and say --robot-poses base-in-gripper"
    assert error.advice == advice

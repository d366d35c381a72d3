"""What a stage accepts, and which flags can act on it."""

import numpy as np
import pytest

from handeye_cli import pipeline
from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError, UsageError
from handeye_cli.pipeline import Steps
from handeye_cli.records import (
    Features,
    Plan,
    Recording,
    Station,
    Stations,
    TargetSpec,
    UncertainPose,
)

DISCS = {"rows": 6, "columns": 6, "spacing_mm": 5.0, "diameter_mm": 4.0}
PLATE = TargetSpec("disc-grid", DISCS)
EYE = Setup.EYE_IN_HAND

RECORDING = Recording(EYE, ())
FEATURES = Features(EYE, (), PLATE)
STATIONS = Stations(EYE, (Station("00", np.eye(4), camera_T_target=UncertainPose(np.eye(4))),))
PLAN = Plan(EYE, (), ())


def test_what_is_there_already_is_returned_as_it_is():
    assert pipeline.to_features(FEATURES, Steps()) is FEATURES
    assert pipeline.to_stations(STATIONS, Steps()) is STATIONS


@pytest.mark.parametrize(
    ("stage", "record", "message"),
    [
        (pipeline.to_features, STATIONS, "expected a recording or features document, found a stat"),
        (pipeline.to_features, PLAN, "expected a recording or features document, found a plan"),
        (pipeline.to_stations, PLAN, "a recording, features or stations document, found a plan"),
    ],
)
def test_a_later_record_is_refused(stage, record, message):
    with pytest.raises(InputError, match=message):
        stage(record, Steps())


def test_one_expected_kind_is_named_alone():
    with pytest.raises(InputError, match="expected a recording document, found a plan document"):
        pipeline.expect(PLAN, Recording)


def test_intrinsics_cannot_be_calibrated_from_poses():
    with pytest.raises(UsageError, match="--calibrate-intrinsics cannot act on a stations"):
        pipeline.to_stations(STATIONS, Steps(calibrate_intrinsics=True))


def test_a_recording_takes_any_target():
    assert pipeline.with_target(RECORDING, PLATE).target == PLATE


def test_features_take_a_target_with_other_lengths():
    right = TargetSpec("disc-grid", DISCS | {"spacing_mm": 5.1})
    assert pipeline.with_target(FEATURES, right).target == right


@pytest.mark.parametrize(
    "other",
    [TargetSpec("disc-grid", DISCS | {"rows": 7}), TargetSpec("asymmetric-circles", DISCS)],
)
def test_features_refuse_a_target_with_other_points(other):
    with pytest.raises(UsageError, match="--target cannot replace the target a features document"):
        pipeline.with_target(FEATURES, other)


def test_poses_refuse_a_target():
    with pytest.raises(UsageError, match="--target cannot replace the target a stations document"):
        pipeline.with_target(STATIONS, PLATE)


def test_a_plan_aims_at_the_middle_of_the_target():
    options = {"distance": 0.2, "tilt": 0.5, "setup": None, "calibration": None, "verification": 0}
    planned = pipeline.to_plan(3, target=PLATE, **options)
    places = np.array([station.target_T_camera[:3, 3] for station in planned.stations])
    np.testing.assert_allclose(places.mean(axis=0)[:2], [0.0125, 0.0125], atol=1e-12)
    assert planned.setup is EYE

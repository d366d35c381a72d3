"""A real camera on a real arm, its stations played back as a robot's recording."""

from dataclasses import replace

import numpy as np
import pytest
from line.foxglove_robot import FoxgloveRobot
from line.foxglove_robot import write as write_foxglove
from line.recordings import SHARED, RecordedRobot
from recording import bags

from handeye_cli import documents, pipeline, recording
from handeye_cli.conventions import MM, MRAD, Setup
from handeye_cli.geometry import rotations
from handeye_cli.recording import McapOptions
from handeye_cli.records.frames import RobotFrames

DOCUMENT = SHARED / "rct-10x10" / "recording.yaml"
KEPT = 0.8
"""Part of a file that is left when its end is cut off."""
NEAR_MRAD, NEAR_MM = 2.0, 1.5
"""The poses' own 0.02 mrad and 0.02 mm hardly move an answer; 75 frames are another picture."""

pytestmark = pytest.mark.skipif(not DOCUMENT.exists(), reason="no shared/data/rct-10x10 here")


def ros2_file(path):
    bags.write(path, RecordedRobot(document=DOCUMENT).messages(), chunk_size=1_000_000)
    return path


def foxglove_file(path):
    return write_foxglove(path, FoxgloveRobot(document=DOCUMENT).messages())


FORMS = {"ros2": ros2_file, "foxglove": foxglove_file}


def read(path):
    target = documents.read(str(DOCUMENT)).target
    return recording.read(str(path), McapOptions(setup=Setup.EYE_IN_HAND, target=target))


def features_of(record):
    return documents.as_written(pipeline.to_features(record, pipeline.Steps()))


def solved(features):
    return pipeline.to_calibration(
        features, pipeline.Steps(), method="maximum-likelihood", pairs="star"
    )


@pytest.fixture(scope="module")
def by_document():
    """The features of the document, which its stations' own pictures show."""
    return features_of(documents.read(str(DOCUMENT)))


@pytest.fixture(scope="module", params=FORMS)
def played(request, tmp_path_factory):
    """A file of the robot's run in each form; its camera never stops."""
    folder = tmp_path_factory.mktemp(f"real-{request.param}")
    return FORMS[request.param](folder / "arm.mcap")


def assert_near(calibration, expected):
    """Check an answer against that of the document."""
    X, X0 = (each.mount_T_camera.matrix for each in (calibration, expected))
    assert float(rotations.angle(X[:3, :3] @ X0[:3, :3].T)) / MRAD < NEAR_MRAD
    assert np.linalg.norm(X[:3, 3] - X0[:3, 3]) / MM < NEAR_MM


def test_all_stations_and_the_answer_of_the_document(played, by_document):
    read_back = read(played)
    assert len(read_back.stations) == 15
    assert read_back.frames == RobotFrames("world", "tool", "camera_optical", bags.ns(0.04))
    calibration = solved(features_of(read_back))
    assert [station.used for station in calibration.stations] == [True] * 15
    assert_near(calibration, solved(by_document))


def test_without_its_end_it_solves_with_a_note(played, by_document):
    content = played.read_bytes()
    cut = played.with_name("cut.mcap")
    cut.write_bytes(content[: int(KEPT * len(content))])
    calibration = solved(features_of(read(cut)))
    codes = [finding.code for finding in calibration.diagnosis]
    assert "recording-cut" in codes
    count = len(calibration.stations)
    assert 10 <= count <= 13
    assert all(station.used for station in calibration.stations)
    same = replace(by_document, stations=by_document.stations[:count])
    assert_near(calibration, solved(same))

"""Reports of fixed records against the texts in `golden/`.

After a wanted change, run this file as a script, which writes the texts anew, and read their diff.
"""

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from handeye_cli.conventions import Setup
from handeye_cli.geometry import rotations, se3
from handeye_cli.pipeline import findings_of as findings
from handeye_cli.plan import plan
from handeye_cli.records import (
    Calibration,
    CriticalFactors,
    Features,
    Finding,
    Improvement,
    Noise,
    Observation,
    PaperPrediction,
    PredictedError,
    Protocol,
    Spread,
    Station,
    StationError,
    StationResidual,
    Stations,
    TargetSpec,
    UncertainPose,
    Verification,
    VerificationRow,
)
from handeye_cli.render.console import make_console, show_findings
from handeye_cli.render.report import show

GOLDEN = Path(__file__).parent / "golden"

MOUNT_T_CAMERA = se3.from_parts(
    rotations.exp(np.array([0.028, -0.016, -1.567])), np.array([-0.083, 0.03, 0.064])
)
LOST = "31 of 36 discs: the plate leaves the image on the left"


def calibration() -> Calibration:
    return Calibration(
        setup=Setup.EYE_IN_HAND,
        method="tsai-lenz",
        mount_T_camera=UncertainPose(MOUNT_T_CAMERA),
        reference_T_target=UncertainPose(np.eye(4)),
        predicted_error=PredictedError(
            rotation=0.81e-3,
            translation=0.19e-3,
            rotation_95=1.3e-3,
            translation_95=0.31e-3,
            paper=PaperPrediction(1.02e-3, 0.41e-3, 3.4e-3, 2.2e-3),
        ),
        noise=Noise(0.5e-3, 0.1e-3, 0.3e-3, 0.05e-3, 0.021),
        noise_estimated=True,
        stations=(
            StationResidual("00", used=True, rotation=0.31e-3, translation=0.08e-3),
            StationResidual("01", used=False, reason=LOST),
            StationResidual("\x1b[2Jpause [7]", used=True, rotation=12e-3, translation=3e-3),
        ),
        factors=CriticalFactors(
            stations=2,
            axes_angle=Spread(1.06, 0.75, 1.49),
            interstation_angle=Spread(0.78, 0.26, 1.37),
            camera_distance=Spread(0.41, 0.4, 0.43),
            gripper_distance=Spread(0.1851, 0.026, 1.0244),
            robot_share_rotation=0.9522,
            robot_share_translation=0.31,
        ),
        improvements=(
            Improvement("nearer", "halving the camera distance", 0.74e-3, 0.12e-3, "would help"),
            Improvement("tilt", "tilting farther " * 5, 0.64e-3, 0.15e-3, "would help too"),
        ),
        diagnosis=(
            Finding("station-apart", "warning", "station 02 is 9 sigma away", "take it out"),
            Finding("paper", "info", "the paper predicts 1.02 mrad"),
        ),
    )


def verification() -> Verification:
    errors = (StationError("04", 4.1e-3, 0.5e-3), StationError("05", 5.0e-3, 0.7e-3))
    rows = (
        VerificationRow(4, 4.568e-3, 0.5902e-3, 4.2e-3, 0.61e-3, True, errors),
        VerificationRow(6, 3.304e-3, 0.4846e-3, 1.2e-3, 0.1e-3, False, errors),
        VerificationRow(8, 3.264e-3, 0.6785e-3, None, None, None, errors),
    )
    return Verification(Setup.EYE_TO_HAND, "maximum-likelihood", rows)


def one_row() -> Verification:
    return Verification(Setup.EYE_IN_HAND, "tsai-lenz", verification().rows[:1])


def left_out_with_pixels() -> Verification:
    errors = (
        StationError("04", 4.1e-3, 0.5e-3, 12.345, 1.234e-3),
        StationError("05", 5.0e-3, 0.7e-3),
    )
    row = VerificationRow(11, 14.568e-3, 10.5902e-3, 4.2e-3, 0.61e-3, False, errors, 12.3, 11.2e-3)
    return Verification(Setup.EYE_IN_HAND, "tsai-lenz", (row,), protocol=Protocol.LEAVE_ONE_OUT)


def calibration_with_moved_target() -> Verification:
    return replace(one_row(), protocol=Protocol.MOVED_TARGET)


def line() -> tuple[Station, ...]:
    seen = Observation(np.arange(36), np.zeros((36, 2)), 0.0213)
    tilted = se3.from_parts(rotations.exp(np.array([np.pi / 6, 0, 0])), np.array([0, 0, 0.17]))
    sigma = np.diag([1e-5, 1e-5, 2e-5, 1e-4, 1e-4, 1e-4]) ** 2
    return (
        Station("00", np.eye(4), seen, UncertainPose(tilted, sigma)),
        Station("01", np.eye(4), reason=LOST),
        Station(
            "02", np.eye(4), Observation(np.arange(4), np.zeros((4, 2))), UncertainPose(tilted)
        ),
    )


def features() -> Features:
    parameters = {"rows": 6, "columns": 6, "spacing_mm": 5.0, "diameter_mm": 4.0}
    return Features(Setup.EYE_IN_HAND, line(), TargetSpec("disc-grid", parameters))


def stations() -> Stations:
    return Stations(Setup.EYE_IN_HAND, line())


def plan_of_cameras():
    return plan(5, distance=0.17, tilt=np.radians(30), verification=2)


def plan_of_robot():
    table = se3.from_parts(np.diag([1.0, -1.0, -1.0]), np.array([0.6, 0.0, 0.1]))
    return plan(3, distance=0.4, mount_T_camera=MOUNT_T_CAMERA, reference_T_target=table)


RECORDS = {
    make.__name__: make
    for make in (
        calibration,
        verification,
        one_row,
        left_out_with_pixels,
        calibration_with_moved_target,
        features,
        stations,
        plan_of_cameras,
        plan_of_robot,
    )
}


def printed(act, *arguments) -> str:
    stream = io.StringIO()
    console = make_console(stream)
    console.width = 80
    act(*arguments, console)
    return "".join(f"{line.rstrip()}\n" for line in stream.getvalue().splitlines())


@pytest.mark.parametrize("name", RECORDS)
def test_report_is_the_golden_text(name):
    text = printed(show, RECORDS[name]())
    assert text == (GOLDEN / f"{name}.txt").read_text(encoding="utf-8")
    assert max(map(len, text.splitlines())) <= 80


def test_a_column_without_any_number_is_left_out():
    stations = tuple(
        replace(each, observation=each.observation and replace(each.observation, sigma_px=None))
        for each in line()
    )
    text = printed(show, replace(features(), stations=stations))
    assert "sigma" not in text
    assert "sigma" in printed(show, features())


def test_a_report_obeys_no_control_character_of_a_file():
    text = printed(show, calibration())
    assert "\x1b" not in text
    assert "\N{REPLACEMENT CHARACTER}[2Jpause [7]" in text


def test_findings_stay_on_one_line_each_with_their_advice_below():
    stream = io.StringIO()
    show_findings(make_console(stream), findings(calibration()))
    assert stream.getvalue().splitlines() == [
        "warning: station 02 is 9 sigma away [station-apart]",
        "  take it out",
        "info: the paper predicts 1.02 mrad [paper]",
    ]


def test_a_long_finding_is_not_broken():
    stream = io.StringIO()
    show_findings(make_console(stream), [Finding("long", "info", "word " * 60)])
    assert len(stream.getvalue().splitlines()) == 1


def test_what_was_not_measured_takes_no_place():
    text = printed(show, replace(calibration(), factors=None, improvements=()))
    assert "What" not in text
    unknown = replace(calibration().factors, robot_share_rotation=None)
    text = printed(show, replace(calibration(), factors=unknown))
    assert "What limits it" in text
    assert "mean square" not in text


def test_a_given_noise_is_said_to_be_given():
    text = printed(show, replace(calibration(), noise_estimated=False, noise=Noise()))
    assert "as given" in text
    assert "estimated" not in text


if __name__ == "__main__":
    for title, make_record in RECORDS.items():
        (GOLDEN / f"{title}.txt").write_text(printed(show, make_record()), encoding="utf-8")

"""Stations to add where the intrinsics are uncertain: promises against recordings made so."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from pictures import WIDE, Shot, shoot
from scenes import estimated

from handeye_cli import targets
from handeye_cli.conventions import Setup
from handeye_cli.geometry import bundle, pnp, se3
from handeye_cli.geometry.camera import project
from handeye_cli.plan import plan_more
from handeye_cli.planning.recorded import solved
from handeye_cli.records import (
    Finding,
    FloatArray,
    Noise,
    Observation,
    Plan,
    Station,
    Stations,
    TargetSpec,
    UncertainPose,
)
from handeye_cli.solve import solve
from handeye_cli.views import views_of

BOARD = TargetSpec("chessboard", {"rows": 5, "columns": 7, "square_mm": 40.0})
POINTS = targets.build(BOARD).points()
CAMERA = replace(WIDE, distortion=WIDE.distortion[:4])
PRIOR = np.diag([2.0, 2.0, 2.0, 2.0, 3e-3, 6e-3, 3e-4, 3e-4]) ** 2
SIGMA = 0.3
NOISE = Noise(5e-4, 5e-5, pixel=SIGMA)
RECORDED, ADDED, RUNS = 6, 3, 20
CALIBRATED = Finding("intrinsics-calibrated", "info", "")


@dataclass(frozen=True)
class Cell:
    """A robot that can be sent anywhere, and what it then records."""

    shot: Shot
    calibrates: bool

    @property
    def setup(self) -> Setup:
        return self.shot.features.setup

    @property
    def hand(self) -> FloatArray:
        """The poses of its first stations."""
        return np.array([each.base_T_gripper for each in self.shot.features.stations])

    def views(self, hand: FloatArray) -> FloatArray:
        """camera_T_target at poses of the hand."""
        A, first = self._mount(hand), self._mount(self.hand[:1])
        X = self.shot.mount_T_camera
        return se3.inverse(A @ X) @ first @ X @ self.shot.camera_T_target[:1]

    def _mount(self, hand: FloatArray) -> FloatArray:
        return hand if self.setup is Setup.EYE_IN_HAND else se3.inverse(hand)

    def record(self, rng: np.random.Generator, hand: FloatArray, sure: float = 1.0) -> Stations:
        """Stations with noise in pixels and robot poses, and intrinsics that are off."""
        B = self.views(hand)
        pixels = project(se3.transform_points(B, POINTS), CAMERA.parameters)
        pixels = pixels + SIGMA * rng.normal(size=pixels.shape)
        axis = np.repeat([NOISE.robot_translation, NOISE.robot_rotation], 3) / np.sqrt(3)
        said = se3.perturb(hand, axis * rng.normal(size=(len(hand), 6)))
        off = sure * rng.normal(size=8) @ np.sqrt(PRIOR)
        seen = [Observation(np.arange(len(POINTS)), each, SIGMA) for each in pixels]
        rows = [Station(f"{i:02d}", *each) for i, each in enumerate(zip(said, seen, strict=True))]
        return self.with_poses(rows, off)

    def with_poses(self, rows: list[Station], off: FloatArray) -> Stations:
        """Stations with the poses that the extrinsics would find, started from the true ones."""
        views = views_of(rows, POINTS)
        start = self.views(np.array([each.base_T_gripper for each in rows]))
        parameters, covariance = CAMERA.parameters + off, PRIOR
        if self.calibrates:
            found = bundle.calibrate(views.seen, CAMERA.lens, start)
            parameters, covariance = found.parameters, SIGMA**2 * np.linalg.inv(found.information)
        fx, fy, cx, cy, *distortion = parameters.tolist()
        camera = replace(CAMERA, fx=fx, fy=fy, cx=cx, cy=cy, distortion=tuple(distortion))
        camera = replace(camera, covariance=covariance)
        poses, _ = pnp.refine(start, views.seen, camera.lens)
        spread = SIGMA**2 * np.linalg.inv(pnp.pose_information(poses, views.seen, camera.lens))
        seen = [
            replace(row, camera_T_target=UncertainPose(pose, C))
            for row, pose, C in zip(rows, poses, spread, strict=True)
        ]
        findings = (CALIBRATED,) if self.calibrates else ()
        return Stations(self.setup, tuple(seen), BOARD, camera, findings=findings, noise=NOISE)


def cell(setup: Setup, *, calibrates: bool) -> Cell:
    rng = np.random.default_rng(7)
    shot = shoot(
        rng,
        RECORDED,
        camera=CAMERA,
        points=POINTS,
        spec=BOARD,
        distance=0.3,
        sigma_px=0.0,
        robot=(0.0, 0.0),
        setup=setup,
    )
    return Cell(shot, calibrates)


def promised(planned: Plan) -> FloatArray:
    """(2, 2) rotation and translation before and after."""
    first, last = planned.gains[0], planned.gains[-1]
    return np.array(
        [[first.rotation_before, first.translation_before], [last.rotation, last.translation]]
    )


def promised_of_noise(planned: Plan, stations: Stations) -> FloatArray:
    """The same without what is taken to last, which is not simulated here."""
    lasting = solved(stations, Noise(), method="maximum-likelihood").lasting
    return np.sqrt(promised(planned) ** 2 - se3.by_kind(np.diag(lasting))[::-1])


CASES = [(Setup.EYE_IN_HAND, False), (Setup.EYE_TO_HAND, True)]


@pytest.mark.many_runs
@pytest.mark.parametrize(("setup", "calibrates"), CASES)
def test_gains_hold_where_intrinsics_are_uncertain(setup, calibrates):
    rng, place = np.random.default_rng(1), cell(setup, calibrates=calibrates)
    stations = place.record(rng, place.hand, 0.0)
    planned = plan_more(stations, ADDED)
    new = np.array([each.base_T_gripper for each in planned.stations])
    away = []
    for _ in range(RUNS):
        state = rng.bit_generator.state
        for hand in (place.hand, np.concatenate([place.hand, new])):
            rng.bit_generator.state = state
            answer = estimated(place.record(rng, hand)).solution.X
            away.append(se3.difference(answer, place.shot.mount_T_camera))
    squares = np.reshape(away, (RUNS, 2, 2, 3)) ** 2
    rms = np.sqrt(squares.sum(axis=-1).mean(axis=0))[:, ::-1]
    # 20 squares of two or three axes each are known to a fifth, their root to a tenth
    ratio = rms / promised_of_noise(planned, stations)
    np.testing.assert_allclose(ratio, 1.0, atol=0.3)


@pytest.mark.parametrize(("setup", "calibrates"), CASES)
def test_what_is_there_is_predicted_as_solve_does(setup, calibrates):
    place = cell(setup, calibrates=calibrates)
    stations = place.record(np.random.default_rng(1), place.hand, 0.0)
    error = solve(stations).predicted_error
    exact = replace(stations, camera=replace(stations.camera, covariance=None))
    assert error.translation > 1.3 * solve(exact).predicted_error.translation
    before = promised(plan_more(stations, 1))[0]
    assert before == pytest.approx([error.rotation, error.translation], rel=1e-6)


def test_a_promise_is_what_solve_predicts_when_it_is_kept():
    """The planned stations are added without noise, and all are solved."""
    place = cell(Setup.EYE_IN_HAND, calibrates=False)
    stations = place.record(np.random.default_rng(1), place.hand, 0.0)
    planned = plan_more(stations, ADDED)
    rows = list(stations.stations)
    for each in planned.stations:
        B = place.views(each.base_T_gripper[None])
        pixels = project(se3.transform_points(B, POINTS), stations.camera.parameters)[0]
        rows.append(
            Station(each.name, each.base_T_gripper, Observation(np.arange(35), pixels, SIGMA))
        )
    off = stations.camera.parameters - CAMERA.parameters
    error = estimated(place.with_poses(rows, off)).covariance
    expected = np.sqrt(se3.by_kind(np.diag(error)[:6]))[::-1]
    found = promised_of_noise(planned, stations)[1]
    assert found == pytest.approx(expected, rel=0.05)

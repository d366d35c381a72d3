"""What limits a recording, and what would help: every promise against the changed recording itself.

The changed recordings are built here by other means: the station generator at another distance or
tilt, poses multiplied out, pixels projected by OpenCV. Then they are solved, and their own
predicted error must be what the advice promised for them.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scenes import (
    PAPER_DISTANCE,
    Scene,
    calibrated,
    disturbed,
    general_scene,
    joint_covariance,
    scene,
    stations,
)

from handeye_cli import advice, solvers, targets
from handeye_cli.chain import chain_of
from handeye_cli.conventions import Setup
from handeye_cli.estimation import estimate
from handeye_cli.extrinsics import extrinsics
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.star import star_pairs
from handeye_cli.geometry.station_generator import generate_stations
from handeye_cli.records import (
    Calibration,
    Camera,
    Features,
    Improvement,
    Noise,
    Observation,
    Station,
    Stations,
    UncertainPose,
)
from handeye_cli.sight import sight_of
from handeye_cli.solve import solve
from handeye_cli.solvers import Problem
from handeye_cli.what_if import circle, more_tilted, nearer

ROBOT_LIMITED = Noise(1e-3, 2e-4, 1e-4, 1e-5)
CAMERA_LIMITED = Noise(1e-4, 1e-5, 2e-3, 1e-4)
ALIKE = Noise(5e-4, 1e-4, 1e-3, 1e-4)
SAME = 0.01
"""Relative: a promise rests on the answer from noisy poses, the recording it is checked on rests on
exact ones; 1 mrad moves no prediction by more than a few thousandths."""


def laid_out(B: np.ndarray, like: Scene) -> Scene:
    """The scene with other poses of the target in the camera; the robot follows."""
    return replace(like, B=B, A=like.Z @ np.linalg.inv(B) @ np.linalg.inv(like.X))


def without_noise(perfect: Scene, noise: Noise, setup: Setup = Setup.EYE_IN_HAND) -> Stations:
    """A document of exact poses that says how noisy they are."""
    robot = perfect.A if setup is Setup.EYE_IN_HAND else np.linalg.inv(perfect.A)
    rows = tuple(
        Station(f"{i:02d}", robot[i], camera_T_target=UncertainPose(perfect.B[i]))
        for i in range(len(robot))
    )
    return Stations(setup, rows, noise=noise)


def promise(answer: Calibration, change: str) -> Improvement:
    found = [each for each in answer.improvements if each.change == change]
    assert found, f"no {change} among {[each.change for each in answer.improvements]}"
    return found[0]


def assert_kept(
    promised: Improvement,
    changed: Stations,
    tolerance: float = SAME,
    method: str = solvers.DEFAULT,
) -> None:
    error = calibrated(changed, method).predicted_error
    assert promised.rotation == pytest.approx(error.rotation, rel=tolerance)
    assert promised.translation == pytest.approx(error.translation, rel=tolerance)


@pytest.mark.parametrize("setup", Setup)
def test_half_the_distance_is_as_good_as_promised(setup):
    rng = np.random.default_rng(3)
    perfect = scene(rng, 7)
    near = perfect.B.copy()
    near[:, :3, 3] /= 2.0
    answer = solve(stations(rng, perfect, CAMERA_LIMITED, setup=setup, given=True))
    promised = promise(answer, "camera-distance")
    assert_kept(promised, without_noise(laid_out(near, perfect), CAMERA_LIMITED, setup))
    assert promised.translation < 0.7 * answer.predicted_error.translation
    assert promised.action == "halving the camera distance (169 to 84 mm)"


def test_half_the_distance_by_monte_carlo():
    """An RMS of 400 trials in three dimensions is known to 1 / sqrt(2 * 3 * 400) = 2 %, or 3.5 %
    when one dimension has it all: 10 % is three sigma."""
    rng = np.random.default_rng(5)
    perfect = scene(rng, 7)
    answer = solve(stations(rng, perfect, CAMERA_LIMITED, given=True))
    promised = promise(answer, "camera-distance")
    near = perfect.B.copy()
    near[:, :3, 3] /= 2.0
    changed = laid_out(near, perfect)
    joint = joint_covariance(7, CAMERA_LIMITED)
    A = disturbed(rng, changed.A, joint[:, :6, :6], 400)
    B = disturbed(rng, changed.B, joint[:, 6:, 6:], 400)
    found = solvers.load("maximum-likelihood").solve(Problem(A, B, star_pairs(7), joint))
    error = se3.difference(found.X, perfect.X)
    assert np.sqrt(np.mean(np.sum(error[:, 3:] ** 2, axis=1))) == pytest.approx(
        promised.rotation, rel=0.1
    )
    assert np.sqrt(np.mean(np.sum(error[:, :3] ** 2, axis=1))) == pytest.approx(
        promised.translation, rel=0.1
    )


@pytest.mark.parametrize(("tilt", "farther"), [(20.0, 30.0), (40.0, 52.0)])
def test_a_farther_tilt_is_as_good_as_promised(tilt, farther):
    """1.5 times the tilt of the paper's circle, or 1.3 times where a step more is above 55 deg."""
    rng = np.random.default_rng(7)
    perfect = scene(rng, 7, tilt_deg=tilt)
    tilted = np.linalg.inv(generate_stations(7, PAPER_DISTANCE, np.radians(farther)))
    promised = promise(solve(stations(rng, perfect, ALIKE, given=True)), "tilt")
    assert_kept(promised, without_noise(laid_out(tilted, perfect), ALIKE))
    angles = [
        np.degrees(rotations.angle(np.linalg.inv(B[0, :3, :3]) @ B[3, :3, :3]))
        for B in (perfect.B, tilted)
    ]
    assert f"({angles[0]:.0f} to {angles[1]:.0f} deg" in promised.action


def test_the_papers_circle_is_as_good_as_promised():
    """Stations whose axes nearly agree, all from one side and rolled, become the generator's."""
    rng = np.random.default_rng(11)
    perfect = scene(rng, 8)
    sideways = rotations.exp(np.radians(np.linspace(-20, 20, 8))[:, None] * [1.0, 0.1, 0.0])
    about = rotations.exp(np.radians(3.0) * rng.normal(size=(8, 3)))
    away = np.tile([0.0, 0.0, 0.4], (8, 1))
    poor = laid_out(se3.from_parts(about @ sideways, away), perfect)
    # This layout leaves the answer so poor that little noise is needed to compare predictions.
    quiet = Noise(*(0.1 * np.array([5e-4, 1e-4, 1e-3, 1e-4])).tolist())
    promised = promise(solve(stations(rng, poor, quiet, given=True)), "circle")
    good = laid_out(np.linalg.inv(generate_stations(8, 0.4, np.radians(30.0))), perfect)
    assert_kept(promised, without_noise(good, quiet))
    assert promised.action == "8 stations by 'handeye plan': 400 mm, tilt 30 deg"
    command = "'handeye plan --stations 8 --distance 400mm --tilt 30deg --setup eye-in-hand'"
    assert promised.message.startswith(f"{command} would take the rotation from ")


@pytest.mark.parametrize("setup", Setup)
def test_as_many_again_are_as_good_as_promised(setup):
    rng = np.random.default_rng(13)
    perfect = general_scene(rng, 6)
    promised = promise(
        solve(stations(rng, perfect, ALIKE, setup=setup, given=True)), "more-stations"
    )
    twice = laid_out(np.concatenate([perfect.B, perfect.B]), perfect)
    assert_kept(promised, without_noise(twice, ALIKE, setup))


@pytest.mark.parametrize("setup", Setup)
@pytest.mark.parametrize(
    ("noise", "change", "who"),
    [(ROBOT_LIMITED, "robot-noise", "robot"), (CAMERA_LIMITED, "camera-noise", "camera")],
)
def test_less_noise_is_as_good_as_promised(noise, change, who, setup):
    rng = np.random.default_rng(19)
    perfect = general_scene(rng, 8)
    levels = {
        name: value / 2.0 if name.startswith(who) else value
        for name, value in vars(noise).items()
        if value is not None
    }
    answer = solve(stations(rng, perfect, noise, setup=setup, given=True))
    assert_kept(promise(answer, change), without_noise(perfect, Noise(**levels), setup))
    assert answer.improvements[0].change == change
    assert {"robot-noise", "camera-noise"} - {each.change for each in answer.improvements}


def test_a_closed_form_is_promised_its_own_error():
    rng = np.random.default_rng(19)
    perfect = scene(rng, 7)
    near = perfect.B.copy()
    near[:, :3, 3] /= 2.0
    document = stations(rng, perfect, CAMERA_LIMITED, given=True)
    promised = promise(solve(document, method="tsai-lenz"), "camera-distance")
    changed = without_noise(laid_out(near, perfect), CAMERA_LIMITED)
    assert_kept(promised, changed, method="tsai-lenz")


PLATE = targets.parse("disc-grid:9x6:20mm:10mm")
CAMERA = Camera(640, 480, 600.0, 600.0, 320.0, 240.0, (-0.1, 0.02, 1e-3, 0.0, 0.0))
PIXELS = Noise(robot_rotation=2e-4, robot_translation=2e-5, pixel=0.5)
CENTRE = np.array([0.08, 0.05, 0.0])
"""Of 9 x 6 points, 20 mm apart."""


def seen_by_opencv(B: np.ndarray) -> np.ndarray:
    matrix = np.array([[CAMERA.fx, 0, CAMERA.cx], [0, CAMERA.fy, CAMERA.cy], [0, 0, 1]])
    points = targets.build(PLATE).points()
    return np.array(
        [
            cv2.projectPoints(
                points, cv2.Rodrigues(b[:3, :3])[0], b[:3, 3], matrix, np.array(CAMERA.distortion)
            )[0][:, 0]
            for b in B
        ]
    )


def with_pixels(
    perfect: Scene,
    noise: Noise = PIXELS,
    *,
    camera: Camera = CAMERA,
    calibrate_intrinsics: bool = False,
) -> Stations:
    rows = tuple(
        Station(f"{i:02d}", perfect.A[i], Observation(np.arange(len(seen)), seen))
        for i, seen in enumerate(seen_by_opencv(perfect.B))
    )
    features = Features(Setup.EYE_IN_HAND, rows, PLATE, camera, (640, 480), noise)
    return extrinsics(features, calibrate_intrinsics=calibrate_intrinsics)


def about_the_plate(distance: float, tilt_deg: float = 25.0) -> Scene:
    cameras = generate_stations(7, distance, np.radians(tilt_deg), CENTRE)
    return laid_out(np.linalg.inv(cameras), scene(np.random.default_rng(23), 7))


def inside(B: np.ndarray) -> np.ndarray:
    pixels = seen_by_opencv(B)
    return np.all((pixels >= 0) & (pixels <= [639, 479]), axis=(1, 2))


def test_with_pixels_the_cameras_noise_is_that_of_the_new_distance():
    far, half = about_the_plate(0.8), about_the_plate(0.4)
    assert inside(half.B).all()
    promised = promise(solve(with_pixels(far)), "camera-distance")
    assert promised.action == "halving the camera distance (800 to 400 mm)"
    assert_kept(promised, with_pixels(half))


def test_with_pixels_a_farther_tilt_sees_the_plate_anew():
    promised = promise(solve(with_pixels(about_the_plate(0.8, 20.0))), "tilt")
    assert_kept(promised, with_pixels(about_the_plate(0.8, 30.0)))


def test_given_levels_of_the_camera_are_kept_though_there_are_pixels():
    far, half = about_the_plate(0.8), about_the_plate(0.4)
    given = replace(PIXELS, camera_rotation=2e-3, camera_translation=1e-4)
    promised = promise(solve(with_pixels(far, given)), "camera-distance")
    assert_kept(promised, with_pixels(half, given))


def test_better_intrinsics_are_as_good_as_promised():
    """By a closed form, which does not improve the given intrinsics by its stations."""
    perfect = about_the_plate(0.4)
    deviations = np.array([2.0, 2.0, 1.0, 1.0, 1e-3, 1e-3, 1e-4, 1e-4, 1e-4])
    uncertain, better = (
        replace(CAMERA, covariance=np.diag(deviations / part) ** 2) for part in (1.0, 2.0)
    )
    answer = solve(with_pixels(perfect, camera=uncertain), method="tsai-lenz")
    promised = promise(answer, "intrinsics")
    assert_kept(promised, with_pixels(perfect, camera=better), method="tsai-lenz")


def test_more_stations_also_help_intrinsics_from_the_same_images():
    rng = np.random.default_rng(53)
    like = about_the_plate(0.3, 20.0)
    turned = rotations.exp(0.3 * rng.normal(size=(14, 3)))
    R = np.concatenate([like.B[:, :3, :3]] * 2) @ turned
    aim = np.array([0.0, 0.0, 0.4]) + 0.03 * rng.normal(size=(14, 3))
    perfect = laid_out(se3.from_parts(R, aim - R @ CENTRE), like)
    twice = laid_out(np.concatenate([perfect.B, perfect.B]), perfect)
    quiet = Noise(robot_rotation=5e-4, robot_translation=5e-5, pixel=0.2)
    answer = solve(with_pixels(perfect, quiet, calibrate_intrinsics=True))
    promised = promise(answer, "more-stations")
    assert_kept(promised, with_pixels(twice, quiet, calibrate_intrinsics=True), 0.03)
    ratio = promised.translation / answer.predicted_error.translation
    assert ratio == pytest.approx(np.sqrt(0.5), rel=1e-6)
    assert answer.factors.robot_share_translation < 0.9


def test_the_camera_goes_no_nearer_than_the_view_allows():
    perfect = about_the_plate(0.28, 20.0)
    document = with_pixels(perfect)
    sight = sight_of(document, chain_of(document))
    moved = nearer(perfect.B, CENTRE, sight)
    before, after = (
        np.linalg.norm(B[:, :3, :3] @ CENTRE + B[:, :3, 3], axis=1) for B in (perfect.B, moved)
    )
    assert np.all(after < before)
    assert np.all(after > 0.5 * before + 1e-9)
    assert inside(moved).all()
    one_more = moved.copy()
    one_more[:, :3, 3] -= (
        0.05 * (before / after * (moved[:, :3, :3] @ CENTRE + moved[:, :3, 3]).T).T
    )
    assert not sight.in_view(one_more).any()


@pytest.mark.parametrize("ids", [[0, 1, 2, 3], [0, 1, 9, 54]])
def test_points_that_fix_no_pose_are_not_looked_through(ids):
    """Four on one line, or one that the target does not have."""
    document = with_pixels(about_the_plate(0.4))
    seen = replace(document.stations[2].observation, ids=np.array(ids), pixels=np.ones((4, 2)))
    rows = list(document.stations)
    rows[2] = replace(rows[2], observation=seen)
    assert sight_of(document, chain_of(document)) is not None
    assert sight_of(replace(document, stations=tuple(rows)), chain_of(document)) is None


def test_no_advice_leads_out_of_view():
    """A plate that fills the image leaves neither room for the circle nor for going nearer."""
    perfect = about_the_plate(0.25, 10.0)
    document = with_pixels(perfect)
    sight = sight_of(document, chain_of(document))
    for B in (nearer(perfect.B, CENTRE, sight), more_tilted(perfect.B, CENTRE, sight)):
        assert inside(B).all()
    assert circle(perfect.B, CENTRE, 0.15, 0.5, sight.of_whole_target()) is None


def test_tilting_stops_at_55_degrees_and_keeps_the_aim():
    perfect = general_scene(np.random.default_rng(29), 40)
    centre = np.array([0.1, -0.05, 0.0])
    turned = more_tilted(perfect.B, centre, None)
    aim = [B[:, :3, :3] @ centre + B[:, :3, 3] for B in (perfect.B, turned)]
    np.testing.assert_allclose(aim[1], aim[0], atol=1e-12)
    cosines = [
        np.abs(np.sum(a * B[:, :3, 2], axis=1)) / np.linalg.norm(a, axis=1)
        for a, B in zip(aim, (perfect.B, turned), strict=True)
    ]
    tilts = np.degrees(np.arccos(cosines))
    assert np.all((tilts[1] <= 55.0 + 1e-9) | np.isclose(tilts[1], tilts[0]))
    assert np.mean(tilts[1]) > np.mean(tilts[0])


@pytest.mark.parametrize("behind", [False, True])
def test_the_circle_keeps_side_and_roll(behind):
    roll = se3.from_parts(rotations.exp(np.array([0.0, 0.0, 1.1])), np.zeros(3))
    side = np.diag([1.0, -1.0, -1.0, 1.0]) if behind else np.eye(4)
    cameras = side @ generate_stations(9, 0.3, 0.5) @ roll
    laid = np.linalg.inv(circle(np.linalg.inv(cameras), np.zeros(3), 0.3, 0.5, None))
    np.testing.assert_allclose(laid, cameras, atol=1e-12)


def test_the_paper_layout_has_the_factors_that_the_generator_put_in():
    """51.8 deg for three stations tilted by 30, section 6 of the contract; |T_c| = 6.65 in."""
    perfect = scene(np.random.default_rng(31), 3)
    found = solve(without_noise(perfect, ALIKE)).factors
    turns = [np.degrees(a) for a in vars(found.interstation_angle).values()]
    assert turns == pytest.approx([51.8] * 3, abs=0.05)
    assert list(vars(found.camera_distance).values()) == pytest.approx([PAPER_DISTANCE] * 3)
    ways = [np.linalg.norm(perfect.A[i, :3, 3] - perfect.A[j, :3, 3]) for i, j in star_pairs(3)]
    expected = [np.median(ways), min(ways), max(ways)]
    assert list(vars(found.gripper_distance).values()) == pytest.approx(expected)
    # The circle's axes lie at 60 degrees for small tilts; a tilt lifts them out of their plane.
    assert np.degrees(found.axes_angle.median) == pytest.approx(60.0, abs=8.0)
    flat = solve(
        without_noise(scene(np.random.default_rng(31), 3, tilt_deg=2.0), Noise(*4 * (1e-6,)))
    )
    assert np.degrees(flat.factors.axes_angle.median) == pytest.approx(60.0, abs=0.1)
    assert found.stations == 3


def test_gripper_distances_are_the_robots_for_a_fixed_camera_too():
    rng = np.random.default_rng(37)
    document = without_noise(general_scene(rng, 6), ALIKE, Setup.EYE_TO_HAND)
    at = np.array([station.base_T_gripper[:3, 3] for station in document.stations])
    ways = [np.linalg.norm(at[i] - at[j]) for i, j in star_pairs(6)]
    assert solve(document).factors.gripper_distance.largest == pytest.approx(max(ways))


def test_shares_add_what_each_noise_does_alone():
    perfect = general_scene(np.random.default_rng(41), 9)
    robot_only = solve(without_noise(perfect, Noise(1e-3, 2e-4, 1e-9, 1e-9))).factors
    camera_only = solve(without_noise(perfect, Noise(1e-9, 1e-9, 1e-3, 2e-4))).factors
    assert robot_only.robot_share_rotation > 0.999
    assert camera_only.robot_share_translation < 0.001


def test_camera_noise_that_is_unknown_has_neither_share_nor_advice():
    rng = np.random.default_rng(43)
    document = stations(rng, scene(rng, 9), ALIKE, with_covariance=False)
    answer = solve(document)
    assert answer.factors.robot_share_rotation is None
    changes = {each.change: each.action for each in answer.improvements}
    assert "camera-noise" not in changes
    assert "noise of robot and camera" in changes["robot-noise"]


@pytest.mark.parametrize("seed", range(5))
def test_advice_is_worth_it_ordered_and_short(seed):
    rng = np.random.default_rng(seed)
    answer = solve(stations(rng, general_scene(rng, 10), ALIKE))
    now = answer.predicted_error
    ratios = np.array(
        [
            [each.rotation / now.rotation, each.translation / now.translation]
            for each in answer.improvements
        ]
    )
    gains = 1.0 - ratios.min(axis=1)
    assert 1 <= len(ratios) <= 4
    assert np.all(gains >= 0.1)
    assert np.all(np.diff(gains) <= 0)
    assert np.all(ratios <= 1.01)
    for each in answer.improvements:
        assert (
            f"from {1e3 * now.translation:.3g} to {1e3 * each.translation:.3g} mm" in each.message
        )
        assert each.message.startswith(each.action)


def advised(document, larger, lasting=(0.0, 0.0)):
    """The advice on a document whose predicted error, for other reasons, is larger than its own."""
    chain, pairs = chain_of(document), star_pairs(len(document.stations))
    _, solution, model = estimate(chain, pairs, document, "maximum-likelihood")
    error = solve(document).predicted_error
    factors, improvements = advice.advise(
        document,
        chain,
        pairs,
        method="maximum-likelihood",
        solution=solution,
        model=model,
        error=replace(
            error, rotation=larger * error.rotation, translation=larger * error.translation
        ),
        lasting=np.array(lasting) * [error.rotation**2, error.translation**2],
    )
    more = next(each for each in improvements if each.change == "more-stations")
    return error, factors, more


def test_what_all_stations_share_is_not_promised_away():
    """Of an error 1.2 times that of the loop's noise the rest, 0.44 in squares, stays."""
    document = without_noise(scene(np.random.default_rng(47), 7), ALIKE)
    error, factors, more = advised(document, 1.2)
    alone = solve(document).factors.robot_share_rotation
    assert factors.robot_share_rotation == pytest.approx(alone / 1.44, rel=1e-6)
    assert more.rotation == pytest.approx(np.sqrt(0.5 + 0.44) * error.rotation, rel=1e-6)
    assert more.translation == pytest.approx(np.sqrt(0.5 + 0.44) * error.translation, rel=1e-6)


def test_what_lasts_is_left_as_it_is():
    """Of twice the squares of the noise nothing takes the half away that is not noise."""
    document = without_noise(scene(np.random.default_rng(53), 7), ALIKE)
    error, _, more = advised(document, np.sqrt(2.0), lasting=(1.0, 1.0))
    assert more.rotation == pytest.approx(np.sqrt(0.5 + 1.0) * error.rotation, rel=1e-6)
    assert more.translation == pytest.approx(np.sqrt(0.5 + 1.0) * error.translation, rel=1e-6)


def test_what_no_step_changes_is_told_where_it_dominates():
    """Levels of a third explain a ninth of the squares; the rest is put down to no noise."""
    rng = np.random.default_rng(31)
    rows = stations(rng, scene(rng, 12), ALIKE, with_covariance=False)
    levels = (None if level is None else level / 3.0 for level in vars(ALIKE).values())
    told = replace(rows, noise=Noise(*levels))
    answer = solve(told)
    assert "noise-understated" in [each.code for each in answer.diagnosis]
    first, *others = answer.improvements
    used = [row for row, seen in zip(told.stations, answer.stations, strict=True) if seen.used]
    left = calibrated(replace(told, stations=tuple(used))).predicted_error
    error = answer.predicted_error
    assert first.change == "lasting"
    assert first.rotation == pytest.approx(left.rotation)
    assert first.translation == pytest.approx(left.translation)
    share = 100.0 * (1.0 - (left.rotation / error.rotation) ** 2)
    assert share > 80.0
    assert first.message.startswith(f"{share:.0f} % of the mean square error in rotation")
    assert all(each.change != "lasting" for each in others)


def test_where_all_is_noise_no_such_thing_is_told():
    rng = np.random.default_rng(31)
    answer = solve(stations(rng, scene(rng, 12), ALIKE, given=True))
    assert answer.improvements
    assert all(each.change != "lasting" for each in answer.improvements)

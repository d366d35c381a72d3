"""The verdict on conventions: classic mistakes, good data, what cannot be told, real recordings."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
import real_recordings
from diagnosis import mistakes
from diagnosis.mistakes import (
    driven_circle,
    near_planar,
    one_axis,
    recording,
    robot,
    with_half_turns,
    with_robot,
)
from scenes import disturbed, general_scene, scene

from handeye_cli import documents
from handeye_cli.chain import chain_of
from handeye_cli.conventions import RobotPoses, Setup
from handeye_cli.diagnosis import conventions, hypotheses
from handeye_cli.diagnosis.fits import clear_factor, fit, gains
from handeye_cli.diagnosis.lengths import length_ratio
from handeye_cli.diagnosis.readings import reading_of
from handeye_cli.extrinsics import extrinsics
from handeye_cli.geometry import se3
from handeye_cli.records import Noise, Observation, TargetSpec
from handeye_cli.records.line import WrittenRotation

SCENES = {
    "circle": lambda rng: driven_circle(rng, int(rng.integers(7, 10))),
    "general": lambda rng: general_scene(rng, 12),
    "near-planar": lambda rng: near_planar(rng, 10),
}
MISTAKES = {
    "inverted": (mistakes.inverted, "mounting-or-direction"),
    "mounting": (mistakes.other_mounting, "mounting-or-direction"),
    "quaternions": (mistakes.all_wxyz, "quaternion-order"),
    "robot-quaternions": (mistakes.robot_wxyz, "quaternion-order"),
    "euler": (mistakes.euler, "euler-order"),
    "radians": (mistakes.radians_as_degrees, "radians-as-degrees"),
    "millimetres": (mistakes.in_millimetres, "pose-units"),
    "board": (mistakes.board_too_small, "target-scale"),
    "shifted": (mistakes.shifted, "lists-shifted"),
    # beyond the classic ones
    "inverted-and-quaternions": (mistakes.inverted_wxyz, "quaternion-order-and-direction"),
    "all-millimetres": (mistakes.all_in_millimetres, "pose-units"),
    "lost-picture": (mistakes.lost_picture, "lists-shifted"),
    "left-handed": (mistakes.mirrored, "left-handed-frame"),
    "none": (lambda document: document, None),
}


def judge(document, *, thorough=False):
    return conventions.judge_conventions(document, chain_of(document), thorough=thorough)


def code(verdict):
    assert verdict.contradiction == any(each.severity == "error" for each in verdict.findings)
    return verdict.findings[0].code if verdict.findings else None


def alarms(verdict):
    return [each for each in verdict.findings if each.severity != "info"]


def from_pixels(document):
    """The same document, its target poses computed from pixels."""
    seen = Observation(np.arange(1), np.zeros((1, 2)))
    rows = tuple(replace(station, observation=seen) for station in document.stations)
    return replace(document, stations=rows)


@pytest.mark.parametrize(
    ("mistake", "layout", "setup"),
    [
        (mistake, layout, list(Setup)[(i + k) % 2])  # by turns in either setup
        for i, mistake in enumerate(MISTAKES)
        for k, layout in enumerate(SCENES)
    ],
)
def test_classic_mistakes_are_named(mistake, layout, setup):
    rng = np.random.default_rng(41)
    make, expected = MISTAKES[mistake]
    verdict = judge(make(recording(rng, SCENES[layout](rng), setup=setup)))
    assert code(verdict) == expected
    assert verdict.best.code == (expected or "declared")
    assert verdict.best in verdict.hypotheses
    assert verdict.declared in verdict.hypotheses


@pytest.mark.parametrize("layout", [driven_circle, near_planar])
def test_degrees_within_a_turn_that_are_read_as_radians_are_named(layout):
    """Only of small turns are the numbers within what radians can be; a document has no others."""
    rng = np.random.default_rng(5)
    perfect = layout(rng, 10, tilt_deg=4.0)
    start = se3.inverse(perfect.A[0])  # the frame of the base is where the gripper starts
    perfect = replace(perfect, A=start @ perfect.A, Z=start @ perfect.Z)
    document = mistakes.degrees_as_radians(recording(rng, perfect))
    assert np.max(np.abs([each.written.euler for each in document.stations])) > 3.0
    assert code(judge(document)) == "degrees-as-radians"


def test_the_numbers_say_how_much_better_the_other_reading_fits():
    rng = np.random.default_rng(7)
    document = mistakes.inverted(recording(rng, with_half_turns(rng, 16)))
    verdict = judge(document)
    before, after = np.degrees([verdict.declared.rotation, verdict.best.rotation])
    # the residual of a loop is the noise of both its poses, less what the fit takes up
    assert 0.5 * np.hypot(1e-3, 1e-3) < verdict.best.rotation < 1.2 * np.hypot(1e-3, 1e-3)
    assert verdict.declared.rotation > 50.0 * verdict.best.rotation
    message = verdict.findings[0].message
    assert f"turned by {before:.3g} deg as declared, {after:.2g} deg if the robot poses" in message


@pytest.mark.parametrize("setup", Setup)
def test_direction_and_mounting_cannot_be_told_apart_and_both_are_named(setup):
    other = Setup.EYE_TO_HAND if setup is Setup.EYE_IN_HAND else Setup.EYE_IN_HAND
    rng = np.random.default_rng(9)
    document = mistakes.inverted(recording(rng, general_scene(rng, 8), setup=setup))
    poses_only, seen = judge(document), judge(from_pixels(document))
    flags = f"--robot-poses base-in-gripper or --setup {other}"
    assert poses_only.best.flag == seen.best.flag == flags
    for verdict in (poses_only, seen):
        assert flags in verdict.findings[0].advice
        assert "no data can tell these apart" in verdict.findings[0].advice
    assert "target_T_camera" in poses_only.best.description
    assert "target_T_camera" not in seen.best.description


def test_target_poses_the_other_way_round_are_the_same_equations():
    rng = np.random.default_rng(11)
    document = recording(rng, general_scene(rng, 8))
    found = judge(mistakes.with_camera(document, se3.inverse(mistakes.camera(document))))
    assert code(found) == "mounting-or-direction"


def test_the_flag_is_the_other_one_where_a_convention_was_declared_already():
    rng = np.random.default_rng(13)
    document = from_pixels(recording(rng, general_scene(rng, 8)))
    declared = WrittenRotation(RobotPoses.BASE_IN_GRIPPER)
    wrong = with_robot(document, se3.inverse(robot(document)), [declared] * 8)
    assert judge(wrong).best.flag.startswith("--robot-poses gripper-in-base or ")


def test_quaternions_are_mended_by_a_flag_where_it_governs_them_alone():
    rng = np.random.default_rng(15)
    document = recording(rng, general_scene(rng, 8))
    assert judge(mistakes.all_wxyz(document)).best.flag == "--quaternion-order wxyz"
    assert judge(mistakes.robot_wxyz(document)).best.flag == ""
    seen = judge(from_pixels(mistakes.robot_wxyz(document)))
    assert seen.best.flag == "--quaternion-order wxyz"
    both = judge(from_pixels(mistakes.inverted_wxyz(document)))
    assert both.best.flag == "--quaternion-order wxyz --robot-poses base-in-gripper"


def test_orders_of_euler_angles_with_the_same_numbers_are_named_together():
    """With the third angle zero, what it turns about does not matter."""
    rng = np.random.default_rng(17)
    document = recording(rng, general_scene(rng, 10), Noise(1e-4, 1e-5, 1e-4, 1e-5))
    numbers = np.concatenate([rng.uniform(-1.0, 1.0, (10, 2)), np.zeros((10, 1))], axis=1)
    true = mistakes.Rotation.from_euler("XYZ", numbers).as_matrix()
    B = mistakes.camera(document)
    base = scene(rng, 3)
    A = se3.from_parts(true, (base.Z @ se3.inverse(B) @ se3.inverse(base.X))[:, :3, 3])
    said = [WrittenRotation(euler=tuple(each), order="YXZ") for each in numbers]
    wrong = mistakes.Rotation.from_euler("YXZ", numbers).as_matrix()
    document = with_robot(document, se3.from_parts(wrong, A[:, :3, 3]), said)
    camera = se3.inverse(A @ base.X) @ base.Z
    verdict = judge(mistakes.with_camera(document, camera))
    assert code(verdict) == "euler-order"
    assert "order XYZ or XYX" in verdict.best.description
    assert "write order: XYZ" in verdict.findings[0].advice


def test_units_and_direction_are_found_together():
    rng = np.random.default_rng(19)
    document = mistakes.inverted(mistakes.in_millimetres(recording(rng, general_scene(rng, 10))))
    verdict = judge(from_pixels(document))
    assert [each.code for each in verdict.findings] == ["mounting-or-direction", "pose-units"]
    assert "--pose-units mm" in verdict.findings[1].advice
    assert verdict.scale.ratio == pytest.approx(1000.0, rel=0.01)


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (1e3, "robot's translations are in millimetres"),
        (1e-3, "in metres and not in millimetres"),
        (1e2, "in centimetres"),
        (1 / 0.0254, "in inches"),
        (1 / 0.3048, "in feet"),
        (25.4, "target's lengths are in inches and not in millimetres"),
        (10.0, "target's lengths are in centimetres and not in millimetres"),
    ],
)
def test_units_are_named(factor, words):
    rng = np.random.default_rng(21)
    document = from_pixels(mistakes.robot_in(recording(rng, general_scene(rng, 8)), factor))
    verdict = judge(document)
    assert code(verdict) == "pose-units"
    assert words in verdict.best.description
    assert verdict.scale.ratio == pytest.approx(factor, rel=0.02)
    flags = {1e3: "--pose-units mm", 1e-3: "--pose-units m"}
    assert verdict.best.flag == flags.get(factor, "")


def test_the_ratio_of_lengths_is_right_within_its_sigma():
    rng = np.random.default_rng(23)
    pulls = []
    for _ in range(60):
        document = mistakes.robot_in(recording(rng, general_scene(rng, 12)), 1.25)
        reading = reading_of(document, chain_of(document), 12)
        scale = length_ratio(fit([hypotheses.declared(reading)])[0])
        pulls.append(np.log(scale.ratio / 1.25) / scale.sigma)
    # the stations that agree best agree a little too well
    assert 0.7 < np.sqrt(np.mean(np.square(pulls))) < 2.0


def test_the_size_of_the_target_is_told_with_the_round_sizes_near_it():
    rng = np.random.default_rng(25)
    document = mistakes.board_too_small(recording(rng, general_scene(rng, 10)))
    target = TargetSpec("disc-grid", {"rows": 6, "columns": 6, "spacing_mm": 20.0})
    message = judge(replace(document, target=target)).findings[0].message
    assert "the target's spacing is 2" in message
    assert "and not 20 mm" in message
    assert "25 mm and 25.4 mm (1 in)" in message


@pytest.mark.parametrize("places", [1, -1, 3])
def test_a_shift_tells_its_places(places):
    rng = np.random.default_rng(27)
    document = recording(rng, general_scene(rng, 12))
    rows = np.arange(12) - places
    wrong = with_robot(document, robot(document)[rows % 12])
    words = f"{'one place' if abs(places) == 1 else f'{places} places'} "
    assert words + ("later" if places > 0 else "earlier") in judge(wrong).best.description


@pytest.mark.parametrize("at", [3, 6])
def test_a_lost_picture_is_told_with_its_station(at):
    rng = np.random.default_rng(29)
    document = mistakes.lost_picture(recording(rng, general_scene(rng, 14)), at)
    verdict = judge(document)
    assert f"from station {at:02d} on" in verdict.best.description
    assert "one place later" in verdict.best.description


def test_a_reversed_list_and_a_shuffled_one_are_sorted_out():
    rng = np.random.default_rng(31)
    document = recording(rng, general_scene(rng, 12))
    assert code(judge(with_robot(document, robot(document)[::-1]))) == "lists-reversed"
    order = rng.permutation(12)
    found = judge(with_robot(document, robot(document)[order]))
    first = next(k for k in range(12) if order[k] != k)
    assert code(found) == "lists-shuffled"
    assert f"{first:02d} to {int(np.argsort(order)[first]):02d}" in found.findings[0].message
    assert found.best.rotation < 3e-3


def test_lists_that_do_not_belong_together_are_refused():
    rng = np.random.default_rng(33)
    document = recording(rng, general_scene(rng, 12))
    other = recording(rng, general_scene(rng, 12))
    verdict = judge(with_robot(document, robot(other)))
    assert code(verdict) == "lists-shuffled"
    assert "does not turn by the same angles" in verdict.findings[0].message
    assert verdict.best is verdict.declared
    loose = robot(document)
    loose[:, :3, 3] += 0.5 * rng.normal(size=(12, 3))
    assert code(judge(with_robot(document, loose))) == "no-convention-fits"


def noise_up_to_ten_milliradians(rng):
    levels = 10.0 ** rng.uniform(-3.0, 0.0, 4)
    return Noise(*(levels * [1e-2, 5e-3, 1e-2, 5e-3]).tolist())


LAYOUTS = (scene, driven_circle, general_scene, near_planar, with_half_turns, one_axis)


@pytest.mark.many_runs
@pytest.mark.parametrize("part", range(4))
def test_good_recordings_raise_no_alarm(part):
    rng = np.random.default_rng([51, part])
    for trial in range(50):
        perfect = LAYOUTS[trial % len(LAYOUTS)](rng, int(rng.integers(5, 21)))
        setup = list(Setup)[int(rng.integers(2))]
        document = recording(rng, perfect, noise_up_to_ten_milliradians(rng), setup)
        if trial % 5 == 0:
            document = mistakes.euler(document, "xyz", "xyz")
        assert alarms(judge(document)) == []


@pytest.mark.parametrize("bad", [1, 2])
def test_bad_stations_raise_no_alarm_and_hide_no_mistake(bad):
    rng = np.random.default_rng([53, bad])
    for trial in range(15):
        document = recording(rng, LAYOUTS[trial % 4](rng, 8))
        poses = robot(document)
        poses[:bad] = disturbed(rng, poses[:bad], np.tile(0.1 * np.eye(6), (bad, 1, 1)))
        document = with_robot(document, poses)
        assert alarms(judge(document)) == []
        if LAYOUTS[trial % 4] is general_scene:
            assert code(judge(mistakes.inverted(document))) == "mounting-or-direction"


@pytest.mark.parametrize("count", [3, 4, 5, 8, 12])
def test_chance_stays_below_the_factor_that_counts_and_mistakes_go_beyond_it(count):
    """The thresholds: gains of wrong readings of good data, and of the right one of wrong data."""
    rng = np.random.default_rng([55, count])
    by_chance, by_mistake = [], []
    for trial in range(10):
        perfect = (general_scene, scene)[trial % 2](rng, count)
        document = recording(rng, perfect, noise_up_to_ten_milliradians(rng))
        reading = reading_of(document, chain_of(document), count)
        rows = [hypotheses.declared(reading), *hypotheses.conventions(reading)]
        declared, *others = fit(rows)
        shares = [max(gains(each, declared)) / clear_factor(each, declared) for each in others]
        fitting = [k for k, each in enumerate(others) if each.like_noise]
        by_chance.append(max((shares[k] for k in fitting), default=0.0))
        document = mistakes.inverted(recording(rng, general_scene(rng, count)))
        reading = reading_of(document, chain_of(document), count)
        declared, right, *_ = fit([hypotheses.declared(reading), *hypotheses.conventions(reading)])
        by_mistake.append(max(gains(right, declared)) / clear_factor(right, declared))
    assert max(by_chance) < 0.8
    if count >= 8:
        assert min(by_mistake) > 2.0


def test_three_stations_fit_either_direction_and_nothing_is_said():
    """Two screws and their inverses differ by a half turn about their common perpendicular."""
    rng = np.random.default_rng(57)
    document = recording(rng, general_scene(rng, 3), Noise(1e-9, 1e-9, 1e-9, 1e-9))
    assert judge(mistakes.inverted(document)).findings == ()
    found = judge(document, thorough=True)
    assert code(found) == "conventions-not-told-apart"
    assert not found.contradiction
    assert "base-in-gripper" in found.findings[0].message


@pytest.mark.parametrize("make", [mistakes.inverted, mistakes.shifted, mistakes.board_too_small])
def test_the_perfect_circle_tells_only_that_it_does_not_check_lengths(make):
    rng = np.random.default_rng(59)
    verdict = judge(make(recording(rng, scene(rng, 8))))
    assert [each.code for each in verdict.findings] == ["lengths-not-checked"]
    assert verdict.scale.sigma == np.inf


@pytest.mark.parametrize("mistake", MISTAKES)
def test_rotations_about_one_axis_say_nothing(mistake):
    rng = np.random.default_rng(61)
    make, _ = MISTAKES[mistake]
    assert judge(make(recording(rng, one_axis(rng, 9)))).findings == ()


def test_a_good_fit_is_not_compared_with_others_unless_asked():
    rng = np.random.default_rng(63)
    document = recording(rng, general_scene(rng, 10))
    assert [each.code for each in judge(document).hypotheses] == ["declared"]
    verdict = judge(document, thorough=True)
    codes = [each.code for each in verdict.hypotheses]
    assert verdict.best is verdict.declared is verdict.hypotheses[0]
    assert {"mounting-or-direction", "quaternion-order", "lists-shifted"} < set(codes)
    assert len(codes) == len(set(codes))
    assert verdict.findings == ()


def test_many_stations_take_no_longer_than_some():
    rng = np.random.default_rng(65)
    document = mistakes.robot_wxyz(recording(rng, general_scene(rng, 3000)))
    reading = reading_of(document, chain_of(document), 60)
    assert len(reading.index) == 60
    assert (reading.index[0], reading.index[-1]) == (0, 2999)
    assert code(judge(document)) == "quaternion-order"


def test_stations_without_a_target_keep_their_place_in_the_lists():
    rng = np.random.default_rng(67)
    document = recording(rng, general_scene(rng, 14))
    wrong = with_robot(document, robot(document)[(np.arange(14) - 2) % 14])
    rows = [
        replace(station, camera_T_target=None, reason="not found") if k in (3, 8) else station
        for k, station in enumerate(wrong.stations)
    ]
    verdict = judge(replace(wrong, stations=tuple(rows)))
    assert "2 places later" in verdict.best.description


def test_a_pipe_knows_what_one_command_knows():
    rng = np.random.default_rng(69)
    document = mistakes.euler(from_pixels(recording(rng, general_scene(rng, 8))))
    piped = documents.read("-", stdin=io.BytesIO(documents.dump(document, "json").encode()))
    assert code(judge(piped)) == "euler-order"
    assert judge(piped).findings == judge(document).findings


@real_recordings.ONE_PROCESS
@pytest.mark.parametrize("name", ["rct-10x10", "rct-charuco"])
def test_real_recordings_raise_no_alarm_and_their_mistakes_are_named(name):
    document = extrinsics(real_recordings.features(name))
    verdict = judge(document, thorough=True)
    assert verdict.findings == ()
    assert verdict.scale.ratio == pytest.approx(1.0, abs=0.03)
    for mistake in ("inverted", "mounting", "robot-quaternions", "euler", "millimetres", "shifted"):
        make, expected = MISTAKES[mistake]
        assert code(judge(make(document))) == expected, mistake


@real_recordings.ONE_PROCESS
def test_a_real_plate_with_the_spacing_of_its_print_is_found_too_small():
    printed = {"rows": 10, "columns": 10, "spacing_mm": 20, "diameter_mm": 10}
    target = TargetSpec("disc-grid", printed | {"corner_diameter_mm": 20})
    seen = replace(real_recordings.features("rct-10x10"), target=target)
    verdict = judge(extrinsics(seen))
    assert code(verdict) == "target-scale"
    assert verdict.contradiction
    assert 1.23 < verdict.scale.ratio < 1.28
    assert "25.4 mm (1 in)" in verdict.findings[0].message
    assert verdict.best.flag == "--target"

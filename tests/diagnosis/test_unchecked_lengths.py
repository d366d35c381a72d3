"""Whether the stations check the size of the target, and the number that is told of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.mistakes import (
    board_too_small,
    camera,
    driven_circle,
    near_planar,
    of_cameras,
    recording,
    scaled,
    with_camera,
)
from scenes import disturbed, general_scene, joint_covariance, scene

from handeye_cli.chain import chain_of
from handeye_cli.diagnosis import hypotheses
from handeye_cli.diagnosis.conventions import judge_conventions
from handeye_cli.diagnosis.fits import fit
from handeye_cli.diagnosis.lengths import LENGTHS_NOT_CHECKED, length_ratio
from handeye_cli.diagnosis.readings import reading_of
from handeye_cli.geometry import se3
from handeye_cli.geometry.station_generator import generate_stations
from handeye_cli.records import Noise, TargetSpec
from handeye_cli.solve import solve

LOUD = Noise(5e-3, 2e-3, 2e-3, 1e-3)


def notes(document):
    found = judge_conventions(document, chain_of(document)).findings
    return [each for each in found if each.code == LENGTHS_NOT_CHECKED]


def resized(document, factor):
    return with_camera(document, scaled(camera(document), 1.0 / factor))


@pytest.mark.parametrize("noise", [Noise(1e-3, 2e-4, 1e-3, 1e-4), LOUD], ids=["quiet", "loud"])
@pytest.mark.parametrize("layout", [general_scene, driven_circle, near_planar])
def test_sigma_of_the_ratio_is_the_scatter_over_many_recordings(layout, noise):
    """The worst stations take no part, so the scatter is larger, but never by the factor of 8."""
    rng = np.random.default_rng(3)
    perfect, joint = layout(rng, 12), joint_covariance(12, noise)
    document = recording(rng, perfect, noise)
    declared = hypotheses.declared(reading_of(document, chain_of(document), 12))
    robots = disturbed(rng, perfect.A, joint[:, :6, :6], 60)
    cameras = disturbed(rng, perfect.B, joint[:, 6:, 6:], 60)
    fits = fit([replace(declared, A=A, B=B) for A, B in zip(robots, cameras, strict=True)])
    scales = [length_ratio(each) for each in fits]
    pulls = [np.log(each.ratio) / each.sigma for each in scales]
    assert 0.6 < np.sqrt(np.mean(np.square(pulls))) < 2.5


@pytest.mark.parametrize("factor", [0.8, 1.0, 1.6])
def test_on_the_perfect_circle_any_size_fits_and_it_is_said(factor):
    rng = np.random.default_rng(5)
    document = resized(recording(rng, scene(rng, 9)), factor)
    (note,) = notes(document)
    assert note.severity == "info"
    assert note.message.startswith("the stations do not check the size of the target behind")
    assert "any would fit" in note.message
    assert "a second 'handeye plan' with another --distance" in note.advice


def test_a_per_cent_of_the_size_moves_the_answer_as_told():
    rng = np.random.default_rng(7)
    document = recording(rng, scene(rng, 9))
    spec = TargetSpec("chessboard", {"columns": 9, "rows": 6, "square_mm": 5.0})
    (note,) = notes(replace(document, target=spec))
    assert note.message.startswith("the stations do not check the target's size against")
    told = float(note.message.split("moves gripper_T_camera by ")[1].split()[0])
    before, after = (solve(each).mount_T_camera.matrix for each in (document, resized(document, 2)))
    change = 1e3 * np.linalg.norm(se3.difference(after, before)[:3])
    # twice the size is 50 per cent of error of the poses as they are
    assert change / 50.0 == pytest.approx(told, rel=0.05)
    assert note in solve(replace(document, target=spec)).diagnosis


@pytest.mark.parametrize("noise", [Noise(1e-3, 2e-4, 1e-3, 1e-4), LOUD], ids=["quiet", "loud"])
def test_a_second_circle_at_another_distance_checks_it_as_the_advice_says(noise):
    rng = np.random.default_rng(8)
    circles = [generate_stations(n, d, np.radians(30.0)) for n, d in ((7, 0.17), (5, 0.25))]
    document = recording(rng, of_cameras(rng, np.concatenate(circles)), noise)
    assert notes(document) == []
    wrong = resized(document, 1.3)
    assert judge_conventions(wrong, chain_of(wrong)).contradiction


@pytest.mark.parametrize("layout", [general_scene, driven_circle, near_planar])
def test_nothing_is_said_where_the_distances_differ_enough(layout):
    rng = np.random.default_rng(9)
    assert notes(recording(rng, layout(rng, 12))) == []


def test_the_number_told_is_what_the_check_refuses():
    """Errors of the size well below it pass, and well above it do not."""
    rng = np.random.default_rng(11)
    told = []
    while len(told) < 4:
        document = recording(rng, driven_circle(rng, 8), LOUD)
        found = [each.message for each in notes(document) if "only to" in each.message]
        if not found:
            continue
        told.append(float(found[0].split("only to ")[1].split()[0]) / 100.0)
        # the noise moves the ratio itself by an eighth of that, or two
        below, above = (1.0 + told[-1]) ** 0.6, (1.0 + told[-1]) ** 1.5
        for factor, refused in ((below, False), (1 / below, False), (above, True)):
            wrong = resized(document, 1.0 / factor)
            assert judge_conventions(wrong, chain_of(wrong)).contradiction == refused
    assert min(told) > 0.16  # intrinsics explain less, and no check refuses it


def test_a_size_that_is_refused_is_not_called_unchecked():
    rng = np.random.default_rng(13)
    document = board_too_small(recording(rng, driven_circle(rng, 9)))
    codes = [each.code for each in judge_conventions(document, chain_of(document)).findings]
    assert codes == ["target-scale"]

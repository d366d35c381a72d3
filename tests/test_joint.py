"""Pixels, robot poses and intrinsics together: the answer, its prediction, and what is refused.

The recordings are 5 x 7 corners seen from eight stations by a wide camera and a good robot, so that
the error of intrinsics calibrated from these images is the largest there is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from pictures import WIDE, Shot, shoot

from handeye_cli import targets
from handeye_cli.chain import chain_of
from handeye_cli.conventions import Setup
from handeye_cli.errors import ConvergenceError, InputError
from handeye_cli.estimates import Estimate
from handeye_cli.estimation import best_estimate, choose_pairs
from handeye_cli.extrinsics import extrinsics
from handeye_cli.geometry import bundle, joint_bundle, pnp, se3
from handeye_cli.held_out import held_out_errors, own_covariances, root_of, weighted_squares
from handeye_cli.part_calibration import calibrate_part, noise_of_others, usable_chain
from handeye_cli.pixel_data import CALIBRATED, with_intrinsics
from handeye_cli.predict import predicted_error
from handeye_cli.records import (
    Camera,
    Finding,
    FloatArray,
    Noise,
    Stations,
    TargetSpec,
    UncertainPose,
)
from handeye_cli.seen_through import chain_through
from handeye_cli.solve import solve
from handeye_cli.views import views_of

BOARD = TargetSpec("chessboard", {"rows": 5, "columns": 7, "square_mm": 40.0})
POINTS = targets.build(BOARD).points()
ROBOT = (5e-4, 5e-5)
PRIOR = np.diag([2.0, 2.0, 2.0, 2.0, 3e-3, 6e-3, 3e-4, 3e-4, 0.0]) ** 2
MANY = 40
FEWER = 20
"""Runs of what differs by far more than their number blurs."""
pytestmark = [pytest.mark.many_runs, pytest.mark.xdist_group("joint")]  # fixtures are made once


def photographed(rng, count=8, *, sigma_px=0.3, camera=WIDE, robot=ROBOT, setup="eye-in-hand"):
    return shoot(
        rng,
        count,
        camera=camera,
        points=POINTS,
        spec=BOARD,
        distance=0.3,
        sigma_px=sigma_px,
        robot=robot,
        setup=Setup(setup),
    )


def exact(document: Stations) -> Stations:
    """The same document with intrinsics that claim to be exact."""
    return replace(document, camera=replace(document.camera, covariance=None))


def estimated(document: Stations, method="maximum-likelihood") -> Estimate:
    chain = chain_of(document)
    return best_estimate(chain, choose_pairs("star", len(chain.A)), document, method)


@dataclass(frozen=True)
class Runs:
    """Recordings of known truth with the estimates made from them."""

    documents: list[Stations]
    truths: list[FloatArray]
    found: dict[str, list[Estimate]]

    def errors(self, name: str) -> FloatArray:
        """Rotation and translation error of each run."""
        apart = [
            se3.difference(each.solution.X, truth)
            for each, truth in zip(self.found[name], self.truths, strict=False)
        ]
        return np.linalg.norm(np.reshape(apart, (-1, 2, 3)), axis=-1)[:, ::-1]

    def judged(self, name: str) -> tuple[FloatArray, FloatArray]:
        """RMS error over predicted RMS, and the share inside the 95 % radius."""
        expected = [
            predicted_error(each.influence, each.model, None, each.shared)
            for each in self.found[name]
        ]
        rms = np.array([[each.rotation, each.translation] for each in expected])
        radius = np.array([[each.rotation_95, each.translation_95] for each in expected])
        errors = self.errors(name)
        ratio = np.sqrt(np.mean(errors**2, axis=0) / np.mean(rms**2, axis=0))
        return ratio, np.mean(errors < radius, axis=0)


def runs(shots, documents) -> Runs:
    found = {
        "joint": [estimated(each) for each in documents],
        "exact": [estimated(exact(each)) for each in documents[:FEWER]],
    }
    return Runs(documents, [shot.mount_T_camera for shot in shots], found)


def seen_through(shot: Shot, camera: Camera, findings=()) -> Stations:
    """What the extrinsics make of a shot, started from the true poses to save time."""
    views = views_of(shot.features.stations, POINTS)
    poses, squares = pnp.refine(shot.camera_T_target, views.seen, camera.lens)
    sigma = float(np.sqrt(np.sum(squares) / views.degrees_of_freedom()))
    covariance = sigma**2 * np.linalg.inv(pnp.pose_information(poses, views.seen, camera.lens))
    rows = tuple(
        replace(
            row,
            observation=replace(row.observation, sigma_px=sigma),
            camera_T_target=UncertainPose(pose, C),
        )
        for row, pose, C in zip(shot.features.stations, poses, covariance, strict=True)
    )
    return Stations(shot.features.setup, rows, BOARD, camera, findings=findings)


def with_parameters(parameters: FloatArray, covariance: FloatArray) -> Camera:
    fx, fy, cx, cy, *distortion = parameters.tolist()
    moved = replace(WIDE, fx=fx, fy=fy, cx=cx, cy=cy, distortion=tuple(distortion))
    return replace(moved, covariance=covariance)


def calibrated_camera(shot: Shot) -> Camera:
    views = views_of(shot.features.stations, POINTS)
    found = bundle.calibrate(views.seen, WIDE.lens, shot.camera_T_target)
    variance = found.squares / views.degrees_of_freedom(9)
    return with_parameters(found.parameters, variance * np.linalg.inv(found.information))


@pytest.fixture(scope="module")
def calibrated() -> Runs:
    """Intrinsics from the recordings' own images."""
    rng = np.random.default_rng(3)
    shots = [photographed(rng) for _ in range(MANY)]
    finding = Finding(CALIBRATED, "info", "")
    return runs(shots, [seen_through(each, calibrated_camera(each), (finding,)) for each in shots])


@pytest.fixture(scope="module")
def given() -> Runs:
    """Intrinsics that are off as their covariance says."""
    rng = np.random.default_rng(5)
    shots = [photographed(rng, setup="eye-to-hand") for _ in range(MANY)]
    off = WIDE.parameters + rng.normal(size=(MANY, 9)) @ np.sqrt(PRIOR)
    cameras = [with_parameters(each, PRIOR) for each in off]
    found = runs(shots, [seen_through(*each) for each in zip(shots, cameras, strict=True)])
    closed_form = [estimated(each, "tsai-lenz") for each in found.documents]
    return replace(found, found=found.found | {"tsai-lenz": closed_form})


@pytest.mark.parametrize(
    ("method", "name"), [("joint", "calibrated"), ("joint", "given"), ("tsai-lenz", "given")]
)
def test_the_error_of_the_intrinsics_is_in_the_prediction(name, method, request):
    ratio, inside = request.getfixturevalue(name).judged(method)
    assert np.all((ratio > 0.8) & (ratio < 1.2))
    assert np.all((inside >= 0.88) & (inside <= 1.0))


def test_intrinsics_taken_as_exact_promise_too_much(calibrated):
    ratio, inside = calibrated.judged("exact")
    assert np.all(ratio > 1.5)
    assert np.all(inside < 0.8)


def test_the_answer_is_no_worse_than_with_intrinsics_taken_as_exact(calibrated):
    joint, before = calibrated.errors("joint")[:FEWER], calibrated.errors("exact")
    assert np.all(np.mean(joint**2, axis=0) < 1.05 * np.mean(before**2, axis=0))


def test_uncertain_intrinsics_that_were_given_are_improved_several_times(given):
    joint, before = given.errors("joint")[:FEWER], given.errors("exact")
    assert np.all(np.mean(joint**2, axis=0) < 0.5**2 * np.mean(before**2, axis=0))


@pytest.mark.parametrize("name", ["calibrated", "given"])
def test_the_refined_intrinsics_are_as_good_as_they_say(name, request):
    squares = []
    for each in request.getfixturevalue(name).found["joint"]:
        off, covariance = each.camera.parameters - WIDE.parameters, each.camera.covariance
        sigma = np.sqrt(np.diag(covariance))
        kept = sigma > 0.0
        assert kept.sum() == (9 if name == "calibrated" else 8)
        correlation = covariance[np.ix_(kept, kept)] / np.outer(sigma[kept], sigma[kept])
        white = off[kept] / sigma[kept]
        squares.append(white @ np.linalg.solve(correlation, white) / kept.sum())
    # Chi-square over its degrees of freedom, and a little more for noise that is estimated.
    assert abs(np.mean(squares) - 1.0) < 4 * np.sqrt(2 / (8 * MANY)) + 0.1


def test_robot_poses_sharpen_the_focal_length(calibrated):
    pairs = zip(calibrated.documents, calibrated.found["joint"], strict=True)
    gain = [
        after.camera.covariance[0, 0] / before.camera.covariance[0, 0] for before, after in pairs
    ]
    assert np.median(gain) < 0.95


@pytest.mark.parametrize("setup", Setup)
@pytest.mark.parametrize("noise", [None, Noise(5e-4, 5e-5)])
def test_exact_intrinsics_leave_the_answer_of_the_poses(setup, noise):
    rng = np.random.default_rng(7)
    for _ in range(4):
        shot = photographed(rng, 10, sigma_px=0.1, setup=setup)
        document = replace(seen_through(shot, WIDE), noise=noise)
        pixels = estimated(document)
        poses = estimated(replace(document, target=None))
        sigma = np.sqrt(np.diag(pixels.covariance))
        apart = se3.difference(pixels.solution.X, poses.solution.X)
        assert np.max(np.abs(apart) / sigma[:6]) < 0.03
        np.testing.assert_allclose(sigma, np.sqrt(np.diag(poses.covariance)), rtol=0.015)
        assert pixels.camera == document.camera


def test_residuals_are_those_of_the_refined_camera(calibrated):
    document = calibrated.documents[0]
    answer = solve(document)
    chain = chain_through(document, usable_chain(document), answer.camera)
    loops = chain.A @ answer.mount_T_camera.matrix @ chain.B
    off = se3.difference(loops, answer.reference_T_target.matrix)
    # The views' best poses to first order, and to the last digit.
    np.testing.assert_allclose(
        [row.rotation for row in answer.stations], np.linalg.norm(off[:, 3:], axis=1), rtol=0.02
    )


@pytest.mark.parametrize("name", ["calibrated", "given"])
def test_held_out_stations_are_predicted_with_the_shared_error(request, name):
    """Five stations calibrate, three are predicted, all with the same intrinsics."""
    squares = []
    for document in request.getfixturevalue(name).documents[:FEWER]:
        known = replace(document, noise=Noise(*ROBOT))
        chain = usable_chain(known)
        found = calibrate_part(
            chain.part(slice(0, 5)), known, method="maximum-likelihood", pairs="star", where="here"
        )
        others = chain_through(known, chain.part(slice(5, 8)), found.camera)
        errors = held_out_errors(others, found.solution)
        own = noise_of_others(others, known.noise, found.model.noise, found.solution)
        shared = errors.by_common @ root_of(found.covariance)
        squares.append(weighted_squares(errors.vectors, own_covariances(errors, own), shared))
    # Chi-square with 18 degrees of freedom; calibrated intrinsics have seen these images, which is
    # why the errors may be a little smaller than that.
    assert 15.5 < np.mean(squares) < 18 + 4 * np.sqrt(36 / FEWER)


@pytest.mark.parametrize("name", ["calibrated", "given"])
def test_what_a_part_says_of_its_error_is_a_covariance(request, name):
    """Of X, the mean Z and the intrinsics together, in units that belong together."""
    for document in request.getfixturevalue(name).documents[:3]:
        chain = usable_chain(document)
        found = calibrate_part(
            chain, document, method="maximum-likelihood", pairs="star", where="here"
        )
        sigma = np.sqrt(np.diag(found.covariance))
        values = np.linalg.eigvalsh(found.covariance / sigma[:, None] / sigma)
        assert values[0] > -1e-3 * values[-1]


def test_an_error_of_all_robot_poses_moves_refined_intrinsics_as_well(given):
    """Its covariance with X, the mean Z and the camera is how far it moves them, by brute force."""
    document = replace(given.documents[0], noise=Noise(*ROBOT, pixel=0.3))
    errors = np.random.default_rng(8).normal(size=(8, 6)) * np.repeat([2e-4, 2e-3], 3)

    def part_at(step):
        rows = tuple(
            replace(each, base_T_gripper=se3.perturb(each.base_T_gripper, step * e), shared_error=e)
            for each, e in zip(document.stations, errors, strict=True)
        )
        moved = replace(document, stations=rows)
        return calibrate_part(
            usable_chain(moved), moved, method="maximum-likelihood", pairs="star", where="here"
        )

    here, up, down = (part_at(step) for step in (0.0, 0.05, -0.05))
    expected = [
        se3.difference(getattr(up.solution, name), getattr(down.solution, name)) / 0.1
        for name in ("X", "Z")
    ]
    caused = here.shared[:, -1]
    np.testing.assert_allclose(
        caused[:12], np.concatenate(expected), rtol=0.02, atol=0.02 * np.abs(caused[:12]).max()
    )
    directions = joint_bundle.uncertain_directions(document.camera.covariance)
    by_intrinsics = directions @ caused[12:-1]
    found = (up.camera.parameters - down.camera.parameters) / 0.1
    np.testing.assert_allclose(by_intrinsics[:4], found[:4], rtol=0.03, atol=1e-3)
    assert np.max(np.abs(found[:2])) > 0.1
    spread = np.diag(here.camera.covariance)[:4]
    assert np.all(spread > 0.99 * by_intrinsics[:4] ** 2)


def test_given_noise_of_the_pixels_is_kept(calibrated):
    document = replace(calibrated.documents[0], noise=Noise(pixel=0.3))
    assert solve(document).noise.pixel == 0.3


def test_noise_of_the_pixels_is_that_of_the_refined_intrinsics(given):
    before = [each.stations[0].observation.sigma_px for each in given.documents]
    after = [each.model.noise.pixel for each in given.found["joint"]]
    assert np.mean(before) > 0.32
    assert np.mean(after) == pytest.approx(0.3, rel=0.02)


def test_given_noise_of_the_camera_stands_above_the_pixels(calibrated):
    document = replace(calibrated.documents[0], noise=Noise(5e-4, 5e-5, 1e-3, 1e-4))
    pixels, poses = solve(document), solve(replace(document, target=None))
    np.testing.assert_array_equal(pixels.mount_T_camera.matrix, poses.mount_T_camera.matrix)
    assert pixels.predicted_error == poses.predicted_error


def test_perfect_pixels_give_the_exact_answer():
    shot = photographed(np.random.default_rng(11), sigma_px=1e-9, robot=(1e-12, 1e-12))
    answer = solve(extrinsics(shot.features, calibrate_intrinsics=True))
    np.testing.assert_allclose(answer.mount_T_camera.matrix, shot.mount_T_camera, atol=1e-6)


def contradictions(found: Estimate):
    return [each for each in found.findings if each.code == "intrinsics-contradicted"]


def test_robot_and_images_that_agree_are_not_blamed(calibrated):
    assert sum(len(contradictions(each)) for each in calibrated.found["joint"]) <= 1


def test_ids_beyond_the_target_are_refused(calibrated):
    document = calibrated.documents[0]
    row = document.stations[2]
    ids = row.observation.ids + 1
    wrong = replace(row, observation=replace(row.observation, ids=ids))
    rows = (*document.stations[:2], wrong, *document.stations[3:])
    with pytest.raises(InputError, match=r"35 points of the target, 0 to 34, found 35") as caught:
        solve(replace(document, stations=rows))
    assert caught.value.where == 'station "02"'


def test_pixels_of_another_pose_are_refused(calibrated):
    document = calibrated.documents[0]
    first, second, *rest = document.stations
    swapped = (
        replace(first, observation=second.observation),
        replace(second, observation=first.observation),
    )
    with pytest.raises(InputError, match=r"found them \d+\.\d+ px away") as caught:
        solve(replace(document, stations=(*swapped, *rest)))
    assert caught.value.where == 'station "00"'


def test_a_refinement_that_does_not_settle_ends_with_code_5(calibrated, monkeypatch):
    monkeypatch.setattr(joint_bundle, "_MAX_STEPS", 1)
    with pytest.raises(ConvergenceError, match="did not converge on 8 stations") as caught:
        solve(calibrated.documents[0])
    assert caught.value.exit_code == 5


def test_a_chain_knows_its_intrinsics_only_where_they_are_uncertain(calibrated):
    document = calibrated.documents[0]
    chain = chain_of(document)
    assert with_intrinsics(exact(document), chain) is chain
    assert with_intrinsics(replace(document, target=None), chain) is chain
    uncertain = with_intrinsics(document, chain)
    assert uncertain.by_intrinsics.shape == (8, 6, document.camera.parameters.size)
    assert uncertain.part(slice(0, 3)).by_intrinsics.shape[0] == 3

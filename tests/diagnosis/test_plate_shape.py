"""Bent plates and wrong lenses against the heights and pitches that were put in."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
import real_recordings
from bent_plates import POINTS, SIGMA, bent, photographed, stations_of
from pictures import WIDE

from handeye_cli.chain import chain_of
from handeye_cli.diagnosis.pixel_noise import unexplained_pixel_noise
from handeye_cli.diagnosis.plate_shape import plate_shape
from handeye_cli.errors import InputError
from handeye_cli.extrinsics import extrinsics
from handeye_cli.geometry import se3
from handeye_cli.records import Camera, Observation

HEIGHT = 1e-3
PLAIN_LENS = replace(WIDE, distortion=(-0.2, 0.06, 0.0, 0.0, 0.0))


def codes(shape):
    return {finding.code for finding in shape.findings}


def waved(row):
    pixels = row.observation.pixels
    bent_pixels = pixels + 0.3 * np.sin(pixels[:, ::-1] / 150.0)
    return replace(row, observation=replace(row.observation, pixels=bent_pixels))


def shapes(seed, plate=POINTS, *, camera=WIDE, calibrate=False, runs=8, **how):
    rng = np.random.default_rng(seed)
    shots = [photographed(rng, plate, **how) for _ in range(runs)]
    return [plate_shape(stations_of(each, camera, calibrate=calibrate)) for each in shots]


@pytest.mark.parametrize("calibrate", [False, True])
def test_good_recordings_are_not_blamed(calibrate):
    found = Counter(
        code for each in shapes(1, calibrate=calibrate, runs=40) for code in codes(each)
    )
    assert max(found.values(), default=0) <= 2


@pytest.mark.parametrize("calibrate", [False, True])
def test_a_bow_is_found_and_measured(calibrate):
    found = shapes(2, bent(HEIGHT), calibrate=calibrate)
    assert all("plate-bowed" in codes(each) for each in found)
    off = np.array([(each.seen.bow - HEIGHT) / each.seen.bow_sigma for each in found])
    # A height is a difference of extremes, which noise makes larger by some of its sigma.
    assert np.sqrt(np.mean(off**2)) < 2.0
    assert all(each.seen.bow_sigma < 0.05 * HEIGHT for each in found)
    assert all(each.seen.plate_share > 0.6 for each in found)
    assert all(each.seen.pixel_left == pytest.approx(SIGMA, rel=0.1) for each in found)


def test_the_message_tells_height_doubt_and_share():
    (shape,) = shapes(3, bent(HEIGHT), runs=1)
    (finding,) = shape.findings
    assert finding.code == "plate-bowed"
    assert finding.severity == "warning"
    assert f"bowed by about {1e3 * shape.seen.bow:.2f} mm" in finding.message
    assert f"(+- {1e3 * shape.seen.bow_sigma:.2f})" in finding.message
    assert f"explains {100 * shape.seen.plate_share:.0f} % of the squares" in finding.message


@pytest.mark.parametrize("calibrate", [False, True])
def test_pitches_that_are_not_as_declared(calibrate):
    found = shapes(4, bent(aspect=3e-3, shear=-2e-3), calibrate=calibrate)
    assert all("plate-aspect" in codes(each) for each in found)
    assert not any("plate-bowed" in codes(each) for each in found)
    off = [
        (
            (each.seen.aspect - 3e-3) / each.seen.aspect_sigma,
            (each.seen.shear + 2e-3) / each.seen.shear_sigma,
        )
        for each in found
    ]
    # Sixteen squares.
    assert 0.3 < np.sqrt(np.mean(np.square(off))) < 1.8


@pytest.mark.parametrize(
    ("strain", "told", "advised", "silent"),
    [
        ({"aspect": 3e-3}, "columns +0.3", "measure the pitch", "corners"),
        ({"shear": -2e-3}, "corners -2.", "measure both diagonals", "columns"),
    ],
)
def test_only_a_strain_that_is_seen_is_told(strain, told, advised, silent):
    (shape,) = shapes(15, bent(**strain), runs=1)
    (finding,) = shape.findings
    assert told in finding.message
    assert finding.advice.startswith(advised)
    assert silent not in finding.message


@pytest.mark.parametrize(
    ("model", "calibrate", "advised"),
    [
        ("plumb_bob", False, "'handeye solve RECORDING --calibrate-intrinsics'"),
        ("plumb_bob", True, "the lens model plumb_bob is too simple for this lens"),
        ("rational_polynomial", False, "no lens model has more coefficients than rational"),
        ("rational_polynomial", True, "no lens model has more coefficients than rational"),
    ],
)
def test_the_advice_on_a_lens_is_never_what_has_been_done(model, calibrate, advised):
    """The pixels are bent by a wave over the image, which no model follows."""
    shot = photographed(np.random.default_rng(16))
    rows = [waved(row) for row in shot.features.stations]
    shot = replace(shot, features=replace(shot.features, stations=tuple(rows)))
    document = stations_of(shot, calibrate=calibrate)
    missing = (0.0, 0.0, 0.0) if model == "rational_polynomial" else ()
    lens = (*document.camera.distortion, *missing)
    camera = replace(document.camera, model=model, distortion=lens, covariance=None)
    shape = plate_shape(replace(document, camera=camera))
    (finding,) = shape.findings
    assert finding.code == "residuals-over-image"
    assert finding.advice.startswith(advised)


def test_a_wrong_lens_is_not_put_down_to_the_plate():
    for each in shapes(5, camera=PLAIN_LENS):
        assert codes(each) == {"residuals-over-image"}
        assert each.seen.image_share > 5 * each.seen.plate_share
        assert not each.by_plate.any()
        assert each.by_image.any()


def test_a_bow_is_measured_in_spite_of_a_wrong_lens():
    for each in shapes(6, bent(HEIGHT), camera=PLAIN_LENS):
        assert codes(each) == {"residuals-over-image", "plate-bowed"}
        assert each.seen.bow == pytest.approx(HEIGHT, abs=5 * each.seen.bow_sigma)


def test_views_that_are_all_alike_do_not_tell_plate_from_lens():
    """A slight bow seen straight on looks like a slight distortion of the lens."""
    for each in shapes(7, bent(0.2 * HEIGHT), tilt_deg=0.3, sigma_px=0.05, count=6):
        (finding,) = each.findings
        assert finding.code == "plate-or-lens"
        assert f"bowed by {1e3 * each.seen.bow:.2g} mm" in finding.message
        assert not each.by_plate.any()
        assert not each.by_image.any()


@pytest.mark.parametrize("calibrate", [False, True])
def test_poses_are_put_right(calibrate):
    """With what was found all views see the true plate in one place."""
    shot = photographed(np.random.default_rng(8), bent(HEIGHT), sigma_px=0.02)
    document = stations_of(shot, calibrate=calibrate)
    shape, chain = plate_shape(document), chain_of(document)
    spreads = []
    for moves in (np.zeros((len(chain.B), 6)), sum(shape.moves(chain))):
        seen = se3.inverse(shot.camera_T_target) @ se3.perturb(chain.B, moves)
        spreads.append(
            np.linalg.norm(se3.difference(seen, se3.mean(seen)).reshape(-1, 2, 3), axis=-1)
        )
    before, after = (np.sqrt(np.mean(each**2, axis=0)) for each in spreads)
    assert np.all(before > 3.0 * after)


def test_moves_are_those_of_the_chains_stations():
    document = stations_of(photographed(np.random.default_rng(9), bent(HEIGHT)))
    shape = plate_shape(document)
    rows = np.array([7, 2, 5])
    part = chain_of(document).part(rows)
    np.testing.assert_array_equal(shape.moves(part)[0], shape.by_plate[rows])
    beside = shape.beside(part)
    np.testing.assert_array_equal(beside.by_intrinsics[..., 0], shape.by_plate[rows])
    assert beside.by_intrinsics.shape == (3, 6, 2)


def test_few_pixels_are_not_judged():
    document = stations_of(photographed(np.random.default_rng(10)))
    assert plate_shape(replace(document, target=None)) is None
    assert plate_shape(replace(document, stations=document.stations[:2])) is None
    corners = np.array([0, 6, 28, 34])
    few = tuple(
        replace(row, observation=Observation(corners, row.observation.pixels[corners], SIGMA))
        for row in document.stations
    )
    assert plate_shape(replace(document, stations=few)) is None


def test_perfect_pixels_are_not_judged():
    for calibrate in (False, True):
        (shape,) = shapes(14, calibrate=calibrate, runs=1, sigma_px=0.0)
        assert not shape.findings


def test_pixels_of_another_pose_are_refused():
    document = stations_of(photographed(np.random.default_rng(11)))
    first = document.stations[0]
    wrong = replace(first.observation, pixels=first.observation.pixels + 30.0)
    rows = (replace(first, observation=wrong), *document.stations[1:])
    with pytest.raises(InputError, match=r"found them 30\.0"):
        plate_shape(replace(document, stations=rows))


def test_pixel_noise_beyond_what_the_detector_says():
    (shape,) = shapes(12, runs=1)
    assert unexplained_pixel_noise(shape, None) is None
    assert unexplained_pixel_noise(shape, SIGMA) is None
    finding = unexplained_pixel_noise(shape, SIGMA / 5)
    assert finding.code == "pixel-noise-unexplained"
    assert f"{5 * shape.seen.pixel_left / SIGMA:.1f} times the 0.020 px" in finding.message


def test_a_bow_is_no_pixel_noise():
    (shape,) = shapes(13, bent(2 * HEIGHT), runs=1)
    assert shape.seen.pixel > 2.5 * SIGMA
    assert unexplained_pixel_noise(shape, SIGMA) is None


@pytest.mark.parametrize("calibrate", [False, True])
@real_recordings.ONE_PROCESS
def test_the_cardboard_plate_is_bowed(calibrate):
    """With given intrinsics, which lack their distortion, and with calibrated ones: 1.2 mm."""
    features = real_recordings.features("rct-10x10")
    shape = plate_shape(extrinsics(features, calibrate_intrinsics=calibrate))
    assert {"plate-bowed", "residuals-over-image"} <= codes(shape)
    assert shape.seen.bow == pytest.approx(1.2e-3, abs=0.2e-3)
    assert shape.seen.bow_sigma < 0.2e-3


@real_recordings.ONE_PROCESS
def test_lens_and_cardboard_that_explain_as_much_are_not_told_apart():
    """The richest lens model there is, as OpenCV calibrates it from the same images."""
    camera = Camera(
        *(640, 480, 542.659, 543.860, 320.0, 226.5),
        (-4.13878, 17.397, 9.6889e-3, -2.67685e-3, -22.4480, -4.16853, 17.4192, -22.5797),
        "rational_polynomial",
    )
    shape = plate_shape(extrinsics(replace(real_recordings.features("rct-10x10"), camera=camera)))
    finding = next(each for each in shape.findings if each.code == "plate-or-lens")
    assert "residuals-over-image" not in codes(shape)
    assert shape.by_image.any()
    assert f"distortion of the lens {100 * shape.seen.image_share:.0f} %" in finding.message
    assert "calibrate the camera with another target" in finding.advice


def test_what_given_intrinsics_leave_open_is_no_shape_of_the_plate():
    sigma = np.array([4.0, 4.0, 2.0, 2.0, *5 * [1e-9]])
    off = replace(WIDE, fx=WIDE.fx + sigma[0], cy=WIDE.cy - sigma[3], covariance=np.diag(sigma**2))
    shots = [photographed(np.random.default_rng(seed)) for seed in range(6)]
    for found in (plate_shape(stations_of(shot, off)) for shot in shots):
        assert not codes(found)
        assert not np.any(found.by_plate)

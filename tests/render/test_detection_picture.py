"""Pictures of detections: what is drawn lies where it was found, and the words are all there."""

import cv2
import numpy as np
import pytest

from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.camera import project
from handeye_cli.records import Camera, Observation, Station
from handeye_cli.render.detection_picture import draw_detection

CAMERA = Camera(900, 700, 800.0, 800.0, 450.0, 350.0, (-0.3, 0.1, 0.0, 0.0, 0.0))
COLUMN, ROW = (each.ravel() for each in np.meshgrid(np.arange(4.0), np.arange(3.0)))
POINTS = np.stack([0.02 * COLUMN, 0.02 * ROW, 0.0 * ROW], axis=1)
POSE = se3.from_parts(rotations.exp(np.array([0.3, -0.4, 0.2])), np.array([-0.03, -0.02, 0.2]))
PIXELS = project(se3.transform_points(POSE, POINTS), CAMERA.parameters, CAMERA.model)
MAGENTA, RED, GREEN = (255, 0, 255), (60, 60, 255), (60, 220, 60)
DISC, HULL = (220, 200, 0), (0, 190, 255)


def station(ids=range(12), pixels=PIXELS, reason=None, name="00"):
    ids = np.array(ids, dtype=np.int64)
    seen = None if reason else Observation(ids, pixels[: len(ids)], 0.0042)
    return Station(name, np.eye(4), seen, reason=reason)


def grey(width=900, height=700, level=128):
    return np.full((height, width), level, dtype=np.uint8)


def band_of(picture, height, factor=1):
    """The rows above the image."""
    return picture[: len(picture) - factor * height]


def places(picture, colour):
    """The (n, 2) pixels of nearly a colour; lines are drawn softly."""
    rows, columns = np.nonzero(np.abs(picture.astype(int) - colour).max(axis=2) < 90)
    return np.stack([columns, rows], axis=1)


@pytest.mark.parametrize("seed", range(3))
def test_crosses_lie_between_the_pixels_where_the_points_are(seed):
    rng = np.random.default_rng(seed)
    corners = [[100, 100], [800, 100], [800, 600], [100, 600]]
    inner = np.array([[450, 350], [300, 420], [500, 200]]) + rng.uniform(-0.5, 0.5, (3, 2))
    pixels = np.concatenate([corners, inner])
    picture = draw_detection(grey(), station(range(7), pixels), POINTS)
    image = picture[len(band_of(picture, 700)) :].astype(float)
    for place in inner:
        u, v = np.rint(place).astype(int)
        around = image[v - 9 : v + 10, u - 9 : u + 10]
        ink = np.clip(np.minimum(around[..., 0], around[..., 2]) - around[..., 1], 0, None)
        # each stroke where the other is not: its rows share the weight as its place wants it
        upright, level = ink[[5, 6, 12, 13]].sum(axis=0), ink[:, [5, 6, 12, 13]].sum(axis=1)
        offsets = [np.average(np.arange(-9, 10), weights=each) for each in (upright, level)]
        np.testing.assert_allclose(np.array([u, v]) + offsets, place, atol=0.2)


@pytest.mark.parametrize(("size", "factor"), [((799, 600), 2), ((800, 600), 1), ((600, 801), 1)])
def test_small_images_are_shown_twice_as_large(size, factor):
    width, height = size
    rng = np.random.default_rng(0)
    image = rng.integers(0, 256, (height, width), dtype=np.uint8)
    picture = draw_detection(image, station(reason="nothing"), POINTS)
    band = len(picture) - factor * height
    assert 0 < band < 100
    np.testing.assert_array_equal(
        picture[band:], np.dstack([np.kron(image, np.ones((factor, factor), np.uint8))] * 3)
    )
    assert picture[:band].mean() < 60


def test_axes_start_at_the_first_point_and_go_along_the_lens():
    picture = draw_detection(grey(), station(), POINTS, camera=CAMERA)
    top = len(band_of(picture, 700))
    ends = np.array([[0.4 * 0.06, 0.0, 0.0], [0.0, 0.4 * 0.06, 0.0]])
    tips = project(se3.transform_points(POSE, ends), CAMERA.parameters, CAMERA.model)
    for tip, colour in zip(tips, (RED, GREEN), strict=True):
        inked = places(picture, colour) - [0, top]
        for wanted in (PIXELS[0], tip, (PIXELS[0] + tip) / 2):
            assert np.linalg.norm(inked - wanted, axis=1).min() < 2.5


def test_axes_start_at_the_seen_point_nearest_to_the_first():
    ids = [5, 6, 9, 10, 11]
    picture = draw_detection(grey(), station(ids, PIXELS[ids]), POINTS)
    top = len(band_of(picture, 700))
    start, nearest = PIXELS[5], places(picture, RED) - [0, top]
    assert np.linalg.norm(nearest - start, axis=1).min() < 3
    assert np.linalg.norm(nearest - PIXELS[0], axis=1).min() > 30


def test_the_outlines_of_discs_are_those_of_the_lens():
    discs = np.column_stack([POINTS[:, :2], np.full(12, 0.007)])
    picture = draw_detection(grey(), station(), POINTS, discs=discs, camera=CAMERA)
    top = len(band_of(picture, 700))
    inked = places(picture, DISC) - [0, top]
    angles = np.linspace(0, 2 * np.pi, 40)
    rim = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1) * 0.007
    for centre in POINTS[[3, 7, 8]]:
        seen = project(se3.transform_points(POSE, centre + rim), CAMERA.parameters, CAMERA.model)
        away = np.linalg.norm(inked[:, None] - seen, axis=2).min(axis=0)
        assert np.quantile(away, 0.8) < 1.5
    assert len(places(draw_detection(grey(), station(), POINTS), DISC)) < len(inked) / 10


def test_the_hull_is_around_all_points():
    picture = draw_detection(grey(), station(), POINTS)
    top = len(band_of(picture, 700))
    inked = places(picture, HULL) - [0, top]
    for a, b in ((0, 3), (3, 11), (11, 8)):
        middle = 0.3 * PIXELS[a] + 0.7 * PIXELS[b]
        assert np.linalg.norm(inked - middle, axis=1).min() < 2.5


class Words:
    """The texts that are written, in order, with where they begin."""

    def __init__(self, monkeypatch):
        self.texts = []
        write = cv2.putText

        def kept(image, text, start, *rest):
            self.texts.append(text)
            size = cv2.getTextSize(text, *rest[:2], rest[3])[0]
            assert 0 <= start[0] <= image.shape[1] - size[0]
            assert size[1] <= start[1] <= image.shape[0]
            return write(image, text, start, *rest)

        monkeypatch.setattr(cv2, "putText", kept)


def test_words_say_what_was_found(monkeypatch):
    words = Words(monkeypatch)
    draw_detection(grey(), station(range(1, 11), name="left \N{DEGREE SIGN}\x1b"), POINTS)
    assert words.texts[0] == "left ??: 10 of 12 points, sigma 0.004 px"
    # the ends of the axes, and the points farthest towards the four corners
    assert sorted(words.texts[1:]) == ["1", "3", "7", "8", "x", "y"]


def test_points_of_unknown_noise_have_no_sigma(monkeypatch):
    words = Words(monkeypatch)
    seen = Observation(np.arange(4), PIXELS[:4])
    draw_detection(grey(), Station("7", np.eye(4), seen), POINTS)
    assert words.texts[0] == "7: 4 of 12 points"


@pytest.mark.parametrize("width", [1, 200, 900, 3000])
def test_a_long_reason_is_wrapped_and_whole(monkeypatch, width):
    words = Words(monkeypatch)
    reason = " ".join(f"word{k}" for k in range(70)) + " " + "/long" * 60
    picture = draw_detection(grey(width, 300), station(reason=reason), POINTS)
    assert "".join(words.texts).replace(" ", "") == f"00:{reason}".replace(" ", "")
    assert len(words.texts) > 1
    # the band grows with the lines, so that none lies on the image
    assert len(picture) > 300 + 15 * len(words.texts)


@pytest.mark.parametrize("shape", [(1, 1), (2, 900), (900, 2)])
@pytest.mark.parametrize("ids", [[0], [0, 1], [0, 1, 2, 3], [0, 1, 2, 3, 7]])
def test_any_image_and_any_points_can_be_drawn(shape, ids):
    image = np.zeros(shape, dtype=np.uint8)
    before = image.copy()
    picture = draw_detection(image, station(ids, PIXELS), POINTS, discs=np.array([[0, 0, 0.01]]))
    assert picture.dtype == np.uint8
    assert picture.shape[2] == 3
    assert picture.shape[0] > shape[0]
    assert picture.shape[1] >= max(shape[1], 200)
    np.testing.assert_array_equal(image, before)


def test_points_at_the_ends_of_the_world_are_drawn_at_the_rim():
    far = PIXELS.copy()
    far[11] = [1e12, -1e12]
    assert draw_detection(grey(), station(range(12), far), POINTS).shape[1] == 900

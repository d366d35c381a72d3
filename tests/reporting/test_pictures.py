"""Images scaled for a page, with the points and the camera scaled along."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from pictures import CAMERA
from reporting import cases

from handeye_cli.errors import InputError
from handeye_cli.geometry.camera import project
from handeye_cli.pipeline import Steps
from handeye_cli.records import RecordedStation, Recording
from handeye_cli.reporting.case import Case
from handeye_cli.reporting.pictures import MOST, album_of, scaled_camera

ALONE = Steps(workers=1)


@dataclass(frozen=True)
class Grey:
    label: str

    def load(self):
        if "lost" in self.label:
            raise InputError("expected an image file: gone", where=self.label)
        image = np.full((480, 640), 100, np.uint8)
        image[240:, 320:] = 200
        return image


def with_images(labels):
    features = cases.shot().features
    copies = [features.stations[k % cases.COUNT] for k in range(len(labels))]
    rows = tuple(replace(each, name=str(k)) for k, each in enumerate(copies))
    recorded = tuple(
        RecordedStation(each.name, each.base_T_gripper, Grey(label))
        for each, label in zip(rows, labels, strict=True)
    )
    return Case(
        "a",
        recording=Recording(features.setup, recorded),
        features=replace(features, stations=rows),
    )


@pytest.mark.parametrize("scale", [0.5, 1.25])
def test_a_scaled_camera_sees_points_at_the_scaled_pixels(scale):
    points = np.array([[0.01, -0.02, 0.2], [-0.03, 0.01, 0.15]])
    small = scaled_camera(CAMERA, scale)
    before = project(points, CAMERA.parameters, CAMERA.model)
    after = project(points, small.parameters, small.model)
    np.testing.assert_allclose(after + 0.5, scale * (before + 0.5))


def test_images_and_points_are_scaled_together():
    case = with_images(["one"])
    (picture,) = album_of(case, ALONE).pictures
    assert picture.grey.shape == (600, 800)
    assert picture.grey[[400, 400, 200], [350, 450, 450]].tolist() == [100, 200, 100]
    seen = case.features.stations[0].observation.pixels
    np.testing.assert_allclose(picture.station.observation.pixels + 0.5, 1.25 * (seen + 0.5))


def test_more_images_are_smaller():
    pictures = album_of(with_images(["x"] * 40), ALONE).pictures
    assert len(pictures) == 40
    assert max(pictures[0].grey.shape) == int(800 * np.sqrt(15 / 40))


def test_of_very_many_images_the_first_are_shown():
    album = album_of(with_images(["x"] * (MOST + 3)), ALONE)
    assert len(album.pictures) == MOST
    assert album.total == MOST + 3


def test_an_image_that_is_lost_says_so():
    pictures = album_of(with_images(["one", "lost.png"]), ALONE).pictures
    assert pictures[0].grey is not None
    assert pictures[1].grey is None
    assert "lost.png" in pictures[1].reason


def test_without_a_recording_there_is_no_album():
    assert album_of(cases.case(), ALONE) is None

"""The images of a page: each as it was taken, with what was found drawn into it."""

from __future__ import annotations

import base64
import re
from dataclasses import replace

import cv2
import numpy as np
import pytest
from reporting import cases

from handeye_cli.gates import Limits
from handeye_cli.pipeline import Steps
from handeye_cli.records import Station
from handeye_cli.render.page import images
from handeye_cli.render.page.desk import Desk
from handeye_cli.render.page.drawing import Pen
from handeye_cli.render.page.telling import Teller
from handeye_cli.reporting.contents import contents_of
from handeye_cli.reporting.pictures import Album, Picture


@pytest.mark.parametrize("shape", [(20, 900), (20, 500), (480, 640), (600, 800)])
def test_an_image_has_its_own_size_and_no_words_above_it(shape):
    """However high those words stand over a low one."""
    shown = Picture(Station("7", np.eye(4), reason="nothing"), np.full(shape, 120, np.uint8))
    album = Album((shown,), 1, np.zeros((1, 3)), np.zeros((0, 3)))
    contents = replace(contents_of(cases.case(), Limits(), Steps()), album=album)
    page = images.body(contents, Desk(Pen("1"), Teller()))
    data = base64.b64decode(re.search(r"base64,([^\"]+)", page)[1])
    pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert pixels.shape[:2] == shape
    assert np.abs(pixels.astype(int) - 120).max() <= 2

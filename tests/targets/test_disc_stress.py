"""Discs found and measured in pictures with one fault each, against the images of their centres."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
import pytest

from handeye_cli import targets
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.camera import project
from handeye_cli.records import Camera
from handeye_cli.simulate.degrade import compressed, curved, defocused, moved, salted, saturated
from handeye_cli.simulate.render import Appearance, expose, paint_target

CAMERA = Camera(640, 480, 1250.0, 1247.0, 322.0, 238.0, (-0.2, 0.05, 1e-3, -1e-3, 0.0))
PLAIN = "disc-grid:6x6:5mm:4mm"
LIGHT = Appearance(gradient=(0.1, -0.05), noise=2.0)
TILTS_DEG = (8.0, 40.0)


@dataclass(frozen=True)
class Fault:
    """How a picture is spoilt, and the largest RMS distance that is left, in pixels."""

    limit: float
    target: str = PLAIN
    look: Appearance = LIGHT
    growth: float = 1.0
    light: Callable[[np.ndarray], np.ndarray] = field(default=lambda light: light)
    file: Callable[[np.ndarray], np.ndarray] = field(default=lambda grey: grey)


def pose_of(board, tilt_deg: float, share: float) -> np.ndarray:
    """A pose at which the plate's diagonal is as long as this share of the image's height."""
    outline = board.drawing().outline
    tilt = np.radians(tilt_deg) * np.array([0.6, 0.8, 0.0])
    R = rotations.exp(tilt) @ rotations.exp(np.array([0.0, 0.0, 0.2]))
    distance = CAMERA.fy * np.linalg.norm(np.ptp(outline, axis=0)) / CAMERA.height / share
    return se3.from_parts(R, [0.0, 0.0, distance] - R @ np.append(outline.mean(axis=0), 0.0))


@lru_cache(maxsize=8)
def painted(target: str, look: Appearance, growth: float, tilt_deg: float, share: float):
    """The light that a camera gets, which most faults have in common."""
    board = targets.build(targets.parse(target))
    drawing = board.drawing()
    drawn = replace(drawing, discs=drawing.discs * [1.0, 1.0, growth])
    return paint_target(CAMERA, pose_of(board, tilt_deg, share), drawn, appearance=look)


def errors(fault: Fault, tilt_deg: float, share: float) -> np.ndarray:
    """The (n, 2) errors of all points of a target in a spoilt picture."""
    board = targets.build(targets.parse(fault.target))
    pose = pose_of(board, tilt_deg, share)
    rng = np.random.default_rng(int(tilt_deg))
    light = fault.light(painted(fault.target, fault.look, fault.growth, tilt_deg, share).copy())
    grey = fault.file(expose(light, fault.look.noise, rng))
    seen = board.refine(grey, board.detect(grey), CAMERA)
    assert seen.reason is None
    assert len(seen.ids) == len(board.points())
    truth = project(se3.transform_points(pose, board.points()), CAMERA.parameters)
    each = [seen.pixels - truth[turn][seen.ids] for turn in board.turns()]
    return min(each, key=lambda error: np.abs(error).max())


FAULTS = {
    "none": Fault(0.012),
    "blur-0.4": Fault(0.012, look=replace(LIGHT, blur_px=0.4)),
    "blur-1.5": Fault(0.012, look=replace(LIGHT, blur_px=1.5)),
    "blur-2.5": Fault(0.045, look=replace(LIGHT, blur_px=2.5)),
    "defocus-2": Fault(0.012, light=lambda light: defocused(light, 2.0)),
    "motion-4": Fault(0.012, light=lambda light: moved(light, 4.0, 0.5)),
    "jpeg-70": Fault(0.012, file=lambda grey: compressed(grey, 70)),
    "gamma-2.2": Fault(0.012, light=lambda light: curved(light, 2.2)),
    "gamma-0.45": Fault(0.012, light=lambda light: curved(light, 1 / 2.2)),
    "white-clipped": Fault(0.012, light=lambda light: saturated(light, 1.5)),
    "too-large-5": Fault(0.015, growth=1.05),
    "white-on-black": Fault(0.012, look=replace(LIGHT, ink=205.0, paper=35.0)),
    "corner-disc": Fault(0.012, target="disc-grid:10x10:5mm:2.5mm:5mm"),
    "asymmetric": Fault(0.012, target="asymmetric-circles:4x11:20mm:16mm"),
    "noise-8": Fault(0.025, look=replace(LIGHT, noise=8.0)),
    "broken-pixels": Fault(0.012, file=lambda grey: salted(grey, 30, np.random.default_rng(1))),
}


HARDER_WHEN_SMALL = ("none", "blur-2.5", "motion-4", "jpeg-70", "corner-disc", "noise-8")
CASES = [
    *(pytest.param(name, 1.0, id=f"{name}-39-px") for name in FAULTS),
    *(pytest.param(name, 0.5, id=f"{name}-19-px") for name in HARDER_WHEN_SMALL),
]


@pytest.mark.parametrize(("name", "share"), CASES)
def test_centres_are_as_near_as_the_fault_leaves_them(name, share):
    fault = FAULTS[name]
    squares = [np.sum(errors(fault, tilt, share) ** 2, axis=1).mean() for tilt in TILTS_DEG]
    assert np.sqrt(np.mean(squares)) < fault.limit

"""Views of a plate of discs at random poses, in random light and surroundings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.camera import project
from handeye_cli.geometry.extent import middle_of
from handeye_cli.records import Camera, FloatArray, GreyImage
from handeye_cli.simulate.render import Appearance, rims
from handeye_cli.simulate.scenery import Scenery, random_scenery, render_scene
from handeye_cli.targets.drawing import Drawing, outline_around

_MARGIN = 4.0
"""Pixels between the discs and the image's edge."""
_NOMINAL = 640
"""Width in pixels of an image whose surroundings are as `random_scenery` has them."""


@dataclass(frozen=True)
class DiscView:
    """A picture of a plate and its truth.

    Attributes:
        image: (height, width) grey image.
        camera_T_target: (4, 4) pose of the plate.
        tilt: Angle between the optical axis and the plate's normal, radians.
        ellipses: (n, 2) middles of the discs' images, pixels.
        discs: (n, 2) images of the discs' own centres, pixels.
        width: Median width of the discs' images, pixels.
        drawing: The plate.
        scenery: What is around it, and the shadow on it.
        appearance: Light, ink and lens.
    """

    image: GreyImage
    camera_T_target: FloatArray
    tilt: float
    ellipses: FloatArray
    discs: FloatArray
    width: float
    drawing: Drawing
    scenery: Scenery
    appearance: Appearance


def random_view(
    camera: Camera,
    centres: FloatArray,
    radii: FloatArray,
    rng: np.random.Generator,
    *,
    width_px: tuple[float, float] = (12.0, 60.0),
    tilt: tuple[float, float] = (0.0, np.radians(55.0)),
) -> DiscView:
    """Draw a picture of a plate that is wholly in view.

    Args:
        camera: The intrinsics.
        centres: (n, 3) disc centres in the target frame, z = 0, metres.
        radii: (n,) radii, metres.
        rng: Source of chance.
        width_px: Smallest and largest width of a disc seen straight on from the plate's distance,
            uniform in its logarithm; widths that do not fit into the image are drawn again.
        tilt: Smallest and largest angle, radians.
    """
    discs = np.column_stack([centres[:, :2], radii])
    while True:
        angle = float(rng.uniform(*tilt))
        width = float(np.exp(rng.uniform(*np.log(width_px))))
        pose = _random_pose(camera, centres, (float(np.median(radii)), width), angle, rng)
        outlines = _outlines(camera, pose, discs)
        if outlines is not None:
            break
    pitch = float(np.min(np.linalg.norm(centres[1:] - centres[0], axis=1)))
    plate = Drawing(discs, outline=outline_around(centres[:, :2], rng.uniform(0.75, 1.6) * pitch))
    scenery = random_scenery(rng, camera.width / _NOMINAL)
    drawing = plate if rng.random() < 0.75 else Drawing(discs)
    appearance = random_appearance(rng)
    image = render_scene(camera, pose, drawing, scenery=scenery, rng=rng, appearance=appearance)
    middles = project(se3.transform_points(pose, centres), camera.parameters, camera.model)
    areas, ellipses = _areas_and_middles(outlines)
    width = float(np.median(np.sqrt(4 / np.pi * areas)))
    return DiscView(image, pose, angle, ellipses, middles, width, drawing, scenery, appearance)


def random_appearance(rng: np.random.Generator) -> Appearance:
    """Draw ink, paper, blur, noise and a slope of the light of up to 40 % to either side."""
    slope, direction = rng.uniform(0.0, 0.8), rng.uniform(0.0, 2.0 * np.pi)
    return Appearance(
        ink=float(rng.uniform(15.0, 60.0)),
        paper=float(rng.uniform(140.0, 215.0)),
        background=float(rng.uniform(10.0, 220.0)),
        gradient=(float(slope * np.cos(direction)), float(slope * np.sin(direction))),
        blur_px=float(rng.uniform(0.5, 1.2)),
        noise=float(rng.uniform(1.0, 4.0)),
    )


def _random_pose(
    camera: Camera,
    centres: FloatArray,
    radius_width: tuple[float, float],
    tilt: float,
    rng: np.random.Generator,
) -> FloatArray:
    about, turn = rng.uniform(0.0, 2.0 * np.pi, 2)
    axis = np.array([np.cos(about), np.sin(about), 0.0])
    R = rotations.exp(tilt * axis) @ rotations.exp(np.array([0.0, 0.0, turn]))
    radius, width = radius_width
    distance = 2.0 * camera.fx * radius / width
    u, v = rng.uniform(0.15, 0.85, 2) * [camera.width, camera.height]
    ray = np.array([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0])
    middle = middle_of(centres)
    return se3.from_parts(R, distance * ray - R @ middle)


def _outlines(camera: Camera, pose: FloatArray, discs: FloatArray) -> FloatArray | None:
    """Return the (n, k, 2) outlines of the discs in the image, None unless all are inside."""
    points = se3.transform_points(pose, np.pad(rims(discs), ((0, 0), (0, 0), (0, 1))))
    if points[..., 2].min() < 0.2 * points[..., 2].max():
        return None
    rays = points[..., :2] / points[..., 2:]
    pixels = project(points, camera.parameters, camera.model)
    last = np.array([camera.width, camera.height]) - 1.0 - _MARGIN
    field = np.array([camera.width / camera.fx, camera.height / camera.fy])
    # what lies far outside may be bent back into the image by the distortion
    fits = np.all((pixels > _MARGIN) & (pixels < last)) and np.all(np.abs(rays) < field)
    return np.asarray(pixels) if fits else None


def _areas_and_middles(outlines: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return areas (n,) and centroids (n, 2) of (n, k, 2) polygons."""
    origin = outlines.mean(axis=1, keepdims=True)
    here = outlines - origin
    there = np.roll(here, -1, axis=1)
    cross = here[..., 0] * there[..., 1] - here[..., 1] * there[..., 0]
    area = cross.sum(axis=1) / 2
    middles = np.sum((here + there) * cross[..., None], axis=1) / (6 * area[:, None])
    return np.abs(area), middles + origin[:, 0]

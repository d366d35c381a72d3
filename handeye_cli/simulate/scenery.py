"""Pictures of a plate in surroundings that make it hard to find.

Beside the plate there may be textures, around its shapes dark blobs and discs that are none of
them, over all of it a soft shadow. The plate's shapes stay where and as exact as they are drawn.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from handeye_cli.geometry import se3
from handeye_cli.geometry.camera import project
from handeye_cli.records import Camera, FloatArray, GreyImage
from handeye_cli.simulate.render import Appearance, expose, paint_target
from handeye_cli.targets.drawing import Drawing

_SUBPIXEL_BITS = 4
_CLEARANCE = 1.6
"""Clutter keeps this many radii away from the hull of the shapes' middles."""


@dataclass(frozen=True)
class Scenery:
    """What is around a plate, and the shadow on it.

    Attributes:
        texture: Standard deviation of the grain beside the plate, grey levels.
        grain_px: Size of the grain, pixels.
        blobs: Number of dark, irregular blobs off the target.
        decoys: Number of discs off the target, about as large as its own shapes.
        shadow: Share of the light that a shadow takes.
        shadow_px: Standard deviation of the shadow's soft edge, pixels.
        shadow_angle: Direction in the image, radians from x, to where the shadow lies; its edge
            passes through the middle of the plate.
    """

    texture: float = 0.0
    grain_px: float = 4.0
    blobs: int = 0
    decoys: int = 0
    shadow: float = 0.0
    shadow_px: float = 20.0
    shadow_angle: float = 0.0


def random_scenery(rng: np.random.Generator, size: float = 1.0) -> Scenery:
    """Draw surroundings of any kind.

    Args:
        rng: Source of chance.
        size: Width of the image in units of 640 pixels: grain and shadow grow with it.
    """
    return Scenery(
        texture=float(rng.choice([0.0, rng.uniform(5.0, 40.0)])),
        grain_px=float(size * rng.uniform(1.0, 12.0)),
        blobs=int(rng.integers(0, 9)),
        decoys=int(rng.integers(0, 9)),
        shadow=float(rng.choice([0.0, rng.uniform(0.2, 0.6)])),
        shadow_px=float(size * rng.uniform(3.0, 40.0)),
        shadow_angle=float(rng.uniform(0.0, 2.0 * np.pi)),
    )


def render_scene(
    camera: Camera,
    camera_T_target: FloatArray,
    drawing: Drawing,
    *,
    scenery: Scenery,
    rng: np.random.Generator,
    appearance: Appearance | None = None,
) -> GreyImage:
    """Draw the picture a camera takes of a plate in its surroundings.

    Args:
        camera: The intrinsics.
        camera_T_target: (4, 4) pose of the plate.
        drawing: What is on it.
        scenery: What is around the plate.
        rng: Source of the clutter and of the noise.
        appearance: Light, ink and lens.

    Returns:
        (height, width) grey image.

    Raises:
        UsageError: Part of the plate is behind the camera.
        InputError: The distortion leaves pixels without a direction.
    """
    appearance = appearance or Appearance()
    around = None if drawing.endless else _backdrop(camera, appearance, scenery, rng)
    grey = paint_target(
        camera, camera_T_target, drawing, appearance=appearance, surroundings=around
    )
    pixels, radius = _spots(camera, camera_T_target, drawing)
    clutter = _clutter(grey.shape, pixels, radius, scenery, rng)
    ink = cv2.GaussianBlur(clutter, (0, 0), max(appearance.blur_px, 0.1))
    grey = grey + ink * (np.minimum(grey, appearance.ink) - grey)
    lit = grey * shade(camera, scenery, pixels.mean(axis=0))
    return expose(lit, appearance.noise, rng)


def _spots(
    camera: Camera, camera_T_target: FloatArray, drawing: Drawing
) -> tuple[FloatArray, float]:
    """Return the (n, 2) pixels of the shapes' middles, and the median of their half widths."""
    first, last = np.split(drawing.rectangles, 2, axis=1)
    middles = np.concatenate([drawing.discs[:, :2], (first + last) / 2])
    half = np.concatenate([drawing.discs[:, 2], (last - first)[:, 0] / 2])
    points = np.pad(
        np.stack([middles, middles + half[:, None] * [1.0, 0.0]]), ((0, 0), (0, 0), (0, 1))
    )
    seen = se3.transform_points(camera_T_target, points)
    pixels, rims = project(seen, camera.parameters, camera.model)
    return pixels, float(np.median(np.linalg.norm(rims - pixels, axis=1)))


def _backdrop(
    camera: Camera, appearance: Appearance, scenery: Scenery, rng: np.random.Generator
) -> FloatArray:
    flat = np.full((camera.height, camera.width), appearance.background)
    if scenery.texture == 0.0:
        return flat
    # the grain is drawn small and enlarged, as it has nothing finer than itself
    size = [max(2, round(side / scenery.grain_px)) for side in (camera.width, camera.height)]
    grain = rng.normal(0.0, scenery.texture, size[::-1])
    enlarged = cv2.resize(grain, (camera.width, camera.height), interpolation=cv2.INTER_CUBIC)
    return np.asarray(np.maximum(flat + enlarged, 0.0))


def _clutter(
    size: tuple[int, ...],
    pixels: FloatArray,
    radius: float,
    scenery: Scenery,
    rng: np.random.Generator,
) -> FloatArray:
    """Return how much of each pixel is covered by blobs and decoys.

    Args:
        size: Height and width of the image.
        pixels: (n, 2) shapes of the target, whose hull is left alone.
        radius: Of a shape of the target, pixels.
        scenery: How many there are.
        rng: Source of chance.
    """
    hull = cv2.convexHull(pixels.astype(np.float32))
    mask = np.zeros(size, dtype=np.uint8)
    for outline in [_decoy] * scenery.decoys + [_blob] * scenery.blobs:
        place = rng.uniform(0.0, size[::-1])
        shape = radius * rng.uniform(0.6, 1.3) * outline(rng)
        room = float(np.linalg.norm(shape, axis=1).max()) + _CLEARANCE * radius
        if cv2.pointPolygonTest(hull, place.tolist(), True) < -room:
            drawn = np.rint((place + shape) * 2**_SUBPIXEL_BITS).astype(np.int32)
            cv2.fillPoly(mask, [drawn], (255,), cv2.LINE_AA, _SUBPIXEL_BITS)
    return np.asarray(mask / 255.0)


def _decoy(rng: np.random.Generator) -> FloatArray:
    """Return the (64, 2) outline of an ellipse of radius about 1."""
    angles = 2.0 * np.pi * np.arange(64) / 64
    turn, slim = rng.uniform(0.0, np.pi), rng.uniform(0.6, 1.0)
    x, y = np.cos(angles), slim * np.sin(angles)
    return np.stack(
        [np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y], axis=-1
    )


def _blob(rng: np.random.Generator) -> FloatArray:
    """Return the (64, 2) outline of an irregular blob of radius up to 2."""
    angles = 2.0 * np.pi * np.arange(64) / 64
    waves, phases = rng.uniform(-0.3, 0.3, 3), rng.uniform(0.0, 2.0 * np.pi, 3)
    radius = 1.0 + np.cos(np.arange(2, 5) * angles[:, None] + phases) @ waves
    return np.stack([radius * np.cos(angles), radius * np.sin(angles)], axis=-1)


def shade(camera: Camera, scenery: Scenery, middle: FloatArray) -> FloatArray:
    """Return the (height, width) share of the light that a shadow leaves.

    Args:
        camera: The intrinsics, for the size of the image.
        scenery: The shadow.
        middle: (2,) middle of the plate, pixels.
    """
    across = np.cos(scenery.shadow_angle) * (np.arange(camera.width) - middle[0])
    down = np.sin(scenery.shadow_angle) * (np.arange(camera.height) - middle[1])
    side = (across + down[:, None]) / max(scenery.shadow_px, 1e-3)
    # the logistic curve that is nearest to a Gaussian's edge
    lit = 1.0 / (1.0 + np.exp(np.clip(-1.702 * side, -50.0, 50.0)))
    return np.asarray(1.0 - scenery.shadow * lit)

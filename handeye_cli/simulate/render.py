"""Grey pictures of a drawn target, made from the camera model alone.

Nothing here knows how targets are found, so these pictures can judge a detector.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handeye_cli.errors import UsageError
from handeye_cli.geometry import se3
from handeye_cli.geometry.camera import project
from handeye_cli.records import Camera, FloatArray, GreyImage, IntArray
from handeye_cli.simulate.bowed import FLAT, Bow, require_seen
from handeye_cli.simulate.coverage import coverage
from handeye_cli.simulate.plate_view import View, look
from handeye_cli.targets.drawing import Drawing

_POINTS = 64
"""Points on an outline that bound its image; the chords of a disc between them bulge by 0.1 %."""


@dataclass(frozen=True)
class Appearance:
    """Light, ink and lens of a drawn picture; grey levels are 0 to 255.

    Attributes:
        ink: Grey level of the target's shapes.
        paper: Grey level of the plate.
        background: Grey level beside the plate.
        gradient: Relative change of the light from the left to the right edge of the image, and
            from the top to the bottom.
        blur_px: Standard deviation of the Gaussian blur before the pixels integrate, pixels.
        noise: Standard deviation of a pixel, grey levels.
    """

    ink: float = 35.0
    paper: float = 205.0
    background: float = 80.0
    gradient: tuple[float, float] = (0.0, 0.0)
    blur_px: float = 0.7
    noise: float = 0.0


def render_target(
    camera: Camera,
    camera_T_target: FloatArray,
    drawing: Drawing,
    *,
    appearance: Appearance | None = None,
    rng: np.random.Generator | None = None,
) -> GreyImage:
    """Draw the picture a camera takes of a target.

    Args:
        camera: The intrinsics.
        camera_T_target: (4, 4) pose of the target.
        drawing: What is on it.
        appearance: Light, ink and lens.
        rng: Source of the noise, or None for a picture without.

    Returns:
        (height, width) grey image.

    Raises:
        UsageError: Part of the target is behind the camera.
        InputError: The distortion leaves pixels without a direction.
    """
    appearance = appearance or Appearance()
    light = paint_target(camera, camera_T_target, drawing, appearance=appearance)
    return expose(light, appearance.noise, rng)


def expose(light: FloatArray, noise: float, rng: np.random.Generator | None) -> GreyImage:
    """Return what a sensor of eight bits makes of light.

    Args:
        light: (height, width) grey levels.
        noise: Standard deviation of a pixel, grey levels.
        rng: Source of the noise, or None for a picture without.

    Returns:
        (height, width) grey image, clipped to 0 and 255.
    """
    if rng is not None:
        light = light + rng.normal(0.0, noise, light.shape)
    return np.clip(np.rint(light), 0, 255).astype(np.uint8)


def paint_target(
    camera: Camera,
    camera_T_target: FloatArray,
    drawing: Drawing,
    *,
    appearance: Appearance | None = None,
    surroundings: FloatArray | None = None,
    bow: Bow = FLAT,
) -> FloatArray:
    """Return the light of the picture, in grey levels before noise and rounding.

    Args:
        camera: The intrinsics.
        camera_T_target: (4, 4) pose of the target.
        drawing: What is on it.
        appearance: Light, ink and lens.
        surroundings: (height, width) grey levels beside the plate in even light, None for the
            background of the appearance.
        bow: How the target is bent.

    Returns:
        (height, width) grey levels.

    Raises:
        UsageError: Part of the target is behind the camera, or bent out of its sight.
        InputError: The distortion leaves pixels without a direction.
    """
    appearance = appearance or Appearance()
    require_seen(bow, camera_T_target, extent_of(drawing))
    view = look(camera, camera_T_target, appearance.blur_px, bow)
    dark = _dark(view, camera_T_target, drawing, bow)
    around = appearance.background if surroundings is None else surroundings
    light = (
        around
        + (appearance.paper - around) * _plate(view, drawing.outline)
        + (appearance.ink - appearance.paper) * dark
    )
    return np.asarray(light * _illumination(camera, appearance.gradient))


def _dark(view: View, camera_T_target: FloatArray, drawing: Drawing, bow: Bow) -> FloatArray:
    discs, rectangles = drawing.discs, drawing.rectangles

    def beyond_the_rim(points: FloatArray, k: IntArray) -> FloatArray:
        away = np.linalg.norm(points - discs[k, :2], axis=-1, keepdims=True)
        return np.asarray(away - discs[k, 2:])

    def beyond_the_sides(points: FloatArray, k: IntArray) -> FloatArray:
        return _beyond(points, rectangles[k])

    disc_boxes, rectangle_boxes = (
        _boxes(view.camera, se3.transform_points(camera_T_target, bow.lifted(outlines)))
        for outlines in (rims(discs), _borders(rectangles))
    )
    round_part = coverage(view, disc_boxes, beyond_the_rim)
    return round_part + coverage(view, rectangle_boxes, beyond_the_sides)


def _plate(view: View, outline: FloatArray) -> FloatArray:
    last = np.array([view.camera.width, view.camera.height]) + view.margin
    everywhere = np.array([[[-view.margin, -view.margin], last]])

    def beyond_the_nearest_side(points: FloatArray, _: IntArray) -> FloatArray:
        # One distance will do: nothing is measured at the corners of a plate.
        return np.asarray(_beyond(points, outline.ravel()).max(axis=-1, keepdims=True))

    return coverage(view, everywhere, beyond_the_nearest_side)


def _beyond(points: FloatArray, rectangle: FloatArray) -> FloatArray:
    """Return the (..., 2) distances by which points lie beyond the sides of (..., 4) rectangles."""
    return np.maximum(rectangle[..., :2] - points, points - rectangle[..., 2:])


def _illumination(camera: Camera, gradient: tuple[float, float]) -> FloatArray:
    across = gradient[0] * np.linspace(-0.5, 0.5, camera.width)
    down = gradient[1] * np.linspace(-0.5, 0.5, camera.height)
    return 1.0 + across + down[:, None]


def extent_of(drawing: Drawing) -> FloatArray:
    """Return the (2, 2) smallest and largest x, y of the plate, or of its shapes if endless."""
    if not drawing.endless:
        return drawing.outline
    points = np.concatenate([rims(drawing.discs), _borders(drawing.rectangles)]).reshape(-1, 2)
    return np.stack([points.min(axis=0), points.max(axis=0)])


def rims(discs: FloatArray) -> FloatArray:
    """Return (n, 64, 2) points on the outlines of (n, 3) discs, in the unit of the discs."""
    angle = 2.0 * np.pi * np.arange(_POINTS) / _POINTS
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return np.asarray(discs[:, None, :2] + discs[:, None, 2:] * circle)


def _borders(rectangles: FloatArray) -> FloatArray:
    """Return (m, 64, 2) points on the outlines of (m, 4) rectangles, the corners among them."""
    along = np.arange(_POINTS // 4) / (_POINTS // 4)
    zero, one = np.zeros_like(along), np.ones_like(along)
    x = np.concatenate([along, one, 1.0 - along, zero])
    y = np.concatenate([zero, along, one, 1.0 - along])
    first, last = rectangles[:, None, :2], rectangles[:, None, 2:]
    return np.asarray(first + (last - first) * np.stack([x, y], axis=-1))


def _boxes(camera: Camera, points: FloatArray) -> IntArray:
    """Return the (n, 2, 2) first and last pixels (u, v) around outlines of (n, k, 3) points."""
    nearest = float(points[..., 2].min(initial=np.inf))
    if nearest <= 0.0:
        raise UsageError(
            "expected the whole target in front of the camera, "
            f"found a part {-1e3 * nearest:g} mm behind",
            hint="take a larger distance or a smaller tilt",
        )
    pixels = project(points, camera.parameters, camera.model)
    bulge = 2.0 + 0.002 * np.ptp(pixels, axis=1)
    corners = np.stack([pixels.min(axis=1) - bulge, pixels.max(axis=1) + bulge], axis=1)
    size = np.array([camera.width, camera.height])
    return np.asarray(np.clip(np.rint(corners), -size, 2 * size), dtype=np.int64)

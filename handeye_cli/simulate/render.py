"""Grey pictures of a plate with dark discs, drawn from the camera model alone.

Nothing here knows how discs are found, so these pictures can judge a detector.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handeye_cli.errors import UsageError
from handeye_cli.geometry import se3
from handeye_cli.geometry.camera import project
from handeye_cli.records import Camera, FloatArray, GreyImage, IntArray
from handeye_cli.simulate.coverage import View, coverage, look

_OUTLINE = 64
"""Points on a disc's outline that bound its image; the chords between them bulge by 0.1 %."""


@dataclass(frozen=True)
class Appearance:
    """Light, ink and lens of a drawn picture; grey levels are 0 to 255.

    Attributes:
        ink: Grey level of the discs.
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


def render_discs(
    camera: Camera,
    camera_T_target: FloatArray,
    centres: FloatArray,
    radii: FloatArray,
    *,
    outline: FloatArray | None = None,
    appearance: Appearance | None = None,
    rng: np.random.Generator | None = None,
) -> GreyImage:
    """Draw the picture a camera takes of a plate with discs.

    Args:
        camera: The intrinsics.
        camera_T_target: (4, 4) pose of the plate.
        centres: (n, 3) disc centres in the target frame, z = 0, metres.
        radii: (n,) radii, metres.
        outline: (2, 2) opposite corners (x, y) of the plate, metres; None is paper everywhere.
        appearance: Light, ink and lens.
        rng: Source of the noise, or None for a picture without.

    Returns:
        (height, width) grey image.

    Raises:
        UsageError: Part of the plate is behind the camera.
        InputError: The distortion leaves pixels without a direction.
    """
    appearance = appearance or Appearance()
    grey = paint_discs(
        camera, camera_T_target, centres, radii, outline=outline, appearance=appearance
    )
    if rng is not None:
        grey = grey + rng.normal(0.0, appearance.noise, grey.shape)
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)


def paint_discs(
    camera: Camera,
    camera_T_target: FloatArray,
    centres: FloatArray,
    radii: FloatArray,
    *,
    outline: FloatArray | None = None,
    appearance: Appearance | None = None,
) -> FloatArray:
    """Return the (height, width) light of the picture, in grey levels before noise and rounding.

    The arguments and errors are those of `render_discs`.
    """
    appearance = appearance or Appearance()
    view = look(camera, camera_T_target, appearance.blur_px)
    discs = coverage(
        view,
        _boxes(camera, camera_T_target, centres, radii),
        lambda points, owner: np.linalg.norm(points - centres[owner, :2], axis=-1) - radii[owner],
    )
    plate = np.ones_like(discs) if outline is None else _plate_coverage(view, outline)
    grey = (
        appearance.background
        + (appearance.paper - appearance.background) * plate
        + (appearance.ink - appearance.paper) * discs
    )
    return np.asarray(grey * _illumination(camera, appearance.gradient))


def _plate_coverage(view: View, outline: FloatArray) -> FloatArray:
    middle, half = np.mean(outline, axis=0), 0.5 * np.abs(np.diff(outline, axis=0))[0]
    everywhere = np.array([[[0, 0], view.reach.shape[::-1]]]) - view.margin
    return coverage(
        view, everywhere, lambda points, _: np.max(np.abs(points - middle) - half, axis=-1)
    )


def _illumination(camera: Camera, gradient: tuple[float, float]) -> FloatArray:
    across = gradient[0] * np.linspace(-0.5, 0.5, camera.width)
    down = gradient[1] * np.linspace(-0.5, 0.5, camera.height)
    return 1.0 + across + down[:, None]


def _boxes(
    camera: Camera, camera_T_target: FloatArray, centres: FloatArray, radii: FloatArray
) -> IntArray:
    """Return the (n, 2, 2) first and last pixels (u, v) around the images of the discs."""
    angles = 2.0 * np.pi * np.arange(_OUTLINE) / _OUTLINE
    circle = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=-1)
    points = se3.transform_points(
        camera_T_target, centres[:, None, :] + radii[:, None, None] * circle
    )
    nearest = float(points[..., 2].min())
    if nearest <= 0.0:
        raise UsageError(
            f"expected every disc in front of the camera, found one {-1e3 * nearest:g} mm behind",
            hint="take a larger distance or a smaller tilt",
        )
    pixels = project(points, camera.parameters, camera.model)
    bulge = 2.0 + 0.002 * np.ptp(pixels, axis=1)
    corners = np.stack([pixels.min(axis=1) - bulge, pixels.max(axis=1) + bulge], axis=1)
    size = np.array([camera.width, camera.height])
    return np.asarray(np.clip(np.rint(corners), -size, 2 * size), dtype=np.int64)

"""Corners of dark squares by maximum likelihood: the blurred edges of the sides fitted to pixels.

A side is a straight line on the plate, carried into the image by the map from plate to pixels, so
perspective and lens distortion are part of the model. What is fitted is how far its image lies
aside at both ends; the corners are where the lines meet. All sides of all squares of an image are
fitted at once, in single precision, which is far finer than a grey level.

With the distances d of a pixel from the side and h from the inner edge of the square's border, in
blurs and positive inside, the dark covers a share S of the pixel,

    S = Phi(d) - w Phi(h) - r phi(h),   grey = light (1 - (1 - ink) S),   light = p0 + p1 x + q d

The light cells behind the border take the share w of that row; r is the first term of Mehler's
series for the chances of two correlated normal variables, as the cells' other ends lean. The slope
q of the light across a side looks much like a shift: it is that between opposite sides. Grey levels
are clipped where the sensor clips.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.blurred_edge import SingleArray, normal_distribution
from handeye_cli.geometry.camera import PlateToPixel
from handeye_cli.geometry.disc_pixels import forward_jacobian
from handeye_cli.geometry.edge_pixels import (
    SIDES,
    Band,
    FloatArray,
    Squares,
    band_pixels,
    image_sides,
    quarter_turn,
)
from handeye_cli.geometry.sensor_limits import (
    FIRST_NOISE,
    clip_model,
    fainter,
    held_within,
)

_FIRST_BLUR = 0.8
_FIRST_BAND = 3.0
_FIRST_LENGTH = 40
"""The first round takes this many columns or rows of a side, within this band."""
_BAND_BLURS = 4.0
_BAND_LIMITS = (2.0, 12.0)
"""Then all pixels within this multiple of the blur take part, and the band's limits."""
_BLUR_LIMITS = (0.3, 6.0)
_FIRST_STEPS, _LAST_STEPS, _STEPS_CLIPPED = 4, 3, 8
_ROUNDS = (2, 4)
_AT_REST = 0.05
"""Least and most rounds; they end when no side has moved by more, in pixels."""
_SHIFT, _BLUR, _LIGHT, _ALONG, _INK = slice(0, 2), 2, 3, 4, 5
_PARAMETERS = 6
_LARGEST_STEP = np.array([0.8, 0.8, 0.4, 1e9, 1e9, 0.3])
_BLUR_SPREAD, _LIGHT_SPREAD, _INK_SPREAD = 0.1, 0.01, 0.02
"""How far the sides of a square may differ: blurs in pixels, light relative, ink."""
_PLANE = np.array(
    [[1, 0, -1], [0, 1, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [0, -1, 0], [1, -1, 0], [0, 0, -1.0]]
)
"""Light p0 and p1 of each side, if light is a plane, by its middle and its slopes in x and y."""
_AREA = (0.2, 5.0)
"""Areas between two sides, in areas of the square, outside of which a fit has lost its square."""
_HOPELESS = 255.0**2
"""Misfit of a lost square: no grey level can be more wrong."""
_STEP = 0.1
"""Share of a side over which the map from the plate to pixels is differentiated."""


@dataclass(frozen=True)
class SquareFit:
    """Fitted squares of one image.

    Attributes:
        pixels: (n, 4, 2) images of the corners.
        covariance: (n, 4, 2, 2) of these from the image noise, square pixels.
        noise: Standard deviation of a grey level, from the residuals.
        blur: (n, 4) standard deviation of each side's edge, pixels.
        contrast: (n, 4) grey levels from ink to paper along each side; negative for light squares.
        misfit: (n, 4) mean square residual of each side, square grey levels.
    """

    pixels: FloatArray
    covariance: FloatArray
    noise: float
    blur: FloatArray
    contrast: FloatArray
    misfit: FloatArray


def fit_squares(
    image: NDArray[np.uint8], squares: Squares, to_pixel: PlateToPixel, start: FloatArray
) -> SquareFit:
    """Fit all squares of a plate in one image.

    Args:
        image: (height, width) grey image.
        squares: The squares.
        to_pixel: Map of (..., 2) plate points to (..., 2) pixels. Only its lens distortion matters
            for the result, its perspective need not be more exact than `start`.
        start: (n, 4, 2) first guess of the corners in the image, good to one or two pixels.
    """
    last = _rounds(image, squares, to_pixel, start)
    noise = math.sqrt(float(np.median(last.misfit)))
    shape, state = start.shape[:2], last.state
    covariance = _corner_covariance(last.quads, to_pixel, last.normal)
    return SquareFit(
        pixels=to_pixel(last.quads),
        covariance=noise**2 * covariance,
        noise=noise,
        blur=state[:, _BLUR].reshape(shape),
        contrast=(state[:, _LIGHT] * (1.0 - state[:, _INK])).reshape(shape),
        misfit=last.misfit.reshape(shape),
    )


@dataclass(frozen=True)
class _Round:
    """What a round of the fit ended with.

    Attributes:
        quads: (n, 4, 2) corners on the plate.
        state: (m, 6) parameters of the sides; their shifts are in the corners already.
        normal: (n, 24, 24) normal matrices of the squares' parameters.
        misfit: (m,) mean square residuals.
    """

    quads: FloatArray
    state: FloatArray
    normal: FloatArray
    misfit: FloatArray


def _rounds(
    image: NDArray[np.uint8], squares: Squares, to_pixel: PlateToPixel, start: FloatArray
) -> _Round:
    """Fit the sides from (n, 4, 2) pixels on, choosing pixels anew until the sides are at rest."""
    quads = _start_quads(squares.corners, to_pixel, start)
    lost = ~_sound(quads, squares.corners)
    quads = np.where(lost[:, None, None], squares.corners, quads)
    blur, band = np.full(SIDES * len(quads), _FIRST_BLUR), _FIRST_BAND
    state, across = np.zeros((len(blur), _PARAMETERS)), np.zeros(len(blur))
    noise = FIRST_NOISE
    for number in range(_ROUNDS[1]):
        sides = image_sides(quads, squares.cells, to_pixel)
        thinned = max(int(np.max(sides.length)) // _FIRST_LENGTH, 1)
        pixels = band_pixels(image, squares, sides, blur, band, step=1 if number else thinned)
        state[:, _SHIFT] = 0.0
        origin = state if number else _first_state(pixels, blur)
        steps = _LAST_STEPS if number else _FIRST_STEPS
        steps = _STEPS_CLIPPED if pixels.clipped else steps
        state, normal, left, count = _iterate(pixels, origin, across, noise, steps)
        moved = _moved(quads, to_pixel, state[:, _SHIFT])
        lost |= ~_sound(moved, squares.corners)
        quads = np.where(lost[:, None, None], quads, moved)
        if number + 1 >= _ROUNDS[0] and np.max(np.abs(state[:, _SHIFT])) < _AT_REST:
            break
        across = _light_across(state, squares.cells * sides.depth[:, 0])
        blur, noise = state[:, _BLUR], _noise(left, count)
        band = min(max(_BAND_BLURS * float(np.median(blur)), _BAND_LIMITS[0]), _BAND_LIMITS[1])
    surplus = np.maximum(count - _PARAMETERS, 1.0)
    misfit = np.where(np.repeat(lost, SIDES), _HOPELESS, left / surplus)
    return _Round(quads, state, normal, misfit)


def _sound(quads: FloatArray, corners: FloatArray) -> NDArray[np.bool_]:
    """Return (n,) whether quads still are squares of the (n, 4, 2) corners' size, roughly."""
    side = np.roll(quads, -1, axis=1) - quads
    turned = np.sum(quarter_turn(side) * np.roll(side, -1, axis=1), axis=-1)
    area = turned / np.sum((corners[:, 1] - corners[:, 0]) ** 2, axis=-1)[:, None]
    return np.asarray(np.all((area > _AREA[0]) & (area < _AREA[1]), axis=1))


def _start_quads(corners: FloatArray, to_pixel: PlateToPixel, start: FloatArray) -> FloatArray:
    """Return the (n, 4, 2) points of the plate that are seen where the corners start."""
    quads = corners
    for _ in range(2):
        ahead = _jacobian(quads, to_pixel)
        quads = quads + np.linalg.solve(ahead, (start - to_pixel(quads))[..., None])[..., 0]
    return quads


def _jacobian(quads: FloatArray, to_pixel: PlateToPixel) -> FloatArray:
    """Return the (n, 4, 2, 2) derivatives of pixels by plate at the corners."""
    size = np.linalg.norm(np.roll(quads, -1, axis=1) - quads, axis=-1)
    J = forward_jacobian(to_pixel, quads.reshape(-1, 2), _STEP * size.ravel())
    return J.reshape(*quads.shape, 2)


def _model(band: Band, state: FloatArray, across: FloatArray) -> tuple[SingleArray, SingleArray]:
    """Return the (m, p) grey levels and their (m, 6, p) derivatives."""
    single = state.astype(np.float32)[..., None]
    blur, ink = single[:, _BLUR], single[:, _INK]
    x, centred = band.place, 2.0 * band.place - 1.0
    moved = single[:, 0] + x * (single[:, 1] - single[:, 0])
    d = (band.distance - moved) / blur
    covered, density = normal_distribution(d)
    by_blur = density * d
    if band.cells is not None:
        h, (share, ends) = (band.behind - moved) / blur, band.cells
        beyond, dense = normal_distribution(h)
        covered -= share * beyond + ends * dense
        dense *= share - ends * h
        density -= dense
        by_blur -= dense * h
    light = single[:, _LIGHT] + single[:, _ALONG] * centred
    light += across.astype(np.float32)[:, None] * band.distance
    paper = 1.0 - (1.0 - ink) * covered
    gain = light * ((1.0 - ink) / blur)
    J = np.empty((len(state), _PARAMETERS, x.shape[1]), dtype=np.float32)
    by_moved = np.multiply(gain, density, out=J[:, 0])
    np.multiply(by_moved, x, out=J[:, 1])
    J[:, 0] -= J[:, 1]
    np.multiply(gain, by_blur, out=J[:, _BLUR])
    J[:, _LIGHT] = paper
    np.multiply(paper, centred, out=J[:, _ALONG])
    np.multiply(light, covered, out=J[:, _INK])
    return light * paper, J


def _first_state(band: Band, blur: FloatArray) -> FloatArray:
    """Return the (m, 6) state at the start: light and ink of each square by least squares."""
    state = np.zeros((len(blur), _PARAMETERS))
    state[:, _BLUR], state[:, _LIGHT] = blur, 1.0
    # With light 1 and ink 0 the model is the share of paper.
    paper, _ = _model(band, state, np.zeros(len(blur)))
    weight = fainter(band.weight, band.at_limits)
    rows = np.stack([paper, 1.0 - paper], axis=1) * weight[:, None]
    normal = _by_square(rows @ np.swapaxes(rows, -1, -2)) + 1e-6 * np.eye(2)
    right = _by_square(rows @ (weight * band.grey)[..., None])
    light, dark = np.repeat(np.linalg.solve(normal, right)[..., 0], SIDES, axis=0).T
    state[:, _LIGHT] = np.maximum(light, 1.0)
    state[:, _INK] = dark / state[:, _LIGHT]
    return state


def _by_square(sides: NDArray[np.float32]) -> FloatArray:
    return np.asarray(sides.reshape(-1, SIDES, *sides.shape[1:]).sum(axis=1), dtype=float)


def _ties() -> tuple[FloatArray, FloatArray]:
    """Return (24, 24) information that the sides of a square have much in common.

    Tiny squares leave too few pixels to tell shift, blur, light and ink of a side apart. The first
    matrix ties blur and ink, the second the light, for light of mean 1.
    """
    size = SIDES * _PARAMETERS
    common = np.eye(SIDES) - 1.0 / SIDES
    bent = np.eye(2 * SIDES) - _PLANE @ np.linalg.pinv(_PLANE)
    fixed, light = np.zeros((2, SIDES, _PARAMETERS, SIDES, _PARAMETERS))
    fixed[:, _BLUR, :, _BLUR] = common / _BLUR_SPREAD**2
    fixed[:, _INK, :, _INK] = common / _INK_SPREAD**2
    pair = slice(_LIGHT, _ALONG + 1)
    light[:, pair, :, pair] = bent.reshape(SIDES, 2, SIDES, 2) / _LIGHT_SPREAD**2
    return fixed.reshape(size, size), light.reshape(size, size)


_TIES = _ties()


def _iterate(
    band: Band, state: FloatArray, across: FloatArray, noise: float, steps: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the state after some Gauss-Newton steps, and what the last of them saw.

    Returns:
        (m, 6) state; (n, 24, 24) normal matrices, (m,) squared residuals and (m,) pixels that tell
        of the light before the last step.
    """
    size = SIDES * _PARAMETERS
    whole = band.weight.sum(axis=1, dtype=float)
    largest = np.tile(_LARGEST_STEP, SIDES)
    for _ in range(steps):
        sides, wanted, squared, lost = _normal_equations(band, state, across, noise)
        count = np.maximum(whole - lost, 1.0)
        together = state.reshape(-1, size)
        level = np.mean(state[:, _LIGHT].reshape(-1, SIDES), axis=1)[:, None, None]
        ties = _noise(squared, count) ** 2 * (_TIES[0] + _TIES[1] / level**2)
        normal = _block_diagonal(sides) + ties
        right = wanted.reshape(-1, size, 1) - ties @ together[..., None]
        diagonal = np.einsum("nii->ni", normal)
        diagonal += 1e-6 * (diagonal + 1e-9)
        step = np.linalg.solve(normal, right)[..., 0]
        state = (together + np.clip(step, -largest, largest)).reshape(-1, _PARAMETERS)
        state[:, _BLUR] = np.clip(state[:, _BLUR], *_BLUR_LIMITS)
    return state, normal, squared, count


def _normal_equations(
    band: Band, state: FloatArray, across: FloatArray, noise: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the normal equations of each side by itself.

    Returns:
        (m, 6, 6) and (m, 6) the equations, (m,) squared residuals, (m,) pixels lost to clipping.
    """
    model, J = _model(band, state, across)
    lost = clip_model(model, J, band.weight, noise) if band.clipped else np.zeros(len(state))
    left = (band.grey - model) * band.weight
    J *= band.weight[:, None]
    squared = np.sum(left * left, axis=1, dtype=float)
    normal = (J @ np.swapaxes(J, -1, -2)).astype(float)
    wanted = (J @ left[..., None])[..., 0].astype(float)
    if band.clipped:
        normal, wanted = held_within(normal, wanted, state, (_LIGHT, _INK), noise)
    return normal, wanted, squared, lost


def _noise(squared: FloatArray, count: FloatArray) -> float:
    """Return the typical residual of a side."""
    return math.sqrt(float(np.median(squared / count)))


def _block_diagonal(blocks: FloatArray) -> FloatArray:
    """Return the (n, 24, 24) matrices of four (6, 6) blocks each, from (4 n, 6, 6)."""
    count, size = len(blocks) // SIDES, blocks.shape[-1]
    matrix = np.zeros((count, SIDES, size, SIDES, size))
    side = np.arange(SIDES)
    matrix[:, side, :, side] = np.swapaxes(blocks.reshape(count, SIDES, size, size), 0, 1)
    return matrix.reshape(count, SIDES * size, SIDES * size)


def _light_across(state: FloatArray, size: FloatArray) -> FloatArray:
    """Return the (m,) slopes of the light into the squares, of these sizes in pixels."""
    light = state[:, _LIGHT].reshape(-1, SIDES)
    return np.asarray((np.roll(light, 2, axis=1) - light).ravel() / size)


def _end_normals(quads: FloatArray, to_pixel: PlateToPixel) -> tuple[FloatArray, FloatArray]:
    """Return how the sides' images move at their ends when the sides move on the plate.

    Returns:
        (n, 4, 2, 2) inward unit normals in the image at the first and the last corner of each side,
        (n, 4, 2) pixels along them per metre across the side on the plate.
    """
    side = (np.roll(quads, -1, axis=1) - quads)[:, :, None]
    inward = quarter_turn(side) / np.linalg.norm(side, axis=-1, keepdims=True)
    J = _jacobian(quads, to_pixel)
    J = np.stack([J, np.roll(J, -1, axis=1)], axis=2)
    normal = quarter_turn((J @ side[..., None])[..., 0])
    normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    return normal, np.sum(normal * (J @ inward[..., None])[..., 0], axis=-1)


def _moved(quads: FloatArray, to_pixel: PlateToPixel, shift: FloatArray) -> FloatArray:
    """Return the (n, 4, 2) corners after the ends of the sides moved inwards by (m, 2) pixels."""
    _, gain = _end_normals(quads, to_pixel)
    following = np.roll(quads, -1, axis=1)
    side = following - quads
    inward = quarter_turn(side) / np.linalg.norm(side, axis=-1, keepdims=True)
    by = shift.reshape(gain.shape) / gain
    first, last = quads + by[..., :1] * inward, following + by[..., 1:] * inward
    normal = quarter_turn(last - first)
    before = np.roll(normal, 1, axis=1)
    rows = np.stack([before, normal], axis=-2)
    right = np.stack(
        [np.sum(before * np.roll(last, 1, axis=1), axis=-1), np.sum(normal * first, axis=-1)], -1
    )
    return np.asarray(np.linalg.solve(rows, right[..., None])[..., 0])


def _corner_covariance(
    quads: FloatArray, to_pixel: PlateToPixel, information: FloatArray
) -> FloatArray:
    """Return the (n, 4, 2, 2) covariance of corners from the (n, 24, 24) information on sides."""
    normal, _ = _end_normals(quads, to_pixel)
    side = np.arange(SIDES)
    # the last corner of the side before, and the first of the side itself
    ends = np.stack([_PARAMETERS * np.roll(side, 1) + 1, _PARAMETERS * side], axis=-1)
    shifts = np.linalg.inv(information)[:, ends[:, :, None], ends[:, None, :]]
    rows = np.stack([np.roll(normal[:, :, 1], 1, axis=1), normal[:, :, 0]], axis=-2)
    back = np.linalg.inv(rows)
    return np.asarray(back @ shifts @ np.swapaxes(back, -1, -2), dtype=float)

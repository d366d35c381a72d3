"""Whether the residuals in the images are smooth over the plate, or over the image.

A pose takes up most of what a bent plate or a wrong lens does to one view. What is left is random
where nothing is wrong. Where it follows the plate through all views, the plate is not as declared;
where it follows the image, the lens is not. Views that are all alike cannot tell the two apart.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.conventions import MM, MRAD
from handeye_cli.diagnosis.common_causes import SIGNIFICANCE, Look, Sized, Test
from handeye_cli.geometry import se3
from handeye_cli.geometry.plate_surface import BOW
from handeye_cli.pixel_data import PixelData, pixel_data
from handeye_cli.records import Finding, FloatArray, IntArray, Stations
from handeye_cli.records.blame import SmoothResiduals
from handeye_cli.wording import CALIBRATE_AGAIN

LENS = "residuals-over-image"
"""Code of the finding that the lens is not as the intrinsics say."""
UNCLEAR = "plate-or-lens"
"""Code of the finding that one of the two is bent, and that the views do not tell which."""
_MIN_VIEWS = 3
_AS_MUCH = 0.8
"""Part of what a distortion of the image explains from which a plate explains as much."""
_SEEN = 3.0
"""Standard deviations from which a strain of the plate is told."""
_RICHEST = "rational_polynomial"
"""Lens model with the most coefficients."""
_ELSEWHERE = (
    "calibrate the camera with another target, flat and stiff, in all parts of the image, and give "
    "the result with --camera"
)
"""What tells lens and plate apart whatever has been tried before."""
_TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class PlateShape:
    """What the residuals of M views say of the plate and of the lens.

    Attributes:
        seen: The sizes.
        findings: The verdicts.
        index: (M,) position of each view's station in the document.
        by_plate: (M, 6) perturbations of the target's poses that the plate's shape makes necessary;
            zero where it was not found to be another than declared.
        by_image: (M, 6) the same of what the intrinsics do not model.
        freedom: Degrees of freedom of the residuals.
    """

    seen: SmoothResiduals
    findings: tuple[Finding, ...]
    index: IntArray
    by_plate: FloatArray
    by_image: FloatArray
    freedom: int

    def moves(self, chain: Chain) -> tuple[FloatArray, FloatArray]:
        """Return (N, 6) of `by_plate` and of `by_image` for the stations of a chain."""
        rows = np.searchsorted(self.index, chain.index)
        return self.by_plate[rows], self.by_image[rows]

    @property
    def noise_share(self) -> float:
        """Part of the variance of the pixels that is noise, and not what was found."""
        found = np.any(self.by_plate) or np.any(self.by_image)
        return (self.seen.pixel_left / self.seen.pixel) ** 2 if found else 1.0

    def answer_covariance(self, chain: Chain, influence: FloatArray) -> FloatArray:
        """Return the (12, 12) mean squares that what was found adds to the errors of X and Z.

        Args:
            chain: The N stations of the answer, whose target poses rest on a straight plate.
            influence: (N, 12, 12) how X and Z move with each station's poses.
        """
        moved = np.stack([np.einsum("nij,nj->i", influence[..., 6:], m) for m in self.moves(chain)])
        return np.asarray(moved.T @ moved)

    def beside(self, chain: Chain) -> Chain:
        """Return a chain that knows what was found as more errors that its target poses share.

        With it `systematic_errors` puts them down neither to the robot nor to the pixels' noise.
        """
        columns = np.stack(self.moves(chain), axis=-1)
        return replace(
            chain,
            camera_covariance=chain.camera_covariance * self.noise_share,
            by_intrinsics=np.concatenate([chain.by_intrinsics, columns], axis=-1),
        )


def plate_shape(stations: Stations) -> PlateShape | None:
    """Look for what the residuals of all views have in common.

    Args:
        stations: A document; those of its stations with pixels and a target pose are looked at.

    Returns:
        The verdict, or None where there are no pixels or too few for one.

    Raises:
        InputError: Pixels have no place on the target, or are not those of the station's pose.
    """
    if stations.target is None or stations.camera is None:
        return None
    data = pixel_data(stations)
    if len(data.poses) < _MIN_VIEWS:
        return None
    look = Look.at(data)
    if look.equations.freedom < 2 * len(look.equations.before):
        return None
    return _verdict(look, data)


@dataclass(frozen=True)
class _Causes:
    """Which causes were found.

    Attributes:
        bowed: The plate's surface is no plane.
        strained: Its pitches are not as declared.
        lens: The image is distorted otherwise than the intrinsics say.
        unclear: Something is bent, plate or lens, and the views do not tell which, or each of them
            explains as much and no bow is certain.
    """

    bowed: bool
    strained: bool
    lens: bool
    unclear: bool


def _verdict(look: Look, data: PixelData) -> PlateShape:
    plate, image = look.causes.plate, look.causes.image
    straight = look.with_plate() if look.test(plate).passed else look
    beyond = straight.test(image, plate)
    both = look.test(image).passed and beyond.passed
    sized = look.sized(plate, image) if both else look.sized(plate)
    found = _causes(look, sized, beyond)
    ended = straight if found.bowed or found.strained else look
    shape = (plate,) if ended is not look else ()
    distorted = (image,) if found.lens or beyond.passed else ()
    known = np.concatenate([look.causes.lens, *shape])
    seen = _sizes(look, sized, ended.pixels(*shape, *distorted))
    # What the lens takes up of these pixels by itself is no matter of the plate.
    by_plate = se3.difference(ended.views.poses, data.poses) - look.equations.moves(
        look.causes.lens
    )
    by_image = ended.equations.moves_beyond(known, image)
    return PlateShape(
        seen=seen,
        findings=tuple(_findings(look, seen, found, data)),
        index=data.views.index,
        by_plate=by_plate if shape else np.zeros_like(by_plate),
        by_image=by_image if distorted else np.zeros_like(by_image),
        freedom=look.equations.freedom,
    )


def _causes(look: Look, sized: Sized, beyond: Test) -> _Causes:
    bow, strain, image = look.bow, look.strain, look.causes.image
    bowed, strained = (
        look.test(columns, known).passed
        and look.test(columns, known, image).passed
        and sized.chance(columns) < SIGNIFICANCE
        for columns, known in ((bow, strain), (strain, bow))
    )
    by_plate, by_image = look.test(look.causes.plate), look.test(image)
    as_much = by_plate.passed and by_plate.share >= _AS_MUCH * by_image.share
    lens = beyond.passed and (bowed or not as_much)
    either = by_image.passed and not (lens or bowed or (strained and not beyond.passed))
    return _Causes(
        bowed=bowed,
        strained=strained,
        lens=lens or (either and not by_plate.passed),
        unclear=either and by_plate.passed,
    )


def _sizes(look: Look, sized: Sized, left: float) -> SmoothResiduals:
    bow, bow_sigma = _height(look, sized)
    (aspect, shear), _ = sized.part(look.strain)
    shown = np.diag(sized.by_pixels)[np.searchsorted(sized.columns, look.strain)] > 0.0
    aspect_sigma, shear_sigma = (
        sized.sigma(look.strain, axis) if seen else math.inf
        for axis, seen in zip(np.eye(2), shown, strict=True)
    )
    return SmoothResiduals(
        pixel=look.pixels(),
        pixel_left=left,
        bow=bow,
        bow_sigma=bow_sigma,
        aspect=float(aspect),
        aspect_sigma=aspect_sigma,
        shear=float(shear),
        shear_sigma=shear_sigma,
        plate_share=look.test(look.causes.plate).share,
        image_share=look.test(look.causes.image).share,
    )


def _height(look: Look, sized: Sized) -> tuple[float, float]:
    """Return the bow from its lowest to its highest point, and its standard deviation."""
    shown = look.views.seen.mask.any(axis=0)
    surface = look.causes.fields[shown][:, 2, :BOW]
    height = surface @ sized.part(look.bow)[0]
    slope = surface[np.argmax(height)] - surface[np.argmin(height)]
    return float(np.ptp(height)), sized.sigma(look.bow, slope)


def _findings(
    look: Look, seen: SmoothResiduals, found: _Causes, data: PixelData
) -> Iterator[Finding]:
    if found.bowed:
        yield _bowed(look, seen)
    if found.strained:
        yield _strained(seen)
    if found.lens:
        yield _distorted(look, seen, data)
    if found.unclear:
        yield _unclear(seen)


def _bowed(look: Look, seen: SmoothResiduals) -> Finding:
    left = look.pixels(look.causes.plate)
    return Finding(
        "plate-bowed",
        "warning",
        f"the residuals within the images are smooth over the plate: it is bowed by about "
        f"{seen.bow / MM:.2f} mm (+- {seen.bow_sigma / MM:.2f}), which explains "
        f"{100 * seen.plate_share:.0f} % of the squares of the {seen.pixel:.3f} px and leaves "
        f"{left:.3f} px",
        "mount the target on something flat and stiff: glass, or an aluminium plate",
    )


def _strained(seen: SmoothResiduals) -> Finding:
    stretched = abs(seen.aspect) / max(seen.aspect_sigma, _TINY)
    sheared = abs(seen.shear) / max(seen.shear_sigma, _TINY)
    least = min(_SEEN, max(stretched, sheared))
    told, advice = [], []
    if stretched >= least:
        told.append(
            f"columns {100 * seen.aspect:+.2f} % (+- {100 * seen.aspect_sigma:.2f}) farther apart "
            "than rows"
        )
        advice.append("measure the pitch along both sides; print without scaling to the page")
    if sheared >= least:
        told.append(
            f"corners {seen.shear / MRAD:+.1f} mrad (+- {seen.shear_sigma / MRAD:.1f}) off a right "
            "angle"
        )
        advice.append("measure both diagonals; where they differ, use a target printed otherwise")
    return Finding(
        "plate-aspect",
        "warning",
        f"the plate is not printed in its declared proportions: {', '.join(told)}",
        "; ".join(advice),
    )


def _distorted(look: Look, seen: SmoothResiduals, data: PixelData) -> Finding:
    left = look.pixels(look.causes.image)
    return Finding(
        LENS,
        "warning",
        f"the residuals are smooth over the image, as with wrong intrinsics: a distortion of the "
        f"image explains {100 * seen.image_share:.0f} % of the squares of the {seen.pixel:.3f} px "
        f"and leaves {left:.3f} px; a bent plate would explain {100 * seen.plate_share:.0f} %",
        _better_lens(data.camera.model, calibrated=data.calibrated),
    )


def _better_lens(model: str, *, calibrated: bool) -> str:
    """Return the next step to a better lens, which is never one that has been taken."""
    if model == _RICHEST:
        return (
            f"no lens model has more coefficients than {model}: {_ELSEWHERE}; what remains then is "
            "the target's"
        )
    if calibrated:
        return (
            f"the lens model {model} is too simple for this lens: calibrate the camera by "
            f"another tool as {_RICHEST}, and give the result with --camera"
        )
    return CALIBRATE_AGAIN


def _unclear(seen: SmoothResiduals) -> Finding:
    return Finding(
        UNCLEAR,
        "warning",
        f"the residuals are smooth: the plate's shape, bowed by {seen.bow / MM:.2g} mm, explains "
        f"{100 * seen.plate_share:.0f} % of the squares of the {seen.pixel:.3f} px, a distortion "
        f"of the lens {100 * seen.image_share:.0f} %, and the views do not tell which it is",
        "record views tilted more and turned about the camera's axis, with the plate in all parts "
        f"of the image; or {_ELSEWHERE}",
    )

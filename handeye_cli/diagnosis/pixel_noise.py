"""Whether the images are noisier than the detector says."""

from __future__ import annotations

from handeye_cli.diagnosis.common_causes import SIGNIFICANCE
from handeye_cli.diagnosis.plate_shape import PlateShape
from handeye_cli.geometry.tail_probabilities import chi_square_tail
from handeye_cli.records import Finding

_MANY_TIMES = 2.0
"""Pixel noise up to this factor above what the detector says is within what detectors know."""


def unexplained_pixel_noise(shape: PlateShape, told: float | None) -> Finding | None:
    """Return a warning where the images are noisier than they should be, else None.

    Args:
        shape: What the residuals of the images say.
        told: RMS of the standard deviations that the detector gave, or the given pixel noise.
    """
    if told is None or not told > 0.0:
        return None
    left = shape.seen.pixel_left
    ratio = left / told
    chance = chi_square_tail(shape.freedom * ratio**2, shape.freedom)
    if ratio < _MANY_TIMES or chance > SIGNIFICANCE:
        return None
    return Finding(
        "pixel-noise-unexplained",
        "warning",
        f"the points lie {left:.3f} px from where poses, lens and plate put them, {ratio:.1f} "
        f"times the {told:.3f} px that the detector is sure of",
        "look at the residuals of single images: motion blur, a rolling shutter, reflections, or a "
        "print whose points are not where they are declared",
    )

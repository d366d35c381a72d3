"""Why no grid of discs was found, from what the search saw on its way."""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np

from handeye_cli.records import FloatArray, GreyImage
from handeye_cli.targets.disc_spots import BoolArray

_SMALLEST = 6.0
"""Width in pixels below which discs are lost."""
_SOFT = 8.0
"""Pixels that the sharpest edge takes in an image that is blurred."""
_EDGE = 1.0
"""Pixels from the image's edge within which a disc counts as cut."""
_FLAT = 15.0
"""Grey levels that an image without anything to see spans at most."""


@dataclass
class Attempts:
    """The best that was seen of a grid so far.

    Attributes:
        expected: Number of discs of the grid.
        name: Of the grid, such as `6x6`.
        spots: Largest number of spots like discs.
        width: Their median width, pixels.
        covered: Largest number of spots that lie where discs of the grid should be.
        sides: Sides of the image that cut this grid.
        absent: Discs of this grid that are missing inside the image.
        larger: Whether the grid fits several places of a larger one.
    """

    expected: int
    name: str
    spots: int = 0
    width: float = 0.0
    covered: int = 0
    sides: list[str] = field(default_factory=list)
    absent: int = 0
    larger: bool = False

    def saw(self, widths: FloatArray) -> None:
        """Note the widths of spots like discs."""
        if len(widths) > self.spots:
            self.spots, self.width = len(widths), float(np.median(widths))

    def fitted(self, covered: int, boxes: list[FloatArray], size: tuple[int, ...]) -> None:
        """Note how well the grid can be laid over a lattice of spots.

        Args:
            covered: Spots that are at places of the grid.
            boxes: (n, 2, 2) least and largest x and y of the grid's discs, pixels, for each way in
                which it covers so many.
            size: Height and width of the image.
        """
        self.larger |= covered == self.expected and len(boxes) > 1
        if covered <= self.covered:
            return
        outside = [_outside(each, size) for each in boxes]
        best = max(outside, key=lambda each: int(each.any(axis=1).sum()))
        names = np.array(["left", "top", "right", "bottom"])
        self.covered, self.sides = covered, names[best.any(axis=0)].tolist()
        self.absent = self.expected - covered - int(best.any(axis=1).sum())

    def reason(self, grey: GreyImage) -> str:
        """Return the most telling reason for an image without the grid."""
        if self.larger:
            return f"the discs go on beyond {self.name}: the declared grid fits several places"
        if self.sides and self.absent <= 0.1 * self.expected and self.covered >= 4:
            where = " and ".join(self.sides)
            found = f"{self.covered} of {self.expected} discs"
            return f"{found}: the plate leaves the image on the {where}"
        if self.spots >= self.expected:
            found = f"{self.spots} spots like discs were found, but no grid of {self.name} among"
            most = f": at most {self.covered} lie on one" if self.covered else ""
            return f"{found} them{most}"
        found = f"{max(self.covered, self.spots)} of {self.expected} discs were found"
        cause = self._cause(grey)
        return f"{found}: {cause}" if cause else found

    def _cause(self, grey: GreyImage) -> str | None:
        smooth = cv2.GaussianBlur(grey, (0, 0), 1.0)
        dark, light = np.percentile(smooth, [2, 98])
        if light - dark < _FLAT:
            return f"the image has nothing but grey levels from {dark:.0f} to {light:.0f}"
        slopes = [cv2.Sobel(smooth, cv2.CV_32F, *axis, scale=1 / 8) for axis in ((1, 0), (0, 1))]
        soft = float((light - dark) / max(float(np.hypot(*slopes).max()), 1e-3))
        if soft > _SOFT:
            return f"the image is blurred, its sharpest edge is {soft:.0f} px wide"
        if self.spots and self.width < _SMALLEST:
            return f"they are {self.width:.1f} px wide, at least {_SMALLEST:.0f} px are needed"
        return None


def _outside(boxes: FloatArray, size: tuple[int, ...]) -> BoolArray:
    """Return the (n, 4) sides, left, top, right and bottom, that boxes touch or lie beyond."""
    last = np.array(size[::-1]) - 1.0
    return np.hstack([boxes[:, 0] < _EDGE, boxes[:, 1] > last - _EDGE])
